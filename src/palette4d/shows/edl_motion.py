"""How the events of an EDL play their media: lines M2 and FREEZE FRAME, and lengths."""

from __future__ import annotations

import dataclasses
import math
import re
from fractions import Fraction

from palette4d.media.timecode import day_of, frames_of, nearest
from palette4d.shows.edl_text import Event


@dataclasses.dataclass(frozen=True)
class Motion:
    """How an event plays its media.

    Attributes
    ----------
    speed : multiple of the media's own speed; 1 without a motion effect.
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

    An event's source is the media that it plays (CMX 3600), or as long as the record at any speed
    (DaVinci Resolve). Their lengths tell which.
    """
    (start, end), (begin, stop) = event.own.source, event.own.record
    frames, media = stop - begin, end - start
    day = day_of(rate, bool(event.own.drops))
    speeds = [
        (speed, at if at is None else nearest(at, start, day)) for speed, at in _speeds(event, rate)
    ]
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
    speeds = []
    for comment in event.comments:
        if match := _M2.fullmatch(comment):
            time = frames_of(match[3] or "", rate, bool(event.own.drops))
            speeds.append(("_".join((match[1] or "").split()), _speed(float(match[2]), rate), time))
    if len(event.lines) == 2 and len(speeds) > 1:
        before, own = event.lines
        # Of two clips in a transition, the one before may state its speed again.
        others = [(reel, before.source[0]) for reel in (before.reel, "")]
        speeds = [one for one in speeds if (one[0], one[2]) not in others] or speeds[-1:]
        speeds = [one for one in speeds if one[0] in (own.reel, "")] or speeds[-1:]
    elif len(event.lines) == 2 and speeds:
        before, own = event.lines
        time = speeds[0][2]
        if time == before.source[0] != own.source[0] and speeds[0][0] == before.reel:
            speeds = []
    return [(speed, time) for _, speed, time in speeds]


def _speed(fps: float, rate: Fraction) -> float:
    """Return the speed of M2's frames per second: 2 for 48 at 24 and for 47.952 at 23.976.

    M2 has one decimal. A whole percentage that rounds to it is taken.
    """
    for base in (round(rate), float(rate)):
        whole = round(100 * fps / base) / 100
        if abs(whole * base - fps) <= ROUNDED:
            return whole
    return fps / round(rate)
