"""A smaller copy of a clip, read in the clip's own size."""

from __future__ import annotations

import numpy as np
import pytest

from palette4d.media.array_clip import ArrayClip
from palette4d.media.proxy_clip import ProxyClip, is_proxy


def test_its_pixels_are_repeated() -> None:
    small = np.arange(2 * 2 * 3 * 3).reshape(2, 2, 3, 3) / 36
    proxy = ProxyClip(ArrayClip(small, first=7), 7, 4)
    assert (proxy.width, proxy.height, proxy.frames) == (7, 4, [7, 8])
    frame = proxy.read(8)
    assert frame.shape == (4, 7, 3)
    assert frame.flags.c_contiguous
    assert (frame[:2, :3] == np.float32(small[1, 0, 0])).all()
    assert (frame[2:, 5:] == np.float32(small[1, 1, 2])).all()


@pytest.mark.parametrize(
    ("size", "proxy"),
    [
        ((960, 540), True),
        ((640, 360), True),
        ((427, 240), True),
        ((1920, 1080), False),
        ((3840, 2160), False),
        ((960, 720), False),
        ((540, 960), False),
    ],
)
def test_a_proxy_is_smaller_and_has_the_shape(size: tuple[int, int], proxy: bool) -> None:
    width, height = size
    clip = ArrayClip(np.zeros((1, height, width, 3), np.float32))
    assert is_proxy(clip, 1920, 1080) == proxy
