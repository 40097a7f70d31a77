"""Colours, sizes and the style sheet: dark and neutral, because colour is judged here."""

from PySide6.QtGui import QColor, QFont, QPalette, Qt
from PySide6.QtWidgets import QApplication

# All greys are neutral: red, green and blue are equal.
PIT = "#161616"  # around pictures
PAGE = "#1e1e1e"
PANEL = "#262626"
RAISED = "#323232"
LINE = "#3c3c3c"
FAINT = "#8a8a8a"
TEXT = "#cfcfcf"
BRIGHT = "#f2f2f2"
ACCENT = "#c8c8c8"  # selection: bright grey, never a hue
WARNING = "#e0b060"
ERROR = "#ef8a7a"

#: Pixels between things, at 100 %.
GAP = 8

SHEET = f"""
* {{ outline: none; }}
QMainWindow, QDialog, QDockWidget {{ background: {PAGE}; color: {TEXT}; }}
QMainWindow::separator {{ background: {PIT}; width: 3px; height: 3px; }}
QMainWindow::separator:hover {{ background: {LINE}; }}
QWidget {{ color: {TEXT}; }}
QMenuBar {{ background: {PAGE}; border-bottom: 1px solid {PIT}; padding: 1px 4px; }}
QMenuBar::item {{ padding: 4px 9px; border-radius: 3px; }}
QMenuBar::item:selected {{ background: {RAISED}; color: {BRIGHT}; }}
QMenu {{ background: {PANEL}; border: 1px solid {LINE}; padding: 4px 0; }}
QMenu::item {{ padding: 4px 28px 4px 22px; }}
QMenu::item:selected {{ background: {LINE}; color: {BRIGHT}; }}
QMenu::item:disabled {{ color: #5e5e5e; }}
QMenu::separator {{ height: 1px; background: {LINE}; margin: 4px 8px; }}
QMenu::indicator {{ left: 6px; width: 10px; height: 10px; }}
QMenu::indicator:checked {{ background: {ACCENT}; border-radius: 5px; }}
QDockWidget::title {{ background: {PAGE}; color: {FAINT}; padding: 5px 8px; text-align: left; }}
QDockWidget > QWidget {{ background: {PANEL}; }}
QStatusBar {{ background: {PAGE}; border-top: 1px solid {PIT}; color: {TEXT}; }}
QStatusBar::item {{ border: none; }}
QToolTip {{ background: {RAISED}; color: {BRIGHT}; border: 1px solid {LINE}; padding: 3px 5px; }}
QPushButton, QToolButton {{ background: {RAISED}; border: 1px solid {LINE}; border-radius: 4px;
  padding: 4px 10px; color: {TEXT}; }}
QToolButton {{ padding: 3px 6px; }}
QToolButton[flat="true"] {{ background: transparent; border-color: transparent; }}
QPushButton:hover, QToolButton:hover {{ background: #3a3a3a; color: {BRIGHT}; }}
QPushButton:focus, QToolButton:focus {{ border-color: {FAINT}; }}
QPushButton:pressed, QPushButton:checked, QToolButton:pressed, QToolButton:checked {{
  background: #4a4a4a; color: {BRIGHT}; }}
QPushButton:default {{ border-color: {FAINT}; color: {BRIGHT}; }}
QPushButton:disabled, QToolButton:disabled {{ color: #5e5e5e; }}
QLineEdit, QAbstractSpinBox, QComboBox, QPlainTextEdit {{ background: {PIT};
  border: 1px solid {LINE}; border-radius: 3px; padding: 2px 5px; color: {TEXT};
  selection-background-color: #5a5a5a; selection-color: {BRIGHT}; }}
QLineEdit:focus, QSpinBox:focus, QDoubleSpinBox:focus, QComboBox:focus, QPlainTextEdit:focus
  {{ border-color: {FAINT}; }}
QAbstractSpinBox::up-button, QAbstractSpinBox::down-button {{ width: 0; border: none; }}
QAbstractSpinBox QLineEdit {{ background: transparent; border: none; padding: 0 4px; }}
QComboBox {{ background: {RAISED}; }}
QComboBox::drop-down {{ border: none; width: 16px; }}
QComboBox QAbstractItemView {{ background: {PANEL}; border: 1px solid {LINE};
  selection-background-color: {LINE}; }}
QListView, QTreeView {{ background: {PANEL}; border: none;
  selection-background-color: #454545; selection-color: {BRIGHT};
  alternate-background-color: #2a2a2a; }}
QListView::item {{ padding: 3px 6px; }}
QHeaderView::section {{ background: {PAGE}; color: {FAINT}; border: none; padding: 4px 6px; }}
QTabBar::tab {{ background: {PAGE}; color: {FAINT}; padding: 5px 7px; border: none; }}
QTabBar::tab:selected {{ background: {PANEL}; color: {BRIGHT}; }}
QTabWidget::pane {{ border: none; background: {PANEL}; }}
QScrollBar:vertical {{ background: transparent; width: 10px; margin: 0; }}
QScrollBar:horizontal {{ background: transparent; height: 10px; margin: 0; }}
QScrollBar::handle {{ background: #4a4a4a; border-radius: 4px; min-height: 24px; min-width: 24px;
  margin: 1px; }}
QScrollBar::handle:hover {{ background: #5e5e5e; }}
QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
QScrollBar::add-page, QScrollBar::sub-page {{ background: transparent; }}
QProgressBar {{ background: {PIT}; border: 1px solid {LINE}; border-radius: 3px; text-align: center;
  height: 12px; }}
QProgressBar::chunk {{ background: #6a6a6a; border-radius: 2px; }}
"""


def numbers_font(size: float = 0) -> QFont:
    """Return the font for figures, whose digits are equally wide."""
    font = QFont(QApplication.font())
    if hasattr(QFont, "Tag"):  # Qt 6.7
        font.setFeature(QFont.Tag("tnum"), 1)
    if size:
        font.setPointSizeF(size)
    return font


def dress(app: QApplication) -> None:
    """Give an application the theme."""
    app.setStyle("Fusion")
    palette = QPalette()
    role = QPalette.ColorRole
    for key, colour in (
        (role.Window, PAGE),
        (role.WindowText, TEXT),
        (role.Base, PIT),
        (role.AlternateBase, PANEL),
        (role.Text, TEXT),
        (role.Button, RAISED),
        (role.ButtonText, TEXT),
        (role.BrightText, BRIGHT),
        (role.Highlight, "#5a5a5a"),
        (role.HighlightedText, BRIGHT),
        (role.ToolTipBase, RAISED),
        (role.ToolTipText, BRIGHT),
        (role.PlaceholderText, FAINT),
        (role.Link, BRIGHT),
        (role.Light, LINE),
        (role.Midlight, LINE),
        (role.Mid, LINE),
        (role.Dark, PIT),
        (role.Shadow, "#000000"),
    ):
        palette.setColor(key, QColor(colour))
    for key in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, key, QColor("#5e5e5e"))
    app.setPalette(palette)
    palette.setColor(role.Window, QColor(TEXT))  # Fusion's rim of a check box is darker than this
    # PySide's stub asks for bytes, which PySide refuses.
    app.setPalette(palette, "QCheckBox")  # type: ignore[arg-type]
    app.setStyleSheet(SHEET)


def plain(text: str) -> str:
    """Return a text that tips and labels show as it is: names in files may look like HTML."""
    return Qt.convertFromPlainText(text) if Qt.mightBeRichText(text) else text
