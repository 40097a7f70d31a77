"""The timecode with which a clip's files say that they begin, as a camera writes it.

Movies state one for the file, for its picture or in a stream of its own; DPX and OpenEXR in each
frame (SMPTE ST 268, `smpte:TimeCode`).
"""

from __future__ import annotations

import re

from palette4d.analysis.clip_base import Clip
from palette4d.errors import Palette4dError

_TIMECODE = re.compile(r"([0-9]{2}:[0-9]{2}:[0-9]{2}[:;.][0-9]{2,3})")


def start_timecode(clip: Clip) -> str | None:
    """Return the timecode of a clip's first frame, `HH:MM:SS:FF`; None when the files say none."""
    try:
        return _of_movie(clip) if clip.is_movie else _of_image(clip)
    except (Palette4dError, OSError):
        return None


def _of_movie(clip: Clip) -> str | None:
    import av

    with av.open(f"file:{clip.file(0)}") as container:
        stated = [container.metadata, *(stream.metadata for stream in container.streams)]
        for metadata in stated:
            found = _TIMECODE.search(metadata.get("timecode", ""))
            if found:
                return found[0]
    return None


def _of_image(clip: Clip) -> str | None:
    for name, _, value in clip.load(clip.frames[0]).metadata:
        if name == "smpte:TimeCode":
            found = _TIMECODE.search(str(value))
            return found[0] if found else None
    return None
