"""Menu entries of the views: the timeline and the solid do their actions themselves."""

from collections.abc import Callable, Iterable, Mapping

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QWidget

from palette4d.studio.menu_entries import Action

#: Keys that the view sees itself: at the last handle, Tab goes on to the next panel.
OWN_KEYS = ("Tab", "Shift+Tab")


def view_actions(
    view: QWidget, actions: Iterable[Action], calls: Mapping[str, Callable[[], object]]
) -> dict[str, list[QAction]]:
    """Return the entries for a view's actions by menu; `calls` do them."""
    result: dict[str, list[QAction]] = {}
    for action in actions:
        made = QAction(action.text, view)
        if action.keys[0] in OWN_KEYS:
            made.setText(f"{action.text}\t{action.keys[0]}")
        else:
            made.setShortcuts([QKeySequence(keys) for keys in action.keys])
            made.setObjectName(action.name)  # its keys can be changed
        made.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
        made.triggered.connect(lambda _=False, call=calls[action.name]: call())
        view.addAction(made)
        result.setdefault(action.menu, []).append(made)
    return result
