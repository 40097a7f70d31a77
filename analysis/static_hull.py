"""One palette for the whole clip: the static, refined RGB hull of section 6.2.

Input: the colours of all frames. Output: `SkewPolytope`s of one block whose colours do not change.
Each colour has one vertex at the first and one at the last frame, the keyframes of section 6.2.
Refinement uses the loss of evenly spaced frames (eq. 8).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.convex_hulls import THIN, hull_mesh
from palette4d.analysis.frame_hulls import refined, simple_hull
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut, pooled
from palette4d.analysis.objective import refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette, Section, SkewPolytope

from palette4d import _core

F64 = NDArray[np.float64]
#: Colours, and their `simple_hull`.
Start = tuple[_core.ColourTree, F64 | FramePalette]

EVALUATIONS = 50
# The colours of these evenly spaced frames decide.
EVEN_FRAMES = 24
# All frames together keep this many times the coarse colours of one frame.
POOLED = 2
# Static hulls start from all of these colours, a half, a quarter.
STARTS = 3
# In shorter clips little moves and a static hull is hard to beat, so all starts are tried.
SHORT = 48


def starts(frames: Sequence[FrameStatistics], options: AnalysisOptions) -> list[Start]:
    """Return the starts of all static palettes."""
    colours = [
        pooled([f.coarse for f in frames], POOLED * options.coarse_colours // 2**start)
        for start in range(STARTS)
    ]
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
        some = begin if len(frames) < SHORT else begin[:1]
        for hull in static_hulls(some, frames, gamut, plain):
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
    first, last = float(frames[0].frame), float(frames[-1].frame)
    count = len(palette.rgb)

    def polytope(vertices: F64, tracks: Sequence[tuple[int, ...]]) -> SkewPolytope:
        return SkewPolytope(vertices, (Section(first, last, tuple(tracks), faces),), ())

    faces = palette.faces
    # A track of one vertex is a constant colour.
    still = polytope(
        np.column_stack([palette.rgb, np.full(count, first)]), [(i,) for i in range(count)]
    )
    some = [*frames[: -1 : -(-len(frames) // EVEN_FRAMES)], frames[-1]]
    still, _ = refine_jointly(still, some, gamut, options, EVALUATIONS, coarse=True)
    faces = _unfolded(still.vertices[:, :3], faces)
    if first == last:
        return polytope(still.vertices, still.blocks[0].tracks)
    ends = still.vertices.copy()
    ends[:, 3] = last
    return polytope(np.vstack([still.vertices, ends]), [(i, count + i) for i in range(count)])


def _unfolded(rgb: F64, faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the faces of the colours' convex hull, if every colour is a corner of it.

    The losses measure the convex hull only: without `convexity` the mesh may fold.
    """
    spread = np.linalg.svd(rgb - rgb.mean(axis=0), compute_uv=False)
    if len(rgb) < 4 or spread[2] < THIN:
        return faces
    mesh = hull_mesh(rgb)
    return mesh.faces if len(mesh.rgb) == len(rgb) else faces
