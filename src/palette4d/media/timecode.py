"""Timecodes, and the one that a camera writes into a clip's files.

Movies state it for the file, for the video stream or in a separate stream. DPX and OpenEXR state it
in each frame (SMPTE ST 268, `smpte:TimeCode`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from fractions import Fraction
from typing import Any

from palette4d.common.errors import Palette4dError
from palette4d.media.clip_base import Clip

#: OpenImageIO's name of the timecode that a frame states.
TIMECODE = "smpte:TimeCode"
_PARTS = re.compile(r"([0-9]{1,2})[:;.,]([0-9]{2})[:;.,]([0-9]{2})([:;.,])([0-9]{2,3})")


def nominal(rate: Fraction) -> int:
    """Return the whole frames that a second of timecode has: 30 for 29.97."""
    return max(1, round(rate))


def frames_of(timecode: str, rate: Fraction, drop: bool = False) -> int | None:
    """Return the number of frames from 00:00:00:00 to a timecode; None if there is no such one.

    Any separator but a colon before the frames means that the timecode drops numbers, and so does
    `drop`. It does so at multiples of 29.97 and 30 alone (SMPTE ST 12-1).

    >>> frames_of("01:00:00:00", Fraction(30000, 1001)), frames_of("01:00:00;00", Fraction(30))
    (108000, 107892)
    >>> frames_of("00:01:00;00", Fraction(30)), frames_of("00:00:00:24", Fraction(24))
    (None, None)
    """
    match = _PARTS.fullmatch(timecode.strip())
    if match is None:
        return None
    hours, minutes, seconds, frames = (int(match[i]) for i in (1, 2, 3, 5))
    base = nominal(rate)
    if minutes > 59 or seconds > 59 or frames >= base:
        return None
    count = ((hours * 60 + minutes) * 60 + seconds) * base + frames
    if not (drop or match[4] != ":"):
        return count
    skipped = skipped_a_minute(rate)
    if minutes % 10 and not seconds and frames < skipped:
        return None
    whole = hours * 60 + minutes
    return count - skipped * (whole - whole // 10)


def skipped_a_minute(rate: Fraction) -> int:
    """Return the numbers that drop-frame timecode leaves out a minute, but for each tenth one.

    >>> skipped_a_minute(Fraction(30000, 1001)), skipped_a_minute(Fraction(25))
    (2, 0)
    """
    return 0 if nominal(rate) % 30 else nominal(rate) // 15


def drops_numbers(timecode: str, rate: Fraction) -> bool:
    """Whether a timecode is one that leaves numbers out, by its last separator."""
    return bool(skipped_a_minute(rate)) and timecode.rstrip("0123456789")[-1:] not in ("", ":")


def day_of(rate: Fraction, drop: bool = False) -> int:
    """Return the frames of 24 hours of timecode, which then begins again.

    >>> day_of(Fraction(24)), day_of(Fraction(30000, 1001), drop=True)
    (2073600, 2589408)
    """
    return 144 * (600 * nominal(rate) - (9 * skipped_a_minute(rate) if drop else 0))


def nearest(frames: int, other: int, day: int) -> int:
    """Return a count of frames, moved by whole days to the one that is nearest to another count.

    >>> nearest(12, 2073588, day_of(Fraction(24)))
    2073612
    """
    return other + (frames - other + day // 2) % day - day // 2


def label_of(frames: int, rate: Fraction, drop: bool = False) -> str:
    """Return the timecode of a count of frames from 00:00:00:00, past 24 hours from there again.

    >>> label_of(2073612, Fraction(24)), label_of(1800, Fraction(30000, 1001), drop=True)
    ('00:00:00:12', '00:01:00;02')
    """
    return moved("00:00:00;00" if drop else "00:00:00:00", frames, rate)


def start_timecode(clip: Clip, rate: Fraction | None = None) -> str | None:
    """Return the timecode of a movie's frame 0, or of a sequence's first frame, `HH:MM:SS:FF`.

    None if the files have none. If the first frame is bad, the nearest good one tells it; `rate` is
    that of the sequence, by default the rate that the files state.
    """
    if clip.is_movie:
        return clip.stated.timecode or None
    first = clip.frames[0]
    for frame in (first, *clip.nearest_to(first)):
        try:
            metadata = clip.load(frame).metadata
        except (Palette4dError, OSError):
            continue
        timecode = timecode_in(metadata)
        if frame != first and timecode:
            timecode = moved(timecode, first - frame, rate or clip.rate)
        return timecode or None
    return None


def timecode_in(metadata: Iterable[tuple[str, Any, Any]]) -> str:
    """Return the timecode in a frame's metadata, or "", also for bits that are none."""
    words = (int(value[0]) for name, _, value in metadata if name == TIMECODE)
    text = next(map(decoded, words), "")
    # At 50 frames per second, where all numbers of frames that the bits may hold exist.
    return "" if frames_of(text, Fraction(50)) is None or text[:2] > "23" else text


def decoded(word: int) -> str:
    """Return the text of SMPTE ST 12's 32 bits: two decimal digits per byte, and flags.

    >>> decoded(0x10215203), decoded(0x00000043)
    ('10:21:52:03', '00:00:00;03')
    """
    hours, minutes, seconds, frames = (word >> 24, word >> 16, word >> 8, word)
    drop = ";" if frames & 0x40 else ":"

    def digits(byte: int, tens: int) -> str:
        return f"{(byte >> 4) & tens}{byte & 15}"

    return f"{digits(hours, 3)}:{digits(minutes, 7)}:{digits(seconds, 7)}{drop}{digits(frames, 3)}"


def encoded(timecode: str) -> int | None:
    """Return the 32 bits of a timecode; None above 39 frames, for which there are no digits.

    >>> hex(encoded("10:21:52;03")), encoded("00:00:00:59")
    ('0x10215243', None)
    """
    if not timecode:
        return None
    numbers = [int(part) for part in timecode.replace(";", ":").replace(".", ":").split(":")]
    if numbers[3] > 39:
        return None
    word = 0
    for number in numbers:
        word = word << 8 | number // 10 << 4 | number % 10
    return word | (0x40 if timecode[8] in ";." else 0)


def moved(timecode: str, frames: int, rate: Fraction) -> str:
    """Return the timecode `frames` later; "" if the rate has no such timecode.

    >>> moved("00:00:59;29", 1, Fraction(30000, 1001)), moved("23:59:59:23", 1, Fraction(24))
    ('00:01:00;02', '00:00:00:00')
    """
    before = frames_of(timecode, rate)
    if before is None:
        return ""
    base, separator, digits = nominal(rate), timecode[8], len(timecode) - 9
    drop = skipped_a_minute(rate) if separator != ":" else 0
    of_ten, of_one = 600 * base - 9 * drop, 60 * base - drop
    tens, count = divmod((before + frames) % day_of(rate, drop > 0), of_ten)
    if count >= 60 * base:  # the first minute of ten drops none
        count += drop * (1 + (count - 60 * base) // of_one)
    seconds, frame = divmod(tens * 600 * base + count, base)
    return (
        f"{seconds // 3600:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"
        f"{separator}{frame:0{digits}d}"
    )
