"""Text between palette4d and OpenImageIO, which may be no UTF-8: errors, attributes, file names."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from palette4d.common.errors import Palette4dError


def problem_of(library: Any) -> str:
    """Return the error that OpenImageIO, or one of its files, keeps; "" if there is none."""
    try:
        return str(library.geterror())
    except UnicodeDecodeError as error:  # it quotes bytes of a broken file
        return error.object.decode("utf-8", "replace")


def readable(value: Any) -> Any:
    """Return an attribute's value; text that is not UTF-8 is taken as Latin-1.

    >>> readable("Andr\\udce9"), readable(24.0)
    ('André', 24.0)
    """
    if not isinstance(value, str) or is_utf8(value):
        return value
    return value.encode("utf-8", "surrogateescape").decode("latin-1")


def file_name(path: str | Path) -> str:
    """Return a file's name for OpenImageIO and for sidecars, which hold only UTF-8.

    Raises
    ------
    Palette4dError
        The name is not UTF-8.
    """
    name = str(path)
    if not is_utf8(name):
        shown = name.encode("utf-8", "backslashreplace").decode()
        raise Palette4dError(f"{shown}: found a name that is not UTF-8; rename the file or folder")
    return name


def is_utf8(text: str) -> bool:
    """Whether text has no bytes that Python could not decode."""
    return not any("\ud800" <= letter <= "\udfff" for letter in text)
