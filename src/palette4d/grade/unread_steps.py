"""Steps whose clip is not read yet: `Edit.unread`.

A program may end before the clip was read for a step that it made at once (`grade.later`). A step
that a later one `replaces` is read when that one is undone.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from palette4d.common.text import some_of
from palette4d.grade.edits import Change, Edit, State
from palette4d.grade.grade import Grade
from palette4d.grade.history import History
from palette4d.grade.picks import Pick


def as_unread(history: History) -> History:
    """Return the history whose last step says that its clip is not read yet."""
    *earlier, step = history.done
    return replace(history, done=(*earlier, replace(step, unread=True)))


def unread(grade: Grade, history: History) -> Iterator[tuple[Grade, Grade, Edit]]:
    """Yield the steps that are to be completed, the first one first, with the grades around them.

    Those that a later step replaces are not.
    """
    waiting, after, line = [], grade, history.done
    wanted = _wanted(line, grade.state)
    for k in range(len(line) - 1, min(wanted, default=len(line)) - 1, -1):
        before = grade.with_state(line[k].inverse().apply(after.state))
        if k in wanted:
            waiting.append((before, after, line[k]))
        after = before
    return reversed(waiting)


def _wanted(line: Sequence[Edit], state: State) -> set[int]:
    """Return which steps are unread, and not replaced by a later one."""
    wanted, newer = set[int](), dict[str, set[frozenset[str]]]()
    if not any(step.unread for step in line):
        return wanted
    for k in range(len(line) - 1, -1, -1):
        if line[k].unread and not _replaced(line[k], newer, state):
            wanted.add(k)
        for change in _of_picks(line[k]):
            newer.setdefault(change.id, set()).add(_fields(change))
    return wanted


def replaces(newer: Edit, step: Edit, state: State) -> bool:
    """Return whether a newer step reads again all that a step reads.

    Not if a version of the state has what the step made.
    """
    return _replaced(step, {c.id: {_fields(c)} for c in _of_picks(newer)}, state)


def _replaced(step: Edit, newer: Mapping[str, set[frozenset[str]]], state: State) -> bool:
    kept = [value for (kind, _), value in state.items() if kind == "version"]
    return all(
        None not in (change.before, change.after)
        and any(_fields(change) <= each for each in newer.get(change.id, ()))
        and all(version.get(change.key) != change.after for version in kept)
        for change in _of_picks(step)
    )


def _of_picks(step: Edit) -> list[Change]:
    return [change for change in step.changes if change.kind == "pick"]


def _fields(change: Change) -> frozenset[str]:
    """Return what a change changes of a pick."""
    values = change.before, change.after
    names = [field.name for field in dataclasses.fields(Pick)]
    if None in values:
        return frozenset([*names, "boxes"])
    found = {name for name in names if len({getattr(pick, name) for pick in values}) > 1}
    if len({pick.window and pick.window.keys for pick in values}) > 1:  # a feather is not read
        found.add("boxes")
    return frozenset(found)


def readers(step: Edit, grade: Grade) -> list[Pick]:
    """Return the picks that a step reads the clip for: without a hold all are learned again."""
    ids, picks = {change.id for change in step.changes if change.kind == "pick"}, grade.picks
    gone = ids - {pick.id for pick in picks}
    return [pick for pick in picks if gone or pick.id in ids]


def unread_note(ids: Sequence[str]) -> str:
    """Return what is said of picks whose steps have not read the clip yet."""
    return (
        f"{some_of(ids)} not yet followed through the clip, as a program ended too early: open the "
        "sidecar in Studio, which goes on"
    )


def unread_picks(grade: Grade, history: History) -> list[str]:
    """Return the ids of enabled picks whose steps have not read the clip yet."""
    steps = [step for _, _, step in unread(grade, history)]
    ids = {change.id for step in steps for change in _of_picks(step)}
    return [pick.id for pick in grade.picks if pick.enabled and pick.id in ids]
