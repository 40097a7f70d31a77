"""What a timeline shows and where: a palette as arrays, and the panel with its rows and times.

The unit is the point (1/72 inch), y upwards.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core

F64 = NDArray[np.float64]


@dataclass
class Palette:
    """What is drawn: the polytope and its edits as arrays.

    Attributes
    ----------
    frames, rgb, edited : (n,), (n, 3), (n, 3) float64
        Time and colours of the vertices, before and after the edit.
    edges : list of (int, int)
        Vertex indices.
    stops : list of (str, int, float, (3,) array)
        Id, edge index, frame, edited colour.
    changed : (n,) bool array
        The vertex has an edited colour.
    """

    ids: list[str]
    frames: F64
    rgb: F64
    edited: F64
    changed: NDArray[np.bool_]
    edges: list[tuple[int, int]]
    edge_ids: list[str]
    stops: list[tuple[str, int, float, F64]]
    sections: list[dict[str, Any]]
    first: float
    last: float

    @classmethod
    def of(cls, sidecar: _core.Sidecar) -> "Palette":
        """Read the arrays from a sidecar."""
        polytope, edits = sidecar.polytope, sidecar.edits
        vertices = np.asarray(polytope.vertices, dtype=np.float64).reshape(-1, 4)
        edited = vertices[:, :3].copy()
        changed = np.zeros(len(vertices), dtype=bool)
        new_colours = edits.vertex_rgb
        for index, name in enumerate(polytope.vertex_ids):
            if name in new_colours:
                edited[index] = new_colours[name]
                changed[index] = True
        edge_ids = list(polytope.edge_ids)
        number = {name: index for index, name in enumerate(edge_ids)}
        stops = [
            (s["id"], number[s["edge"]], float(s["frame"]), np.asarray(s["rgb"], dtype=np.float64))
            for s in edits.stops
        ]
        return cls(
            ids=list(polytope.vertex_ids),
            frames=vertices[:, 3].copy(),
            rgb=vertices[:, :3].copy(),
            edited=edited,
            changed=changed,
            edges=[(int(a), int(b)) for a, b in np.asarray(polytope.edges).reshape(-1, 2)],
            edge_ids=edge_ids,
            stops=sorted(stops, key=lambda stop: (stop[1], stop[2])),
            sections=list(polytope.sections),
            first=float(polytope.first_frame),
            last=float(polytope.last_frame),
        )

    def before(self, edge: int, frames: F64) -> F64:
        """Return the original colours on an edge at (k,) times, (k, 3)."""
        start, end = self.edges[edge]
        knots = [self.frames[start], self.frames[end]]
        colours = np.stack([self.rgb[start], self.rgb[end]])
        return np.stack([np.interp(frames, knots, colours[:, c]) for c in range(3)], axis=-1)

    def after(self, edge: int, frames: F64) -> F64:
        """Return the edited colours on an edge at (k,) times, (k, 3): linear between stops."""
        start, end = self.edges[edge]
        inner = [stop for stop in self.stops if stop[1] == edge]
        knots = [self.frames[start], *(s[2] for s in inner), self.frames[end]]
        colours = np.stack([self.edited[start], *(s[3] for s in inner), self.edited[end]])
        return np.stack([np.interp(frames, knots, colours[:, c]) for c in range(3)], axis=-1)

    @property
    def edited_times(self) -> list[float]:
        """Return the frames of edited vertices and of stops."""
        return [float(t) for t in self.frames[self.changed]] + [stop[2] for stop in self.stops]

    def touched(self, edge: int) -> bool:
        """Whether anything on this edge is edited."""
        start, end = self.edges[edge]
        return bool(
            self.changed[start] or self.changed[end] or any(s[1] == edge for s in self.stops)
        )


@dataclass
class Frame:
    """Where the timeline stands on the page, in points, and how rows and times map onto it."""

    left: float
    right: float
    top: float
    first: float
    last: float
    rows: int
    row_height: float

    #: Room for the block names above the rows and for the axis below them.
    HEAD = 34.0
    FOOT = 34.0
    #: Room between the panel's sides and the first and last frame.
    SIDE = 46.0

    @property
    def height(self) -> float:
        """Return the height of the panel."""
        return self.HEAD + self.rows * self.row_height + self.FOOT

    @property
    def bottom(self) -> float:
        """Return the y of the panel's lower side."""
        return self.top - self.height

    @property
    def floor(self) -> float:
        """Return the y where the rows end and the axis begins."""
        return self.bottom + self.FOOT

    def x(self, frame: Any) -> Any:
        """Return the x of frame numbers; a clip of one frame stands in the middle."""
        low, high = self.left + self.SIDE, self.right - self.SIDE
        span = self.last - self.first
        if span <= 0:
            return np.zeros_like(np.asarray(frame, dtype=np.float64)) + (low + high) / 2
        return low + (np.asarray(frame, dtype=np.float64) - self.first) / span * (high - low)

    def y(self, row: Any) -> Any:
        """Return the y of a row's middle."""
        return self.top - self.HEAD - (np.asarray(row, dtype=np.float64) + 0.5) * self.row_height


def row_height(rows: int) -> float:
    """Return the height of a row in points: generous for few, tight for many."""
    return float(np.clip(1100.0 / max(rows, 1), 16.0, 50.0))
