"""The selected pick or hold: its matte, its tools, and what it takes of its frame."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QPainter, QPixmap
from PySide6.QtWidgets import (
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from palette4d.common.errors import in_words
from palette4d.common.text import percent
from palette4d.grade.answer import Answer
from palette4d.grade.document import Document
from palette4d.grade.picks import MOST_REACH, Area, Pick
from palette4d.plotting import style
from palette4d.studio import grade_steps, paint, texts, theme
from palette4d.studio.colour_widgets import Bar, Span
from palette4d.studio.newest import Newest
from palette4d.studio.number import Number
from palette4d.studio.pick_window import WindowRows
from palette4d.studio.preview import taken_share
from palette4d.studio.screen_colours import on_screen
from palette4d.studio.session import Session
from palette4d.studio.states import Place

U8 = NDArray[np.uint8]

#: What a pick takes is worked out when nothing has changed for so many milliseconds.
REST = 300
#: A reach this near 0 becomes 0.
SNAP = 0.12
#: Notes of an answer that are shown, from the first on.
NOTES = 8
WARNS = f"color: {theme.WARNING}"
#: Colours of a bar.
SAMPLES = 24
#: The width of the numbers beside the bars.
NUMBERS = 72
#: The width that a scroll bar takes.
SCROLL_BAR = 10
#: The size of a colour before a line.
SWATCH = QSize(14, 14)


class Line(QWidget):
    """A line of the answer: a colour, words, and what would help."""

    def __init__(self) -> None:
        """Begin hidden."""
        super().__init__()
        self.swatch, self.words = QLabel(), QLabel()
        self.swatch.setFixedSize(SWATCH)
        self.words.setTextFormat(Qt.TextFormat.PlainText)
        self.words.setWordWrap(True)
        self.words.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(6)
        row.addWidget(self.swatch)
        row.addWidget(self.words, 1)
        self.button = QPushButton()
        self.button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.button.hide()
        row.addWidget(self.button)
        self.hide()

    def say(self, words: str, colour: U8 | None = None) -> None:
        """Show words with a displayed colour; without words, hide."""
        self.words.setText(words.replace(" %", "\u00a0%"))
        self.swatch.setVisible(colour is not None)
        if colour is not None:
            self.swatch.setPixmap(_patch(self, colour))
        self.setVisible(bool(words))


class PickPanel(QWidget):
    """The tools of the selected pick and its answer, which scrolls.

    Attributes
    ----------
    shape : QWidget
        Reach, softness, lightness and window; it stands elsewhere.
    """

    def __init__(self, session: Session) -> None:
        """Listen to the session."""
        super().__init__()
        self.session = session
        self._newest = Newest("palette4d answer")
        self._waits: object = None  # what an answer was asked for
        self._known: object = None  # what the answer that is shown is for
        self._warned: tuple[str, ...] = ()
        self._here: tuple[int, float] | None = None  # what it takes of the frame that is shown
        self._lacks = False  # that frame was not read yet
        self._revision = -1  # what the warnings are for
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.timeout.connect(self._ask)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(6)
        column.addLayout(self._make_tools())
        self._make_shape()
        answer = QWidget()
        lines = QVBoxLayout(answer)
        lines.setContentsMargins(0, 0, 0, 0)
        lines.setSpacing(6)
        column.addWidget(scrolled(answer), 1)
        self.takes, self.warning = Line(), Line()
        self.takes.button.setText(texts.HERE_TOOL)
        self.takes.button.setToolTip(texts.HERE_TOOL_TIP)
        self.takes.button.setCheckable(True)
        self.takes.button.clicked.connect(lambda on: session.take("here" if on else ""))
        self.notes = [Line() for _ in range(NOTES)]
        for k, line in enumerate(self.notes):
            line.button.clicked.connect(lambda _=False, k=k: self._do(k))
        self.warning.words.setStyleSheet(WARNS)
        for line in (self.takes, *self.notes, self.warning):
            lines.addWidget(line)
        lines.addStretch(1)
        for event in ("document", "selection", "clip"):
            session.on(event, self.refresh, panel=True, follows=lambda: True)
            session.on(event, lambda: self._resting.start(REST))
        session.on("frame", self._moved_on)
        session.on("playing", self._moved_on)
        session.on("pixels", lambda: self._moved_on() if self._lacks else None)
        session.on("answer", self._show_answer)
        session.on("view", self.refresh)
        session.on("tool", self._show_tool)
        self.refresh()

    def _make_tools(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(6)
        self.add, self.hold, self.matte = QPushButton(), QPushButton(), QPushButton()
        for button, text, tip in (
            (self.add, texts.ADD_TO_IT, texts.ADD_TO_IT_TIP),
            (self.hold, texts.HOLD_TOOL, texts.HOLD_TOOL_TIP),
            (self.matte, texts.MATTE_BUTTON, texts.MATTE_TIP),
        ):
            button.setText(text)
            button.setToolTip(tip)
            button.setCheckable(True)
            row.addWidget(button)
        session = self.session
        self.add.clicked.connect(lambda on: session.take("add" if on else ""))
        self.hold.clicked.connect(lambda on: session.take("hold" if on else ""))
        self.matte.clicked.connect(lambda on: session.look(matte=on))
        row.addStretch(1)
        return row

    def _make_shape(self) -> None:
        self.shape = QWidget()
        grid = QGridLayout(self.shape)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(6)
        grid.setVerticalSpacing(2)
        self.bars: dict[str, Bar] = {}
        self.boxes: dict[str, Number] = {}
        for line, (name, text, tip, low, high, step) in enumerate(
            (
                ("reach", texts.REACH, texts.REACH_TIP, -MOST_REACH, MOST_REACH, 0.25),
                ("softness", texts.SOFTNESS, texts.SOFTNESS_TIP, 0.0, 1.0, 0.05),
            )
        ):
            label, bar, box = (
                QLabel(text),
                Bar(text, step),
                Number(text, low, high, step, 2, NUMBERS),
            )
            box.valueChanged.connect(lambda value, name=name: self._typed(name, value))
            bar.moved.connect(lambda value, name=name: self._moved(name, value))
            bar.let_go.connect(self.session.drop)
            label.setBuddy(box)
            _add_row(grid, line, tip, label, bar, box)
            self.bars[name], self.boxes[name] = bar, box
        self.lightness, self.lightness_words = Span(texts.LIGHTNESS_RANGE, 0.05), QLabel()
        label = QLabel(texts.LIGHTNESS_RANGE)
        self.lightness_words.setFixedWidth(NUMBERS)
        self.lightness.moved.connect(lambda span: self._moved("lightness", span))
        self.lightness.let_go.connect(self.session.drop)
        _add_row(grid, 2, texts.LIGHTNESS_TIP, label, self.lightness, self.lightness_words)
        self.whole_hue = QCheckBox(texts.WHOLE_HUE)
        self.whole_hue.setToolTip(texts.WHOLE_HUE_TIP)
        self.whole_hue.clicked.connect(self._toggled)
        self.steady = QCheckBox(texts.SAME_COLOUR)
        self.steady.setToolTip(texts.SAME_COLOUR_TIP)
        self.steady.clicked.connect(self._steadied)
        grid.addWidget(self.steady, 3, 0, 1, 3)
        self.window_rows = WindowRows(self.session, grid, 4, self.whole_hue)
        grid.setColumnStretch(1, 1)

    # ------------------------------------------------------------------------------ what it shows

    def refresh(self) -> None:
        """Show the selected pick or hold."""
        pick = self.session.picked
        self.setVisible(pick is not None)
        self.shape.setVisible(pick is not None and pick.kind == "pick")
        if pick is None:
            return
        self._show_shape(pick)
        self.window_rows.refresh()
        self._show_tool()

    def _show_shape(self, pick: Pick) -> None:
        own = on_screen(self.session, pick.rgb).astype(np.float64)
        ramp = np.linspace(0, 1, SAMPLES)[:, None]
        dark = np.full(3, 40.0)
        colours = (dark + (own - dark) * ramp).astype(np.uint8)
        greys = np.repeat(np.rint(ramp * 255), 3, axis=1).astype(np.uint8)
        self.bars["reach"].show_value(pick.reach, 0.0, -MOST_REACH, MOST_REACH, colours)
        self.bars["softness"].show_value(pick.softness, 0.5, 0.0, 1.0, colours)
        self.lightness.show_span(pick.lightness, greys)
        self.lightness_words.setText("{:.2f} – {:.2f}".format(*pick.lightness))
        for name, box in self.boxes.items():
            box.show_number(getattr(pick, name))
        self.whole_hue.setChecked(pick.whole_hue)
        self.steady.setChecked(pick.toward == "colour")

    def _show_tool(self) -> None:
        self.add.setChecked(self.session.tool == "add")
        self.hold.setChecked(self.session.tool == "hold")
        self.takes.button.setChecked(self.session.tool == "here")
        self.matte.setChecked(self.session.view.matte)

    # --------------------------------------------------------------------------------- what it does

    def _moved(self, name: str, value: float | tuple[float, float]) -> None:
        pick = self.session.picked
        if pick is None:
            return
        if isinstance(value, float):
            value = 0.0 if name == "reach" and abs(value) < SNAP else round(value, 2)
        grade_steps.shape_pick(self.session, pick.id, True, **{name: value})

    def _typed(self, name: str, value: float) -> None:
        pick = self.session.picked
        if pick is not None:
            grade_steps.shape_pick(self.session, pick.id, False, **{name: round(value, 2)})

    def _toggled(self, on: bool) -> None:
        pick = self.session.picked
        if pick is not None:
            said = texts.ITS_HUE if on else texts.ITS_COLOURS
            grade_steps.change_pick(self.session, pick.id, said, whole_hue=on)

    def _steadied(self, on: bool) -> None:
        pick = self.session.picked
        if pick is not None:
            said, toward = (texts.SAME_EVERYWHERE, "colour") if on else (texts.SAME_SHIFT, "shift")
            grade_steps.change_pick(self.session, pick.id, said, toward=toward)

    def _do(self, k: int) -> None:
        """Do what a note of the answer proposes."""
        found = self.session.answer
        if found is None:
            return
        note = found.notes[k]
        if note.window is not None:
            grade_steps.set_window(self.session, note.id, found.frame, note.window)
        if note.place is None:
            return
        at = note.place
        if note.gesture == "hold":
            grade_steps.hold(self.session, Place(at.frame, *at.pixel, at.box, at.rgb))
        else:
            area = Area(at.frame, (at.pixel,), at.box / 2)
            grade_steps.add_area(self.session, note.id, area)

    # ---------------------------------------------------------------------------------- the answer

    @property
    def settled(self) -> bool:
        """Whether the answer of now is shown."""
        return not self._resting.isActive() and self._waits is None

    def _moved_on(self) -> None:
        """Ask again at another frame; while playing, when that ends."""
        if self.session.picked is not None and not self.session.playing:
            self._lacks = False
            self._resting.start(REST)

    def _ask(self) -> None:
        """Ask what the selected pick takes, and what speaks against it."""
        session, pick = self.session, self.session.picked
        document, source = session.document, grade_steps.source_of(session)
        if document is None or pick is None or source is None:
            self._waits = self._known = None
            self._clear()
            return
        # What it takes depends on itself and on holds; its new colour changes nothing.
        own = [
            replace(p, to=None) for p in document.grade.picks if p.kind == "hold" or p.id == pick.id
        ]
        asked, trial = (document, source, own), Document(document.grade)
        known = session.answer if asked == self._known else None
        if known is None and not session.dragging:
            self._known = None
            session.show_answer(None)
            self._clear(texts.LOOKING)
        if session.dragging or session.following:
            return  # the session tells of the document again when that is done
        same = known is not None and self._revision == session.revision
        warned, self._revision, self._waits = self._warned, session.revision, asked
        frame, player = session.frame, session.player
        pixels = None if player is None else player.frame(frame)
        self._lacks = pixels is None

        def work() -> None:
            found, here, told = known, None, warned
            try:
                if pixels is not None and pick.enabled:
                    here = frame, taken_share(pixels, trial, pick.id, frame)
                if not same:
                    told = trial.pick_warnings(pick.id, source)
                if found is None and pick.enabled:
                    found = trial.answer(pick.id, source)
            except Exception as error:  # whatever fails, the window stays
                told = (in_words(error),)
            session.post(lambda: self._answered(asked, found, here, told))

        self._newest.ask(work)

    def _answered(
        self,
        asked: object,
        found: Answer | None,
        here: tuple[int, float] | None,
        warned: tuple[str, ...],
    ) -> None:
        if asked is not self._waits:
            return
        self._waits, self._known, self._warned, self._here = None, asked, warned, here
        self.session.show_answer(found)

    def _clear(self, words: str = "") -> None:
        """Show no answer, but words instead of it."""
        for line in (*self.notes, self.warning):
            line.say("")
        self.takes.button.hide()
        self.takes.say(words)

    def _show_answer(self) -> None:
        found, pick = self.session.answer, self.session.picked
        self._clear()
        told = [f"{_sentence(line)}." for line in self._warned]
        if found is not None and pick is not None:
            says = texts.TAKES if pick.kind == "pick" else texts.KEEPS
            words = says.format(share=percent(found.share), frame=found.frame)
            if not grade_steps.acts_at(self.session, pick, found.frame):
                words = f"{words} {texts.JUDGED}"
            frame, share = self._here or (found.frame, 0.0)
            if frame == self.session.frame != found.frame:
                acts = grade_steps.acts_at(self.session, pick, frame)
                here = texts.HERE if acts else texts.NOT_HERE
                words = f"{words} {here.format(share=percent(share), frame=frame)}"
                self.takes.button.setVisible(acts and bool(pick.path))
            self.takes.say(words)
            for line, note in zip(self.notes, found.notes, strict=False):
                at = note.place
                line.words.setStyleSheet(WARNS if note.warns else "")
                where = "" if at is None else texts.NOTE_AT.format(x=at.pixel[0], y=at.pixel[1])
                line.say(
                    f"{_sentence(note.words)}{where}.",
                    None if at is None else on_screen(self.session, at.rgb),
                )
                line.button.setEnabled(True)
                line.button.setVisible(bool(note.gesture))
                line.button.setText(texts.ADD_GESTURE.get(note.gesture, ""))
                line.button.setToolTip(note.effect)
        self.warning.say("\n".join(told))


def scrolled(content: QWidget) -> QScrollArea:
    """Return an area in which something scrolls up and down."""
    area = QScrollArea()
    area.setWidget(content)
    area.setWidgetResizable(True)
    area.setFrameShape(QScrollArea.Shape.NoFrame)
    area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    area.setMinimumWidth(content.minimumSizeHint().width() + SCROLL_BAR)
    return area


def _sentence(words: str) -> str:
    """Return words that begin with a capital, unless with a name such as p1."""
    return words if words[1:2].isdigit() else f"{words[0].upper()}{words[1:]}"


def _add_row(grid: QGridLayout, line: int, tip: str, *parts: QWidget) -> None:
    for place, part in enumerate(parts):
        part.setToolTip(tip)
        grid.addWidget(part, line, place)


def _patch(widget: QWidget, colour: U8) -> QPixmap:
    """Return a displayed colour with a rim."""
    ratio = widget.devicePixelRatioF()
    picture = QPixmap(SWATCH * ratio)
    picture.setDevicePixelRatio(ratio)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(paint.pen(style.RIM, 1.0))
    painter.setBrush(paint.colour_of(colour))
    painter.drawRoundedRect(QRectF(0.5, 0.5, SWATCH.width() - 1, SWATCH.height() - 1), 2.5, 2.5)
    painter.end()
    return picture
