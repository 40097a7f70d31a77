"""Versions: edits that the user keeps under a name.

Each function takes a grade and arguments, and returns the grade after the edit, and the name that
edits which were in the way have now.
"""

import itertools
from collections.abc import Iterator

from palette4d.common.errors import Palette4dError
from palette4d.grade.grade import Grade

#: The most characters of a version's name.
LONGEST_NAME = 100


def save_version(grade: Grade, name: str) -> tuple[Grade, str | None]:
    """Keep the active edits as a version; another version of this name becomes "former NAME"."""
    if not 1 <= len(name.strip()) <= LONGEST_NAME or not name.isprintable():
        raise Palette4dError(
            f"found the version name {name!r}, expected 1 to {LONGEST_NAME} printable characters"
        )
    former, kept = grade.state.get(("version", name)), None
    after = grade.put("version", name, grade.active)
    if former is not None and former != grade.active:
        kept = free_name(grade, f"former {name}")
        after = after.put("version", kept, former)
    return after, kept


def use_version(grade: Grade, name: str) -> tuple[Grade, str | None]:
    """Make the edits of a version the active ones; others are kept as version "before NAME"."""
    wanted = grade.of_version(name)
    grade, kept = with_active_kept(grade, f"before {name}")
    state = {**wanted, **grade.of_kind("version")}
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
    return grade.put("version", name, None, f"remove version {name}")


def free_name(grade: Grade, name: str) -> str:
    """Return a name that no version has."""
    names = (name[: LONGEST_NAME - 4] + more for more in _suffixes())
    return next(candidate for candidate in names if candidate not in grade.versions)


def _suffixes() -> Iterator[str]:
    yield ""
    yield from (f" {number}" for number in itertools.count(2))
