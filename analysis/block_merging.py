"""Stage 3, section 5.3: merging blocks of topologically consistent frames.

Input: a palette for each frame and which neighbours are consistent. Output: few `Block`s, each
with one topology. A merge makes one block adopt the other's topology: its frames' palettes become
refinements of their neighbour's, frame after frame (eq. 9). Greedy, by the block configuration
loss (eqs. 8 and 10): `merge_sequence` down to one block, `merge_blocks` until the loss exceeds eta1
times its first value.
"""

from __future__ import annotations

import dataclasses
import heapq
import itertools
from collections.abc import Callable, Collection, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import palette_loss, refine_palette
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette
from palette4d.analysis.statistics import FrameStatistics

F64 = NDArray[np.float64]

# Of a frame's refinement: it starts where its neighbour's ended.
EVALUATIONS = 30
# Of its loss: a frame that its neighbour's palette fits so nearly as well shows the same.
SAME = 1e-3


@dataclasses.dataclass(frozen=True)
class Block:
    """Contiguous frames of one topology.

    Attributes
    ----------
    first : index of its first frame.
    palettes : one a frame; all have the same faces, and colour i corresponds to colour i.
    losses : L (eq. 4) of each frame.
    """

    first: int
    palettes: tuple[Palette, ...]
    losses: tuple[float, ...]

    def weighted_loss(self, frames: int, options: AnalysisOptions) -> float:
        """Sum of theta_i L_i over the block's frames (eqs. 8 and 10), not yet divided by N."""
        theta = _theta(len(self.palettes), len(self.palettes[0].rgb), frames, options)
        return theta * sum(self.losses)


def _theta(n: int, m: int, frames: int, options: AnalysisOptions) -> float:
    """Return eq. 10 for a block of n of all frames, with m colours."""
    return (1 + options.alpha * n / frames) * (1 + options.beta * m)


def initial_blocks(
    statistics: Sequence[FrameStatistics],
    palettes: Sequence[Palette],
    links: Sequence[Sequence[tuple[int, int]] | None],
    options: AnalysisOptions,
) -> list[Block]:
    """Group frames into blocks; links[i] are the one-to-one edges from frame i to i + 1, or None.

    Inside a block the colours are put in the order of its first frame.
    """
    blocks: list[Block] = []
    run: list[Palette] = []
    order = np.arange(0)
    for i, palette in enumerate(palettes):
        pairs = links[i - 1] if i else None
        if pairs is None:
            run, order = [palette], np.arange(len(palette.rgb))
        else:
            to = dict(pairs)
            order = np.array([to[int(v)] for v in order])
            run = [*run, Palette(palette.rgb[order], run[0].faces)]
        loss = palette_loss(statistics[i].coarse, run[-1].rgb, options)
        if pairs is None:
            blocks.append(Block(i, (run[0],), (loss,)))
        else:
            blocks[-1] = Block(blocks[-1].first, tuple(run), (*blocks[-1].losses, loss))
    return blocks


class Merge:
    """Merging `adopt` into its neighbour `keep`, before or after it (eq. 9), a frame at a time.

    Attributes
    ----------
    change : what it adds to the sum of theta_i L_i; while frames are missing, the least it can add.
    """

    def __init__(
        self,
        keep: Block,
        adopt: Block,
        statistics: Sequence[FrameStatistics],
        low: F64,
        high: F64,
        options: AnalysisOptions,
    ) -> None:
        self.keep, self.adopt = keep, adopt
        self.statistics, self.low, self.high, self.options = statistics, low, high, options
        self.forwards = keep.first < adopt.first
        self.palettes: list[Palette] = []
        self.losses: list[float] = []
        frames = len(statistics)
        self.before = keep.weighted_loss(frames, options) + adopt.weighted_loss(frames, options)
        self.theta = _theta(
            len(keep.palettes) + len(adopt.palettes), len(keep.palettes[0].rgb), frames, options
        )
        self.kept = sum(keep.losses)
        self.change = self.theta * self.kept - self.before

    @property
    def done(self) -> bool:
        """Whether no frame is missing."""
        return len(self.palettes) == len(self.adopt.palettes)

    def advance(self) -> None:
        """Refine the palette of the next frame, away from `keep`."""
        first, count, at = self.adopt.first, len(self.adopt.palettes), len(self.palettes)
        colours = self.statistics[first + (at if self.forwards else count - 1 - at)].coarse
        end = -1 if self.forwards else 0
        previous = self.palettes[-1] if at else self.keep.palettes[end]
        fitted = self.losses[-1] if at else self.keep.losses[end]
        loss = palette_loss(colours, previous.rgb, self.options)
        if abs(loss - fitted) > SAME * fitted:
            rgb = refine_palette(
                colours,
                previous.rgb,
                previous.faces,
                self.low,
                self.high,
                self.options,
                EVALUATIONS,
            )
            previous = Palette(rgb, previous.faces)
            loss = palette_loss(colours, rgb, self.options)
        self.palettes.append(previous)
        self.losses.append(loss)
        self.change = self.theta * (self.kept + sum(self.losses)) - self.before

    def finish(self) -> Block:
        """Return the merged block."""
        while not self.done:
            self.advance()
        keep, palettes, losses = self.keep, tuple(self.palettes), tuple(self.losses)
        if self.forwards:
            return Block(keep.first, (*keep.palettes, *palettes), (*keep.losses, *losses))
        return Block(
            self.adopt.first,
            (*reversed(palettes), *keep.palettes),
            (*reversed(losses), *keep.losses),
        )


def merge_sequence(
    blocks: Sequence[Block],
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
    apart: Collection[int] = (),
) -> Iterator[tuple[float, list[Block]]]:
    """Yield the configurations of greedy merging, from the given one down to one block, or to those
    that begin with the frames (indices) of `apart`: they are never merged with the one before.

    Each with its loss, the sum of theta_i L_i. A merge is followed only as far as it may still be
    the best: what it adds can but grow with its frames, since losses are never negative.
    """
    current = list(blocks)
    frames = len(statistics)
    total = sum(b.weighted_loss(frames, options) for b in current)
    yield total, list(current)
    tried: dict[tuple[int, int, bool], Merge] = {}
    while len(current) > 1:
        queue = []
        for i, (a, b) in enumerate(itertools.pairwise(current)):
            if b.first in apart:
                continue
            for keep, adopt in ((a, b), (b, a)):
                key = (id(keep), id(adopt), keep is a)
                if key not in tried:
                    tried[key] = Merge(keep, adopt, statistics, low, high, options)
                queue.append((tried[key].change, i, keep is b, tried[key]))
        if not queue:
            break
        heapq.heapify(queue)  # changes, then places: merges themselves are never compared
        while not queue[0][3].done:
            _, i, backwards, best = queue[0]
            best.advance()
            heapq.heapreplace(queue, (best.change, i, backwards, best))
        change, i, _, best = queue[0]
        gone = {id(current[i]), id(current[i + 1])}
        # Keys are object ids: forget those of the blocks that end here before their ids are used
        # again.
        tried = {key: value for key, value in tried.items() if not gone & set(key[:2])}
        current[i : i + 2] = [best.finish()]
        total += change
        yield total, list(current)


def merge_blocks(
    blocks: Sequence[Block],
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
    progress: Callable[[int, int], None] | None = None,
) -> list[Block]:
    """Merge greedily (section 5.3.3) until the loss exceeds eta1 times its first value, or one
    block is left; return the blocks, in order."""
    start = len(blocks)
    threshold, last = 0.0, list(blocks)
    for total, configuration in merge_sequence(blocks, statistics, low, high, options):
        if len(configuration) == start:
            threshold = options.eta1 * total
        elif total > threshold:
            break
        last = configuration
        if progress and start > 1:
            progress(start - len(configuration), start - 1)
    return last
