"""Structure search: the handles that are worth their cost.

Input: polytopes to start from (the configurations of block merging, thinned out), and static hulls.
Output: the polytope of the least price, refined on coarse colours. The price is what is minimised,
eq. 12 with the terms for shape, plus `handle_cost` a vertex, plus `RARE_COST` a rare one.

Static hulls are refined. From each other start a walk goes down from rich to poor. Each step takes
away the vertex whose loss costs least, and all others move jointly to take over. Then the walk goes
back to its best palette, takes a whole colour away (`moves`), and goes down again, until no poorer
palette can be the best. Stops are put into the best palette of each start, and single vertices
removed again.
`handle_cost`, `vertices` and `blocks` choose among the palettes found. A dearer handle and fewer
vertices also lengthen the walks. So a dearer handle hardly ever means more handles, and more of
what is allowed hardly ever anything worse (docs/lab/search.md).

The paper's rule, a multiple of the loss before removal (section 5.4.2), does not measure the use of
a vertex.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis import moves
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.handle_use import rare_handles
from palette4d.analysis.losses import loss_weights, shaped_weights, smoothness, thread_count
from palette4d.analysis.objective import Priced, frame_losses, loss_of, refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope

F64 = NDArray[np.float64]

# Gradient steps of joint moves: at the start of a walk, and after each removal.
FIRST_STEPS, STEPS = 20, 15
# The palettes of a walk are compared at this cost, whatever `handle_cost` is.
USUAL = AnalysisOptions()
USUAL_COST = USUAL.handle_cost
# Prices this share above the least are hopeless: walks end, and no more blocks are tried.
PATIENCE = 0.08
# With a dearer handle or fewer vertices walks end only at so many times the cost.
DEARER = 4
# At the end palettes are refined in rounds, on more frames than before and on all frames in the
# last one: the steps of a round, and how far above the least price a palette may be to take part.
# So many with the same numbers of handles and colours do.
ROUNDS, OF_A_KIND = ((0, 0.5), (5, 0.05), (30, 0.02)), 2
# Prices that differ by this share count as the same: the last refinement changes them by as much.
ALIKE = 0.005
# Stops are put into the best palette again if the last ones lowered its price by this share.
WORTHWHILE = 0.01
# A rare handle costs so much more, whatever `handle_cost` is.
RARE_COST = USUAL_COST
# So many evenly spaced frames are looked at, by merging and by walks, and so many others with the
# largest losses.
KEY_FRAMES, EVEN_FRAMES, WORST_FRAMES = 48, 16, 8
# Frames in which palettes without one of their colours are compared.
CHAIN_FRAMES = 8


def search(
    starts: Iterable[SkewPolytope],
    static: SkewPolytope,
    rungs: Sequence[SkewPolytope],
    few: Sequence[FrameStatistics],
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> tuple[int | None, SkewPolytope]:
    """Return which start the best polytope comes from (None: a static hull), and the polytope.

    The starts come in the order of their blocks. Those with more blocks than one that is far worse
    than the best are not searched. `rungs` are static hulls; `static` is the best of them.
    """
    usual = few if len(few) <= EVEN_FRAMES else key_frames(static, few, options, EVEN_FRAMES)
    found = [
        Priced(*refine_jointly(rung, usual, gamut, options, FIRST_STEPS, True)) for rung in rungs
    ]
    ways: list[tuple[int | None, Sequence[FrameStatistics], list[Priced]]] = [(None, usual, found)]

    def known() -> list[Priced]:
        return [one for *_, way in ways for one in way]

    least = math.inf
    for at, start in enumerate(starts):
        ends = {time for b in start.blocks for time in (b.first, b.last)}
        ends |= {frame.frame for frame in usual}
        some = [frame for frame in frames if frame.frame in ends]
        steps = walk(start, some, gamut, options, known())
        ways.append((at, some, steps))
        price = min(map(_usual_price, steps))
        if price > (1 + PATIENCE) * least:
            break
        least = min(least, price)
    for _, seen, way in ways:
        way += up_and_down(min(way, key=_usual_price), seen, gamut, options, known())
    everything = [(one, at) for at, _, way in ways for one in way]
    return best_of(everything, few, frames, gamut, options)


def _usual_price(one: Priced) -> float:
    return one.price(USUAL_COST)


def best_of(
    found: Sequence[tuple[Priced, int | None]],
    few: Sequence[FrameStatistics],
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> tuple[int | None, SkewPolytope]:
    """Return the best of all that was found, measured on all frames, and its start.

    The first rounds look at a `few` frames, more than the walks. Of palettes of nearly the same
    price it is one with the fewest handles, and of these the one whose terms for shape are least.
    """
    everything = [one for one, _ in found]
    cost = options.handle_cost
    close = [(p, at) for p, at in found if allowed(p, everything, options)]
    for (steps, share), seen in zip(ROUNDS, (few, few, frames), strict=True):
        close = [
            (Priced(*refine_jointly(p.polytope, seen, gamut, options, steps, True)), at)
            for p, at in _close(close, cost, share)
        ]
    close.sort(key=lambda found: found[0].price(cost))
    # Rare handles are counted only where they decide: counting is slow.
    whole = functools.cache(lambda one: one.price(cost) + rare_cost(one.polytope, frames))
    least = math.inf
    for one, _ in close:
        if one.price(cost) < least:
            least = min(least, whole(one))

    def plainness(one: Priced) -> tuple[int, float]:
        weights = shaped_weights(options, gamut.scale)
        everywhere = range(len(frames))
        rows = frame_losses(one.polytope, frames, everywhere, weights, options, coarse=True)
        return one.handles, float(rows[:, 2].mean())

    alike = [found for found in close if found[0].price(cost) <= (1 + ALIKE) * least]
    alike.sort(key=lambda found: plainness(found[0]))
    chosen, at = next(found for found in alike if whole(found[0]) <= (1 + ALIKE) * least)
    return at, chosen.polytope


def _close(
    found: Sequence[tuple[Priced, int | None]], cost: float, share: float
) -> list[tuple[Priced, int | None]]:
    """Return the palettes near the least price, few of each number of handles and colours."""
    bound = (1 + share) * min(one.price(cost) for one, _ in found)
    best: dict[tuple[int, ...], list[tuple[Priced, int | None]]] = {}
    for one, at in sorted(found, key=lambda found: found[0].price(cost)):
        kind = (one.handles, *(len(block.tracks) for block in one.polytope.blocks))
        if one.price(cost) <= bound:
            best.setdefault(kind, []).append((one, at))
    return [found for kind in best.values() for found in kind[:OF_A_KIND]]


def rare_cost(polytope: SkewPolytope, frames: Sequence[FrameStatistics]) -> float:
    """Return what the rare handles of a palette cost more than others."""
    return RARE_COST * rare_handles(polytope, frames)


def key_frames(
    static: SkewPolytope,
    frames: Sequence[FrameStatistics],
    options: AnalysisOptions,
    even: int,
) -> list[FrameStatistics]:
    """Return frames that stand for all: evenly spaced, and those that one palette fits worst.

    The frames before and after these count too: otherwise a palette that fits a flash might change
    long before it.
    """
    chosen = {*range(0, len(frames), -(-len(frames) // even)), len(frames) - 1}
    most = len(chosen) + WORST_FRAMES
    everything = range(len(frames))
    rows = frame_losses(static, frames, everything, loss_weights(options), options, coarse=True)
    loss = options.lambda_ * rows[:, 0] + rows[:, 1]
    for worst in np.argsort(-loss, kind="stable").tolist():
        if len(chosen) >= most:
            break
        chosen |= {worst - 1, worst, worst + 1} & set(everything)
    return [frames[i] for i in sorted(chosen)]


def walk(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    known: Sequence[Priced],
) -> list[Priced]:
    """Return the palettes on the way down from a polytope, all its colours first.

    Ends when no colour can go, or when poorer palettes cannot be the best of these and of those
    `known`. `frames` may be a choice of the clip's frames.
    """
    found: list[Priced] = []
    first = Priced(*refine_jointly(polytope, frames, gamut, options, FIRST_STEPS, True))
    while True:
        steps = remove_singly(first, frames, gamut, options, [*known, *found])
        found += steps
        best = min(steps, key=lambda one: one.price(USUAL_COST))
        chain = _dispensable(best.polytope, frames, gamut, options)
        if chain is None:
            return found
        poorer = moves.without_chain(best.polytope, chain)
        first = Priced(*refine_jointly(poorer, frames, gamut, options, STEPS, True))
        if hopeless(first, found, [*known, *found], options):
            return [*found, first]


def up_and_down(
    best: Priced,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    known: Sequence[Priced],
) -> list[Priced]:
    """Return what is found when stops are put into a palette and single vertices removed again.

    Stops are put into the middle of each edge. Goes on with the best of what is found as long as
    that is worthwhile.
    """
    found: list[Priced] = []
    while True:
        rich = moves.enriched(best.polytope)
        first = Priced(*refine_jointly(rich, frames, gamut, options, FIRST_STEPS, True))
        steps = remove_singly(first, frames, gamut, options, [*known, *found])
        found += steps
        before, best = best, min(best, *steps, key=_usual_price)
        if _usual_price(best) > (1 - WORTHWHILE) * _usual_price(before):
            return found


def remove_singly(
    first: Priced,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    known: Sequence[Priced] = (),
) -> list[Priced]:
    """Return a palette with fewer and fewer vertices, most vertices first.

    Ends when no vertex can go, or when poorer palettes cannot be the best.
    """
    found = [first]
    while not hopeless(found[-1], found, [*known, *found], options):
        last = found[-1]
        cheapest = _cheapest(last.polytope, frames, gamut, options)
        if not cheapest:
            break
        rest = last.polytope
        for vertex in sorted(cheapest[: max(1, len(cheapest) // 3)], reverse=True):
            rest = rest.without(vertex)
        found.append(Priced(*refine_jointly(rest, frames, gamut, options, STEPS, True)))
    return found


def hopeless(
    one: Priced, found: Iterable[Priced], known: Iterable[Priced], options: AnalysisOptions
) -> bool:
    """Return whether palettes with fewer vertices are unlikely to be the best.

    They are when prices have risen far since the best one `found` on this walk, or when the value
    alone, which rises as vertices go, is too much beside what is `known`: at the usual cost of a
    handle and, for other options, at theirs too, so that these look no less far. For dearer handles
    and fewer vertices it counts `DEARER` times, so that a walk gets over a few bad palettes.
    """
    fewest = min(2 * min(len(block.tracks) for block in one.polytope.blocks), one.handles)

    def at(cost: float, most: AnalysisOptions) -> bool:
        def least(of: Iterable[Priced]) -> float:
            return min((x.price(cost) for x in of if allowed(x, (), most)), default=math.inf)

        risen = one.price(cost) > (1 + PATIENCE) * least(found)
        return risen or one.value + cost * fewest > least(known)

    cost = options.handle_cost
    dear = DEARER * cost if cost > USUAL_COST or options.vertices else cost
    return at(USUAL_COST, USUAL) and at(cost, options) and at(dear, USUAL)


def allowed(one: Priced, found: Sequence[Priced], options: AnalysisOptions) -> bool:
    """Return whether a palette has at most `vertices`, or is the smallest there is."""
    most = options.vertices or math.inf
    return one.handles <= max(most, min((x.handles for x in found), default=0))


def _dispensable(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> tuple[int, ...] | None:
    """Return the chain whose loss costs least before the others take over, if any may go."""
    weights = shaped_weights(options, gamut.scale, faces=False)
    few = range(0, len(frames), -(-len(frames) // CHAIN_FRAMES))

    def loss(chain: tuple[int, ...]) -> float:
        rest = moves.without_chain(polytope, chain, any_mesh=True)
        rows = frame_losses(rest, frames, few, weights, options, coarse=True)
        return float((options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2]).sum())

    return min(moves.chains(polytope), key=loss, default=None)


def _cheapest(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> list[int]:
    """Return removable vertices, the least needed first, no two of them neighbours in time."""
    times = np.array([frame.frame for frame in frames], float)
    vertices, edges, length = polytope.vertices, polytope.edges(), polytope.length()
    before, after = polytope.neighbours()
    loss = loss_of(polytope, frames, coarse=True)
    weights = shaped_weights(options, gamut.scale)

    def losses(of: F64, which: Sequence[int]) -> F64:
        rows, _ = loss.evaluate(of, which, weights, thread_count(options), False)
        total: F64 = options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2]
        return total

    now = losses(vertices, range(len(frames)))
    order = []
    for vertex in polytope.removable():
        (early,), (late,) = before[vertex], after[vertex]
        start, end = vertices[early], vertices[late]
        rest = vertices.copy()  # with the vertex on the edge between its neighbours
        rest[vertex] = start + (rest[vertex, 3] - start[3]) / (end[3] - start[3]) * (end - start)
        which = np.flatnonzero((times > start[3]) & (times < end[3])).tolist()
        rise = float((losses(rest, which) - now[which]).sum()) / len(frames) if which else 0.0
        others = edges[(edges != vertex).all(axis=1)]
        k, _ = smoothness(rest, np.vstack([others, np.array([[early, late]], np.int32)]), length)
        order.append((rise + options.gamma * k, vertex))
    chosen: list[int] = []
    busy: set[int] = set()
    for _, vertex in sorted(order):
        near = {vertex, *before[vertex], *after[vertex]}
        if not busy & near:
            busy |= near
            chosen.append(vertex)
    return chosen
