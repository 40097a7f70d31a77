"""What tests of the window share: what the picture shows, and what a person drops."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from PySide6.QtCore import QEvent, QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent, QMouseEvent
from PySide6.QtWidgets import QWidget

from palette4d.grade.grade import Grade
from palette4d.studio.window import Window

Settle = Callable[[Window], None]
FRAME = 6


def busiest(window: Window) -> str:
    """The id of a vertex of the palette colour that the frame has most of."""
    document, player = window.session.document, window.session.player
    assert document is not None
    assert player is not None
    frame = window.session.frame
    palette = document.grade.palette(frame)
    shares = document.weights(player.read(frame), frame).mean(axis=(0, 1))
    at = int(np.argmax(shares))
    return palette.ends[at][int(palette.weights[at] > 0.5)]


def edits_of(grade: Grade) -> dict[str, object]:
    """The picks' new colours, and the boxes of their windows that were given."""
    return {
        pick.id: [pick.to, pick.window and [(key.frame, key.box) for key in pick.window.given.keys]]
        for pick in grade.picks
    }


def seen(window: Window) -> Any:
    """What the viewer draws, (h, w, 3) of 8 bits."""
    return pixels_of(window.viewer)


def pixels_of(widget: QWidget) -> Any:
    """What a widget draws, (h, w, 3) of 8 bits."""
    image = widget.grab().toImage()
    image = image.convertToFormat(image.Format.Format_RGB888)
    rows = np.array(np.frombuffer(image.constBits(), np.uint8)).reshape(image.height(), -1)
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3)


def send(
    widget: QWidget, to: QPointF, keys: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier
) -> None:
    """Move the pointer with the left button down."""
    kind, none = QEvent.Type.MouseMove, Qt.MouseButton.NoButton
    widget.mouseMoveEvent(QMouseEvent(kind, to, to, none, Qt.MouseButton.LeftButton, keys))


def drop(window: Window, path: str) -> None:
    """Drop a file on the window."""
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(path)])
    copy, left, none = (
        Qt.DropAction.CopyAction,
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
    )
    window.dropEvent(QDropEvent(QPointF(50, 50), copy, data, left, none))
