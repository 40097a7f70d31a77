"""The counts of waveform, parade and vectorscope against plain NumPy, from their description."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from palette4d import _core

F32 = NDArray[np.float32]

LEVELS, BELOW, BINS = 288, 16, 257


def nearest(values: F32, scale: float, offset: int, count: int) -> NDArray[np.int64]:
    """Return the bin nearest to each value; halves go up, the rims take what is beyond."""
    at = values * np.float32(scale) + np.float32(offset + 0.5)
    return np.floor(np.clip(at, 0, count - 1)).astype(np.int64)


def reference(image: F32, columns: int, zoom: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the counts, one pixel after the other."""
    width = image.shape[1]
    columns = min(columns, width)
    waveform, vectors = np.zeros((columns, 4, LEVELS), int), np.zeros((BINS, BINS), int)
    starts = [column * width // columns for column in range(columns + 1)]
    with np.errstate(invalid="ignore"):
        for column in range(columns):
            pixels = image[:, starts[column] : starts[column + 1], :3].reshape(-1, 3)
            weights = np.array([0.2126, 0.7152, 0.0722], np.float32)
            r, g, b = pixels.T
            luma = weights[0] * r + weights[1] * g + weights[2] * b
            whole = ~np.isnan(luma)
            for trace, values in enumerate((luma, r, g, b)):
                np.add.at(waveform[column, trace], nearest(values[whole], 255, BELOW, LEVELS), 1)
            cb = (b - luma) * np.float32(np.float32(1) / np.float32(1.8556))
            cr = (luma - r) * np.float32(np.float32(1) / np.float32(1.5748))
            whole &= ~np.isnan(cb) & ~np.isnan(cr)
            scale = zoom * (BINS - 1)
            across = nearest(cb[whole], scale, BINS // 2, BINS)
            down = nearest(cr[whole], scale, BINS // 2, BINS)
            np.add.at(vectors, (down, across), 1)
    return waveform, vectors


@pytest.mark.parametrize("size", [(1, 1), (3, 5), (37, 480), (40, 481), (33, 1001)])
@pytest.mark.parametrize(("channels", "zoom", "threads"), [(3, 1.0, 1), (4, 2.0, 3)])
def test_counts_are_those_of_plain_numpy(
    size: tuple[int, int], channels: int, zoom: float, threads: int
) -> None:
    rng = np.random.default_rng(size[1])
    image = rng.normal(0.5, 0.5, (*size, channels)).astype(np.float32)
    if size[0] > 1:
        image[0, :4, 0] = (np.nan, np.inf, -np.inf, 1e30)
        image[1, 0, :3] = (np.inf, -np.inf, 0.2)
    waveform, vectors = _core.scope_counts(image, columns=480, zoom=zoom, threads=threads)
    wanted, wanted_vectors = reference(image, 480, zoom)
    np.testing.assert_array_equal(waveform, wanted)
    np.testing.assert_array_equal(vectors, wanted_vectors)


def test_rows_may_have_gaps() -> None:
    whole = np.random.default_rng(1).random((20, 30, 3), dtype=np.float32)
    part = whole[::2, 4:20]
    for found, wanted in zip(
        _core.scope_counts(part), _core.scope_counts(part.copy()), strict=True
    ):
        np.testing.assert_array_equal(found, wanted)


def test_colour_bars_stand_where_a_vectorscope_has_its_targets() -> None:
    bars = [(r, g, b) for r in (0, 0.75) for g in (0, 0.75) for b in (0, 0.75)]
    image = np.array([bars], np.float32)
    waveform, vectors = _core.scope_counts(image, columns=8)
    assert [int(np.argmax(waveform[k, 1])) - _core.SCOPE_BELOW for k in range(8)] == [
        0 if k < 4 else 191 for k in range(8)
    ]
    assert vectors[128, 128] == 2  # black and grey
    assert vectors[128 - 96, 128 - 22] == 1  # red: Cr 0.375, Cb -0.0859
    assert vectors[128 + 9, 128 + 96] == 1  # blue: Cr -0.0344, Cb 0.375


@pytest.mark.parametrize(
    ("image", "more"),
    [
        (np.zeros((2, 2, 2), np.float32), {}),
        (np.zeros((2, 2, 3), np.float64), {}),
        (np.zeros((2, 2, 3), np.float32), {"columns": 0}),
        (np.zeros((2, 2, 3), np.float32), {"zoom": 0.0}),
        (np.zeros((2, 2, 3), np.float32), {"threads": -1}),
    ],
)
def test_bad_input_is_refused(image: Any, more: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="expected"):
        _core.scope_counts(image, **more)
