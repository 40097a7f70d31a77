"""Words of messages that depend on numbers."""


def counted(count: int, one: str, several: str | None = None) -> str:
    """Return "1 frame", "2 frames"; `several` where an s does not make the plural.

    >>> counted(1, "bad frame"), counted(0, "vertex", "vertices")
    ('1 bad frame', '0 vertices')
    """
    return f"{count} {one if count == 1 else several or one + 's'}"
