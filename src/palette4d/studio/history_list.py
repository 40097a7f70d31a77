"""The list of the grade's steps."""

import numpy as np
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QVBoxLayout, QWidget

from palette4d.grade.edits import Colour, Edit, Setting
from palette4d.studio import texts
from palette4d.studio.pick_list import ICON, icon_of
from palette4d.studio.row_names import with_row_names
from palette4d.studio.screen_colours import on_screen
from palette4d.studio.session import Session


def _is_hold(edit: Edit) -> bool:
    picks = [p for c in edit.changes if c.kind == "pick" for p in (c.before, c.after) if p]
    return bool(picks) and all(pick.kind == "hold" for pick in picks)


class History(QWidget):
    """The steps of the grade; a click goes back or forward to one."""

    def __init__(self, session: Session) -> None:
        """Listen to the session."""
        super().__init__()
        self.session = session
        self.list = QListWidget()
        self.list.setWordWrap(True)
        self.list.setIconSize(ICON)
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
        rows: list[tuple[str, Edit | None]] = []
        done = 0
        if document is not None:
            steps = (*document.history.done, *reversed(document.history.undone))
            rows = [(texts.BEGINNING, None)]
            for step in steps:
                text = with_row_names(document, step.label)
                rows.append((f"{text}  {texts.UNREAD_STEP}" if step.unread else text, step))
            done = len(document.history.done)
        self.list.clear()
        for k, (text, edit) in enumerate(rows):
            item = QListWidgetItem(text)
            if edit is not None and (colours := self._colours(edit)) is not None:
                shown = on_screen(self.session, np.array(colours))
                item.setIcon(icon_of(self, shown[0], shown[1], hold=_is_hold(edit)))
            if k > done:
                item.setText(f"{text}  {texts.UNDONE_STEP}")
                item.setForeground(self.palette().placeholderText())
            self.list.addItem(item)
        if rows:
            self.list.setCurrentRow(done)
            self.list.scrollToItem(self.list.item(done))

    def _colours(self, edit: Edit) -> tuple[Colour, Colour] | None:
        """Return the first colour that a step changes, before and after."""
        document = self.session.document
        for change in edit.changes if document is not None else ():
            values = change.before, change.after
            if change.kind == "pick":
                known = [p for p in values if p is not None]
                news = [known[0].rgb if p is None or p.to is None else p.to for p in values]
                if len(known) == 1 or news[0] != news[1]:
                    return news[0], news[1]
            elif change.kind == "handle":
                own = self._own_colour(change.id, values)
                rgb = [own if setting is None else setting.rgb for setting in values]
                if rgb[0] is not None and rgb[1] is not None:
                    return rgb[0], rgb[1]
        return None

    def _own_colour(self, id_: str, values: tuple[Setting | None, ...]) -> Colour | None:
        """Return the colour of a vertex without edits; of a new stop its own."""
        assert self.session.document is not None
        polytope = self.session.document.grade.core.polytope
        if id_ in polytope.vertex_ids:
            rgb = polytope.vertices[list(polytope.vertex_ids).index(id_), :3].tolist()
            return rgb[0], rgb[1], rgb[2]
        return next((setting.rgb for setting in values if setting is not None), None)

    def go_to(self, row: int) -> None:
        """Undo or redo up to a row; row 0 is before the first step."""
        self.session.keep_typed()
        document = self.session.document
        if document is None:
            return
        for _ in range(len(document.history.done) - row):
            self.session.undo()
        for _ in range(row - len(document.history.done)):
            self.session.redo()
