"""A sliced polyhedral palette in the RGB cube, with the frame's pixels inside it.

A parallel projection of the cube on its black corner. Bright colours are above dark colours, warm
hues to the right, cold hues to the left, green in front. The drawing order is from far to near:
cube, far faces and edges, pixels, near faces and edges, palette colours.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.plotting import style
from palette4d.plotting.timeline import disc

F64 = NDArray[np.float64]

#: The corners of the RGB cube; bit 0, 1, 2 of the index: red, green, blue.
CORNERS = np.array([[i >> 0 & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.float64)


def _axes() -> F64:
    """Return the (3, 3) matrix from RGB to right, up and towards the viewer."""
    # Right-handed: blue to red and yellow, magenta to green (towards the viewer), grey up.
    warm, front, grey = np.array([[1, 0, -1], [-1, 2, -1], [1, 1, 1]]) / np.sqrt([[2], [6], [3]])
    azimuth, elevation = np.radians([-14.0, 9.0])
    across = warm * np.cos(azimuth) + front * np.sin(azimuth)
    towards = front * np.cos(azimuth) - warm * np.sin(azimuth)
    up = grey * np.cos(elevation) - towards * np.sin(elevation)
    return np.stack([across, up, towards * np.cos(elevation) + grey * np.sin(elevation)])


AXES = _axes()


@dataclass(frozen=True)
class View:
    """A parallel projection: the RGB cube's middle in points, and points per unit of colour."""

    centre: F64
    scale: float

    @classmethod
    def fit(cls, colours: F64, centre: tuple[float, float], size: float) -> "View":
        """Return the largest view in which (k, 3) colours fit a square of `size` points."""
        points = cls(np.zeros(2), 1.0).project(colours)[:, :2]
        low, high = points.min(axis=0), points.max(axis=0)
        scale = size / float((high - low).max())
        return cls(np.asarray(centre) - (low + high) / 2 * scale, scale)

    def project(self, rgb: F64) -> F64:
        """Return (n, 3): points on the page, and depths, larger is nearer."""
        seen = (np.asarray(rgb, dtype=np.float64) - 0.5) @ AXES.T
        seen[:, :2] = seen[:, :2] * self.scale + self.centre
        return seen


@dataclass(frozen=True)
class Shape:
    """A slice: (n, 3) colours before and after, (f, 3) faces, and optionally (p, 3) pixels."""

    rgb: F64
    edited: F64
    faces: NDArray[np.int32]
    pixels: F64 | None = None


def extent_of(shapes: list[Shape]) -> F64:
    """Return the colours that a view has to hold: the RGB cube and every palette colour."""
    return np.concatenate([CORNERS, *(s.rgb for s in shapes), *(s.edited for s in shapes)])


def draw(axes: Any, shape: Shape, view: View, encoding: str) -> None:
    """Draw one polyhedron."""
    from matplotlib.collections import LineCollection, TriMesh
    from matplotlib.tri import Triangulation

    _draw_cube(axes, view)
    seen = view.project(shape.rgb)
    points, faces = seen[:, :2], shape.faces
    # A face is a near face if it is anticlockwise on the page.
    u, v = (points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2))
    towards = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0
    colours = style.shown(shape.rgb, encoding)
    for side, alpha, zorder in ((~towards, 0.20, 4.0), (towards, 0.13, 6.0)):
        if side.any():
            gradient = TriMesh(
                Triangulation(points[:, 0], points[:, 1], faces[side]), rasterized=True
            )
            gradient.set(facecolor=np.insert(colours, 3, alpha, axis=1), zorder=zorder)
            axes.add_collection(gradient, autolim=False)

    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    near = {tuple(edge) for edge in sides[np.tile(towards, 3)].tolist()}
    edges = sorted({tuple(edge) for edge in sides.tolist()})
    if not edges and len(points) == 2:  # a palette of two colours: a line
        edges, near = [(0, 1)], {(0, 1)}
    edge_styles = ((style.GUIDE, 0.7, 4.5), (style.TEXT, 1.0, 7.0))
    for edge in edges:
        colour, width, zorder = edge_styles[edge in near]
        axes.plot(*points[list(edge)].T, color=colour, linewidth=width, zorder=zorder)

    if shape.pixels is not None and len(shape.pixels):
        cloud = view.project(shape.pixels)
        order = np.argsort(cloud[:, 2], kind="stable")
        at, seen_as = cloud[order], style.shown(shape.pixels[order], encoding)
        axes.scatter(*at[:, :2].T, s=1.6, c=seen_as, linewidths=0, zorder=5, rasterized=True)

    # Edited colours: an arrow to each, and dashed edges.
    after = view.project(shape.edited)[:, :2]
    moved = np.flatnonzero((shape.rgb != shape.edited).any(axis=1)).tolist()
    dashed = [after[list(edge)] for edge in edges if set(edge) & set(moved)]
    outline = LineCollection(dashed, colors=style.BRIGHT, linewidths=0.8, zorder=7.5)
    outline.set(linestyle=(0, (3, 2.4)), alpha=0.75)
    axes.add_collection(outline, autolim=False)
    arrow: dict[str, Any] = {
        "arrowstyle": "-|>,head_width=0.28,head_length=0.5",
        "color": style.BRIGHT,
    }
    arrow |= {"linewidth": 1.2, "shrinkA": 6, "shrinkB": 0}
    for index in moved:
        axes.annotate("", xy=after[index], xytext=points[index], arrowprops=arrow, zorder=8)
    both = np.stack([colours, style.shown(shape.edited, encoding)], axis=1)
    for index in np.argsort(seen[:, 2], kind="stable"):
        kind, radius = ("edited", 6.5) if index in moved else ("plain", 5.0)
        x, y = points[index].tolist()
        disc(axes, x, y, radius, both[index], kind, 9)


def _draw_cube(axes: Any, view: View) -> None:
    corners = view.project(CORNERS)
    farthest = int(np.argmin(corners[:, 2]))
    for a in range(8):
        for b in (a | 1, a | 2, a | 4):
            hidden = farthest in (a, b)
            how = {"color": style.LINE, "linestyle": (0, (2, 3))} if hidden else {}
            line = {"color": style.GUIDE, "linewidth": 0.6, "zorder": 3, **how}
            if a != b:
                axes.plot(*corners[[a, b], :2].T, **line)
    for bit, name in ((1, "R"), (2, "G"), (4, "B")):
        away = corners[bit, :2] - corners[0, :2]
        at = corners[bit, :2] + 9 * away / max(float(np.linalg.norm(away)), 1e-9)
        axes.text(*at, name, zorder=3, **style.CENTRED | {"fontsize": 7.5})
