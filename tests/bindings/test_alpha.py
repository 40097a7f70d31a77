"""One rule for alpha: the core's reader of pixels, NumPy, the recolouring and the bins agree."""

from __future__ import annotations

import numpy as np
import pytest
from parity.cases import cube, same_bits
from parity.reference import straight

from palette4d import _core
from palette4d.media.array_clip import ArrayClip
from palette4d.media.frame_writer import with_alpha_of

GOOD = (1.0, 0.3, 2.0, -0.5, 1e-3, 1e-30, 1e-45)
NONE = (0.0, -0.0, np.inf, -np.inf, np.nan)


def pixels(alphas=GOOD + NONE) -> np.ndarray:
    """(2, n, 4) float32: a colour and black at each alpha, multiplied where that is possible."""
    image = np.empty((2, len(alphas), 4), np.float32)
    image[..., 3] = alphas
    image[0, :, :3] = (0.2, 0.4, 0.6)
    image[1, :, :3] = 0
    divided = np.isfinite(image[0, :, 3])
    image[0, divided, :3] *= np.maximum(np.abs(image[0, divided, 3:]), 0.1)
    return image


def test_straight_colours_are_those_of_numpy():
    image = pixels()
    found = _core.straight_colours(image, premultiplied=True)
    with np.errstate(over="ignore"):
        expected = np.array(
            [[straight(p[:3].astype(float), float(p[3])) for p in row] for row in image], np.float32
        )
    assert found.dtype == np.float32
    np.testing.assert_array_equal(found, expected)
    assert np.isnan(found[:, len(GOOD) :]).all()
    assert not np.isnan(found[:, : len(GOOD)]).any()


@pytest.mark.parametrize("view", [np.s_[:], np.s_[::-1], np.s_[:, 2:5]])
def test_colours_that_are_not_premultiplied_are_copied(view):
    image = pixels()[view]
    copied = _core.straight_colours(image, premultiplied=False)
    assert same_bits(copied, image[..., :3]).all()
    rgb = np.ascontiguousarray(image[..., :3])
    assert same_bits(_core.straight_colours(rgb, premultiplied=True), rgb).all()
    divided = _core.straight_colours(image, premultiplied=True)
    np.testing.assert_array_equal(
        divided, _core.straight_colours(np.ascontiguousarray(image), premultiplied=True)
    )


def test_what_is_no_image_is_refused():
    for wrong in (np.zeros((2, 2, 2), np.float32), np.zeros((2, 2, 4)), np.zeros(4, np.float32)):
        with pytest.raises(ValueError, match="image"):
            _core.straight_colours(wrong, premultiplied=True)


@pytest.mark.parametrize("precision", ["double", "single"])
def test_pixels_pass_where_there_is_no_straight_colour(precision):
    rgb, faces = cube()
    recolourer = _core.Recolourer(rgb, 0.5 * rgb + 0.2, faces)
    image = pixels()
    result = recolourer.apply(image, premultiplied=True, precision=precision)
    own = _core.straight_colours(image, premultiplied=True)
    passed = same_bits(result, image).all(axis=2)
    assert passed[np.isnan(own).any(axis=2)].all()
    visible = np.isfinite(own).all(axis=2) & (np.abs(image[..., 3]) > 1e-2)
    assert visible.sum() == 8
    assert not passed[visible].any()


def test_the_bins_leave_out_what_is_faint_or_has_no_colour():
    image = pixels((*GOOD, 1 / 255, 0.99 / 255, *NONE))[:1]
    binner = _core.ColourBinner()
    binner.add(image, premultiplied=True)
    seen = image[..., 3] >= np.float32(_core.LEAST_ALPHA)
    assert binner.transparent == (~seen).sum()
    own = _core.straight_colours(image, premultiplied=True)
    kept = seen & np.isfinite(own).all(axis=2)
    assert (binner.pixels, kept.sum()) == (4, 4)
    clip = ArrayClip(image[np.newaxis, ..., :3])
    clip.has_alpha = clip.premultiplied = True
    np.testing.assert_array_equal(np.isfinite(clip.straight_colours(image)).all(axis=2), kept)


def test_a_straight_file_keeps_what_has_no_straight_colour():
    image = pixels()
    written, premultiplied = with_alpha_of("png", image, premultiplied=True)
    assert not premultiplied
    own = _core.straight_colours(image, premultiplied=True)
    none = np.isnan(own)
    np.testing.assert_array_equal(written[..., :3][none], image[..., :3][none])
    np.testing.assert_array_equal(written[..., :3][~none], own[~none])
    assert same_bits(written[..., 3], image[..., 3]).all()
