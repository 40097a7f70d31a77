"""Colour statistics: the weighted colours that the analysis keeps for each frame.

Input: a clip, or an image. Output: k-d trees of bounded size. Memory does not grow with the
resolution, nor, beyond `MOST_COLOURS`, with the number of frames. Pixels that are not finite or
have an alpha below 1/255 do not count. If that leaves no pixel in any frame, alpha is ignored.

The losses of section 3 are exact for 8-bit frames whose distinct colours are all kept. Otherwise
the colours are a sample, dense near the hull of the frame's colours. Tests measure its error.
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
from palette4d.analysis.frame_statistics import FrameStatistics, pooled
from palette4d.analysis.losses import LOST_SHARE, thread_count
from palette4d.analysis.options import AnalysisOptions

from palette4d import _core
from palette4d.common.text import counted
from palette4d.media import colour_histogram
from palette4d.media.clip_base import Fill, FrameError, named

if TYPE_CHECKING:
    from palette4d.media.clip import Clip

# Pixels between two calls that return freed memory to the system. glibc would keep the gaps that
# frames of different sizes leave.
TRIM_EVERY = 50_000_000
# Colours kept for all frames together, about 100 MB. Four times as many gave no better palettes.
MOST_COLOURS = 2_000_000
# Clips below SHORT frames keep more coarse colours per frame, at most RICHER times as many.
SHORT, RICHER = 48, 2
# In a longer clip only every n-th frame is analysed: a palette is linear in time anyway.
MOST_FRAMES = 3000
# Least colours and coarse colours per frame, for any number of frames.
FEWEST_COLOURS, FEWEST_COARSE = 1024, 512
# Cap on the memory of frames that are read at the same time, in bytes, and of each binner's table.
MEMORY, TABLE = 400 << 20, 64 << 20
# Least number of pixels that extend a border outside 0..1, and its cap as a share of the frame.
FEWEST_OUTSIDE, MOST_OUTSIDE_SHARE = 5, 0.01
# Least distance of an outlier, as a share of the extent of the clip's other colours. Nearer colours
# hardly change a hull and may belong to a true highlight.
OUTLYING = 0.1

Progress = Callable[[int, int], object]


@dataclasses.dataclass(frozen=True)
class ClipStatistics:
    """The statistics of frames by number (None if no pixel counts), and notes for the user.

    Notes are about frames left out, unused alpha and clipped outliers. The clip lists bad frames.
    """

    frames: dict[int, FrameStatistics | None]
    notes: tuple[str, ...]


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
    """Read the frames of a clip, one after the other, and keep their statistics.

    Frames are read and binned in `options.threads` threads, as far as memory allows; the result
    does not depend on their number.

    Raises
    ------
    FrameError
        For the first bad frame, or, with `Clip.skip_bad_frames`, when every frame is bad.
    """
    chosen = chosen_frames(clip.frames)
    colours, coarse = budget(len(chosen), options)
    pixels = clip.width * clip.height
    statistics: dict[int, FrameStatistics | None] = {}
    hidden: set[int] = set()

    def statistics_of(
        number: int, fill: Fill, binner: _core.ColourBinner
    ) -> FrameStatistics | None:
        try:
            if fill(binner):
                hidden.add(number)
            return _taken(number, binner, colours, coarse, pixels)
        finally:
            binner.clear()

    most = min(MEMORY // (TABLE + 12 * pixels), len(chosen))
    workers = max(1, min(thread_count(options), most))
    # Close the generator to end its threads: the traceback of an error would keep them alive.
    with contextlib.closing(_in_order(clip.fills(chosen), statistics_of, workers)) as results:
        for done, (number, result) in enumerate(results, start=1):
            try:
                statistics[number] = result()
            except FrameError:
                if not clip.skip_bad_frames:
                    raise
                clip.skip(number)
            if done % max(1, TRIM_EVERY // pixels) == 0:
                _core.return_memory()
            if progress:
                progress(done, len(chosen))
    if not statistics:
        raise clip.none_readable()
    notes = []
    if len(chosen) < len(clip.frames):
        notes.append(
            f"the clip has {counted(len(clip.frames), 'frame')}: one in "
            f"{clip.frames.index(chosen[1])} and the last are analysed, {len(chosen)} in all; "
            "colours change linearly between them"
        )
    if any(statistics[number] is not None for number in statistics.keys() - hidden):
        statistics |= dict.fromkeys(hidden)  # alpha is used, and these frames are fully transparent
    elif hidden:
        notes.append(_unused_alpha(clip.premultiplied))
    usable = {number: frame for number, frame in statistics.items() if frame is not None}
    kept, outliers = without_outliers(usable, options, colours, coarse)
    return ClipStatistics({**statistics, **kept}, (*notes, *outliers))


def chosen_frames(frames: Sequence[int]) -> list[int]:
    """Return all frames; in very long clips every n-th frame and the last."""
    step = -(-(len(frames) - 1) // (MOST_FRAMES - 1)) if len(frames) > MOST_FRAMES else 1
    chosen = list(frames[::step])
    return chosen if chosen[-1] == frames[-1] else [*chosen, frames[-1]]


def budget(frames: int, options: AnalysisOptions) -> tuple[int, int]:
    """Return how many colours and coarse colours to keep per frame of a clip of this length."""
    share = MOST_COLOURS / (frames * (options.colours + options.coarse_colours))
    if share >= 1:
        richer = min(RICHER, max(1.0, SHORT / frames))
        return options.colours, min(options.colours, int(richer * options.coarse_colours))
    return (
        min(options.colours, max(FEWEST_COLOURS, int(share * options.colours))),
        min(options.coarse_colours, max(FEWEST_COARSE, int(share * options.coarse_colours))),
    )


def without_outliers(
    frames: Mapping[int, FrameStatistics], options: AnalysisOptions, colours: int, coarse: int
) -> tuple[dict[int, FrameStatistics], tuple[str, ...]]:
    """Return frames whose outliers are clipped to the border of the other colours, and a note.

    Each channel has a lower and an upper border, never inside 0..1. A border is the farthest value
    that enough pixels of one frame reach: `LOST_SHARE` of a frame, at most `options.k`. That many
    pixels justify a handle. Pixels are counted per frame, because a hot pixel is in all frames.
    The borders hold for the whole clip, so that a highlight may begin small. Frames without
    outliers are returned unchanged.
    """
    if not frames:
        return {}, ()
    reached = np.array([_reached(frame, options) for frame in frames.values()])  # (n, 2, 3)
    low, high = reached[:, 0].min(axis=0), reached[:, 1].max(axis=0)
    margin = OUTLYING * (high - low)
    least = np.min([frame.low for frame in frames.values()], axis=0)
    most = np.max([frame.high for frame in frames.values()], axis=0)
    low = np.where(least < low - margin, low, -np.inf)
    high = np.where(most > high + margin, high, np.inf)
    kept: dict[int, FrameStatistics] = {}
    pixels, farthest = 0.0, 0.0
    for number, frame in frames.items():
        if np.all(frame.low >= low) and np.all(frame.high <= high):
            continue
        rgb, counts = frame.colours.rgb, frame.colours.counts
        clipped = np.clip(rgb, low, high)
        distance = np.abs(rgb - clipped).max(axis=1)
        pixels += counts[distance > 0].sum()
        farthest = max(farthest, float(distance.max()))
        binner = _core.ColourBinner()
        binner.add_colours(clipped, counts)
        taken = binner.take(colours, coarse)
        assert taken is not None  # frames without pixels have no tree
        fine, coarser, lowest, highest = taken
        kept[number] = dataclasses.replace(
            frame, colours=fine, coarse=coarser, low=lowest, high=highest
        )
    if not kept:
        return dict(frames), ()
    note = (
        f"{counted(max(1, round(pixels)), 'pixel lies', 'pixels lie')} far outside 0..1 and the "
        f"clip's other colours, by up to {farthest:.3g} ({named(list(kept))}): for the palette "
        "they are clipped to the other colours; k=1 keeps them"
    )
    return dict(frames) | kept, (note,)


def _reached(frame: FrameStatistics, options: AnalysisOptions) -> NDArray[np.float64]:
    """Return the (2, 3) least and largest values of each channel that enough pixels reach.

    The least values are at most 0, the largest at least 1.
    """
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
            # Rounding may leave the mean of counts just below a whole number.
            reaching = np.flatnonzero(np.cumsum(frame.colours.counts[outside]) >= enough - 1e-6)
            if len(reaching):
                out[side, channel] = sign * values[outside[reaching[0]]]
    return out


def _taken(
    frame: int, binner: _core.ColourBinner, colours: int, coarse: int, pixels: int
) -> FrameStatistics | None:
    """Return the statistics of a frame; its counted pixels represent all of its `pixels`."""
    looked_at = binner.pixels + binner.ignored
    scale = pixels / looked_at if looked_at else 1.0
    count, ignored = round(scale * binner.pixels), round(scale * binner.ignored)
    least = colour_histogram.LEAST_COLOURS
    taken = binner.take(max(colours, least), coarse, scale)
    if taken is None:
        return None
    fine, coarser, low, high = taken
    histogram = colour_histogram.histogram(fine.rgb, fine.counts)
    if colours < least:  # of a very long clip
        fine = pooled([fine], colours)
    return FrameStatistics(frame, fine, coarser, histogram, low, high, count, ignored)


def _in_order(
    fills: Iterator[tuple[int, Fill]],
    taken: Callable[[int, Fill, _core.ColourBinner], FrameStatistics | None],
    workers: int,
) -> Generator[tuple[int, Callable[[], FrameStatistics | None]], None, None]:
    """Yield each frame's number and a function that returns or raises its result, in order."""
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
            if len(waiting) > workers:
                number, future = waiting.popleft()
                yield number, future.result
        for number, future in waiting:
            yield number, future.result
    finally:
        pool.shutdown(cancel_futures=True)


def _unused_alpha(premultiplied: bool) -> str:
    """Return the note for a clip whose pixels all have alpha 0, and its effect on recolouring."""
    text = "alpha is 0 in every pixel of the clip: it was ignored, and the clip taken for opaque"
    if premultiplied:
        text += (
            "; recolouring leaves premultiplied pixels with alpha 0 as they are, so write the "
            "frames without alpha, or with an alpha of 1, before they are graded"
        )
    return text
