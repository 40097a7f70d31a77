"""Vertex refinement: eq. 12 falls, the box of section 5.5 holds, the gradient is the loss's own."""

from __future__ import annotations

import numpy as np
import pytest
from analysis_frames import mixture, stats
from bent_track import bent, colours_at
from palette4d.analysis.losses import loss_weights, smoothness
from palette4d.analysis.objective import loss_of
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.vertex_refinement import refine

LOW, HIGH = np.zeros(3), np.ones(3)


@pytest.fixture
def frames():
    truth = bent(4.0)
    return stats([mixture(colours_at(truth, t), t) for t in range(11)])


def refinement_loss(polytope, frames, options):
    rows, _ = loss_of(polytope, frames).evaluate(
        polytope.vertices, list(range(len(frames))), loss_weights(options), 1, False
    )
    k, _ = smoothness(polytope.vertices, polytope.edges(), polytope.length())
    return options.lambda_ * rows[:, 0].mean() + rows[:, 1].mean() + options.gamma * k


def test_loss_falls_and_a_vertex_finds_its_time(frames):
    options = AnalysisOptions(convexity=0.0, separation=0.0)
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
