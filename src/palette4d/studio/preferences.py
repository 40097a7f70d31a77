"""What the user sets for all clips; the settings keep it."""

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QPushButton,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from palette4d.studio import texts
from palette4d.studio.choice import Choice
from palette4d.studio.display import Display
from palette4d.studio.shortcuts import KeysPage

if TYPE_CHECKING:
    from palette4d.studio.window import Window

#: Where the settings keep the display.
DISPLAY = "display"


class Preferences(QDialog):
    """The preferences in tabs: all are taken at once."""

    def __init__(self, window: "Window") -> None:
        """Show what is set."""
        super().__init__(window)
        self.window_ = window
        self.setWindowTitle(texts.PREFERENCES)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.resize(620, 640)
        self.keys = KeysPage(window.keys)
        tabs = QTabWidget()
        tabs.addTab(self._make_general(), texts.GENERAL)
        tabs.addTab(self.keys, texts.SHORTCUTS)
        tabs.currentChanged.connect(self.keys.table.search.setFocus)
        closes = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        closes.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(tabs)
        layout.addWidget(closes)

    def _make_general(self) -> QWidget:
        page, window = QWidget(), self.window_
        form = QFormLayout(page)
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.FieldsStayAtSizeHint)
        self.display, shown = Choice(), window.session.display
        known = shown if shown is not None and shown.known else Display("sRGB")
        self.display.addItem(texts.OWN_DISPLAY, "")
        for name in known.displays():
            self.display.addItem(name, name)
        self.display.setCurrentIndex(max(0, self.display.findData(window.settings.value(DISPLAY))))
        self.display.activated.connect(self._show_display)
        self.forget = QPushButton(texts.FORGET)
        reset = QPushButton(texts.ACTIONS["window"]["reset_layout"])
        self.forget.clicked.connect(window.files.forget_recent)
        reset.clicked.connect(window.reset_layout)
        for text, widget in (
            (texts.DEFAULT_DISPLAY, self.display),
            (texts.RECENT_FILES, self.forget),
            (texts.LAYOUT, reset),
        ):
            form.addRow(text, widget)
        return page

    def _show_display(self) -> None:
        """Show all clips on the display; its view is the one that suits the clip."""
        name = self.display.currentData()
        self.window_.settings.setValue(DISPLAY, name)
        self.window_.session.look(display=name, view="")
