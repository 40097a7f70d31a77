"""Stop insertion: stops for colours that only a few frames have, such as a short highlight.

Input: a refined polytope and all frames of the clip. Output: the polytope with such stops. Merging
takes the palettes of a block from frame to frame, and removal looks at the mean: both miss a colour
that only a few frames have. Frames with lost pixels (`LOST`) get stops.

The lost colours of such a frame get a stop on a track, with or without stops before and after that
keep the rest of the track where it is. In the clip's first and last frame the vertex of the track
itself takes the colour. A stop stays if it brings most of the lost pixels back. It need not be
worth its `handle_cost`, which judges the mean: the value of `Objective` may rise.
Its edges count little in eq. 11, which would otherwise rather lose the colour than let it change
quickly.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.losses import EVALUATIONS, LOST, LOST_SHARE, reach_weights
from palette4d.analysis.objective import LEAST_GAP, Objective, frame_losses, move
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from scipy.spatial.distance import cdist

from palette4d import _core

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

# Most frames that get stops.
MOST_ROUNDS = 10
# Least share of the lost pixels that a stop must bring back.
REMOVED = 0.5
# Cap on the lost colours of a frame that are clustered, farthest first: the time is quadratic.
FARTHEST = 1000


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
        for trial in _trials(now.polytope, frames, misfit, worst, gamut):
            if options.vertices and len(trial.polytope.vertices) > options.vertices:
                continue
            moved, change = _settled(now, trial, frames, gamut, options)
            price = change + options.handle_cost * len(trial.new)
            rest = _Misfit.of(moved.polytope, [frames[i] for i in trial.span], gamut, options)
            removed = [
                misfit.removed(i, rest, index, trial.share) for index, i in enumerate(trial.span)
            ]
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
    """Of each frame: how far its distant pixels are outside (`reach`), and the share of its pixels
    that are lost."""

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
                cut = polytope.slice_at(float(frames[i].frame))
                distance = _outside(cut.rgb, cut.faces, frames[i])
                counts = frames[i].coarse.counts[distance > LOST * gamut.scale]
                lost[i] = counts.sum() / frames[i].pixels
        return cls(rows[:, 2], lost)

    def worst(self, hopeless: set[int]) -> int | None:
        """Return the frame that needs a stop most, None if none does."""
        bad = np.flatnonzero(self.lost >= LOST_SHARE).tolist()
        return max((i for i in bad if i not in hopeless), key=lambda i: self.far[i], default=None)

    def removed(self, frame: int, rest: _Misfit, index: int, share: float) -> bool:
        """Return whether most of the pixels of a lost colour are back in frame `at` of `rest`."""
        less = self.lost[frame] - rest.lost[index] >= REMOVED * min(share, self.lost[frame])
        return bool(less and rest.far[index] <= self.far[frame])


@dataclasses.dataclass(frozen=True, eq=False)
class _Trial:
    """A polytope with new stops.

    Attributes
    ----------
    new, peaks : the vertices of the stops; the first `peaks` of them have the missing colour.
    share : the share of the frame's pixels with that lost colour.
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
        target, share = _lost_colour(_outside(rgb, block.faces, frame), frame, gamut.scale)
        if not share:
            continue
        # The colour lasts as long as frames lack at least half as much as this one.
        far, limit = misfit.far, misfit.far[worst] / 2
        before = next((i for i in range(worst, -1, -1) if far[i] < limit), -1)
        after = next((i for i in range(worst, len(far)) if far[i] < limit), len(far))
        beside = [float(frames[i].frame) for i in (before, after) if 0 <= i < len(far)]
        lasting = [float(frames[i].frame) for i in (before + 1, after - 1)]
        # One stop; with stops that keep the track before and after; for as long as it lasts.
        span = range(before + 1, after)
        shapes = [([time], [], False), ([time], beside, False)]
        if lasting[0] < lasting[1]:
            shapes += [(lasting, beside, False), (lasting, beside, True)]
        for track, (peaks, pins, held) in itertools.product(range(len(rgb)), shapes):
            stops = [(*target.tolist(), when) for when in peaks]
            stops += [(*polytope.colours_at(block, when)[track], when) for when in pins]
            changed, new = _with_stops(polytope, place, track, stops, len(peaks))
            if new:
                yield _Trial(changed, new, len(peaks), share, span, held)


def _outside(rgb: F64, faces: I32, frame: FrameStatistics) -> F64:
    """Return how far each coarse colour lies outside a palette's solid."""
    distance: F64 = _core.palette_weights(frame.coarse.rgb, rgb, faces)[1]
    return distance


def _lost_colour(distance: F64, frame: FrameStatistics, scale: float) -> tuple[F64, float]:
    """Return the mean of a cluster of lost colours, and its share of the frame's pixels.

    The cluster with the largest sum of pixels times distance outside is returned.
    """
    colours, counts = frame.coarse.rgb, frame.coarse.counts
    far = np.argsort(-distance, kind="stable")[:FARTHEST]
    far = far[distance[far] > LOST * scale]
    if not len(far):
        return np.zeros(3), 0.0
    near = cdist(colours[far], colours[far]) < LOST * scale
    far = far[near[np.argmax(near @ (counts[far] * distance[far]))]]
    return counts[far] @ colours[far] / counts[far].sum(), counts[far].sum() / frame.pixels


def _with_stops(
    polytope: SkewPolytope, place: int, track: int, stops: Sequence[tuple[float, ...]], peaks: int
) -> tuple[SkewPolytope, list[int]]:
    """Return the polytope with stops (r, g, b, frame) on a block's track, and their vertices.

    Stops too near others in time are skipped; if a peak is skipped, no stop is added. In
    the clip's first and last frame the track's own vertex takes the colour of a peak, if another
    stop holds the rest of the track.
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
        inside = block.first <= stop[3] <= block.last and times[0] < stop[3] < times[-1]
        if not inside or np.abs(times - stop[3]).min() < 2 * LEAST_GAP:
            if i < peaks:
                return polytope, []
            continue
        index = int(np.searchsorted(times, stop[3]))
        new = len(changed.vertices)
        changed = changed.with_stop((chain[index - 1], chain[index]), stop)
        chain.insert(index, new)
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
) -> tuple[WithStops, float]:
    """Optimise the new vertices; return the polytope and the change in value."""
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
    vertices = move(evaluate, vertices, moving, which, (lower, upper), EVALUATIONS)
    value, _ = evaluate(vertices, which, False)
    unchanged = Objective(now.polytope, frames, options, gamut, True, now.brief)
    before, _ = unchanged(now.polytope.vertices, which, False)
    return WithStops(trial.polytope.with_vertices(vertices), brief), value - before
