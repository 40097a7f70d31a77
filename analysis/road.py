"""What the methods of analysis share: the clip's frames, what each stage has reached, and blocks
glued together to strands."""

from __future__ import annotations

import abc
import dataclasses
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis import block_merging, frame_hulls, glue, statistics
from palette4d.analysis.baselines import static_hull
from palette4d.analysis.block_merging import Block
from palette4d.analysis.losses import Losses, loss_weights, smoothness, summarise, thread_count
from palette4d.analysis.objective import loss_of
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette, SkewPolytope
from palette4d.analysis.report.quality import Report
from palette4d.analysis.statistics import FrameStatistics
from palette4d.analysis.strands import Strands

from palette4d import _core
from palette4d.common.text import counted

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
# Of all frames together so many times as many coarse colours are kept as of one.
POOLED = 2
# Of these, one in so many: what static palettes start from.
STARTS = (1, 2, 4)
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
    """The result: the polytope, what each stage reached, remarks for the user, how good the palette
    is (measured on the finished sidecar), and the L' that it is held to (that of the best static
    palette found; None where the method holds it to nothing)."""

    polytope: SkewPolytope
    stages: tuple[StageResult, ...]
    remarks: tuple[str, ...]
    report: Report | None = None
    bound: float | None = None


class Road(abc.ABC):
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
        self._pooled: dict[int, _core.ColourTree] = {}

    @abc.abstractmethod
    def run(self) -> Analysis:
        """Go the whole way."""

    def counter(self, stage: str) -> Callable[[int, int], None]:
        """Return what tells the progress of one stage."""
        return lambda done, total: self.report(stage, done, total)

    def losses(self, polytope: SkewPolytope) -> Losses:
        """Measure a polytope on all colours of all frames."""
        rows: F64
        rows, _ = loss_of(polytope, self.frames).evaluate(
            polytope.vertices,
            list(range(len(self.frames))),
            loss_weights(self.options),
            thread_count(self.options),
            False,
        )
        k, _ = smoothness(polytope.vertices, polytope.edges(), polytope.length())
        return summarise(rows, k, self.options)

    def measure(self, stage: str, polytope: SkewPolytope, blocks: int | None = None) -> None:
        """Keep what a stage's polytope has reached."""
        count = len(polytope.blocks) if blocks is None else blocks
        losses = self.losses(polytope)
        self.stages.append(StageResult(stage, len(polytope.vertices), count, losses))

    def frame_palettes(self) -> list[Palette]:
        """Return each frame's palette (section 5.1)."""
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

    def pooled(self, sparser: int = 1) -> _core.ColourTree:
        """Return the colours of all frames together, or only so many times fewer."""
        if sparser not in self._pooled:
            most = POOLED * self.options.coarse_colours // sparser
            self._pooled[sparser] = statistics.pooled([f.coarse for f in self.frames], most)
        return self._pooled[sparser]

    def static(self) -> SkewPolytope:
        """Return the static palette of section 6.2, the best of several starts."""
        found = [self.static_from(self.options, sparser) for sparser in STARTS]
        return min(found, key=lambda polytope: self.losses(polytope).L_prime)

    def static_from(self, options: AnalysisOptions, sparser: int) -> SkewPolytope:
        """Return a static palette that started from the colours `pooled`."""
        palette = frame_hulls.frame_palette(self.pooled(sparser), self.low, self.high, options)
        polytope = static_hull.static_polytope(palette, self.frames, self.low, self.high, options)
        self.report("static_hull", 1, 1)
        return polytope


class Glued:
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
        """Return what the user should know of the edges between blocks."""
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
