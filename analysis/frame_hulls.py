"""Stage 1, section 5.2.1: a polyhedral palette for each frame.

Input: a frame's colours. Output: a `Palette`: at most `palette_size` colours and the triangles of
their convex hull. The convex hull of the colours is simplified (Tan et al. 2016), clipped to the
gamut, close colours are merged, and the vertices refined (Wang et al. 2019). Colours that fill no
volume give palettes of one colour, of two (a line), or flat two-sided polygons.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import colour_scale, palette_loss, refine_palette
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette
from scipy.spatial import ConvexHull, QhullError

from palette4d import _core

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

# Colours within half an 8-bit step of a plane, a line or a point fill nothing.
THIN = 0.5 / 255


def frame_palette(
    colours: _core.ColourTree, low: F64, high: F64, options: AnalysisOptions
) -> Palette:
    """Return the refined, simplified hull of a frame's colours, inside the gamut [low, high]."""
    flat = flat_palette(colours.rgb, options)
    if flat is not None:
        return flat
    close = options.merge_distance * colour_scale(low, high)
    mesh = hull_mesh(colours.rgb)
    simple = _core.progressive_hull(mesh.rgb, mesh.faces, options.palette_size)
    if len(simple) > options.palette_size:
        # No edge of a sliver-thin hull may be contracted: its extreme points do instead.
        simple = extreme_points(mesh.rgb, options.palette_size)
    palette = hull_mesh(merge_close(np.clip(simple, low, high), close))
    best, best_loss = palette, palette_loss(colours, palette.rgb, options)
    for _ in range(
        2
    ):  # refining may push a vertex inside; the second round starts from the new hull
        moved = refine_palette(colours, best.rgb, best.faces, low, high, options)
        palette = hull_mesh(merge_close(moved, close))
        loss = palette_loss(colours, palette.rgb, options)
        if loss >= best_loss and len(palette.rgb) >= len(best.rgb):
            break
        best, best_loss = palette, loss
    return best


def hull_mesh(points: F64) -> Palette:
    """Return the convex hull of (n, 3) points that fill a volume: its vertices and outward
    triangles.

    Raises
    ------
    scipy.spatial.QhullError
        When the points fill no volume.
    """
    try:
        hull = ConvexHull(points)
    except QhullError:
        hull = ConvexHull(points, qhull_options="QJ")
    used = np.unique(hull.simplices)
    faces = np.searchsorted(used, hull.simplices)
    rgb = points[used]
    a, b, c = rgb[faces[:, 0]], rgb[faces[:, 1]], rgb[faces[:, 2]]
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    return Palette(rgb, faces.astype(np.int32))


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


def flat_palette(points: F64, options: AnalysisOptions) -> Palette | None:
    """Return the palette of colours that fill no volume, or None when they do.

    One colour for a point, two for a line, a two-sided polygon of at most `palette_size` for a
    plane.
    """
    centre = points.mean(axis=0)
    _, vectors = np.linalg.eigh((points - centre).T @ (points - centre))
    axes = vectors.T[::-1]  # principal axes, longest first
    along = (points - centre) @ axes.T
    extent = np.ptp(along, axis=0)
    none: I32 = np.zeros((0, 3), np.int32)
    if extent[0] <= 2 * THIN:
        return Palette(centre[None], none)
    if extent[1] <= 2 * THIN:
        ends = [int(np.argmin(along[:, 0])), int(np.argmax(along[:, 0]))]
        return Palette(points[ends], none)
    if extent[2] > 2 * THIN:
        return None
    polygon: NDArray[np.int32] = ConvexHull(along[:, :2]).vertices  # anticlockwise
    while len(polygon) > max(3, options.palette_size):
        polygon = np.delete(polygon, _least_corner(along[polygon, :2]))
    n = len(polygon)
    front = [(0, i, i + 1) for i in range(1, n - 1)]
    # The back is a fan from the next corner: the two sides must not share a diagonal.
    back = [(1, (i + 2) % n, (i + 1) % n) for i in range(1, n - 1)]
    return Palette(points[polygon], np.array(front + back, np.int32))


def _least_corner(corners: F64) -> int:
    """Index of the polygon corner whose removal loses the least area."""
    before, after = np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners
    return int(np.argmin(np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])))
