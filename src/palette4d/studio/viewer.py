"""The viewer: the frame before and after the edits."""

from PySide6.QtWidgets import QWidget

from palette4d.studio.session import Session


class Viewer(QWidget):
    """A place for the picture."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        """Listen to the session."""
        super().__init__(parent)
        self.session = session
