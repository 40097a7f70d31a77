"""The menu File: opening, saving, recent files, and the shots of a show."""

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QFileDialog

from palette4d.common.errors import Palette4dError
from palette4d.shows import manifest
from palette4d.shows.timeline_files import is_timeline
from palette4d.studio import texts
from palette4d.studio.instance import is_open
from palette4d.studio.paths import sequence_of, sidecar_of
from palette4d.studio.session import recovered
from palette4d.studio.start_page import is_there

if TYPE_CHECKING:
    from palette4d.studio.window import Window

#: Recent files that the menu keeps, and files whose frames are kept: a show has many shots.
RECENT, KEPT = 10, 100


class FileMenu:
    """The files of a window."""

    def __init__(self, window: "Window") -> None:
        self.window, self.session = window, window.session
        self._marked = ""  # the sidecar that the settings have as open

    def open_path(self, path: str, clip: str | None = None) -> None:
        """Open a sidecar or a manifest; a clip without a palette, or an edit, is analysed."""
        QApplication.setOverrideCursor(Qt.CursorShape.WaitCursor)
        try:
            self._open(path, clip)
        except (Palette4dError, OSError) as error:
            self.session.report(error)
        finally:
            QApplication.restoreOverrideCursor()

    def _open(self, path: str, clip: str | None) -> None:
        found, shots = Path(path), self.window.docks["shots"]
        if manifest.is_manifest(found):
            self.window.shots.load(found)
            shots.show()
            if self.window.shots.count():
                self.window.shots.open_first()
            self.remember(path)
            return
        if is_timeline(path):
            self.window.verbs.analyze_show(path)
        elif found.name.endswith(".json"):
            self._open_sidecar(found, clip)
        else:
            beside_it = sidecar_of(path)
            if beside_it is not None:
                self._open_sidecar(beside_it, path)
            else:
                self.session.open_clip(path)
                self.window.verbs.analyze()
        self.remember(path)
        if not self.window.shots.follow():
            shots.hide()

    def _open_sidecar(self, path: Path, clip: str | None = None) -> None:
        """Open a sidecar at the frame at which it was left."""
        frame = self._frames().get(str(path.absolute()))
        self.session.open_sidecar(path, clip)
        if frame is not None:
            self.session.go(frame)
        self._offer_recovery(path)

    def _offer_recovery(self, path: Path) -> None:
        copy = recovered(path)
        if copy is not None:
            self.session.say(texts.RECOVERY.format(copy=copy), "warning")
            does = {
                texts.OPEN_COPY: lambda: self.open_path(str(copy)),
                texts.DISCARD_COPY: lambda: self._discard(copy),
            }
            self.window.banner.tell("recovery", self.session.status.text, "warning", does)

    def _discard(self, copy: Path) -> None:
        """Remove edits that could not be saved."""
        try:
            copy.unlink(missing_ok=True)
        except OSError as error:
            self.session.report(error)
        else:
            self.window.banner.drop("recovery")

    def mark_open(self, path: Path | None) -> None:
        """Keep which sidecar is open, until it is closed: after a crash it is offered again."""
        wanted = "" if path is None else str(path.absolute())
        if wanted != self._marked:
            others = [each for each in self._listed("open") if each != self._marked]
            self._mark([wanted, *others] if wanted else others)
            self._marked = wanted
            self.mark_frame()

    def mark_frame(self) -> None:
        """Keep where the playhead is too, for the files that were open last."""
        if self._marked:
            frames = {path: at for path, at in self._frames().items() if path != self._marked}
            kept = [*frames.items(), (self._marked, self.session.frame)][-KEPT:]
            self.window.settings.setValue("frames", dict(kept))
            self.window.settings.sync()

    def _mark(self, opened: list[str]) -> None:
        self.window.settings.setValue("open", opened)
        self.window.settings.sync()

    def _frames(self) -> dict[str, int]:
        found: Any = self.window.settings.value("frames")
        frames = found if isinstance(found, dict) else {}  # the file may hold anything
        return {path: at for path, at in frames.items() if isinstance(at, int)}

    def offer_crashed(self) -> None:
        """Offer to open again what was open in a window that ended without closing."""
        marked = [each for each in self._listed("open") if each != self._marked]
        alive = [each for each in marked if is_open(each)]
        self._mark([*alive, *([self._marked] if self._marked else [])])
        lost = next((each for each in marked if each not in alive and is_there(each)), None)
        if lost is not None:
            text = texts.CRASHED.format(name=Path(lost).name)
            reopens = {texts.REOPEN: lambda: self.open_path(lost)}
            self.window.banner.tell("crash", text, "warning", reopens)

    def _listed(self, name: str) -> list[str]:
        found: Any = self.window.settings.value(name, [])
        listed = found if isinstance(found, list) else [found]  # the file may hold anything
        return [each for each in listed if isinstance(each, str) and "\0" not in each]

    def open_shot(self, path: Path) -> None:
        """Open a shot of the list."""
        try:
            self._open_sidecar(path)
        except (Palette4dError, OSError) as error:
            self.session.report(error)

    def remember(self, path: str) -> None:
        """Put a file in front of the recent ones."""
        path = str(Path(path).absolute())
        kept = [each for each in self.recent_files() if each != path]
        self.window.settings.setValue("recent", [path, *kept][:RECENT])

    def forget_recent(self) -> None:
        """Forget the recent files."""
        self.window.settings.remove("recent")
        self.window.start.fill()

    def recent_files(self) -> list[str]:
        """Return the recent files, the newest first."""
        return self._listed("recent")[:RECENT]

    def fill_recent(self) -> None:
        """Fill the menu of the recent files."""
        self.window.recent.clear()
        for path in self.recent_files():
            self.window.recent.addAction(path, functools.partial(self.open_path, path))
        self.window.recent.setEnabled(True)
        if self.window.recent.isEmpty():
            self.window.recent.addAction(texts.NOTHING_YET).setEnabled(False)

    def open(self) -> None:
        """Ask for a file and open it."""
        folder = str(self.session.path.parent) if self.session.path is not None else ""
        path, _ = QFileDialog.getOpenFileName(
            self.window, texts.OPEN_TITLE, folder, texts.OPEN_FILTER
        )
        if path:
            self.open_path(sequence_of(path))

    def find_clip(self) -> None:
        """Ask for the document's clip."""
        path, _ = QFileDialog.getOpenFileName(self.window, texts.FIND_TITLE, "", texts.CLIP_FILTER)
        if path:
            self.session.find_clip(sequence_of(path))

    def save(self) -> None:
        """Save now."""
        self.window.enter_typed()
        if self.session.save():
            self.session.say(texts.SAVED_NOW)

    def save_as(self) -> None:
        """Save under another name."""
        self.window.enter_typed()
        start = str(self.session.path or "")
        path, _ = QFileDialog.getSaveFileName(
            self.window, texts.SAVE_TITLE, start, texts.SIDECAR_FILTER
        )
        if path and self.session.save_as(path):
            self.remember(path)

    def revert(self) -> None:
        """Load the file again, and try frames again that could not be read."""
        self.session.revert()
        if self.session.player is not None:
            self.session.player.forget_errors()
            self.window.viewer.read_frame()
