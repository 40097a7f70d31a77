"""Detection of sudden cuts from the colours of frames: a palette must not span one (section 7.1).

Input: the histograms of frames (`colour_histogram`). Output: the numbers of the first frames of new
shots.

The difference of two frames is one minus the intersection of their histograms: the share of pixels
whose colour has no counterpart in the other frame. A small shift of all colours (exposure, fading,
grain) is a small difference. A frame begins a new shot if its difference from the frame before
meets all of these conditions:

- It is at least `LEAST_DIFFERENCE`; a title or a banner changes less.
- The code values change by `LEAST_SHIFT` on average in some channel: near black one step of 8 bits
  moves every pixel to another cell of the histogram.
- It is `LEAST_RATIO` times the differences around it: the second largest of the `AROUND` before or
  after. The factor is doubled near the ends of the clip, where less than half of them are there on
  a side. A pan, a fade, a time lapse or flicker change all the time.
- No frames around it agree over a gap of one or two frames, as they do around a flash.

A dissolve is not a cut: a palette follows it in time. A cut between pictures of equal colours is
not detected and does no harm. Two frames alone show no cut, because the speed of the clip is
unknown. A lasting change of lighting, such as a lamp switched on, counts as a cut.
docs/lab/clips.md has the measurements behind the limits.
"""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from palette4d.common.message import ANALYZE_SHOTS, Arg, Message
from palette4d.common.text import counted, some_of
from palette4d.media.colour_histogram import mean_shift

F64 = NDArray[np.float64]

# Least share of pixels that change at a cut, and as a multiple of the changes around it.
LEAST_DIFFERENCE = 0.15
LEAST_RATIO = 3.0
LEAST_SHIFT = 0.01  # one step of 8 bits from black measures 0.009, others less
# Around a flash the frames agree again: they differ by at most this share of the jump.
AGREEMENT = 0.5
# Frames of the longest flash, and the number of changes before and after that are compared.
LONGEST_FLASH = 2
AROUND = 5


def find_cuts(histograms: Iterable[tuple[int, F64]]) -> list[int]:
    """Return the numbers of the frames that begin a new shot, rising; none for a single shot.

    The input is (frame number, histogram) pairs in order of time; memory holds few of them.
    """
    numbers, gaps, moved = _gaps(histograms)
    return [numbers[i] for i in range(1, len(numbers)) if moved[i - 1] and _is_cut(gaps, i)]


def _gaps(
    histograms: Iterable[tuple[int, F64]],
) -> tuple[list[int], dict[int, list[float]], list[bool]]:
    """Return the numbers of the frames, `gaps[d][i]`, how frame i + d differs from frame i, and
    `moved[i]`, whether code values differ by `LEAST_SHIFT` between frames i and i + 1."""
    numbers: list[int] = []
    moved: list[bool] = []
    gaps: dict[int, list[float]] = {d: [] for d in range(1, LONGEST_FLASH + 2)}
    recent: deque[F64] = deque(maxlen=LONGEST_FLASH + 1)
    for number, here in histograms:
        for d, before in enumerate(reversed(recent), start=1):
            gaps[d].append(difference(before, here))
        if recent:
            moved.append(mean_shift(recent[-1], here) >= LEAST_SHIFT)
        recent.append(here)
        numbers.append(number)
    return numbers, gaps, moved


def _is_cut(gaps: dict[int, list[float]], first: int) -> bool:
    """Return whether a shot begins with frame `first`, an index from 1."""
    jumps = gaps[1]
    jump = jumps[first - 1]
    around = _activity(jumps, first - 1, first)
    if jump < LEAST_DIFFERENCE or jump < LEAST_RATIO * around:
        return False
    for length in range(1, LONGEST_FLASH + 1):
        # The flash lies between `start` and `start + length + 1`; the jump is one of its edges.
        for start in range(first - 1 - length, first):
            if 0 <= start < len(gaps[length + 1]) and (gaps[length + 1][start] <= AGREEMENT * jump):
                return False
    return True


def _activity(jumps: list[float], start: int, end: int) -> float:
    """Return how much the frames change around some jumps; infinite if there are no others."""
    before, after = jumps[max(0, start - AROUND) : start], jumps[end : end + AROUND]
    if not before and not after:
        return np.inf
    activity = max(_usual(side) for side in (before, after) if side)
    return activity if 2 * min(len(before), len(after)) > AROUND else 2 * activity


def _usual(jumps: list[float]) -> float:
    """Return the second largest of several jumps.

    The largest may be another cut. With repeated frames (pulldown, animation on twos) only two of
    five jumps show the speed of the clip.
    """
    ordered = sorted(jumps)
    return ordered[-2] if len(ordered) > 2 else ordered[-1]


def difference(before: F64, after: F64) -> float:
    """Return the share of pixels, 0 to 1, without a counterpart in the other histogram."""
    return float(1 - np.minimum(before, after).sum())


def refusal(frames: Sequence[int], cuts: Sequence[int]) -> Message:
    """Return the message that the clip has `cuts`, with the frame ranges to analyse."""
    shots = [f"{Arg('frames', shot)}" for shot in _shots(frames, cuts)]
    return Message(
        f"found {counted(len(cuts), 'sudden cut')}: a new shot begins at {_places(cuts)}; expected "
        "one shot, since a palette must not span a cut. Analyse each shot by itself "
        f"({some_of(shots)}; {ANALYZE_SHOTS} does all of them), or give "
        f"{Arg('allow_cuts', True)} to analyse all frames as one shot.{_flash(frames, cuts)}"
    )


def _flash(frames: Sequence[int], cuts: Sequence[int]) -> str:
    """Return the advice for a flash at the end of the clip."""
    step = frames[1] - frames[0]
    bounds = [frames[0], *cuts, frames[-1] + step]
    lasting = [
        shot
        for shot, (first, end) in zip(_shots(frames, cuts), itertools.pairwise(bounds), strict=True)
        if end - first > LONGEST_FLASH * step
    ]
    if len(lasting) != 1:
        return ""
    only = Arg("frames", lasting[0])
    return f" If it is a flash at the end of the clip, leave it out: {only}."


def refusal_inside(cuts: Sequence[int]) -> str:
    """Return the message that one clip of an edit has `cuts`."""
    return (
        f"found {counted(len(cuts), 'sudden cut')} inside one clip of the edit: a new shot begins "
        f"at {_places(cuts)}; expected one shot. Blade the edit there, or give "
        f"{Arg('allow_cuts', True)}"
    )


def note(cuts: Sequence[int]) -> str:
    """Return the note that the palette spans `cuts` that the user allowed."""
    what = counted(len(cuts), "sudden cut", "sudden cuts")
    return f"the palette spans {what}, at {_places(cuts)}: expect a loose fit beside them"


def _places(cuts: Sequence[int]) -> str:
    return f"frame{'s' * (len(cuts) != 1)} {some_of(cuts)}"


def _shots(frames: Sequence[int], cuts: Sequence[int]) -> list[str]:
    """Return the frame range of each shot in the form of `parse_frames`."""
    step = frames[1] - frames[0]
    bounds = [frames[0], *cuts, frames[-1] + step]
    out = []
    for first, end in itertools.pairwise(bounds):
        last = end - step
        by = f"x{step}" if step != 1 and first != last else ""
        out.append(f"{first}-{last}{by}" if first != last else f"{first}")
    return out
