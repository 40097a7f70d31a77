"""The static hull of section 6.2: one palette that does not move, refined for all frames."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from analysis_frames import constant, mixture, noise, stats
from palette4d.analysis.convex_hulls import deepest_concavity
from palette4d.analysis.frame_statistics import Gamut, pooled
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.static_hull import ladder

CORNERS = np.array(list(itertools.product((0.1, 0.9), repeat=3)))
FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
GAMUT = Gamut(np.zeros(3), np.ones(3))
OPTIONS = AnalysisOptions()


def rungs(pictures, options=OPTIONS, first=0):
    return ladder(stats(pictures, first=first), GAMUT, options)


def test_pooling_counts_every_pixel():
    count = 35
    frames = stats([mixture(FOUR, i) for i in range(count)])
    colours = pooled([f.coarse for f in frames], OPTIONS.coarse_colours)
    assert colours.total == pytest.approx(600 * count)
    assert len(colours) <= OPTIONS.coarse_colours


@pytest.mark.parametrize("frames", [1, 3])
def test_colours_without_volume_have_one_palette(frames):
    (rung,) = rungs([constant([0.3, 0.4, 0.5])] * frames)
    assert len(rung.polytope.vertices) == min(frames, 2)
    for vertex in rung.polytope.vertices:
        np.testing.assert_allclose(vertex[:3], [0.3, 0.4, 0.5], atol=3e-3)


def test_the_ladder_loses_the_colours_that_are_needed_least():
    found = rungs([mixture(CORNERS, i) for i in range(3)], first=100)
    counts = [len(rung.polytope.blocks[0].tracks) for rung in found]
    assert counts == sorted(set(counts), reverse=True)
    assert counts[0] >= 8
    assert counts[-1] == 4
    eight = found[counts.index(8)].polytope.vertices[:8, :3]
    assert np.abs(eight[:, None] - CORNERS).max(axis=2).min(axis=1).max() < 0.05
    for rung in found:
        early, late = np.split(rung.polytope.vertices, 2)
        np.testing.assert_array_equal(early[:, :3], late[:, :3])
        assert set(early[:, 3]) == {100}
        assert set(late[:, 3]) == {102}
        assert len(rung.polytope.blocks) == 1


def test_the_loss_is_that_of_the_palette_in_all_frames():
    pictures = [mixture(FOUR + 0.02 * i, i) for i in range(6)]
    paper = dataclasses.replace(OPTIONS, separation=0.0, reach=0.0)
    for rung in rungs(pictures, paper):
        rgb = rung.polytope.slice_at(2.0).rgb
        losses = [palette_loss(frame.coarse, rgb, paper) for frame in stats(pictures)]
        assert rung.value == pytest.approx(np.mean(losses))


@pytest.mark.parametrize("convexity", [0.0, OPTIONS.convexity])
def test_every_palette_is_convex(convexity):
    pictures = [mixture(CORNERS, i) for i in range(3)]
    frames = stats(pictures)
    for rung in rungs(pictures, dataclasses.replace(OPTIONS, convexity=convexity)):
        assert deepest_concavity(rung.polytope, frames) < 1e-9


def test_no_rung_is_missing():
    """Without `convexity` colours fall into the solid, several at once."""
    found = rungs([noise(i) for i in range(3)])
    counts = [len(rung.polytope.blocks[0].tracks) for rung in found]
    assert counts == list(range(OPTIONS.palette_size, 3, -1))


def test_the_ladder_begins_with_no_more_than_palette_size_colours():
    few = dataclasses.replace(OPTIONS, palette_size=6)
    found = rungs([mixture(CORNERS, i) for i in range(3)], few)
    assert 4 < max(len(rung.polytope.blocks[0].tracks) for rung in found) <= 6
