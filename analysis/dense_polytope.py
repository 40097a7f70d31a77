"""The skew polytope between block merging and vertex removal: a vertex for each colour and frame.

Input: blocks with one palette per frame, and the inter-frame edges between blocks. A removed vertex
becomes a ghost on the edge between its neighbours in time (section 5.4.1). Splitting and merging
vertices are never removed, nor are vertices in the first and last frame.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import NO_FACES
from palette4d.analysis.polytope import FramePalette, Section, SkewPolytope

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
Links = tuple[tuple[int, int], ...]


class DensePolytope:
    """All vertices, their neighbours in time, and the ghosts.

    Parameters
    ----------
    frames : frame numbers.
    blocks : for each block one palette per frame, all with the same faces.
    links : inter-frame edges between each block and the next, pairs of colours.
    faces_between : (f, 3) triangles over these edges; without them transitions have no faces.

    Attributes
    ----------
    node : `node[i][s]` is the vertex of colour s in frame i.
    position : (n, 3) colours of each frame, of ghosts too.
    place : (frame index, colour) of each vertex.
    chain : for each edge (v, w) the ghosts between v and w, in order of time.
    """

    def __init__(
        self,
        frames: Sequence[int],
        blocks: Sequence[Sequence[FramePalette]],
        links: Sequence[Links] = (),
        faces_between: Sequence[I32] = (),
    ) -> None:
        self.frames = [float(f) for f in frames]
        self.faces = [block[0].faces for block in blocks]
        self.links = list(links)
        self.faces_between = list(faces_between)
        self.block_frames: list[range] = []
        self.node: list[list[int]] = []
        self.position: list[F64] = []
        self.place: list[tuple[int, int]] = []
        for block in blocks:
            begin = len(self.node)
            self.block_frames.append(range(begin, begin + len(block)))
            for i, palette in enumerate(block, begin):
                self.node.append(list(range(len(self.place), len(self.place) + len(palette.rgb))))
                self.place += [(i, s) for s in range(len(palette.rgb))]
                self.position.append(palette.rgb.copy())
        self.before: list[list[int]] = [[] for _ in self.place]
        self.after: list[list[int]] = [[] for _ in self.place]
        self.chain: dict[tuple[int, int], list[int]] = {}
        for b, inside in enumerate(self.block_frames):
            for i in inside[:-1]:
                for u, v in zip(self.node[i], self.node[i + 1], strict=True):
                    self._join(u, v)
            if b + 1 < len(self.block_frames):
                last, first = self.node[inside[-1]], self.node[inside[-1] + 1]
                for i, j in self.links[b]:
                    self._join(last[i], first[j])
        self.alive = [True] * len(self.place)

    def _join(self, u: int, v: int) -> None:
        self.after[u].append(v)
        self.before[v].append(u)
        self.chain[u, v] = []

    def colour(self, vertex: int) -> F64:
        """Return the (3,) colour of a vertex; a ghost has the colour of its edge at that time."""
        i, s = self.place[vertex]
        rgb: F64 = self.position[i][s]
        return rgb

    def removable(self, vertex: int) -> bool:
        """Whether section 5.4.1 allows removal and no two edges would coincide."""
        if not self.alive[vertex]:
            return False
        if len(self.before[vertex]) != 1 or len(self.after[vertex]) != 1:
            return False
        return (self.before[vertex][0], self.after[vertex][0]) not in self.chain

    def ghosts(self, vertex: int) -> list[tuple[int, int, F64]]:
        """Return (frame index, colour, (3,) position) of each colour that the removal of `vertex`
        would move."""
        v, w = self.before[vertex][0], self.after[vertex][0]
        start, end = self.frames[self.place[v][0]], self.frames[self.place[w][0]]
        a, b = self.colour(v), self.colour(w)
        out = []
        for ghost in (*self.chain[v, vertex], vertex, *self.chain[vertex, w]):
            i, s = self.place[ghost]
            weight = (self.frames[i] - start) / (end - start)
            out.append((i, s, a + weight * (b - a)))
        return out

    def remove(self, vertex: int) -> None:
        """Turn `vertex` into a ghost."""
        moved = self.ghosts(vertex)
        v, w = self.before[vertex][0], self.after[vertex][0]
        self.chain[v, w] = [*self.chain.pop((v, vertex)), vertex, *self.chain.pop((vertex, w))]
        self.after[v][self.after[v].index(vertex)] = w
        self.before[w][self.before[w].index(vertex)] = v
        self.alive[vertex] = False
        for i, s, rgb in moved:
            self.position[i][s] = rgb

    def polytope(self) -> SkewPolytope:
        """Return the polytope of the remaining vertices."""
        keep = [v for v, alive in enumerate(self.alive) if alive]
        index = {v: n for n, v in enumerate(keep)}
        edge_of = {ghost: edge for edge, chain in self.chain.items() for ghost in chain}
        vertices = np.array([[*self.colour(v), self.frames[self.place[v][0]]] for v in keep])

        def through(nodes: Sequence[int]) -> tuple[int, ...]:
            """Return the track through the given vertices and ghosts."""
            out = [index[v] for v in nodes if self.alive[v]]
            if not self.alive[nodes[0]]:
                out.insert(0, index[edge_of[nodes[0]][0]])
            if not self.alive[nodes[-1]]:
                out.append(index[edge_of[nodes[-1]][1]])
            return tuple(out)

        blocks, transitions = [], []
        for b, inside in enumerate(self.block_frames):
            colours = range(len(self.node[inside[0]]))
            tracks = tuple(through([self.node[i][s] for i in inside]) for s in colours)
            first, last = self.frames[inside[0]], self.frames[inside[-1]]
            blocks.append(Section(first, last, tracks, self.faces[b]))
            if b + 1 < len(self.block_frames):
                ends, begins = self.node[inside[-1]], self.node[inside[-1] + 1]
                links = tuple(through([ends[i], begins[j]]) for i, j in self.links[b])
                faces = self.faces_between[b] if self.faces_between else NO_FACES
                transitions.append(Section(last, self.frames[inside[-1] + 1], links, faces))
        return SkewPolytope(vertices, tuple(blocks), tuple(transitions))
