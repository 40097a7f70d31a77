"""Whether files of an earlier render can stay: whole, and not older than the sidecar."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from palette4d.common.errors import Palette4dError
from palette4d.common.files import date
from palette4d.media import oiio_text
from palette4d.media.clip import open_clip
from palette4d.media.exr_around import has_every_block


def is_older(path: Path, sidecar: Path | None) -> bool:
    """Whether a file was written before the sidecar was saved, or put there.

    A copy or another name may bring an earlier time of saving with it.
    """
    if sidecar is None or not sidecar.is_file():
        return False
    about = sidecar.stat()
    return path.stat().st_mtime < max(about.st_mtime, about.st_ctime)


class Dated:
    """Gives files the time of the sidecar that they are of, once that was saved meanwhile.

    So they are older than the sidecar that is there. Make one before the sidecar is read.
    """

    def __init__(self, sidecar: str | os.PathLike[str] | None) -> None:
        self._sidecar = sidecar
        self._before = self._times()

    def __call__(self, path: Path) -> None:
        """Look after a file that was just written."""
        if self._before is not None and self._before != self._times():
            date(path, self._before[0])

    def _times(self) -> tuple[int, int] | None:
        if self._sidecar is None:
            return None
        try:
            about = Path(self._sidecar).stat()
        except OSError:
            return 0, 0
        return about.st_mtime_ns, about.st_ctime_ns


def is_whole_frame(path: Path, size: tuple[int, int]) -> bool:
    """Whether a file is an image of (width, height) whose last row can be read."""
    import OpenImageIO as oiio

    if not path.is_file() or not path.stat().st_size:
        return False
    source = oiio.ImageInput.open(oiio_text.file_name(path))
    if source is None:
        oiio_text.problem_of(oiio)
        return False
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
        return has_every_block(path)
    return whole


def is_whole_movie(path: Path, frames: Sequence[int]) -> bool:
    """Whether a file is a movie of as many frames."""
    if not path.is_file():
        return False
    try:
        return len(open_clip(str(path)).frames) == len(frames)
    except (Palette4dError, OSError):
        return False


def again(damaged: int, older: int) -> list[str]:
    """Return a note on the files of an earlier render that are rendered again."""
    counts = [(damaged, "damaged"), (older, "older than the sidecar")]
    counted = [f"{count} {word}" for count, word in counts if count]
    return [f"files rendered again: {', '.join(counted)}"] if counted else []
