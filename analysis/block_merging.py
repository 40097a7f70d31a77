"""Block merging, section 5.3: blocks of topologically consistent frames.

Input: a palette for each frame, and which neighbours are consistent. Output: few `Block`s, each
with one topology. A merge gives one block the topology of the other. Frame after frame, a palette
is replaced by the refined palette of its neighbour (eq. 9). Merging is greedy and minimises the
block configuration loss (eqs. 8 and 10).
"""

from __future__ import annotations

import dataclasses
import heapq
import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.losses import EVALUATIONS, palette_loss, refine_palette
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette


@dataclasses.dataclass(frozen=True)
class Block:
    """Contiguous frames of one topology.

    Attributes
    ----------
    first : index of its first frame.
    palettes : one per frame; all have the same faces, and colour i corresponds to colour i.
    losses : L (eq. 4) of each frame.
    """

    first: int
    palettes: tuple[FramePalette, ...]
    losses: tuple[float, ...]

    def weighted_loss(self, frames: int, options: AnalysisOptions) -> float:
        """Sum of theta_i L_i over the block's frames (eqs. 8 and 10), not yet divided by N."""
        theta = _theta(len(self.palettes), len(self.palettes[0].rgb), frames, options)
        return theta * sum(self.losses)


def _theta(n: int, m: int, frames: int, options: AnalysisOptions) -> float:
    """Return eq. 10 for a block of n of all frames, with m colours."""
    return (1 + options.alpha * n / frames) * (1 + options.beta * m)


def initial_blocks(
    frames: Sequence[FrameStatistics],
    palettes: Sequence[FramePalette],
    links: Sequence[Sequence[tuple[int, int]] | None],
    options: AnalysisOptions,
) -> list[Block]:
    """Group frames into blocks; links[i] are the one-to-one edges from frame i to i + 1, or None.

    All palettes of a block have the order of its first frame.
    """
    blocks: list[Block] = []
    run: list[FramePalette] = []
    order = np.arange(0)
    for i, palette in enumerate(palettes):
        pairs = links[i - 1] if i else None
        if pairs is None:
            run, order = [palette], np.arange(len(palette.rgb))
        else:
            to = dict(pairs)
            order = np.array([to[int(v)] for v in order])
            run = [*run, FramePalette(palette.rgb[order], run[0].faces)]
        loss = palette_loss(frames[i].coarse, run[-1].rgb, options)
        if pairs is None:
            blocks.append(Block(i, (run[0],), (loss,)))
        else:
            blocks[-1] = Block(blocks[-1].first, tuple(run), (*blocks[-1].losses, loss))
    return blocks


class Merge:
    """A merge in progress: `adopt` takes the topology of its neighbour `keep` (eq. 9).

    Attributes
    ----------
    change : the increase of the sum of theta_i L_i; a lower bound until all frames are done.
    """

    def __init__(
        self,
        keep: Block,
        adopt: Block,
        frames: Sequence[FrameStatistics],
        gamut: Gamut,
        options: AnalysisOptions,
    ) -> None:
        self.keep, self.adopt = keep, adopt
        self.frames, self.gamut, self.options = frames, gamut, options
        self.forwards = keep.first < adopt.first
        self.palettes: list[FramePalette] = []
        self.losses: list[float] = []
        n = len(frames)
        self.before = keep.weighted_loss(n, options) + adopt.weighted_loss(n, options)
        count = len(keep.palettes) + len(adopt.palettes)
        self.theta = _theta(count, len(keep.palettes[0].rgb), n, options)
        self.kept = sum(keep.losses)
        self.change = self.theta * self.kept - self.before

    @property
    def done(self) -> bool:
        """Whether all frames are done."""
        return len(self.palettes) == len(self.adopt.palettes)

    def advance(self) -> None:
        """Refine the palette of the next frame, away from `keep`."""
        first, count, index = self.adopt.first, len(self.adopt.palettes), len(self.palettes)
        colours = self.frames[first + (index if self.forwards else count - 1 - index)].coarse
        end = -1 if self.forwards else 0
        previous = self.palettes[-1] if index else self.keep.palettes[end]
        rgb = refine_palette(colours, previous, self.gamut, self.options, EVALUATIONS)
        self.palettes.append(FramePalette(rgb, previous.faces))
        self.losses.append(palette_loss(colours, rgb, self.options))
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
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    options: AnalysisOptions,
) -> Iterator[tuple[float, list[Block]]]:
    """Yield the configurations of greedy merging and their losses, from `blocks` to one block.

    The loss is the sum of theta_i L_i. A merge continues only while it may be the best. Its change
    never decreases from frame to frame, because losses are never negative.
    """
    current = list(blocks)
    total = sum(b.weighted_loss(len(frames), options) for b in current)
    yield total, list(current)
    tried: dict[tuple[int, int], Merge] = {}
    while len(current) > 1:
        queue = []
        for i, (a, b) in enumerate(itertools.pairwise(current)):
            for keep, adopt in ((a, b), (b, a)):
                key = (id(keep), id(adopt))
                if key not in tried:
                    tried[key] = Merge(keep, adopt, frames, gamut, options)
                queue.append((tried[key].change, i, keep is b, tried[key]))
        heapq.heapify(queue)  # the place breaks ties: merges themselves cannot be compared
        while not queue[0][3].done:
            _, i, backwards, best = queue[0]
            best.advance()
            heapq.heapreplace(queue, (best.change, i, backwards, best))
        change, i, _, best = queue[0]
        gone = {id(current[i]), id(current[i + 1])}
        # Python reuses object ids: forget the merges of blocks that end here.
        tried = {key: value for key, value in tried.items() if not gone & set(key)}
        current[i : i + 2] = [best.finish()]
        total += change
        yield total, list(current)


def placed(
    blocks: Sequence[Block],
    sampled: Sequence[FrameStatistics],
    frames: Sequence[FrameStatistics],
    options: AnalysisOptions,
) -> tuple[list[Block], list[FrameStatistics]]:
    """Extend the blocks of `sampled` frames in `frames`; return them, and the frames they cover.

    In the gap between two blocks, frames before the boundary keep the earlier block's last palette
    and frames after it the later block's first. The boundary is where the sum of losses is least.
    """
    index = {frame.frame: i for i, frame in enumerate(frames)}
    out, kept = [blocks[0]], [sampled[i] for i in range(len(blocks[0].palettes))]
    for block in blocks[1:]:
        start, before = block.first, out[-1]
        own = list(sampled[start:][: len(block.palettes)])
        gap = frames[index[sampled[start - 1].frame] + 1 : index[sampled[start].frame]]
        if gap:
            early, late = before.palettes[-1], block.palettes[0]
            first = [palette_loss(f.coarse, early.rgb, options) for f in gap]
            second = [palette_loss(f.coarse, late.rgb, options) for f in gap]
            sums = [sum(first[:n]) + sum(second[n:]) for n in range(len(gap) + 1)]
            boundary = int(np.argmin(sums))
            if boundary > 0:
                kept.append(gap[boundary - 1])
                out[-1] = Block(
                    before.first, (*before.palettes, early), (*before.losses, first[boundary - 1])
                )
            if boundary < len(gap):
                own.insert(0, gap[boundary])
                block = Block(start, (late, *block.palettes), (second[boundary], *block.losses))
        out.append(dataclasses.replace(block, first=len(kept)))
        kept += own
    return out, kept
