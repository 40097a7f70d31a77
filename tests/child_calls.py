"""Calls for a child process, in a module that it can import."""

import contextlib
import os
import pickle
import time
from multiprocessing import resource_tracker
from pathlib import Path

from palette4d.common import answers
from palette4d.common.errors import SidecarError


def well(a: int, b: int) -> tuple[int, int, int]:
    return a, b, os.getpid()


def crash() -> None:
    os.abort()


def hang() -> None:
    time.sleep(60)


def grow() -> int:
    return len(bytearray(4 << 30))


def refuse() -> None:
    raise SidecarError("a.p4d.json", "/clip", "null", "an object")


def fault() -> None:
    raise ZeroDivisionError("by zero")


class _Evil:
    def __init__(self, path: str) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, tuple[object, ...]]:
        return os.mkdir, (self.path,)


def take_over(path: str) -> None:
    """Answer from now on with pickles that make a folder where they are read."""
    answers.written = lambda value: pickle.dumps((_Evil(path), None))


def speak_to_the_tracker() -> bool:
    """Ask the process that removes shared memory, which is not confined, for something."""
    try:
        os.write(resource_tracker._resource_tracker._fd, b"PROBE:0:noop\n")
    except OSError:
        return False
    return True


def handles() -> list[str]:
    """Return what the open files of this process are, without the standard ones."""
    found = []
    for handle in list(Path("/proc/self/fd").iterdir()):
        with contextlib.suppress(OSError):  # that of the list itself
            found += [str(handle.readlink())] if int(handle.name) > 2 else []
    return [one for one in found if one != os.devnull]
