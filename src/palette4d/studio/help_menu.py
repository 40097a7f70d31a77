"""The help: first steps, every gesture and key in one table, and what this program is."""

from collections.abc import Iterable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QDialog,
    QHeaderView,
    QLineEdit,
    QMessageBox,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from palette4d.studio import texts
from palette4d.studio.menu_entries import ACTIONS, PALETTE, SOLID_ACTIONS, TIMELINE_ACTIONS, title


def rows() -> list[tuple[str, str, str]]:
    """Return where, the gesture or keys, and what it does."""
    listed = [
        *((action, "") for action in ACTIONS),
        *((action, texts.IN_TIMELINE) for action in TIMELINE_ACTIONS),
        *((action, texts.IN_SOLID) for action in SOLID_ACTIONS),
    ]
    found = list(texts.GESTURES)
    for menu in texts.MENUS:
        name = title(menu)
        for action, where in listed:
            if action.menu == menu and action.keys:
                keys = ", ".join(action.keys)
                found.append((name, f"{keys} {where}" if where else keys, action.text))
        if menu == PALETTE:
            found.append((name, "1 – 9", texts.USE_A_VERSION))
    return found


class Manual(QDialog):
    """Every gesture and key in a table that can be searched."""

    def __init__(self, parent: QWidget) -> None:
        """Fill the table."""
        super().__init__(parent)
        self.setWindowTitle(texts.MANUAL)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.resize(760, 640)
        self.search = QLineEdit()
        self.search.setPlaceholderText(texts.SEARCH)
        self.search.setClearButtonEnabled(True)
        self.search.textChanged.connect(self._sought)
        self.table = QTreeWidget()
        self.table.setColumnCount(3)
        self.table.setHeaderLabels(texts.MANUAL_COLUMNS)
        self.table.setRootIsDecorated(False)
        self.table.setAlternatingRowColors(True)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.table.setAccessibleName(texts.MANUAL)
        last = ""
        for where, what, does in rows():
            item = QTreeWidgetItem(["" if where == last else where, what, does])
            item.setData(0, Qt.ItemDataRole.UserRole, where)
            self.table.addTopLevelItem(item)
            last = where
        header = self.table.header()
        header.setStretchLastSection(True)
        for column in (0, 1):
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
        layout = QVBoxLayout(self)
        layout.addWidget(self.search)
        layout.addWidget(self.table)

    def items(self) -> Iterable[QTreeWidgetItem]:
        """Return the rows."""
        for k in range(self.table.topLevelItemCount()):
            item = self.table.topLevelItem(k)
            if item is not None:
                yield item

    def _sought(self, text: str) -> None:
        """Show the rows with this text; each says where it is."""
        last = ""
        for item in self.items():
            where = str(item.data(0, Qt.ItemDataRole.UserRole))
            words = " ".join((where, item.text(1), item.text(2))).lower()
            item.setHidden(text.lower() not in words)
            if not item.isHidden():
                item.setText(0, "" if where == last else where)
                last = where


class HelpMenu:
    """The menu Help of a window."""

    def __init__(self, window: QWidget) -> None:
        self.window = window

    def first_steps(self) -> None:
        """Show the first steps."""
        QMessageBox.information(self.window, texts.FIRST_STEPS, texts.FIRST_STEPS_TEXT)

    def manual(self) -> Manual:
        """Show the gestures and keys."""
        found = Manual(self.window)
        found.show()
        return found

    def about(self) -> None:
        """Say what this is."""
        from palette4d._core import __version__

        QMessageBox.about(self.window, texts.TITLE, texts.ABOUT.format(version=__version__))
