"""Chang et al. (2015), "Palette-based Photo Recoloring": a comparison method of section 6.2.

`extract` finds the palette: k-means in CIELAB on the means of 16 x 16 x 16 bins of RGB, from a
deterministic start. A further cluster, locked at black, takes the very dark colours and is dropped.
`Transfer` recolours. Lightness follows the palette piecewise linearly. In a* and b*, a colour moves
by the mean of the palette colours' moves, weighted by Gaussian radial basis functions. A move ends
at the gamut's boundary.

As in section 6.2 of Du et al., all frames together give one palette. Its edit is constant, or
linear between two key frames, the first and the last frame. Colours are sRGB code values from 0 to
1; the paper does not say how it treats others, so they are clipped.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.distance import cdist, pdist
from skimage.color import rgb2lab
from skimage.color.colorconv import xyz_from_rgb

F64 = NDArray[np.float64]

# From the article: the default number of palette colours, bins per channel of RGB, the CIELAB
# distance within which a start attenuates others, nodes per channel of the cached transfer.
COLOURS, BINS, ATTENUATION, NODES = 5, 16, 80.0, 12
# Cap on the iterations of k-means.
ITERATIONS = 200
# The gamut's boundary is searched within its CIELAB diameter, by halving to 1/1000 of a unit.
DIAMETER, HALVINGS = 300.0, 18
# Tolerance of linear RGB for colours on the gamut's boundary.
ROUNDING = 1e-4
# XYZ of the D65 white (as in scikit-image), and linear RGB from XYZ.
WHITE, TO_LINEAR = np.array([0.95047, 1.0, 1.08883]), np.linalg.inv(xyz_from_rgb)


def binned(images: Iterable[tuple[F64, F64]]) -> tuple[F64, F64]:
    """Return the mean CIELAB colours (n, 3) of the bins that have pixels, and their (n,) pixels.

    Each image is given by its (m, 3) colours and the (m,) pixels of each.
    """
    sums, pixels = np.zeros((BINS**3, 3)), np.zeros(BINS**3)
    for rgb, counts in images:
        clipped = np.clip(rgb, 0, 1)
        cells = np.minimum((clipped * BINS).astype(np.int64), BINS - 1)
        keys = cells @ np.array([BINS**2, BINS, 1])
        pixels += np.bincount(keys, counts, BINS**3)
        for channel, values in enumerate(_lab(clipped).T):
            sums[:, channel] += np.bincount(keys, counts * values, BINS**3)
    filled = pixels > 0
    return sums[filled] / pixels[filled, None], pixels[filled]


def extract(lab: F64, pixels: F64, colours: int = COLOURS) -> F64:
    """Return the palette, (`colours`, 3) CIELAB colours from dark to light.

    Clips of fewer colours give a smaller palette.
    """
    weights, starts = pixels.astype(float), [np.zeros(3)]
    for _ in range(min(colours, len(lab))):
        weights = weights * (1 - np.exp(-(((lab - starts[-1]) / ATTENUATION) ** 2).sum(axis=1)))
        starts.append(lab[np.argmax(weights)])
    means = np.array(starts)
    nearest = np.zeros(0, np.int64)
    for _ in range(ITERATIONS):
        before, nearest = nearest, cdist(lab, means).argmin(axis=1)
        if np.array_equal(before, nearest):
            break
        for cluster in np.unique(nearest[nearest > 0]):  # black is locked
            members = nearest == cluster
            means[cluster] = np.average(lab[members], axis=0, weights=pixels[members])
    palette = np.unique(means[1:], axis=0)
    return palette[np.argsort(palette[:, 0], kind="stable")]


def edited(palette: F64, changes: Sequence[tuple[int, F64]]) -> F64:
    """Return the palette after changes (index, new CIELAB colour), made one after the other.

    Lightness stays monotone: a change moves the lightness of the others as far as the order of the
    palette requires.
    """
    result = palette.copy()
    for index, colour in changes:
        result[index] = colour
        result[:index, 0] = np.minimum(result[:index, 0], colour[0])
        result[index + 1 :, 0] = np.maximum(result[index + 1 :, 0], colour[0])
    return result


@dataclasses.dataclass(frozen=True)
class Transfer:
    """The recolouring by which each colour of a palette becomes that of an edited one.

    `palette` and `target` are (n, 3) CIELAB colours; both have increasing lightness.
    """

    palette: F64
    target: F64

    @classmethod
    def at(cls, palette: F64, first: F64, last: F64, share: float) -> Transfer:
        """Return the transfer at a share of the way between two key frames."""
        return cls(palette, first + share * (last - first))

    def weights(self, lab: F64) -> F64:
        """Return the (m, n) weights of the palette colours; they add up to 1.

        A palette colour has the weight 1 for itself. Negative weights are set to zero.
        """
        if len(self.palette) == 1:
            return np.ones((len(lab), 1))
        width = pdist(self.palette).mean()

        def radial(points: F64) -> F64:
            basis: F64 = np.exp(-((cdist(points, self.palette) / width) ** 2) / 2)
            return basis

        weights = np.maximum(radial(lab) @ np.linalg.inv(radial(self.palette)), 0)
        normalised: F64 = weights / weights.sum(axis=1, keepdims=True)
        return normalised

    def __call__(self, rgb: F64) -> F64:
        """Return (m, 3) recoloured code values."""
        lab = _lab(np.clip(rgb, 0, 1))
        before, after = ([0, *colours[:, 0], 100] for colours in (self.palette, self.target))
        moved = np.column_stack([np.interp(lab[:, 0], before, after), lab[:, 1:]])
        shifts = np.stack([self._shift(moved, i) for i in range(len(self.palette))], axis=1)
        moved[:, 1:] += (self.weights(lab)[:, :, None] * shifts).sum(axis=1)
        return np.clip(_srgb(moved), 0, 1)

    def _shift(self, lab: F64, index: int) -> F64:
        """Return the (m, 2) moves in a* and b* of colours `lab` if one palette colour moves alone.

        A colour moves as far as the palette colour, or less where the gamut's boundary is nearer
        than for the palette colour: so both reach it together. `lab` have their new lightness.
        """
        target = self.target[index]
        start = np.array([target[0], *self.palette[index, 1:]])
        step = target - start
        length = np.linalg.norm(step)
        if length == 0:
            return np.zeros((len(lab), 2))
        room = length * _room(start[None], step[None])[0]
        inside = _inside(lab + step)
        # A colour that would leave the gamut moves to where its way from the target leaves it.
        origin = np.where(inside[:, None], lab, target)
        towards = np.where(inside[:, None], step, lab - start)
        boundary = origin + _room(origin, towards)[:, None] * towards
        way = boundary[:, 1:] - lab[:, 1:]
        own_room = np.linalg.norm(way, axis=1)
        share = np.minimum(1, own_room / room) if room > 0 else np.ones(len(lab))
        with np.errstate(invalid="ignore", divide="ignore"):
            direction = np.where(own_room[:, None] > 0, way / own_room[:, None], 0)
        return length * share[:, None] * direction

    def cached(self) -> RegularGridInterpolator:
        """Return the transfer on a grid of RGB, trilinear between its nodes."""
        axis = np.linspace(0, 1, NODES)
        nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
        values = self(nodes.reshape(-1, 3)).reshape(nodes.shape)
        return RegularGridInterpolator((axis,) * 3, values)


def srgb(lab: F64) -> F64:
    """Return the (n, 3) code values of CIELAB colours, clipped to 0 to 1."""
    return np.clip(_srgb(lab), 0, 1)


def _lab(rgb: F64) -> F64:
    return np.asarray(rgb2lab(rgb), np.float64)


def _linear(lab: F64) -> F64:
    """Return linear RGB, outside 0 to 1 for colours outside the gamut (skimage clips those)."""
    y = (lab[:, 0] + 16) / 116
    f = np.stack([y + lab[:, 1] / 500, y, y - lab[:, 2] / 200], axis=1)
    xyz = WHITE * np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    linear: F64 = xyz @ TO_LINEAR.T
    return linear


def _srgb(lab: F64) -> F64:
    linear = _linear(lab)
    bright = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear > 0.0031308, bright, 12.92 * linear)


def _inside(lab: F64) -> NDArray[np.bool_]:
    """Return whether colours are in the gamut."""
    linear = _linear(lab)
    inside: NDArray[np.bool_] = ((linear > -ROUNDING) & (linear < 1 + ROUNDING)).all(axis=1)
    return inside


def _room(lab: F64, steps: F64) -> F64:
    """Return the (m,) multiples of steps from colours to the gamut's boundary; 0 outside."""
    low, high = np.zeros(len(lab)), DIAMETER / np.maximum(np.linalg.norm(steps, axis=1), 1e-9)
    high[~_inside(lab)] = 0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        inside = _inside(lab + middle[:, None] * steps)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return low
