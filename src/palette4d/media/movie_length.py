"""How many frames a movie file promises, whatever is left of it."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any, BinaryIO

from palette4d.common.arguments import MAX_FRAMES
from palette4d.media.movie_boxes import boxes

# EBML (RFC 8794) and Matroska (RFC 9559).
_EBML, _SEGMENT = 0x1A45DFA3, 0x18538067


def promised_frames(container: Any, stream: Any, path: Path) -> int:
    """Return the frames that a movie's header promises; 0 if it promises none.

    Matroska states a time, which the sound may need alone. It counts only if the file is cut short.
    """
    if stream.frames:
        return int(stream.frames)
    rate = stream.average_rate
    time: Fraction | None = None
    if container.format.name == "mxf" and stream.duration is not None:
        time = stream.duration * stream.time_base
    elif "matroska" in container.format.name and container.duration and _matroska_is_short(path):
        time = _stated(stream.metadata.get("DURATION", "")) or Fraction(container.duration, 10**6)
    promised = round(time * rate) if time and rate else 0
    return promised if promised <= MAX_FRAMES else 0


def is_cut_short(path: Path) -> bool:
    """Whether a .mov or .mp4 ends in the middle of a box, as of a fragment."""
    length = path.stat().st_size
    with path.open("rb") as file:
        return any(file.tell() + size > length for _, size in boxes(file))


def _stated(text: str) -> Fraction | None:
    """Return the time of a text "00:00:04.000000000" in seconds."""
    try:
        hours, minutes, seconds = map(Fraction, text.split(":"))
    except ValueError:
        return None
    return hours * 3600 + minutes * 60 + seconds


def _matroska_is_short(path: Path) -> bool:
    """Whether a Matroska file ends before its segment does."""
    length = path.stat().st_size
    with path.open("rb") as file:
        kind, size = _number(file, marked=True), _number(file)
        if kind != _EBML or size is None:
            return False
        file.seek(size, 1)
        kind, size = _number(file, marked=True), _number(file)
        return kind == _SEGMENT and size is not None and file.tell() + size > length


def _number(file: BinaryIO, *, marked: bool = False) -> int | None:
    """Return a number of variable length, of an id with its mark; None if it is unknown."""
    head = file.read(1)
    if not head or not head[0]:
        return None
    more = 8 - head[0].bit_length()
    value = int.from_bytes(head + file.read(more), "big")
    mask = (1 << 7 * (more + 1)) - 1
    if marked:
        return value
    return None if value & mask == mask else value & mask
