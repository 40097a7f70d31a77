"""The bar below the picture: playing, the frame, what is compared, and the display."""

import functools
import time

from PySide6.QtCore import QObject, QPointF, QRectF, QSignalBlocker, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap, QPolygonF, QResizeEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QButtonGroup,
    QComboBox,
    QHBoxLayout,
    QLabel,
    QLayout,
    QSizePolicy,
    QSpinBox,
    QToolButton,
    QWidget,
)

from palette4d.studio import texts, theme
from palette4d.studio.choice import Choice
from palette4d.studio.number import Number
from palette4d.studio.player import Region
from palette4d.studio.preview import Picture, Request
from palette4d.studio.session import Session
from palette4d.studio.viewer import Viewer

#: Frames that are made ahead of the playhead while playing.
AHEAD = 16
#: Pictures that are ready when playing starts, and the longest wait for them (seconds).
READY, PATIENCE = 4, 0.6
#: Milliseconds between two looks at the clock while playing.
CLOCK = 4
#: The most characters of a version's name on a button.
LONGEST_NAME = 12
#: The least width of the bar.
LEAST_WIDTH = 380
#: Seconds between two requests for frames that are late.
ASK_EVERY = 0.03
#: The signs of the buttons, 64 pixels wide: triangles from x to their tip's x, bars from x and how
#: wide they are.
SIGNS: dict[str, tuple[tuple[tuple[int, int], ...], tuple[tuple[int, int], ...]]] = {
    "play": (((18, 50),), ()),
    "stop": ((), ((18, 9), (37, 9))),
    "next_frame": (((26, 50),), ((16, 6),)),
    "previous_frame": (((38, 14),), ((42, 6),)),
    "first_frame": (((36, 18), (54, 36)), ((10, 6),)),
    "last_frame": (((10, 28), (28, 46)), ((48, 6),)),
}


class Playback(QObject):
    """Plays in real time: a frame whose picture is late is dropped and counted."""

    def __init__(self, session: Session, viewer: Viewer) -> None:
        """Listen to the session."""
        super().__init__(viewer)
        self.session, self.viewer = session, viewer
        self.dropped = self.shown = 0
        self.rate = 0.0  #: frames a second that were shown lately
        self._asked = 0.0
        self._lead = 0  #: frames after the playhead that cannot be made in time
        self._started: float | None = None
        self._began = self._count_from = 0.0
        self._from = session.frame
        self._step = 0
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(CLOCK)
        self._timer.timeout.connect(self._tick)
        session.on("playing", self._changed)
        session.on("pixels", self._pixels)
        session.on("document", self._pixels)
        session.on("view", self._pixels)

    @property
    def frames_per_second(self) -> float:
        """The clip's rate."""
        clip = self.session.clip
        return 24.0 if clip is None else float(clip.rate)

    def span(self) -> tuple[int, int, int]:
        """Return the first and last frame to play, and the step."""
        first, last, step = self.session.frames
        low, high = self.session.marks or (first, last)
        return low, high, step

    def _changed(self) -> None:
        if self.session.playing:
            low, high, _ = self.span()
            if not low <= self.session.frame <= high:
                self.session.go(low if self.session.playing > 0 else high)
            elif not self.session.loop:
                end = high if self.session.playing > 0 else low
                if self.session.frame == end:
                    self.session.go(low if self.session.playing > 0 else high)
            self._from, self._step, self._started = self.session.frame, 0, None
            self._began = time.perf_counter()
            self.dropped = self.shown = self._lead = 0
            self._timer.start()
            self._ask()
        else:
            self._timer.stop()
            self.viewer.preview.roll(())
            self.viewer.read_frame()

    def _pixels(self) -> None:
        if self.session.playing:
            self._ask()

    def nth(self, count: int) -> int | None:
        """Return the frame so many steps after the start; None after the end."""
        low, high, step = self.span()
        total = (high - low) // step + 1
        at = (self._from - low) // step + count * self.session.playing
        if not self.session.loop and not 0 <= at < total:
            return None
        return low + at % total * step

    def _ask(self) -> None:
        """Have the next frames read and made."""
        self._asked = time.perf_counter()
        viewer, player, region = self.viewer, self.session.player, self.viewer.region()
        if player is None or region is None:
            return
        # What would come too late is left out.
        start = self._step + 1 + self._lead
        nexts = [self.nth(start + k) for k in range(AHEAD)]
        frames = list(dict.fromkeys(n for n in nexts if n is not None))
        missing = [n for n in frames if self._picture(n, region) is None]
        player.want(missing, region.coarse)
        ready = [n for n in missing if player.has_small(n, region.coarse)]
        viewer.preview.roll([functools.partial(self._scene, n) for n in ready])

    def _scene(self, frame: int) -> Request | None:
        """Return what the preview's thread makes for a frame."""
        request = self.viewer.film(frame)
        return None if request is None else self.viewer.with_pixels(request)

    def _tick(self) -> None:
        now = time.perf_counter()
        session, viewer = self.session, self.viewer
        if session.player is None:
            session.play(0)
            return
        if self._started is None:
            starts, region = (self.nth(k) for k in range(READY)), viewer.region()
            ready = sum(n is not None and self._picture(n, region) is not None for n in starts)
            if ready < READY and now - self._began < PATIENCE:
                return
            self._started, self._step = now, -1
            self._count_from = now
        due = int((now - self._started) * self.frames_per_second)
        if due <= self._step:
            return
        # The newest picture that is ready; frames before it are dropped.
        for count in range(due, self._step, -1):
            frame = self.nth(count)
            if frame is None:
                session.play(0)
                return
            picture = self._picture(frame, viewer.region())
            if picture is not None:
                self.dropped += count - self._step - 1
                self.shown += 1
                late = count - self._step - 1
                self._lead = min(self._lead + 2, AHEAD) if late else max(self._lead - 1, 0)
                self._step = count
                viewer.show_picture(picture)
                if session.frame != frame:
                    session.frame = frame
                    session.emit("frame")
                self.rate = self.shown / max(now - self._count_from, 1e-3)
                break
        else:
            if now - self._asked < ASK_EVERY:
                return
            if due - self._step > self._lead:
                # Nothing comes in time: these frames are dropped, and later ones are made.
                self.dropped += due - self._step
                self._step = due
                self._lead = min(self._lead + 2, AHEAD)
        self._ask()

    def _picture(self, frame: int, region: Region | None) -> Picture | None:
        return self.viewer.preview.kept(self.viewer.film_key(frame, region))


class Transport(QWidget):
    """The bar."""

    def __init__(self, session: Session, playback: Playback) -> None:
        """Make the widgets."""
        super().__init__()
        self.session, self.playback = session, playback
        both = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        both.setSizeConstraint(QLayout.SizeConstraint.SetNoConstraint)  # it leaves things out
        both.setContentsMargins(8, 4, 8, 4)
        row, looks = QHBoxLayout(), QHBoxLayout()
        both.addLayout(row, 2)
        both.addLayout(looks, 1)
        for each in (both, row, looks):
            each.setSpacing(3)
        self._rows, self._parts = both, (row, looks)
        self.buttons: dict[str, QToolButton] = {}
        for name in ("first_frame", "previous_frame", "play", "next_frame", "last_frame"):
            button = QToolButton()
            button.setProperty("flat", True)
            button.setIconSize(QSize(16, 16))
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.setIcon(icon(name))
            self.buttons[name] = button
            row.addWidget(button)
        row.addSpacing(6)
        self.frame = QSpinBox()
        self.frame.setFont(theme.numbers_font())
        self.frame.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.frame.setKeyboardTracking(False)
        self.frame.setAccessibleName(texts.FRAME_FIELD)
        self.frame.setFixedWidth(64)
        self.frame.valueChanged.connect(session.go)
        row.addWidget(self.frame)
        self.facts = QLabel()
        self.facts.setStyleSheet(f"color: {theme.FAINT}")
        self.facts.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.facts.setMinimumWidth(96)
        row.addWidget(self.facts, 2)
        row.addStretch(0)
        self.compare: dict[str, QToolButton] = {}
        group = QButtonGroup(self)
        for key, text in texts.COMPARE.items():
            button = QToolButton()
            button.setText(text)
            button.setCheckable(True)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.clicked.connect(lambda _=False, key=key: session.look(compare=key))
            group.addButton(button)
            self.compare[key] = button
            row.addWidget(button)
        looks.addSpacing(6)
        self.look = Choice()
        self.look.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.look.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        self.look.setMinimumContentsLength(8)
        self.look.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.look.setMinimumWidth(66)
        self.look.setMaximumWidth(230)
        self.look.setAccessibleName(texts.DISPLAY)
        self.look.activated.connect(self._chosen)
        looks.addWidget(self.look, 2)
        looks.addSpacing(6)
        self.exposure = self._number(looks, texts.EXPOSURE, -10, 10, 0.25, "exposure")
        self.gamma = self._number(looks, texts.GAMMA, 0.2, 5, 0.05, "gamma")
        looks.addStretch(0)
        #: What is left out where there is no room, in this order; the menus have it too.
        self.extras: list[list[QWidget]] = [[self.facts]]
        for names in (("first_frame", "last_frame"), ("previous_frame", "next_frame")):
            self.extras.append([self.buttons[name] for name in names])
        for event in ("clip", "document", "view", "range"):
            session.on(event, self._show, panel=True)
        session.on("frame", self._show_frame)
        session.on("playing", self._show_playing)
        self._clock = QTimer(self)
        self._clock.timeout.connect(self._show_facts)
        self._show()

    def minimumSizeHint(self) -> QSize:
        """Return the least size: half of a small screen at 200 %."""
        return QSize(LEAST_WIDTH, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out what has no room; take two rows where that is not enough."""
        one, two = QBoxLayout.Direction.LeftToRight, QBoxLayout.Direction.TopToBottom
        for direction, least in (*((one, k) for k in range(4)), *((two, k) for k in range(4))):
            self._rows.setDirection(direction)
            for k, extra in enumerate(self.extras):
                for widget in extra:
                    widget.setVisible(k >= least)
            for part in self._parts:
                part.invalidate()  # Qt does it only for the layout around them
            if self._rows.minimumSize().width() <= self.width():
                break
        # Its layout asks for nothing: the bar does, or it would lie over the picture.
        self.setFixedHeight(self._rows.minimumSize().height())
        super().resizeEvent(event)

    def _number(
        self, row: QHBoxLayout, text: str, low: float, high: float, step: float, name: str
    ) -> Number:
        label = QLabel(text)
        label.setStyleSheet(f"color: {theme.FAINT}")
        row.addWidget(label)
        box = Number(text, low, high, step, 2, 50)
        box.setAlignment(Qt.AlignmentFlag.AlignRight)
        box.setFont(theme.numbers_font())
        box.valueChanged.connect(lambda value: self.session.look(**{name: value}))
        row.addWidget(box)
        return box

    def _chosen(self, index: int) -> None:
        found = self.look.itemData(index)
        if found:
            self.session.look(display=found[0], view=found[1])

    def _show(self) -> None:
        session, display = self.session, self.session.display
        first, last, step = session.frames
        with QSignalBlocker(self.frame):
            self.frame.setRange(first, last)
            self.frame.setSingleStep(step)
        self.exposure.show_number(session.view.exposure)
        self.gamma.show_number(session.view.gamma)
        self.compare[session.view.compare].setChecked(True)
        for side, version in (("before", session.view.version), ("after", session.view.after)):
            name = version if len(version) <= LONGEST_NAME else f"{version[: LONGEST_NAME - 1]}…"
            self.compare[side].setText(name or texts.COMPARE[side])
            self.compare[side].setToolTip(theme.plain(texts.SHOWS.format(name=version or side)))
        wanted = (
            []
            if display is None
            else [(name, view) for name in display.displays() for view in display.views(name)]
        )
        if wanted != [tuple(self.look.itemData(k) or ()) for k in range(self.look.count())]:
            self.look.clear()
            for name, view in wanted:
                self.look.addItem(f"{name} · {view}", (name, view))
        if display is None or not wanted:
            self.look.clear()
            self.look.addItem(texts.NO_DISPLAY if display is None else texts.AS_IS)
        else:
            chosen = display.chosen(session.looked)
            self.look.setCurrentIndex(wanted.index((chosen.display, chosen.view)))
        if display is not None:
            self.look.setToolTip(
                theme.plain(texts.LOOK_TIP.format(space=display.space, config=display.name))
                if display.known
                else texts.AS_IS_TIP
            )
        self._show_frame()
        self._show_playing()

    def _show_frame(self) -> None:
        with QSignalBlocker(self.frame):
            self.frame.setValue(self.session.frame)
        if not self.session.playing:
            self._show_facts()

    def _show_playing(self) -> None:
        self.buttons["play"].setIcon(icon("stop" if self.session.playing else "play"))
        if self.session.playing:
            self._clock.start(250)
        else:
            self._clock.stop()
        self._show_facts()

    def _show_facts(self) -> None:
        _, last, _ = self.session.frames
        facts = [f"/ {last}", texts.RATE.format(rate=f"{self.playback.frames_per_second:.5g}")]
        if self.session.playing:
            speed = self.session.playing
            if speed != 1:
                facts.append(f"{speed}×")
            facts.append(texts.DROPPED.format(count=self.playback.dropped))
        if self.session.marks is not None:
            facts.append(texts.MARKS.format(*self.session.marks))
        self.facts.setText("   ".join(facts))


def icon(name: str) -> QIcon:
    """Return the drawn sign of a button."""
    pixmap = QPixmap(64, 64)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(theme.TEXT))

    triangles, bars = SIGNS[name]
    for left, right in triangles:
        tip = [QPointF(left, 14), QPointF(right, 32), QPointF(left, 50)]
        painter.drawPolygon(QPolygonF(tip))
    for left, wide in bars:
        painter.drawRect(QRectF(left, 14, wide, 36))
    painter.end()
    return QIcon(pixmap)
