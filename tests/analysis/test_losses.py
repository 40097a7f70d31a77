"""Losses are minimised, and their binding says what it refuses."""

from __future__ import annotations

import gc
import itertools
import weakref

import numpy as np
import pytest
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.losses import NO_FACES, minimise, refine_palette
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette

from palette4d import _core

WEIGHTS = _core.LossWeights(50.0, 50.0)
BOX = np.array(list(itertools.product([0.25, 0.75], repeat=3)))


def tree(points, counts=None):
    points = np.atleast_2d(np.asarray(points, float))
    return _core.ColourTree(points, np.ones(len(points)) if counts is None else counts)


def loss(points, palette, counts=None, k=1.0):
    r, c, shape, outside, far, _ = _core.palette_loss(
        tree(points, counts), np.asarray(palette, float), NO_FACES, _core.LossWeights(50.0, k)
    )
    return {"R": r, "C": c, "shape": shape, "outside": outside, "far": far}


@pytest.mark.parametrize("seed", range(30))
def test_distances_are_those_to_the_convex_hull(seed):
    """As the weights of colours have them, which share no code with the losses."""
    rng = np.random.default_rng(seed)
    palette = rng.random((4 + seed % 6, 3))
    points, counts = rng.uniform(-0.2, 1.2, (400, 3)), rng.integers(1, 8, 400).astype(float)
    hull = hull_mesh(palette)
    _, distance = _core.palette_weights(points, hull.rgb, hull.faces)
    measured = loss(points, palette, counts)
    assert measured["R"] == pytest.approx(counts @ distance / counts.sum(), abs=1e-9)
    assert measured["outside"] == pytest.approx(counts @ (distance > 1e-6) / counts.sum())
    assert measured["far"] == pytest.approx(distance.max(), abs=1e-9)


def test_refinement_never_worsens_and_stays_in_its_box():
    rng = np.random.default_rng(8)
    options = AnalysisOptions(hull_box=0.05)
    colours = tree(rng.random((2000, 3)) * 0.6 + 0.2)
    before = _core.palette_loss(colours, BOX, NO_FACES, WEIGHTS)
    gamut = Gamut(np.zeros(3), np.ones(3))
    moved = refine_palette(colours, FramePalette(BOX, NO_FACES), gamut, options)
    after = _core.palette_loss(colours, moved, NO_FACES, WEIGHTS)
    assert 50 * after[0] + after[1] < 50 * before[0] + before[1]
    assert np.abs(moved - BOX).max() <= 0.05 + 1e-12


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
@pytest.mark.parametrize("at", [2, 3, 5])
def test_what_an_objective_raises_comes_out(error, at):
    """NLopt would drop it: Ctrl-C in the middle of a search must end the program."""
    calls = []

    def objective(x):
        calls.append(x)
        if len(calls) == at:
            raise error
        bend = x[1] - x[0] ** 2  # Rosenbrock's valley: not reached in a few steps
        slope = np.array([-400 * x[0] * bend - 2 * (1 - x[0]), 200 * bend])
        return float(100 * bend**2 + (1 - x[0]) ** 2), slope

    with pytest.raises(error):
        minimise(objective, np.array([-1.2, 1.0]), np.full(2, -5.0), np.full(2, 5.0), 50)
    assert len(calls) == at


def test_what_an_objective_knows_is_let_go_of():
    """It knows the colours of a frame, or of all frames of a shot."""

    class Parabola:
        def __call__(self, x):
            return float(x @ x), 2 * x

    parabola = Parabola()
    gone = weakref.ref(parabola)
    best = minimise(parabola, np.ones(2), np.full(2, -5.0), np.full(2, 5.0), 50)
    np.testing.assert_allclose(best, 0, atol=1e-6)
    del parabola
    gc.collect()
    assert gone() is None


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match="shape"):
        _core.palette_loss(tree([[0, 0, 0]]), np.zeros((4, 2)), NO_FACES, WEIGHTS)
    with pytest.raises(ValueError, match="at least one"):
        _core.palette_loss(tree([[0, 0, 0]]), np.zeros((0, 3)), NO_FACES, WEIGHTS)
    with pytest.raises(ValueError, match="face"):
        _core.palette_loss(tree([[0, 0, 0]]), BOX, np.array([[0, 1, 99]]), WEIGHTS)


def test_a_colour_in_the_plane_of_several_facets_is_not_outside():
    """Rounding puts it above a facet whose triangle is elsewhere: it used to count as far away."""
    a = 0.9999999999999997
    palette = [[a, 0.9937, a], [1, 0.3645, 0.0069], [1, 0.3586, 0.0204], [a, 1, a], [1, 1, 0.0204]]
    palette += [[1, 0.9996, 0.0069], [0, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert loss([[1, 0.498, 0.0588]], palette)["R"] < 1e-9
