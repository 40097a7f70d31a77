"""The timeline in the window: what a person sees, drags and types."""

from __future__ import annotations

import os
import shutil
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

os.environ["QT_QPA_PLATFORM"] = "offscreen"
pytest.importorskip("PySide6", reason="the extra palette4d[studio] is not installed")

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtWidgets import QApplication

from palette4d.cli.main import main
from palette4d.plotting.layout import BAND
from palette4d.studio import grade_steps, theme, timeline_places
from palette4d.studio.session import Session
from palette4d.studio.states import Probe
from palette4d.studio.timeline_menu import menu_for
from palette4d.studio.timeline_view import TimelineView

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"
LATER = 1e9
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def sidecar(tmp_path: Path) -> Path:
    return Path(shutil.copy(GOLDEN / "v1_edited.p4d.json", tmp_path / "a.p4d.json"))


@pytest.fixture
def view(qapp: QApplication, sidecar: Path) -> Generator[TimelineView]:
    theme.dress(qapp)
    session = Session()
    made = TimelineView(session)
    made.resize(1000, 360)
    made.show()
    session.open_sidecar(sidecar)
    qapp.processEvents()
    yield made
    session.close()
    made.deleteLater()
    qapp.processEvents()


def place(view: TimelineView, id_: str) -> QPoint:
    """Where a handle is drawn."""
    disc = view.places.disc(id_)
    assert disc is not None
    return QPointF(disc.x, disc.y + view.places.top).toPoint()


def on_band(view: TimelineView, edge: str, frame: float) -> QPoint:
    found = view.places.timeline
    assert found is not None
    x, y = found[0].at(found[0].palette.edge_ids.index(edge), frame)
    return QPointF(x, y + view.places.top).toPoint()


def drag(qtbot: Any, view: TimelineView, start: QPoint, end: QPoint) -> None:
    qtbot.mousePress(view, LEFT, pos=start)
    for share in (0.4, 0.8, 1.0):
        at = QPointF(start) * (1 - share) + QPointF(end) * share
        qtbot.mouseMove(view, at.toPoint())
        # Offscreen, a moved pointer carries no button: send what a mouse sends.
        view.mouseMoveEvent(_moved(at))
    qtbot.mouseRelease(view, LEFT, pos=end)


def _moved(at: QPointF) -> Any:
    from PySide6.QtCore import QEvent
    from PySide6.QtGui import QMouseEvent

    keys = Qt.KeyboardModifier.NoModifier
    return QMouseEvent(QEvent.Type.MouseMove, at, at, Qt.MouseButton.NoButton, LEFT, keys)


def seen(view: TimelineView, at: QPoint) -> np.ndarray:
    colour = view.grab().toImage().pixelColor(at)
    return np.array([colour.red(), colour.green(), colour.blue()])


def test_a_row_shows_the_colour_before_above_and_after_below(view: TimelineView) -> None:
    document = view.session.document
    assert document is not None
    id_ = "v3"
    view.session.edit(lambda d: d.set(id_, rgb=(0.9, 0.1, 0.6)))
    view.session.go(14)
    disc = view.places.disc(id_)
    assert disc is not None
    at = place(view, id_)
    half = QPoint(0, round(disc.radius / 2))
    before = np.round(disc.before * 255)
    assert np.abs(seen(view, at - half) - before).max() <= 2
    assert np.abs(seen(view, at + half) - [230, 26, 153]).max() <= 2


def test_a_click_selects_and_shift_adds(qtbot: Any, view: TimelineView) -> None:
    qtbot.mouseClick(view, LEFT, pos=place(view, "v1"))
    assert view.session.selection == ("v1",)
    qtbot.mouseClick(view, LEFT, Qt.KeyboardModifier.ShiftModifier, place(view, "v2"))
    assert view.session.selection == ("v1", "v2")
    qtbot.mouseClick(view, LEFT, Qt.KeyboardModifier.ShiftModifier, place(view, "v1"))
    assert view.session.selection == ("v2",)
    qtbot.mouseClick(view, LEFT, pos=on_band(view, "e1", 5))
    assert view.session.selection == ("e1",)
    qtbot.mouseClick(view, LEFT, pos=QPoint(500, view.height() - timeline_places.FOOT - 3))
    assert view.session.selection == ()


def test_a_double_click_adds_a_stop_as_the_verb_does(
    qtbot: Any, view: TimelineView, sidecar: Path, tmp_path: Path
) -> None:
    twin = Path(shutil.copy(sidecar, tmp_path / "twin.p4d.json"))
    document = view.session.document
    assert document is not None
    rgb = document.grade.colour("e1", frame=5)
    qtbot.mouseDClick(view, LEFT, pos=on_band(view, "e1", 5))
    document = view.session.document
    (new,) = view.session.selection
    assert document.grade.settings[new].edge == "e1"
    assert document.grade.settings[new].frame == 5
    view.session.tick(LATER)
    words = ["set", "e1", "--frame", "5", "--rgb", *(repr(value) for value in rgb)]
    assert main(["edit", str(twin), *words]) == 0
    assert sidecar.read_bytes() == twin.read_bytes()


def test_a_stop_is_dragged_to_whole_frames_and_stays_inside_its_edge(
    qtbot: Any, view: TimelineView
) -> None:
    view.session.edit(lambda d: d.stop("e1", frame=4, rgb=(0.5, 0.5, 0.9)))
    document = view.session.document
    assert document is not None
    stop = next(i for i, s in document.grade.settings.items() if s.edge == "e1" and s.frame == 4)
    steps = len(document.history.done)
    start = place(view, stop)
    end = QPoint(round(view.places.x_of(6.3)), start.y() + 40)
    drag(qtbot, view, start, end)
    document = view.session.document
    assert document.grade.settings[stop].frame == 6
    assert len(document.history.done) == steps + 1  # a drag is one step
    drag(qtbot, view, place(view, stop), QPoint(view.width() + 500, start.y()))
    assert view.session.document is not None
    last = view.session.document.grade.settings[stop].frame
    edge = next(e for e in document.grade.core.polytope.edges[:1])
    assert last is not None
    assert last < float(document.grade.core.polytope.vertices[edge[1], 3])
    view.session.undo()
    view.session.undo()
    assert view.session.document.grade.settings[stop].frame == 4


def test_rows_that_have_no_room_are_scrolled_by_the_bar(qtbot: Any, view: TimelineView) -> None:
    view.resize(500, 110)
    places = view.places
    assert places.hidden > 0
    assert places.top == places.upper + places.head
    qtbot.mouseClick(view, LEFT, pos=QPoint(view.width() - 2, view.height() - 16))
    assert places.top == places.upper + places.head - places.hidden


def test_keys_go_through_handles_and_rows(qtbot: Any, view: TimelineView) -> None:
    view.setFocus()
    seen = []
    for _ in range(4):
        assert view.focusNextPrevChild(True)
        seen.append(view.session.selection)
    assert len(set(seen)) == 4
    assert view.focusNextPrevChild(False)
    assert view.session.selection == seen[2]
    view.step_row(1)
    (edge,) = view.session.selection
    view.step_row(1)
    assert view.session.selection != (edge,)
    qtbot.keyClick(view, Qt.Key.Key_Escape)
    assert view.session.selection == ()


def test_a_stop_at_the_end_of_a_row_is_refused_in_words(view: TimelineView) -> None:
    first, *_ = view.session.frames
    view.session.go(first)
    view.session.select("v1")
    view.add_stop_at_playhead()
    assert view.session.status.level == "warning"
    assert "v1" in view.session.status.text


def test_nudge_and_reset_of_a_selected_stop(view: TimelineView) -> None:
    view.session.edit(lambda d: d.stop("e1", frame=4, rgb=(0.5, 0.5, 0.9)))
    document = view.session.document
    assert document is not None
    stop = next(i for i, s in document.grade.settings.items() if s.edge == "e1" and s.frame == 4)
    view.session.select(stop)
    view.nudge(1)
    assert view.session.document.grade.settings[stop].frame == 5
    grade_steps.reset(view.session)
    assert stop not in view.session.document.grade.settings


def test_the_ruler_moves_the_playhead(qtbot: Any, view: TimelineView) -> None:
    qtbot.mouseClick(view, LEFT, pos=QPoint(round(view.places.x_of(7.4)), 10))
    assert view.session.frame == 7


def test_zoom_keeps_the_frame_under_the_pointer_and_pans_with_the_playhead(
    view: TimelineView,
) -> None:
    x = view.places.x_of(6)
    view.zoom(0.5, x)
    assert view.places.x_of(6) == pytest.approx(x, abs=1.5)
    start, end = view.places.span
    assert end - start == pytest.approx(10)
    view.session.go(20)
    start, end = view.places.span
    assert start <= 20 <= end
    view.show_all()
    assert view.places.span == (0, 20)


def test_weights_of_the_pixel_are_written_beside_the_rows(view: TimelineView) -> None:
    gutter = (0, timeline_places.RULER, timeline_places.GUTTER, view.height())
    before = view.grab().copy(*gutter).toImage()
    assert view.session.document is not None
    ids = view.session.document.grade.palette(view.session.frame).ids
    view.session.show_probe(Probe(0, 0, (0, 0, 0), (0, 0, 0), {ids[0]: 0.75, ids[1]: 0.25}))
    assert view.grab().copy(*gutter).toImage() != before


def test_hover_is_shared(qtbot: Any, view: TimelineView) -> None:
    view.mouseMoveEvent(_moved(QPointF(place(view, "v1"))))
    assert view.session.hover == "v1"
    view.leaveEvent(QEvent(QEvent.Type.Leave))
    assert view.session.hover is None


def test_ten_thousand_frames_zoom_to_single_frames(
    qapp: QApplication, tmp_path: Path, qtbot: Any
) -> None:
    import json

    data = json.loads((GOLDEN / "v1_split.p4d.json").read_text(encoding="utf-8"))
    for part in (data["polytope"]["vertices"], data["polytope"]["blocks"]):
        for entry in part:
            entry.update({k: 500 * entry[k] for k in ("frame", "first", "last") if k in entry})
    data["clip"]["frames"]["last"] = 10_000
    path = tmp_path / "long.p4d.json"
    path.write_text(json.dumps(data), encoding="utf-8")
    session = Session()
    view = TimelineView(session)
    view.resize(1000, 300)
    session.open_sidecar(path)
    for _ in range(40):
        view.zoom(0.6)
    start, end = view.places.span
    assert end - start == pytest.approx(timeline_places.CLOSEST)
    x = view.places.x_of(session.frame)
    assert view.places.frame_at(x + view.places.scale.per_frame) == session.frame + 1
    view.grab()
    session.close()
    view.deleteLater()


def test_the_menu_of_a_stop_sets_its_ramp_and_locks_it(view: TimelineView) -> None:
    view.session.edit(lambda d: d.stop("e1", frame=4, rgb=(0.5, 0.5, 0.9)))
    document = view.session.document
    assert document is not None
    stop = next(i for i, s in document.grade.settings.items() if s.edge == "e1" and s.frame == 4)
    at = QPointF(place(view, stop))
    menu = menu_for(view, view.places.hit(at), at.x())
    ramps = next(a.menu() for a in menu.actions() if a.menu() is not None)
    next(a for a in ramps.actions() if a.text() == "step").trigger()
    assert view.session.document.grade.settings[stop].ramp == "hold"
    grade_steps.lock(view.session)
    assert view.session.document.grade.locks == (stop,)
    grade_steps.lock(view.session)
    assert view.session.document.grade.locks == ()
    next(a for a in menu.actions() if "stop" in a.text().lower()).trigger()
    assert stop not in view.session.document.grade.settings


@pytest.mark.parametrize("name", sorted(path.name for path in GOLDEN.glob("v1_*.p4d.json")))
def test_every_kind_of_palette_is_drawn(qapp: QApplication, tmp_path: Path, name: str) -> None:
    """One colour, one frame, scene-linear, picks: each is drawn in all panels."""
    from palette4d.studio.inspector import Inspector
    from palette4d.studio.solid_view import SolidView

    session = Session()
    views = [kind(session) for kind in (TimelineView, SolidView, Inspector)]
    empty = [view.grab().toImage() for view in views]
    session.open_sidecar(shutil.copy(GOLDEN / name, tmp_path / "a.p4d.json"))
    document = session.document
    assert document is not None
    for id_ in (*document.grade.core.polytope.vertex_ids, *document.grade.core.polytope.edge_ids):
        session.select(id_)
    for view, before in zip(views, empty, strict=True):
        assert view.grab().toImage() != before
    session.close()
    for view in views:
        view.deleteLater()


def test_bands_show_the_cores_colours_also_while_something_is_dragged(view: TimelineView) -> None:
    document = view.session.document
    assert document is not None
    view.session.go(20)
    for dragged in (False, True):
        if dragged:
            view.session.drag(lambda d: d.set("v1", rgb=(0.3, 0.2, 0.4)))
        content = view.places.content
        assert content is not None
        for edge, frame in (("e3", 3), ("e7", 17), ("e1", 6), ("e4", 4)):
            index = content.edge_ids.index(edge)
            at = on_band(view, edge, frame)
            # Near the upper rim is the colour before, near the lower rim the colour after.
            assert view.places.timeline is not None
            half = round(BAND * view.places.timeline[0].row_height) - 2
            touched = content.touched(index)
            # The line of the ramp is above one place of the lower half at most.
            for offsets, edited in (
                ((-half,), False),
                ((2, half) if touched else (half,), touched),
            ):
                wanted = content.colours(index, np.array([float(frame)]), edited=edited)[0]
                found = np.array([seen(view, at + QPoint(0, offset)) for offset in offsets])
                away = np.abs(found - np.clip(wanted, 0, 1) * 255).max(axis=1)
                assert away.min() <= 9, (edge, edited)
