"""Which pixels of a frame are the thing that a user marked, as far as the picture says.

A matte over colours cannot part a thing from another one of its colour that touches it. Here a
region grows from the marks, over pixels whose surroundings are ever less like theirs. Where a large
part joins it at once, another thing may begin.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
B = NDArray[np.bool_]

#: Standard deviation, in pixels, of a pixel's surroundings. Larger: textures are told apart better,
#: narrow parts of a thing worse.
SURROUNDINGS = 2.0
#: Lightness beside saturation, as in learning (`kLightnessWeight`).
LIGHTNESS = 0.4
#: A region grows in this many steps, each by the same factor. More: smaller parts are noticed.
STEPS = 64
#: A part that joins at once is noticed if it is more than this share of the region.
JOINS = 0.3


def unlike(points: F64, marks: Sequence[B]) -> F64:
    """Return how far the surroundings of each pixel are from those of the nearest mark.

    Surroundings are the mean and the standard deviation of points of pick space, (h, w, 3).
    """
    from scipy import ndimage

    weighted = points * (1, 1, LIGHTNESS)
    mean, square = (
        ndimage.gaussian_filter(values, (SURROUNDINGS, SURROUNDINGS, 0))
        for values in (weighted, weighted**2)
    )
    near = np.concatenate([mean, np.sqrt(np.maximum(square - mean**2, 0))], axis=2)
    away = [np.linalg.norm(near - near[mark].mean(axis=0), axis=2) for mark in marks]
    return np.asarray(np.min(away, axis=0))


def connected(mask: B, marked: B, gap: int = 0) -> B:
    """Return what of a mask is connected with marked pixels, across gaps of 2 `gap` pixels."""
    from scipy import ndimage

    labels, _ = ndimage.label(ndimage.binary_dilation(mask, iterations=gap) if gap else mask)
    kept = np.unique(labels[marked])
    return np.asarray(np.isin(labels, kept[kept > 0]) & mask)


def joins(taken: B, marked: B, away: F64, near: float, least: int) -> Iterator[tuple[B, B]]:
    """Yield a region that grows from marked pixels, and a part of `least` pixels that joins it.

    It grows over `taken` pixels, in the order of `away`. What is nearer than `near` is its own.
    """
    from scipy import ndimage

    ranked = np.sort(away[taken])
    if not len(ranked):
        return
    ranks = np.geomspace(max(1, int((taken & marked).sum())), len(ranked), STEPS)
    region = np.zeros_like(taken)
    for limit in ranked[ranks.round().astype(int) - 1]:
        grown = connected(taken & (away <= limit) | marked, marked)
        labels, _ = ndimage.label(grown & ~region)
        sizes = np.bincount(labels.ravel())[1:]
        most = max(least, JOINS * region.sum())
        if limit > near and region.any() and sizes.max(initial=0) > most:
            yield region, np.asarray(labels == sizes.argmax() + 1)
        region = grown


def nearer(away: F64, one: B, other: B) -> B:
    """Return what is parted by smaller steps of `away` from the pixels `one` than from `other`."""
    from scipy import ndimage

    heights = (away * (65535 / max(float(away.max()), 1e-9))).astype(np.uint16)
    markers = np.where(one, 1, np.where(other, 2, 0)).astype(np.int16)
    return np.asarray(ndimage.watershed_ift(heights, markers) == 1)
