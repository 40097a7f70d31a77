"""The 4D skew polytope (section 4.1) as the analysis builds it, and its form in the sidecar.

Times are frame numbers. `FramePalette` is one frame's polyhedron. `SkewPolytope` is the palette of
the clip: vertices, and for each block and each transition the tracks (chains of vertices) and the
triangles over them.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

# Least number of colours that enclose a volume.
LEAST_COLOURS = 4


@dataclasses.dataclass(frozen=True)
class FramePalette:
    """A polyhedral palette: (n, 3) colours and (f, 3) outward triangles (none for n < 3)."""

    rgb: F64
    faces: I32

    def adjacency(self) -> NDArray[np.bool_]:
        """Return the (n, n) intra-frame edges; without faces, every colour touches every other."""
        n = len(self.rgb)
        if len(self.faces) == 0:
            return ~np.eye(n, dtype=bool)
        out = np.zeros((n, n), bool)
        for a, b in ((0, 1), (1, 2), (2, 0)):
            out[self.faces[:, a], self.faces[:, b]] = True
            out[self.faces[:, b], self.faces[:, a]] = True
        return out


@dataclasses.dataclass(frozen=True)
class Section:
    """A block [first, last] or a transition (first, last): tracks of vertex indices, and
    triangles."""

    first: float
    last: float
    tracks: tuple[tuple[int, ...], ...]
    faces: I32


class Slice(NamedTuple):
    """A palette at one time: (n, 3) colours, triangles, and as in eq. 6 the (n, 2) vertices before
    and after each colour and the weights of the later ones."""

    rgb: F64
    faces: I32
    ends: I32
    weights: F64


@dataclasses.dataclass(frozen=True, eq=False)
class SkewPolytope:
    """Vertices (n, 4) float64, columns r, g, b, frame; blocks, and the transitions between them."""

    vertices: F64
    blocks: tuple[Section, ...]
    transitions: tuple[Section, ...]

    def edges(self) -> I32:
        """Return the inter-frame edges E, (m, 2) vertex indices, earlier end first, each once."""
        pairs = {
            pair
            for section in (*self.blocks, *self.transitions)
            for track in section.tracks
            for pair in itertools.pairwise(track)
        }
        return np.array(sorted(pairs), np.int32).reshape(-1, 2)

    def length(self) -> float:
        """Return the clip's length in frames; 1 for a single frame, so that it can divide."""
        return max(self.blocks[-1].last - self.blocks[0].first, 1.0)

    def fixed_times(self) -> NDArray[np.bool_]:
        """Vertices that may not move in time: in the first or last frame, splitting or merging."""
        before, after = self.neighbours()
        single = [len(b) == 1 and len(a) == 1 for b, a in zip(before, after, strict=True)]
        return ~np.array(single, bool)

    def neighbours(self) -> tuple[list[list[int]], list[list[int]]]:
        """Return, for each vertex, its earlier and its later neighbours in time."""
        before: list[list[int]] = [[] for _ in self.vertices]
        after: list[list[int]] = [[] for _ in self.vertices]
        for u, v in self.edges().tolist():
            before[v].append(u)
            after[u].append(v)
        return before, after

    def colours_at(self, block: Section, time: float) -> F64:
        """Return the (n, 3) colours of a block's tracks at a time; constant beyond their ends."""
        tracks = (self.vertices[list(track)] for track in block.tracks)
        return np.array(
            [[np.interp(time, t[:, 3], t[:, channel]) for channel in range(3)] for t in tracks]
        )

    def slice_at(self, time: float) -> Slice:
        """Return the slice of the block at a time; between blocks, of the nearest block."""
        block = min(self.blocks, key=lambda b: max(b.first - time, time - b.last))
        time = min(max(time, block.first), block.last)
        ends, weights = [], []
        for track in block.tracks:
            position = np.interp(time, self.vertices[list(track), 3], range(len(track)))
            ends.append((track[int(position)], track[math.ceil(position)]))
            weights.append(position % 1)
        rgb = self.colours_at(block, time)
        return Slice(rgb, block.faces, np.array(ends, np.int32), np.array(weights))

    def extended_tracks(self) -> list[list[list[int]]]:
        """Return each block's tracks, extended by one vertex at either end.

        A vertex at the block's end may move into the block; the track must then continue behind it.
        Tracks are not extended past splitting and merging vertices, which never move.
        """
        before, after = self.neighbours()

        def extended(track: tuple[int, ...]) -> list[int]:
            head, tail = before[track[0]], after[track[-1]]
            return [*(head if len(head) == 1 else []), *track, *(tail if len(tail) == 1 else [])]

        return [[extended(track) for track in block.tracks] for block in self.blocks]

    def with_vertices(self, vertices: F64) -> SkewPolytope:
        """Return the same edges with other vertices, whose times may have moved inside their
        blocks."""
        blocks = [
            dataclasses.replace(
                block, tracks=tuple(_covering(block, track, vertices) for track in extended)
            )
            for block, extended in zip(self.blocks, self.extended_tracks(), strict=True)
        ]
        return dataclasses.replace(self, vertices=vertices, blocks=tuple(blocks))

    def later(self, by: float) -> SkewPolytope:
        """Return the polytope, `by` frames later."""

        def moved(section: Section) -> Section:
            return dataclasses.replace(section, first=section.first + by, last=section.last + by)

        return SkewPolytope(
            self.vertices + np.array([0, 0, 0, by]),
            tuple(map(moved, self.blocks)),
            tuple(map(moved, self.transitions)),
        )

    def with_stop(self, edge: tuple[int, int], stop: Sequence[float]) -> SkewPolytope:
        """Return the polytope with one more vertex, (r, g, b, frame) on an edge.

        It is the last vertex, in all tracks along that edge, also across blocks.
        """
        vertices = np.vstack([self.vertices, stop])
        new = len(self.vertices)

        def parted(old: Section) -> Section:
            tracks = []
            for track in old.tracks:
                for index, pair in enumerate(itertools.pairwise(track), 1):
                    if pair == edge:
                        track = _covering(old, [*track[:index], new, *track[index:]], vertices)
                        break
                tracks.append(track)
            return dataclasses.replace(old, tracks=tuple(tracks))

        return SkewPolytope(
            vertices,
            tuple(parted(b) for b in self.blocks),
            tuple(parted(t) for t in self.transitions),
        )

    def removable(self) -> list[int]:
        """Return the vertices that section 5.4.1 allows to remove.

        They are not at the clip's ends and do not split or merge, and no two edges would coincide.
        """
        before, after = self.neighbours()
        edges = {(int(u), int(v)) for u, v in self.edges()}
        return [
            v
            for v in range(len(self.vertices))
            if len(before[v]) == len(after[v]) == 1 and (before[v][0], after[v][0]) not in edges
        ]

    def without(self, vertex: int) -> SkewPolytope:
        """Return the polytope without a removable vertex; an edge joins its neighbours in time."""
        before, after = (side[vertex][0] for side in self.neighbours())

        def rejoined(track: tuple[int, ...]) -> tuple[int, ...]:
            if vertex not in track:
                rest = list(track)
            else:
                rest = [v for v in track if v != vertex]
                if track[0] == vertex:
                    rest.insert(0, before)
                if track[-1] == vertex:
                    rest.append(after)
            return tuple(v - (v > vertex) for v in rest)

        def section(old: Section) -> Section:
            return dataclasses.replace(old, tracks=tuple(rejoined(t) for t in old.tracks))

        return SkewPolytope(
            np.delete(self.vertices, vertex, axis=0),
            tuple(section(b) for b in self.blocks),
            tuple(section(t) for t in self.transitions),
        )

    def fields(self, ids: Sequence[str] = ()) -> dict[str, Any]:
        """Return the sidecar's "polytope": ids v1, v2, … and e1, e2, … in order of time.

        Only this function makes ids; edits refer to them. With the `ids` of all vertices it keeps
        these, and the vertices' order.
        """
        order = list(range(len(self.vertices)))
        if not ids:
            order.sort(key=lambda i: (self.vertices[i, 3], *self.vertices[i, :3], i))
            ids = [f"v{number}" for number in range(1, len(order) + 1)]
        name = dict(zip(order, ids, strict=True))
        place = {index: number for number, index in enumerate(order)}
        edges = sorted((place[int(u)], place[int(v)]) for u, v in self.edges())
        return {
            "vertices": [
                {
                    "id": name[i],
                    "frame": _number(self.vertices[i, 3]),
                    "rgb": [float(x) for x in self.vertices[i, :3]],
                }
                for i in order
            ],
            "edges": [
                {"id": f"e{number}", "from": name[order[u]], "to": name[order[v]]}
                for number, (u, v) in enumerate(edges, 1)
            ],
            "blocks": [
                {
                    "first": _number(b.first),
                    "last": _number(b.last),
                    "tracks": [[name[i] for i in track] for track in b.tracks],
                    "faces": b.faces.tolist(),
                }
                for b in self.blocks
            ],
            "transitions": [
                {
                    "tracks": [[name[i] for i in track] for track in t.tracks],
                    "faces": t.faces.tolist(),
                }
                for t in self.transitions
            ],
        }


def _covering(section: Section, track: Sequence[int], vertices: F64) -> tuple[int, ...]:
    """Return the shortest run of a track that covers the section."""
    times = vertices[list(track), 3]
    start = max(int(np.searchsorted(times, section.first, side="right")) - 1, 0)
    end = int(np.searchsorted(times, section.last, side="left"))
    return tuple(track[start : end + 1])


def _number(x: float) -> int | float:
    """Return whole frame numbers as integers, and others unchanged."""
    return int(x) if float(x).is_integer() else float(x)
