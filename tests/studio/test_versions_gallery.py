"""The gallery of versions: pictures, names, notes, and wipes between any two."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit

from palette4d.studio import grade_steps
from palette4d.studio.versions_gallery import Gallery
from palette4d.studio.window import Window

Settle = Callable[[Window], None]


def recolour(window: Window, rgb: tuple[float, float, float]) -> None:
    """Give the first vertex another colour."""
    document = window.session.document
    assert document is not None
    vertex = document.grade.core.polytope.vertex_ids[0]
    window.session.edit(lambda document: document.set(vertex, rgb=rgb))


@pytest.fixture
def gallery(opened: Window, settle: Settle) -> Gallery:
    """A gallery with versions A (red) and B (blue); the grade is blue."""
    for rgb in ((0.9, 0.1, 0.1), (0.1, 0.1, 0.9)):
        recolour(opened, rgb)
        grade_steps.keep_version(opened.session)
    opened.show_or_hide("versions")
    settle(opened)
    return opened.gallery


def names(gallery: Gallery) -> list[str]:
    return [gallery.list.item(k).text() for k in range(gallery.list.count())]


def choose(gallery: Gallery, *rows: int) -> None:
    gallery.list.clearSelection()
    for row in rows:
        gallery.list.item(row).setSelected(True)


def test_each_version_has_a_picture_of_the_frame(
    gallery: Gallery, opened: Window, settle: Settle
) -> None:
    pictures = [gallery.picture(name) for name in ("A", "B")]
    assert pictures[0] is not None
    assert pictures[1] is not None
    assert pictures[0].shape == (90, 160, 3)
    assert (pictures[0] != pictures[1]).any()
    opened.session.go(12)
    settle(opened)
    other = gallery.picture("A")
    assert other is not None
    assert (other != pictures[0]).any()


def test_nothing_is_drawn_while_it_is_hidden(opened: Window) -> None:
    grade_steps.keep_version(opened.session)
    assert opened.gallery.picture("A") is None
    assert opened.gallery.settled


def test_two_versions_are_compared_until_something_is_edited(
    gallery: Gallery, opened: Window, settle: Settle
) -> None:
    recolour(opened, (0.1, 0.9, 0.1))
    choose(gallery, 0, 1)
    gallery.compare()
    settle(opened)
    view, picture, document = opened.session.view, opened.viewer.picture, opened.session.document
    assert (view.version, view.after, view.compare) == ("A", "B", "wipe")
    assert picture is not None
    assert picture.request.before is not None
    assert picture.request.grade is not None
    assert document is not None
    for grade, name in ((picture.request.before, "A"), (picture.request.grade, "B")):
        wanted = document.version(name).grade.palette(6).edited
        np.testing.assert_array_equal(grade.palette.edited, wanted)
    opened._do("switch")
    assert opened.session.view.compare == "before"
    recolour(opened, (0.2, 0.9, 0.1))
    settle(opened)
    assert opened.session.view.after == ""
    assert opened.viewer.picture is not None
    assert opened.viewer.picture.request.grade is not None


def test_the_buttons_name_what_is_compared_and_escape_shows_the_grade_again(
    gallery: Gallery, opened: Window
) -> None:
    recolour(opened, (0.1, 0.9, 0.1))
    choose(gallery, 0, 1)
    gallery.compare()
    buttons = opened.transport.compare
    assert [buttons[side].text() for side in ("before", "after")] == ["A", "B"]
    opened._do("cancel")
    view = opened.session.view
    assert (view.version, view.after, view.compare) == ("", "", "after")
    assert [buttons[side].text() for side in ("before", "after")] == ["Before", "After"]


def test_a_version_that_was_kept_is_selected_so_that_its_note_can_be_typed(
    gallery: Gallery, opened: Window
) -> None:
    recolour(opened, (0.1, 0.2, 0.8))
    grade_steps.keep_version(opened.session)
    assert gallery.chosen == [opened.session.versions[-1]]
    assert gallery.note.isEnabled()


def test_one_version_is_compared_with_the_grade(gallery: Gallery, opened: Window) -> None:
    choose(gallery, 0)
    gallery.buttons["compare"].click()
    view = opened.session.view
    assert (view.version, view.after, view.compare) == ("A", "", "wipe")


def test_a_name_is_typed_in_its_place(gallery: Gallery, opened: Window, qtbot: Any) -> None:
    choose(gallery, 0)
    opened.session.look(version="A")
    gallery.buttons["rename"].click()
    editor = gallery.list.findChild(QLineEdit)
    assert isinstance(editor, QLineEdit)
    editor.selectAll()
    QTest.keyClicks(editor, "warm")
    QTest.keyClick(editor, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: opened.session.versions == ("B", "warm"))
    assert names(gallery) == ["B", "warm"]
    assert opened.session.view.version == "warm"


def test_a_version_stays_selected_under_its_new_name(
    gallery: Gallery, opened: Window, qtbot: Any
) -> None:
    """Its place may be another one: the next key is for it."""
    choose(gallery, 0)
    gallery.list.setCurrentRow(0)
    gallery.list.setFocus()
    QTest.keyClick(gallery.list, Qt.Key.Key_F2)
    assert opened.session.view.compare == "after"
    editor = gallery.list.findChild(QLineEdit)
    assert editor is not None
    editor.setText("Z")
    QTest.keyClick(editor, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: names(gallery) == ["B", "Z"])
    assert gallery.chosen == ["Z"]


def test_a_name_that_another_version_has_is_refused(
    gallery: Gallery, opened: Window, qtbot: Any
) -> None:
    choose(gallery, 0)
    gallery.list.item(0).setText("B")
    qtbot.waitUntil(lambda: names(gallery) == ["A", "B"])
    assert opened.session.status.level == "error"
    assert gallery.chosen == ["A"]


def test_a_note_stands_below_the_name(gallery: Gallery, opened: Window) -> None:
    choose(gallery, 1)
    QTest.keyClicks(gallery.note, "for the client")
    QTest.keyClick(gallery.note, Qt.Key.Key_Return)
    document = opened.session.document
    assert document is not None
    assert document.grade.note("B") == "for the client"
    assert "for the client" in gallery.list.item(1).toolTip()
    choose(gallery, 0)
    assert gallery.note.text() == ""
    choose(gallery, 1)
    assert gallery.note.text() == "for the client"


def test_keys_use_and_remove_versions_and_undo_brings_them_back(
    gallery: Gallery, opened: Window
) -> None:
    document = opened.session.document
    assert document is not None
    choose(gallery, 0)
    QTest.keyClick(gallery.list, Qt.Key.Key_Return)
    assert document.grade.same_edits == ("A",)
    choose(gallery, 0, 1)
    QTest.keyClick(gallery.list, Qt.Key.Key_Delete)
    assert opened.session.versions == ()
    assert names(gallery) == []
    opened.session.undo()
    assert opened.session.versions == ("A", "B")
