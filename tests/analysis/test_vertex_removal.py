"""Vertex removal: vertices on straight paths go at once, vertices at bends stay."""

from __future__ import annotations

import numpy as np
import pytest
from analysis_frames import mixture, stats
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.dense_polytope import DensePolytope
from palette4d.analysis.losses import palette_loss
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette
from palette4d.analysis.vertex_removal import THINNED, thin_out

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
FACES = hull_mesh(FOUR).faces


def moving(count, bend=0.0, at=0):
    """`count` palettes drifting linearly; colour 1 bends by `bend` at frame `at`."""
    out = []
    for i in range(count):
        rgb = FOUR + 0.02 * i
        rgb[1, 2] += bend * max(0, 1 - abs(i - at) / at) if at else 0
        out.append(FramePalette(rgb, FACES))
    return out


def total(frames, palettes, options):
    pairs = zip(frames, palettes, strict=True)
    return sum(palette_loss(f.coarse, rgb, options) for f, rgb in pairs)


def test_thinning_is_quick_and_bounded():
    palettes = moving(12, bend=0.5, at=5)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])
    options = AnalysisOptions()
    dense = DensePolytope(range(12), [palettes], [])
    before = total(frames, dense.position, options)
    losses = thin_out(dense, frames, options)
    assert losses.sum() == pytest.approx(total(frames, dense.position, options))
    assert losses.sum() <= THINNED * before + 1e-3 * 12
    left = dense.polytope().vertices
    assert len(left) <= 10  # of 48; 8 of them stand at the ends
    assert any(3 <= v[3] <= 7 and v[2] > 0.4 for v in left)  # the bend is kept


@pytest.mark.parametrize("count", [1, 2])
def test_thinning_one_or_two_frames_changes_nothing(count):
    palettes = moving(count)
    frames = stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])
    dense = DensePolytope(range(count), [palettes], [])
    thin_out(dense, frames, AnalysisOptions())
    assert all(dense.alive)
