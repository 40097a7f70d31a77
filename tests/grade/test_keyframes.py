"""Few keys for many: which ones are kept."""

import numpy as np

from palette4d.grade.keyframes import needed

TIMES = [0.0, 1, 2, 3, 4, 8]
BENT = np.array([[0.0, 5], [1, 5], [2, 5.05], [3, 5], [4, 5], [0, 5]])


def test_bends_and_fixed_keys_are_kept() -> None:
    assert needed(TIMES, BENT, (), 0.1) == [0, 4, 5]
    assert needed(TIMES, BENT, [1], 0.1) == [0, 1, 4, 5]
    assert needed(TIMES, BENT, (), 0.01) == [0, 1, 2, 3, 4, 5]


def test_the_largest_bends_come_first_if_there_are_too_many() -> None:
    assert needed(TIMES, BENT, (), 0.01, 1) == [0, 4, 5]
    assert needed(TIMES, BENT, [1], 0.01, 1) == [0, 1, 4, 5]


def test_a_single_key_stays() -> None:
    assert needed([3.0], np.zeros((1, 2)), (), 0.1) == [0]
