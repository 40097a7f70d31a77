"""Gluing: the four topological rules hold, tracks join like colours, the mesh between is closed."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import pytest
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.glue import glue, transition_faces
from palette4d.analysis.polytope import FramePalette

from palette4d import _core

CUBE = np.array(list(itertools.product([0.2, 0.8], repeat=3)))


def rules_hold(first, second, links):
    """The four rules of section 5.2.2, checked from their text."""
    near_first, near_second = first.adjacency(), second.adjacency()
    of_first = {v: [j for i, j in links if i == v] for v in range(len(first.rgb))}
    of_second = {u: [i for i, j in links if j == u] for u in range(len(second.rgb))}
    degree1 = all(of_first.values()) and all(of_second.values())
    degree2 = all(len(of_first[i]) == 1 or len(of_second[j]) == 1 for i, j in links)
    topo1 = all(
        near_second[a, b] for us in of_first.values() for a, b in itertools.combinations(us, 2)
    ) and all(
        near_first[a, b] for vs in of_second.values() for a, b in itertools.combinations(vs, 2)
    )

    def maps(near, images, other):
        return all(
            any(a == b or other[a, b] for a in images[v] for b in images[w])
            for v, w in zip(*np.nonzero(near), strict=True)
        )

    topo2 = maps(near_first, of_first, near_second) and maps(near_second, of_second, near_first)
    return degree1, degree2, topo1, topo2


def closed(faces):
    directed = [(int(f[e]), int(f[(e + 1) % 3])) for f in faces for e in range(3)]
    return len(set(directed)) == len(directed) and all((b, a) in directed for a, b in directed)


def solid(seed, n, spread=0.0):
    rng = np.random.default_rng(seed)
    while True:
        directions = rng.normal(size=(n, 3))
        points = 0.5 + 0.4 * directions / np.linalg.norm(directions, axis=1)[:, None]
        palette = hull_mesh(points + rng.normal(0, spread, points.shape))
        if len(palette.rgb) == n:
            return palette


def test_a_moved_palette_is_consistent():
    first = solid(1, 7)
    order = np.random.default_rng(2).permutation(7)
    place = np.argsort(order)
    second = FramePalette(first.rgb[order] + 0.01, place[first.faces].astype(np.int32))
    found = glue(first, second)
    assert found.consistent
    assert found.broken == 0
    assert all(order[j] == i for i, j in found.links)


def test_a_split_is_found():
    first = solid(3, 6)
    far = int(np.argmax(first.rgb[:, 0]))
    split = np.vstack([first.rgb, first.rgb[far] + [0.0, 0.08, 0.08]])
    split[far] += [0.02, -0.04, -0.04]
    second = hull_mesh(split)
    assert len(second.rgb) == 7
    found = glue(first, second)
    assert not found.consistent
    splitting = [i for i in range(6) if sum(a == i for a, _ in found.links) == 2]
    assert splitting == [far]
    back = glue(second, first)
    assert sorted((j, i) for i, j in back.links) == sorted(
        found.links
    )  # a merge is a split backwards


@pytest.mark.parametrize("seed", range(12))
def test_rules_and_meshes_of_random_pairs(seed):
    rng = np.random.default_rng(seed)
    first, second = (solid(100 + 2 * seed + i, int(rng.integers(4, 9))) for i in range(2))
    found = glue(first, second)
    degree1, degree2, topo1, topo2 = rules_hold(first, second, found.links)
    assert degree1
    if found.broken == 0:
        assert degree2
        assert topo1
        assert topo2
    else:
        assert not topo2
    faces = transition_faces(first, second, found.links)
    assert closed(faces)
    assert len(faces) == 2 * (len(found.links) - 2)
    assert set(faces.ravel()) == set(range(len(found.links)))


@pytest.mark.parametrize("seed", range(3))
def test_no_shorter_links_obey_the_rules(seed):
    first, second = solid(seed, 4), solid(seed + 10, 5)
    sets = [s for size in (1, 2, 3) for s in itertools.combinations(range(5), size)]
    distance = np.linalg.norm(first.rgb[:, None] - second.rgb, axis=2)
    costs = np.array([[row[list(s)].sum() for s in sets] for row in distance])
    total = functools.reduce(np.add.outer, costs)  # of all choices of the four colours
    found = sum(distance[i, j] for i, j in glue(first, second).links)
    shorter = np.argwhere(total < found - 1e-9)
    assert len(shorter) > 10
    for choice in shorter:
        links = [(i, j) for i, at in enumerate(choice) for j in sets[at]]
        assert not all(rules_hold(first, second, links))


@pytest.mark.parametrize(
    ("allowed", "order"), [((3, 4), range(4)), ((4, 4), range(3)), ((4, 4), (0, 1, 1, 2))]
)
def test_arrays_that_do_not_fit_are_refused(allowed, order):
    near = np.ones((4, 4), bool)
    with pytest.raises(ValueError, match="links need matrices"):
        _core.find_links(
            np.ones((4, 4)), np.ones(allowed, bool), near, near, list(order),
            strict=True, bound=1.0, broken_cost=1.0, most_nodes=9,
        )  # fmt: skip


def test_one_colour_may_link_to_three():
    first, second = np.ones((1, 1), bool), np.ones((3, 3), bool)
    links, broken, complete = _core.find_links(
        np.ones((1, 3)), np.ones((1, 3), bool), first, second, [0],
        strict=True, bound=9.0, broken_cost=1.0, most_nodes=9,
    )  # fmt: skip
    assert (sorted(map(tuple, links)), broken, complete) == ([(0, 0), (0, 1), (0, 2)], 0, True)


def test_between_two_frames_the_mesh_meets_both_palettes():
    """With the rules obeyed, projecting the mesh to either side gives that side's triangles."""
    for seed in range(6):
        first = solid(seed, 6)
        second = hull_mesh(first.rgb + np.random.default_rng(seed).normal(0, 0.02, first.rgb.shape))
        found = glue(first, second)
        if len(second.rgb) != 6 or found.broken:
            continue
        faces = transition_faces(first, second, found.links)
        for side, palette in ((0, first), (1, second)):
            image = {
                frozenset(found.links[v][side] for v in face)
                for face in faces
                if len({found.links[v][side] for v in face}) == 3
            }
            assert {frozenset(map(int, f)) for f in palette.faces} <= image


@pytest.mark.parametrize(
    ("n", "m"), [(1, 1), (1, 2), (2, 1), (2, 2), (1, 8), (8, 1), (2, 8), (8, 2)]
)
def test_palettes_of_one_and_two_colours(n, m):
    none = np.zeros((0, 3), np.int32)

    def make(count):
        if count <= 2:
            return FramePalette(np.linspace(0.1, 0.9, count)[:, None].repeat(3, 1), none)
        return hull_mesh(CUBE)

    first, second = make(n), make(m)
    found = glue(first, second)
    assert {i for i, _ in found.links} == set(range(n))
    assert {j for _, j in found.links} == set(range(m))
    assert found.consistent == (n == m)
    faces = transition_faces(first, second, found.links)
    assert closed(faces)
    assert len(faces) == (12 if max(n, m) == 8 else 0)


def test_a_search_that_is_ended_early_says_so(monkeypatch):
    first = solid(1, 8)
    second = hull_mesh(first.rgb + np.random.default_rng(2).normal(0, 0.05, first.rgb.shape))
    assert glue(first, second).complete
    monkeypatch.setattr("palette4d.analysis.glue.MOST_NODES", 3)
    cut = glue(first, second)
    assert not cut.complete
    assert {i for i, _ in cut.links} == set(range(len(first.rgb)))  # links all the same
    assert {j for _, j in cut.links} == set(range(len(second.rgb)))
