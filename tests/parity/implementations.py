"""The reference and the core: a document's slices, weights and pictures from each."""

from __future__ import annotations

import json
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from parity import reference

from palette4d import _core

F64 = NDArray[np.float64]
Document = dict[str, Any]
Position = tuple[str, str, float]


class Reference:
    """Plain NumPy."""

    name = "reference"

    def slice(
        self, document: Document, frame: float
    ) -> tuple[F64, list[list[int]], list[Position]]:
        return (
            reference.slice_rgb(document, frame),
            reference.slice_faces(document, frame),
            reference.positions(document, frame),
        )

    def edited(self, document: Document, frame: float) -> F64:
        return reference.edited_colours(document, frame)

    def weights(self, points: ArrayLike, rgb: ArrayLike, faces: ArrayLike) -> tuple[F64, F64]:
        return reference.palette_weights(points, rgb, faces)

    def recolour(
        self,
        image: NDArray[np.float32],
        document: Document,
        frame: float,
        strength: float = 1.0,
        premultiplied: bool = False,
    ) -> NDArray[np.float32]:
        original = reference.slice_rgb(document, frame)
        faces = reference.slice_faces(document, frame)
        edited = reference.edited_colours(document, frame)
        picks = reference.picks_at(document, frame)
        return reference.recolour(image, original, edited, faces, strength, premultiplied, picks)


class Core:
    """The compiled core through its bindings, recolouring in one of its precisions."""

    def __init__(self, precision: Literal["single", "double"], instructions: str = "best") -> None:
        self.name = f"_core {precision}"
        self.precision: Literal["single", "double"] = precision
        self.instructions = instructions

    @staticmethod
    def sidecar(document: Document) -> _core.Sidecar:
        return _core.parse_sidecar(json.dumps(document), "case")

    def slice(
        self, document: Document, frame: float
    ) -> tuple[F64, list[list[int]], list[Position]]:
        polytope = self.sidecar(document).polytope
        cut = _core.slice_at(polytope, frame)
        names = polytope.vertex_ids
        where = [
            (names[a], names[b], float(w))
            for (a, b), w in zip(cut.ends.tolist(), cut.weights, strict=True)
        ]
        return cut.rgb, cut.faces.tolist(), where

    def edited(self, document: Document, frame: float) -> F64:
        sidecar = self.sidecar(document)
        cut = _core.slice_at(sidecar.polytope, frame)
        return _core.edited_colours(sidecar.polytope, sidecar.edits, cut)

    def recolourer(self, document: Document, frame: float) -> _core.Recolourer:
        sidecar = self.sidecar(document)
        cut = _core.slice_at(sidecar.polytope, frame)
        edited = _core.edited_colours(sidecar.polytope, sidecar.edits, cut)
        picks = sidecar.picks_at(cut.frame)
        return _core.Recolourer(cut.rgb, edited, cut.faces, picks=picks)

    def weights(self, points: ArrayLike, rgb: ArrayLike, faces: ArrayLike) -> tuple[F64, F64]:
        return _core.palette_weights(points, rgb, faces)

    def polytope_weights(self, points: ArrayLike, document: Document, frame: float) -> F64:
        return _core.polytope_weights(points, self.sidecar(document).polytope, frame)

    def recolour(
        self,
        image: NDArray[np.float32],
        document: Document,
        frame: float,
        strength: float = 1.0,
        premultiplied: bool = False,
    ) -> NDArray[np.float32]:
        return self.recolourer(document, frame).apply(
            image,
            strength=strength,
            premultiplied=premultiplied,
            precision=self.precision,
            instructions=self.instructions,
            picture=True,
        )


REFERENCE = Reference()
#: Double precision throughout: the bakes.
CORE = Core("double")
#: Many colours at a time: the node and `palette4d render`.
FAST = Core("single")
