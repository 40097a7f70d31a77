"""The versions of the grade as a gallery: a picture of the playhead's frame, a name, a note."""

from PySide6.QtCore import QEvent, QModelIndex, QPersistentModelIndex, QRect, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPixmap
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from palette4d.grade.versions import LONGEST_NOTE
from palette4d.studio import grade_steps, paint, texts, theme
from palette4d.studio.newest import Newest
from palette4d.studio.player import Region, resampled
from palette4d.studio.screen_colours import U8, thumbnail
from palette4d.studio.session import Session

#: The longer side of a picture, and space around it and below it for two lines.
PICTURE, RIM, LINES = 168, 6, 40
#: Milliseconds without a change after which pictures are made.
REST = 200
NAME, NOTE, USED = (Qt.ItemDataRole.UserRole + k for k in range(3))


class Gallery(QWidget):
    """The gallery of a session."""

    def __init__(self, session: Session) -> None:
        """Listen to the session."""
        super().__init__()
        self.session = session
        self._silent = False
        self._newest = Newest("palette4d gallery")
        self._made: object = None  # what the pictures are of
        self._wanted: object = None
        self._pictures: dict[str, U8] = {}
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.timeout.connect(self._make_pictures)
        self.empty = QLabel(texts.NO_VERSIONS_LONG)
        self.empty.setWordWrap(True)
        self.empty.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.empty.setStyleSheet(f"color: {theme.FAINT}")
        self.list = self._make_list()
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 6, 8, 8)
        column.setSpacing(6)
        column.addWidget(self.empty, 1)
        column.addWidget(self.list, 1)
        self.note = QLineEdit()
        self.note.setPlaceholderText(texts.NOTE_HINT)
        self.note.setAccessibleName(texts.NOTE_HINT)
        self.note.setMaxLength(LONGEST_NOTE)
        self.note.editingFinished.connect(self._note_typed)
        column.addWidget(self.note)
        column.addLayout(self._make_buttons())
        for event in ("document", "frame", "clip", "view"):
            session.on(event, self.refresh, panel=True)
        session.on("document", self._show_the_grade)
        session.on("pixels", self._ask)
        self.refresh()

    def _make_list(self) -> QListWidget:
        made = _Versions(self)
        made.setAccessibleName(texts.VERSIONS)
        made.setViewMode(QListWidget.ViewMode.IconMode)
        made.setResizeMode(QListWidget.ResizeMode.Adjust)
        made.setMovement(QListWidget.Movement.Static)
        made.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        made.setEditTriggers(QAbstractItemView.EditTrigger.EditKeyPressed)
        made.setItemDelegate(_Delegate(made))
        made.setSpacing(2)
        made.itemChanged.connect(self._renamed)
        made.itemDoubleClicked.connect(lambda item: self.use(item.data(NAME)))
        made.itemSelectionChanged.connect(self._show_chosen)
        return made

    def _make_buttons(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(4)
        self.buttons: dict[str, QPushButton] = {}
        calls = {
            "keep": lambda: grade_steps.keep_version(self.session),
            "use": lambda: self.use(self.chosen[0]),
            "compare": self.compare,
            "rename": lambda: self.list.editItem(self.list.selectedItems()[0]),
            "delete": self.delete,
        }
        for name, (text, tip) in texts.GALLERY_BUTTONS.items():
            button = QPushButton(text)
            button.setToolTip(tip)
            button.clicked.connect(lambda _=False, name=name: calls[name]())
            row.addWidget(button)
            self.buttons[name] = button
        return row

    # ------------------------------------------------------------------------------ what it shows

    @property
    def chosen(self) -> list[str]:
        """The names of the selected versions."""
        return [item.data(NAME) for item in self.list.selectedItems()]

    def refresh(self) -> None:
        """Show the versions."""
        if self.session.dragging:
            return
        document, chosen = self.session.document, self.chosen
        names = () if document is None else document.grade.versions
        same = () if document is None else document.grade.same_edits
        self._silent = True
        focus = self.list.currentItem()
        current = focus.data(NAME) if focus is not None else None
        shown = tuple(self.list.item(k).data(NAME) for k in range(self.list.count()))
        if names != shown:
            new = [name for name in names if name not in shown]
            if shown and len(new) == 1 and len(names) > len(shown):
                chosen = new  # its note can be typed
            elif len(names) == 1:
                chosen = list(names)
            self.list.clear()
            for name in names:
                item = QListWidgetItem(name)
                item.setFlags(item.flags() | Qt.ItemFlag.ItemIsEditable)
                item.setData(NAME, name)
                self.list.addItem(item)
                item.setSelected(name in chosen)
                if name == current:
                    self.list.setCurrentItem(item)
        for k, name in enumerate(names):
            assert document is not None
            item, note = self.list.item(k), document.grade.note(name)
            item.setText(name)
            item.setData(NOTE, note)
            item.setData(USED, name in same)
            used = (texts.GALLERY_USED,) if name in same else ()
            item.setToolTip(theme.plain("\n".join((name, *filter(None, (note,)), *used))))
        self._silent = False
        self.list.setVisible(bool(names))
        self.empty.setVisible(not names)
        self._show_chosen()
        self._ask()

    def _show_chosen(self) -> None:
        document, chosen = self.session.document, self.chosen
        count = len(chosen)
        enabled = {"keep": document is not None, "use": count == 1, "rename": count == 1}
        enabled |= {"compare": count in (1, 2), "delete": count > 0}
        for name, on in enabled.items():
            self.buttons[name].setEnabled(on)
        self.note.setEnabled(count == 1)
        if not self.note.isModified():
            one = document is not None and count == 1 and chosen[0] in document.grade.versions
            self.note.setText(document.grade.note(chosen[0]) if document and one else "")

    def _show_the_grade(self) -> None:
        """Show the grade again, which was edited, in the place of a version that was compared."""
        if self.session.view.after:
            self.session.look(after="")

    # --------------------------------------------------------------------------------- what it does

    def use(self, name: str) -> None:
        """Make the edits of a version the active edits."""
        grade_steps.use_version(self.session, name)

    def compare(self) -> None:
        """Wipe between the selected version and the grade, or between two versions."""
        chosen = self.chosen
        if not chosen:
            return
        before, after = chosen[0], chosen[1] if len(chosen) > 1 else ""
        view = self.session.view
        kept = view.compare if view.compare in ("wipe", "side") else "wipe"
        self.session.look(version=before, after=after, compare=kept)
        names = (before, after or texts.THE_GRADE)
        self.session.say(texts.COMPARES.format(*names))

    def delete(self) -> None:
        """Remove the selected versions."""
        grade_steps.remove_versions(self.session, self.chosen)

    def _renamed(self, item: QListWidgetItem) -> None:
        old, new = item.data(NAME), item.text()
        if not self._silent and new != old:
            # Later: the list is built anew by it, and Qt still uses the item that was renamed.
            QTimer.singleShot(0, self, lambda: self._rename(old, new))

    def _rename(self, old: str, new: str) -> None:
        grade_steps.rename_version(self.session, old, new)
        self.refresh()
        now = old if old in self.session.versions else new  # it may have been refused
        for k in range(self.list.count()):  # its place has changed with its name
            self.list.item(k).setSelected(self.list.item(k).data(NAME) == now)

    def _note_typed(self) -> None:
        chosen = self.chosen
        if self.note.isModified() and len(chosen) == 1:
            self.note.setModified(False)
            grade_steps.note_version(self.session, chosen[0], self.note.text())

    # --------------------------------------------------------------------------------- the pictures

    @property
    def seen(self) -> bool:
        """Whether the panel is seen: below another one it is not."""
        return not self.visibleRegion().isEmpty()

    @property
    def settled(self) -> bool:
        """Whether all pictures are those of now."""
        return not self.seen or not self.list.count() or self._made == self._key()

    def picture(self, name: str) -> U8 | None:
        """Return the picture of a version, (h, w, 3)."""
        return self._pictures.get(name)

    def size_of_pictures(self) -> QSize:
        """Return the size of a picture, of the clip's shape."""
        clip = self.session.clip
        width, height = (16, 9) if clip is None else (clip.width, clip.height)
        by = PICTURE / max(width, height)
        return QSize(max(1, round(width * by)), max(1, round(height * by)))

    def _key(self) -> object:
        session = self.session
        return session.revision, session.frame, session.looked, self.devicePixelRatioF()

    def _ask(self) -> None:
        if self.session.document is not None and not self.settled:
            self._resting.start(REST)

    def _make_pictures(self) -> None:
        session, document, clip = self.session, self.session.document, self.session.clip
        pixels = None if session.player is None else session.player.frame(session.frame)
        if document is None or clip is None or pixels is None or session.playing:
            return
        size = self.size_of_pictures() * self.devicePixelRatioF()
        width, height = min(size.width(), clip.width), min(size.height(), clip.height)
        region = Region(0, 0, clip.width, clip.height, width, height)
        key = self._wanted = self._key()
        makes = {
            name: thumbnail(session, session.frame, clip.premultiplied, document.version(name))
            for name in document.grade.versions
        }

        def work() -> None:
            small = resampled(pixels, region)
            found = {}
            for name, make in makes.items():
                if key != self._wanted:
                    return
                found[name] = make(small)
            session.post(lambda: self._arrived(key, found))

        self._newest.ask(work)

    def _arrived(self, key: object, found: dict[str, U8]) -> None:
        self._made, self._pictures = key, found
        self.list.viewport().update()
        self._ask()


class _Versions(QListWidget):
    """The list; Delete removes, Enter uses."""

    def __init__(self, gallery: Gallery) -> None:
        super().__init__()
        self.gallery = gallery

    def event(self, event: QEvent) -> bool:
        """F2 renames here; else it is a key of the window."""
        if (
            isinstance(event, QKeyEvent)
            and event.type() == QEvent.Type.ShortcutOverride
            and event.key() == Qt.Key.Key_F2
            and self.gallery.chosen
        ):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Delete removes, Enter uses the selected version."""
        editing = self.state() == QAbstractItemView.State.EditingState
        if event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace) and not editing:
            self.gallery.delete()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not editing:
            if len(self.gallery.chosen) == 1:
                self.gallery.use(self.gallery.chosen[0])
        else:
            super().keyPressEvent(event)


Index = QModelIndex | QPersistentModelIndex


class _Delegate(QStyledItemDelegate):
    """Draws a version: its picture, its name with a mark if it is in use, and its note."""

    def __init__(self, list_: _Versions) -> None:
        super().__init__(list_)
        self.gallery = list_.gallery

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        """Return the size of the picture with two lines below it."""
        return self.gallery.size_of_pictures() + QSize(2 * RIM, 2 * RIM + LINES)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw it."""
        box: QRect = option.rect
        state: QStyle.StateFlag = option.state
        chosen = bool(state & QStyle.StateFlag.State_Selected)
        if chosen or state & QStyle.StateFlag.State_MouseOver:
            painter.fillRect(box, QColor("#454545" if chosen else theme.RAISED))
        size = self.gallery.size_of_pictures()
        place = QRect(box.topLeft(), size).translated(RIM, RIM)
        found = self.gallery.picture(index.data(NAME))
        if found is None:
            painter.fillRect(place, QColor(theme.PIT))
        else:
            painter.drawPixmap(place, QPixmap.fromImage(paint.image_of(found)))
        if state & QStyle.StateFlag.State_HasFocus:
            painter.setPen(paint.pen(theme.FAINT, 1.0))
            painter.drawRect(box.adjusted(0, 0, -1, -1))
        name, used = index.data(NAME), index.data(USED)
        number = index.row() + 1
        painter.setPen(QColor(theme.BRIGHT))
        self._line(painter, self._name_box(box), f"{texts.USED} {name}" if used else name, 14)
        if number < 10:
            painter.setPen(QColor(theme.FAINT))
            painter.drawText(self._name_box(box), Qt.AlignmentFlag.AlignRight, str(number))
        painter.setPen(QColor(theme.TEXT if chosen else theme.FAINT))
        self._line(painter, self._name_box(box).translated(0, LINES // 2 - 2), index.data(NOTE))

    def updateEditorGeometry(
        self, editor: QWidget, option: QStyleOptionViewItem, index: Index
    ) -> None:
        """Put the editor of the name where the name stands."""
        editor.setGeometry(self._name_box(option.rect).adjusted(-2, -2, 2, 2))

    @staticmethod
    def _name_box(box: QRect) -> QRect:
        return QRect(box.left() + RIM, box.bottom() - LINES - 1, box.width() - 2 * RIM, LINES // 2)

    @staticmethod
    def _line(painter: QPainter, box: QRect, text: str, less: int = 0) -> None:
        end, room = Qt.TextElideMode.ElideRight, box.width() - less
        elided = painter.fontMetrics().elidedText(text, end, room)
        painter.drawText(box, Qt.AlignmentFlag.AlignLeft, elided)
