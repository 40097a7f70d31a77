"""EXR files that hold more than the picture: overscan, further channels and parts, attributes.

`exr_copy` copies such a file around another picture.
"""

from __future__ import annotations

import mmap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

# Rows of the picture in a block of a file, by the number of the compression.
_ROWS = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256, 10: 256, 11: 32}


@dataclass(frozen=True)
class Around:
    """The place of a picture in an EXR file.

    Attributes
    ----------
    file : the file.
    part : number of the part that holds the picture.
    channels : names of its channels of red, green and blue, and perhaps of alpha.
    picture : x, y, width and height of the display window within the pixels that were read.
    """

    file: Path
    part: int
    channels: tuple[str, ...]
    picture: tuple[int, int, int, int]


def described(spec: Any, chosen: list[int], parts: int) -> str:
    """Return the other contents of an EXR in words: channels, parts, overscan; "" for none."""
    extras = []
    left, top = spec.full_x - spec.x, spec.full_y - spec.y
    right = spec.x + spec.width - spec.full_x - spec.full_width
    if max(left, top, right, spec.y + spec.height - spec.full_y - spec.full_height) > 0:
        extras.append("overscan")
    further = [name for i, name in enumerate(spec.channelnames) if i not in chosen]
    if further:
        shown = ", ".join(further[:4]) + (", …" if further[4:] else "")
        extras.append(f"{len(further)} further channel{'s' * (len(further) > 1)} ({shown})")
    if parts > 1:
        extras.append(f"{parts - 1} further part{'s' * (parts > 2)}")
    return ", ".join(extras)


def has_every_block(path: Path) -> bool:
    """Whether an EXR in rows was closed: its tables of places are filled in last.

    OpenEXR writes a full disk's file without an error then, and reads it; others do not.
    """
    with path.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as exr:
        try:
            return _has_every_block(exr)
        except (LookupError, ValueError):  # a table that is cut, a header of no EXR
            return False


def _has_every_block(exr: mmap.mmap) -> bool:
    several, offset = bool(exr[5] & 0x10), 8
    counts = []
    while exr[offset]:
        offset, attributes = _attributes(exr, offset)
        counts.append(_blocks(attributes))
        if not several:
            break
    offset += several  # an empty header ends the list
    table = np.frombuffer(exr[offset : offset + 8 * sum(counts)], "<u8")
    return len(table) == sum(counts) and bool(table.all())


def _attributes(exr: Any, offset: int) -> tuple[int, dict[bytes, bytes]]:
    """Return the place behind a header, and its attributes: name, type, size, value."""
    attributes = {}
    while exr[offset]:
        kind = exr.find(b"\0", offset) + 1
        size = exr.find(b"\0", kind) + 1
        if not kind or not size:
            raise ValueError("the header has no end")
        value = size + 4
        end = value + int.from_bytes(exr[size:value], "little")
        attributes[exr[offset : kind - 1]] = exr[value:end]
        offset = end
    return offset + 1, attributes


def _blocks(attributes: dict[bytes, bytes]) -> int:
    if b"chunkCount" in attributes:
        return int.from_bytes(attributes[b"chunkCount"], "little")
    _, top, _, bottom = np.frombuffer(attributes[b"dataWindow"], "<i4").tolist()
    return int(-(-(bottom - top + 1) // _ROWS[attributes[b"compression"][0]]))
