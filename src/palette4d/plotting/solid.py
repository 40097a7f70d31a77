"""The RGB solid as plain numbers: the projection, near and far faces, concavities and flips.

`palette4d plot` and the window draw the same solid. Bright colours are above dark colours, warm
hues to the right, cold hues to the left, green in front.
"""

import functools
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

#: The corners of the RGB cube; bit 0, 1, 2 of the index: red, green, blue.
CORNERS = np.array([[i >> 0 & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], dtype=np.float64)
#: The cube's edges, pairs of corners.
CUBE = [(a, a | bit) for a in range(8) for bit in (1, 2, 4) if not a & bit]
#: Degrees: how the picture looks at the cube.
AZIMUTH, ELEVATION = -14.0, 9.0
#: A face bends inwards if a neighbour's corner is this far above it, in code values.
BENT = 1e-4


def axes_of(azimuth: float, elevation: float) -> F64:
    """Return the (3, 3) matrix from RGB to right, up and towards the viewer; angles in degrees."""
    # Right-handed: blue to red and yellow, magenta to green (towards the viewer), grey up.
    warm, front, grey = np.array([[1, 0, -1], [-1, 2, -1], [1, 1, 1]]) / np.sqrt([[2], [6], [3]])
    turn, tilt = np.radians([azimuth, elevation])
    across = warm * np.cos(turn) + front * np.sin(turn)
    towards = front * np.cos(turn) - warm * np.sin(turn)
    up = grey * np.cos(tilt) - towards * np.sin(tilt)
    return np.stack([across, up, towards * np.cos(tilt) + grey * np.sin(tilt)])


@dataclass(frozen=True)
class View:
    """A parallel projection of the RGB cube; y is up.

    Attributes
    ----------
    centre : (2,) float64
        The drawing's point of the cube's middle.
    scale : float
        The drawing's units per unit of colour.
    axes : (3, 3) float64
        Rows: right, up, towards the viewer.
    """

    centre: F64
    scale: float
    axes: F64 = field(default_factory=lambda: axes_of(AZIMUTH, ELEVATION))

    @classmethod
    def fit(cls, colours: F64, centre: tuple[float, float], size: float) -> "View":
        """Return the largest view in which (k, 3) colours fit a square of `size`."""
        points = cls(np.zeros(2), 1.0).project(colours)[:, :2]
        low, high = points.min(axis=0), points.max(axis=0)
        scale = size / float((high - low).max())
        return cls(np.asarray(centre) - (low + high) / 2 * scale, scale)

    def turned(self, azimuth: float, elevation: float) -> "View":
        """Return the same view from another side."""
        return replace(self, axes=axes_of(azimuth, elevation))

    def project(self, rgb: F64) -> F64:
        """Return (n, 3): points, and depths, larger is nearer."""
        seen = (np.asarray(rgb, dtype=np.float64) - 0.5) @ self.axes.T
        seen[:, :2] = seen[:, :2] * self.scale + self.centre
        return seen

    def in_plane(self, dx: float, dy: float) -> F64:
        """Return the (3,) change of colour for a move of a point in the plane of the drawing."""
        moved: F64 = (self.axes[0] * dx + self.axes[1] * dy) / self.scale
        return moved

    def along(self, channel: int, dx: float, dy: float) -> F64:
        """Return the (3,) change of one channel that follows a move of a point best."""
        seen = self.axes[:2, channel] * self.scale
        length = max(float(seen @ seen), (0.15 * self.scale) ** 2)  # an axis seen from its end
        result = np.zeros(3)
        result[channel] = float(seen @ [dx, dy]) / length
        return result


@dataclass(frozen=True)
class Shape:
    """A slice: (n, 3) colours before and after, (f, 3) faces, and optionally (p, 3) pixels."""

    rgb: F64
    edited: F64
    faces: NDArray[np.int32]
    pixels: F64 | None = None

    @functools.cached_property
    def edges(self) -> I64:
        """The (e, 2) edges; the line between them for two colours."""
        if not len(self.faces):
            return np.array([[0, 1]] if len(self.rgb) == 2 else []).reshape(-1, 2).astype(np.int64)
        return edges_of(self.faces)[0]


def extent_of(shapes: list[Shape]) -> F64:
    """Return the colours that a view has to hold: the RGB cube and every palette colour."""
    return np.concatenate([CORNERS, *(s.rgb for s in shapes), *(s.edited for s in shapes)])


def even_sample(image: NDArray[np.float32], most: int) -> F64:
    """Return at most (most, 3) finite colours of an image, evenly chosen."""
    flat = image.reshape(-1, image.shape[-1])[:, :3]
    # A golden-ratio sequence picks evenly without following rows or columns.
    picked = np.arange(min(most, len(flat))) * 0.6180339887498949 % 1 * len(flat)
    colours = flat[picked.astype(np.int64)].astype(np.float64)
    return colours[np.isfinite(colours).all(axis=1)]


def facing(points: F64, faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return which faces are near: anticlockwise in the drawing, with y up; (f,)."""
    u, v = (points[faces[:, k]] - points[faces[:, 0]] for k in (1, 2))
    return np.asarray(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] > 0)


def edges_of(faces: NDArray[np.int32]) -> tuple[I64, I64]:
    """Return the (e, 2) edges of a closed mesh, and the (e, 2) faces beside each; -1: none."""
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    count = int(faces.max()) + 1
    codes, which = np.unique(sides.astype(np.int64) @ [count, 1], return_inverse=True)
    edges = np.stack(np.divmod(codes, count), axis=1)
    beside = np.full((len(edges), 2), -1, dtype=np.int64)
    for side, edge in enumerate(which.tolist()):
        beside[edge, 1 if beside[edge, 0] >= 0 else 0] = side % len(faces)
    return edges, beside


def concave(rgb: F64, faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return which edges of `edges_of` bend inwards, (e,)."""
    edges, beside = edges_of(faces)
    result = np.zeros(len(edges), dtype=bool)
    inner = np.flatnonzero((beside >= 0).all(axis=1))
    first, second = faces[beside[inner, 0]], faces[beside[inner, 1]]
    a, b, c = np.moveaxis(rgb[first], 1, 0)
    normal = np.cross(b - a, c - a)
    # The other face's corner that is not on the edge.
    apex = second.sum(axis=1) - edges[inner].sum(axis=1)
    height = ((rgb[apex] - a) * normal).sum(axis=1)
    result[inner] = height / np.maximum(np.linalg.norm(normal, axis=1), 1e-12) > BENT
    return result


def flipped(before: F64, after: F64, faces: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return which faces an edit turns inside out, seen from the middle of the palette, (f,)."""

    def volume(rgb: F64) -> F64:
        a, b, c = np.moveaxis(rgb[faces] - rgb.mean(axis=0), 1, 0)
        return np.asarray((np.cross(a, b) * c).sum(axis=-1))

    first, second = volume(before), volume(after)
    return (first * second < 0) & (np.abs(second) > 1e-9)
