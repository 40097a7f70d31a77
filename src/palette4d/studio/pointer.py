"""Whether a button of the pointer is down where it drags, for Escape to take the drag back."""

from collections.abc import Iterable

from PySide6.QtCore import QEvent, QObject
from PySide6.QtWidgets import QWidget

from palette4d.studio.session import Session

DOWN = (QEvent.Type.MouseButtonPress, QEvent.Type.MouseButtonDblClick)


class Pointer(QObject):
    """Tells the session of buttons that are pressed and let go over some parts of a window."""

    def __init__(self, session: Session, parts: Iterable[QWidget]) -> None:
        super().__init__()
        self.session = session
        for part in parts:
            part.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Note it, and let the part have it."""
        if event.type() in DOWN:
            self.session.held, self.session.waived = True, False
        elif event.type() == QEvent.Type.MouseButtonRelease:
            self.session.held = False
        return False
