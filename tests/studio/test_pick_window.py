"""The window of a pick in its panel: on and off, its numbers, and its feather."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from windows import FRAME, Settle, seen

from palette4d.grade.answer import Answer, Note
from palette4d.grade.document import Document
from palette4d.grade.picks import Area, WindowKey
from palette4d.grade.picks import Window as PickWindow
from palette4d.studio import grade_steps, texts
from palette4d.studio.pick_window import REST, WindowRows
from palette4d.studio.pixels import place_between
from palette4d.studio.timeline_menu import menu_for
from palette4d.studio.window import Window

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def rows(opened: Window, settle: Settle, qtbot: Any) -> Iterator[WindowRows]:
    """The rows of a pick that is selected, in a window of 160x90 pixels."""
    session = opened.session
    assert session.clip is not None
    clip = session.clip.source
    session.edit(lambda d: d.pick(FRAME, pixel=(40, 30), to=(0.9, 0.1, 0.5), clip=clip))
    session.select("p1")
    settle(opened)
    yield opened.inspector.panel.window_rows
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)


def window_of(rows: WindowRows, id_: str = "p1") -> PickWindow | None:
    assert rows.session.document is not None
    return rows.session.document.grade.pick(id_).window


def box_of(rows: WindowRows) -> list[float]:
    """The box at the playhead."""
    own = window_of(rows)
    assert own is not None
    return [float(side) for side in own.box_at(rows.session.frame)]


def steps(rows: WindowRows) -> int:
    assert rows.session.document is not None
    return len(rows.session.document.history.done)


def switch(rows: WindowRows) -> None:
    QTest.mouseClick(rows.on, LEFT, pos=QPoint(6, rows.on.height() // 2))


def numbers(rows: WindowRows) -> list[float]:
    return [box.value() for box in rows.numbers.values()]


def test_it_is_switched_on_around_the_place_and_off(rows: WindowRows) -> None:
    before = steps(rows)
    assert window_of(rows) is None
    assert not rows.on.isChecked()
    assert not rows.bar.isVisibleTo(rows.on.window())
    switch(rows)
    left, top, right, bottom = box_of(rows)
    assert (right - left, bottom - top) == pytest.approx((90 / 4, 90 / 4), abs=1)
    assert ((left + right) / 2, (top + bottom) / 2) == pytest.approx((40.5, 30.5), abs=1)
    own = window_of(rows)
    assert own is not None
    assert own.feather > 0
    assert [key.frame for key in own.keys if key.given] == [FRAME]
    assert rows.on.isChecked()
    assert rows.bar.isVisibleTo(rows.on.window())
    assert numbers(rows) == [left, top, right - left, bottom - top]
    assert steps(rows) == before + 1
    switch(rows)
    assert window_of(rows) is None
    assert not rows.on.isChecked()
    rows.session.undo()
    assert box_of(rows) == [left, top, right, bottom]


def test_it_is_inverted_and_stays_so_when_it_is_moved(rows: WindowRows) -> None:
    assert not rows.invert.isVisibleTo(rows.on.window())
    switch(rows)
    assert not rows.invert.isChecked()
    QTest.mouseClick(rows.invert, LEFT, pos=QPoint(6, rows.invert.height() // 2))
    own = window_of(rows)
    assert own is not None
    assert own.inverted
    rows.numbers["x"].setValue(rows.numbers["x"].value() + 3)
    rows.session.keep_typed()
    moved = window_of(rows)
    assert moved is not None
    assert moved.inverted
    assert moved.given != own.given
    rows.session.undo()
    rows.session.undo()
    assert not rows.invert.isChecked()


def test_it_begins_with_room_around_what_was_marked(rows: WindowRows) -> None:
    rows.session.edit(lambda d: d.change_pick("p1", areas=(Area(FRAME, ((40, 30), (100, 50)), 5),)))
    switch(rows)
    left, top, right, bottom = box_of(rows)
    assert left < 35 < 105 < right < 130
    assert top < 25 < 55 < bottom < 80


def test_of_a_colour_without_a_place_it_begins_in_the_middle_of_this_frame(
    rows: WindowRows,
) -> None:
    session = rows.session
    session.edit(lambda d: d.pick(2, colour=(0.5, 0.4, 0.3), to=(0.9, 0.1, 0.5), follow=False))
    session.select("p2")
    switch(rows)
    own = window_of(rows, "p2")
    assert own is not None
    left, top, right, bottom = own.box_at(FRAME)
    assert ((left + right) / 2, (top + bottom) / 2) == pytest.approx((80, 45), abs=1)
    assert FRAME in [key.frame for key in own.keys if key.given]


def test_the_feather_is_dragged_and_typed(rows: WindowRows, qtbot: Any) -> None:
    switch(rows)
    before, middle = steps(rows), rows.bar.height() // 2
    QTest.mousePress(rows.bar, LEFT, pos=QPoint(rows.bar.width() // 4, middle))
    QTest.mouseMove(rows.bar, QPoint(rows.bar.width() // 2, middle))
    own = window_of(rows)
    assert own is not None
    assert rows.session.dragging
    assert own.feather == pytest.approx(45, abs=1)  # half of the frame's smaller side
    qtbot.waitUntil(lambda: rows.feather.value() == own.feather)
    QTest.mouseRelease(rows.bar, LEFT, pos=QPoint(rows.bar.width() // 2, middle))
    assert not rows.session.dragging
    assert steps(rows) == before + 1
    rows.feather.setFocus()
    rows.feather.selectAll()
    QTest.keyClicks(rows.feather, "200.5")  # more than the bar has
    QTest.keyClick(rows.feather, Qt.Key.Key_Return)
    own = window_of(rows)
    assert own is not None
    assert own.feather == 200.5
    assert steps(rows) == before + 2
    QTest.keyClick(rows.bar, Qt.Key.Key_Left)
    assert steps(rows) == before + 3


def test_numbers_are_typed_as_one_step(rows: WindowRows, qtbot: Any) -> None:
    switch(rows)
    before = steps(rows)
    left, top, right, bottom = box_of(rows)
    for name, text in (("x", "-7"), ("width", "50")):
        box = rows.numbers[name]
        box.setFocus()
        box.selectAll()
        QTest.keyClicks(box, text)
        QTest.keyClick(box, Qt.Key.Key_Return)
    assert box_of(rows) == [-7, top, 43, bottom]
    assert rows.session.dragging
    qtbot.waitUntil(lambda: not rows.session.dragging, timeout=10 * REST)
    assert box_of(rows) == [-7, top, 43, bottom]
    assert steps(rows) == before + 1
    box = rows.numbers["height"]
    QTest.keyClick(box, Qt.Key.Key_Up)  # the arrow's step, and then Esc
    assert box_of(rows) == [-7, top, 43, bottom + 1]
    QTest.keyClick(box, Qt.Key.Key_Escape)
    assert box_of(rows) == [-7, top, 43, bottom]
    qtbot.wait(2 * REST)
    assert steps(rows) == before + 1
    assert rows.numbers["height"].value() == bottom - top
    rows.session.undo()
    assert box_of(rows) == [left, top, right, bottom]


@pytest.mark.parametrize("then", ["feather", "invert", "undo", "save", "colour", "close", "hold"])
def test_typed_numbers_are_kept_before_what_is_done_next(
    rows: WindowRows, then: str, qtbot: Any
) -> None:
    """They are followed when they rest; what is done before that does not take their place."""
    switch(rows)
    session, before = rows.session, steps(rows)
    left, top, right, bottom = box_of(rows)
    rows.numbers["x"].setValue(left + 5)
    assert session.dragging
    path = session.path
    assert path is not None
    if then == "feather":
        rows.feather.setValue(7)
    elif then == "invert":
        rows.invert.click()
    elif then == "undo":
        session.undo()
        assert box_of(rows) == [left, top, right, bottom]
        assert steps(rows) == before
        return
    elif then == "save":
        session.save()
    elif then == "colour":
        session.drag(lambda document: document.adjust(by=(0.1, 0, 0)))
        session.drop()
    elif then == "hold":
        place = place_between(session, (5, 5), (5, 5))
        assert place is not None
        grade_steps.hold(session, place)
        qtbot.waitUntil(lambda: not session.following, timeout=30_000)
        assert session.document is not None
        (hold,) = (pick for pick in session.document.grade.picks if pick.kind == "hold")
        assert hold.matte is not None
    else:
        session.close()
        (pick,) = Document.load(path).grade.picks
        assert pick.window is not None
        assert pick.window.given.keys[0].box[0] == left + 5
        return
    assert box_of(rows)[0] == left + 5
    assert steps(rows) == before + (1 if then == "save" else 2)


def test_the_numbers_are_those_of_the_playhead(
    rows: WindowRows, opened: Window, settle: Settle
) -> None:
    session = rows.session
    session.edit(lambda d: d.set_window("p1", 2, (10, 20, 30, 50)))
    session.edit(lambda d: d.set_window("p1", 10, (50, 20, 90, 60)))
    for frame, wanted in ((2, [10, 20, 20, 30]), (10, [50, 20, 40, 40]), (6, [30, 20, 30, 35])):
        session.go(frame)
        settle(opened)
        np.testing.assert_allclose(numbers(rows), wanted, atol=0.5)


def test_a_box_is_removed_where_it_was_given(
    rows: WindowRows, opened: Window, settle: Settle, qtbot: Any
) -> None:
    session, timeline = rows.session, opened.timeline
    session.edit(lambda d: d.set_window("p1", 2, (10, 20, 30, 50)))
    session.go(2)
    settle(opened)
    assert not rows.remove.isVisibleTo(opened)  # the only one
    session.edit(lambda d: d.set_window("p1", 10, (50, 20, 90, 60)))
    assert rows.remove.isVisibleTo(opened)
    session.go(9)
    settle(opened)
    assert not rows.remove.isVisibleTo(opened)
    at = QPointF(timeline.places.x_of(9), timeline.places.lane_y(0))
    menu = menu_for(timeline, timeline.places.hit(at), at.x())
    wanted = texts.REMOVE_BOX.format(frame=10)
    next(entry for entry in menu.actions() if entry.text() == wanted).trigger()
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    own = window_of(rows)
    assert own is not None
    assert [key.frame for key in own.keys if key.given] == [2]
    assert any(not key.given for key in own.keys)  # it was followed from there


def test_a_window_that_the_answer_proposes_is_seen_and_added(
    rows: WindowRows, opened: Window, settle: Settle
) -> None:
    settle(opened)
    panel, before = opened.inspector.panel, seen(opened)
    note = Note("a window helps", None, "window", "then takes 2 %", "p1", window=(70, 10, 120, 60))
    panel._warned = ()
    rows.session.show_answer(Answer(FRAME, 0.2, (note,)))
    line = panel.notes[0]
    assert line.button.text() == texts.ADD_GESTURE["window"]
    assert "2 %" in line.button.toolTip()
    edge = opened.viewer.point_of(120, 35).toPoint()
    part = slice(edge.y() - 20, edge.y() + 20), slice(edge.x() - 4, edge.x() + 5)
    assert (seen(opened)[part] != before[part]).any()
    QTest.mouseClick(line.button, LEFT)
    assert box_of(rows) == [70, 10, 120, 60]


def place(window: PickWindow, document: Document) -> None:
    document.change_pick("p1", window=window)


def test_it_says_where_it_is_lost(rows: WindowRows) -> None:
    session, box, window = rows.session, (20.0, 10.0, 60.0, 50.0), rows.on.window()
    for first, last, words in ((1, 12, []), (3, 12, ["until frame 3"]), (1, 9, ["from frame 9"])):
        keys = WindowKey(first, box), WindowKey(FRAME, box, given=True), WindowKey(last, box)
        own = PickWindow(12.0, keys)
        session.edit(functools.partial(place, own))
        assert rows.lost.isVisibleTo(window) == bool(words)
        assert all(each in rows.lost.text() for each in words)
    session.edit(lambda d: d.change_pick("p1", until=8.0))  # not where it does not act
    assert not rows.lost.isVisibleTo(window)


def test_a_hold_has_none(rows: WindowRows) -> None:
    rows.session.edit(lambda d: d.hold(FRAME, colour=(0.2, 0.5, 0.2), follow=False))
    rows.session.select("p2")
    assert not rows.on.isVisibleTo(rows.on.window())
    rows.session.select("p1")
    assert rows.on.isVisibleTo(rows.on.window())


def test_screen_readers_know_its_fields(rows: WindowRows) -> None:
    names = [box.accessibleName() for box in (*rows.numbers.values(), rows.feather, rows.bar)]
    assert all(names)
    assert len({*names}) == 5  # the bar and its number are the same thing
    assert all(part.toolTip() for part in (rows.on, *rows.numbers.values(), rows.feather))


def test_the_keyboard_goes_to_the_picture_when_the_numbers_go(
    rows: WindowRows, opened: Window, settle: Settle
) -> None:
    """Space, which plays, removed the pick: Qt gave the keyboard to the button *Remove*."""
    switch(rows)
    settle(opened)
    number = rows.numbers["x"]
    number.setFocus()
    opened._do("undo")
    settle(opened)
    assert not number.isVisible()
    assert opened.focusWidget() is opened.viewer


def test_the_wheel_scrolls_and_changes_no_number_below_it(
    rows: WindowRows, opened: Window, settle: Settle
) -> None:
    switch(rows)
    settle(opened)
    before, number = window_of(rows), rows.numbers["x"]
    opened.viewer.setFocus()
    where = QPointF(number.rect().center())
    for _ in range(3):
        wheel = QWheelEvent(
            where,
            number.mapToGlobal(where),
            QPoint(),
            QPoint(0, -120),
            Qt.MouseButton.NoButton,
            Qt.KeyboardModifier.NoModifier,
            Qt.ScrollPhase.NoScrollPhase,
            False,
        )
        QApplication.sendEvent(number, wheel)
    assert window_of(rows) == before
    assert not number.hasFocus()
