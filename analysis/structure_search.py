"""Structure search: the vertices that are worth their cost.

Input: polytopes to start from (the configurations of block merging, thinned out) and a static hull.
Output: the polytope of the least price, refined on coarse colours. From each start vertices are
removed one by one, and after each removal all others move jointly to take over. The price is what
is minimised, eq. 12 with the terms for shape, plus `handle_cost` a vertex: a vertex stays only if
the value would rise by more without it. The paper's rule, a multiple of the loss before removal
(section 5.4.2), does not measure the use of a vertex. A clip that starts with a small loss keeps
handles that nobody sees, and others lose handles that they need.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.losses import shaped_weights, smoothness
from palette4d.analysis.objective import frame_losses, refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope

F64 = NDArray[np.float64]

# Evaluations of joint moves: at the start, after each removal, and before results are compared.
FIRST_EVALUATIONS, EVALUATIONS, COMPARE_EVALUATIONS = 50, 20, 40
# Above this many vertices a tenth of them is removed at once.
SINGLY = 40
# The search ends when the price is this far above the least price so far.
PATIENCE = 0.02
# Removal measures these evenly spaced frames, and those with the largest losses.
EVEN_FRAMES, WORST_FRAMES = 24, 8


@dataclasses.dataclass(frozen=True, eq=False)
class Start:
    """A polytope to start from, and the loss of each frame of the clip with it."""

    polytope: SkewPolytope
    losses: F64


@dataclasses.dataclass(frozen=True, eq=False)
class Priced:
    """A refined polytope, and its value: eq. 12 with the terms for shape, on some frames."""

    polytope: SkewPolytope
    value: float

    def price(self, options: AnalysisOptions) -> float:
        """Return the value plus the cost of the vertices."""
        return self.value + options.handle_cost * len(self.polytope.vertices)


def search(
    starts: Sequence[Start],
    static: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    progress: Callable[[int, int], object],
) -> tuple[int | None, SkewPolytope]:
    """Return which start the best polytope comes from (None: the static hull), and the polytope.

    The starts come in the order of their cost: the first results shorten the search of the others.
    """

    def compared(polytope: SkewPolytope) -> Priced:
        refined = refine_jointly(polytope, frames, gamut, options, COMPARE_EVALUATIONS, True)
        return Priced(*refined)

    bound, found = math.inf, list[Priced]()
    for at, start in enumerate(starts, start=1):
        some = [frames[i] for i in search_frames(start, frames)]
        best = choose(remove_singly(start.polytope, some, gamut, options, bound), options)
        bound = min(bound, best.price(options))
        found.append(compared(best.polytope))
        progress(at, len(starts))
    found.append(compared(static))
    chosen = choose(found, options)
    at = found.index(chosen)
    return (at if at < len(starts) else None), chosen.polytope


def search_frames(start: Start, frames: Sequence[FrameStatistics]) -> list[int]:
    """Return indices of frames that stand for all: evenly spaced, the worst, the blocks' ends."""
    count = len(frames)
    ends = {time for block in start.polytope.blocks for time in (block.first, block.last)}
    chosen = set(range(0, count, max(1, -(-count // EVEN_FRAMES))))
    chosen |= {i for i, frame in enumerate(frames) if frame.frame in ends}
    chosen |= set(np.argsort(-start.losses, kind="stable")[:WORST_FRAMES].tolist())
    return sorted(chosen)


def remove_singly(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    bound: float = math.inf,
) -> list[Priced]:
    """Return the polytope with fewer and fewer vertices, most vertices first.

    Ends when no vertex can go, or when the price is unlikely to fall below the best so far, or
    below `bound`, the price from another start. `frames` may be a choice of the clip's frames.
    """
    found = [Priced(*refine_jointly(polytope, frames, gamut, options, FIRST_EVALUATIONS, True))]
    fewest = len(polytope.vertices) - len(polytope.removable())
    while True:
        last = found[-1]
        count = len(last.polytope.vertices)
        best = min(one.price(options) for one in found)
        if options.vertices == 0 or count <= options.vertices:
            if last.price(options) > best + PATIENCE:
                break
            # Values rarely fall as vertices go.
            least = last.value + options.handle_cost * fewest
            if options.vertices == 0 and least > bound + PATIENCE:
                break
        cheapest = _cheapest(last.polytope, frames, gamut, options)
        if not cheapest:
            break
        rest = last.polytope
        for vertex in sorted(cheapest[: count // 10 if count > SINGLY else 1], reverse=True):
            rest = rest.without(vertex)
        found.append(Priced(*refine_jointly(rest, frames, gamut, options, EVALUATIONS, True)))
    return found


def choose(found: Sequence[Priced], options: AnalysisOptions) -> Priced:
    """Return the one of the least price; with `vertices`, the best of those with so few vertices,
    else the smallest."""
    if not options.vertices:
        return min(found, key=lambda one: one.price(options))
    few = [one for one in found if len(one.polytope.vertices) <= options.vertices]
    if few:
        return min(few, key=lambda one: one.value)
    return min(found, key=lambda one: len(one.polytope.vertices))


def _cheapest(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> list[int]:
    """Return removable vertices, the least needed first, no two of them neighbours in time."""
    times = np.array([frame.frame for frame in frames], float)
    length = polytope.length()
    before, after = polytope.neighbours()

    def losses(of: SkewPolytope, which: Sequence[int]) -> F64:
        weights = shaped_weights(options, gamut.scale)
        rows = frame_losses(of, frames, which, weights, options, coarse=True)
        total: F64 = options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2]
        return total

    now = losses(polytope, range(len(frames)))
    order = []
    for vertex in polytope.removable():
        rest = polytope.without(vertex)
        start, end = polytope.vertices[[before[vertex][0], after[vertex][0]], 3]
        which = np.flatnonzero((times > start) & (times < end)).tolist()
        rise = float((losses(rest, which) - now[which]).sum()) / len(frames) if which else 0.0
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
