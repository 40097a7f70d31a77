"""The window of the selected pick as numbers: on or off, where it is, and its feather."""

import numpy as np
from PySide6.QtCore import QObject, Qt, QTimer
from PySide6.QtWidgets import (
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QWidget,
)

from palette4d.grade.picks import MOST_PIXELS, Window
from palette4d.plotting import style
from palette4d.studio import grade_steps, texts, theme
from palette4d.studio.colour_widgets import Bar
from palette4d.studio.number import Number
from palette4d.studio.session import Session

#: The width of a number, and of that beside the bar, which is as those of the panel.
NUMBER, BESIDE = 54, 72
#: A typed box is followed through the clip when no number has changed for so many milliseconds.
REST = 600
#: Greys of the feather's bar.
GREYS = np.repeat(np.linspace(40, 200, 24).astype(np.uint8)[:, None], 3, axis=1)


class WindowRows(QObject):
    """The rows of a pick's panel for its window.

    Parameters
    ----------
    session : Session
    grid : QGridLayout
        The panel's rows: a name, a bar, a number.
    line : int
        The first row that is free.
    beside : QWidget
        Stands beside the switch.
    """

    def __init__(self, session: Session, grid: QGridLayout, line: int, beside: QWidget) -> None:
        super().__init__()
        self.session = session
        self._typed: tuple[str, float] | None = None  # the pick and the frame of a typed box
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.timeout.connect(session.keep_typed)
        self.on = QCheckBox(texts.WINDOW)
        self.on.setToolTip(texts.WINDOW_TIP)
        self.on.clicked.connect(self._switched)
        self.invert = QCheckBox(texts.INVERT)
        self.invert.setToolTip(texts.INVERT_TIP)
        self.invert.clicked.connect(self._inverted)
        switches = QHBoxLayout()
        switches.addWidget(self.on)
        switches.addWidget(self.invert)
        switches.addStretch(1)
        switches.addWidget(beside)
        grid.addLayout(switches, line, 0, 1, 3)
        grid.addLayout(self._make_numbers(), line + 1, 0, 1, 3)
        self.label, self.bar = QLabel(texts.FEATHER), Bar(texts.FEATHER, 1.0)
        self.feather = Number(texts.FEATHER, 0, MOST_PIXELS, 1, 1, BESIDE)
        self.feather.valueChanged.connect(self._feather_typed)
        self.bar.moved.connect(self._feather_moved)
        self.bar.let_go.connect(session.drop)
        self.label.setBuddy(self.feather)
        for place, part in enumerate((self.label, self.bar, self.feather)):
            part.setToolTip(texts.FEATHER_TIP)
            grid.addWidget(part, line + 2, place)
        self.lost = QLabel()
        self.lost.setTextFormat(Qt.TextFormat.PlainText)
        self.lost.setWordWrap(True)
        self.lost.setStyleSheet(f"color: {theme.WARNING}")
        grid.addWidget(self.lost, line + 3, 0, 1, 3)
        self.remove = QPushButton()
        self.remove.setToolTip(texts.REMOVE_BOX_TIP)
        self.remove.clicked.connect(self._remove_box)
        grid.addWidget(self.remove, line + 4, 0, 1, 3, Qt.AlignmentFlag.AlignLeft)
        session.on("frame", self.refresh, panel=True)

    def _make_numbers(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(3)
        self.numbers: dict[str, Number] = {}
        self._names = []
        for name, (short, what) in texts.WINDOW_NUMBERS.items():
            least = 1 if name in ("width", "height") else -MOST_PIXELS
            label, box = QLabel(short), Number(what, least, MOST_PIXELS, 1, 0, NUMBER)
            box.valueChanged.connect(lambda value, name=name: self._number_typed(name, value))
            label.setBuddy(box)
            for part in (label, box):
                part.setToolTip(what)
                row.addWidget(part)
            row.addStretch(1)
            self.numbers[name] = box
            self._names.append(label)
        return row

    def refresh(self) -> None:
        """Show the window of the selected pick at the playhead."""
        pick = self.session.picked
        if pick is None:
            return
        window, document = pick.window, self.session.document
        lost = (None, None) if document is None else pick.lost(document.grade.frames)
        told = [
            text.format(frame=style.number(frame))
            for text, frame in zip(texts.WINDOW_LOST, lost, strict=True)
            if frame is not None
        ]
        self.lost.setText("\n".join(told))
        self.lost.setVisible(bool(told))
        boxes = [] if window is None else [key.frame for key in window.given.keys]
        self.remove.setText(texts.REMOVE_BOX.format(frame=self.session.frame))
        self.remove.setVisible(len(boxes) > 1 and self.session.frame in boxes)
        shape = (self.invert, self.label, self.bar, self.feather)
        for part in (*self._names, *self.numbers.values(), *shape):
            part.setVisible(window is not None)
        self.on.setChecked(window is not None)
        if window is None:
            return
        for name, value in self._numbers_of(window).items():
            self.numbers[name].show_number(value)
        self.invert.setChecked(window.inverted)
        self.feather.show_number(window.feather)
        self.bar.show_value(window.feather, 0.0, 0.0, self._most(), GREYS)

    def _numbers_of(self, window: Window) -> dict[str, float]:
        """Return the numbers of a window at the playhead."""
        left, top, right, bottom = window.box_at(self.session.frame).tolist()
        return {"x": left, "y": top, "width": right - left, "height": bottom - top}

    def _most(self) -> float:
        """Return the largest feather of the bar: the frame's smaller side."""
        document = self.session.document
        clip = {"width": 1, "height": 1} if document is None else document.grade.core.clip
        return float(min(clip["width"], clip["height"]))

    # --------------------------------------------------------------------------------- what it does

    def _switched(self, on: bool) -> None:
        pick = self.session.picked
        if pick is None:
            return
        if on:
            grade_steps.set_window(
                self.session, pick.id, *grade_steps.first_box(self.session, pick)
            )
        else:
            grade_steps.remove_window(self.session, pick.id)

    def _inverted(self, on: bool) -> None:
        pick = self.session.picked
        if pick is not None and pick.window is not None:
            grade_steps.invert_window(self.session, pick.id, on)

    def _remove_box(self) -> None:
        pick = self.session.picked
        if pick is not None:
            grade_steps.remove_box(self.session, pick.id, self.session.frame)

    def _feather_moved(self, value: float) -> None:
        pick = self.session.picked
        if pick is not None:
            soft = max(0.0, float(round(value)))
            grade_steps.feather_window(self.session, pick.id, soft, dragging=True)

    def _feather_typed(self, value: float) -> None:
        pick = self.session.picked
        if pick is not None:
            grade_steps.feather_window(self.session, pick.id, value)

    def _number_typed(self, name: str, value: float) -> None:
        """Show the window there, and follow it when no other number comes."""
        pick = self.session.picked
        if pick is None or pick.window is None:
            return
        x, y, width, height = {**self._numbers_of(pick.window), name: value}.values()
        where = pick.id, self.session.frame
        if where != self._typed:
            self.session.keep_typed()
        self._typed = where
        box = x, y, x + width, y + height
        grade_steps.drag_window(self.session, *where, box, typed=True)
        self._resting.start(REST)
