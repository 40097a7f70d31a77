"""Vertex refinement: the loss on all colours falls, a static hull stays within its bound."""

from __future__ import annotations

import numpy as np
from analysis_frames import mixture, stats
from palette4d.analysis import static_hull
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.objective import losses_of
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Section, SkewPolytope
from palette4d.analysis.vertex_refinement import refine, relax

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
GAMUT = Gamut(np.zeros(3), np.ones(3))


def test_the_loss_falls_and_only_inner_vertices_move_in_time():
    """The clip's red turns brighter at frame 3; the palette's does at frame 2."""
    red = np.interp(range(7), (0, 3, 6), (0.6, 0.9, 0.6))
    frames = stats([mixture(np.vstack([FOUR[0], [r, 0.2, 0.2], FOUR[2:]]), 1, 900) for r in red])
    mesh = hull_mesh(FOUR)
    place = int(np.argmax(mesh.rgb[:, 0]))
    ends = [(*c, t) for t in (0.0, 6.0) for c in np.minimum(mesh.rgb, (0.65, 1, 1))]
    tracks = [[i, 4 + i] for i in range(4)]
    tracks[place].insert(1, 8)
    block = Section(0.0, 6.0, tuple(map(tuple, tracks)), mesh.faces)
    start = SkewPolytope(np.array([*ends, (0.85, 0.2, 0.2, 2.0)]), (block,), ())
    options = AnalysisOptions(k=8)
    found = refine(start, frames, GAMUT, options)
    before, after = (losses_of(one, frames, options).L_prime for one in (start, found))
    assert after < 0.8 * before
    assert found.blocks == start.blocks
    np.testing.assert_array_equal(found.vertices[:8, 3], start.vertices[:8, 3])
    assert 2 < found.vertices[8, 3] < 4
    assert found.vertices[8, 0] > found.vertices[place, 0] + 0.1


def test_a_static_hull_that_may_move_stays_within_its_bound():
    frames = stats([mixture(FOUR + 0.01 * i, i, 3000) for i in range(3)])
    options = AnalysisOptions()
    hull = min(
        static_hull.plain_hulls(static_hull.starts(frames, options), frames, GAMUT, options),
        key=lambda one: losses_of(one, frames, options).L_prime,
    )
    bound = losses_of(hull, frames, options).L_prime
    found = relax(hull, frames, GAMUT, options, bound)
    assert losses_of(found, frames, options).L_prime <= bound
    assert relax(hull, frames, GAMUT, options, 0.0) is hull  # nothing is so good
