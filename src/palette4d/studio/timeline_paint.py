"""How the timeline is drawn.

A row is a palette colour through time; its upper half is the colour before the edits, its lower
half after. In the lower half a line shows how much of the edit acts: the ramp. The left column has
the colours at the playhead, and the weights of the pixel under the pointer.
"""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPixmap, QPolygonF
from PySide6.QtWidgets import QWidget

from palette4d.plotting import style
from palette4d.plotting.layout import BAND, Disc, Timeline, disc_names, half_bands
from palette4d.plotting.rows import PlottedPalette
from palette4d.studio import paint, texts, theme
from palette4d.studio.frame_strip import FrameStrip
from palette4d.studio.screen_colours import on_screen
from palette4d.studio.session import Session
from palette4d.studio.timeline_lanes import paint_lanes
from palette4d.studio.timeline_places import FOOT, GUTTER, RULER, SIDE, TAIL, Places

F64 = NDArray[np.float64]
#: The lower side of a band; its sides and its middle, its area, and the halves of that.
Shapes = tuple[F64, tuple[QPolygonF, ...], QPolygonF, list[QPolygonF]]

#: Pixels between two sampled colours of a band.
COLUMN = 2
#: The same while something is dragged.
DRAGGED_COLUMN = 8
#: From this height of half a row on, the area of a ramp is filled; its colour.
TALL_RAMP, RAMP_AREA = 8.0, QColor(0, 0, 0, 70)
#: The ground of rows with something selected.
CHOSEN = QColor(255, 255, 255, 26)


class TimelinePainter:
    """Draws a timeline.

    Parameters
    ----------
    view : QWidget
        The widget: its size, font and focus.
    session : Session
    places : Places
    strip : FrameStrip
    """

    def __init__(self, view: QWidget, session: Session, places: Places, strip: FrameStrip) -> None:
        """Draw nothing yet."""
        self.view, self.session, self.places, self.strip = view, session, places, strip
        self.box: QRectF | None = None  #: the box of a selection
        self.told: tuple[QPointF, str] | None = None  #: what is said beside the pointer
        self._picture: tuple[object, tuple[QPixmap, QPixmap]] | None = None
        self._shapes: tuple[object, dict[int, Shapes]] | None = None

    def paint(self, part: QRect) -> None:
        """Draw a part of the timeline; the strip alone and the left column alone take less time."""
        painter = QPainter(self.view)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.view.rect(), QColor(style.PANEL))
        if self.session.frames[0] == self.session.frames[1] == 0 and self.session.document is None:
            painter.setPen(QColor(theme.FAINT))
            painter.drawText(self.view.rect(), Qt.AlignmentFlag.AlignCenter, texts.NOTHING_OPEN)
            return
        strip_alone = part.top() >= RULER and part.bottom() < RULER + self.places.strip
        if strip_alone:
            self.strip.paint(painter)
            self._paint_playhead(painter)
        elif part.right() >= GUTTER:
            bands, discs = self._pictures()
            painter.drawPixmap(0, 0, bands)
            self.strip.paint(painter)
            paint_lanes(painter, self.session, self.places)
            self._paint_playhead(painter)
            painter.drawPixmap(0, 0, discs)
            self._paint_pointer(painter)
            self._paint_scroll_bar(painter)
        self._paint_gutter(painter)
        if part.bottom() >= self.places.height - FOOT:
            self._paint_zoom_bar(painter)
        paint.focus_frame(painter, self.view)
        painter.end()

    def _pictures(self) -> tuple[QPixmap, QPixmap]:
        """Return the rows and the ruler, and the discs; drawn again only when they changed."""
        ratio = self.view.devicePixelRatioF()
        found = self.places.timeline
        key = (
            self.places.key,
            self.places.scale,
            self.session.marks,
            self.view.size(),
            ratio,
            self.places.top,
            self.session.selection,
            self.session.looked,
        )
        if self._picture is None or self._picture[0] != key:
            pictures: list[QPixmap] = []
            for draw, ground in ((self._paint_rows, style.PANEL), (self._paint_discs, "#00000000")):
                picture = QPixmap(self.view.size() * ratio)
                picture.setDevicePixelRatio(ratio)
                picture.fill(QColor(ground))
                painter = QPainter(picture)
                painter.setRenderHint(QPainter.RenderHint.Antialiasing)
                painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
                if not pictures:
                    self._paint_ruler(painter)
                if found is not None:
                    draw(painter, *found)
                painter.end()
                pictures.append(picture)
            self._picture = key, (pictures[0], pictures[1])
        return self._picture[1]

    def _paint_rows(self, painter: QPainter, layout: Timeline, discs: list[Disc]) -> None:
        top, floor = self.places.upper, self.places.height - FOOT
        painter.setClipRect(QRectF(GUTTER, top, self.places.width - GUTTER, floor - top))
        for section in layout.sections():
            if section.number % 2:
                continue
            box = QRectF(section.left, top, section.right - section.left, floor - top)
            ground = style.PANEL_ALTERNATE if section.number else style.TRANSITION
            painter.fillRect(box, QColor(ground))
            if not section.number:
                painter.setPen(paint.pen(style.LINE, 0.8))
                for x in (section.left, section.right):
                    painter.drawLine(QPointF(x, top), QPointF(x, floor))
        y0 = self.places.top
        for row in {self.places.row_of(id_) for id_ in self.session.selection} - {None}:
            assert row is not None
            y = y0 + row * layout.row_height
            painter.fillRect(QRectF(0, y, self.places.width, layout.row_height), CHOSEN)
        painter.setFont(paint.small_font(self.view, -1))
        metrics = painter.fontMetrics()
        middle = 11 - self.places.head + self.places.scroll
        names = layout.block_names(middle, metrics.horizontalAdvance)
        for name in names if len(layout.sections()) > 1 else ():
            if GUTTER < name.x < self.places.width:
                paint.label(painter, name.x, name.y + y0, name.text, style.FAINT)
        self._into_rows(painter)
        painter.setPen(paint.pen(style.LINE, 0.7, [1, 4]))
        for disc in discs:
            if disc.kind != "plain":
                painter.drawLine(QPointF(disc.home, 0), QPointF(disc.home, layout.height))
        self._paint_bands(painter, layout)

    def _into_rows(self, painter: QPainter) -> None:
        """Clip to the rows, and put the first row's top at y = 0."""
        top = self.places.upper + self.places.head - 10
        painter.setClipRect(
            QRectF(GUTTER, top, self.places.width - GUTTER, self.places.room + TAIL + 10)
        )
        painter.translate(0, self.places.top)

    def _paint_bands(self, painter: QPainter, layout: Timeline) -> None:
        palette, scale = layout.palette, layout.scale
        left = max(GUTTER, scale.left - 1)
        right = min(self.places.width, scale.right + 1)
        wide = DRAGGED_COLUMN if self.session.dragging else COLUMN
        columns = np.arange(left, max(right, left + wide), wide, dtype=np.float64)
        times = np.asarray(scale.frame(columns + wide / 2)).reshape(-1)
        before, after = palette.sampled(times)
        seen = on_screen(self.session, np.stack([before, after]))
        selected = set(self.session.selection)
        moved = np.nan_to_num(np.linalg.norm(after - before, axis=-1))
        for edge, (_, line) in layout.paths.items():
            inside = np.flatnonzero(~np.isnan(before[edge, :, 0]))
            if not inside.size:
                continue
            lower, outline, whole, halves = self._shapes_of(layout)[edge]
            touched = palette.touched(edge)
            parts = list(zip(halves, seen, strict=True)) if touched else [(whole, seen[0])]
            painter.setPen(Qt.PenStyle.NoPen)
            for shape, colours in parts:
                # The first and last column twice: a texture begins again where it ends.
                own = np.pad(colours[edge, inside], ((1, 1), (0, 0)), mode="edge")
                start = float(columns[inside[0]]) - wide
                painter.setBrush(paint.texture(own, start, float(wide)))
                painter.drawPolygon(shape)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            chosen = palette.edge_ids[edge] in selected
            painter.setPen(paint.pen(style.BRIGHT if chosen else style.RIM, 1.8 if chosen else 0.8))
            for side in outline[:2]:
                painter.drawPolyline(side)
            if touched:
                painter.setPen(paint.pen(style.INK, 0.9))
                painter.drawPolyline(outline[2])
                middle = columns[inside] + wide / 2
                self._paint_ramp(painter, line, lower, middle, moved[edge, inside])

    def _shapes_of(self, layout: Timeline) -> dict[int, Shapes]:
        """Return the lower side of each band, and its sides, area and halves as polygons."""
        if self._shapes is None or self._shapes[0] is not layout.paths:
            found = {}
            for edge, (_, line) in layout.paths.items():
                upper, lower = half_bands(line, BAND * layout.row_height)
                whole, *halves = (
                    paint.polygon(np.concatenate([above, below[::-1]]))
                    for above, below in ((upper, lower), (upper, line), (line, lower))
                )
                sides = tuple(paint.polygon(side) for side in (upper, lower, line))
                found[edge] = lower, sides, whole, halves
            self._shapes = layout.paths, found
        return self._shapes[1]

    @staticmethod
    def _paint_ramp(painter: QPainter, line: F64, lower: F64, x: F64, moved: F64) -> None:
        """Draw how much an edit acts through time: at the seam nothing, at the rim the most."""
        most = float(moved.max())
        if most <= 1e-6:
            return
        seam = np.interp(x, line[:, 0], line[:, 1])
        rim = np.interp(x, lower[:, 0], lower[:, 1])
        curve = np.stack([x, seam + (rim - seam) * (0.12 + 0.76 * moved / most)], axis=-1)
        shape = paint.polygon(curve)
        if float(np.max(rim - seam)) > TALL_RAMP:  # the area tells how much of the edit acts
            area = np.concatenate([curve, np.stack([x, seam], axis=-1)[::-1]])
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(RAMP_AREA)
            painter.drawPolygon(paint.polygon(area))
            painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(paint.pen(style.INK, 2.2))
        painter.drawPolyline(shape)
        painter.setPen(paint.pen(style.BRIGHT, 1.0))
        painter.drawPolyline(shape)

    def _paint_discs(self, painter: QPainter, layout: Timeline, discs: list[Disc]) -> None:
        self._into_rows(painter)
        shown = [d for d in discs if GUTTER - 30 < d.x < self.places.width + 30]
        selected = set(self.session.selection)
        shown.sort(key=lambda disc: disc.kind == "stop")
        colours = np.array([[each.before, each.after] for each in shown]).reshape(-1, 2, 3)
        seen = on_screen(self.session, colours)
        for each, (before, after) in zip(shown, seen, strict=True):
            if abs(each.x - each.home) > 2.5:
                foot = each.y + BAND * layout.row_height + 3.5
                bent = [(each.home, each.y), (each.home, foot), (each.x, each.y + each.radius)]
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.setPen(paint.pen(style.RING, 0.8))
                painter.drawPolyline(paint.polygon(np.array(bent)))
            paint.disc(
                painter,
                each.x,
                each.y,
                each.radius,
                before,
                after,
                each.kind,
                selected=each.id in selected,
            )
        locks = set() if self.session.document is None else set(self.session.document.grade.locks)
        for each in shown:
            if each.id in locks:
                paint.padlock(painter, each.x + each.radius, each.y + each.radius)
        font = paint.small_font(self.view, -1.5)
        painter.setFont(font)
        metrics = painter.fontMetrics()
        names = disc_names(
            shown,
            metrics.ascent(),
            lambda text: metrics.horizontalAdvance(text) + 4.0,
            layout.height + TAIL,
            collar=3.0,
            beside=(layout.scale.left, layout.scale.right, SIDE),
            longer=self._colour_names(),
            ends=(GUTTER, self.places.width),
        )
        for name in names:
            painter.setFont(paint.small_font(self.view, -1.5, bold=name.bright))
            colour = style.BRIGHT if name.bright else style.TEXT
            paint.label(painter, name.x, name.y, name.text, colour, style.PANEL)

    def _colour_names(self) -> dict[str, str]:
        document = self.session.document
        return {} if document is None else document.grade.colour_names

    def _paint_ruler(self, painter: QPainter) -> None:
        painter.save()
        painter.fillRect(QRectF(0, 0, self.places.width, RULER), QColor(theme.PAGE))
        painter.setClipRect(QRectF(GUTTER, 0, self.places.width - GUTTER, RULER))
        scale, marks = self.places.scale, self.session.marks
        if marks is not None:
            left, right = (self.places.x_of(t) for t in marks)
            painter.fillRect(QRectF(left, RULER - 5, right - left, 5), QColor(style.RING))
        painter.setFont(paint.small_font(self.view, -1))
        for tick in scale.ticks(max(scale.left, GUTTER), min(scale.right, self.places.width)):
            x = self.places.x_of(tick)
            painter.setPen(paint.pen(style.GUIDE, 0.8))
            painter.drawLine(QPointF(x, RULER - 4), QPointF(x, RULER))
            paint.label(painter, x, RULER / 2 - 1, style.number(tick), style.TEXT)
        painter.restore()

    def _paint_gutter(self, painter: QPainter) -> None:
        found = self.places.timeline
        painter.fillRect(QRectF(0, RULER, GUTTER, self.places.height - RULER), QColor(theme.PAGE))
        painter.setPen(paint.pen(theme.PIT, 1.0))
        painter.drawLine(QPointF(GUTTER, 0), QPointF(GUTTER, self.places.height))
        painter.setFont(paint.small_font(self.view, -1))
        painter.setPen(QColor(theme.FAINT))
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        painter.drawText(QRectF(0, 0, GUTTER - 8, RULER), right, texts.FRAME)
        if found is None:
            return
        names: dict[int, list[str]] = {}
        for pick, lane in self.places.lanes():
            names.setdefault(lane, []).append(pick.id)
        for lane, ids in names.items():
            # Names of thin lanes stand in two columns.
            aside = 24 * (lane % 2) if self.places.lane_height < 10 else 0
            box = QRectF(4, self.places.lane_y(lane) - 13, GUTTER - 12 - aside, 26)
            text = painter.fontMetrics().elidedText(
                " ".join(ids), Qt.TextElideMode.ElideRight, int(box.width())
            )
            painter.drawText(box, right, text)
        layout, top = found[0], self.places.top
        palette, frame = layout.palette, float(self.session.frame)
        before, after = palette.sampled(np.array([frame]))
        seen = on_screen(self.session, np.stack([before[:, 0], after[:, 0]], axis=1))
        probe = self.session.probe
        weights = {} if probe is None else probe.weights
        caption = texts.WEIGHT if weights else ""
        painter.drawText(QRectF(0, self.places.upper, GUTTER - 8, self.places.head), right, caption)
        x = self.places.x_of(frame)
        painter.setClipRect(
            QRectF(0, self.places.upper + self.places.head - 6, GUTTER, self.places.height)
        )
        half = min(7.0, layout.row_height / 2 - 2)
        for edge, y in self.places.edges_at(layout, x):
            if np.isnan(before[edge, 0]).any():
                continue
            two = seen[edge]
            box = QRectF(15 - half, y + top - half, 2 * half, 2 * half)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(paint.colour_of(two[0]))
            painter.drawRect(box)
            painter.setBrush(paint.colour_of(two[1]))
            painter.drawRect(QRectF(box.left(), y + top, 2 * half, half))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(paint.pen(style.RIM, 1.0))
            painter.drawRect(box)
            if weights:
                share = self._weight(palette, edge, weights)
                self._paint_weight(painter, y + top, layout.row_height, share)
        painter.setClipping(False)

    @staticmethod
    def _weight(palette: PlottedPalette, edge: int, weights: dict[str, float]) -> float:
        ids = [palette.edge_ids[edge], *(palette.ids[v] for v in palette.edges[edge])]
        return max((weights[id_] for id_ in ids if id_ in weights), default=0.0)

    @staticmethod
    def _paint_weight(painter: QPainter, y: float, tall: float, weight: float) -> None:
        """Draw the number above a bar; in a thin row beside it."""
        bar, at = QRectF(28, y + 3, GUTTER - 36, 3), QRectF(26, y - 13, GUTTER - 34, 15)
        if tall < at.height() + bar.height():
            bar, at = QRectF(28, y - 1, 14, 3), QRectF(26, y - 7.5, GUTTER - 34, 15)
            font = painter.font()
            font.setPixelSize(min(painter.fontInfo().pixelSize(), int(tall)))
            painter.setFont(font)
        painter.fillRect(bar, QColor(theme.LINE))
        share = float(np.clip(weight, 0, 1))
        painter.fillRect(
            QRectF(bar.left(), bar.top(), bar.width() * share, 3), QColor(style.BRIGHT)
        )
        painter.setPen(QColor(style.BRIGHT if weight >= 0.005 else theme.FAINT))
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        painter.drawText(at, right, f"{weight:.0%}".replace("-", "−"))

    def _paint_pointer(self, painter: QPainter) -> None:
        """Draw what is under the pointer brighter, and the box of a selection."""
        found, top = self.places.timeline, self.places.top
        if found is not None and self.session.hover is not None:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setClipRect(
                QRectF(
                    GUTTER,
                    self.places.upper,
                    self.places.width - GUTTER,
                    self.places.room + self.places.head,
                )
            )
            layout, discs = found
            for disc in discs:
                if disc.id == self.session.hover:
                    painter.setPen(paint.pen(style.BRIGHT, 1.4))
                    painter.drawEllipse(
                        QPointF(disc.x, disc.y + top), disc.radius + 4, disc.radius + 4
                    )
            if self.session.hover in layout.palette.edge_ids:
                edge = layout.palette.edge_ids.index(self.session.hover)
                painter.setPen(paint.pen(style.RING, 1.4))
                for side in half_bands(layout.paths[edge][1] + [0, top], BAND * layout.row_height):
                    painter.drawPolyline(paint.polygon(side))
            painter.setClipping(False)
        if self.told is not None:
            at, text = self.told
            painter.setFont(paint.small_font(self.view, bold=True))
            wide = painter.fontMetrics().horizontalAdvance(text) / 2 + 4
            x = min(max(at.x(), GUTTER + wide), self.places.width - wide)
            y = max(at.y() - 18, RULER + self.places.strip + 8.0)
            paint.label(painter, x, y, text, style.BRIGHT, style.INK)
        if self.box is not None:
            painter.setPen(paint.pen(style.BRIGHT, 1.0, [3, 3]))
            painter.setBrush(QColor(255, 255, 255, 18))
            painter.drawRect(self.box)

    def _paint_playhead(self, painter: QPainter) -> None:
        x = self.places.x_of(self.session.frame)
        if not GUTTER <= x <= self.places.width:
            return
        painter.setPen(paint.pen(style.INK, 3.0))
        painter.drawLine(QPointF(x, RULER), QPointF(x, self.places.height - FOOT))
        painter.setPen(paint.pen(style.BRIGHT, 1.0))
        painter.drawLine(QPointF(x, RULER), QPointF(x, self.places.height - FOOT))
        painter.setFont(paint.small_font(self.view, -1, bold=True))
        text = style.number(self.session.frame)
        wide = painter.fontMetrics().horizontalAdvance(text) + 12
        left = min(max(x - wide / 2, GUTTER + 1), self.places.width - wide - 1)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(style.BRIGHT))
        painter.drawRoundedRect(QRectF(left, 2, wide, RULER - 7), 3, 3)
        foot = [QPointF(x - 4, RULER - 5.5), QPointF(x + 4, RULER - 5.5), QPointF(x, RULER)]
        painter.drawPolygon(QPolygonF(foot))
        painter.setPen(QColor(style.INK))
        painter.drawText(QRectF(left, 2, wide, RULER - 7), Qt.AlignmentFlag.AlignCenter, text)

    def _paint_scroll_bar(self, painter: QPainter) -> None:
        """Show which rows are seen, if not all are."""
        places = self.places
        if places.hidden:
            tall = places.height - FOOT - places.upper
            share = tall / (places.room + places.hidden)
            top = places.upper + (places.upper + places.head - places.top) * share
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(style.GUIDE))
            box = QRectF(places.width - FOOT + 3, top, FOOT - 6, places.room * share)
            painter.drawRoundedRect(box, 3, 3)

    def _paint_zoom_bar(self, painter: QPainter) -> None:
        top, wide = self.places.height - FOOT, self.places.width - GUTTER
        painter.fillRect(QRectF(0, top, self.places.width, FOOT), QColor(theme.PAGE))
        first, last, _ = self.session.frames
        if self.places.zoomed is None or last <= first:
            return
        start, end = (GUTTER + (t - first) / (last - first) * wide for t in self.places.zoomed)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(style.GUIDE))
        painter.drawRoundedRect(QRectF(start, top + 3, max(end - start, 16), FOOT - 6), 3, 3)
