"""Tracks: the ways of palette colours through time, and where a colour comes from and goes to.

A chain follows one palette colour through its vertices. At a split or a merge one edge continues
the chain; every other edge begins or ends another chain.
"""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.grade.handles import Handles

F64 = NDArray[np.float64]


@dataclass(frozen=True)
class Chain:
    """A palette colour through time: vertices, edges, and the first and last frame with forks.

    The outer edges may end on another chain's vertex.
    """

    vertices: tuple[int, ...]
    edges: tuple[int, ...]
    first: float
    last: float


def _continuations(
    frames: F64, rgb: F64, edges: Sequence[tuple[int, int]]
) -> tuple[dict[int, int], list[int]]:
    """Return the next edge of each edge's chain, and the edge of each vertex (-1: none).

    The edge with the least change of colour continues.
    """

    def change(edge: int) -> tuple[float, int]:
        start, end = edges[edge]
        return float(np.linalg.norm(rgb[end] - rgb[start])), edge

    follows: dict[int, int] = {}
    home = []
    arriving_at: list[list[int]] = [[] for _ in frames]
    leaving_from: list[list[int]] = [[] for _ in frames]
    for edge, (start, end) in enumerate(edges):
        leaving_from[start].append(edge)
        arriving_at[end].append(edge)
    for arriving, leaving in zip(arriving_at, leaving_from, strict=True):
        home.append(min(arriving or leaving, key=change, default=-1))
        if arriving and leaving:
            follows[home[-1]] = min(leaving, key=change)
    return follows, home


def find_chains(
    frames: F64, rgb: F64, edges: Sequence[tuple[int, int]]
) -> tuple[tuple[Chain, ...], NDArray[np.int64], NDArray[np.int64]]:
    """Cut the edges into chains; return them with the chain of each vertex and of each edge."""
    follows, home = _continuations(frames, rgb, edges)
    carried_on = set(follows.values())
    members: list[list[int]] = []
    for first in (edge for edge in range(len(edges)) if edge not in carried_on):
        members.append([first])
        while (edge := follows.get(members[-1][-1])) is not None:
            members[-1].append(edge)
    edge_chain = np.full(len(edges), -1, dtype=np.int64)
    for number, chain in enumerate(members):
        edge_chain[chain] = number
    vertex_chain = np.full(len(frames), -1, dtype=np.int64)
    for vertex, edge in enumerate(home):
        vertex_chain[vertex] = edge_chain[edge] if edge >= 0 else len(members)
        if edge < 0:  # no edge at all: a colour of one frame
            members.append([])

    standing_in: list[list[int]] = [[] for _ in members]
    for v in np.argsort(frames, kind="stable").tolist():
        standing_in[vertex_chain[v]].append(v)
    chains = []
    for standing, chain in zip(standing_in, members, strict=True):
        times = [float(frames[v]) for v in standing]
        times += [float(frames[v]) for e in chain for v in edges[e]]
        chains.append(Chain(tuple(standing), tuple(chain), min(times), max(times)))
    return tuple(chains), vertex_chain, edge_chain


def chains_of(
    vertices: Iterable[Mapping[str, Any]], edges: Iterable[Mapping[str, Any]]
) -> tuple[Chain, ...]:
    """Return the chains of a sidecar's vertices and edges."""
    vertices = list(vertices)
    place = {vertex["id"]: index for index, vertex in enumerate(vertices)}
    pairs = [(place[edge["from"]], place[edge["to"]]) for edge in edges]
    frames = np.array([vertex["frame"] for vertex in vertices], dtype=np.float64)
    rgb = np.array([vertex["rgb"] for vertex in vertices], dtype=np.float64)
    return find_chains(frames, rgb, pairs)[0]


@dataclass(frozen=True)
class Run:
    """Successive vertices of a chain with one label, and the frames of that label."""

    vertices: tuple[int, ...]
    first: float
    last: float


def runs_of(chain: Chain, frames: Sequence[float], labels: Sequence[str]) -> list[Run]:
    """Return a chain's runs. Between vertices with two labels the label changes half way.

    Parameters
    ----------
    frames, labels : sequence
        Of all vertices.
    """
    runs = [tuple(run) for _, run in itertools.groupby(chain.vertices, lambda v: labels[v])]
    ends = [(frames[a[-1]] + frames[b[0]]) / 2 for a, b in itertools.pairwise(runs)]
    times = itertools.pairwise([chain.first, *ends, chain.last])
    return [Run(run, *time) for run, time in zip(runs, times, strict=False)]


def plain(name: str) -> str:
    """Return the name of a colour without its number."""
    return name.rstrip(" 0123456789")


@dataclass(frozen=True)
class Track:
    """One palette colour through time, as a row of `plot` shows it.

    Attributes
    ----------
    name : str
        The id of its first vertex.
    called : str
        Its name for people: its colour and its frames, such as "deep red, 13-31". Where that
        changes, its first and last colour, and the most colourful of the others: "yellow > lime >
        orange, 0-49". From blue to pale blue is no change, but to dark blue it is. The frames are
        those at which the colour is the track's own, not at other tracks' vertices.
    frame : float
        The frame of its most colourful vertex; of a fork, the middle.
    first, last : float
        The first and the last frame, with forks.
    vertices, edges : tuple of str
        Ids in order of time.
    """

    name: str
    called: str
    frame: float
    first: float
    last: float
    vertices: tuple[str, ...]
    edges: tuple[str, ...]


def tracks_of(handles: Handles, colours: Mapping[str, str]) -> list[Track]:
    """Return the tracks of a palette; every vertex and every edge belongs to exactly one.

    `colours` are the names of the vertices' colours by id. Tracks of one name and the same frames,
    such as forks between tracks, get numbers.
    """
    ids, edge_ids = list(handles.vertices), list(handles.edges)
    rgb = [vertex["rgb"] for vertex in handles.vertices.values()]
    frames = [float(vertex["frame"]) for vertex in handles.vertices.values()]
    names = [colours[id_] for id_ in ids]
    labels = [plain(name).removeprefix("pale ").removeprefix("light ") for name in names]
    place = {id_: index for index, id_ in enumerate(ids)}
    tracks: list[Track] = []
    for chain in chains_of(handles.vertices.values(), handles.edges.values()):
        shown = list(chain.vertices)
        if not shown:  # a fork between two other tracks
            fork = handles.edges[edge_ids[chain.edges[0]]]
            shown = [place[fork[end]] for end in ("from", "to")]
        by_strength = sorted(shown, key=lambda v: min(rgb[v]) - max(rgb[v]))
        strongest, first, last = by_strength[0], shown[0], shown[-1]
        others = [v for v in by_strength if labels[v] not in (labels[first], labels[last])]
        way = first, *others[:1], last
        colour = names[strongest]
        if len({labels[v] for v in way}) > 1:
            runs = itertools.groupby(way, key=lambda v: labels[v])
            colour = " > ".join(names[next(run)] for _, run in runs)
        frame = frames[strongest] if chain.vertices else (chain.first + chain.last) / 2
        ends = [chain.first, chain.last]
        if chain.vertices:  # at another track's vertex the colour is that track's
            ends[0] = min(frames[chain.vertices[0]], math.floor(chain.first) + 1)
            ends[1] = max(frames[chain.vertices[-1]], math.ceil(chain.last) - 1)
        span = "-".join(dict.fromkeys(str(round(time)) for time in ends))
        called = f"{colour}, {span}"
        vertices = tuple(ids[vertex] for vertex in chain.vertices)
        edges = tuple(edge_ids[edge] for edge in chain.edges)
        name = (vertices or edges)[0]
        tracks.append(Track(name, called, frame, chain.first, chain.last, vertices, edges))
    return _numbered(tracks)


def _numbered(tracks: Sequence[Track]) -> list[Track]:
    """Return tracks with numbers of their own where two have one name: forks after the others."""
    taken, last, called = set[str](), dict[str, int](), dict[str, str]()
    for track in sorted(tracks, key=lambda track: not track.vertices):
        new, number = track.called, last.get(track.called, 1)
        colour, span = new.rsplit(", ", 1)
        while new in taken:
            number += 1
            new = f"{plain(colour)} {number}, {span}"
        last[track.called] = number
        taken.add(new)
        called[track.name] = new
    return [replace(track, called=called[track.name]) for track in tracks]


def way_of(handles: Handles, id_: str) -> tuple[set[str], set[str]]:
    """Return the vertices and edges of the way of a colour through a vertex or an edge.

    The way goes back to all colours that it comes from, and on to all that it becomes.
    """
    edges: set[str] = set()
    if id_ in handles.edges:
        edges.add(id_)
        ends = handles.edges[id_]
        starts = {"from": ends["from"], "to": ends["to"]}
    else:
        starts = {"from": id_, "to": id_}
    vertices = set(starts.values())
    for near, far in (("to", "from"), ("from", "to")):  # back, then on
        edges_at: dict[str, list[str]] = {}
        for edge, ends in handles.edges.items():
            edges_at.setdefault(ends[near], []).append(edge)
        open_ = [starts[far]]
        while open_:
            for edge in edges_at.pop(open_.pop(), ()):
                edges.add(edge)
                open_.append(handles.edges[edge][far])
                vertices.add(open_[-1])
    return vertices, edges
