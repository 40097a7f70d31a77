"""The progressive hull in four dimensions, against SciPy's convex hulls.

What it refuses, and a hull by hand: tests/core/fit/test_progressive_hull_4d.cpp.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from palette4d import _core

NO_LIMITS = np.zeros((0, 5))


def ball(seed, count):
    """Return points on a sphere, which are all corners of their hull, and its facets."""
    points = np.random.default_rng(seed).normal(size=(count, 4))
    points = 0.5 + 0.4 * points / np.linalg.norm(points, axis=1, keepdims=True)
    return points, ConvexHull(points).simplices


def farthest_outside(inner, outer):
    """Return how far points reach beyond the hull of others."""
    equations = ConvexHull(outer).equations
    return (inner @ equations[:, :4].T + equations[:, 4]).max()


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("target", [14, 11, 9])
def test_hulls_enclose_their_points_with_as_many_vertices_as_asked(seed, target):
    points, facets = ball(seed, 16)
    hull = _core.progressive_hull_4d(points, facets, target, NO_LIMITS)
    assert len(hull) == target
    assert farthest_outside(points, hull) < 1e-7


def test_new_vertices_keep_their_limits():
    beyond = 0.0
    for seed in range(4):
        points, facets = ball(seed, 14)
        low, high = points[:, 3].min() - 0.01, points[:, 3].max() + 0.01
        # Not of unit length: a limit is a half-space, however it is written.
        limits = [[0, 0, 0, 2, 2 * low], [0, 0, 0, -3, -3 * high]]
        free = _core.progressive_hull_4d(points, facets, 7, NO_LIMITS)[:, 3]
        beyond = max(beyond, low - free.min(), free.max() - high)
        kept = _core.progressive_hull_4d(points, facets, 7, limits)
        assert len(kept) < len(points)
        assert low - 1e-8 < kept[:, 3].min() <= kept[:, 3].max() < high + 1e-8
        assert farthest_outside(points, kept) < 1e-7
    assert beyond > 0.01  # without limits they do not


def test_a_limit_that_allows_nothing_leaves_the_hull_as_it_is():
    points, facets = ball(3, 12)
    hull = _core.progressive_hull_4d(points, facets, 8, [[1, 0, 0, 0, 100]])
    np.testing.assert_allclose(hull, points, rtol=0, atol=1e-14)


def test_the_unit_of_an_axis_does_not_matter():
    points, facets = ball(5, 16)
    # A power of two, so that the numbers in a unit cube are the same to the last bit.
    unit = np.array([1, 1, 1, 64])
    small = _core.progressive_hull_4d(points, facets, 9, NO_LIMITS)
    large = _core.progressive_hull_4d(points * unit, facets, 9, NO_LIMITS)
    np.testing.assert_array_equal(large, small * unit)


def test_points_without_volume_end_without_a_crash():
    points, facets = ball(2, 10)
    for flat in ({1: 0.25}, dict.fromkeys(range(4), 0.5)):
        for axis, value in flat.items():
            points[:, axis] = value
        assert np.isfinite(_core.progressive_hull_4d(points, facets, 6, NO_LIMITS)).all()
