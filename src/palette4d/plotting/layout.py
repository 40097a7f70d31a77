"""Rows of the timeline: the polytope's edges as chains, and where each chain stands.

Input: vertices with times and colours, and edges. A chain follows one palette colour through its
vertices; where a vertex has more than one edge on a side (a split or a merge), one of them carries
the chain on and every other one begins or ends a chain of its own, which forks from or joins the
chain of that vertex. Chains that never meet in time share a row. Rows are ordered so that forks are
short and cross little, and otherwise from light to dark.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

#: Rec. 709 luma, to order rows from light to dark.
LUMA = np.array([0.2126, 0.7152, 0.0722])
#: What a fork costs per row it spans, and per chain it crosses; a place off the luma order costs 1
#: over all chains together.
SPAN_COST, CROSSING_COST, ORDER_COST = 1.0, 2.5, 0.35
#: What one row less is worth in that cost; and when rows count as many.
ROW_SAVING, MANY_ROWS = 1.5, 24
#: Moves that are tried at most: bounds the search on palettes of hundreds of vertices.
MAX_TRIALS = 20_000


@dataclass(frozen=True)
class Chain:
    """A palette colour through time.

    Attributes
    ----------
    vertices : tuple of int
        Vertices that stand in this chain's row, in order of time.
    edges : tuple of int
        Its edges, in order of time; the outer ones may end on another chain's vertex.
    first, last : float
        The frames it spans, forks included.
    """

    vertices: tuple[int, ...]
    edges: tuple[int, ...]
    first: float
    last: float


@dataclass(frozen=True)
class Layout:
    """Chains and their rows.

    Attributes
    ----------
    chains : tuple of Chain
        All chains; every vertex stands in exactly one and every edge belongs to exactly one.
    rows : (c,) int array
        The row of each chain, 0 at the top.
    vertex_chain, edge_chain : (n,), (m,) int arrays
        The chain of each vertex and edge.
    """

    chains: tuple[Chain, ...]
    rows: NDArray[np.int64]
    vertex_chain: NDArray[np.int64]
    edge_chain: NDArray[np.int64]

    @property
    def row_count(self) -> int:
        """The number of rows."""
        return int(self.rows.max()) + 1 if self.rows.size else 0


def _continuations(
    frames: F64, rgb: F64, edges: Sequence[tuple[int, int]]
) -> tuple[dict[int, int], list[int]]:
    """Which edge carries on into which, and the edge that each vertex stands on (-1: none)."""
    arriving: list[list[int]] = [[] for _ in frames]
    leaving: list[list[int]] = [[] for _ in frames]
    for edge, (start, end) in enumerate(edges):
        leaving[start].append(edge)
        arriving[end].append(edge)

    def change(edge: int) -> tuple[float, float, int]:
        start, end = edges[edge]
        # The colour that changes least carries on; of equals the longer edge.
        return (
            float(np.linalg.norm(rgb[end] - rgb[start])),
            float(frames[start] - frames[end]),
            edge,
        )

    follows: dict[int, int] = {}
    home = [-1] * len(frames)
    for vertex in range(len(frames)):
        if arriving[vertex]:
            home[vertex] = min(arriving[vertex], key=change)
            if leaving[vertex]:
                follows[home[vertex]] = min(leaving[vertex], key=change)
        elif leaving[vertex]:
            home[vertex] = min(leaving[vertex], key=change)
    return follows, home


def find_chains(
    frames: F64, rgb: F64, edges: Sequence[tuple[int, int]]
) -> tuple[tuple[Chain, ...], NDArray[np.int64], NDArray[np.int64]]:
    """Cut the edges into chains; return them with the chain of each vertex and of each edge."""
    follows, home = _continuations(frames, rgb, edges)
    edge_chain = np.full(len(edges), -1, dtype=np.int64)
    members: list[list[int]] = []
    carried_on = set(follows.values())
    for first in range(len(edges)):
        if first in carried_on:
            continue
        edge: int | None = first
        chain: list[int] = []
        while edge is not None:
            edge_chain[edge] = len(members)
            chain.append(edge)
            edge = follows.get(edge)
        members.append(chain)

    vertex_chain = np.full(len(frames), -1, dtype=np.int64)
    for vertex, edge_at in enumerate(home):
        if edge_at >= 0:
            vertex_chain[vertex] = edge_chain[edge_at]
        else:  # no edge at all: a colour of one frame
            vertex_chain[vertex] = len(members)
            members.append([])

    chains = []
    for index, chain in enumerate(members):
        standing = np.flatnonzero(vertex_chain == index)
        standing = standing[np.argsort(frames[standing], kind="stable")]
        times = [float(frames[v]) for v in standing]
        times += [float(frames[v]) for e in chain for v in edges[e]]
        chains.append(Chain(tuple(int(v) for v in standing), tuple(chain), min(times), max(times)))
    return tuple(chains), vertex_chain, edge_chain


@dataclass(frozen=True)
class _Forks:
    """Forks as arrays: a chain, the chain it leaves or joins, and who else is there then."""

    child: NDArray[np.int64]
    parent: NDArray[np.int64]
    alive: NDArray[np.bool_]
    target: F64

    def cost(self, place: F64) -> float:
        """What an arrangement costs: (c,) places -> badness."""
        total = ORDER_COST * float(np.abs(place - self.target).sum()) / max(1, place.size)
        if self.child.size:
            low = np.minimum(place[self.child], place[self.parent])[:, None]
            high = np.maximum(place[self.child], place[self.parent])[:, None]
            between = (place[None] > low) & (place[None] < high) & self.alive
            total += SPAN_COST * float((high - low).sum())
            total += CROSSING_COST * float(np.count_nonzero(between))
        return total


def _find_forks(
    chains: Sequence[Chain],
    frames: F64,
    edges: Sequence[tuple[int, int]],
    vertex_chain: NDArray[np.int64],
    target: F64,
) -> _Forks:
    child, parent, when = [], [], []
    for index, chain in enumerate(chains):
        for edge in chain.edges[:1]:
            vertex = edges[edge][0]
            if vertex_chain[vertex] != index:
                child.append(index)
                parent.append(int(vertex_chain[vertex]))
                when.append(float(frames[vertex]))
        for edge in chain.edges[-1:]:
            vertex = edges[edge][1]
            if vertex_chain[vertex] != index:
                child.append(index)
                parent.append(int(vertex_chain[vertex]))
                when.append(float(frames[vertex]))
    first = np.array([c.first for c in chains])
    last = np.array([c.last for c in chains])
    times = np.array(when, dtype=np.float64)[:, None]
    alive = (first[None] <= times) & (last[None] >= times)
    return _Forks(np.array(child, np.int64), np.array(parent, np.int64), alive, target)


def _order(forks: _Forks, order: list[int]) -> list[int]:
    """Improve an order of chains by moving one at a time while it pays."""

    def cost(candidate: list[int]) -> float:
        place = np.empty(len(candidate))
        place[candidate] = np.arange(len(candidate))
        return forks.cost(place)

    best, trials = cost(order), 0
    improved = True
    while improved and trials < MAX_TRIALS:
        improved = False
        for chain in list(order):
            here = order.index(chain)
            rest = order[:here] + order[here + 1 :]
            for there in range(len(order)):
                trials += 1
                candidate = [*rest[:there], chain, *rest[there:]]
                found = cost(candidate)
                if found < best - 1e-9:
                    best, order, improved = found, candidate, True
            if trials >= MAX_TRIALS:
                break
    return order


def _apart(chains: Sequence[Chain], some: Sequence[int], others: Sequence[int], gap: float) -> bool:
    """Whether no two chains of two groups meet in time, with a gap between them."""
    return all(
        chains[a].last + gap < chains[b].first or chains[b].last + gap < chains[a].first
        for a in some
        for b in others
    )


def _share_rows(
    chains: Sequence[Chain], order: Sequence[int], forks: _Forks, gap: float
) -> NDArray[np.int64]:
    """Put chains that never meet in time (with a gap) into one row, where forks do not suffer."""

    def numbered(rows: Sequence[Sequence[int]]) -> NDArray[np.int64]:
        result = np.zeros(len(chains), dtype=np.int64)
        for row, members in enumerate(rows):
            result[list(members)] = row
        return result

    rows = [[chain] for chain in order]
    while True:
        limit = forks.cost(numbered(rows).astype(np.float64)) + ROW_SAVING
        best: tuple[float, list[list[int]]] | None = None
        for a in range(len(rows)):
            # Among many rows only neighbours are tried: the search stays short.
            reach = len(rows) if len(rows) <= MANY_ROWS else a + 2
            for b in range(a + 1, min(reach, len(rows))):
                if not _apart(chains, rows[a], rows[b], gap):
                    continue
                joined = rows[a] + rows[b]
                for kept, gone in ((a, b), (b, a)):
                    candidate = [joined if k == kept else r for k, r in enumerate(rows)]
                    del candidate[gone]
                    found = forks.cost(numbered(candidate).astype(np.float64))
                    if found <= limit and (best is None or found < best[0]):
                        best = found, candidate
        if best is None:
            return numbered(rows)
        rows = best[1]


def arrange(frames: F64, rgb: F64, edges: Sequence[tuple[int, int]]) -> Layout:
    """Find the rows of a palette's timeline.

    Parameters
    ----------
    frames : (n,) float64
        The vertices' frame numbers.
    rgb : (n, 3) float64
        Their colours.
    edges : sequence of (int, int)
        Vertex indices, the earlier end first.
    """
    chains, vertex_chain, edge_chain = find_chains(frames, rgb, edges)
    luma = np.empty(len(chains))
    for index, chain in enumerate(chains):
        members = set(chain.vertices) | {v for e in chain.edges for v in edges[e]}
        luma[index] = float((rgb[sorted(members)] @ LUMA).mean())
    light_first = np.argsort(-luma, kind="stable")
    target = np.empty(len(chains))
    target[light_first] = np.arange(len(chains))
    forks = _find_forks(chains, frames, edges, vertex_chain, target)
    order = _order(forks, [int(i) for i in light_first])
    gap = 0.04 * float(np.ptp(frames)) if frames.size else 0.0
    return Layout(chains, _share_rows(chains, order, forks, gap), vertex_chain, edge_chain)
