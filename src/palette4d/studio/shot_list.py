"""The list of a show's shots, with thumbnails and states."""

import functools
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QIcon, QPainter, QPixmap
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document
from palette4d.media.source_clip import find_clip, nearest_frame
from palette4d.shows import manifest
from palette4d.studio import texts, theme
from palette4d.studio.display import Display, Look
from palette4d.studio.paint import image_of
from palette4d.studio.player import Region, resampled
from palette4d.studio.session import Session

U8 = NDArray[np.uint8]

#: The thumbnails' size in pixels.
THUMB = QSize(112, 63)


class Shots(QWidget):
    """The shots of a manifest, with thumbnails and states."""

    def __init__(self, session: Session, open_shot: Callable[[Path], object]) -> None:
        """Begin empty."""
        super().__init__()
        self.session, self._open = session, open_shot
        self.path: Path | None = None  #: the manifest
        self.folder = Path()
        self.entries: list[manifest.Entry] = []
        self._generation = 0
        self.list = QListWidget()
        self.list.setIconSize(THUMB)
        self.list.setSpacing(2)
        self.list.setMinimumWidth(160)
        self.list.setAccessibleName(texts.SHOTS)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.list)
        self.list.itemActivated.connect(lambda item: self._chosen(self.list.row(item)))
        self.list.itemClicked.connect(lambda item: self._chosen(self.list.row(item)))

    def count(self) -> int:
        """Return how many shots there are."""
        return len(self.entries)

    def load(self, path: Path) -> None:
        """Show the shots of a manifest.

        Raises
        ------
        Palette4dError
            The manifest is unusable.
        """
        show = manifest.read(path)
        self.path, self.folder, self.entries = path, path.absolute().parent, list(show.entries)
        self._generation += 1
        self.list.clear()
        for entry in self.entries:
            item = QListWidgetItem(f"{entry.shot.name}\n{texts.SHOT_STATES[entry.status]}")
            item.setToolTip(theme.plain(entry.error or str(self.folder / entry.sidecar)))
            blank = QPixmap(THUMB)
            blank.fill(Qt.GlobalColor.black)
            item.setIcon(QIcon(blank))
            if entry.status != manifest.DONE:
                item.setFlags(Qt.ItemFlag.ItemIsSelectable)
            self.list.addItem(item)

    def follow(self) -> bool:
        """Mark the shot that is open; whether the open file is one. If not, forget the show."""
        row = next((k for k, entry in enumerate(self.entries) if self._is_open(entry)), None)
        if row is None:
            self.path, self.entries = None, []
            self._generation += 1
            self.list.clear()
        else:
            self.list.setCurrentRow(row)
        return row is not None

    def draw(self, rows: Sequence[int] | None = None) -> None:
        """Draw the thumbnails of some shots or of all, graded, in a thread."""
        wanted = range(self.count()) if rows is None else rows
        work = threading.Thread(
            target=self._draw, args=(self._generation, wanted), name="palette4d shots", daemon=True
        )
        work.start()

    def _draw(self, generation: int, rows: Sequence[int]) -> None:
        entries = list(self.entries)
        for row in rows:
            if generation != self._generation:
                return
            if entries[row].status != manifest.DONE:
                continue
            try:
                pixels = thumbnail(self.folder / entries[row].sidecar)
            except (Palette4dError, OSError):
                continue
            if pixels is not None:
                self.session.post(functools.partial(self._set, generation, row, pixels))

    def _set(self, generation: int, row: int, pixels: U8) -> None:
        if generation == self._generation:
            self.list.item(row).setIcon(icon_of(pixels))

    def _chosen(self, row: int) -> None:
        if 0 <= row < len(self.entries) and self.entries[row].status == manifest.DONE:
            left = [k for k, entry in enumerate(self.entries) if self._is_open(entry)]
            self.list.setCurrentRow(row)
            self._open(self.folder / self.entries[row].sidecar)
            self.draw(left)

    def _is_open(self, entry: manifest.Entry) -> bool:
        path = self.session.path
        return path is not None and path.resolve() == (self.folder / entry.sidecar).resolve()

    def open_first(self) -> None:
        """Open the first shot that has a palette, and draw all thumbnails."""
        for row, entry in enumerate(self.entries):
            if entry.status == manifest.DONE:
                self._chosen(row)
                break
        self.draw()

    def step(self, way: int) -> None:
        """Open the next or previous shot that has a palette."""
        row = self.list.currentRow() + way
        while 0 <= row < len(self.entries):
            if self.entries[row].status == manifest.DONE:
                self._chosen(row)
                return
            row += way


def icon_of(pixels: U8) -> QIcon:
    """Return pixels, (h, w, 4) uint8, in the middle of an icon.

    All icons have one size: of a larger one before it, Qt leaves what a smaller one does not cover.
    """
    picture, canvas = image_of(pixels), QPixmap(THUMB)
    canvas.fill(Qt.GlobalColor.black)
    painter = QPainter(canvas)
    free = THUMB - picture.size()
    painter.drawImage(free.width() // 2, free.height() // 2, picture)
    painter.end()
    return QIcon(canvas)


def thumbnail(sidecar: Path) -> U8 | None:
    """Return a shot's middle frame, graded, (h, w, 4) uint8; None without its clip."""
    document = Document.load(sidecar)
    clip = find_clip(sidecar, document.grade.core.clip, None)
    if clip is None:
        return None
    first, last, _ = document.grade.frames
    frame = nearest_frame(clip, (first + last) / 2)
    pixels = clip.read(frame)
    scale = min(THUMB.width() / clip.width, THUMB.height() / clip.height, 1.0)
    width, height = max(1, round(clip.width * scale)), max(1, round(clip.height * scale))
    small = resampled(pixels, Region(0, 0, clip.width, clip.height, width, height))
    graded = document.recolour(small, frame, premultiplied=clip.premultiplied)
    display = Display(*Display.wanted(document, clip.encoding))
    return display.painter(Look()).paint(np.ascontiguousarray(graded[..., :3]))
