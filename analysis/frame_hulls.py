"""Frame hulls, section 5.2.1: a polyhedral palette for each frame.

Input: the colours of a frame. Output: a `FramePalette` of at most `palette_size` colours and the
triangles of their convex hull. The convex hull of the colours is simplified (Tan et al. 2016) and
clipped to the gamut, close colours are merged, and the vertices refined (Wang et al. 2019). Colours
without volume give palettes of one colour, of two (a line), or flat two-sided polygons.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.convex_hulls import THIN, hull_mesh, two_sided
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.losses import NO_FACES, palette_loss, refine_palette
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette
from scipy.spatial import ConvexHull

from palette4d import _core

F64 = NDArray[np.float64]

# Most corners of a simplified hull: with more, neighbouring frames rarely merge.
MOST_CORNERS = 8


def frame_palette(
    colours: _core.ColourTree, gamut: Gamut, options: AnalysisOptions
) -> FramePalette:
    """Return the refined, simplified hull of a frame's colours, inside the gamut."""
    return refined(colours, simple_hull(colours, options), gamut, options)


def simple_hull(
    colours: _core.ColourTree, options: AnalysisOptions, most: int = MOST_CORNERS
) -> F64 | FramePalette:
    """Return at most `most` (n, 3) corners whose hull holds all colours, or the palette of flat
    colours."""
    rgb = colours.rgb
    most = min(most, options.palette_size)
    flat = flat_palette(rgb, most)
    if flat is not None:
        return flat
    mesh = hull_mesh(rgb)
    simple = _core.progressive_hull(mesh.rgb, mesh.faces, most)
    if len(simple) > most:
        # No edge of a sliver-thin hull can be contracted: use its extreme points instead.
        simple = extreme_points(mesh.rgb, most)
    return simple


def refined(
    colours: _core.ColourTree,
    simple: F64 | FramePalette,
    gamut: Gamut,
    options: AnalysisOptions,
) -> FramePalette:
    """Return the refined palette of a `simple_hull`."""
    if isinstance(simple, FramePalette):
        return simple
    least_distance = options.merge_distance * gamut.scale
    best = hull_mesh(merge_close(gamut.clip(simple), least_distance))
    best_loss = palette_loss(colours, best.rgb, options)
    # Refining may push a vertex inside the hull, so the second round starts from the new hull.
    for _ in range(2):
        moved = refine_palette(colours, best, gamut, options)
        palette = hull_mesh(merge_close(moved, least_distance))
        loss = palette_loss(colours, palette.rgb, options)
        if loss >= best_loss and len(palette.rgb) >= len(best.rgb):
            break
        best, best_loss = palette, loss
    return best


def extreme_points(points: F64, count: int) -> F64:
    """Return `count` of the (n, 3) points, each the farthest from those before it."""
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    while len(chosen) < min(count, len(points)):
        gaps = np.linalg.norm(points[:, None] - points[chosen][None], axis=2).min(axis=1)
        chosen.append(int(np.argmax(gaps)))
    return points[chosen]


def merge_close(points: F64, distance: float) -> F64:
    """Replace pairs of points closer than `distance` by their midpoint, closest pair first.

    Stops at four points, so that a solid palette stays solid.
    """
    points = points.copy()
    while len(points) > 4:
        gaps = np.linalg.norm(points[:, None] - points[None], axis=2)
        np.fill_diagonal(gaps, np.inf)
        i, j = np.unravel_index(np.argmin(gaps), gaps.shape)
        if gaps[i, j] >= distance:
            break
        merged = np.vstack([np.delete(points, [i, j], axis=0), (points[i] + points[j]) / 2])
        if np.linalg.svd(merged - merged.mean(axis=0), compute_uv=False)[2] < THIN:
            break
        points = merged
    return points


def flat_palette(points: F64, most: int) -> FramePalette | None:
    """Return the palette of colours without volume, or None when they have one.

    One colour for a point, two for a line, a two-sided polygon of at most `most` corners for
    a plane.
    """
    centre = points.mean(axis=0)
    _, vectors = np.linalg.eigh((points - centre).T @ (points - centre))
    axes = vectors.T[::-1]  # principal axes, longest first
    along = (points - centre) @ axes.T
    extent = np.ptp(along, axis=0)
    if extent[0] <= 2 * THIN:
        return FramePalette(centre[None], NO_FACES)
    if extent[1] <= 2 * THIN:
        ends = [int(np.argmin(along[:, 0])), int(np.argmax(along[:, 0]))]
        return FramePalette(points[ends], NO_FACES)
    if extent[2] > 2 * THIN:
        return None
    polygon: NDArray[np.int32] = ConvexHull(along[:, :2]).vertices  # anticlockwise
    while len(polygon) > max(3, most):
        polygon = np.delete(polygon, _least_corner(along[polygon, :2]))
    return FramePalette(points[polygon], two_sided(np.arange(len(polygon))))


def _least_corner(corners: F64) -> int:
    """Return the index of the polygon corner whose removal loses the least area."""
    before, after = np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners
    return int(np.argmin(np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])))
