"""The methods of analysis, from frames' statistics to a polytope: each a road through the stages.

`skew` and `paper` follow section 5; they part at block merging. The paper stops merging and removal
at multiples of a first loss (eta1, eta2); `skew` is `structure_search`. `static` and `rgbt` are
what section 6.2 compares with.
"""

from __future__ import annotations

from palette4d.analysis import block_merging, vertex_refinement, vertex_removal
from palette4d.analysis.baselines import rgbt_hull
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.road import STAGES, Analysis, Glued, Progress, Road, StageResult
from palette4d.analysis.statistics import FrameStatistics
from palette4d.analysis.structure_search import Skew

__all__ = ["STAGES", "Analysis", "Progress", "StageResult", "analyze"]


def analyze(
    frames: list[FrameStatistics], options: AnalysisOptions, progress: Progress | None = None
) -> Analysis:
    """Run `options.method` on the frames' statistics (at least one frame, in order of time)."""
    roads: dict[str, type[Road]] = {
        "skew": Skew,
        "paper": _Paper,
        "static": _Static,
        "rgbt": _Rgbt,
    }
    return roads[options.method](frames, options, progress).run()


class _Static(Road):
    """One palette for the whole clip (section 6.2)."""

    def run(self) -> Analysis:
        polytope = self.static()
        self.measure("static_hull", polytope)
        return Analysis(polytope, tuple(self.stages), ())


class _Rgbt(Road):
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


class _Paper(Road):
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
        glued = Glued(self.frames, blocks)
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
