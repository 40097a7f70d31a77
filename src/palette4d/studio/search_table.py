"""A table whose rows are found by typing."""

from collections.abc import Iterator, Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QLineEdit,
    QTreeWidget,
    QTreeWidgetItem,
)

#: The first column of a row; only the first of equal ones is shown.
WHERE = Qt.ItemDataRole.UserRole


class SearchTable(QTreeWidget):
    """Rows of three columns, and the field that hides those without what is typed.

    Parameters
    ----------
    name, hint : str
        The table's name, and what the field says while it is empty.
    columns : sequence of str
    """

    def __init__(self, name: str, hint: str, columns: Sequence[str]) -> None:
        """Begin without rows."""
        super().__init__()
        self.search = QLineEdit()
        self.search.setPlaceholderText(hint)
        self.search.setClearButtonEnabled(True)
        self.search.textChanged.connect(self.look_for)
        self.setColumnCount(len(columns))
        self.setHeaderLabels(columns)
        self.setRootIsDecorated(False)
        self.setAlternatingRowColors(True)
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.setAccessibleName(name)
        for column in (0, 1):
            mode = QHeaderView.ResizeMode.ResizeToContents
            self.header().setSectionResizeMode(column, mode)

    def add(self, where: str, *words: str) -> QTreeWidgetItem:
        """Add a row and return it."""
        item = QTreeWidgetItem(["", *words])
        item.setData(0, WHERE, where)
        self.addTopLevelItem(item)
        return item

    def items(self) -> Iterator[QTreeWidgetItem]:
        """Return the rows."""
        for k in range(self.topLevelItemCount()):
            item = self.topLevelItem(k)
            assert item is not None
            yield item

    def look_for(self, text: str) -> None:
        """Show the rows with this text."""
        last = ""
        for item in self.items():
            where = str(item.data(0, WHERE))
            words = " ".join((where, item.text(1), item.text(2))).lower()
            item.setHidden(text.lower() not in words)
            if not item.isHidden():
                item.setText(0, "" if where == last else where)
                last = where
