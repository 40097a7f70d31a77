"""Lists to choose from, with the arrow that the style sheet takes away."""

from collections.abc import Callable, Iterable

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QFocusEvent, QPainter, QPaintEvent, QPolygonF, QWheelEvent
from PySide6.QtWidgets import QComboBox, QCompleter

from palette4d.studio import theme


class Choice(QComboBox):
    """A combo box with an arrow."""

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the arrow above the box."""
        super().paintEvent(event)
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QColor(0, 0, 0, 0))
        painter.setBrush(QColor(theme.TEXT if self.isEnabled() else theme.FAINT))
        x, y = self.width() - 10.0, self.height() / 2 - 2
        painter.drawPolygon(QPolygonF([QPointF(x - 4, y), QPointF(x + 4, y), QPointF(x, y + 5)]))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Leave the wheel to what scrolls: nobody wants to choose by chance."""
        event.ignore()


class SearchChoice(Choice):
    """A field with a list that shows what contains the text that is typed.

    Parameters
    ----------
    listed : callable
        Returns the list; called when the keyboard comes or the list opens.
    """

    def __init__(self, value: str, hint: str, listed: Callable[[], Iterable[str]]) -> None:
        """Begin with a value."""
        super().__init__()
        self._listed = listed
        self.setEditable(True)
        self.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        completer = QCompleter(self.model(), self)
        completer.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        completer.setFilterMode(Qt.MatchFlag.MatchContains)
        completer.setCompletionMode(QCompleter.CompletionMode.PopupCompletion)
        self.setCompleter(completer)
        self.setEditText(value)
        line = self.lineEdit()
        if line is not None:
            line.setPlaceholderText(hint)

    def fill(self) -> None:
        """Fill the list; the text stays."""
        wanted = list(self._listed())
        if wanted != [self.itemText(k) for k in range(self.count())]:
            text = self.currentText()
            self.clear()
            self.addItems(wanted)
            self.setEditText(text)

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Have the list ready for the search."""
        self.fill()
        super().focusInEvent(event)

    def showPopup(self) -> None:
        """Open the list."""
        self.fill()
        super().showPopup()
