"""A frame's colour histogram on a coarse grid, for comparing frames.

Input: weighted colours. Output: a histogram of `CELLS` cells per channel. Each pixel is distributed
to the eight cells around it. So a small shift of all colours (exposure, fading, grain) is a small
difference. The grid is even in the square root of a code value, which suits encoded and
scene-linear pictures; above 1 its cells are wider.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

#: The histogram needs at least this many colours of a frame: with 1024, noise looks nearly like a
#: cut. If more colours are kept, all are used, because drawing a sample costs more.
LEAST_COLOURS = 2048

CELLS = 12
# Cells from 0 to 1; the cells above reach to about 60.
CELLS_TO_ONE = 7
ABOVE_ONE = 0.15
# Square roots up to 1, where equal steps look alike in darks and lights; logarithms above.
_EASED = np.arange(CELLS) / CELLS_TO_ONE
_CODE_VALUES = np.where(_EASED <= 1, _EASED**2, np.exp((_EASED - 1) / ABOVE_ONE))


def histogram(rgb: F64, counts: F64) -> F64:
    """Return (CELLS^3,) shares of pixels of (n, 3) colours with (n,) counts; they sum to 1."""
    x = np.maximum(rgb, 0.0)
    eased = np.where(x <= 1, np.sqrt(x), 1 + ABOVE_ONE * np.log(np.maximum(x, 1.0)))
    place = np.clip(CELLS_TO_ONE * eased, 0, CELLS - 1)
    lower = np.minimum(place.astype(int), CELLS - 2)
    parts = np.stack([1 - (place - lower), place - lower])
    out: F64 = np.zeros(CELLS**3)
    for corner in itertools.product((0, 1), repeat=3):  # of the eight cells
        r, g, b = (parts[upper, :, channel] for channel, upper in enumerate(corner))
        cells = (lower + corner) @ (CELLS**2, CELLS, 1)
        out += np.bincount(cells, counts * r * g * b, minlength=len(out))
    shares: F64 = out / out.sum()
    return shares


def mean_shift(before: F64, after: F64) -> float:
    """Return how far the pixels' code values differ in the channel that differs most.

    It is the earth mover's distance of the channels' histograms, from the cells' code values.
    """
    excess = (before - after).reshape(CELLS, CELLS, CELLS)
    shifts = [
        np.abs(np.cumsum(excess.sum(axis=others))[:-1]) @ np.diff(_CODE_VALUES)
        for others in ((1, 2), (0, 2), (0, 1))
    ]
    return float(max(shifts))
