"""A smaller copy of the clip is shown: places are those of the palette's clip."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from windows import Settle, seen, send

from palette4d.cli.main import main
from palette4d.grade.picks import Pick
from palette4d.studio import texts
from palette4d.studio.window import Window

LEFT, SHIFT = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def proxied(opened: Window, settle: Settle, tmp_path: Path) -> Window:
    """A window that shows a copy of half the size."""
    proxy = str(tmp_path / "proxy" / "frame.####.png")
    assert main(["sample-clip", "-o", proxy, "--size", "80x45", "--frames", "12", "--quiet"]) == 0
    opened.session.find_clip(proxy)
    settle(opened)
    return opened


def first_pick(window: Window) -> Pick:
    document = window.session.document
    assert document is not None
    return document.grade.pick("p1")


def at(window: Window, x: float, y: float) -> QPoint:
    """Where a point of the palette's clip is drawn."""
    return window.viewer.point_of(x / 2, y / 2).toPoint()


def test_a_pick_is_made_where_it_is_in_the_palettes_clip(
    proxied: Window, settle: Settle, qtbot: Any
) -> None:
    session = proxied.session
    QTest.mouseClick(proxied.viewer, LEFT, pos=at(proxied, 81.0, 61.0))
    qtbot.waitUntil(lambda: session.draft is not None, timeout=20_000)
    proxied.inspector.set_colour(np.array((0.9, 0.1, 0.5)))
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    made = first_pick(proxied)
    assert made.pixel == (81, 61)
    assert made.path
    assert made.matte
    ring = at(proxied, 81.5, 61.5)
    settle(proxied)
    around = seen(proxied)[ring.y() - 9 : ring.y() + 10, ring.x() - 9 : ring.x() + 10]
    assert (around == 255).all(axis=2).any()  # its ring
    QTest.mousePress(proxied.viewer, LEFT, SHIFT, at(proxied, 41, 21))
    send(proxied.viewer, at(proxied, 61, 21).toPointF())
    QTest.mouseRelease(proxied.viewer, LEFT, SHIFT, at(proxied, 61, 21))
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    (area,) = first_pick(proxied).areas
    assert area.points[0] == (41, 21)
    assert area.points[-1] == (61, 21)
    # What was made on it is in the clip where it was seen.
    rows = proxied.inspector.panel.window_rows
    rows.on.click()
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    own = first_pick(proxied).window
    assert own is not None
    assert any(not key.given for key in own.keys)
    assert texts.NOT_FOLLOWED.split("{")[0] not in session.status.text
    left, top, right, bottom = own.box_at(6).tolist()
    assert left < 81 < right
    assert top < 61 < bottom
