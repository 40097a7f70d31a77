"""The help: first steps, every gesture and key in one table, and what this program is."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QMessageBox, QVBoxLayout, QWidget

from palette4d.studio import texts
from palette4d.studio.menu_entries import ACTIONS, PALETTE, SOLID_ACTIONS, TIMELINE_ACTIONS, title
from palette4d.studio.search_table import SearchTable


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
        self.table = SearchTable(texts.MANUAL, texts.SEARCH, texts.MANUAL_COLUMNS)
        for row in rows():
            self.table.add(*row)
        self.table.look_for("")
        layout = QVBoxLayout(self)
        layout.addWidget(self.table.search)
        layout.addWidget(self.table)


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
