"""The bounded reader of JSON files other than sidecars: manifests and indexes.

Its limits are those of the core's sidecar reader: a small file must not take all memory, nor hang.
"""

from __future__ import annotations

import json
import math
import os
import re
import stat
from pathlib import Path
from typing import Any, NoReturn

from palette4d.common.errors import Palette4dError

LARGEST_FILE = 64 << 20
MOST_VALUES = 4_000_000
DEEPEST = 64

_TEXT = re.compile(rb'"(?:[^"\\]++|\\.)*+"', re.DOTALL)
_NO_BRACKETS = bytes(sorted(set(range(256)) - set(b"[]{}")))


class UnusableFile(Palette4dError):
    """A file that is not what it should be; the message says what was found and expected."""


def read_regular(path: Path, largest: int = LARGEST_FILE) -> bytes:
    """Return the bytes of a regular file; pipes and devices could block or have no end.

    Raises
    ------
    UnusableFile
        It is not a regular file, or larger than `largest`.
    OSError
        It cannot be read.
    """
    # Opening a pipe would block until a program writes into it.
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise UnusableFile(f"{path}: found a folder, pipe or device, expected a file")
        with os.fdopen(handle, "rb", closefd=False) as stream:
            data = stream.read(largest + 1)
    finally:
        os.close(handle)
    if len(data) > largest:
        raise UnusableFile(f"{path}: found more than {largest} bytes, expected a smaller file")
    return data


def read_json(path: Path) -> Any:
    """Return the JSON value in a file; its numbers are finite.

    Raises
    ------
    UnusableFile
        The file is not regular, is no JSON in UTF-8, or exceeds the limits.
    OSError
        It cannot be read.
    """
    try:
        return parse(read_regular(path))
    except ValueError as error:  # also from the decoders of UTF-8 and JSON
        raise UnusableFile(
            f"{path}: it cannot be read as JSON ({error}); expected JSON text"
        ) from error


def parse(data: bytes) -> Any:
    """Return the JSON value of UTF-8 text; ValueError as `read_json` says."""
    bare = _TEXT.sub(b'""', data)
    if sum(map(bare.count, (b",", b"[", b"{"))) >= MOST_VALUES:
        raise ValueError(f"it has more than {MOST_VALUES} values")
    depth = 0
    for bracket in bare.translate(None, _NO_BRACKETS):
        depth += 1 if bracket in b"[{" else -1
        if depth > DEEPEST:
            raise ValueError(f"it is nested deeper than {DEEPEST}")
    value = json.loads(data.decode("utf-8"), parse_float=_finite, parse_constant=_refuse)
    if b"\\ud" in data.lower():  # halves of characters, which cannot be written again
        json.dumps(value, ensure_ascii=False).encode("utf-8")
    return value


def with_unique_names(members: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the members of an object, for `json`; ValueError if two have one name.

    Of such two, readers take the first or the last.
    """
    found = dict(members)
    if len(found) < len(members):
        names = [name for name, _ in members]
        raise ValueError(f"an object has two members {max(names, key=names.count)[:40]!r}")
    return found


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        _refuse(text)
    return value


def _refuse(text: str) -> NoReturn:
    raise ValueError(f"the number {text[:40]} is not finite")
