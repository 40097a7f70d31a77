"""How the viewer is drawn: the picture, the wipe, captions, picks and holds, and the probe."""

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFontMetricsF,
    QImage,
    QLinearGradient,
    QPainter,
    QPainterPath,
    QPainterPathStroker,
    QPen,
    QRegion,
)

from palette4d.grade.picks import Pick
from palette4d.studio import paint, texts, theme
from palette4d.studio.drafts import DRAFT
from palette4d.studio.preview import MATTE_GREY, REST_LIFT, REST_LIGHT
from palette4d.studio.row_names import row_name
from palette4d.studio.screen_colours import on_screen

if TYPE_CHECKING:
    from palette4d.studio.viewer import Viewer

#: From this zoom on pixels are squares.
SQUARES = 2.0
#: The least height of the view in which the probe lists weights.
LEAST_HEIGHT = 300
#: The most weights that the probe lists, and a name as wide as their longest one.
WEIGHTS, WIDEST_NAME = 4, "v12 greyish teal"


class ViewerPainter:
    """Draws a viewer.

    Attributes
    ----------
    plates : list of QRectF
        Where words lie over the picture: the names of marks, and the legend.
    probe : QRectF
        Where the probe was drawn.
    """

    def __init__(self, viewer: "Viewer") -> None:
        """Draw nothing yet."""
        self.viewer, self.session = viewer, viewer.session
        self.plates: list[QRectF] = []
        self.probe = QRectF()

    def paint(self) -> None:
        """Draw all."""
        painter = QPainter(self.viewer)
        painter.setClipRegion(QRegion(self.viewer.rect()).subtracted(self._covered()))
        painter.fillRect(self.viewer.rect(), QColor(theme.PIT))
        painter.setClipping(False)
        if self.session.clip is None:
            if self.session.document is not None:
                self._say(painter, texts.NO_PICTURE)
            return
        if self.viewer.problem:  # the banner says why
            self._say(painter, texts.BAD_PICTURE.format(frame=self.session.frame))
            return
        if self.viewer.picture is None:
            self._say(painter, texts.READING)
            return
        panes = self.viewer.panes()
        for side, pane in panes:
            painter.save()
            painter.setClipRect(pane)
            self._draw_side(painter, side, pane)
            painter.restore()
        if self.session.view.compare == "wipe" and not self.viewer.comparing:
            self._draw_wipe(painter)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._draw_captions(painter)
        self.plates.clear()
        self._draw_marks(painter)
        self.viewer.handles.paint(painter)
        self._draw_brush(painter)
        self.viewer.cross.paint(painter)
        if (
            self.viewer.doing == "box"
            and self.viewer.press is not None
            and self.viewer.pointer is not None
        ):
            painter.setBrush(Qt.BrushStyle.NoBrush)
            frame = QRectF(self.viewer.press, self.viewer.pointer).normalized()
            paint.ring(painter, lambda: painter.drawRect(frame))
        self._draw_legend(painter)
        self._draw_probe(painter)
        if self.viewer.late:
            text = texts.LATE.format(shown=self.viewer.shown_frame, frame=self.session.frame)
            _label(painter, text, QRectF(self.viewer.rect()), Qt.AlignmentFlag.AlignHCenter)

    def _covered(self) -> QRegion:
        """Return what pictures cover."""
        covered = QRegion()
        if self.session.clip is None or self.viewer.problem or not self.viewer.images:
            return covered
        for _, pane in self.viewer.panes():
            box = (self._target(pane) & pane).toAlignedRect()
            covered += QRegion(box.adjusted(1, 1, -1, -1))  # its edges are not whole pixels
        return covered

    def _target(self, pane: QRectF) -> QRectF:
        assert self.viewer.picture is not None
        region = self.viewer.picture.request.region
        origin, scale = self.viewer.origin(pane), self.viewer.scale()
        return QRectF(
            origin.x() + region.left * scale,
            origin.y() + region.top * scale,
            (region.right - region.left) * scale,
            (region.bottom - region.top) * scale,
        )

    def _draw_side(self, painter: QPainter, side: str, pane: QRectF) -> None:
        image = (
            self.viewer.images.get(side)
            or self.viewer.images.get("after")
            or self.viewer.images.get("before")
        )
        if image is None:
            return
        dense = self.viewer.scale() * self.viewer.devicePixelRatioF()
        smooth = dense < SQUARES
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, smooth)
        painter.drawImage(self._target(pane), image)
        outside = self.viewer.images.get("outside")
        if outside is not None and side == "after":
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, False)
            painter.drawImage(self._target(pane), outside)

    def _draw_wipe(self, painter: QPainter) -> None:
        pane, x = self.viewer.panes()[0][1], self.viewer.wipe_x()
        if "before" in self.viewer.images:
            painter.save()
            painter.setClipRect(QRectF(pane.left(), pane.top(), x - pane.left(), pane.height()))
            self._draw_side(painter, "before", pane)
            painter.restore()
        picture = self._target(pane) & pane
        for width, colour in ((3.0, QColor(0, 0, 0, 110)), (1.0, QColor(255, 255, 255, 200))):
            painter.setPen(QPen(colour, width))
            painter.drawLine(QPointF(x, picture.top()), QPointF(x, picture.bottom()))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(0, 0, 0, 140), 1))
        painter.setBrush(QColor(245, 245, 245))
        painter.drawEllipse(QPointF(x, picture.center().y()), 5, 5)

    def _draw_captions(self, painter: QPainter) -> None:
        view = self.session.view
        before, after = view.version or texts.BEFORE, view.after or texts.AFTER
        captions: list[tuple[str, QRectF, Qt.AlignmentFlag]] = []
        left, right = Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignRight
        panes = self.viewer.panes()
        if self.viewer.comparing or view.compare == "before":
            captions = [(before, panes[0][1], left)]
        elif view.compare == "side":
            captions = [(before, panes[0][1], left), (after, panes[1][1], left)]
        elif view.compare == "wipe":
            captions = [(before, panes[0][1], left), (after, panes[0][1], right)]
        elif view.after:
            captions = [(after, panes[0][1], left)]
        for text, pane, side in captions:
            _label(painter, text, self._target(pane) & pane, side)

    def _draw_marks(self, painter: QPainter) -> None:
        """Draw the picks (rings) and holds (squares) of this frame, with their colours."""
        session = self.session
        place = session.place
        made = session.dragging and session.draft is not None  # then it is one of the picks
        if place is not None and place.frame == session.frame and not made:
            box = self._mark(painter, place.x, place.y, place.box, hold=False, cross=True)
            inspected = np.array([place.colour, place.colour])
            self._flag(painter, box, texts.NEW_PICK, on_screen(session, inspected), bright=True)
        for pick in () if session.document is None else session.document.grade.picks:
            if pick.pixel is None or pick.frame != session.frame:
                continue
            x, y = pick.pixel
            box = self._mark(painter, x, y, pick.box or 1, hold=pick.kind == "hold")
            both = np.array([pick.rgb, pick.rgb if pick.to is None else pick.to])
            chosen = pick.id in session.selection
            self._flag(painter, box, pick.id, on_screen(session, both), bright=chosen)
        if session.picked is not None:
            self._draw_areas(painter, session.picked)

    def _draw_areas(self, painter: QPainter, pick: Pick) -> None:
        """Draw what was added to the selected pick, and what its answer proposes."""
        session, found = self.session, self.session.answer
        for area in pick.areas:
            if area.frame == session.frame:
                self._stroke(painter, area.points, area.radius, 70)
        for note in () if found is None else found.notes:
            place = note.place
            if found is not None and note.window is not None and found.frame == session.frame:
                corner = self.viewer.handles.paint_proposed(painter, note.window)
                none = np.zeros((0, 3), np.uint8)
                self._flag(painter, corner, texts.PROPOSED_WINDOW, none, bright=False)
            if place is None or place.frame != session.frame:
                continue
            box = self._mark(painter, *place.pixel, place.box, hold=True, dashed=True)
            text = {"": texts.ALSO, "hold": texts.PROPOSED_HOLD, "area": texts.PROPOSED_BOX}
            shown = on_screen(session, np.array([place.rgb]))
            self._flag(painter, box, text[note.gesture], shown, bright=False)

    def _draw_brush(self, painter: QPainter) -> None:
        """Draw the stroke, and the brush at the pointer."""
        viewer, at = self.viewer, self.viewer.pointer
        if viewer.stroke:
            self._stroke(painter, viewer.stroke, viewer.stroke_radius, 110)
        if at is not None and (viewer.shows_brush or viewer.stroke):
            painter.setBrush(Qt.BrushStyle.NoBrush)
            radius = viewer.stroke_radius * viewer.own_scale
            paint.ring(painter, lambda: painter.drawEllipse(at, radius, radius), thin=True)

    def _stroke(
        self, painter: QPainter, points: Sequence[tuple[float, float]], radius: float, alpha: int
    ) -> None:
        """Draw a box (one point) or a stroke of the frame."""
        scale = self.viewer.own_scale
        line = [self.viewer.own_point(x + 0.5, y + 0.5) for x, y in points]
        shape = QPainterPath()
        if len(line) == 1:
            half = radius * scale
            shape.addRect(line[0].x() - half, line[0].y() - half, 2 * half, 2 * half)
        else:
            middle = QPainterPath(line[0])
            for point in line[1:]:
                middle.lineTo(point)
            stroker = QPainterPathStroker()
            stroker.setWidth(2 * radius * scale)
            stroker.setCapStyle(Qt.PenCapStyle.RoundCap)
            stroker.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
            shape = stroker.createStroke(middle).simplified()
        painter.fillPath(shape, QColor(255, 255, 255, alpha))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        paint.ring(painter, lambda: painter.drawPath(shape), thin=True)

    def _mark(
        self,
        painter: QPainter,
        x: float,
        y: float,
        side: int,
        *,
        hold: bool,
        cross: bool = False,
        dashed: bool = False,
    ) -> QRectF:
        """Draw a ring or a square around pixels; return its box."""
        point = self.viewer.own_point(x + 0.5, y + 0.5)
        half = max(7.0, side * self.viewer.own_scale / 2)
        box = QRectF(point.x() - half, point.y() - half, 2 * half, 2 * half)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        draw = painter.drawRect if hold else painter.drawEllipse
        paint.ring(painter, lambda: draw(box), dashed=dashed)
        if hold and not dashed:
            paint.ring(painter, lambda: painter.drawPoint(point))
        if cross:
            for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                start = point + QPointF(dx, dy) * (half + 2)
                end = point + QPointF(dx, dy) * (half + 9)
                paint.ring(painter, functools.partial(painter.drawLine, start, end))
        return box

    def _flag(
        self,
        painter: QPainter,
        box: QRectF,
        text: str,
        colours: NDArray[np.uint8],
        *,
        bright: bool,
    ) -> None:
        """Write a name on a plate beside a mark, with its colours, where no other plate lies."""
        font = painter.font()
        font.setPointSizeF(8.5)
        font.setBold(bright)
        painter.setFont(font)
        measure = QFontMetricsF(font)
        tall = measure.height() + 4
        left = 9 + 11 * len(colours)
        wide = left + measure.horizontalAdvance(text) + 5
        right, top = box.right() + 5, box.top() - 2
        places = [(right, top), (box.left() - 5 - wide, top)]
        places += [(right, y) for y in (box.bottom() + 2, top - tall)]
        plate = self._free([QRectF(x, y, wide, tall) for x, y in places])
        self.plates.append(plate)
        painter.setPen(QPen(QColor(255, 255, 255, 230) if bright else QColor(0, 0, 0, 0), 1))
        painter.setBrush(QColor(18, 18, 18, 215))
        painter.drawRoundedRect(plate, 3, 3)
        for k, rgb in enumerate(colours.tolist()):
            square = QRectF(plate.left() + 5 + 11 * k, plate.top() + 3, 11, tall - 6)
            painter.fillRect(square, QColor(*rgb))
        painter.setPen(QColor(255, 255, 255))
        painter.drawText(QPointF(plate.left() + left, plate.top() + 2 + measure.ascent()), text)

    def _free(self, boxes: list[QRectF]) -> QRectF:
        """Return the box with the least out of sight and below plates, the first of equals."""
        sight = QRectF(self.viewer.rect())

        def lost(box: QRectF) -> float:
            covered = sum(_area(box & plate) for plate in self.plates)
            return _area(box) - _area(box & sight) + covered

        return min(boxes, key=lost)

    def _draw_probe(self, painter: QPainter) -> None:
        """Write what the pixel under the pointer is, in a corner that the pointer is not in."""
        probe = self.session.probe
        if probe is None:
            return
        font = theme.numbers_font(9)
        painter.setFont(font)
        measure = QFontMetricsF(font)
        rows = [f"{probe.x}, {probe.y}"]
        rows.append(f"{texts.PROBE_IN:<4}" + " ".join(_figure(v) for v in probe.source))
        rows.append(f"{texts.PROBE_OUT:<4}" + " ".join(_figure(v) for v in probe.result))
        # In a low picture they would cover it; they stand beside the rows too.
        weights = probe.weights if self.viewer.height() >= LEAST_HEIGHT else {}
        shares = sorted(weights.items(), key=lambda item: -abs(item[1]))[:WEIGHTS]
        shares = [(id_, share) for id_, share in shares if abs(share) >= 0.005]
        line = measure.height() + 1
        width = max(measure.horizontalAdvance("in  " + " -0.0000" * len(probe.source)), 150.0)
        named = measure.horizontalAdvance(WIDEST_NAME) if weights else 0.0
        width = max(width, named + 110.0 if weights else 0.0)
        # As tall as it can become: it stays as it is while the pointer moves.
        height = line * (len(rows) + (WEIGHTS if weights else 0))
        size = QSizeF(width + 16, height + 14)
        low = self.viewer.height() - size.height() - 12
        right = self.viewer.width() - size.width() - 12
        corners = [QRectF(QPointF(x, y), size) for y in (low, 12) for x in (right, 12)]
        at = self.viewer.pointer or QPointF(-99, -99)
        away = [box for box in corners if not box.adjusted(-40, -40, 40, 40).contains(at)]
        # It stays where it is as long as it can.
        away.sort(key=lambda box: box != self.probe)
        self.probe = box = self._free(away or corners)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(18, 18, 18, 225))
        painter.drawRoundedRect(box, 4, 4)
        y = box.top() + 7 + measure.ascent()
        for k, row in enumerate(rows):
            painter.setPen(QColor(theme.FAINT if k == 0 else theme.BRIGHT))
            painter.drawText(QPointF(box.left() + 8, y), row)
            y += line
        colours = self._palette_colours()
        for id_, share in shares:
            painter.setPen(QColor(theme.TEXT))
            name = measure.elidedText(
                row_name(self.session.document, id_), Qt.TextElideMode.ElideRight, named
            )
            painter.drawText(QPointF(box.left() + 8, y), name)
            left = box.left() + named + 16
            full = QRectF(left, y - measure.ascent() + 3, width - named - 52, measure.ascent() - 4)
            painter.fillRect(full, QColor(theme.RAISED))
            part = QRectF(full)
            part.setWidth(full.width() * min(max(share, 0), 1))
            painter.fillRect(part, colours.get(id_, QColor(theme.FAINT)))
            painter.drawText(QPointF(full.right() + 6, y), f"{share:.0%}")
            y += line

    def _draw_legend(self, painter: QPainter) -> None:
        """Say what the matte shows, with its scale from grey to the picture."""
        picture, shown = self.viewer.picture, self.session.shown_matte
        if picture is None or shown is None or picture.request.matte != shown:
            return
        pick = picture.request.pick_matte is not None
        painter.setFont(theme.numbers_font(9))
        measure = painter.fontMetrics()
        has, lacks = texts.MATTE, texts.NO_MATTE
        if pick:
            has, lacks = texts.PICK_MATTE, texts.NO_PICK_MATTE
        if shown == DRAFT:
            has = lacks = texts.DRAFT_MATTE
        words = (has if picture.matte else lacks).format(id=row_name(self.session.document, shown))
        ends = texts.MATTE_ENDS
        wide = 90.0
        widths = [measure.horizontalAdvance(text) for text in (words, *ends)]
        tall = measure.height() + 8
        box = QRectF(12, 0, sum(widths) + wide + 36 if picture.matte else widths[0] + 16, tall)
        box.moveTop(self.viewer.height() - tall - 12)
        self.plates.append(box)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(18, 18, 18, 225))
        painter.drawRoundedRect(box, 4, 4)
        base = box.top() + 4 + measure.ascent()
        x = box.left() + 8
        told = (words, ends[0]) if picture.matte else (words,)
        for text, width in zip(told, widths, strict=False):
            painter.setPen(QColor(theme.BRIGHT))
            painter.drawText(QPointF(x, base), text)
            x += width + 8
        if not picture.matte:
            return
        colour, grey = self._palette_colours().get(shown, QColor(theme.BRIGHT)), MATTE_GREY
        if pick:
            colour, grey = self._pick_colour(shown), round(128 * REST_LIGHT + REST_LIFT)
        scale = QLinearGradient(x, 0, x + wide, 0)
        scale.setColorAt(0, QColor(grey, grey, grey))
        scale.setColorAt(1, colour)
        painter.fillRect(QRectF(x, box.top() + 7, wide, tall - 14), QBrush(scale))
        painter.drawText(QPointF(x + wide + 6, base), ends[1])

    def _pick_colour(self, id_: str) -> QColor:
        """Return the new colour of a pick, or that of the clicked pixel, as displayed."""
        document, place = self.session.document, self.session.place
        picks = () if document is None else document.grade.picks
        rgb = next((pick.to or pick.rgb for pick in picks if pick.id == id_), None)
        if rgb is None:
            rgb = (1.0, 1.0, 1.0) if place is None else place.colour
        return QColor(*on_screen(self.session, np.array(rgb)).tolist())

    def _palette_colours(self) -> dict[str, QColor]:
        """Return the frame's palette colours as displayed, by id."""
        if self.session.document is None:
            return {}
        palette = self.session.document.grade.palette(self.session.frame)
        shown = on_screen(self.session, palette.edited)
        return {id_: QColor(*rgb) for id_, rgb in zip(palette.ids, shown.tolist(), strict=True)}

    def _say(self, painter: QPainter, text: str, colour: QColor | None = None) -> None:
        painter.setPen(colour or QColor(theme.FAINT))
        box = QRectF(self.viewer.rect()).adjusted(40, 40, -40, -40)
        flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
        painter.drawText(box, int(flags), text)


def hatched(mask: NDArray[np.uint8]) -> QImage:
    """Return an overlay with stripes where the mask is set."""
    y, x = np.indices(mask.shape)
    stripes = ((x + y) // 2) % 2 == 0
    overlay = np.zeros((*mask.shape, 4), np.uint8)
    overlay[..., 3] = np.where(mask > 0, 190, 0)
    overlay[..., :3] = np.where((mask > 0) & stripes, 190, 0)[..., None]  # premultiplied white
    return paint.image_of(overlay, QImage.Format.Format_RGBA8888_Premultiplied)


def _area(box: QRectF) -> float:
    return box.width() * box.height()


def _figure(value: float) -> str:
    return f"{value:7.4f}" if abs(value) < 100 else f"{value:7.1f}"


def _label(painter: QPainter, text: str, box: QRectF, side: Qt.AlignmentFlag) -> None:
    """Draw a caption at the upper rim of a box."""
    font = painter.font()
    font.setPointSizeF(9)
    font.setBold(False)
    painter.setFont(font)
    measure = QFontMetricsF(font)
    width = measure.horizontalAdvance(text) + 14
    left = {
        Qt.AlignmentFlag.AlignLeft: box.left() + 8,
        Qt.AlignmentFlag.AlignHCenter: box.center().x() - width / 2,
        Qt.AlignmentFlag.AlignRight: box.right() - 8 - width,
    }[side]
    frame = QRectF(left, box.top() + 8, width, measure.height() + 6)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QBrush(QColor(18, 18, 18, 190)))
    painter.drawRoundedRect(frame, 3, 3)
    painter.setPen(QColor(theme.BRIGHT))
    painter.drawText(frame, int(Qt.AlignmentFlag.AlignCenter), text)
