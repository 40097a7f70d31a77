"""The methods of analysis, from frames' statistics to a polytope: each a road through the stages.

`skew` and `paper` follow section 5; they part at block merging. The paper stops merging and removal
at multiples of a first loss (eta1, eta2). `skew` takes the configurations of one to `blocks`
blocks, removes vertices from each while refining, and keeps what costs least with every handle paid
for; a static hull of the whole clip takes part, so that the result is never worse than that by L'.
`static` and `rgbt` are what section 6.2 compares with.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis import (
    block_merging,
    frame_hulls,
    glue,
    handle_removal,
    rgbt_hull,
    static_hull,
    statistics,
    stop_insertion,
    vertex_refinement,
    vertex_removal,
)
from palette4d.analysis.block_merging import Block
from palette4d.analysis.handle_removal import Step
from palette4d.analysis.losses import Losses, loss_weights, smoothness, summarise, thread_count
from palette4d.analysis.objective import loss_of, refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette, SkewPolytope
from palette4d.analysis.quality import Report
from palette4d.analysis.statistics import FrameStatistics
from palette4d.analysis.strands import Strands
from palette4d.wording import counted

F64 = NDArray[np.float64]

STAGES = (
    "statistics",
    "static_hull",
    "rgbt_hull",
    "frame_hulls",
    "glue",
    "block_merging",
    "vertex_removal",
    "vertex_refinement",
)
Progress = Callable[[str, int, int], None]
"""Called as progress(stage, done, total)."""


@dataclasses.dataclass(frozen=True)
class StageResult:
    """What a stage reached: its name, vertices, blocks and losses."""

    stage: str
    vertices: int
    blocks: int
    losses: Losses

    def row(self) -> dict[str, Any]:
        """Return the stage's row in the sidecar's "quality"."""
        return {
            "stage": self.stage,
            "vertices": self.vertices,
            "blocks": self.blocks,
            **dataclasses.asdict(self.losses),
        }


@dataclasses.dataclass(frozen=True)
class Analysis:
    """The result: the polytope, what each stage reached, remarks for the user, and how good the
    palette is (measured on the finished sidecar)."""

    polytope: SkewPolytope
    stages: tuple[StageResult, ...]
    remarks: tuple[str, ...]
    report: Report | None = None


# Frames that removal looks at: these evenly spaced ones, and the worst fitted.
SEARCH_FRAMES = 24
WORST_FRAMES = 8
# Joint moves on all frames: before candidates are compared, and at the end.
COMPARE_EVALUATIONS = 40
FINAL_EVALUATIONS = 150


def analyze(
    frames: list[FrameStatistics], options: AnalysisOptions, progress: Progress | None = None
) -> Analysis:
    """Run `options.method` on the frames' statistics (at least one frame, in order of time)."""
    roads: dict[str, type[_Road]] = {
        "skew": _Skew,
        "paper": _Paper,
        "static": _Static,
        "rgbt": _Rgbt,
    }
    return roads[options.method](frames, options, progress).run()


class _Road:
    """What the methods share: the frames, the gamut, and what each stage reached."""

    def __init__(
        self,
        frames: list[FrameStatistics],
        options: AnalysisOptions,
        progress: Progress | None,
    ) -> None:
        self.frames, self.options = frames, options
        self.report = progress or (lambda stage, done, total: None)
        self.low, self.high = statistics.gamut_box(frames)
        self.stages: list[StageResult] = []

    def run(self) -> Analysis:
        raise NotImplementedError

    def counter(self, stage: str) -> Callable[[int, int], None]:
        return lambda done, total: self.report(stage, done, total)

    def measure(self, stage: str, polytope: SkewPolytope, blocks: int | None = None) -> StageResult:
        """Measure a stage's polytope on all frames, and keep the figures."""
        rows: F64
        rows, _ = loss_of(polytope, self.frames).evaluate(
            polytope.vertices,
            list(range(len(self.frames))),
            loss_weights(self.options),
            thread_count(self.options),
            False,
        )
        k, _ = smoothness(polytope.vertices, polytope.edges(), polytope.length())
        count = len(polytope.blocks) if blocks is None else blocks
        losses = summarise(rows, k, self.options)
        self.stages.append(StageResult(stage, len(polytope.vertices), count, losses))
        return self.stages[-1]

    def frame_palettes(self) -> list[Palette]:
        out = []
        for frame in self.frames:
            out.append(frame_hulls.frame_palette(frame.coarse, self.low, self.high, self.options))
            self.report("frame_hulls", len(out), len(self.frames))
        return out

    def first_blocks(self) -> list[Block]:
        """Hulls of all frames, glued, as blocks of consistent frames (sections 5.2 and 5.3.1)."""
        palettes = self.frame_palettes()
        glued = []
        for first, second in itertools.pairwise(palettes):
            glued.append(glue.glue(first, second))
            self.report("glue", len(glued), len(palettes) - 1)
        links = [g.links for g in glued]
        strands = Strands([f.frame for f in self.frames], [[p] for p in palettes], links)
        blocks = block_merging.initial_blocks(
            self.frames, palettes, [g.links if g.consistent else None for g in glued], self.options
        )
        self.measure("frame_hulls", strands.polytope(), len(blocks))
        return blocks

    def static(self) -> SkewPolytope:
        """Return the static palette of section 6.2."""
        pooled = statistics.pooled([f.coarse for f in self.frames], self.options.coarse_colours)
        palette = frame_hulls.frame_palette(pooled, self.low, self.high, self.options)
        polytope = static_hull.static_polytope(
            palette, self.frames, self.low, self.high, self.options
        )
        self.report("static_hull", 1, 1)
        return polytope


class _Glued:
    """A configuration of blocks, with the edges between them, as strands."""

    def __init__(self, frames: list[FrameStatistics], blocks: list[Block]) -> None:
        self.blocks = blocks
        self.between = [
            glue.glue(a.palettes[-1], b.palettes[0]) for a, b in itertools.pairwise(blocks)
        ]
        self.strands = Strands(
            [f.frame for f in frames],
            [b.palettes for b in blocks],
            [g.links for g in self.between],
        )

    def polytope(self) -> SkewPolytope:
        """Return what is left of the strands; each transition has the triangles that hold between
        its two frames."""
        polytope = self.strands.polytope()
        transitions = [
            dataclasses.replace(
                section, faces=glue.transition_faces(a.palettes[-1], b.palettes[0], link.links)
            )
            for section, (a, b), link in zip(
                polytope.transitions, itertools.pairwise(self.blocks), self.between, strict=True
            )
        ]
        return dataclasses.replace(polytope, transitions=tuple(transitions))

    def remarks(self) -> tuple[str, ...]:
        out = []
        boundaries = counted(len(self.between), "block boundary", "block boundaries")
        if broken := sum(g.broken > 0 for g in self.between):
            out.append(
                f"at {broken} of {boundaries} no set of edges obeys topological rule 2; "
                "the mesh between the two frames is the nearest one"
            )
        if cut := sum(not g.complete for g in self.between):
            out.append(
                f"at {cut} of {boundaries} the search for edges was ended early; a smaller "
                "--palette-size lets it see every solution"
            )
        return tuple(out)


class _Static(_Road):
    """One palette for the whole clip (section 6.2)."""

    def run(self) -> Analysis:
        polytope = self.static()
        self.measure("static_hull", polytope)
        return Analysis(polytope, tuple(self.stages), ())


class _Rgbt(_Road):
    """The simplified convex hull in RGB and time (section 6.2)."""

    def run(self) -> Analysis:
        polytope = rgbt_hull.rgbt_polytope(
            self.frames,
            self.low,
            self.high,
            self.options,
            self.options.vertices or rgbt_hull.VERTICES,
            self.counter("rgbt_hull"),
        )
        self.measure("rgbt_hull", polytope)
        return Analysis(polytope, tuple(self.stages), ())


class _Paper(_Road):
    """Sections 5.2 to 5.5 with the paper's stopping rules."""

    def run(self) -> Analysis:
        blocks = block_merging.merge_blocks(
            self.first_blocks(),
            self.frames,
            self.low,
            self.high,
            self.options,
            self.counter("block_merging"),
        )
        glued = _Glued(self.frames, blocks)
        self.measure("block_merging", glued.strands.polytope())
        vertex_removal.remove_vertices(
            glued.strands, self.frames, self.options, self.counter("vertex_removal")
        )
        polytope = glued.polytope()
        self.measure("vertex_removal", polytope)
        polytope = vertex_refinement.refine(
            polytope,
            self.frames,
            self.low,
            self.high,
            self.options,
            self.counter("vertex_refinement"),
        )
        self.measure("vertex_refinement", polytope)
        return Analysis(polytope, tuple(self.stages), glued.remarks())


@dataclasses.dataclass(frozen=True)
class _Candidate:
    """A structure and what became of it: blocks before removal (none for the static hull)."""

    merged: SkewPolytope
    removed: Step
    remarks: tuple[str, ...]


class _Skew(_Road):
    """Section 5, its structure chosen by what each handle is worth."""

    def run(self) -> Analysis:
        static = self.static()
        self.measure("static_hull", static)
        reference = self.stages[-1].losses.L_prime
        configurations = self.configurations()
        candidates = []
        for i, blocks in enumerate(configurations):
            candidates.append(self.simplified(blocks, i, len(configurations)))
        candidates.append(_Candidate(static, self.compared(static), ()))
        steps = [c.removed for c in candidates]
        chosen = candidates[steps.index(handle_removal.choose(steps, self.options))]
        self.measure("block_merging", chosen.merged)
        removed = stop_insertion.insert_stops(
            chosen.removed, self.frames, self.low, self.high, self.options
        )
        self.measure("vertex_removal", removed.polytope)
        polytope = self.refined(removed.polytope)
        remarks = chosen.remarks
        if self.stages[-1].losses.L_prime > reference:
            self.stages.pop()
            polytope, remarks = self.refined(static), ()
        if self.stages[-1].losses.L_prime > reference:  # what keeps its shape cost too much
            self.stages.pop()
            polytope = static
            self.measure("vertex_refinement", static)
        if 0 < self.options.vertices < len(polytope.vertices):
            remarks = (
                *remarks,
                f"the palette has {len(polytope.vertices)} vertices, not {self.options.vertices}: "
                "its colours have two each, and a smaller --palette-size means fewer colours",
            )
        return Analysis(polytope, tuple(self.stages), remarks)

    def configurations(self) -> list[list[Block]]:
        """Return the configurations of at most `blocks` blocks, most blocks first."""
        blocks = self.first_blocks()
        out = []
        for _, configuration in block_merging.merge_sequence(
            blocks, self.frames, self.low, self.high, self.options
        ):
            self.report("block_merging", len(blocks) - len(configuration), len(blocks) - 1)
            if len(configuration) <= self.options.blocks:
                out.append(configuration)
        return out

    def simplified(self, blocks: list[Block], place: int, of: int) -> _Candidate:
        """Remove vertices from a configuration; compare on all frames."""
        glued = _Glued(self.frames, blocks)
        merged = glued.polytope()
        losses = vertex_removal.thin(glued.strands, self.frames, self.options)
        some = [self.frames[i] for i in search_frames(losses, blocks)]

        def progress(done: int, total: int) -> None:
            self.report("vertex_removal", place * 1000 + 1000 * done // total, of * 1000)

        steps = handle_removal.simplify(
            glued.polytope(), some, self.low, self.high, self.options, progress
        )
        best = handle_removal.choose(steps, self.options)
        self.report("vertex_removal", (place + 1) * 1000, of * 1000)
        return _Candidate(merged, self.compared(best.polytope), glued.remarks())

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

    def refined(self, polytope: SkewPolytope) -> SkewPolytope:
        """Return the polytope refined on all colours of all frames."""
        out, _ = refine_jointly(
            polytope,
            self.frames,
            self.low,
            self.high,
            self.options,
            FINAL_EVALUATIONS,
            coarse=False,
        )
        self.measure("vertex_refinement", out)
        self.report("vertex_refinement", 1, 1)
        return out


def search_frames(losses: F64, blocks: list[Block]) -> list[int]:
    """Return indices of frames that stand for all: evenly spaced ones, the worst, blocks' ends."""
    count = len(losses)
    chosen = set(range(0, count, max(1, -(-count // SEARCH_FRAMES)))) | {count - 1}
    for block in blocks:
        chosen |= {block.first, block.first + len(block.palettes) - 1}
    chosen |= {int(i) for i in np.argsort(-losses, kind="stable")[:WORST_FRAMES]}
    return sorted(chosen)
