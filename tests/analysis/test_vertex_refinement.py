"""Vertex refinement: the loss falls, slices become convex."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from analysis_frames import noise, stats
from palette4d.analysis.convex_hulls import CONCAVE, deepest_concavity, hull_mesh
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.objective import refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Section, SkewPolytope
from palette4d.analysis.vertex_refinement import GENTLE, STEPS, refine

CUBE = np.array(list(itertools.product((0.1, 0.9), repeat=3)))
FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
GAMUT = Gamut(np.zeros(3), np.ones(3))
LIMP = AnalysisOptions(convexity=0.02, separation=0.0, reach=0.0, refinement_box=0.5)


def cube_with_apex():
    """A cube at rest for three frames, with a ninth colour just below its top face."""
    mesh = hull_mesh(np.vstack([CUBE, [0.5, 0.5, 0.95]]))
    rgb = np.where(mesh.rgb > 0.9, 0.82, mesh.rgb)
    n = len(rgb)
    vertices = np.array([[*c, t] for t in (0.0, 2.0) for c in rgb])
    tracks = tuple((i, n + i) for i in range(n))
    return SkewPolytope(vertices, (Section(0.0, 2.0, tracks, mesh.faces),), ())


@pytest.fixture(scope="module")
def frames():
    """Colours in a cube, most of them in its middle, which attract the palette (eq. 3)."""
    images = [noise(i, 0.8, 0.1, (30, 30)) for i in range(3)]
    for image in images:
        image[10:] = 0.5
    return stats(images)


def test_slices_that_are_not_convex_are_refined_again(frames):
    start = cube_with_apex()
    once, _ = refine_jointly(start, frames, GAMUT, LIMP, STEPS, False, (), GENTLE)
    assert deepest_concavity(once, frames) > CONCAVE
    free = dataclasses.replace(LIMP, convexity=0.0)
    once, _ = refine_jointly(start, frames, GAMUT, free, STEPS, False, (), GENTLE)
    assert deepest_concavity(once, frames) > CONCAVE
    # Without `convexity` nobody asks for it.
    found = refine(start, frames, GAMUT, free)
    np.testing.assert_array_equal(found.vertices, once.vertices)
    assert deepest_concavity(refine(start, frames, GAMUT, LIMP), frames) < CONCAVE
