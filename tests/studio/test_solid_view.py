"""The RGB solid in the window: turning it, and moving colours in it."""

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
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication

from palette4d.studio import theme
from palette4d.studio.session import Session
from palette4d.studio.solid_paint import troubles
from palette4d.studio.solid_view import SolidView

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def view(qapp: QApplication, tmp_path: Path) -> Generator[SolidView]:
    theme.dress(qapp)
    session = Session()
    made = SolidView(session)
    made.resize(400, 400)
    made.show()
    session.open_sidecar(shutil.copy(GOLDEN / "v1_split.p4d.json", tmp_path / "a.p4d.json"))
    session.go(0)
    qapp.processEvents()
    yield made
    session.close()
    made.deleteLater()
    qapp.processEvents()


def at(view: SolidView, id_: str) -> QPoint:
    palette = view.palette_now()
    assert palette is not None
    _, after = view.places(palette, view.view_of(palette))
    x, y = after[palette.ids.index(id_), :2].tolist()
    return QPointF(x, y).toPoint()


def move(view: SolidView, to: QPoint) -> None:
    where, keys = QPointF(to), Qt.KeyboardModifier.NoModifier
    kind = QEvent.Type.MouseMove
    view.mouseMoveEvent(QMouseEvent(kind, where, where, Qt.MouseButton.NoButton, LEFT, keys))


def drag(qtbot: Any, view: SolidView, start: QPoint, by: QPoint) -> None:
    qtbot.mousePress(view, LEFT, pos=start)
    for share in (0.5, 1.0):
        move(view, (QPointF(start) + QPointF(by) * share).toPoint())
    qtbot.mouseRelease(view, LEFT, pos=start + by)


def colour(view: SolidView, id_: str) -> np.ndarray:
    assert view.session.document is not None
    return np.array(view.session.document.grade.colour(id_))


def test_a_dragged_colour_follows_the_pointer(qtbot: Any, view: SolidView) -> None:
    start = at(view, "v2")
    move(view, start)
    assert view.session.hover == "v2"
    drag(qtbot, view, start, QPoint(-30, -20))
    assert view.session.hover is None  # the picture shows the edit, not the matte
    end = at(view, "v2")
    assert (end - start - QPoint(-30, -20)).manhattanLength() <= 2
    assert view.session.selection == ("v2",)
    document = view.session.document
    assert document is not None
    assert len(document.history.done) == 1
    view.session.undo()
    assert colour(view, "v2").tolist() == [0.9, 0.1, 0.1]


@pytest.mark.parametrize(("key", "channel"), [(Qt.Key.Key_X, 0), (Qt.Key.Key_Z, 2)])
def test_with_an_axis_key_one_channel_moves(
    qtbot: Any, view: SolidView, key: Qt.Key, channel: int
) -> None:
    before = colour(view, "v3")
    qtbot.keyPress(view, key)
    drag(qtbot, view, at(view, "v3"), QPoint(-25, 10))
    qtbot.keyRelease(view, key)
    moved = colour(view, "v3") - before
    assert abs(moved[channel]) > 0.02
    assert np.delete(moved, channel).tolist() == [0, 0]
    assert view.axis is None


def test_at_a_frame_between_vertices_a_stop_is_made(qtbot: Any, view: SolidView) -> None:
    view.session.go(5)
    drag(qtbot, view, at(view, "e2"), QPoint(-20, 0))
    document = view.session.document
    assert document is not None
    (setting,) = document.grade.settings.values()
    assert (setting.edge, setting.frame) == ("e2", 5)
    drag(qtbot, view, at(view, "e2"), QPoint(0, -20))  # the same stop again
    assert len(view.session.document.grade.settings) == 1


def test_a_drag_of_the_ground_turns_the_solid(qtbot: Any, view: SolidView) -> None:
    before = view.azimuth, view.elevation
    drag(qtbot, view, QPoint(12, 60), QPoint(60, 30))
    assert (view.azimuth, view.elevation) != before
    assert view.session.document is not None
    assert not view.session.document.grade.edited
    qtbot.mouseDClick(view, LEFT, pos=QPoint(12, 60))
    assert (view.azimuth, view.elevation) == before


def test_escape_takes_a_drag_back(qtbot: Any, view: SolidView) -> None:
    start = at(view, "v2")
    qtbot.mousePress(view, LEFT, pos=start)
    move(view, start + QPoint(-40, 0))
    assert view.session.dragging
    qtbot.keyClick(view, Qt.Key.Key_Escape)
    assert not view.session.dragging
    qtbot.mouseRelease(view, LEFT, pos=start)
    assert colour(view, "v2").tolist() == [0.9, 0.1, 0.1]


def test_what_an_edit_spoils_is_shown(view: SolidView) -> None:
    view.session.go(15)
    palette = view.palette_now()
    assert palette is not None
    assert not any(found.any() for found in troubles(palette))
    plain = view.grab().toImage()
    # The light grey above red, green and blue sinks between them.
    view.session.edit(lambda d: d.stop("e9", frame=15, rgb=(0.36, 0.36, 0.36)))
    palette = view.palette_now()
    assert palette is not None
    dents, turned = troubles(palette)
    assert dents.sum() == 3
    assert not turned.any()
    view.session.edit(lambda d: d.stop("e9", frame=15, rgb=(-0.8, -0.8, -0.8)))
    palette = view.palette_now()
    assert palette is not None
    assert troubles(palette)[1].any()
    assert view.grab().toImage() != plain


def test_tab_goes_through_the_colours_and_alt_arrows_move_one(qtbot: Any, view: SolidView) -> None:
    view.setFocus()
    assert view.focusNextPrevChild(True)
    assert view.session.selection == ("v1",)
    assert view.focusNextPrevChild(True)
    assert view.session.selection == ("v2",)
    qtbot.keyClick(view, Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    assert np.abs(colour(view, "v2") - [0.9, 0.1, 0.1]).max() == pytest.approx(0.008, abs=0.004)


def test_hover_and_selection_are_shared(view: SolidView) -> None:
    move(view, at(view, "v3"))
    assert view.session.hover == "v3"
    before = view.grab().toImage()
    view.session.select("v3")
    assert view.grab().toImage() != before


def test_what_an_edit_spoils_is_told_beside_the_solid(view: SolidView) -> None:
    palette = view.palette_now()
    assert palette is not None
    document = view.session.document
    assert document is not None
    before, _ = view.places(palette, view.view_of(palette))
    middle = palette.rgb.mean(axis=0)
    for id_ in document.grade.core.polytope.vertex_ids:  # through the middle: inside out
        old = np.array(document.grade.colour(id_))
        view.session.edit(lambda d, i=id_, o=old: d.set(i, rgb=(2 * middle - o).tolist()))
        if any(found.any() for found in troubles(view.palette_now() or palette)):
            break
    spoilt = view.palette_now()
    assert spoilt is not None
    words = view.painter.words_width(spoilt)
    assert 100 < words < view.width() / 2
    for points in view.places(spoilt, view.view_of(spoilt)):
        assert points[:, 0].min() > words
    view.session.edit(lambda d: d.undo())
    again, _ = view.places(palette, view.view_of(palette))
    assert view.painter.words_width(palette) == 0
    assert np.allclose(again, before)
