"""Calls for a child process, in a module that it can import."""

import os
import time

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
