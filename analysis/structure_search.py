"""Structure search: the handles that are worth their cost.

Input: polytopes to start from (the configurations of block merging, thinned out), and static hulls.
Output: the polytope of the least price, refined on coarse colours. The price is the value of
`Objective` (eq. 12 with the terms for shape), plus `handle_cost` for each vertex, plus `RARE_COST`
for each rare one.

Static hulls are only refined. From every other start a walk removes vertices. Each step removes the
vertices whose removal raises the loss least, and refines the others jointly. When the price has
risen too far, the walk returns to its best palette, removes a whole colour (`moves`), and removes
single vertices again. At last, stops are inserted into each walk's best palette, and single
vertices are removed once more.

`handle_cost`, `vertices` and `blocks` select from the palettes of all walks. A higher cost and
fewer vertices only make the walks longer. So a higher `handle_cost` rarely gives more handles, and
relaxing a limit rarely gives a worse palette (docs/lab/search.md).

The paper stops at a multiple of the loss before removal (section 5.4.2), which does not measure the
use of a vertex.
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
from palette4d.analysis.objective import PARTS, Priced, frame_losses, loss_of, refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope

F64 = NDArray[np.float64]
Candidate = tuple[Priced, int | None]
"""A palette, and the index of its start; None for a static hull."""

# Gradient steps of joint moves: at the start of a walk, and after each removal.
FIRST_STEPS, STEPS = 20, 15
# Walks compare palettes at the default cost of a handle, whatever `handle_cost` is.
USUAL = AnalysisOptions()
USUAL_COST = USUAL.handle_cost
# Relative tolerance of prices on a walk: it ends, and no more blocks are tried, when the price
# exceeds the least by more. Larger values find better palettes and take longer.
PATIENCE = 0.08
# Factor of `handle_cost` in the stopping test, for higher costs and for fewer vertices.
DEARER = 4
# Gradient steps of the rounds of the final selection: on all candidates, on those within `PATIENCE`
# of the least price, and, on all frames, on those within a quarter of it: rare handles are counted
# after that. More steps rank better and take longer.
ROUNDS = (0, 5, 30)
# Most candidates with the same numbers of handles and colours in a round.
OF_A_KIND = 2
# Relative tolerance of equal prices, and least gain that justifies another insertion of stops: the
# last refinement changes prices by as much.
ALIKE = 0.005
# Extra cost of a rare handle, whatever `handle_cost` is.
RARE_COST = USUAL_COST
# Evenly spaced frames for block merging and the first rounds, and for walks; and the number of
# frames with the largest losses that are added.
KEY_FRAMES, EVEN_FRAMES, WORST_FRAMES = 48, 16, 8


def search(
    starts: Iterable[SkewPolytope],
    static: SkewPolytope,
    rungs: Sequence[SkewPolytope],
    key: Sequence[FrameStatistics],
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> tuple[int | None, SkewPolytope]:
    """Return the index of the best polytope's start (None: a static hull), and the polytope.

    `starts` are in order of their number of blocks. The search ends at a start whose price exceeds
    the least by more than `PATIENCE`. `rungs` are static hulls, and `static` is the best of them.
    `key` are the `key_frames` of the clip's `frames`.
    """
    usual = key if len(key) <= EVEN_FRAMES else key_frames(static, key, options, EVEN_FRAMES)
    refined_rungs = [
        Priced(*refine_jointly(rung, usual, gamut, options, FIRST_STEPS, True)) for rung in rungs
    ]
    # The start, the frames and the palettes of each walk.
    walks: list[tuple[int | None, Sequence[FrameStatistics], list[Priced]]]
    walks = [(None, usual, refined_rungs)]

    def known() -> list[Priced]:
        return [palette for *_, palettes in walks for palette in palettes]

    least = math.inf
    for index, start in enumerate(starts):
        times = {time for b in start.blocks for time in (b.first, b.last)}
        times |= {frame.frame for frame in usual}
        measured = [frame for frame in frames if frame.frame in times]
        palettes = walk(start, measured, gamut, options, known())
        walks.append((index, measured, palettes))
        price = min(map(_usual_price, palettes))
        if price > (1 + PATIENCE) * least:
            break
        least = min(least, price)
    for _, sample, palettes in walks:
        best = min(palettes, key=_usual_price)
        palettes += up_and_down(best, sample, gamut, options, known())
    candidates = [(palette, index) for index, _, palettes in walks for palette in palettes]
    return best_of(candidates, key, frames, gamut, options)


def _usual_price(palette: Priced) -> float:
    return palette.price(USUAL_COST)


def best_of(
    candidates: Sequence[Candidate],
    key: Sequence[FrameStatistics],
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> tuple[int | None, SkewPolytope]:
    """Return the start and the polytope of the best candidate, measured on all frames.

    The first rounds measure the `key` frames, more than the walks. Of candidates with equal prices
    (`ALIKE`) the one with the fewest handles wins, then the one with the least terms for shape.
    """
    palettes = [palette for palette, _ in candidates]
    cost = options.handle_cost
    close = [candidate for candidate in candidates if allowed(candidate[0], palettes, options)]
    rounds = zip(ROUNDS, (math.inf, PATIENCE, PATIENCE / 4), (key, key, frames), strict=True)
    for steps, tolerance, measured in rounds:
        close = [
            (Priced(*refine_jointly(p.polytope, measured, gamut, options, steps, True)), start)
            for p, start in _close(close, cost, tolerance)
        ]
    close.sort(key=lambda candidate: candidate[0].price(cost))
    # Rare handles are counted for few candidates only: counting is slow.
    full_price = functools.cache(lambda p: p.price(cost) + rare_cost(p.polytope, frames))
    least = math.inf
    for palette, _ in close:
        if palette.price(cost) < least:
            least = min(least, full_price(palette))

    def plainness(palette: Priced) -> tuple[int, float]:
        weights = shaped_weights(options, gamut.scale)
        all_frames = range(len(frames))
        rows = frame_losses(palette.polytope, frames, all_frames, weights, options, coarse=True)
        return palette.handles, float(rows[:, 2].mean())

    alike = [candidate for candidate in close if candidate[0].price(cost) <= (1 + ALIKE) * least]
    alike.sort(key=lambda candidate: plainness(candidate[0]))
    best, start = next(c for c in alike if full_price(c[0]) <= (1 + ALIKE) * least)
    return start, best.polytope


def _close(candidates: Sequence[Candidate], cost: float, tolerance: float) -> list[Candidate]:
    """Return the candidates near the least price, `OF_A_KIND` for each (handles, colours)."""
    bound = (1 + tolerance) * min(palette.price(cost) for palette, _ in candidates)
    kinds: dict[tuple[int, ...], list[Candidate]] = {}
    for palette, start in sorted(candidates, key=lambda candidate: candidate[0].price(cost)):
        kind = (palette.handles, *(len(block.tracks) for block in palette.polytope.blocks))
        if palette.price(cost) <= bound:
            kinds.setdefault(kind, []).append((palette, start))
    return [candidate for kind in kinds.values() for candidate in kind[:OF_A_KIND]]


def rare_cost(polytope: SkewPolytope, frames: Sequence[FrameStatistics]) -> float:
    """Return the extra cost of a palette's rare handles."""
    return RARE_COST * rare_handles(polytope, frames)


def key_frames(
    static: SkewPolytope,
    frames: Sequence[FrameStatistics],
    options: AnalysisOptions,
    even: int,
) -> list[FrameStatistics]:
    """Return a sample of the frames: `even` evenly spaced ones, and those `static` fits worst.

    The neighbours of a badly fitting frame are included: otherwise a palette that fits a flash
    might change long before it.
    """
    chosen = {*range(0, len(frames), -(-len(frames) // even)), len(frames) - 1}
    most = len(chosen) + WORST_FRAMES
    all_frames = range(len(frames))
    rows = frame_losses(static, frames, all_frames, loss_weights(options), options, coarse=True)
    loss = options.lambda_ * rows[:, 0] + rows[:, 1]
    for worst in np.argsort(-loss, kind="stable").tolist():
        if len(chosen) >= most:
            break
        chosen |= {worst - 1, worst, worst + 1} & set(all_frames)
    return [frames[i] for i in sorted(chosen)]


def walk(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    known: Sequence[Priced],
) -> list[Priced]:
    """Return the palettes of a walk from a polytope, most colours first.

    The walk ends when no colour can be removed, or when further palettes can beat neither these nor
    the `known` ones. `frames` may be a sample of the clip's frames.
    """
    palettes: list[Priced] = []
    first = Priced(*refine_jointly(polytope, frames, gamut, options, FIRST_STEPS, True))
    while True:
        steps = remove_singly(first, frames, gamut, options, [*known, *palettes])
        palettes += steps
        best = min(steps, key=_usual_price)
        chain = _cheapest_chain(best.polytope, frames, gamut, options)
        if chain is None:
            return palettes
        poorer = moves.without_chain(best.polytope, chain)
        first = Priced(*refine_jointly(poorer, frames, gamut, options, STEPS, True))
        if hopeless(first, palettes, [*known, *palettes], options):
            return [*palettes, first]


def up_and_down(
    best: Priced,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    known: Sequence[Priced],
) -> list[Priced]:
    """Insert stops into a palette, remove single vertices again, and return all palettes.

    Stops are inserted in the middle of each edge. This is repeated with the best palette so far,
    while the relative gain in price is at least `ALIKE`.
    """
    palettes: list[Priced] = []
    while True:
        rich = moves.enriched(best.polytope)
        first = Priced(*refine_jointly(rich, frames, gamut, options, FIRST_STEPS, True))
        steps = remove_singly(first, frames, gamut, options, [*known, *palettes])
        palettes += steps
        before, best = best, min(best, *steps, key=_usual_price)
        if _usual_price(best) > (1 - ALIKE) * _usual_price(before):
            return palettes


def remove_singly(
    first: Priced,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    known: Sequence[Priced] = (),
) -> list[Priced]:
    """Return palettes with fewer and fewer vertices, most vertices first.

    Ends when no vertex can be removed, or when further palettes cannot be the best.
    """
    palettes = [first]
    while not hopeless(palettes[-1], palettes, [*known, *palettes], options):
        last = palettes[-1]
        cheapest = _cheapest_vertices(last.polytope, frames, gamut, options)
        if not cheapest:
            break
        rest = last.polytope
        for vertex in sorted(cheapest[: max(1, len(cheapest) // 3)], reverse=True):
            rest = rest.without(vertex)
        palettes.append(Priced(*refine_jointly(rest, frames, gamut, options, STEPS, True)))
    return palettes


def hopeless(
    last: Priced,
    own: Iterable[Priced],
    known: Iterable[Priced],
    options: AnalysisOptions,
) -> bool:
    """Return whether palettes with fewer vertices than `last` are unlikely to be the best.

    Either the price exceeds the least of the walk's `own` palettes by more than `PATIENCE`. Or the
    value, which rises with each removal, plus the cost of the fewest handles exceeds the least
    price of the `known` palettes.

    Both tests use the usual cost of a handle, and also that of the options if these differ: then a
    walk is never shorter than with the defaults. With a higher cost or fewer vertices they use
    `DEARER` times the cost too, so that the walk passes a few bad palettes.
    """
    fewest = min(2 * min(len(block.tracks) for block in last.polytope.blocks), last.handles)

    def ends(cost: float, limits: AnalysisOptions) -> bool:
        def least(palettes: Iterable[Priced]) -> float:
            prices = (p.price(cost) for p in palettes if allowed(p, (), limits))
            return min(prices, default=math.inf)

        risen = last.price(cost) > (1 + PATIENCE) * least(own)
        return risen or last.value + cost * fewest > least(known)

    cost = options.handle_cost
    dear = DEARER * cost if cost > USUAL_COST or options.vertices else cost
    return ends(USUAL_COST, USUAL) and ends(cost, options) and ends(dear, USUAL)


def allowed(palette: Priced, others: Sequence[Priced], options: AnalysisOptions) -> bool:
    """Return whether a palette has at most `vertices`, or no more than any of the others."""
    most = options.vertices or math.inf
    return palette.handles <= max(most, min((p.handles for p in others), default=0))


def _cheapest_chain(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> tuple[int, ...] | None:
    """Return the chain with the least loss without it, before others are refined, or None."""
    weights = shaped_weights(options, gamut.scale, faces=False)
    measured = range(0, len(frames), PARTS)

    def loss(chain: tuple[int, ...]) -> float:
        rest = moves.without_chain(polytope, chain, any_mesh=True)
        rows = frame_losses(rest, frames, measured, weights, options, coarse=True)
        return float((options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2]).sum())

    return min(moves.chains(polytope), key=loss, default=None)


def _cheapest_vertices(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> list[int]:
    """Return removable vertices, cheapest first, no two of them neighbours in time."""
    times = np.array([frame.frame for frame in frames], float)
    vertices, edges, length = polytope.vertices, polytope.edges(), polytope.length()
    before, after = polytope.neighbours()
    loss = loss_of(polytope, frames, coarse=True)
    weights = shaped_weights(options, gamut.scale)

    def losses(trial: F64, which: Sequence[int]) -> F64:
        rows, _ = loss.evaluate(trial, which, weights, thread_count(options), False)
        total: F64 = options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2]
        return total

    current = losses(vertices, range(len(frames)))
    order = []
    for vertex in polytope.removable():
        (early,), (late,) = before[vertex], after[vertex]
        start, end = vertices[early], vertices[late]
        rest = vertices.copy()  # with the vertex on the edge between its neighbours
        rest[vertex] = start + (rest[vertex, 3] - start[3]) / (end[3] - start[3]) * (end - start)
        which = np.flatnonzero((times > start[3]) & (times < end[3])).tolist()
        rise = float((losses(rest, which) - current[which]).sum()) / len(frames) if which else 0.0
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
