"""A verb as the job of another program: what it does, as JSON lines.

    {"stage": "structure search", "done": 3, "total": 40}    total may be null
    {"note": TEXT}, {"warning": TEXT}, {"error": TEXT, "fields": true}
    {"finished": true}                                       the last line, after a success

"fields" says that the text names fields of Studio's dialog. `palette4d VERB --progress FILE …`
writes the lines to a file, or with "-" to standard error.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from palette4d.common.text import printable

#: Longest text of an event, in characters: hosts read the end of the file only.
LONGEST = 8000

_stream: IO[str] | None = None


@contextlib.contextmanager
def events_to(path: str | None) -> Iterator[None]:
    """Write the events of the body to a file, to standard error ("-"), or nowhere."""
    global _stream
    with contextlib.ExitStack() as stack:
        if path == "-":
            _stream = sys.stderr
        elif path is not None:
            _stream = stack.enter_context(Path(path).open("w", encoding="utf-8"))
        try:
            yield
        finally:
            _stream = None


def waits() -> bool:
    """Whether a program waits for events."""
    return _stream is not None


def on_stderr() -> bool:
    """Whether standard error is for events alone."""
    return _stream is sys.stderr


def event(**parts: object) -> None:
    """Write an event, if a program waits for it."""
    if _stream is not None:
        shown = {k: printable(v)[:LONGEST] if isinstance(v, str) else v for k, v in parts.items()}
        print(json.dumps(shown, ensure_ascii=False), file=_stream, flush=True)
