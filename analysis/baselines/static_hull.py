"""One palette for the whole clip, as section 6.2 compares with: a static, refined RGB hull.

Input: the palette of all frames' pixels taken together. Output: a `SkewPolytope` of one block whose
colours do not change; each has a vertex at the first and one at the last frame, the two keyframes
of section 6.2. It is refined against the loss of every frame (eq. 8).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_hulls import THIN, hull_mesh
from palette4d.analysis.objective import refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette, Section, SkewPolytope
from palette4d.analysis.statistics import FrameStatistics

F64 = NDArray[np.float64]

EVALUATIONS = 100


def plain(options: AnalysisOptions) -> Iterator[AnalysisOptions]:
    """Yield options of hulls of `palette_size` colours for the paper's loss, without our terms and
    in wide boxes: one, one kept as convex as asked for, and one that starts farther from where
    simplification left it. On each of the clips tried, one of the three is the best by far."""
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
    palette: Palette,
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
) -> SkewPolytope:
    """Return the palette, refined, as a polytope that does not change with time."""
    first, last = float(statistics[0].frame), float(statistics[-1].frame)
    count = len(palette.rgb)
    # A track of one vertex is a colour that stays: what moves is the palette of all frames.
    still = SkewPolytope(
        np.column_stack([palette.rgb, np.full(count, first)]),
        (Section(first, last, tuple((i,) for i in range(count)), palette.faces),),
        (),
    )
    still, _ = refine_jointly(still, statistics, low, high, options, EVALUATIONS, coarse=True)
    faces = _unfolded(still.vertices[:, :3], palette.faces)
    if first == last:
        return dataclasses.replace(
            still, blocks=(dataclasses.replace(still.blocks[0], faces=faces),)
        )
    ends = still.vertices.copy()
    ends[:, 3] = last
    tracks = tuple((i, count + i) for i in range(count))
    return SkewPolytope(
        np.vstack([still.vertices, ends]), (Section(first, last, tracks, faces),), ()
    )


def _unfolded(rgb: F64, faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the faces of the colours' convex hull, if all of them are its corners: the losses see
    that alone, and without `convexity` a mesh may fold while its colours move."""
    spread = np.linalg.svd(rgb - rgb.mean(axis=0), compute_uv=False)
    if len(rgb) < 4 or spread[2] < THIN:
        return faces
    mesh = hull_mesh(rgb)
    return mesh.faces if len(mesh.rgb) == len(rgb) else faces
