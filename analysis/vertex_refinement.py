"""Stage 5, section 5.5: refining the vertices in RGB and time.

Input and output: a `SkewPolytope`; its structure stays. Each vertex in turn moves in the 4D box of
section 5.5 to lower the refinement loss (eq. 12), by NLopt with the core's exact gradient, only
the frames that it touches being evaluated again; after each cycle over the vertices all move
together once. Vertices of the first and last frame and splitting and merging vertices keep their
time; the others stay inside their block, between their neighbours in time. The loss never grows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d import _core
from palette4d.analysis.losses import (
    colour_scale,
    convexity_weight,
    minimise,
    smoothness,
    thread_count,
)
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from palette4d.analysis.statistics import FrameStatistics

F64 = NDArray[np.float64]

LOCAL_EVALUATIONS = 40
JOINT_EVALUATIONS = 150
# Two vertices of a track stay this many frames apart: a steeper change is a cut, not a palette.
LEAST_GAP = 0.5


def loss_of(
    polytope: SkewPolytope, statistics: Sequence[FrameStatistics], coarse: bool = False
) -> _core.PolytopeLoss:
    """Prepare the polytope's structure for evaluation on all frames' fine or coarse colours."""
    blocks = [(b.first, b.last, polytope.extended_tracks(b), b.faces) for b in polytope.blocks]
    frames = np.array([s.frame for s in statistics], float)
    return _core.PolytopeLoss(
        blocks, frames, [s.coarse if coarse else s.colours for s in statistics]
    )


def refine(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
    progress: Callable[[int, int], None] | None = None,
) -> SkewPolytope:
    """Return the polytope with its vertices refined."""
    scale = colour_scale(low, high)
    fine = _Objective(polytope, statistics, options, scale, coarse=False)
    coarse = _Objective(polytope, statistics, options, scale, coarse=True)
    start = polytope.vertices.copy()
    start[:, :3] = np.clip(start[:, :3], low, high)
    vertices = start
    everything = list(range(len(statistics)))
    steps = options.refinement_cycles * (len(vertices) + 1)
    done = 0
    for cycle in range(options.refinement_cycles):
        # The way is found on coarse colours, three times as fast; the last cycle uses all.
        evaluate = fine if cycle == options.refinement_cycles - 1 else coarse
        for v in range(len(vertices)):
            which = evaluate.touched(vertices, [v])
            box = evaluate.box(vertices, [v], low, high, share=1.0)
            vertices = _move(evaluate, vertices, np.array([v]), which, box, LOCAL_EVALUATIONS)
            done += 1
            if progress:
                progress(done, steps)
        # Neighbours in time share the gap between them, so that both may move at once.
        box = evaluate.box(vertices, range(len(vertices)), low, high, share=0.5)
        moving = np.arange(len(vertices))
        vertices = _move(evaluate, vertices, moving, everything, box, JOINT_EVALUATIONS)
        done += 1
        if progress:
            progress(done, steps)
    if fine(vertices, everything)[0] > fine(start, everything)[0]:
        vertices = start
    return polytope.with_vertices(vertices)


def _move(
    evaluate: _Objective,
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


class _Objective:
    """Eq. 12 as a function of the vertices, over a choice of frames."""

    def __init__(
        self,
        polytope: SkewPolytope,
        statistics: Sequence[FrameStatistics],
        options: AnalysisOptions,
        scale_of_colours: float,
        coarse: bool,
    ) -> None:
        self.colour_box = options.refinement_box * scale_of_colours
        self.convexity = convexity_weight(options, scale_of_colours)
        self.loss = loss_of(polytope, statistics, coarse)
        self.options = options
        self.threads = thread_count(options)
        self.count = len(statistics)
        self.frames = np.array([s.frame for s in statistics], float)
        self.edges = polytope.edges()
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
        """Return sum over `which` of L / N + gamma K (+ the convexity term), and the gradient."""
        o = self.options
        rows, gradient = self.loss.evaluate(
            vertices, which, o.lambda_, o.k, self.convexity, self.threads, True
        )
        sums = rows.sum(axis=0)
        value = (o.lambda_ * sums[0] + sums[1] + self.convexity * sums[2]) / self.count
        gradient = gradient / self.count
        if o.gamma and self.count > 1:
            k, slope = smoothness(vertices, self.edges, self.length)
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
        moving: Sequence[int],
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
