"""The viewer: the frame before and after the edits, with probe, mattes, picks and holds."""

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import (
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPaintEvent,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QWidget

from palette4d.grade.picks import Area
from palette4d.studio import texts
from palette4d.studio.paint import image_of
from palette4d.studio.pixels import of_palette, place_between, probe_at, proxy_of
from palette4d.studio.player import Region
from palette4d.studio.preview import NO_PIXELS, Grade, Picture, Preview, Request
from palette4d.studio.session import Session
from palette4d.studio.states import Place
from palette4d.studio.viewer_cross import Cross
from palette4d.studio.viewer_paint import ViewerPainter, hatched
from palette4d.studio.viewer_window import WindowHandles

#: Pixels of the screen within which the pointer takes the wipe's line, and a press is a click.
NEAR_WIPE, CLICK = 6, 4
ZOOM_STEP, LEAST_ZOOM, MOST_ZOOM = 1.25, 0.02, 64.0
#: A click with one of these holds; many desktops keep Alt for themselves.
HOLD_KEYS = Qt.KeyboardModifier.AltModifier | Qt.KeyboardModifier.ControlModifier
#: Half of the brush's width, its limits in pixels of the widget, and the step of the wheel.
BRUSH, LEAST_BRUSH, MOST_BRUSH, BRUSH_STEP = 10.0, 2.0, 200.0, 1.2
#: The probe stands within so many pixels of the lower rim.
PROBE_HEIGHT = 200
#: Frames that are read around the playhead, when it has rested for so many milliseconds.
AHEAD, BEHIND, REST = 6, 2, 80
#: Milliseconds after which the picture of another frame says so.
PATIENCE = 250

F32 = NDArray[np.float32]


class Viewer(QWidget):
    """Draws the picture, and translates what the pointer does over it."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        """Listen to the session."""
        super().__init__(parent)
        self.session = session
        self.setMinimumSize(QSize(320, 180))
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setAccessibleName(texts.VIEWER)
        self.cross, self.handles = Cross(self), WindowHandles(self)
        self.painter = ViewerPainter(self)
        self.preview = Preview(lambda picture: session.post(lambda: self._arrived(picture)))
        self.zoom: float | None = None  #: pixels of the screen for one of the frame; None: fitted
        self.centre = QPointF()  #: the frame's point in the middle
        self.picture: Picture | None = None
        self.images: dict[str, QImage] = {}
        self.shown_frame: int | None = None
        self.problem = ""
        self.comparing = False  #: the key of hold-to-compare is down
        self._before: tuple[Any, ...] = ()
        self._clips = 0  # how many were opened
        self.press: QPointF | None = None
        self.doing = ""
        self._pan_from = QPointF()
        self.pointer: QPointF | None = None
        self.shows_brush = False  #: the pointer is a brush
        #: a click or a box before its frame is read: the frame, two pixels, and whether it holds
        self._clicked: tuple[int, tuple[int, int], tuple[int, int], bool] | None = None
        self._lacks = False  #: the frame's pixels were wanted, and not there
        self._patience = QTimer(self)  #: while it runs, the picture of another frame may stay
        self._patience.setSingleShot(True)
        self._patience.timeout.connect(self.update)
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.timeout.connect(self._read_around)
        self.on_pick: Any = None  #: called with a Place for a click or a box
        self.on_hold: Any = None  #: the same with Alt
        self.on_picked: Any = None  #: called after a pick by keys alone
        self.on_area: Any = None  #: called with an Area for a stroke
        self.brush = BRUSH  #: half of its width, in pixels of the widget
        self.stroke: list[tuple[int, int]] = []  #: the frame's pixels that a stroke is drawn along
        session.on("clip", self._clip_changed)
        session.on("document", self.refresh)
        session.on("document", self._probe_again)
        session.on("playing", self.refresh)
        session.on("frame", self.read_frame)
        session.on("pixels", self._pixels_arrived)
        session.on("view", self.refresh)
        session.on("hover", self.refresh)
        session.on("selection", self.refresh)
        session.on("draft", self.refresh)
        for event in ("wipe", "answer", "tool"):
            session.on(event, self.update)

    # ---------------------------------------------------------------------------- what is shown

    @property
    def sides(self) -> tuple[str, ...]:
        """What is drawn: "before", "after" or both."""
        compare = "before" if self.comparing else self.session.view.compare
        return ("before", "after") if compare in ("wipe", "side") else (compare,)

    @property
    def current(self) -> bool:
        """Whether the picture of now is shown; it may be coarse."""
        picture, session = self.picture, self.session
        return (
            picture is not None
            and picture.request.frame == session.frame
            and picture.request.revision == session.revision
        )

    @property
    def late(self) -> bool:
        """Whether the picture has been that of another frame for some time."""
        there = self.session.playing or self.shown_frame == self.session.frame
        return not there and not self._patience.isActive()

    def _clip_changed(self) -> None:
        self.picture, self.images, self.shown_frame, self.problem = None, {}, None, ""
        self.zoom, self._clicked = None, None
        self._clips += 1
        self.preview.forget()
        self.read_frame()

    def read_frame(self) -> None:
        """Read the frame and its neighbours, and show it."""
        session = self.session
        if session.player is None:
            self.update()
            return
        if not session.playing:
            # Its neighbours are read when the playhead rests.
            self._resting.stop()
            if not self._patience.isActive():
                self._patience.start(PATIENCE)
            session.player.want([session.frame])
            self.refresh()
        self._probe_again()

    def _read_around(self) -> None:
        """Read the frames around the playhead."""
        if self.session.player is not None and not self.session.playing:
            self.session.player.want(frames_around(self.session))

    def _pixels_arrived(self) -> None:
        """Show the frame, unless another frame's pixels have arrived."""
        if self._lacks or self.shown_frame != self.session.frame or self.session.playing:
            self.refresh()
            self._probe_again()
        self._do_click()

    def refresh(self) -> None:
        """Ask for the picture of now; while playing, the playback chooses the pictures."""
        if self.session.playing:
            self.update()
            return
        request = self.request()
        self._lacks = request is None
        if request is not None:
            self.problem = ""
            self.preview.ask(request)
            # What would be drawn now is the picture of before.
            if self.session.dragging or self.shown_frame != self.session.frame:
                return
        elif self.session.player is not None:
            player, frame = self.session.player, self.session.frame
            missing = texts.NO_FRAME.format(frame=frame)
            self.problem = player.errors.get(frame, "" if frame in player.numbers else missing)
        self.update()

    def request(self) -> Request | None:
        """Return what is to be shown now; None while the frame is not read."""
        session, region = self.session, self.region()
        if session.player is None or region is None:
            return None
        pixels = session.player.frame(session.frame)
        if pixels is None:
            return None
        moving = session.dragging or self.doing == "pan"
        return self._request_of(
            session.frame,
            region,
            pixels,
            settled=not moving,
            matte=session.shown_matte,
            pick_matte=session.pick_matte(session.shown_matte),
            outside=session.view.outside,
        )

    def film(self, frame: int) -> Request | None:
        """Return the request for a frame to play; its pixels are taken when it is developed."""
        region = self.region()
        if region is None:
            return None
        return self._request_of(frame, region, NO_PIXELS, settled=False, scaled=True)

    def film_key(self, frame: int, region: Region | None) -> tuple[Any, ...]:
        """Return `Request.key` of the request for a frame to play in `region()`."""
        session = self.session
        sides = frozenset(self.sides)
        before = self._before_key()
        return self._clips, frame, region, session.looked, sides, before, session.revision

    def _before_key(self) -> str:
        view = self.session.view
        if not view.version and not view.after:
            return ""
        return f"{view.version}\n{view.after}\n{self.session.revision}"

    def with_pixels(self, request: Request) -> Request | None:
        """Return a request to play with its pixels; None if they are gone."""
        player = self.session.player
        small = None if player is None else player.small(request.frame, request.region.coarse)
        return None if small is None else dataclasses.replace(request, pixels=small)

    def _request_of(self, frame: int, region: Region, pixels: F32, **more: Any) -> Request:
        session, view = self.session, self.session.view
        revision = session.revision  # first: another thread may make pictures to play
        document = session.document
        assert session.clip is not None
        assert session.display is not None
        grade = None if document is None else Grade.shown(document, view.after, frame)
        before = None
        if view.version and document is not None:
            before = Grade.of_version(document, view.version, frame)
        return Request(
            clip=self._clips,
            frame=frame,
            pixels=pixels,
            premultiplied=session.clip.premultiplied,
            grade=grade,
            before=before,
            region=region,
            display=session.display,
            look=session.looked,
            against=self._before_key(),
            revision=revision,
            sides=frozenset(self.sides),
            proxy=proxy_of(session),
            **more,
        )

    def show_picture(self, picture: Picture) -> None:
        """Show a picture that was made to play."""
        self._take(picture)

    def _arrived(self, picture: Picture) -> None:
        if picture.request.clip != self._clips:
            return
        if picture.error:
            self.problem = picture.error
            self.session.say(picture.error, "error")
            self.update()
            return
        session = self.session
        if session.clip is None or session.playing or session.player is None:
            return
        shown = None if self.picture is None else self.picture.request
        if shown is not None and shown.revision > picture.request.revision:
            return  # late, of an older drag
        self._take(picture)
        if picture.exact:
            self._resting.start(REST)

    def _take(self, picture: Picture) -> None:
        self.picture, self.shown_frame = picture, picture.request.frame
        for side in ("before", "after"):
            pixels = getattr(picture, side)
            if pixels is not None:
                self.images[side] = image_of(pixels)
            else:
                self.images.pop(side, None)
        if picture.outside is not None:
            self.images["outside"] = hatched(picture.outside)
        else:
            self.images.pop("outside", None)
        self.update()
        self.session.emit("picture")

    # ------------------------------------------------------------------------------- where it is

    def panes(self) -> list[tuple[str, QRectF]]:
        """Return the sides and their parts of the widget."""
        width, height = float(self.width()), float(self.height())
        if self.session.view.compare == "side" and not self.comparing:
            half = (width - 2) / 2
            return [
                ("before", QRectF(0, 0, half, height)),
                ("after", QRectF(half + 2, 0, half, height)),
            ]
        return [(self.sides[-1], QRectF(0, 0, width, height))]

    def scale(self) -> float:
        """Return the widget's pixels for one pixel of the frame."""
        clip = self.session.clip
        if clip is None:
            return 1.0
        if self.zoom is not None:
            return self.zoom / self.devicePixelRatioF()
        pane = self.panes()[0][1]
        return max(min(pane.width() / clip.width, pane.height() / clip.height), 1e-4)

    def origin(self, pane: QRectF) -> QPointF:
        """Return where the frame's upper left corner lies in the widget."""
        clip, scale = self.session.clip, self.scale()
        assert clip is not None
        centre = QPointF(clip.width / 2, clip.height / 2) if self.zoom is None else self.centre
        return pane.center() - centre * scale

    def region(self) -> Region | None:
        """Return the visible part of the frame, and the size that it is computed at."""
        clip = self.session.clip
        if clip is None or self.width() < 2:
            return None
        pane = self.panes()[0][1]
        origin, scale = self.origin(pane), self.scale()
        left = max(0, math.floor((pane.left() - origin.x()) / scale))
        top = max(0, math.floor((pane.top() - origin.y()) / scale))
        right = min(clip.width, math.ceil((pane.right() - origin.x()) / scale))
        bottom = min(clip.height, math.ceil((pane.bottom() - origin.y()) / scale))
        if right <= left or bottom <= top:
            return None
        dense = min(1.0, scale * self.devicePixelRatioF())
        width = max(1, round((right - left) * dense))
        height = max(1, round((bottom - top) * dense))
        return Region(left, top, right, bottom, width, height)

    def wipe_x(self) -> float:
        """Return the x of the wipe."""
        pane = self.panes()[0][1]
        clip = self.session.clip
        assert clip is not None
        left = self.origin(pane).x()
        x = left + self.session.view.wipe * clip.width * self.scale()
        return min(max(x, pane.left()), pane.right())

    def pixel_at(self, point: QPointF) -> tuple[int, int] | None:
        """Return the frame's pixel at a point of the widget."""
        clip = self.session.clip
        if clip is None:
            return None
        for _, pane in self.panes():
            if pane.contains(point):
                at = (point - self.origin(pane)) / self.scale()
                x, y = math.floor(at.x()), math.floor(at.y())
                if 0 <= x < clip.width and 0 <= y < clip.height:
                    return x, y
        return None

    def point_of(self, x: float, y: float) -> QPointF:
        """Return the widget's point of a point of the frame, in the last pane."""
        return self.origin(self.panes()[-1][1]) + QPointF(x, y) * self.scale()

    def own_point(self, x: float, y: float) -> QPointF:
        """Return the widget's point of a point of the palette's clip, of which a proxy is shown."""
        across, down = proxy_of(self.session)
        return self.point_of(x * across, y * down)

    @property
    def own_scale(self) -> float:
        """Pixels of the widget for one of the palette's clip."""
        return self.scale() * proxy_of(self.session)[0]

    def fit(self) -> None:
        """Show the whole frame."""
        self.zoom = None
        self.refresh()

    def zoom_to(self, zoom: float, at: QPointF | None = None) -> None:
        """Zoom, 1 is a pixel of the screen for each of the frame, and keep the point `at`."""
        if self.session.clip is None:
            return
        pane = self.panes()[0][1]
        for _, other in self.panes():
            if at is not None and other.contains(at):
                pane = other
        at = pane.center() if at is None else at
        fixed = (at - self.origin(pane)) / self.scale()
        self.zoom = min(max(zoom, LEAST_ZOOM), MOST_ZOOM)
        self.centre = fixed - (at - pane.center()) / self.scale()
        self.refresh()

    def zoom_by(self, factor: float, at: QPointF | None = None) -> None:
        """Zoom in or out."""
        self.zoom_to(self.scale() * self.devicePixelRatioF() * factor, at)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw all."""
        self.painter.paint()

    # ------------------------------------------------------------------------------------ gestures

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a pan, a wipe, a drag of a window, or a pick."""
        self.press, point = event.position(), event.position()
        if event.button() == Qt.MouseButton.MiddleButton:
            self.doing, self._pan_from = "pan", QPointF(self._middle())
        elif event.button() == Qt.MouseButton.LeftButton:
            if self._over_wipe(point):
                self.doing = "wipe"
            elif (grip := self.handles.grip_at(point, event.modifiers())) is not None:
                self.doing = "handle"
                self.handles.press(point, grip)
            elif (at := self.pixel_at(point)) is not None and self.brushing(event.modifiers()):
                self.doing, self.stroke = "stroke", [of_palette(self.session, *at)]
                self.update()
            elif event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
                self.doing, self._pan_from = "pan", QPointF(self._middle())
            elif at is not None:
                self.doing = "pick"

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Go on with what the button does; else probe."""
        point = self.pointer = event.position()
        if self.session.waived and self.doing:
            self._waive()
        self.cross.hide_for_pointer()
        if self.doing == "pan" and self.press is not None:
            if self.zoom is None:
                self.zoom = self.scale() * self.devicePixelRatioF()
            self.centre = self._pan_from - (point - self.press) / self.scale()
            self.refresh()
        elif self.doing == "wipe":
            clip = self.session.clip
            assert clip is not None
            left = self.origin(self.panes()[0][1]).x()
            at = (point.x() - left) / (clip.width * self.scale())
            self.session.look(wipe=min(max(at, 0.0), 1.0))
        elif self.doing == "stroke":
            self._draw_to(point)
        elif self.doing == "window":
            self.handles.drag_to(point)
        elif self.doing in ("pick", "box", "handle") and self.press is not None:
            moved = point - self.press
            if max(abs(moved.x()), abs(moved.y())) > CLICK:
                self.doing = "window" if self.doing == "handle" else "box"
            if self.doing == "window":
                self.handles.drag_to(point)
            self.update()
        else:
            before, self.shows_brush = self.shows_brush, self.brushing(event.modifiers())
            if before or self.shows_brush:
                self.update()
            over = self._over_wipe(point)
            shape = Qt.CursorShape.SplitHCursor if over else Qt.CursorShape.CrossCursor
            shape = shape if self.pixel_at(point) or over else Qt.CursorShape.ArrowCursor
            handle = None if over else self.handles.shape_at(point, event.modifiers())
            self.setCursor(shape if handle is None else handle)
        self._probe(point)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a pan or a drag of a window; make a pick or a hold."""
        if self.session.waived:
            self._waive()
        doing, press, self.doing, self.press = self.doing, self.press, "", None
        if doing == "pan":
            self.refresh()
        if doing == "stroke":
            points, self.stroke = self.stroke, []
            drawn = tuple((float(x), float(y)) for x, y in points)
            if self.on_area is not None:
                self.on_area(Area(self.session.frame, drawn, self.stroke_radius))
        if doing == "window":
            self.handles.let_go()
        if doing in ("pick", "box", "handle") and press is not None:
            hold = event.modifiers() & HOLD_KEYS or self.session.tool == "hold"
            self._click(press, event.position() if doing == "box" else press, hold=bool(hold))
        self.update()

    def _waive(self) -> None:
        """Forget what the button does."""
        self.doing, self.press, self.stroke = "", None, []
        self.update()

    def _click(self, start: QPointF, end: QPointF, *, hold: bool) -> None:
        """Pick or hold what was clicked; a click that comes before its frame is read is kept."""
        first, last = self.pixel_at(start), self.pixel_at(end) or self.pixel_at(start)
        if first is not None and last is not None:
            self._clicked = self.session.frame, first, last, hold
            self._do_click()

    def _do_click(self) -> None:
        """Do the click that is kept, if its frame is there."""
        session, clicked = self.session, self._clicked
        if clicked is None or session.player is None:
            return
        frame, first, last, hold = clicked
        waits = frame == session.frame and frame not in session.player.errors
        if waits and session.player.frame(frame) is None:
            session.say(texts.READING)
            return
        self._clicked = None
        place = place_between(session, first, last) if waits else None
        act = self.on_hold if hold else self.on_pick
        if place is not None and act is not None:
            act(place)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """A second click is a click."""
        self.mousePressEvent(event)

    def leaveEvent(self, event: QEvent) -> None:
        """Stop probing."""
        self.pointer, self.shows_brush = None, False
        self.session.show_probe(None)
        self.cross.show()
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom at the pointer; with Shift, change the brush's size."""
        turn = event.angleDelta()
        turns = (turn.y() or turn.x()) / 120  # some systems turn the wheel sideways with Shift
        shift = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        if turns and shift and self.brushing(event.modifiers()):
            self.brush = min(max(self.brush * BRUSH_STEP**turns, LEAST_BRUSH), MOST_BRUSH)
            self.shows_brush = True
            self.update()
        elif turns:
            self.zoom_by(ZOOM_STEP**turns, event.position())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the cross; pass every other key on: the menus have them."""
        enters = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        if self.cross.takes(event):
            if enters and self.cross.at is None:
                self.cross.switch()
            else:
                self.cross.press(event)
        else:
            event.ignore()

    def event(self, event: QEvent) -> bool:
        """Have the keys of the cross before the menus while it is seen."""
        override = event.type() == QEvent.Type.ShortcutOverride
        if override and isinstance(event, QKeyEvent) and self.cross.takes(event):
            event.accept()
            return True
        return super().event(event)

    def point_at(self, point: QPointF) -> None:
        """Probe a point, as if the pointer were there."""
        self.pointer = point
        self._probe(point)
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Ask for a picture of the new size."""
        self.refresh()

    # ------------------------------------------------------------------------------------- strokes

    def brushing(self, keys: Qt.KeyboardModifier) -> bool:
        """Return whether a drag adds to the selected pick."""
        shift = bool(keys & Qt.KeyboardModifier.ShiftModifier)
        return self.session.picked is not None and (shift or self.session.tool == "add")

    @property
    def stroke_radius(self) -> float:
        """Half of the brush's width in pixels of the palette's clip; the width is whole."""
        return max(1, round(2 * self.brush / self.own_scale)) / 2

    def _draw_to(self, point: QPointF) -> None:
        """Draw the stroke on; points nearer than a third of the brush are left out."""
        at = self.pixel_at(point)
        if at is not None:
            at = of_palette(self.session, *at)
            away = math.hypot(at[0] - self.stroke[-1][0], at[1] - self.stroke[-1][1])
            if away >= max(1.0, self.stroke_radius / 3):
                self.stroke.append(at)
        self.update()

    def hold_to_compare(self, down: bool) -> None:
        """Show the picture before while a key is down."""
        if down != self.comparing:
            self.comparing = down
            self.refresh()

    def _middle(self) -> QPointF:
        clip = self.session.clip
        if self.zoom is None and clip is not None:
            self.centre = QPointF(clip.width / 2, clip.height / 2)
        return self.centre

    def _over_wipe(self, point: QPointF) -> bool:
        view = self.session.view
        if view.compare != "wipe" or self.session.clip is None or self.comparing:
            return False
        return abs(point.x() - self.wipe_x()) <= NEAR_WIPE

    def place(self, start: QPointF, end: QPointF) -> Place | None:
        """Return the pixel or the box between two points of the widget, with its main colour."""
        first, last = self.pixel_at(start), self.pixel_at(end) or self.pixel_at(start)
        return None if first is None or last is None else place_between(self.session, first, last)

    def _probe_again(self) -> None:
        """Probe the same pixel of another frame or grade."""
        if self.pointer is not None:
            self._probe(self.pointer)

    def _probe(self, point: QPointF) -> None:
        at = self.pixel_at(point)
        self.session.show_probe(None if at is None else probe_at(self.session, *at))
        self.update(0, self.height() - PROBE_HEIGHT, self.width(), PROBE_HEIGHT)


def frames_around(session: Session) -> list[int]:
    """Return the frames to read, the playhead's first, as many as can be kept with it."""
    assert session.clip is not None
    assert session.player is not None
    _, _, step = session.frames
    # Movies are decoded forwards; going back takes long.
    behind = 0 if session.clip.is_movie else BEHIND
    offsets = [0, *range(1, AHEAD + 1), *range(-1, -behind - 1, -1)]
    frames = [session.frame + offset * step for offset in offsets]
    known = [frame for frame in frames if frame in session.player.numbers]
    return known[: session.player.room]
