"""The k-means palette and the recolouring of Chang et al. (2015)."""

from __future__ import annotations

import importlib.util
import sys

import numpy as np
import pytest
from skimage.color import rgb2lab


@pytest.fixture(scope="module")
def chang(repo_root):
    spec = importlib.util.spec_from_file_location("chang", repo_root / "benchmarks" / "chang.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


COLOURS = np.array([[0.35, 0.2, 0.15], [0.2, 0.5, 0.3], [0.8, 0.4, 0.3], [0.5, 0.7, 0.9]])
RNG = np.random.default_rng(5)


def noisy(pixels, colours=COLOURS, noise=0.01):
    rgb = np.repeat(colours, pixels, axis=0)
    return np.clip(rgb + RNG.normal(0, noise, rgb.shape), 0, 1)


def lab(rgb):
    return np.asarray(rgb2lab(np.atleast_2d(rgb)))


@pytest.fixture(scope="module")
def palette(chang):
    rgb = noisy([400, 300, 200, 100])
    return chang.extract(*chang.binned([(rgb, np.ones(len(rgb)))]), colours=4)


def test_the_palette_is_the_clusters_from_dark_to_light(palette):
    assert (np.diff(palette[:, 0]) > 0).all()
    expected = lab(COLOURS)
    gaps = np.linalg.norm(palette[:, None] - expected[None], axis=2)
    assert sorted(gaps.argmin(axis=1)) == [0, 1, 2, 3]
    assert gaps.min(axis=1).max() < 2


def test_frames_count_together_and_by_their_pixels(chang):
    first, second = noisy([500, 300, 0, 0]), noisy([0, 0, 200, 100])
    whole = np.vstack([first, second])
    apart = chang.binned([(first, np.ones(len(first))), (second, np.ones(len(second)))])
    together = chang.binned([(whole, np.ones(len(whole)))])
    for one, other in zip(apart, together, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)
    assert together[1].sum() == len(whole)


def test_nearly_black_pixels_get_no_colour(chang):
    rgb = np.vstack([np.full((5000, 3), 0.01), noisy([100, 100, 100, 100])])
    palette = chang.extract(*chang.binned([(rgb, np.ones(len(rgb)))]), colours=4)
    assert palette[:, 0].min() > 10


def test_a_clip_of_two_colours_has_two(chang):
    binned = chang.binned([(COLOURS[:2], np.array([7.0, 3.0]))])
    assert len(chang.extract(*binned)) == 2


def test_without_an_edit_nothing_changes(chang, palette):
    rgb = RNG.random((500, 3))
    np.testing.assert_allclose(chang.Transfer(palette, palette)(rgb), rgb, atol=1e-5)


def test_palette_colours_reach_their_targets(chang, palette):
    target = chang.edited(palette, [(1, palette[1] + [3, 12, -8]), (3, palette[3] + [-4, 6, 9])])
    moved = chang.Transfer(palette, target)(chang.srgb(palette))
    np.testing.assert_allclose(moved, chang.srgb(target), atol=1e-6)


def test_weights_add_up_and_near_colours_move_more(chang, palette):
    transfer = chang.Transfer(palette, palette)
    weights = transfer.weights(lab(RNG.random((200, 3))))
    assert weights.min() >= 0
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    np.testing.assert_allclose(transfer.weights(palette), np.eye(4), atol=1e-9)
    way = palette[0] + np.linspace(0, 1, 5)[:, None] * (palette[2] - palette[0])
    assert (np.diff(transfer.weights(way)[:, 2]) > 0).all()


def test_lightness_stays_monotone(chang, palette):
    darker = chang.edited(palette, [(2, np.array([5.0, *palette[2, 1:]]))])
    assert (np.diff(darker[:, 0]) >= 0).all()
    np.testing.assert_array_equal(darker[:2, 0], 5.0)  # the darker colours make room
    assert darker[3, 0] == palette[3, 0]
    greys = np.repeat(np.linspace(0, 1, 50)[:, None], 3, axis=1)
    lightness = lab(chang.Transfer(palette, darker)(greys))[:, 0]
    assert (np.diff(lightness) > -0.5).all()
    assert lightness[0] < 0.1
    assert lightness[-1] > 99


def test_moves_are_never_longer_than_the_palette_colour_s(chang):
    single = lab([0.5, 0.4, 0.4])
    transfer = chang.Transfer(single, single + np.array([[0, 30, 0]]))
    rgb = RNG.random((400, 3))
    before, after = lab(rgb), lab(transfer(rgb))
    steps = np.linalg.norm(after[:, 1:] - before[:, 1:], axis=1)
    assert np.quantile(steps, 0.98) < 30.1  # clipping may add to a few
    greys = np.repeat(np.linspace(0.35, 0.5, 5)[:, None], 3, axis=1)
    np.testing.assert_allclose(
        lab(transfer(greys)) - lab(greys), np.tile([0, 30, 0], (5, 1)), atol=0.1
    )


def test_a_colour_near_the_boundary_moves_less(chang):
    """It reaches the boundary with the palette colour, which is half way there."""
    single = lab([0.5, 0.4, 0.4])
    step = np.array([[0, 1.0, 0]])
    room = chang._room(single, step)[0]
    transfer = chang.Transfer(single, single + room / 2 * step)
    near = single + 0.8 * room * step
    moved = transfer(chang.srgb(near))
    np.testing.assert_allclose(lab(moved), near + 0.1 * room * step, atol=0.2)


def test_two_key_frames_are_linear_in_time(chang, palette):
    first = chang.edited(palette, [(1, palette[1] + [0, 20, 0])])
    last = chang.edited(palette, [(1, palette[1] + [0, -20, 0])])
    rgb = RNG.uniform(0.2, 0.8, (100, 3))
    at = chang.Transfer.at
    np.testing.assert_array_equal(
        at(palette, first, last, 0.0)(rgb), chang.Transfer(palette, first)(rgb)
    )
    np.testing.assert_allclose(at(palette, first, last, 0.5)(rgb), rgb, atol=1e-5)


def test_the_cached_transfer_is_near_the_exact_one(chang, palette):
    target = chang.edited(palette, [(1, palette[1] + [5, 10, 10])])
    transfer = chang.Transfer(palette, target)
    rgb = RNG.uniform(0.1, 0.9, (300, 3))
    assert np.abs(transfer.cached()(rgb) - transfer(rgb)).mean() < 1 / 255
    nodes = np.array([[0, 0, 0], [1, 1, 1], [4 / 11, 5 / 11, 6 / 11]])
    np.testing.assert_allclose(transfer.cached()(nodes), transfer(nodes), atol=1e-9)
