"""The window: keys, history, versions, saving and panels."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QTextDocument
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QMessageBox, QTabBar
from windows import FRAME, Settle, busiest

import palette4d
from palette4d.grade.document import Document
from palette4d.grade.follow import Progress
from palette4d.studio import menu_entries, texts
from palette4d.studio.window import Window


def test_versions_are_kept_used_and_compared(opened: Window, settle: Settle) -> None:
    id_ = busiest(opened)
    session = opened.session
    session.edit(lambda document: document.set(id_, rgb=(1.0, 0.0, 0.0)))
    QTest.keyClick(opened, Qt.Key.Key_V)
    session.edit(lambda document: document.set(id_, rgb=(0.0, 0.0, 1.0)))
    QTest.keyClick(opened, Qt.Key.Key_V)
    assert session.versions == ("A", "B")
    QTest.keyClick(opened, Qt.Key.Key_1)
    assert session.document is not None
    assert session.document.grade.colour(id_) == (1.0, 0.0, 0.0)
    opened.commands.compare_version()
    assert session.view.version == "B"  # A is what is shown
    settle(opened)
    picture = opened.viewer.picture
    assert picture is not None
    assert not np.array_equal(picture.before, picture.after)
    opened.commands.compare_version()
    assert session.view.version == ""


def test_names_that_look_like_html_are_shown_as_they_are(opened: Window, settle: Settle) -> None:
    name = "<h1>gone</h1> <img src='x.png'>"
    opened.session.say(name, "error")
    settle(opened)
    tip = QTextDocument()
    tip.setHtml(opened.line.says.toolTip())
    assert tip.toPlainText() == name
    assert opened.line.says.textFormat() == Qt.TextFormat.PlainText
    assert opened.line.file_facts.textFormat() == Qt.TextFormat.PlainText


def test_undo_redo_and_the_history_by_hand(opened: Window) -> None:
    id_ = busiest(opened)
    session = opened.session
    for value in (0.1, 0.2, 0.3):
        session.edit(lambda document, v=value: document.set(id_, rgb=(v, v, v)))
    QTest.keyClick(opened, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert session.document is not None
    assert session.document.grade.colour(id_) == (0.2, 0.2, 0.2)
    opened.history.go_to(1)
    assert session.document.grade.colour(id_) == (0.1, 0.1, 0.1)
    opened.history.go_to(3)
    assert session.document.grade.colour(id_) == (0.3, 0.3, 0.3)


def test_a_window_closes_when_its_last_pick_is_followed(
    opened: Window, sidecar: Path, qtbot: Any
) -> None:
    go_on = threading.Event()
    id_ = busiest(opened)

    def slowly(document: Document, clip: object, _: Progress | None) -> None:
        if isinstance(clip, str):
            assert go_on.wait(20)
        document.set(id_, rgb=(0.3, 0.2, 0.1))

    opened.session.edit_later(slowly, "done")
    opened.close()
    opened.open_path(str(sidecar))
    assert opened.isVisible()
    assert opened.session.status.text == texts.STILL_FOLLOWING
    go_on.set()
    qtbot.waitUntil(lambda: not opened.isVisible())
    assert Document.load(sidecar).grade.colour(id_) == (0.3, 0.2, 0.1)


def test_while_a_colour_is_dragged_only_its_own_panels_follow(opened: Window, qtbot: Any) -> None:
    session, places, wheel = opened.session, opened.timeline.places, opened.inspector.wheel
    session.select(busiest(opened))
    told = []
    session.on("document", lambda: told.append(session.revision), panel=True)
    shown, drawn = places.revision, opened.inspector.hex.text()
    QTest.mousePress(wheel, Qt.MouseButton.LeftButton, pos=QPoint(90, 60))
    for x in (95, 100, 105):
        QTest.mouseMove(wheel, QPoint(x, 60))
        qtbot.waitUntil(lambda: opened.viewer.current, timeout=20_000)
        qtbot.waitUntil(lambda: opened.turns.settled, timeout=20_000)
    assert session.dragging
    assert opened.inspector.hex.text() != drawn
    assert places.revision == shown
    assert not told
    QTest.mouseRelease(wheel, Qt.MouseButton.LeftButton, pos=QPoint(105, 60))
    assert places.revision == session.revision
    assert told == [session.revision]


def test_a_click_in_the_picture_brings_the_inspector(opened: Window, qtbot: Any) -> None:
    def in_front() -> list[str]:
        return [bar.tabText(bar.currentIndex()) for bar in opened.findChildren(QTabBar)]

    opened.docks["history"].raise_()
    qtbot.waitUntil(lambda: texts.HISTORY in in_front())
    QTest.mouseClick(opened.viewer, Qt.MouseButton.LeftButton, pos=opened.viewer.rect().center())
    qtbot.waitUntil(lambda: texts.INSPECTOR in in_front())


def test_a_locked_colour_that_is_changed_by_hand_is_said(opened: Window) -> None:
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.lock(id_), "locked")
    assert opened.session.status.text == "locked"
    opened.session.edit(lambda document: document.set(id_, rgb=(0.3, 0.2, 0.1)), "set it")
    assert opened.session.status.text == f"set it; {texts.LOCKED_MOVED.format(ids=id_)}"
    opened.session.undo()
    assert opened.session.status.text == texts.UNDONE


def test_the_playhead_goes_from_handle_to_handle(opened: Window) -> None:
    document, session = opened.session.document, opened.session
    assert document is not None
    frames = sorted({round(float(t)) for t in document.grade.core.polytope.vertices[:, 3]})
    for way, wanted in (("next_handle", frames), ("previous_handle", frames[::-1])):
        session.go(wanted[0])
        seen = [session.frame]
        for _ in frames:
            opened.commands.calls[way]()
            seen.append(session.frame)
        assert seen == [*wanted, wanted[-1]]


def test_arrows_in_and_out_points_and_playing(opened: Window, qtbot: Any) -> None:
    session = opened.session
    QTest.keyClick(opened, Qt.Key.Key_Right)
    assert session.frame == FRAME + 1
    QTest.keyClick(opened, Qt.Key.Key_Home)
    QTest.keyClick(opened, Qt.Key.Key_I)
    session.go(4)
    QTest.keyClick(opened, Qt.Key.Key_O)
    assert session.marks == (1, 4)
    visited = set()
    session.on("frame", lambda: visited.add(session.frame))
    QTest.keyClick(opened, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: visited == {1, 2, 3, 4}, timeout=30_000)
    QTest.keyClick(opened, Qt.Key.Key_Space)
    assert session.playing == 0
    QTest.keyClick(opened, Qt.Key.Key_J)
    assert session.playing == -1
    QTest.keyClick(opened, Qt.Key.Key_K)
    assert session.playing == 0


def test_a_sidecar_that_cannot_be_written_is_kept_elsewhere(
    opened: Window, sidecar: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from palette4d.common.errors import WriteError
    from palette4d.grade import sidecar as sidecars
    from palette4d.studio.session import recovery_files

    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    write = sidecars.write

    def full(path: Path, *words: Any, **more: Any) -> None:
        if path == sidecar:
            raise WriteError(f"{path}: cannot be written: no space left on the device")
        write(path, *words, **more)

    monkeypatch.setattr(sidecars, "write", full)
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(1.0, 0.0, 0.0)))
    assert not opened.session.save()
    assert "no space" in opened.session.status.text
    assert not opened.session.saved
    assert palette4d.load(next(recovery_files(sidecar))).grade.colour(id_) == (1.0, 0.0, 0.0)
    # Enter in the question of the closing window saves elsewhere.
    asked: list[str] = []
    monkeypatch.setattr(QMessageBox, "exec", lambda box: asked.append(box.defaultButton().text()))
    monkeypatch.setattr(QMessageBox, "clickedButton", lambda box: box.defaultButton())
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: ("", ""))
    opened.close()
    assert asked == ["Save as…"]
    assert opened.isVisible()
    monkeypatch.setattr(sidecars, "write", write)
    assert opened.session.save()
    assert palette4d.load(sidecar).grade.colour(id_) == (1.0, 0.0, 0.0)
    assert not next(recovery_files(sidecar)).exists()
    # Saved elsewhere, nothing is lost, and the window closes.
    monkeypatch.setattr(sidecars, "write", full)
    opened.session.edit(lambda document: document.set(id_, rgb=(0.0, 1.0, 0.0)))
    there = str(tmp_path / "there.p4d.json")
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (there, ""))
    opened.close()
    assert not opened.isVisible()
    assert palette4d.load(there).grade.colour(id_) == (0.0, 1.0, 0.0)


@pytest.mark.slow
def test_fifty_thousand_frames(
    window: Window, analysed: Path, settle: Settle, repo_root: Path, tmp_path: Path
) -> None:
    golden = repo_root / "tests" / "golden" / "sidecars" / "v1_split.p4d.json"  # frames 0 to 20
    fields = json.loads(golden.read_text())
    for part in (fields["polytope"]["vertices"], fields["polytope"]["blocks"]):
        for entry in part:
            entry.update({k: 2500 * entry[k] for k in ("frame", "first", "last") if k in entry})
    last = fields["clip"]["frames"]["last"] = 50_000
    (tmp_path / "many").mkdir()
    image = next((analysed / "clip").glob("*.png"))
    for frame in range(last + 1):
        (tmp_path / "many" / f"f.{frame:05d}.png").symlink_to(image)
    fields["clip"]["source"] = str(tmp_path / "many" / "f.#####.png")
    sidecar = tmp_path / "many.p4d.json"
    sidecar.write_text(json.dumps(fields))
    window.open_path(str(sidecar))
    window.session.go(last)
    settle(window)
    id_ = busiest(window)
    for _ in range(30):
        window.timeline.zoom(0.5)
    window.session.edit(lambda document: document.set(id_, rgb=(0.9, 0.3, 0.1)))
    settle(window)
    start, end = window.timeline.places.span
    assert (round(end), round(end - start)) == (last, 4)
    assert window.session.save()


def test_panels_follow_the_picture_of_a_drag(opened: Window, settle: Settle, qtbot: Any) -> None:
    id_ = busiest(opened)
    opened.session.select(id_)
    for red in (0.2, 0.4, 0.6):
        opened.session.drag(lambda document, red=red: document.set(id_, rgb=(red, 0.1, 0.2)))
        assert opened.inspector.boxes["R"].value() != red  # later, when the picture is shown
    qtbot.waitUntil(lambda: opened.turns.settled, timeout=10_000)
    assert opened.inspector.boxes["R"].value() == pytest.approx(0.6)
    picture = opened.viewer.picture
    assert picture is not None
    assert picture.request.revision == opened.session.revision
    opened.session.cancel()
    assert opened.inspector.boxes["R"].value() != pytest.approx(0.6)


@pytest.mark.parametrize("name", ["hex", "L"])
def test_a_field_gives_the_keyboard_back(opened: Window, name: str) -> None:
    session, panel = opened.session, opened.inspector
    assert session.document is not None
    id_ = busiest(opened)
    session.select(id_)
    before = session.document.grade.colour(id_)
    field = panel.hex if name == "hex" else panel.boxes[name]
    text = "#3366ff" if name == "hex" else "0.4"

    def press(key: Qt.Key, modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
        QTest.keyClick(opened.windowHandle(), key, modifier)

    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, text)
    QTest.keyClick(field, Qt.Key.Key_Return)
    after = session.document.grade.colour(id_)
    assert after != before
    assert not field.hasFocus()
    control, shift = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
    press(Qt.Key.Key_Z, control)
    assert session.document.grade.colour(id_) == before
    # So it is in a field that has the keyboard, but no text that waits for Enter.
    field.setFocus()
    press(Qt.Key.Key_Z, control | shift)
    assert session.document.grade.colour(id_) == after
    QTest.keyClick(field, Qt.Key.Key_Return)
    press(Qt.Key.Key_Space)
    assert session.playing
    press(Qt.Key.Key_Space)
    assert not session.playing


def test_each_menu_opens_with_a_key_of_its_own(window: Window) -> None:
    keys = [menu.title().partition("&")[2][:1].upper() for menu in window.menus.values()]
    assert all(keys)
    assert len(set(keys)) == len(keys)


def test_every_action_has_a_method_and_no_key_twice(window: Window) -> None:
    keys = [key for action in menu_entries.ACTIONS for key in action.keys]
    assert len(keys) == len(set(keys))
    for action in menu_entries.ACTIONS:
        assert callable(window.action(action.name))


def test_a_low_window_has_a_large_picture_and_all_of_a_pick(
    opened: Window, settle: Settle, qtbot: Any
) -> None:
    high = opened.docks["solid"].geometry()
    for k in range(4):
        colour = (0.1 + 0.15 * k, 0.5, 0.4)
        opened.session.edit(
            lambda d, colour=colour: d.pick(6, colour=colour, by=(0.1, 0, 0), follow=False)
        )
    opened.session.select("p1")
    opened.resize(1000, 600)
    settle(opened)
    viewer, inspector, panel = opened.viewer, opened.inspector, opened.inspector.panel
    assert viewer.height() >= 300
    assert viewer.height() > opened.timeline.height()
    assert inspector.isVisible()
    assert not opened.solid.isVisible() or opened.solid.visibleRegion().isEmpty()
    for part in (inspector.wheel, panel.add, panel.hold, panel.matte, panel.takes):
        assert part.visibleRegion().boundingRect().height() > part.height() - 4, part
    assert rows_seen(opened) == 4
    opened.resize(1200, 900)
    qtbot.waitUntil(lambda: not opened.solid.visibleRegion().isEmpty())
    assert opened.docks["solid"].geometry().top() == high.top()


def rows_seen(window: Window) -> int:
    """Return how many rows of the list of picks are seen whole."""
    rows = window.inspector.picks.list
    inside = rows.viewport().rect()
    boxes = [rows.visualItemRect(rows.topLevelItem(k)) for k in range(rows.topLevelItemCount())]
    return sum(box.isValid() and inside.contains(box) for box in boxes)


def test_an_answer_that_comes_moves_no_row_and_no_button(
    opened: Window, settle: Settle, qtbot: Any
) -> None:
    panel, rows = opened.inspector.panel, opened.inspector.picks.list
    for k in range(4):
        colour = (0.1 + 0.15 * k, 0.5, 0.4)
        opened.session.edit(
            lambda d, colour=colour: d.pick(6, colour=colour, by=(0.1, 0, 0), follow=False)
        )
    opened.resize(1600, 1000)
    opened.arrange()
    opened.session.select()
    settle(opened)

    def places() -> list[object]:
        parts = (opened.inspector.wheel, panel.add, panel.hold, panel.matte, rows)
        return [part.mapTo(opened, part.rect().topLeft()) for part in parts]

    before = rows.mapTo(opened, rows.rect().topLeft())
    opened.session.select("p1")
    qtbot.wait(50)  # laid out, without an answer
    assert not panel.settled
    empty = places()
    settle(opened)
    assert panel.takes.words.text()
    for line in panel.notes:
        line.say("Also takes its colour elsewhere, 3.3 %, in many words that need two lines.")
    qtbot.wait(50)
    assert places() == empty
    assert rows.mapTo(opened, rows.rect().topLeft()) == before
    assert rows_seen(opened) == 4
