"""The text of a CMX 3600 EDL: its encoding, events, and the comments that belong to each.

Input: a file's bytes. Output: `Event`s. Programs write EDLs in any encoding, several lines with one
number, timecodes that drop numbers with colons, and comments of their own.
"""

from __future__ import annotations

import codecs
import dataclasses
import itertools
import re
from collections.abc import Iterator, Sequence
from fractions import Fraction

from palette4d.common.errors import Arg, Palette4dError
from palette4d.media.timecode import (
    day_of,
    drops_numbers,
    frames_of,
    nearest,
    skipped_a_minute,
)

_TIME = r"([0-9]{1,2}[:;][0-9]{2}[:;][0-9]{2}[:;.,][0-9]{2,3}|[0-9]+)"
_LINE = re.compile(
    r"([0-9]+)\s+(?:(\S.*?)\s+)?(\S+)\s+(C|D|W[0-9]{3}|K(?:\s*[BO])?)\s+(?:([0-9]{1,3})\s+)?"
    + r"\s+".join([_TIME] * 4)
    + r"\s*"
)
#: The most characters of a line that are read.
LONGEST = 1000
_SHAPE = "001 A001C001 V C 01:00:00:00 01:00:02:00 01:00:00:00 01:00:02:00"


@dataclasses.dataclass(frozen=True)
class EventLine:
    """One numbered line; times are frames from 00:00:00:00, also past midnight.

    `drops` and `record_drops`: whether the timecodes of source and record leave numbers out; None
    for a source in frames.
    """

    number: str
    reel: str
    channel: str
    kind: str
    length: str
    source: tuple[int, int]
    record: tuple[int, int]
    drops: bool | None
    record_drops: bool

    @property
    def frames(self) -> int:
        """How many frames of the timeline it has."""
        return self.record[1] - self.record[0]

    @property
    def is_black(self) -> bool:
        """Whether it shows black instead of a clip."""
        return self.reel in ("BL", "BLACK")


@dataclasses.dataclass(frozen=True)
class Event:
    """A cut, or a transition to a clip, and the comments below it.

    Attributes
    ----------
    lines : its own; of a transition, before it the outgoing clip's, which has no length.
    comments : as they stand in the file.
    place : the number of the last line of the event in the file, with its comments.
    """

    lines: tuple[EventLine, ...]
    comments: tuple[str, ...]
    place: int

    @property
    def own(self) -> EventLine:
        """The line of the clip that begins here."""
        return self.lines[-1]


def decoded(data: bytes) -> str:
    """Return the text of an EDL in UTF-8, UTF-16, Windows-1252 or Latin-1."""
    encoding, mark = _encoding_of(data)
    return data[len(mark) :].decode(encoding, "replace")


def encoded_like(data: bytes, lines: Sequence[str]) -> bytes:
    """Return lines as a file in the encoding and with the line ends of another one's bytes."""
    encoding, mark = _encoding_of(data)
    first = next(iter(decoded(data).splitlines(keepends=True)), "")
    end = first[len(first.rstrip("\r\n")) :] or "\n"
    return mark + (end.join(lines) + end).encode(encoding, "replace")


def _encoding_of(data: bytes) -> tuple[str, bytes]:
    """Return the encoding of an EDL's bytes, and its byte order mark, or b""."""
    for encoding, mark in (
        ("utf-8", codecs.BOM_UTF8),
        ("utf-16-le", codecs.BOM_UTF16_LE),
        ("utf-16-be", codecs.BOM_UTF16_BE),
    ):
        if data.startswith(mark):
            return encoding, mark
    if b"\0" in data[:200]:  # without a mark: an EDL begins with letters
        return "utf-16-le" if data[1:2] == b"\0" else "utf-16-be", b""
    for encoding in ("utf-8", "cp1252"):
        try:
            data.decode(encoding)
        except UnicodeDecodeError:
            continue
        return encoding, b""
    return "latin-1", b""


def title_of(text: str) -> str:
    """Return the text of the line TITLE."""
    titles = (line.strip() for line in text.splitlines())
    found = next((title for title in titles if title.startswith("TITLE:")), "")
    return found.removeprefix("TITLE:").strip()


def states_drop(text: str) -> bool:
    """Whether an EDL has a line FCM: DROP FRAME."""
    return any(_drops(line) for line in text.splitlines() if _is_mode(line.strip()))


def _is_mode(line: str) -> bool:
    """Whether a line states the frame code mode; some programs write it in small letters."""
    return line[:4].upper() == "FCM:"


def _drops(line: str) -> bool:
    return "NON" not in line.upper() and "DROP" in line.upper()


def events_of(text: str, rate: Fraction) -> list[Event]:
    """Return the events in their order.

    Raises
    ------
    Palette4dError
        A line is no event, or has a timecode that the rate does not have.
    """
    events: list[Event] = []
    for block, comments, place in _blocks(text, rate):
        events += [Event(lines, comments, place) for lines in _pairs(block)]
    return _past_midnight(events, rate)


def _past_midnight(events: list[Event], rate: Fraction) -> list[Event]:
    """Count the record past midnight, where it begins again at 00:00:00:00.

    Each line is counted nearest to the first one, so that events may come in any order.
    """
    lines = [line for event in events for line in event.lines]
    day = day_of(rate, bool(lines) and lines[0].record_drops)
    crosses = any(line.record[1] >= day for line in lines)
    falls = (a.record[0] - b.record[0] > day // 2 for a, b in itertools.pairwise(lines))
    if not crosses and not any(falls):
        return events
    first = lines[0].record[0]
    begins = [nearest(line.record[0], first, day) for line in lines]
    later = day if min(begins) < 0 else 0
    moved = (
        dataclasses.replace(line, record=(begin + later, begin + later + line.frames))
        for line, begin in zip(lines, begins, strict=True)
    )
    return [
        dataclasses.replace(event, lines=tuple(itertools.islice(moved, len(event.lines))))
        for event in events
    ]


def _blocks(text: str, rate: Fraction) -> Iterator[tuple[list[EventLine], tuple[str, ...], int]]:
    """Yield the event lines with one number, the comments below them, and the last line's."""
    drop = False
    block: list[EventLine] = []
    comments: list[str] = []
    place = 0
    for index, raw in enumerate(text.splitlines(), start=1):
        line = raw[:LONGEST].strip()  # patterns take long for lines that no program writes
        if _is_mode(line):
            drop = _drops(line)
        elif line[:1].isdigit():
            event = _event_line(line, index, rate, drop)
            if block and _goes_on(block, event):
                comments = []  # they belong to the outgoing clip
            elif block and (comments or int(event.number) != int(block[0].number)):
                yield block, tuple(comments), place
                block, comments = [], []
            block.append(event)
            place = index
        elif line and block and not line.startswith("SPLIT:"):
            comments.append(line)
            place = index
    if block:
        yield block, tuple(comments), place


def _goes_on(block: list[EventLine], line: EventLine) -> bool:
    """Whether a line is the second one of a transition, with comments between the two or not."""
    before = block[-1]
    return (
        line.kind[0] in "DW"
        and before.kind == "C"
        and not before.frames
        and (int(before.number), before.channel) == (int(line.number), line.channel)
    )


def _pairs(block: list[EventLine]) -> Iterator[tuple[EventLine, ...]]:
    """Yield the events of lines with one number: a transition has two lines of one channel."""
    before: EventLine | None = None
    for line in block:
        if line.kind == "C":
            if before is not None:
                yield (before,)
            before = line
        elif before is not None and _goes_on([before], line):
            yield before, line
            before = None
        else:
            if before is not None and before.channel == line.channel:
                yield (before,)
                before = None
            yield (line,)
    if before is not None:
        yield (before,)


def _event_line(line: str, index: int, rate: Fraction, drop: bool) -> EventLine:
    match = _LINE.fullmatch(line)
    if match is None:
        raise Palette4dError(
            f"line {index}: found {line!r:.90}, expected an event such as {_SHAPE}"
        )
    number, reel, channel, kind, length, *times = match.groups()
    start, end, begin, stop = (_count(time, index, rate, drop) for time in times)
    drop = drop and skipped_a_minute(rate) > 0
    drops, record_drops = (drop or drops_numbers(time, rate) for time in (times[0], times[2]))
    if not times[2].isdigit() and begin - stop > day_of(rate, record_drops) // 2:
        stop += day_of(rate, record_drops)
    if not times[0].isdigit() and end - start != stop - begin:
        end = nearest(end, start, day_of(rate, drops))
    if stop < begin:
        raise Palette4dError(
            f"line {index}: found a record from {times[2]} to {times[3]}, which ends before it "
            "begins; mend it in the edit"
        )
    return EventLine(
        number,
        "_".join((reel or "AX").split()),
        channel,
        "".join(kind.split()),
        length or "",
        (start, end),
        (begin, stop),
        None if times[0].isdigit() else drops,
        record_drops,
    )


def _count(time: str, index: int, rate: Fraction, drop: bool) -> int:
    """Return a timecode in frames. With FCM: DROP FRAME colons drop numbers, too, if they can."""
    if time.isdigit():
        return int(time)
    count = frames_of(time, rate, drop)
    if count is None and drop:
        count = frames_of(time, rate)
    if count is None:
        raise Palette4dError(
            f"line {index}: found the timecode {time}, which {float(rate):.6g} frames per second "
            f"do not have; name the rate of the EDL's timecodes with {Arg('rate')}"
        )
    return count
