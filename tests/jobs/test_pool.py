"""Pieces of work in processes: outcomes, failures, processes that are ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from farm_processes import running, wait_for
from pieces import once, piece

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


def test_a_process_that_is_ended_once_is_tried_again(tmp_path: Path) -> None:
    found: dict[int, object] = {}
    tasks = {number: str(tmp_path / str(number)) for number in range(3)}
    pool.run(once, tasks, found.__setitem__, 2)
    assert found == dict.fromkeys(tasks, "done")


def test_processes_that_end_while_others_start() -> None:
    found = outcomes([5, 1, 5, 5, 2, 5, 5, 6], 2)
    threads = max(1, (os.cpu_count() or 1) // 2)
    whole = {key: it for key, it in found.items() if not isinstance(it, Failed)}
    assert whole == {1: (1, threads), 4: (4, threads), 7: (36, threads)}
    assert len(found) == 8


@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends a program no such signal")
def test_a_parent_that_is_killed_leaves_no_process(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "from pieces import noted\n"
        "from palette4d.jobs import pool\n"
        "if __name__ == '__main__':\n"
        f"    pool.run(noted, {{i: {str(tmp_path)!r} for i in range(100)}}, print, 2)\n"
    )
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    parent = subprocess.Popen(
        [sys.executable, str(program)],
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.DEVNULL,
    )
    wait_for(lambda: len(list(tmp_path.glob("*.pid"))) == 2, "both processes")
    parent.kill()
    parent.wait(timeout=60)
    for file in tmp_path.glob("*.pid"):
        wait_for(lambda file=file: not running(int(file.stem)), "a process to end")


def test_ctrl_c_waits_until_an_outcome_is_taken() -> None:
    taken = []

    def take(key: int, found: object) -> None:
        signal.raise_signal(signal.SIGINT)
        taken.append(key)

    with pytest.raises(KeyboardInterrupt):
        pool.run(piece, {0: 1, 1: 2}, take, 1)
    assert taken == [0]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
