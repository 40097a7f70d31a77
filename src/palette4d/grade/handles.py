"""A palette's vertices and edges by id. An id that does not exist is an error with advice."""

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

from palette4d.common.errors import Palette4dError


class Handles:
    """The vertices and edges of a sidecar's polytope.

    `vertices` and `edges` are the sidecar's members by id, in its order; `colours` the names of the
    vertices' colours, once `handle_names.colours_by_id` has set them.
    """

    def __init__(self, polytope: Mapping[str, Any]) -> None:
        self.vertices: dict[str, dict[str, Any]] = {v["id"]: v for v in polytope["vertices"]}
        self.edges: dict[str, dict[str, Any]] = {e["id"]: e for e in polytope["edges"]}
        self.colours: dict[str, str] = {}

    def vertex(self, id_: str, others: Iterable[str] = ()) -> dict[str, Any]:
        """Return a vertex. The error for an unknown id names similar ids, also from `others`."""
        if id_ in self.vertices:
            return self.vertices[id_]
        if id_ in self.edges:
            edge = self.edges[id_]
            raise Palette4dError(
                f"found the edge {id_}, expected a vertex or a stop; between its ends "
                f"{edge['from']} and {edge['to']} it has a colour only at a frame: give it a stop"
            )
        raise unknown(id_, "vertex or stop", dict.fromkeys([*self.vertices, *others]))

    def check_inside(self, edge: str, frame: float) -> None:
        """Refuse a stop's place that is not strictly between the ends of an edge."""
        if edge not in self.edges:
            raise unknown(edge, "edge", self.edges)
        start, end = (self.vertices[self.edges[edge][name]] for name in ("from", "to"))
        for vertex in (start, end):
            if frame == vertex["frame"]:
                raise Palette4dError(
                    f"at frame {frame:g} edge {edge} has its end {vertex['id']}, which needs no "
                    f"stop; set {vertex['id']} itself"
                )
        if not start["frame"] < frame < end["frame"]:
            raise Palette4dError(
                f"edge {edge} runs from {start['id']} at frame {start['frame']:g} to {end['id']} "
                f"at frame {end['frame']:g}; found frame {frame:g}, expected one in between"
            )


def unknown(
    id_: str, kind: str, ids: Iterable[str], lists: str = "`palette4d info` or `Document.names`"
) -> Palette4dError:
    """Return the error for an unknown id; it names similar ids, and what lists all."""
    known = list(ids)
    near = difflib.get_close_matches(id_, known, n=5, cutoff=0.5) or known[:5]
    if not near:
        return Palette4dError(f"there is no {kind} {id_!r}; there are none")
    return Palette4dError(
        f"there is no {kind} {id_!r}; did you mean {' or '.join(near)}? {lists} lists all"
    )
