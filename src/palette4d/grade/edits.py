"""Edits as pure functions: each takes a sidecar document and returns a new one.

A document is what `palette4d.grade.sidecar.load` returns. A handle is what an edit holds on to:
a palette vertex or a colour stop, both named by an id. Colours are in the clip's own encoding and
may lie outside 0..1; frames are the clip's frame numbers. Every function raises `Palette4dError`
when it is asked for something that does not exist, and leaves its argument as it was.
"""

import copy
import difflib
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade.sidecar import Document, validate

Colour = tuple[float, float, float]

#: Colour components further from 0 are refused by the format (docs/sidecar.md).
LARGEST_COLOUR = 1e6


@dataclass(frozen=True)
class Handle:
    """The handle nearest to a colour at a time.

    Attributes
    ----------
    kind : {"vertex", "stop"}
        What `id` names.
    id : str
        The vertex or stop to edit.
    frame : float
        When the handle is; differs from the time asked for unless `exact`.
    edge : str or None
        The edge on which the palette colour lies at the time asked for; None on a vertex.
    exact : bool
        Whether the handle lies at the time asked for.
    rgb : tuple of float
        The palette colour found there, unedited.
    distance : float
        From the colour asked for to `rgb`, Euclidean in RGB.
    """

    kind: Literal["vertex", "stop"]
    id: str
    frame: float
    edge: str | None
    exact: bool
    rgb: Colour
    distance: float


def colour_of(document: Document, handle: str) -> Colour:
    """Return the present (edited, else original) colour of a vertex or stop."""
    stop = _find(document["edits"]["stops"], handle)
    if stop is not None:
        return _colour(stop["rgb"])
    vertex = _vertex(document, handle)
    edit = _find(document["edits"]["vertices"], handle, "vertex")
    return _colour((edit or vertex)["rgb"])


def set_colour(document: Document, handle: str, rgb: Iterable[float]) -> Document:
    """Give a vertex or a stop a colour."""
    colour = _checked(rgb)
    document = copy.deepcopy(document)
    stop = _find(document["edits"]["stops"], handle)
    if stop is not None:
        stop["rgb"] = list(colour)
        return document
    _vertex(document, handle)
    edit = _find(document["edits"]["vertices"], handle, "vertex")
    if edit is None:
        document["edits"]["vertices"].append({"vertex": handle, "rgb": list(colour)})
        # In the order of the polytope, so that the file does not depend on the order of editing.
        order = {vertex["id"]: i for i, vertex in enumerate(document["polytope"]["vertices"])}
        document["edits"]["vertices"].sort(key=lambda entry: order[entry["vertex"]])
    else:
        edit["rgb"] = list(colour)
    return document


def shift_colour(document: Document, handle: str, offset: Iterable[float]) -> Document:
    """Add an offset to the present colour of a vertex or a stop."""
    delta = _checked(offset)
    now = colour_of(document, handle)
    return set_colour(document, handle, [a + b for a, b in zip(now, delta, strict=True)])


def set_stop(
    document: Document, edge: str, frame: float, rgb: Iterable[float]
) -> tuple[Document, str]:
    """Return the document with a stop on `edge` at `frame`, and the stop's id.

    A stop that is there already gets the colour; otherwise a new one is added.
    """
    colour = _checked(rgb)
    _check_inside(document, edge, frame)
    there = stop_at(document, edge, frame)
    if there is not None:
        return set_colour(document, there, colour), there
    document = copy.deepcopy(document)
    new = {"id": _new_stop_id(document), "edge": edge, "frame": frame, "rgb": list(colour)}
    document["edits"]["stops"].append(new)
    return document, str(new["id"])


def move_stop(document: Document, stop: str, frame: float) -> Document:
    """Move a stop in time, within its edge."""
    entry = _find(document["edits"]["stops"], stop)
    if entry is None:
        if _find(document["polytope"]["vertices"], stop) is not None:
            raise Palette4dError(
                f"{stop} is a palette vertex, whose time the analysis found; only stops move in "
                "time. Its colour moves with --by"
            )
        raise _unknown(stop, "stop", [s["id"] for s in document["edits"]["stops"]])
    _check_inside(document, entry["edge"], frame)
    there = stop_at(document, entry["edge"], frame)
    if there not in (None, stop):
        raise Palette4dError(
            f"edge {entry['edge']} already has the stop {there} at frame {frame:g}; choose another "
            "frame, or reset that stop first"
        )
    document = copy.deepcopy(document)
    _require(_find(document["edits"]["stops"], stop))["frame"] = frame
    return document


def reset(document: Document, handle: str | None = None) -> Document:
    """Undo the edit of a vertex, remove a stop, or (None) undo everything.

    Resetting a vertex that is not edited changes nothing.
    """
    if handle is not None and _find(document["edits"]["stops"], handle) is None:
        _vertex(document, handle)
    document = copy.deepcopy(document)
    edits = document["edits"]
    edits["vertices"] = [e for e in edits["vertices"] if handle not in (None, e["vertex"])]
    edits["stops"] = [s for s in edits["stops"] if handle not in (None, s["id"])]
    return document


def stop_at(document: Document, edge: str, frame: float) -> str | None:
    """Return the id of the stop on `edge` at exactly `frame`, or None."""
    for stop in document["edits"]["stops"]:
        if stop["edge"] == edge and stop["frame"] == frame:
            return str(stop["id"])
    return None


def nearest_handle(document: Document, rgb: Iterable[float], frame: float) -> Handle:
    """Return the handle with which to change the palette colour nearest to `rgb` at `frame`.

    The palette is sliced at `frame` (eq. 5) and the sliced colour nearest to `rgb`, as analysed and
    not as edited, is taken. Where it lies on a vertex or a stop, that is the handle; else it is the
    end or stop of its edge that is nearest in time.
    """
    colour = _checked(rgb)
    check_frame(document, frame)
    polytope = document["polytope"]
    ids = {vertex["id"]: vertex for vertex in polytope["vertices"]}
    sliced = _core.slice_at(validate(document).polytope, frame)
    best, distance = 0, math.inf
    for i, candidate in enumerate(sliced.rgb.tolist()):
        d = math.dist(colour, candidate)
        if d < distance:
            best, distance = i, d
    there = _colour(sliced.rgb[best].tolist())
    edge_index = int(sliced.edges[best])
    if edge_index < 0:
        vertex = polytope["vertices"][int(sliced.ends[best, 0])]
        return Handle("vertex", vertex["id"], vertex["frame"], None, True, there, distance)
    edge = polytope["edges"][edge_index]
    kinds: list[tuple[Literal["vertex", "stop"], str, float]] = [
        ("vertex", edge["from"], ids[edge["from"]]["frame"]),
        ("vertex", edge["to"], ids[edge["to"]]["frame"]),
    ]
    for stop in document["edits"]["stops"]:
        if stop["edge"] == edge["id"]:
            kinds.append(("stop", stop["id"], stop["frame"]))
    kind, handle, when = min(kinds, key=lambda entry: (abs(entry[2] - frame), entry[2]))
    return Handle(kind, handle, when, edge["id"], when == frame, there, distance)


def nearest_edge(document: Document, rgb: Iterable[float], frame: float) -> tuple[str, Colour]:
    """Return the edge on which the palette colour nearest to `rgb` lies, and that colour.

    Raises
    ------
    Palette4dError
        When the colour lies on a vertex at that time: vertices need no stop.
    """
    handle = nearest_handle(document, rgb, frame)
    if handle.edge is None:
        raise Palette4dError(
            f"the nearest palette colour at frame {frame:g} is the vertex {handle.id} itself, "
            f"where there is no edge to put a stop on; use `set {handle.id}`"
        )
    return handle.edge, handle.rgb


def edited_at(document: Document, edge: str, frame: float) -> Colour:
    """Return the edited colour on an edge at a frame from its start to its end, by the core."""
    entry = _edge(document, edge)
    for vertex in (entry["from"], entry["to"]):
        if frame == _vertex(document, vertex)["frame"]:
            return colour_of(document, vertex)
    _check_inside(document, edge, frame)
    read = validate(document)
    cut = _core.slice_at(read.polytope, frame)
    # Where tracks share the edge, each of them has the same colour there.
    track = cut.edges.tolist().index(read.polytope.edge_ids.index(edge))
    return _colour(_core.edited_colours(read.polytope, read.edits, cut)[track].tolist())


def check_frame(document: Document, frame: float) -> None:
    """Refuse a frame outside of the clip."""
    frames = document["clip"]["frames"]
    if not frames["first"] <= frame <= frames["last"]:
        raise Palette4dError(
            f"frame {frame:g} is outside of the clip; choose one from {frames['first']} to "
            f"{frames['last']}"
        )


# ----------------------------------------------------------------------------------------- details


def _find(entries: Sequence[dict[str, Any]], value: str, name: str = "id") -> dict[str, Any] | None:
    return next((entry for entry in entries if entry[name] == value), None)


def _require(entry: dict[str, Any] | None) -> dict[str, Any]:
    if entry is None:
        raise LookupError("an id that a validated document holds is missing")
    return entry


def _colour(values: Iterable[float]) -> Colour:
    r, g, b = values
    return (float(r), float(g), float(b))


def _checked(values: Iterable[float]) -> Colour:
    listed = [float(value) for value in values]
    if len(listed) != 3 or not all(abs(value) <= LARGEST_COLOUR for value in listed):
        raise Palette4dError(
            f"found the colour {listed}, expected 3 finite numbers of at most {LARGEST_COLOUR:g}"
        )
    return _colour(listed)


def _vertex(document: Document, handle: str) -> dict[str, Any]:
    vertices = document["polytope"]["vertices"]
    found = _find(vertices, handle)
    if found is not None:
        return found
    if _find(document["polytope"]["edges"], handle) is not None:
        raise Palette4dError(
            f"{handle} is an edge, which has no colour of its own; add a stop with "
            f"`stop {handle} --frame T --rgb R G B`"
        )
    ids = [v["id"] for v in vertices] + [s["id"] for s in document["edits"]["stops"]]
    raise _unknown(handle, "vertex or stop", ids)


def _edge(document: Document, edge: str) -> dict[str, Any]:
    found = _find(document["polytope"]["edges"], edge)
    if found is None:
        raise _unknown(edge, "edge", [e["id"] for e in document["polytope"]["edges"]])
    return found


def _unknown(handle: str, kind: str, ids: list[str]) -> Palette4dError:
    near = difflib.get_close_matches(handle, ids, n=5, cutoff=0.5) or ids[:5]
    if not near:
        return Palette4dError(f"there is no {kind} {handle!r}; the file holds none")
    return Palette4dError(
        f"there is no {kind} {handle!r}; did you mean {' or '.join(near)}? "
        "`palette4d info SIDECAR` lists all ids"
    )


def _check_inside(document: Document, edge: str, frame: float) -> None:
    entry = _edge(document, edge)
    vertices = document["polytope"]["vertices"]
    start = _require(_find(vertices, entry["from"]))
    end = _require(_find(vertices, entry["to"]))
    if frame in (start["frame"], end["frame"]):
        vertex = start if frame == start["frame"] else end
        raise Palette4dError(
            f"at frame {frame:g} edge {edge} has its end {vertex['id']}, which needs no stop; use "
            f"`set {vertex['id']} --rgb R G B`"
        )
    if not start["frame"] < frame < end["frame"]:
        raise Palette4dError(
            f"edge {edge} runs from {start['id']} at frame {start['frame']:g} to {end['id']} at "
            f"frame {end['frame']:g}; found frame {frame:g}, expected one in between"
        )


def _new_stop_id(document: Document) -> str:
    """Return s1, s2, …: one more than the largest in use, so that gaps are not filled again."""
    polytope = document["polytope"]
    taken = {e["id"] for e in polytope["vertices"] + polytope["edges"] + document["edits"]["stops"]}
    numbers = [int(match[1]) for match in map(re.compile(r"s(\d{1,9})").fullmatch, taken) if match]
    return f"s{max(numbers, default=0) + 1}"
