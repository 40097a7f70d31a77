"""The range of a clip's media that an edit shows, with transitions, speed and compounds.

Input: a clip of an OpenTimelineIO timeline. Output: ranges of time, in the edit and in the media.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from palette4d.common.errors import Palette4dError
from palette4d.shows.timeline_files import library

#: Fraction of a frame within which two times are the same: OpenTimelineIO's are doubles.
ROUNDING = 1e-3


@dataclasses.dataclass(frozen=True)
class Level:
    """A clip, or what it lies in.

    Attributes
    ----------
    item : OpenTimelineIO's object.
    place : its start in its parent; None for 0, a text if it cannot be known.
    """

    item: Any
    place: Any

    @property
    def moves(self) -> tuple[Any, Any]:
        """The start of the item's own time, and its start in its parent; None for 0."""
        if isinstance(self.place, str):
            raise Palette4dError(self.place)
        if isinstance(self.item, library().schema.Clip):
            return self.item.trimmed_range().start_time, self.place
        own = self.item.source_range
        return None if own is None else own.start_time, self.place


def shown(levels: Sequence[Level]) -> tuple[Any, Any] | None:
    """Return a clip's start in the edit, and the range of its media that the edit shows.

    `levels` begins with the clip and ends with the track. None if the edit shows nothing of the
    clip. The start is in the time of the timeline's stack, the range in the media's time.
    """
    schema = library().schema
    clip = levels[0].item
    whole = window = clip.visible_range()  # with the media that neighbouring transitions show
    for level, parent in itertools.pairwise([*levels, Level(levels[-1].item.parent(), None)]):
        item = level.item
        if item is not clip and any(
            isinstance(effect, schema.TimeEffect) for effect in item.effects
        ):
            raise Palette4dError(
                f"the clip {clip.name!r} lies in a compound {item.name!r} that plays at "
                "another speed, which is not followed; change the speed of the clip itself"
            )
        own, place = level.moves
        window = _moved(window, own, place)
        if parent.item.source_range is not None:
            window = _common(window, parent.item.source_range)
            if window is None:
                return None
    back = window
    for level in levels:
        own, place = level.moves
        back = _moved(back, place, own)
    left = _common(back, whole)
    return None if left is None else (window.start_time, _with_speed(clip, left))


def frames(shown: Any, rate: Fraction) -> tuple[int, int]:
    """Return the first and last frame of a range of media, counted in its time at a rate."""
    start, length = _at(shown.start_time, rate), _at(shown.duration, rate)
    rounding = Fraction(ROUNDING).limit_denominator(1000)
    first = math.floor(start + rounding)
    return first, max(first, math.ceil(start + length - rounding) - 1)


def _at(time: Any, rate: Fraction) -> Fraction:
    value = Fraction(time.value).limit_denominator(10**6)
    return value * (rate / Fraction(time.rate).limit_denominator(1001))


def _moved(window: Any, back: Any, on: Any) -> Any:
    """Return a time range moved back by one time and on by another; None is 0."""
    start = window.start_time
    if back is not None:
        start = start - back
    if on is not None:
        start = start + on
    return library().opentime.TimeRange(start, window.duration)


def _with_speed(clip: Any, shown: Any) -> Any:
    """Return the media that a clip plays in a range of its own time."""
    schema, opentime = library().schema, library().opentime
    speed = 1.0
    for effect in clip.effects:
        if isinstance(effect, schema.LinearTimeWarp):  # a freeze frame, too
            speed *= effect.time_scalar
        elif isinstance(effect, schema.TimeEffect):
            raise Palette4dError(
                f"the clip {clip.name!r} has the time effect {effect.effect_name!r}, which is "
                "not followed; expected a constant speed or a freeze frame"
            )
    if speed == 1:
        return shown
    if speed < 0 or not math.isfinite(speed):
        raise Palette4dError(
            f"the clip {clip.name!r} plays at {speed:g} times its speed, which is not followed; "
            "expected 0 (a freeze frame) or more. Render it, or analyse its media on its own"
        )
    # The in-point stays the same; time counts from there, in whole frames.
    origin = clip.trimmed_range().start_time
    rate = shown.duration.rate
    begin = origin.value_rescaled_to(rate)
    start = begin + speed * (shown.start_time.value_rescaled_to(rate) - begin)
    last = start + speed * (shown.duration.value - 1)
    first, end = math.floor(start + ROUNDING), math.floor(last + ROUNDING) + 1
    return opentime.TimeRange(
        opentime.RationalTime(first, rate), opentime.RationalTime(max(1, end - first), rate)
    )


def _common(one: Any, other: Any) -> Any:
    """Return the intersection of two time ranges; None if it is empty."""
    start = max(one.start_time, other.start_time)
    end = min(one.end_time_exclusive(), other.end_time_exclusive())
    if end <= start:
        return None
    return library().opentime.range_from_start_end_time(start, end)
