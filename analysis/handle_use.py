"""Handle use: the mean weight (eq. 7) of each handle, its share of the picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_statistics import FrameStatistics
from palette4d.analysis.polytope import SkewPolytope, Slice

from palette4d import _core

F64 = NDArray[np.float64]

# Number of evenly spaced frames that are measured. All frames would take longer than the rest of
# the analysis.
USE_FRAMES = 12
# A handle is rare if its mean weight is below this threshold in every frame.
RARE = 0.02


def rare_handles(polytope: SkewPolytope, frames: Sequence[FrameStatistics]) -> int:
    """Return the number of rare vertices: below `RARE` of the picture in every frame."""

    def slice_of(index: int) -> Slice:
        return polytope.slice_at(float(frames[index].frame))

    return int((handle_use(polytope.vertices, slice_of, frames, RARE) < RARE).sum())


def handle_use(
    vertices: F64,
    slice_of: Callable[[int], _core.Slice | Slice],
    frames: Sequence[FrameStatistics],
    enough: float = np.inf,
) -> F64:
    """Return the largest mean weight of each vertex in any frame.

    `slice_of` returns the slice at a frame index. A frame is skipped if all its vertices have
    reached the weight `enough`.
    """
    use = np.zeros(len(vertices))
    times = np.array([f.frame for f in frames], float)
    # A vertex weighs most at its own time.
    nearest = [int(np.argmin(np.abs(times - t))) for t in vertices[:, 3]]
    even = np.linspace(0, len(frames) - 1, min(len(frames), USE_FRAMES)).round().astype(int)
    for index in dict.fromkeys([*nearest, *even.tolist()]):
        cut, colours = slice_of(index), frames[index].coarse
        if (use[cut.ends] >= enough).all():
            continue
        if len(cut.faces) == 0:  # a line or a point needs every colour
            use[cut.ends] = 1.0
            continue
        weights, _ = _core.palette_weights(colours.rgb, cut.rgb, cut.faces)
        mean = colours.counts @ weights / colours.total
        weight = np.zeros(len(use))
        np.add.at(weight, cut.ends[:, 0], mean * (1 - cut.weights))
        np.add.at(weight, cut.ends[:, 1], mean * cut.weights)
        np.maximum(use, weight, out=use)
    return use
