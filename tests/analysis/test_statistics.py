"""Colour bins: exact for 8 bit, bounded for everything, blind to what is no colour."""

from __future__ import annotations

import numpy as np
import pytest
from analysis_frames import noise
from palette4d import _core
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.statistics import gamut_box, gather


def test_8_bit_colours_stay_exact():
    levels = np.random.default_rng(1).integers(0, 256, (40, 50, 3))
    image = (levels / 255).astype(np.float32)
    rgb, counts, step, ignored = _core.bin_colours(image, 1 / 255, 10**6)
    expected, times = np.unique(levels.reshape(-1, 3), axis=0, return_counts=True)
    order = np.lexsort(np.round(rgb * 255).T[::-1])
    np.testing.assert_allclose(rgb[order], expected / 255, atol=1e-7)
    np.testing.assert_array_equal(counts[order], times)
    assert step == 1 / 255
    assert ignored == 0


def test_bins_are_bounded_and_keep_sums():
    image = noise(2, size=(200, 200))
    rgb, counts, step, _ = _core.bin_colours(image, 1 / 255, 1000)
    assert len(rgb) <= 1000
    assert step > 1 / 255
    assert counts.sum() == 40000
    np.testing.assert_allclose(counts @ rgb, image.reshape(-1, 3).astype(float).sum(axis=0))


def test_what_is_no_colour_does_not_count():
    image = np.concatenate([noise(3), np.ones((20, 30, 1), np.float32)], axis=2)
    image[0, :, 3] = 0  # transparent
    image[1, :, 0] = np.nan
    image[2, :, 1] = np.inf
    found = gather(7, image, AnalysisOptions())
    assert found.frame == 7
    assert (found.pixels, found.ignored) == (17 * 30, 90)
    assert gather(7, np.full((4, 4, 3), np.nan, np.float32), AnalysisOptions()) is None


@pytest.mark.parametrize("view", [np.s_[::-1], np.s_[:, ::2], np.s_[::3, 5:]])
def test_any_strides(view):
    image = noise(4)[view]
    rgb, counts, *_ = _core.bin_colours(image, 1 / 255, 10**6)
    packed = _core.bin_colours(np.ascontiguousarray(image), 1 / 255, 10**6)
    np.testing.assert_array_equal(rgb, packed[0])
    np.testing.assert_array_equal(counts, packed[1])


def test_bad_images_are_refused():
    with pytest.raises(ValueError, match="dimensions"):
        _core.bin_colours(np.zeros((4, 4), np.float32), 0.1, 10)
    with pytest.raises(ValueError, match="channels"):
        _core.bin_colours(np.zeros((4, 4, 2), np.float32), 0.1, 10)
    with pytest.raises(ValueError, match="positive width"):
        _core.bin_colours(np.zeros((4, 4, 3), np.float32), 0.0, 10)


def test_gamut_grows_only_for_colours_outside():
    inside = gather(0, noise(5), AnalysisOptions())
    outside = gather(1, noise(6, 3, -1), AnalysisOptions())
    low, high = gamut_box([inside])
    assert (low.tolist(), high.tolist()) == ([0, 0, 0], [1, 1, 1])
    low, high = gamut_box([inside, outside])
    assert low.max() < -0.9
    assert high.min() > 1.9
