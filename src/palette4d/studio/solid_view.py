"""The RGB solid: the palette at the playhead as a polyhedron, with the frame's pixels inside it.

A dragged colour moves in the plane of the screen, or along one axis. Where an edit makes a
concavity, the edge is drawn with notches; a face that it turns inside out is hatched.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QSize, Qt
from PySide6.QtGui import (
    QKeyEvent,
    QMouseEvent,
    QPaintEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QWidget

from palette4d import _core
from palette4d.grade.document import Document
from palette4d.grade.palette import Palette
from palette4d.plotting.solid import (
    AZIMUTH,
    ELEVATION,
    Shape,
    View,
    even_sample,
    extent_of,
)
from palette4d.studio import paint, texts
from palette4d.studio.menu_entries import SOLID_ACTIONS
from palette4d.studio.panel_menus import view_actions
from palette4d.studio.screen_colours import on_screen
from palette4d.studio.session import Session
from palette4d.studio.solid_paint import DISC, SolidPainter

F64 = NDArray[np.float64]

#: How many pixels of the frame are drawn.
PIXELS = 5000
#: Degrees for a pixel of a drag, and for an arrow key.
TURN, STEP = 0.4, 6.0
#: How far edited colours shrink the view, in radii of the others.
FARTHEST = 1.35
AXIS_KEYS = {Qt.Key.Key_X: 0, Qt.Key.Key_Y: 1, Qt.Key.Key_Z: 2}


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
        self._left = 0.0  #: pixels at the left that have words
        self._pixels: tuple[object, F64, NDArray[np.uint8]] | None = None
        self._extent: F64 | None = None
        self._drawn: Palette | None = None  #: at the last change of the document
        self.painter = SolidPainter(self)
        self.menu_actions = view_actions(
            self,
            SOLID_ACTIONS,
            {"next_colour": lambda: self._step(True), "reset_view": self.reset_view},
        )
        for event in ("clip", "frame", "selection", "hover", "view"):
            session.on(event, self.update, panel=True)
        session.on("document", self._changed, panel=True, follows=self._moves)
        session.on("pixels", self._pixels_arrived, panel=True)

    def sizeHint(self) -> QSize:
        """Return a square."""
        return QSize(380, 360)

    def minimumSizeHint(self) -> QSize:
        """Return the least size in which discs stay apart."""
        return QSize(220, 140)

    # ---------------------------------------------------------------------------------- content

    def _changed(self) -> None:
        self._drawn = self.palette_now()
        self.update()

    def _moves(self) -> bool:
        """Return whether its colours are others than those that were drawn: picks move none."""
        now, drawn = self.palette_now(), self._drawn
        if now is None or drawn is None:
            return now is not drawn
        return not np.array_equal(now.edited, drawn.edited)

    def _pixels_arrived(self) -> None:
        """Draw the frame's pixels, unless another frame's have arrived."""
        if self._pixels is None or self._pixels[0] != self._pixels_key():
            self.update()

    def _pixels_key(self) -> object:
        return id(self.session.player), self.session.frame, self.session.looked

    @property
    def pressed(self) -> bool:
        """Whether a button is down in it."""
        return self._drag is not None

    def palette_now(self) -> Palette | None:
        """Return the palette at the playhead."""
        document = self.session.document
        return None if document is None else document.grade.palette(float(self.session.frame))

    def view_of(self, palette: Palette) -> View:
        """Return the projection; while a colour is dragged it stays as it was."""
        if self._drag is None or self._drag.index is None or self._extent is None:
            self._extent = extent_of([Shape(palette.rgb, palette.edited, palette.faces)])
        if self._drag is None:  # what a drag spoils moves nothing below the pointer
            self._left = self.painter.words_width(palette)
        room = self.width() - self._left
        size = max(60.0, min(room - 34.0, self.height() - 34.0)) * self.zoom
        # The size of a ball around everything: it fits from all sides. A colour that an edit moves
        # far away does not shrink the rest.
        far = np.linalg.norm(self._extent - 0.5, axis=1)
        near = float(far[: len(self._extent) - len(palette.edited)].max())
        away = float(min(far.max(), FARTHEST * near))
        centre = np.array([self._left + room / 2, -(self.height() - 6) / 2])
        return View(centre, size / (2 * away)).turned(self.azimuth, self.elevation)

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

    def cloud(self) -> tuple[F64, NDArray[np.uint8]] | None:
        """Return pixels of the frame in the palette's code values, and their displayed colours."""
        session = self.session
        if session.player is None or session.clip is None:
            return None
        key = self._pixels_key()
        if self._pixels is None or self._pixels[0] != key:
            image = session.player.frame(session.frame)
            if image is None:
                return None if self._pixels is None else self._pixels[1:]
            premultiplied = session.clip.premultiplied
            straight = _core.straight_colours(image, premultiplied=premultiplied)
            colours = even_sample(straight, PIXELS).astype(np.float64)
            document = session.document
            own = None if document is None else document.grade.core.conversion
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
        self.session.hover_over(None)  # what is dragged is seen in the picture, without a matte
        if index is not None and palette is not None:
            self.session.select(self.handle_of(palette, index))
        elif event.button() == Qt.MouseButton.LeftButton:
            self.setCursor(Qt.CursorShape.ClosedHandCursor)

    def handle_of(self, palette: Palette, index: int) -> str:
        """Return the vertex or stop that a colour lies on, or its edge."""
        document, id_ = self.session.document, palette.ids[index]
        for name, setting in {} if document is None else document.grade.settings.items():
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
        elif key == Qt.Key.Key_Escape and (self.session.dragging or self.session.held):
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

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the solid."""
        self.painter.paint()


@dataclass(frozen=True)
class Moving:
    """The edit that gives a palette colour at a frame a new colour: `edit set --near`."""

    id: str
    frame: float
    old: list[float]
    new: list[float]

    def __call__(self, document: Document) -> str:
        """Do it; return the handle that has the colour."""
        if self.id in document.grade.core.polytope.vertex_ids:
            document.set(self.id, rgb=self.new)
            return self.id
        near = document.set_near(self.old, frame=self.frame, id=self.id, rgb=self.new)
        return near.handle or near.id
