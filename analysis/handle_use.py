"""How much of the picture each handle is: its mean weight (eq. 7)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_statistics import FrameStatistics
from palette4d.analysis.polytope import SkewPolytope, Slice

from palette4d import _core

F64 = NDArray[np.float64]

# The use of handles is measured on this many evenly spaced frames: on all frames it would take
# longer than the rest of the analysis.
USE_FRAMES = 12
# A handle is rare whose mean weight is smaller in every frame.
RARE = 0.02


def rare_handles(polytope: SkewPolytope, frames: Sequence[FrameStatistics]) -> int:
    """Return how many vertices are nowhere `RARE` of the picture."""

    def slice_of(at: int) -> Slice:
        return polytope.slice_at(float(frames[at].frame))

    return int((handle_use(polytope.vertices, slice_of, frames, RARE) < RARE).sum())


def handle_use(
    vertices: F64,
    slice_of: Callable[[int], _core.Slice | Slice],
    frames: Sequence[FrameStatistics],
    enough: float = np.inf,
) -> F64:
    """Return the largest mean weight of each vertex in any frame.

    `slice_of` returns the slice of a frame (index). A frame is left out if all its vertices have
    `enough`.
    """
    use = np.zeros(len(vertices))
    times = np.array([f.frame for f in frames], float)
    # A vertex weighs most at its own time.
    nearest = [int(np.argmin(np.abs(times - t))) for t in vertices[:, 3]]
    even = np.linspace(0, len(frames) - 1, min(len(frames), USE_FRAMES)).round().astype(int)
    for at in dict.fromkeys([*nearest, *even.tolist()]):
        here, colours = slice_of(at), frames[at].coarse
        if (use[here.ends] >= enough).all():
            continue
        if len(here.faces) == 0:  # a line or a point needs every colour
            use[here.ends] = 1.0
            continue
        weights, _ = _core.palette_weights(colours.rgb, here.rgb, here.faces)
        mean = colours.counts @ weights / colours.total
        weight = np.zeros(len(use))
        np.add.at(weight, here.ends[:, 0], mean * (1 - here.weights))
        np.add.at(weight, here.ends[:, 1], mean * here.weights)
        np.maximum(use, weight, out=use)
    return use
