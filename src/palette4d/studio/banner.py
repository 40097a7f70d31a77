"""What is wrong, above the picture: it stays until it is dealt with, and leaves with its clip."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
)

from palette4d.studio import texts, theme
from palette4d.studio.session import Session
from palette4d.studio.states import Level
from palette4d.studio.viewer import Viewer

#: Milliseconds between two reads of a frame that cannot be read.
READ_AGAIN = 2000
#: The most entries, and the most characters of one; its tip has all.
MOST, LONGEST = 3, 400

Remedies = Mapping[str, Callable[[], object]]


@dataclass(frozen=True)
class Entry:
    """One thing that is wrong, and the buttons that help."""

    text: str
    level: Level = "error"
    remedies: Remedies = field(default_factory=dict, compare=False)


class Banner(QFrame):
    """Shows what is wrong with the document, the clip and the frame, and what can be done.

    Parameters
    ----------
    session : Session
    viewer : Viewer
        Knows why there is no picture.
    find_clip, save_as, choose_space : callable
        Ask for the clip, for another file, and for the clip's colour space.
    """

    def __init__(
        self,
        session: Session,
        viewer: Viewer,
        find_clip: Callable[[], object],
        save_as: Callable[[], object],
        choose_space: Callable[[], object],
    ) -> None:
        """Begin with nothing wrong."""
        super().__init__()
        self.session, self.viewer = session, viewer
        self._find: Remedies = {texts.FIND_CLIP: find_clip}
        self._elsewhere: Remedies = {texts.SAVE_ELSEWHERE: save_as}
        self._change: Remedies = {texts.CHANGE: choose_space}
        self.entries: dict[str, Entry] = {}
        self._closed: set[str] = set()  # texts that the user has read and closed
        self._of: object = None  #: the clip and the file that the entries are about
        self.setStyleSheet(f"Banner {{ background: {theme.RAISED}; }}")
        self.setAccessibleName(texts.BANNER)
        self._rows = QVBoxLayout(self)
        self._rows.setContentsMargins(10, 4, 6, 4)
        self._rows.setSpacing(2)
        self._follow: Remedies = {texts.FOLLOW_NOW: session.follow}
        self._again = QTimer(self)
        self._again.setInterval(READ_AGAIN)
        self._again.timeout.connect(self.read_again)
        for event in ("status", "clip", "document", "pixels", "frame"):
            session.on(event, self._look, panel=True)
        session.on("status", self._heard)
        self._look()

    def tell(self, key: str, text: str, level: Level, remedies: Remedies) -> None:
        """Show what is wrong, in the place of what had this key."""
        wanted = Entry(text, level, remedies)
        if self.entries.get(key) != wanted and text not in self._closed:
            self.entries.pop(key, None)
            self.entries[key] = wanted
            self._show()

    def drop(self, key: str) -> None:
        """Show it no more: it was dealt with."""
        if self.entries.pop(key, None) is not None:
            self._show()

    def read_again(self) -> None:
        """Try the frame again that cannot be read."""
        player, frame = self.session.player, self.session.frame
        if player is None or not self.viewer.problem:
            self._again.stop()
        elif frame in player.errors:
            player.try_again(frame)

    def _read_clip_again(self) -> None:
        """Try the frame again; if the clip lacked it when it was opened, open the clip again."""
        player, clip = self.session.player, self.session.clip
        if player is not None and clip is not None and self.session.frame not in player.numbers:
            self.session.find_clip(clip.source)
        else:
            self.read_again()
            self.viewer.refresh()

    def _look(self) -> None:
        """Look what is wrong now."""
        session, problem = self.session, self.viewer.problem
        found, of = (session.document, session.clip), (session.clip, session.path)
        if of != self._of:
            # The clip and its document come one after the other.
            self.entries.clear()
            self._closed.clear()
            self._show()
        self._of = of
        self._state("clip", found[0] is not None and found[1] is None, texts.NO_CLIP, self._find)
        self._state("fit", bool(fit := session.fit()), fit, self._find)
        display = session.display
        unknown = found[1] is not None and display is not None and not display.known
        self._state("encoding", unknown, texts.ASSUMED, self._change)
        if found[1] is not None and display is not None and display.problem:
            other = texts.OTHER_CONFIG.format(problem=display.problem, config=display.name)
            self.tell("config", other, "warning", {})
        else:
            self.drop("config")
        left = texts.UNFOLLOWED.format(ids=", ".join(ids := session.unfollowed))
        self._state("follow", bool(ids), left, self._follow)
        again: Remedies = {texts.TRY_AGAIN: self._read_clip_again}
        self._state("frame", bool(problem), problem, again, "error")
        if problem and not self._again.isActive():
            self._again.start()
        if session.saved:
            self.drop("save")

    def _heard(self) -> None:
        """Keep the error that was said; why there is no picture stands here already."""
        status = self.session.status
        if status.level == "error" and status.text != self.viewer.problem:
            save = status.code == "not saved"
            remedies = self._elsewhere if save else {}
            self.tell("save" if save else "error", status.text, "error", remedies)

    def _state(
        self, key: str, wrong: bool, text: str, remedies: Remedies, level: Level = "warning"
    ) -> None:
        if wrong:
            self.tell(key, text, level, remedies)
        else:
            self.drop(key)

    def _show(self) -> None:
        """Make the rows again; the newest is above."""
        while (item := self._rows.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        for key, entry in list(reversed(self.entries.items()))[:MOST]:
            row = self._row(key, entry)
            self._rows.addWidget(row)
            row.show()  # what is not shown yet takes no room in `_fit`
        self.setVisible(bool(self.entries))
        self._fit()
        self._rows.invalidate()  # laid out without any height, the first row kept none

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Ask for the room that the wrapped words need: the window's layout does not."""
        self._fit()
        super().resizeEvent(event)

    def _fit(self) -> None:
        self.setFixedHeight(max(0, self._rows.heightForWidth(self.width())))

    def _row(self, key: str, entry: Entry) -> QFrame:
        sign = {"error": texts.ERROR_SIGN, "warning": texts.WARNING_SIGN, "info": ""}[entry.level]
        colour = {"error": theme.ERROR, "warning": theme.WARNING, "info": theme.TEXT}[entry.level]
        box = QFrame()
        row = QHBoxLayout(box)
        row.setContentsMargins(0, 0, 0, 0)
        text = f"{sign}{entry.text}"
        label = QLabel(text if len(text) <= LONGEST else f"{text[:LONGEST]}…")
        label.setTextFormat(Qt.TextFormat.PlainText)
        label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        label.setToolTip(theme.plain(entry.text))
        label.setWordWrap(True)
        label.setStyleSheet(f"color: {colour}")
        label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        row.addWidget(label, 1)
        for name, call in entry.remedies.items():
            button = QPushButton(name)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # it goes, and the keyboard stays
            button.clicked.connect(call)
            row.addWidget(button)
        close = QToolButton()
        close.setText("×")
        close.setProperty("flat", True)
        close.setAccessibleName(texts.CLOSE)
        close.setToolTip(texts.CLOSE)
        close.clicked.connect(lambda: self._close(key))
        row.addWidget(close)
        return box

    def _close(self, key: str) -> None:
        self._closed.add(self.entries[key].text)
        self.drop(key)

    def button(self, name: str) -> QPushButton | None:
        """Return the button of this name that is shown, or None."""
        shown = [each for each in self.findChildren(QPushButton) if not each.isHidden()]
        return next((each for each in shown if each.text() == name and each.isVisible()), None)
