"""The main window: viewer, timeline, solid and inspector of one session, and its menus."""

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QDockWidget, QLabel, QMainWindow, QWidget

from palette4d.studio import texts
from palette4d.studio.inspector import Inspector
from palette4d.studio.session import Session
from palette4d.studio.solid_view import SolidView
from palette4d.studio.timeline_view import TimelineView
from palette4d.studio.viewer import Viewer

#: Milliseconds between two looks at the file.
TICK = 200


class _Post(QObject):
    """Brings calls of other threads to the window's thread."""

    called = Signal(object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.called.connect(lambda call: call(), Qt.ConnectionType.QueuedConnection)


class Window(QMainWindow):
    """The window of one session."""

    def __init__(self, session: Session) -> None:
        """Make all views."""
        super().__init__()
        self.session = session
        session.post = _Post(self).called.emit
        self.setWindowTitle(texts.TITLE)
        self.setDockNestingEnabled(True)
        self.viewer = Viewer(session)
        self.timeline = TimelineView(session)
        self.solid = SolidView(session)
        self.inspector = Inspector(session)
        self.setCentralWidget(self.viewer)
        self.setCorner(Qt.Corner.BottomRightCorner, Qt.DockWidgetArea.RightDockWidgetArea)
        right, bottom = (
            Qt.DockWidgetArea.RightDockWidgetArea,
            Qt.DockWidgetArea.BottomDockWidgetArea,
        )
        self._dock(texts.SOLID, self.solid, right)
        self._dock(texts.INSPECTOR, self.inspector, right)
        self._dock(texts.TIMELINE, self.timeline, bottom)
        self._says = QLabel()
        self.statusBar().addWidget(self._says, 1)
        session.on("status", self._show_status)
        self._timer = QTimer(self)
        self._timer.timeout.connect(session.tick)
        self._timer.start(TICK)

    def _dock(self, title: str, view: QWidget, area: Qt.DockWidgetArea) -> QDockWidget:
        dock = QDockWidget(title, self)
        dock.setObjectName(title)
        dock.setWidget(view)
        self.addDockWidget(area, dock)
        return dock

    def _show_status(self) -> None:
        self._says.setText(self.session.status.text)
