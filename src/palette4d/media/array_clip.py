"""Frames in memory as a clip, for notebooks and other programs without files."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.media.clip_base import DEFAULT_RATE, Clip, ClipError, Fill, Image


class ArrayClip(Clip):
    """An array (frames, height, width, 3) of code values as a clip.

    Parameters
    ----------
    frames : float, 0 to 1 for the range of a display; other values are allowed.
    first, step : the number of the first frame, and the distance between frame numbers.
    rate : frames a second.
    name : for people, and for the sidecar.

    Raises
    ------
    ClipError
        When the array has another shape, no frames or no pixels, or holds integers.

    >>> ArrayClip(np.zeros((5, 9, 16, 3)), first=1001).frames
    [1001, 1002, 1003, 1004, 1005]
    """

    def __init__(
        self,
        frames: NDArray[np.floating[Any]],
        first: int = 0,
        step: int = 1,
        rate: Fraction = DEFAULT_RATE,
        name: str = "array",
    ) -> None:
        images = np.asarray(frames)
        if images.ndim != 4 or images.shape[3] != 3 or images.size == 0:
            raise ClipError(
                f"an array of frames: found the shape {images.shape}, expected "
                "(frames, height, width, 3)"
            )
        if not np.issubdtype(images.dtype, np.floating):
            raise ClipError(
                f"an array of frames: found {images.dtype}, expected floats, 0 to 1 for the range "
                "of a display; divide 8-bit code values by 255"
            )
        super().__init__(
            name=name,
            source=name,
            frames=[first + step * i for i in range(len(images))],
            rate=rate,
            width=images.shape[2],
            height=images.shape[1],
            encoding="unknown",
            has_alpha=False,
            premultiplied=False,
            depth="array",
        )
        self._images = images

    def load(self, frame: int) -> Image:
        """Return one frame."""
        pixels = self._images[self.frames.index(frame)]
        return Image(frame, np.ascontiguousarray(pixels, dtype=np.float32))

    def file(self, frame: int) -> Path:
        """Return the name of the clip: no file holds a frame."""
        return Path(self.name)

    def fills(self, frames: Sequence[int]) -> Iterator[tuple[int, Fill]]:
        """Yield for each frame its number and the function that bins it."""
        for frame in frames:
            yield frame, functools.partial(self._fill, frame)

    def _fill(self, frame: int, binner: _core.ColourBinner) -> bool:
        binner.add(self.load(frame).pixels[self.row_step // 2 :: self.row_step])
        return False
