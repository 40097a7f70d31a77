"""The status line: the file and whether it is saved, what the last action did, and the view."""

from PySide6.QtCore import QMimeData, Qt, QUrl
from PySide6.QtGui import QDrag, QMouseEvent
from PySide6.QtWidgets import QLabel, QStatusBar

from palette4d.studio import texts, theme
from palette4d.studio.session import Session
from palette4d.studio.viewer import Viewer


class FileLabel(QLabel):
    """The file's name and state; the sidecar can be dragged out of it, into a host for example."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the sidecar out."""
        path = self.session.path
        if path is None or not event.buttons() & Qt.MouseButton.LeftButton:
            return
        self.session.save()
        data = QMimeData()
        data.setUrls([QUrl.fromLocalFile(str(path.absolute()))])
        drag = QDrag(self)
        drag.setMimeData(data)
        drag.exec(Qt.DropAction.CopyAction)


class StatusLine(QStatusBar):
    """The status line of a session."""

    def __init__(self, session: Session, viewer: Viewer) -> None:
        """Say nothing yet."""
        super().__init__()
        self.session, self.viewer = session, viewer
        self.setSizeGripEnabled(False)
        self.says = QLabel()
        self.says.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.says.setMinimumWidth(100)
        self.file_facts, self.view_facts = FileLabel(session), QLabel()
        self.addWidget(self.file_facts)
        self.addWidget(self.says, 1)
        self.addPermanentWidget(self.view_facts)
        for label in (self.says, self.file_facts, self.view_facts):
            label.setTextFormat(Qt.TextFormat.PlainText)
        for label in (self.file_facts, self.view_facts):
            label.setStyleSheet(f"color: {theme.FAINT}; padding: 2px 8px")
            label.setMinimumWidth(1)  # a long name or note makes no wide window

    def show_state(self) -> None:
        """Show the state of now."""
        session, view, picture = self.session, self.session.view, self.viewer.picture
        document, status = session.document, session.status
        colour = {"info": theme.TEXT, "warning": theme.WARNING, "error": theme.ERROR}
        self.says.setStyleSheet(f"color: {colour[status.level]}")
        sign = {"info": "", "warning": texts.WARNING_SIGN, "error": texts.ERROR_SIGN}
        self.says.setText(sign[status.level] + status.text)
        self.says.setToolTip(theme.plain(status.text))
        facts = []
        if session.path is not None and document is not None:
            saved = session.saved and not session.dragging
            facts = [session.path.name, texts.SAVED if saved else texts.UNSAVED]
            facts.append(texts.HANDLES.format(count=len(document.grade.core.polytope.vertex_ids)))
            picks = sum(kind == "pick" for kind, _ in document.grade.state)
            if picks:
                facts.append(texts.PICKS.format(count=picks))
        elif session.clip is not None:
            facts = [session.clip.name, texts.NO_PALETTE]
        self.file_facts.setText("  ·  ".join(facts))
        tips = ["  ·  ".join(facts), *([texts.DRAG_OUT] if session.path is not None else [])]
        self.file_facts.setToolTip(theme.plain("\n".join(tips)))
        display = session.display
        shown = ""
        if display is not None and not display.known and session.clip is not None:
            shown = texts.AS_IS_STATUS
        elif display is not None and picture is not None:
            error = picture.quick_error
            if error * 255 >= 0.05:  # less is not seen
                shown = texts.LUT_ERROR.format(error=error * 255)
        if view.outside and picture is not None:
            share = picture.share
            few = 0 < share < 0.0005
            shown += "  " + texts.OUTSIDE.format(share=texts.NEARLY_NONE if few else f"{share:.1%}")
        self.view_facts.setText(shown)
        self.view_facts.setToolTip(shown)
