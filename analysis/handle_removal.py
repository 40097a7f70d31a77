"""Stage 4 and 5 together: removing vertices while refining what is left.

Input: a `SkewPolytope`. Output: one for every smaller number of vertices, down to the fewest that
its structure allows, each refined. Section 5.4 removes vertices by the loss of what stays where it
is; here the others take over what a removed vertex did (all vertices move jointly after each
removal), and the smoothness of eq. 12 counts as well. Which of the results is taken is decided by
what a handle is worth (`Step.price`): a vertex stays only if, without it, the loss of eq. 12 would
rise by more than `handle_cost`. The paper's rule, a multiple of the loss before removal, says
nothing about the use of a vertex: on a clip that starts with a small loss it keeps handles that
nobody sees, and on others it removes those that the palette needs.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import colour_scale, shaped_weights, smoothness, thread_count
from palette4d.analysis.objective import loss_of, refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from palette4d.analysis.statistics import FrameStatistics

F64 = NDArray[np.float64]

FIRST_EVALUATIONS = 50
EVALUATIONS = 20  # after each removal
# Above this many vertices several go at once, a tenth of them.
SINGLY = 40
# How far above the best price so far the search still looks.
PATIENCE = 0.02


@dataclasses.dataclass(frozen=True, eq=False)
class Step:
    """A refined polytope and its value: eq. 12 and the shape terms, on the frames given."""

    polytope: SkewPolytope
    value: float

    def price(self, options: AnalysisOptions) -> float:
        """Return the value with every vertex paid for."""
        return self.value + options.handle_cost * len(self.polytope.vertices)


def simplify(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
    progress: Callable[[int, int], None] | None = None,
    bound: float = math.inf,
) -> list[Step]:
    """Return the polytope with fewer and fewer vertices, most vertices first.

    Ends where no vertex may go, or where the price can hardly fall any more below the best, or
    below `bound`, the price of another structure. `statistics` may be a choice of the clip's
    frames.
    """
    start, value = refine_jointly(polytope, statistics, low, high, options, FIRST_EVALUATIONS, True)
    steps = [Step(start, value)]
    most = len(start.vertices)
    scale = colour_scale(low, high)
    fewest = most - len(start.removable())
    while True:
        last = steps[-1].polytope
        count = len(last.vertices)
        best = min(step.price(options) for step in steps)
        wanted = options.vertices == 0 or count <= options.vertices
        if wanted and steps[-1].price(options) > best + PATIENCE:
            break
        least = steps[-1].value + options.handle_cost * fewest  # values hardly ever fall
        if options.vertices == 0 and least > bound + PATIENCE:
            break
        cheapest = _cheapest(last, statistics, options, scale)
        if not cheapest:
            break
        several = count // 10 if count > SINGLY else 1
        rest = last
        for vertex in sorted(cheapest[:several], reverse=True):
            rest = rest.without(vertex)
        rest, value = refine_jointly(rest, statistics, low, high, options, EVALUATIONS, True)
        steps.append(Step(rest, value))
        if progress:
            progress(most - len(rest.vertices), most)
    return steps


def choose(steps: Sequence[Step], options: AnalysisOptions) -> Step:
    """Return the step of the best price; with `vertices` given, the best of those with so few, or
    the smallest."""
    if not options.vertices:
        return min(steps, key=lambda step: step.price(options))
    few = [s for s in steps if len(s.polytope.vertices) <= options.vertices]
    if few:
        return min(few, key=lambda step: step.value)
    return min(steps, key=lambda step: len(step.polytope.vertices))


def _cheapest(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    options: AnalysisOptions,
    scale: float,
) -> list[int]:
    """Return removable vertices, no two of them neighbours in time, the least needed first."""
    weights = shaped_weights(options, scale)
    threads = thread_count(options)
    frames = np.array([s.frame for s in statistics], float)
    length = polytope.length()
    before, after = polytope.neighbours()

    def frame_losses(of: SkewPolytope, which: list[int]) -> F64:
        rows, _ = loss_of(of, statistics, coarse=True).evaluate(
            of.vertices, which, weights, threads, False
        )
        losses: F64 = options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2]
        return losses

    now = frame_losses(polytope, list(range(len(frames))))
    order = []
    for vertex in polytope.removable():
        rest = polytope.without(vertex)
        start, end = polytope.vertices[[before[vertex][0], after[vertex][0]], 3]
        which = [int(i) for i in np.flatnonzero((frames > start) & (frames < end))]
        rise = float((frame_losses(rest, which) - now[which]).sum()) / len(frames) if which else 0.0
        k, _ = smoothness(rest.vertices, rest.edges(), length)
        order.append((rise + options.gamma * k, vertex))
    chosen: list[int] = []
    busy: set[int] = set()
    for _, vertex in sorted(order):
        near = {vertex, *before[vertex], *after[vertex]}
        if not busy & near:
            busy |= near
            chosen.append(vertex)
    return chosen
