"""The steps of a document: taken back, applied again, and merged with those of another program."""

from dataclasses import dataclass, replace

from palette4d.common.errors import Palette4dError
from palette4d.grade import edits
from palette4d.grade.edits import Edit, State
from palette4d.grade.grade import Grade


@dataclass(frozen=True)
class History:
    """The steps of a document, also those of earlier sessions.

    `undo` reverts the last of `done`, `redo` applies the last of `undone` again.
    """

    done: tuple[Edit, ...] = ()
    undone: tuple[Edit, ...] = ()

    def with_step(self, step: Edit) -> "History":
        """Return the history after another step; without changes it is no step."""
        return History((*self.done, step)) if step.changes else self

    def back(self, grade: Grade) -> tuple[Grade, "History", Edit]:
        """Return the grade before the last step, the steps then, and the step."""
        if not self.done:
            raise Palette4dError("there is nothing to undo: the palette has no earlier step")
        step = self.done[-1]
        return grade.after(step.inverse()), History(self.done[:-1], (*self.undone, step)), step

    def forth(self, grade: Grade) -> tuple[Grade, "History", Edit]:
        """Return the grade after the last undone step, the steps then, and the step."""
        if not self.undone:
            raise Palette4dError("there is nothing to redo: no step was undone since the last edit")
        step = self.undone[-1]
        return grade.after(step), History((*self.done, step), self.undone[:-1]), step


@dataclass(frozen=True)
class File:
    """What a document's file holds: its bytes, and the state and steps that they say."""

    data: bytes
    state: State
    history: History


def merged(
    file: File, mine: tuple[Grade, History], theirs: tuple[Grade, History]
) -> tuple[Grade, History, dict[str, str]]:
    """Return another program's grade with my edits since the file was read, as one more step.

    Return also new ids of my picks and stops, by theirs that the other program has used too.
    """
    (own, history), (other, steps) = mine, theirs
    if other.members["polytope"] != own.members["polytope"]:
        raise Palette4dError(
            f"{own.name}: the clip was analysed again since this palette was loaded, and the "
            "edits belong to the old palette; nothing was written. Load the file again, or "
            "save under another name"
        )
    taken = {*own.handles.vertices, *own.handles.edges}
    try:
        state, renamed = edits.merged(file.state, own.state, other.state, taken)
    except Palette4dError as error:
        raise Palette4dError(f"{own.name}: {error.message.marked}") from None
    before = file.history.done
    new = history.done[len(before) :] if history.done[: len(before)] == before else ()
    label = new[0].label if len(new) == 1 else "edits of two programs"
    step = edits.difference(other.state, state, label).undoable()
    step = replace(step, unread=any(each.unread for each in new))
    if step.changes:
        steps = History((*steps.done, step), history.undone)
    return other.with_mattes(own.mattes).with_state(state), steps, renamed
