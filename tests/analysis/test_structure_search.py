"""The structure search removes vertices on straight paths and keeps those worth their cost."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from analysis_frames import constant, mixture, stats
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.dense_polytope import DensePolytope
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.objective import Objective
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette, SkewPolytope
from palette4d.analysis.structure_search import Priced, Start, choose, remove_singly, search_frames

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
FACES = hull_mesh(FOUR).faces
GAMUT = Gamut(np.zeros(3), np.ones(3))


def bend(count, size, at):
    """Palettes a frame, colour 1 bending by `size` at frame `at`; and their frames."""
    palettes = []
    for i in range(count):
        rgb = FOUR + 0.01 * i
        rgb[1, 2] += size * max(0, 1 - abs(i - at) / at)
        palettes.append(Palette(rgb, FACES))
    return palettes, stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])


def full(palettes):
    return DensePolytope(range(len(palettes)), [palettes], []).polytope()


def test_every_step_has_fewer_vertices_and_its_own_value():
    palettes, frames = bend(7, 0.4, 3)
    options = AnalysisOptions(handle_cost=0.1)  # fewer is always better: down to the end
    steps = remove_singly(full(palettes), frames, GAMUT, options)
    counts = [len(s.polytope.vertices) for s in steps]
    assert counts == sorted(set(counts), reverse=True)
    assert counts[0] == 28
    assert counts[-1] == 8
    for step in steps:
        evaluate = Objective(step.polytope, frames, options, GAMUT, coarse=True)
        value, _ = evaluate(step.polytope.vertices, list(range(7)))
        assert step.value == pytest.approx(value)


def test_a_handle_that_pays_stays_and_one_that_does_not_goes():
    palettes, frames = bend(9, 0.5, 4)
    best = {}
    for cost in (0.002, 10.0):
        options = AnalysisOptions(handle_cost=cost)
        steps = remove_singly(full(palettes), frames, GAMUT, options)
        best[cost] = choose(steps, options).polytope
    inner = [v for v in best[0.002].vertices if 0 < v[3] < 8]
    assert len(inner) == 1
    assert abs(inner[0][3] - 4) < 1
    assert inner[0][2] > 0.5
    assert len(best[10.0].vertices) == 8


def test_a_number_of_vertices_may_be_asked_for():
    palettes, frames = bend(7, 0.4, 3)
    for wanted, expected in ((12, 12), (9, 9), (8, 8), (3, 8)):
        options = AnalysisOptions(vertices=wanted)
        steps = remove_singly(full(palettes), frames, GAMUT, options)
        count = len(choose(steps, options).polytope.vertices)
        assert count <= max(expected, 8)


def test_the_choice_weighs_vertices_against_the_loss():
    def step(count, value):
        return Priced(SkewPolytope(np.zeros((count, 4)), (), ()), value)

    steps = [step(20, 0.100), step(15, 0.105), step(10, 0.150)]
    for cost, count in ((0.0, 20), (0.0005, 20), (0.002, 15), (0.02, 10)):
        chosen = choose(steps, AnalysisOptions(handle_cost=cost))
        assert len(chosen.polytope.vertices) == count
    for most, count in ((30, 20), (19, 15), (10, 10), (4, 10)):
        assert len(choose(steps, AnalysisOptions(vertices=most)).polytope.vertices) == count


def test_removed_vertices_leave_their_neighbours_joined():
    palettes, _ = bend(5, 0.0, 2)
    links = tuple((i, i) for i in range(4))
    polytope = DensePolytope(range(5), [palettes[:2], palettes[2:]], [links]).polytope()
    while vertices := polytope.removable():
        polytope = polytope.without(vertices[0])
        covered = []
        for section in (*polytope.blocks, *polytope.transitions):
            for track in section.tracks:
                times = polytope.vertices[list(track), 3]
                assert (np.diff(times) > 0).all()
                assert times[0] <= section.first
                assert times[-1] >= section.last
                covered += list(track)
        assert set(covered) == set(range(len(polytope.vertices)))
    assert len(polytope.vertices) == 8
    assert len(polytope.edges()) == 4
    assert len(set(itertools.chain(*polytope.transitions[0].tracks))) == 8


def test_search_frames_hold_the_ends_the_worst_and_the_blocks():
    frames = stats([constant([0.5, 0.5, 0.5])] * 100)
    palette = hull_mesh(FOUR)
    links = tuple((i, i) for i in range(4))
    dense = DensePolytope(range(100), [[palette] * 70, [palette] * 30], [links])
    losses = np.full(100, 0.1)
    losses[37] = 0.5
    chosen = search_frames(Start(dense.polytope(), losses), frames)
    assert {0, 99, 37, 69, 70} <= set(chosen)
    assert len(chosen) <= 40
    assert max(b - a for a, b in itertools.pairwise(chosen)) <= 5
