"""Simplifies keys: keeps those that linear interpolation needs within a tolerance."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

#: Most keys that are kept for the tolerance: a path or an edge with more is simplified further.
MOST_KEYS = 64


def needed(
    times: Sequence[float],
    values: NDArray[np.float64],
    fixed: Iterable[int],
    tolerance: float,
    most: int = MOST_KEYS,
) -> list[int]:
    """Return the indices of the keys that are needed (Douglas and Peucker).

    `times` (n,) increase; `values` are (n, m). Both ends and the `fixed` keys are kept, and at most
    `most` others. Values of the other keys differ from linear interpolation by up to `tolerance`.
    """
    kept = sorted({0, len(times) - 1, *fixed})
    limit = most + len(kept)
    while len(kept) < limit:
        chosen = [times[i] for i in kept]
        lines = [np.interp(times, chosen, column[kept]) for column in values.T]
        off = np.abs(np.stack(lines, axis=1) - values).max(axis=1)
        if off.max() <= tolerance:
            break
        kept = sorted({*kept, int(off.argmax())})
    return kept
