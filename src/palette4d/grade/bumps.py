"""Bumps and holds in NumPy, as the core computes them: for the solver and for errors of bakes."""

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

# Below this length of a colour, its shades are less and less certain: all are near black.
DARK = 0.6


def alongs(centres: F64, shades: F64 | float) -> F64:
    """Return (m, 3): the directions of colours' shades, along which distances count `shades`."""
    lengths = np.maximum(np.linalg.norm(centres, axis=1), DARK)
    found: F64 = (np.sqrt(1 - np.square(shades)) / lengths)[:, None] * centres
    return found


def squares(colours: F64, centres: F64, along: F64) -> F64:
    """Return (n, m) squared distances of n colours from m centres; shades are nearer."""
    # Products of matrices, not of (n, m, 3) arrays: picks are solved while the user waits.
    norms = (colours**2).sum(axis=1)[:, None] + (centres**2).sum(axis=1)
    plain = norms - 2 * colours @ centres.T
    found: F64 = np.maximum(plain - (colours @ along.T - (centres * along).sum(axis=1)) ** 2, 0.0)
    return found


def bump_values(colours: F64, centres: F64, radii: F64 | float, along: F64) -> F64:
    """Return (n, m) values, 0..1, of m bumps at n colours: 1 at the centre, 0 from the radius."""
    away = squares(colours, centres, along) / radii**2
    values: F64 = np.maximum(0.0, 1.0 - away) ** 3
    return values


def bumped(colours: F64, moved: F64, bumps: F64) -> F64:
    """Return the (n, 3) displacements of colours that the palette moves by `moved`.

    `bumps` is (b, 11) as `_core.Edits.bumps_at` gives it, holds last.
    """
    values = bump_values(colours, bumps[:, :3], bumps[:, 3], bumps[:, 8:])
    holds = bumps[:, 7] > 0
    both = moved + values[:, ~holds] @ bumps[~holds, 4:7]
    held = 1 - (1 - values[:, holds]) ** 3
    kept: F64 = both * (1 - held * bumps[holds, 7]).prod(axis=1, keepdims=True)
    return kept
