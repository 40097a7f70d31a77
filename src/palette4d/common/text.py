"""Counts in messages, text for terminals, and safe file names."""

import re
import shlex
import sys
import unicodedata
from collections.abc import Iterable, Sequence
from typing import Any

from palette4d import _core
from palette4d.common.errors import Palette4dError


def counted(count: int, one: str, several: str | None = None) -> str:
    """Return "1 frame", "2 frames"; `several` is the plural if it is not regular.

    >>> counted(1, "bad frame"), counted(0, "vertex", "vertices")
    ('1 bad frame', '0 vertices')
    """
    return f"{count} {one if count == 1 else several or one + 's'}"


def some_of(words: Iterable[object]) -> str:
    """Return the first eight of a list, as messages name them.

    >>> some_of(["v1", "v2"]), some_of(range(10))
    ('v1, v2', '0, 1, 2, 3, 4, 5, 6, 7, …')
    """
    first, rest = (listed := list(words))[:8], listed[8:]
    return ", ".join(map(str, first)) + (", …" if rest else "")


def percent(share: float) -> str:
    """Return a share of 1 with two or three digits.

    >>> percent(0.123), percent(0.0567), percent(1)
    ('12 %', '5.7 %', '100 %')
    """
    return f"{100 * share:.{0 if share >= 0.0995 else 1}f} %"


# Control characters, line and paragraph separators, marks that turn the direction of writing, and
# halves of characters, which no encoding can write.
_ACTIVE = re.compile(
    "[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


def printable(text: str) -> str:
    """Return a text without characters that act on a terminal; line breaks stay.

    They become escapes that JSON reads back.

    >>> print(printable("red \x1b[31m"))
    red \\u001b[31m
    """
    return _ACTIVE.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def quoted(word: object) -> str:
    """Return a word as the system's shell takes it in a command."""
    if sys.platform != "win32":
        return shlex.quote(str(word))
    # As cmd and PowerShell take it; no name of a file has such quotes.
    return str(word) if re.fullmatch(r"[\w.:\\/#=+-]+", str(word)) else f'"{word}"'


def on_lines(value: Any) -> Any:
    """Return JSON data whose texts, also the names of members, have no line breaks."""
    if isinstance(value, str):
        return value.replace("\n", "\\n")
    if isinstance(value, list):
        return [on_lines(item) for item in value]
    if isinstance(value, dict):
        return {on_lines(name): on_lines(item) for name, item in value.items()}
    return value


def file_safe(name: str) -> str:
    """Return a name that is safe in files and in OpenColorIO: letters, digits, . _ -.

    Letters of all languages stay, composed (NFC). It has at most `_core.LONGEST_NAME` bytes.

    >>> file_safe("shot 010/a+b"), file_safe("-x"), file_safe("Gru\u0308n")
    ('shot_010_a_b', 'x', 'Grün')
    """
    composed = unicodedata.normalize("NFC", name)
    return _core.file_safe(composed.encode("utf-8", "replace"))


def checked_name(name: str) -> str:
    """Return the name if it is safe in files."""
    if file_safe(name) != name:
        raise Palette4dError(
            f"found the name {name!r}, expected letters, digits, '.', '_' and '-' only, at most "
            f"{_core.LONGEST_NAME} bytes of UTF-8, as in {file_safe(name)!r}"
        )
    return name


def hex_of(rgb: Sequence[float]) -> str:
    """Return #rrggbb of a colour, with "*" for a colour outside 0..1, which #rrggbb cannot hold."""
    outside = any(not 0 <= value <= 1 for value in rgb)
    digits = "".join(f"{round(min(max(value, 0.0), 1.0) * 255):02x}" for value in rgb)
    return f"#{digits}{'*' if outside else ''}"
