"""After removal: stops for what single frames lack, such as a light that shines for a moment.

Input: a refined polytope and the clip's frames. Output: the polytope with such stops.
Merging takes a block's palettes on from frame to frame, and removal looks at the mean: neither sees
a colour that is there for a few frames only, however far it lies outside. So two kinds of frames
are looked at: those that fit much worse than the usual one, and those of whose pixels some are lost
(`LOST`). The colours that one leaves outside get a stop on a track near to them, with or without
one before and after, which keep the rest of the track where it is; at the clip's ends the track's
own vertex takes the light's colour. Such stops need not be worth `handle_cost`, which is a matter
of the mean; they stay if they make good most of what the frame lacks and nothing else suffers for
it: in a frame with lost pixels what is minimised may rise by `WORTH`. That they come and go at once
is hardly held against them: eq. 11 would rather lose a light than let a colour jump.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import LOST, LOST_SHARE, colour_scale, reach_weights, thread_count
from palette4d.analysis.objective import LEAST_GAP, Objective, loss_of, move
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from palette4d.analysis.statistics import FrameStatistics
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.distance import cdist

F64 = NDArray[np.float64]

MOST_ROUNDS = 10
BAD = 3.0  # times the median frame's loss: a frame to be looked at
MENDED = 0.5  # of what is lacking must go
WORTH = 0.04  # of a light: by how much what is minimised may rise for it
SAME_LIGHT = 0.25  # lost colours so near to each other are of one light
FEW_COLOURS = 1000  # of the farthest ones lights are made
NEAREST = 8  # tracks tried: one that matters little just then need not be near
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
) -> list[Inserted]:
    """Return the polytope as it is, and, each on top of the one before, with stops for its worst
    frames.

    `statistics` are all of the clip's frames. With `options.vertices` there are never more than so
    many.
    """
    scale = colour_scale(low, high)
    steps = [Inserted(polytope, ())]
    hopeless: set[int] = set()
    for _ in range(MOST_ROUNDS):
        now = steps[-1]
        lacks = _lacks(now.polytope, statistics, options, scale)
        worst = lacks.worst(hopeless)
        if worst is None:
            break
        best: tuple[int, float, Inserted] | None = None
        for trial in _trials(now.polytope, statistics, lacks, worst, scale):
            if options.vertices and len(trial.polytope.vertices) > options.vertices:
                continue
            moved, change = _settled(now, trial, statistics, low, high, options)
            if change > (WORTH if trial.share else 0):
                continue
            price = change + options.handle_cost * len(trial.new)
            rest = _lacks(moved.polytope, [statistics[i] for i in trial.span], options, scale)
            mended = [lacks.mended(i, rest, at, trial.share) for at, i in enumerate(trial.span)]
            left = mended.count(False)  # of a light that shines for longer
            if mended[trial.span.index(worst)] and (best is None or (left, price) < best[:2]):
                best = left, price, moved
        if best is None:
            hopeless.add(worst)
        else:
            steps.append(best[2])
    return steps


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

    def mended(self, frame: int, rest: _Lacks, at: int, share: float) -> bool:
        """Return whether that frame, the one `at` in `rest`, lacks so much less: of a light, on
        this share of the pixels of some frame, most is no longer lost."""
        if share:
            light = min(share, self.lost[frame])
            less = self.lost[frame] - rest.lost[at] >= MENDED * light
            return bool(less and rest.far[at] <= self.far[frame])
        usual = float(np.median(self.loss))
        return bool(rest.loss[at] <= self.loss[frame] - MENDED * (self.loss[frame] - usual))


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


@dataclasses.dataclass(frozen=True, eq=False)
class _Trial:
    """A polytope with new stops: their vertices, how many of these (the first ones) have the lost
    colour, the share of the frame's pixels that are this light, 0 where none are lost, and the
    frames (indices) that are looked at: of a light all that lack nearly as much. The times of the
    first vertices may move unless they are `held`."""

    polytope: SkewPolytope
    new: list[int]
    peaks: int
    share: float
    span: range
    held: bool


def _trials(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    lacks: _Lacks,
    worst: int,
    scale: float,
) -> Iterator[_Trial]:
    """Ways to give the worst frame what it lacks."""
    frame = statistics[worst]
    time = float(frame.frame)
    for place, block in enumerate(polytope.blocks):
        if not block.first <= time <= block.last or len(block.faces) == 0:
            continue
        rgb = polytope.colours_at(block, time)
        target, share = _lost_colour(rgb, frame, scale)
        if target is None:
            continue
        # For as long as frames lack nearly as much as this one.
        if share:
            what, limit = lacks.far, lacks.far[worst] / 2
        else:
            what, limit = lacks.loss, (lacks.loss[worst] + float(np.median(lacks.loss))) / 2
        before = next((i for i in range(worst, -1, -1) if what[i] < limit), -1)
        after = next((i for i in range(worst, len(what)) if what[i] < limit), len(what))
        beside = [float(statistics[i].frame) for i in (before, after) if 0 <= i < len(what)]
        lasting = [float(statistics[i].frame) for i in (before + 1, after - 1)]
        # At once; with the track kept beside it; and for as long as it is there.
        span = range(before + 1, after) if share else range(worst, worst + 1)
        shapes = [([time], [], False), ([time], beside, False)]
        if share and lasting[0] < lasting[1]:
            shapes += [(lasting, beside, False), (lasting, beside, True)]
        nearest = np.argsort(np.linalg.norm(rgb - target, axis=1), kind="stable")[:NEAREST]
        for track, (peaks, pins, held) in itertools.product(nearest.tolist(), shapes):
            stops = [(*target.tolist(), at) for at in peaks]
            stops += [(*polytope.colours_at(block, at)[track], at) for at in pins]
            changed, new = _with_stops(polytope, place, track, stops, len(peaks))
            if new:
                yield _Trial(changed, new, len(peaks), share, span, held)


def _slice(polytope: SkewPolytope, time: float) -> F64:
    """(n, 3) colours of the block there; between blocks, those of the nearest."""
    block = min(polytope.blocks, key=lambda b: max(b.first - time, time - b.last))
    return polytope.colours_at(block, min(max(time, block.first), block.last))


def _outside(rgb: F64, frame: FrameStatistics) -> F64:
    """How far each coarse colour lies outside a palette's convex hull; 0 where it has none."""
    try:
        planes = ConvexHull(rgb).equations
    except QhullError:
        return np.zeros(len(frame.coarse.counts))
    distance: F64 = (frame.coarse.rgb @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return distance


def _lost_colour(rgb: F64, frame: FrameStatistics, scale: float) -> tuple[F64 | None, float]:
    """Return the mean of the colours that lie farthest outside, None where none does, and the share
    of the frame's pixels that are lost and of that colour."""
    distance = _outside(rgb, frame)
    colours, counts = frame.coarse.rgb, frame.coarse.counts
    order = np.argsort(-distance, kind="stable")
    far = order[:FEW_COLOURS]
    far = far[distance[far] > LOST * scale]
    if counts[far].sum() >= LOST_SHARE * frame.pixels:
        # One light a time: that on most pixels, and on those farthest outside.
        near = cdist(colours[far], colours[far]) < SAME_LIGHT * scale
        far = far[near[np.argmax(near @ (counts[far] * distance[far]))]]
        return counts[far] @ colours[far] / counts[far].sum(), counts[far].sum() / frame.pixels
    # The farthest pixels decide, not the farthest one.
    few = int(np.searchsorted(np.cumsum(counts[order]), frame.pixels / 1000)) + 1
    far = order[:few][distance[order[:few]] > 0]
    if len(far) == 0:
        return None, 0.0
    return counts[far] @ colours[far] / counts[far].sum(), 0.0


def _with_stops(
    polytope: SkewPolytope, place: int, track: int, stops: Sequence[tuple[float, ...]], peaks: int
) -> tuple[SkewPolytope, list[int]]:
    """Put stops (r, g, b, frame) on a block's track, where no other is too near in time.

    The first `peaks` of them are needed: nothing is added where one has no room. At the clip's
    first and last frame such a one is the track's own vertex, if another keeps the track beside it.
    """
    block = polytope.blocks[place]
    chain = list(block.tracks[track])
    before, after = polytope.neighbours()
    changed, added = polytope, list[int]()
    for i, stop in enumerate(stops):
        times = changed.vertices[chain, 3]
        end = chain[0] if stop[3] == times[0] else chain[-1] if stop[3] == times[-1] else None
        if end is not None and i < peaks and len(before[end]) + len(after[end]) == 1:
            vertices = changed.vertices.copy()
            vertices[end] = stop
            changed = dataclasses.replace(changed, vertices=vertices)
            added.append(end)
            continue
        inside = max(block.first, times[0]) < stop[3] < min(block.last, times[-1])
        if not inside or np.abs(times - stop[3]).min() < 2 * LEAST_GAP:
            if i < peaks:
                return polytope, []
            continue
        at = int(np.searchsorted(times, stop[3]))
        new = len(changed.vertices)
        changed = changed.with_stop((chain[at - 1], chain[at]), stop)
        chain.insert(at, new)
        added.append(new)
    if len(added) <= peaks and min(added) < len(polytope.vertices):  # all of the track would change
        return polytope, []
    return changed, added


def _settled(
    now: Inserted,
    trial: _Trial,
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
) -> tuple[Inserted, float]:
    """Move the new vertices to their best places; return the polytope, and by how much the value
    has changed."""
    scale = colour_scale(low, high)
    brief = (*now.brief, *trial.new[: trial.peaks])
    evaluate = Objective(trial.polytope, statistics, options, scale, coarse=True, brief=brief)
    vertices = trial.polytope.vertices.copy()
    vertices[:, :3] = np.clip(vertices[:, :3], low, high)
    moving = np.array(trial.new)
    which = evaluate.touched(vertices, trial.new)
    lower, upper = evaluate.box(vertices, moving, low, high, share=0.5)
    times = vertices[moving, 3]
    if len(trial.new) > 1:  # what is there for a moment only makes its track give way as briefly
        span = np.abs(times - times[0]).max()
        lower[:, 3] = np.maximum(lower[:, 3], times - span)
        upper[:, 3] = np.minimum(upper[:, 3], times + span)
    if trial.held:
        lower[: trial.peaks, 3] = upper[: trial.peaks, 3] = times[: trial.peaks]
    vertices = move(evaluate, vertices, moving, which, (lower, upper), EVALUATIONS)
    value, _ = evaluate(vertices, which)
    before, _ = Objective(now.polytope, statistics, options, scale, coarse=True, brief=now.brief)(
        now.polytope.vertices, which
    )
    return Inserted(trial.polytope.with_vertices(vertices), brief), value - before
