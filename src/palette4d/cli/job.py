"""A verb as the job of another program: what it does, as JSON lines.

    {"stage": "structure search", "done": 3, "total": 40}    total may be null
    {"note": PARTS}, {"warning": PARTS}, {"error": PARTS}
    {"finished": true}                                       the last line, after a success

PARTS are texts, and between them arguments: {"argument": "force=True", "option": "--force",
"field": "'Replace existing files'"}; "field", of Studio's dialog, may be null.
`palette4d VERB --progress FILE …` writes the lines to a file, or to standard error ("-").
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from palette4d.common.text import printable

#: Longest text of an event, in characters: hosts read the end of the file only.
LONGEST = 8000

#: Where events go: nowhere, if no program waits.
stream: IO[str] | None = None


@contextlib.contextmanager
def events_to(path: str | None) -> Iterator[None]:
    """Write the events of the body to a file, to standard error ("-"), or nowhere."""
    global stream
    with contextlib.ExitStack() as stack:
        if path == "-":
            stream = sys.stderr
        elif path is not None:
            stream = stack.enter_context(Path(path).open("w", encoding="utf-8"))
        try:
            yield
        finally:
            stream = None


def stop_at_end_of_input() -> None:
    """Do as on Ctrl-C when the program that waits closes its end of our input, or has ended."""
    # A process that starts meanwhile would wait for the thread that reads its input.
    theirs, nothing = os.dup(0), os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)

    def wait() -> None:
        with contextlib.suppress(OSError):
            while os.read(theirs, 4096):
                pass
        signal.raise_signal(signal.SIGINT)

    threading.Thread(target=wait, name="palette4d input", daemon=True).start()


def shown(text: str) -> str:
    """Return a text for an event."""
    return printable(text)[:LONGEST]


def event(**parts: object) -> None:
    """Write an event, if a program waits for it."""
    if stream is not None:
        print(json.dumps(parts, ensure_ascii=False), file=stream, flush=True)
