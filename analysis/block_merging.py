"""Stage 3, section 5.3: merging blocks of topologically consistent frames.

Input: a palette for each frame and which neighbours are consistent. Output: few `Block`s, each
with one topology. A merge makes one block adopt the other's topology: its frames' palettes become
refinements of their neighbour's, frame after frame (eq. 9). Greedy, by the block configuration
loss (eqs. 8 and 10), until it exceeds eta1 times its first value or one block is left.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.losses import palette_loss, refine_palette
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette
from palette4d.analysis.statistics import FrameStatistics

F64 = NDArray[np.float64]


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
        n, m = len(self.palettes), len(self.palettes[0].rgb)
        theta = (1 + options.alpha * n / frames) * (1 + options.beta * m)
        return theta * sum(self.losses)


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


def merge(
    keep: Block,
    adopt: Block,
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
) -> Block:
    """Merge `adopt` into its neighbour `keep`, before or after it: eq. 9, away from `keep`."""
    forwards = keep.first < adopt.first
    count = len(adopt.palettes)
    frames = range(adopt.first, adopt.first + count)
    palette = keep.palettes[-1 if forwards else 0]
    palettes, losses = [], []
    for i in frames if forwards else reversed(frames):
        colours = statistics[i].coarse
        rgb = refine_palette(colours, palette.rgb, palette.faces, low, high, options)
        palette = Palette(rgb, palette.faces)
        palettes.append(palette)
        losses.append(palette_loss(colours, rgb, options))
    if forwards:
        return Block(keep.first, (*keep.palettes, *palettes), (*keep.losses, *losses))
    return Block(
        adopt.first, (*reversed(palettes), *keep.palettes), (*reversed(losses), *keep.losses)
    )


def merge_blocks(
    blocks: Sequence[Block],
    statistics: Sequence[FrameStatistics],
    low: F64,
    high: F64,
    options: AnalysisOptions,
    progress: Callable[[int, int], None] | None = None,
) -> list[Block]:
    """Merge greedily (section 5.3.3) and return the blocks that are left, in order."""
    current = list(blocks)
    frames = len(statistics)
    total = sum(b.weighted_loss(frames, options) for b in current)
    threshold = options.eta1 * total
    tried: dict[tuple[int, int, bool], Block] = {}
    start = len(current)
    while len(current) > 1:
        best: tuple[float, int, Block] | None = None
        for i, (a, b) in enumerate(itertools.pairwise(current)):
            before = a.weighted_loss(frames, options) + b.weighted_loss(frames, options)
            for keep, adopt in ((a, b), (b, a)):
                key = (id(keep), id(adopt), keep is a)
                if key not in tried:
                    tried[key] = merge(keep, adopt, statistics, low, high, options)
                change = tried[key].weighted_loss(frames, options) - before
                if best is None or change < best[0]:
                    best = change, i, tried[key]
        assert best is not None
        change, i, merged = best
        if total + change > threshold:
            break
        gone = {id(current[i]), id(current[i + 1])}
        # Keys are object ids: forget those of the blocks that end here before their ids are used
        # again.
        tried = {key: value for key, value in tried.items() if not gone & set(key[:2])}
        current[i : i + 2] = [merged]
        total += change
        if progress:
            progress(start - len(current), start - 1)
    return current
