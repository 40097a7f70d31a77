"""Edits as values: applied, taken back, and merged with another writer's."""

import json
from dataclasses import replace
from typing import Any

import pytest

from palette4d.common.errors import Palette4dError
from palette4d.grade.edits import (
    RAMP,
    Change,
    Edit,
    Setting,
    State,
    as_colour,
    difference,
    merged,
    new_id,
)
from palette4d.grade.members import MOST_STEPS, bounded, history_of, with_state
from palette4d.grade.picks import PathKey, Pick


def state(handles: dict[str, Setting]) -> State:
    return {("handle", id_): setting for id_, setting in handles.items()}


RED, GREEN, BLUE = (Setting((1.0, 0, 0)), Setting((0, 1.0, 0)), Setting((0, 0, 1.0)))


def stop(frame: float, edge: str = "e1", red: float = 0.0) -> Setting:
    return Setting((red, 0.0, 0.0), edge, frame)


def changed(id_: str, before: Setting | None, after: Setting | None) -> Change:
    return Change("handle", id_, before, after)


def test_an_edit_and_its_inverse_cancel_out() -> None:
    before = {**state({"v1": RED, "s1": stop(3), "v2": GREEN}), ("lock", "v2"): True}
    after = {**state({"v1": BLUE, "s2": stop(4), "v2": GREEN}), RAMP: "smooth"}
    edit = difference(before, after)
    assert edit.apply(before) == after
    assert edit.inverse().apply(after) == before
    assert before == {**state({"v1": RED, "s1": stop(3), "v2": GREEN}), ("lock", "v2"): True}


@pytest.mark.parametrize(
    "change", [changed("v1", None, BLUE), changed("v1", GREEN, BLUE), changed("v9", RED, None)]
)
def test_an_edit_of_something_else_is_refused(change: Change) -> None:
    with pytest.raises(Palette4dError):
        Edit((change,)).apply(state({"v1": RED}))


def test_two_writers_of_different_things_lose_nothing() -> None:
    base = state({"v1": RED, "v2": RED, "s1": stop(3)})
    mine = {**state({"v1": GREEN, "v2": RED, "s1": stop(3), "v3": BLUE}), ("lock", "v3"): True}
    theirs = {**state({"v1": RED, "v2": BLUE, "v4": RED}), RAMP: "hold"}  # s1 removed
    assert merged(base, mine, theirs, ())[0] == {
        **state({"v1": GREEN, "v2": BLUE, "v3": BLUE, "v4": RED}),
        ("lock", "v3"): True,
        RAMP: "hold",
    }


def test_the_same_change_by_both_is_one() -> None:
    red, blue = state({"v1": RED}), state({"v1": BLUE})
    assert merged(red, blue, blue, ()) == (blue, {})
    assert merged(red, {}, {}, ()) == ({}, {})


@pytest.mark.parametrize(
    ("mine", "theirs"),
    [
        (state({"v1": GREEN}), state({"v1": BLUE})),
        ({}, state({"v1": BLUE})),
        (state({"v1": BLUE}), {}),
        (state({"v1": RED, "s1": stop(3)}), state({"v1": RED, "s1": stop(3, red=1)})),
        (state({"v1": RED, "s1": stop(3)}), state({"v1": RED, "s2": stop(3)})),
        ({**state({"v1": RED}), RAMP: "hold"}, {**state({"v1": RED}), RAMP: "smooth"}),
        (
            {**state({"v1": RED}), ("version", "a"): {"vertices": [1]}},
            {**state({"v1": RED}), ("version", "a"): {"vertices": []}},
        ),
    ],
)
def test_different_changes_of_one_thing_are_a_conflict(mine: State, theirs: State) -> None:
    with pytest.raises(Palette4dError):
        merged(state({"v1": RED}), mine, theirs, ())


def test_a_note_goes_with_the_version_that_the_other_removed() -> None:
    base: State = {("version", "warm"): state({"v1": RED}), **state({"v2": RED})}
    mine: State = {**base, ("note", "warm"): "for the client"}
    assert merged(base, mine, state({"v2": RED}), ())[0] == state({"v2": RED})


def test_two_new_stops_of_one_id_are_two_stops() -> None:
    mine = {**state({"s1": stop(3), "s2": stop(4)}), ("lock", "s1"): True}
    theirs = state({"s1": stop(5)})
    assert merged({}, mine, theirs, {"s8"})[0] == {
        **state({"s1": stop(5), "s9": stop(3), "s2": stop(4)}),
        ("lock", "s9"): True,
    }


def test_two_new_picks_of_one_id_are_two_picks() -> None:
    mine: State = {("pick", id_): Pick(id_, "hold", 1, (0, 0, 0)) for id_ in ("p1", "p2")}
    theirs: State = {("pick", "p1"): Pick("p1", "hold", 2, (0, 0, 0))}
    assert merged({}, mine, theirs, ())[0] == {
        ("pick", "p1"): Pick("p1", "hold", 2, (0, 0, 0)),
        ("pick", "p2"): Pick("p2", "hold", 1, (0, 0, 0)),
        ("pick", "p3"): Pick("p3", "hold", 1, (0, 0, 0)),
    }


def written(*done: Edit) -> dict[str, Any]:
    """The members of a sidecar with these steps, through JSON."""
    members = {"polytope": {"vertices": [{"id": "v1"}]}}
    found: dict[str, Any] = with_state(members, {}, (done, ()), {}, lambda: None)
    read: dict[str, Any] = json.loads(json.dumps(found))
    return read


def test_steps_are_the_same_after_their_json() -> None:
    before: State = {}
    after = {
        **state({"v1": Setting((0.1, 2, -3), ramp="hold"), "s1": stop(3), "s2": stop(4.5)}),
        RAMP: "smooth",
        ("pick", "p1"): Pick("p1", "hold", 1, (0.5, 0.5, 0.5)),
        ("lock", "v1"): True,
    }
    after["version", "warm"] = dict(after)
    both = (difference(before, after, "all").undoable(), difference(after, before, "nothing"))
    assert history_of(written(*both), "name") == (both, ())
    unread = (replace(both[0], unread=True), both[1])
    assert history_of(written(*unread), "name") == (unread, ())


def test_old_steps_are_forgotten() -> None:
    steps = [difference({}, state({f"v{i}": stop(i)}), f"step {i}") for i in range(500)]
    assert bounded(steps) == steps[-MOST_STEPS:]
    path = tuple(PathKey(frame, (0.25, 0.5, 0.75)) for frame in range(100))
    picks = [Pick(f"p{i}", "hold", 1, (0, 0, 0), path=path) for i in range(300)]
    large = [difference({}, {("pick", pick.id): pick}) for pick in picks]
    kept = bounded(large)
    assert 10 < len(kept) < MOST_STEPS
    assert len(json.dumps(written(*kept)["history"])) < 260_000
    everything: State = {("pick", pick.id): pick for pick in picks}
    assert bounded([*large, difference({}, everything)]) == [difference({}, everything)]


def test_new_ids_are_never_those_of_old_stops() -> None:
    assert new_id("s", ()) == "s1"
    assert new_id("s", ("s1", "s3", "v9", "s", "sx", "s007", "s٣")) == "s8"


@pytest.mark.parametrize(
    "wrong", [(1, 2), (1, 2, float("nan")), (1, 2, 2e6), "red", "#ff003380", 3, None]
)
def test_colours_are_three_finite_numbers(wrong: object) -> None:
    with pytest.raises(Palette4dError):
        as_colour(wrong)  # type: ignore[arg-type]
