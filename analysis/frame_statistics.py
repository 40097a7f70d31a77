"""The input of all stages: the colours of each frame, and the gamut that they span."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from palette4d import _core

F64 = NDArray[np.float64]

# One 8-bit step of code values: smaller differences are invisible.
CODE_STEP = 1 / 255


@dataclasses.dataclass(frozen=True)
class FrameStatistics:
    """The colours of one frame.

    Attributes
    ----------
    frame : the frame number.
    colours : the colours for the losses.
    coarse : fewer colours, for stages that only compare alternatives.
    histogram : `media.colour_histogram` of the frame, for the detection of cuts.
    low, high : (3,) float64 the bounding box of the colours.
    pixels, ignored : how many pixels count, and how many are ignored.
    """

    frame: int
    colours: _core.ColourTree
    coarse: _core.ColourTree
    histogram: F64
    low: F64
    high: F64
    pixels: int
    ignored: int


@dataclasses.dataclass(frozen=True)
class Gamut:
    """The box (3,) `low` to `high` in which palette colours may lie."""

    low: F64
    high: F64

    @classmethod
    def of(cls, frames: Sequence[FrameStatistics]) -> Gamut:
        """Return the unit cube (section 3), extended to the colours outside it."""
        low = np.minimum(0.0, np.min([frame.low for frame in frames], axis=0))
        high = np.maximum(1.0, np.max([frame.high for frame in frames], axis=0))
        return cls(low, high)

    @property
    def scale(self) -> float:
        """The longest side, 1 for the unit cube: distances in options scale with it."""
        return max(1.0, float(np.max(self.high - self.low)))

    def clip(self, rgb: F64) -> F64:
        """Move (n, 3) colours into the box."""
        inside: F64 = np.clip(rgb, self.low, self.high)
        return inside

    def around(self, rgb: F64, half_width: float) -> tuple[F64, F64]:
        """Return lower and upper (n, 3) bounds of a move by `half_width`, inside the gamut."""
        return np.maximum(rgb - half_width, self.low), np.minimum(rgb + half_width, self.high)


def pooled(trees: Sequence[_core.ColourTree], most: int) -> _core.ColourTree:
    """Return the colours of several trees as one tree of at most `most` colours."""
    binner = _core.ColourBinner()
    for tree in trees:
        binner.add_colours(tree.rgb, tree.counts)
    taken = binner.take(most, most)
    assert taken is not None  # each tree needs at least one colour
    return taken[0]
