"""The steps of an edit: applied, undone and redone.

Every change of a palette goes through `Steps.apply`, which takes one `Edit`.
"""

import contextlib
from collections.abc import Generator, Iterable
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from palette4d.common.errors import Palette4dError
from palette4d.grade import edits
from palette4d.grade.edits import Change, Edit, Key, Kind, State

#: The kinds that recolouring uses; versions wait.
ACTIVE: tuple[Kind, ...] = ("handle", "ramp", "pick", "lock")


class Steps:
    """Everything that the user set, and the steps that led there."""

    _state: State
    _done: list[Edit]
    _undone: list[Edit]

    def _become(self, state: State) -> None:
        """Take another state; what follows from the old one is forgotten."""
        self._state = state

    @property
    def state(self) -> State:
        """Everything that the user set, by kind and id (`palette4d.grade.edits`)."""
        return MappingProxyType(dict(self._state))

    @property
    def history(self) -> tuple[Edit, ...]:
        """The steps that `undo` reverts, oldest first; also those of earlier sessions."""
        return tuple(self._done)

    @property
    def undone(self) -> tuple[Edit, ...]:
        """The steps that `redo` applies again, the next one last."""
        return tuple(self._undone)

    def apply(self, edit: Edit) -> None:
        """Apply an edit as one step, which `undo` reverts; an edit without change is no step.

        Versions that it makes are no part of the step: they stay when it is undone.
        """
        edit = replace(edit, changes=tuple(c for c in edit.changes if c.before != c.after))
        if not edit.changes:
            return
        self._change(edit)
        self._add(edit, self._done, self._undone)

    @contextlib.contextmanager
    def one_step(self, label: str) -> Generator[None]:
        """Make all edits in a ``with`` block one step; an error in it reverts them all."""
        state, done, undone = self._state, self._done, self._undone
        try:
            yield
        except BaseException:
            self._become(state)
            self._done, self._undone = done, undone
            raise
        self._add(edits.difference(state, self._state, label), done, undone)

    def _add(self, edit: Edit, done: list[Edit], undone: list[Edit]) -> None:
        step = edit.undoable()
        self._done, self._undone = ([*done, step], []) if step.changes else (done, undone)

    def undo(self) -> Edit:
        """Revert the last step, and return it. Steps of earlier sessions can be reverted too."""
        if not self._done:
            raise Palette4dError("there is nothing to undo: the palette has no earlier step")
        step = self._done[-1]
        self._change(step.inverse())
        self._done, self._undone = self._done[:-1], [*self._undone, step]
        return step

    def redo(self) -> Edit:
        """Apply the last undone step again, and return it."""
        if not self._undone:
            raise Palette4dError("there is nothing to redo: no step was undone since the last edit")
        step = self._undone[-1]
        self._change(step)
        self._done, self._undone = [*self._done, step], self._undone[:-1]
        return step

    def forget_history(self) -> None:
        """Drop all steps, done and undone; the edits stay."""
        self._done, self._undone = [], []

    def _change(self, edit: Edit) -> None:
        self._become(edit.apply(self._state))

    def _put(self, kind: Kind, id: str, value: Any, label: str) -> None:
        """Set one value of the state (None: remove it) as one step."""
        self.apply(Edit((Change(kind, id, self._state.get((kind, id)), value),), label))

    def _remove(self, keys: Iterable[Key], label: str) -> None:
        changes = tuple(Change(*key, self._state[key], None) for key in keys)
        self.apply(Edit(changes, label))

    def _active(self) -> dict[Key, Any]:
        return {key: value for key, value in self._state.items() if key[0] in ACTIVE}
