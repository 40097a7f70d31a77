"""The clip of a sidecar: given by the user, or found at the path in the sidecar."""

import os
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.common.errors import Palette4dError
from palette4d.common.files import names_a_server
from palette4d.media.clip import Clip, open_clip
from palette4d.media.clip_base import describe
from palette4d.media.reading import like_source


def candidates(sidecar_path: Path, source: str) -> list[str]:
    """Return possible paths of a source: absolute, beside the sidecar, in the working folder.

    None on a server that only the sidecar names.
    """
    if not source or names_a_server(source, sidecar_path):
        return []
    if Path(source).is_absolute():
        return [source]
    beside = str(sidecar_path.absolute().parent / source)
    here = str(Path.cwd() / source)
    return [beside] if beside == here else [beside, here]


def find_clip(sidecar_path: Path, clip: Mapping[str, Any], given: str | None) -> Clip | None:
    """Open the clip of a sidecar; None if none was given and the sidecar's clip is missing.

    A relative source is looked up in the sidecar's folder, then in the working folder. `clip` is
    `Sidecar.clip`. A `given` clip is used instead and must open.
    """
    if given is not None:
        name = like_source(os.fspath(given), str(clip["source"]))
        return open_clip(name, skip_bad_frames=True)
    for spec in candidates(sidecar_path, str(clip["source"])):
        try:
            # Callers need only a few frames: missing frames elsewhere do not matter.
            return open_clip(spec, skip_bad_frames=True)
        except (Palette4dError, OSError):
            continue
    return None


def nearest_frame(clip: Clip, frame: float) -> int:
    """Return the clip's frame number nearest to `frame`; the earlier of two."""
    return nearest(clip.frames, frame)


def nearest(frames: Sequence[int], frame: float) -> int:
    """Return the number nearest to `frame` among rising ones; the earlier of two."""
    at = bisect_left(frames, frame)
    return min(frames[max(0, at - 1) : at + 1], key=lambda number: (abs(number - frame), number))


def frame_colours(
    sidecar_path: Path, clip: Mapping[str, Any], frame: float, given: str | None
) -> tuple[NDArray[np.float32] | None, int | None]:
    """Read the colours of the clip's frame nearest to a time, and that frame's number.

    The colours are (h, w, 3) float32, straight (`Clip.straight_colours`): NaN where alpha is 0.
    None, None if no clip was given and the sidecar's clip cannot be found or read. A single picture
    may be given for any time; several frames must have the numbers of the sidecar's.
    """
    opened = find_clip(sidecar_path, clip, given)
    if opened is None:
        return None, None
    number = nearest_frame(opened, frame)
    first, last = clip["first"], clip["last"]
    if given is not None and len(opened.frames) > 1 and not first <= number <= last:
        raise Palette4dError(
            f"{given}: found the frames {describe(opened.frames)}, expected those of the palette, "
            f"{first} to {last}; other frames have other colours"
        )
    try:
        return opened.straight_colours(opened.read(number)), number
    except (Palette4dError, OSError):
        if given is not None:
            raise
        return None, None
