"""Vertex removal: what is predictable goes, splits, merges and ends stay, ghosts lie on their
edges."""

from __future__ import annotations

import numpy as np
import pytest
from analysis_frames import mixture, stats
from palette4d.analysis.frame_hulls import hull_mesh
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Palette
from palette4d.analysis.strands import Strands
from palette4d.analysis.vertex_removal import THINNED, remove_vertices, thin

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
FACES = hull_mesh(FOUR).faces
LINKS = ((0, 0), (1, 1), (2, 2), (3, 3))


def moving(count, bend=0.0, at=0):
    """`count` palettes drifting linearly; colour 1 bends by `bend` at frame `at`."""
    out = []
    for i in range(count):
        rgb = FOUR + 0.02 * i
        rgb[1, 2] += bend * max(0, 1 - abs(i - at) / at) if at else 0
        out.append(Palette(rgb, FACES))
    return out


def test_a_linear_drift_leaves_the_two_ends():
    palettes = moving(6)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)], first=10)
    strands = Strands([f.frame for f in frames], [palettes[:3], palettes[3:]], [LINKS])
    remove_vertices(strands, frames, AnalysisOptions(eta2=1.2))
    polytope = strands.polytope()
    assert len(polytope.vertices) == 8
    assert set(polytope.vertices[:, 3]) == {10, 15}
    # The edges run through the block boundary, in both blocks and in the transition.
    assert polytope.blocks[0].tracks == polytope.blocks[1].tracks == polytope.transitions[0].tracks
    assert len(polytope.edges()) == 4


def test_a_bend_keeps_its_vertex():
    palettes = moving(9, bend=0.4, at=4)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])
    strands = Strands(range(9), [palettes], [])
    remove_vertices(strands, frames, AnalysisOptions(eta2=1.5))
    inner = [v for v in strands.polytope().vertices if 0 < v[3] < 8]
    assert any(abs(v[3] - 4) <= 1 and v[2] > 0.4 for v in inner)


def test_splits_merges_and_ends_are_never_removed():
    five = np.vstack([FOUR, [[0.9, 0.9, 0.9]]])
    palettes = [hull_mesh(FOUR)] * 3 + [hull_mesh(five)] * 3
    links = ((0, 0), (1, 1), (2, 2), (3, 3), (3, 4))
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])
    strands = Strands(range(6), [palettes[:3], palettes[3:]], [links])
    splitting = strands.node[2][3]
    ends = {*strands.node[0], *strands.node[5]}
    remove_vertices(strands, frames, AnalysisOptions(eta2=1e6))
    assert strands.alive[splitting]
    assert all(strands.alive[v] for v in ends)
    assert sum(strands.alive) == len(ends) + 1


def test_strands_between_a_split_and_a_merge_do_not_become_one_edge():
    five = np.vstack([FOUR, [[0.9, 0.9, 0.9]]])
    four = hull_mesh(FOUR)
    split = ((0, 0), (1, 1), (2, 2), (3, 3), (3, 4))
    merge = tuple((j, i) for i, j in split)
    frames = stats([mixture(FOUR, i) for i in range(5)])
    blocks = [[four], [hull_mesh(five)] * 3, [four]]
    strands = Strands(range(5), blocks, [split, merge])
    remove_vertices(strands, frames, AnalysisOptions(eta2=1e6))
    edges = strands.polytope().edges()
    assert len(edges) == len({tuple(e) for e in edges.tolist()})
    assert len(strands.polytope().transitions[0].tracks) == 5
    assert len(set(strands.polytope().blocks[1].tracks)) == 5


def test_ghosts_lie_on_their_edges_and_losses_match():
    palettes = moving(7, bend=0.2, at=3)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)], first=100)
    strands = Strands([f.frame for f in frames], [palettes], [])
    options = AnalysisOptions(eta2=2.0)
    before = sum(
        palette_loss(f.coarse, p.rgb, options) for f, p in zip(frames, palettes, strict=True)
    )
    remove_vertices(strands, frames, options)
    after = sum(
        palette_loss(f.coarse, rgb, options)
        for f, rgb in zip(frames, strands.position, strict=True)
    )
    assert after <= 2 * before + 1e-3 * 7
    polytope = strands.polytope()
    for i, rgb in enumerate(strands.position):
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
    strands = Strands(range(frames), [palettes], [])
    remove_vertices(strands, statistics, AnalysisOptions(eta2=1e6))
    assert all(strands.alive)


def total(frames, palettes, options):
    pairs = zip(frames, palettes, strict=True)
    return sum(palette_loss(f.coarse, rgb, options) for f, rgb in pairs)


def test_thinning_is_quick_and_bounded():
    palettes = moving(12, bend=0.5, at=5)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])
    options = AnalysisOptions()
    strands = Strands(range(12), [palettes], [])
    before = total(frames, strands.position, options)
    losses = thin(strands, frames, options)
    assert losses.sum() == pytest.approx(total(frames, strands.position, options))
    assert losses.sum() <= THINNED * before + 1e-3 * 12
    left = strands.polytope().vertices
    assert len(left) <= 10  # of 48; 8 of them stand at the ends
    assert any(3 <= v[3] <= 7 and v[2] > 0.4 for v in left)  # the bend is kept


@pytest.mark.parametrize("count", [1, 2])
def test_thinning_one_or_two_frames_changes_nothing(count):
    palettes = moving(count)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])
    strands = Strands(range(count), [palettes], [])
    thin(strands, frames, AnalysisOptions())
    assert all(strands.alive)
