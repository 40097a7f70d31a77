"""The range of a clip's media that an edit shows, with transitions, speed and compounds.

Input: a clip of an OpenTimelineIO timeline. Output: ranges of time, in the edit and in the media.
"""

from __future__ import annotations

import math
from typing import Any

from palette4d.common.errors import Palette4dError
from palette4d.shows.timeline_files import library

#: Fraction of a frame within which two times are the same: OpenTimelineIO's are doubles.
ROUNDING = 1e-3


def shown(clip: Any) -> tuple[Any, Any] | None:
    """Return a clip's start in the edit, and the range of its media that the edit shows.

    None if the edit shows nothing of the clip. The start is in the time of the timeline's stack,
    the range in the media's time.
    """
    schema = library().schema
    whole = clip.visible_range()  # with the media that the neighbouring transitions show
    window, item = whole, clip
    while item.parent() is not None:
        parent = item.parent()
        if item is not clip and any(
            isinstance(effect, schema.TimeEffect) for effect in item.effects
        ):
            raise Palette4dError(
                f"the clip {clip.name!r} lies in a compound {item.name!r} that plays at "
                "another speed, which is not followed; change the speed of the clip itself"
            )
        window = item.transformed_time_range(window, parent)
        if parent.source_range is not None:
            window = _common(window, parent.source_range)
            if window is None:
                return None
        item = parent
    left = _common(item.transformed_time_range(window, clip), whole)
    return None if left is None else (window.start_time, _with_speed(clip, left))


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
