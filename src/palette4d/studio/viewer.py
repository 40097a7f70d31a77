"""The viewer: the frame before and after the edits, with probe, mattes, picks and holds."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import (
    QBrush,
    QColor,
    QFontMetricsF,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QWidget

from palette4d import _core
from palette4d.studio import texts, theme
from palette4d.studio.player import Region
from palette4d.studio.preview import Grade, Picture, Preview, Request, straight
from palette4d.studio.screen_colours import on_screen
from palette4d.studio.session import Probe, Session

#: Pixels of the screen within which the pointer takes the wipe's line, and a press is a click.
NEAR_WIPE, CLICK = 6, 4
ZOOM_STEP, LEAST_ZOOM, MOST_ZOOM = 1.25, 0.02, 64.0
#: From this zoom on pixels are squares.
SQUARES = 2.0
#: The pixels of a request that has none yet.
NO_PIXELS = np.zeros((0, 0, 3), np.float32)
#: Frames that are read around the playhead.
AHEAD, BEHIND = 6, 2

F32 = NDArray[np.float32]


@dataclass(frozen=True)
class Place:
    """A pixel of a frame, or a box around it.

    Attributes
    ----------
    frame : int
    x, y : int
        The pixel; the box's middle.
    box : int
        The box's side in pixels, odd; 1 is the pixel.
    colour : tuple of float
        The mean colour there, in the palette's code values.
    """

    frame: int
    x: int
    y: int
    box: int
    colour: tuple[float, float, float]


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
        self._press: QPointF | None = None
        self._doing = ""
        self._pan_from = QPointF()
        self._pointer: QPointF | None = None
        self.on_pick: Any = None  #: called with a Place for a click or a box
        self.on_hold: Any = None  #: the same with Alt
        session.on("clip", self._clip_changed)
        session.on("document", self.refresh)
        session.on("document", self._probe_again)
        session.on("pixels", self._probe_again)
        session.on("trial", self.refresh)
        session.on("playing", self.refresh)
        session.on("frame", self.read_frame)
        session.on("pixels", self.refresh)
        session.on("view", self.refresh)
        session.on("hover", self.refresh)

    # ---------------------------------------------------------------------------- what is shown

    @property
    def sides(self) -> tuple[str, ...]:
        """What is drawn: "before", "after" or both."""
        compare = "before" if self.comparing else self.session.view.compare
        return ("before", "after") if compare in ("wipe", "side") else (compare,)

    def _clip_changed(self) -> None:
        self.picture, self.images, self.shown_frame, self.problem = None, {}, None, ""
        self.zoom = None
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
            # Its neighbours are read when its picture is shown.
            session.player.want([session.frame])
            self.refresh()
        self._probe_again()

    def refresh(self) -> None:
        """Ask for the picture of now; while playing, the playback chooses the pictures."""
        if self.session.playing:
            self.update()
            return
        request = self.request()
        if request is not None:
            self.problem = ""
            self.preview.ask(request)
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
        moving = session.dragging or self._doing in ("pan", "wipe")
        return self._request_of(
            session.frame,
            region,
            pixels,
            settled=not moving,
            matte=session.hover,
            outside=session.view.outside,
        )

    def film(self, frame: int) -> Request | None:
        """Return the request for a frame to play; its pixels are taken when it is developed."""
        region = self.region()
        if region is None:
            return None
        return self._request_of(frame, region, NO_PIXELS, settled=False, scaled=True)

    def film_key(self, frame: int) -> tuple[Any, ...]:
        """Return `Request.film_key` of the request for a frame to play."""
        session = self.session
        sides = frozenset(self.sides)
        before = self._before_key()
        return self._clips, frame, self.region(), session.looked, sides, before, session.revision

    def _before_key(self) -> str:
        version = self.session.view.version
        return f"{version} {self.session.revision}" if version else ""

    def with_pixels(self, request: Request) -> Request | None:
        """Return a request to play with its pixels; None if they are gone."""
        player = self.session.player
        small = None if player is None else player.small(request.frame, request.region)
        return None if small is None else dataclasses.replace(request, pixels=small)

    def _request_of(self, frame: int, region: Region, pixels: F32, **more: Any) -> Request:
        session, view = self.session, self.session.view
        revision = session.revision  # first: another thread may make pictures to play
        document = session.document
        assert session.clip is not None
        assert session.display is not None
        grade = None if document is None else Grade.of(document, frame)
        before = None
        if view.version and document is not None:
            before = version_grade(document, view.version, frame)
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
            key=self._before_key(),
            revision=revision,
            sides=frozenset(self.sides),
            **more,
        )

    def show_picture(self, picture: Picture) -> None:
        """Show a picture that was made to play."""
        self._take(picture)

    def _arrived(self, picture: Picture) -> None:
        if picture.error:
            self.problem = picture.error
            self.session.say(picture.error, "error")
            self.update()
            return
        session = self.session
        if session.clip is None or session.playing or session.player is None:
            return
        self._take(picture)
        if picture.exact and picture.request.frame == session.frame:
            session.player.want(frames_around(session))

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

    # ------------------------------------------------------------------------------------ drawing

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw all."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(theme.PIT))
        if self.session.clip is None:
            self._say(painter, texts.EMPTY if self.session.document is None else texts.NO_CLIP)
            return
        if self.problem:
            self._say(painter, self.problem, QColor(theme.ERROR))
            return
        if self.picture is None:
            self._say(painter, texts.READING)
            return
        panes = self.panes()
        for side, pane in panes:
            painter.save()
            painter.setClipRect(pane)
            self._draw_side(painter, side, pane)
            painter.restore()
        if self.session.view.compare == "wipe" and not self.comparing:
            self._draw_wipe(painter)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._draw_captions(painter)
        self._draw_marks(painter)
        if self._doing == "box" and self._press is not None and self._pointer is not None:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            frame = QRectF(self._press, self._pointer).normalized()
            _ring(painter, lambda: painter.drawRect(frame))
        self._draw_probe(painter)
        if self.session.dragging:
            QTimer.singleShot(0, self.session.tell)

    def _target(self, pane: QRectF) -> QRectF:
        assert self.picture is not None
        region = self.picture.request.region
        origin, scale = self.origin(pane), self.scale()
        return QRectF(
            origin.x() + region.left * scale,
            origin.y() + region.top * scale,
            (region.right - region.left) * scale,
            (region.bottom - region.top) * scale,
        )

    def _draw_side(self, painter: QPainter, side: str, pane: QRectF) -> None:
        image = self.images.get(side) or self.images.get("after") or self.images.get("before")
        if image is None:
            return
        dense = self.scale() * self.devicePixelRatioF()
        smooth = dense < SQUARES
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, smooth)
        painter.drawImage(self._target(pane), image)
        outside = self.images.get("outside")
        if outside is not None and side == "after":
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, False)
            painter.drawImage(self._target(pane), outside)

    def _wipe_x(self) -> float:
        pane = self.panes()[0][1]
        clip = self.session.clip
        assert clip is not None
        left = self.origin(pane).x()
        x = left + self.session.view.wipe * clip.width * self.scale()
        return min(max(x, pane.left()), pane.right())

    def _draw_wipe(self, painter: QPainter) -> None:
        pane, x = self.panes()[0][1], self._wipe_x()
        if "before" in self.images:
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
        before = view.version or texts.BEFORE
        captions: list[tuple[str, QRectF, Qt.AlignmentFlag]] = []
        left, right = Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignRight
        panes = self.panes()
        if self.comparing or view.compare == "before":
            captions = [(before, panes[0][1], left)]
        elif view.compare == "side":
            captions = [(before, panes[0][1], left), (texts.AFTER, panes[1][1], left)]
        elif view.compare == "wipe":
            captions = [(before, panes[0][1], left), (texts.AFTER, panes[0][1], right)]
        for text, pane, side in captions:
            _label(painter, text, self._target(pane) & pane, side)

    def _draw_marks(self, painter: QPainter) -> None:
        """Draw the picks (discs) and holds (squares) that were made in this frame."""
        document = self.session.document
        picks = getattr(document, "picks", None) if document is not None else None
        for pick in picks or ():
            pixel = getattr(pick, "pixel", None)
            if pixel is None or pick.frame != self.session.frame:
                continue
            point = self.point_of(pixel[0] + 0.5, pixel[1] + 0.5)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            half = max(6.0, (getattr(pick, "box", None) or 1) * self.scale() / 2)
            box = QRectF(point.x() - half, point.y() - half, 2 * half, 2 * half)
            if pick.kind == "hold":
                _ring(painter, lambda box=box: painter.drawRect(box))
                _ring(painter, lambda p=point: painter.drawPoint(p))
            else:
                _ring(painter, lambda box=box: painter.drawEllipse(box))
            chosen = pick.id in self.session.selection
            _note(painter, pick.id, box.topRight() + QPointF(3, 2), bright=chosen)

    def _draw_probe(self, painter: QPainter) -> None:
        probe = self.session.probe
        if probe is None:
            return
        font = theme.numbers_font(9)
        painter.setFont(font)
        measure = QFontMetricsF(font)
        rows = [f"{probe.x}, {probe.y}"]
        rows.append(f"{texts.PROBE_IN:<4}" + " ".join(_figure(v) for v in probe.source))
        rows.append(f"{texts.PROBE_OUT:<4}" + " ".join(_figure(v) for v in probe.result))
        shares = sorted(probe.weights.items(), key=lambda item: -abs(item[1]))[:4]
        shares = [(id_, share) for id_, share in shares if abs(share) >= 0.005]
        line = measure.height() + 1
        width = max(measure.horizontalAdvance(row) for row in rows)
        width = max(width, 150.0)
        height = line * (len(rows) + len(shares))
        box = QRectF(
            self.width() - width - 28, self.height() - height - 26, width + 16, height + 14
        )
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
            painter.drawText(QPointF(box.left() + 8, y), f"{id_}")
            full = QRectF(
                box.left() + 52, y - measure.ascent() + 3, width - 88, measure.ascent() - 4
            )
            painter.fillRect(full, QColor(theme.RAISED))
            part = QRectF(full)
            part.setWidth(full.width() * min(max(share, 0), 1))
            painter.fillRect(part, colours.get(id_, QColor(theme.FAINT)))
            painter.drawText(QPointF(full.right() + 6, y), f"{share:.0%}")
            y += line

    def _palette_colours(self) -> dict[str, QColor]:
        """Return the frame's palette colours as displayed, by id."""
        if self.session.document is None:
            return {}
        palette = self.session.document.palette(self.session.frame)
        shown = on_screen(self.session, palette.edited)
        return {id_: QColor(*rgb) for id_, rgb in zip(palette.ids, shown.tolist(), strict=True)}

    def _say(self, painter: QPainter, text: str, colour: QColor | None = None) -> None:
        painter.setPen(colour or QColor(theme.FAINT))
        box = QRectF(self.rect()).adjusted(40, 40, -40, -40)
        flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
        painter.drawText(box, int(flags), text)

    # ------------------------------------------------------------------------------------ gestures

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a pan, a wipe, or a pick."""
        self._press, point = event.position(), event.position()
        if event.button() == Qt.MouseButton.MiddleButton:
            self._doing, self._pan_from = "pan", QPointF(self._middle())
        elif event.button() == Qt.MouseButton.LeftButton:
            if self._over_wipe(point):
                self._doing = "wipe"
            elif event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
                self._doing, self._pan_from = "pan", QPointF(self._middle())
            elif self.pixel_at(point) is not None:
                self._doing = "pick"

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Go on with what the button does; else probe."""
        point = self._pointer = event.position()
        if self._doing == "pan" and self._press is not None:
            if self.zoom is None:
                self.zoom = self.scale() * self.devicePixelRatioF()
            self.centre = self._pan_from - (point - self._press) / self.scale()
            self.refresh()
        elif self._doing == "wipe":
            clip = self.session.clip
            assert clip is not None
            left = self.origin(self.panes()[0][1]).x()
            at = (point.x() - left) / (clip.width * self.scale())
            self.session.look(wipe=min(max(at, 0.0), 1.0))
        elif self._doing in ("pick", "box") and self._press is not None:
            moved = point - self._press
            if max(abs(moved.x()), abs(moved.y())) > CLICK:
                self._doing = "box"
            self.update()
        else:
            over = self._over_wipe(point)
            shape = Qt.CursorShape.SplitHCursor if over else Qt.CursorShape.CrossCursor
            self.setCursor(shape if self.pixel_at(point) or over else Qt.CursorShape.ArrowCursor)
        self._probe(point)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End a pan; make a pick or a hold."""
        doing, press, self._doing, self._press = self._doing, self._press, "", None
        if doing == "pan":
            self.refresh()
        if doing in ("pick", "box") and press is not None:
            place = self.place(press, event.position() if doing == "box" else press)
            if place is not None:
                hold = event.modifiers() & Qt.KeyboardModifier.AltModifier
                act = self.on_hold if hold else self.on_pick
                if act is not None:
                    act(place)
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """A second click is a click."""
        self.mousePressEvent(event)

    def leaveEvent(self, event: QEvent) -> None:
        """Stop probing."""
        self._pointer = None
        self.session.show_probe(None)
        self.update()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom at the pointer."""
        turns = event.angleDelta().y() / 120
        if turns:
            self.zoom_by(ZOOM_STEP**turns, event.position())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Pass every key on: the menus have them."""
        event.ignore()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Ask for a picture of the new size."""
        self.refresh()

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
        return abs(point.x() - self._wipe_x()) <= NEAR_WIPE

    def place(self, start: QPointF, end: QPointF) -> Place | None:
        """Return the pixel or the box between two points of the widget, with its mean colour."""
        session = self.session
        first, last = self.pixel_at(start), self.pixel_at(end) or self.pixel_at(start)
        if first is None or last is None or session.player is None or session.document is None:
            return None
        pixels = session.player.frame(session.frame)
        if pixels is None:
            return None
        side = max(abs(last[0] - first[0]), abs(last[1] - first[1])) + 1
        side += 1 - side % 2
        x, y = (first[0] + last[0]) // 2, (first[1] + last[1]) // 2
        half = side // 2
        box = pixels[max(0, y - half) : y + half + 1, max(0, x - half) : x + half + 1]
        assert session.clip is not None
        colours = straight(box, session.clip.premultiplied).reshape(-1, 3).astype(np.float64)
        own = session.document.core.conversion
        if own is not None:
            colours = own.steps.to_palette(colours)
        colours = colours[np.isfinite(colours).all(axis=1)]
        if not len(colours):
            session.say(texts.NO_COLOUR, "warning")
            return None
        mean = colours.mean(axis=0).tolist()
        return Place(session.frame, x, y, side, (mean[0], mean[1], mean[2]))

    def _probe_again(self) -> None:
        """Probe the same pixel of another frame or grade."""
        if self._pointer is not None:
            self._probe(self._pointer)

    def _probe(self, point: QPointF) -> None:
        at = self.pixel_at(point)
        self.session.show_probe(None if at is None else probe_at(self.session, *at))
        self.update()


# ------------------------------------------------------------------------------------------ details


def frames_around(session: Session) -> list[int]:
    """Return the frames to read, the playhead's first."""
    assert session.clip is not None
    _, _, step = session.frames
    # Movies are decoded forwards; going back takes long.
    behind = 0 if session.clip.is_movie else BEHIND
    offsets = [0, *range(1, AHEAD + 1), *range(-1, -behind - 1, -1)]
    known = frozenset() if session.player is None else session.player.numbers
    frames = [session.frame + offset * step for offset in offsets]
    return [frame for frame in frames if frame in known]


def probe_at(session: Session, x: int, y: int) -> Probe | None:
    """Return a pixel's code values before and after, and its weights."""
    if session.player is None or session.clip is None:
        return None
    pixels = session.player.frame(session.frame)
    if pixels is None or not (0 <= y < pixels.shape[0] and 0 <= x < pixels.shape[1]):
        return None
    pixel = np.ascontiguousarray(pixels[y : y + 1, x : x + 1])
    source = tuple(float(v) for v in pixel[0, 0])
    if session.document is None:
        return Probe(x, y, source, source)
    grade = Grade.of(session.document, session.frame)
    result = Preview.exact(pixel, grade, session.clip.premultiplied)
    colour: Any = straight(pixel, session.clip.premultiplied)[0]
    if grade.conversion is not None:
        colour = grade.conversion.to_palette(colour)
    weights, _ = _core.palette_weights(colour, grade.palette.rgb, grade.palette.faces)
    shares: dict[str, float] = {}
    for id_, share in zip(grade.palette.ids, weights[0], strict=True):
        shares[id_] = shares.get(id_, 0.0) + float(share)
    return Probe(x, y, source, tuple(float(v) for v in result[0, 0]), shares)


def version_grade(document: Any, name: str, frame: float) -> Grade | None:
    """Return the grade of a version at a time; None if there is no such version."""
    core = document.core
    edits = dict(getattr(core, "versions", ())).get(name)
    if edits is None:
        return None
    palette = document.palette(frame)
    cut = _core.slice_at(core.polytope, frame)
    edited = _core.edited_colours(core.polytope, edits, cut)
    bumps = edits.bumps_at(frame)
    own = core.conversion
    return Grade(
        dataclasses.replace(palette, edited=edited),
        None if own is None else own.steps,
        bumps if len(bumps) else None,
    )


def image_of(pixels: NDArray[np.uint8]) -> QImage:
    """Return an image that shares the (h, w, 4) pixels."""
    height, width = pixels.shape[:2]
    image = QImage(pixels.data, width, height, 4 * width, QImage.Format.Format_RGBX8888)
    image._pixels = pixels  # type: ignore[attr-defined]  # Qt does not keep the memory that it shows
    return image


def hatched(mask: NDArray[np.uint8]) -> QImage:
    """Return an overlay with stripes where the mask is set."""
    y, x = np.indices(mask.shape)
    stripes = ((x + y) // 2) % 2 == 0
    overlay = np.zeros((*mask.shape, 4), np.uint8)
    overlay[..., 3] = np.where(mask > 0, 190, 0)
    overlay[..., :3] = np.where((mask > 0) & stripes, 190, 0)[..., None]  # premultiplied white
    height, width = mask.shape
    image = QImage(
        overlay.data, width, height, 4 * width, QImage.Format.Format_RGBA8888_Premultiplied
    )
    return image.copy()


def _figure(value: float) -> str:
    return f"{value:7.4f}" if abs(value) < 100 else f"{value:7.1f}"


def _ring(painter: QPainter, draw: Any) -> None:
    """Draw a line that is seen on any picture: dark below bright."""
    for width, colour in ((3.2, QColor(0, 0, 0, 150)), (1.4, QColor(255, 255, 255, 235))):
        painter.setPen(QPen(colour, width))
        draw()


def _note(painter: QPainter, text: str, at: QPointF, *, bright: bool) -> None:
    font = painter.font()
    font.setPointSizeF(8.5)
    font.setBold(bright)
    painter.setFont(font)
    painter.setPen(QColor(0, 0, 0, 200))
    painter.drawText(at + QPointF(1, 1), text)
    painter.setPen(QColor(255, 255, 255))
    painter.drawText(at, text)


def _label(painter: QPainter, text: str, box: QRectF, side: Qt.AlignmentFlag) -> None:
    """Draw a caption in an upper corner of the picture."""
    font = painter.font()
    font.setPointSizeF(9)
    font.setBold(False)
    painter.setFont(font)
    measure = QFontMetricsF(font)
    width = measure.horizontalAdvance(text) + 14
    left = box.left() + 8 if side == Qt.AlignmentFlag.AlignLeft else box.right() - 8 - width
    frame = QRectF(left, box.top() + 8, width, measure.height() + 6)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QBrush(QColor(18, 18, 18, 190)))
    painter.drawRoundedRect(frame, 3, 3)
    painter.setPen(QColor(theme.BRIGHT))
    painter.drawText(frame, int(Qt.AlignmentFlag.AlignCenter), text)
