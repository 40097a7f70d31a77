"""The start timecode that a camera writes into a clip's files.

Movies state it for the file, for the video stream or in a separate stream. DPX and OpenEXR state it
in each frame (SMPTE ST 268, `smpte:TimeCode`).
"""

from __future__ import annotations

import re

from palette4d.common.errors import Palette4dError
from palette4d.media.clip_base import Clip

_TIMECODE = re.compile(r"([0-9]{2}:[0-9]{2}:[0-9]{2}[:;.][0-9]{2,3})")


def start_timecode(clip: Clip) -> str | None:
    """Return the timecode of a clip's first frame, `HH:MM:SS:FF`; None if the files have none."""
    try:
        return _of_movie(clip) if clip.is_movie else _of_image(clip)
    except (Palette4dError, OSError):
        return None


def _of_movie(clip: Clip) -> str | None:
    import av

    from palette4d.media.clip_movie import ONLY_FILES

    with av.open(f"file:{clip.file(0)}", options=ONLY_FILES) as container:
        stated = [container.metadata, *(stream.metadata for stream in container.streams)]
        for metadata in stated:
            found = _TIMECODE.search(metadata.get("timecode", ""))
            if found:
                return found[0]
    return None


def _of_image(clip: Clip) -> str | None:
    for name, _, value in clip.load(clip.frames[0]).metadata:
        if name == "smpte:TimeCode":
            return _decoded(int(value[0]))
    return None


def _decoded(word: int) -> str:
    """Return the text of SMPTE ST 12's 32 bits: two decimal digits per byte, and flags.

    >>> _decoded(0x10215203), _decoded(0x00000043)
    ('10:21:52:03', '00:00:00;03')
    """
    hours, minutes, seconds, frames = (word >> 24, word >> 16, word >> 8, word)
    drop = ";" if frames & 0x40 else ":"

    def digits(byte: int, tens: int) -> str:
        return f"{(byte >> 4) & tens}{byte & 15}"

    return f"{digits(hours, 3)}:{digits(minutes, 7)}:{digits(seconds, 7)}{drop}{digits(frames, 3)}"
