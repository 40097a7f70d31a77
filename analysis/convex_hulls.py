"""Convex hulls of colours, as meshes and as planes, and the concavity of meshes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_statistics import CODE_STEP, FrameStatistics
from palette4d.analysis.polytope import FramePalette, SkewPolytope
from scipy.spatial import ConvexHull, QhullError

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

# Tolerance for flat colours: their distance from a plane, a line or a point.
THIN = CODE_STEP / 2
# Threshold of a slice that is not convex: the share of its convex hull that it lacks. Smaller
# values report folds that no gradient shows.
CONCAVE = 0.05
# Least extent of a frame's colours, in code values of one channel, for judging a slice's shape.
NARROW = 0.24


def hull_mesh(points: F64) -> FramePalette:
    """Return the vertices and outward triangles of the convex hull of (n, 3) points.

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
    a, b, c = (rgb[faces[:, i]] for i in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    return FramePalette(rgb, faces.astype(np.int32))


def two_sided(polygon: NDArray[np.integer[Any]]) -> I32:
    """Return the triangles of the front and back of a flat polygon, (n,) corners in order."""
    n = len(polygon)
    front = [(0, i, i + 1) for i in range(1, n - 1)]
    # The back is a fan from the next corner: the two sides must not share a diagonal.
    back = [(1, (i + 2) % n, (i + 1) % n) for i in range(1, n - 1)]
    faces: I32 = polygon[np.array(front + back)].astype(np.int32)
    return faces


def concavity(rgb: F64, faces: I32) -> float:
    """Return the share of its convex hull that a mesh lacks; 0 for a hull that is nearly flat."""
    volume = hull_volume(rgb)
    if volume == 0 or len(faces) == 0:
        return 0.0
    # A mesh turned inside out has a negative volume, so it lacks its whole hull.
    return float(np.clip(1 - mesh_volume(rgb, faces) / volume, 0.0, 1.0))


def hull_volume(rgb: F64) -> float:
    """Return the volume of the convex hull of (n, 3) colours; 0 if it is nearly flat."""
    if len(rgb) < 4:
        return 0.0
    try:
        hull = ConvexHull(rgb)
    except QhullError:
        return 0.0
    flat = hull.volume <= 2 * CODE_STEP * hull.area / 2  # its mean thickness: two steps
    return 0.0 if flat else float(hull.volume)


def mesh_volume(rgb: F64, faces: I32) -> float:
    """Return the volume inside a closed mesh, negative if it is turned inside out."""
    (a, b, c), (d, e, f), (g, h, i) = (rgb - rgb[0])[faces].T
    return float((a * (e * i - f * h) + d * (h * c - b * i) + g * (b * f - c * e)).sum()) / 6


def deepest_concavity(polytope: SkewPolytope, frames: Iterable[FrameStatistics]) -> float:
    """Return the largest share of its hull that a slice lacks; `narrow` frames are skipped."""
    slices = {
        (index, rgb.tobytes()): (rgb, block.faces)  # a static palette has one
        for frame in frames
        for index, block in enumerate(polytope.blocks)
        if block.first <= frame.frame <= block.last and not narrow(frame)
        for rgb in (polytope.colours_at(block, frame.frame),)
    }
    return max((concavity(rgb, faces) for rgb, faces in slices.values()), default=0.0)


def narrow(frame: FrameStatistics) -> bool:
    """Return whether a frame, such as a black one, has too few colours to judge a shape by."""
    return float(np.max(frame.high - frame.low)) < NARROW
