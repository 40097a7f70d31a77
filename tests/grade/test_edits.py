"""Edits as values: applied, taken back, and merged with another writer's."""

import pytest

from palette4d.common.errors import Palette4dError
from palette4d.grade.edits import (
    Change,
    Edit,
    Setting,
    as_colour,
    difference,
    merged,
    new_stop_id,
)

RED, GREEN, BLUE = (Setting((1.0, 0, 0)), Setting((0, 1.0, 0)), Setting((0, 0, 1.0)))


def stop(frame: float, edge: str = "e1", red: float = 0.0) -> Setting:
    return Setting((red, 0.0, 0.0), edge, frame)


def test_an_edit_and_its_inverse_cancel_out() -> None:
    before = {"v1": RED, "s1": stop(3), "v2": GREEN}
    after = {"v1": BLUE, "s2": stop(4), "v2": GREEN}
    edit = difference(before, after)
    assert edit.apply(before) == after
    assert edit.inverse().apply(after) == before
    assert before == {"v1": RED, "s1": stop(3), "v2": GREEN}


@pytest.mark.parametrize(
    "change", [Change("v1", None, BLUE), Change("v1", GREEN, BLUE), Change("v9", RED, None)]
)
def test_an_edit_of_something_else_is_refused(change: Change) -> None:
    with pytest.raises(Palette4dError):
        Edit((change,)).apply({"v1": RED})


def test_two_writers_of_different_handles_lose_nothing() -> None:
    base = {"v1": RED, "v2": RED, "s1": stop(3)}
    mine = {"v1": GREEN, "v2": RED, "s1": stop(3), "v3": BLUE}
    theirs = {"v1": RED, "v2": BLUE, "v4": RED}  # s1 removed
    assert merged(base, mine, theirs, ()) == (
        {"v1": GREEN, "v2": BLUE, "v3": BLUE, "v4": RED},
        {},
    )


def test_the_same_change_by_both_is_one() -> None:
    assert merged({"v1": RED}, {"v1": BLUE}, {"v1": BLUE}, ()) == ({"v1": BLUE}, {})
    assert merged({"v1": RED}, {}, {}, ()) == ({}, {})


@pytest.mark.parametrize(
    ("mine", "theirs"),
    [
        ({"v1": GREEN}, {"v1": BLUE}),
        ({}, {"v1": BLUE}),
        ({"v1": BLUE}, {}),
        ({"v1": RED, "s1": stop(3)}, {"v1": RED, "s1": stop(3, red=1)}),
        ({"v1": RED, "s1": stop(3)}, {"v1": RED, "s2": stop(3)}),
    ],
)
def test_different_changes_of_one_handle_are_a_conflict(
    mine: dict[str, Setting], theirs: dict[str, Setting]
) -> None:
    with pytest.raises(Palette4dError):
        merged({"v1": RED}, mine, theirs, ())


def test_two_new_stops_of_one_id_are_two_stops() -> None:
    mine, theirs = {"s1": stop(3), "s2": stop(4)}, {"s1": stop(5)}
    assert merged({}, mine, theirs, {"s8"}) == (
        {"s1": stop(5), "s9": stop(3), "s2": stop(4)},
        {"s1": "s9"},
    )
    edit = difference({}, mine).renamed({"s1": "s9"})
    assert edit.apply({}) == {"s9": stop(3), "s2": stop(4)}


def test_new_ids_are_never_those_of_old_stops() -> None:
    assert new_stop_id(()) == "s1"
    assert new_stop_id(("s1", "s3", "v9", "s", "sx", "s007", "s٣")) == "s8"


@pytest.mark.parametrize("wrong", [(1, 2), (1, 2, float("nan")), (1, 2, 2e6), "red", 3, None])
def test_colours_are_three_finite_numbers(wrong: object) -> None:
    with pytest.raises(Palette4dError):
        as_colour(wrong)  # type: ignore[arg-type]
