"""Vertex removal, section 5.4: vertices that their neighbours in time predict become ghosts.

Input and output: a `DensePolytope`, changed in place. Removal is greedy by the overall loss (eq. 8,
theta = 1). `thin_out` removes the vertices that cost little, many at a time; `structure_search`
then removes vertices one by one. The paper's own rule is in `baselines.paper_thresholds`.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.dense_polytope import DensePolytope
from palette4d.analysis.frame_statistics import FrameStatistics
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions

F64 = NDArray[np.float64]

# Tolerance of L in a frame: 1/200 of an 8-bit step at lambda 50. Without it, rounding would keep
# the vertices of clips whose loss is zero.
NEGLIGIBLE = 1e-3
# Threshold of `thin_out`, as a multiple of the first loss; the structure search goes on from there.
THINNED = 1.6
# RGB tolerance for straight paths: a colour's distance from the line between two vertices.
STRAIGHT = 0.08


class RemovalTrials:
    """The loss of each frame, and its loss without a vertex, cached while nothing changes."""

    def __init__(
        self, dense: DensePolytope, frames: Sequence[FrameStatistics], options: AnalysisOptions
    ) -> None:
        self.dense, self.frames, self.options = dense, frames, options
        self.losses = np.array([self._loss(i, rgb) for i, rgb in enumerate(dense.position)])
        self._version = [0] * len(self.losses)  # counts the changes of each frame's palette
        self._tried: dict[int, tuple[tuple[int, ...], dict[int, float]]] = {}

    def _loss(self, frame: int, rgb: F64) -> float:
        return palette_loss(self.frames[frame].coarse, rgb, self.options)

    def _without(self, vertex: int) -> dict[int, float]:
        """Return the losses of the frames that the removal of `vertex` affects, by frame index."""
        moved = self.dense.ghosts(vertex)
        state = tuple(self._version[i] for i, _, _ in moved)
        cached = self._tried.get(vertex)
        if cached is not None and cached[0] == state:
            return cached[1]
        new = {}
        for i, s, rgb in moved:
            palette = self.dense.position[i].copy()
            palette[s] = rgb
            new[i] = self._loss(i, palette)
        self._tried[vertex] = state, new
        return new

    def change(self, vertex: int) -> float:
        """Return the rise of the sum of the losses when `vertex` is removed."""
        return sum(new - float(self.losses[i]) for i, new in self._without(vertex).items())

    def remove(self, vertex: int) -> None:
        """Remove `vertex`."""
        for i, new in self._without(vertex).items():
            self.losses[i] = new
            self._version[i] += 1
        self.dense.remove(vertex)


def thin_out(
    dense: DensePolytope, frames: Sequence[FrameStatistics], options: AnalysisOptions
) -> F64:
    """Remove vertices until the loss is `THINNED` times its first value; return it for each frame.

    The first to go are vertices on straight paths. Then each round tries all vertices and removes
    the cheapest, a quarter of them at most, no two of them neighbours in time.
    """
    first = RemovalTrials(dense, frames, options).losses
    threshold = THINNED * float(first.sum()) + NEGLIGIBLE * len(first)
    _straighten(dense)
    trials = RemovalTrials(dense, frames, options)
    pool = [v for v in range(len(dense.place)) if dense.removable(v)]
    while pool:
        total = float(trials.losses.sum())
        room = max(1, len(pool) // 4)
        busy: set[int] = set()
        for change, vertex in sorted((trials.change(v), v) for v in pool):
            if total + change > threshold or room == 0:
                break
            near = {vertex, *dense.before[vertex], *dense.after[vertex]}
            if busy & near or not dense.removable(vertex):
                continue
            busy |= near
            room -= 1
            # A removal on another track of the same frame may have changed the cost.
            total = float(trials.losses.sum()) + trials.change(vertex)
            if total > threshold:
                break
            trials.remove(vertex)
        if not busy:
            break
        pool = [v for v in pool if dense.removable(v)]
    return trials.losses


def _straighten(dense: DensePolytope) -> None:
    """Remove vertices, the straightest path first, while ghosts stay near their first colours."""
    original = [rgb.copy() for rgb in dense.position]

    def bend(vertex: int) -> float:
        return max(
            float(np.linalg.norm(rgb - original[i][s])) for i, s, rgb in dense.ghosts(vertex)
        )

    queue = [(bend(v), v) for v in range(len(dense.place)) if dense.removable(v)]
    heapq.heapify(queue)
    while queue:
        cached, vertex = heapq.heappop(queue)
        if cached > STRAIGHT:
            break
        if not dense.removable(vertex):
            continue
        now = bend(vertex)  # it grows as neighbours go
        if now > cached:
            heapq.heappush(queue, (now, vertex))
            continue
        dense.remove(vertex)
