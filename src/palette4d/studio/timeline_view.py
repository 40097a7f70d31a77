"""The timeline: frames, tracks with their handles, the ranges of picks, and the playhead.

This is what the pointer and the keyboard do in it. `timeline_places` knows where things are,
`timeline_paint` draws them, `timeline_menu` makes the menus.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import (
    QContextMenuEvent,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QPaintEvent,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QToolTip, QWidget

from palette4d.plotting import style
from palette4d.studio import grade_steps, texts, theme
from palette4d.studio.frame_strip import FrameStrip
from palette4d.studio.menu_entries import TIMELINE_ACTIONS
from palette4d.studio.panel_menus import view_actions
from palette4d.studio.row_names import row_name
from palette4d.studio.session import Session
from palette4d.studio.session_events import Event
from palette4d.studio.timeline_menu import menu_for
from palette4d.studio.timeline_paint import TimelinePainter
from palette4d.studio.timeline_places import (
    FOOT,
    GUTTER,
    HEAD,
    LOWEST,
    RULER,
    STRIP,
    TAIL,
    Hit,
    Places,
)

#: A step of the zoom, and of the rows' height.
ZOOM, TALLER = 0.6, 1.4
#: With one of these a range's end changes the fade; many desktops keep Alt for themselves.
FADE_KEYS = Qt.KeyboardModifier.AltModifier | Qt.KeyboardModifier.ControlModifier
#: Pixels that the pointer moves before a press becomes a drag.
THRESHOLD = 3


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
    places : Places
        Where things are.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        """Listen to the session."""
        super().__init__(parent)
        self.session = session
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setAccessibleName(texts.TIMELINE)
        self.places = Places(session, lambda: (self.width(), self.height()))
        self.strip = FrameStrip(session, self.places, self._strip_changed)
        self.painter = TimelinePainter(self, session, self.places, self.strip)
        self._press: Press | None = None
        self.menu_actions = view_actions(
            self,
            TIMELINE_ACTIONS,
            {
                "zoom_in": lambda: self.zoom(ZOOM),
                "zoom_out": lambda: self.zoom(1 / ZOOM),
                "next_handle": lambda: self.step_handle(1),
                "previous_handle": lambda: self.step_handle(-1),
                "row_above": lambda: self.step_row(-1),
                "row_below": lambda: self.step_row(1),
                "stop_earlier": lambda: self.nudge(-1),
                "stop_later": lambda: self.nudge(1),
                "select_all": self.select_all,
                "show_all": self.show_all,
                "rows_taller": lambda: self.make_taller(TALLER),
                "rows_lower": lambda: self.make_taller(1 / TALLER),
            },
        )
        calls: tuple[tuple[Event, Callable[[], object]], ...] = (
            ("document", self._changed),
            ("clip", self._new_clip),
            ("frame", self._frame_moved),
            ("selection", self.update),
            ("hover", self.update),
            ("probe", lambda: self.update(0, RULER, GUTTER, self.height() - RULER - FOOT)),
            ("range", self.update),
            ("view", self.update),
            ("pixels", self._pixels_arrived),
        )
        for event, call in calls:
            session.on(event, call, panel=True, follows=lambda: self._press is not None)

    def sizeHint(self) -> QSize:
        """Return the size that shows a common palette whole."""
        return QSize(1100, RULER + STRIP + FOOT + int(HEAD + TAIL) + 8 * 30)

    def minimumSizeHint(self) -> QSize:
        """Return the least size: a few rows."""
        return QSize(360, RULER + FOOT + int(HEAD + TAIL) + 3 * int(LOWEST))

    @property
    def settled(self) -> bool:
        """Whether all that it draws is made."""
        return self.strip.settled

    # -------------------------------------------------------------------------------- what changes

    def _changed(self) -> None:
        places = self.places
        places.revision = self.session.revision
        first, last, _ = self.session.frames
        if places.zoomed is not None and not first <= places.zoomed[0] < places.zoomed[1] <= last:
            places.zoomed = None
        if self._press is None:
            places.dragged = None
        self.update()

    def _new_clip(self) -> None:
        self.strip.clear()
        self._changed()

    def _pixels_arrived(self) -> None:
        if not self.strip.settled:
            self.strip.changed()
            self._strip_changed()

    def _strip_changed(self) -> None:
        self.update(0, RULER, self.width(), self.places.strip)

    def _frame_moved(self) -> None:
        places = self.places
        start, end = places.span
        frame = float(self.session.frame)
        if places.zoomed is not None and not start <= frame <= end and self._press is None:
            wide = end - start
            places.show(frame - 0.1 * wide if frame > end else frame - 0.9 * wide, wide)
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the frames that are shown."""
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the timeline."""
        self.strip.ratio = self.devicePixelRatioF()
        self.painter.paint(event.rect())

    # -------------------------------------------------------------------------------- zoom and pan

    def zoom(self, factor: float, at: float | None = None) -> None:
        """Show `factor` times as many frames; the frame at x (default: the playhead) stays."""
        self.places.zoom(factor, at)
        self.update()

    def show_all(self) -> None:
        """Show the whole clip."""
        self.places.show_all()
        self.update()

    def make_taller(self, factor: float) -> None:
        """Make rows so many times as high: their colours and ramps are seen better."""
        self.places.make_taller(factor)
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom over the ruler or with Ctrl, pan with Shift, else scroll the rows.

        With Alt, make rows taller or lower.
        """
        turn = event.angleDelta()
        steps, sideways = turn.y() / 120, turn.x() / 120
        keys, at = event.modifiers(), event.position()
        start, end = self.places.span
        zooms = keys & Qt.KeyboardModifier.ControlModifier or at.y() < RULER + self.places.strip
        if keys & Qt.KeyboardModifier.AltModifier:  # some systems turn the wheel sideways then
            self.make_taller(TALLER ** ((steps + sideways) / 2))
        elif keys & Qt.KeyboardModifier.ShiftModifier or sideways:
            self.places.show(start - (steps + sideways) * 0.1 * (end - start), end - start)
        elif zooms or not self.places.hidden:
            self.zoom(0.85**steps, at.x())
        else:
            self.places.scroll -= steps * 30
            self.update()
        event.accept()

    # -------------------------------------------------------------------------------------- mouse

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Select, or begin a drag."""
        at = event.position()
        hit = self.places.hit(at)
        self._press = Press(hit, at, self.places.scroll, self.places.span[0], button=event.button())
        if event.button() != Qt.MouseButton.LeftButton:
            return
        self.session.hover_over(None)  # what is dragged is seen in the picture, without a matte
        add = bool(
            event.modifiers()
            & (Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
        )
        if hit.what == "ruler":
            self.session.go(self.places.frame_at(at.x()))
        elif hit.what == "zoom":
            self._drag_zoom_bar(at.x())
        elif hit.what == "scroll":
            self._drag_scroll_bar(at.y())
        elif hit.id:
            held = hit.grip and hit.id in self.session.selection  # a fade is dragged with Ctrl
            self._select(hit.id, add and not held)
            if hit.what == "disc" and (disc := self.places.disc(hit.id)) is not None:
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

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag, or tell what is under the pointer."""
        at, press = event.position(), self._press
        if self.session.waived:
            self._press = press = self.painter.box = self.painter.told = self.places.dragged = None
            self.update()
        if press is None:
            self._hover(at)
            return
        if not press.moved and (at - press.at).manhattanLength() < THRESHOLD:
            return
        press.moved = True
        if press.button == Qt.MouseButton.MiddleButton:
            start, end = self.places.span
            away = (press.at.x() - at.x()) / self.places.scale.per_frame
            self.places.scroll = press.scroll + press.at.y() - at.y()
            self.places.show(press.first + away, end - start)
        elif press.button != Qt.MouseButton.LeftButton:
            return
        elif press.hit.what == "ruler":
            self.session.go(self.places.frame_at(at.x()))
        elif press.hit.what == "zoom":
            self._drag_zoom_bar(at.x())
        elif press.hit.what == "scroll":
            self._drag_scroll_bar(at.y())
        elif press.hit.stop:
            free = bool(event.modifiers() & Qt.KeyboardModifier.AltModifier)
            self._drag_stop(press.hit.id, at.x() - press.grab, snap=not free)
        elif press.hit.grip:
            self._drag_range(press.hit, at.x(), fade=bool(event.modifiers() & FADE_KEYS))
        elif press.hit.what == "ground":
            self.painter.box = QRectF(press.at, at).normalized()
            self._select_in(self.painter.box)
        self.update()

    def _drag_zoom_bar(self, x: float) -> None:
        first, last, _ = self.session.frames
        start, end = self.places.span
        middle = first + (x - GUTTER) / max(self.width() - GUTTER, 1) * (last - first)
        self.places.show(middle - (end - start) / 2, end - start)

    def _drag_scroll_bar(self, y: float) -> None:
        places = self.places
        share = (y - places.upper) / max(self.height() - FOOT - places.upper, 1)
        places.scroll = share * (places.room + places.hidden) - places.room / 2
        self.update()

    def _drag_stop(self, id_: str, x: float, *, snap: bool) -> None:
        frame = self.places.place_for(id_, self.places.frame_at(x, snap=snap))
        if frame is not None:
            self._tell(x, frame)
            grade_steps.move_stop(self.session, id_, frame, dragging=True)

    def _tell(self, x: float, frame: float) -> None:
        """Say a frame's number beside the pointer."""
        press = self._press
        if press is not None:
            text = texts.AT_FRAME.format(frame=style.number(frame))
            self.painter.told = QPointF(x, press.at.y()), text

    def _drag_range(self, hit: Hit, x: float, *, fade: bool) -> None:
        """Drag an end of a range, or of its fades."""
        pick = next((pick for pick, _ in self.places.lanes() if pick.id == hit.id), None)
        if pick is None:
            return
        self.places.dragged = None  # one end, or its fade: not what was dragged before Ctrl
        _, start, until, _ = self.places.reach(pick)
        frame = self.places.frame_at(x)
        first = hit.grip in ("start", "fade in")
        fades = list(pick.fades)
        wide = max(start - frame if first else frame - until, 0.0)
        fades_alone = fade or hit.grip.startswith("fade")
        if fades_alone:
            fades[0 if first else 1] = wide
        elif first:
            start = min(frame, until)
        else:
            until = max(frame, start)
        self._tell_range(None if fades_alone else start if first else until, x, wide)
        self.places.dragged = (hit.id, start, until, fades[0], fades[1])
        self.update()

    def _tell_range(self, end: float | None, x: float, wide: float) -> None:
        """Say what an end of a range becomes, or (None) how long the fade is."""
        self._tell(x, wide if end is None else end)
        if self.painter.told is not None and end is None:
            text = texts.FADE_OF.format(frames=style.number(wide))
            self.painter.told = self.painter.told[0], text

    def _keep_range(self) -> None:
        """Give the pick the range or the fade that was dragged."""
        if self.places.dragged is None:
            return
        id_, start, until, *fades = self.places.dragged
        pick = next((pick for pick, _ in self.places.lanes() if pick.id == id_), None)
        if pick is not None and tuple(fades) != pick.fades:
            grade_steps.set_fades(self.session, id_, fades[0], fades[1])
        elif pick is not None:
            grade_steps.set_range(self.session, id_, start, until)

    def _select_in(self, box: QRectF) -> None:
        found, top = self.places.timeline, self.places.top
        if found is not None:
            ids = [d.id for d in found[1] if box.contains(QPointF(d.x, d.y + top))]
            self.session.select(*ids)

    def _hover(self, at: QPointF) -> None:
        hit = self.places.hit(at)
        self.session.hover_over(hit.id or None)
        shape = Qt.CursorShape.ArrowCursor
        if hit.stop or hit.grip:
            shape = Qt.CursorShape.SizeHorCursor
        elif hit.what in ("disc", "band", "pick"):
            shape = Qt.CursorShape.PointingHandCursor
        self.setCursor(shape)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a drag."""
        press, self._press, self.painter.box = self._press, None, None
        self.painter.told = None
        if self.session.waived:
            press = self.places.dragged = None
        if press is not None and press.hit.grip and press.moved:
            self._keep_range()
        if press is not None and press.hit.stop and press.moved:
            self.session.drop()
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Add a stop to a row, or go to a handle's frame."""
        if event.button() != Qt.MouseButton.LeftButton:
            return
        hit = self.places.hit(event.position())
        if hit.what == "band":
            self.add_stop(hit.id, self.places.frame_at(event.position().x()))
        elif hit.what == "disc" and (disc := self.places.disc(hit.id)) is not None:
            self.session.go(disc.frame)

    def leaveEvent(self, event: QEvent) -> None:
        """Nothing is under the pointer."""
        self.session.hover_over(None)

    def event(self, event: QEvent) -> bool:
        """Show a tip about what is under the pointer."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            tip = self.tip(self.places.hit(QPointF(event.pos())))
            if tip:
                QToolTip.showText(event.globalPos(), theme.plain(tip), self)
            else:
                QToolTip.hideText()
            return True
        return super().event(event)

    def tip(self, hit: Hit) -> str:
        """Return what a tip says."""
        disc = self.places.disc(hit.id) if hit.what == "disc" else None
        if disc is not None:
            before, after = (
                " ".join(f"{v:.3f}" for v in colour) for colour in (disc.before, disc.after)
            )
            kind = texts.STOP if disc.kind == "stop" else texts.VERTEX
            line = f"{kind} {disc.id}: {self._called(disc.id)}\n{before}"
            return line if before == after else f"{line} → {after}"
        if hit.what == "band":
            name = row_name(self.session.document, hit.id)
            return f"{name}: {self._called(hit.id)}\n{texts.ROW_TIP}"
        for pick, _ in self.places.lanes() if hit.what == "pick" else ():
            if pick.id == hit.id:
                return f"{pick.id}: {grade_steps.pick_tip(self.session, pick)}"
        return ""

    def _called(self, id_: str) -> str:
        document = self.session.document
        return "" if document is None else document.grade.called(id_)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Show the menu of what is under the pointer."""
        at = QPointF(event.pos())
        if event.reason() == QContextMenuEvent.Reason.Keyboard and self.session.selection:
            at = self.places.point_of(self.session.selection[0]) or at
        menu_for(self, self.places.hit(at), at.x()).exec(self.mapToGlobal(at.toPoint()))
        self._press = None

    # --------------------------------------------------------------------------------------- stops

    def add_stop(self, edge: str, frame: float) -> None:
        """Add a stop of the colour that the edge has at a frame."""
        content = self.places.content
        if content is None or edge not in content.edge_ids:
            return
        index = content.edge_ids.index(edge)
        start, end = content.frames[list(content.edges[index])]
        if not start < frame < end:
            self.session.say(
                texts.NO_STOP_HERE.format(row=row_name(self.session.document, edge)), "warning"
            )
            return
        rgb = content.colours(index, np.array([frame]), edited=True)[0].tolist()
        text = texts.STOP_ADDED.format(
            row=row_name(self.session.document, edge), frame=style.number(frame)
        )
        made = self.session.edit(lambda document: document.stop(edge, frame=frame, rgb=rgb), text)
        if made is not None:
            self.session.select(made)
            self.session.go(frame)  # the picture shows what its colour does

    def add_stop_at_playhead(self) -> None:
        """Add a stop to the selected row at the playhead."""
        content = self.places.content
        row = self.places.selected_row()
        if content is None or row is None:
            self.session.say(texts.SELECT_A_ROW, "warning")
            return
        for edge in self.places.edges_of_row(row):
            start, end = content.frames[list(content.edges[edge])]
            if start < self.session.frame < end:
                self.add_stop(content.edge_ids[edge], float(self.session.frame))
                return
        selected = row_name(self.session.document, self.session.selection[0])
        self.session.say(texts.NO_STOP_HERE.format(row=selected), "warning")

    # -------------------------------------------------------------------------------- the keyboard

    def select_all(self) -> None:
        """Select all handles."""
        found = self.places.timeline
        if found is not None:
            self.session.select(*(disc.id for disc in found[1]))

    def step_handle(self, by: int) -> bool:
        """Select the next handle, row by row; return whether there is one."""
        found = self.places.timeline
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
        found = self.places.timeline
        if found is None:
            return
        row = self.places.selected_row()
        count = found[0].rows.count
        start = (row + by) if row is not None else (0 if by > 0 else count - 1)
        for there in range(start, count if by > 0 else -1, by):
            edge = self.places.edge_now((there + 0.5) * found[0].row_height)
            if edge is not None:
                self.session.select(found[0].palette.edge_ids[edge])
                return

    def nudge(self, by: int) -> None:
        """Move the selected stop by frames."""
        content = self.places.content
        stops = {} if content is None else {stop[0]: stop[2] for stop in content.stops}
        for id_ in self.session.selection:
            if id_ not in stops:
                continue
            frame = self.places.place_for(
                id_, float(round(stops[id_]) + by * self.session.frames[2])
            )
            if frame is not None and frame != stops[id_]:
                grade_steps.move_stop(self.session, id_, frame)

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Tab goes through the handles, and then to the next panel."""
        return self.step_handle(1 if forward else -1) or super().focusNextPrevChild(forward)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape stops a drag, or selects nothing."""
        if event.key() == Qt.Key.Key_Escape:
            if self.session.dragging or self.session.held:
                self.session.cancel()
            else:
                self.session.select()
            return
        super().keyPressEvent(event)
