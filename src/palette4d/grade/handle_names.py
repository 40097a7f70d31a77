"""Names of handles for people: a colour and when it is, such as "deep red, 13".

The analysis keeps the colour's name with each vertex, so that the node shows the same names.
"""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from palette4d.colour.names import named_lch
from palette4d.grade.edits import Setting
from palette4d.grade.handles import Handles
from palette4d.grade.tracks import chains_of, runs_of


def vertex_colours(
    vertices: Sequence[Mapping[str, Any]], edges: Iterable[Mapping[str, Any]], encoding: str
) -> list[str]:
    """Return the name of each vertex's colour; an unknown encoding counts as sRGB.

    Tracks that have a colour of one name at the same time get numbers, the lightest first.
    """
    named = named_lch([vertex["rgb"] for vertex in vertices], encoding)
    names = [name for _, name in named]
    frames = [float(vertex["frame"]) for vertex in vertices]
    times: dict[str, list[tuple[float, float]]] = {}
    tracks: dict[str, dict[int, list[int]]] = {}
    for number, chain in enumerate(chains_of(vertices, edges)):
        for run in runs_of(chain, frames, names):
            name = names[run.vertices[0]]
            times.setdefault(name, []).append((run.first, run.last))
            tracks.setdefault(name, {}).setdefault(number, []).extend(run.vertices)
    for name, chains in tracks.items():
        in_time = itertools.pairwise(sorted(times[name]))
        if any(later[0] <= earlier[1] for earlier, later in in_time):
            light_first = sorted(chains.values(), key=lambda same: -max(named[v][0] for v in same))
            for number, same in enumerate(light_first, 1):
                for vertex in same:
                    names[vertex] = f"{name} {number}"
    return names


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
            names = vertex_colours(vertices, handles.edges.values(), encoding)
        handles.colours = dict(zip(handles.vertices, names, strict=True))
    colours = dict(handles.colours)
    for id_, stop in (settings or {}).items():
        if stop.edge is not None and stop.frame is not None:
            ends = [handles.vertices[handles.edges[stop.edge][end]] for end in ("from", "to")]
            away = [abs(end["frame"] - stop.frame) for end in ends]
            colours[id_] = colours[ends[away[1] < away[0]]["id"]]
    return colours
