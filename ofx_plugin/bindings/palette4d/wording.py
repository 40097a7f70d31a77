"""Words of messages that depend on numbers, and words that names may hold."""

import re


def counted(count: int, one: str, several: str | None = None) -> str:
    """Return "1 frame", "2 frames"; `several` where an s does not make the plural.

    >>> counted(1, "bad frame"), counted(0, "vertex", "vertices")
    ('1 bad frame', '0 vertices')
    """
    return f"{count} {one if count == 1 else several or one + 's'}"


def file_safe(name: str) -> str:
    """Return a name fit for files, looks and OpenColorIO's variables: letters, digits, . _ -.

    >>> file_safe("shot 010/a+b"), file_safe("-x")
    ('shot_010_a_b', 'x')
    """
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name).strip("-.") or "clip"
