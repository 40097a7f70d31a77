"""Picks and holds by the hand: a click, the wheel, the list, the range above the rows."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

os.environ["QT_QPA_PLATFORM"] = "offscreen"
pytest.importorskip("PySide6", reason="the extra palette4d[studio] is not installed")

from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QWidget

from palette4d.cli.main import main
from palette4d.grade.picks import Pick
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
    return window.session.document.picks


def pick(qtbot: Any, window: Window, x: int, y: int) -> None:
    """Click a pixel and give it a new colour."""
    qtbot.mouseClick(window.viewer, LEFT, pos=at(window, x, y).toPoint())
    window.inspector.set_colour(np.array(NEW))
    qtbot.waitUntil(lambda: not window.session.dragging and bool(picks(window)), timeout=20_000)


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


def test_alt_click_holds(qtbot: Any, opened: Window) -> None:
    keys = Qt.KeyboardModifier.AltModifier
    qtbot.mouseClick(opened.viewer, LEFT, keys, at(opened, 20, 10).toPoint())
    qtbot.waitUntil(lambda: bool(picks(opened)), timeout=20_000)
    (hold,) = picks(opened)
    assert hold.kind == "hold"
    assert hold.pixel == (20, 10)


def test_what_speaks_against_the_picks_stands_below_them(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    notes = opened.inspector.picks.notes

    def says(*, is_far: bool) -> None:
        qtbot.waitUntil(lambda: ("p1 lies far outside 0..1" in notes.text()) == is_far)

    opened.session.edit(lambda document: document.change_pick("p1", to=(3.0, 0.25, 0.5)))
    says(is_far=True)
    assert notes.isVisibleTo(opened)
    opened.session.undo()
    says(is_far=False)


def test_the_list_switches_off_selects_and_removes(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    rows = opened.inspector.picks.list
    assert rows.topLevelItemCount() == 1
    item = rows.topLevelItem(0)
    assert item is not None
    assert item.text(0).startswith("p1")
    item.setCheckState(0, Qt.CheckState.Unchecked)
    assert not picks(opened)[0].enabled
    opened.session.undo()
    qtbot.waitUntil(lambda: not opened.session.solving)
    assert picks(opened)[0].enabled
    opened.session.select("p1")
    opened.inspector.boxes["R"].setValue(0.5)  # another colour for the same pick
    qtbot.waitUntil(lambda: not opened.session.solving)
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


def test_keys_set_the_range_at_the_playhead(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    session = opened.session
    session.select()
    opened.commands.act_until()
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


def send(widget: QWidget, to: QPointF) -> None:
    """Move the pointer with the left button down."""
    kind, none = QEvent.Type.MouseMove, Qt.MouseButton.NoButton
    widget.mouseMoveEvent(QMouseEvent(kind, to, to, none, LEFT, Qt.KeyboardModifier.NoModifier))


def test_the_pipette_takes_a_colour_of_the_picture(qtbot: Any, opened: Window) -> None:
    document = opened.session.document
    assert document is not None
    id_ = document.core.polytope.vertex_ids[0]
    opened.session.select(id_)
    qtbot.mouseClick(opened.inspector.dropper, LEFT)
    qtbot.mouseClick(opened.viewer, LEFT, pos=at(opened, 40, 30).toPoint())
    assert opened.session.player is not None
    frame = opened.session.player.frame(opened.session.frame)
    assert frame is not None
    assert opened.session.document is not None
    np.testing.assert_allclose(opened.session.document.colour(id_), frame[30, 40, :3], atol=1e-6)
    assert not opened.inspector.dropper.isChecked()


def test_versions_are_kept_and_used(qtbot: Any, opened: Window) -> None:
    session, versions = opened.session, opened.inspector.versions
    document = session.document
    assert document is not None
    id_ = document.core.polytope.vertex_ids[0]
    before = document.colour(id_)
    qtbot.mouseClick(versions.keep, LEFT)
    session.edit(lambda d: d.set(id_, rgb=NEW))
    qtbot.mouseClick(versions.keep, LEFT)
    assert list(versions.buttons) == ["A", "B"]
    qtbot.mouseClick(versions.buttons["A"], LEFT)
    assert session.document is not None
    assert session.document.colour(id_) == before
    assert versions.buttons["A"].isChecked()
    assert not versions.buttons["B"].isChecked()


def test_the_menu_of_a_range_changes_the_pick(qtbot: Any, opened: Window) -> None:
    pick(qtbot, opened, 40, 30)
    timeline = opened.timeline
    place = QPointF(timeline.places.x_of(6.5), timeline.places.lane_y(0))

    def choose(text: str) -> None:
        menu = timeline.menu_for(timeline.places.hit(place), place.x())
        entries = [*menu.actions()]
        entries += [e for a in menu.actions() if a.menu() is not None for e in a.menu().actions()]
        next(entry for entry in entries if text in entry.text()).trigger()

    choose("palette alone")
    qtbot.waitUntil(lambda: picks(opened)[0].global_only, timeout=20_000)
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
