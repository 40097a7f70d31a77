"""Following a window: where the box of a pick is at the other frames of its clip.

Input: a clip, boxes that the user gave at some frames, and the frames of interest. Output: a few
keys. The box moves with what is in it: the place in a frame where a template correlates best. The
template is the box of a given frame while that still matches, so that the box does not drift; else
the box of the last frame where it was found. Its size is linear between given boxes. One pass reads
the frames; memory holds at most `follow.MOST_FRAMES` of them, reduced, with 8 bits a pixel.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.grade.follow import MOST_FRAMES, Progress, check_given
from palette4d.grade.keyframes import needed
from palette4d.grade.mattes import Display
from palette4d.grade.picks import Box, WindowKey, as_box
from palette4d.media.clip_base import Clip, FrameError

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I8 = NDArray[np.int8]

#: Pixels of a box's longer side, and of a picture's width, to which frames are reduced at most; of
#: a tall picture, the side of a square of as many pixels. More: the place is known better, in more
#: time and memory.
SIDE, WIDTH = 128, 960
#: How far the box may move from a frame to the next, as shares of its longer side and of the
#: picture's width; the larger one counts. More: faster things are followed, in more time.
FAST, FAST_IN_PICTURE = 0.5, 1 / 32
#: Correlation, -1..1, with a template that still matches. Higher: the box drifts more; lower: it is
#: placed worse where the thing changes.
MATCHES = 0.8
#: Where none matches, the box of the last frame may still be found: with this correlation, and so
#: that the last frame has it where it was, up to this share of its longer side. Of 100 pairs of
#: unlike pictures 8 pass, of 100 neighbouring frames 98 (docs/lab/picks.md).
LOST, BACK = 0.55, 1 / 16
#: Least share of a template that must be in the picture, by weight.
INSIDE = 0.5
#: Standard deviation, of 255, of what is noise: less than that in a box says little about its
#: place.
NOISE = 1.0
#: What a box that ends at the picture's edge gets beyond it, as a share of its side. More: the box
#: takes more of what comes in there.
BEYOND = 0.25
#: Decimal places of a box's edges, in pixels.
DIGITS = 1


@dataclass(frozen=True)
class _Template:
    """A part of a frame, (h, w), with its weights, and where the box begins in it (x, y)."""

    values: F32
    weights: F32
    offset: F64

    @classmethod
    def of(cls, picture: I8, corner: F64, size: F64) -> _Template | None:
        """Return the part of a box that is in the picture; None if that is too little."""
        height, width = picture.shape
        left, top = np.maximum(np.round(corner), 0).astype(int)
        right, bottom = np.minimum(np.round(corner + size), (width, height)).astype(int)
        if right - left < 4 or bottom - top < 4:
            return None
        # The middle of a box is the thing, its edges may be what is behind.
        hann = [np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in (bottom - top, right - left)]
        values = picture[top:bottom, left:right].astype(np.float32)
        return cls(values, np.outer(*hann).astype(np.float32), corner - (left, top))

    def found(self, picture: I8, corner: F64, reach: int) -> tuple[float, F64]:
        """Return the best correlation near a place of the box, and the box's corner there."""
        from scipy import fft

        height, width = self.values.shape
        left, top = np.round(corner - self.offset).astype(int) - reach
        shape = height + 2 * reach, width + 2 * reach
        inside = np.zeros(shape, np.float32)
        values = np.zeros(shape, np.float32)
        rows = slice(max(0, -top), min(shape[0], picture.shape[0] - top))
        columns = slice(max(0, -left), min(shape[1], picture.shape[1] - left))
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return -1.0, corner
        inside[rows, columns] = 1
        values[rows, columns] = picture[
            max(0, top) : rows.stop + top, max(0, left) : columns.stop + left
        ]
        own = self.values
        full = [fft.next_fast_len(n, real=True) for n in shape]
        there = [fft.rfft2(part, full) for part in (inside, values, values**2)]
        weighted = (self.weights, self.weights * own, self.weights * own**2)
        here = [fft.rfft2(part, full).conj() for part in weighted]

        def correlation(mine: int, its: int) -> F32:
            return fft.irfft2(here[mine] * there[its], full)[: 2 * reach + 1, : 2 * reach + 1]

        weight = np.maximum(correlation(0, 0), 1e-3)
        mean, square = correlation(0, 1) / weight, correlation(0, 2) / weight
        own_mean, own_square = correlation(1, 0) / weight, correlation(2, 0) / weight
        both = correlation(1, 1) / weight - mean * own_mean
        spread = np.maximum(square - mean**2, 0) + NOISE**2
        score = both / np.sqrt(spread * (np.maximum(own_square - own_mean**2, 0) + NOISE**2))
        score = np.where(weight >= INSIDE * self.weights.sum(), score, -1)
        row, column = np.unravel_index(int(score.argmax()), score.shape)
        place = np.array(
            [
                column + _peak(score[row], int(column)),
                row + _peak(score[:, column], int(row)),
            ]
        )
        return float(score[row, column]), place + np.array((left, top)) + self.offset


def _peak(scores: NDArray[np.floating], index: int) -> float:
    """Return how far the peak of a parabola through three scores is from the middle one."""
    if not 0 < index < len(scores) - 1:
        return 0.0
    before, at, after = (float(score) for score in scores[index - 1 : index + 2])
    bend = before - 2 * at + after
    return (before - after) / (2 * bend) if bend < 0 and min(before, after) > -1 else 0.0


def boxes(
    clip: Clip,
    given: Mapping[int, Box],
    span: tuple[float, float],
    *,
    conversion: _core.ColourConversion | None = None,
    display: Display | None = None,
    progress: Progress | None = None,
) -> tuple[WindowKey, ...]:
    """Follow a box through a clip, from one or more frames where it is known.

    Parameters
    ----------
    given : mapping of int to 4 floats
        Frames where the box is known, and its left, top, right and bottom there, in pixels.
        Between two of them the box goes gradually from what follows the one to what follows the
        other.
    span : (float, float)
        First and last frame of interest.
    conversion, display
        From the clip's code values to the palette's, and from these to those of a display.

    Returns
    -------
    tuple of WindowKey
        Keys in order of time; linear between them. The first and the last are at the ends of the
        span, or where the box is lost: from there on it stays (`Pick.lost`).
    """
    known = dict(sorted(given.items()))
    check_given(known, "boxes")
    low, high = min(span[0], *known), max(span[1], *known)
    inside = [frame for frame in clip.frames if low <= frame <= high]
    every = -(-len(inside) // MOST_FRAMES)
    frames = sorted({*inside[::every], inside[-1], *known})
    longest = max(float(np.ptp(part)) for box in known.values() for part in _inside(clip, box))
    broad = max(clip.width, math.sqrt(clip.width * clip.height))
    scale = max(1, math.ceil(longest / SIDE), math.ceil(broad / WIDTH))
    scale = min(scale, clip.width, clip.height)
    side = math.ceil(longest / scale)
    greys = _read(clip, frames, (scale, side), (conversion, display), progress)
    starts = [frames.index(frame) for frame in known]
    sides = np.array([known[frame] for frame in known], float)
    corners, sizes = sides[:, :2] / scale, (sides[:, 2:] - sides[:, :2]) / scale
    middles = _middles(greys, starts, corners, sizes) * scale
    seen = np.flatnonzero(~np.isnan(middles[:, 0]))
    # The frame beside the last one where the box is seen says that it is lost there.
    first, last = max(0, int(seen[0]) - 1), min(len(frames) - 1, int(seen[-1]) + 1)
    part = np.arange(first, last + 1)
    places = [np.interp(part, seen, middles[seen, i]) for i in (0, 1)]
    half = [np.interp(part, starts, sizes[:, i] * scale / 2) for i in (0, 1)]
    path = np.array([p + sign * h for sign in (-1, 1) for p, h in zip(places, half, strict=True)]).T
    path += _beyond(clip, np.stack([np.interp(part, starts, side) for side in sides.T], axis=1))
    path = np.round(path, DIGITS)
    path[np.array(starts) - first] = sides
    times = frames[first : last + 1]
    kept = needed(times, path, [start - first for start in starts], scale / 2)
    return tuple(WindowKey(times[i], as_box(path[i].tolist()), times[i] in known) for i in kept)


def _beyond(clip: Clip, boxes: F64) -> F64:
    """Return what boxes, (n, 4), get beyond the edges of the picture that they end at.

    What is in such a box goes on there, and comes into the picture.
    """
    left, top, right, bottom = boxes.T
    wide, high = BEYOND * (right - left), BEYOND * (bottom - top)
    ends = np.abs(boxes - (0, 0, clip.width, clip.height)) < 1
    return np.where(ends, np.stack([-wide, -high, wide, high], axis=1), 0)


def _inside(clip: Clip, box: Box) -> tuple[F64, F64]:
    """Return the horizontal and the vertical edges of a box, within the picture."""
    left, top, right, bottom = box
    return np.clip((left, right), 0, clip.width), np.clip((top, bottom), 0, clip.height)


def _read(
    clip: Clip,
    frames: Sequence[int],
    reduced: tuple[int, int],
    conversions: tuple[_core.ColourConversion | None, Display | None],
    progress: Progress | None,
) -> list[I8 | None]:
    """Return the reduced frames: the mean of their display code values, less that around them.

    `reduced` are how many pixels of a row and of a column become one, and the side of the square
    around each of these whose mean is taken away, as smooth shades are alike in all pictures: that
    of the box. None for a frame that cannot be read.
    """
    from scipy import ndimage

    greys: list[I8 | None] = []
    (scale, side), (conversion, display) = reduced, conversions
    for done, frame in enumerate(frames, start=1):
        try:
            rgb = clip.straight_colours(clip.read(frame))
        except FrameError:
            greys.append(None)
        else:
            height, width = (n // scale for n in rgb.shape[:2])
            whole = np.ascontiguousarray(rgb[: height * scale, : width * scale])
            rows = whole.reshape(height, scale, width * scale * 3).mean(axis=1)
            small = rows.reshape(height, width, scale, 3).mean(axis=2)
            small = np.nan_to_num(small, nan=0, posinf=1, neginf=0)
            if conversion is not None:
                small = conversion.to_palette(small)
            if display is not None:
                start, end, values = display
                small = np.interp(small, np.linspace(start, end, len(values)), values)
            grey = 255 * small.mean(axis=2).clip(0, 1)
            detail = grey - ndimage.uniform_filter(grey, side or 1)
            greys.append(np.round(detail).clip(-128, 127).astype(np.int8))
        if progress:
            progress(done, len(frames))
    return greys


def _middles(greys: Sequence[I8 | None], starts: Sequence[int], corners: F64, sizes: F64) -> F64:
    """Return the middle of the box in each frame, (n, 2); NaN where it is lost at either end."""
    result = np.full((len(greys), 2), np.nan)
    own = corners + sizes / 2
    first, last = starts[0], starts[-1]
    result[: first + 1] = (_followed(greys[first::-1], corners[0], sizes[0]) + sizes[0] / 2)[::-1]
    result[last:] = _followed(greys[last:], corners[-1], sizes[-1]) + sizes[-1] / 2
    for k, (a, b) in enumerate(itertools.pairwise(starts)):
        forward = _followed(greys[a : b + 1], corners[k], sizes[k]) + sizes[k] / 2
        backward = _followed(greys[a : b + 1][::-1], corners[k + 1], sizes[k + 1])[::-1]
        backward += sizes[k + 1] / 2
        forward[-1], backward[0] = own[k + 1], own[k]
        part = np.linspace(0, 1, b - a + 1)[:, None]
        result[a : b + 1] = (1 - part) * _filled(forward) + part * _filled(backward)
    return result


def _filled(path: F64) -> F64:
    """Return a path whose gaps are straight lines."""
    every, seen = np.arange(len(path)), np.flatnonzero(~np.isnan(path[:, 0]))
    return np.stack([np.interp(every, seen, column[seen]) for column in path.T], axis=1)


def _followed(greys: Sequence[I8 | None], corner: F64, size: F64) -> F64:
    """Return the box's corner in each frame, (n, 2), from the first one; NaN where it is lost."""
    path = np.full((len(greys), 2), np.nan)
    path[0] = corner
    if greys[0] is None or (home := _Template.of(greys[0], corner, size)) is None:
        return path
    latest, before, width = home, greys[0], greys[0].shape[1]
    reach = math.ceil(max(FAST * max(home.values.shape), FAST_IN_PICTURE * width))
    lost = False
    for i, grey in enumerate(greys[1:], start=1):
        if grey is None:
            continue
        score, place = home.found(grey, corner, reach)
        if score < MATCHES and latest is not home:
            score, place = latest.found(grey, corner, reach)
        if score < MATCHES and not lost:
            newer = _Template.of(before, corner, size)
            if newer is not None:
                latest = newer
                score, place = latest.found(grey, corner, reach)
                if score < MATCHES and not _returns(grey, before, (place, corner), size, reach):
                    score = -1.0
        # After a gap only what looks the same is the thing again.
        lost = score < (MATCHES if lost else LOST)
        if not lost:
            path[i] = corner = place
            before = grey
    return path


def _returns(grey: I8, before: I8, places: tuple[F64, F64], size: F64, reach: int) -> bool:
    """Return whether the box at a place is found again in the frame before, where it was there."""
    there = _Template.of(grey, places[0], size)
    if there is None:
        return False
    _, back = there.found(before, places[0], reach)
    return bool(np.linalg.norm(back - places[1]) <= BACK * size.max())
