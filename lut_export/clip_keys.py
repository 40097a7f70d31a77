"""Keys: a few of a clip's frames, between which all that changes goes along cubics."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]


def keys_of(count: int, fits: Callable[[int, int], bool]) -> list[int]:
    """Return the fewest of `count` frames so that fits(key, next key) holds, or they are adjoining.

    What fits must fit in a part of it, too: the step from a key is doubled as long as it fits, then
    halved.
    """
    keys, last = [0], count - 1
    while keys[-1] < last:
        start = keys[-1]
        end, step, growing = start + 1, 1, True
        while step > 0:
            trial = min(end + step, last)
            good = trial > end and fits(start, trial)
            end = trial if good else end
            growing = growing and good
            step = step * 2 if growing else step // 2
        keys.append(end)
    return keys


def bends(times: F64, values: F64) -> tuple[F64, F64]:
    """Return how columns go from their first value to the last, and each one's largest error.

    A column is v + w (v' - v + (1 - w) (a + b w)), where w is the part of the time: a cubic. The
    bends are a and b of each column, (2, n), of `values`, (times, n).
    """
    part = (times - times[0]) / (times[-1] - times[0])
    rest = values - values[0] - part[:, None] * (values[-1] - values[0])
    shape = (part * (1 - part))[:, None] * np.stack([np.ones_like(part), part], axis=1)
    found = np.zeros((2, values.shape[1]))
    if len(times) > 2:
        found = np.linalg.lstsq(shape, rest, rcond=None)[0]
        # What is straight but for rounding stays so.
        found[:, np.abs(found).max(axis=0) < 1e-9] = 0
    return found, np.abs(rest - shape @ found).max(axis=0)
