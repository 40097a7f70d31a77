"""The first page of a window: open a clip, try the sample, or go on with a recent file."""

import functools
import threading
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QIcon, QPixmap
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from palette4d.common.errors import Palette4dError
from palette4d.studio import texts, theme
from palette4d.studio.paths import sidecar_of
from palette4d.studio.session import Session
from palette4d.studio.shot_list import THUMB, U8, icon_of, thumbnail

#: Pixels for a recent file: its picture and its name.
CELL = QSize(THUMB.width() + 32, THUMB.height() + 34)


class StartPage(QWidget):
    """What the window shows before anything is open.

    Parameters
    ----------
    session : Session
    open_file, try_sample : callable
        Ask for a file; open the sample clip.
    open_path : callable
        Opens a file.
    recent : callable
        Returns the recent files, the newest first.
    """

    def __init__(
        self,
        session: Session,
        open_file: Callable[[], object],
        try_sample: Callable[[], object],
        open_path: Callable[[str], object],
        recent: Callable[[], list[str]],
    ) -> None:
        """Make the page; it shows itself while nothing is open."""
        super().__init__()
        self.session, self._recent = session, recent
        self._generation = 0
        page = QVBoxLayout(self)
        page.addStretch(2)
        what = QLabel(texts.EMPTY)
        what.setAlignment(Qt.AlignmentFlag.AlignCenter)
        what.setWordWrap(True)
        page.addWidget(what)
        page.addSpacing(theme.GAP)
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        for text, call in (
            (texts.ACTIONS["window"]["open"], open_file),
            (texts.TRY_SAMPLE, try_sample),
        ):
            button = QPushButton(text)
            button.clicked.connect(call)
            buttons.addWidget(button)
        buttons.addStretch(1)
        page.addLayout(buttons)
        page.addSpacing(theme.GAP)
        self.list = QListWidget()
        self.list.setAccessibleName(texts.RECENT)
        self.list.setViewMode(QListWidget.ViewMode.IconMode)
        self.list.setMovement(QListWidget.Movement.Static)
        self.list.setResizeMode(QListWidget.ResizeMode.Adjust)
        self.list.setIconSize(THUMB)
        self.list.setGridSize(CELL)
        self.list.setMinimumHeight(60)
        self.list.setStyleSheet(f"background: {theme.PIT}")
        self.list.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.list.itemActivated.connect(
            lambda item: open_path(str(item.data(Qt.ItemDataRole.UserRole)))
        )
        page.addWidget(self.list, 5)
        page.addStretch(1)
        session.on("clip", self._show)
        session.on("document", self._show)
        self._show()

    def _show(self) -> None:
        empty = self.session.document is None and self.session.clip is None
        if (empty and self.isHidden()) or not self._generation:
            self.fill()
        self.setVisible(empty)

    def fill(self) -> None:
        """List the recent files that are there; a thread draws their pictures."""
        self._generation += 1
        self.list.clear()
        works: dict[str, str] = {}  # a clip and its sidecar are one
        for path in self._recent():
            if is_there(path):
                works.setdefault(str(sidecar_beside(path) or path), path)
        paths = [*works.values()]
        blank = QPixmap(THUMB)
        blank.fill(Qt.GlobalColor.black)
        for path in paths:
            found = Path(path)
            item = QListWidgetItem(QIcon(blank), str(Path(found.parent.name, found.name)))
            item.setData(Qt.ItemDataRole.UserRole, path)
            item.setToolTip(theme.plain(path))
            self.list.addItem(item)
        self.list.setVisible(bool(paths))
        draw = functools.partial(self._draw, self._generation, paths)
        threading.Thread(target=draw, name="palette4d recent", daemon=True).start()

    def _draw(self, generation: int, paths: list[str]) -> None:
        for row, path in enumerate(paths):
            if generation != self._generation:
                return
            sidecar = sidecar_beside(path)
            try:
                pixels = None if sidecar is None else thumbnail(sidecar)
            except (Palette4dError, OSError):
                continue  # its name alone is shown
            if pixels is not None:
                self.session.post(functools.partial(self._set, generation, row, pixels))

    def _set(self, generation: int, row: int, pixels: U8) -> None:
        if generation == self._generation:
            self.list.item(row).setIcon(icon_of(pixels))


def sidecar_beside(path: str) -> Path | None:
    """Return the sidecar that a recent file is or has."""
    return Path(path) if path.endswith(".p4d.json") else sidecar_of(path)


def is_there(path: str) -> bool:
    """Whether a recent file is there; of a pattern, its folder."""
    found = Path(path)
    try:
        return found.exists() or ("#" in found.name and found.parent.is_dir())
    except OSError:  # longer than names of files are
        return False
