"""The sidecar as it was before it was analysed again: undo brings it back. It knows no toolkit."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from palette4d.common.errors import Palette4dError
from palette4d.common.json_files import UnusableFile, read_regular
from palette4d.grade.document import content_of, put_back
from palette4d.grade.edits import Edit, State
from palette4d.studio import texts
from palette4d.studio.session import Session

#: The steps of a document, and what they led to: other programs may write no steps.
Edits = tuple[tuple[Edit, ...], State]


@dataclass(frozen=True)
class Content:
    """What a file had, and the edits of the document that takes its place."""

    path: Path
    data: bytes
    edits: Edits | None


class Former:
    """Undoes and redoes analyses that wrote the session's sidecar anew.

    Parameters
    ----------
    session : Session
    changed : callable
        Called when another analysis is there: what was noted is no longer true.
    """

    def __init__(self, session: Session, changed: Callable[[], object]) -> None:
        """Begin with no analysis."""
        self.session, self._changed = session, changed
        self._now: tuple[Path, bytes] | None = None
        self._palette: object = None  #: of the document whose file an analysis will write
        self._past: list[Content] = []
        self._future: list[Content] = []
        for event in ("document", "status"):  # after a save there is a new status
            session.on(event, self._follow)

    def keep(self, path: Path) -> None:
        """Keep what a file has, before an analysis writes it."""
        self._now, document = None, self.session.document
        self._palette = None if document is None else document.grade.members["polytope"]
        with contextlib.suppress(OSError, UnusableFile):
            self._now = (path.absolute(), read_regular(path))

    def _follow(self) -> None:
        """Keep what the file gets by edits until the analysis writes it, which makes no steps."""
        document = self.session.document
        if self._now is None or document is None or document.path is None:
            return
        (path, data), content = self._now, content_of(document)
        if content is None or content == data or document.path.absolute() != path:
            return
        if document.history.done and document.grade.members["polytope"] == self._palette:
            self._now = path, content

    def written(self, path: Path) -> None:
        """Let undo bring back what the file had; call it when the new one is open."""
        if self._now is not None and self._now[0] == path.absolute():
            self._past.append(Content(*self._now, self._edits))
            self._future.clear()
        self._now = None

    @property
    def _edits(self) -> Edits | None:
        document = self.session.document
        return None if document is None else (document.history.done, document.grade.state)

    def _is_next(self, stack: list[Content]) -> bool:
        path = self.session.path
        return (
            bool(stack)
            and path is not None
            and (path.absolute(), self._edits) == (stack[-1].path, stack[-1].edits)
        )

    @property
    def can_undo(self) -> bool:
        """Whether the last thing that was done is an analysis."""
        return self._is_next(self._past)

    @property
    def can_redo(self) -> bool:
        """Whether the last thing that was undone is an analysis."""
        return self._is_next(self._future)

    def undo(self) -> None:
        """Bring back the file before the analysis, or undo an edit."""
        if self.can_undo:
            self._change_places(self._past, self._future, texts.ANALYSIS_UNDONE)
        else:
            self.session.undo()

    def redo(self) -> None:
        """Bring back the file after the analysis, or redo an edit."""
        if self.can_redo:
            self._change_places(self._future, self._past, texts.ANALYSIS_REDONE)
        else:
            self.session.redo()

    def _change_places(self, stack: list[Content], other: list[Content], said: str) -> None:
        wanted, document = stack[-1], self.session.document
        if document is None or not self.session.save():
            return
        if not self._is_next(stack):  # the save took over what another program wrote
            self.session.say(texts.ANALYSIS_STAYS, "warning")
            return
        try:
            data = put_back(document, wanted.data)
        except (Palette4dError, OSError) as error:
            self.session.report(error)
            return
        stack.pop()
        self.session.select()
        self.session.revert()
        self.session.go(self.session.frame)
        other.append(Content(wanted.path, data, self._edits))
        self._changed()
        self.session.say(said)
