"""Few keys for many: the keys without which linear interpolation would differ."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray


def needed(
    times: Sequence[float],
    values: NDArray[np.float64],
    fixed: Iterable[int],
    tolerance: float,
    most: int | None = None,
) -> list[int]:
    """Return the indices of the keys that are needed (Douglas and Peucker).

    Parameters
    ----------
    times : (n,)
        Increasing.
    values : (n, m)
        The keys' values.
    fixed : iterable of int
        Keys that are kept in any case, beside both ends.
    tolerance : float
        The largest difference of a value from linear interpolation of the kept keys.
    most : int, optional
        At most so many keys beside the fixed ones; the largest differences count first.
    """
    kept = sorted({0, len(times) - 1, *fixed})
    limit = len(times) if most is None else most + len(kept)
    while len(kept) < limit:
        chosen = [times[i] for i in kept]
        lines = [np.interp(times, chosen, column[kept]) for column in values.T]
        off = np.abs(np.stack(lines, axis=1) - values).max(axis=1)
        if off.max() <= tolerance:
            break
        kept = sorted({*kept, int(off.argmax())})
    return kept
