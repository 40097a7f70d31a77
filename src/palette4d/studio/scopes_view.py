"""The panel of the scopes: it follows the picture that is shown, beside the window's thread."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import QRectF, QSettings, QSize, QTimer
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QHBoxLayout, QToolButton, QVBoxLayout, QWidget

from palette4d.common.errors import in_words
from palette4d.studio import texts, theme
from palette4d.studio.display import Look
from palette4d.studio.newest import Newest
from palette4d.studio.preview import Grade, Picture
from palette4d.studio.scopes import Frame, Measured, measure, values_of_picture
from palette4d.studio.scopes_paint import WIDE, Mark, ScopesPainter, tiles
from palette4d.studio.session import Session
from palette4d.studio.viewer import Viewer

#: Milliseconds without a change after which the whole frame is measured.
REST = 150
#: Seconds between two measurements of pictures that move.
EVERY = 0.08
#: How much the vectorscope is enlarged, where it is.
ZOOM = 2.0
#: What is shown at first.
USUAL = ("waveform", "vectorscope")


class _Newer(Exception):
    """A newer picture waits."""


class Scopes(QWidget):
    """The scopes of the picture in the viewer.

    Attributes
    ----------
    sides : dict of str to Measured
        What is shown: "before", "after" or both, as in the viewer.
    took : float
        Seconds that the last measurement took, without the recolouring.
    """

    def __init__(self, session: Session, viewer: Viewer, settings: QSettings) -> None:
        """Listen to the session."""
        super().__init__()
        self.session, self.viewer, self._settings = session, viewer, settings
        self.sides: dict[str, Measured] = {}
        self.took = 0.0
        self._newest = Newest("palette4d scopes")
        self._asked = 0  # rises with every request
        self._shown: object = None  # what the measured frame depends on
        self._last = 0.0
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.timeout.connect(self._measure_frame)
        self._later = QTimer(self)  # the last picture of those that came too soon
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._measure_picture)
        self.setAccessibleName(texts.SCOPES_PANEL)
        column = QVBoxLayout(self)
        column.setContentsMargins(6, 4, 6, 6)
        column.setSpacing(4)
        column.addLayout(self._make_buttons())
        self.canvas = _Canvas(self)
        column.addWidget(self.canvas, 1)
        session.on("picture", self.follow)
        for event in ("document", "selection", "frame"):
            session.on(event, self.canvas.update, panel=True)
        session.on("clip", self._clear)

    def _make_buttons(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(2)
        kept = self._settings.value("scopes")
        names = str(kept).split() if kept else USUAL
        self.buttons: dict[str, QToolButton] = {}
        for name, text in texts.SCOPES_SHOWN.items():
            self.buttons[name] = self._button(row, text, texts.SCOPE_TIPS_SHOWN[name])
            self.buttons[name].setChecked(name in names)
        row.addStretch(1)
        self.closer = self._button(row, texts.SCOPE_ZOOM, texts.SCOPE_ZOOM_TIP)
        self.closer.setChecked("closer" in names)
        return row

    def _button(self, row: QHBoxLayout, text: str, tip: str) -> QToolButton:
        button = QToolButton()
        button.setText(text)
        button.setMinimumWidth(40)  # on a small screen words are cut, not the picture's room
        button.setToolTip(tip)
        button.setCheckable(True)
        button.clicked.connect(self._chosen)
        row.addWidget(button)
        return button

    def _chosen(self) -> None:
        names = [*self.shown, *(["closer"] if self.closer.isChecked() else [])]
        self._settings.setValue("scopes", " ".join(names) or "none")
        self._shown = None
        self.follow()
        self.canvas.update()

    @property
    def shown(self) -> list[str]:
        """The names of the scopes that are drawn."""
        return [name for name, button in self.buttons.items() if button.isChecked()]

    @property
    def seen(self) -> bool:
        """Whether the panel is seen: below another one it is not."""
        return not self.visibleRegion().isEmpty()

    @property
    def zoom(self) -> float:
        """How much the vectorscope is enlarged."""
        return ZOOM if self.closer.isChecked() else 1.0

    @property
    def settled(self) -> bool:
        """Whether the frame of now is measured."""
        waits = self._resting.isActive() or self._later.isActive()
        return not self.seen or (not waits and self._shown == self._key())

    def sizeHint(self) -> QSize:
        """Return the size that shows two scopes."""
        return QSize(380, 260)

    # --------------------------------------------------------------------------------- measuring

    def _clear(self) -> None:
        self._asked += 1
        self.sides, self._shown = {}, None
        self.canvas.update()

    def _key(self) -> object:
        """Return what the measured frame depends on; None without a picture."""
        picture, session = self.viewer.picture, self.session
        if picture is None:
            return None
        request, view = picture.request, session.view
        parts = request.clip, request.frame, request.revision, request.sides, request.against
        return (*parts, view.display, view.view, self.zoom)

    def follow(self) -> None:
        """Measure the picture that is shown now; the whole frame when nothing moves."""
        picture = self.viewer.picture
        if not self.seen or picture is None or self._key() == self._shown:
            return
        moves = self.session.playing or self.session.dragging
        if picture.request.matte is None and not picture.exact:
            wait = EVERY - (time.monotonic() - self._last)
            if wait <= 0:
                self._measure_picture()
            elif not self._later.isActive():
                self._later.start(round(wait * 1000))
        if moves:
            self._resting.stop()
        else:
            self._resting.start(REST)

    def _measure_picture(self) -> None:
        """Measure the picture on screen."""
        picture, self._last = self.viewer.picture, time.monotonic()
        if picture is not None and picture.request.matte is None:
            sides = _pictures(picture)
            self._ask(lambda side, _: values_of_picture(sides[side]), list(sides), None)

    def _measure_frame(self) -> None:
        """Measure the frame itself."""
        session, picture = self.session, self.viewer.picture
        frame = None if picture is None else self._frame(picture)
        if session.playing or session.dragging:
            return
        if frame is None:
            self._resting.start(REST)  # its pixels are still being read
            return
        self._ask(frame.values, list(frame.grades), self._key())

    def _frame(self, picture: Picture) -> Frame | None:
        """Return what is measured of the playhead's frame."""
        session, request, view = self.session, picture.request, self.session.view
        if session.player is None or session.clip is None or session.display is None:
            return None
        if request.revision != session.revision or request.frame != session.frame:
            return None
        pixels = session.player.frame(session.frame)
        if pixels is None:
            return None
        grades: dict[str, Grade | None] = {"before": request.before, "after": request.grade}
        return Frame(
            pixels,
            {side: grades[side] for side in ("before", "after") if side in request.sides},
            session.clip.premultiplied,
            session.display,
            Look(view.display, view.view),
        )

    def _ask(
        self,
        values: Callable[[str, Callable[[], None]], Any],
        sides: Sequence[str],
        key: object,
    ) -> None:
        """Measure sides in the thread; a key tells what the result is of."""
        self._asked += 1
        own, zoom = self._asked, self.zoom

        def check() -> None:
            if own != self._asked:
                raise _Newer

        def work() -> None:
            took, found = 0.0, {}
            try:
                for side in sides:
                    colours = values(side, check)
                    start = time.perf_counter()
                    found[side] = measure(colours, zoom)
                    took += time.perf_counter() - start
            except _Newer:
                return
            except Exception as error:  # whatever fails, the window stays
                words = in_words(error) or type(error).__name__
                self.session.post(lambda: self.session.say(words, "error"))
            self.session.post(lambda: self._measured(own, found, took, key))

        self._newest.ask(work)

    def _measured(self, own: int, found: dict[str, Measured], took: float, key: object) -> None:
        if own == self._asked:
            self.sides, self.took = found, took
            self._shown = key
            self.canvas.update()

    # ------------------------------------------------------------------------------- the picks

    def marks(self) -> list[Mark]:
        """Return the picks and holds that are switched on, as the display shows their colours.

        Those of the version that "after" shows.
        """
        session = self.session
        document, display = session.document, session.display
        if document is None or display is None:
            return []
        grade, version = document.grade, session.view.after
        if version in grade.versions:
            grade = grade.version(version)
        picks = [p for p in grade.picks if p.enabled]
        if not picks:
            return []
        rgb = np.array([(p.rgb, p.rgb if p.to is None else p.to) for p in picks], np.float64)
        conversion = document.grade.core.conversion
        if conversion is not None:
            rgb = np.asarray(conversion.steps.to_clip(rgb))
        look = dataclasses.replace(session.looked, exposure=0.0, gamma=1.0)
        shown = display.painter(look).values(rgb.astype(np.float32)).astype(np.float64)
        return [
            Mark(p.id, before, after, p.kind == "hold", p.id in session.selection)
            for p, (before, after) in zip(picks, shown, strict=True)
        ]


class _Canvas(QWidget):
    """Where the scopes are drawn."""

    def __init__(self, panel: Scopes) -> None:
        super().__init__()
        self.panel = panel
        self.setMinimumSize(160, 110)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the scopes that are chosen."""
        panel, painter = self.panel, QPainter(self)
        painter.fillRect(self.rect(), QColor(theme.PANEL))
        names = panel.shown
        if not names or not panel.sides:
            words = texts.NO_SCOPE if not names else texts.NOTHING_MEASURED
            painter.setPen(QColor(theme.FAINT))
            painter.drawText(self.rect(), 0x84, words)  # centred
            return
        view = panel.session.view
        names_of_sides = {
            "before": view.version or texts.BEFORE,
            "after": view.after or texts.AFTER,
        }
        own = ScopesPainter(painter, self, panel.zoom, names_of_sides)
        both = len(panel.sides)
        shapes = [
            1.0 * both if name == "vectorscope" else WIDE * (both if name == "parade" else 1)
            for name in names
        ]
        marks = panel.marks() if "vectorscope" in names else []
        for name, box in zip(names, tiles(QRectF(self.rect()), shapes), strict=True):
            own.draw(name, box, panel.sides, marks)


def _pictures(picture: Picture) -> dict[str, Any]:
    sides = {"before": picture.before, "after": picture.after}
    return {side: pixels for side, pixels in sides.items() if pixels is not None}
