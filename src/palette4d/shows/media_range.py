"""The media that a clip of a timeline shows, with transitions, speed and compounds.

Input: a clip of an OpenTimelineIO timeline. Output: times of the timeline and of the media, in
seconds. OpenTimelineIO's times are doubles at any rate. Here they are fractions, so that no sum of
times at several rates is off by a frame.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from palette4d.common.errors import Palette4dError
from palette4d.media.clip_base import as_rate
from palette4d.media.timecode import nominal
from palette4d.shows.edl_motion import UNFOLLOWED
from palette4d.shows.timeline_files import library

#: Part of a frame within which two times are the same: files hold times as rounded decimals.
ROUNDING = Fraction(1, 1000)


@dataclasses.dataclass(frozen=True)
class Level:
    """A clip, or a compound around it.

    Attributes
    ----------
    item : OpenTimelineIO's object.
    place : its start in its parent, in seconds; a text if it cannot be known.
    """

    item: Any
    place: Fraction | str

    @property
    def moves(self) -> tuple[Fraction, Fraction]:
        """The start of the item's own time, and its start in its parent, in seconds."""
        if isinstance(self.place, str):
            raise Palette4dError(self.place)
        if isinstance(self.item, library().schema.Clip):
            return seconds(self.item.trimmed_range().start_time), self.place
        own = self.item.source_range
        return Fraction(0) if own is None else seconds(own.start_time), self.place


@dataclasses.dataclass(frozen=True)
class Shown:
    """The range of a clip's media that a timeline shows.

    Attributes
    ----------
    record : the clip's start in the time of the timeline's stack, in seconds; None if it is not
        known, because an item before it has no length.
    start, end : the media's time in seconds. At the media's own speed `end` is behind the last
        frame, else it is a time in the last frame.
    speed : multiple of the media's own speed; negative backwards, 0 for a freeze frame.
    """

    record: Fraction | None
    start: Fraction
    end: Fraction
    speed: float = 1.0

    def frames(self, rate: Fraction) -> tuple[int, int]:
        """Return the first and last frame, counted in the media's time at a rate."""
        start, end = self.start * rate, self.end * rate
        first = math.floor(start + ROUNDING)
        if self.speed == 1:
            return first, max(first, math.ceil(end - ROUNDING) - 1)
        return first, max(first, math.floor(end + ROUNDING))


def rate_of(rate: float) -> Fraction:
    """Return a rate of OpenTimelineIO's; `Palette4dError` if it is none."""
    known = as_rate(rate)
    if known is None:
        raise Palette4dError(
            f"found the rate {rate:g}, expected frames per second above 0; mend it in the edit"
        )
    return known


def own_rate(range_: Any) -> Fraction:
    """Return the rate at which a time range counts; a start of 0 may have any."""
    start = range_.start_time
    return rate_of(start.rate if start.value else range_.duration.rate)


def seconds(time: Any) -> Fraction:
    """Return a time of OpenTimelineIO's in seconds."""
    return Fraction(time.value).limit_denominator(10**6) / rate_of(time.rate)


def shown(levels: Sequence[Level], rate: Fraction) -> Shown | None:
    """Return the range of a clip's media that a timeline shows; None if it shows none.

    `levels` begins with the clip and ends with the track. `rate` is the timeline's.
    """
    schema = library().schema
    clip = levels[0].item
    whole = window = _visible(clip)
    for level in levels[1:]:
        if any(isinstance(effect, schema.TimeEffect) for effect in level.item.effects):
            raise Palette4dError(
                f"the clip {clip.name!r} lies in a compound {level.item.name!r} that plays at "
                "another speed, which is not followed; change the speed of the clip itself"
            )
    parents = [*(level.item for level in levels[1:]), levels[-1].item.parent()]
    lost = any(isinstance(level.place, str) for level in levels)
    if lost and all(parent.source_range is None for parent in parents):
        return _with_speed(clip, None, whole, rate)  # nothing cuts it, wherever it is
    for level, parent in zip(levels, parents, strict=True):
        own, place = level.moves
        window = _moved(window, place - own)
        if parent.source_range is not None:
            cut = _common(window, _bounds(parent.source_range))
            if cut is None:
                return None
            window = cut
    back = window
    for level in levels:
        own, place = level.moves
        back = _moved(back, own - place)
    left = _common(back, whole)
    return None if left is None else _with_speed(clip, window[0], left, rate)


_Range = tuple[Fraction, Fraction]


def _bounds(range_: Any) -> _Range:
    start = seconds(range_.start_time)
    return start, start + seconds(range_.duration)


def _visible(clip: Any) -> _Range:
    """Return a clip's range with the media that neighbouring transitions show."""
    start, end = _bounds(clip.trimmed_range())
    head, tail = clip.parent().handles_of_child(clip) if _in_track(clip) else (None, None)
    return start - (seconds(head) if head else 0), end + (seconds(tail) if tail else 0)


def _in_track(clip: Any) -> bool:
    return isinstance(clip.parent(), library().schema.Track)


def _moved(window: _Range, by: Fraction) -> _Range:
    return window[0] + by, window[1] + by


def _common(first: _Range, second: _Range) -> _Range | None:
    start, end = max(first[0], second[0]), min(first[1], second[1])
    return None if end <= start else (start, end)


def speed_of(clip: Any) -> float:
    """Return a clip's constant speed, 1 for the media's own; `Palette4dError` if it has none."""
    schema = library().schema
    speed = 1.0
    for effect in clip.effects:
        if isinstance(effect, schema.LinearTimeWarp):  # a freeze frame, too
            speed *= effect.time_scalar
        elif isinstance(effect, schema.TimeEffect) and effect.effect_name == UNFOLLOWED:
            raise Palette4dError(f"the clip {clip.name!r}: {effect.name}")
        elif isinstance(effect, schema.TimeEffect):
            name = effect.effect_name or effect.name or effect.schema_name()
            raise Palette4dError(
                f"the clip {clip.name!r} has the time effect {name!r}, which is "
                "not followed; expected a constant speed or a freeze frame"
            )
    if not math.isfinite(speed):
        raise Palette4dError(
            f"the clip {clip.name!r} plays at {speed:g} times its speed, expected a finite number; "
            "mend it in the edit"
        )
    return speed


def _with_speed(clip: Any, record: Fraction | None, left: _Range, rate: Fraction) -> Shown:
    """Return the media that a clip plays in a range of its own time.

    At another speed the in-point stays, and the media of the clip's length times the speed follows
    it. Backwards, its last frame is played first.
    """
    speed = speed_of(clip)
    if speed == 1:
        return Shown(record, *left)
    own = clip.trimmed_range()
    begin, end = _bounds(own)
    counted = own_rate(own)
    # The timeline shows no frame after its own last one.
    finest = counted if nominal(counted) == nominal(rate) else max(counted, rate)
    step = 1 / finest
    first, last = left[0] - begin, max(left[0], left[1] - step) - begin
    if speed < 0:
        first, last = end - begin - step - last, end - begin - step - first
    times = Fraction(abs(speed)).limit_denominator(10**6)
    return Shown(record, begin + times * first, begin + times * last, speed)
