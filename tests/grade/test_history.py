"""Steps and versions: kept in the file, reverted and applied again, never lost."""

import contextlib
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from palette4d import _core
from palette4d.common.errors import Palette4dError, SidecarError
from palette4d.grade import sidecar
from palette4d.grade.document import Document

GOLDEN = Path(__file__).parents[1] / "golden" / "sidecars"
STOP = {"edge": "e1", "frame": 5, "rgb": [0, 0, 0]}
AREA = {"frame": 2, "points": [[3, 10], [{}, 10]], "radius": 1.5}
PICK = {"id": "p1", "kind": "pick", "frame": 5, "rgb": [0, 0, 0], "to": [1, 1, 1]}


def version(pick: dict[str, Any]) -> dict[str, Any]:
    return {"vertices": [], "stops": [], "picks": [pick]}


@pytest.fixture
def plain(tmp_path: Path) -> Path:
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    return path


def test_steps_are_undone_in_other_sessions(plain: Path) -> None:
    first = plain.read_bytes()
    files = []
    acts: list[Callable[[Document], object]] = [
        lambda d: d.set("v1", rgb="#ff8000"),
        lambda d: d.stop("e1", frame=3, rgb=(0.5, 0.5, 0.5)),
        lambda d: d.set_ramp("smooth"),
        lambda d: d.set_ramp("hold", "s1"),
        lambda d: d.move("s1", frame=4),
        lambda d: d.adjust("s1", by=(0.1, 0, -0.1)),
        lambda d: d.set_near((0.2, 0.2, 1), frame=9, rgb=(1, 0, 0)),
        lambda d: d.reset("v8"),
        lambda d: d.reset(),
    ]
    for each in acts:
        document = Document.load(plain)
        each(document)
        document.save()
        files.append(sidecar.load(plain))
        assert files[-1]["history"]["done"][:-1] == (files[-2:-1] or [{}])[0].get(
            "history", {"done": []}
        ).get("done")

    def without_history() -> Any:
        return {**sidecar.load(plain), "history": None}

    for expected in [*reversed(files[:-1]), json.loads(first)]:
        document = Document.load(plain)
        document.undo()
        document.save()
        assert without_history() == {**expected, "history": None}
    document = Document.load(plain)
    with pytest.raises(Palette4dError):
        document.undo()
    for expected in files:
        document.redo()
        document.save()
        assert without_history() == {**expected, "history": None}
    with pytest.raises(Palette4dError):
        document.redo()
    while document.history.done:
        document.undo()
    document.forget_history()
    document.save()
    assert plain.read_bytes() == first


def test_a_step_that_changes_nothing_is_none(plain: Path) -> None:
    before = plain.read_bytes()
    document = Document.load(plain)
    document.reset()
    document.set_ramp("linear")
    document.save()
    assert (document.history.done, plain.read_bytes()) == ((), before)


def test_several_edits_are_one_step(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=(0, 0, 0))
    with document.one_step("everything darker"):
        document.set("v2", rgb=(0, 0, 0))
        document.set("v3", rgb=(0, 0, 0))
    assert [step.label for step in document.history.done] == [
        "set v1 to 0 0 0",
        "everything darker",
    ]
    document.undo()
    assert list(document.grade.settings) == ["v1"]
    document.set("v4", rgb=(0, 0, 0))
    with pytest.raises(Palette4dError):  # another way was taken
        document.redo()
    document.undo()
    before = document.fields()
    with contextlib.suppress(Palette4dError), document.one_step("half of it"):
        document.set("v2", rgb=(0, 0, 0))
        document.set("v99", rgb=(0, 0, 0))
    assert document.fields() == before


def test_under_another_name_the_history_stays_small_too(plain: Path, tmp_path: Path) -> None:
    document = Document.load(plain)
    for i in range(250):
        document.set("v1", rgb=(i / 1000, 0, 0))
    document.save(tmp_path / "other.p4d.json")
    assert len(Document.load(tmp_path / "other.p4d.json").history.done) == 200


def test_the_history_stays_small(plain: Path) -> None:
    document = Document.load(plain)
    for i in range(700):
        document.set(f"v{i % 5 + 1}", rgb=(i / 1000, 0.123456789, 0.987654321))
        if i % 100 == 0:
            document.save()
    document.save()
    assert len(document.history.done) == 200
    assert plain.stat().st_size < 60_000
    last = [document.grade.colour(f"v{i}") for i in range(1, 6)]
    document = Document.load(plain)
    for _ in range(200):
        document.undo()
    assert document.grade.colour("v5")[0] == 499 / 1000  # the oldest steps are forgotten
    while document.history.undone:
        document.redo()
    assert [document.grade.colour(f"v{i}") for i in range(1, 6)] == last


@pytest.mark.parametrize(
    "history",
    [
        {"done": 3},
        {"done": [{"step": "x"}]},
        {"done": [{"step": "x", "changes": []}]},
        {"done": [{"step": "x", "changes": [["handle", "v1", None, {"rgb": [1, 2]}]]}]},
        {"done": [{"step": "x", "changes": [["thing", "v1", None, {"rgb": [1, 2, 3]}]]}]},
        {"done": [{"step": "x", "changes": [["handle", "s1", None, STOP | {"frame": "5"}]]}]},
        {"done": [{"step": "x", "changes": [["pick", "p1", None, {"id": "p1"}]]}]},
        {"done": [{"step": "x", "changes": [["pick", "p1", None, PICK | {"fade": "5"}]]}]},
        {"done": [{"step": "x", "changes": [["pick", "p1", None, PICK | {"areas": [AREA]}]]}]},
        {"done": [{"step": "x", "changes": [["pick", "p1", None, PICK | {"matte": {}}]]}]},
        {
            "done": [
                {"step": "x", "changes": [["version", "a", version(PICK | {"fade": "5"}), None]]}
            ]
        },
        {
            "done": [
                {
                    "step": "x",
                    "changes": [["version", "a", version(PICK | {"areas": [AREA]}), None]],
                }
            ]
        },
        {"done": [{"step": "x", "changes": [["version", "a", version(PICK | {"id": 5}), None]]}]},
        {"undone": [{"step": 3, "changes": [["lock", "v1", None, True]]}]},
        {"undone": [{"step": "x", "changes": [["lock", "v1", None, 3]]}]},
        {"done": [{"step": "x", "changes": [["lock", "v1", None, True]], "unread": 1}]},
        {"undone": [{"step": "x", "changes": [["version", "v1", None, 3]]}]},
    ],
)
def test_a_broken_history_is_named(plain: Path, history: Any) -> None:
    fields = {**sidecar.load(plain), "history": history}
    with pytest.raises(SidecarError, match="/history"):
        Document(fields)


def test_a_history_that_does_not_fit_changes_nothing(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=(0, 0, 0))
    document.save()
    fields = sidecar.load(plain)
    fields["edits"]["vertices"] = [{"vertex": "v1", "rgb": [0.5, 0.5, 0.5]}]  # by hand
    document = Document(fields)
    with pytest.raises(Palette4dError, match="v1"):
        document.undo()
    assert document.grade.colour("v1") == (0.5, 0.5, 0.5)


def test_versions(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=(1, 0, 0))
    document.lock("v1")
    document.save_version("red")
    document.lock("v1", locked=False)
    document.set("v1", rgb=(0, 0, 1))
    document.save_version("blue")
    document.save()
    document = Document.load(plain)
    assert document.grade.versions == ("blue", "red")
    assert document.grade.same_edits == ("blue",)
    assert document.use_version("red") is None
    assert document.grade.colour("v1") == (1, 0, 0)
    assert document.grade.locks == ("v1",)
    document.set("v2", rgb=(0, 1, 0))
    assert document.use_version("blue") == "before blue"
    document.set("v3", rgb=(0, 1, 0))
    assert document.use_version("blue") == "before blue 2"
    assert document.version("before blue").grade.colour("v2") == (0, 1, 0)
    assert document.grade.colour("v2") != (0, 1, 0)
    document.save()
    core = _core.read_sidecar(plain)
    assert [name for name, _ in core.versions] == ["before blue", "before blue 2", "blue", "red"]
    assert Document.load(plain).grade.versions == document.grade.versions


def test_no_step_takes_a_version_away(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=(1, 0, 0))
    document.set("v2", rgb=(1, 0, 0))
    document.undo()
    document.save_version("crimson")
    assert [step.label for step in document.history.done] == ["set v1 to 1 0 0"]
    assert document.history.undone  # saving a version leaves what redo does
    document.save()
    document = Document.load(plain)
    document.undo()
    document.set("v1", rgb=(0, 0, 1))
    assert document.grade.versions == ("crimson",)
    document.use_version("crimson")
    assert (document.grade.colour("v1"), len(document.history.done)) == ((1, 0, 0), 2)
    document.undo()
    assert document.grade.colour("v1") == (0, 0, 1)
    assert document.grade.versions == ("before crimson", "crimson")
    assert document.use_version("crimson") is None
    document.set("v1", rgb=(0, 1, 0))
    document.change_version("crimson", note="for the client")
    assert document.save_version("crimson") == "former crimson"
    assert document.save_version("crimson") is None
    assert document.version("former crimson").grade.colour("v1") == (1, 0, 0)
    assert document.grade.note("former crimson") == "for the client"
    assert document.grade.note("crimson") == ""


def test_the_longest_name_leaves_room_for_former_and_a_number(plain: Path) -> None:
    document, name = Document.load(plain), "x" * 100
    for i in range(4):
        document.set("v1", rgb=(i / 4, 0, 0))
        document.save_version(name)
        document.save()
    document = Document.load(plain)
    assert len(document.grade.versions) == 4
    assert max(map(len, document.grade.versions)) <= 100


def test_steps_that_were_undone_outlive_another_programs_edit(plain: Path) -> None:
    mine = Document.load(plain)
    mine.set("v1", rgb=(1, 0, 0))
    mine.set("v2", rgb=(1, 0, 0))
    mine.undo()
    other = Document.load(plain)
    other.set("v3", rgb=(0, 1, 0))
    other.save()
    mine.save()
    assert mine.grade.colour("v3") == (0, 1, 0)
    again = Document.load(plain)
    again.redo()
    assert again.grade.colour("v2") == (1, 0, 0)


def test_a_removed_version_comes_back(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=(1, 0, 0))
    document.save_version("red")
    document.remove_version("red")
    document.undo()
    assert document.version("red").grade.colour("v1") == (1, 0, 0)
    document.change_version("red", rename="crimson")
    document.undo()
    assert document.grade.versions == ("red",)
    document.remove_version("red")
    document.undo()
    document.redo()
    assert document.grade.versions == ()
    document.set("v1", rgb=(0, 1, 0))
    document.save_version("red")
    document.undo()
    document.undo()  # the removal; the name holds other edits now
    document.redo()
    assert document.version("red").grade.colour("v1") == (0, 1, 0)


def test_versions_of_two_writers_are_no_steps(plain: Path) -> None:
    mine, theirs = Document.load(plain), Document.load(plain)
    mine.set("v1", rgb=(1, 0, 0))
    mine.save_version("red")
    theirs.set("v2", rgb=(0, 0, 1))
    theirs.save_version("blue")
    mine.save()
    theirs.save()
    found = Document.load(plain)
    assert found.grade.versions == ("blue", "red")
    assert [step.label for step in found.history.done] == ["set v1 to 1 0 0", "set v2 to 0 0 1"]


def test_steps_of_older_files_that_save_versions(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=(1, 0, 0))
    document.save_version("red")
    document.save()
    fields = sidecar.load(plain)
    held = document.fields()["versions"][0]["edits"]
    saved = {"step": "save version red", "changes": [["version", "red", None, held]]}
    fields["history"]["done"].append(saved)
    document = Document(fields)
    assert document.undo().label == "set v1 to 1 0 0"
    assert document.grade.versions == ("red",)


def test_a_version_is_a_document_of_its_own(plain: Path, tmp_path: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=(1, 0, 0))
    document.save_version("red")
    document.reset()
    document.save()
    red = document.version("red")
    assert red.grade.colour("v1") == (1, 0, 0)
    assert red.grade.palette(0).edited[0].tolist() == [1, 0, 0]
    assert not document.grade.settings
    before = plain.read_bytes()
    for target in ((), (plain,)):
        with pytest.raises(Palette4dError):
            red.save(*target)
    assert plain.read_bytes() == before
    red.save(tmp_path / "red.p4d.json")
    assert Document.load(tmp_path / "red.p4d.json").grade.colour("v1") == (1, 0, 0)
    assert document.version("") is document


@pytest.mark.parametrize("name", ["", "  ", "a\nb", "x" * 101])
def test_names_of_versions(plain: Path, name: str) -> None:
    document = Document.load(plain)
    with pytest.raises(Palette4dError):
        document.save_version(name)


@pytest.mark.parametrize("method", ["use_version", "remove_version", "version"])
def test_a_version_that_is_not_there(plain: Path, method: str) -> None:
    document = Document.load(plain)
    document.save_version("warm")
    with pytest.raises(Palette4dError, match="warm"):
        getattr(document, method)("cold")


def test_many_versions_are_listed_in_linear_time(plain: Path) -> None:
    fields = sidecar.load(plain)
    nothing = {"vertices": [], "stops": []}
    fields["versions"] = [{"name": f"n{i}", "edits": nothing} for i in range(10_000)]
    document = Document(fields)
    start = time.process_time()
    assert len(document.grade.same_edits) == 10_000
    assert time.process_time() - start < 3


def test_a_new_analysis_keeps_steps_and_versions(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=(1, 0, 0))
    document.save_version("red")
    document.save()
    before = sidecar.load(plain)
    again = Document(sidecar.load(GOLDEN / "v1_split.p4d.json"))
    with pytest.raises(Palette4dError):
        again.save(plain)
    again.save(plain, on_edits="keep")
    assert {**sidecar.load(plain), "clip": None} == {**before, "clip": None}
    assert again.grade.versions == ("red",)


ACTS = st.lists(
    st.tuples(
        st.sampled_from(
            ["set", "stop", "move", "ramp", "reset", "undo", "redo", "save", "load", "keep", "use"]
        ),
        st.integers(1, 4),
        st.integers(1, 7),
    ),
    max_size=40,
)


def act(document: Document, name: str, i: int, j: int) -> Document:
    if name == "set":
        document.set(f"v{i}", rgb=(j / 8, 0, 0))
    elif name == "stop":
        document.stop(f"e{i}", frame=j, rgb=(0, j / 8, 0))
    elif name == "move":
        document.move(f"s{i}", frame=j)
    elif name == "ramp":
        document.set_ramp(("linear", "smooth", "hold")[j % 3], (None, f"v{i}", f"s{i}")[j % 3])
    elif name == "reset":
        document.reset((None, f"v{i}", f"s{i}")[j % 3])
    elif name == "undo":
        document.undo()
    elif name == "redo":
        document.redo()
    elif name == "keep":
        document.save_version(f"version {i}")
    elif name == "use":
        document.use_version(f"version {i}")
    elif name == "save":
        document.save()
    else:
        document.save()
        return Document.load(document.path or "")
    return document


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(acts=ACTS)
def test_any_edits_can_be_undone_and_done_again(plain: Path, acts: list[Any]) -> None:
    first = (GOLDEN / "v1_split.p4d.json").read_bytes()
    plain.write_bytes(first)
    document = Document.load(plain)
    for name, i, j in acts:
        before = document.fields()
        try:
            document = act(document, name, i, j)
        except Palette4dError:
            assert document.fields() == before
    document.save()
    last = {**sidecar.load(plain), "history": None}
    while document.history.done:
        document.undo()
    document.save()
    bare = {n: v for n, v in sidecar.load(plain).items() if n not in ("history", "versions")}
    assert sidecar.dumps(bare).encode() == first
    document = Document.load(plain)
    undone = 0
    while document.history.undone and undone < len(acts):
        document.redo()
        undone += 1
    if not document.history.undone and not any(name == "undo" for name, *_ in acts):
        assert {**document.fields(), "history": None} == last


def test_undo_beside_another_writer(plain: Path) -> None:
    document = Document.load(plain)
    document.set("v1", rgb=(1, 0, 0))
    document.save()
    mine, theirs = Document.load(plain), Document.load(plain)
    theirs.set("v2", rgb=(0, 1, 0))
    theirs.save()
    mine.undo()
    mine.set("v3", rgb=(0, 0, 1))
    mine.save()
    found = Document.load(plain)
    assert set(found.grade.settings) == {"v2", "v3"}
    labels = [step.label for step in found.history.done]
    assert labels == ["set v1 to 1 0 0", "set v2 to 0 1 0", "edits of two programs"]
    for _ in found.history.done:
        found.undo()
    assert not found.grade.settings


def test_a_change_that_was_taken_back_does_not_meet_theirs(plain: Path) -> None:
    mine, theirs = Document.load(plain), Document.load(plain)
    mine.set("v1", rgb=(1, 0, 0))
    mine.reset("v1")
    mine.set("v2", rgb=(0, 1, 0))
    theirs.set("v1", rgb=(0, 0, 1))
    theirs.save()
    mine.save()
    found = Document.load(plain)
    assert found.grade.colour("v1") == (0, 0, 1)
    found.undo()
    assert set(found.grade.settings) == {"v1"}
    found.undo()
    assert not found.grade.settings


def test_picks_are_undone_and_merged(plain: Path) -> None:
    first = plain.read_bytes()
    mine, theirs = Document.load(plain), Document.load(plain)
    seen = mine.grade.palette(4).rgb.mean(axis=0)
    mine.pick(frame=4, colour=seen, by=(0.1, 0, 0), follow=False)
    mine.save()
    theirs.pick(frame=12, colour=seen, by=(0, 0.1, 0), follow=False)
    theirs.lock("v1")
    theirs.save()
    found = Document.load(plain)
    assert [pick.id for pick in found.grade.picks] == ["p1", "p2"]
    assert found.grade.locks == ("v1",)
    assert found.fields() == theirs.fields()
    while found.history.done:
        found.undo()
    found.forget_history()
    found.save()
    assert plain.read_bytes() == first


def test_undo_of_a_rename_takes_no_version_away(plain: Path) -> None:
    """Its old name has other edits now."""
    document = Document.load(plain)
    document.set("v1", rgb=(0.1, 0.1, 0.1))
    document.save_version("warm")
    document.change_version("warm", rename="cold")
    cold = document.grade.of_version("cold")
    document.set("v1", rgb=(0.7, 0.2, 0.6))
    document.save_version("warm")
    for _ in range(2):
        document.undo()
    assert document.grade.of_version("cold") == cold
    assert set(document.grade.versions) == {"cold", "warm"}
    document.redo()
    assert document.grade.of_version("cold") == cold
    # With its name free, it goes back.
    document.undo()
    document.remove_version("warm")
    document.undo()
