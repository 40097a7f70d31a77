"""The road of section 5, from a clip to a sidecar document: the only module that knows the stages'
order."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from palette4d import _core
from palette4d.analysis import (
    block_merging,
    frame_hulls,
    glue,
    sidecar,
    statistics,
    vertex_refinement,
    vertex_removal,
)
from palette4d.analysis.clip_base import describe, even_step
from palette4d.analysis.losses import Losses, smoothness, summarise, thread_count
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette, SkewPolytope
from palette4d.analysis.statistics import FrameStatistics
from palette4d.errors import Palette4dError
from palette4d.wording import counted

if TYPE_CHECKING:
    from palette4d.analysis.clip import Clip

STAGES = (
    "statistics",
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
    """The result: the polytope, what each stage reached, and remarks for the user."""

    polytope: SkewPolytope
    stages: tuple[StageResult, ...]
    remarks: tuple[str, ...]


def analyze_clip(
    clip: Clip, options: AnalysisOptions, progress: Progress | None = None
) -> tuple[dict[str, Any], Analysis]:
    """Analyse a clip and return its sidecar document (not yet written) and the analysis.

    Frames are read one at a time; what is kept of each is bounded, whatever its resolution.

    Raises
    ------
    Palette4dError
        When a frame cannot be read, the frames are not evenly spaced (a sidecar has one step), or
        no frame has a pixel to go by.
    """
    step = even_step(clip.frames)
    if not step:
        raise Palette4dError(
            f"the frames {describe(clip.frames)} are not evenly spaced, and a palette is analysed "
            "from frames with one step between them; expected a range such as 1-10 or 1-10x3"
        )
    report = progress or (lambda stage, done, total: None)
    gathered: list[FrameStatistics | None] = []
    numbers: list[int] = []
    for number, image in clip.iter_colours():
        numbers.append(number)
        gathered.append(statistics.gather(number, image, options))
        report("statistics", len(gathered), len(clip.frames))
    skipped = set(clip.skipped)
    usable, remarks = _usable(clip.frames, dict(zip(numbers, gathered, strict=True)), skipped)
    analysis = analyze(usable, options, report)
    document = sidecar.new_document(
        {
            "name": clip.name,
            "source": clip.source,
            "frames": {
                "first": clip.frames[0],
                "last": clip.frames[-1],
                "step": step,
                "skipped": sorted(skipped),
            },
            "rate": [clip.rate.numerator, clip.rate.denominator],
            "size": [clip.width, clip.height],
            "encoding": clip.encoding,
        },
        analysis.polytope.fields(),
        {
            "stages": [stage.row() for stage in analysis.stages],
            "options": options.recorded(),
            "versions": _versions(),
        },
    )
    return document, dataclasses.replace(analysis, remarks=(*remarks, *analysis.remarks))


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    names = ("numpy", "scipy", "nlopt", "OpenImageIO", "av")
    return {"palette4d": _core.__version__, **{name: version(name) for name in names}}


def _usable(
    frames: Iterable[int], gathered: dict[int, FrameStatistics | None], skipped: set[int]
) -> tuple[list[FrameStatistics], list[str]]:
    """Return statistics of the frames that have pixels; the clip's ends are always there.

    A first or last frame without a colour of its own stands in with its nearest neighbour's, so
    that the palette covers the whole clip.
    """
    numbers = list(frames)
    have = {n: s for n, s in gathered.items() if s is not None}
    if not have:
        raise Palette4dError(
            f"no frame of the clip has a pixel to go by: found {counted(len(numbers), 'frame')} "
            "empty, fully transparent or not finite; expected at least one with colours"
        )
    remarks = []
    blank = sorted(n for n, s in gathered.items() if s is None)
    if blank:
        what = counted(
            len(blank),
            "frame has no usable pixel and was",
            "frames have no usable pixel and were",
        )
        remarks.append(f"{what} passed over: {blank}")
    for end, nearest in ((numbers[0], min(have)), (numbers[-1], max(have))):
        if end not in have:
            have[end] = dataclasses.replace(have[nearest], frame=end)
            remarks.append(f"frame {end} takes the palette of frame {nearest}")
    return [have[n] for n in sorted(have)], remarks


def analyze(
    frames: list[FrameStatistics], options: AnalysisOptions, progress: Progress | None = None
) -> Analysis:
    """Run all stages on the frames' statistics (at least one frame, in order of time)."""
    report = progress or (lambda stage, done, total: None)
    count = len(frames)
    low, high = statistics.gamut_box(frames)
    stages: list[StageResult] = []

    palettes: list[Palette] = []
    for frame in frames:
        palettes.append(frame_hulls.frame_palette(frame.coarse, low, high, options))
        report("frame_hulls", len(palettes), count)

    glued = []
    for first, second in itertools.pairwise(palettes):
        glued.append(glue.glue(first, second))
        report("glue", len(glued), count - 1)
    strands = _strands(frames, [[p] for p in palettes], [g.links for g in glued])
    blocks = block_merging.initial_blocks(
        frames, palettes, [g.links if g.consistent else None for g in glued], options
    )
    stages.append(_measure("frame_hulls", strands.polytope(), frames, options, len(blocks)))

    blocks = block_merging.merge_blocks(
        blocks, frames, low, high, options, lambda done, total: report("block_merging", done, total)
    )
    between = [glue.glue(a.palettes[-1], b.palettes[0]) for a, b in itertools.pairwise(blocks)]
    strands = _strands(frames, [b.palettes for b in blocks], [g.links for g in between])
    stages.append(_measure("block_merging", strands.polytope(), frames, options))

    vertex_removal.remove_vertices(
        strands, frames, options, lambda done, total: report("vertex_removal", done, total)
    )
    polytope = _with_transitions(strands.polytope(), blocks, between)
    stages.append(_measure("vertex_removal", polytope, frames, options))

    polytope = vertex_refinement.refine(
        polytope,
        frames,
        low,
        high,
        options,
        lambda done, total: report("vertex_refinement", done, total),
    )
    stages.append(_measure("vertex_refinement", polytope, frames, options))
    return Analysis(polytope, tuple(stages), tuple(_remarks(between)))


def _strands(frames: list[FrameStatistics], blocks: Any, links: Any) -> vertex_removal.Strands:
    return vertex_removal.Strands([f.frame for f in frames], blocks, links)


def _with_transitions(
    polytope: SkewPolytope, blocks: list[block_merging.Block], between: list[glue.Glue]
) -> SkewPolytope:
    """Give each transition the triangles that hold between its two frames."""
    transitions = [
        dataclasses.replace(
            section, faces=glue.transition_faces(a.palettes[-1], b.palettes[0], link.links)
        )
        for section, (a, b), link in zip(
            polytope.transitions, itertools.pairwise(blocks), between, strict=True
        )
    ]
    return dataclasses.replace(polytope, transitions=tuple(transitions))


def _remarks(between: list[glue.Glue]) -> list[str]:
    broken = sum(g.broken > 0 for g in between)
    if not broken:
        return []
    boundaries = counted(len(between), "block boundary", "block boundaries")
    return [
        f"at {broken} of {boundaries} no set of edges obeys topological rule 2; "
        "the mesh between the two frames is the nearest one"
    ]


def _measure(
    stage: str,
    polytope: SkewPolytope,
    frames: list[FrameStatistics],
    options: AnalysisOptions,
    blocks: int | None = None,
) -> StageResult:
    """Measure a stage's polytope on all frames."""
    loss = vertex_refinement.loss_of(polytope, frames)
    everything = list(range(len(frames)))
    rows: NDArray[np.float64]
    rows, _ = loss.evaluate(
        polytope.vertices, everything, options.lambda_, options.k, 0.0, thread_count(options), False
    )
    k, _ = smoothness(polytope.vertices, polytope.edges(), polytope.length())
    return StageResult(
        stage,
        len(polytope.vertices),
        len(polytope.blocks) if blocks is None else blocks,
        summarise(rows, k, options),
    )
