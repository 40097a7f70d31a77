"""Shortcuts that can be searched and changed; the settings keep those that differ from ours."""

from collections.abc import Callable, Sequence

from PySide6.QtCore import QSettings, Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QKeySequenceEdit,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from palette4d.studio import texts, theme
from palette4d.studio.menu_entries import (
    ACTIONS,
    FIXED,
    SOLID_ACTIONS,
    TIMELINE_ACTIONS,
    VERSION_ACTIONS,
    Action,
    title,
)
from palette4d.studio.search_table import SearchTable

#: Where the settings keep them.
GROUP = "shortcuts"
#: Keys of actions at the same time are at most so many; the first is shown.
MOST = 2
#: The action of a row.
NAME = Qt.ItemDataRole.UserRole + 1


class Shortcuts:
    """The keys of all actions.

    Parameters
    ----------
    settings : QSettings
    entry : callable
        Returns an action's entry in the menus.
    """

    def __init__(self, settings: QSettings, entry: Callable[[Action], QAction]) -> None:
        """Give the actions the keys that were chosen."""
        self._settings, self._entry = settings, entry
        self.actions = {
            f"{action.view}.{action.name}": action
            for action in (*ACTIONS, *VERSION_ACTIONS, *TIMELINE_ACTIONS, *SOLID_ACTIONS)
            if action.name not in FIXED.get(action.view, ())
        }
        for name in self.actions:
            self._apply(name)

    def keys(self, name: str) -> list[str]:
        """Return the keys of an action."""
        kept = self._settings.value(f"{GROUP}/{name}")
        if kept is None:
            return list(self.actions[name].keys)
        return [key for key in str(kept).split("\n") if key]

    def taken_by(self, name: str, key: str) -> str | None:
        """Return another action with this key that works at the same time; None without one."""
        own, wanted = self.actions[name].view, QKeySequence(key)
        for other, action in self.actions.items():
            together = "window" in (own, action.view) or own == action.view
            same = any(QKeySequence(each) == wanted for each in self.keys(other))
            if other != name and together and same and not self._meant(own, action.view, key):
                return other
        return None

    def _meant(self, first: str, second: str, key: str) -> bool:
        """Whether a panel's key is also one of the window's by our own choice."""
        views = {a.view for a in self.actions.values() if key in a.keys}
        return first != second and {first, second} <= views

    def set(self, name: str, keys: Sequence[str]) -> None:
        """Give an action keys; another one with such a key loses it."""
        for key in keys:
            while (other := self.taken_by(name, key)) is not None:
                rest = [k for k in self.keys(other) if QKeySequence(k) != QKeySequence(key)]
                self._keep(other, rest)
        self._keep(name, keys)

    def reset(self) -> None:
        """Give all actions our keys."""
        self._settings.remove(GROUP)
        for name in self.actions:
            self._apply(name)

    def _keep(self, name: str, keys: Sequence[str]) -> None:
        place = f"{GROUP}/{name}"
        if list(keys) == list(self.actions[name].keys):
            self._settings.remove(place)
        else:
            self._settings.setValue(place, "\n".join(keys))
        self._apply(name)

    def _apply(self, name: str) -> None:
        entry = self._entry(self.actions[name])
        entry.setShortcuts([QKeySequence(key) for key in self.keys(name)])


class KeysPage(QWidget):
    """A table of the actions, with their keys; the keys of the selected one can be typed."""

    def __init__(self, shortcuts: Shortcuts) -> None:
        """Fill the table."""
        super().__init__()
        self.shortcuts = shortcuts
        names = texts.SHORTCUTS, texts.SEARCH_KEYS, texts.SHORTCUT_COLUMNS
        self.table = SearchTable(*names)
        self.table.search.textChanged.connect(self._sought)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        for name, action in shortcuts.actions.items():
            where = {"timeline": texts.IN_TIMELINE, "solid": texts.IN_SOLID}.get(action.view, "")
            text = f"{action.text} {where}".strip()
            self.table.add(title(action.menu), text, "").setData(0, NAME, name)
        self.table.itemSelectionChanged.connect(self._show_chosen)
        self.fields = [QKeySequenceEdit() for _ in range(MOST)]
        self.told = QLabel()
        self.told.setStyleSheet(f"color: {theme.WARNING}")
        self.told.setWordWrap(True)
        layout = QVBoxLayout(self)
        layout.addWidget(self.table.search)
        layout.addWidget(self.table, 1)
        layout.addLayout(self._make_fields())
        layout.addWidget(self.told)
        self._show_keys()
        self._show_chosen()

    def _make_fields(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.addWidget(QLabel(texts.KEYS))
        for field in self.fields:
            field.setMaximumSequenceLength(1)
            field.setClearButtonEnabled(True)
            field.keySequenceChanged.connect(self._warn)
            field.editingFinished.connect(self._typed)
            row.addWidget(field, 1)
        self.reset = QPushButton(texts.RESET_KEYS)
        self.reset.clicked.connect(self._reset)
        self.reset.setAutoDefault(False)
        row.addWidget(self.reset)
        return row

    @property
    def chosen(self) -> str | None:
        """The name of the selected action."""
        found = self.table.selectedItems()
        return str(found[0].data(0, NAME)) if found else None

    def choose(self, name: str) -> None:
        """Select an action."""
        self.table.setCurrentItem(next(i for i in self.table.items() if i.data(0, NAME) == name))

    def _sought(self) -> None:
        if self.chosen is None:  # a hidden row is not selected
            self._show_chosen()

    def _show_keys(self) -> None:
        for item in self.table.items():
            name = item.data(0, NAME)
            keys = self.shortcuts.keys(name)
            item.setText(2, ", ".join(_native(key) for key in keys))
            font = item.font(2)
            font.setBold(tuple(keys) != self.shortcuts.actions[name].keys)
            item.setFont(2, font)
        self.table.look_for(self.table.search.text())

    def _show_chosen(self) -> None:
        keys = [] if self.chosen is None else self.shortcuts.keys(self.chosen)
        for k, field in enumerate(self.fields):
            field.setEnabled(self.chosen is not None)
            field.blockSignals(True)
            field.setKeySequence(QKeySequence(keys[k] if k < len(keys) else ""))
            field.blockSignals(False)
        self.told.clear()

    def _warn(self, sequence: QKeySequence) -> None:
        """Say which other action will lose its key."""
        key = sequence.toString()
        other = self.shortcuts.taken_by(self.chosen, key) if key and self.chosen else None
        name = "" if other is None else self.shortcuts.actions[other].text
        self.told.setText("" if other is None else texts.KEY_TAKEN.format(key=key, name=name))

    def _typed(self) -> None:
        keys = [field.keySequence().toString() for field in self.fields]
        if self.chosen is not None:
            self.shortcuts.set(self.chosen, list(dict.fromkeys(key for key in keys if key)))
            self._show_keys()

    def _reset(self) -> None:
        self.shortcuts.reset()
        self._show_keys()
        self._show_chosen()


def _native(key: str) -> str:
    return QKeySequence(key).toString(QKeySequence.SequenceFormat.NativeText)
