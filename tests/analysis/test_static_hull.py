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
from palette4d.analysis.static_hull import ladder, starts, static_polytope

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


def rungs(pictures, options=OPTIONS):
    frames = stats(pictures)
    return list(ladder(starts(frames, options)[0], frames, GAMUT, options))


def test_the_ladder_loses_the_colours_that_are_needed_least():
    found = rungs([mixture(CORNERS, i) for i in range(3)])
    counts = [len(rung.blocks[0].tracks) for rung in found]
    assert counts == sorted(set(counts), reverse=True)
    assert counts[0] >= 8
    assert counts[-1] == 4
    eight = found[counts.index(8)].vertices[:8, :3]
    assert np.abs(eight[:, None] - CORNERS).max(axis=2).min(axis=1).max() < 0.05
    for rung in found:
        early, late = np.split(rung.vertices, 2)
        np.testing.assert_array_equal(early[:, :3], late[:, :3])
        assert set(early[:, 3]) == {0}
        assert set(late[:, 3]) == {2}


def test_the_ladder_begins_with_no_more_than_palette_size_colours():
    few = dataclasses.replace(OPTIONS, palette_size=6)
    found = rungs([mixture(CORNERS, i) for i in range(3)], few)
    assert 4 < max(len(rung.blocks[0].tracks) for rung in found) <= 6


def test_colours_without_volume_have_no_ladder():
    assert rungs([constant([0.3, 0.4, 0.5])] * 3) == []
