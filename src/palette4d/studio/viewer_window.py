"""The window of the selected pick over the picture: its box, its feather, and their handles.

Edges, corners and the middle take a drag; all the rest, also a click on them, picks as elsewhere.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import QPainter

from palette4d.grade.picks import Box, Pick
from palette4d.studio import grade_steps, paint
from palette4d.studio.pixels import proxy_of

if TYPE_CHECKING:
    from palette4d.studio.viewer import Viewer

#: Pixels of the widget within which a handle takes the pointer, and half of a handle's size.
NEAR, HALF = 6.0, 3.0
#: The least side of a window in pixels of the clip.
LEAST = 1.0

#: Which sides move: left, top, right, bottom. None of them: the feather.
Grip = tuple[bool, bool, bool, bool]
MIDDLE: Grip = (True, True, True, True)
FEATHER: Grip = (False, False, False, False)


@dataclass(frozen=True)
class Drag:
    """A press on a handle, which becomes a drag when the pointer moves.

    Attributes
    ----------
    id, frame
        The pick, and the playhead.
    grip : Grip
    start : QPointF
        Where it began, in the clip's pixels.
    box, feather
        The window then.
    """

    id: str
    frame: float
    grip: Grip
    start: QPointF
    box: Box
    feather: float


class WindowHandles:
    """The handles of a window in a viewer."""

    def __init__(self, viewer: "Viewer") -> None:
        self.viewer, self.session = viewer, viewer.session
        self._drag: Drag | None = None
        self._moved = False
        self._last: Box | None = None  # where the drag has put it

    # ------------------------------------------------------------------------------- where it is

    @property
    def pick(self) -> Pick | None:
        """The selected pick, if it has a window."""
        pick = self.session.picked
        return pick if pick is not None and pick.window is not None else None

    def box(self) -> Box | None:
        """Return the window's box at the playhead, in pixels of the palette's clip."""
        pick = self.pick
        if pick is None or pick.window is None or self.session.clip is None:
            return None
        left, top, right, bottom = pick.window.box_at(self.session.frame).tolist()
        return left, top, right, bottom

    def rects(self) -> tuple[QRectF, QRectF] | None:
        """Return where the box is in the widget, and where its feather ends."""
        box, pick = self.box(), self.pick
        if box is None or pick is None or pick.window is None:
            return None
        left, top, right, bottom = box
        soft = pick.window.feather
        return self._rect(box), self._rect((left - soft, top - soft, right + soft, bottom + soft))

    def _rect(self, box: Box) -> QRectF:
        """Return where a box of the palette's clip is in the widget."""
        left, top, right, bottom = box
        return QRectF(self.viewer.own_point(left, top), self.viewer.own_point(right, bottom))

    def _of_clip(self, point: QPointF) -> QPointF:
        """Return a point of the widget in pixels of the palette's clip."""
        (x, y), scale = proxy_of(self.session), self.viewer.scale()
        at = point - self.viewer.point_of(0, 0)
        return QPointF(at.x() / scale / x, at.y() / scale / y)

    def grip_at(self, point: QPointF, keys: Qt.KeyboardModifier) -> Grip | None:
        """Return the handle at a point of the widget; None without one, or with a key or a tool."""
        found, session = self.rects(), self.session
        busy = session.playing or session.tool or keys != Qt.KeyboardModifier.NoModifier
        if found is None or busy or not self.viewer.panes()[-1][1].contains(point):
            return None
        inner, outer = found
        x, y = point.x(), point.y()
        if inner.adjusted(-NEAR, -NEAR, NEAR, NEAR).contains(point):
            # Of a small window the edges are outside, so that its middle can be taken.
            near_x, near_y = (min(NEAR, side / 4) for side in (inner.width(), inner.height()))
            left, top = x < inner.left() + near_x, y < inner.top() + near_y
            right, bottom = x > inner.right() - near_x, y > inner.bottom() - near_y
            if left or top or right or bottom:
                return left, top, right, bottom
            from_middle = point - inner.center()
            near = math.hypot(from_middle.x(), from_middle.y()) <= NEAR
            return MIDDLE if near else None
        radius = (outer.width() - inner.width()) / 2
        return FEATHER if abs(_away(point, inner) - radius) <= NEAR else None

    def shape_at(self, point: QPointF, keys: Qt.KeyboardModifier) -> Qt.CursorShape | None:
        """Return the pointer's shape over a handle; None elsewhere."""
        grip, shapes = self.grip_at(point, keys), Qt.CursorShape
        if grip is None:
            return None
        left, top, right, bottom = grip
        if grip == FEATHER:
            inner = (self.rects() or (QRectF(), QRectF()))[0]
            if inner.left() <= point.x() <= inner.right():
                return shapes.SizeVerCursor
            if inner.top() <= point.y() <= inner.bottom():
                return shapes.SizeHorCursor
            falls = (point.x() < inner.left()) == (point.y() < inner.top())
            return shapes.SizeFDiagCursor if falls else shapes.SizeBDiagCursor
        if grip == MIDDLE:
            return shapes.SizeAllCursor
        if (left or right) and (top or bottom):
            return shapes.SizeFDiagCursor if left == top else shapes.SizeBDiagCursor
        return shapes.SizeHorCursor if left or right else shapes.SizeVerCursor

    # ---------------------------------------------------------------------------------- the drag

    def press(self, point: QPointF, grip: Grip) -> None:
        """Begin a drag with a handle."""
        pick, box = self.pick, self.box()
        assert pick is not None
        assert pick.window is not None
        assert box is not None
        start, soft = self._of_clip(point), pick.window.feather
        self._drag = Drag(pick.id, self.session.frame, grip, start, box, soft)
        self._moved, self._last = False, None

    def drag_to(self, point: QPointF) -> None:
        """Show the window as the pointer has it; not any more when the drag was taken back."""
        drag = self._drag
        if drag is None or (self._moved and not self.session.dragging):
            return
        self._moved, to = True, self._of_clip(point)
        if drag.grip == FEATHER:
            inner = QRectF(QPointF(*drag.box[:2]), QPointF(*drag.box[2:]))
            wider = _away(to, inner) - _away(drag.start, inner)
            soft = max(0.0, float(round(drag.feather + wider)))
            grade_steps.feather_window(self.session, drag.id, soft, dragging=True)
            return
        self._last = _moved(drag.box, drag.grip, to - drag.start)
        grade_steps.drag_window(self.session, drag.id, drag.frame, self._last)

    def let_go(self) -> bool:
        """Do what was dragged; return whether there was a drag, and not a click."""
        drag, self._drag = self._drag, None
        if drag is None or not self._moved:
            return False
        if self.session.dragging and self._last is not None:
            grade_steps.set_window(self.session, drag.id, drag.frame, self._last)
        else:
            self.session.drop()
        return True

    # -------------------------------------------------------------------------------- how it looks

    def _sharp(self, rect: QRectF) -> QRectF:
        """Return a rectangle whose lines are in the middles of the screen's pixels."""
        dense = self.viewer.devicePixelRatioF()
        ends = (rect.left(), rect.top(), rect.right(), rect.bottom())
        left, top, right, bottom = ((math.floor(end * dense) + 0.5) / dense for end in ends)
        return QRectF(QPointF(left, top), QPointF(right, bottom))

    def paint_proposed(self, painter: QPainter, box: Box) -> QRectF:
        """Draw a window that is proposed; return its upper left corner."""
        rect = self._sharp(self._rect(box))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        paint.ring(painter, lambda: painter.drawRect(rect), dashed=True)
        return QRectF(rect.topLeft() + QPointF(4, 8), QSizeF())

    def paint(self, painter: QPainter) -> None:
        """Draw the box with its handles, and dashed where its feather ends."""
        found = self.rects()
        if found is None:
            return
        inner, outer = (self._sharp(rect) for rect in found)
        painter.save()
        painter.setClipRect(self.viewer.panes()[-1][1])
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if outer != inner:
            across, down = inner.left() - outer.left(), inner.top() - outer.top()
            paint.ring(painter, lambda: painter.drawRoundedRect(outer, across, down), dashed=True)
        paint.ring(painter, lambda: painter.drawRect(inner), thin=True)
        painter.setBrush(Qt.GlobalColor.white)
        corners = (inner.topLeft(), inner.topRight(), inner.bottomLeft(), inner.bottomRight())
        squares = [QRectF(at.x() - HALF, at.y() - HALF, 2 * HALF, 2 * HALF) for at in corners]
        paint.ring(painter, lambda: painter.drawRects(squares), thin=True)
        paint.ring(painter, lambda: painter.drawEllipse(inner.center(), HALF, HALF), thin=True)
        painter.restore()


def _away(point: QPointF, box: QRectF) -> float:
    """Return how far a point is outside of a box."""
    x = max(box.left() - point.x(), 0.0, point.x() - box.right())
    y = max(box.top() - point.y(), 0.0, point.y() - box.bottom())
    return math.hypot(x, y)


def _moved(box: Box, grip: Grip, by: QPointF) -> Box:
    """Return a box some of whose sides are moved by whole pixels; none passes the other one."""
    step = np.rint([by.x(), by.y(), by.x(), by.y()])
    left, top, right, bottom = (np.array(box) + step * grip).tolist()
    if grip != MIDDLE:
        left = min(left, right - LEAST) if grip[0] else left
        top = min(top, bottom - LEAST) if grip[1] else top
        right = max(right, left + LEAST) if grip[2] else right
        bottom = max(bottom, top + LEAST) if grip[3] else bottom
    return left, top, right, bottom
