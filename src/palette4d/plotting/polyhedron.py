"""A sliced polyhedral palette in the RGB cube, with the frame's pixels inside it.

A parallel projection of the cube standing on its black corner, so that light colours are above dark
ones and hues spread sideways: warm to the right, cold to the left, green in front. Drawn from far
to near: cube, far faces and edges, pixels, near faces and edges, palette colours.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.plotting import style
from palette4d.plotting.discs import half_disc

F64 = NDArray[np.float64]

#: Samples per point of the faces' gradients.
FINENESS = 3.0


#: The corners of the RGB cube; bit 0, 1, 2 of the index: red, green, blue.
CORNERS = np.array([[i >> 0 & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.float64)


@dataclass(frozen=True)
class View:
    """A parallel projection of colours onto the page.

    Attributes
    ----------
    centre : (float, float)
        Where the middle of the RGB cube stands, in points.
    scale : float
        Points per unit of colour.
    """

    centre: tuple[float, float]
    scale: float

    AZIMUTH, ELEVATION = np.radians(-14.0), np.radians(9.0)

    @classmethod
    def fit(cls, colours: F64, centre: tuple[float, float], size: float) -> "View":
        """Return the view in which (k, 3) colours just fit a square of `size` points."""
        points, _ = cls((0.0, 0.0), 1.0).project(colours)
        scale = size / float(np.ptp(points, axis=0).max())
        middle = (points.max(axis=0) + points.min(axis=0)) / 2 * scale
        return cls((centre[0] - float(middle[0]), centre[1] - float(middle[1])), scale)

    def project(self, rgb: F64) -> tuple[F64, F64]:
        """Return (n, 2) points on the page and (n,) depths, larger is nearer."""
        centred = np.asarray(rgb, dtype=np.float64) - 0.5
        # Right-handed: from blue to red and yellow, from magenta to green (towards us), grey up.
        warm = (centred @ [1.0, 0.0, -1.0]) / np.sqrt(2.0)
        front = (centred @ [-1.0, 2.0, -1.0]) / np.sqrt(6.0)
        grey = (centred @ [1.0, 1.0, 1.0]) / np.sqrt(3.0)
        sine, cosine = np.sin(self.AZIMUTH), np.cos(self.AZIMUTH)
        across = warm * cosine + front * sine
        towards = front * cosine - warm * sine
        up = grey * np.cos(self.ELEVATION) - towards * np.sin(self.ELEVATION)
        depth = towards * np.cos(self.ELEVATION) + grey * np.sin(self.ELEVATION)
        points = np.stack([across, up], axis=-1) * self.scale + np.asarray(self.centre)
        return points, depth


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
    _draw_cube(axes, view)
    points, depth = view.project(shape.rgb)
    towards = _facing(points, shape.faces)
    _draw_faces(axes, shape, points, ~towards, encoding, alpha=0.20, zorder=4.0)
    _draw_edges(axes, points, shape.faces, towards)
    if shape.pixels is not None and len(shape.pixels):
        where, far = view.project(shape.pixels)
        order = np.argsort(far, kind="stable")
        axes.scatter(
            where[order, 0],
            where[order, 1],
            s=1.6,
            c=style.shown(shape.pixels[order], encoding),
            linewidths=0,
            zorder=5,
            rasterized=True,
        )
    _draw_faces(axes, shape, points, towards, encoding, alpha=0.13, zorder=6.0)
    _draw_edited(axes, shape, view, points)
    for index in np.argsort(depth, kind="stable"):
        changed = not np.array_equal(shape.rgb[index], shape.edited[index])
        half_disc(
            axes,
            float(points[index, 0]),
            float(points[index, 1]),
            6.5 if changed else 5.0,
            style.shown(shape.rgb[index], encoding),
            style.shown(shape.edited[index], encoding),
            kind="edited" if changed else "plain",
            zorder=9 + 0.1 * float(np.clip(depth[index], -4, 4)),
        )


def _draw_cube(axes: Any, view: View) -> None:
    points, depth = view.project(CORNERS)
    farthest = int(np.argmin(depth))
    for a in range(8):
        for bit in (1, 2, 4):
            b = a | bit
            if b == a:
                continue
            hidden = farthest in (a, b)
            axes.plot(
                points[[a, b], 0],
                points[[a, b], 1],
                color=style.LINE if hidden else style.GUIDE,
                linewidth=0.6,
                linestyle=(0, (2, 3)) if hidden else "-",
                zorder=3,
            )
    origin = points[0]
    for bit, name in ((1, "R"), (2, "G"), (4, "B")):
        away = points[bit] - origin
        away = away / max(float(np.linalg.norm(away)), 1e-9)
        axes.text(
            float(points[bit, 0] + away[0] * 9),
            float(points[bit, 1] + away[1] * 9),
            name,
            fontsize=7.5,
            color=style.FAINT,
            ha="center",
            va="center",
            zorder=3,
        )


def _facing(points: F64, faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which faces look at us: anticlockwise on the page when anticlockwise from outside."""
    if not len(faces):
        return np.zeros(0, dtype=bool)
    a, b, c = (points[faces[:, k]] for k in range(3))
    u, v = b - a, c - a
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0)


def _draw_faces(
    axes: Any,
    shape: Shape,
    points: F64,
    chosen: NDArray[np.bool_],
    encoding: str,
    *,
    alpha: float,
    zorder: float,
) -> None:
    """Draw faces as one picture with a gradient between each face's corners."""
    if not chosen.any():
        return
    low, high = points.min(axis=0), points.max(axis=0)
    across, up = np.maximum(np.ceil((high - low) * FINENESS).astype(int), 1)
    x = low[0] + (np.arange(across) + 0.5) / across * (high[0] - low[0])
    y = low[1] + (np.arange(up) + 0.5) / up * (high[1] - low[1])
    colour = np.zeros((up, across, 3))
    opaque = np.zeros((up, across))
    for face in shape.faces[chosen]:
        weights = _barycentric(points[face], x, y)
        if weights is None:
            continue
        inside = (weights >= 0).all(axis=-1)
        # A face over another one (a palette may be concave) hides it in part.
        covered = alpha + (1 - alpha) * opaque[inside]
        mixed = (1 - alpha) * opaque[inside][:, None] * colour[inside]
        mixed += alpha * (weights[inside] @ shape.rgb[face])
        colour[inside] = mixed / covered[:, None]
        opaque[inside] = covered
    axes.imshow(
        np.concatenate([style.shown(colour, encoding), opaque[..., None]], axis=-1),
        extent=(low[0], high[0], low[1], high[1]),
        origin="lower",
        aspect="auto",
        interpolation="auto",
        zorder=zorder,
    )


def _barycentric(corners: F64, x: F64, y: F64) -> F64 | None:
    """Return (len(y), len(x), 3) barycentric weights of a grid; None for a face seen edge on."""
    (ax, ay), (bx, by), (cx, cy) = corners
    area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    if abs(area) < 1e-9:
        return None
    gx, gy = x[None, :], y[:, None]
    b = ((gx - ax) * (cy - ay) - (cx - ax) * (gy - ay)) / area
    c = ((bx - ax) * (gy - ay) - (gx - ax) * (by - ay)) / area
    return np.stack([1 - b - c, b, c], axis=-1)


def _edges(faces: NDArray[np.int32]) -> dict[tuple[int, int], list[int]]:
    result: dict[tuple[int, int], list[int]] = {}
    for index, face in enumerate(faces):
        for k in range(3):
            a, b = sorted((int(face[k]), int(face[(k + 1) % 3])))
            result.setdefault((a, b), []).append(index)
    return result


def _draw_edges(
    axes: Any, points: F64, faces: NDArray[np.int32], towards: NDArray[np.bool_]
) -> None:
    from matplotlib.collections import LineCollection

    if not len(faces):
        if len(points) == 2:  # a palette of two colours: a line
            axes.plot(points[:, 0], points[:, 1], color=style.TEXT, linewidth=1.0, zorder=7)
        return
    near: list[F64] = []
    far: list[F64] = []
    for (a, b), sides in _edges(faces).items():
        line = points[[a, b]]
        (near if any(towards[s] for s in sides) else far).append(line)
    for lines, colour, width, zorder in (
        (far, style.GUIDE, 0.7, 4.5),
        (near, style.TEXT, 1.0, 7.0),
    ):
        if lines:
            axes.add_collection(
                LineCollection(lines, colors=colour, linewidths=width, zorder=zorder), autolim=False
            )


def _draw_edited(axes: Any, shape: Shape, view: View, points: F64) -> None:
    """Draw where edited colours went: a dashed outline of what moved, a line to each."""
    moved = np.flatnonzero((shape.rgb != shape.edited).any(axis=1))
    if not len(moved):
        return
    after, _ = view.project(shape.edited)
    for a, b in _edges(shape.faces):
        if a in moved or b in moved:
            axes.plot(
                after[[a, b], 0],
                after[[a, b], 1],
                color=style.BRIGHT,
                linewidth=0.8,
                linestyle=(0, (3, 2.4)),
                alpha=0.75,
                zorder=7.5,
            )
    for index in moved:
        axes.annotate(
            "",
            xy=tuple(after[index]),
            xytext=tuple(points[index]),
            arrowprops={
                "arrowstyle": "-|>,head_width=0.28,head_length=0.5",
                "color": style.BRIGHT,
                "linewidth": 1.2,
                "shrinkA": 6,
                "shrinkB": 0,
            },
            zorder=8,
        )
