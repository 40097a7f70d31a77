"""From a clip to a sidecar document. Only this module knows the order of the stages.

clip -> colour_statistics -> frame_hulls -> glue -> block_merging -> vertex_removal
-> structure_search -> stop_insertion -> vertex_refinement -> polytope -> sidecar document

`static_hull` is a start of the search and a method; `baselines` holds the other methods.
`earlier_palette` takes the place of the stages between statistics and refinement for `like`.
"""

from __future__ import annotations

import concurrent.futures
import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis import (
    block_merging,
    clip_colours,
    colour_statistics,
    earlier_palette,
    frame_hulls,
    glue,
    static_hull,
    stop_insertion,
    structure_search,
    vertex_refinement,
    vertex_removal,
)
from palette4d.analysis.baselines import paper_thresholds, rgbt_hull
from palette4d.analysis.block_merging import Block
from palette4d.analysis.dense_polytope import DensePolytope
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.losses import EVALUATIONS, LOST_SHARE, Losses, thread_count
from palette4d.analysis.objective import Priced, losses_of, refine_jointly
from palette4d.analysis.options import LIKE, AnalysisOptions
from palette4d.analysis.polytope import FramePalette, SkewPolytope
from palette4d.analysis.report import advice, quality
from palette4d.analysis.report.quality import Report

from palette4d import _core
from palette4d.colour.ocio_config import says_linear
from palette4d.common.errors import Arg, Message, Palette4dError
from palette4d.common.text import counted
from palette4d.grade import sidecar
from palette4d.grade.handle_names import vertex_colours
from palette4d.media import colour_space, cuts
from palette4d.media.array_clip import ArrayClip
from palette4d.media.clip_base import Clip, describe, even_step
from palette4d.media.colour_space import SpaceOptions

#: The largest frame number and code value of a sidecar (docs/sidecar.md).
LARGEST_FRAME, LARGEST_VALUE = 1_000_000_000, 1_000_000

T = TypeVar("T")
Progress = Callable[[str, int, int], object]
"""Called as progress(stage, done, total)."""


@dataclasses.dataclass(frozen=True)
class StageResult:
    """Vertices, blocks and losses after a stage."""

    stage: str
    vertices: int
    blocks: int
    losses: Losses

    def row(self) -> dict[str, Any]:
        """Return the row of the stage in the sidecar's "quality"."""
        counts = {"stage": self.stage, "vertices": self.vertices, "blocks": self.blocks}
        return counts | dataclasses.asdict(self.losses)


@dataclasses.dataclass(frozen=True)
class PaletteResult:
    """The result of all stages.

    Attributes
    ----------
    polytope : the palette.
    stages : vertices, blocks and losses after each stage.
    notes : notes and warnings for the user.
    """

    polytope: SkewPolytope
    stages: tuple[StageResult, ...]
    notes: tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class Analysis(PaletteResult):
    """The result of an analysis.

    Attributes
    ----------
    document : the sidecar document, not yet written.
    report : how good the finished palette is.
    colours : one line about the colour spaces, None without colour spaces.
    """

    document: dict[str, Any]
    report: Report
    colours: str | None

    def figures(self) -> dict[str, Any]:
        """Return what `analyze --json` prints; docs/palettes.md explains the names."""
        return {
            "stages": [stage.row() for stage in self.stages],
            "palette": self.report.figures(),
            "frames": [dataclasses.asdict(fit) for fit in self.report.fits],
            "colour_spaces": self.colours,
            "notes": list(self.notes),
        }


def analyze(
    clip: Clip | NDArray[np.floating[Any]],
    options: AnalysisOptions | None = None,
    progress: Progress | None = None,
    *,
    spaces: SpaceOptions | None = None,
    allow_cuts: bool = False,
    like: Mapping[str, Any] | None = None,
) -> Analysis:
    """Find the time-varying palette of a clip.

    Frames are read one after the other. Memory does not grow with their resolution or number.

    Parameters
    ----------
    clip : an opened clip, or an array (frames, height, width, 3) of code values 0 to 1.
    options : by default `AnalysisOptions()`.
    progress : called as progress(stage, done, total).
    spaces : colour spaces of the clip and of its palette; by default those of $OCIO, if it is set.
    allow_cuts : analyse a clip with sudden cuts as one shot.
    like : the sidecar document of an earlier version of the clip, for the method `LIKE`: its
        palette is moved to this clip's colours.

    Raises
    ------
    Palette4dError
        When a frame cannot be read, the frames are not evenly spaced, no frame has a pixel that
        counts, the clip has sudden cuts and `allow_cuts` is not set, or the palette of `like` is
        for frames or colours of another kind.
    """
    options = options or AnalysisOptions()
    clip = clip if isinstance(clip, Clip) else ArrayClip(clip)
    used = colour_space.spaces_of(clip, spaces or SpaceOptions())
    clip = colour_space.converted(clip, used)
    step = even_step(clip.frames)
    if not step:
        raise Palette4dError(
            f"the frames {describe(clip.frames)} are not evenly spaced; expected one step between "
            "all frames, such as 1-10 or 1-10x3"
        )
    if abs(largest := max(clip.frames, key=abs)) > LARGEST_FRAME:
        raise Palette4dError(
            f"{clip.source}: found the frame number {largest}, expected at most {LARGEST_FRAME}; "
            "give the files smaller numbers"
        )
    earlier = earlier_palette.read(like, clip) if like is not None else None
    tell = progress or (lambda stage, done, total: None)
    gathered = colour_statistics.gather_clip(
        clip, options, lambda done, total: tell("colour_statistics", done, total)
    )
    skipped = sorted(clip.skipped)
    usable, missing = _usable(clip.frames, gathered.frames)
    gamut = Gamut.of(usable)
    if (farthest := float(max(-gamut.low.min(), gamut.high.max()))) > LARGEST_VALUE:
        raise Palette4dError(
            f"{clip.source}: found code values up to {farthest:.3g} in more than single pixels, "
            f"expected colours, of at most {LARGEST_VALUE:,}; choose another layer of it, or "
            "convert it"
        )
    if starts := cuts.find_cuts((frame.frame, frame.histogram) for frame in usable):
        if not allow_cuts:
            raise Palette4dError(f"{clip.source}: {cuts.refusal(clip.frames, starts).marked}")
        missing.append(cuts.note(starts))
    result = find_polytope(usable, options, tell, earlier)
    polytope = result.polytope
    fields = polytope.fields() if like is None else earlier_palette.fields_of(polytope, like)
    document = sidecar.new_document(
        {
            "name": clip.name,
            "source": clip.source,
            "frames": {
                "first": clip.frames[0],
                "last": clip.frames[-1],
                "step": step,
                "skipped": skipped,
            },
            "rate": [clip.rate.numerator, clip.rate.denominator],
            "size": [clip.width, clip.height],
            "encoding": clip.encoding,
        },
        fields,
        {
            "stages": [stage.row() for stage in result.stages],
            "options": options.recorded(),
            "versions": _versions(),
        },
    )
    finished = sidecar.validate(document).polytope
    report = quality.report(finished, usable, options)
    document["quality"]["stages"][-1] |= report.figures()
    warnings = advice.warnings(
        report,
        options,
        {stage.stage: stage.losses.max_distance for stage in result.stages},
        brightest=float(finished.vertices[:, :3].max()),
        linear=clip.encoding if says_linear(clip.encoding) else "",
    )
    notes = [*clip.notes, *([used.note] if used and used.note else [])]
    if skipped:
        notes.append(f"{counted(len(skipped), 'bad frame')} skipped: {describe(skipped)}")
    document["colours"] = clip_colours.clip_colours(usable)
    notes += colour_space.record(document, clip, used)
    vertices, edges = (document["polytope"][part] for part in ("vertices", "edges"))
    names = vertex_colours(vertices, edges, document["clip"]["encoding"])
    for vertex, name in zip(vertices, names, strict=True):
        vertex["name"] = name
    if like is not None:
        notes += earlier_palette.fit(like, result.stages[-1].losses.L_prime)
    notes += [*gathered.notes, *missing, *result.notes, *warnings]
    return Analysis(
        result.polytope,
        result.stages,
        tuple(map(Message, notes)),
        document=document,
        report=report,
        colours=colour_space.described(used),
    )


def _versions() -> dict[str, str]:
    from importlib.metadata import version

    names = ("numpy", "scipy", "nlopt", "OpenImageIO", "av")
    return {"palette4d": _core.__version__, **{name: version(name) for name in names}}


def _usable(
    frames: Iterable[int], gathered: dict[int, FrameStatistics | None]
) -> tuple[list[FrameStatistics], list[str]]:
    """Return the statistics of the frames that have pixels, and notes about the others.

    The palette covers the whole clip. If the first or last frame has no pixels, it takes the
    colours of the nearest frame with pixels.
    """
    numbers = list(frames)
    have = {n: s for n, s in gathered.items() if s is not None}
    if not have:
        raise Palette4dError(
            f"no frame of the clip has a pixel that counts: found {counted(len(numbers), 'frame')} "
            "empty or not finite; expected at least one with colours"
        )
    notes = []
    if blank := sorted(n for n, s in gathered.items() if s is None):
        single, more = "frame has no usable pixel and was", "frames have no usable pixel and were"
        notes.append(f"{counted(len(blank), single, more)} left out: {describe(blank)}")
    for end, nearest in ((numbers[0], min(have)), (numbers[-1], max(have))):
        if end not in have:
            have[end] = dataclasses.replace(have[nearest], frame=end)
            notes.append(f"frame {end} takes the palette of frame {nearest}")
    return [have[n] for n in sorted(have)], notes


def find_polytope(
    frames: Sequence[FrameStatistics],
    options: AnalysisOptions,
    progress: Progress | None = None,
    earlier: SkewPolytope | None = None,
) -> PaletteResult:
    """Run the stages after `colour_statistics` on at least one frame, in order of time.

    `earlier` is the palette that the method `LIKE` moves.
    """
    # Times start at 0, so that the result does not depend on frame numbers, not even by rounding.
    first = frames[0].frame
    frames = [dataclasses.replace(frame, frame=frame.frame - first) for frame in frames]
    run = _Run(frames, options, progress)
    if options.method == LIKE:
        if earlier is None:
            raise Palette4dError(
                f"{Arg('method', 'like')} needs the palette of an earlier version: {Arg('like')}"
            )
        polytope = _moved(run, earlier.later(-first))
    else:
        methods = {"skew": _skew, "paper": _paper, "static": _static, "rgbt": _rgbt}
        polytope = methods[options.method](run)
    polytope = polytope.later(first)
    return PaletteResult(polytope, tuple(run.stages), tuple(run.notes))


class _Run:
    """One analysis: the frames, the results of each stage, and notes for the user."""

    def __init__(
        self,
        frames: Sequence[FrameStatistics],
        options: AnalysisOptions,
        progress: Progress | None,
    ) -> None:
        self.frames, self.options = frames, options
        self.gamut = Gamut.of(frames)
        self.report = progress or (lambda stage, done, total: None)
        self.stages: list[StageResult] = []
        self.notes: list[str] = []
        self.measured: dict[SkewPolytope, Losses] = {}

    @functools.cached_property
    def ladder(self) -> list[Priced]:
        """Static palettes of fewer and fewer colours."""
        return static_hull.ladder(self.frames, self.gamut, self.options)

    def counter(self, stage: str) -> Callable[[int, int], object]:
        """Return the progress callback of one stage."""
        return lambda done, total: self.report(stage, done, total)

    def counted(self, stage: str, results: Iterable[T], total: int) -> Iterator[T]:
        """Yield results, and report the progress of their stage."""
        for done, result in enumerate(results, start=1):
            yield result
            self.report(stage, done, total)

    def losses(self, polytope: SkewPolytope) -> Losses:
        """Measure a polytope on all colours of all frames, once."""
        if polytope not in self.measured:
            self.measured[polytope] = losses_of(polytope, self.frames, self.options)
        return self.measured[polytope]

    def result(self, stage: str, polytope: SkewPolytope) -> StageResult:
        """Return the vertices, blocks and losses after a stage."""
        losses = self.losses(polytope)
        return StageResult(stage, len(polytope.vertices), len(polytope.blocks), losses)

    def record(self, stage: str, polytope: SkewPolytope) -> None:
        """Record the vertices, blocks and losses after a stage."""
        self.stages.append(self.result(stage, polytope))


def _skew(run: _Run) -> SkewPolytope:
    """Sections 5.2 to 5.5. Each handle of the result is worth its cost (the default method)."""
    options = run.options
    usual = _static(run)  # does not depend on `handle_cost`
    rungs = [rung for rung in run.ladder if structure_search.allowed(rung, run.ladder, options)]
    simple = min(rungs, key=lambda rung: rung.price(options.handle_cost)).polytope
    polytope = _searched(run, options, usual, simple)
    run.record("vertex_refinement", polytope)
    run.report("vertex_refinement", 1, 1)
    if 0 < options.vertices < len(polytope.vertices):
        run.notes.append(
            f"the palette has {len(polytope.vertices)} vertices, not {options.vertices}: it has at "
            "least four colours, and each of them two vertices"
        )
    return polytope


def _moved(run: _Run, earlier: SkewPolytope) -> SkewPolytope:
    """Move the palette of an earlier version to the colours of this clip."""
    frames, gamut, options = run.frames, run.gamut, run.options
    run.record("earlier_palette", earlier)
    near, _ = refine_jointly(earlier, frames, gamut, options, EVALUATIONS, coarse=True)
    polytope = vertex_refinement.refine(near, frames, gamut, options)
    run.record("vertex_refinement", polytope)
    run.report("vertex_refinement", 1, 1)
    return polytope


def _price(polytope: SkewPolytope, run: _Run, cost: float, free: int = 0) -> float:
    """Return L' and the cost of all handles except `free` of them."""
    return run.losses(polytope).L_prime + cost * (len(polytope.vertices) - free)


def _searched(
    run: _Run, options: AnalysisOptions, static: SkewPolytope, simple: SkewPolytope
) -> SkewPolytope:
    """Run the stages from frame hulls to refinement; the result is never dearer than `simple`.

    The search starts from `static`, which does not depend on `handle_cost`.
    """
    frames, gamut = run.frames, run.gamut
    sampled = structure_search.key_frames(static, frames, options, structure_search.KEY_FRAMES)
    blocks, first = _consistent_blocks(run, sampled)
    sequence = block_merging.merge_sequence(blocks, sampled, gamut, options)
    configurations = [merged for _, merged in run.counted("block_merging", sequence, len(blocks))]
    few_blocks = [c for c in reversed(configurations) if len(c) <= options.blocks]
    starts, notes = [], []

    def next_starts() -> Iterator[SkewPolytope]:  # lazily: the search may stop early
        for configuration in few_blocks:
            apart, its_frames = block_merging.placed(configuration, sampled, frames, options)
            dense, note = _glued(its_frames, apart)
            notes.append(note)
            vertex_removal.thin_out(dense, its_frames, options)
            starts.append(dense.polytope())
            yield starts[-1]

    rungs = [rung.polytope for rung in run.ladder]
    begun = run.counted("vertex_removal", next_starts(), len(few_blocks))
    chosen, polytope = structure_search.search(
        begun, static, rungs, sampled, frames, gamut, options
    )
    with_stops = stop_insertion.insert_stops(polytope, frames, gamut, options)
    run.stages += [
        first,
        run.result("block_merging", static if chosen is None else starts[chosen]),
        run.result("vertex_removal", with_stops[-1].polytope),
    ]
    if chosen is not None and len(polytope.blocks) > 1:
        run.notes += notes[chosen]
    cost = options.handle_cost
    for candidate, free in _with_useful_stops(run, with_stops):
        if _price(candidate, run, cost, free) <= _price(simple, run, cost):
            return candidate
    return simple


def _with_useful_stops(
    run: _Run, tried: Sequence[stop_insertion.WithStops]
) -> Iterator[tuple[SkewPolytope, int]]:
    """Yield the refined polytope with all stops, if they are useful, and the one without stops.

    Stops are useful if they lower the price, or if each recovers lost pixels: `LOST_SHARE` of a
    frame. Useful stops cost nothing; the second item is their number.
    """

    def priced(candidate: SkewPolytope) -> float:
        rare = structure_search.rare_cost(candidate, run.frames)
        return _price(candidate, run, run.options.handle_cost) + rare

    refined = [
        vertex_refinement.refine(stops.polytope, run.frames, run.gamut, run.options, stops.brief)
        for stops in dict.fromkeys((tried[0], tried[-1]))
    ]
    if len(refined) > 1:
        plain, rich = refined
        before, after = (
            stop_insertion.lost_share(candidate, run.frames, run.gamut, run.options)
            for candidate in refined
        )
        count = len(rich.vertices) - len(plain.vertices)
        if before - after >= LOST_SHARE * count or priced(rich) <= priced(plain):
            yield rich, count
    yield refined[0], 0


def _consistent_blocks(
    run: _Run, frames: Sequence[FrameStatistics]
) -> tuple[list[Block], StageResult]:
    """Return blocks of topologically consistent frames (sections 5.2 and 5.3.1)."""

    def hull(frame: FrameStatistics) -> FramePalette:
        return frame_hulls.frame_palette(frame.coarse, run.gamut, run.options)

    with concurrent.futures.ThreadPoolExecutor(thread_count(run.options)) as pool:
        palettes = list(run.counted("frame_hulls", pool.map(hull, frames), len(frames)))
    pairs = (glue.glue(a, b) for a, b in itertools.pairwise(palettes))
    glued = list(run.counted("glue", pairs, len(frames) - 1))
    links = [g.links if g.consistent else None for g in glued]
    blocks = block_merging.initial_blocks(frames, palettes, links, run.options)
    times = [f.frame for f in frames]
    dense = DensePolytope(times, [[p] for p in palettes], [g.links for g in glued]).polytope()
    losses = losses_of(dense, frames, run.options)
    return blocks, StageResult("frame_hulls", len(dense.vertices), len(blocks), losses)


def _glued(
    frames: Sequence[FrameStatistics], blocks: Sequence[Block]
) -> tuple[DensePolytope, tuple[str, ...]]:
    """Return the polytope of a configuration of blocks, and notes about the edges between them."""
    ends = [(a.palettes[-1], b.palettes[0]) for a, b in itertools.pairwise(blocks)]
    glued = [glue.glue(a, b) for a, b in ends]
    dense = DensePolytope(
        [f.frame for f in frames],
        [b.palettes for b in blocks],
        [g.links for g in glued],
        [glue.transition_faces(a, b, g.links) for (a, b), g in zip(ends, glued, strict=True)],
    )
    notes = []
    boundaries = counted(len(glued), "block boundary", "block boundaries")
    if broken := sum(g.broken > 0 for g in glued):
        notes.append(
            f"at {broken} of {boundaries} no set of edges obeys topological rule 2; the mesh "
            "between the two frames is the nearest one"
        )
    if partial := sum(not g.complete for g in glued):
        notes.append(
            f"at {partial} of {boundaries} the search for edges ended early; with a smaller "
            f"{Arg('palette_size')} it sees every solution"
        )
    return dense, tuple(notes)


def _paper(run: _Run) -> SkewPolytope:
    """Sections 5.2 to 5.5 with the thresholds of the paper."""
    frames, gamut, options = run.frames, run.gamut, run.options
    blocks, first = _consistent_blocks(run, frames)
    run.stages.append(first)
    blocks = paper_thresholds.merge_blocks(
        blocks, frames, gamut, options, run.counter("block_merging")
    )
    dense, notes = _glued(frames, blocks)
    run.notes += notes
    run.record("block_merging", dense.polytope())
    paper_thresholds.remove_vertices(dense, frames, options, run.counter("vertex_removal"))
    polytope = dense.polytope()
    run.record("vertex_removal", polytope)
    polytope = paper_thresholds.refine_vertices(
        polytope, frames, gamut, options, run.counter("vertex_refinement")
    )
    run.record("vertex_refinement", polytope)
    return polytope


def _static(run: _Run) -> SkewPolytope:
    """One palette for the whole clip (section 6.2): that of the least price."""
    polytope = min(run.ladder, key=lambda rung: rung.price(structure_search.USUAL_COST)).polytope
    run.report("static_hull", 1, 1)
    run.record("static_hull", polytope)
    return polytope


def _rgbt(run: _Run) -> SkewPolytope:
    """The simplified convex hull in RGB and time (section 6.2)."""
    most = run.options.vertices or rgbt_hull.VERTICES
    polytope = rgbt_hull.rgbt_polytope(run.frames, run.gamut, most, run.counter("rgbt_hull"))
    run.record("rgbt_hull", polytope)
    return polytope
