"""Colour statistics of a frame: what the analysis keeps of its pixels.

Input: a clip, or an image. Output: for each frame weighted colours in k-d trees, of bounded size,
so that memory grows neither with resolution nor, beyond `MOST_COLOURS`, with the number of frames.
Pixels that are not finite or have an alpha below 1/255 do not count; where that leaves no pixel of
any frame, alpha is not used.

The losses of section 3 measured on a frame of 8-bit colours of which no more than the kept number
differ are exact. Else the colours are a sample (`colour_sample.hpp`), dense where the colours of
the frame end; its error is measured by the tests.
"""

from __future__ import annotations

import collections
import concurrent.futures
import contextlib
import dataclasses
import functools
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis import colour_histogram
from palette4d.analysis.losses import LOST_SHARE, thread_count
from palette4d.analysis.options import AnalysisOptions

from palette4d import _core
from palette4d.common.text import counted
from palette4d.media.clip_base import Fill, FrameError, describe

if TYPE_CHECKING:
    from palette4d.media.clip import Clip

TRIM_EVERY = 50_000_000
"""Pixels after which freed memory is given back: glibc keeps what frames of changing sizes leave
between the colours that stay."""

MOST_COLOURS = 2_000_000
"""Colours kept of a clip, all frames together: about 100 MB. Four times as many gave palettes no
better, for twice the time."""

SHORT, RICHER = 48, 2
"""Of clips with fewer frames than these more coarse colours are kept of each, so that as many take
part in the search, up to so many times."""

MOST_FRAMES = 3000
"""Of a clip with more frames only every n-th is analysed: a palette is linear in time anyway."""

FEWEST_COLOURS, FEWEST_COARSE = 1024, 512
"""Colours kept of a frame, however many frames there are."""

MEMORY, MOST_WORKERS = 400 << 20, 8
"""Bytes for frames that are read at the same time, and how many that may be."""

TABLE = 64 << 20
"""Most bytes of a binner's table."""

FEWEST_OUTSIDE, MOST_OUTSIDE_SHARE = 5, 0.01
"""A colour outside 0..1 counts on so many pixels of a small frame, of a tiny one on this share."""

OUTLYING = 0.1
"""Outliers are those farther outside than this share of what the clip's other colours span: less
than that hardly changes a hull, and the end of an honest highlight stays as it is."""

Progress = Callable[[int, int], None]


@dataclasses.dataclass(frozen=True)
class FrameStatistics:
    """One frame's colours.

    Attributes
    ----------
    frame : the frame number.
    colours : the colours the losses are measured on.
    coarse : fewer of them, for the stages that only compare alternatives.
    histogram : `colour_histogram.histogram` of the frame, to find cuts by.
    low, high : (3,) float64 the colours' bounding box.
    pixels, ignored : how many pixels count, and how many do not.
    """

    frame: int
    colours: _core.ColourTree
    coarse: _core.ColourTree
    histogram: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    pixels: int
    ignored: int


@dataclasses.dataclass(frozen=True)
class ClipStatistics:
    """The statistics of a clip's frames, by their number; None where no pixel counts.

    remarks says what was left out to stay within bounds, whether alpha was, and which colours were
    moved (`without_outliers`). Bad frames are listed by the clip.
    """

    frames: dict[int, FrameStatistics | None]
    remarks: tuple[str, ...]


def gather(
    frame: int, image: NDArray[np.float32], options: AnalysisOptions
) -> FrameStatistics | None:
    """Return the statistics of an (h, w, 3 or 4) image, or None when no pixel counts."""
    binner = _core.ColourBinner()
    binner.add(image)
    return _taken(frame, binner, options.colours, options.coarse_colours, image[..., 0].size)


def gather_clip(
    clip: Clip, options: AnalysisOptions, progress: Progress | None = None
) -> ClipStatistics:
    """Read a clip's frames, one after the other, and keep their statistics.

    Frames are read and binned side by side in `options.threads` threads, as far as memory allows;
    the result does not depend on it.

    Raises
    ------
    FrameError
        For the first bad frame, or, with `Clip.skip_bad_frames`, when every frame is bad.
    """
    chosen = chosen_frames(clip.frames)
    colours, coarse = budget(len(chosen), options)
    report = progress or (lambda done, total: None)
    pixels = clip.width * clip.height
    found: dict[int, FrameStatistics | None] = {}
    hidden: set[int] = set()

    def taken(number: int, fill: Fill, binner: _core.ColourBinner) -> FrameStatistics | None:
        try:
            if fill(binner):
                hidden.add(number)
            return _taken(number, binner, colours, coarse, pixels)
        finally:
            binner.clear()

    workers = min(
        thread_count(options), MOST_WORKERS, max(1, MEMORY // (TABLE + 12 * pixels)), len(chosen)
    )
    # Its threads end here, whatever comes: an error's traceback would keep them until it is
    # garbage, and the collector, wherever it happens to run, would wait for them.
    with contextlib.closing(_in_order(clip.fills(chosen), taken, workers)) as results:
        for done, (number, result) in enumerate(results, start=1):
            try:
                found[number] = result()
            except FrameError:
                if not clip.skip_bad_frames:
                    raise
                clip.skip(number)
            if done % max(1, TRIM_EVERY // pixels) == 0:
                _core.return_memory()
            report(done, len(chosen))
    if not found:
        raise clip.none_readable()
    remarks = list(_remarks(clip.frames, chosen))
    if any(found[number] is not None for number in found.keys() - hidden):
        for number in hidden:  # alpha is used: there is nothing to be seen in these
            found[number] = None
    elif hidden:
        remarks.append(_unused_alpha(clip.premultiplied))
    usable = {number: one for number, one in found.items() if one is not None}
    kept, outliers = without_outliers(usable, options, colours, coarse)
    return ClipStatistics({**found, **kept}, (*remarks, *outliers))


def chosen_frames(frames: Sequence[int]) -> list[int]:
    """Return all frames, or, of very many, every n-th and the last."""
    step = -(-(len(frames) - 1) // (MOST_FRAMES - 1)) if len(frames) > MOST_FRAMES else 1
    chosen = list(frames[::step])
    return chosen if chosen[-1] == frames[-1] else [*chosen, frames[-1]]


def budget(frames: int, options: AnalysisOptions) -> tuple[int, int]:
    """Return how many colours and coarse colours are kept of each of so many frames."""
    share = MOST_COLOURS / (frames * (options.colours + options.coarse_colours))
    if share >= 1:
        richer = min(RICHER, max(1.0, SHORT / frames))
        return options.colours, min(options.colours, int(richer * options.coarse_colours))
    return (
        min(options.colours, max(FEWEST_COLOURS, int(share * options.colours))),
        min(options.coarse_colours, max(FEWEST_COARSE, int(share * options.coarse_colours))),
    )


def pooled(trees: Sequence[_core.ColourTree], most: int) -> _core.ColourTree:
    """Return the colours of several trees as one, at most `most` of them."""
    binner = _core.ColourBinner()
    for tree in trees:
        binner.add_colours(tree.rgb, tree.counts)
    taken = binner.take(most, most)
    assert taken is not None  # a tree has at least one colour
    return taken[0]


def without_outliers(
    frames: Mapping[int, FrameStatistics], options: AnalysisOptions, colours: int, coarse: int
) -> tuple[dict[int, FrameStatistics], tuple[str, ...]]:
    """Return frames whose outliers are taken at the border of the other colours, and a remark.

    The border is, for each channel and side, what enough pixels of some frame reach, never inside
    0..1. Enough are `LOST_SHARE` of a frame, and `options.k`, which hold a handle, at most. They
    are counted in each frame, since a hot pixel is in all of a clip's; but the border is the
    clip's, so that a light may begin small. Frames without outliers are returned as they are;
    others with at most `colours` and `coarse` colours.
    """
    if not frames:
        return {}, ()
    reached = np.array([_reached(one, options) for one in frames.values()])  # (n, 2, 3)
    low, high = reached[:, 0].min(axis=0), reached[:, 1].max(axis=0)
    margin = OUTLYING * (high - low)
    least = np.min([one.low for one in frames.values()], axis=0)
    most = np.max([one.high for one in frames.values()], axis=0)
    low = np.where(least < low - margin, low, -np.inf)
    high = np.where(most > high + margin, high, np.inf)
    kept: dict[int, FrameStatistics] = {}
    pixels, farthest = 0.0, 0.0
    for number, one in frames.items():
        if np.all(one.low >= low) and np.all(one.high <= high):
            continue
        rgb, counts = one.colours.rgb, one.colours.counts
        clipped = np.clip(rgb, low, high)
        distance = np.abs(rgb - clipped).max(axis=1)
        pixels += counts[distance > 0].sum()
        farthest = max(farthest, float(distance.max()))
        binner = _core.ColourBinner()
        binner.add_colours(clipped, counts)
        taken = binner.take(colours, coarse)
        assert taken is not None  # there were colours
        fine, few, lowest, highest = taken
        kept[number] = dataclasses.replace(one, colours=fine, coarse=few, low=lowest, high=highest)
    return dict(frames) | kept, _outliers(list(kept), max(1, round(pixels)), farthest)


def _reached(frame: FrameStatistics, options: AnalysisOptions) -> NDArray[np.float64]:
    """Return (2, 3) the least and the largest value of each channel that enough pixels reach, 0
    and 1 where these are farther out."""
    enough = min(
        options.k,
        max(FEWEST_OUTSIDE, LOST_SHARE * frame.pixels),
        MOST_OUTSIDE_SHARE * frame.pixels,
    )
    out = np.array([[0.0] * 3, [1.0] * 3])
    for channel in range(3):
        for side, (sign, extreme) in enumerate(((-1, frame.low), (1, frame.high))):
            border = sign * out[side, channel]
            if sign * extreme[channel] <= border:
                continue
            values = sign * frame.colours.rgb[:, channel]
            outside = np.flatnonzero(values > border)
            outside = outside[np.argsort(-values[outside], kind="stable")]
            # Means of counts may fall short of a whole number by rounding.
            there = np.flatnonzero(np.cumsum(frame.colours.counts[outside]) >= enough - 1e-6)
            if len(there):
                out[side, channel] = sign * values[outside[there[0]]]
    return out


def _outliers(frames: Sequence[int], pixels: int, farthest: float) -> tuple[str, ...]:
    if not frames:
        return ()
    what = counted(pixels, "pixel lies", "pixels lie")
    where = f"{'frame' if len(frames) == 1 else 'frames'} {describe(frames)}"
    return (
        f"{what} far outside the clip's other colours and 0..1, by up to {farthest:.3g} "
        f"({where}): for the palette taken at the others' border; --k 1 takes them as they are",
    )


def _taken(
    frame: int, binner: _core.ColourBinner, colours: int, coarse: int, pixels: int
) -> FrameStatistics | None:
    """Take a frame's colours; where not all of its `pixels` were looked at, those stand for all."""
    looked_at = binner.pixels + binner.ignored
    scale = pixels / looked_at if looked_at else 1.0
    count, ignored = round(scale * binner.pixels), round(scale * binner.ignored)
    least = colour_histogram.LEAST_COLOURS
    taken = binner.take(max(colours, least), coarse, scale)
    if taken is None:
        return None
    fine, few, low, high = taken
    histogram = colour_histogram.histogram(fine.rgb, fine.counts)
    if colours < least:  # of a very long clip
        fine = pooled([fine], colours)
    return FrameStatistics(frame, fine, few, histogram, low, high, count, ignored)


def _in_order(
    fills: Iterator[tuple[int, Fill]],
    taken: Callable[[int, Fill, _core.ColourBinner], FrameStatistics | None],
    workers: int,
) -> Generator[tuple[int, Callable[[], FrameStatistics | None]], None, None]:
    """(number, what returns or raises its result) of each frame, in order."""
    if workers == 1:
        binner = _core.ColourBinner()
        for number, fill in fills:
            yield number, functools.partial(taken, number, fill, binner)
        return
    idle = collections.deque(_core.ColourBinner() for _ in range(workers))

    def work(number: int, fill: Fill) -> FrameStatistics | None:
        binner = idle.pop()
        try:
            return taken(number, fill, binner)
        finally:
            idle.append(binner)

    pool = concurrent.futures.ThreadPoolExecutor(workers, "palette4d-read")
    waiting: collections.deque[tuple[int, concurrent.futures.Future[FrameStatistics | None]]]
    waiting = collections.deque()
    try:
        for number, fill in fills:
            waiting.append((number, pool.submit(work, number, fill)))
            if len(waiting) > workers:  # one is ready to be taken up
                number, future = waiting.popleft()
                yield number, future.result
        for number, future in waiting:
            yield number, future.result
    finally:
        pool.shutdown(cancel_futures=True)


def _remarks(frames: Sequence[int], chosen: Sequence[int]) -> Iterator[str]:
    if len(chosen) < len(frames):
        step = frames.index(chosen[1])
        yield (
            f"the clip has {counted(len(frames), 'frame')}: one in {step} and the last are "
            f"analysed, {len(chosen)} in all; in between, colours are taken to change evenly"
        )


def _unused_alpha(premultiplied: bool) -> str:
    """Say that no pixel of a clip shows, and what that means for recolouring it."""
    text = "alpha is 0 in every pixel of the clip: it was taken for unused, and the clip for opaque"
    if premultiplied:
        text += (
            "; but recolouring leaves premultiplied pixels with alpha 0 as they are: write the "
            "frames without alpha, or with an alpha of 1, before they are graded"
        )
    return text


def gamut_box(
    statistics: list[FrameStatistics],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where palette colours may lie: the unit cube (section 3), grown to hold colours outside
    it."""
    low = np.minimum(0.0, np.min([s.low for s in statistics], axis=0))
    high = np.maximum(1.0, np.max([s.high for s in statistics], axis=0))
    return low, high
