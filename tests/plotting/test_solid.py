"""The RGB solid: projection, drags, concavities and flips."""

import numpy as np
import pytest

from palette4d.plotting.solid import (
    CORNERS,
    CUBE,
    Shape,
    View,
    concave,
    edges_of,
    extent_of,
    facing,
    flipped,
)

#: An octahedron, faces anticlockwise from outside.
POINTS = np.array(
    [[1, 0.5, 0.5], [0, 0.5, 0.5], [0.5, 1, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 1], [0.5, 0.5, 0]]
)
FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
    dtype=np.int32,
)
VIEW = View.fit(CORNERS, (100.0, 100.0), 180.0)


def test_white_is_above_black_and_red_right_of_blue() -> None:
    black, red, blue, white = VIEW.project(CORNERS[[0, 1, 4, 7]])
    assert white[1] > black[1]
    assert red[0] > blue[0]
    assert len(CUBE) == 12


def test_everything_fits_into_the_view() -> None:
    shape = Shape(POINTS, POINTS + 0.7, FACES)
    view = View.fit(extent_of([shape]), (0.0, 0.0), 200.0)
    seen = view.project(extent_of([shape]))[:, :2]
    assert np.abs(seen).max() <= 100 + 1e-9


@pytest.mark.parametrize("sides", [(-14.0, 9.0), (40.0, -60.0), (175.0, 80.0)])
def test_a_drag_in_the_plane_keeps_the_colour_under_the_pointer(sides: tuple[float, float]) -> None:
    view = VIEW.turned(*sides)
    colour = np.array([[0.3, 0.6, 0.2]])
    moved = view.project(colour + view.in_plane(13.0, -7.0))
    np.testing.assert_allclose(moved[0, :2] - view.project(colour)[0, :2], [13.0, -7.0])
    np.testing.assert_allclose(moved[0, 2], view.project(colour)[0, 2])


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_a_drag_along_an_axis_changes_one_channel(channel: int) -> None:
    view = VIEW.turned(35.0, 25.0)
    along = (view.axes[:2, channel] * view.scale * 0.25).tolist()
    expected = np.zeros(3)
    expected[channel] = 0.25
    np.testing.assert_allclose(view.along(channel, *along), expected)


def test_a_closed_mesh_has_two_faces_at_every_edge() -> None:
    edges, beside = edges_of(FACES)
    assert len(edges) == 12
    assert (beside >= 0).all()
    assert facing(VIEW.project(POINTS)[:, :2], FACES).sum() == 4


def test_a_colour_that_is_pushed_in_is_concave_and_further_flips() -> None:
    assert not concave(POINTS, FACES).any()
    assert not flipped(POINTS, POINTS * 0.4 + 0.1, FACES).any()
    pushed = POINTS.copy()
    pushed[4, 2] = 0.45  # the blue corner, just through the middle
    edges, _ = edges_of(FACES)
    bent = edges[concave(pushed, FACES)]
    assert len(bent) == 4
    assert (bent == 4).any(axis=1).all()  # the edges that lead into the pit
    through = POINTS.copy()
    through[4, 2] = -0.6  # beyond the other corner
    assert flipped(POINTS, through, FACES).any()


def test_two_colours_are_a_line() -> None:
    two = Shape(POINTS[:2], POINTS[:2], np.zeros((0, 3), np.int32))
    assert two.edges.tolist() == [[0, 1]]
    one = Shape(POINTS[:1], POINTS[:1], np.zeros((0, 3), np.int32))
    assert one.edges.shape == (0, 2)
