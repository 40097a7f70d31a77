"""The text of a CMX 3600 EDL: its encoding, events, and the comments that belong to each.

Input: a file's bytes. Output: `Event`s. Programs write EDLs in any encoding, several lines with one
number, timecodes that drop numbers with colons, and comments of their own.
"""

from __future__ import annotations

import codecs
import dataclasses
import math
import re
from collections.abc import Iterator, Sequence
from fractions import Fraction

from palette4d.common.errors import Arg, Palette4dError
from palette4d.media.timecode import frames_of

_TIME = r"([0-9]{1,2}[:;][0-9]{2}[:;][0-9]{2}[:;.,][0-9]{2,3}|[0-9]+)"
_LINE = re.compile(
    r"([0-9]+)\s+(?:(\S.*?)\s+)?(\S+)\s+(C|D|W[0-9]{3}|KB?|KO)\s+(?:([0-9]{1,3})\s+)?"
    + r"\s+".join([_TIME] * 4)
    + r"\s*"
)
#: The most characters of a line that are read.
LONGEST = 1000
_SHAPE = "001 A001C001 V C 01:00:00:00 01:00:02:00 01:00:00:00 01:00:02:00"


@dataclasses.dataclass(frozen=True)
class EventLine:
    """One numbered line; times are frames from 00:00:00:00."""

    number: str
    reel: str
    channel: str
    kind: str
    length: str
    source: tuple[int, int]
    record: tuple[int, int]


@dataclasses.dataclass(frozen=True)
class Event:
    """A cut, or a transition to a clip, and the comments below it.

    Attributes
    ----------
    lines : one, or for a transition that of the clip before and its own.
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
    return any(_drops(line) for line in text.splitlines() if line.strip().startswith("FCM:"))


def _drops(line: str) -> bool:
    return "NON" not in line.upper() and "DROP" in line.upper()


def events_of(text: str, rate: Fraction) -> list[Event]:
    """Return the events in their order.

    Raises
    ------
    Palette4dError
        A line is no event, or has a timecode that the rate does not have.
    """
    found: list[Event] = []
    for block, comments, place in _blocks(text, rate):
        found += [Event(lines, comments, place) for lines in _pairs(block)]
    return found


def _blocks(text: str, rate: Fraction) -> Iterator[tuple[list[EventLine], tuple[str, ...], int]]:
    """Yield the event lines with one number, the comments below them, and the last line's."""
    drop = False
    block: list[EventLine] = []
    comments: list[str] = []
    place = 0
    for index, raw in enumerate(text.splitlines(), start=1):
        line = raw[:LONGEST].strip()  # patterns take long for lines that no program writes
        if line.startswith("FCM:"):
            drop = _drops(line)
        elif line[:1].isdigit():
            event = _event_line(line, index, rate, drop)
            if block and (comments or int(event.number) != int(block[0].number)):
                yield block, tuple(comments), place
                block, comments = [], []
            block.append(event)
            place = index
        elif line and block and not line.startswith("SPLIT:"):
            comments.append(line)
            place = index
    if block:
        yield block, tuple(comments), place


def _pairs(block: list[EventLine]) -> Iterator[tuple[EventLine, ...]]:
    """Yield the events of lines with one number: a transition has two lines of one channel."""
    before: EventLine | None = None
    for line in block:
        if line.kind == "C":
            if before is not None:
                yield (before,)
            before = line
        elif before is not None and before.channel == line.channel:
            yield before, line
            before = None
        else:
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
    frames = [_count(time, index, rate, drop) for time in times]
    return EventLine(
        number,
        "_".join((reel or "AX").split()),
        channel,
        kind,
        length or "",
        (frames[0], frames[1]),
        (frames[2], frames[3]),
    )


def _count(time: str, index: int, rate: Fraction, drop: bool) -> int:
    """Return a timecode in frames. With FCM: DROP FRAME colons drop numbers, too, if they can."""
    if time.isdigit():
        return int(time)
    found = frames_of(time, rate, drop)
    if found is None and drop:
        found = frames_of(time, rate)
    if found is None:
        raise Palette4dError(
            f"line {index}: found the timecode {time}, which {float(rate):.6g} frames per second "
            f"do not have; name the rate of the EDL's timecodes with {Arg('rate')}"
        )
    return found


@dataclasses.dataclass(frozen=True)
class Motion:
    """How an event plays its media.

    Attributes
    ----------
    speed : how often the media's own speed; 1 if no motion effect says so.
    start : the first frame of the media that `speed` counts from: backwards the last one played.
    problem : the reason why it cannot be followed, or "".
    """

    speed: float
    start: int
    problem: str = ""


#: The time effect of an event whose frames are not known; the effect's name is the reason.
UNFOLLOWED = "palette4d.unfollowed"
_M2 = re.compile(r"M2\s+(?:(\S.*)\s+)?([+-]?[0-9]+(?:\.[0-9]*)?)(?:\s+(\S.*))?")
#: Frames per second by which M2 may be off: it has one decimal.
ROUNDED = 0.0501
_FREEZE = re.compile(r"\*\s*(\*\s*)?FREEZE FRAME")


def is_motion(comment: str) -> bool:
    """Whether a comment states how fast an event plays."""
    return bool(re.match(r"M2\s", comment) or _FREEZE.match(comment))


def motion_of(event: Event, rate: Fraction) -> Motion:
    """Return how an event plays its media, of lines M2 and FREEZE FRAME, or of its lengths.

    The source of an event is what it plays (CMX 3600), or it is as long as the record whatever the
    speed (DaVinci Resolve). Lengths tell the two apart.
    """
    (start, end), (begin, stop) = event.own.source, event.own.record
    frames, media = stop - begin, end - start
    speeds = _speeds(event, rate)
    if any(_FREEZE.match(comment) for comment in event.comments):
        speeds = speeds or [(0.0, start)]
    if not speeds:
        if media == frames:
            return Motion(1, start)
        return Motion(
            1,
            start,
            f"its source has {media} frames, its record {frames}, and no line M2 states the speed; "
            "mend it in the edit",
        )
    speed, at = speeds[-1]
    if frames <= 0:
        return Motion(speed, start)
    if speed == 0:
        return Motion(0, start if at is None else at)
    own = _of_lengths(media, frames, speed, rate)
    if own is None:
        return Motion(speed, start, _misfit(media, frames, speed))
    if own > 0 and at not in (None, start):
        return Motion(speed, start, _elsewhere(at - start if at else 0))
    if own < 0 and media < 0:  # written as it plays: from a frame down to another
        return Motion(own, round(start + own * (frames - 1)))
    if own < 0 and at not in (None, start, end - 1, end):
        return Motion(speed, start, _elsewhere(at - start if at else 0))
    return Motion(own, start)


def _of_lengths(media: int, frames: int, speed: float, rate: Fraction) -> float | None:
    """Return the speed that fits the lengths of source and record; None if none does."""
    length, fast = abs(media), abs(speed)
    # Avid's source ends with the last frame that plays, others' with the last frame's end.
    if fast * (frames - 1) - 1 <= length <= fast * frames + 1:
        return speed
    exact = math.copysign(length / frames, speed)
    if abs(exact - speed) * rate <= 2 * ROUNDED:
        return exact
    return speed if media == frames and speed > 0 else None


def _elsewhere(frames: int) -> str:
    return (
        f"its line M2 begins {frames} frames away from its source, so that the frames are not "
        "known; expected the same timecode. Mend it in the edit"
    )


def _misfit(media: int, frames: int, speed: float) -> str:
    return (
        f"its source has {media} frames and its record {frames}, which do not fit the {speed:g} "
        "times that its line M2 states; mend it in the edit, or analyse the media on its own"
    )


def _speeds(event: Event, rate: Fraction) -> list[tuple[float, int | None]]:
    """Return (speed, first frame) of each line M2 that belongs to the event's own clip."""
    found = []
    for comment in event.comments:
        if match := _M2.fullmatch(comment):
            at = frames_of(match[3] or "", rate)
            found.append(("_".join((match[1] or "").split()), _speed(float(match[2]), rate), at))
    if len(event.lines) == 2 and len(found) > 1:
        before, own = event.lines
        # Of two clips in a transition, the one before may state its speed again.
        others = [(reel, before.source[0]) for reel in (before.reel, "")]
        found = [one for one in found if (one[0], one[2]) not in others] or found[-1:]
        found = [one for one in found if one[0] in (own.reel, "")] or found[-1:]
    elif len(event.lines) == 2 and found:
        before, own = event.lines
        at = found[0][2]
        if at == before.source[0] != own.source[0] and found[0][0] == before.reel:
            found = []
    return [(speed, at) for _, speed, at in found]


def _speed(fps: float, rate: Fraction) -> float:
    """Return the speed of M2's frames per second: 2 for 48 at 24 and for 47.952 at 23.976.

    Whole percents are likelier than what M2 rounds them to.
    """
    for base in (round(rate), float(rate)):
        whole = round(100 * fps / base) / 100
        if abs(whole * base - fps) <= ROUNDED:
            return whole
    return fps / round(rate)
