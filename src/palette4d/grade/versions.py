"""Versions: edits that the user keeps under a name.

Each function takes a grade and arguments, and returns the grade after the edit. Where edits must
make room for others, it returns also the name that they are kept under.
"""

import itertools
from collections.abc import Mapping
from typing import Any

from palette4d.common.errors import Palette4dError
from palette4d.grade.edits import Key
from palette4d.grade.grade import Grade

#: The most characters of a version's name, and of a note.
LONGEST_NAME, LONGEST_NOTE = 100, 300


def save_version(grade: Grade, name: str) -> tuple[Grade, str | None]:
    """Keep the active edits as a version; another version of this name becomes "former NAME"."""
    _check_name(name)
    former, kept = grade.state.get(("version", name)), None
    after = grade.put("version", name, grade.active)
    if former is not None and former != grade.active:
        kept = free_name(grade, f"former {name}")
        after = after.put("version", kept, former)
        after = after.having({("note", kept): grade.note(name) or None, ("note", name): None})
    return after, kept


def _check_name(name: str) -> None:
    if not 1 <= len(name.strip()) <= LONGEST_NAME or not name.isprintable():
        raise Palette4dError(
            f"found the version name {name!r}, expected 1 to {LONGEST_NAME} printable characters"
        )


def rename_version(grade: Grade, name: str, new: str) -> Grade:
    """Give a version another name, that no version has; its note stays with it."""
    _check_name(new)
    edits = grade.of_version(name)
    if new in grade.versions and new != name:
        raise Palette4dError(
            f"found a version {new!r} already, expected a name that no version has; "
            f"remove or rename that one first"
        )
    there: Mapping[Key, Any] = {("version", new): edits, ("note", new): grade.note(name) or None}
    return grade.having({**_nothing_of(name), **there}, f"rename version {name} to {new}")


def set_note(grade: Grade, name: str, note: str) -> Grade:
    """Set the note of a version; "" removes it."""
    grade.of_version(name)
    note = note.strip()
    if len(note) > LONGEST_NOTE or not note.isprintable():
        raise Palette4dError(
            f"found a note of {len(note)} characters, expected at most {LONGEST_NOTE}, printable "
            "and on one line"
        )
    return grade.put("note", name, note or None, f"note of version {name}")


def use_version(grade: Grade, name: str) -> tuple[Grade, str | None]:
    """Make the edits of a version the active ones; others are kept as version "before NAME"."""
    wanted = grade.of_version(name)
    grade, kept = with_active_kept(grade, f"before {name}")
    state = {**wanted, **grade.of_kind("version", "note")}
    return grade.with_state(state, f"use version {name}"), kept


def with_active_kept(grade: Grade, name: str) -> tuple[Grade, str | None]:
    """Keep the active edits as a version if none holds them."""
    if not grade.active or grade.same_edits:
        return grade, None
    kept = free_name(grade, name)
    return grade.put("version", kept, grade.active), kept


def remove_version(grade: Grade, name: str) -> Grade:
    """Remove a version."""
    grade.of_version(name)
    return grade.having(_nothing_of(name), f"remove version {name}")


def _nothing_of(name: str) -> dict[Key, None]:
    return {("version", name): None, ("note", name): None}


def free_name(grade: Grade, name: str) -> str:
    """Return a name that no version has."""
    suffixes = itertools.chain([""], (f" {number}" for number in itertools.count(2)))
    names = (name[: LONGEST_NAME - 4] + suffix for suffix in suffixes)
    return next(candidate for candidate in names if candidate not in grade.versions)
