"""Dialogs of the long work: options, the command line that does the same, progress, and a stop."""

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFontDatabase, QGuiApplication
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QFileDialog,
    QFormLayout,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QMessageBox,
    QPlainTextEdit,
    QProgressBar,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from palette4d.studio import texts, theme
from palette4d.studio.choice import Choice, SearchChoice
from palette4d.studio.job import Job, command_line
from palette4d.studio.paths import sequence_of

FieldKind = Literal["text", "words", "values", "save", "open", "folder", "choice", "check"]
Entry = QLineEdit | QComboBox | QCheckBox

#: Options that a button enters and runs with at once: nothing is lost by them.
RUN_AT_ONCE = ("--allow-cuts", "--skip-bad-frames")
#: Buttons of offers side by side, so that their words have room.
OFFERS_IN_ROW = 3


@dataclass(frozen=True)
class Field:
    """One option of a verb.

    Attributes
    ----------
    flag : str
        The option; "" is the verb's own argument.
    text : str
        Its label, if `texts.FIELDS` has none.
    kind : str
        How it is entered; "words" repeats the option for each word, "values" gives all words.
    value : str
        Its first value; "yes" ticks a check box.
    choices : tuple of str
        The choices; "" leaves the option out.
    hint : str
        Shown where the field is empty.
    names : tuple of str
        What the choices are called, if not by their values.
    listed : callable, optional
        Returns a list of values for the dialog, which can be searched.
    more : bool
        It is shown by *More* only.
    """

    flag: str
    text: str = ""
    kind: FieldKind = "text"
    value: str = ""
    choices: tuple[str, ...] = ()
    hint: str = ""
    names: tuple[str, ...] = ()
    listed: "Callable[[VerbDialog], Iterable[str]] | None" = None
    more: bool = False

    @property
    def label(self) -> str:
        """Its label."""
        return self.text or texts.FIELDS[self.flag.lstrip("-").replace("-", "_")]


class VerbDialog(QDialog):
    """Runs one verb; it tells when that is about to start.

    Parameters
    ----------
    title : str
        The window's title.
    verb : str
        The verb of the command line.
    fields : sequence of Field
        Its options, in the order of the command line.
    post : callable
        Runs a function on the window's thread.
    done : callable, optional
        Called with the dialog after a success.
    refused : callable, optional
        Called before the verb runs; returns why it must not, or "".

    Attributes
    ----------
    notes : str
        The notes and warnings of the verb, a line each.
    advised : list of str
        The options that these name.
    """

    started = Signal()

    def __init__(
        self,
        parent: QWidget,
        title: str,
        verb: str,
        fields: Sequence[Field],
        post: Callable[[Callable[[], object]], object],
        done: Callable[["VerbDialog"], object] | None = None,
        refused: Callable[[], str] = str,
    ) -> None:
        """Make the form."""
        super().__init__(parent)
        self.setWindowTitle(title)
        self.setMinimumWidth(760)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.verb, self.fields = verb, tuple(sorted(fields, key=lambda field: field.more))
        self.job: Job | None = None
        self.notes, self.advised = "", list[str]()
        self._post, self._done, self._refused = post, done, refused
        self.inputs: list[Entry] = []
        column = QVBoxLayout(self)
        column.setContentsMargins(16, 14, 16, 14)
        column.setSpacing(10)
        self.form = form = QFormLayout()
        form.setLabelAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        form.setHorizontalSpacing(12)
        form.setVerticalSpacing(7)
        column.addLayout(form)
        for field in self.fields:
            form.addRow(*self._row(field))
        self.more = QToolButton()
        self.more.setText(texts.MORE)
        self.more.setCheckable(True)
        self.more.setArrowType(Qt.ArrowType.RightArrow)
        self.more.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.more.toggled.connect(self._show_more)
        if any(field.more for field in fields):
            column.addWidget(self.more)
        self._show_more(False)
        caption = QLabel(texts.SAME_COMMAND)
        caption.setStyleSheet(f"color: {theme.FAINT}")
        column.addWidget(caption)
        line = QHBoxLayout()
        self.command = QPlainTextEdit()
        self.command.setReadOnly(True)
        self.command.setTabChangesFocus(True)
        self.command.setFont(theme.numbers_font())
        self.command.setFixedHeight(2 * self.command.fontMetrics().lineSpacing() + 14)
        line.addWidget(self.command)
        copy = QPushButton(texts.COPY)
        copy.setAutoDefault(False)
        copy.clicked.connect(
            lambda: QGuiApplication.clipboard().setText(self.command.toPlainText())
        )
        line.addWidget(copy)
        column.addLayout(line)
        self.bar = QProgressBar()
        self.bar.setTextVisible(False)
        self.bar.setFixedHeight(8)
        self.stage = QLabel()
        self.stage.setTextFormat(Qt.TextFormat.PlainText)
        self.stage.setWordWrap(True)
        self.log = QPlainTextEdit()
        self.log.setReadOnly(True)
        self.log.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.log.setFixedHeight(130)
        for widget in (self.bar, self.stage, self.log):
            widget.hide()
            column.addWidget(widget)
        self.offers: list[QPushButton] = []
        self._offered = QGridLayout()
        column.addLayout(self._offered)
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        self.stop = QPushButton(texts.CLOSE)
        self.stop.setAutoDefault(False)
        self.stop.clicked.connect(self._stop_or_close)
        self.go = QPushButton(title.rstrip("…"))
        self.go.setDefault(True)
        self.go.clicked.connect(self.start)
        buttons.addWidget(self.stop)
        buttons.addWidget(self.go)
        column.addLayout(buttons)
        self._show_command()

    def _row(self, field: Field) -> tuple[QLabel, QWidget]:
        label = QLabel(field.label)
        if field.kind == "check":
            check = QCheckBox()
            check.setChecked(field.value == "yes")
            check.toggled.connect(self._show_command)
            self.inputs.append(check)
            check.setAccessibleName(field.label)
            return label, check
        if field.kind == "choice":
            choice = Choice()
            for name, each in zip(field.names or field.choices, field.choices, strict=True):
                choice.addItem(name or field.hint, each)
            choice.setCurrentIndex(max(0, choice.findData(field.value)))
            choice.currentIndexChanged.connect(self._show_command)
            self.inputs.append(choice)
            choice.setAccessibleName(field.label)
            return label, choice
        if (listed := field.listed) is not None:
            search = SearchChoice(field.value, field.hint, lambda: listed(self))
            search.editTextChanged.connect(self._show_command)
            self.inputs.append(search)
            search.setAccessibleName(field.label)
            return label, search
        line = QLineEdit(field.value)
        line.setPlaceholderText(field.hint)
        line.textChanged.connect(self._show_command)
        line.setAccessibleName(field.label)
        self.inputs.append(line)
        if field.kind in ("text", "words", "values"):
            return label, line
        box = QWidget()
        row = QHBoxLayout(box)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(line)
        choose = QPushButton(texts.CHOOSE)
        choose.setAutoDefault(False)
        choose.clicked.connect(lambda: self._choose(line, field))
        row.addWidget(choose)
        return label, box

    def _show_more(self, shown: bool) -> None:
        """Show or hide the options that are seldom needed."""
        arrow = Qt.ArrowType.DownArrow if shown else Qt.ArrowType.RightArrow
        self.more.setArrowType(arrow)
        for row, field in enumerate(self.fields):
            self.form.setRowVisible(row, shown or not field.more)
        self.adjustSize()

    def _choose(self, line: QLineEdit, field: Field) -> None:
        if field.kind == "folder":
            found = QFileDialog.getExistingDirectory(self, field.label, line.text())
        elif field.kind == "save":
            found = QFileDialog.getSaveFileName(self, field.label, line.text())[0]
        else:
            found = sequence_of(QFileDialog.getOpenFileName(self, field.label, line.text())[0])
        if found:
            line.setText(found)

    def words(self) -> list[str]:
        """Return the verb and its arguments, in the order of the command line."""
        words = [self.verb]
        for field, entry in zip(self.fields, self.inputs, strict=True):
            if isinstance(entry, QCheckBox):
                words += [field.flag] if entry.isChecked() else []
                continue
            value = value_of(entry)
            each = value.split() if field.kind in ("words", "values") else [value] if value else []
            if field.kind == "words":
                words += [word for one in each for word in (field.flag, one)]
            else:
                words += [field.flag, *each] if field.flag and each else each
        return words

    def entry(self, flag: str) -> Entry:
        """Return where an option is entered, the first of those with this flag."""
        pairs = zip(self.fields, self.inputs, strict=True)
        return next(widget for field, widget in pairs if field.flag == flag)

    def value(self, flag: str) -> str:
        """Return the text that was entered for an option."""
        return value_of(self.entry(flag))

    def go_to(self, flag: str) -> None:
        """Show where an option is entered."""
        entry = self.entry(flag)
        if any(field.more for field in self.fields if field.flag == flag):
            self.more.setChecked(True)
        entry.setFocus()

    def _show_command(self) -> None:
        self.command.setPlainText(command_line(self.words()))

    def start(self) -> None:
        """Run the verb."""
        if why := self._refused():
            self.stage.setText(why)
            self.stage.show()
            return
        self.started.emit()
        self.log.clear()
        for button in self.offers:
            button.deleteLater()
        self.offers.clear()
        self.bar.setRange(0, 0)
        for widget in (self.bar, self.stage, self.log):
            widget.show()
        self.stage.setText(texts.RUNNING)
        self.go.setEnabled(False)
        self.stop.setText(texts.STOP_JOB)
        for entry in self.inputs:
            entry.setEnabled(False)
        self.job = Job(self.words(), lambda job: self._post(lambda: self._changed(job)))

    def _changed(self, job: Job) -> None:
        if job is not self.job:
            return
        try:
            if job.fraction is not None and not job.cancelled:
                self.bar.setRange(0, 1000)
                self.bar.setValue(round(job.fraction * 1000))
                self.stage.setText(f"{job.what} {job.fraction:.0%}")
            self.log.setPlainText((job.messages + job.output).strip())
            if job.status is None:
                return
            self.bar.setRange(0, 1000)
            self.bar.setValue(1000 if job.status == 0 else 0)
            if job.cancelled:
                self.stage.setText(texts.CANCELLED)
            else:
                self.stage.setText(texts.DONE if job.status == 0 else texts.FAILED)
            self.go.setEnabled(True)
            if not job.cancelled:
                self.offer(job.advised)
            self.stop.setText(texts.CLOSE)
            for entry in self.inputs:
                entry.setEnabled(True)
        except RuntimeError:  # the dialog was closed
            return
        self.job, self.notes, self.advised = None, "\n".join(job.notes), job.advised
        if job.status == 0 and self._done is not None:
            self._done(self)

    def offer(self, advised: Sequence[str]) -> None:
        """Show a button for each option that the messages advise, if it has a field here.

        Those that leave nothing to be chosen come first.
        """
        at_once = [each for each in advised if each.partition(" ")[0] in RUN_AT_ONCE]
        for option in dict.fromkeys([*at_once, *advised]):
            flag, _, value = option.partition(" ")
            for field, entry in zip(self.fields, self.inputs, strict=True):
                if flag == field.flag or option in field.choices:
                    text = texts.OFFERS.get(flag, f"{field.label}: {value}" if value else "")
                    button = QPushButton(text or field.label)
                    button.setAutoDefault(False)
                    take = functools.partial(self._take, field, entry, value or option)
                    button.clicked.connect(take)
                    self._offered.addWidget(button, *divmod(len(self.offers), OFFERS_IN_ROW))
                    self.offers.append(button)

    def _take(self, field: Field, entry: Entry, value: str) -> None:
        """Go to an entry, and enter the advised value if there is one; run if that is all."""
        self.more.setChecked(self.more.isChecked() or field.more)
        entry.setFocus()
        if isinstance(entry, QCheckBox):
            entry.setChecked(True)
        elif value.startswith("--") and value not in field.choices:
            return  # which value, only the user knows
        elif isinstance(entry, SearchChoice):
            entry.setEditText(value)
        elif isinstance(entry, QComboBox):
            entry.setCurrentIndex(max(0, entry.findData(value)))
        elif field.kind == "words":
            name = value.split("=")[0]
            kept = [word for word in entry.text().split() if word.split("=")[0] != name]
            entry.setText(" ".join([*kept, value]))
        else:
            entry.setText(value)
        if field.flag in RUN_AT_ONCE:
            self.start()

    def _stop_or_close(self) -> None:
        if self.job is None:
            self.close()
        elif not self.job.cancelled:
            self.job.cancel()
            self.stage.setText(texts.STOPPING)

    def reject(self) -> None:
        """Ask before what runs is stopped, and stay to say that it was; else close."""
        if self.job is None:
            super().reject()
            return
        asks = QMessageBox(self)
        asks.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        asks.setText(texts.STOP_ASKED)
        stop = asks.addButton(texts.STOP_JOB, QMessageBox.ButtonRole.DestructiveRole)
        asks.setDefaultButton(asks.addButton(texts.GO_ON, QMessageBox.ButtonRole.RejectRole))
        stop.clicked.connect(lambda: None if self.job is None else self._stop_or_close())
        asks.open()  # the work goes on, and may end meanwhile


def value_of(entry: Entry) -> str:
    """Return what was entered; a check box has no text."""
    if isinstance(entry, QLineEdit):
        return entry.text().strip()
    if isinstance(entry, SearchChoice):
        return entry.currentText().strip()
    return str(entry.currentData()) if isinstance(entry, QComboBox) else ""
