"""The inspector's parts that show colours: swatch, hue-chroma wheel, and bars.

They know code values and draw what the screen shows. While they are dragged they emit `moved`, and
`let_go` at the end; a key emits both.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPainterPath,
    QPaintEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from palette4d.colour.oklch import Lch
from palette4d.plotting import style
from palette4d.studio import paint, theme

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
Shown = Callable[[F64], U8]

#: The chroma at the wheel's rim, for displays; more than sRGB's strongest colours have.
RIM = 0.33
#: Arrows of some keyboards come with it.
KEYPAD = Qt.KeyboardModifier.KeypadModifier
#: The wheel is computed at this size and scaled up.
GRAIN = 96


class Swatch(QWidget):
    """A colour before and after."""

    def __init__(self) -> None:
        """Begin grey."""
        super().__init__()
        self.before = self.after = np.zeros(3, np.uint8)
        self.names = ("", "")
        self.setMinimumSize(QSize(112, 40))
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def show_colours(self, before: U8, after: U8, names: tuple[str, str]) -> None:
        """Show two displayed colours with their names."""
        self.before, self.after, self.names = before, after, names
        self.setAccessibleName(f"{names[0]} {before.tolist()}, {names[1]} {after.tolist()}")
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw both halves, with names that can be read on any colour."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        box = QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5)
        path = QPainterPath()
        path.addRoundedRect(box, 4, 4)
        painter.setClipPath(path)
        half = box.width() / 2
        painter.setFont(paint.small_font(self, -1.5))
        for k, (colour, name) in enumerate(zip((self.before, self.after), self.names, strict=True)):
            part = QRectF(box.left() + k * half, box.top(), half, box.height())
            painter.fillRect(part, paint.colour_of(colour))
            luma = float(np.asarray(colour, np.float64) @ [0.2126, 0.7152, 0.0722])
            painter.setPen(QColor(0, 0, 0, 190) if luma > 110 else QColor(255, 255, 255, 190))
            where = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom
            painter.drawText(part.adjusted(0, 0, 0, -3), where, name)
        painter.setClipping(False)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(paint.pen(style.RIM, 1.0))
        painter.drawPath(path)
        painter.end()


class Keyed(QWidget):
    """A part whose value drags and arrows change; arrows do nothing else meanwhile."""

    let_go = Signal()
    KEYS: tuple[Qt.Key, ...] = (Qt.Key.Key_Left, Qt.Key.Key_Right)

    def _touch(self, event: QMouseEvent) -> None:
        """Take the value under the pointer."""

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take a value."""
        if event.button() == Qt.MouseButton.LeftButton:
            self._touch(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Take others."""
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._touch(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the drag."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.let_go.emit()

    def event(self, event: QEvent) -> bool:
        """Keep the arrows from the menus."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            plain = event.modifiers() in (Qt.KeyboardModifier.NoModifier, KEYPAD)
            if plain and event.key() in self.KEYS:
                event.accept()
                return True
        return super().event(event)


class Wheel(Keyed):
    """Hue around, chroma outwards, at one lightness; what cannot be displayed is dimmed."""

    moved = Signal(object)  #: (chroma, hue)
    KEYS = (*Keyed.KEYS, Qt.Key.Key_Up, Qt.Key.Key_Down)

    def __init__(self) -> None:
        """Begin grey."""
        super().__init__()
        self.lch, self.origin = np.zeros(3), np.zeros(3)
        self.others: list[F64] = []
        self._rim = RIM
        self._picture: tuple[object, QImage] | None = None
        self._convert: tuple[Lch, Shown, object] | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        """Return a square."""
        return QSize(136, 136)

    def show_colour(
        self,
        lch: F64,
        origin: F64,
        others: Sequence[F64],
        convert: tuple[Lch, Shown, object],
    ) -> None:
        """Show a colour, where it came from, and other selected colours.

        Parameters
        ----------
        lch, origin : (3,) float64
            Lightness, chroma, hue.
        others : sequence of (3,) float64
        convert : (Lch, callable, object)
            Lightness, chroma, hue to code values, these to displayed colours, and a key that
            changes with either.
        """
        self.lch, self.origin, self.others = lch, origin, list(others)
        self._rim = max(RIM, float(lch[1]) * 1.1, float(origin[1]) * 1.1)
        self._convert = convert
        self.update()

    def _circle(self) -> tuple[QPointF, float]:
        return QRectF(self.rect()).center(), min(self.width(), self.height()) / 2 - 3

    def point_of(self, lch: F64) -> QPointF:
        """Return where a colour is."""
        centre, radius = self._circle()
        reach = min(float(lch[1]) / self._rim, 1.0) * radius
        angle = math.radians(float(lch[2]))
        return centre + QPointF(reach * math.cos(angle), -reach * math.sin(angle))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the wheel."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        centre, radius = self._circle()
        if self._convert is not None and self.isEnabled():
            path = QPainterPath()
            path.addEllipse(centre, radius, radius)
            painter.setClipPath(path)
            box = QRectF(centre.x() - radius, centre.y() - radius, 2 * radius, 2 * radius)
            painter.drawImage(box, self._disc())
            painter.setClipping(False)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        bright = self.hasFocus()
        painter.setPen(paint.pen(style.BRIGHT if bright else style.RIM, 1.6 if bright else 1.0))
        painter.drawEllipse(centre, radius, radius)
        if self._convert is not None and self.isEnabled():
            for other in self.others:
                painter.setPen(paint.pen(style.INK, 1.0))
                painter.setBrush(QColor(style.BRIGHT))
                painter.drawEllipse(self.point_of(other), 2.2, 2.2)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            start, now = self.point_of(self.origin), self.point_of(self.lch)
            painter.setPen(paint.pen(style.INK, 2.4))
            painter.drawLine(start, now)
            painter.drawEllipse(start, 3.0, 3.0)
            painter.setPen(paint.pen(style.BRIGHT, 1.0))
            painter.drawLine(start, now)
            painter.drawEllipse(start, 3.0, 3.0)
            lch, shown, _ = self._convert
            seen = shown(lch.fitted(self.lch)[None])[0]
            paint.disc(painter, now.x(), now.y(), 6.0, seen, seen, "edited")
        painter.end()

    def _disc(self) -> QImage:
        assert self._convert is not None
        lch, shown, key = self._convert
        key = (key, round(float(self.lch[0]), 3), round(self._rim, 3))
        if self._picture is None or self._picture[0] != key:
            axis = (np.arange(GRAIN) + 0.5) / GRAIN * 2 - 1
            x, y = np.meshgrid(axis, -axis)
            wanted = np.stack(
                [
                    np.full_like(x, float(self.lch[0])),
                    np.hypot(x, y) * self._rim,
                    np.degrees(np.arctan2(y, x)) % 360,
                ],
                axis=-1,
            )
            rgb = lch.back(wanted)
            fits = lch.fits(rgb)
            picture = shown(rgb).astype(np.float64)
            grey = np.full(3, 44.0)
            picture[~fits] = grey + 0.12 * (picture[~fits] - grey)
            self._picture = key, paint.image_of(picture.astype(np.uint8))
        return self._picture[1]

    def _touch(self, event: QMouseEvent) -> None:
        """Change hue and chroma; Shift keeps the chroma, Ctrl the hue."""
        centre, radius = self._circle()
        away = event.position() - centre
        chroma = math.hypot(away.x(), away.y()) / radius * self._rim
        hue = math.degrees(math.atan2(-away.y(), away.x())) % 360
        keys = event.modifiers()
        if keys & Qt.KeyboardModifier.ShiftModifier:
            chroma = float(self.lch[1])
        elif keys & Qt.KeyboardModifier.ControlModifier:
            hue = float(self.lch[2])
        self.moved.emit((min(chroma, self._rim), hue))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Left and right turn the hue, up and down change the chroma."""
        turns = {Qt.Key.Key_Left: 1.0, Qt.Key.Key_Right: -1.0}
        steps = {Qt.Key.Key_Up: 0.005, Qt.Key.Key_Down: -0.005}
        key = Qt.Key(event.key())
        if key not in turns and key not in steps:
            super().keyPressEvent(event)
            return
        chroma = max(0.0, float(self.lch[1]) + steps.get(key, 0.0))
        self.moved.emit((chroma, (float(self.lch[2]) + turns.get(key, 0.0)) % 360))
        self.let_go.emit()


class Bar(Keyed):
    """A value on a gradient of the colours that it leads to."""

    moved = Signal(float)

    def __init__(self, name: str, step: float) -> None:
        """Begin at 0."""
        super().__init__()
        self.low, self.high, self.value, self.origin, self.step = 0.0, 1.0, 0.0, 0.0, step
        self.colours: U8 = np.zeros((2, 3), np.uint8)
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setCursor(Qt.CursorShape.SizeHorCursor)
        self.setMinimumSize(QSize(60, 20))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def show_value(self, value: float, origin: float, low: float, high: float, colours: U8) -> None:
        """Show a value, where it came from, and the colours of the range."""
        self.value, self.origin, self.low, self.high, self.colours = (
            value,
            origin,
            low,
            high,
            colours,
        )
        self.update()

    def _x(self, value: float) -> float:
        share = (value - self.low) / max(self.high - self.low, 1e-9)
        return 5 + min(max(share, 0.0), 1.0) * (self.width() - 10)

    def _draw_gradient(self, painter: QPainter) -> QRectF:
        """Draw the bar without marks; return its place."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        box = QRectF(5, 5, self.width() - 10, self.height() - 10)
        painter.setPen(paint.pen(style.BRIGHT if self.hasFocus() else style.RIM, 1.0))
        if self.isEnabled():
            width = box.width() / max(len(self.colours), 1)
            painter.setBrush(paint.texture(self.colours, box.left(), width))
        else:
            painter.setBrush(QColor(theme.PAGE))
        painter.drawRoundedRect(box, 2, 2)
        return box

    def _draw_mark(self, painter: QPainter, x: float) -> None:
        painter.setPen(paint.pen(style.INK, 1.2))
        painter.setBrush(QColor(style.BRIGHT))
        painter.drawRoundedRect(QRectF(x - 2.5, 1.5, 5, self.height() - 3), 2, 2)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the gradient and the marks."""
        painter = QPainter(self)
        box = self._draw_gradient(painter)
        if self.isEnabled():
            start, now = self._x(self.origin), self._x(self.value)
            painter.setPen(paint.pen(style.INK, 3.0))
            painter.drawLine(QPointF(start, box.top()), QPointF(start, box.bottom()))
            painter.setPen(paint.pen(style.RING, 1.0))
            painter.drawLine(QPointF(start, box.top()), QPointF(start, box.bottom()))
            self._draw_mark(painter, now)
        painter.end()

    def _value_at(self, x: float) -> float:
        share = (x - 5) / max(self.width() - 10, 1)
        return self.low + min(max(share, 0.0), 1.0) * (self.high - self.low)

    def _touch(self, event: QMouseEvent) -> None:
        self.moved.emit(self._value_at(event.position().x()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Left and right change the value by a step."""
        steps = {Qt.Key.Key_Left: -self.step, Qt.Key.Key_Right: self.step}
        key = Qt.Key(event.key())
        if key not in steps:
            super().keyPressEvent(event)
            return
        self.moved.emit(self.value + steps[key])
        self.let_go.emit()


class Span(Bar):
    """A lowest and a highest value on one bar; what is outside of them is dimmed."""

    moved = Signal(object)  #: (lowest, highest)

    KEYS = (*Keyed.KEYS, Qt.Key.Key_Up, Qt.Key.Key_Down)
    #: The least distance between both values.
    APART = 0.01

    def __init__(self, name: str, step: float) -> None:
        """Begin with all of the bar."""
        super().__init__(name, step)
        self.span = (0.0, 1.0)
        self._upper = False  # the end that was touched last

    def show_span(self, span: tuple[float, float], colours: U8) -> None:
        """Show both values, and the colours of the bar from 0 to 1."""
        self.span, self.colours = span, colours
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the gradient and both marks."""
        painter = QPainter(self)
        box = self._draw_gradient(painter)
        low, high = map(self._x, self.span)
        inner = box.adjusted(0, 0.5, 0, -0.5)
        for left, right in ((inner.left(), low), (high, inner.right())):
            rest = QRectF(left, inner.top(), right - left, inner.height())
            painter.fillRect(rest, QColor(theme.PANEL))
            painter.setPen(paint.pen(theme.LINE, 1.0))
            painter.drawLine(QPointF(left, box.center().y()), QPointF(right, box.center().y()))
        for at in (low, high):
            self._draw_mark(painter, at)
        painter.end()

    def _move(self, value: float) -> None:
        """Move the end that was touched last."""
        low, high = self.span
        if self._upper:
            high = min(max(value, low + self.APART), 1.0)
        else:
            low = max(min(value, high - self.APART), 0.0)
        self.moved.emit((round(low, 3), round(high, 3)))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take the nearer end."""
        if event.button() == Qt.MouseButton.LeftButton:
            x = event.position().x()
            low, high = map(self._x, self.span)
            self._upper = abs(x - high) < abs(x - low)
            self._touch(event)

    def _touch(self, event: QMouseEvent) -> None:
        self._move(self._value_at(event.position().x()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Left and right move an end by a step; up and down choose which."""
        steps = {Qt.Key.Key_Left: -self.step, Qt.Key.Key_Right: self.step}
        key = Qt.Key(event.key())
        if key in (Qt.Key.Key_Up, Qt.Key.Key_Down):
            self._upper = key == Qt.Key.Key_Up
        elif key in steps:
            self._move(self.span[self._upper] + steps[key])
            self.let_go.emit()
        else:
            super().keyPressEvent(event)
