"""Vertex refinement: eq. 12 falls, the box of section 5.5 holds, the gradient is the loss's own."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from analysis_frames import mixture, stats
from palette4d.analysis.frame_hulls import hull_mesh
from palette4d.analysis.losses import smoothness
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Section, SkewPolytope
from palette4d.analysis.vertex_refinement import _move, _Objective, loss_of, refine

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
FACES = hull_mesh(FOUR).faces
LOW, HIGH = np.zeros(3), np.ones(3)


def bent(middle=6.0):
    """Frames 0 to 10; three colours rest, colour 1 goes to blue-ish by `middle` and back."""
    ends = [[*c, t] for t in (0.0, 10.0) for c in FOUR]
    vertices = np.array([*ends, [0.9, 0.2, 0.7, middle]])
    tracks = ((0, 4), (1, 8, 5), (2, 6), (3, 7))
    return SkewPolytope(vertices, (Section(0.0, 10.0, tracks, FACES),), ())


def colours_at(polytope, t):
    return np.array(
        [
            [
                np.interp(t, polytope.vertices[list(k), 3], polytope.vertices[list(k), c])
                for c in range(3)
            ]
            for k in polytope.blocks[0].tracks
        ]
    )


@pytest.fixture
def frames():
    truth = bent(4.0)
    return stats([mixture(colours_at(truth, t), t) for t in range(11)])


def refinement_loss(polytope, frames, options):
    rows, _ = loss_of(polytope, frames).evaluate(
        polytope.vertices, list(range(len(frames))), options.lambda_, options.k, 0.0, 1, False
    )
    k, _ = smoothness(polytope.vertices, polytope.edges(), polytope.length())
    return options.lambda_ * rows[:, 0].mean() + rows[:, 1].mean() + options.gamma * k


def test_loss_falls_and_a_vertex_finds_its_time(frames):
    options = AnalysisOptions(convexity=0.0)
    start = bent(6.0)
    refined = refine(start, frames, LOW, HIGH, options)
    assert refinement_loss(refined, frames, options) < 0.6 * refinement_loss(start, frames, options)
    assert refined.vertices[8, 3] < 5.2  # the bend is at 4


def test_box_and_fixed_times(frames):
    options = AnalysisOptions(refinement_cycles=1, refinement_box=0.03)
    start = bent(6.0)
    refined = refine(start, frames, LOW, HIGH, options)
    # One cycle moves a vertex once alone and once with the others: twice the box.
    assert np.abs(refined.vertices[:, :3] - start.vertices[:, :3]).max() <= 0.06 + 1e-9
    np.testing.assert_array_equal(refined.vertices[:8, 3], start.vertices[:8, 3])
    assert 0 < refined.vertices[8, 3] < 10


def test_no_cycles_is_no_change(frames):
    start = bent()
    refined = refine(start, frames, LOW, HIGH, AnalysisOptions(refinement_cycles=0))
    np.testing.assert_array_equal(refined.vertices, start.vertices)


def test_the_result_does_not_depend_on_threads(frames):
    results = [
        refine(bent(), frames, LOW, HIGH, AnalysisOptions(refinement_cycles=1, threads=n))
        for n in (1, 2, 5)
    ]
    for other in results[1:]:
        np.testing.assert_array_equal(results[0].vertices, other.vertices)


def test_gradient_in_colour_and_time(frames):
    polytope = bent(5.3)
    polytope.vertices[:, :3] = 0.5 + 0.8 * (polytope.vertices[:, :3] - 0.5)  # pixels lie outside
    loss = loss_of(polytope, frames)
    which = list(range(11))

    def value(v):
        rows, _ = loss.evaluate(v, which, 50.0, 1e9, 0.0, 1, False)
        return (50 * rows[:, 0] + rows[:, 1]).sum()

    _, gradient = loss.evaluate(polytope.vertices, which, 50.0, 1e9, 0.0, 1, True)
    for i, c in itertools.product(range(9), range(4)):
        if c == 3 and i < 8:
            continue
        step = np.zeros_like(polytope.vertices)
        step[i, c] = 1e-6
        slope = (value(polytope.vertices + step) - value(polytope.vertices - step)) / 2e-6
        assert gradient[i, c] == pytest.approx(slope, rel=1e-3, abs=1e-3)


def test_a_vertex_that_leaves_a_block_end_keeps_both_blocks_covered():
    """The edge through a boundary starts at a vertex that may move away from it."""
    vertices = np.array(
        [[*c, t] for t in (0.0, 10.0) for c in FOUR] + [[0.9, 0.2, 0.7, 5.0]], float
    )
    whole = ((0, 4), (1, 8, 5), (2, 6), (3, 7))
    early = ((0, 4), (1, 8), (2, 6), (3, 7))
    late = ((0, 4), (8, 5), (2, 6), (3, 7))
    polytope = SkewPolytope(
        vertices,
        (Section(0.0, 5.0, early, FACES), Section(6.0, 10.0, late, FACES)),
        (Section(5.0, 6.0, late, FACES),),
    )
    moved = vertices.copy()
    moved[8, 3] = 3.0
    result = polytope.with_vertices(moved)
    assert result.blocks[0].tracks == whole
    assert result.blocks[1].tracks == late
    assert polytope.extended_tracks(polytope.blocks[0])[1] == [1, 8, 5]


def test_a_vertex_at_the_edge_of_its_box_stays_in_its_block():
    """Lengths whose division and multiplication do not cancel used to push it out by rounding."""
    for last in (46, 47, 48, 49, 53):
        polytope = bent(6.0)
        vertices = polytope.vertices.copy()
        vertices[4:8, 3] = last
        block = Section(0.0, float(last), polytope.blocks[0].tracks, FACES)
        polytope = SkewPolytope(vertices, (block,), ())
        frames = stats([mixture(colours_at(polytope, t), t, 300) for t in range(last + 1)])
        evaluate = _Objective(polytope, frames, AnalysisOptions(gamma=0.0), 1.0, coarse=True)
        for at in np.linspace(5.0, 7.0, 23):
            box = (vertices[[8]].copy(), vertices[[8]].copy())
            box[0][0, 3] = box[1][0, 3] = at  # nowhere to go but here
            moved = _move(evaluate, vertices, np.array([8]), [3], box, 3)
            assert moved[8, 3] == at
