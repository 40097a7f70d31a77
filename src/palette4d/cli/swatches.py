"""Colours in the output of the command line: code values, #rrggbb, and a patch on terminals."""

import os
import re
import secrets
import sys
from collections.abc import Sequence

from palette4d.common.text import hex_of

# What the terminal's filter makes patches of (`terminal.py`). No name from a file can know it.
_TOKEN = secrets.token_hex(8)
PATCH = re.compile(f"{_TOKEN}:([0-9]+;[0-9]+;[0-9]+):")


def swatch(rgb: Sequence[float] | None) -> str:
    """Return a patch of the colour for terminals (None: blanks), "" for files and pipes."""
    if not sys.stdout.isatty() or os.environ.get("NO_COLOR"):
        return ""
    if rgb is None:
        return "   "
    r, g, b = (round(min(max(value, 0.0), 1.0) * 255) for value in rgb)
    return f"{_TOKEN}:{r};{g};{b}:"


def drawn(rgb: str) -> str:
    """Return the patch of a colour, "r;g;b", as a terminal takes it."""
    return f"\x1b[48;2;{rgb}m  \x1b[0m "


def row(rgb: Sequence[float]) -> str:
    """Return a colour for a table: patch, #rrggbb and three code values, in columns."""
    return f"{swatch(rgb)}{hex_of(rgb):8} " + " ".join(f"{value:8.5g}" for value in rgb)


def shown(rgb: Sequence[float]) -> str:
    """Return a colour for a sentence: patch, #rrggbb and three code values."""
    numbers = " ".join(f"{value:.6g}" for value in rgb)
    return f"{swatch(rgb)}{hex_of(rgb)} ({numbers})"
