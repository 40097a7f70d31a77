"""The timeline: frames, tracks with their handles, and the playhead.

It draws the layout of `palette4d.plotting.layout`, as `palette4d plot` does. A row is a palette
colour through time; its upper half is the colour before the edits, its lower half after. In the
lower half a line shows how much of the edit acts: the ramp. The left column has the colours at the
playhead, and the weights of the pixel under the pointer.
"""

import contextlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QHelpEvent,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPixmap,
    QPolygonF,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QMenu, QToolTip, QWidget

from palette4d.grade.document import Document
from palette4d.grade.edits import RAMPS, Ramp
from palette4d.grade.follow import Progress
from palette4d.grade.picks import Pick
from palette4d.plotting import style
from palette4d.plotting.layout import (
    BAND,
    COLLAR,
    Disc,
    Scale,
    Timeline,
    disc_names,
    half_bands,
)
from palette4d.plotting.rows import Palette, Rows, arrange
from palette4d.studio import paint, texts, theme
from palette4d.studio.actions import TIMELINE_ACTIONS, VIEW
from palette4d.studio.menus import view_actions
from palette4d.studio.player import Region
from palette4d.studio.screen_colours import on_screen, thumbnail
from palette4d.studio.session import Event, Session

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]

#: The column of colours at the left, the ruler, the frame strip, and the zoom bar, in pixels.
GUTTER, RULER, STRIP, FOOT = 84, 24, 46, 12
#: The height of a pick's range, and the most that are drawn above each other.
LANE, MOST_LANES = 13, 5
#: Fades of picks in the menu, in frames.
FADES = (0.0, 2.0, 5.0, 10.0, 25.0)
#: Space for the block names above the rows, below them, and beside the first and last frame.
HEAD, TAIL, SIDE = 22.0, 10.0, 26.0
#: The heights of a row, and the largest radius of a disc, in rows.
LOWEST, HIGHEST, RADIUS = 20.0, 46.0, 0.27
#: Pixels between two sampled colours of a band.
COLUMN = 2
#: The same while something is dragged.
DRAGGED_COLUMN = 8
#: A step of the zoom, and the fewest frames that fill the width.
ZOOM = 0.6
CLOSEST = 4.0
#: Makes the strip's pictures.
THREAD = ThreadPoolExecutor(1, thread_name_prefix="palette4d thumbnails")
#: Pixels that the pointer moves before a press becomes a drag.
THRESHOLD = 3


@dataclass(frozen=True)
class Hit:
    """What is under the pointer.

    Attributes
    ----------
    what : str
    id : str
        The handle of a disc, the edge of a band, the id of a pick.
    stop : bool
        The disc is a stop.
    grip : str
        The end of a pick's range: "start" or "until".
    """

    what: Literal["ruler", "lane", "pick", "gutter", "disc", "band", "zoom", "ground"]
    id: str = ""
    stop: bool = False
    grip: str = ""


@dataclass
class Press:
    """A press of the mouse that may become a drag."""

    hit: Hit
    at: QPointF
    scroll: float
    first: float
    grab: float = 0.0
    moved: bool = False
    button: Qt.MouseButton = Qt.MouseButton.LeftButton


class TimelineView(QWidget):
    """The timeline of a session.

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
        self.setAccessibleName(texts.TIMELINE)
        self._span: tuple[float, float] | None = None  # frames shown; None: the clip
        self._scroll = 0.0
        self._palette: tuple[object, Palette, Rows] | None = None
        self._layout: tuple[object, Timeline, list[Disc]] | None = None
        self._lanes: tuple[int, list[tuple[Pick, int]]] | None = None
        self._range: tuple[str, float, float] | None = None  # of a pick, while it is dragged
        self._picture: tuple[object, tuple[QPixmap, QPixmap]] | None = None
        self._thumbs: dict[int, tuple[object, QPixmap]] = {}
        self._making: set[int] = set()
        self._press: Press | None = None
        self._band: QRectF | None = None
        self.menu_actions = view_actions(self, TIMELINE_ACTIONS)
        calls: tuple[tuple[Event, Callable[[], object]], ...] = (
            ("document", self._changed),
            ("clip", self._new_clip),
            ("frame", self._frame_moved),
            ("selection", self._redraw),
            ("hover", self.update),
            ("probe", self.update),
            ("range", self.update),
            ("view", self.update),
            ("pixels", self.update),
        )
        for event, call in calls:
            session.on(event, call)

    def sizeHint(self) -> QSize:
        """Return the size that shows a common palette whole."""
        return QSize(1100, RULER + STRIP + FOOT + int(HEAD + TAIL) + 8 * 30)

    def minimumSizeHint(self) -> QSize:
        """Return the least size: a few rows."""
        return QSize(360, RULER + STRIP + FOOT + int(HEAD + TAIL) + 3 * int(LOWEST))

    # ------------------------------------------------------------------------------------- layout

    @property
    def _content(self) -> Palette | None:
        document, key = self.session.document, self.session.revision
        if document is None:
            return None
        if self._palette is None or self._palette[0] != key:
            palette = Palette.of(document.core)
            old = self._palette
            if old is not None and old[1].edges == palette.edges and old[1].ids == palette.ids:
                rows = old[2]  # the rows depend on the clip's palette alone, not on edits
            else:
                rows = arrange(palette.frames, palette.rgb, palette.edges)
            self._palette = key, palette, rows
        return self._palette[1]

    @property
    def span(self) -> tuple[float, float]:
        """The first and last frame that the width shows."""
        first, last, _ = self.session.frames
        return self._span or (float(first), float(last))

    @property
    def scale(self) -> Scale:
        """The x of the clip's frames; it reaches beyond the widget when zoomed."""
        first, last, _ = self.session.frames
        start, end = self.span
        left, right = GUTTER + SIDE, max(self.width() - SIDE, GUTTER + SIDE + 1)
        if last <= first:
            return Scale(first, last, left, right)
        per_frame = (right - left) / max(end - start, 1e-9)
        begin = left - (start - first) * per_frame
        return Scale(first, last, begin, begin + (last - first) * per_frame)

    @property
    def timeline(self) -> tuple[Timeline, list[Disc]] | None:
        """The places of rows and discs; y is 0 at the first row's top."""
        palette = self._content
        if palette is None or self._palette is None:
            return None
        rows = self._palette[2]
        height = float(np.clip(self._room / max(rows.count, 1), LOWEST, HIGHEST))
        scale = self.scale
        key = (self._palette[0], scale, height)
        if self._layout is None or self._layout[0] != key:
            layout = Timeline(palette, rows, scale, height, RADIUS)
            discs = layout.discs(scale.left - SIDE + 4, scale.right + SIDE - 4)
            self._layout = key, layout, discs
        return self._layout[1], self._layout[2]

    @property
    def _upper(self) -> float:
        """The y below the frame strip and the ranges of the picks."""
        lanes = max((lane for _, lane in self.lanes()), default=-1) + 1
        return RULER + STRIP + (lanes * LANE + 4 if lanes else 0)

    def lanes(self) -> list[tuple[Pick, int]]:
        """Return the picks and holds with the lanes of their ranges; ranges of a lane are apart."""
        document = self.session.document
        if document is None:
            return []
        if self._lanes is None or self._lanes[0] != self.session.revision:
            ends: list[float] = []
            placed = []
            for pick in sorted(document.picks, key=lambda pick: self.reach(pick)[0]):
                start, *_, end = self.reach(pick)
                free = [lane for lane, last in enumerate(ends) if last < start]
                lane = free[0] if free else min(len(ends), MOST_LANES - 1)
                ends[lane : lane + 1] = [end]
                placed.append((pick, lane))
            self._lanes = self.session.revision, placed
        return self._lanes[1]

    def reach(self, pick: Pick) -> tuple[float, float, float, float]:
        """Return where a pick begins to act, acts fully, no longer fully, and no more."""
        first, last, _ = self.session.frames
        start = float(first if pick.start is None else pick.start)
        until = float(last if pick.until is None else pick.until)
        if self._range is not None and self._range[0] == pick.id:
            start, until = self._range[1:]
        return max(start - pick.fade, first), start, until, min(until + pick.fade, last)

    def _lane_y(self, lane: int) -> float:
        return RULER + STRIP + 4 + (lane + 0.5) * LANE

    def _hit_lane(self, at: QPointF) -> Hit:
        """Return the pick at a point, and which end of its range."""
        found = Hit("lane")
        for pick, lane in self.lanes():
            begin, start, until, end = (self.x_of(t) for t in self.reach(pick))
            if abs(at.y() - self._lane_y(lane)) > LANE / 2 or not begin - 7 <= at.x() <= end + 7:
                continue
            near = {"start": abs(at.x() - start), "until": abs(at.x() - until)}
            grip = min(near, key=lambda name: near[name])
            found = Hit("pick", pick.id, grip=grip if near[grip] <= 7 else "")
        return found

    @property
    def _room(self) -> float:
        """The height that rows can have."""
        return self.height() - self._upper - HEAD - TAIL - FOOT

    @property
    def _top(self) -> float:
        """The widget's y of the first row's top."""
        found = self.timeline
        limit = 0.0 if found is None else max(0.0, found[0].height - self._room)
        self._scroll = min(max(self._scroll, 0.0), limit)
        return self._upper + HEAD - self._scroll

    def frame_at(self, x: float, *, snap: bool = True) -> float:
        """Return the time at an x; snapped to the clip's frames."""
        first, last, step = self.session.frames
        time = float(self.scale.frame(x))
        return float(min(first + round((time - first) / step) * step, last)) if snap else time

    def x_of(self, frame: float) -> float:
        """Return the x of a time."""
        return float(self.scale.x(frame))

    def hit(self, at: QPointF) -> Hit:
        """Return what is at a point."""
        if at.y() < RULER + STRIP:
            return Hit("ruler")
        if at.y() < self._upper:
            return self._hit_lane(at)
        if at.y() >= self.height() - FOOT:
            return Hit("zoom")
        found = self.timeline
        if found is None:
            return Hit("ground")
        layout, discs = found
        y = at.y() - self._top
        if at.x() < GUTTER:
            edge = self._edge_now(y)
            return Hit("gutter", "" if edge is None else layout.palette.edge_ids[edge])
        reached = [
            (away, disc)
            for disc in discs
            if (away := float(np.hypot(disc.x - at.x(), disc.y - y)))
            <= max(disc.radius + COLLAR, paint.REACH)
        ]
        if reached:
            disc = min(reached, key=lambda pair: pair[0])[1]
            return Hit("disc", disc.id, disc.kind == "stop")
        band = layout.edge_near(at.x(), y, max(BAND * layout.row_height + 1, paint.REACH))
        if band is not None:
            return Hit("band", layout.palette.edge_ids[band])
        return Hit("ground")

    def _edge_now(self, y: float) -> int | None:
        """Return the edge at the playhead in the row at a y."""
        found = self.timeline
        if found is None:
            return None
        layout = found[0]
        return layout.edge_near(self.x_of(self.session.frame), y, layout.row_height / 2)

    # -------------------------------------------------------------------------------- what changes

    def _changed(self) -> None:
        first, last, _ = self.session.frames
        if self._span is not None and not first <= self._span[0] < self._span[1] <= last:
            self._span = None
        self._redraw()

    def _redraw(self) -> None:
        self.update()

    def _new_clip(self) -> None:
        self._thumbs.clear()
        self._changed()

    def _frame_moved(self) -> None:
        start, end = self.span
        frame = float(self.session.frame)
        if self._span is not None and not start <= frame <= end and self._press is None:
            wide = end - start
            self._show(frame - 0.1 * wide if frame > end else frame - 0.9 * wide, wide)
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the frames that are shown."""
        self.update()

    # -------------------------------------------------------------------------------- zoom and pan

    def _show(self, start: float, wide: float) -> None:
        first, last, _ = self.session.frames
        whole = float(last - first)
        if wide >= whole:
            self._span = None
        else:
            start = min(max(start, first), last - wide)
            self._span = (start, start + wide)
        self.update()

    def zoom(self, factor: float, at: float | None = None) -> None:
        """Show `factor` times as many frames; the frame at x (default: the playhead) stays."""
        first, last, _ = self.session.frames
        start, end = self.span
        fixed = self.session.frame if at is None else float(self.scale.frame(at))
        fixed = min(max(fixed, start), end)
        wide = float(np.clip((end - start) * factor, min(CLOSEST, last - first), last - first))
        share = (fixed - start) / max(end - start, 1e-9)
        self._show(fixed - share * wide, wide)

    def show_all(self) -> None:
        """Show the whole clip."""
        self._span = None
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom over the ruler or with Ctrl, pan with Shift, else scroll the rows."""
        turn = event.angleDelta()
        steps, sideways = turn.y() / 120, turn.x() / 120
        keys, at = event.modifiers(), event.position()
        found = self.timeline
        scrolls = found is not None and found[0].height > self._room
        start, end = self.span
        if keys & Qt.KeyboardModifier.ShiftModifier or sideways:
            self._show(start - (steps + sideways) * 0.1 * (end - start), end - start)
        elif keys & Qt.KeyboardModifier.ControlModifier or at.y() < RULER + STRIP or not scrolls:
            self.zoom(0.85**steps, at.x())
        else:
            self._scroll -= steps * 30
            self.update()
        event.accept()

    # -------------------------------------------------------------------------------------- mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Select, or begin a drag."""
        at = event.position()
        hit = self.hit(at)
        self._press = Press(hit, at, self._scroll, self.span[0], button=event.button())
        if event.button() != Qt.MouseButton.LeftButton:
            return
        add = bool(
            event.modifiers()
            & (Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
        )
        if hit.what == "ruler":
            self.session.go(self.frame_at(at.x()))
        elif hit.what == "zoom":
            self._drag_zoom_bar(at.x())
        elif hit.id:
            self._select(hit.id, add)
            if hit.what == "disc" and (disc := self._disc(hit.id)) is not None:
                self._press.grab = at.x() - disc.home
        elif not add:
            self.session.select()

    def _select(self, id_: str, add: bool) -> None:
        held = self.session.selection
        if not add:
            self.session.select(id_)
        elif id_ in held:
            self.session.select(*(other for other in held if other != id_))
        else:
            self.session.select(*held, id_)

    def _disc(self, id_: str) -> Disc | None:
        found = self.timeline
        discs = [] if found is None else found[1]
        return next((disc for disc in discs if disc.id == id_), None)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag, or tell what is under the pointer."""
        at, press = event.position(), self._press
        if press is None:
            self._hover(at)
            return
        if not press.moved and (at - press.at).manhattanLength() < THRESHOLD:
            return
        press.moved = True
        if press.button == Qt.MouseButton.MiddleButton:
            start, end = self.span
            away = (press.at.x() - at.x()) / self.scale.per_frame
            self._scroll = press.scroll + press.at.y() - at.y()
            self._show(press.first + away, end - start)
        elif press.button != Qt.MouseButton.LeftButton:
            return
        elif press.hit.what == "ruler":
            self.session.go(self.frame_at(at.x()))
        elif press.hit.what == "zoom":
            self._drag_zoom_bar(at.x())
        elif press.hit.stop:
            free = bool(event.modifiers() & Qt.KeyboardModifier.AltModifier)
            self._drag_stop(press.hit.id, at.x() - press.grab, snap=not free)
        elif press.hit.grip:
            self._drag_range(press.hit, at.x())
        elif press.hit.what == "ground":
            self._band = QRectF(press.at, at).normalized()
            self._select_in(self._band)
        self.update()

    def _drag_zoom_bar(self, x: float) -> None:
        first, last, _ = self.session.frames
        start, end = self.span
        middle = first + (x - GUTTER) / max(self.width() - GUTTER, 1) * (last - first)
        self._show(middle - (end - start) / 2, end - start)

    def _drag_stop(self, id_: str, x: float, *, snap: bool) -> None:
        frame = self.place_for(id_, self.frame_at(x, snap=snap))
        if frame is not None:
            text = texts.STOP_MOVED.format(id=id_, frame=style.number(frame))
            self.session.drag(lambda document: document.move(id_, frame=frame), text)

    def _drag_range(self, hit: Hit, x: float) -> None:
        pick = next((pick for pick, _ in self.lanes() if pick.id == hit.id), None)
        if pick is None:
            return
        _, start, until, _ = self.reach(pick)
        frame = self.frame_at(x)
        if hit.grip == "start":
            self._range = (hit.id, min(frame, until), until)
        else:
            self._range = (hit.id, start, max(frame, start))
        self.update()

    def set_range(self, id_: str, start: float, until: float) -> None:
        """Give a pick or hold a range; at the clip's ends it has no limit."""
        first, last, _ = self.session.frames
        clip = None if self.session.clip is None else self.session.clip.source
        begin = None if start <= first else start
        end = None if until >= last else until

        def change(document: Document, progress: Progress) -> None:
            document.change_pick(id_, clip=clip, progress=progress, start=begin, until=end)

        def done(_: object) -> None:
            self._range = None
            self.update()

        text = texts.RANGE_SET.format(id=id_, start=style.number(start), until=style.number(until))
        self.session.edit_later(change, text, done)

    def place_for(self, id_: str, frame: float) -> float | None:
        """Return the time nearest to a wanted one that a stop can have; None: it stays."""
        content, document = self._content, self.session.document
        if content is None or document is None:
            return None
        stop = next((stop for stop in content.stops if stop[0] == id_), None)
        if stop is None:
            return None
        first, _, step = self.session.frames
        start, end = (float(t) for t in content.frames[list(content.edges[stop[1]])])
        low = first + (np.floor((start - first) / step) + 1) * step
        high = first + (np.ceil((end - first) / step) - 1) * step
        if float(frame).is_integer() and low <= high:
            frame = float(min(max(frame, low), high))
        else:
            room = 1e-3 * (end - start)
            frame = float(np.clip(frame, start + room, end - room))
        edge = stop[1]
        taken = [other[2] for other in content.stops if other[1] == edge and other[0] != id_]
        return None if frame in taken else frame

    def _select_in(self, box: QRectF) -> None:
        found, top = self.timeline, self._top
        if found is not None:
            ids = [d.id for d in found[1] if box.contains(QPointF(d.x, d.y + top))]
            self.session.select(*ids)

    def _hover(self, at: QPointF) -> None:
        hit = self.hit(at)
        self.session.hover_over(hit.id or None if hit.what != "pick" else None)
        shape = Qt.CursorShape.ArrowCursor
        if hit.stop or hit.grip:
            shape = Qt.CursorShape.SizeHorCursor
        elif hit.what in ("disc", "band", "pick"):
            shape = Qt.CursorShape.PointingHandCursor
        self.setCursor(shape)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a drag."""
        press, self._press, self._band = self._press, None, None
        if press is not None and press.hit.grip and press.moved and self._range is not None:
            self.set_range(*self._range)
        if press is not None and press.hit.stop and press.moved:
            self.session.drop()
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Add a stop to a row, or go to a handle's frame."""
        if event.button() != Qt.MouseButton.LeftButton:
            return
        hit = self.hit(event.position())
        if hit.what == "band":
            self.add_stop(hit.id, self.frame_at(event.position().x()))
        elif hit.what == "disc" and (disc := self._disc(hit.id)) is not None:
            self.session.go(disc.frame)

    def leaveEvent(self, event: QEvent) -> None:
        """Nothing is under the pointer."""
        self.session.hover_over(None)

    def event(self, event: QEvent) -> bool:
        """Show a tip about what is under the pointer."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            tip = self.tip(self.hit(QPointF(event.pos())))
            if tip:
                QToolTip.showText(event.globalPos(), tip, self)
            else:
                QToolTip.hideText()
            return True
        return super().event(event)

    def tip(self, hit: Hit) -> str:
        """Return what a tip says."""
        disc = self._disc(hit.id) if hit.what == "disc" else None
        if disc is not None:
            before, after = (
                " ".join(f"{v:.3f}" for v in colour) for colour in (disc.before, disc.after)
            )
            kind = texts.STOP if disc.kind == "stop" else texts.VERTEX
            line = f"{kind} {disc.id}, {texts.FRAME} {style.number(disc.frame)}\n{before}"
            return line if before == after else f"{line} → {after}"
        if hit.what == "band":
            return texts.ROW_TIP.format(id=hit.id)
        for pick, _ in self.lanes() if hit.what == "pick" else ():
            if pick.id == hit.id:
                _, start, until, _ = self.reach(pick)
                ends = style.number(start), style.number(until), style.number(pick.fade)
                return f"{pick.id}: {texts.PICK_TIP.format(*ends)}"
        return ""

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Show the menu of what is under the pointer."""
        at = QPointF(event.pos())
        menu = self.menu_for(self.hit(at), at.x())
        menu.exec(event.globalPos())
        self._press = None

    def menu_for(self, hit: Hit, x: float) -> QMenu:
        """Return the menu of something under the pointer."""
        menu = QMenu(self)
        if hit.id and hit.id not in self.session.selection:
            self.session.select(hit.id)
        disc = self._disc(hit.id) if hit.what == "disc" else None
        if disc is not None:
            frame = disc.frame
            go = texts.GO_THERE.format(frame=style.number(frame))
            menu.addAction(go, lambda: self.session.go(frame))
            reset = texts.REMOVE_STOP if hit.stop else texts.RESET
            menu.addAction(reset, self.reset_selected)
            self._add_ramps(menu)
            menu.addAction(texts.LOCK_ENTRY, self.lock_selected)
            menu.addSeparator()
        elif hit.what == "pick":
            self._add_pick(menu, next(p for p, _ in self.lanes() if p.id == hit.id))
            menu.addAction(texts.REMOVE, self.remove_picks)
            menu.addSeparator()
        elif hit.what == "band":
            time = self.frame_at(x)
            add = texts.ADD_STOP_AT.format(frame=style.number(time))
            menu.addAction(add, lambda: self.add_stop(hit.id, time))
            menu.addSeparator()
        menu.addActions(self.menu_actions[VIEW])
        return menu

    def _add_pick(self, menu: QMenu, pick: Pick) -> None:
        """Add what can be changed of a pick or hold."""

        def entry(where: QMenu, text: str, on: bool, **changes: Any) -> None:
            made = where.addAction(text)
            made.setCheckable(True)
            made.setChecked(on)
            made.triggered.connect(lambda _=False: self._change_pick(pick.id, changes))

        go = texts.GO_THERE.format(frame=style.number(pick.frame))
        menu.addAction(go, lambda: self.session.go(pick.frame))
        entry(menu, texts.COUNTS, pick.enabled, enabled=not pick.enabled)
        entry(menu, texts.PALETTE_ONLY, pick.global_only, global_only=not pick.global_only)
        if pick.kind == "pick":
            same = pick.toward == "colour"
            entry(menu, texts.SAME_COLOUR, same, toward="shift" if same else "colour")
        fades = menu.addMenu(texts.FADE)
        for fade in sorted({*FADES, pick.fade}):
            name = texts.FADE_OF.format(frames=style.number(fade))
            entry(fades, name, fade == pick.fade, fade=float(fade))

    def _change_pick(self, id_: str, changes: dict[str, Any]) -> None:
        clip = None if self.session.clip is None else self.session.clip.source

        def change(document: Document, progress: Progress) -> None:
            document.change_pick(id_, clip=clip, progress=progress, **changes)

        text = texts.PICK_CHANGED.format(id=id_)
        self.session.edit_later(change, text, lambda _: self.update())

    def _add_ramps(self, menu: QMenu) -> None:
        """Add the ramps of the selected handles that are edited."""
        document = self.session.document
        ids = [
            id_
            for id_ in self.session.selection
            if document is not None and id_ in document.settings
        ]
        ramps = menu.addMenu(texts.RAMP)
        ramps.setEnabled(bool(ids))
        for ramp in RAMPS:
            entry = ramps.addAction(texts.RAMPS[ramp])
            entry.triggered.connect(lambda _=False, ramp=ramp: self._set_ramp(ids, ramp))
            entry.setCheckable(True)
            if document is not None and ids:
                entry.setChecked(all(document.settings[id_].ramp == ramp for id_ in ids))

    def _set_ramp(self, ids: list[str], ramp: Ramp) -> None:
        def change(document: Document) -> None:
            with document.one_step(texts.RAMP_STEP.format(ramp=ramp)):
                for id_ in ids:
                    document.set_ramp(ramp, id_)

        self.session.edit(change, texts.RAMP_SET.format(ramp=texts.RAMPS[ramp]))

    # ----------------------------------------------------------------------------------- gestures

    def lock_selected(self) -> None:
        """Lock the selected handles, or unlock them if all are locked."""
        document = self.session.document
        content = self._content
        if document is None or content is None:
            return
        handles = {*content.ids, *(stop[0] for stop in content.stops)}
        ids = [id_ for id_ in self.session.selection if id_ in handles]
        if not ids:
            return
        if set(ids) <= set(document.locks):
            self.session.edit(lambda document: document.unlock(*ids), texts.LOCK)
        else:
            new = [id_ for id_ in ids if id_ not in document.locks]
            self.session.edit(lambda document: document.lock(*new), texts.LOCK)

    def remove_picks(self) -> None:
        """Remove the selected picks and holds."""
        ids = [pick.id for pick, _ in self.lanes() if pick.id in self.session.selection]
        if ids:
            text = texts.REMOVED.format(ids=", ".join(ids))
            self.session.edit(lambda document: document.unpick(*ids), text)

    def add_stop(self, edge: str, frame: float) -> None:
        """Add a stop of the colour that the edge has at a frame."""
        content = self._content
        if content is None or edge not in content.edge_ids:
            return
        index = content.edge_ids.index(edge)
        start, end = content.frames[list(content.edges[index])]
        if not start < frame < end:
            self.session.say(texts.NO_STOP_HERE.format(edge=edge), "warning")
            return
        rgb = content.colours(index, np.array([frame]), edited=True)[0].tolist()
        text = texts.STOP_ADDED.format(edge=edge, frame=style.number(frame))
        made = self.session.edit(lambda document: document.stop(edge, frame=frame, rgb=rgb), text)
        if made is not None:
            self.session.select(made)

    def add_stop_at_playhead(self) -> None:
        """Add a stop to the selected row at the playhead."""
        content = self._content
        row = self._selected_row()
        if content is None or row is None:
            self.session.say(texts.SELECT_A_ROW, "warning")
            return
        for edge in self._edges_of_row(row):
            start, end = content.frames[list(content.edges[edge])]
            if start < self.session.frame < end:
                self.add_stop(content.edge_ids[edge], float(self.session.frame))
                return
        self.session.say(texts.NO_STOP_HERE.format(edge=""), "warning")

    def _selected_row(self) -> int | None:
        """Return the row of the first selected handle."""
        content = self._content
        if content is None or self._palette is None or not self.session.selection:
            return None
        rows, id_ = self._palette[2], self.session.selection[0]
        if id_ in content.ids:
            return int(rows.row[rows.vertex_chain[content.ids.index(id_)]])
        stops = {stop[0]: stop[1] for stop in content.stops}
        edge = stops.get(id_)
        if id_ in content.edge_ids:
            edge = content.edge_ids.index(id_)
        return None if edge is None else int(rows.row[rows.edge_chain[edge]])

    def _edges_of_row(self, row: int) -> list[int]:
        assert self._palette is not None
        rows = self._palette[2]
        return np.flatnonzero(rows.row[rows.edge_chain] == row).tolist()

    def reset_selected(self) -> None:
        """Reset the selected vertices, and remove the selected stops."""
        document = self.session.document
        if document is None:
            return
        ids = [id_ for id_ in self.session.selection if id_ in document.settings]

        def reset(document: Document) -> None:
            for id_ in ids:
                document.reset(id_)

        if ids:
            self.session.edit(reset, texts.WAS_RESET.format(ids=", ".join(ids)))

    def select_all(self) -> None:
        """Select all handles."""
        found = self.timeline
        if found is not None:
            self.session.select(*(disc.id for disc in found[1]))

    def next_handle(self) -> None:
        """Select the next handle, row by row."""
        self.step_handle(1)

    def previous_handle(self) -> None:
        """Select the handle before."""
        self.step_handle(-1)

    def row_above(self) -> None:
        """Select the colour at the playhead in the row above."""
        self.step_row(-1)

    def row_below(self) -> None:
        """Select the colour at the playhead in the row below."""
        self.step_row(1)

    def stop_earlier(self) -> None:
        """Move the selected stops a frame earlier."""
        self.nudge(-1)

    def stop_later(self) -> None:
        """Move the selected stops a frame later."""
        self.nudge(1)

    def zoom_in(self) -> None:
        """Show fewer frames."""
        self.zoom(ZOOM)

    def zoom_out(self) -> None:
        """Show more frames."""
        self.zoom(1 / ZOOM)

    def step_handle(self, by: int) -> bool:
        """Select the next handle, row by row; return whether there is one."""
        found = self.timeline
        if found is None:
            return False
        ids = [disc.id for disc in sorted(found[1], key=lambda disc: (round(disc.y), disc.home))]
        held = [ids.index(id_) for id_ in self.session.selection if id_ in ids]
        at = held[0] + by if held else (0 if by > 0 else len(ids) - 1)
        if not 0 <= at < len(ids):
            return False
        self.session.select(ids[at])
        return True

    def step_row(self, by: int) -> None:
        """Select the colour at the playhead in the next row."""
        found = self.timeline
        if found is None or self._palette is None:
            return
        row = self._selected_row()
        count = found[0].rows.count
        start = (row + by) if row is not None else (0 if by > 0 else count - 1)
        for there in range(start, count if by > 0 else -1, by):
            edge = self._edge_now((there + 0.5) * found[0].row_height)
            if edge is not None:
                self.session.select(found[0].palette.edge_ids[edge])
                return

    def nudge(self, by: int) -> None:
        """Move the selected stop by frames."""
        content = self._content
        stops = {} if content is None else {stop[0]: stop[2] for stop in content.stops}
        for id_ in self.session.selection:
            if id_ not in stops:
                continue
            frame = self.place_for(id_, float(round(stops[id_]) + by * self.session.frames[2]))
            if frame is not None and frame != stops[id_]:
                self._move(id_, frame)

    def _move(self, id_: str, frame: float) -> None:
        text = texts.STOP_MOVED.format(id=id_, frame=style.number(frame))
        self.session.edit(lambda document: document.move(id_, frame=frame), text)

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Tab goes through the handles, and then to the next panel."""
        return self.step_handle(1 if forward else -1) or super().focusNextPrevChild(forward)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape stops a drag, or selects nothing."""
        if event.key() == Qt.Key.Key_Escape:
            if self.session.dragging:
                self._press = None
                self.session.cancel()
            else:
                self.session.select()
            return
        super().keyPressEvent(event)

    # ------------------------------------------------------------------------------------ painting

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the timeline."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), QColor(style.PANEL))
        if self.session.frames[0] == self.session.frames[1] == 0 and self.session.document is None:
            painter.setPen(QColor(theme.FAINT))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, texts.NOTHING_OPEN)
            return
        bands, discs = self._pictures()
        painter.drawPixmap(0, 0, bands)
        self._paint_strip(painter)
        self._paint_lanes(painter)
        self._paint_ruler(painter)
        self._paint_playhead(painter)
        painter.drawPixmap(0, 0, discs)
        self._paint_pointer(painter)
        self._paint_gutter(painter)
        self._paint_zoom_bar(painter)
        paint.focus_frame(painter, self)
        painter.end()

    def _pictures(self) -> tuple[QPixmap, QPixmap]:
        """Return the rows, and their discs; drawn again only when something in them changed."""
        ratio = self.devicePixelRatioF()
        found = self.timeline
        key = (
            self._layout and self._layout[0],
            self.size(),
            ratio,
            self._top,
            self.session.selection,
            self.session.looked,
        )
        if self._picture is None or self._picture[0] != key:
            pictures = []
            for draw, ground in ((self._paint_rows, style.PANEL), (self._paint_discs, "#00000000")):
                picture = QPixmap(self.size() * ratio)
                picture.setDevicePixelRatio(ratio)
                picture.fill(QColor(ground))
                if found is not None:
                    painter = QPainter(picture)
                    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
                    painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
                    draw(painter, *found)
                    painter.end()
                pictures.append(picture)
            self._picture = key, (pictures[0], pictures[1])
        return self._picture[1]

    def _paint_rows(self, painter: QPainter, layout: Timeline, discs: list[Disc]) -> None:
        top, floor = self._upper, self.height() - FOOT
        painter.setClipRect(QRectF(GUTTER, top, self.width() - GUTTER, floor - top))
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
        painter.setFont(paint.small_font(self, -1))
        metrics = painter.fontMetrics()
        y0 = self._top
        for name in layout.block_names(11 - HEAD + self._scroll, metrics.horizontalAdvance):
            if GUTTER < name.x < self.width():
                paint.label(painter, name.x, name.y + y0, name.text, style.FAINT)
        self._into_rows(painter)
        painter.setPen(paint.pen(style.LINE, 0.7, [1, 4]))
        for disc in discs:
            if disc.kind != "plain":
                painter.drawLine(QPointF(disc.home, 0), QPointF(disc.home, layout.height))
        self._paint_bands(painter, layout)

    def _into_rows(self, painter: QPainter) -> None:
        """Clip to the rows, and put the first row's top at y = 0."""
        top = self._upper + HEAD - 10
        painter.setClipRect(QRectF(GUTTER, top, self.width() - GUTTER, self._room + TAIL + 10))
        painter.translate(0, self._top)

    def _paint_bands(self, painter: QPainter, layout: Timeline) -> None:
        palette, scale = layout.palette, layout.scale
        left = max(GUTTER, scale.left - 1)
        right = min(self.width(), scale.right + 1)
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
            upper, lower = half_bands(line, BAND * layout.row_height)
            touched = palette.touched(edge)
            parts = [(upper, line if touched else lower, seen[0])]
            parts += [(line, lower, seen[1])] if touched else []
            painter.setPen(Qt.PenStyle.NoPen)
            for above, below, colours in parts:
                # The first and last column twice: a texture begins again where it ends.
                own = np.pad(colours[edge, inside], ((1, 1), (0, 0)), mode="edge")
                start = float(columns[inside[0]]) - wide
                painter.setBrush(paint.texture(own, start, float(wide)))
                painter.drawPolygon(paint.polygon(np.concatenate([above, below[::-1]])))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            chosen = palette.edge_ids[edge] in selected
            painter.setPen(paint.pen(style.BRIGHT if chosen else style.RIM, 1.8 if chosen else 0.8))
            painter.drawPolyline(paint.polygon(upper))
            painter.drawPolyline(paint.polygon(lower))
            if touched:
                painter.setPen(paint.pen(style.INK, 0.9))
                painter.drawPolyline(paint.polygon(line))
                middle = columns[inside] + wide / 2
                self._paint_ramp(painter, line, lower, middle, moved[edge, inside])

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
        painter.setPen(paint.pen(style.INK, 2.2))
        painter.drawPolyline(shape)
        painter.setPen(paint.pen(style.BRIGHT, 1.0))
        painter.drawPolyline(shape)

    def _paint_discs(self, painter: QPainter, layout: Timeline, discs: list[Disc]) -> None:
        self._into_rows(painter)
        shown = [d for d in discs if GUTTER - 30 < d.x < self.width() + 30]
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
        locks = set() if self.session.document is None else set(self.session.document.locks)
        for each in shown:
            if each.id in locks:
                paint.padlock(painter, each.x + each.radius, each.y + each.radius)
        font = paint.small_font(self, -1.5)
        painter.setFont(font)
        metrics = painter.fontMetrics()
        names = disc_names(
            shown,
            metrics.ascent(),
            lambda text: metrics.horizontalAdvance(text) + 4.0,
            layout.height + TAIL,
            collar=3.0,
        )
        for name in names:
            painter.setFont(paint.small_font(self, -1.5, bold=name.bright))
            colour = style.BRIGHT if name.bright else style.TEXT
            paint.label(painter, name.x, name.y, name.text, colour, style.PANEL)

    def _paint_ruler(self, painter: QPainter) -> None:
        painter.save()
        painter.fillRect(QRectF(0, 0, self.width(), RULER), QColor(theme.PAGE))
        painter.setClipRect(QRectF(GUTTER, 0, self.width() - GUTTER, RULER))
        scale, marks = self.scale, self.session.marks
        if marks is not None:
            left, right = (self.x_of(t) for t in marks)
            painter.fillRect(QRectF(left, RULER - 5, right - left, 5), QColor(style.RING))
        painter.setFont(paint.small_font(self, -1))
        for tick in scale.ticks(max(scale.left, GUTTER), min(scale.right, self.width())):
            x = self.x_of(tick)
            painter.setPen(paint.pen(style.GUIDE, 0.8))
            painter.drawLine(QPointF(x, RULER - 4), QPointF(x, RULER))
            paint.label(painter, x, RULER / 2 - 1, style.number(tick), style.TEXT)
        painter.restore()

    def _paint_strip(self, painter: QPainter) -> None:
        painter.save()
        box = QRectF(GUTTER, RULER, self.width() - GUTTER, STRIP)
        painter.fillRect(QRectF(0, RULER, self.width(), STRIP), QColor(theme.PIT))
        painter.setClipRect(box)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        self._ask_thumbnails()
        for frame, place in self.thumbnails():
            picture = self._thumbnail(frame)
            if picture is None:
                painter.setPen(paint.pen(theme.LINE, 0.8))
                painter.setBrush(QColor(theme.PAGE))
                painter.drawRect(place.adjusted(0.5, 0.5, -0.5, -0.5))
            else:
                painter.drawPixmap(place, picture, QRectF(picture.rect()))
        painter.restore()

    def thumbnails(self) -> list[tuple[int, QRectF]]:
        """Return the frames of the strip and their places."""
        clip = self.session.clip
        if clip is None or not clip.frames:
            return []
        tall = STRIP - 6
        wide = max(20.0, tall * clip.width / max(clip.height, 1))
        scale = self.scale
        left, right = scale.left - wide / 2, scale.right + wide / 2
        count = max(1, int((right - left) // (wide + 2)))
        each = (right - left) / count
        result = []
        first = max(0, int((GUTTER - left) // each))
        last = min(count, int((self.width() - left) // each) + 1)
        numbers = np.asarray(clip.frames)
        for k in range(first, last):
            middle = left + (k + 0.5) * each
            number = int(numbers[np.abs(numbers - float(scale.frame(middle))).argmin()])
            result.append((number, QRectF(middle - wide / 2, RULER + 3, wide, tall)))
        return result

    def _paint_lanes(self, painter: QPainter) -> None:
        """Draw the ranges of picks and holds: the fades as wedges, the frame as a diamond."""
        picks = self.lanes()
        if not picks:
            return
        painter.save()
        painter.setClipRect(QRectF(GUTTER, RULER + STRIP, self.width() - GUTTER, self._upper))
        for pick, lane in picks:
            y, half = self._lane_y(lane), LANE / 2 - 2
            begin, start, until, end = (self.x_of(t) for t in self.reach(pick))
            start, until = max(start, begin + 0.5), max(until, start + 1)
            shape = np.array(
                [
                    (begin, y),
                    (start, y - half),
                    (until, y - half),
                    (end, y),
                    (until, y + half),
                    (start, y + half),
                ]
            )
            chosen = pick.id in self.session.selection
            rim = paint.pen(style.BRIGHT if chosen else style.RING, 1.8 if chosen else 0.9)
            colour = on_screen(self.session, pick.rgb if pick.to is None else pick.to)
            painter.setBrush(paint.colour_of(colour))
            if not pick.enabled:
                rim.setDashPattern([3, 3])
                painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(rim)
            painter.drawPolygon(paint.polygon(shape))
            if pick.kind == "hold":  # a hold has a bar along it
                for grey, width in ((style.INK, 3.4), (style.BRIGHT, 1.4)):
                    painter.setPen(paint.pen(grey, width))
                    painter.drawLine(QPointF(start + 4, y), QPointF(until - 4, y))
            x = self.x_of(pick.frame)
            diamond = np.array([(x - 5, y), (x, y - 5), (x + 5, y), (x, y + 5)])
            painter.setPen(paint.pen(style.INK, 1.2))
            painter.setBrush(QColor(style.BRIGHT))
            painter.drawPolygon(paint.polygon(diamond))
        painter.restore()

    @property
    def settled(self) -> bool:
        """Whether all pictures of the frame strip are made."""
        key = (self.session.revision, self.session.looked)
        region, player = self._thumb_region(), self.session.player
        if player is None or region is None:
            return True
        return not self._making and all(
            frame in player.errors or (frame in self._thumbs and self._thumbs[frame][0] == key)
            for frame, _ in self.thumbnails()
        )

    def _ask_thumbnails(self) -> None:
        """Have the strip's frames read when the player has nothing else to do."""
        if self.session.player is not None and (region := self._thumb_region()) is not None:
            self.session.player.want_later([n for n, _ in self.thumbnails()], region)

    def _thumb_region(self) -> Region | None:
        clip = self.session.clip
        if clip is None:
            return None
        tall = min(clip.height, round((STRIP - 6) * self.devicePixelRatioF()))
        wide = max(1, round(tall * clip.width / max(clip.height, 1)))
        return Region(0, 0, clip.width, clip.height, wide, tall)

    def _thumbnail(self, frame: int) -> QPixmap | None:
        """Return a frame of the strip with the edits; a new one is made in a thread."""
        session, region = self.session, self._thumb_region()
        if session.player is None or session.clip is None or region is None:
            return None
        made = self._thumbs.get(frame)
        key = (session.revision, session.looked)
        if (made is None or made[0] != key) and not session.dragging and frame not in self._making:
            pixels = session.player.small(frame, region)
            if pixels is not None:
                self._making.add(frame)
                picture = thumbnail(session, frame, session.clip.premultiplied)
                THREAD.submit(self._make_thumbnail, frame, key, picture, pixels)
        return None if made is None else made[1]

    def _make_thumbnail(
        self, frame: int, key: object, picture: Callable[[F32], U8], pixels: F32
    ) -> None:
        """Make a frame of the strip; runs in a thread."""
        try:
            image = paint.image_of(picture(pixels))
        except Exception:  # the viewer says what is wrong with a frame
            image = QImage(1, 1, QImage.Format.Format_RGB888)
            image.fill(QColor(theme.PIT))

        def done() -> None:
            self._making.discard(frame)
            self._thumbs[frame] = key, QPixmap.fromImage(image)
            self.update()

        with contextlib.suppress(RuntimeError):  # the window is closed
            self.session.post(done)

    def _paint_gutter(self, painter: QPainter) -> None:
        found = self.timeline
        painter.fillRect(QRectF(0, RULER, GUTTER, self.height() - RULER), QColor(theme.PAGE))
        painter.setPen(paint.pen(theme.PIT, 1.0))
        painter.drawLine(QPointF(GUTTER, 0), QPointF(GUTTER, self.height()))
        painter.setFont(paint.small_font(self, -1))
        painter.setPen(QColor(theme.FAINT))
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        painter.drawText(QRectF(0, 0, GUTTER - 8, RULER), right, texts.FRAME)
        if found is None:
            return
        names: dict[int, list[str]] = {}
        for pick, lane in self.lanes():
            names.setdefault(lane, []).append(pick.id)
        for lane, ids in names.items():
            box = QRectF(4, self._lane_y(lane) - LANE, GUTTER - 12, 2 * LANE)
            text = painter.fontMetrics().elidedText(
                " ".join(ids), Qt.TextElideMode.ElideRight, int(box.width())
            )
            painter.drawText(box, right, text)
        layout, top = found[0], self._top
        palette, frame = layout.palette, float(self.session.frame)
        before, after = palette.sampled(np.array([frame]))
        seen = on_screen(self.session, np.stack([before[:, 0], after[:, 0]], axis=1))
        probe = self.session.probe
        weights = {} if probe is None else probe.weights
        caption = texts.WEIGHT if weights else ""
        painter.drawText(QRectF(0, self._upper, GUTTER - 8, HEAD), right, caption)
        x = self.x_of(frame)
        painter.setClipRect(QRectF(0, self._upper + HEAD - 6, GUTTER, self.height()))
        for edge, y in self._edges_at(layout, x):
            if np.isnan(before[edge, 0]).any():
                continue
            two = seen[edge]
            box = QRectF(8, y + top - 7, 14, 14)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(paint.colour_of(two[0]))
            painter.drawRect(box)
            painter.setBrush(paint.colour_of(two[1]))
            painter.drawRect(QRectF(box.left(), y + top, 14, 7))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(paint.pen(style.RIM, 1.0))
            painter.drawRect(box)
            if weights:
                self._paint_weight(painter, y + top, self._weight(palette, edge, weights))
        painter.setClipping(False)

    def _edges_at(self, layout: Timeline, x: float) -> list[tuple[int, float]]:
        """Return the edges at an x and the middles of their rows; one for each row."""
        chosen: dict[float, int] = {}
        for edge, (_, points) in layout.paths.items():
            if points[0, 0] - 1e-6 <= x <= points[-1, 0] + 1e-6:
                chosen[float(layout.edge_y[edge])] = edge
        return [(edge, y) for y, edge in chosen.items()]

    @staticmethod
    def _weight(palette: Palette, edge: int, weights: dict[str, float]) -> float:
        ids = [palette.edge_ids[edge], *(palette.ids[v] for v in palette.edges[edge])]
        return max((weights[id_] for id_ in ids if id_ in weights), default=0.0)

    def _paint_weight(self, painter: QPainter, y: float, weight: float) -> None:
        bar = QRectF(28, y + 3, (GUTTER - 36), 3)
        painter.fillRect(bar, QColor(theme.LINE))
        share = float(np.clip(weight, 0, 1))
        painter.fillRect(
            QRectF(bar.left(), bar.top(), bar.width() * share, 3), QColor(style.BRIGHT)
        )
        painter.setPen(QColor(style.BRIGHT if weight >= 0.005 else theme.FAINT))
        at = QRectF(26, y - 13, GUTTER - 34, 15)
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        painter.drawText(at, right, f"{weight:.0%}".replace("-", "−"))

    def _paint_pointer(self, painter: QPainter) -> None:
        """Draw what is under the pointer brighter, and the box of a selection."""
        found, top = self.timeline, self._top
        if found is not None and self.session.hover is not None:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setClipRect(
                QRectF(GUTTER, self._upper, self.width() - GUTTER, self._room + HEAD)
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
        if self._band is not None:
            painter.setPen(paint.pen(style.BRIGHT, 1.0, [3, 3]))
            painter.setBrush(QColor(255, 255, 255, 18))
            painter.drawRect(self._band)

    def _paint_playhead(self, painter: QPainter) -> None:
        x = self.x_of(self.session.frame)
        if not GUTTER <= x <= self.width():
            return
        painter.setPen(paint.pen(style.INK, 3.0))
        painter.drawLine(QPointF(x, RULER), QPointF(x, self.height() - FOOT))
        painter.setPen(paint.pen(style.BRIGHT, 1.0))
        painter.drawLine(QPointF(x, RULER), QPointF(x, self.height() - FOOT))
        painter.setFont(paint.small_font(self, -1, bold=True))
        text = style.number(self.session.frame)
        wide = painter.fontMetrics().horizontalAdvance(text) + 12
        left = min(max(x - wide / 2, GUTTER + 1), self.width() - wide - 1)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(style.BRIGHT))
        painter.drawRoundedRect(QRectF(left, 2, wide, RULER - 7), 3, 3)
        foot = [QPointF(x - 4, RULER - 5.5), QPointF(x + 4, RULER - 5.5), QPointF(x, RULER)]
        painter.drawPolygon(QPolygonF(foot))
        painter.setPen(QColor(style.INK))
        painter.drawText(QRectF(left, 2, wide, RULER - 7), Qt.AlignmentFlag.AlignCenter, text)

    def _paint_zoom_bar(self, painter: QPainter) -> None:
        top, wide = self.height() - FOOT, self.width() - GUTTER
        painter.fillRect(QRectF(0, top, self.width(), FOOT), QColor(theme.PAGE))
        first, last, _ = self.session.frames
        if self._span is None or last <= first:
            return
        start, end = (GUTTER + (t - first) / (last - first) * wide for t in self._span)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(style.GUIDE))
        painter.drawRoundedRect(QRectF(start, top + 3, max(end - start, 16), FOOT - 6), 3, 3)
