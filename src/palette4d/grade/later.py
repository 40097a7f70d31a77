"""Edits of picks that read the clip later: made at once, and completed when it is read.

An edit with `Unread` for its clip leaves out what only the clip can tell: the path, and the matte.
The same edit with the clip gives both. `completed` puts them into the step that was made at once,
whatever was done, undone or kept as a version since. Until then the step is `Edit.unread`, also to
the next program (`grade.unread_steps`).
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from palette4d.grade import edits, pick_edits
from palette4d.grade.clip_of_picks import DIGITS, ClipOfPicks
from palette4d.grade.document import Document, OfClip
from palette4d.grade.edits import Change, Colour, Edit, Key, State
from palette4d.grade.follow import Progress
from palette4d.grade.grade import Grade
from palette4d.grade.history import History
from palette4d.grade.mattes import Display, Learned
from palette4d.grade.picks import PathKey, Pick, Window
from palette4d.grade.unread_steps import readers

#: A pick before and after the clip was read.
Readings = tuple[tuple[Pick, Pick], ...]
#: What a path and a matte depend on: a pick that differs in one of these is another pick.
_INPUTS = ("kind", "frame", "rgb", "pixel", "box", "areas", "whole_hue")


class Unread(ClipOfPicks):
    """A clip that is read later: nothing is learned or followed.

    Known are the colour of the picked pixel, and what was learned for a new pick already.
    """

    unread = True
    missing = False  # an edit that needs the clip is tried with it later

    def __init__(self, colour: Iterable[float] = (), learned: Learned | None = None) -> None:
        super().__init__({}, None, None)
        self._colour, self._learned = tuple(colour), learned

    def colour(self, frame: float, pixel: tuple[float, float], box: int) -> Colour:
        """Return the colour that is known."""
        return edits.as_colour([round(value, DIGITS) for value in self._colour])

    def check_places(self, frame: float, pixels: Iterable[tuple[float, float]]) -> None:
        """Check nothing yet."""

    def learn(self, pick: Pick, holds: Sequence[Pick], display: Display | None) -> Learned | None:
        """Return what is known; else the pick keeps its matte."""
        new = pick.kind == "pick" and pick.matte is None
        return self._learned if new else None

    def path(
        self, pick: Pick, given: Sequence[PathKey] = (), progress: Progress | None = None
    ) -> tuple[PathKey, ...]:
        """Return the path that the pick has."""
        return pick.path

    def window(self, pick: Pick, window: Window, progress: Progress | None = None) -> Window:
        """Return the given keys."""
        return window.given


def do_again(document: Document, step: Edit, clip: OfClip, progress: Progress | None) -> None:
    """Do a step whose clip was not read, and read it."""
    were = {change.id: change.before for change in step.changes if change.kind == "pick"}
    with document.one_step(step.label):
        document.grade = document.grade.after(step)
        for pick in readers(step, document.grade):
            old = were.get(pick.id)
            new = were.get(pick.id, pick) is None
            reads: dict[str, Any] = {"areas": pick.areas, "clip": clip, "progress": progress}
            if new and pick.pixel is not None:  # its colour too is read with it
                reads |= {"pixel": pick.pixel, "box": pick.box}
            moved = old and (old.frame, old.rgb) != (pick.frame, pick.rgb)
            stays = not moved and pick_edits.known(pick.path, pick, document.grade)
            if pick.id in were and (new or (pick.path and not stays)):
                reads["follow"] = True
            window = pick.window
            if window is not None and old is not None:
                reads["window"] = window
            document.change_pick(pick.id, **reads)
            if window and old and (old.window is None or old.window.keys != window.keys):
                key = window.given.keys[-1]
                document.set_window(pick.id, key.frame, key.box, clip=clip, progress=progress)


def readings_of(clip: Grade, unread: Grade) -> Readings:
    """Return the picks that an edit with the clip made different from those without it."""
    pairs = ((unread.state.get(key), value) for key, value in clip.of_kind("pick").items())
    return tuple((old, new) for old, new in pairs if old is not None and old != new)


def completed(
    grade: Grade,
    history: History,
    steps: tuple[Edit, Edit],
    readings: Readings,
    mattes: Mapping[str, str],
) -> tuple[Grade, History]:
    """Return a grade and its steps where a step has what the clip says.

    `steps` are the step that was made at once, and that of the same edit with the clip. The first
    may be done or undone. Without it in the history, the readings become a step of their own, if
    the state has what it made: else it was undone, and is forgotten.
    `mattes` are the texts of the learned mattes by id.
    """
    grade, (step, like) = grade.with_mattes(mattes), steps
    line, done = [*history.done, *reversed(history.undone)], len(history.done)
    index = max((k for k, each in enumerate(line) if same(each, step)), default=None)
    is_done = index is None or index < done
    now = (with_readings if is_done else _versions)(grade.state, readings, step)
    if index is None and not any(_has(grade.state, change) for change in step.changes):
        return grade, history
    if index is None:  # merged with other steps, when another program wrote the file
        keys = {change.key for change in step.changes}
        done_now = [
            replace(each, unread=each.unread and not keys <= {c.key for c in each.changes})
            for each in history.done
        ]
        own = edits.difference(grade.state, now, like.label).undoable()
        return grade.with_state(now), replace(history, done=tuple(done_now)).with_step(own)
    before: State = grade.state
    for each in reversed(line[index:done]):
        before = each.inverse().apply(before)
    for each in line[done:index]:
        before = each.apply(before)
    state, orders = before, [like, *line[index + 1 :]]
    for k, order in enumerate(orders, index):
        before = line[k].apply(before)
        after = with_readings(before, readings, step)
        line[k] = replace(line[k], changes=_changes(state, after, order))
        state = after
    line[index] = replace(line[index], label=like.label, unread=False)
    kept = [each for each in line[:done] if each.changes]
    undone = [each for each in line[done:] if each.changes]
    return grade.with_state(now, grade.label), History(tuple(kept), tuple(reversed(undone)))


def _has(state: State, change: Change) -> bool:
    """Return whether a state has a change of a pick, as far as that is read for."""
    own, made = state.get(change.key), change.after
    if change.kind != "pick" or own is None or made is None:
        return change.kind == "pick" and own is made
    return all(getattr(own, name) == getattr(made, name) for name in _INPUTS)


def with_readings(state: State, readings: Readings, step: Edit | None = None) -> dict[Key, Any]:
    """Return a state whose picks have their readings, where nothing else changed them.

    Of the versions those have them that have what the step made, which they are of.
    """
    result = _versions(state, readings, step)
    for old, new in readings:
        if (own := result.get(("pick", old.id))) is not None:
            result["pick", old.id] = _read(own, old, new)
    return result


def _read(own: Pick, old: Pick, new: Pick) -> Pick:
    """Return a pick with what was read for it as it was, where nothing else changed it."""
    changes = {
        field.name: getattr(new, field.name)
        for field in dataclasses.fields(old)
        if getattr(old, field.name) != getattr(new, field.name)
    }
    window = changes.pop("window", None)
    # Areas that were added since are for the matte alone.
    followed = all(getattr(own, n) == getattr(old, n) for n in ("kind", "frame", "rgb", "path"))
    if "path" in changes and "rgb" not in changes and followed:
        own = replace(own, path=changes["path"])
        old = replace(old, path=changes["path"])
    same = {*_INPUTS, *changes}
    if all(getattr(own, name) == getattr(old, name) for name in same):
        own = replace(own, **changes)
    # It depends on its boxes alone: the feather may have changed since.
    if window and own.window and old.window and own.window.keys == old.window.keys:
        own = replace(own, window=replace(own.window, keys=window.keys))
    return own


def same(step: Edit, other: Edit) -> bool:
    """Return whether two steps change the same, in any order."""
    return {c.key: c for c in step.changes} == {c.key: c for c in other.changes}


def _changes(before: State, after: State, order: Edit) -> tuple[Change, ...]:
    """Return the changes between two states, those of a step in its order."""
    places = {change.key: k for k, change in enumerate(order.changes)}
    new = edits.difference(before, after).undoable().changes
    return tuple(sorted(new, key=lambda change: places.get(change.key, len(places))))


def _versions(state: State, readings: Readings, step: Edit | None) -> dict[Key, Any]:
    """Return a state whose versions have the readings, if they have what the step made."""
    result = dict(state)
    for (kind, name), value in state.items():
        if kind != "version" or not (step is None or any(_has(value, c) for c in step.changes)):
            continue
        own = {old.id: value.get(("pick", old.id)) for old, _ in readings}
        new = {
            ("pick", old.id): _read(own[old.id], old, read)
            for old, read in readings
            if own[old.id] is not None
        }
        if any(value[key] != pick for key, pick in new.items()):
            result["version", name] = {**value, **new}
    return result
