"""The list of the grade's steps."""

from PySide6.QtWidgets import QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from palette4d.studio import texts
from palette4d.studio.row_names import with_row_names
from palette4d.studio.session import Session


class History(QWidget):
    """The steps of the grade; a click goes back or forward to one."""

    def __init__(self, session: Session) -> None:
        """Listen to the session."""
        super().__init__()
        self.session = session
        self.list = QListWidget()
        self.list.setWordWrap(True)
        self.list.setAccessibleName(texts.HISTORY)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.list)
        self.list.itemClicked.connect(lambda item: self.go_to(self.list.row(item)))
        self.list.itemActivated.connect(lambda item: self.go_to(self.list.row(item)))
        session.on("document", self._show, panel=True)
        self._show()

    def _show(self) -> None:
        document = self.session.document
        if self.session.dragging:
            return
        rows = [texts.BEGINNING] if document is not None else []
        done = 0
        if document is not None:
            steps = [*document.history.done, *reversed(document.history.undone)]
            rows += [with_row_names(document.grade, edit.label) for edit in steps]
            done = len(document.history.done)
        self.list.clear()
        for k, text in enumerate(rows):
            item = QListWidgetItem(text)
            if k > done:
                item.setText(f"{text}  {texts.UNDONE_STEP}")
                item.setForeground(self.palette().placeholderText())
            self.list.addItem(item)
        if rows:
            self.list.setCurrentRow(done)
            self.list.scrollToItem(self.list.item(done))

    def go_to(self, row: int) -> None:
        """Undo or redo up to a row; row 0 is before the first step."""
        document = self.session.document
        if document is None:
            return
        for _ in range(len(document.history.done) - row):
            self.session.undo()
        for _ in range(row - len(document.history.done)):
            self.session.redo()
