"""Eq. 12 as a function of the vertices of a polytope, and joint moves of vertices that lower it.

Vertex refinement (section 5.5), the structure search and the static hull share this module. It
knows the boxes of the vertices and the frames that a vertex affects. It minimises with the core's
exact gradient.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.losses import (
    STEP,
    Losses,
    descend,
    loss_weights,
    minimise,
    shaped_weights,
    smoothness,
    summarise,
    thread_count,
)
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope

from palette4d import _core

F64 = NDArray[np.float64]

# Least gap between two vertices of a track, in frames: a steeper change would be a cut.
LEAST_GAP = 0.5
# Weight in eq. 11 of the edges of a brief colour (see `Objective`).
BRIEF = 0.25
# A joint step evaluates every PARTS-th frame, or more, so that it has at least PARTS frames. With 4
# the search is 10 % faster and its prices are 0.3 % higher (docs/lab/search.md).
PARTS = 3


@dataclasses.dataclass(frozen=True, eq=False)
class Priced:
    """A refined polytope, and its value: eq. 12 with the terms for shape, on some frames."""

    polytope: SkewPolytope
    value: float

    @property
    def handles(self) -> int:
        """The number of vertices."""
        return len(self.polytope.vertices)

    def price(self, cost: float) -> float:
        """Return the value plus the cost of the vertices."""
        return self.value + cost * self.handles


def loss_of(
    polytope: SkewPolytope, frames: Sequence[FrameStatistics], coarse: bool = False
) -> _core.PolytopeLoss:
    """Prepare a polytope's structure for evaluation on the fine or coarse colours of frames."""
    blocks = [
        (b.first, b.last, tracks, b.faces)
        for b, tracks in zip(polytope.blocks, polytope.extended_tracks(), strict=True)
    ]
    times = np.array([f.frame for f in frames], float)
    return _core.PolytopeLoss(blocks, times, [f.coarse if coarse else f.colours for f in frames])


def frame_losses(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    which: Sequence[int],
    weights: _core.LossWeights,
    options: AnalysisOptions,
    coarse: bool,
) -> F64:
    """Return (n, 5) R, C, shape, share outside and farthest pixel of the frames (indices)."""
    rows: F64
    rows, _ = loss_of(polytope, frames, coarse).evaluate(
        polytope.vertices, list(which), weights, thread_count(options), False
    )
    return rows


def losses_of(
    polytope: SkewPolytope, frames: Sequence[FrameStatistics], options: AnalysisOptions
) -> Losses:
    """Measure a polytope on all colours of all frames, by the paper's losses alone."""
    all_frames = range(len(frames))
    rows = frame_losses(polytope, frames, all_frames, loss_weights(options), options, coarse=False)
    k, _ = smoothness(polytope.vertices, polytope.edges(), polytope.length())
    return summarise(rows, k, options)


def refine_jointly(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    steps: int,
    coarse: bool,
    brief: Collection[int] = (),
    longest: float = STEP,
) -> tuple[SkewPolytope, float]:
    """Move all vertices together in their boxes; return the polytope and the value of `Objective`.

    Each step evaluates every n-th frame, from another first one each time. The value never exceeds
    that of the given polytope, clipped to the gamut. Vertices in `brief` (see `Objective`) keep
    their times: the mean over all frames would shorten such a colour.
    """
    evaluate = Objective(polytope, frames, options, gamut, coarse, brief)
    evaluate.fixed[list(brief)] = True
    start = polytope.vertices.copy()
    start[:, :3] = gamut.clip(start[:, :3])
    box = evaluate.box(start, range(len(start)), share=0.5)
    parts = max(1, min(PARTS, len(frames) // PARTS))

    def slope(x: F64, step: int) -> F64:
        part = evaluate.all_frames[step % parts :: parts]
        _, gradient = evaluate(x * evaluate.scale, part, for_all=True)
        scaled: F64 = gradient * evaluate.scale
        return scaled

    low, high = (bound / evaluate.scale for bound in box)
    moved = descend(slope, start / evaluate.scale, low, high, steps, longest) * evaluate.scale
    vertices = evaluate.with_fixed_times(np.clip(moved, *box), start)
    value, _ = evaluate(vertices, evaluate.all_frames, False)
    if steps and value >= evaluate(start, evaluate.all_frames, False)[0]:
        # The optimum is near, or at a kink, and the steps overshoot it.
        vertices = move_all(evaluate, start, max(1, steps // parts))
        value, _ = evaluate(vertices, evaluate.all_frames, False)
    return polytope.with_vertices(vertices), value


def move_all(evaluate: Objective, vertices: F64, most_evaluations: int) -> F64:
    """Return the vertices after a joint move of all of them."""
    moving = np.arange(len(vertices))
    # Each neighbour in time gets half the gap between them, so that both may move at once.
    box = evaluate.box(vertices, moving, share=0.5)
    return move(evaluate, vertices, moving, evaluate.all_frames, box, most_evaluations)


def move(
    evaluate: Objective,
    vertices: F64,
    moving: NDArray[np.int64],
    which: list[int],
    box: tuple[F64, F64],
    most_evaluations: int,
) -> F64:
    """Return the vertices, those in `moving` at their optimum in the box.

    NLopt minimises to a relative tolerance: the paper's refinement.
    """

    def objective(x: F64) -> tuple[float, F64]:
        trial = vertices.copy()
        trial[moving] = x.reshape(-1, 4) * evaluate.scale
        value, gradient = evaluate(trial, which)
        return value, (gradient[moving] * evaluate.scale).ravel()

    start = (vertices[moving] / evaluate.scale).ravel()
    lower, upper = ((bound / evaluate.scale).ravel() for bound in box)
    best = minimise(objective, start, lower, upper, most_evaluations, tolerance=1e-5)
    out = vertices.copy()
    # Scaling rounds; the clip keeps a vertex at the edge of its box inside its block.
    out[moving] = np.clip(best.reshape(-1, 4) * evaluate.scale, *box)
    return evaluate.with_fixed_times(out, vertices)


class Objective:
    """Eq. 12 over a choice of frames, plus the terms for convexity, separation and reach.

    Vertices in `brief` belong to a colour that exists for a short time. It may appear and vanish
    quickly: the edges of these vertices have the weight `BRIEF` in eq. 11.
    """

    def __init__(
        self,
        polytope: SkewPolytope,
        frames: Sequence[FrameStatistics],
        options: AnalysisOptions,
        gamut: Gamut,
        coarse: bool,
        brief: Collection[int] = (),
    ) -> None:
        self.gamut, self.options = gamut, options
        self.weights = shaped_weights(options, gamut.scale)
        self.loss = loss_of(polytope, frames, coarse)
        self.threads = thread_count(options)
        self.all_frames = list(range(len(frames)))
        self.times = np.array([frame.frame for frame in frames], float)
        self.edges = polytope.edges()
        self.quick = np.where(np.isin(self.edges, list(brief)).any(axis=1), BRIEF, 1.0)
        self.length = polytope.length()
        self.fixed = polytope.fixed_times()
        # As in the paper, times are divided by the clip's length: all four axes have one scale.
        self.scale = np.array([1.0, 1.0, 1.0, self.length])
        self.before, self.after = polytope.neighbours()
        self.block = np.zeros((len(polytope.vertices), 2))
        for b in polytope.blocks:
            inside = (polytope.vertices[:, 3] >= b.first) & (polytope.vertices[:, 3] <= b.last)
            self.block[inside] = b.first, b.last

    def __call__(
        self, vertices: F64, which: list[int], with_gradient: bool = True, for_all: bool = False
    ) -> tuple[float, F64]:
        """Return the sum over `which` of L / N + gamma K (+ shape), and its gradient on request.

        N counts all frames; with `for_all` the frames in `which`, as a sample of all frames.
        """
        o = self.options
        rows, gradient = self.loss.evaluate(
            vertices, which, self.weights, self.threads, with_gradient
        )
        sums = rows.sum(axis=0)
        count = len(which if for_all else self.all_frames)
        value = (o.lambda_ * sums[0] + sums[1] + sums[2]) / count
        gradient = gradient / count if with_gradient else np.zeros_like(vertices)
        if o.gamma and len(self.all_frames) > 1:
            k, slope = smoothness(vertices, self.edges, self.length, self.quick)
            value += o.gamma * k
            gradient += o.gamma * slope
        return float(value), gradient

    def with_fixed_times(self, moved: F64, vertices: F64) -> F64:
        """Return moved vertices with the times of `vertices` where these may not change."""
        out = moved.copy()
        out[self.fixed, 3] = vertices[self.fixed, 3]
        return out

    def touched(self, vertices: F64, moving: Sequence[int]) -> list[int]:
        """Return the frames whose slices the vertices in `moving` affect, wherever they move."""
        near = [n for v in moving for n in (*self.before[v], *self.after[v], v)]
        times = vertices[near, 3]
        inside = (self.times >= times.min()) & (self.times <= times.max())
        return [int(i) for i in np.flatnonzero(inside)]

    def box(
        self, vertices: F64, moving: Sequence[int] | NDArray[np.int64], share: float
    ) -> tuple[F64, F64]:
        """Return the lower and upper (n, 4) bounds of section 5.5.

        A vertex may move by `share` of the gap to its neighbours in time, inside its block.
        """
        lower, upper = vertices[list(moving)].copy(), vertices[list(moving)].copy()
        half_width = self.options.refinement_box * self.gamut.scale
        lower[:, :3], upper[:, :3] = self.gamut.around(lower[:, :3], half_width)
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
