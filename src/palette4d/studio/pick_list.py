"""The list below the inspected colour: picks, holds and locks, with when they act."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QIcon, QKeyEvent, QPainter, QPixmap
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from palette4d.grade.picks import Pick
from palette4d.plotting import style
from palette4d.studio import grade_steps, paint, texts, theme
from palette4d.studio.screen_colours import on_screen
from palette4d.studio.session import Session

U8 = NDArray[np.uint8]

#: The size of the colours before a pick's name.
ICON = QSize(34, 14)
#: The least rows that are seen at a time.
ROWS = 4
ID = Qt.ItemDataRole.UserRole


class PickList(QWidget):
    """Picks, holds and locks: enabled or not, selected, removed."""

    def __init__(self, session: Session) -> None:
        """Listen to the session."""
        super().__init__()
        self.session = session
        self._silent = False
        self.title = QLabel(texts.PICK_LIST)
        self.title.setStyleSheet(f"color: {theme.FAINT}")
        self.list = QTreeWidget()
        self.list.setAccessibleName(texts.PICK_LIST)
        self.list.setColumnCount(2)
        self.list.setHeaderHidden(True)
        self.list.setRootIsDecorated(False)
        self.list.setUniformRowHeights(True)
        self.list.setIconSize(ICON)
        self.list.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.list.setMinimumHeight(ROWS * (self.list.fontMetrics().height() + 4))
        header = self.list.header()
        header.setStretchLastSection(False)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.ResizeToContents)
        self.remove = QPushButton(texts.REMOVE)
        self.remove.clicked.connect(self.remove_selected)
        row = QHBoxLayout()
        row.addWidget(self.title, 1)
        row.addWidget(self.remove)
        column_ = QVBoxLayout(self)
        column_.setContentsMargins(0, 0, 0, 0)
        column_.setSpacing(4)
        column_.addLayout(row)
        column_.addWidget(self.list, 1)
        self.list.setMouseTracking(True)
        self.list.itemEntered.connect(lambda item: session.hover_over(item.data(0, ID)))
        self.list.viewport().installEventFilter(self)
        self.list.itemSelectionChanged.connect(self._selected)
        self.list.itemChanged.connect(self._toggled)
        for event in ("document", "selection", "view"):
            session.on(event, self.refresh, panel=True)
        self.refresh()

    def refresh(self) -> None:
        """Show the document's picks, holds and locks."""
        document = self.session.document
        picks = () if document is None else document.grade.picks
        locks = () if document is None else document.grade.locks
        self._silent = True
        self.list.clear()
        for pick in picks:
            item = QTreeWidgetItem(self._words(pick))
            item.setData(0, ID, pick.id)
            item.setCheckState(
                0, Qt.CheckState.Checked if pick.enabled else Qt.CheckState.Unchecked
            )
            item.setIcon(0, self._icon(pick))
            item.setToolTip(0, theme.plain(grade_steps.pick_tip(self.session, pick)))
            self.list.addTopLevelItem(item)
            item.setSelected(pick.id in self.session.selection)
        for id_ in locks:
            item = QTreeWidgetItem([texts.LOCKED.format(id=id_), ""])
            item.setData(0, ID, id_)
            self.list.addTopLevelItem(item)
            item.setSelected(id_ in self.session.selection)
        self.remove.setEnabled(bool(self.list.selectedItems()))
        self.setVisible(bool(picks or locks))
        self._silent = False

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Hide the matte when the pointer leaves the list."""
        if event.type() == QEvent.Type.Leave:
            self.session.hover_over(None)
        return super().eventFilter(watched, event)

    def _words(self, pick: Pick) -> list[str]:
        kind = texts.HOLD if pick.kind == "hold" else texts.PICK
        start, until = grade_steps.range_of(self.session, pick)
        when = texts.ALL_FRAMES
        if pick.start is not None or pick.until is not None:
            when = f"{style.number(start)} – {style.number(until)}"
        return [f"{pick.id} {kind} · {style.number(pick.frame)}", when if pick.enabled else "–"]

    def _icon(self, pick: Pick) -> QIcon:
        """Return the colour before and after; a hold has a bar across."""
        both = np.array([pick.rgb, pick.rgb if pick.to is None else pick.to])
        before, after = on_screen(self.session, both)
        return icon_of(self, before, after, hold=pick.kind == "hold")

    def _selected(self) -> None:
        if not self._silent:
            self.session.select(*(item.data(0, ID) for item in self.list.selectedItems()))

    def _toggled(self, item: QTreeWidgetItem, _: int) -> None:
        if self._silent:
            return
        id_, on = item.data(0, ID), item.checkState(0) == Qt.CheckState.Checked
        # Later: the list is built anew by it, and Qt still uses the item that tells of its change.
        QTimer.singleShot(0, self, lambda: grade_steps.enable(self.session, id_, on))

    def remove_selected(self) -> None:
        """Remove the selected picks and holds, and unlock the selected handles."""
        self.session.hover_over(None)
        grade_steps.remove(self.session, [item.data(0, ID) for item in self.list.selectedItems()])

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Delete removes."""
        if event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace):
            self.remove_selected()
            return
        super().keyPressEvent(event)


def icon_of(widget: QWidget, before: U8, after: U8, *, hold: bool = False) -> QIcon:
    """Return a picture of two displayed colours; a hold has a bar across."""
    ratio = widget.devicePixelRatioF()
    picture = QPixmap(ICON * ratio)
    picture.setDevicePixelRatio(ratio)
    painter = QPainter(picture)
    half = ICON.width() / 2
    painter.fillRect(QRectF(0, 0, half, ICON.height()), paint.colour_of(before))
    painter.fillRect(QRectF(half, 0, half, ICON.height()), paint.colour_of(after))
    painter.setPen(paint.pen(style.RIM, 1.0))
    painter.drawRect(QRectF(0.5, 0.5, ICON.width() - 1, ICON.height() - 1))
    if hold:
        for colour, width in ((style.INK, 4.0), (style.BRIGHT, 2.0)):
            painter.setPen(paint.pen(colour, width))
            painter.drawLine(
                QPointF(4, ICON.height() / 2), QPointF(ICON.width() - 4, ICON.height() / 2)
            )
    painter.end()
    return QIcon(picture)
