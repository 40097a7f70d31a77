"""How the scopes are drawn: traces, graticules, targets, and the colours of picks as marks."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPolygonF, qRgb
from PySide6.QtWidgets import QWidget

from palette4d import _core
from palette4d.plotting import style
from palette4d.studio import paint, texts, theme
from palette4d.studio.scopes import SKIN_ANGLE, TARGETS, TRACES, Measured, vector_of

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]

#: Pixels between the scopes, above each for its name, and beside the waveforms for numbers.
GAP, HEAD, NUMBERS = 6.0, 17.0, 32.0
#: A waveform as wide as this times its height looks well; a vectorscope is a square.
WIDE = 1.7
#: The lines of the graticule, as 10-bit code values.
LINES = (0, 128, 256, 384, 512, 640, 768, 896, 1023)
GRATICULE, STRONG, SKIN = QColor(255, 255, 255, 34), QColor(255, 255, 255, 84), "#c9a57e"
#: The bins that a maximum of the histogram is looked for in: its ends may be as high as they like.
INNER = slice(_core.SCOPE_BELOW + 2, -_core.SCOPE_BELOW - 2)


@dataclass(frozen=True)
class Mark:
    """A pick or hold in the vectorscope: its display code values before and after."""

    id: str
    before: F64
    after: F64
    hold: bool
    chosen: bool


def tiles(box: QRectF, shapes: Sequence[float]) -> list[QRectF]:
    """Return a box for each scope, in one or more rows, so that they are as large as can be.

    `shapes` are the widths that look well, in heights.
    """
    best: tuple[float, list[QRectF]] = (-1.0, [])
    for across in range(1, len(shapes) + 1):
        down = math.ceil(len(shapes) / across)
        wide = (box.width() - GAP * (across - 1)) / across
        tall = (box.height() - GAP * (down - 1)) / down
        least = min(min(wide / shape, tall - HEAD) for shape in shapes)
        if least > best[0]:
            found = []
            for k in range(len(shapes)):
                row, column = divmod(k, across)
                last = len(shapes) - row * across < across
                own = wide
                if last:  # the last row is filled
                    rest = len(shapes) - row * across
                    own = (box.width() - GAP * (rest - 1)) / rest
                x, y = column * (own + GAP), row * (tall + GAP)
                found.append(QRectF(box.left() + x, box.top() + y, own, tall))
            best = least, found
    return best[1]


class ScopesPainter:
    """Draws scopes into boxes of a widget.

    Parameters
    ----------
    painter : QPainter
    widget : QWidget
        Its font is used.
    zoom : float
        Of the vectorscope.
    names : dict of str to str
        What the sides "before" and "after" are called.
    """

    def __init__(
        self, painter: QPainter, widget: QWidget, zoom: float, names: dict[str, str]
    ) -> None:
        self.painter, self.zoom, self.names = painter, zoom, names
        self.font = paint.small_font(widget, -1.5)
        painter.setFont(self.font)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)

    def draw(
        self, name: str, box: QRectF, sides: dict[str, Measured], marks: Sequence[Mark]
    ) -> None:
        """Draw a scope of the measured sides."""
        painter = self.painter
        painter.fillRect(box, QColor(theme.PIT))
        head = QRectF(box.left() + 6, box.top(), box.width() - 12, HEAD)
        painter.setPen(QColor(theme.FAINT))
        left = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
        # Beside the name of a side its own name has no room in a small scope.
        title = texts.SCOPES_SHOWN[name]
        part = head.width() / (len(sides) if head.width() > box.height() else 1)
        words = [title, *(self.names[side] for side in sides)][: 2 if len(sides) > 1 else 1]
        if painter.fontMetrics().horizontalAdvance(" ".join(words)) <= part:
            painter.drawText(head, left, title)
        inner = box.adjusted(6, HEAD, -6, -6)
        draws = {"waveform": self._waveform, "parade": self._parade, "histogram": self._histogram}
        if name == "vectorscope":
            self._vectorscopes(inner, sides, marks)
        else:
            draws[name](inner, sides)

    # ---------------------------------------------------------------------------- the waveforms

    def _levels(self, box: QRectF) -> QRectF:
        """Draw the lines of code values with their numbers; return where the traces stand."""
        painter = self.painter
        inner = box.adjusted(NUMBERS, 2, 0, -2)
        tall = self.painter.fontMetrics().height()
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        room = inner.height() / len(LINES) > tall * 0.9
        for k, value in enumerate(LINES):
            y = _level_y(inner, value / 1023)
            end = value in (0, 1023)
            painter.setPen(paint.pen(STRONG if end else GRATICULE, 1.0))
            painter.drawLine(QPointF(inner.left(), y), QPointF(inner.right(), y))
            if room or end or (k % 4 == 0):
                painter.setPen(QColor(theme.FAINT))
                painter.drawText(
                    QRectF(box.left(), y - tall / 2, NUMBERS - 5, tall), right, f"{value}"
                )
        return inner

    def _waveform(self, box: QRectF, sides: dict[str, Measured]) -> None:
        inner = self._levels(box)
        for part, (side, found) in zip(_split(inner, len(sides)), sides.items(), strict=True):
            self._trace(part, tinted(found.luma, TRACES[0]))
            self._caption(part, side, len(sides))

    def _parade(self, box: QRectF, sides: dict[str, Measured]) -> None:
        inner = self._levels(box)
        for part, (side, found) in zip(_split(inner, len(sides)), sides.items(), strict=True):
            thirds = zip(_split(part, 3, 2.0), found.parade, TRACES[1:], strict=True)
            for third, brightness, colour in thirds:
                self._trace(third, tinted(brightness, colour))
            self._caption(part, side, len(sides))

    def _trace(self, box: QRectF, picture: QImage) -> None:
        """Add the light of a trace to the lines below it."""
        mode = QPainter.CompositionMode
        self.painter.setCompositionMode(mode.CompositionMode_Plus)
        self.painter.drawImage(box, picture)
        self.painter.setCompositionMode(mode.CompositionMode_SourceOver)

    def _caption(self, box: QRectF, side: str, count: int) -> None:
        if count > 1:
            self.painter.setPen(QColor(theme.TEXT))
            flags = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop
            room = box.adjusted(4, -HEAD - 1, -2, 0)
            self.painter.drawText(room, flags, self.names[side])

    # ---------------------------------------------------------------------------- the histogram

    def _histogram(self, box: QRectF, sides: dict[str, Measured]) -> None:
        """Draw red, green and blue; of two sides the one before as a line."""
        painter = self.painter
        shown = sides.get("after") or sides["before"]
        ghost = sides["before"] if len(sides) > 1 else None
        tall = painter.fontMetrics().height()
        inner = box.adjusted(0, 0, 0, -tall)
        for value in LINES:
            x = _level_x(inner, value / 1023)
            painter.setPen(paint.pen(STRONG if value in (0, 1023) else GRATICULE, 1.0))
            painter.drawLine(QPointF(x, inner.top()), QPointF(x, inner.bottom()))
            if value % 256 in (0, 255):
                place = QRectF(x - 30, inner.bottom(), 60, tall)
                place.moveLeft(min(max(place.left(), box.left() - 22), box.right() - 38))
                painter.setPen(QColor(theme.FAINT))
                painter.drawText(place, Qt.AlignmentFlag.AlignCenter, f"{value}")
        rows = (inner.height() - 2 * GAP) / 3
        for k in range(3):
            row = QRectF(inner.left(), inner.top() + k * (rows + GAP), inner.width(), rows)
            both = [m.histogram[k + 1] for m in (shown, ghost) if m is not None]
            most = max(max(float(h[INNER].max()) for h in both), 1e-6)
            colour = QColor(*TRACES[k + 1])
            line = _curve(row, both[0], most)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(colour.red(), colour.green(), colour.blue(), 190))
            painter.drawPolygon(
                QPolygonF([QPointF(row.left(), row.bottom()), *line, row.bottomRight()])
            )
            painter.setBrush(Qt.BrushStyle.NoBrush)
            if len(both) > 1:
                painter.setPen(paint.pen(style.BRIGHT, 1.0))
                painter.drawPolyline(QPolygonF(_curve(row, both[1], most)))
            self._clipping(row, shown.clipped[k])
        if ghost is not None:
            painter.setPen(QColor(theme.TEXT))
            flags = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop
            painter.drawText(inner.adjusted(0, -HEAD - 1, 0, 0), flags, texts.GHOST)

    def _clipping(self, row: QRectF, shares: F64) -> None:
        """Write which share of the pixels is at the ends."""
        self.painter.setPen(QColor(theme.TEXT))
        for share, side in zip(shares, ("Left", "Right"), strict=True):
            if share >= 0.001:
                flags = Qt.AlignmentFlag[f"Align{side}"] | Qt.AlignmentFlag.AlignTop
                self.painter.drawText(row.adjusted(20, 0, -20, 0), flags, f"{share:.1%}")

    # -------------------------------------------------------------------------- the vectorscope

    def _vectorscopes(self, box: QRectF, sides: dict[str, Measured], marks: Sequence[Mark]) -> None:
        wide = box.width() > box.height()
        parts = _split(box, len(sides)) if wide else _split_down(box, len(sides))
        for part, (side, found) in zip(parts, sides.items(), strict=True):
            size = min(part.width(), part.height())
            square = QRectF(0, 0, size, size)
            square.moveCenter(part.center())
            self._graticule(square)
            self._trace(square, paint.image_of(found.vectors))
            self.painter.save()
            self.painter.setClipRect(square)
            self._marks(square, marks, side, both=len(sides) == 1)
            self.painter.restore()
            self._caption(part if wide else part.adjusted(0, HEAD, 0, 0), side, len(sides))

    def _graticule(self, box: QRectF) -> None:
        painter, centre, radius = self.painter, box.center(), box.width() / 2
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(paint.pen(STRONG, 1.0))
        painter.drawEllipse(centre, radius - 0.5, radius - 0.5)
        painter.setPen(paint.pen(GRATICULE, 1.0))
        for share in (0.25, 0.5, 0.75):
            painter.drawEllipse(centre, share * radius, share * radius)
        painter.drawLine(QLineF(centre.x() - radius, centre.y(), centre.x() + radius, centre.y()))
        painter.drawLine(QLineF(centre.x(), centre.y() - radius, centre.x(), centre.y() + radius))
        angle = math.radians(SKIN_ANGLE)
        skin = centre + QPointF(math.cos(angle), -math.sin(angle)) * (radius - 1)
        painter.setPen(paint.pen(SKIN, 1.2))
        painter.drawLine(centre, skin)
        for name, rgb in TARGETS.items():
            x, y = (vector_of(np.array(rgb), self.zoom) * radius).tolist()
            if math.hypot(x, y) > radius - 4:
                continue
            half = max(3.5, radius * 0.035)
            square = QRectF(centre.x() + x - half, centre.y() + y - half, 2 * half, 2 * half)
            colour = QColor(*(int(90 + 160 * value) for value in rgb))
            painter.setPen(paint.pen(colour, 1.2))
            painter.drawRect(square)
            if radius > 60:
                out = 1 + (half + 9) / math.hypot(x, y)
                paint.label(painter, centre.x() + x * out, centre.y() + y * out, name, theme.TEXT)

    def _marks(self, box: QRectF, marks: Sequence[Mark], side: str, *, both: bool) -> None:
        """Draw picks as rings and holds as squares: an arrow leads from before to after."""
        painter, centre, radius = self.painter, box.center(), box.width() / 2

        def place(rgb: F64) -> QPointF:
            x, y = (np.clip(vector_of(rgb, self.zoom), -1, 1) * radius).tolist()
            return centre + QPointF(x, y)

        for mark in sorted(marks, key=lambda each: each.chosen):
            start, end = place(mark.before), place(mark.after)
            if both and not mark.hold and (end - start).manhattanLength() > 6:
                self._arrow(start, end, mark.chosen)
                self._spot(start, mark, mark.before, 3.5)
            shown = mark.before if side == "before" else mark.after
            at = start if side == "before" else end
            self._spot(at, mark, shown, 5.5 if mark.chosen else 4.5)
            if mark.chosen:
                paint.label(painter, at.x() + 16, at.y() - 8, mark.id, style.BRIGHT, theme.PIT)

    def _arrow(self, start: QPointF, end: QPointF, bright: bool) -> None:
        for width, colour in ((3.4, style.INK), (1.4, style.BRIGHT if bright else style.RING)):
            self.painter.setPen(paint.pen(colour, width))
            self.painter.drawLine(start, end)

    def _spot(self, at: QPointF, mark: Mark, rgb: F64, size: float) -> None:
        painter = self.painter
        red, green, blue = (np.clip(rgb, 0, 1) * 255).astype(int).tolist()
        draw = painter.drawRect if mark.hold else painter.drawEllipse
        box = QRectF(at.x() - size, at.y() - size, 2 * size, 2 * size)
        painter.setPen(paint.pen(style.INK, 4.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        draw(box)
        painter.setPen(paint.pen(style.BRIGHT if mark.chosen else style.RING, 1.6))
        painter.setBrush(QColor(red, green, blue))
        draw(box)


def tinted(brightness: U8, colour: tuple[int, int, int]) -> QImage:
    """Return the picture of (h, w) brightness in one colour."""
    height, width = brightness.shape
    image = QImage(brightness.tobytes(), width, height, width, QImage.Format.Format_Indexed8)
    image.setColorTable([qRgb(*(part * k // 255 for part in colour)) for k in range(256)])
    return image.convertToFormat(QImage.Format.Format_RGB32)


def _level_y(box: QRectF, value: float) -> float:
    below = _core.SCOPE_BELOW
    return box.bottom() - (value * 255 + below + 0.5) / (256 + 2 * below) * box.height()


def _level_x(box: QRectF, value: float) -> float:
    below = _core.SCOPE_BELOW
    return box.left() + (value * 255 + below + 0.5) / (256 + 2 * below) * box.width()


def _split(box: QRectF, count: int, gap: float = GAP) -> list[QRectF]:
    """Return parts beside each other."""
    wide = (box.width() - gap * (count - 1)) / count
    return [
        QRectF(box.left() + k * (wide + gap), box.top(), wide, box.height()) for k in range(count)
    ]


def _split_down(box: QRectF, count: int) -> list[QRectF]:
    """Return parts below each other."""
    tall = (box.height() - GAP * (count - 1)) / count
    return [
        QRectF(box.left(), box.top() + k * (tall + GAP), box.width(), tall) for k in range(count)
    ]


def _curve(box: QRectF, shares: F64, most: float) -> list[QPointF]:
    wide = box.width() / len(shares)
    heights = np.minimum(shares / most, 1) * box.height()
    return [
        QPointF(box.left() + (k + 0.5) * wide, box.bottom() - tall)
        for k, tall in enumerate(heights.tolist())
    ]
