"""The default method: section 5, its structure chosen by what each handle is worth.

Input: the frames' statistics. Output: an `Analysis`. The configurations of one to `blocks` blocks,
some with flashes kept apart, are simplified each, their vertices removed while the others take
over; what costs least with every handle paid for is kept, given stops for what single frames lack,
and refined. Static hulls of the whole clip, some of them refined for the paper's loss alone, are
found as well: the best of them takes part, and is what the result is held to, which is never worse
by L'. Some are dented: none of these is the result, but what beats them is looked for among
palettes of more vertices, and by a search that starts otherwise. Where the result itself is dented,
a stiffer search has the last word.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis import (
    block_merging,
    cuts,
    handle_removal,
    statistics,
    stop_insertion,
    vertex_removal,
)
from palette4d.analysis.baselines import static_hull
from palette4d.analysis.block_merging import Block
from palette4d.analysis.handle_removal import Step
from palette4d.analysis.objective import refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from palette4d.analysis.report import quality
from palette4d.analysis.road import STARTS, Analysis, Glued, Progress, Road
from palette4d.analysis.statistics import FrameStatistics

F64 = NDArray[np.float64]

# A palette has this many at least, however few vertices are asked for.
LEAST_COLOURS = 4
# Frames that removal looks at: these evenly spaced ones, and the worst fitted.
SEARCH_FRAMES = 24
WORST_FRAMES = 8
# Joint moves on all frames: before candidates are compared, and at the end.
COMPARE_EVALUATIONS = 40
FINAL_EVALUATIONS = 150
# Where slices are dented all the same: times `convexity`.
STIFFER = 10.0
# Of what L' gains over a static hull, a stiffer search may lose so much.
STIFFER_COST = 0.5
# Shares of the stops for single frames that are tried in turn, until L' allows them.
STOPS_KEPT = (1, 0.75, 0.5, 0.25, 0)
# Where nothing else is as good as a simple hull: what its shape counts, as much as L' lets it.
SHAPE_WEIGHTS = (1.0, 0.7, 0.5)
LOOSE_WEIGHTS = (0.25, 0.1, 0.0)
# Where a dented hull has a lower L' than all that: how many of more vertices are tried.
RICHER = 12
# With these colours may look alike. Before, they are pushed apart only as far as the eye needs.
APART = 0.07


@dataclasses.dataclass(frozen=True)
class Candidate:
    """A structure and what became of it: blocks before removal (none for a static hull); the price
    when it was searched on some frames, and what it was until then, with more and more vertices
    (`steps`, most first); the edges that blocks have between them."""

    merged: SkewPolytope
    removed: Step
    price: float = math.inf
    steps: tuple[Step, ...] = ()
    remarks: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True)
class Simple:
    """The best static hull that is not dented, its L', and the lowest L' of all static hulls."""

    hull: SkewPolytope
    L_prime: float
    lowest: float

    def bound(self, value: float) -> float:
        """Return the lowest L' of a static hull that a palette of L' `value` keeps to."""
        return self.lowest if value <= self.lowest else self.L_prime


class Skew(Road):
    """Section 5, its structure chosen by what each handle is worth."""

    def __init__(
        self, frames: list[FrameStatistics], options: AnalysisOptions, progress: Progress | None
    ) -> None:
        if options.vertices:  # a colour has a vertex at either end of the clip at least
            most = max(LEAST_COLOURS, options.vertices // 2)
            options = dataclasses.replace(options, palette_size=min(options.palette_size, most))
        super().__init__(frames, options, progress)

    def run(self) -> Analysis:
        """Find what is simple, then search; where the result is dented, search once more."""
        static = self.static()
        self.measure("static_hull", static)
        hulls = [static, *self.plain_hulls()]
        values = [self.losses(hull).L_prime for hull in hulls]
        in_shape = [0, *(i for i in range(1, len(hulls)) if not self.dented(hulls[i]))]
        reference = min(values[i] for i in in_shape)
        simple = Simple(hulls[values.index(reference)], reference, min(values))
        polytope, remarks = self.searched(simple)
        stiffer: tuple[str, ...] = ()
        if self.options.convexity and self.dented(polytope):
            polytope, remarks, stiffer = self.searched_stiffer(polytope, remarks, simple)
        self.measure("vertex_refinement", polytope)
        self.report("vertex_refinement", 1, 1)
        remarks = stiffer if len(polytope.blocks) == 1 else (*remarks, *stiffer)
        if 0 < self.options.vertices < len(polytope.vertices):
            remarks = (
                *remarks,
                f"the palette has {len(polytope.vertices)} vertices, not {self.options.vertices}: "
                "it has four colours at least, and each of them two",
            )
        bound = simple.bound(self.stages[-1].losses.L_prime)
        return Analysis(polytope, tuple(self.stages), remarks, bound=bound)

    def searched(self, simple: Simple) -> tuple[SkewPolytope, tuple[str, ...]]:
        """Search, insert stops, refine, and compare with what is simple: the refined polytope, and
        what the user should know of its blocks."""
        candidates = [*self.candidates(), Candidate(simple.hull, self.compared(simple.hull))]
        steps = [c.removed for c in candidates]
        chosen = candidates[steps.index(handle_removal.choose(steps, self.options))]
        self.measure("block_merging", chosen.merged)
        stops = stop_insertion.insert_stops(
            chosen.removed.polytope, self.frames, self.low, self.high, self.options
        )
        self.measure("vertex_removal", stops[-1].polytope)
        # All stops, else as many as L' lets: those that came first are the most wanted.
        kept = sorted({round(share * (len(stops) - 1)) for share in STOPS_KEPT}, reverse=True)
        ways = [
            functools.partial(self.refined, stops[i].polytope, self.options, stops[i].brief)
            for i in kept
        ]
        polytope, remarks = self.never_worse(ways, simple.hull, simple.L_prime), chosen.remarks
        searches: tuple[Callable[[], list[Candidate]], ...]
        searches = (lambda: candidates, self.started_otherwise)
        for others in searches:
            if self.losses(polytope).L_prime > simple.lowest:  # that of a dented hull
                polytope, remarks = self.richer(polytope, remarks, others(), simple.lowest)
        return polytope, remarks

    def searched_stiffer(
        self, polytope: SkewPolytope, remarks: tuple[str, ...], simple: Simple
    ) -> tuple[SkewPolytope, tuple[str, ...], tuple[str, ...]]:
        """Return what a search finds that is `STIFFER`, its remarks, and one that says so; what was
        given where that is dented too, or loses more than `STIFFER_COST` of what is gained over a
        static hull."""
        options = dataclasses.replace(self.options, convexity=STIFFER * self.options.convexity)
        road = Skew(self.frames, options, self.report)
        found, its_remarks = road.searched(simple)
        first, value = self.losses(polytope).L_prime, self.losses(found).L_prime
        if self.dented(found) or value > first + STIFFER_COST * (simple.bound(first) - first):
            return polytope, remarks, ()
        self.stages[-len(road.stages) :] = road.stages
        dent = quality.deepest_dent(polytope, self.frames)
        said = (
            f"without dents by a second search, with --convexity {options.convexity:g}: L' is "
            f"{value:.3f}; the first found {first:.3f}, dented by {dent:.0%}"
        )
        return found, its_remarks, (said,)

    def plain_hulls(self) -> list[SkewPolytope]:
        """Return plain static hulls of no more vertices than asked for.

        In a short clip little moves, and such a hull is hard to beat: several starts are tried.
        Without shape terms a colour may end inside of the others' hull, where it costs less and is
        of no use: such a palette is dented. It is never the result, but is to be beaten.
        """
        starts = STARTS if len(self.frames) < statistics.SHORT else STARTS[:1]
        hulls = [
            self.static_from(options, sparser)
            for options in static_hull.plain(self.options)
            for sparser in starts
        ]
        most = self.options.vertices
        return [hull for hull in hulls if not most or len(hull.vertices) <= most]

    def never_worse(
        self, ways: Sequence[Callable[[], SkewPolytope]], simple: SkewPolytope, reference: float
    ) -> SkewPolytope:
        """Take the first of the ways to a refined polytope whose L' is not above `reference`, that
        of `simple`; if there is none, `simple` itself, kept in shape as far as that allows."""
        found = (way() for way in ways)
        relaxed = (self.refined(simple, options) for options in self.shapes())
        # What is in no better shape than `simple` is not worth it.
        in_shape = (p for p in relaxed if not self.dented(p))
        polytopes = itertools.chain(found, in_shape)
        within = (p for p in polytopes if self.losses(p).L_prime <= reference)
        return next(within, simple)

    def richer(
        self,
        polytope: SkewPolytope,
        remarks: tuple[str, ...],
        candidates: Sequence[Candidate],
        lowest: float,
    ) -> tuple[SkewPolytope, tuple[str, ...]]:
        """Return a polytope of more vertices, as few as will do, whose L' is not above `lowest`,
        and which is in shape, with its candidate's remarks; what was given where what the
        candidates were on their way has none."""
        count, most = len(polytope.vertices), self.options.vertices or math.inf
        steps = [
            (step, candidate)
            for candidate in candidates
            for step in candidate.steps
            if count < len(step.polytope.vertices) <= most
        ]
        steps.sort(key=lambda pair: (len(pair[0].polytope.vertices), pair[0].value))
        for step, candidate in steps[:RICHER]:
            found = self.refined(step.polytope, self.options)
            if self.losses(found).L_prime <= lowest and not self.dented(found):
                return found, candidate.remarks
        return polytope, remarks

    def started_otherwise(self) -> list[Candidate]:
        """Return candidates that were searched by half of the coarse colours: the search is greedy,
        and from elsewhere it may find what it has missed."""
        frames = [
            dataclasses.replace(f, coarse=statistics.pooled([f.coarse], -(-len(f.coarse) // 2)))
            for f in self.frames
        ]
        return Skew(frames, self.options, self.report).candidates()

    def dented(self, polytope: SkewPolytope) -> bool:
        """Return whether the report would warn of a dent."""
        return quality.deepest_dent(polytope, self.frames) > quality.DENT

    def shapes(self) -> Iterator[AnalysisOptions]:
        """Yield options that keep a simple hull in shape less and less."""
        o = self.options
        yield from (self.shaped(weight) for weight in SHAPE_WEIGHTS)
        yield dataclasses.replace(o, separation=min(o.separation, APART), reach=0.0)
        yield from (self.shaped(weight) for weight in LOOSE_WEIGHTS)

    def shaped(self, weight: float) -> AnalysisOptions:
        """Return the options with what keeps palettes in shape weighed so much; with 0, those for
        the paper's loss alone."""
        o = self.options
        return dataclasses.replace(
            o,
            convexity=weight * o.convexity,
            separation=weight * o.separation,
            reach=o.reach if weight else 0.0,
        )

    def candidates(self) -> list[Candidate]:
        """Return what becomes of each configuration."""
        configurations = self.configurations()
        out: list[Candidate] = []
        for i, blocks in enumerate(reversed(configurations)):  # those of few blocks cost least
            bound = min((c.price for c in out), default=math.inf)
            out.append(self.simplified(blocks, i, len(configurations), bound))
        return out

    def configurations(self) -> list[list[Block]]:
        """Return the configurations of at most `blocks` blocks, most blocks first.

        Merging takes a flash into the blocks beside it before it merges these. So it is also tried
        with every flash kept apart.
        """
        blocks = self.first_blocks()
        flashes = cuts.find_flashes(self.frames)
        edges = [at for flash in flashes for at in (flash.start, flash.stop)]
        found: dict[tuple[int, ...], list[Block]] = {}
        for apart in ([], edges) if edges else ([],):
            for _, configuration in block_merging.merge_sequence(
                blocks, self.frames, self.low, self.high, self.options, apart
            ):
                self.report("block_merging", len(blocks) - len(configuration), len(blocks) - 1)
                if len(configuration) <= self.options.blocks:
                    found.setdefault(tuple(block.first for block in configuration), configuration)
        return sorted(found.values(), key=len, reverse=True)

    def simplified(self, blocks: list[Block], place: int, of: int, bound: float) -> Candidate:
        """Remove vertices from a configuration; compare on all frames."""
        glued = Glued(self.frames, blocks)
        merged = glued.polytope()
        losses = vertex_removal.thin(glued.strands, self.frames, self.options)
        some = [self.frames[i] for i in search_frames(losses, blocks)]

        def progress(done: int, total: int) -> None:
            self.report("vertex_removal", place * 1000 + 1000 * done // total, of * 1000)

        steps = handle_removal.simplify(
            glued.polytope(), some, self.low, self.high, self.options, progress, bound
        )
        best = handle_removal.choose(steps, self.options)
        self.report("vertex_removal", (place + 1) * 1000, of * 1000)
        price = best.price(self.options)
        until = tuple(steps[: steps.index(best) + 1])
        return Candidate(merged, self.compared(best.polytope), price, until, glued.remarks())

    def compared(self, polytope: SkewPolytope) -> Step:
        """Return the polytope refined a little on all frames, with its value there."""
        return Step(
            *refine_jointly(
                polytope,
                self.frames,
                self.low,
                self.high,
                self.options,
                COMPARE_EVALUATIONS,
                coarse=True,
            )
        )

    def refined(
        self, polytope: SkewPolytope, options: AnalysisOptions, brief: tuple[int, ...] = ()
    ) -> SkewPolytope:
        """Return the polytope refined on all colours of all frames; where that is dented, refined
        once more and `STIFFER`, if this makes the deepest dent less."""
        refine = functools.partial(
            refine_jointly,
            statistics=self.frames,
            low=self.low,
            high=self.high,
            most_evaluations=FINAL_EVALUATIONS,
            coarse=False,
            brief=brief,
        )
        found, _ = refine(polytope, options=options)
        deepest = quality.deepest_dent(found, self.frames)
        if not options.convexity or deepest <= quality.DENT:
            return found
        stiffer = dataclasses.replace(options, convexity=STIFFER * options.convexity)
        mended, _ = refine(found, options=stiffer)
        return mended if quality.deepest_dent(mended, self.frames) < deepest else found


def search_frames(losses: F64, blocks: list[Block]) -> list[int]:
    """Return indices of frames that stand for all: evenly spaced ones, the worst, blocks' ends."""
    count = len(losses)
    chosen = set(range(0, count, max(1, -(-count // SEARCH_FRAMES)))) | {count - 1}
    for block in blocks:
        chosen |= {block.first, block.first + len(block.palettes) - 1}
    chosen |= {int(i) for i in np.argsort(-losses, kind="stable")[:WORST_FRAMES]}
    return sorted(chosen)
