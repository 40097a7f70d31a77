"""Stop insertion: stops for colours that only a few frames have, such as a short highlight.

Input: a refined polytope and all frames of the clip. Output: the polytope with such stops. Merging
takes the palettes of a block from frame to frame, and removal looks at the mean: both miss a colour
that only a few frames have. Two kinds of frames get stops: those whose loss is far above the
median's, and those with lost pixels (`LOST`).

The colours outside the palette of such a frame get a stop on a track near them, with or without
stops before and after that keep the rest of the track where it is. In the clip's first and last
frame the vertex of the track itself takes the colour. A stop stays if it removes most of the
frame's misfit and is worth its `handle_cost`. Where pixels are lost it need not be, as the cost
judges the mean: the value of `Objective` may even rise by `WORTH`. Its edges count little in
eq. 11, which would otherwise rather lose the colour than let it change quickly.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.convex_hulls import hull_planes
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.losses import LOST, LOST_SHARE, reach_weights
from palette4d.analysis.objective import LEAST_GAP, Objective, frame_losses, move
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from scipy.spatial.distance import cdist

F64 = NDArray[np.float64]

MOST_ROUNDS = 10
BAD = 3.0  # times the median frame's loss: such a frame gets a stop
REMOVED = 0.5  # the least share of a misfit that a stop must remove
WORTH = 0.04  # the most that lost pixels may raise the value of `Objective`
SAME_COLOUR = 0.25  # lost colours within this distance belong together
FARTHEST = 1000  # lost colours that are looked at
TRIED = 8  # places for stops that are tried, the most promising first
NEAREST = 8  # tracks that are tried: the nearest need not be the one to spare
EVALUATIONS = 30


@dataclasses.dataclass(frozen=True, eq=False)
class WithStops:
    """A polytope with stops; `brief` are its vertices of short colours (see `Objective`)."""

    polytope: SkewPolytope
    brief: tuple[int, ...]


def insert_stops(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> list[WithStops]:
    """Return the polytope as it is, then with the stops of one more frame each time, worst first.

    With `options.vertices` there are never more vertices than that.
    """
    steps = [WithStops(polytope, ())]
    hopeless: set[int] = set()
    for _ in range(MOST_ROUNDS):
        now = steps[-1]
        misfit = _Misfit.of(now.polytope, frames, gamut, options)
        worst = misfit.worst(hopeless)
        if worst is None:
            break
        best: tuple[int, float, WithStops] | None = None
        trials = [
            trial
            for trial in _trials(now.polytope, frames, misfit, worst, gamut)
            if not options.vertices or len(trial.polytope.vertices) <= options.vertices
        ]
        # Those that are best before their stops move are tried.
        trials.sort(key=lambda trial: _settled(now, trial, frames, gamut, options, 0)[1])
        for trial in trials[:TRIED]:
            moved, change = _settled(now, trial, frames, gamut, options)
            price = change + options.handle_cost * len(trial.new)
            if change > WORTH if trial.share else price > 0:
                continue
            rest = _Misfit.of(moved.polytope, [frames[i] for i in trial.span], gamut, options)
            removed = [misfit.removed(i, rest, at, trial.share) for at, i in enumerate(trial.span)]
            left = removed.count(False)
            if removed[trial.span.index(worst)] and (best is None or (left, price) < best[:2]):
                best = left, price, moved
        if best is None:
            hopeless.add(worst)
        else:
            steps.append(best[2])
    return steps


def lost_share(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> float:
    """Return the sum of the frames' shares of lost pixels, without those that count as noise."""
    lost = _Misfit.of(polytope, frames, gamut, options).lost
    return float(lost[lost >= LOST_SHARE].sum())


@dataclasses.dataclass(frozen=True, eq=False)
class _Misfit:
    """Of each frame: its loss (eq. 4 plus `reach`), the part of `reach` alone, and the share of its
    pixels that are lost."""

    loss: F64
    far: F64
    lost: F64

    @classmethod
    def of(
        cls,
        polytope: SkewPolytope,
        frames: Sequence[FrameStatistics],
        gamut: Gamut,
        options: AnalysisOptions,
    ) -> _Misfit:
        """Measure a polytope on the coarse colours of frames."""
        weights = reach_weights(options, gamut.scale)
        rows = frame_losses(polytope, frames, range(len(frames)), weights, options, coarse=True)
        lost = np.zeros(len(frames))
        if options.reach:  # otherwise distant pixels count like all others
            for i in np.flatnonzero(rows[:, 4] > LOST * gamut.scale).tolist():
                distance = _outside(polytope.slice_at(float(frames[i].frame)).rgb, frames[i])
                counts = frames[i].coarse.counts[distance > LOST * gamut.scale]
                lost[i] = counts.sum() / frames[i].pixels
        return cls(options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2], rows[:, 2], lost)

    @property
    def usual(self) -> float:
        """The median frame's loss."""
        return float(np.median(self.loss))

    def worst(self, hopeless: set[int]) -> int | None:
        """Return the frame that needs a stop most, None if none does."""
        for of, bad in (
            (self.loss, self.loss > BAD * self.usual),
            (self.far, self.lost >= LOST_SHARE),
        ):
            found = [i for i in np.flatnonzero(bad).tolist() if i not in hopeless]
            if found:
                return max(found, key=lambda i: of[i])
        return None

    def removed(self, frame: int, rest: _Misfit, at: int, share: float) -> bool:
        """Return whether most of a frame's misfit is gone in frame `at` of `rest`.

        With `share`, of the pixels of one lost colour, that is the misfit that counts.
        """
        if share:
            less = self.lost[frame] - rest.lost[at] >= REMOVED * min(share, self.lost[frame])
            return bool(less and rest.far[at] <= self.far[frame])
        return bool(rest.loss[at] <= self.loss[frame] - REMOVED * (self.loss[frame] - self.usual))


@dataclasses.dataclass(frozen=True, eq=False)
class _Trial:
    """A polytope with new stops.

    Attributes
    ----------
    new, peaks : the vertices of the stops; the first `peaks` of them have the missing colour.
    share : the share of the frame's pixels with that lost colour, 0 if no pixels are lost.
    span : the frames (indices) whose misfit counts: all that lack nearly as much of the colour.
    held : whether the times of the peaks stay.
    """

    polytope: SkewPolytope
    new: list[int]
    peaks: int
    share: float
    span: range
    held: bool


def _trials(
    polytope: SkewPolytope,
    frames: Sequence[FrameStatistics],
    misfit: _Misfit,
    worst: int,
    gamut: Gamut,
) -> Iterator[_Trial]:
    """Yield polytopes with stops for the worst frame."""
    frame = frames[worst]
    time = float(frame.frame)
    for place, block in enumerate(polytope.blocks):
        if not block.first <= time <= block.last or len(block.faces) == 0:
            continue
        rgb = polytope.colours_at(block, time)
        target, share = _missing_colour(rgb, frame, gamut.scale)
        if target is None:
            continue
        # The colour lasts as long as frames lack nearly as much as this one.
        if share:
            what, limit = misfit.far, misfit.far[worst] / 2
        else:
            what, limit = misfit.loss, (misfit.loss[worst] + misfit.usual) / 2
        before = next((i for i in range(worst, -1, -1) if what[i] < limit), -1)
        after = next((i for i in range(worst, len(what)) if what[i] < limit), len(what))
        beside = [float(frames[i].frame) for i in (before, after) if 0 <= i < len(what)]
        lasting = [float(frames[i].frame) for i in (before + 1, after - 1)]
        # One stop; with stops that keep the track before and after; for as long as it lasts.
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


def _outside(rgb: F64, frame: FrameStatistics) -> F64:
    """Return how far each coarse colour lies outside a palette's hull; 0 without a volume."""
    planes = hull_planes(rgb)
    if planes is None:
        return np.zeros(len(frame.coarse.counts))
    distance: F64 = (frame.coarse.rgb @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    return distance


def _missing_colour(rgb: F64, frame: FrameStatistics, scale: float) -> tuple[F64 | None, float]:
    """Return the mean of the colours farthest outside, None if none is outside, and the share of
    the frame's pixels that have this colour and are lost."""
    distance = _outside(rgb, frame)
    colours, counts = frame.coarse.rgb, frame.coarse.counts
    order = np.argsort(-distance, kind="stable")
    far = order[:FARTHEST]
    far = far[distance[far] > LOST * scale]
    if counts[far].sum() >= LOST_SHARE * frame.pixels:
        # One colour at a time: that of the most pixels and of those farthest outside.
        near = cdist(colours[far], colours[far]) < SAME_COLOUR * scale
        far = far[near[np.argmax(near @ (counts[far] * distance[far]))]]
        return counts[far] @ colours[far] / counts[far].sum(), counts[far].sum() / frame.pixels
    # A thousandth of the pixels decides, not the farthest one.
    few = int(np.searchsorted(np.cumsum(counts[order]), frame.pixels / 1000)) + 1
    far = order[:few][distance[order[:few]] > 0]
    if len(far) == 0:
        return None, 0.0
    return counts[far] @ colours[far] / counts[far].sum(), 0.0


def _with_stops(
    polytope: SkewPolytope, place: int, track: int, stops: Sequence[tuple[float, ...]], peaks: int
) -> tuple[SkewPolytope, list[int]]:
    """Return the polytope with stops (r, g, b, frame) on a block's track, and their vertices.

    Stops too near to others in time are left out. If one of the first `peaks` is, none is added. In
    the clip's first and last frame the track's own vertex takes the colour of a peak, if another
    stop keeps the rest of the track.
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
    if len(added) <= peaks and min(added) < len(polytope.vertices):  # the whole track would change
        return polytope, []
    return changed, added


def _settled(
    now: WithStops,
    trial: _Trial,
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
    evaluations: int = EVALUATIONS,
) -> tuple[WithStops, float]:
    """Move the new vertices to their best places; return the polytope and the change in value.

    With no `evaluations` they stay where they are.
    """
    brief = (*now.brief, *trial.new[: trial.peaks])
    evaluate = Objective(trial.polytope, frames, options, gamut, True, brief)
    vertices = trial.polytope.vertices.copy()
    vertices[:, :3] = gamut.clip(vertices[:, :3])
    moving = np.array(trial.new)
    which = evaluate.touched(vertices, trial.new)
    lower, upper = evaluate.box(vertices, moving, share=0.5)
    times = vertices[moving, 3]
    if len(trial.new) > 1:  # a short colour displaces its track for a short time only
        span = np.abs(times - times[0]).max()
        lower[:, 3] = np.maximum(lower[:, 3], times - span)
        upper[:, 3] = np.minimum(upper[:, 3], times + span)
    if trial.held:
        lower[: trial.peaks, 3] = upper[: trial.peaks, 3] = times[: trial.peaks]
    if evaluations:
        vertices = move(evaluate, vertices, moving, which, (lower, upper), evaluations)
    value, _ = evaluate(vertices, which, False)
    unchanged = Objective(now.polytope, frames, options, gamut, True, now.brief)
    before, _ = unchanged(now.polytope.vertices, which, False)
    return WithStops(trial.polytope.with_vertices(vertices), brief), value - before
