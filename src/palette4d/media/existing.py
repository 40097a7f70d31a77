"""What files of an earlier render are: whole, damaged, or of another grade."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

from palette4d.common.errors import Palette4dError
from palette4d.media import oiio_text
from palette4d.media.clip import open_clip
from palette4d.media.exr_around import has_every_block

#: What `grade.rendering.made_by` returns.
_MADE_BY = re.compile(r"palette4d \S+, grade [0-9a-f]{16}(, .*)?")
State = Literal["whole", "damaged", "of another grade"]


def frame(path: Path, size: tuple[int, int], is_wanted: Callable[[str], bool]) -> State:
    """Look at a file that should be an image of (width, height), down to its last row.

    `is_wanted` says whether a text that names a grade is that of the render. A file that names
    none, such as a frame that was retouched, stays.
    """
    import OpenImageIO as oiio

    if not path.is_file() or not path.stat().st_size:
        return "damaged"
    source = oiio.ImageInput.open(oiio_text.file_name(path))
    if source is None:
        oiio_text.problem_of(oiio)
        return "damaged"
    spec = source.spec()
    if path.suffix.lower() in (".tif", ".tiff"):  # rows may stand in any order
        read = source.read_image(0, 0, 0, spec.nchannels, spec.format)
    else:
        last = spec.y + spec.height - 1
        read = source.read_scanlines(0, 0, last, last + 1, 0, 0, spec.nchannels, spec.format)
    whole = read is not None and not oiio_text.problem_of(source)
    whole = whole and (spec.full_width, spec.full_height) == size
    rows = not spec.tile_width
    source.close()
    if whole and rows and path.suffix.lower() == ".exr":
        whole = has_every_block(path)
    return _state(whole, spec.get_string_attribute("Software"), is_wanted)


def movie(path: Path, frames: Sequence[int], is_wanted: Callable[[str], bool]) -> State:
    """Look at a file that should be a movie of as many frames, as `frame` does."""
    try:
        clip = open_clip(str(path))
        clip.read(clip.frames[-1])  # a file that was cut is still said to have all frames
    except (Palette4dError, OSError):
        return "damaged"
    return _state(len(clip.frames) == len(frames), clip.stated.made_by, is_wanted)


def _state(whole: bool, text: str, is_wanted: Callable[[str], bool]) -> State:
    if not whole:
        return "damaged"
    stays = not _MADE_BY.fullmatch(text) or is_wanted(text)
    return "whole" if stays else "of another grade"


def again(states: Sequence[State]) -> list[str]:
    """Return a note on the files of an earlier render that are rendered again."""
    kinds: tuple[State, ...] = ("damaged", "of another grade")
    counted = [f"{states.count(kind)} {kind}" for kind in kinds if kind in states]
    return [f"files rendered again: {', '.join(counted)}"] if counted else []
