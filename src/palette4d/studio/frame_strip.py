"""The strip of small frames above the rows: made in a thread, with the edits, as displayed."""

import bisect
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize
from PySide6.QtGui import QColor, QImage, QPainter, QPixmap

from palette4d.studio import paint, theme
from palette4d.studio.player import Region
from palette4d.studio.screen_colours import thumbnail
from palette4d.studio.session import Session
from palette4d.studio.timeline_places import GUTTER, RULER, STRIP, Places

F32 = NDArray[np.float32]
U8 = NDArray[np.uint8]

#: Pictures that are kept, at most.
KEPT = 2000
#: Makes the strip's pictures.
THREAD = ThreadPoolExecutor(1, thread_name_prefix="palette4d thumbnails")


class FrameStrip:
    """The strip of a timeline.

    Parameters
    ----------
    session : Session
    places : Places
        Where frames are.
    update : callable
        Called on the views' thread when another picture is ready.
    """

    def __init__(self, session: Session, places: Places, update: Callable[[], object]) -> None:
        """Begin without pictures."""
        self.session, self.places, self._update = session, places, update
        self.ratio = 1.0  #: pixels of the screen for one of the view
        self._thumbs: dict[int, tuple[object, QPixmap]] = {}
        self._making: set[int] = set()
        self._drawn: tuple[object, QPixmap] | None = None

    def clear(self) -> None:
        """Forget the pictures: there is another clip."""
        self._thumbs.clear()
        self.changed()

    def changed(self) -> None:
        """Draw the strip again: frames or pictures have arrived."""
        self._drawn = None

    def paint(self, painter: QPainter) -> None:
        """Draw the strip; its frames are drawn again only when something in them changed."""
        if not self.places.strip:
            return
        session = self.session
        now = None if session.dragging else (session.revision, session.looked)
        key = self.places.scale, self.places.width, self.ratio, now
        if self._drawn is None or self._drawn[0] != key:
            drawn = QPixmap(QSize(self.places.width, STRIP) * self.ratio)
            drawn.setDevicePixelRatio(self.ratio)
            drawn.fill(QColor(theme.PIT))
            self._drawn = key, drawn
            within = QPainter(drawn)
            within.translate(0, -RULER)
            self._draw(within)
            within.end()
        painter.drawPixmap(0, RULER, self._drawn[1])

    def _draw(self, painter: QPainter) -> None:
        painter.setClipRect(QRectF(GUTTER, RULER, self.places.width - GUTTER, STRIP))
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

    def thumbnails(self) -> list[tuple[int, QRectF]]:
        """Return the frames of the strip and their places."""
        clip = self.session.clip
        if clip is None or not clip.frames or not self.places.strip:
            return []
        tall = STRIP - 6
        wide = max(20.0, tall * clip.width / max(clip.height, 1))
        scale = self.places.scale
        left, right = scale.left - wide / 2, scale.right + wide / 2
        count = max(1, int((right - left) // (wide + 2)))
        each = (right - left) / count
        result = []
        first = max(0, int((GUTTER - left) // each))
        last = min(count, int((self.places.width - left) // each) + 1)
        for k in range(first, last):
            middle = left + (k + 0.5) * each
            number = _nearest(clip.frames, float(scale.frame(middle)))
            result.append((number, QRectF(middle - wide / 2, RULER + 3, wide, tall)))
        return result

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
        tall = min(clip.height, round((STRIP - 6) * self.ratio))
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
            if len(self._thumbs) >= KEPT:
                self._thumbs.clear()  # those in sight are made again
            self._thumbs[frame] = key, QPixmap.fromImage(image)
            self.changed()
            self._update()

        self.session.post(done)


def _nearest(frames: Sequence[int], time: float) -> int:
    """Return the frame nearest to a time; the frames are in order."""
    after = min(bisect.bisect_left(frames, time), len(frames) - 1)
    return min(frames[max(after - 1, 0)], frames[after], key=lambda frame: abs(frame - time))
