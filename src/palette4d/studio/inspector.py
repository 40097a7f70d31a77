"""The inspector: the selected colour and what it becomes, and below it the picks and holds.

Its wheel, bars and numbers all choose a colour; what that changes is the scope: the selected
handles, their tracks, or the whole palette.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QButtonGroup,
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from palette4d.colour.oklch import Adjustment, Lch
from palette4d.common.errors import Palette4dError
from palette4d.common.text import hex_of
from palette4d.grade.document import Document, OfClip
from palette4d.grade.edits import RAMPS, as_colour
from palette4d.grade.follow import Progress
from palette4d.grade.picks import Area
from palette4d.plotting import style
from palette4d.studio import grade_steps, texts, theme
from palette4d.studio.choice import Choice
from palette4d.studio.colour_widgets import Bar, Swatch, Wheel
from palette4d.studio.number import Number
from palette4d.studio.pick_list import PickList
from palette4d.studio.pick_panel import PickPanel, scrolled
from palette4d.studio.row_names import row_name
from palette4d.studio.screen_colours import on_screen
from palette4d.studio.session import Session
from palette4d.studio.states import Place
from palette4d.studio.targets import PickTo, Recolour, RecolourMany, Target, target_of

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
Scope = Literal["handle", "track", "palette"]

#: The parts of the height that the colour has, and the lists below it.
UPPER, LOWER = 12, 8
#: Colours of a bar.
SAMPLES = 24


class Inspector(QWidget):
    """The inspector of a session."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        """Listen to the session."""
        super().__init__(parent)
        self.session = session
        self.scope: Scope = "handle"
        self.target: Target | None = None
        self._tried: tuple[float, ...] = ()  # the colour that a drag shows
        self._settled: Target | None = None  # the target without the edit of a drag
        self._hex_of = ""  # what the hex code is of
        self._lch: tuple[str, Lch] | None = None
        self.panel, self.picks = PickPanel(session), PickList(session)
        self._make()
        for event in ("document", "selection", "frame", "view", "clip"):
            session.on(event, self.refresh, panel=True, follows=lambda: True)
        session.on("draft", self._try_again)
        self.refresh()

    # ------------------------------------------------------------------------------------- layout

    def _make(self) -> None:
        content = QWidget()
        column = QVBoxLayout(content)
        column.setContentsMargins(10, 8, 10, 8)
        column.setSpacing(8)
        column.addLayout(self._make_head())
        column.addWidget(self._make_scope())
        column.addLayout(self._make_colour())
        column.addLayout(self._make_hex())
        column.addWidget(self.panel.shape)
        column.addStretch(1)
        # Each half has its height, whatever stands in the other: nothing moves under the pointer.
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.setSpacing(0)
        whole.addWidget(scrolled(content), UPPER)
        self.below = QWidget()
        lists = QVBoxLayout(self.below)
        lists.setContentsMargins(10, 4, 10, 8)
        lists.addWidget(self.picks, 1)
        lists.addWidget(self.panel, 1)
        whole.addWidget(self.below, LOWER)

    def _make_head(self) -> QHBoxLayout:
        row = QHBoxLayout()
        self.swatch = Swatch()
        self.title, self.place = QLabel(), QLabel()
        self.title.setTextFormat(Qt.TextFormat.PlainText)
        self.place.setTextFormat(Qt.TextFormat.PlainText)
        self.title.setStyleSheet(f"color: {theme.BRIGHT}; font-weight: bold")
        self.place.setStyleSheet(f"color: {theme.FAINT}")
        self.place.setWordWrap(True)
        words = QVBoxLayout()
        words.setSpacing(1)
        words.addWidget(self.title)
        words.addWidget(self.place)
        row.addWidget(self.swatch)
        row.addSpacing(4)
        row.addLayout(words, 1)
        return row

    def _make_scope(self) -> QWidget:
        self.scope_row = QWidget()
        row = QHBoxLayout(self.scope_row)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        group = QButtonGroup(self)
        self.scopes: dict[Scope, QToolButton] = {}
        for name, text in texts.SCOPES.items():
            button = QToolButton()
            button.setText(text)
            button.setCheckable(True)
            button.setToolTip(texts.SCOPE_TIPS[name])
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            button.clicked.connect(lambda _=False, name=name: self.set_scope(name))
            group.addButton(button)
            row.addWidget(button)
            self.scopes[name] = button
        self.scopes["handle"].setChecked(True)
        self.ramp = Choice()
        self.ramp.setSizeAdjustPolicy(
            QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon
        )
        self.ramp.setMinimumContentsLength(8)
        self.ramp.setAccessibleName(texts.RAMP)
        self.ramp.setToolTip(texts.RAMP_TIP)
        self.ramp.addItem(texts.RAMP_OF_CLIP, None)
        for ramp in RAMPS:
            self.ramp.addItem(f"{texts.RAMP}: {texts.RAMPS[ramp]}", ramp)
        self.ramp.activated.connect(self._ramp_chosen)
        row.addSpacing(6)
        row.addWidget(self.ramp)
        return self.scope_row

    def _make_colour(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(10)
        self.wheel = Wheel()
        self.wheel.setAccessibleName(texts.WHEEL)
        self.wheel.setToolTip(texts.WHEEL_TIP)
        self.wheel.moved.connect(self._wheel_moved)
        self.wheel.let_go.connect(self.keep)
        row.addWidget(self.wheel, 0, Qt.AlignmentFlag.AlignTop)
        grid = QGridLayout()
        grid.setHorizontalSpacing(4)
        grid.setVerticalSpacing(2)
        self.bars: dict[str, Bar] = {}
        self.boxes: dict[str, Number] = {}
        for line, (name, (text, step, decimals)) in enumerate(
            {
                "L": (texts.LIGHTNESS, 0.005, 3),
                "C": (texts.CHROMA, 0.005, 3),
                "h": (texts.HUE, 1.0, 1),
                "R": (texts.RED, 0.005, 4),
                "G": (texts.GREEN, 0.005, 4),
                "B": (texts.BLUE, 0.005, 4),
            }.items()
        ):
            label = QLabel(name)
            label.setToolTip(text)
            bar, box = Bar(text, step), Number(text, -1e6, 1e6, step, decimals, 60)
            bar.setToolTip(text)
            box.valueChanged.connect(lambda value, name=name: self._typed(name, value))
            bar.moved.connect(lambda value, name=name: self._bar_moved(name, value))
            bar.let_go.connect(self.keep)
            label.setBuddy(box)
            for place, part in enumerate((label, bar, box)):
                grid.addWidget(part, line + (line >= 3), place)
            self.bars[name], self.boxes[name] = bar, box
        grid.setRowMinimumHeight(3, 4)
        grid.setColumnStretch(1, 1)
        row.addLayout(grid, 1)
        return row

    def _make_hex(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(6)
        self.hex, self.hex_label, self.shown_hex = QLineEdit(), QLabel(texts.HEX), QLabel()
        self.hex.setFixedWidth(74)
        self.hex.setAccessibleName(texts.HEX)
        self.hex.setToolTip(texts.HEX_TIP)
        self.hex.editingFinished.connect(self._hex_typed)
        self.hex_label.setBuddy(self.hex)
        self.shown_hex.setStyleSheet(f"color: {theme.FAINT}")
        self.shown_hex.setToolTip(texts.SHOWN_TIP)
        self.shown_hex.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.shown_hex.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.dropper = QPushButton(texts.EYEDROPPER)
        self.dropper.setCheckable(True)
        self.dropper.setToolTip(texts.EYEDROPPER_TIP)
        self.reset = QPushButton(texts.RESET_SHORT)
        self.reset.setToolTip(texts.RESET)
        self.reset.clicked.connect(lambda: grade_steps.reset(self.session))
        for part in (self.hex_label, self.hex, self.dropper, self.reset):
            row.addWidget(part)
        row.addWidget(self.shown_hex, 1)
        return row

    # ----------------------------------------------------------------------------- what it shows

    @property
    def lch(self) -> Lch:
        """The conversion of the document's palette."""
        document = self.session.document
        encoding = "unknown" if document is None else document.grade.encoding
        if self._lch is None or self._lch[0] != encoding:
            self._lch = encoding, Lch(encoding)
        return self._lch[1]

    def refresh(self) -> None:
        """Show the selected colour."""
        document, session = self.session.document, self.session
        targets = []
        if document is not None:
            found = (target_of(document, id_, session.frame) for id_ in session.selection)
            targets = [target for target in found if target is not None]
            if session.place is not None and session.place.frame == session.frame:
                targets = [self._target_at(document, session.place)]
        self.target = targets[0] if targets else None
        if not session.dragging:
            self._settled, self._tried = self.target, ()
        if not session.dragging:  # they are the same during a drag
            self._show_words(len(session.selection))
            self._show_ramp()
        self._show_colour(targets[1:])
        self.below.setVisible(not self.picks.isHidden() or not self.panel.isHidden())

    def _show_words(self, count: int) -> None:
        target = self.target
        on = target is not None and target.kind != "hold"
        parts = (self.wheel, self.hex, self.dropper, *self.bars.values())
        for part in (*parts, *self.boxes.values()):
            part.setEnabled(on)
        document = self.session.document
        for part in self.scopes.values():
            part.setEnabled(target is not None)
        self.scope_row.setVisible(target is None or not target.picked)
        self.reset.setVisible(
            document is not None
            and any(id_ in document.grade.settings for id_ in self.session.selection)
        )
        if target is None:
            self.title.setText(texts.NOTHING_SELECTED)
            self.place.setText(texts.SELECT_HINT if self.session.document is not None else "")
            return
        kinds = {
            "vertex": texts.VERTEX,
            "stop": texts.STOP,
            "edge": texts.EDGE,
            "pick": texts.PICK,
            "hold": texts.HOLD,
            "place": texts.PLACE_HINT,
        }
        more = texts.AND_MORE.format(count=count - 1) if count > 1 else ""
        name, called = target.id, ""
        if document is not None:
            called = document.grade.colour_names.get(target.id) or document.grade.called(target.id)
            if target.kind == "edge":
                name = row_name(document, target.id)
        if target.place is not None:
            name = texts.PLACE.format(x=target.place.x, y=target.place.y)
        self.title.setText(f"{name}{more}")
        where = f"{texts.FRAME} {style.number(target.frame)}"
        self.place.setText(" · ".join(filter(None, (called, kinds[target.kind], where))))

    def shown(self, rgb: F64) -> U8:
        """Return what the screen shows of code values of the palette."""
        return on_screen(self.session, rgb)

    def _show_colour(self, others: list[Target]) -> None:
        target = self.target
        if target is None:
            grey = np.full(3, 0x32, np.uint8)
            self.swatch.show_colours(grey, grey, ("", ""))
            self.hex.clear()
            self.shown_hex.clear()
            for box in self.boxes.values():
                box.clear()
            return
        before, after = self.shown(np.stack([target.before, target.after]))
        self.swatch.show_colours(before, after, (texts.BEFORE, texts.AFTER))
        lch = self.lch
        now, origin = lch.of(target.after), lch.of(target.before)
        if now[1] < 1e-4:  # a grey keeps the hue that it had
            now[2] = origin[2]
        convert = (lch, self.shown, (self._lch and self._lch[0], self.session.looked))
        self.wheel.show_colour(now, origin, [lch.of(o.after) for o in others], convert)
        self._show_bars(now, origin, target)
        typing = self.hex.hasFocus() and self.hex.isModified() and self._hex_of == target.id
        if not typing:
            self.hex.setText(hex_of(self.in_clip(target.after).tolist()).rstrip("*"))
        self._hex_of = target.id
        self.shown_hex.setText(f"{texts.ON_SCREEN} #{bytes(after.tolist()).hex()}")

    def _show_bars(self, now: F64, origin: F64, target: Target) -> None:
        lch = self.lch
        limits = {
            "L": (0.0, max(1.0, float(now[0]) * 1.25, float(origin[0]) * 1.25)),
            "C": (0.0, max(0.33, float(now[1]) * 1.1)),
            "h": (0.0, 360.0),
        }
        ranges = []
        for k, name in enumerate("LCh"):
            range_ = np.repeat(now[None], SAMPLES, axis=0)
            range_[:, k] = np.linspace(*limits[name], SAMPLES)
            ranges.append(range_)
        ranges = [*lch.fitted(np.stack(ranges))]
        both = np.concatenate([target.before, target.after])
        for k, name in enumerate("RGB"):
            limits[name] = min(0.0, float(both.min())), max(1.0, float(both.max()))
            range_ = np.repeat(target.after[None], SAMPLES, axis=0)
            range_[:, k] = np.linspace(*limits[name], SAMPLES)
            ranges.append(range_)
        colours = self.shown(np.stack(ranges))
        values = [
            *zip("LCh", now, origin, strict=True),
            *zip("RGB", target.after, target.before, strict=True),
        ]
        for (name, value, was), own in zip(values, colours, strict=True):
            self.bars[name].show_value(float(value), float(was), *limits[name], own)
            self.boxes[name].show_number(float(value))

    def _show_ramp(self) -> None:
        document, target = self.session.document, self.target
        own = None
        if document is not None and target is not None and target.id in document.grade.settings:
            own = document.grade.settings[target.id].ramp
        can = target is None or target.kind in ("vertex", "stop")
        self.ramp.setEnabled(document is not None and can)
        shown = own
        if target is None and document is not None:
            shown = document.grade.ramp
        self.ramp.setCurrentIndex(max(0, self.ramp.findData(shown)))

    def in_clip(self, rgb: F64) -> F64:
        """Return code values of the clip for code values of the palette."""
        document = self.session.document
        own = None if document is None else document.grade.core.conversion
        return rgb if own is None else np.asarray(own.steps.to_clip(rgb))

    def in_palette(self, rgb: F64) -> F64:
        """Return code values of the palette for code values of the clip."""
        document = self.session.document
        own = None if document is None else document.grade.core.conversion
        return rgb if own is None else np.asarray(own.steps.to_palette(rgb))

    # --------------------------------------------------------------------------------- what it does

    def set_scope(self, scope: Scope) -> None:
        """Choose what a new colour changes."""
        self.scope = scope
        self.scopes[scope].setChecked(True)

    def operation(
        self, rgb: F64, change: Adjustment | None = None
    ) -> Callable[[Document], object] | None:
        """Return the edit that gives the inspected colour a new colour, within the scope.

        `change` is how the colour was changed, where that was a change of hue, chroma or lightness:
        other colours of the scope change in the same way. Otherwise they move by as much.
        """
        target = self._settled or self.target
        if target is None:
            return None
        new = tuple(rgb.tolist())
        if target.picked:
            return PickTo(target, new, self.session.draft)
        if self.scope == "handle":
            return Recolour(target, self.session.selection, float(self.session.frame), new)
        return RecolourMany(target, self.scope == "track", new, change)

    def try_colour(self, rgb: F64, change: Adjustment | None = None) -> None:
        """Show a colour without keeping it; `session.drop` keeps it."""
        operation = self.operation(rgb, change)
        if operation is not None:
            self._tried = tuple(rgb.tolist())
            self.session.drag(operation, self._said())

    def set_colour(self, rgb: F64, change: Adjustment | None = None) -> None:
        """Give the inspected colour a new colour."""
        operation = self.operation(rgb, change)
        if operation is None:
            return
        if self.target is not None and self.target.place is not None:
            self.try_colour(rgb, change)
            self.keep()
        else:
            self.session.edit(operation, self._said())

    def keep(self) -> None:
        """Keep the colour that is shown: a new pick follows its colour through the clip first."""
        target = self._settled
        if target is None or target.place is None:
            self.session.drop()
            return
        if not self.session.dragging:
            return
        place, to = target.place, self._tried

        def pick(document: Document, clip: OfClip | None, progress: Progress | None) -> str:
            if clip is None:
                made = document.pick(place.frame, colour=place.colour, to=to, any_value=True)
            else:
                made = document.pick(
                    place.frame,
                    pixel=(place.x, place.y),
                    box=place.box,
                    to=to,
                    clip=clip,
                    any_value=True,
                    progress=progress,
                )
            return made.id

        unread = self.session.unread(place)
        self.session.edit_later(pick, texts.PICKED, self.session.select, unread)

    def pick(self, place: Place) -> None:
        """Inspect a pixel of the clip; a new colour for it becomes a pick.

        With the pipette, the selected colour becomes the pixel's colour. With the tool "here", the
        selected pick goes through the pixel.
        """
        if self.session.tool == "here" and self.session.picked is not None:
            self.session.take("")
            grade_steps.correct_path(self.session, self.session.picked.id, place)
            return
        if self.dropper.isChecked() and self.target is not None:
            self.dropper.setChecked(False)
            self.set_colour(np.asarray(place.colour))
            return
        self.session.begin_pick(place)

    def ask_colour(self) -> None:
        """Have the keyboard type the new colour."""
        self.hex.setFocus()
        self.hex.selectAll()

    def hold(self, place: Place) -> None:
        """Hold the colour of a pixel."""
        self.session.take("")
        grade_steps.hold(self.session, place)

    def add_area(self, area: Area) -> None:
        """Add a box or a stroke to the selected pick."""
        if self.session.picked is not None:
            grade_steps.add_area(self.session, self.session.picked.id, area)

    def _try_again(self) -> None:
        """Show the colour that was tried before the pixel's pick was learned."""
        if self._tried and self.session.dragging:
            self.try_colour(np.asarray(self._tried))

    def _target_at(self, document: Document, place: Place) -> Target:
        """Return the target of a pixel, with the colour that the edits give it."""
        before = np.asarray(place.colour, dtype=np.float64)
        if self._tried and self.session.dragging:
            return Target("", "place", place.frame, before, np.asarray(self._tried), place)
        pixel = before.astype(np.float32).reshape(1, 1, 3)
        width, height = document.grade.members["clip"]["size"]
        picture = -int(place.x), -int(place.y), width, height
        drawn = document.recolour(pixel, place.frame, space="palette", picture=picture)
        after = drawn[0, 0].astype(np.float64)
        return Target("", "place", place.frame, before, after, place)

    def _said(self) -> str:
        name = self.target.id if self.target is not None else ""
        if self.target is not None and self.target.picked:
            new = self.target.kind == "place"
            return texts.PICKED if new else texts.PICK_SET.format(id=name)
        return texts.SET_BY_SCOPE[self.scope].format(id=name)

    def _start(self) -> F64:
        """Return lightness, chroma and hue of the inspected colour, as it is without a drag."""
        start = self._settled if self._settled is not None else self.target
        assert start is not None
        lch = self.lch.of(start.after)
        if lch[1] < 1e-4:
            lch[2] = self.wheel.lch[2]
        return lch

    def _change_to(self, lch: F64) -> tuple[F64, Adjustment | None]:
        """Return the colour of new lightness, chroma and hue, and the change to it."""
        start = self._start()
        change = None
        if start[0] > 1e-3 and (start[1] > 1e-3 or lch[1] < 1e-3):
            change = Adjustment(
                hue=float((lch[2] - start[2] + 180) % 360 - 180),
                chroma=float(lch[1] / max(start[1], 1e-3)),
                lightness=float(lch[0] / start[0]),
            )
        return self.lch.fitted(lch), change

    def _wheel_moved(self, value: tuple[float, float]) -> None:
        if self.target is not None:
            self.try_colour(*self._change_to(np.array([self.wheel.lch[0], *value])))

    def _with(self, name: str, value: float) -> tuple[F64, Adjustment | None]:
        """Return the inspected colour with one of its numbers changed, and the change."""
        assert self.target is not None
        if name in "RGB":
            rgb = self.target.after.copy()
            rgb["RGB".index(name)] = value
            return rgb, None
        lch = self.wheel.lch.copy()
        lch["LCh".index(name)] = value % 360 if name == "h" else max(value, 0.0)
        return self._change_to(lch)

    def _bar_moved(self, name: str, value: float) -> None:
        if self.target is not None:
            self.try_colour(*self._with(name, value))

    def _typed(self, name: str, value: float) -> None:
        if self.target is not None:
            self.set_colour(*self._with(name, value))

    def _hex_typed(self) -> None:
        if self.target is None or not self.hex.isModified():
            return
        self.hex.setModified(False)
        text = self.hex.text().strip()
        try:
            rgb = as_colour(text if text.startswith("#") else f"#{text}")
        except Palette4dError as error:
            self.session.report(error)
            self.refresh()
            return
        self.set_colour(self.in_palette(np.asarray(rgb)))

    def _ramp_chosen(self, index: int) -> None:
        document = self.session.document
        if document is not None:
            grade_steps.set_ramp(self.session, self.ramp.itemData(index) or document.grade.ramp)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape takes a drag back."""
        if event.key() == Qt.Key.Key_Escape and self.session.dragging:
            self.session.cancel()
            return
        super().keyPressEvent(event)
