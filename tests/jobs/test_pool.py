"""Pieces of work in processes: outcomes, failures, processes that are ended."""

from __future__ import annotations

import os
import signal

import pytest
from pieces import piece

from palette4d.jobs import pool
from palette4d.jobs.pool import Failed


def outcomes(values: list[int], jobs: int) -> dict[int, object]:
    found: dict[int, object] = {}
    pool.run(piece, dict(enumerate(values)), found.__setitem__, jobs)
    return found


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_outcome_is_told(jobs: int) -> None:
    found = outcomes([1, 3, 2], jobs)
    threads = max(1, (os.cpu_count() or 1) // jobs)
    assert found == {0: (1, threads), 1: Failed("three is refused"), 2: (4, threads)}


def test_nothing_to_do() -> None:
    assert outcomes([], 0) == {}


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_fault_of_the_program_is_not_hidden(jobs: int) -> None:
    with pytest.raises(ZeroDivisionError):
        outcomes([1, 4], jobs)


def test_a_process_that_is_ended_fails_only_its_piece() -> None:
    found = outcomes([1, 5, 2, 5, 2, 2], 2)
    assert set(found) == {0, 1, 2, 3, 4, 5}
    failed = {key for key, outcome in found.items() if isinstance(outcome, Failed)}
    assert failed == {1, 3}
    assert all("ended from outside" in str(found[key]) for key in failed)


def test_ctrl_c_waits_until_an_outcome_is_taken() -> None:
    taken = []

    def take(key: int, found: object) -> None:
        signal.raise_signal(signal.SIGINT)
        taken.append(key)

    with pytest.raises(KeyboardInterrupt):
        pool.run(piece, {0: 1, 1: 2}, take, 1)
    assert taken == [0]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
