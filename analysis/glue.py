"""Gluing, section 5.2.2: the palettes of two frames become a two-frame 4D skew polytope.

Input: two palettes. Output: `Glue`, the inter-frame edges (pairs of colour indices) and the
triangle mesh between the two frames, whose corners are these edges. The edges obey the two
inter-degree rules and the two topological rules at the least total colour distance. The search is
exhaustive (branch and bound) among the edges of the 4D convex hull of both palettes.

A second search tries all pairs of colours; a shorter solution wins. The paper searches only the
edges of the hull, but then colours inside the hull of both frames link to unrelated colours. If the
two triangulations cannot be mapped onto each other, no solution exists. Then the edges break
topological rule 2 as little as possible.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.polytope import FramePalette
from scipy.spatial import ConvexHull, QhullError

from palette4d import _core

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
Bool = NDArray[np.bool_]
Links = tuple[tuple[int, int], ...]

# Cap on the nodes of the branch and bound; at the cap it returns its best solution. Real clips need
# far fewer.
MOST_NODES = 200_000


@dataclasses.dataclass(frozen=True)
class Glue:
    """Inter-frame edges between two palettes.

    Attributes
    ----------
    links : (i, j) pairs, colour i of the first palette to colour j of the second, sorted.
    broken : how many intra-frame edges break topological rule 2 (0 if a solution exists).
    consistent : all links are one-to-one, and both palettes have the same connectivity
        (section 5.3).
    complete : whether the search saw every solution; otherwise the links are the best found.
    """

    links: Links
    broken: int
    consistent: bool
    complete: bool = True


def glue(first: FramePalette, second: FramePalette) -> Glue:
    """Return the best inter-frame edges between two palettes."""
    n, m = len(first.rgb), len(second.rgb)
    distance = np.linalg.norm(first.rgb[:, None] - second.rgb[None], axis=2)
    if min(n, m) <= 2:
        links = _nearest_links(distance)
        return Glue(links, 0, n == m and _same_topology(first, second, links))
    hull = hull_pairs(first.rgb, second.rgb)
    all_pairs = np.ones_like(hull)
    solution, complete = _search(first, second, distance, hull, strict=True)
    bound = np.inf if solution is None else sum(float(distance[i, j]) for i, j in solution[0])
    shorter, also_complete = _search(first, second, distance, all_pairs, strict=True, bound=bound)
    solution, complete = shorter or solution, complete and also_complete
    if solution is not None:
        same = n == m and _same_topology(first, second, solution[0])
        return Glue(solution[0], 0, same, complete)
    solution, also_complete = _search(first, second, distance, all_pairs, strict=False)
    if solution is None:
        links = _nearest_links(distance)
        solution = links, _broken_edges(first, second, links)
    return Glue(solution[0], solution[1], False, complete and also_complete)


def hull_pairs(first: F64, second: F64) -> Bool:
    """Return which (i, j) are edges of the RGBT convex hull of two palettes one frame apart."""
    n, m = len(first), len(second)
    points = np.vstack([np.hstack([first, np.zeros((n, 1))]), np.hstack([second, np.ones((m, 1))])])
    out = np.zeros((n, m), bool)
    try:
        hull = ConvexHull(points, qhull_options="QJ")
    except QhullError:
        return ~out
    for simplex in hull.simplices:
        early, late = simplex[simplex < n], simplex[simplex >= n] - n
        out[np.ix_(early, late)] = True
    return out


def _search(
    first: FramePalette,
    second: FramePalette,
    distance: F64,
    allowed: Bool,
    strict: bool,
    bound: float = np.inf,
) -> tuple[tuple[Links, int] | None, bool]:
    """Return the shortest links below a bound, if any, with the number of broken edges, and whether
    every solution was seen."""
    near = first.adjacency()
    links, broken, complete = _core.find_links(
        distance,
        allowed,
        near,
        second.adjacency(),
        _breadth_first(near),
        strict=strict,
        bound=bound,
        broken_cost=float(distance.sum()),  # more than breaking a rule can save
        most_nodes=MOST_NODES,
    )
    return (tuple(links), broken) if links else None, complete


def _breadth_first(adjacency: Bool) -> list[int]:
    """Order the vertices so that each touches an earlier one: then the rules prune early."""
    order = [int(np.argmax(adjacency.sum(axis=1)))]
    while len(order) < len(adjacency):
        rest = [v for v in range(len(adjacency)) if v not in order]
        order.append(max(rest, key=lambda v: (int(adjacency[v, order].sum()), -v)))
    return order


def _nearest_links(distance: F64) -> Links:
    """Match the smaller palette one-to-one at least total distance; the rest go to the nearest
    colour."""
    if distance.shape[0] > distance.shape[1]:
        return tuple(sorted((i, j) for j, i in _nearest_links(distance.T)))
    from scipy.optimize import linear_sum_assignment  # slow to import, and few clips need it

    rows, columns = linear_sum_assignment(distance)
    links = {(int(i), int(j)) for i, j in zip(rows, columns, strict=True)}
    for j in set(range(distance.shape[1])) - {j for _, j in links}:
        links.add((int(np.argmin(distance[:, j])), j))
    return tuple(sorted(links))


def _same_topology(first: FramePalette, second: FramePalette, links: Links) -> bool:
    if len(links) != len(first.rgb) or len({i for i, _ in links}) != len({j for _, j in links}):
        return False
    to = dict(links)
    image = {_triangle(to[int(a)], to[int(b)], to[int(c)]) for a, b, c in first.faces}
    return image == {_triangle(*map(int, face)) for face in second.faces}


def _broken_edges(first: FramePalette, second: FramePalette, links: Links) -> int:
    near, far = first.adjacency(), second.adjacency()
    broken = 0
    for source, target, pairs in ((near, far, links), (far, near, tuple((j, i) for i, j in links))):
        images = [[j for i, j in pairs if i == v] for v in range(len(source))]
        broken += sum(
            bool(source[v, w])
            and not any(a == b or target[a, b] for a in images[v] for b in images[w])
            for v, w in itertools.combinations(range(len(source)), 2)
        )
    return broken


def _triangle(a: int, b: int, c: int) -> tuple[int, int, int]:
    """Rotate so that equal oriented triangles compare equal."""
    return min((a, b, c), (b, c, a), (c, a, b))


def transition_faces(first: FramePalette, second: FramePalette, links: Links) -> I32:
    """Return the (f, 3) triangles over the links: the topology between the two frames.

    If colours only split, it is the second palette's mesh; if they only merge, the first's. If
    colours split and merge, it is the second palette's mesh with each merging vertex split into its
    tracks. The cut reproduces most of the first palette's triangles, or all if the rules hold.
    """
    late = [j for _, j in links]
    early = [i for i, _ in links]
    if len(set(late)) == len(links):
        place = {j: index for index, j in enumerate(late)}
        return _relabel(second.faces, place)
    if len(set(early)) == len(links):
        place = {i: index for index, i in enumerate(early)}
        return _relabel(first.faces, place)
    tracks = {j: [index for index, (_, b) in enumerate(links) if b == j] for j in set(late)}
    mesh = [tuple(tracks[int(v)][0] for v in face) for face in second.faces]
    wanted = {_triangle(*map(int, face)) for face in first.faces}
    for j in sorted(tracks):
        for fresh in tracks[j][1:]:
            mesh = _split_vertex(mesh, tracks[j][0], fresh, early, wanted)
    return np.array(mesh, np.int32).reshape(-1, 3)


def _relabel(faces: I32, place: dict[int, int]) -> I32:
    return np.array([[place[int(v)] for v in face] for face in faces], np.int32).reshape(-1, 3)


Mesh = list[tuple[int, ...]]


def _split_vertex(
    mesh: Mesh, old: int, fresh: int, early: list[int], wanted: set[tuple[int, int, int]]
) -> Mesh:
    """Split `old` into `old` and `fresh` along the best pair of its neighbours."""
    star = {}  # neighbour -> next neighbour, anticlockwise round `old`
    for face in mesh:
        if old in face:
            index = face.index(old)
            star[face[(index + 1) % 3]] = face[(index + 2) % 3]
    ring = [min(star)]
    while len(ring) < len(star):
        ring.append(star[ring[-1]])
    others = [face for face in mesh if old not in face]
    best: tuple[int, Mesh] | None = None
    for i, j in itertools.permutations(range(len(ring)), 2):
        span = [ring[(i + s) % len(ring)] for s in range((j - i) % len(ring) + 1)]
        back = [ring[(j + s) % len(ring)] for s in range((i - j) % len(ring) + 1)]
        fan: Mesh = [(fresh, a, b) for a, b in itertools.pairwise(span)]
        fan += [(old, a, b) for a, b in itertools.pairwise(back)]
        fan += [(fresh, span[-1], old), (old, span[0], fresh)]
        candidate = others + fan
        score = len(wanted & {_triangle(*(early[v] for v in face)) for face in candidate})
        if best is None or score > best[0]:
            best = score, candidate
    assert best is not None  # in a closed mesh every vertex has at least three neighbours
    return best[1]
