"""What the command line prints: names from files must not act on the terminal."""

from __future__ import annotations

import contextlib
import re
import sys
from collections.abc import Iterator
from typing import Any, TextIO

from palette4d.common.text import printable

# What the command itself sends to terminals: patches of colour (`swatches`).
_OWN = re.compile(r"(\x1b\[48;2;[0-9]{1,3};[0-9]{1,3};[0-9]{1,3}m  \x1b\[0m )")


class _Printable:
    """A text stream that makes what is written to it printable."""

    def __init__(self, stream: TextIO) -> None:
        self._wrapped = stream  # tqdm's name for it, by which it knows a stream again

    def write(self, text: str) -> int:
        parts = _OWN.split(text)
        parts[::2] = map(printable, parts[::2])
        self._wrapped.write("".join(parts))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._wrapped, name)


def unfiltered_stderr() -> TextIO:
    """Return standard error for a progress bar, which moves the cursor."""
    return sys.stderr._wrapped if isinstance(sys.stderr, _Printable) else sys.stderr


@contextlib.contextmanager
def printable_output() -> Iterator[None]:
    """Make standard output and standard error printable in the body (`common.text.printable`)."""
    streams: Any = (_Printable(sys.stdout), _Printable(sys.stderr))
    with contextlib.redirect_stdout(streams[0]), contextlib.redirect_stderr(streams[1]):
        yield
