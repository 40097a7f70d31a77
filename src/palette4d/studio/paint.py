"""What the views draw in common: discs as in `palette4d plot`, and colours as displayed."""

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QFont, QImage, QPainter, QPen, QPolygonF, QTransform
from PySide6.QtWidgets import QWidget

from palette4d.plotting import style
from palette4d.studio import theme

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]

#: A disc can be hit this far from its centre, however small it is drawn.
REACH = 8.0
SQUARE = Qt.PenCapStyle.FlatCap


def colour_of(rgb: ArrayLike) -> QColor:
    """Return the colour of three display values 0..255."""
    red, green, blue = (int(value) for value in np.asarray(rgb))
    return QColor(red, green, blue)


def pen(colour: str | QColor, width: float = 1.0, dash: list[float] | None = None) -> QPen:
    """Return a pen; dashes are in widths of the line."""
    result = QPen(QColor(colour), width)
    if dash is not None:
        result.setDashPattern(dash)
        result.setCapStyle(SQUARE)
    return result


def polygon(points: F64) -> QPolygonF:
    """Return (n, 2) points as a polygon, without points in the middle of straight lines."""
    if len(points) > 2:
        before, after = points[1:-1] - points[:-2], points[2:] - points[1:-1]
        turn = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
        back = (before * after).sum(axis=1) < 0
        points = points[np.concatenate([[True], (turn > 1e-6) | back, [True]])]
    return QPolygonF([QPointF(x, y) for x, y in points.tolist()])


def texture(colours: U8, left: float, width: float) -> QBrush:
    """Return a brush of (k, 3) columns of one width in pixels, the first at `left`."""
    row = np.empty((1, len(colours), 4), np.uint8)
    row[0, :, :3], row[0, :, 3] = colours[:, ::-1], 255
    image = QImage(row.tobytes(), len(colours), 1, 4 * len(colours), QImage.Format.Format_RGB32)
    brush = QBrush(image.copy())
    brush.setTransform(QTransform.fromTranslate(left, 0).scale(width, 1))
    return brush


def image_of(picture: U8, kind: QImage.Format | None = None) -> QImage:
    """Return an (h, w, 3 or 4) picture as an image of its own memory.

    It has the format that Qt draws twice as fast as others, unless `kind` is given.
    """
    height, width, channels = picture.shape
    own = QImage.Format.Format_RGB888 if channels == 3 else QImage.Format.Format_RGBX8888
    data = np.ascontiguousarray(picture)
    image = QImage(data.data, width, height, channels * width, kind or own)
    return image.convertToFormat(QImage.Format.Format_RGB32) if kind is None else image.copy()


def disc(
    painter: QPainter,
    x: float,
    y: float,
    radius: float,
    before: U8,
    after: U8,
    kind: Literal["plain", "edited", "stop"],
    *,
    selected: bool = False,
    hovered: bool = False,
) -> None:
    """Draw a disc: the upper half is the colour before, the lower half the colour after.

    A stop has a second ring, an edited vertex a bright rim and a line across. A selected disc has
    a wide ring with a gap around it.
    """
    centre = QPointF(x, y)

    def ring(size: float, colour: str, width: float) -> None:
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(pen(colour, width))
        painter.drawEllipse(centre, size, size)

    def filled(size: float, colour: QColor | str) -> None:
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(colour))
        painter.drawEllipse(centre, size, size)

    rim = style.RING if kind == "plain" else style.BRIGHT
    if selected:
        filled(radius + 6.0, style.INK)
        ring(radius + 4.9, style.BRIGHT, 2.2)
    elif hovered:
        filled(radius + 4.6, style.INK)
        ring(radius + 4.0, style.RING, 1.2)
    filled(radius + (2.6 if kind == "stop" else 1.9), style.INK)
    if kind == "stop":
        ring(radius + 2.6, rim, 0.9)
    filled(radius, colour_of(before))
    if (before != after).any():
        painter.setBrush(colour_of(after))
        box = QRectF(x - radius, y - radius, 2 * radius, 2 * radius)
        painter.drawChord(box, 180 * 16, 180 * 16)
    if kind != "plain":
        painter.setPen(pen(style.INK, 0.9))
        painter.drawLine(QPointF(x - radius, y), QPointF(x + radius, y))
    ring(radius, rim, 1.7 if kind == "edited" else 1.0)


def ring(
    painter: QPainter, draw: Callable[[], object], *, thin: bool = False, dashed: bool = False
) -> None:
    """Draw a line that is seen on any picture: dark below bright."""
    slim = 0.55 if thin or dashed else 1.0
    for width, colour in ((4.2, QColor(0, 0, 0, 190)), (1.8, QColor(255, 255, 255, 255))):
        pen = QPen(colour, width * slim)
        if dashed and width < 2:
            pen.setDashPattern([4, 3])
        painter.setPen(pen)
        draw()


def padlock(painter: QPainter, x: float, y: float) -> None:
    """Draw a small padlock centred at a point."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for colour, width in ((style.INK, 3.6), (style.BRIGHT, 1.3)):
        painter.setPen(pen(colour, width))
        painter.drawArc(QRectF(x - 2.3, y - 5, 4.6, 6), 0, 180 * 16)
    painter.setPen(pen(style.INK, 1.2))
    painter.setBrush(QColor(style.BRIGHT))
    painter.drawRect(QRectF(x - 3.6, y - 1.6, 7.2, 5.2))


def small_font(widget: QWidget, points: float = 0.0, *, bold: bool = False) -> QFont:
    """Return the widget's font, smaller; `points` is added to its size."""
    font = QFont(widget.font())
    font.setPointSizeF(max(6.5, font.pointSizeF() + points))
    font.setBold(bold)
    return font


def label(
    painter: QPainter, x: float, y: float, text: str, colour: str, ground: str | None = None
) -> None:
    """Write a line of text centred at a point, with a ground behind it if one is given."""
    metrics = painter.fontMetrics()
    wide, tall = metrics.horizontalAdvance(text) + 4, metrics.height()
    box = QRectF(x - wide / 2, y - tall / 2, wide, tall)
    if ground is not None:
        back = QColor(ground)
        back.setAlpha(215)
        painter.fillRect(box.adjusted(0, 1, 0, -1), back)
    painter.setPen(QColor(colour))
    painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)


def focus_frame(painter: QPainter, widget: QWidget) -> None:
    """Draw a frame inside a widget that has the keyboard."""
    if widget.hasFocus():
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(pen(theme.FAINT, 1.0))
        painter.drawRect(QRectF(widget.rect()).adjusted(0.5, 0.5, -0.5, -0.5))
