"""The main window: viewer, timeline, solid and inspector of one session, and its menus."""

import contextlib
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import QEvent, QMimeData, QObject, QSettings, Qt, QTimer, QUrl, Signal
from PySide6.QtGui import (
    QAction,
    QActionGroup,
    QCloseEvent,
    QDrag,
    QDragEnterEvent,
    QDropEvent,
    QKeyEvent,
    QKeySequence,
    QMouseEvent,
)
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QApplication,
    QDockWidget,
    QFileDialog,
    QLabel,
    QLineEdit,
    QMainWindow,
    QMessageBox,
    QVBoxLayout,
    QWidget,
)

from palette4d.common.errors import Palette4dError
from palette4d.media import clip_sequence
from palette4d.media.clip import ClipError
from palette4d.media.clip_sequence import ImageSequence
from palette4d.shows import manifest
from palette4d.studio import actions, texts, theme
from palette4d.studio.actions import ACTIONS, Action
from palette4d.studio.inspector import Inspector
from palette4d.studio.instance import Listener
from palette4d.studio.jobs import Job
from palette4d.studio.panels import History, Shots
from palette4d.studio.session import Session, recovery_file
from palette4d.studio.solid_view import SolidView
from palette4d.studio.timeline_view import TimelineView
from palette4d.studio.transport import Playback, Transport
from palette4d.studio.viewer import Viewer
from palette4d.studio.work import Field, WorkDialog, beside, sequence_of

#: Milliseconds between two looks at the file.
TICK = 200
#: Shows the picture before while it is down.
COMPARE_KEY = Qt.Key.Key_C
#: Recent files that the menu keeps.
RECENT = 10


class _Post(QObject):
    """Brings calls of other threads to the window's thread."""

    called = Signal(object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.called.connect(lambda call: call(), Qt.ConnectionType.QueuedConnection)


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


class Window(QMainWindow):
    """The window of one session."""

    def __init__(self, session: Session, settings: QSettings | None = None) -> None:
        """Make all views."""
        super().__init__()
        self.session = session
        self.settings = settings if settings is not None else QSettings("palette4d", "studio")
        session.post = _Post(self).called.emit
        self.setWindowTitle(f"{texts.TITLE}[*]")
        self.setAcceptDrops(True)
        self.setDockNestingEnabled(True)
        self.viewer = Viewer(session)
        self.playback = Playback(session, self.viewer)
        self.transport = Transport(session, self.playback)
        self.timeline = TimelineView(session)
        self.solid = SolidView(session)
        self.inspector = Inspector(session)
        self.viewer.on_pick, self.viewer.on_hold = self.inspector.pick, self.inspector.hold
        self.history = History(session)
        self.shots = Shots(session, self.open_shot)
        middle = QWidget()
        column = QVBoxLayout(middle)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(self.viewer, 1)
        column.addWidget(self.transport)
        self.setCentralWidget(middle)
        self._make_docks()
        self._make_fields()
        self._make_status()
        self.actions_by_name: dict[str, QAction] = {}
        self._make_menus()
        for name in ("first_frame", "previous_frame", "play", "next_frame", "last_frame"):
            button = self.transport.buttons[name]
            button.clicked.connect(functools.partial(self._do, name))
            action = self.actions_by_name[name]
            keys = action.shortcut().toString(QKeySequence.SequenceFormat.NativeText)
            button.setToolTip(f"{action.text()} ({keys})")
        for event in ("document", "status", "clip", "selection", "view", "playing"):
            session.on(event, self._show)
        self._dialogs: list[WorkDialog] = []
        self._listener = Listener(self, self._asked_for)
        session.on("document", lambda: self._listener.listen(session.path))
        self._timer = QTimer(self)
        self._timer.timeout.connect(session.tick)
        self._timer.start(TICK)
        self._show()

    # ------------------------------------------------------------------------------------- layout

    def _make_docks(self) -> None:
        area = Qt.DockWidgetArea
        self.setCorner(Qt.Corner.BottomRightCorner, area.RightDockWidgetArea)
        self.setCorner(Qt.Corner.BottomLeftCorner, area.BottomDockWidgetArea)
        self.docks = {
            "solid": self._dock(texts.SOLID, self.solid, area.RightDockWidgetArea),
            "inspector": self._dock(texts.INSPECTOR, self.inspector, area.RightDockWidgetArea),
            "history": self._dock(texts.HISTORY, self.history, area.RightDockWidgetArea),
            "timeline": self._dock(texts.TIMELINE, self.timeline, area.BottomDockWidgetArea),
            "shots": self._dock(texts.SHOTS, self.shots, area.LeftDockWidgetArea),
        }
        self.tabifyDockWidget(self.docks["inspector"], self.docks["history"])
        self.docks["inspector"].raise_()
        self.docks["shots"].hide()
        # The timeline needs no title: it is told by what it shows.
        self.docks["timeline"].setTitleBarWidget(QWidget())

    def _make_fields(self) -> None:
        """Let a field that was entered give the keyboard back to the picture."""
        fields: list[QAbstractSpinBox | QLineEdit] = [
            *self.findChildren(QAbstractSpinBox),
            *self.findChildren(QLineEdit),
        ]
        for field in fields:
            if not isinstance(field.parent(), QAbstractSpinBox):
                field.editingFinished.connect(functools.partial(self._entered, field))
                field.installEventFilter(self)

    def _entered(self, field: QAbstractSpinBox | QLineEdit) -> None:
        line_of(field).setModified(False)
        if field.hasFocus():  # by Enter, not because the keyboard went elsewhere
            self.viewer.setFocus()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Leave undo and redo to the document, unless text was typed that is not entered yet."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and isinstance(watched, QAbstractSpinBox | QLineEdit)
        ):
            keys = QKeySequence.StandardKey
            undoes = event.matches(keys.Undo) or event.matches(keys.Redo)
            if undoes and not line_of(watched).isModified():
                event.ignore()
                return True
        return super().eventFilter(watched, event)

    def arrange(self) -> None:
        """Give the panels their usual sizes."""
        width, height = self.width(), self.height()
        side = min(max(330, width // 5), 460)
        both = Qt.Orientation
        self.resizeDocks(
            [self.docks["solid"], self.docks["inspector"]], [side] * 2, both.Horizontal
        )
        solid = min(max(220, height * 3 // 10), side)
        self.resizeDocks(
            [self.docks["solid"], self.docks["inspector"]],
            [solid, max(200, height - solid)],
            both.Vertical,
        )
        low = max(height * 3 // 10, min(300, height * 2 // 5))
        self.resizeDocks([self.docks["timeline"]], [low], both.Vertical)

    def _dock(self, title: str, view: QWidget, area: Qt.DockWidgetArea) -> QDockWidget:
        dock = QDockWidget(title, self)
        dock.setObjectName(title)
        dock.setWidget(view)
        features = QDockWidget.DockWidgetFeature
        dock.setFeatures(features.DockWidgetClosable | features.DockWidgetMovable)
        self.addDockWidget(area, dock)
        return dock

    def _make_status(self) -> None:
        bar = self.statusBar()
        bar.setSizeGripEnabled(False)
        self.says = QLabel()
        self.says.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.says.setMinimumWidth(100)
        self.file_facts, self.view_facts = FileLabel(self.session), QLabel()
        bar.addWidget(self.file_facts)
        bar.addWidget(self.says, 1)
        bar.addPermanentWidget(self.view_facts)
        for label in (self.file_facts, self.view_facts):
            label.setStyleSheet(f"color: {theme.FAINT}; padding: 2px 8px")

    def _make_menus(self) -> None:
        titles = dict.fromkeys(action.menu for action in ACTIONS)
        self.menus = {title: self.menuBar().addMenu(title) for title in titles}
        group = -1
        last = ""
        compares = QActionGroup(self)
        for action in ACTIONS:
            menu = self.menus[action.menu]
            if action.menu == last and action.group != group:
                menu.addSeparator()
            last, group = action.menu, action.group
            made = self._action(action)
            menu.addAction(made)
            if action.name.startswith("show_"):
                compares.addAction(made)
            if action.name == "open":
                self.recent = menu.addMenu(texts.RECENT)
                self.recent.aboutToShow.connect(self._fill_recent)
        # The views' own keys work while they have the keyboard.
        for panel in (self.timeline, self.solid):
            for title, more in panel.menu_actions.items():
                self.menus[title].addSeparator()
                self.menus[title].addActions(more)
        palette = self.menus[actions.PALETTE]
        self.versions = palette.addMenu(texts.VERSIONS)
        self.versions.aboutToShow.connect(self._fill_versions)
        view = self.menus[actions.VIEW]
        view.addSeparator()
        for dock in self.docks.values():
            view.addAction(dock.toggleViewAction())
        for number in range(1, 10):
            shortcut = QAction(self)
            shortcut.setShortcut(QKeySequence(str(number)))
            shortcut.triggered.connect(functools.partial(self.use_version, number))
            self.addAction(shortcut)

    def _action(self, action: Action) -> QAction:
        made = QAction(action.text, self)
        made.setShortcuts([QKeySequence(keys) for keys in action.keys])
        made.setCheckable(action.checks)
        # The key of hold-to-compare is watched, because its release matters.
        if action.name == "compare":
            made.setShortcuts([])
            made.setText(f"{action.text}\t{action.keys[0]}")
        made.triggered.connect(functools.partial(self._do, action.name))
        self.actions_by_name[action.name] = made
        return made

    def _do(self, name: str, *_: object) -> None:
        """Do an action; whatever goes wrong becomes the status."""
        try:
            getattr(self, f"do_{name}")()
        except (Palette4dError, OSError) as error:
            self.session.report(error)

    # ------------------------------------------------------------------------------- what it says

    def _show(self) -> None:
        session, view = self.session, self.session.view
        document, status = session.document, session.status
        colour = {"info": theme.TEXT, "warning": theme.WARNING, "error": theme.ERROR}
        self.says.setStyleSheet(f"color: {colour[status.level]}")
        sign = {"info": "", "warning": texts.WARNING_SIGN, "error": texts.ERROR_SIGN}
        self.says.setText(sign[status.level] + status.text)
        self.says.setToolTip(status.text)
        facts = []
        if session.path is not None and document is not None:
            facts = [session.path.name, texts.SAVED if session.saved else texts.UNSAVED]
            facts.append(texts.HANDLES.format(count=len(document.core.polytope.vertex_ids)))
            picks = sum(kind == "pick" for kind, _ in document.state)
            if picks:
                facts.append(texts.PICKS.format(count=picks))
        elif session.clip is not None:
            facts = [session.clip.name, texts.NO_PALETTE]
        self.file_facts.setText("  ·  ".join(facts))
        display = session.display
        shown = ""
        if display is not None and not display.known and session.clip is not None:
            shown = texts.AS_IS_STATUS
        elif display is not None and self.viewer.picture is not None:
            error = self.viewer.picture.quick_error
            if error:
                shown = texts.LUT_ERROR.format(error=error * 255)
        if view.outside and self.viewer.picture is not None:
            shown += "  " + texts.OUTSIDE.format(share=self.viewer.picture.share)
        self.view_facts.setText(shown)
        name = session.path.name if session.path is not None else ""
        title = name or (session.clip.name if session.clip is not None else "")
        self.setWindowTitle(f"{title}[*] — {texts.TITLE}" if title else texts.TITLE)
        self.setWindowModified(not session.saved)
        checks = {
            **{f"show_{each}": view.compare == each for each in texts.COMPARE},
            "outside": view.outside,
            "loop": session.loop,
            "full_screen": self.isFullScreen(),
        }
        for action, checked in checks.items():
            self.actions_by_name[action].setChecked(checked)
        open_ = document is not None
        for action in (
            *("save", "save_as", "revert", "analyze_again", "render", "bake", "export", "config"),
            *("reset_all", "save_version", "compare_version", "ramp_linear", "ramp_smooth"),
            *("ramp_hold", "find_clip", "copy_grade", "pick_pixel", "hold_pixel"),
        ):
            self.actions_by_name[action].setEnabled(open_)
        self.actions_by_name["undo"].setEnabled(open_ and bool(document and document.history))
        self.actions_by_name["redo"].setEnabled(open_ and bool(document and document.undone))
        for action in ("reset_selected", "lock", "add_stop"):
            self.actions_by_name[action].setEnabled(open_ and bool(session.selection))
        many = self.shots.count() > 1
        for action in ("next_shot", "previous_shot"):
            self.actions_by_name[action].setEnabled(many)

    # -------------------------------------------------------------------------------------- files

    def open_path(self, path: str, clip: str | None = None) -> None:
        """Open a sidecar, a manifest, or a clip; a clip without a palette is offered to analyse."""
        QApplication.setOverrideCursor(Qt.CursorShape.WaitCursor)
        try:
            self._open(path, clip)
        except (Palette4dError, OSError) as error:
            self.session.report(error)
        finally:
            QApplication.restoreOverrideCursor()

    def _open(self, path: str, clip: str | None) -> None:
        found = Path(path)
        if manifest.is_manifest(found):
            self.shots.load(found)
            self.docks["shots"].show()
            if self.shots.count():
                self.shots.open_first()
        elif found.name.endswith(".json"):
            self.session.open_sidecar(found, clip)
            self._offer_recovery(found)
        else:
            beside_it = sidecar_of(path)
            if beside_it is not None:
                self.session.open_sidecar(beside_it, path)
            else:
                self.session.open_clip(path)
                self.do_analyze()
        self.remember(path)

    def _offer_recovery(self, path: Path) -> None:
        copy = recovery_file(path)
        if not copy.exists() or copy.stat().st_mtime < path.stat().st_mtime:
            return
        self.session.say(texts.RECOVERY.format(copy=copy), "warning")

    def open_shot(self, path: Path) -> None:
        """Open a shot of the list."""
        try:
            self.session.open_sidecar(path)
        except (Palette4dError, OSError) as error:
            self.session.report(error)

    def remember(self, path: str) -> None:
        """Put a file in front of the recent ones."""
        path = str(Path(path).absolute())
        kept = [each for each in self.recent_files() if each != path]
        self.settings.setValue("recent", [path, *kept][:RECENT])

    def recent_files(self) -> list[str]:
        """Return the recent files, the newest first."""
        found: Any = self.settings.value("recent", [])
        return [found] if isinstance(found, str) else [str(each) for each in found or []]

    def _fill_recent(self) -> None:
        self.recent.clear()
        for path in self.recent_files():
            self.recent.addAction(path, functools.partial(self.open_path, path))
        self.recent.setEnabled(True)
        if self.recent.isEmpty():
            self.recent.addAction(texts.NOTHING_YET).setEnabled(False)

    def do_open(self) -> None:
        """Ask for a file and open it."""
        folder = str(self.session.path.parent) if self.session.path is not None else ""
        path, _ = QFileDialog.getOpenFileName(self, texts.OPEN_TITLE, folder, texts.OPEN_FILTER)
        if path:
            self.open_path(sequence_of(path))

    def do_find_clip(self) -> None:
        """Ask for the document's clip."""
        path, _ = QFileDialog.getOpenFileName(self, texts.FIND_TITLE, "", texts.CLIP_FILTER)
        if path:
            self.session.find_clip(sequence_of(path))

    def do_save(self) -> None:
        """Save now."""
        if self.session.save():
            self.session.say(texts.SAVED_NOW)

    def do_save_as(self) -> None:
        """Save under another name."""
        start = str(self.session.path or "")
        path, _ = QFileDialog.getSaveFileName(self, texts.SAVE_TITLE, start, texts.SIDECAR_FILTER)
        if path and self.session.save_as(path):
            self.remember(path)

    def do_revert(self) -> None:
        """Load the file again, and try frames again that could not be read."""
        self.session.revert()
        if self.session.player is not None:
            self.session.player.forget_errors()
            self.viewer.read_frame()

    def do_quit(self) -> None:
        """Close the window."""
        self.close()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take files."""
        if event.mimeData().hasUrls():
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open the dropped file."""
        paths = [url.toLocalFile() for url in event.mimeData().urls() if url.isLocalFile()]
        if paths:
            event.acceptProposedAction()
            self.open_path(sequence_of(paths[0]))

    def closeEvent(self, event: QCloseEvent) -> None:
        """Save; if that fails, ask before anything is lost."""
        if not self.session.save():
            answer = QMessageBox.question(
                self,
                texts.TITLE,
                texts.CLOSE_ANYWAY.format(why=self.session.status.text),
                QMessageBox.StandardButton.Discard | QMessageBox.StandardButton.Cancel,
            )
            if answer != QMessageBox.StandardButton.Discard:
                event.ignore()
                return
        self.settings.setValue("geometry", self.saveGeometry())
        self.settings.setValue("state", self.saveState())
        self.shut()
        event.accept()

    def _asked_for(self, frame: float | None) -> None:
        """Come to the front, and go to a frame."""
        if frame is not None:
            self.session.go(frame)
        self.setWindowState(self.windowState() & ~Qt.WindowState.WindowMinimized)
        self.raise_()
        self.activateWindow()

    @property
    def settled(self) -> bool:
        """Whether what is shown is final: the exact picture, and all that the panels draw."""
        session, picture = self.session, self.viewer.picture
        if session.player is None or self.viewer.problem:
            return True
        return (
            picture is not None
            and picture.exact
            and picture.request.frame == session.frame
            and picture.request.revision == session.revision
            and session.player.idle
            and (self.timeline.settled or not self.timeline.isVisible())
        )

    def shut(self) -> None:
        """End all threads and close the document."""
        self._timer.stop()
        self._listener.listen(None)
        self.session.play(0)
        self.viewer.preview.close()
        self.viewer.preview.forget()
        self.session.close()

    # ------------------------------------------------------------------------------------ editing

    def do_undo(self) -> None:
        """Undo."""
        self.session.undo()

    def do_redo(self) -> None:
        """Redo."""
        self.session.redo()

    def do_cancel(self) -> None:
        """Forget a drag; else select nothing."""
        if self.session.dragging:
            self.session.cancel()
        elif self.isFullScreen():
            self.showNormal()
        else:
            self.session.select()

    def do_reset_selected(self) -> None:
        """Reset the selected vertices, remove stops and picks."""
        ids = self.session.selection
        if not ids:
            return

        def reset(document: Any) -> None:
            for id_ in ids:
                if ("pick", id_) in document.state:
                    document.unpick(id_)
                else:
                    document.reset(id_)

        self.session.edit(lambda document: _as_one(document, "reset", ids, reset))

    def do_reset_all(self) -> None:
        """Reset everything."""
        self.session.edit(lambda document: document.reset(), texts.RESET_ALL)

    def do_add_stop(self) -> None:
        """Add a stop to the selected row at the playhead."""
        self.timeline.add_stop_at_playhead()

    def do_lock(self) -> None:
        """Lock or unlock the selected handles."""
        ids = self.session.selection

        def lock(document: Any) -> None:
            for id_ in ids:
                if ("lock", id_) in document.state:
                    document.unlock(id_)
                else:
                    document.lock(id_)

        self.session.edit(lambda document: _as_one(document, texts.LOCK, ids, lock))

    def _ramp(self, ramp: str) -> None:
        ids = self.session.selection

        def change(document: Any) -> None:
            for id_ in ids or (None,):
                document.set_ramp(ramp, id_)

        self.session.edit(lambda document: _as_one(document, f"ramp {ramp}", ids, change))

    def do_ramp_linear(self) -> None:
        """Set the ramp."""
        self._ramp("linear")

    def do_ramp_smooth(self) -> None:
        """Set the ramp."""
        self._ramp("smooth")

    def do_ramp_hold(self) -> None:
        """Set the ramp."""
        self._ramp("hold")

    def do_pick_pixel(self) -> None:
        """Pick the colour under the pointer."""
        self._at_pointer(self.viewer.on_pick)

    def do_hold_pixel(self) -> None:
        """Hold the colour under the pointer."""
        self._at_pointer(self.viewer.on_hold)

    def _at_pointer(self, act: Callable[[Any], object] | None) -> None:
        point = self.viewer._pointer
        if point is None or act is None:
            self.session.say(texts.POINT_AT, "warning")
            return
        place = self.viewer.place(point, point)
        if place is not None:
            act(place)

    # ----------------------------------------------------------------------------------- versions

    def version_names(self) -> list[str]:
        """Return the names of the versions."""
        document = self.session.document
        if document is None:
            return []
        return list(document.versions)

    def do_save_version(self) -> None:
        """Keep the edits as the next version: A, B, C…"""
        names = self.version_names()
        name = next(c for c in map(chr, range(65, 91)) if c not in names)
        self.session.edit(
            lambda document: document.save_version(name), texts.KEPT_VERSION.format(name=name)
        )

    def use_version(self, number: int) -> None:
        """Use the n-th version."""
        names = self.version_names()
        if number > len(names):
            self.session.say(texts.NO_VERSION.format(number=number), "warning")
            return
        name = names[number - 1]
        self.session.edit(
            lambda document: document.use_version(name), texts.USES_VERSION.format(name=name)
        )

    def do_compare_version(self) -> None:
        """Compare with the next version; after the last with the source."""
        names = ["", *self.version_names()]
        now = self.session.view.version
        at = names.index(now) if now in names else 0
        name = names[(at + 1) % len(names)]
        compare = self.session.view.compare
        self.session.look(version=name, compare=compare if compare != "after" else "wipe")
        if len(names) == 1:
            self.session.say(texts.NO_VERSIONS, "warning")
        else:
            self.session.say(texts.COMPARED.format(name=name) if name else texts.COMPARED_SOURCE)

    def _fill_versions(self) -> None:
        self.versions.clear()
        for number, name in enumerate(self.version_names(), 1):
            text = f"{name}\t{number}" if number < 10 else name
            self.versions.addAction(text, functools.partial(self.use_version, number))
        if self.versions.isEmpty():
            self.versions.addAction(texts.NO_VERSIONS).setEnabled(False)

    # --------------------------------------------------------------------------------------- view

    def do_show_after(self) -> None:
        """Show the picture after."""
        self.session.look(compare="after")

    def do_show_before(self) -> None:
        """Show the picture before."""
        self.session.look(compare="before")

    def do_show_wipe(self) -> None:
        """Show both, divided by a line."""
        self.session.look(compare="wipe")

    def do_show_side(self) -> None:
        """Show both."""
        self.session.look(compare="side")

    def do_compare(self) -> None:
        """Show the other picture; the key does so while it is down."""
        after = self.session.view.compare != "before"
        self.session.look(compare="before" if after else "after")

    def do_fit(self) -> None:
        """Show the whole frame."""
        self.viewer.fit()

    def do_one_to_one(self) -> None:
        """Show a pixel of the frame as a pixel of the screen."""
        self.viewer.zoom_to(1.0, self.viewer._pointer)

    def do_zoom_in(self) -> None:
        """Zoom in."""
        self.viewer.zoom_by(1.5, self.viewer._pointer)

    def do_zoom_out(self) -> None:
        """Zoom out."""
        self.viewer.zoom_by(1 / 1.5, self.viewer._pointer)

    def do_outside(self) -> None:
        """Mark colours outside of the palette."""
        self.session.look(outside=not self.session.view.outside)

    def do_brighter(self) -> None:
        """Raise the exposure."""
        self.session.look(exposure=min(self.session.view.exposure + 0.25, 10.0))

    def do_darker(self) -> None:
        """Lower the exposure."""
        self.session.look(exposure=max(self.session.view.exposure - 0.25, -10.0))

    def do_plain_look(self) -> None:
        """Reset exposure and gamma."""
        self.session.look(exposure=0.0, gamma=1.0)

    def do_full_screen(self) -> None:
        """Fill the screen, or no more."""
        self.setWindowState(self.windowState() ^ Qt.WindowState.WindowFullScreen)

    # ------------------------------------------------------------------------------------ playback

    def do_play(self) -> None:
        """Play or stop."""
        self.session.play(0 if self.session.playing else 1)

    def do_stop(self) -> None:
        """Stop."""
        self.session.play(0)

    def _shuttle(self, way: int) -> None:
        now = self.session.playing
        self.session.play(way if now * way <= 0 else max(-8, min(8, now * 2)))

    def do_play_forwards(self) -> None:
        """Play forwards; again: faster."""
        self._shuttle(1)

    def do_play_backwards(self) -> None:
        """Play backwards; again: faster."""
        self._shuttle(-1)

    def _step(self, frames: int) -> None:
        if self.session.playing:
            self.session.play(0)
        self.session.step(frames)

    def do_next_frame(self) -> None:
        """Go one frame on."""
        self._step(1)

    def do_previous_frame(self) -> None:
        """Go one frame back."""
        self._step(-1)

    def do_ten_on(self) -> None:
        """Go ten frames on."""
        self._step(10)

    def do_ten_back(self) -> None:
        """Go ten frames back."""
        self._step(-10)

    def handle_frames(self) -> list[int]:
        """Return the frames of vertices and stops, in order."""
        document = self.session.document
        if document is None:
            return []
        times = {float(t) for t in document.core.polytope.vertices[:, 3]}
        times |= {s.frame for s in document.settings.values() if s.frame is not None}
        first, last, _ = document.frames
        return sorted({round(min(max(time, first), last)) for time in times})

    def do_next_handle(self) -> None:
        """Go to the next frame with a handle."""
        later = [frame for frame in self.handle_frames() if frame > self.session.frame]
        if later:
            self.session.go(later[0])

    def do_previous_handle(self) -> None:
        """Go to the frame with a handle before."""
        earlier = [frame for frame in self.handle_frames() if frame < self.session.frame]
        if earlier:
            self.session.go(earlier[-1])

    def do_first_frame(self) -> None:
        """Go to the first frame, or to the in point."""
        self.session.go(self.playback.span()[0])

    def do_last_frame(self) -> None:
        """Go to the last frame, or to the out point."""
        self.session.go(self.playback.span()[1])

    def do_mark_in(self) -> None:
        """Set the in point."""
        self.session.mark(start=self.session.frame)

    def do_mark_out(self) -> None:
        """Set the out point."""
        self.session.mark(end=self.session.frame)

    def do_clear_marks(self) -> None:
        """Remove in and out point."""
        self.session.mark()

    def do_loop(self) -> None:
        """Begin again at the end, or no more."""
        self.session.loop = not self.session.loop

    # --------------------------------------------------------------------------------------- work

    def _work(
        self,
        title: str,
        verb: str,
        fields: list[Field],
        done: Callable[[Job], object] | None = None,
    ) -> WorkDialog:
        self.session.save()
        dialog = WorkDialog(self, title, verb, fields, self.session.post, done)
        dialog.show()
        self._dialogs.append(dialog)
        dialog.destroyed.connect(lambda: self._dialogs.remove(dialog))
        return dialog

    @property
    def _clip_source(self) -> str:
        return "" if self.session.clip is None else self.session.clip.source

    def do_analyze(self) -> WorkDialog:
        """Find the palette of a clip."""
        source = self._clip_source
        out = ""
        if source:
            path = Path(source)
            # The name by which the node finds it, see docs/node.md.
            stem = path.name.split("#")[0].rstrip("._-") or path.absolute().parent.name
            stem = Path(stem).stem if "#" not in source else stem
            out = str(path.with_name(f"{stem}.p4d.json"))
        return self._analyze(texts.ANALYZE, source, out, "--drop-edits" if out else "")

    def do_analyze_again(self) -> WorkDialog:
        """Find the palette of the document's clip again."""
        return self._analyze(
            texts.ANALYZE_AGAIN, self._clip_source, str(self.session.path or ""), "--keep-edits"
        )

    def _analyze(self, title: str, clip: str, out: str, edits: str) -> WorkDialog:
        fields = [
            Field("", texts.CLIP, "open", clip, hint=texts.CLIP_HINT),
            Field("-o", texts.SIDECAR, "save", out),
            Field("--frames", texts.FRAMES, hint=texts.FRAMES_HINT),
            Field("--vertices", texts.VERTICES, hint=texts.VERTICES_HINT),
            Field("--input-space", texts.INPUT_SPACE, hint=texts.SPACE_HINT),
            Field("--palette-space", texts.PALETTE_SPACE, hint=texts.SPACE_HINT),
            Field("--ocio-config", texts.CONFIG, "open", hint="$OCIO"),
        ]
        if edits == "--keep-edits":
            fields.append(Field("--keep-edits", texts.KEEP_EDITS, "check", "yes"))
        fields.append(Field("--skip-bad-frames", texts.SKIP_BAD, "check"))
        fields.append(Field("--allow-cuts", texts.ALLOW_CUTS, "check"))

        def done(_: Job) -> None:
            self.open_path(dialog.value("-o"), dialog.value("") or None)
            dialog.close()

        dialog = self._work(title, "analyze", fields, done)
        return dialog

    def do_render(self) -> WorkDialog:
        """Write the recoloured clip."""
        path = self.session.path
        assert path is not None
        stem = path.name.removesuffix(".p4d.json")
        marks = self.session.marks
        return self._work(
            texts.RENDER,
            "render",
            [
                Field("", texts.SIDECAR, "open", str(path)),
                Field("", texts.CLIP, "open", self._clip_source),
                Field("-o", texts.OUTPUT, "save", str(path.with_name(f"{stem}_graded.mp4"))),
                Field("--frames", texts.FRAMES, value="{}-{}".format(*marks) if marks else ""),
                Field("--compare", texts.COMPARE_LABEL, "choice", "", ("", "wipe", "side"), "no"),
                Field("--bits", texts.BITS, "choice", "", ("", "8", "16", "32"), "as the clip"),
                Field("--half", texts.HALF, "check"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def do_bake(self) -> WorkDialog:
        """Write a LUT of this frame."""
        path = self.session.path
        assert path is not None
        frame = self.session.frame
        return self._work(
            texts.BAKE,
            "bake",
            [
                Field("", texts.SIDECAR, "open", str(path)),
                Field("--frame", texts.FRAME_FIELD, value=str(frame)),
                Field("-o", texts.OUTPUT, "save", beside(path, f"_{frame}.cube")),
                Field("--size", texts.GRID, hint="33"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def do_export(self) -> WorkDialog:
        """Write LUTs over time."""
        path = self.session.path
        assert path is not None
        return self._work(
            texts.EXPORT,
            "export",
            [
                Field("", texts.SIDECAR, "open", str(path)),
                Field("--every", texts.EVERY, value="1"),
                Field("-o", texts.FOLDER, "folder", beside(path, "_luts")),
                Field("--format", texts.FORMAT, hint="cube"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def do_config(self) -> WorkDialog:
        """Write an OpenColorIO config with the looks."""
        path = self.session.path
        assert path is not None
        return self._work(
            texts.CONFIG_WORK,
            "config",
            [
                Field("", texts.SIDECAR, "open", str(path)),
                Field("-o", texts.FOLDER, "folder", beside(path, "_config")),
                Field("--base", texts.BASE_CONFIG, "open"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def do_install(self) -> WorkDialog:
        """Install the OpenFX node."""
        return self._work(
            texts.INSTALL,
            "install-plugin",
            [
                Field("--dest", texts.FOLDER, "folder", str(Path.home() / "OFX")),
                Field("--link", texts.LINK, "check"),
                Field("--kdenlive", "Kdenlive", "check"),
                Field("--shotcut", "Shotcut", "check"),
                Field("--force", texts.FORCE, "check"),
            ],
        )

    def do_copy_grade(self) -> None:
        """Copy this grade to another shot."""
        path, _ = QFileDialog.getOpenFileName(self, texts.COPY_TITLE, "", texts.SIDECAR_FILTER)
        if path and self.session.path is not None:
            self._work(
                texts.COPY_GRADE,
                "edit",
                [
                    Field("", texts.TO_SHOT, "open", path),
                    Field("", texts.ACTION, "choice", "copy", ("copy",)),
                    Field("", texts.FROM_SHOT, "open", str(self.session.path)),
                ],
            )

    def do_next_shot(self) -> None:
        """Open the next shot of the list."""
        self.shots.step(1)

    def do_previous_shot(self) -> None:
        """Open the shot before."""
        self.shots.step(-1)

    # --------------------------------------------------------------------------------------- help

    def do_first_steps(self) -> None:
        """Show the first steps."""
        QMessageBox.information(self, texts.FIRST_STEPS, texts.FIRST_STEPS_TEXT)

    def do_manual(self) -> None:
        """Show the gestures and keys."""
        rows = [f"{where}: {gesture} — {what}" for where, gesture, what in actions.GESTURES]
        listed = (*ACTIONS, *actions.TIMELINE_ACTIONS, *actions.SOLID_ACTIONS)
        keys = [f"{', '.join(a.keys)} — {a.text}" for a in listed if a.keys]
        box = QMessageBox(QMessageBox.Icon.NoIcon, texts.MANUAL, "\n".join(rows), parent=self)
        box.setDetailedText("\n".join(keys))
        box.exec()

    def do_about(self) -> None:
        """Say what this is."""
        from palette4d._core import __version__

        QMessageBox.about(self, texts.TITLE, texts.ABOUT.format(version=__version__))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Show the picture before while the key of hold-to-compare is down."""
        if self._compares(event):
            self.viewer.hold_to_compare(True)
        else:
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Show the picture after again."""
        if event.key() == COMPARE_KEY and not event.isAutoRepeat():
            self.viewer.hold_to_compare(False)
        else:
            super().keyReleaseEvent(event)

    @staticmethod
    def _compares(event: QKeyEvent) -> bool:
        plain = event.modifiers() == Qt.KeyboardModifier.NoModifier
        return event.key() == COMPARE_KEY and plain and not event.isAutoRepeat()


def _as_one(document: Any, what: str, ids: tuple[str, ...], change: Callable[[Any], None]) -> None:
    """Do a change of several handles as one step; of one as the verb does it."""
    if len(ids) == 1:
        change(document)
        return
    with document.one_step(f"{what} {', '.join(ids)}"):
        change(document)


def line_of(field: QAbstractSpinBox | QLineEdit) -> QLineEdit:
    """Return the line of text of a field."""
    return field if isinstance(field, QLineEdit) else field.lineEdit()


def sidecar_of(path: str) -> Path | None:
    """Return the sidecar beside a clip, if it was analysed before."""
    found = Path(path)
    names = [found.name.split("#")[0].split("%")[0].rstrip("._-"), found.stem, found.name]
    if "#" in found.name:
        with contextlib.suppress(ClipError):
            names.append(clip_sequence.of_pattern(path)[0].name)
    for name in dict.fromkeys(names):
        candidate = found.absolute().with_name(f"{name}.p4d.json")
        if name and candidate.is_file():
            return candidate
    if found.is_dir():  # or in the folder, beside its frames
        with contextlib.suppress(ClipError):
            inside = clip_sequence.in_folder(found)
            return sidecar_of(inside.pattern if isinstance(inside, ImageSequence) else str(inside))
    return None
