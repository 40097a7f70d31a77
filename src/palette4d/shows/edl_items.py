"""The events of an EDL in the form that OpenTimelineIO's adapter reads.

Sources as long as records, each event with a number of its own, track by track in the record's
order. A transition gets a line for its outgoing clip.
"""

from __future__ import annotations

import dataclasses
import itertools
import re
from collections.abc import Iterator, Sequence
from fractions import Fraction

from palette4d.common.errors import Arg, Palette4dError
from palette4d.media.timecode import label_of
from palette4d.shows import edl_cdl
from palette4d.shows.edl_motion import Motion, is_motion, motion_of
from palette4d.shows.edl_text import Event, EventLine

#: Begins a comment of ours: the adapter keeps comments with their clip.
MARK = "PALETTE4D ITEM "
#: The adapter's member of metadata.
NAMESPACE = "cmx_3600"
#: Ends the name of the track for the foreground of a key.
KEYED = "_KEY"
_NAME = re.compile(r"\*?\s*(FROM|TO|KEY) CLIP NAME\s*:?\s*(.*)")
_FILE = re.compile(r"\*?\s*SOURCE FILE\s*:\s*(.+)")
_STATED = re.compile(r"\*?\s*FROM (CLIP|FILE)\s*:")
_STILL = re.compile(r"\*?\s*(FROM|TO) CLIP IS A STILL")


@dataclasses.dataclass(frozen=True)
class Item:
    """A clip for the adapter.

    Attributes
    ----------
    place : in the list of all items.
    line, motion, comments : of its event.
    channel : the track.
    number : of its event in the list of events; None for the outgoing clip of a transition that has
        no event.
    before : the line of the outgoing clip of a transition; None for a cut.
    """

    place: int
    line: EventLine
    motion: Motion
    comments: tuple[str, ...]
    channel: str
    number: int | None
    before: EventLine | None = None

    @property
    def name(self) -> str:
        """The number of the event for the adapter."""
        return f"{self.place + 1:06d}"

    def text(self, origin: int) -> str:
        """Return the lines for the adapter, with the record counted from a frame.

        Sources begin at 0, because the adapter counts no further than midnight.
        """
        line, begin = self.line, self.line.record[0] - origin
        times = f"0 {line.frames} {begin} {begin + line.frames}"
        lines = [f"{self.name} {line.reel} {self.channel} C {times}"]
        if self.before is not None:
            lines = [
                f"{self.name} {self.before.reel} {self.channel} C 0 0 {begin} {begin}",
                f"{self.name} {line.reel} {self.channel} {line.kind} {line.length} {times}",
            ]
        kept = (
            comment
            for comment in self.comments
            if not (is_motion(comment) or edl_cdl.is_cdl(comment))
        )
        return "\n".join([*lines, *kept, f"* {MARK}{self.place}"])


def items_of(events: Sequence[Event], rate: Fraction) -> list[Item]:
    """Return the clips of an EDL's events, track by track in the record's order."""
    items: list[Item] = []
    last: dict[str, Item] = {}
    channels = [_channel(event.own) for event in events]
    tracks = {channel: place for place, channel in enumerate(dict.fromkeys(channels))}
    rows = zip(events, channels, itertools.count(), strict=False)
    for event, channel, number in sorted(
        rows, key=lambda row: (tracks[row[1]], row[0].own.record[0])
    ):
        if channel in last:
            _check_order(last[channel].line, event, rate)
        motion = motion_of(event, rate)
        before = None
        if event.own.kind[0] in "DW" and event.own.length:
            out = event.lines[0] if len(event.lines) == 2 else None
            if out is not None and not out.is_black and not _continues(last.get(channel), out):
                comments = tuple(_named_before(event))
                own = Event((out,), comments, event.place)
                item = Item(len(items), out, motion_of(own, rate), comments, channel, None)
                items.append(item)
                last[channel] = item
            if channel in last:  # the adapter refuses a transition from nothing
                before = out or last[channel].line
        comments = tuple(_named(event))
        last[channel] = Item(len(items), event.own, motion, comments, channel, number, before)
        items.append(last[channel])
    return items


def _channel(line: EventLine) -> str:
    """Return the track of an event: V for picture with sound.

    The channel NONE means audio tracks above A2, which a comment AUD numbers.
    """
    if line.kind in ("K", "KO"):
        return line.channel + KEYED
    if line.channel == "NONE":
        return "A"
    if re.fullmatch(r"V[0-9]*", line.channel) or "V" not in line.channel.upper():
        return line.channel
    return "V" if re.fullmatch(r"[AV0-9/,]+", line.channel.upper()) else line.channel


def _check_order(before: EventLine, event: Event, rate: Fraction) -> None:
    """Refuse an event that overlaps the one before it on its track."""
    own = event.own
    if own.record[0] < before.record[1]:
        begin, end = (
            label_of(frame, rate, own.record_drops) for frame in (own.record[0], before.record[1])
        )
        raise Palette4dError(
            f"line {event.place}: found the event {own.number} at {begin} of the record, while the "
            f"event {before.number} goes on to {end} on the same track, {own.channel}; expected "
            f"events one after the other; mend it in the edit, or check {Arg('rate')}"
        )


def _continues(before: Item | None, line: EventLine) -> bool:
    """Whether the outgoing clip of a transition is the clip that ends there."""
    if before is None or before.line.record[1] != line.record[0]:
        return False
    same_reel = before.line.reel == line.reel
    return same_reel and (before.motion.speed != 1 or before.line.source[1] == line.source[0])


def _named_before(event: Event) -> Iterator[str]:
    """Yield the comments for the outgoing clip of a transition: its name and speed."""
    out, own = event.lines
    for comment in event.comments:
        name = _NAME.match(comment)
        is_speed = is_motion(comment) and out.reel != own.reel and out.reel in comment.split()
        if is_speed or (name and name[1] == "FROM"):
            yield comment


def _named(event: Event) -> Iterator[str]:
    """Yield an event's comments without the names of other clips."""
    names = {match[1] for one in event.comments if (match := _NAME.match(one))}
    files = [match[1] for one in event.comments if (match := _FILE.match(one))]
    states_file = any(_STATED.match(one) for one in event.comments)
    for comment in event.comments:
        match = _NAME.match(comment)
        if match and match[1] == "FROM" and not _is_own(event, names):
            continue
        if match and event.own.kind in ("K", "KO"):
            if match[1] == "KEY":
                yield f"* FROM CLIP NAME: {match[2]}"
        elif not _STILL.match(comment):
            yield comment
    if files and not states_file and len(files) == len(event.lines):
        yield f"* FROM FILE: {files[-1]}"


def _is_own(event: Event, names: set[str]) -> bool:
    """Whether FROM CLIP NAME names the event's own clip, not the outgoing one."""
    if len(event.lines) == 1 or "TO" in names:
        return True
    before, own = event.lines
    return before.is_black or own.is_black or (before.reel == own.reel != "AX")
