"""A palette at one time, and its colour nearest to a colour that the user sees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.message import Arg
from palette4d.grade.edits import Colour

#: Distance in code values above which edits of a palette colour hardly change another colour.
FAR = 0.25


@dataclass(frozen=True)
class Palette:
    """The palette at one time (eq. 5): n colours, and m triangles between them.

    Attributes
    ----------
    frame : float
        The time; frames outside the clip use its first or last frame.
    ids : tuple of str
        The id to edit for each colour: its vertex if it lies on one, else its edge.
    rgb, edited : (n, 3) float64
        The colours as analysed and as edited, in the palette's code values.
    faces : (m, 3) int32
        Triangles of indices into `rgb`, anticlockwise from outside; none for one or two colours.
    ends : tuple of (str, str)
        The vertices before and after each colour in time; the same twice if it lies on a vertex.
    weights : (n,) float64
        The share of the vertex after it, 0..1 (eq. 6).
    """

    frame: float
    ids: tuple[str, ...]
    rgb: NDArray[np.float64]
    edited: NDArray[np.float64]
    faces: NDArray[np.int32]
    ends: tuple[tuple[str, str], ...]
    weights: NDArray[np.float64]

    def nearest(self, colour: Colour, id: str | None = None) -> tuple[int, float]:
        """Return the index of the edited colour nearest to a colour, and their RGB distance.

        With an id, of that colour.
        """
        distances = np.linalg.norm(self.edited - np.asarray(colour), axis=1)
        index = int(np.argmin(distances)) if id is None else self.ids.index(id)
        return index, float(distances[index])

    def shares(self, colour: Colour) -> list[tuple[str, float]]:
        """Return the mean value weights of the edited colours in a colour, largest first."""
        weights, _ = _core.palette_weights([colour], self.edited, self.faces)
        named = zip(self.ids, weights[0].tolist(), strict=True)
        return sorted(named, key=lambda share: -share[1])


@dataclass(frozen=True)
class Near:
    """The palette colour nearest to a colour that the user sees, and the handle to edit.

    Attributes
    ----------
    id : str
        The vertex or edge that the palette colour lies on.
    handle : str or None
        The existing vertex or stop; None: the edit needs a new stop on edge `id`.
    rgb, distance : 3 floats and float
        The edited palette colour, and its distance to the given colour, in RGB code values.
    shares : list of (str, float)
        `Palette.shares` of the given colour.
    """

    frame: float
    id: str
    handle: str | None
    rgb: Colour
    distance: float
    shares: list[tuple[str, float]]

    def refusal(self, wanted: Colour) -> str:
        """Return the error message if this palette colour is too far from the given colour."""
        shown = ", ".join(f"{value:.4g}" for value in wanted)
        there = ", ".join(f"{value:.4g}" for value in self.rgb)
        mixed = ", ".join(f"{part:.0%} {id_}" for id_, part in self.shares[:5] if part >= 0.005)
        return (
            f"found no palette colour within {FAR:g} of ({shown}) at frame {self.frame:g}: pixels "
            f"of this colour are a mix of {mixed}. Edit one of these by its id, or pass "
            f"{Arg('anyway', True)} to edit the nearest, {self.id} at ({there}), "
            f"{self.distance:.3f} away"
        )


def palette_at(sidecar: _core.Sidecar, frame: float) -> Palette:
    """Return the palette of a sidecar at a time."""
    polytope = sidecar.polytope
    cut = _core.slice_at(polytope, frame)
    vertices, edges = polytope.vertex_ids, polytope.edge_ids
    ends = tuple((vertices[a], vertices[b]) for a, b in cut.ends.tolist())
    return Palette(
        frame=cut.frame,
        ids=tuple(
            end[0] if edge < 0 else edges[edge]
            for edge, end in zip(cut.edges.tolist(), ends, strict=True)
        ),
        rgb=cut.rgb,
        edited=_core.edited_colours(polytope, sidecar.edits, cut),
        faces=cut.faces,
        ends=ends,
        weights=cut.weights,
    )
