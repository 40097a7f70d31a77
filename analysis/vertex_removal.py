"""Stage 4, section 5.4: removing vertices that the others predict.

Input and output: `Strands`, whose vertices become ghosts. `remove_vertices` is the paper's rule:
greedy by the overall loss (eq. 8, theta = 1), among the candidates closest to their ghosts, until
it exceeds eta2 times its first value. `thin` takes many vertices at a time while it costs little:
what comes before the removal that refines as it goes (`handle_removal`).
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.statistics import FrameStatistics
from palette4d.analysis.strands import Strands

F64 = NDArray[np.float64]

# A loss per frame that nobody sees (1/200 of an 8-bit step off, at lambda 50); without it, rounding
# would keep vertices of clips whose loss is zero.
NEGLIGIBLE = 1e-3
# Where `thin` stops: well before the losses say which vertices matter.
THINNED = 1.6
# What counts as a straight path of a colour: so near to the line between two vertices.
STRAIGHT = 0.08


class _Trials:
    """Each frame's loss, and what it would be without a vertex, remembered while nothing moves."""

    def __init__(
        self, strands: Strands, statistics: Sequence[FrameStatistics], options: AnalysisOptions
    ) -> None:
        self.strands, self.statistics, self.options = strands, statistics, options
        self.losses = np.array([self.loss(i, rgb) for i, rgb in enumerate(strands.position)])
        self.version = [0] * len(self.losses)  # counts the changes of each frame's palette
        self.tried: dict[int, tuple[tuple[int, ...], dict[int, float]]] = {}

    def loss(self, frame: int, rgb: F64) -> float:
        return palette_loss(self.statistics[frame].coarse, rgb, self.options)

    def without(self, vertex: int) -> dict[int, float]:
        """Losses of the frames that removing `vertex` touches, by frame index."""
        moved = self.strands.ghosts(vertex)
        state = tuple(self.version[i] for i, _, _ in moved)
        known = self.tried.get(vertex)
        if known is not None and known[0] == state and len(known[1]) == len(moved):
            return known[1]
        new = {}
        for i, s, rgb in moved:
            palette = self.strands.position[i].copy()
            palette[s] = rgb
            new[i] = self.loss(i, palette)
        self.tried[vertex] = state, new
        return new

    def change(self, vertex: int) -> float:
        """By how much removing `vertex` raises the sum of the losses."""
        return sum(new - float(self.losses[i]) for i, new in self.without(vertex).items())

    def remove(self, vertex: int) -> None:
        for i, new in self.without(vertex).items():
            self.losses[i] = new
            self.version[i] += 1
        self.strands.remove(vertex)


def remove_vertices(
    strands: Strands,
    statistics: Sequence[FrameStatistics],
    options: AnalysisOptions,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Remove vertices from `strands` (section 5.4.2), in place."""
    trials = _Trials(strands, statistics, options)
    total = float(trials.losses.sum())
    threshold = options.eta2 * total + NEGLIGIBLE * len(trials.losses)
    pool = [v for v in range(len(strands.at)) if strands.removable(v)]
    start, removed = len(pool), 0
    distance: dict[int, tuple[tuple[int, int], float]] = {}

    def ghost_distance(vertex: int) -> float:
        """Distance to the ghost's position, which has the same time."""
        ends = strands.before[vertex][0], strands.after[vertex][0]
        known = distance.get(vertex)
        if known is None or known[0] != ends:
            place = next(rgb for i, _, rgb in strands.ghosts(vertex) if i == strands.at[vertex][0])
            gap = float(np.linalg.norm(place - strands.colour(vertex)))
            distance[vertex] = known = ends, gap
        return known[1]

    while True:
        pool = [v for v in pool if strands.removable(v)]
        if not pool:
            break
        nearest = sorted(pool, key=lambda v: (ghost_distance(v), v))[: options.removal_candidates]
        change, vertex = min((trials.change(v), v) for v in nearest)
        if total + change > threshold:
            break
        trials.remove(vertex)
        total = float(trials.losses.sum())
        removed += 1
        if progress:
            progress(removed, start)


def thin(
    strands: Strands, statistics: Sequence[FrameStatistics], options: AnalysisOptions
) -> NDArray[np.float64]:
    """Remove vertices many at a time, in place, until the loss is THINNED times its first value.

    First those whose colours lie where the others predict them. Then each round tries every vertex
    and removes the cheapest, a quarter of them at most, no two of them neighbours in time. Returns
    each frame's loss.
    """
    first = _Trials(strands, statistics, options).losses
    threshold = THINNED * float(first.sum()) + NEGLIGIBLE * len(first)
    _straighten(strands, STRAIGHT)
    trials = _Trials(strands, statistics, options)
    pool = [v for v in range(len(strands.at)) if strands.removable(v)]
    while pool:
        total = float(trials.losses.sum())
        room = max(1, len(pool) // 4)
        busy: set[int] = set()
        for change, vertex in sorted((trials.change(v), v) for v in pool):
            if total + change > threshold or room == 0:
                break
            near = {vertex, *strands.before[vertex], *strands.after[vertex]}
            if busy & near or not strands.removable(vertex):
                continue
            busy |= near
            room -= 1
            # Two tracks of one frame may change in one round: what that costs together is seen
            # here, as the second is tried again.
            total = float(trials.losses.sum()) + trials.change(vertex)
            if total > threshold:
                break
            trials.remove(vertex)
        if not busy:
            break
        pool = [v for v in pool if strands.removable(v)]
    return trials.losses


def _straighten(strands: Strands, tolerance: float) -> None:
    """Remove vertices, the straightest first, while every ghost stays within `tolerance` of the
    colour that it stands for."""
    original = [rgb.copy() for rgb in strands.position]

    def bend(vertex: int) -> float:
        return max(
            float(np.linalg.norm(rgb - original[i][s])) for i, s, rgb in strands.ghosts(vertex)
        )

    pool = [v for v in range(len(strands.at)) if strands.removable(v)]
    queue = [(bend(v), v) for v in pool]
    heapq.heapify(queue)
    while queue:
        known, vertex = heapq.heappop(queue)
        if known > tolerance:
            break
        if not strands.removable(vertex):
            continue
        now = bend(vertex)  # may have grown since it was queued
        if now > known:
            heapq.heappush(queue, (now, vertex))
            continue
        strands.remove(vertex)
