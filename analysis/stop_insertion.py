"""After removal: stops for what single frames lack, such as a light that shines for a moment.

Input: a `Step` (a refined polytope) and the clip's frames. Output: a step whose value is no higher.
Merging takes a block's palettes on from frame to frame, and removal looks at the mean: neither sees
a colour that is there for a few frames only, however far it lies outside. So frames that fit much
worse than the usual one are looked at: the colours that one leaves outside get a stop on a track
near to them, with or without one before and after, which keep the rest of the track where it is.
Such stops need not be worth `handle_cost`, which is a matter of the mean; they stay if they make
good most of what the frame lacks and nothing else suffers for it.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.handle_removal import Step
from palette4d.analysis.losses import colour_scale, reach_weights, thread_count
from palette4d.analysis.objective import LEAST_GAP, Objective, loss_of, move
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Section, SkewPolytope
from palette4d.analysis.statistics import FrameStatistics
from scipy.spatial import ConvexHull, QhullError

F64 = NDArray[np.float64]

MOST_FRAMES = 6
BAD = 3.0  # times the median frame's loss: a frame to be looked at
MENDED = 0.5  # of what its loss is above the median must go
NEAREST = 3  # tracks tried
EVALUATIONS = 30


def insert_stops(
    step: Step,
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
) -> Step:
    """Return the polytope with stops for its worst frames.

    `statistics` are all of the clip's frames; `step.value` is on them. With `options.vertices`
    there are never more than so many.
    """
    polytope, value = step.polytope, step.value
    scale = colour_scale(low, high)
    hopeless: set[int] = set()
    for _ in range(MOST_FRAMES):
        losses = _frame_losses(polytope, statistics, options, scale)
        usual = float(np.median(losses))
        bad = [i for i in np.argsort(-losses, kind="stable").tolist() if i not in hopeless]
        if not bad or losses[bad[0]] <= BAD * usual:
            break
        enough = losses[bad[0]] - MENDED * (losses[bad[0]] - usual)
        best: tuple[float, float, SkewPolytope] | None = None
        for trial, added in _trials(polytope, statistics, losses, bad[0]):
            if options.vertices and len(trial.vertices) > options.vertices:
                continue
            moved, change = _settled(polytope, trial, added, statistics, low, high, options)
            price = change + options.handle_cost * len(added)
            if change > 0 or (best and price >= best[0]):
                continue
            if _frame_losses(moved, [statistics[bad[0]]], options, scale)[0] <= enough:
                best = price, change, moved
        if best is None:
            hopeless.add(bad[0])
        else:
            _, change, polytope = best
            value += change
    return Step(polytope, value)


def _frame_losses(
    polytope: SkewPolytope,
    statistics: Sequence[FrameStatistics],
    options: AnalysisOptions,
    scale: float,
) -> F64:
    """L (eq. 4) of each frame, and what lies far outside once more (`reach`)."""
    rows, _ = loss_of(polytope, statistics, coarse=True).evaluate(
        polytope.vertices,
        list(range(len(statistics))),
        reach_weights(options, scale),
        thread_count(options),
        False,
    )
    losses: F64 = options.lambda_ * rows[:, 0] + rows[:, 1] + rows[:, 2]
    return losses


def _trials(
    polytope: SkewPolytope, statistics: Sequence[FrameStatistics], losses: F64, worst: int
) -> Iterator[tuple[SkewPolytope, list[int]]]:
    """Polytopes with a stop more in the worst frame, and their new vertices."""
    frame = statistics[worst]
    time = float(frame.frame)
    for place, block in enumerate(polytope.blocks):
        if not block.first <= time <= block.last or len(block.faces) == 0:
            continue
        rgb = np.array([_colour(polytope.vertices[list(t)], time) for t in block.tracks])
        target = _lost_colour(rgb, frame)
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


def _lost_colour(rgb: F64, frame: FrameStatistics) -> F64 | None:
    """Return the mean of the colours that lie farthest outside; None where none does."""
    try:
        planes = ConvexHull(rgb).equations
    except QhullError:
        return None
    colours, counts = frame.coarse.rgb, frame.coarse.counts
    distance = (colours @ planes[:, :3].T + planes[:, 3]).max(axis=1)
    # The farthest pixels decide, not the farthest one.
    order = np.argsort(-distance, kind="stable")
    few = int(np.searchsorted(np.cumsum(counts[order]), frame.pixels / 1000)) + 1
    far = order[:few][distance[order[:few]] > 0]
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
    polytope: SkewPolytope,
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
    evaluate = Objective(trial, statistics, options, scale, coarse=True)
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
    before, _ = Objective(polytope, statistics, options, scale, coarse=True)(
        polytope.vertices, which
    )
    return trial.with_vertices(vertices), value - before
