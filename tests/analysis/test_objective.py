"""Eq. 12 as a function of the vertices: its gradient, box limits, joint moves of all vertices."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from analysis_frames import mixture, stats
from bent_track import FACES, FOUR, bent, colours_at
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.objective import Objective, loss_of, move, refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Section, SkewPolytope

from palette4d import _core

GAMUT = Gamut(np.zeros(3), np.ones(3))


@pytest.fixture
def frames():
    truth = bent(4.0)
    return stats([mixture(colours_at(truth, t), t) for t in range(11)])


def test_gradient_in_colour_and_time(frames):
    polytope = bent(5.3)
    polytope.vertices[:, :3] = 0.5 + 0.8 * (polytope.vertices[:, :3] - 0.5)  # pixels lie outside
    loss = loss_of(polytope, frames)
    which = list(range(11))
    weights = _core.LossWeights(50.0, 1e9)

    def value(v):
        rows, _ = loss.evaluate(v, which, weights, 1, False)
        return (50 * rows[:, 0] + rows[:, 1]).sum()

    _, gradient = loss.evaluate(polytope.vertices, which, weights, 1, True)
    for i, c in itertools.product(range(9), range(4)):
        if c == 3 and i < 8:
            continue
        step = np.zeros_like(polytope.vertices)
        step[i, c] = 1e-6
        slope = (value(polytope.vertices + step) - value(polytope.vertices - step)) / 2e-6
        assert gradient[i, c] == pytest.approx(slope, rel=1e-3, abs=1e-3)


def test_a_vertex_at_the_edge_of_its_box_stays_in_its_block():
    """Lengths whose division and multiplication do not cancel used to push it out by rounding."""
    for last in (46, 47, 48, 49, 53):
        polytope = bent(6.0)
        vertices = polytope.vertices.copy()
        vertices[4:8, 3] = last
        block = Section(0.0, float(last), polytope.blocks[0].tracks, FACES)
        polytope = SkewPolytope(vertices, (block,), ())
        frames = stats([mixture(colours_at(polytope, t), t, 300) for t in range(last + 1)])
        evaluate = Objective(polytope, frames, AnalysisOptions(gamma=0.0), GAMUT, coarse=True)
        for at in np.linspace(5.0, 7.0, 23):
            box = (vertices[[8]].copy(), vertices[[8]].copy())
            box[0][0, 3] = box[1][0, 3] = at  # nowhere to go but here
            moved = move(evaluate, vertices, np.array([8]), [3], box, 3)
            assert moved[8, 3] == at


def test_joint_refinement_finds_the_bend_and_never_worsens(frames):
    options = AnalysisOptions(convexity=0.0, separation=0.0)
    start = bent(6.0)
    everything = list(range(11))
    for coarse in (True, False):
        before, _ = Objective(start, frames, options, GAMUT, coarse)(start.vertices, everything)
        refined, after = refine_jointly(start, frames, GAMUT, options, 100, coarse)
        assert after < 0.6 * before
        assert refined.vertices[8, 3] < 5.2  # the bend is at 4
        np.testing.assert_array_equal(refined.vertices[:8, 3], start.vertices[:8, 3])
        value, _ = Objective(refined, frames, options, GAMUT, coarse)(refined.vertices, everything)
        assert value == after
        # Near the best place even one step may lead away from it.
        for steps in (1, 2, 8):
            _, value = refine_jointly(refined, frames, GAMUT, options, steps, coarse)
            assert value <= after
    same, _ = refine_jointly(start, frames, GAMUT, options, 0, True)
    np.testing.assert_array_equal(same.vertices, start.vertices)


def test_parts_of_the_frames_stand_for_all(frames):
    options = AnalysisOptions()
    start = bent(5.3)
    evaluate = Objective(start, frames[:9], options, GAMUT, coarse=True)
    whole = evaluate(start.vertices, list(range(9)))
    parts = [evaluate(start.vertices, list(range(i, 9, 3)), for_all=True) for i in range(3)]
    assert np.mean([value for value, _ in parts]) == pytest.approx(whole[0])
    np.testing.assert_allclose(np.mean([slope for _, slope in parts], axis=0), whole[1], atol=1e-12)


def test_what_is_there_for_a_moment_stays_where_it_is_in_time(frames):
    start = bent(5.3)  # the bend is at 4
    found, _ = refine_jointly(start, frames, GAMUT, AnalysisOptions(), 100, True, brief=(8,))
    assert found.vertices[8, 3] == 5.3
    assert np.abs(found.vertices[8, :3] - start.vertices[8, :3]).max() > 1e-3


def test_separation_keeps_colours_apart():
    """Two of the clip's five colours nearly touch; the palette's must not."""
    near = np.vstack([FOUR, FOUR[1] + [0.0, 0.05, 0.0]])
    mesh = hull_mesh(near)
    count = len(mesh.rgb)
    frames = stats([mixture(near, t) for t in range(3)])
    # Not with pixels right on the vertices: the loss has a kink there, where a search may end.
    grown = 0.5 + 1.02 * (mesh.rgb - 0.5)
    vertices = np.array([[*c, t] for t in (0.0, 2.0) for c in grown])
    tracks = tuple((i, count + i) for i in range(count))
    polytope = SkewPolytope(vertices, (Section(0.0, 2.0, tracks, mesh.faces),), ())
    gaps = []
    for separation in (0.0, 0.2):
        options = AnalysisOptions(separation=separation)
        refined, _ = refine_jointly(polytope, frames, GAMUT, options, 100, True)
        rgb = refined.vertices[:count, :3]
        pairs = itertools.combinations(range(count), 2)
        gaps.append(min(np.linalg.norm(rgb[i] - rgb[j]) for i, j in pairs))
    assert gaps[0] < 0.1 < gaps[1]
