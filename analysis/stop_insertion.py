"""After removal: stops for what single frames lack, such as a light that shines for a moment.

Input: a refined polytope and the clip's frames. Output: the polytope with such stops.
Merging takes a block's palettes on from frame to frame, and removal looks at the mean: neither sees
a colour that is there for a few frames only, however far it lies outside. So two kinds of frames
are looked at: those that fit much worse than the usual one, and those of whose pixels some are lost
(`LOST`). The colours that one leaves outside get a stop on a track near to them, with or without
one before and after, which keep the rest of the track where it is. Such stops need not be worth
`handle_cost`, which is a matter of the mean; they stay if they make good most of what the frame
lacks and nothing else suffers for it. That they come and go at once is not held against them: eq.
11 would rather lose a light than let a colour jump.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import LOST, LOST_SHARE, colour_scale, reach_weights, thread_count
from palette4d.analysis.objective import LEAST_GAP, Objective, loss_of, move
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Section, SkewPolytope
from palette4d.analysis.statistics import FrameStatistics
from scipy.spatial import ConvexHull, QhullError

F64 = NDArray[np.float64]

MOST_FRAMES = 6
BAD = 3.0  # times the median frame's loss: a frame to be looked at
MENDED = 0.5  # of what is lacking must go
NEAREST = 3  # tracks tried
EVALUATIONS = 30


@dataclasses.dataclass(frozen=True, eq=False)
class Inserted:
    """The polytope with stops, and which of its vertices are there for a moment (`brief` of
    `Objective`)."""

    polytope: SkewPolytope
    brief: tuple[int, ...]


def insert_stops(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
) -> Inserted:
    """Return the polytope with stops for its worst frames.

    `statistics` are all of the clip's frames. With `options.vertices` there are never more than so
    many.
    """
    scale = colour_scale(low, high)
    now = Inserted(polytope, ())
    hopeless: set[int] = set()
    for _ in range(MOST_FRAMES):
        lacks = _lacks(now.polytope, statistics, options, scale)
        worst = lacks.worst(hopeless)
        if worst is None:
            break
        enough = lacks.enough(worst)
        best: tuple[float, Inserted] | None = None
        for trial, added in _trials(now.polytope, statistics, lacks.loss, worst, scale):
            if options.vertices and len(trial.vertices) > options.vertices:
                continue
            moved, change = _settled(now, trial, added, statistics, low, high, options)
            price = change + options.handle_cost * len(added)
            if change > 0 or (best and price >= best[0]):
                continue
            rest = _lacks(moved, [statistics[worst]], options, scale)
            if enough(rest):
                best = price, Inserted(moved, (*now.brief, added[0]))
        if best is None:
            hopeless.add(worst)
        else:
            now = best[1]
    return now


@dataclasses.dataclass(frozen=True, eq=False)
class _Lacks:
    """What each frame lacks: its L (eq. 4) with what lies far outside once more (`reach`); the
    latter alone; and the share of its pixels that are lost."""

    loss: F64
    far: F64
    lost: F64

    def worst(self, hopeless: set[int]) -> int | None:
        """Return the frame to be looked at next."""
        usual = float(np.median(self.loss))
        for of, bad in (
            (self.loss, self.loss > BAD * usual),
            (self.far, self.lost >= LOST_SHARE),
        ):
            found = [i for i in np.flatnonzero(bad).tolist() if i not in hopeless]
            if found:
                return max(found, key=lambda i: of[i])
        return None

    def enough(self, frame: int) -> Callable[[_Lacks], bool]:
        """Return whether that frame alone, in `_Lacks` of its own, lacks so much less."""
        usual = float(np.median(self.loss))
        if self.loss[frame] > BAD * usual:
            most = self.loss[frame] - MENDED * (self.loss[frame] - usual)
            return lambda rest: bool(rest.loss[0] <= most)
        return lambda rest: bool(rest.far[0] <= MENDED * self.far[frame])


def _lacks(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    options: AnalysisOptions,
    scale: float,
) -> _Lacks:
    rows, _ = loss_of(polytope, statistics, coarse=True).evaluate(
        polytope.vertices,
        list(range(len(statistics))),
        reach_weights(options, scale),
        thread_count(options),
        False,
    )
    lost = np.zeros(len(statistics))
    if options.reach:  # else a light counts like everything else
        for i in np.flatnonzero(rows[:, 4] > LOST * scale).tolist():
            frame = statistics[i]
            distance = _outside(_slice(polytope, float(frame.frame)), frame)
            lost[i] = frame.coarse.counts[distance > LOST * scale].sum() / frame.pixels
    return _Lacks(options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2], rows[:, 2], lost)


def _trials(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    losses: F64,
    worst: int,
    scale: float,
) -> Iterator[tuple[SkewPolytope, list[int]]]:
    """Polytopes with a stop more in the worst frame, and their new vertices."""
    frame = statistics[worst]
    time = float(frame.frame)
    for place, block in enumerate(polytope.blocks):
        if not block.first <= time <= block.last or len(block.faces) == 0:
            continue
        rgb = _colours(polytope, block, time)
        target = _lost_colour(rgb, frame, LOST * scale)
        if target is None:
            continue
        # For as long as frames are nearer to this one than to the usual.
        limit = (losses[worst] + float(np.median(losses))) / 2
        before = next((i for i in range(worst, -1, -1) if losses[i] < limit), None)
        after = next((i for i in range(worst, len(losses)) if losses[i] < limit), None)
        ends = [float(statistics[i].frame) for i in (before, after) if i is not None]
        nearest = np.argsort(np.linalg.norm(rgb - target, axis=1), kind="stable")[:NEAREST]
        for track, pinned in itertools.product(nearest.tolist(), (False, True)):
            stops = [(*target.tolist(), time)]
            for end in ends if pinned else ():
                stops.append((*_colour(polytope.vertices[list(block.tracks[track])], end), end))
            trial, added = _with_stops(polytope, place, track, stops)
            if added:
                yield trial, added


def _colour(track: F64, time: float) -> F64:
    """(3,) colour of a track's (n, 4) vertices, held beyond its ends."""
    return np.array([np.interp(time, track[:, 3], track[:, c]) for c in range(3)])


def _colours(polytope: SkewPolytope, block: Section, time: float) -> F64:
    """(n, 3) colours of a block's tracks."""
    return np.array([_colour(polytope.vertices[list(t)], time) for t in block.tracks])


def _slice(polytope: SkewPolytope, time: float) -> F64:
    """(n, 3) colours of the block there; between blocks, those of the nearest."""
    block = min(polytope.blocks, key=lambda b: max(b.first - time, time - b.last))
    return _colours(polytope, block, min(max(time, block.first), block.last))


def _outside(rgb: F64, frame: FrameStatistics) -> F64:
    """How far each coarse colour lies outside a palette's convex hull; 0 where it has none."""
    try:
        planes = ConvexHull(rgb).equations
    except QhullError:
        return np.zeros(len(frame.coarse.counts))
    distance: F64 = (frame.coarse.rgb @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return distance


def _lost_colour(rgb: F64, frame: FrameStatistics, lost: float) -> F64 | None:
    """Return the mean of the colours that lie farthest outside; None where none does."""
    distance = _outside(rgb, frame)
    colours, counts = frame.coarse.rgb, frame.coarse.counts
    # The farthest pixels decide, not the farthest one.
    order = np.argsort(-distance, kind="stable")
    most = int(np.searchsorted(np.cumsum(counts[order]), frame.pixels / 1000)) + 1
    gone = int((distance > lost).sum())  # and where some are lost, those alone
    far = order[: min(most, gone or most)]
    far = far[distance[far] > 0]
    if len(far) == 0:
        return None
    mean: F64 = counts[far] @ colours[far] / counts[far].sum()
    return mean


def _with_stops(
    polytope: SkewPolytope, place: int, track: int, stops: Sequence[tuple[float, ...]]
) -> tuple[SkewPolytope, list[int]]:
    """Put stops (r, g, b, frame) on a block's track, where no other is too near in time.

    Nothing is added where the first of them has no room.
    """
    block = polytope.blocks[place]
    chain = list(block.tracks[track])
    vertices = polytope.vertices
    added: list[int] = []
    for stop in stops:
        times = vertices[chain, 3]
        inside = max(block.first, times[0]) < stop[3] < min(block.last, times[-1])
        if not inside or np.abs(times - stop[3]).min() < 2 * LEAST_GAP:
            if not added:
                return polytope, []
            continue
        chain.insert(int(np.searchsorted(times, stop[3])), len(vertices))
        added.append(len(vertices))
        vertices = np.vstack([vertices, stop])
    tracks = (*block.tracks[:track], tuple(chain), *block.tracks[track + 1 :])
    section: Section = dataclasses.replace(block, tracks=tracks)
    blocks = (*polytope.blocks[:place], section, *polytope.blocks[place + 1 :])
    return dataclasses.replace(polytope, vertices=vertices, blocks=blocks), added


def _settled(
    now: Inserted,
    trial: SkewPolytope,
    added: list[int],
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
) -> tuple[SkewPolytope, float]:
    """Move the new vertices to their best places; return the polytope, and by how much the value
    has changed."""
    scale = colour_scale(low, high)
    brief = (*now.brief, added[0])
    evaluate = Objective(trial, statistics, options, scale, coarse=True, brief=brief)
    vertices = trial.vertices.copy()
    vertices[:, :3] = np.clip(vertices[:, :3], low, high)
    moving = np.array(added)
    which = evaluate.touched(vertices, added)
    lower, upper = evaluate.box(vertices, moving, low, high, share=0.5)
    if len(added) > 1:  # what is there for a moment only makes its track give way as briefly
        times = vertices[moving, 3]
        span = np.abs(times - times[0]).max()
        lower[:, 3] = np.maximum(lower[:, 3], times - span)
        upper[:, 3] = np.minimum(upper[:, 3], times + span)
    vertices = move(evaluate, vertices, moving, which, (lower, upper), EVALUATIONS)
    value, _ = evaluate(vertices, which)
    before, _ = Objective(now.polytope, statistics, options, scale, coarse=True, brief=now.brief)(
        now.polytope.vertices, which
    )
    return trial.with_vertices(vertices), value - before
