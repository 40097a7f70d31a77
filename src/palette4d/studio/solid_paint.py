"""How the RGB solid is drawn: faces, edges, the frame's pixels, discs, and what an edit spoils."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QPen, QPolygonF

from palette4d.common.text import counted
from palette4d.grade.palette import Palette
from palette4d.plotting import style
from palette4d.plotting.solid import CORNERS, CUBE, Shape, View, concave, edges_of, facing, flipped
from palette4d.studio import paint, texts, theme
from palette4d.studio.screen_colours import on_screen

if TYPE_CHECKING:
    from palette4d.studio.solid_view import SolidView

F64 = NDArray[np.float64]
#: Which edges an edit makes concave, and which faces it turns inside out.
Spoilt = tuple[NDArray[np.bool_], NDArray[np.bool_]]

#: The radius of a disc, and of the place where an edited colour was.
DISC, ORIGIN = 6.5, 3.6
#: The width of the words beside the solid, which say what an edit spoils.
WORDS = 150.0
AXIS_NAMES = ("R", "G", "B")
#: A face is drawn in this many strips, for a smooth gradient; in fewer while something moves.
STRIPS, MOVING_STRIPS = 5, 2


def _pieces(strips: int) -> F64:
    """Return the (n, 3, 3) pieces of a face: of each corner its shares of the face's corners."""
    found = []
    for i in range(strips):
        for j in range(strips - i):
            found.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j < strips - 1:
                found.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
    second, third = np.moveaxis(np.array(found) / strips, -1, 0)
    return np.stack([1 - second - third, second, third], axis=-1)


PIECES = {strips: _pieces(strips) for strips in (STRIPS, MOVING_STRIPS)}


class SolidPainter:
    """Draws a solid."""

    def __init__(self, view: "SolidView") -> None:
        """Draw nothing yet."""
        self.view, self.session = view, view.session
        self._spoilt: tuple[Palette, Spoilt] | None = None

    def paint(self) -> None:
        """Draw the solid."""
        painter = QPainter(self.view)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.view.rect(), QColor(style.PANEL))
        palette = self.view.palette_now()
        spoilt = None if palette is None else self._troubles(palette)
        if palette is not None and spoilt is not None:
            self._paint_solid(painter, palette, spoilt)
        self._paint_words(painter, spoilt)
        paint.focus_frame(painter, self.view)
        painter.end()

    def words_width(self, palette: Palette) -> float:
        """Return the width of the words beside the solid; 0 if there is nothing to say."""
        if not any(found.any() for found in self._troubles(palette)):
            return 0.0
        return min(WORDS, self.view.width() * 0.4)

    def _troubles(self, palette: Palette) -> Spoilt:
        """Return `troubles`, looked for once."""
        if self._spoilt is None or self._spoilt[0] is not palette:
            self._spoilt = palette, troubles(palette)
        return self._spoilt[1]

    def _paint_solid(self, painter: QPainter, palette: Palette, spoilt: Spoilt) -> None:
        view = self.view.view_of(palette)
        before, after = self.view.places(palette, view)
        shape = Shape(palette.rgb, palette.edited, palette.faces)
        moved = (palette.rgb != palette.edited).any(axis=1)
        self._paint_cube(painter, view)
        colours = on_screen(self.session, np.stack([palette.rgb, palette.edited]))
        # With y down a near face is clockwise.
        near = ~facing(before[:, :2], palette.faces) if len(palette.faces) else np.zeros(0, bool)
        faint = 0.55 if moved.any() else 1.0
        self._paint_faces(painter, before, colours[0], palette.faces[~near], 52 * faint)
        self._paint_edges(painter, before, shape, near, front=False)
        self._paint_cloud(painter, view)
        self._paint_faces(painter, before, colours[0], palette.faces[near], 34 * faint)
        self._paint_edges(painter, before, shape, near, front=True)
        if moved.any():
            self._paint_edited(painter, palette, after, colours[1], moved, spoilt)
        self._paint_discs(painter, palette, before, after, colours, moved)

    def _paint_cube(self, painter: QPainter, view: View) -> None:
        corners = view.project(CORNERS)
        corners[:, 1] *= -1
        farthest = int(np.argmin(corners[:, 2]))
        for a, b in CUBE:
            hidden = farthest in (a, b)
            how = paint.pen(style.LINE, 1.0, [2, 3]) if hidden else paint.pen(style.GUIDE, 0.8)
            painter.setPen(how)
            painter.drawLine(QPointF(*corners[a, :2].tolist()), QPointF(*corners[b, :2].tolist()))
        painter.setFont(paint.small_font(self.view, -1))
        for channel, (bit, name) in enumerate(((1, "R"), (2, "G"), (4, "B"))):
            away = corners[bit, :2] - corners[0, :2]
            at = corners[bit, :2] + 10 * away / max(float(np.linalg.norm(away)), 1e-9)
            chosen = channel == self.view.axis
            if chosen:
                painter.setPen(paint.pen(style.BRIGHT, 2.0))
                ends = [QPointF(*corners[k, :2].tolist()) for k in (0, bit)]
                painter.drawLine(*ends)
            x, y = at.tolist()
            paint.label(painter, x, y, name, style.BRIGHT if chosen else style.FAINT)

    def _paint_faces(
        self,
        painter: QPainter,
        at: F64,
        colours: NDArray[np.uint8],
        faces: NDArray[np.int32],
        alpha: float,
    ) -> None:
        """Fill faces with the colours of their corners; small pieces make the gradient."""
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, on=False)
        painter.setPen(Qt.PenStyle.NoPen)
        # (face, piece, corner) from the three corners of each face.
        moving = self.session.dragging or self.session.playing or self.view.pressed
        shares = PIECES[MOVING_STRIPS if moving else STRIPS]
        seen = np.einsum("pc,fcx->fpx", shares.mean(axis=1), colours[faces].astype(np.float64))
        points = np.einsum("pkc,fcx->fpkx", shares, at[faces, :2])
        for pieces, places in zip(seen.tolist(), points.tolist(), strict=True):
            for (red, green, blue), corners in zip(pieces, places, strict=True):
                painter.setBrush(QColor(int(red), int(green), int(blue), round(alpha)))
                painter.drawPolygon(QPolygonF([QPointF(x, y) for x, y in corners]))
        painter.restore()

    @staticmethod
    def _paint_edges(
        painter: QPainter, at: F64, shape: Shape, near: NDArray[np.bool_], *, front: bool
    ) -> None:
        corners = [set(face) for face in shape.faces[near].tolist()]
        painter.setPen(paint.pen(style.TEXT if front else style.GUIDE, 1.1 if front else 0.8))
        for edge in shape.edges.tolist():
            is_near = not len(shape.faces) or any(set(edge) <= c for c in corners)
            if is_near == front:
                painter.drawLine(*(QPointF(*at[v, :2].tolist()) for v in edge))

    def _paint_cloud(self, painter: QPainter, view: View) -> None:
        found = self.view.cloud()
        if found is None or not len(found[0]):
            return
        colours, seen = found
        ratio = self.view.devicePixelRatioF()
        width, height = (round(s * ratio) for s in (self.view.width(), self.view.height()))
        at = view.project(colours)
        order = np.argsort(at[:, 2], kind="stable")
        x = np.rint(at[order, 0] * ratio).astype(np.int64)
        y = np.rint(-at[order, 1] * ratio).astype(np.int64)
        picture = np.zeros((height, width, 4), np.uint8)
        bgra = np.concatenate([seen[order][:, ::-1], np.full((len(x), 1), 255, np.uint8)], axis=1)
        size = max(2, round(1.8 * ratio))
        inside = (x >= 0) & (y >= 0) & (x < width - size) & (y < height - size)
        for dx in range(size):
            for dy in range(size):
                picture[y[inside] + dy, x[inside] + dx] = bgra[inside]
        image = QImage(
            picture.data, width, height, 4 * width, QImage.Format.Format_ARGB32_Premultiplied
        )
        image.setDevicePixelRatio(ratio)
        painter.drawImage(0, 0, image)

    def _paint_edited(
        self,
        painter: QPainter,
        palette: Palette,
        after: F64,
        colours: NDArray[np.uint8],
        moved: NDArray[np.bool_],
        spoilt: Spoilt,
    ) -> None:
        """Draw the polyhedron of the edited colours, its concavities and its flipped faces."""
        if len(palette.faces):
            self._paint_faces(painter, after, colours, palette.faces, 26)
        shape = Shape(palette.edited, palette.edited, palette.faces)
        dents, turned = spoilt
        edges = shape.edges
        painter.setPen(paint.pen(style.BRIGHT, 1.0, [3, 2.4]))
        for edge in edges.tolist():
            if moved[edge].any():
                painter.drawLine(*(QPointF(*after[v, :2].tolist()) for v in edge))
        for face in palette.faces[turned]:
            hatch = QColor(theme.WARNING)
            hatch.setAlpha(120)
            painter.setPen(QPen(hatch, 1.0))
            painter.setBrush(QBrush(hatch, Qt.BrushStyle.BDiagPattern))
            painter.drawPolygon(paint.polygon(after[face, :2]))
        for edge in edges[dents].tolist() if len(palette.faces) else []:
            self._paint_notches(painter, *(after[v, :2] for v in edge))

    @staticmethod
    def _paint_notches(painter: QPainter, start: F64, end: F64) -> None:
        """Draw a concave edge: a thick line with short strokes across."""
        painter.setPen(paint.pen(style.INK, 4.0))
        painter.drawLine(QPointF(*start.tolist()), QPointF(*end.tolist()))
        painter.setPen(paint.pen(theme.WARNING, 1.8))
        painter.drawLine(QPointF(*start.tolist()), QPointF(*end.tolist()))
        along = end - start
        length = float(np.linalg.norm(along))
        if length < 1:
            return
        across = np.array([-along[1], along[0]]) / length * 3.5
        for share in np.arange(8, length, 9) / length:
            middle = start + along * share
            painter.drawLine(
                QPointF(*(middle - across).tolist()), QPointF(*(middle + across).tolist())
            )

    def _paint_discs(
        self,
        painter: QPainter,
        palette: Palette,
        before: F64,
        after: F64,
        colours: NDArray[np.uint8],
        moved: NDArray[np.bool_],
    ) -> None:
        for k in np.flatnonzero(moved).tolist():
            self._paint_arrow(painter, before[k, :2], after[k, :2])
            painter.setPen(paint.pen(style.RING, 1.0))
            painter.setBrush(paint.colour_of(colours[0, k]))
            painter.drawEllipse(QPointF(*before[k, :2].tolist()), ORIGIN, ORIGIN)
        selected = set(self.session.selection)
        for k in np.argsort(after[:, 2], kind="stable").tolist():
            own = {palette.ids[k], self.view.handle_of(palette, k)}
            hovered = self.session.hover in own or self.session.hover in palette.ends[k]
            x, y = after[k, :2].tolist()
            paint.disc(
                painter,
                x,
                y,
                DISC,
                colours[0, k],
                colours[1, k],
                "edited" if moved[k] else "plain",
                selected=bool(own & selected),
                hovered=hovered or bool(selected & set(palette.ends[k])),
            )

    @staticmethod
    def _paint_arrow(painter: QPainter, start: F64, end: F64) -> None:
        along = end - start
        length = float(np.linalg.norm(along))
        if length < DISC + 6:
            return
        along /= length
        tip, foot = end - along * (DISC + 2), end - along * (DISC + 9)
        across = np.array([-along[1], along[0]]) * 3.4
        painter.setPen(paint.pen(style.BRIGHT, 1.3))
        painter.drawLine(QPointF(*start.tolist()), QPointF(*foot.tolist()))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(style.BRIGHT))
        painter.drawPolygon(paint.polygon(np.stack([tip, foot + across, foot - across])))

    def _paint_words(self, painter: QPainter, spoilt: Spoilt | None) -> None:
        """Write what the edit makes of the solid, and what the pointer can do."""
        painter.setFont(paint.small_font(self.view, -1))
        tall = painter.fontMetrics().height()
        wide = self.view.width() - 16.0
        foot = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom
        painter.setPen(QColor(theme.FAINT))
        words = texts.NOTHING_OPEN if spoilt is None else texts.SOLID_HINT
        if self.view.axis is not None:
            words = texts.SOLID_AXIS.format(axis=AXIS_NAMES[self.view.axis])
        words = painter.fontMetrics().elidedText(words, Qt.TextElideMode.ElideRight, int(wide))
        painter.drawText(QRectF(8, self.view.height() - tall - 5, wide, tall), foot, words)
        if spoilt is None:
            return
        dents, turned = spoilt
        heads = (
            counted(int(dents.sum()), texts.CONCAVE_EDGE, texts.CONCAVE_EDGES),
            counted(int(turned.sum()), texts.FLIPPED_FACE, texts.FLIPPED_FACES),
        )
        whys = (texts.CONCAVE_WHY, texts.FLIPPED_WHY)
        # While a colour is dragged, they may stand over the solid: it stays where it is.
        wide, top = min(WORDS, self.view.width() * 0.4) - 8, 6.0
        flags = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap
        for head, why, found in zip(heads, whys, spoilt, strict=True):
            if not found.any():
                continue
            for text, colour in ((f"⚠ {head}", theme.WARNING), (why, theme.TEXT)):
                box = QRectF(8, top, wide, self.view.height())
                box = painter.boundingRect(box, int(flags), text)
                painter.setPen(QColor(colour))
                painter.drawText(box, int(flags), text)
                top = box.bottom() + 1


def troubles(palette: Palette) -> Spoilt:
    """Return which edges an edit makes concave, and which faces it turns inside out."""
    faces = palette.faces
    if np.array_equal(palette.rgb, palette.edited) or not len(faces):
        return np.zeros(0, bool), np.zeros(0, bool)
    new = concave(palette.edited, faces) & ~concave(palette.rgb, faces)
    turned = flipped(palette.rgb, palette.edited, faces)
    # Where a face is turned inside out, its edges' sides mean nothing.
    _, beside = edges_of(faces)
    return new & ~turned[beside].any(axis=1), turned
