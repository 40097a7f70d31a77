"""Inspector: a view of the session."""

from PySide6.QtWidgets import QWidget

from palette4d.studio.session import Session


class Inspector(QWidget):
    """A place for the view."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        """Listen to the session."""
        super().__init__(parent)
        self.session = session
