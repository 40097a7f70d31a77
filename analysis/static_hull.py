"""One palette for the whole clip: the static, refined RGB hull of section 6.2.

Input: the colours of all frames. Output: `SkewPolytope`s of one block whose colours do not change.
Each colour has one vertex at the first and one at the last frame, the keyframes of section 6.2.
Refinement uses the loss of evenly spaced frames (eq. 8). `ladder` is a start of the search: static
palettes of fewer and fewer colours.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.convex_hulls import THIN, hull_mesh
from palette4d.analysis.frame_hulls import refined, simple_hull
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut, pooled
from palette4d.analysis.losses import NO_FACES, shaped_weights
from palette4d.analysis.moves import COLOURS_TRIED, LEAST_COLOURS
from palette4d.analysis.objective import frame_losses, refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette, Section, SkewPolytope

from palette4d import _core

F64 = NDArray[np.float64]
#: Colours, and their `simple_hull`.
Start = tuple[_core.ColourTree, F64 | FramePalette]

STEPS = 30
# The colours of these evenly spaced frames decide.
EVEN_FRAMES = 24
# All frames together keep this many times the coarse colours of one frame.
POOLED = 2
# Static hulls start from all of these colours, a half, a quarter.
STARTS = 3


def starts(frames: Sequence[FrameStatistics], options: AnalysisOptions) -> list[Start]:
    """Return the starts of all static palettes."""
    colours = [pooled([f.coarse for f in frames], POOLED * options.coarse_colours)]
    while len(colours) < STARTS:
        colours.append(pooled(colours[-1:], max(1, len(colours[-1]) // 2)))
    return [(tree, simple_hull(tree, options)) for tree in colours]


def static_hulls(
    begin: Sequence[Start],
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> Iterator[SkewPolytope]:
    """Yield refined static palettes from several starts."""
    for colours, simple in begin:
        yield static_polytope(refined(colours, simple, gamut, options), frames, gamut, options)


def plain_hulls(
    begin: Sequence[Start],
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> Iterator[SkewPolytope]:
    """Yield static palettes of no more than `vertices`, refined for the paper's loss."""
    for plain in plain_options(options):
        for hull in static_hulls(begin[:1], frames, gamut, plain):
            if not options.vertices or len(hull.vertices) <= options.vertices:
                yield hull


def plain_options(options: AnalysisOptions) -> Iterator[AnalysisOptions]:
    """Yield options with wide boxes and without shape terms. Each is by far the best on some clips.

    The second keeps `convexity`; the third starts farther from the simplified hull.
    """
    for convexity, start in ((0.0, 1.0), (options.convexity, 1.0), (0.0, 2.0)):
        yield dataclasses.replace(
            options,
            convexity=convexity,
            separation=0.0,
            reach=0.0,
            merge_distance=0.0,
            hull_box=start * options.hull_box,
            refinement_box=max(options.refinement_box, 2 * options.hull_box),
        )


def static_polytope(
    palette: FramePalette, frames: Sequence[FrameStatistics], gamut: Gamut, options: AnalysisOptions
) -> SkewPolytope:
    """Return the palette, refined, as a polytope that does not change with time."""
    some = [*frames[: -1 : -(-len(frames) // EVEN_FRAMES)], frames[-1]]
    still, _ = refine_jointly(_still(palette, some), some, gamut, options, STEPS, coarse=True)
    rgb = still.vertices[:, :3]
    return _lasting(FramePalette(rgb, _unfolded(rgb, palette.faces)), frames)


def ladder(
    begin: Start, frames: Sequence[FrameStatistics], gamut: Gamut, options: AnalysisOptions
) -> Iterator[SkewPolytope]:
    """Yield static palettes from `palette_size` colours down to four.

    Each lacks one colour of the one before. Of two such ladders, without `convexity` and with it,
    the better palette of each number of colours is yielded. Colours that do not get to a corner of
    the palette go too. Nothing is yielded for colours without volume.
    """
    colours, _ = begin
    simple = simple_hull(colours, options, options.palette_size)
    if isinstance(simple, FramePalette):
        return
    first = refined(colours, simple, gamut, dataclasses.replace(options, merge_distance=0.0)).rgb
    roomy = dataclasses.replace(options, refinement_box=2 * options.refinement_box)
    weights = shaped_weights(options, gamut.scale, faces=False)

    def bare(rgb: F64) -> SkewPolytope:
        return _still(FramePalette(rgb, NO_FACES), frames)

    def loss(rgb: F64) -> float:
        some = range(0, len(frames), 2)
        rows = frame_losses(bare(rgb), frames, some, weights, options, coarse=True)
        return float((options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2]).sum())

    def rungs(start: Callable[[F64], SkewPolytope]) -> Iterator[FramePalette]:
        poorer = [first]
        while poorer:
            tried = [start(rgb) for rgb in sorted(poorer, key=loss)[:COLOURS_TRIED]]
            moved = (refine_jointly(p, frames, gamut, roomy, STEPS, coarse=True) for p in tried)
            found, _ = min(moved, key=lambda one: one[1])
            palette = hull_mesh(found.vertices[:, :3])
            yield palette
            count = len(palette.rgb) if len(palette.rgb) > LEAST_COLOURS else 0
            poorer = [np.delete(palette.rgb, i, axis=0) for i in range(count)]

    # With faces, `convexity` keeps colours from falling into the solid, where they are lost.
    best: dict[int, FramePalette] = {}
    for start in (bare, lambda rgb: _still(hull_mesh(rgb), frames)):
        for palette in rungs(start):
            other = best.setdefault(len(palette.rgb), palette)
            best[len(palette.rgb)] = min(other, palette, key=lambda one: loss(one.rgb))
    for _, palette in sorted(best.items(), reverse=True):
        yield _lasting(palette, frames)


def _still(palette: FramePalette, frames: Sequence[FrameStatistics]) -> SkewPolytope:
    """Return a palette as tracks of one vertex: constant colours."""
    first, count = float(frames[0].frame), len(palette.rgb)
    tracks = tuple((i,) for i in range(count))
    section = Section(first, float(frames[-1].frame), tracks, palette.faces)
    return SkewPolytope(np.column_stack([palette.rgb, np.full(count, first)]), (section,), ())


def _lasting(palette: FramePalette, frames: Sequence[FrameStatistics]) -> SkewPolytope:
    """Return a palette as tracks with a vertex in the first and one in the last frame."""
    still, last, count = _still(palette, frames), float(frames[-1].frame), len(palette.rgb)
    if last == still.blocks[0].first:
        return still
    ends = still.vertices.copy()
    ends[:, 3] = last
    tracks = tuple((i, count + i) for i in range(count))
    section = dataclasses.replace(still.blocks[0], tracks=tracks)
    return SkewPolytope(np.vstack([still.vertices, ends]), (section,), ())


def _unfolded(rgb: F64, faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the faces of the colours' convex hull, if every colour is a corner of it.

    The losses measure the convex hull only: without `convexity` the mesh may fold.
    """
    spread = np.linalg.svd(rgb - rgb.mean(axis=0), compute_uv=False)
    if len(rgb) < 4 or spread[2] < THIN:
        return faces
    mesh = hull_mesh(rgb)
    return mesh.faces if len(mesh.rgb) == len(rgb) else faces
