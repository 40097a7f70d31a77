"""Bumps and holds in NumPy, as the core computes them: for the solver and for errors of bakes."""

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]


def bump_values(colours: F64, centres: F64, radii: F64) -> F64:
    """Return (n, m) values, 0..1, of m bumps at n colours: 1 at the centre, 0 from the radius."""
    away = ((colours[:, None] - centres) ** 2).sum(axis=2) / radii**2
    values: F64 = np.maximum(0.0, 1.0 - away) ** 3
    return values


def bumped(colours: F64, moved: F64, bumps: F64) -> F64:
    """Return the (n, 3) displacements of colours that the palette moves by `moved`.

    `bumps` is (b, 8) as `_core.Edits.bumps_at` gives it, holds last.
    """
    values = bump_values(colours, bumps[:, :3], bumps[:, 3])
    holds = bumps[:, 7] > 0
    both = moved + values[:, ~holds] @ bumps[~holds, 4:7]
    kept: F64 = both * (1 - values[:, holds] * bumps[holds, 7]).prod(axis=1, keepdims=True)
    return kept
