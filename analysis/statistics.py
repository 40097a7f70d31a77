"""Colour statistics of a frame: what the analysis keeps of its pixels.

Input: an (h, w, 3 or 4) float32 image. Output: weighted colours in a k-d tree, of bounded size, so
that memory does not grow with resolution. Pixels that are not finite or have alpha 0 do not count.
The losses of section 3 measured on a frame with no more distinct 8-bit colours than `colours` are
exact.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray
from palette4d import _core
from palette4d.analysis.options import AnalysisOptions

FINEST_STEP = 1 / 255  # 8-bit colours stay apart; finer differences do not matter to a palette


MOST_STEPS = 2**19  # bins from 0 to the largest colour, what the core's bin numbers hold


@dataclasses.dataclass(frozen=True)
class FrameStatistics:
    """One frame's colours.

    Attributes
    ----------
    frame : the frame number.
    colours : the colours the losses are measured on.
    coarse : fewer, wider bins, for the stages that only compare alternatives.
    low, high : (3,) float64 the colours' bounding box.
    pixels, ignored : how many pixels count, and how many do not.
    """

    frame: int
    colours: _core.ColourTree
    coarse: _core.ColourTree
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    pixels: int
    ignored: int


def gather(
    frame: int, image: NDArray[np.float32], options: AnalysisOptions
) -> FrameStatistics | None:
    """Return the statistics of an (h, w, 3 or 4) image, or None when no pixel counts."""
    step = max(FINEST_STEP, _largest(image) / MOST_STEPS)
    rgb, counts, step, ignored = _core.bin_colours(image, step, options.colours)
    if len(rgb) == 0:
        return None
    fine = _core.ColourTree(rgb, counts)
    coarse = fine
    if len(rgb) > options.coarse_colours:
        rgb, counts, _ = _core.coarsen_colours(rgb, counts, step, options.coarse_colours)
        coarse = _core.ColourTree(rgb, counts)
    points = fine.rgb
    return FrameStatistics(
        frame, fine, coarse, points.min(axis=0), points.max(axis=0), round(fine.total), ignored
    )


def _largest(image: NDArray[np.float32]) -> float:
    """Return the largest finite magnitude among an image's colours."""
    colours = np.abs(image[..., :3])
    return float(np.max(colours, initial=0.0, where=np.isfinite(colours)))


def gamut_box(
    statistics: list[FrameStatistics],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where palette colours may lie: the unit cube (section 3), grown to hold colours outside
    it."""
    low = np.minimum(0.0, np.min([s.low for s in statistics], axis=0))
    high = np.maximum(1.0, np.max([s.high for s in statistics], axis=0))
    return low, high
