"""Shortcuts that are changed, searched and kept; the keyboard alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest

from palette4d.studio.preferences import Preferences
from palette4d.studio.session import Session
from palette4d.studio.shortcuts import KeysPage, Shortcuts
from palette4d.studio.window import Window

Settle = Callable[[Window], None]


def keys(window: Window, name: str) -> list[str]:
    return [key.toString() for key in window._entry(window.keys.actions[name]).shortcuts()]


def test_a_changed_key_works_and_is_kept(opened: Window, qtbot: Any) -> None:
    page = KeysPage(opened.keys)
    page.choose("window.show_wipe")
    page.fields[0].setKeySequence(QKeySequence("Ctrl+Shift+Y"))
    page.fields[0].editingFinished.emit()
    page.close()
    assert keys(opened, "window.show_wipe") == ["Ctrl+Shift+Y", "W"]
    QTest.keyClick(
        opened,
        Qt.Key.Key_Y,
        Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier,
    )
    assert opened.session.view.compare == "wipe"
    again = Shortcuts(opened.settings, opened._entry)
    assert again.keys("window.show_wipe") == ["Ctrl+Shift+Y", "W"]


def test_a_key_is_taken_from_another_action_after_a_warning(opened: Window) -> None:
    page = KeysPage(opened.keys)
    page.choose("window.fit")
    page.fields[0].setKeySequence(QKeySequence("M"))
    assert "Matte" in page.told.text()
    page.fields[0].editingFinished.emit()
    assert keys(opened, "window.fit") == ["M"]
    assert keys(opened, "window.matte") == []
    page.reset.click()
    assert keys(opened, "window.fit") == ["F"]
    assert keys(opened, "window.matte") == ["M"]
    assert opened.settings.value("shortcuts/window.fit") is None


def test_panels_have_keys_of_their_own(opened: Window) -> None:
    taken = opened.keys.taken_by
    assert taken("timeline.show_all", "0") is None  # the solid's too, but never both
    assert taken("timeline.show_all", "F") == "window.fit"
    for name, action in opened.keys.actions.items():
        assert all(taken(name, key) is None for key in action.keys), name


def test_the_table_is_searched_by_action_and_key(opened: Window) -> None:
    page = KeysPage(opened.keys)

    def seen() -> set[str]:
        return {item.text(1) for item in page.table.items() if not item.isHidden()}

    everything = seen()
    page.table.search.setText("wipe")
    assert seen() == {"Wipe"}
    page.table.search.setText("ctrl+s")
    assert "Save" in seen()
    assert len(seen()) < len(everything)
    page.choose("window.save")
    assert page.fields[0].isEnabled()
    page.table.search.setText("wipe")
    assert not page.fields[0].isEnabled()  # its row is not seen any more


def test_arrows_move_a_cross_that_picks(opened: Window, settle: Settle, qtbot: Any) -> None:
    viewer, session = opened.viewer, opened.session
    viewer.setFocus()
    QTest.keyClick(viewer, Qt.Key.Key_Return)
    start = viewer.cross.at
    assert start is not None
    assert session.probe is not None
    frame = session.frame
    QTest.keyClick(viewer, Qt.Key.Key_Right, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClick(viewer, Qt.Key.Key_Up, Qt.KeyboardModifier.ControlModifier)
    assert viewer.cross.at == start + QPointF(1, -1)
    assert session.frame == frame
    assert (session.probe.x, session.probe.y) == (int(start.x()) + 1, int(start.y()) - 1)
    QTest.keyClick(viewer, Qt.Key.Key_Return)
    assert session.place is not None
    assert (session.place.x, session.place.y) == (session.probe.x, session.probe.y)
    # Its colour is typed, and then it is a pick.
    field = opened.focusWidget()
    assert field is opened.inspector.hex
    QTest.keyClicks(field, "#2040b0")
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert session.document is not None
    (made,) = session.document.grade.picks
    assert made.to == pytest.approx((0x20 / 255, 0x40 / 255, 0xB0 / 255), abs=1e-4)
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    viewer.setFocus()
    QTest.keyClick(viewer, Qt.Key.Key_Escape)
    assert viewer.cross.at is None
    QTest.keyClick(viewer, Qt.Key.Key_Right)
    assert session.frame != frame  # arrows are the menus' again


def test_the_cross_stays_in_the_picture_and_goes_with_the_pointer(
    opened: Window, qtbot: Any
) -> None:
    viewer = opened.viewer
    opened._do("cross")
    for _ in range(60):
        QTest.keyClick(viewer, Qt.Key.Key_Left, Qt.KeyboardModifier.ShiftModifier)
    assert viewer.cross.at is not None
    assert viewer.cross.at.x() == 0.5
    for x, y in ((20, 20), (50, 40)):  # Qt keeps the pointer's place of the test before
        qtbot.mouseMove(viewer, viewer.point_of(x, y).toPoint())
    qtbot.waitUntil(lambda: viewer.cross.at is None)


def test_the_ways_to_compare_are_reached_by_tab(opened: Window, qtbot: Any) -> None:
    wipe = opened.transport.compare["wipe"]
    for _ in range(40):
        QTest.keyClick(opened.focusWidget() or opened, Qt.Key.Key_Tab)
        if opened.focusWidget() is opened.transport.compare["after"]:
            break
    assert opened.focusWidget() is opened.transport.compare["after"]
    wipe.setFocus()
    QTest.keyClick(wipe, Qt.Key.Key_Space)
    assert opened.session.view.compare == "wipe"
    assert opened.session.playing == 0


def test_the_layout_is_reset(opened: Window) -> None:
    opened.docks["solid"].hide()
    opened.docks["timeline"].hide()
    opened.addDockWidget(Qt.DockWidgetArea.LeftDockWidgetArea, opened.docks["inspector"])
    opened._do("reset_layout")
    area = opened.dockWidgetArea(opened.docks["inspector"])
    assert area == Qt.DockWidgetArea.RightDockWidgetArea
    assert opened.docks["timeline"].isVisible()
    assert not opened.docks["solid"].isHidden()


def test_the_display_that_is_preferred_shows_all_clips(opened: Window, qtbot: Any) -> None:
    opened._do("preferences")
    dialog = opened.findChild(Preferences)
    assert dialog is not None
    chosen = dialog.display
    assert opened.session.display is not None
    own = opened.session.display.chosen(opened.session.looked).display
    other = next(k for k in range(1, chosen.count()) if chosen.itemData(k) != own)
    chosen.setCurrentIndex(other)
    chosen.activated.emit(other)
    name = chosen.itemData(other)
    assert opened.session.display.chosen(opened.session.looked).display == name
    again = Window(Session(), opened.settings)
    qtbot.addWidget(again)
    assert again.session.view.display == name
    assert again.session.view.view == ""  # the one that suits the clip
    assert Preferences(again).display.currentData() == name
    again.shut()
    assert opened.files.recent_files()
    dialog.forget.click()
    assert opened.files.recent_files() == []
