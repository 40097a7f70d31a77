"""The frames that the page shows: those whose colours stand for all others, and edited ones."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from palette4d.grade.clip_colours import ClipColours
from palette4d.plotting.rows import PlottedPalette

F64 = NDArray[np.float64]

#: So many frames show the clip, and with frames of edits at most so many.
SHOWN, MOST = 6, 7
#: Looked at are about so many frames.
TRIED = 64
#: A colour one 8-bit step brighter. A frame looks like another one that differs by less than this.
STEP = np.array([1 / 255] * 3 + [0])


def default_frames(palette: PlottedPalette, clip: ClipColours) -> list[float]:
    """Choose the frames to show: the clip's ends, frames that stand for the others, and edits.

    Frames whose colours others show, too, are left out. Frames of edits come on top: the frame of
    the largest change, unless half of it is shown, and those a tenth of the clip from all others.
    """
    first, last = palette.first, palette.last
    if last <= first:
        return [first]
    tried = np.unique(np.linspace(first, last, TRIED).round())
    # Without the clip's colours no frames count as alike: it may change where its palette does not.
    shown = _representing(clip, clip.frames or tried.tolist(), alike=bool(clip.frames))
    chosen = [first, *(float(t) for t in shown if first < t < last), last]
    change = palette.change(tried)
    if palette.change(np.array(chosen)).max() < change.max() / 2:
        chosen.append(float(tried[change.argmax()]))
    gap = max(1.0, (last - first) / 10)
    wanted = [float(min(max(round(t), first), last)) for t in palette.edited_times]
    while len(chosen) < MOST and (far := [t for t in wanted if _room(t, chosen) >= gap]):
        chosen.append(max(far, key=lambda t: _room(t, chosen)))
    return sorted(chosen)


def _representing(clip: ClipColours, times: Sequence[float], *, alike: bool) -> list[float]:
    """Leave out one frame after the other, so that all are near in colour to one of the others."""
    colours = [clip.colours_at(time) for time in times]
    own = [_mean_distance(rgbw, rgbw) for rgbw in colours]
    count = len(times)
    apart = np.zeros((count, count))
    for i in range(count):
        for k in range(i):
            across = 2 * _mean_distance(colours[i], colours[k])
            apart[i, k] = apart[k, i] = across - own[i] - own[k]
    step = np.mean([2 * _mean_distance(c, c + STEP) for c in colours]) - 2 * np.mean(own)
    least = step if alike else 0.0
    # A long gap counts like other colours; of frames of the same colours those far in time stay.
    when = np.asarray(times) / max(np.ptp(times), 1)
    gap = np.abs(when[:, None] - when)
    apart = apart + 1e-9 * gap
    apart_too_in_time = apart + apart.mean() * gap
    kept = list(range(count))

    def missed(gone: int, by: F64) -> F64:
        nearest: F64 = by[:, [k for k in kept if k != gone]].min(axis=1)
        return nearest

    while len(kept) > 2:
        gone = min(kept[1:-1], key=lambda k: missed(k, apart_too_in_time).sum())
        if len(kept) <= SHOWN and missed(gone, apart).max() > least:
            break
        kept.remove(gone)
    return [times[k] for k in kept]


def _mean_distance(before: F64, after: F64) -> float:
    """Return the mean distance of a pixel's colour in one picture to one in another."""
    shares = [rgbw[:, 3] / rgbw[:, 3].sum() for rgbw in (before, after)]
    apart = np.linalg.norm(before[:, None, :3] - after[None, :, :3], axis=2)
    return float(shares[0] @ apart @ shares[1])


def _room(time: float, chosen: Sequence[float]) -> float:
    return min(abs(time - other) for other in chosen)
