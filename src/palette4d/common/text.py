"""Counts in messages, and safe file names."""

import re

from palette4d.common.errors import Palette4dError


def counted(count: int, one: str, several: str | None = None) -> str:
    """Return "1 frame", "2 frames"; `several` is the plural if it is not regular.

    >>> counted(1, "bad frame"), counted(0, "vertex", "vertices")
    ('1 bad frame', '0 vertices')
    """
    return f"{count} {one if count == 1 else several or one + 's'}"


def file_safe(name: str) -> str:
    """Return a name that is safe in files and in OpenColorIO: letters, digits, . _ -.

    >>> file_safe("shot 010/a+b"), file_safe("-x")
    ('shot_010_a_b', 'x')
    """
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name).strip("-.") or "clip"


def checked_name(name: str) -> str:
    """Return the name if it is safe in files."""
    if file_safe(name) != name:
        raise Palette4dError(
            f"found the name {name!r}, expected letters, digits, '.', '_' and '-' only, as in "
            f"{file_safe(name)!r}"
        )
    return name
