"""A grade is a value: edits are functions that give another one."""

import operator
from collections.abc import Callable
from pathlib import Path

import pytest

from palette4d.grade import handle_edits, pick_edits, versions
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.document import Document
from palette4d.grade.grade import Grade

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"

EDITS: list[Callable[[Grade], Grade]] = [
    lambda grade: handle_edits.set_colour(grade, "v1", (1.0, 0.0, 0.5)),
    lambda grade: handle_edits.stop(grade, "e1", 3, (1.0, 0.0, 0.5))[0],
    lambda grade: handle_edits.adjust(grade, "v1", by=(0.1, 0.0, 0.0))[0],
    lambda grade: handle_edits.move(grade, "s1", 2),
    lambda grade: handle_edits.adjust(grade, hue=20)[0],
    lambda grade: handle_edits.set_near(grade, (0.1, 0.1, 0.1), frame=3, by=(0.1, 0, 0))[0],
    lambda grade: handle_edits.set_ramp(grade, "smooth"),
    lambda grade: handle_edits.lock(grade, "v1", "s1"),
    lambda grade: handle_edits.reset(grade, "s1"),
    lambda grade: handle_edits.reset(grade),
    lambda grade: pick_edits.hold(grade, ClipOfPicks.of(grade), 3, colour=(0.1, 0.2, 0.3))[0],
    lambda grade: versions.save_version(grade, "one")[0],
    lambda grade: versions.use_version(versions.save_version(grade, "one")[0], "one")[0],
]


@pytest.mark.parametrize("edit", EDITS)
def test_an_edit_gives_another_grade(edit: Callable[[Grade], Grade]) -> None:
    document = Document.load(GOLDEN)
    grade, before, drawn = document.grade, document.fields(), document.grade.palette(3).edited
    after = edit(grade)
    assert dict(after.state) != dict(grade.state)
    assert after.label or after.versions
    assert Document(grade).fields() == {n: v for n, v in before.items() if n != "history"}
    assert grade.palette(3).edited.tolist() == drawn.tolist()
    assert after.core.polytope.vertex_ids == grade.core.polytope.vertex_ids
    with pytest.raises(TypeError):
        operator.setitem(grade.state, ("lock", "v1"), True)


def test_a_document_takes_what_an_edit_gives() -> None:
    document = Document.load(GOLDEN)
    grade = document.grade
    document.set("v1", rgb=(1, 1, 1))
    assert grade.colour("v1") != document.grade.colour("v1")
    document.undo()
    assert dict(document.grade.state) == dict(grade.state)
    assert Document(grade).history.done == ()
