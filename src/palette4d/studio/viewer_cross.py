"""A cross that keys move over the picture, in the place of the pointer: it picks and holds."""

from typing import TYPE_CHECKING

from PySide6.QtCore import QLineF, QPointF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPen

if TYPE_CHECKING:
    from palette4d.studio.viewer import Viewer

#: The directions of the arrows.
ARROWS = {
    Qt.Key.Key_Left: QPointF(-1, 0),
    Qt.Key.Key_Right: QPointF(1, 0),
    Qt.Key.Key_Up: QPointF(0, -1),
    Qt.Key.Key_Down: QPointF(0, 1),
}
#: Pixels of the widget that an arrow moves, with Ctrl (at least one of the frame) and with Shift.
STEP, SMALL, LARGE = 8.0, 1.0, 64.0
#: Half of its size, and of the gap in its middle.
SIZE, GAP = 18.0, 5.0


class Cross:
    """The cross of a viewer; None of it is seen until it is switched on.

    Attributes
    ----------
    at : QPointF or None
        Where it is, in the frame; None: it is off.
    """

    def __init__(self, viewer: "Viewer") -> None:
        self.viewer = viewer
        self.at: QPointF | None = None

    def switch(self) -> None:
        """Show it in the middle of the picture that is seen, or hide it."""
        viewer = self.viewer
        if self.at is not None or viewer.session.clip is None:
            self.hide()
            return
        pane = viewer.panes()[-1][1]
        point = viewer.pointer or pane.center()
        if viewer.pixel_at(point) is None:
            point = pane.center()
        self.at = (point - viewer.origin(pane)) / viewer.scale()
        viewer.setFocus()
        self.show()

    def hide(self) -> None:
        """Hide it."""
        if self.at is not None:
            self.at, self.viewer.pointer = None, None
            self.viewer.session.show_probe(None)
            self.viewer.update()

    def hide_for_pointer(self) -> None:
        """Hide it, because the pointer is used again."""
        if self.at is not None:
            self.at = None
            self.viewer.update()

    def show(self) -> None:
        """Have the viewer probe the pixel below it."""
        if self.at is not None:
            self.viewer.point_at(self.point())

    def point(self) -> QPointF:
        """Return where it is in the widget."""
        assert self.at is not None
        return self.viewer.point_of(self.at.x(), self.at.y())

    def takes(self, event: QKeyEvent) -> bool:
        """Whether it takes a key: Enter shows it; while it is seen, arrows and Esc are its own."""
        enters = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        if self.at is None:
            return enters and self.viewer.session.clip is not None
        alt = event.modifiers() & Qt.KeyboardModifier.AltModifier
        return not alt and (enters or event.key() in (*ARROWS, Qt.Key.Key_Escape))

    def press(self, event: QKeyEvent) -> None:
        """Move it, pick with Enter, hold with Ctrl-Enter, or hide it with Esc."""
        viewer, clip = self.viewer, self.viewer.session.clip
        control = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if event.key() == Qt.Key.Key_Escape or clip is None or self.at is None:
            self.hide()
        elif event.key() in ARROWS:
            step = LARGE if shift else SMALL if control else STEP
            pixels = max(1.0, round(step / viewer.scale()))
            to = self.at + ARROWS[Qt.Key(event.key())] * pixels
            x = min(max(to.x(), 0.5), clip.width - 0.5)
            y = min(max(to.y(), 0.5), clip.height - 0.5)
            self.at = QPointF(x, y)
            self.show()
        else:
            place = viewer.place(self.point(), self.point())
            hold = control or viewer.session.tool == "hold"
            act = viewer.on_hold if hold else viewer.on_pick
            if place is not None and act is not None:
                act(place)
                if viewer.session.place is not None and viewer.on_picked is not None:
                    viewer.on_picked()

    def paint(self, painter: QPainter) -> None:
        """Draw it, seen on any picture."""
        if self.at is None:
            return
        point = self.point()
        for width, colour in ((4.0, QColor(0, 0, 0, 190)), (1.6, QColor(255, 255, 255))):
            painter.setPen(QPen(colour, width))
            for way in ARROWS.values():
                painter.drawLine(QLineF(point + way * GAP, point + way * SIZE))
