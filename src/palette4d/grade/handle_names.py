"""Names of handles for people: a colour and when it is, such as "deep red, 13".

The analysis keeps the colour's name with each vertex, so that the node shows the same names.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from palette4d.colour.names import named_lch
from palette4d.grade.edits import Setting
from palette4d.grade.handles import Handles


def vertex_colours(vertices: Sequence[Mapping[str, Any]], encoding: str) -> list[str]:
    """Return the name of each vertex's colour.

    Colours of one name at one frame get numbers, the lightest first.

    Parameters
    ----------
    vertices : sequence of mapping
        ``rgb`` and ``frame``, as in the sidecar.
    encoding : str
        The palette's encoding; unknown counts as sRGB.
    """
    found = named_lch([vertex["rgb"] for vertex in vertices], encoding)
    order = sorted(range(len(found)), key=lambda i: -found[i][0])
    numbers = numbered((found[i][1], round(vertices[i]["frame"])) for i in order)
    numbers = [number for _, number in sorted(zip(order, numbers, strict=True))]
    return [name + number for (_, name), number in zip(found, numbers, strict=True)]


def numbered(names: Iterable[object]) -> list[str]:
    """Return " 1", " 2", … for names that occur more than once, and "" for the others."""
    places: dict[object, list[int]] = {}
    for place, name in enumerate(names):
        places.setdefault(name, []).append(place)
    found: dict[int, str] = {}
    for same in places.values():
        found |= {at: f" {n}" if len(same) > 1 else "" for n, at in enumerate(same, 1)}
    return [found[place] for place in sorted(found)]


def colours_by_id(
    handles: Handles, encoding: str, settings: Mapping[str, Setting] | None = None
) -> dict[str, str]:
    """Return the names of the colours of vertices and stops, before edits.

    A stop has the name of the nearer end of its edge. Files of older versions have no names.
    """
    if not handles.colours:
        vertices = list(handles.vertices.values())
        if all("name" in vertex for vertex in vertices):
            names = [str(vertex["name"]) for vertex in vertices]
        else:
            names = vertex_colours(vertices, encoding)
        handles.colours = dict(zip(handles.vertices, names, strict=True))
    colours = dict(handles.colours)
    for id_, stop in (settings or {}).items():
        if stop.edge is not None and stop.frame is not None:
            ends = [handles.vertices[handles.edges[stop.edge][end]] for end in ("from", "to")]
            away = [abs(end["frame"] - stop.frame) for end in ends]
            colours[id_] = colours[ends[away[1] < away[0]]["id"]]
    return colours
