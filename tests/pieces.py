"""Small pieces of work, in a module that the processes of a pool can import."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from palette4d.common.errors import Palette4dError


class NoAnswer:
    """What is sent and cannot be received."""

    def __reduce__(self) -> tuple[object, ...]:
        return int, ("no number",)


#: Windows ends a process that gets any signal.
KILL = getattr(signal, "SIGKILL", signal.SIGTERM)


def lie(value: int, threads: int) -> object:
    """Square a number, but answer 2 with what cannot be received, and 3 with nothing."""
    return NoAnswer() if value == 2 else None if value == 3 else value * value


def piece(value: int, threads: int) -> tuple[int, int]:
    """Square a number; refuse 3, fall over 4, let 5 end the process, and never reach 7."""
    if value == 3:
        raise Palette4dError("three is refused")
    if value == 4:
        raise ZeroDivisionError
    if value == 5:
        os.kill(os.getpid(), KILL)
    if value == 7:
        return piece(7, threads)
    return value * value, threads


def once(marker: str, threads: int) -> str:
    """End the process, but only the first time."""
    try:
        Path(marker).touch(exist_ok=False)
    except FileExistsError:
        return "done"
    os.kill(os.getpid(), KILL)
    raise AssertionError


def noted(folder: str, threads: int) -> None:
    """Leave a file with this process's number in a folder, and take a while."""
    Path(folder, f"{os.getpid()}.pid").touch()
    time.sleep(0.2)
