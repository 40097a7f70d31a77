"""Frames in memory as a clip: their numbers, what a binner sees, and which arrays are refused."""

from __future__ import annotations

import numpy as np
import pytest

from palette4d import _core
from palette4d.media.array_clip import ArrayClip
from palette4d.media.clip import ClipError

FRAMES = np.random.default_rng(1).random((3, 4, 6, 3))


def test_frames_are_numbered_and_keep_their_values():
    clip = ArrayClip(FRAMES, first=1001, step=2)
    assert (clip.frames, clip.width, clip.height) == ([1001, 1003, 1005], 6, 4)
    for image, expected in zip(clip.iter_images(), FRAMES, strict=True):
        np.testing.assert_array_equal(image.pixels, expected.astype(np.float32))


def test_every_pixel_is_binned():
    clip = ArrayClip(FRAMES)
    for number, fill in clip.fills(clip.frames):
        binner = _core.ColourBinner()
        assert not fill(binner)
        colours = binner.take(100, 100)[0]
        assert colours.total == 24
        found = colours.rgb[np.lexsort(colours.rgb.T)]
        expected = FRAMES[number].astype(np.float32).reshape(-1, 3).astype(float)
        np.testing.assert_allclose(found, expected[np.lexsort(expected.T)], atol=1e-6)


@pytest.mark.parametrize(
    ("array", "found"),
    [
        (FRAMES[0], r"\(4, 6, 3\)"),
        (FRAMES[..., :2], r"\(3, 4, 6, 2\)"),
        (FRAMES[:0], r"\(0, 4, 6, 3\)"),
        ((255 * FRAMES).astype(np.uint8), "uint8"),
    ],
)
def test_other_arrays_are_refused(array, found):
    with pytest.raises(ClipError, match=found):
        ArrayClip(array)
