"""Following: where a picked colour is at the other frames of its clip.

Input: a clip, a colour at a frame, and the frames of interest. Output: a path of a few keys. From
each frame to the next the colour moves as the mean of the pixels near it moves (mean shift). The
path ends where the colour is lost among others: where many more pixels are near it. One pass reads
the frames; memory holds at most `MOST_COLOURS` colours for at most `MOST_FRAMES` frames.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade.edits import Colour, as_colour
from palette4d.grade.keyframes import needed
from palette4d.grade.picks import ALIKE, PathKey
from palette4d.media.clip_base import Clip, FrameError

F64 = NDArray[np.float64]
Progress = Callable[[int, int], object]
"""Called as progress(done, total)."""

#: Rounds of the mean shift from one frame to the next, and the step at which it has arrived.
ROUNDS, ARRIVED = 8, 1e-4
#: A colour moves at most so far from one frame to the next; what jumps is another object.
MOST_STEP = 0.08
#: Weight of the path's bends: what is shorter than some 2 pi STIFF^(1/4) frames is jitter, which
#: would be flicker of the grade. And the weight of colours that the user gave.
STIFF, PINNED = 12.0, 1e6
#: How strongly the path is drawn to the picked colour, per frame. The pull fades as the count of
#: pixels near that colour departs from the first count; at half or twice that count it is 0.
HOME, SAME = 0.5, 2
#: Where more than LOST times as many pixels as at first are near, the colour is another thing's, as
#: in the night, where all is dark. From there on it has ended, unless it comes back to its start.
LOST = 7.0
#: A colour this far from its start is another one: there it must have as many pixels, by SAME.
FAR = 0.5
#: Where fewer than one in GONE of the pixels at first is near, its object is not in the picture:
#: what is left is others, and the change would be theirs.
GONE = 20.0
#: Fewer near pixels than this share of a frame: the colour is out of sight and stays.
LEAST_SHARE = 1e-5

#: In a longer range every n-th frame is read.
MOST_FRAMES = 600
#: Colours kept for each frame.
MOST_COLOURS = 2048

#: Keys that a straight line between their neighbours meets within this are left out.
STRAIGHT = 0.012
#: At most so many keys; a path with more is told less exactly.
MOST_KEYS = 48
DIGITS = 4
#: A smoothed path has ended, or is all there, within this share.
BARELY = 0.05


def paths(
    clip: Clip,
    starts: Sequence[tuple[int, Colour]],
    span: tuple[float, float],
    *,
    conversion: _core.ColourConversion | None = None,
    progress: Progress | None = None,
) -> tuple[PathKey, ...]:
    """Follow one colour through a clip, from one or more frames where it is known.

    Parameters
    ----------
    clip : Clip
        The clip; its frames are read once, in order.
    starts : list of (int, 3 floats)
        Frames where the colour is known, and the colour, in the palette's code values. Between two
        of them the path goes gradually from what follows the one to what follows the other.
    span : (float, float)
        First and last frame of interest.
    conversion : ColourConversion, optional
        From the clip's code values to the palette's.
    progress : callable, optional
        Called as progress(done, total) for each frame.

    Returns
    -------
    tuple of PathKey
        Keys in order of time; linear between them. The first and the last are at the ends of the
        span; keys at `starts` are marked as given. `there` falls to 0 where the path ends.

    Raises
    ------
    Palette4dError
        A start is no frame of the clip, or a frame cannot be read.
    """
    known = dict(sorted(starts))
    for frame in known:
        if frame not in clip.frames:
            raise Palette4dError(
                f"{clip.source} has no frame {frame}; expected one from {clip.frames[0]} to "
                f"{clip.frames[-1]}"
            )
    low, high = min(span[0], *known), max(span[1], *known)
    inside = [frame for frame in clip.frames if low <= frame <= high]
    every = -(-len(inside) // MOST_FRAMES)
    chosen = sorted({*inside[::every], inside[-1], *known})
    frames, colours = read_colours(clip, chosen, conversion, progress)
    for frame in known:
        if frame not in frames:
            raise Palette4dError(
                f"frame {frame} of {clip.source} has no pixel that can be followed"
            )
    joined = _joined(frames, colours, known)
    if len(known) == 1:
        joined[:, :3] = _without_drift(joined[:, :3], np.array(starts[0][1]))
    found = _smoothed(joined, [frames.index(frame) for frame in known])
    found[:, 3] = np.clip((found[:, 3] - BARELY) / (1 - 2 * BARELY), 0.0, 1.0)
    kept = needed(frames, found, map(frames.index, known), STRAIGHT, MOST_KEYS)
    return tuple(
        PathKey(
            frames[i],
            as_colour(np.round(found[i, :3], DIGITS)),
            frames[i] in known,
            float(np.round(found[i, 3], DIGITS)),
        )
        for i in kept
    )


def read_colours(
    clip: Clip,
    chosen: Sequence[int],
    conversion: _core.ColourConversion | None,
    progress: Progress | None = None,
) -> tuple[list[int], list[tuple[F64, F64]]]:
    """Return the frames with pixels, and the weighted colours of each."""
    frames, colours = [], []
    binner = _core.ColourBinner()
    for done, (frame, fill) in enumerate(clip.fills(chosen), start=1):
        try:
            fill(binner)
            taken = binner.take(MOST_COLOURS, MOST_COLOURS)
        except FrameError:
            taken = None
        finally:
            binner.clear()
        if taken is not None:
            rgb, counts = taken[0].rgb, taken[0].counts
            frames.append(frame)
            colours.append((rgb if conversion is None else conversion.to_palette(rgb), counts))
        if progress:
            progress(done, len(chosen))
    return frames, colours


def _joined(
    frames: Sequence[int], colours: Sequence[tuple[F64, F64]], known: dict[int, Colour]
) -> F64:
    """Return the (n, 4) path through all known colours, and whether the colour is there."""
    at = {frames.index(frame): np.array(rgb) for frame, rgb in known.items()}
    order = sorted(at)
    found = np.empty((len(frames), 4))
    found[: order[0] + 1] = _followed(colours[: order[0] + 1][::-1], at[order[0]])[::-1]
    found[order[-1] :] = _followed(colours[order[-1] :], at[order[-1]])
    for a, b in itertools.pairwise(order):
        forward = _followed(colours[a : b + 1], at[a])
        backward = _followed(colours[a : b + 1][::-1], at[b])[::-1]
        part = np.linspace(0, 1, b - a + 1)[:, None]
        found[a : b + 1] = (1 - part) * forward + part * backward
    return found


def _followed(colours: Sequence[tuple[F64, F64]], start: F64) -> F64:
    """Return the (n, 4) path from a colour in the first frame to the last one.

    The fourth column is 1 while the colour is there, and 0 from where it is lost, and where hardly
    any pixel has it.
    """
    home, pixels = _near(start, *colours[0]), _alike(start, *colours[0])
    path, seen, alive = [start], [1.0], True
    for before, after in itertools.pairwise(colours):
        there = _shifted(path[-1], before, after)
        now = _near(start, *after)
        if home is not None and now is not None:
            # While as many pixels as at first are near the start, the colour is still there:
            # without this, small errors would add up in a still picture.
            same = min(now[1] / home[1], home[1] / now[1])
            still = start + now[0] - home[0]
            there = there + HOME * max(0.0, 1 - (1 - same) * SAME) * (still - there)
        path.append(there)
        found = _near(there, *after)
        # The farther it has gone, the more it must be as large as at first: else it has slid over
        # to another thing.
        far = min(1.0, float(np.linalg.norm(there - start)) / FAR)
        most, least = LOST ** (1 - far) * SAME**far, far / SAME
        size = 1.0 if home is None or found is None else found[1] / home[1]
        lost = size > most or size < least
        back = float(np.linalg.norm(there - start)) < ALIKE
        alive = not lost and (back or alive)
        seen.append(float(alive and GONE * _alike(there, *after) >= pixels))
    return np.column_stack([path, seen])


def _without_drift(path: F64, start: F64) -> F64:
    """Return (n, 3) colours of a path that stays at its start while it is as near as `ALIKE`.

    So far the mean of one thing's pixels moves in a still light, as others pass by. From twice as
    far on the path is as it was found.
    """
    away = path - start
    length = np.linalg.norm(away, axis=1, keepdims=True)
    part = np.clip(length / ALIKE - 1, 0.0, 1.0)
    kept: F64 = start + away * part * part * (3 - 2 * part)
    return kept


def _alike(colour: F64, rgb: F64, counts: F64) -> float:
    """Return the share of a frame's pixels that have a colour or one like it."""
    return float(counts[((rgb - colour) ** 2).sum(axis=1) < ALIKE**2].sum() / counts.sum())


def _smoothed(path: F64, fixed: Sequence[int]) -> F64:
    """Return the path without its jitter (Whittaker's smoothing); fixed places stay."""
    weight = np.ones(len(path))
    weight[list(fixed)] = PINNED
    bend = np.diff(np.eye(len(path)), 2, axis=0)
    smooth = np.linalg.solve(np.diag(weight) + STIFF * bend.T @ bend, weight[:, None] * path)
    smooth[list(fixed)] = path[list(fixed)]
    return np.asarray(smooth, np.float64)


def _shifted(here: F64, before: tuple[F64, F64], after: tuple[F64, F64]) -> F64:
    """Return where a colour of one frame is in the next one (mean shift)."""
    found = _near(here, *before)
    if found is None:
        return here
    offset, there = found[0] - here, here
    for _ in range(ROUNDS):
        found = _near(there, *after)
        if found is None:
            return here
        step = found[0] - offset - there
        there = there + step
        if np.abs(step).max() < ARRIVED:
            break
    length = float(np.linalg.norm(there - here))
    moved: F64 = here + (there - here) * min(1.0, MOST_STEP / max(length, MOST_STEP))
    return moved


def _near(colour: F64, rgb: F64, counts: F64) -> tuple[F64, float] | None:
    """Return the mean of a frame's pixels near a colour, and their share; None for hardly any."""
    weight = counts * np.exp(((rgb - colour) ** 2).sum(axis=1) / (-2 * ALIKE**2))
    total, share = float(weight.sum()), float(weight.sum() / counts.sum())
    return (weight @ rgb / total, share) if share >= LEAST_SHARE else None
