"""The outermost boxes of .mov and .mp4 files (ISO/IEC 14496-12), which PyAV does not show."""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

#: The most boxes that are read: a file has a few, but for fragments.
_MOST = 64


def boxes(file: BinaryIO) -> Iterator[tuple[bytes, int]]:
    """Yield the kind of each box and the size of its content; the file is at the content."""
    offset = 0
    for _ in range(_MOST):
        file.seek(offset)
        head = file.read(8)
        if len(head) < 8:
            return
        size, kind, read = int.from_bytes(head[:4], "big"), head[4:], 8
        if size == 1:  # a size of 64 bits follows
            size, read = int.from_bytes(file.read(8), "big"), 16
        yield kind, max(size - read, 0)
        if size < read:  # up to the file's end
            return
        offset += size
