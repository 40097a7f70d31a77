"""Per-frame palettes enclose the colours, have few vertices, and are flat for flat colours."""

from __future__ import annotations

import numpy as np
import pytest
from analysis_frames import constant, grey, mixture, noise, stats
from palette4d.analysis.frame_hulls import frame_palette, merge_close
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions

GAMUT = Gamut(np.zeros(3), np.ones(3))
OPTIONS = AnalysisOptions()


def is_closed_and_outward(palette):
    directed = {(int(f[e]), int(f[(e + 1) % 3])) for f in palette.faces for e in range(3)}
    closed = len(directed) == 3 * len(palette.faces) and all(
        (b, a) in directed for a, b in directed
    )
    corners = palette.rgb[palette.faces] - palette.rgb.mean(axis=0)
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    return closed, volume


@pytest.mark.parametrize("seed", range(4))
def test_a_solid_frame_gets_a_small_closed_palette(seed):
    corners = [[0.1, 0.1, 0.1], [0.9, 0.2, 0.1], [0.2, 0.8, 0.2], [0.2, 0.3, 0.9], [0.9, 0.9, 0.8]]
    (frame,) = stats([mixture(corners, seed)])
    palette = frame_palette(frame.coarse, GAMUT, OPTIONS)
    assert 4 <= len(palette.rgb) <= 8
    closed, volume = is_closed_and_outward(palette)
    assert closed
    assert volume > 0
    gaps = np.linalg.norm(np.array(corners)[:, None] - palette.rgb[None], axis=2).min(axis=1)
    assert gaps.max() < 0.15  # each true colour has a handle near it
    assert palette_loss(frame.colours, palette.rgb, OPTIONS) < 0.1


def test_one_colour_and_a_line_of_colours():
    one = frame_palette(stats([constant([0.2, 0.4, 0.6])])[0].coarse, GAMUT, OPTIONS)
    np.testing.assert_allclose(one.rgb, [[0.2, 0.4, 0.6]], atol=1e-6)
    assert len(one.faces) == 0
    line = frame_palette(stats([grey(5)])[0].coarse, GAMUT, OPTIONS)
    assert len(line.rgb) == 2
    assert len(line.faces) == 0
    assert np.ptp(line.rgb, axis=1).max() < 1e-6  # both ends are grey
    assert abs(line.rgb[0, 0] - line.rgb[1, 0]) > 0.9


def test_flat_colours_get_a_two_sided_polygon():
    image = noise(6)
    image[..., 2] = 0.5
    palette = frame_palette(stats([image])[0].coarse, GAMUT, OPTIONS)
    assert 3 <= len(palette.rgb) <= 8
    closed, volume = is_closed_and_outward(palette)
    assert closed
    assert abs(volume) < 1e-9
    assert len(palette.faces) == 2 * (len(palette.rgb) - 2)


def test_colours_above_one_keep_their_place():
    (frame,) = stats([noise(7, scale=8, offset=-1)])
    palette = frame_palette(frame.coarse, Gamut(np.full(3, -1.0), np.full(3, 7.0)), OPTIONS)
    assert len(palette.rgb) <= 8
    assert palette.rgb.max() > 6
    assert palette.rgb.min() < 0


def test_merging_stops_at_four_points():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.01, 0, 0]], float)
    assert len(merge_close(points, 0.1)) == 4
    assert len(merge_close(points, 10.0)) == 4
