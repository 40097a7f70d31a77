"""The paper's own rules: when merging and removal stop, and refinement one vertex at a time."""

from __future__ import annotations

import numpy as np
import pytest
from analysis_frames import mixture, stats
from bent_track import bent, colours_at
from palette4d.analysis.baselines.paper_thresholds import (
    merge_blocks,
    refine_vertices,
    remove_vertices,
)
from palette4d.analysis.block_merging import initial_blocks
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.dense_polytope import DensePolytope
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.losses import loss_weights, palette_loss, smoothness
from palette4d.analysis.objective import loss_of
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette

GAMUT = Gamut(np.zeros(3), np.ones(3))


@pytest.fixture
def frames():
    truth = bent(4.0)
    return stats([mixture(colours_at(truth, t), t) for t in range(11)])


def refinement_loss(polytope, frames, options):
    rows, _ = loss_of(polytope, frames).evaluate(
        polytope.vertices, list(range(len(frames))), loss_weights(options), 1, False
    )
    k, _ = smoothness(polytope.vertices, polytope.edges(), polytope.length())
    return options.lambda_ * rows[:, 0].mean() + rows[:, 1].mean() + options.gamma * k


def test_loss_falls_and_a_vertex_finds_its_time(frames):
    options = AnalysisOptions(convexity=0.0, separation=0.0)
    start = bent(6.0)
    refined = refine_vertices(start, frames, GAMUT, options)
    assert refinement_loss(refined, frames, options) < 0.6 * refinement_loss(start, frames, options)
    assert refined.vertices[8, 3] < 5.2  # the bend is at 4


def test_box_and_fixed_times(frames):
    options = AnalysisOptions(refinement_cycles=1, refinement_box=0.03)
    start = bent(6.0)
    refined = refine_vertices(start, frames, GAMUT, options)
    # One cycle moves a vertex once alone and once with the others: twice the box.
    assert np.abs(refined.vertices[:, :3] - start.vertices[:, :3]).max() <= 0.06 + 1e-9
    np.testing.assert_array_equal(refined.vertices[:8, 3], start.vertices[:8, 3])
    assert 0 < refined.vertices[8, 3] < 10


def test_no_cycles_is_no_change(frames):
    start = bent()
    refined = refine_vertices(start, frames, GAMUT, AnalysisOptions(refinement_cycles=0))
    np.testing.assert_array_equal(refined.vertices, start.vertices)


def test_the_result_does_not_depend_on_threads(frames):
    results = [
        refine_vertices(bent(), frames, GAMUT, AnalysisOptions(refinement_cycles=1, threads=n))
        for n in (1, 2, 5)
    ]
    for other in results[1:]:
        np.testing.assert_array_equal(results[0].vertices, other.vertices)


FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
FACES = hull_mesh(FOUR).faces
LINKS = ((0, 0), (1, 1), (2, 2), (3, 3))


def moving(count, bend=0.0, at=0):
    """`count` palettes drifting linearly; colour 1 bends by `bend` at frame `at`."""
    out = []
    for i in range(count):
        rgb = FOUR + 0.02 * i
        rgb[1, 2] += bend * max(0, 1 - abs(i - at) / at) if at else 0
        out.append(FramePalette(rgb, FACES))
    return out


def test_a_linear_drift_leaves_the_two_ends():
    palettes = moving(6)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)], first=10)
    dense = DensePolytope([f.frame for f in frames], [palettes[:3], palettes[3:]], [LINKS])
    remove_vertices(dense, frames, AnalysisOptions(eta2=1.2))
    polytope = dense.polytope()
    assert len(polytope.vertices) == 8
    assert set(polytope.vertices[:, 3]) == {10, 15}
    # The edges run through the block boundary, in both blocks and in the transition.
    assert polytope.blocks[0].tracks == polytope.blocks[1].tracks == polytope.transitions[0].tracks
    assert len(polytope.edges()) == 4


def test_a_bend_keeps_its_vertex():
    palettes = moving(9, bend=0.4, at=4)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])
    dense = DensePolytope(range(9), [palettes], [])
    remove_vertices(dense, frames, AnalysisOptions(eta2=1.5))
    inner = [v for v in dense.polytope().vertices if 0 < v[3] < 8]
    assert any(abs(v[3] - 4) <= 1 and v[2] > 0.4 for v in inner)


def test_splits_merges_and_ends_are_never_removed():
    five = np.vstack([FOUR, [[0.9, 0.9, 0.9]]])
    palettes = [hull_mesh(FOUR)] * 3 + [hull_mesh(five)] * 3
    links = ((0, 0), (1, 1), (2, 2), (3, 3), (3, 4))
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])
    dense = DensePolytope(range(6), [palettes[:3], palettes[3:]], [links])
    splitting = dense.node[2][3]
    ends = {*dense.node[0], *dense.node[5]}
    remove_vertices(dense, frames, AnalysisOptions(eta2=1e6))
    assert dense.alive[splitting]
    assert all(dense.alive[v] for v in ends)
    assert sum(dense.alive) == len(ends) + 1


def test_strands_between_a_split_and_a_merge_do_not_become_one_edge():
    five = np.vstack([FOUR, [[0.9, 0.9, 0.9]]])
    four = hull_mesh(FOUR)
    split = ((0, 0), (1, 1), (2, 2), (3, 3), (3, 4))
    merge = tuple((j, i) for i, j in split)
    frames = stats([mixture(FOUR, i) for i in range(5)])
    blocks = [[four], [hull_mesh(five)] * 3, [four]]
    dense = DensePolytope(range(5), blocks, [split, merge])
    remove_vertices(dense, frames, AnalysisOptions(eta2=1e6))
    edges = dense.polytope().edges()
    assert len(edges) == len({tuple(e) for e in edges.tolist()})
    assert len(dense.polytope().transitions[0].tracks) == 5
    assert len(set(dense.polytope().blocks[1].tracks)) == 5


def test_ghosts_lie_on_their_edges_and_losses_match():
    palettes = moving(7, bend=0.2, at=3)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)], first=100)
    dense = DensePolytope([f.frame for f in frames], [palettes], [])
    options = AnalysisOptions(eta2=2.0)
    before = sum(
        palette_loss(f.coarse, p.rgb, options) for f, p in zip(frames, palettes, strict=True)
    )
    remove_vertices(dense, frames, options)
    after = sum(
        palette_loss(f.coarse, rgb, options) for f, rgb in zip(frames, dense.position, strict=True)
    )
    assert after <= 2 * before + 1e-3 * 7
    polytope = dense.polytope()
    for i, rgb in enumerate(dense.position):
        for s, track in enumerate(polytope.blocks[0].tracks):
            times = polytope.vertices[list(track), 3]
            expected = [
                np.interp(100 + i, times, polytope.vertices[list(track), c]) for c in range(3)
            ]
            np.testing.assert_allclose(rgb[s], expected, atol=1e-12)


@pytest.mark.parametrize("frames", [1, 2])
def test_nothing_to_remove_in_one_or_two_frames(frames):
    palettes = moving(frames)
    statistics = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])
    dense = DensePolytope(range(frames), [palettes], [])
    remove_vertices(dense, statistics, AnalysisOptions(eta2=1e6))
    assert all(dense.alive)


FIVE = np.vstack([FOUR, [[0.9, 0.9, 0.9]]])


def test_merging_stops_at_eta1():
    clip = stats([mixture(np.clip((FOUR, FIVE)[i > 2] + 0.01 * i, 0, 1), i) for i in range(6)])
    palettes = [hull_mesh(FOUR)] * 3 + [hull_mesh(FIVE)] * 3
    singles = initial_blocks(clip, palettes, [None] * 5, AnalysisOptions())
    start = sum(b.weighted_loss(6, AnalysisOptions()) for b in singles)
    seen = []
    for eta1 in (1.0, 2.0, 1e6):
        options = AnalysisOptions(eta1=eta1)
        blocks = merge_blocks(singles, clip, GAMUT, options)
        assert blocks[0].first == 0
        assert sum(len(b.palettes) for b in blocks) == 6
        total = sum(b.weighted_loss(6, options) for b in blocks)
        assert total <= eta1 * start * (1 + 1e-12)
        seen.append(len(blocks))
    assert seen == sorted(seen, reverse=True)
    assert seen[-1] == 1
