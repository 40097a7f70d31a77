"""The static hull of section 6.2: one palette that does not move, refined for all frames."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from analysis_frames import constant, mixture, stats
from palette4d.analysis.convex_hulls import deepest_concavity, hull_mesh
from palette4d.analysis.frame_hulls import frame_palette
from palette4d.analysis.frame_statistics import Gamut, pooled
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette
from palette4d.analysis.static_hull import static_polytope

CORNERS = np.array(list(itertools.product((0.1, 0.9), repeat=3)))
FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
GAMUT = Gamut(np.zeros(3), np.ones(3))
OPTIONS = AnalysisOptions()


def static(frames):
    colours = pooled([f.coarse for f in frames], OPTIONS.coarse_colours)
    palette = frame_palette(colours, GAMUT, OPTIONS)
    return palette, static_polytope(palette, frames, GAMUT, OPTIONS)


def test_colours_do_not_move_and_the_loss_falls():
    frames = stats([mixture(FOUR + 0.02 * i, i) for i in range(6)], first=100)
    palette, polytope = static(frames)
    n = len(palette.rgb)
    assert len(polytope.vertices) == 2 * n
    np.testing.assert_array_equal(polytope.vertices[:n, :3], polytope.vertices[n:, :3])
    assert set(polytope.vertices[:n, 3]) == {100}
    assert set(polytope.vertices[n:, 3]) == {105}
    assert len(polytope.blocks) == 1

    def loss(rgb):
        return np.mean([palette_loss(f.coarse, rgb, OPTIONS) for f in frames])

    assert loss(polytope.vertices[:n, :3]) < loss(palette.rgb)


def test_pooling_counts_every_pixel():
    count = 35
    frames = stats([mixture(FOUR, i) for i in range(count)])
    colours = pooled([f.coarse for f in frames], OPTIONS.coarse_colours)
    assert colours.total == pytest.approx(600 * count)
    assert len(colours) <= OPTIONS.coarse_colours


@pytest.mark.parametrize("frames", [1, 3])
def test_one_colour(frames):
    statistics = stats([constant([0.3, 0.4, 0.5])] * frames)
    _, polytope = static(statistics)
    assert len(polytope.vertices) == min(frames, 2)
    for vertex in polytope.vertices:
        np.testing.assert_allclose(vertex[:3], [0.3, 0.4, 0.5], atol=3e-3)


def test_a_mesh_that_has_folded_is_unfolded():
    """Without `convexity` nothing keeps it from that, and the losses do not see it."""
    frames = stats([mixture(CORNERS, i) for i in range(3)])
    mesh = hull_mesh(CORNERS)
    other = mesh.rgb[[1, 0, *range(2, len(mesh.rgb))]]  # two colours have changed places
    plain = dataclasses.replace(OPTIONS, convexity=0.0, separation=0.0)
    folded = FramePalette(other, mesh.faces)
    polytope = static_polytope(folded, frames, GAMUT, plain)
    assert deepest_concavity(polytope, frames) < 1e-9
    # With a colour inside of the others it cannot be.
    inside = FramePalette(np.vstack([other, CORNERS.mean(axis=0)]), mesh.faces)
    polytope = static_polytope(inside, frames, GAMUT, plain)
    np.testing.assert_array_equal(polytope.blocks[0].faces, mesh.faces)
