"""The main window: viewer, timeline, solid and inspector of one session, and its menus."""

import functools
from collections.abc import Callable

from PySide6.QtCore import (
    QByteArray,
    QCoreApplication,
    QEvent,
    QObject,
    QSettings,
    Qt,
    QTimer,
)
from PySide6.QtGui import (
    QAction,
    QActionGroup,
    QCloseEvent,
    QDragEnterEvent,
    QDropEvent,
    QKeyEvent,
    QKeySequence,
    QResizeEvent,
)
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QDockWidget,
    QLineEdit,
    QMainWindow,
    QMessageBox,
    QTabBar,
    QVBoxLayout,
    QWidget,
)
from shiboken6 import isValid

from palette4d.common.errors import Palette4dError
from palette4d.studio import menu_entries, texts
from palette4d.studio.banner import Banner
from palette4d.studio.colour_widgets import Keyed
from palette4d.studio.file_menu import FileMenu
from palette4d.studio.help_menu import HelpMenu
from palette4d.studio.history_list import History
from palette4d.studio.inspector import Inspector
from palette4d.studio.instance import Listener
from palette4d.studio.menu_actions import MenuActions
from palette4d.studio.menu_entries import ACTIONS, Action
from palette4d.studio.no_objects import refuse_objects
from palette4d.studio.paths import sequence_of
from palette4d.studio.pointer import Pointer
from palette4d.studio.preferences import DISPLAY
from palette4d.studio.scopes_view import Scopes
from palette4d.studio.session import Session
from palette4d.studio.shortcuts import Shortcuts
from palette4d.studio.shot_list import Shots
from palette4d.studio.solid_view import SolidView
from palette4d.studio.start_page import StartPage
from palette4d.studio.status_line import StatusLine
from palette4d.studio.timeline_view import TimelineView
from palette4d.studio.transport import Playback, Transport
from palette4d.studio.turns import Post, Turns
from palette4d.studio.verb_dialog import VerbDialog
from palette4d.studio.verb_menu import VerbMenu
from palette4d.studio.versions_gallery import Gallery
from palette4d.studio.viewer import Viewer

#: Below this height the solid and the scopes are tabs beside the inspector.
LOW = 800
#: The layouts in the settings, of high windows and of low ones.
STATES = {False: "state", True: "low_state"}
#: Milliseconds between two looks at the file.
TICK = 100
#: Milliseconds for which the playhead rests before its frame is kept for *Reopen*.
REST = 500
#: Shows the picture before while it is down.
COMPARE_KEY = Qt.Key.Key_C


class Window(QMainWindow):
    """The window of one session."""

    def __init__(self, session: Session, settings: QSettings | None = None) -> None:
        """Make all views."""
        super().__init__()
        refuse_objects()
        self.session = session
        self.settings = settings if settings is not None else QSettings("palette4d", "studio")
        session.post = Post(self).post
        self.setWindowTitle(f"{texts.TITLE}[*]")
        self.setAcceptDrops(True)
        self.setDockNestingEnabled(True)
        self.viewer = Viewer(session)
        self.turns = Turns(self, lambda: session.player is None or self.viewer.current)
        session.later = self.turns.later
        self.playback = Playback(session, self.viewer)
        self.transport = Transport(session, self.playback)
        self.timeline = TimelineView(session)
        self.solid = SolidView(session)
        self.scopes = Scopes(session, self.viewer, self.settings)
        self.inspector = Inspector(session)
        self.viewer.on_pick, self.viewer.on_hold = self.inspector.pick, self.inspector.hold
        self.viewer.on_area = self.inspector.add_area
        self.viewer.on_picked = self.inspector.ask_colour
        self.history = History(session)
        self.gallery = Gallery(session)
        self.files = FileMenu(self)
        self.shots = Shots(session, self.files.open_shot)
        middle = QWidget()
        column = QVBoxLayout(middle)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addWidget(self.viewer, 1)
        column.addWidget(self.transport)
        self.setCentralWidget(middle)
        self._low = False  #: whether panels are folded
        self._states: dict[bool, QByteArray] = {}  #: the layouts for both, as they were left
        self._make_docks()
        self._make_fields()
        self.line = StatusLine(session, self.viewer)
        self.setStatusBar(self.line)
        self.commands, self.verbs, self.help = MenuActions(self), VerbMenu(self), HelpMenu(self)
        files, verbs = self.files, self.verbs
        self.banner = Banner(
            session, self.viewer, files.find_clip, files.save_as, verbs.choose_space
        )
        column.insertWidget(0, self.banner)
        self.start = StartPage(
            session, files.open, verbs.try_sample, self.open_path, files.recent_files
        )
        QVBoxLayout(self.viewer).addWidget(self.start)
        self.actions_by_name: dict[str, QAction] = {}
        self._make_menus()
        self.keys = Shortcuts(self.settings, self._entry)
        session.look(display=str(self.settings.value(DISPLAY) or ""))
        for name in ("first_frame", "previous_frame", "play", "next_frame", "last_frame"):
            button = self.transport.buttons[name]
            button.clicked.connect(functools.partial(self._do, name))
            action = self.actions_by_name[name]
            keys = action.shortcut().toString(QKeySequence.SequenceFormat.NativeText)
            button.setToolTip(f"{action.text()} ({keys})")
        for event in ("document", "status", "clip", "selection", "view", "playing"):
            session.on(event, self._show, panel=True)
        dragged = (self.viewer, self.solid, self.timeline, *self.findChildren(Keyed))
        self._pointer = Pointer(session, dragged)
        session.on("selection", self._bring_inspector)
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        app.focusChanged.connect(self._keep_focus)
        self._closing = False  # when no edit reads the clip any more
        session.on("followed", self._close_if_followed)
        self._first_state = self.saveState()
        self._listener = Listener(self, self._asked_for)
        session.on("document", lambda: self._listener.listen(session.path))
        session.on("document", lambda: self.files.mark_open(session.path))
        self._resting = QTimer(self, interval=REST, singleShot=True)
        self._resting.timeout.connect(self.files.mark_frame)
        session.on("frame", self._resting.start)
        self._timer = QTimer(self)
        self._timer.timeout.connect(session.tick)
        self._timer.start(TICK)
        self._show()

    def _keep_focus(self, old: QWidget | None, new: QWidget | None) -> None:
        """Give the keyboard to the picture where what had it is gone.

        Qt gives it to the next button, such as *Remove*, which Space would press.
        """
        if old is None or not isinstance(new, QAbstractButton) or new.window() is not self:
            return
        if not isValid(old) or not old.isVisible() or not old.isEnabled():
            self.viewer.setFocus()

    # ------------------------------------------------------------------------------------- layout

    def _make_docks(self) -> None:
        area = Qt.DockWidgetArea
        self.setCorner(Qt.Corner.BottomRightCorner, area.RightDockWidgetArea)
        self.setCorner(Qt.Corner.BottomLeftCorner, area.BottomDockWidgetArea)
        self.docks = {
            "solid": self._dock(texts.SOLID, self.solid, area.RightDockWidgetArea),
            "scopes": self._dock(texts.SCOPES_PANEL, self.scopes, area.RightDockWidgetArea),
            "inspector": self._dock(texts.INSPECTOR, self.inspector, area.RightDockWidgetArea),
            "history": self._dock(texts.HISTORY, self.history, area.RightDockWidgetArea),
            "versions": self._dock(texts.VERSIONS, self.gallery, area.RightDockWidgetArea),
            "timeline": self._dock(texts.TIMELINE, self.timeline, area.BottomDockWidgetArea),
            "shots": self._dock(texts.SHOTS, self.shots, area.LeftDockWidgetArea),
        }
        for dock in self.docks.values():  # Qt draws the tabs of layouts on the way to the last one
            dock.hide()
        self.tabifyDockWidget(self.docks["inspector"], self.docks["history"])
        self.tabifyDockWidget(self.docks["history"], self.docks["versions"])
        self.docks["versions"].visibilityChanged.connect(
            lambda _: self.turns.later(self.gallery.refresh)
        )
        self.tabifyDockWidget(self.docks["solid"], self.docks["scopes"])
        self.docks["scopes"].visibilityChanged.connect(
            lambda _: self.turns.later(self.scopes.follow)  # when it is where it will be
        )
        for name, dock in self.docks.items():
            dock.setVisible(name != "shots")
        self.docks["inspector"].raise_()
        self.docks["solid"].raise_()
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

    def enter_typed(self) -> None:
        """Enter what was typed in the field that has the keyboard."""
        field = self.focusWidget()
        if isinstance(field, QAbstractSpinBox | QLineEdit):
            field.clearFocus()
        self.session.keep_typed()

    def event(self, event: QEvent) -> bool:
        """Leave the space bar to a button that has the keyboard: else it plays."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            plain = event.modifiers() == Qt.KeyboardModifier.NoModifier
            button = isinstance(self.focusWidget(), QAbstractButton | QComboBox)
            if event.key() == Qt.Key.Key_Space and plain and button:
                event.accept()
                return True
        return super().event(event)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Leave undo and redo to the document, unless text was typed that is not entered yet.

        The key of hold-to-compare may come up over a menu or a dialog, or in another program.
        """
        if self.viewer.comparing and (
            event.type() == QEvent.Type.ApplicationDeactivate
            or (
                event.type() == QEvent.Type.KeyRelease
                and isinstance(event, QKeyEvent)
                and event.key() == COMPARE_KEY
                and not event.isAutoRepeat()
            )
        ):
            self._compare(False)
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

    def reset_layout(self) -> None:
        """Give the panels their first places and sizes; the shots stay as they are."""
        shots = self.docks["shots"].isVisible()
        self.restoreState(self._first_state)
        self._states.clear()
        self._low = False
        self.arrange()
        self.docks["shots"].setVisible(shots)

    def show_or_hide(self, panel: str) -> None:
        """Show a panel above those that it lies below; hide it if it is seen."""
        dock = self.docks[panel]
        if dock.widget().visibleRegion().isEmpty():
            dock.show()
            dock.raise_()
        else:
            dock.hide()

    def arrange(self) -> None:
        """Give the panels their usual places and sizes."""
        self._fold()
        width, height = self.width(), self.height()
        side = min(max(330, width * 6 // 25), 460)
        both = Qt.Orientation
        self.resizeDocks([self.docks["inspector"]], [side], both.Horizontal)
        if not self._low:
            solid = min(height // 4, side)
            panels = [self.docks["solid"], self.docks["inspector"]]
            self.resizeDocks(panels, [solid, height - solid], both.Vertical)
        self.resizeDocks([self.docks["timeline"]], [max(200, height * 32 // 100)], both.Vertical)

    def _fold(self) -> None:
        """Let the solid and the scopes share the inspector's place in a low window."""
        low = self.height() < LOW
        if low == self._low:
            return
        self._states[self._low] = self.saveState()
        self._low = low
        if low in self._states:
            self.restoreState(self._states[low])
            return
        for name in ("solid", "scopes"):
            self.tabifyDockWidget(self.docks["versions"], self.docks[name])
        for bar in self.findChildren(QTabBar, options=Qt.FindChildOption.FindDirectChildrenOnly):
            bar.hide()  # Qt shows those again that it goes on to use
        self.docks["inspector"].raise_()
        self.arrange()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fold panels where they have no room, and unfold them where they have."""
        super().resizeEvent(event)
        self._fold()

    def restore(self) -> None:
        """Have the size and the panels as they were left; the shots come with a show."""
        geometry = self.settings.value("geometry")
        if isinstance(geometry, QByteArray):
            self.restoreGeometry(geometry)
        self._fold()
        for low, name in STATES.items():
            if isinstance(state := self.settings.value(name), QByteArray):
                self._states[low] = state
        self.restoreState(self._states.get(self._low, QByteArray()))
        self.docks["shots"].hide()

    def _dock(self, title: str, view: QWidget, area: Qt.DockWidgetArea) -> QDockWidget:
        dock = QDockWidget(title, self)
        dock.setObjectName(title)
        dock.setWidget(view)
        features = QDockWidget.DockWidgetFeature
        dock.setFeatures(features.DockWidgetClosable | features.DockWidgetMovable)
        self.addDockWidget(area, dock)
        return dock

    def _make_menus(self) -> None:
        self.menus = {menu: self.menuBar().addMenu(title) for menu, title in texts.MENUS.items()}
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
                self.recent.aboutToShow.connect(self.files.fill_recent)
        # The views' own keys work while they have the keyboard.
        for panel in (self.timeline, self.solid):
            for title, more in panel.menu_actions.items():
                self.menus[title].addSeparator()
                self.menus[title].addActions(more)
        palette = self.menus[menu_entries.PALETTE]
        self.versions = palette.addMenu(texts.VERSIONS)
        self.versions.aboutToShow.connect(self._fill_versions)
        view = self.menus[menu_entries.VIEW]
        view.addSeparator()
        for dock in self.docks.values():
            view.addAction(dock.toggleViewAction())
        for action in menu_entries.VERSION_ACTIONS:
            self.addAction(self._action(action))

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

    def _entry(self, action: Action) -> QAction:
        """Return the menus' entry of an action, of the window or of a panel."""
        if action.view == "window":
            return self.actions_by_name[action.name]
        panel = self.timeline if action.view == "timeline" else self.solid
        found = panel.findChild(QAction, action.name)
        assert isinstance(found, QAction)
        return found

    def action(self, name: str) -> Callable[[], object]:
        """Return what does an action: a call of the menus, or a method of its name."""
        owners: tuple[object, ...] = (self.files, self.commands, self.verbs, self.help)
        methods = (getattr(each, name) for each in owners if hasattr(each, name))
        return self.commands.calls.get(name) or next(methods)

    def _do(self, name: str, *_: object) -> None:
        """Do an action; whatever goes wrong becomes the status."""
        try:
            self.action(name)()
        except (Palette4dError, OSError) as error:
            self.session.report(error)

    # ------------------------------------------------------------------------------- what it says

    def _show(self) -> None:
        session, view = self.session, self.session.view
        document = session.document
        self.line.show_state()
        name = session.path.name if session.path is not None else ""
        title = name or (session.clip.name if session.clip is not None else "")
        self.setWindowTitle(f"{title}[*] — {texts.TITLE}" if title else texts.TITLE)
        self.setWindowModified(not session.saved)
        checks = {
            **{f"show_{each}": view.compare == each for each in texts.COMPARE},
            "outside": view.outside,
            "matte": view.matte,
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
        past, former = None if document is None else document.history, self.verbs.former
        self.actions_by_name["undo"].setEnabled(bool(past) or former.can_undo)
        self.actions_by_name["redo"].setEnabled(bool(past and past.undone) or former.can_redo)
        for action in ("reset_selected", "lock", "add_stop", "act_from", "act_until"):
            self.actions_by_name[action].setEnabled(open_ and bool(session.selection))
        many = self.shots.count() > 1
        for action in ("next_shot", "previous_shot"):
            self.actions_by_name[action].setEnabled(many)

    def _bring_inspector(self) -> None:
        """Show where the colour of a pixel that was clicked is chosen."""
        if self.session.place is not None:
            self.docks["inspector"].show()
            self.docks["inspector"].raise_()

    def _fill_versions(self) -> None:
        self.versions.clear()
        for number, name in enumerate(self.session.versions, 1):
            key = " ".join(self.keys.keys(f"window.version_{number}")) if number < 10 else ""
            text = f"{name}\t{key}"
            self.versions.addAction(text, functools.partial(self.commands.use_version, number))
        if self.versions.isEmpty():
            self.versions.addAction(texts.NO_VERSIONS).setEnabled(False)

    # -------------------------------------------------------------------------------------- files

    def open_path(self, path: str, clip: str | None = None) -> None:
        """Open a sidecar or a manifest; a clip without a palette, or an edit, is analysed."""
        self.files.open_path(path, clip)

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
        """Save; if that fails, ask before anything is lost. Edits that read the clip come first."""
        self.enter_typed()
        if self.session.following and not self._closing:
            self._closing = True
            self.session.say(texts.CLOSES_SOON, "warning")
            event.ignore()
            return
        self._closing = False
        jobs = [each.job for each in self.findChildren(VerbDialog) if each.job is not None]
        if jobs and not self._may_stop():
            event.ignore()
            return
        for job in jobs:
            job.cancel()
        if not self.session.save():
            asks = QMessageBox(self)
            asks.setIcon(QMessageBox.Icon.Warning)
            asks.setTextFormat(Qt.TextFormat.PlainText)
            asks.setText(texts.CLOSE_ANYWAY.format(why=self.session.status.text))
            role = QMessageBox.ButtonRole.AcceptRole
            save_as = asks.addButton(texts.ACTIONS["window"]["save_as"], role)
            discard = asks.addButton(QMessageBox.StandardButton.Discard)
            asks.addButton(QMessageBox.StandardButton.Cancel)
            asks.setDefaultButton(save_as)
            asks.exec()
            if asks.clickedButton() == save_as:
                self.files.save_as()
            if not self.session.saved and asks.clickedButton() != discard:
                event.ignore()
                return
        self.files.mark_frame()
        self.files.mark_open(None)
        self.settings.setValue("geometry", self.saveGeometry())
        self._states[self._low] = self.saveState()
        for low, state in self._states.items():
            self.settings.setValue(STATES[low], state)
        self.shut()
        event.accept()

    def _may_stop(self) -> bool:
        """Ask whether what still runs may be stopped."""
        asks = QMessageBox(self)
        asks.setText(texts.STOP_ASKED)
        stop = asks.addButton(texts.STOP_JOB, QMessageBox.ButtonRole.DestructiveRole)
        asks.setDefaultButton(asks.addButton(texts.GO_ON, QMessageBox.ButtonRole.RejectRole))
        asks.exec()
        return asks.clickedButton() == stop

    def _close_if_followed(self) -> None:
        if self._closing and not self.session.following:
            self.close()

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
            self.viewer.current
            and picture is not None
            and picture.exact
            and not session.learning
            and session.player.idle
            and self.inspector.panel.settled
            and self.turns.settled
            and self.scopes.settled
            and self.gallery.settled
            and (self.timeline.settled or not self.timeline.isVisible())
        )

    def shut(self) -> None:
        """End all threads and close the document."""
        self._timer.stop()
        self._resting.stop()
        self._listener.listen(None)
        self.session.play(0)
        self.viewer.preview.close()
        self.viewer.preview.forget()
        self.session.close()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Show the picture before while the key of hold-to-compare is down."""
        plain = event.modifiers() == Qt.KeyboardModifier.NoModifier
        if event.key() == COMPARE_KEY and plain and not event.isAutoRepeat():
            self._compare(True)
        else:
            super().keyPressEvent(event)

    def _compare(self, down: bool) -> None:
        """Watch all keys while the picture before is shown."""
        app = QCoreApplication.instance()
        if app is not None and down:
            app.installEventFilter(self)
        elif app is not None:
            app.removeEventFilter(self)
        self.viewer.hold_to_compare(down)


def line_of(field: QAbstractSpinBox | QLineEdit) -> QLineEdit:
    """Return the line of text of a field."""
    return field if isinstance(field, QLineEdit) else field.lineEdit()
