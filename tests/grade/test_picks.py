"""Picks as values: where a path stays near the picked colour."""

from palette4d.grade.picks import PathKey, Pick

GREY = (0.5, 0.5, 0.5)


def test_a_path_is_alike_until_it_leaves_the_picked_colour() -> None:
    path = (PathKey(0, (0.88, 0.5, 0.5)), PathKey(10, GREY), PathKey(30, (0.54, 0.5, 0.5)))
    assert Pick("p1", "hold", 10, GREY, path=path).alike() == (8, 30)
    assert Pick("p1", "hold", 10, GREY, path=path, start=9, until=20).alike() == (9, 20)
