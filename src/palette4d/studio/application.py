"""The application of the window: on macOS the Finder hands it files while it runs."""

from collections.abc import Callable

from PySide6.QtCore import QEvent
from PySide6.QtGui import QFileOpenEvent
from PySide6.QtWidgets import QApplication


class Application(QApplication):
    """An application that opens files which the system hands to it.

    Attributes
    ----------
    open_path : callable or None
        Called with a file's path.
    """

    open_path: Callable[[str], object] | None = None

    def event(self, event: QEvent) -> bool:
        """Take a file; whether the event was taken."""
        if isinstance(event, QFileOpenEvent) and self.open_path is not None:
            self.open_path(event.file())
            return True
        return bool(super().event(event))
