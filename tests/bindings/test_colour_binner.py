"""The binner's binding: kinds of arrays, any strides, the GIL, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from interpreter import assert_interpreter_runs_on

from palette4d import _core

MANY = 10**9


def noise(kind, shape=(20, 30, 3), seed: int = 1):
    generator = np.random.default_rng(seed)
    if kind == np.float32:
        return generator.random(shape, np.float32)
    return generator.integers(0, np.iinfo(kind).max, shape, kind, endpoint=True)


def taken(image, **how):
    binner = _core.ColourBinner()
    binner.add(image, **how)
    return binner.take(MANY, MANY)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize(
    "view", [np.s_[::-1], np.s_[:, ::2], np.s_[::3, 5:], np.s_[:, ::-1], np.s_[..., 1:]]
)
def test_any_strides(kind, view):
    image = noise(kind, (20, 30, 4))[view]
    fine, *_ = taken(image)
    packed, *_ = taken(np.ascontiguousarray(image))
    np.testing.assert_array_equal(fine.rgb, packed.rgb)
    np.testing.assert_array_equal(fine.counts, packed.counts)


def test_rows_of_no_stride():
    row = np.array([[[1, 2, 3], [4, 5, 6]]], np.uint8)
    fine, *_ = taken(np.broadcast_to(row, (50, 2, 3)))
    assert fine.counts.tolist() == [50, 50]


def test_fine_coarse_and_the_box():
    binner = _core.ColourBinner()
    image = noise(np.uint8, (200, 200, 3))
    binner.add(image)
    assert (binner.pixels, binner.ignored, binner.transparent) == (40000, 0, 0)
    fine, coarse, low, high = binner.take(5000, 600)
    assert 4000 < len(fine) <= 5000
    assert 480 < len(coarse) <= 600
    assert fine.total == coarse.total == 40000
    np.testing.assert_array_equal(low, fine.rgb.min(axis=0))
    np.testing.assert_array_equal(high, fine.rgb.max(axis=0))
    every = {tuple(p) for p in image.reshape(-1, 3)}
    for tree in (fine, coarse):
        assert {tuple(np.rint(p * 255).astype(int)) for p in tree.rgb} <= every
    assert binner.take(10, 10) is None
    binner.add(image[:2, :5])
    fine, coarse, *_ = binner.take(100, 100, 3.5)
    assert fine is coarse
    assert fine.total == 35


def test_planes_of_luma_and_chroma():
    binner = _core.ColourBinner()
    how = {"red_weight": 0.299, "blue_weight": 0.114, "full_range": True}
    grey = np.array([[0, 51], [102, 255]], np.uint8)
    none = np.full((2, 2), 128, np.uint8)
    binner.add_luma_chroma(grey, none, none, bits=8, **how)
    rgb = binner.take(9, 9)[0].rgb
    np.testing.assert_allclose(
        np.sort(rgb, axis=0), np.repeat([[0], [0.2], [0.4], [1]], 3, 1), atol=1e-6
    )
    wide = [plane.astype("<u2") << 2 for plane in (grey, none, none)]
    binner.add_luma_chroma(*wide, bits=10, **how)
    assert len(binner.take(9, 9)[0]) == 4
    with pytest.raises(ValueError, match="uint8 or of uint16"):
        binner.add_luma_chroma(grey, none, wide[2], bits=8, **how)
    with pytest.raises(ValueError, match=r"found shape \(1, 2, 2\), expected \(h, w\)"):
        binner.add_luma_chroma(grey[None], none, none, bits=8, **how)
    with pytest.raises(ValueError, match="one size"):
        binner.add_luma_chroma(grey, none[:1], none, bits=8, **how)


@pytest.mark.parametrize(
    ("image", "match"),
    [
        (np.zeros((4, 4), np.float32), r"found shape \(4, 4\), expected three dimensions"),
        (np.zeros((4, 4, 2), np.float32), "2 channels"),
        (np.zeros((4, 4, 3), np.float64), "found dtype float64, expected uint8, uint16 or float32"),
    ],
)
def test_bad_images_are_refused(image, match):
    with pytest.raises(ValueError, match=match):
        _core.ColourBinner().add(image)


def test_bad_arguments_are_refused():
    binner = _core.ColourBinner()
    binner.add(noise(np.uint8))
    with pytest.raises(ValueError, match="one kind"):
        binner.add(noise(np.float32))
    with pytest.raises(ValueError, match="room"):
        binner.take(0, 10)
    with pytest.raises(ValueError, match="positive scale"):
        binner.take(10, 10, 0.0)
    binner.clear()
    with pytest.raises(ValueError, match="found 17 bits"):
        binner.add(noise(np.uint16), bits=17)


def test_the_interpreter_runs_on_while_a_frame_is_binned():
    image = noise(np.uint8, (2500, 2500, 3))
    binner = _core.ColourBinner()
    assert_interpreter_runs_on(lambda: (binner.add(image), binner.take(30000, 5000)))
