"""Picks and holds by the hand: a click, the wheel, the list, the range above the rows."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

os.environ["QT_QPA_PLATFORM"] = "offscreen"
pytest.importorskip("PySide6", reason="the extra palette4d[studio] is not installed")

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QWidget
from windows import Settle, send

import palette4d
from palette4d.cli.main import main
from palette4d.common.text import percent
from palette4d.grade.answer import Answer, Note, Place
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.picks import Pick
from palette4d.studio import grade_steps, states, texts, theme
from palette4d.studio.pick_panel import PickPanel
from palette4d.studio.pixels import place_between
from palette4d.studio.session import Session
from palette4d.studio.timeline_menu import menu_for
from palette4d.studio.window import Window

LATER = 1e9
LEFT = Qt.MouseButton.LeftButton
NEW = (0.75, 0.25, 0.5)


def at(window: Window, x: int, y: int) -> QPointF:
    """Where a pixel of the frame is drawn."""
    viewer = window.viewer
    return viewer.origin(viewer.panes()[0][1]) + QPointF(x + 0.5, y + 0.5) * viewer.scale()


def picks(window: Window) -> tuple[Pick, ...]:
    assert window.session.document is not None
    return window.session.document.grade.picks


def history(window: Window) -> list[str]:
    """The rows of the list of steps."""
    rows = window.history.list
    return [rows.item(row).text() for row in range(rows.count())]


def pick(qtbot: Any, window: Window, x: int, y: int) -> None:
    """Click a pixel and give it a new colour."""
    qtbot.mouseClick(window.viewer, LEFT, pos=at(window, x, y).toPoint())
    window.inspector.set_colour(np.array(NEW))
    assert not window.session.dragging
    assert picks(window)
    qtbot.waitUntil(lambda: not window.session.following, timeout=20_000)


def test_a_click_begins_a_pick_and_shows_its_pixel(qtbot: Any, opened: Window) -> None:
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    inspector = opened.inspector
    assert "40, 30" in inspector.title.text()
    assert opened.session.player is not None
    frame = opened.session.player.frame(opened.session.frame)
    assert frame is not None
    shown = [inspector.boxes[name].value() for name in "RGB"]
    np.testing.assert_allclose(shown, frame[30, 40, :3], atol=6e-5)
    assert not picks(opened)  # a look at a pixel changes nothing


def test_a_picked_colour_leaves_the_bytes_of_the_verb(
    qtbot: Any, opened: Window, sidecar: Path
) -> None:
    twin = Path(shutil.copy(sidecar, sidecar.with_name("twin.p4d.json")))
    pick(qtbot, opened, 40, 30)
    opened.session.tick(LATER)
    frame = str(opened.session.frame)
    words = ["pick", "--pixel", "40,30", "--frame", frame, "--to", *map(str, NEW)]
    assert main(["edit", str(twin), *words]) == 0
    assert sidecar.read_bytes() == twin.read_bytes()
    assert opened.session.selection == ("p1",)


def test_the_picture_follows_the_wheel_before_anything_is_kept(
    qtbot: Any, opened: Window, settle: Callable[[Window], None]
) -> None:
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    wheel, session = opened.inspector.wheel, opened.session
    for hue in (10.0, 60.0, 120.0):
        wheel.moved.emit((0.15, hue))
    assert session.dragging
    qtbot.waitUntil(lambda: len(picks(opened)) == 1, timeout=20_000)  # of the trial
    session.cancel()
    assert not picks(opened)


def test_a_drag_of_the_new_colour_learns_nothing(
    qtbot: Any, opened: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    learned = []
    learn = ClipOfPicks.learn
    monkeypatch.setattr(
        ClipOfPicks, "learn", lambda self, *args: (learned.append(args), learn(self, *args))[1]
    )
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    session, wheel = opened.session, opened.inspector.wheel
    wheel.moved.emit((0.15, 10.0))  # before it is known what the pick takes
    qtbot.waitUntil(lambda: len(picks(opened)) == 1, timeout=20_000)
    matte = picks(opened)[0].matte
    for hue in range(0, 360, 60):
        wheel.moved.emit((0.15, float(hue)))
        (pick,) = picks(opened)
        assert pick.matte == matte
    assert len(learned) == 1
    wheel.let_go.emit()
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    assert session.selection == ("p1",)
    before = len(learned)
    for hue in range(0, 360, 60):
        wheel.moved.emit((0.1, float(hue)))
    wheel.let_go.emit()
    assert len(learned) == before
    assert session.document is not None
    assert len(session.document.history.done) == 2


def test_bars_of_the_matte_show_live_and_are_one_step(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    session, panel = opened.session, opened.inspector.panel
    assert session.document is not None
    steps = len(session.document.history.done)
    for value in (1.0, 2.0, 3.0):
        panel.bars["reach"].moved.emit(value)
        assert picks(opened)[0].reach == value
        assert session.dragging
    panel.bars["reach"].let_go.emit()
    assert not session.dragging
    assert len(session.document.history.done) == steps + 1
    panel.bars["reach"].moved.emit(0.05)  # it catches at 0
    panel.bars["reach"].let_go.emit()
    assert picks(opened)[0].reach == 0
    lightness = panel.lightness
    qtbot.keyClick(lightness, Qt.Key.Key_Up)  # the lightest
    qtbot.keyClick(lightness, Qt.Key.Key_Left)
    assert picks(opened)[0].lightness == (0, 0.95)
    qtbot.mousePress(lightness, LEFT, pos=QPoint(lightness.width() - 3, 8))  # over the other end
    send(lightness, QPointF(-50, 8))
    qtbot.mouseRelease(lightness, LEFT, pos=QPoint(-50, 8))
    assert picks(opened)[0].lightness == (0, lightness.APART)
    for name, number in (("reach", 2.5), ("softness", 0.2)):
        panel.boxes[name].setValue(number)
        assert getattr(picks(opened)[0], name) == number
    qtbot.mouseClick(panel.whole_hue, LEFT, pos=QPoint(6, 6))
    qtbot.waitUntil(lambda: picks(opened)[0].whole_hue, timeout=20_000)
    for toward in ("colour", "shift"):
        qtbot.mouseClick(panel.steady, LEFT, pos=QPoint(6, 6))
        assert picks(opened)[0].toward == toward
    assert picks(opened)[0].matte is None


def test_a_stroke_is_seen_and_belongs_to_the_pick(
    qtbot: Any, opened: Window, settle: Callable[[Window], None]
) -> None:
    pick(qtbot, opened, 40, 30)
    settle(opened)
    session, viewer, shift = opened.session, opened.viewer, Qt.KeyboardModifier.ShiftModifier
    before = viewer.grab().toImage()
    start, end = at(opened, 70, 20), at(opened, 110, 26)
    QTest.mousePress(viewer, LEFT, shift, start.toPoint())
    send(viewer, end, shift)
    middle = ((start + end) / 2).toPoint()
    assert viewer.grab().toImage().pixelColor(middle) != before.pixelColor(middle)
    QTest.mouseRelease(viewer, LEFT, shift, end.toPoint())
    qtbot.waitUntil(lambda: bool(picks(opened)[0].areas), timeout=20_000)
    (area,) = picks(opened)[0].areas
    assert area.frame == session.frame
    assert area.points[0] == (70, 20)
    assert area.points[-1] == (110, 26)
    assert area.radius * viewer.scale() == pytest.approx(viewer.brush, abs=viewer.scale())
    settle(opened)
    # With the button, without Shift; a larger brush; the tool ends by Esc, and then a drag picks.
    qtbot.mouseClick(opened.inspector.panel.add, LEFT)
    wheel(viewer, start, 3)
    assert viewer.stroke_radius > area.radius
    QTest.mouseClick(viewer, LEFT, pos=start.toPoint())
    qtbot.waitUntil(lambda: len(picks(opened)[0].areas) == 2, timeout=20_000)
    assert session.tool == "add"
    qtbot.keyClick(opened, Qt.Key.Key_Escape)
    assert session.tool == ""
    assert session.selection == ("p1",)
    QTest.mouseClick(viewer, LEFT, pos=start.toPoint())
    assert session.place is not None


def test_shift_pans_without_a_pick(opened: Window) -> None:
    opened.session.select()
    QTest.mousePress(
        opened.viewer, LEFT, Qt.KeyboardModifier.ShiftModifier, at(opened, 70, 20).toPoint()
    )
    assert opened.viewer.doing == "pan"


def test_the_tool_hold_holds_once_and_leaves_the_pick_selected(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    session = opened.session
    qtbot.mouseClick(opened.inspector.panel.hold, LEFT)
    QTest.mouseClick(opened.viewer, LEFT, pos=at(opened, 20, 10).toPoint())
    qtbot.waitUntil(lambda: len(picks(opened)) == 2, timeout=20_000)
    assert picks(opened)[1].kind == "hold"
    assert session.tool == ""
    assert session.selection == ("p1",)


def test_where_a_pick_is_in_another_frame_is_clicked(
    qtbot: Any, opened: Window, settle: Settle, sidecar: Path
) -> None:
    pick(qtbot, opened, 40, 30)
    session, panel = opened.session, opened.inspector.panel
    session.save()
    twin = Path(shutil.copy(sidecar, sidecar.with_name("twin.p4d.json")))
    session.go(9)
    settle(opened)
    assert "frame 9" in panel.takes.words.text()
    qtbot.mouseClick(panel.takes.button, LEFT)
    QTest.mouseClick(opened.viewer, LEFT, pos=at(opened, 52, 34).toPoint())
    assert session.selection == ("p1",)
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    assert session.tool == ""
    assert session.save()
    words = ["pick", "--frame", "9", "--pixel", "52,34", "--with", "p1"]
    assert main(["edit", str(twin), *words]) == 0
    assert sidecar.read_bytes() == twin.read_bytes()
    grade_steps.set_range(session, "p1", 1, 7)
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    settle(opened)
    assert texts.NOT_HERE.format(frame=9) in panel.takes.words.text()
    session.go(6)
    settle(opened)
    assert not panel.takes.button.isVisibleTo(panel)


def answered(panel: PickPanel, found: Answer) -> None:
    """Show an answer, as if it had been found."""
    panel._resting.stop()
    panel._waits, panel._warned = None, ()
    panel.session.show_answer(found)


def test_the_answer_says_what_a_pick_takes(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    session, panel = opened.session, opened.inspector.panel
    qtbot.waitUntil(lambda: session.answer is not None, timeout=20_000)
    assert session.document is not None
    assert session.clip is not None
    expected = session.document.answer("p1", session.clip.source)
    assert session.answer == expected
    assert expected is not None
    assert percent(expected.share).replace(" ", "\u00a0") in panel.takes.words.text()
    assert [line.isVisibleTo(panel) for line in panel.notes] == [
        k < len(expected.notes) for k in range(len(panel.notes))
    ]
    session.select()
    assert session.answer is None
    assert not panel.isVisibleTo(opened)


def test_an_answer_goes_as_soon_as_its_pick_is_another_one(qtbot: Any, opened: Window) -> None:
    """It was there until the pick was followed and measured, with a button that did it again."""
    pick(qtbot, opened, 40, 30)
    session, panel = opened.session, opened.inspector.panel
    qtbot.waitUntil(lambda: session.answer is not None, timeout=20_000)
    first = session.answer
    shown = list[object]()
    session.on("answer", lambda: shown.append(session.answer))
    grade_steps.set_window(session, "p1", 6, (20, 10, 70, 50))
    qtbot.waitUntil(lambda: bool(shown), timeout=20_000)
    assert shown[0] is None
    assert panel.takes.words.text() == texts.LOOKING
    qtbot.waitUntil(lambda: session.answer is not None, timeout=20_000)
    assert session.answer != first


def test_an_answer_says_that_its_frame_is_out_of_the_range(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    session, words = opened.session, opened.inspector.panel.takes.words
    qtbot.waitUntil(lambda: session.answer is not None, timeout=20_000)
    assert texts.JUDGED not in words.text()
    session.edit(lambda document: document.change_pick("p1", start=9))
    qtbot.waitUntil(lambda: texts.JUDGED in words.text(), timeout=20_000)
    assert "frame 6" in words.text()


def test_a_range_within_a_known_path_follows_nothing(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    session, said = opened.session, list[str]()
    assert session.document is not None
    path = session.document.grade.pick("p1").path
    session.on("status", lambda: said.append(session.status.text))
    grade_steps.set_range(session, "p1", 3, 8)
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    grade_steps.set_fades(session, "p1", 2, 2)
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    assert session.document.grade.pick("p1").path == path
    assert session.document.grade.pick("p1").fades == (2, 2)
    assert not [text for text in said if "of 12 frames" in text]


def test_the_answers_buttons_do_what_it_proposes(qtbot: Any, opened: Window, sidecar: Path) -> None:
    pick(qtbot, opened, 40, 30)
    session, panel = opened.session, opened.inspector.panel
    session.save()
    twin = Path(shutil.copy(sidecar, sidecar.with_name("twin.p4d.json")))
    green = Note("also", Place(6, (120, 70), 5, (0.3, 0.4, 0.2)), "hold", "leaves 0.1 %", "p1")
    sky = Note("not", Place(6, (90, 12), 7, (0, 0, 1)), "area", "then takes 10 %", "p1")
    other, part = panel.notes[:2]
    answered(panel, Answer(6, 0.2, (green, sky)))
    assert other.button.isVisibleTo(panel)
    assert "0.1 %" in other.button.toolTip()
    qtbot.mouseClick(part.button, LEFT)
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    answered(panel, Answer(6, 0.2, (green,)))
    assert not part.isVisibleTo(panel)
    qtbot.mouseClick(other.button, LEFT)
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    assert session.selection == ("p1",)  # its answer is found again
    assert session.save()
    for words in (
        ["area", "p1", "--frame", "6", "--pixel", "90,12", "--box", "7"],
        ["hold", "--frame", "6", "--pixel", "120,70", "--box", "5"],
    ):
        assert main(["edit", str(twin), *words]) == 0
    assert sidecar.read_bytes() == twin.read_bytes()
    answered(panel, Answer(6, 0.2, (replace(green, gesture=""),)))  # no hold helps
    assert other.isVisibleTo(panel)
    assert not other.button.isVisibleTo(panel)


@pytest.mark.parametrize("by_key", [False, True])
def test_what_was_proposed_and_done_leaves_the_keyboard_on_no_button(
    qtbot: Any, opened: Window, by_key: bool
) -> None:
    """The next Space plays: it removed the pick, as the button that had the keyboard was gone."""
    pick(qtbot, opened, 40, 30)
    panel, session = opened.inspector.panel, opened.session
    held = Note("green", Place(6, (120, 70), 5, (0.2, 0.6, 0.3)), gesture="hold")
    answered(panel, Answer(6, 0.2, (held,)))
    button = panel.notes[0].button
    if by_key:
        button.setFocus()
        QTest.keyClick(button, Qt.Key.Key_Space)
    else:
        qtbot.mouseClick(button, LEFT)
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    answered(panel, Answer(6, 0.2))
    assert not button.isVisibleTo(panel)
    assert not isinstance(opened.focusWidget(), QAbstractButton)


def test_a_pick_that_floods_is_a_warning(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    panel = opened.inspector.panel
    answered(panel, Answer(6, 0.7, (Note("more than one thing", warns=True),)))
    assert theme.WARNING in panel.notes[0].words.styleSheet()
    answered(panel, Answer(6, 0.2))
    assert not panel.notes[0].isVisibleTo(panel)


def test_what_speaks_against_a_pick_stands_in_its_panel(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    words = opened.inspector.panel.warning.words

    def says(*, is_far: bool) -> None:
        qtbot.waitUntil(
            lambda: ("p1 lies far outside 0..1" in words.text()) == is_far, timeout=20_000
        )

    opened.session.edit(lambda document: document.change_pick("p1", to=(3.0, 0.25, 0.5)))
    says(is_far=True)
    opened.session.undo()
    says(is_far=False)


def test_the_matte_of_a_row_of_the_list_is_shown(
    qtbot: Any, opened: Window, settle: Settle
) -> None:
    pick(qtbot, opened, 40, 30)
    session, rows = opened.session, opened.inspector.picks.list
    opened.resize(1200, 1400)  # all of the list is seen
    settle(opened)  # the list is filled again, and where it stays
    item = rows.topLevelItem(0)
    assert item is not None
    QTest.mouseMove(rows.viewport(), rows.visualItemRect(item).center())
    assert session.hover == "p1"
    assert session.shown_matte == "p1"
    QApplication.sendEvent(rows.viewport(), QEvent(QEvent.Type.Leave))
    assert session.hover is None
    timeline = opened.timeline
    lane = QPointF(timeline.places.x_of(6.5), timeline.places.lane_y(0)).toPoint()
    QTest.mouseMove(timeline, lane)
    assert session.hover == "p1"


def waiting_calls(session: Session, qtbot: Any) -> Callable[[], None]:
    """Keep what threads bring to the window; return what does it at last."""
    waiting: list[Callable[[], object]] = []
    posts, session.post = session.post, waiting.append

    def go_on() -> None:
        qtbot.waitUntil(
            lambda: any("_work.<locals>.<lambda>" in repr(call) for call in waiting), timeout=20_000
        )
        session.post = posts
        for call in waiting:
            call()
        qtbot.waitUntil(lambda: not session.following, timeout=20_000)

    return go_on


def test_a_change_while_a_hold_is_learned_is_not_lost(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    session = opened.session
    go_on = waiting_calls(session, qtbot)
    grade_steps.hold(session, states.Place(6, 120, 70, 5, (0.3, 0.4, 0.2)))
    session.edit(lambda document: document.change_pick("p1", to=(0.1, 0.2, 0.3)))
    go_on()
    first, second = picks(opened)
    assert first.to == (0.1, 0.2, 0.3)
    assert second.kind == "hold"
    assert second.matte is not None


def test_what_is_released_is_saved_before_it_is_followed(
    qtbot: Any, opened: Window, sidecar: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    twin = Path(shutil.copy(sidecar, sidecar.with_name("twin.p4d.json")))
    session = opened.session
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    go_on = waiting_calls(session, qtbot)
    opened.inspector.set_colour(np.array(NEW))
    assert session.following
    assert not session.saved
    session.tick(LATER)
    (found,) = palette4d.load(sidecar).grade.picks  # what a kill now would leave
    assert found.to == NEW
    assert found.path == ()
    assert [step.unread for step in palette4d.load(sidecar).history.done] == [True]
    assert main(["edit", str(sidecar), "history"]) == 0
    assert all(texts.UNREAD_STEP in said for said in (history(opened)[1], capsys.readouterr().out))
    assert session.saved
    go_on()
    assert not session.saved
    session.tick(2 * LATER)
    assert texts.UNREAD_STEP not in history(opened)[1]
    frame = str(session.frame)
    words = ["pick", "--pixel", "40,30", "--frame", frame, "--to", *map(str, NEW)]
    assert main(["edit", str(twin), *words]) == 0
    assert sidecar.read_bytes() == twin.read_bytes()


def test_a_pick_that_is_merged_with_other_edits_while_it_is_followed(
    qtbot: Any, opened: Window, sidecar: Path
) -> None:
    session = opened.session
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    go_on = waiting_calls(session, qtbot)
    opened.inspector.set_colour(np.array(NEW))
    session.edit(lambda document: document.set_ramp("smooth"))
    theirs = palette4d.load(sidecar)
    theirs.lock("v1")
    theirs.save()
    assert session.save()
    assert [step.unread for step in palette4d.load(sidecar).history.done] == [False, True]
    go_on()
    assert session.save()
    assert not any(step.unread for step in palette4d.load(sidecar).history.done)
    assert not session.unfollowed
    (found,) = picks(opened)
    assert found.path


def test_a_pick_that_is_undone_or_kept_while_it_is_followed(qtbot: Any, opened: Window) -> None:
    session = opened.session
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    go_on = waiting_calls(session, qtbot)
    opened.inspector.set_colour(np.array(NEW))
    grade_steps.keep_version(session)
    session.undo()
    go_on()
    assert not picks(opened)
    session.redo()
    (found,) = picks(opened)
    assert found.path
    assert session.document is not None
    assert session.document.grade.same_edits == ("A",)
    grade_steps.use_version(session, "A")
    assert picks(opened) == (found,)


@pytest.mark.parametrize("by", ["this window", "the next window"])
def test_edits_that_follow_each_other_are_completed_in_their_order(
    qtbot: Any, opened: Window, settle: Settle, sidecar: Path, by: str
) -> None:
    twin = Path(shutil.copy(sidecar, sidecar.with_name("twin.p4d.json")))
    session = opened.session
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    opened.inspector.set_colour(np.array(NEW))
    place = place_between(session, (118, 68), (122, 72))
    assert place is not None
    grade_steps.hold(session, place)
    grade_steps.set_range(session, "p1", 2, 9)
    grade_steps.shape_pick(session, "p1", False, reach=1.0)
    session.select("p2")
    grade_steps.reset(session)
    assert [len(picks(opened)), session.following] == [1, 4]
    if by == "the next window":
        assert session.save()
        killed = sidecar.read_bytes()
        qtbot.waitUntil(lambda: not session.following, timeout=60_000)
        assert session.save()
        assert not session.unfollowed
        sidecar.write_bytes(killed)
        session.revert()
        settle(opened)
        assert session.unfollowed == ["p1"]
        button = opened.banner.button(texts.FOLLOW_NOW)
        assert button is not None
        qtbot.mouseClick(button, LEFT)
        assert session.following == 4
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    settle(opened)
    assert opened.banner.button(texts.FOLLOW_NOW) is None
    session.undo()
    assert session.save()
    for words in (
        ["pick", "--pixel", "40,30", "--frame", "6", "--to", *map(str, NEW)],
        ["hold", "--frame", "6", "--pixel", "120,70", "--box", "5"],
        ["change", "p1", "--from", "2", "--until", "9"],
        ["change", "p1", "--reach", "1"],
        ["unpick", "p2"],
        ["undo"],
    ):
        assert main(["edit", str(twin), *words]) == 0
    assert sidecar.read_bytes() == twin.read_bytes()


def test_alt_click_holds(qtbot: Any, opened: Window) -> None:
    keys = Qt.KeyboardModifier.AltModifier
    qtbot.mouseClick(opened.viewer, LEFT, keys, at(opened, 20, 10).toPoint())
    qtbot.waitUntil(lambda: bool(picks(opened)), timeout=20_000)
    (hold,) = picks(opened)
    assert hold.kind == "hold"
    assert hold.pixel == (20, 10)


def test_the_list_switches_off_selects_and_removes(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    rows = opened.inspector.picks.list
    assert rows.topLevelItemCount() == 1
    item = rows.topLevelItem(0)
    assert item is not None
    assert item.text(0).startswith("p1")
    item.setCheckState(0, Qt.CheckState.Unchecked)
    qtbot.waitUntil(lambda: not picks(opened)[0].enabled)
    opened.session.undo()
    assert picks(opened)[0].enabled
    opened.session.select("p1")
    opened.inspector.boxes["R"].setValue(0.5)  # another colour for the same pick
    assert picks(opened)[0].to == (0.5, NEW[1], NEW[2])
    qtbot.mouseClick(opened.inspector.picks.remove, LEFT)
    assert not picks(opened)


def test_the_end_of_a_range_is_dragged(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    timeline, session = opened.timeline, opened.session
    _, last, _ = session.frames
    y = timeline.places.lane_y(0)
    start, end = QPointF(timeline.places.x_of(last), y), QPointF(timeline.places.x_of(last - 3), y)
    assert timeline.places.hit(start).grip == "until"
    qtbot.mousePress(timeline, LEFT, pos=start.toPoint())
    send(timeline, end)
    qtbot.mouseRelease(timeline, LEFT, pos=end.toPoint())
    qtbot.waitUntil(lambda: picks(opened)[0].until == last - 3, timeout=20_000)
    assert picks(opened)[0].start is None


def test_escape_takes_back_what_the_pointer_does_until_it_is_let_go(
    qtbot: Any, opened: Window
) -> None:
    pick(qtbot, opened, 40, 30)
    timeline, session, wheel = opened.timeline, opened.session, opened.inspector.wheel
    assert session.document is not None
    state, steps = session.document.grade.state, len(session.document.history.done)
    _, last, _ = session.frames
    y = timeline.places.lane_y(0)
    ends = [QPointF(timeline.places.x_of(frame), y) for frame in (last, last - 3)]
    middle = QPointF(wheel.rect().center())
    colours = [middle + QPointF(20, 0), middle + QPointF(0, 25)]
    area = [at(opened, x, 20) for x in (70, 110)]
    for part, places, keys in (
        (timeline, ends, Qt.KeyboardModifier.NoModifier),
        (wheel, colours, Qt.KeyboardModifier.NoModifier),
        (opened.viewer, area, Qt.KeyboardModifier.ShiftModifier),
    ):
        session.select("p1")
        qtbot.mousePress(part, LEFT, keys, places[0].toPoint())
        send(part, places[1], keys)
        opened.commands.cancel()
        send(part, places[0], keys)
        send(part, places[1], keys)
        assert session.document.grade.state == state
        qtbot.mouseRelease(part, LEFT, keys, places[1].toPoint())
        assert session.document.grade.state == state
    assert len(session.document.history.done) == steps
    assert timeline.places.dragged is None
    session.select("p1")
    qtbot.mouseClick(wheel, LEFT, pos=colours[1].toPoint())  # the next one does it
    assert session.document.grade.state != state


def test_a_colour_that_is_dragged_while_the_playhead_moves_is_kept(
    qtbot: Any, opened: Window
) -> None:
    session, wheel = opened.session, opened.inspector.wheel
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    frame, centre = session.frame, wheel.rect().center()
    qtbot.mousePress(wheel, LEFT, pos=centre + QPoint(20, 0))
    session.go(frame + 1)
    opened.inspector.refresh()
    qtbot.mouseRelease(wheel, LEFT, pos=centre + QPoint(20, 0))
    assert not session.dragging
    (made,) = picks(opened)
    assert made.frame == frame


def test_a_number_that_is_not_entered_yet_is_saved(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    field = opened.inspector.hex
    opened.activateWindow()
    field.setFocus()
    field.selectAll()
    qtbot.keyClicks(field, "#336699")
    opened.files.save()
    assert opened.session.path is not None
    (kept,) = palette4d.load(opened.session.path).grade.picks
    assert kept.to == pytest.approx((0.2, 0.4, 0.6), abs=2e-3)


def test_keys_set_the_range_at_the_playhead(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    session = opened.session
    session.select()
    opened.commands.calls["act_until"]()
    assert session.status.level == "warning"
    session.select("p1")
    for key, frame, wanted in (
        (Qt.Key.Key_BracketRight, 8, (None, 8)),
        (Qt.Key.Key_BracketLeft, 4, (4, 8)),
        (Qt.Key.Key_BracketRight, 2, (2, 2)),
    ):
        session.go(frame)
        qtbot.keyClick(opened, key)
        qtbot.waitUntil(
            lambda wanted=wanted: (picks(opened)[0].start, picks(opened)[0].until) == wanted,
            timeout=20_000,
        )


def wheel(widget: QWidget, at: QPointF, turns: int) -> None:
    """Turn the wheel with Shift down."""
    shift, phase = Qt.KeyboardModifier.ShiftModifier, Qt.ScrollPhase.NoScrollPhase
    none, turn = Qt.MouseButton.NoButton, QPoint(0, 120 * turns)
    widget.wheelEvent(QWheelEvent(at, at, QPoint(), turn, none, shift, phase, False))


def test_the_pipette_takes_a_colour_of_the_picture(qtbot: Any, opened: Window) -> None:
    document = opened.session.document
    assert document is not None
    id_ = document.grade.core.polytope.vertex_ids[0]
    opened.session.select(id_)
    qtbot.mouseClick(opened.inspector.dropper, LEFT)
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    assert opened.session.player is not None
    frame = opened.session.player.frame(opened.session.frame)
    assert frame is not None
    assert opened.session.document is not None
    np.testing.assert_allclose(
        opened.session.document.grade.colour(id_), frame[30, 40, :3], atol=1e-6
    )
    assert not opened.inspector.dropper.isChecked()


def test_versions_are_kept_and_used(qtbot: Any, opened: Window) -> None:
    session, gallery = opened.session, opened.gallery
    opened.show_or_hide("versions")
    document = session.document
    assert document is not None
    id_ = document.grade.core.polytope.vertex_ids[0]
    before = document.grade.colour(id_)
    qtbot.mouseClick(gallery.buttons["keep"], LEFT)
    session.edit(lambda d: d.set(id_, rgb=NEW))
    qtbot.mouseClick(gallery.buttons["keep"], LEFT)
    assert session.versions == ("A", "B")
    gallery.list.clearSelection()
    gallery.list.item(0).setSelected(True)
    qtbot.mouseClick(gallery.buttons["use"], LEFT)
    assert session.document is not None
    assert session.document.grade.colour(id_) == before
    assert session.document.grade.same_edits == ("A",)


def test_the_menu_of_a_range_changes_the_pick(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    timeline = opened.timeline
    place = QPointF(timeline.places.x_of(6.5), timeline.places.lane_y(0))

    def choose(text: str) -> None:
        menu = menu_for(timeline, timeline.places.hit(place), place.x())
        entries = [*menu.actions()]
        entries += [e for a in menu.actions() if a.menu() is not None for e in a.menu().actions()]
        next(entry for entry in entries if text in entry.text()).trigger()

    choose("of its hue")
    qtbot.waitUntil(lambda: picks(opened)[0].whole_hue, timeout=20_000)
    choose("5 frames")
    qtbot.waitUntil(lambda: picks(opened)[0].fade == 5, timeout=20_000)
    choose("same new colour")
    qtbot.waitUntil(lambda: picks(opened)[0].toward == "colour", timeout=20_000)
    # Ctrl on an end of the range, which drags the fade, keeps the selection.
    places, (found,) = timeline.places, picks(opened)
    opened.session.select(found.id)
    end = QPointF(places.x_of(places.reach(found)[2]), places.lane_y(0)).toPoint()
    qtbot.mouseClick(timeline, LEFT, Qt.KeyboardModifier.ControlModifier, end)
    assert opened.session.selection == (found.id,)
