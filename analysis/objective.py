"""Eq. 12 as a function of a polytope's vertices, and moving all of them together to lower it.

What vertex refinement (5.5) and the removal that refines as it goes share: the boxes that vertices
may move in, the frames that a vertex touches, and NLopt with the core's exact gradient.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import (
    colour_scale,
    minimise,
    shaped_weights,
    smoothness,
    thread_count,
)
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from palette4d.analysis.statistics import FrameStatistics

from palette4d import _core

F64 = NDArray[np.float64]

# Two vertices of a track stay this many frames apart: a steeper change is a cut, not a palette.
LEAST_GAP = 0.5
# What a change to and from a colour that is there for a moment weighs in eq. 11.
BRIEF = 0.25


def loss_of(
    polytope: SkewPolytope, statistics: Sequence[FrameStatistics], coarse: bool = False
) -> _core.PolytopeLoss:
    """Prepare the polytope's structure for evaluation on all frames' fine or coarse colours."""
    blocks = [
        (b.first, b.last, tracks, b.faces)
        for b, tracks in zip(polytope.blocks, polytope.extended_tracks(), strict=True)
    ]
    frames = np.array([s.frame for s in statistics], float)
    return _core.PolytopeLoss(
        blocks, frames, [s.coarse if coarse else s.colours for s in statistics]
    )


def refine_jointly(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
    most_evaluations: int,
    coarse: bool,
    brief: Collection[int] = (),
) -> tuple[SkewPolytope, float]:
    """Move all vertices together in their boxes; return the polytope and what was minimised.

    That is eq. 12, and what keeps slices convex and colours apart. It is never above that of the
    polytope given, clipped to the gamut. `brief` as in `Objective`; these stay where they are in
    time: else the mean, to which a moment hardly matters, would shorten it.
    """
    scale = colour_scale(low, high)
    evaluate = Objective(polytope, statistics, options, scale, coarse, brief)
    vertices = polytope.vertices.copy()
    vertices[:, :3] = np.clip(vertices[:, :3], low, high)
    everything = list(range(len(statistics)))
    evaluate.fixed[list(brief)] = True
    moving = np.arange(len(vertices))
    # Neighbours in time share the gap between them, so that both may move at once.
    box = evaluate.box(vertices, moving, low, high, share=0.5)
    vertices = move(evaluate, vertices, moving, everything, box, most_evaluations)
    return polytope.with_vertices(vertices), evaluate(vertices, everything)[0]


def move(
    evaluate: Objective,
    vertices: F64,
    moving: NDArray[np.int64],
    which: list[int],
    box: tuple[F64, F64],
    most_evaluations: int,
) -> F64:
    """Return the vertices with those of `moving` at their best place in the box."""

    def objective(x: F64) -> tuple[float, F64]:
        trial = vertices.copy()
        trial[moving] = x.reshape(-1, 4) * evaluate.scale
        value, gradient = evaluate(trial, which)
        return value, (gradient[moving] * evaluate.scale).ravel()

    start = (vertices[moving] / evaluate.scale).ravel()
    lower, upper = ((bound / evaluate.scale).ravel() for bound in box)
    best = minimise(objective, start, lower, upper, most_evaluations, tolerance=1e-5)
    out = vertices.copy()
    # Scaling there and back rounds: a vertex at the edge of its box must not leave its block.
    out[moving] = np.clip(best.reshape(-1, 4) * evaluate.scale, *box)
    fixed = evaluate.fixed[moving]
    out[moving[fixed], 3] = vertices[moving[fixed], 3]
    return out


class Objective:
    """Eq. 12, and what keeps slices convex and colours apart, over a choice of frames.

    `brief` are vertices that are there for a moment: their colours may come and go quickly, so
    that in eq. 11 the edges that end at them count `BRIEF` times only.
    """

    def __init__(
        self,
        polytope: SkewPolytope,
        statistics: Sequence[FrameStatistics],
        options: AnalysisOptions,
        scale_of_colours: float,
        coarse: bool,
        brief: Collection[int] = (),
    ) -> None:
        self.colour_box = options.refinement_box * scale_of_colours
        self.weights = shaped_weights(options, scale_of_colours)
        self.loss = loss_of(polytope, statistics, coarse)
        self.options = options
        self.threads = thread_count(options)
        self.count = len(statistics)
        self.frames = np.array([s.frame for s in statistics], float)
        self.edges = polytope.edges()
        self.quick = np.where(np.isin(self.edges, list(brief)).any(axis=1), BRIEF, 1.0)
        self.length = polytope.length()
        self.fixed = polytope.fixed_times()
        # Times are divided by the clip's length, as in the paper, so that all four axes are alike.
        self.scale = np.array([1.0, 1.0, 1.0, self.length])
        n = len(polytope.vertices)
        self.before, self.after = polytope.neighbours()
        self.block = np.zeros((n, 2))
        for b in polytope.blocks:
            inside = (polytope.vertices[:, 3] >= b.first) & (polytope.vertices[:, 3] <= b.last)
            self.block[inside] = b.first, b.last

    def __call__(self, vertices: F64, which: list[int]) -> tuple[float, F64]:
        """Return sum over `which` of L / N + gamma K (+ shape), and the gradient."""
        o = self.options
        rows, gradient = self.loss.evaluate(vertices, which, self.weights, self.threads, True)
        sums = rows.sum(axis=0)
        value = (o.lambda_ * sums[0] + sums[1] + sums[2]) / self.count
        gradient = gradient / self.count
        if o.gamma and self.count > 1:
            k, slope = smoothness(vertices, self.edges, self.length, self.quick)
            value += o.gamma * k
            gradient += o.gamma * slope
        return float(value), gradient

    def touched(self, vertices: F64, moving: list[int]) -> list[int]:
        """Frames whose slices depend on the vertices in `moving`, wherever their boxes let them
        go."""
        near = [n for v in moving for n in (*self.before[v], *self.after[v], v)]
        times = vertices[near, 3]
        inside = (self.frames >= times.min()) & (self.frames <= times.max())
        return [int(i) for i in np.flatnonzero(inside)]

    def box(
        self,
        vertices: F64,
        moving: Sequence[int] | NDArray[np.int64],
        low: F64,
        high: F64,
        share: float,
    ) -> tuple[F64, F64]:
        """Return the lower and upper (n, 4) bounds of section 5.5."""
        lower, upper = vertices[list(moving)].copy(), vertices[list(moving)].copy()
        lower[:, :3] = np.maximum(lower[:, :3] - self.colour_box, low)
        upper[:, :3] = np.minimum(upper[:, :3] + self.colour_box, high)
        for row, v in enumerate(moving):
            if self.fixed[v]:
                continue
            now = vertices[v, 3]
            early = max(vertices[u, 3] for u in self.before[v])
            late = min(vertices[w, 3] for w in self.after[v])
            room = share * max(now - early - LEAST_GAP, 0), share * max(late - now - LEAST_GAP, 0)
            lower[row, 3] = max(now - room[0], min(self.block[v, 0], now))
            upper[row, 3] = min(now + room[1], max(self.block[v, 1], now))
        return lower, upper
