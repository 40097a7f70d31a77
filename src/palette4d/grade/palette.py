"""A palette at one time, and which of its colours is nearest to one that the user sees there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.grade.edits import Colour

#: Palette colours further from the colour that was asked for hardly change it.
FAR = 0.25


@dataclass(frozen=True)
class Palette:
    """The palette at one time (eq. 5): n colours, and m triangles between them.

    Attributes
    ----------
    frame : float
        The time; frames outside the clip take its first or last.
    ids : tuple of str
        What to edit for each colour: a vertex where it lies on one, else the edge that it is on.
    rgb, edited : (n, 3) float64
        The colours as analysed and as edited, in the palette's code values.
    faces : (m, 3) int32
        Triangles of indices into `rgb`, anticlockwise from outside; none for one or two colours.
    ends : tuple of (str, str)
        The vertices before and after each colour in time; twice the same where it lies on one.
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

    def nearest(self, colour: Colour) -> tuple[int, float]:
        """Return the index of the edited colour nearest to this one, and their distance in RGB."""
        distances = np.linalg.norm(self.edited - np.asarray(colour), axis=1)
        index = int(np.argmin(distances))
        return index, float(distances[index])

    def shares(self, colour: Colour) -> list[tuple[str, float]]:
        """Return which edited colours make up this one, by mean value weights, largest first."""
        weights, _ = _core.palette_weights([colour], self.edited, self.faces)
        found = zip(self.ids, weights[0].tolist(), strict=True)
        return sorted(found, key=lambda share: -share[1])


@dataclass(frozen=True)
class Near:
    """The palette colour nearest to one that the user sees, and how to change it there.

    Attributes
    ----------
    frame : float
        The time asked for.
    id : str
        The vertex or edge that the palette colour lies on.
    handle : str or None
        The vertex or stop that is there already; None: a new stop on edge `id` is needed.
    rgb : tuple of float
        The palette colour, edited, as the user sees it.
    distance : float
        Euclidean, in RGB code values, to the colour asked for.
    shares : list of (str, float)
        `Palette.shares` of the colour asked for.
    """

    frame: float
    id: str
    handle: str | None
    rgb: Colour
    distance: float
    shares: list[tuple[str, float]]

    def refusal(self, wanted: Colour) -> str:
        """Return why this palette colour is too far from the one that was asked for."""
        shown = ", ".join(f"{value:.4g}" for value in wanted)
        there = ", ".join(f"{value:.4g}" for value in self.rgb)
        made_of = ", ".join(f"{id_} {part:.0%}" for id_, part in self.shares[:5] if part >= 0.005)
        return (
            f"the palette colour nearest to ({shown}) at frame {self.frame:g} is ({there}) of "
            f"{self.id}, {self.distance:.3g} away; expected one within {FAR:g}. A pixel of "
            f"({shown}) is made of {made_of}. Edit one of these, or edit {self.id} anyway "
            "(--anyway; anyway=True)"
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
