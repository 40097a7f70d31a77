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
import dataclasses
import functools
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from palette4d import _core
from palette4d.analysis import colour_histogram
from palette4d.analysis.clip_base import Fill, FrameError
from palette4d.analysis.losses import thread_count
from palette4d.analysis.options import AnalysisOptions
from palette4d.wording import counted

if TYPE_CHECKING:
    from palette4d.analysis.clip import Clip

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

    remarks says what was left out to stay within bounds, and whether alpha was. Bad frames are
    listed by the clip.
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
    results = _in_order(clip.fills(chosen), taken, workers)
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
    return ClipStatistics(found, tuple(remarks))


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
) -> Iterator[tuple[int, Callable[[], FrameStatistics | None]]]:
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
