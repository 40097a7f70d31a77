"""Block merging: consistent frames form blocks, blocks merge greedily, eqs. 9 and 10 hold."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from analysis_frames import mixture, stats
from palette4d.analysis.block_merging import (
    Block,
    Merge,
    initial_blocks,
    merge_sequence,
)
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette

GAMUT = Gamut(np.zeros(3), np.ones(3))
OPTIONS = AnalysisOptions()
FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
FIVE = np.vstack([FOUR, [[0.9, 0.9, 0.9]]])


@pytest.fixture
def clip():
    """Three frames of four colours, then three of five, drifting."""
    images = [mixture(FOUR + 0.01 * i, i) for i in range(3)]
    images += [mixture(np.clip(FIVE + 0.01 * i, 0, 1), i) for i in range(3, 6)]
    return stats(images)


def test_weights_of_equation_10():
    palette = hull_mesh(FOUR)
    block = Block(0, (palette,) * 3, (0.1, 0.2, 0.3))
    theta = (1 + 10 * 3 / 50) * (1 + 1 * 4)
    assert block.weighted_loss(50, OPTIONS) == pytest.approx(theta * 0.6)


def test_initial_blocks_follow_the_links(clip):
    base = hull_mesh(FOUR)
    order = np.array([2, 0, 3, 1])
    shuffled = FramePalette(base.rgb[order], np.argsort(order)[base.faces].astype(np.int32))
    links = [[(int(v), int(np.argsort(order)[v])) for v in range(4)], None]
    blocks = initial_blocks(clip[:3], [base, shuffled, base], links, OPTIONS)
    assert [(b.first, len(b.palettes)) for b in blocks] == [(0, 2), (2, 1)]
    np.testing.assert_array_equal(blocks[0].palettes[1].rgb, base.rgb)
    assert blocks[0].losses[1] == palette_loss(clip[1].coarse, base.rgb, OPTIONS)


def test_merging_goes_away_from_the_block_that_keeps_its_topology(clip):
    early = Block(0, (hull_mesh(FOUR),), (1.0,))
    late = Block(1, (hull_mesh(FIVE), hull_mesh(FIVE)), (1.0, 1.0))
    forwards = Merge(early, late, clip, GAMUT, OPTIONS).finish()
    assert (forwards.first, len(forwards.palettes)) == (0, 3)
    assert {len(p.rgb) for p in forwards.palettes} == {4}
    assert forwards.palettes[0] is early.palettes[0]
    backwards = Merge(late, early, clip, GAMUT, OPTIONS).finish()
    assert (backwards.first, len(backwards.palettes)) == (0, 3)
    assert {len(p.rgb) for p in backwards.palettes} == {5}
    assert backwards.palettes[1:] == late.palettes
    for i, (palette, loss) in enumerate(
        zip(forwards.palettes[1:], forwards.losses[1:], strict=True), 1
    ):
        assert loss == palette_loss(clip[i].coarse, palette.rgb, OPTIONS)
        np.testing.assert_array_equal(palette.faces, early.palettes[0].faces)


def test_the_greedy_choice_is_that_of_trying_every_merge(clip):
    """Merges are followed lazily, by a lower bound; the result is that of following all."""
    palettes = [hull_mesh(FOUR)] * 3 + [hull_mesh(FIVE)] * 3
    current = initial_blocks(clip, palettes, [None] * 5, OPTIONS)
    for total, blocks in merge_sequence(current, clip, GAMUT, OPTIONS):
        assert total == pytest.approx(sum(b.weighted_loss(6, OPTIONS) for b in blocks))
        if len(blocks) < len(current):
            tried = []
            for i, (a, b) in enumerate(itertools.pairwise(current)):
                for keep, adopt in ((a, b), (b, a)):
                    merged = Merge(keep, adopt, clip, GAMUT, OPTIONS).finish()
                    tried.append([*current[:i], merged, *current[i + 2 :]])
            best = min(tried, key=lambda c: sum(b.weighted_loss(6, OPTIONS) for b in c))
            assert [b.first for b in best] == [b.first for b in blocks]
            for one, other in zip(best, blocks, strict=True):
                assert one.losses == other.losses
        current = blocks
    assert len(current) == 1


def test_the_bound_of_an_unfinished_merge_never_falls(clip):
    early = Block(0, (hull_mesh(FOUR),), (1.0,))
    late = Block(1, (hull_mesh(FIVE),) * 4, (1.0,) * 4)
    trial = Merge(early, late, clip, GAMUT, OPTIONS)
    bounds = [trial.change]
    while not trial.done:
        trial.advance()
        bounds.append(trial.change)
    assert bounds == sorted(bounds)
    before = early.weighted_loss(6, OPTIONS) + late.weighted_loss(6, OPTIONS)
    merged = trial.finish()
    assert bounds[-1] == pytest.approx(merged.weighted_loss(6, OPTIONS) - before)
