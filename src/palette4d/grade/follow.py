"""Following: where a picked colour is at the other frames of its clip.

Input: a clip, a colour at a frame, and the frames of interest. Output: a path of a few keys. From
each frame to the next the colour moves with the weighted mean of its neighbours (mean shift, with a
Gaussian of `ALIKE`). The path ends where the number of neighbours shows that they are another
object's. One pass reads the frames; memory holds at most `MOST_COLOURS` colours for at most
`MOST_FRAMES` frames.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade.edits import DIGITS, VISIBLE, Colour, as_colour
from palette4d.grade.keyframes import needed
from palette4d.grade.picks import ALIKE, PathKey
from palette4d.media.clip_base import Clip, FrameError

F64 = NDArray[np.float64]
Progress = Callable[[int, int], object]
"""Called as progress(done, total)."""

#: Most rounds of the mean shift from one frame to the next; a step below `DIGITS` ends them. With
#: 100, 15 of 140 paths slide to another colour (docs/lab/picks.md).
ROUNDS = 8
#: Weight of the path's curvature, in frames^4: jitter shorter than 2 pi STIFF^(1/4) = 12 frames is
#: smoothed, else the grade would flicker. Larger: the path is late where a light changes.
STIFF = 12.0
#: Share of the way back to its first colour that a path goes in each frame, while that has as many
#: neighbours as at first. Without it, 34 of 140 paths drift by more than 0.05.
HOME = 0.5
#: Largest ratios of the number of neighbours to that at the start: beyond OTHER they are another
#: object's; beyond SAME, where the colour has moved by FAR or more (code values). At SAME, HOME has
#: faded to 0. From 7 to 20, OTHER changes five of 140 paths.
OTHER, SAME, FAR = 12.0, 2.0, 0.5
#: Least share of a frame's pixels that are neighbours. Below, the colour is out of sight and stays
#: where it was: the mean of so few pixels is another object's.
LEAST_SHARE = 1e-5

#: In a longer range every n-th frame is read.
MOST_FRAMES = 600
#: Colours kept for each frame.
MOST_COLOURS = 2048
#: Tolerance of `there` at 0 and 1: smoothing overshoots the ends of a fade by less.
OVERSHOOT = 0.05


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
    starts : list of (int, 3 floats)
        Frames where the colour is known, and the colour, in the palette's code values. Between two
        of them the path goes gradually from what follows the one to what follows the other.
    span : (float, float)
        First and last frame of interest.
    conversion : ColourConversion, optional
        From the clip's code values to the palette's.

    Returns
    -------
    tuple of PathKey
        Keys in order of time; linear between them. The first and the last are at the ends of the
        span; keys at `starts` are marked as given. `there` falls to 0 where the path ends.
    """
    known = dict(sorted(starts))
    check_given(known, "colours")
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
    path = _smoothed(joined, [frames.index(frame) for frame in known])
    path[:, 3] = np.clip((path[:, 3] - OVERSHOOT) / (1 - 2 * OVERSHOOT), 0.0, 1.0)
    kept = needed(frames, path, map(frames.index, known), VISIBLE)
    path = np.round(path, DIGITS)
    return tuple(
        PathKey(frames[i], as_colour(path[i, :3]), frames[i] in known, float(path[i, 3]))
        for i in kept
    )


def check_given(known: Mapping[int, object], what: str) -> None:
    """Refuse more places where something is known than frames are read between them."""
    if len(known) > MOST_FRAMES:
        raise Palette4dError(
            f"found {len(known)} frames where {what} of the pick are given, expected at most "
            f"{MOST_FRAMES}; pick it again"
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
    starts = {frames.index(frame): np.array(rgb) for frame, rgb in known.items()}
    first, *_, last = [*sorted(starts)] * 2
    path = np.empty((len(frames), 4))
    path[: first + 1] = _followed(colours[: first + 1][::-1], starts[first])[::-1]
    path[last:] = _followed(colours[last:], starts[last])
    for a, b in itertools.pairwise(sorted(starts)):
        forward = _followed(colours[a : b + 1], starts[a])
        backward = _followed(colours[a : b + 1][::-1], starts[b])[::-1]
        part = np.linspace(0, 1, b - a + 1)[:, None]
        path[a : b + 1] = (1 - part) * forward + part * backward
    return path


def _followed(colours: Sequence[tuple[F64, F64]], start: F64) -> F64:
    """Return the (n, 4) path from a colour in the first frame to the last frame.

    The fourth column is 1 while the colour is there, and 0 where its neighbours are another
    object's. From there on the path has ended, unless it returns to its start.
    """
    first = _near(start, *colours[0])
    path, seen, alive = [start], [1.0], True
    for before, after in itertools.pairwise(colours):
        colour = _shifted(path[-1], before, after)
        now = _near(start, *after)
        if first is not None and now is not None:
            # Without this, small errors would add up in a still picture.
            ratio = min(now[1] / first[1], first[1] / now[1])
            returned = start + now[0] - first[0]
            colour = colour + HOME * max(0.0, 1 - (1 - ratio) * SAME) * (returned - colour)
        path.append(colour)
        near = _near(colour, *after)
        moved = float(np.linalg.norm(colour - start))
        # A colour that has moved far with another number of neighbours has slid to another object.
        far = min(1.0, moved / FAR)
        allowed = OTHER ** (1 - far) * SAME**far
        ratio = 1.0 if first is None or near is None else near[1] / first[1]
        other = not 1 / allowed <= ratio <= allowed
        alive = not other and (moved < ALIKE or alive)
        seen.append(float(alive))
    return np.column_stack([path, seen])


def _without_drift(path: F64, start: F64) -> F64:
    """Return (n, 3) colours of a path that stays at its start while it is within `ALIKE` of it.

    The mean of one object's pixels moves as far in a still light, as others pass by. Beyond twice
    that distance the path is unchanged.
    """
    away = path - start
    length = np.linalg.norm(away, axis=1, keepdims=True)
    part = np.clip(length / ALIKE - 1, 0.0, 1.0)
    kept: F64 = start + away * part * part * (3 - 2 * part)
    return kept


def _smoothed(path: F64, fixed: Sequence[int]) -> F64:
    """Return the path without its jitter (Whittaker's smoothing); fixed places stay."""
    bend = np.diff(np.eye(len(path)), 2, axis=0)
    system = np.eye(len(path)) + STIFF * bend.T @ bend
    held = np.array(fixed, np.int64)
    free = np.delete(np.arange(len(path)), held)
    pull = system[np.ix_(free, held)] @ path[held]
    smooth = path.copy()
    smooth[free] = np.linalg.solve(system[np.ix_(free, free)], path[free] - pull)
    return smooth


def _shifted(colour: F64, before: tuple[F64, F64], after: tuple[F64, F64]) -> F64:
    """Return where a colour is in the next frame (mean shift), at most `ALIKE` away."""
    near = _near(colour, *before)
    if near is None:
        return colour
    offset, new = near[0] - colour, colour
    for _ in range(ROUNDS):
        near = _near(new, *after)
        if near is None:
            return colour
        step = near[0] - offset - new
        new = new + step
        if np.abs(step).max() < 10.0**-DIGITS:
            break
    length = float(np.linalg.norm(new - colour))
    moved: F64 = colour + (new - colour) * min(1.0, ALIKE / max(length, ALIKE))
    return moved


def _near(colour: F64, rgb: F64, counts: F64) -> tuple[F64, float] | None:
    """Return the mean of a colour's neighbours in a frame, and their share; None if too few."""
    weight = counts * np.exp(((rgb - colour) ** 2).sum(axis=1) / (-2 * ALIKE**2))
    total, share = float(weight.sum()), float(weight.sum() / counts.sum())
    return (weight @ rgb / total, share) if share >= LEAST_SHARE else None
