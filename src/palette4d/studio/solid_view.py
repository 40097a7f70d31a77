"""The RGB solid: the palette at the playhead as a polyhedron, with the frame's pixels inside it.

A dragged colour moves in the plane of the screen, or along one axis. Where an edit makes a
concavity, the edge is drawn with notches; a face that it turns inside out is hatched.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QBrush,
    QColor,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QWheelEvent,
)
from PySide6.QtWidgets import QWidget

from palette4d.common.text import counted
from palette4d.grade.document import Document
from palette4d.grade.palette import Palette
from palette4d.plotting import style
from palette4d.plotting.solid import (
    AZIMUTH,
    CORNERS,
    CUBE,
    ELEVATION,
    Shape,
    View,
    concave,
    edges_of,
    even_sample,
    extent_of,
    facing,
    flipped,
)
from palette4d.studio import paint, texts, theme
from palette4d.studio.actions import SOLID_ACTIONS
from palette4d.studio.menus import view_actions
from palette4d.studio.preview import straight
from palette4d.studio.screen_colours import on_screen
from palette4d.studio.session import Session

F64 = NDArray[np.float64]

#: How many pixels of the frame are drawn.
PIXELS = 5000
#: Degrees for a pixel of a drag, and for an arrow key.
TURN, STEP = 0.4, 6.0
#: The radius of a disc, and of the place where an edited colour was.
DISC, ORIGIN = 6.5, 3.6
#: How far edited colours shrink the view, in radii of the others.
FARTHEST = 1.35
#: A face is drawn in this many strips, for a smooth gradient.
STRIPS = 5


def _pieces() -> F64:
    """Return the (n, 3, 3) pieces of a face: of each corner its shares of the face's corners."""
    found = []
    for i in range(STRIPS):
        for j in range(STRIPS - i):
            found.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j < STRIPS - 1:
                found.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
    second, third = np.moveaxis(np.array(found) / STRIPS, -1, 0)
    return np.stack([1 - second - third, second, third], axis=-1)


PIECES = _pieces()
AXIS_KEYS = {Qt.Key.Key_X: 0, Qt.Key.Key_Y: 1, Qt.Key.Key_Z: 2}
AXIS_NAMES = ("R", "G", "B")


@dataclass
class Drag:
    """A press that turns the solid (`index` is None) or moves a colour."""

    index: int | None
    at: QPointF
    palette: Palette | None
    azimuth: float
    elevation: float
    moved: bool = False


class SolidView(QWidget):
    """The RGB solid of a session.

    Attributes
    ----------
    menu_actions : dict of str to list of QAction
        Its actions, by the window's menu that shows them.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        """Listen to the session."""
        super().__init__(parent)
        self.session = session
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setAccessibleName(texts.SOLID)
        self.azimuth, self.elevation, self.zoom = AZIMUTH, ELEVATION, 1.0
        self.axis: int | None = None  #: the axis whose key is down
        self._drag: Drag | None = None
        self._pixels: tuple[object, F64, NDArray[np.uint8]] | None = None
        self._extent: F64 | None = None
        self.menu_actions = view_actions(self, SOLID_ACTIONS)
        for event in ("document", "clip", "frame", "pixels", "selection", "hover", "view", "probe"):
            session.on(event, self.update)

    def sizeHint(self) -> QSize:
        """Return a square."""
        return QSize(380, 360)

    def minimumSizeHint(self) -> QSize:
        """Return the least size in which discs stay apart."""
        return QSize(220, 200)

    # ---------------------------------------------------------------------------------- content

    def palette_now(self) -> Palette | None:
        """Return the palette at the playhead."""
        document = self.session.document
        return None if document is None else document.palette(float(self.session.frame))

    def view_of(self, palette: Palette) -> View:
        """Return the projection; while a colour is dragged it stays as it was."""
        if self._drag is None or self._drag.index is None or self._extent is None:
            self._extent = extent_of([Shape(palette.rgb, palette.edited, palette.faces)])
        size = max(60.0, min(self.width() - 34.0, self.height() - 34.0)) * self.zoom
        # The size of a ball around everything: it fits from all sides. A colour that an edit moves
        # far away does not shrink the rest.
        far = np.linalg.norm(self._extent - 0.5, axis=1)
        near = float(far[: len(self._extent) - len(palette.edited)].max())
        away = float(min(far.max(), FARTHEST * near))
        centre = np.array([self.width() / 2, -(self.height() - 6) / 2])
        return View(centre, 1.12 * size / (2 * away)).turned(self.azimuth, self.elevation)

    def places(self, palette: Palette, view: View) -> tuple[F64, F64]:
        """Return the (n, 3) points of the colours before and after, y down, with depths."""
        both = []
        for colours in (palette.rgb, palette.edited):
            seen = view.project(colours)
            seen[:, 1] *= -1
            both.append(seen)
        return both[0], both[1]

    def index_at(self, at: QPointF) -> int | None:
        """Return the palette colour at a point."""
        palette = self.palette_now()
        if palette is None or not len(palette.ids):
            return None
        _, after = self.places(palette, self.view_of(palette))
        away = np.hypot(after[:, 0] - at.x(), after[:, 1] - at.y())
        near = np.flatnonzero(away <= max(DISC + 3, paint.REACH))
        if not near.size:
            return None
        # Of discs above each other, the one in front.
        return int(max(near.tolist(), key=lambda k: (round(-float(away[k]) / 4), after[k, 2])))

    def _cloud(self) -> tuple[F64, NDArray[np.uint8]] | None:
        """Return pixels of the frame in the palette's code values, and their displayed colours."""
        session = self.session
        if session.player is None or session.clip is None:
            return None
        key = (id(session.player), session.frame, session.looked)
        if self._pixels is None or self._pixels[0] != key:
            image = session.player.frame(session.frame)
            if image is None:
                return None if self._pixels is None else self._pixels[1:]
            colours = even_sample(straight(image, session.clip.premultiplied), PIXELS)
            document = session.document
            own = None if document is None else document.core.conversion
            if own is not None:
                colours = np.asarray(own.steps.to_palette(colours))
            self._pixels = key, colours, on_screen(session, colours)
        return self._pixels[1:]

    # -------------------------------------------------------------------------------------- mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Select a colour, or begin to turn the solid."""
        at = event.position()
        index = self.index_at(at) if event.button() == Qt.MouseButton.LeftButton else None
        palette = self.palette_now()
        self._drag = Drag(index, at, palette, self.azimuth, self.elevation)
        if index is not None and palette is not None:
            self.session.select(self.handle_of(palette, index))
        elif event.button() == Qt.MouseButton.LeftButton:
            self.setCursor(Qt.CursorShape.ClosedHandCursor)

    def handle_of(self, palette: Palette, index: int) -> str:
        """Return the vertex or stop that a colour lies on, or its edge."""
        document, id_ = self.session.document, palette.ids[index]
        for name, setting in {} if document is None else document.settings.items():
            if setting.edge == id_ and setting.frame == palette.frame:
                return name
        return id_

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn the solid, move a colour, or tell what is under the pointer."""
        at, drag = event.position(), self._drag
        if drag is None:
            palette, index = self.palette_now(), self.index_at(at)
            hovered = None if palette is None or index is None else palette.ids[index]
            self.session.hover_over(hovered)
            hand = Qt.CursorShape.OpenHandCursor
            self.setCursor(hand if index is None else Qt.CursorShape.SizeAllCursor)
            return
        away = at - drag.at
        if not drag.moved and away.manhattanLength() < 3:
            return
        drag.moved = True
        if drag.index is None:
            self.azimuth = (drag.azimuth - TURN * away.x() + 180) % 360 - 180
            self.elevation = float(np.clip(drag.elevation + TURN * away.y(), -90, 90))
            self.update()
        else:
            self._move(drag, away.x(), away.y())

    def _move(self, drag: Drag, dx: float, dy: float) -> None:
        assert drag.palette is not None
        assert drag.index is not None
        view = self.view_of(drag.palette)
        by = view.in_plane(dx, -dy) if self.axis is None else view.along(self.axis, dx, -dy)
        self.session.drag(self.moving(drag.palette, drag.index, by), texts.COLOUR_MOVED)

    def moving(self, palette: Palette, index: int, by: F64) -> "Moving":
        """Return the edit that moves a palette colour by a (3,) difference."""
        old = palette.edited[index]
        return Moving(palette.ids[index], palette.frame, old.tolist(), (old + by).tolist())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Do the edit that was dragged."""
        drag, self._drag = self._drag, None
        if drag is not None and drag.index is not None and drag.moved:
            self.session.drop()
            palette = self.palette_now()
            if palette is not None:
                self.session.select(self.handle_of(palette, drag.index))
        self.setCursor(Qt.CursorShape.OpenHandCursor)
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Look from the first side again."""
        if self.index_at(event.position()) is None:
            self.reset_view()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom."""
        self.zoom = float(np.clip(self.zoom * 1.15 ** (event.angleDelta().y() / 120), 0.5, 12))
        self.update()
        event.accept()

    def leaveEvent(self, event: QEvent) -> None:
        """Nothing is under the pointer."""
        self.session.hover_over(None)

    # ----------------------------------------------------------------------------------- keyboard

    def reset_view(self) -> None:
        """Look from the first side again."""
        self.azimuth, self.elevation, self.zoom = AZIMUTH, ELEVATION, 1.0
        self.update()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Choose an axis, turn, zoom, or move the selected colour."""
        key = Qt.Key(event.key())
        alt = bool(event.modifiers() & Qt.KeyboardModifier.AltModifier)
        arrows = {
            Qt.Key.Key_Left: (-1, 0),
            Qt.Key.Key_Right: (1, 0),
            Qt.Key.Key_Up: (0, -1),
            Qt.Key.Key_Down: (0, 1),
        }
        if key in AXIS_KEYS:
            self.axis = AXIS_KEYS[key]
        elif key in arrows and alt:
            self._nudge(*arrows[key])
        elif key in arrows:
            dx, dy = arrows[key]
            self.azimuth -= STEP * dx
            self.elevation = float(np.clip(self.elevation + STEP * dy, -90, 90))
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal, Qt.Key.Key_Minus):
            self.zoom = float(
                np.clip(self.zoom * (0.85 if key == Qt.Key.Key_Minus else 1 / 0.85), 0.5, 12)
            )
        elif key == Qt.Key.Key_Escape and self.session.dragging:
            self._drag = None
            self.session.cancel()
        else:
            super().keyPressEvent(event)
            return
        self.update()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """An axis lasts as long as its key is down."""
        if event.isAutoRepeat():
            return
        if AXIS_KEYS.get(Qt.Key(event.key())) == self.axis:
            self.axis = None
            self.update()

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Tab goes through the colours, and then to the next panel."""
        return self._step(forward) or super().focusNextPrevChild(forward)

    def next_colour(self) -> None:
        """Select the next colour."""
        self._step(True)

    def _step(self, forward: bool) -> bool:
        """Select the next colour or the one before; return whether there is one."""
        palette = self.palette_now()
        if palette is None:
            return False
        handles = [self.handle_of(palette, k) for k in range(len(palette.ids))]
        held = [handles.index(id_) for id_ in self.session.selection if id_ in handles]
        ends = 0 if forward else len(handles) - 1
        at = held[0] + (1 if forward else -1) if held else ends
        if not 0 <= at < len(handles):
            return False
        self.session.select(handles[at])
        return True

    def event(self, event: QEvent) -> bool:
        """Keep the axis keys and the arrows from the window's shortcuts."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            arrows = (Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down)
            control = event.modifiers() & Qt.KeyboardModifier.ControlModifier
            if not control and Qt.Key(event.key()) in (*AXIS_KEYS, *arrows):
                event.accept()
                return True
        return super().event(event)

    def _nudge(self, dx: int, dy: int) -> None:
        """Move the selected colour by about a hundredth, as a drag by the same way would."""
        palette = self.palette_now()
        if palette is None:
            return
        handles = [self.handle_of(palette, k) for k in range(len(palette.ids))]
        for id_ in self.session.selection:
            if id_ in handles:
                view = self.view_of(palette)
                way = (0.01 * view.scale * dx, -0.01 * view.scale * dy)
                by = view.in_plane(*way) if self.axis is None else view.along(self.axis, *way)
                edit = self.moving(palette, handles.index(id_), by)
                self.session.edit(edit, texts.COLOUR_MOVED)
                return

    # ------------------------------------------------------------------------------------ painting

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the solid."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), QColor(style.PANEL))
        palette = self.palette_now()
        if palette is not None:
            self._paint_solid(painter, palette)
        self._paint_words(painter, palette)
        paint.focus_frame(painter, self)
        painter.end()

    def _paint_solid(self, painter: QPainter, palette: Palette) -> None:
        view = self.view_of(palette)
        before, after = self.places(palette, view)
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
            self._paint_edited(painter, palette, after, colours[1], moved)
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
        painter.setFont(paint.small_font(self, -1))
        for channel, (bit, name) in enumerate(((1, "R"), (2, "G"), (4, "B"))):
            away = corners[bit, :2] - corners[0, :2]
            at = corners[bit, :2] + 10 * away / max(float(np.linalg.norm(away)), 1e-9)
            chosen = channel == self.axis
            if chosen:
                painter.setPen(paint.pen(style.BRIGHT, 2.0))
                ends = [QPointF(*corners[k, :2].tolist()) for k in (0, bit)]
                painter.drawLine(*ends)
            x, y = at.tolist()
            paint.label(painter, x, y, name, style.BRIGHT if chosen else style.FAINT)

    @staticmethod
    def _paint_faces(
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
        seen = np.einsum("pc,fcx->fpx", PIECES.mean(axis=1), colours[faces].astype(np.float64))
        points = np.einsum("pkc,fcx->fpkx", PIECES, at[faces, :2])
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
        found = self._cloud()
        if found is None or not len(found[0]):
            return
        colours, seen = found
        ratio = self.devicePixelRatioF()
        width, height = (round(s * ratio) for s in (self.width(), self.height()))
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
    ) -> None:
        """Draw the polyhedron of the edited colours, its concavities and its flipped faces."""
        if len(palette.faces):
            self._paint_faces(painter, after, colours, palette.faces, 26)
        shape = Shape(palette.edited, palette.edited, palette.faces)
        dents, turned = troubles(palette)
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
            own = {palette.ids[k], self.handle_of(palette, k)}
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

    def _paint_words(self, painter: QPainter, palette: Palette | None) -> None:
        """Write what the edit makes of the solid, and what the pointer can do."""
        painter.setFont(paint.small_font(self, -1))
        tall = painter.fontMetrics().height()
        wide = self.width() - 16.0
        foot = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom
        painter.setPen(QColor(theme.FAINT))
        words = texts.NOTHING_OPEN if palette is None else texts.SOLID_HINT
        if self.axis is not None:
            words = texts.SOLID_AXIS.format(axis=AXIS_NAMES[self.axis])
        words = painter.fontMetrics().elidedText(words, Qt.TextElideMode.ElideRight, int(wide))
        painter.drawText(QRectF(8, self.height() - tall - 5, wide, tall), foot, words)
        if palette is None:
            return
        dents, turned = troubles(palette)
        said = [
            counted(int(dents.sum()), texts.CONCAVE_EDGE, texts.CONCAVE_EDGES),
            counted(int(turned.sum()), texts.FLIPPED_FACE, texts.FLIPPED_FACES),
        ]
        said = [text for text, found in zip(said, (dents, turned), strict=True) if found.any()]
        if said:
            painter.setPen(QColor(theme.WARNING))
            head = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop
            painter.drawText(QRectF(8, 6, wide, tall), head, "⚠ " + ", ".join(said))


@dataclass(frozen=True)
class Moving:
    """The edit that gives a palette colour at a frame a new colour: `edit set --near`."""

    id: str
    frame: float
    old: list[float]
    new: list[float]

    def __call__(self, document: Document) -> str:
        """Do it; return the handle that has the colour."""
        if self.id in document.core.polytope.vertex_ids:
            document.set(self.id, rgb=self.new)
            return self.id
        near = document.set_near(self.old, frame=self.frame, rgb=self.new, anyway=True)
        return near.handle or near.id


def troubles(palette: Palette) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which edges an edit makes concave, and which faces it turns inside out."""
    faces = palette.faces
    if not len(faces):
        return np.zeros(0, bool), np.zeros(0, bool)
    new = concave(palette.edited, faces) & ~concave(palette.rgb, faces)
    turned = flipped(palette.rgb, palette.edited, faces)
    # Where a face is turned inside out, its edges' sides mean nothing.
    _, beside = edges_of(faces)
    return new & ~turned[beside].any(axis=1), turned
