"""Block merging: consistent frames form blocks, blocks merge greedily, eqs. 9 and 10 hold."""

from __future__ import annotations

import numpy as np
import pytest
from analysis_frames import mixture, stats
from palette4d.analysis.block_merging import Block, initial_blocks, merge, merge_blocks
from palette4d.analysis.frame_hulls import hull_mesh
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette

LOW, HIGH = np.zeros(3), np.ones(3)
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
    shuffled = Palette(base.rgb[order], np.argsort(order)[base.faces].astype(np.int32))
    links = [[(int(v), int(np.argsort(order)[v])) for v in range(4)], None]
    blocks = initial_blocks(clip[:3], [base, shuffled, base], links, OPTIONS)
    assert [(b.first, len(b.palettes)) for b in blocks] == [(0, 2), (2, 1)]
    np.testing.assert_array_equal(blocks[0].palettes[1].rgb, base.rgb)
    assert blocks[0].losses[1] == palette_loss(clip[1].coarse, base.rgb, OPTIONS)


def test_merging_goes_away_from_the_block_that_keeps_its_topology(clip):
    early = Block(0, (hull_mesh(FOUR),), (1.0,))
    late = Block(1, (hull_mesh(FIVE), hull_mesh(FIVE)), (1.0, 1.0))
    forwards = merge(early, late, clip, LOW, HIGH, OPTIONS)
    assert (forwards.first, len(forwards.palettes)) == (0, 3)
    assert {len(p.rgb) for p in forwards.palettes} == {4}
    assert forwards.palettes[0] is early.palettes[0]
    backwards = merge(late, early, clip, LOW, HIGH, OPTIONS)
    assert (backwards.first, len(backwards.palettes)) == (0, 3)
    assert {len(p.rgb) for p in backwards.palettes} == {5}
    assert backwards.palettes[1:] == late.palettes
    for i, (palette, loss) in enumerate(
        zip(forwards.palettes[1:], forwards.losses[1:], strict=True), 1
    ):
        assert loss == palette_loss(clip[i].coarse, palette.rgb, OPTIONS)
        np.testing.assert_array_equal(palette.faces, early.palettes[0].faces)


def test_merging_stops_at_eta1(clip):
    palettes = [hull_mesh(FOUR)] * 3 + [hull_mesh(FIVE)] * 3
    singles = initial_blocks(clip, palettes, [None] * 5, OPTIONS)
    start = sum(b.weighted_loss(6, OPTIONS) for b in singles)
    seen = []
    for eta1 in (1.0, 2.0, 1e6):
        options = AnalysisOptions(eta1=eta1)
        blocks = merge_blocks(singles, clip, LOW, HIGH, options)
        assert blocks[0].first == 0
        assert sum(len(b.palettes) for b in blocks) == 6
        total = sum(b.weighted_loss(6, options) for b in blocks)
        assert total <= eta1 * start * (1 + 1e-12)
        seen.append(len(blocks))
    assert seen == sorted(seen, reverse=True)
    assert seen[-1] == 1
