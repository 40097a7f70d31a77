"""The timeline's content and layout, without a drawing library: vertices, times, rows.

`PlottedPalette` holds a sidecar's palette and edits as arrays. `arrange` finds the rows. A chain
follows one palette colour through its vertices. At a split or a merge one edge continues the chain.
Every other edge begins or ends another chain, which forks from or joins the chain of that vertex.
Chains that never overlap in time share a row. Rows are ordered for short forks with few crossings,
and otherwise from bright to dark.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.grade.tracks import Chain, find_chains

F64 = NDArray[np.float64]
Row = list[int]
Cost = Callable[[F64], float]

#: Rec. 709 luma, to order rows from bright to dark.
LUMA = np.array([0.2126, 0.7152, 0.0722])
#: The cost of a fork per row that it spans and per chain that it crosses. One place off the luma
#: order costs ORDER_COST over the number of chains.
SPAN_COST, CROSSING_COST, ORDER_COST = 1.0, 2.5, 0.35
#: The gain of one row less. Above MANY_ROWS rows only neighbours are joined.
ROW_SAVING, MANY_ROWS = 1.5, 24
#: Largest number of tried moves: it limits the search on palettes of hundreds of vertices.
MAX_TRIALS = 20_000


@dataclass(frozen=True)
class PlottedPalette:
    """A palette and its edits as arrays.

    Attributes
    ----------
    ids, edge_ids : list of str
        The ids of the vertices and edges.
    frames, rgb, edited : (n,), (n, 3), (n, 3) float64
        Times of the vertices, and their colours before and after the edit.
    changed : (n,) bool array
        The vertex has an edited colour.
    edges : list of (int, int)
        Vertex indices, the earlier end first.
    stops : list of (str, int, float, (3,) float64)
        Id, edge index, frame and edited colour, by edge and frame.
    sections : list of dict
        Blocks and transitions: ``first``, ``last``, ``transition``.
    first, last : float
        The first and last frame.
    sidecar : Sidecar
        Where all this is from.
    against : Edits or None
        The edits that make the colours before; None: the clip's colours.
    """

    ids: list[str]
    frames: F64
    rgb: F64
    edited: F64
    changed: NDArray[np.bool_]
    edges: list[tuple[int, int]]
    edge_ids: list[str]
    stops: list[tuple[str, int, float, F64]]
    sections: list[dict[str, Any]]
    first: float
    last: float
    sidecar: _core.Sidecar
    against: _core.Edits | None = None

    @classmethod
    def of(cls, sidecar: _core.Sidecar, against: _core.Edits | None = None) -> "PlottedPalette":
        """Read the arrays from a sidecar; `against`: other edits as the colours before."""
        polytope, edits = sidecar.polytope, sidecar.edits
        vertices = np.asarray(polytope.vertices, dtype=np.float64).reshape(-1, 4)
        ids, edge_ids = list(polytope.vertex_ids), list(polytope.edge_ids)
        rgb, edited = vertices[:, :3].copy(), vertices[:, :3].copy()
        for frame in np.unique(vertices[:, 3]):
            cut = _core.slice_at(polytope, float(frame))
            at_vertex = cut.edges < 0
            after = _core.edited_colours(polytope, edits, cut)
            edited[cut.ends[at_vertex, 0]] = after[at_vertex]
            if against is not None:
                other = _core.edited_colours(polytope, against, cut)
                rgb[cut.ends[at_vertex, 0]] = other[at_vertex]
        given = [against is None and name in edits.vertex_rgb for name in ids]
        result = cls(
            ids=ids,
            frames=vertices[:, 3].copy(),
            rgb=rgb,
            edited=edited,
            changed=np.array(given, dtype=bool) | (edited != rgb).any(axis=1),
            edges=[(int(a), int(b)) for a, b in np.asarray(polytope.edges).reshape(-1, 2)],
            edge_ids=edge_ids,
            stops=[],
            sections=list(polytope.sections),
            first=float(polytope.first_frame),
            last=float(polytope.last_frame),
            sidecar=sidecar,
            against=against,
        )
        for stop in edits.stops:
            edge, frame = edge_ids.index(stop["edge"]), float(stop["frame"])
            colour = result.colours(edge, np.array([frame]), edited=True)[0]
            result.stops.append((stop["id"], edge, frame, colour))
        result.stops.sort(key=lambda stop: stop[1:3])
        return result

    def sampled(self, frames: F64) -> tuple[F64, F64]:
        """Return the colours of all edges at (k,) times, before and after, (m, k, 3).

        The core computes them, so that ramps count. An edge is NaN where it is not; at an
        end it has the vertex's colour.
        """
        polytope, edits = self.sidecar.polytope, self.sidecar.edits
        before = np.full((len(self.edges), len(frames), 3), np.nan)
        after = before.copy()
        for k, frame in enumerate(np.asarray(frames, dtype=np.float64).tolist()):
            cut = _core.slice_at(polytope, frame)
            inside = cut.edges >= 0
            old = cut.rgb
            if self.against is not None:
                old = _core.edited_colours(polytope, self.against, cut)
            before[cut.edges[inside], k] = old[inside]
            after[cut.edges[inside], k] = _core.edited_colours(polytope, edits, cut)[inside]
        for end in (0, 1):
            vertices = np.array([edge[end] for edge in self.edges], dtype=np.int64)
            which, column = np.nonzero(self.frames[vertices][:, None] == np.asarray(frames)[None])
            before[which, column] = self.rgb[vertices[which]]
            after[which, column] = self.edited[vertices[which]]
        return before, after

    def colours(self, edge: int, frames: F64, *, edited: bool) -> F64:
        """Return the colours on an edge at (k,) times, (k, 3)."""
        colours: F64 = self.sampled(frames)[int(edited)][edge]
        return colours

    def touched(self, edge: int) -> bool:
        """Whether anything on this edge is edited."""
        return bool(self.changed[list(self.edges[edge])].any()) or any(
            stop[1] == edge for stop in self.stops
        )

    @property
    def edited_times(self) -> list[float]:
        """The frames of edited vertices, of stops and of picks."""
        own = [*map(float, self.frames[self.changed]), *(stop[2] for stop in self.stops)]
        return own + self.sidecar.edits.pick_times

    def change(self, frames: F64) -> F64:
        """Return by how much colours change at (k,) times: the largest of a channel, (k,)."""
        before, after = self.sampled(frames)
        largest: F64 = np.nanmax(np.abs(after - before), axis=(0, 2))
        picked = [self.sidecar.edits.picks_at(frame).largest for frame in frames.tolist()]
        return np.maximum(largest, picked)


def track_ids(polytope: _core.Polytope) -> dict[str, str]:
    """Return the id of the track of every vertex and edge: that of the track's first one."""
    vertices = np.asarray(polytope.vertices, dtype=np.float64).reshape(-1, 4)
    edges = [(int(a), int(b)) for a, b in np.asarray(polytope.edges).reshape(-1, 2)]
    tracks: dict[str, str] = {}
    for chain in find_chains(vertices[:, 3], vertices[:, :3], edges)[0]:
        members = [polytope.vertex_ids[v] for v in chain.vertices]
        members += [polytope.edge_ids[e] for e in chain.edges]
        tracks |= dict.fromkeys(members, members[0])
    return tracks


@dataclass(frozen=True)
class Rows:
    """Chains and their rows.

    Attributes
    ----------
    chains : tuple of Chain
        Every vertex and every edge belongs to exactly one.
    row : (c,) int array
        The row of each chain, 0 at the top.
    vertex_chain, edge_chain : (n,), (m,) int arrays
        The chain of each vertex and edge.
    """

    chains: tuple[Chain, ...]
    row: NDArray[np.int64]
    vertex_chain: NDArray[np.int64]
    edge_chain: NDArray[np.int64]

    @property
    def count(self) -> int:
        """The number of rows."""
        return int(self.row.max()) + 1 if self.row.size else 0


def _fork_cost(
    chains: Sequence[Chain],
    frames: F64,
    edges: Sequence[tuple[int, int]],
    vertex_chain: NDArray[np.int64],
    target: F64,
) -> Cost:
    """Return the function from the chains' places, (c,), to the cost of the arrangement."""
    forks = []
    for index, chain in enumerate(chains):
        # The outer ends of a chain may be on another chain's vertex.
        ends = [edges[e][0] for e in chain.edges[:1]] + [edges[e][1] for e in chain.edges[-1:]]
        forks += [(index, vertex_chain[v], frames[v]) for v in ends if vertex_chain[v] != index]
    child, parent = (np.array([fork[k] for fork in forks], dtype=np.int64) for k in (0, 1))
    times = np.array([fork[2] for fork in forks], dtype=np.float64)[:, None]
    first, last = (np.array([getattr(c, end) for c in chains]) for end in ("first", "last"))
    alive = (first[None] <= times) & (last[None] >= times)

    def cost(place: F64) -> float:
        low = np.minimum(place[child], place[parent])[:, None]
        high = np.maximum(place[child], place[parent])[:, None]
        crossed = (place[None] > low) & (place[None] < high) & alive
        off_order = float(np.abs(place - target).sum()) / max(1, place.size)
        total = ORDER_COST * off_order + SPAN_COST * float((high - low).sum())
        return total + CROSSING_COST * float(np.count_nonzero(crossed))

    return cost


def _places(rows: Sequence[Sequence[int]]) -> NDArray[np.int64]:
    """Return the row of each chain."""
    result = np.zeros(sum(map(len, rows)), dtype=np.int64)
    for row, members in enumerate(rows):
        result[list(members)] = row
    return result


def _order(cost: Cost, order: list[int]) -> list[int]:
    """Improve an order of chains by moving one at a time while the cost falls."""
    best, trials, improved = cost(np.argsort(order).astype(np.float64)), 0, True
    while improved and trials < MAX_TRIALS:
        improved = False
        for chain in list(order):
            rest = [other for other in order if other != chain]
            for there in range(len(order)):
                candidate = [*rest[:there], chain, *rest[there:]]
                price = cost(np.argsort(candidate).astype(np.float64))
                if price < best - 1e-9:
                    best, order, improved = price, candidate, True
            trials += len(order)
            if trials >= MAX_TRIALS:
                break
    return order


def _share_rows(chains: Sequence[Chain], order: Sequence[int], cost: Cost, gap: float) -> list[Row]:
    """Put chains that never overlap in time (with a gap) into one row, if the cost allows it."""

    def apart(some: Row, others: Row) -> bool:
        return all(
            chains[a].last + gap < chains[b].first or chains[b].last + gap < chains[a].first
            for a in some
            for b in others
        )

    rows = [[chain] for chain in order]
    while True:
        limit = cost(_places(rows).astype(np.float64)) + ROW_SAVING
        best: tuple[float, list[Row]] | None = None
        for a in range(len(rows)):
            # Among many rows only neighbours are tried: the search stays short.
            reach = len(rows) if len(rows) <= MANY_ROWS else min(a + 2, len(rows))
            for b in range(a + 1, reach):
                for kept, gone in ((a, b), (b, a)) if apart(rows[a], rows[b]) else ():
                    candidate = [rows[a] + rows[b] if k == kept else r for k, r in enumerate(rows)]
                    del candidate[gone]
                    price = cost(_places(candidate).astype(np.float64))
                    if price <= limit and (best is None or price < best[0]):
                        best = price, candidate
        if best is None:
            return rows
        rows = best[1]


def arrange(frames: F64, rgb: F64, edges: Sequence[tuple[int, int]]) -> Rows:
    """Find the rows of a palette's timeline.

    Parameters
    ----------
    frames, rgb : (n,), (n, 3) float64
        The vertices' frame numbers and colours.
    edges : sequence of (int, int)
        Vertex indices, the earlier end first.
    """
    chains, vertex_chain, edge_chain = find_chains(frames, rgb, edges)
    luma = np.empty(len(chains))
    for index, chain in enumerate(chains):
        members = set(chain.vertices) | {v for e in chain.edges for v in edges[e]}
        luma[index] = float((rgb[sorted(members)] @ LUMA).mean())
    light_first = np.argsort(-luma, kind="stable")
    target = np.argsort(light_first).astype(np.float64)
    cost = _fork_cost(chains, frames, edges, vertex_chain, target)
    gap = 0.04 * float(np.ptp(frames)) if frames.size else 0.0
    rows = _share_rows(chains, _order(cost, light_first.tolist()), cost, gap)
    return Rows(chains, _places(rows), vertex_chain, edge_chain)
