"""Long work in a child process: the command line's own verbs, with progress and a way to cancel.

A child's crash is a message in the window, not its end. Its command line can be copied.
"""

import contextlib
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import IO, Any

from palette4d.common.json_files import parse
from palette4d.common.text import quoted

#: Python's options for a child: no module of the working folder, and UTF-8 on every system.
PALETTE4D = ("-P", "-Xutf8", "-m", "palette4d")

#: Seconds in which a cancelled child may clean up; on a busy machine it takes some.
GRACE = 10.0

#: Longest line of the child that is read as one, in bytes.
LONGEST = 1 << 16


def command_line(words: Sequence[str]) -> str:
    """Return the command as a user types it."""
    return " ".join(["palette4d", *map(quoted, words)])


class Job:
    """A verb of the command line that runs.

    Parameters
    ----------
    words : sequence of str
        The verb and its arguments.
    changed : callable
        Called in the job's thread when something changed.

    Attributes
    ----------
    what : str
        The stage that runs.
    fraction : float or None
        How much of it is done, 0..1; None if unknown.
    output, messages : str
        What it printed, and its notes and errors.
    notes : list of str
        The notes and warnings among these, without their kinds.
    advised : list of str
        The options that these name.
    status : int or None
        The exit status; None while it runs.
    """

    def __init__(self, words: Sequence[str], changed: Callable[["Job"], object]) -> None:
        """Start it."""
        self.what, self.fraction = "", None  # type: tuple[str, float | None]
        self.output = self.messages = ""
        self.advised: list[str] = []
        self.notes: list[str] = []
        self.status: int | None = None
        self.cancelled = False
        self._changed = changed
        windows = sys.platform == "win32"
        # Windows sends Ctrl-C within a console only: there the child watches its input's end.
        how = ["--progress", "-", *["--stop-at-eof"] * windows]
        self._process = subprocess.Popen(
            [sys.executable, *PALETTE4D, *words[:1], *how, *words[1:]],
            stdin=subprocess.PIPE if windows else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            # A group of its own, which is stopped as a whole.
            start_new_session=not windows,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        self._events = threading.Thread(target=self._read_events, name="palette4d job", daemon=True)
        self._events.start()
        threading.Thread(target=self._wait, name="palette4d job", daemon=True).start()

    def cancel(self) -> None:
        """End it as Ctrl-C does; a child that does not end is killed."""
        self.cancelled = True
        self._signal("SIGINT")
        timer = threading.Timer(GRACE, self._signal, ["SIGKILL"])
        timer.daemon = True
        timer.start()

    def _signal(self, name: str) -> None:
        """Send a signal to the child's group, if the child still runs."""
        if self._process.poll() is not None:
            return
        with contextlib.suppress(ProcessLookupError):
            if sys.platform != "win32":
                os.killpg(self._process.pid, signal.Signals[name])
            elif name == "SIGINT":
                assert self._process.stdin is not None
                self._process.stdin.close()
            else:
                self._process.kill()

    def wait(self, seconds: float | None = None) -> int:
        """Wait for the end; return the exit status."""
        status = self._process.wait(seconds)
        self._events.join(GRACE)
        return status

    def _read_events(self) -> None:
        for line in _lines(self._process.stderr):
            self._take(line)

    def _take(self, line: bytes) -> None:
        """Read an event of `cli.job`; other lines, as a crash leaves them, are messages."""
        try:
            event = parse(line)
            if not isinstance(event, dict):
                raise TypeError
            if "stage" in event:
                self.what, total = str(event["stage"]), event["total"]
                self.fraction = min(max(event["done"] / total, 0.0), 1.0) if total else None
            for kind in {"note", "warning", "error"} & event.keys():
                named = [part for part in event[kind] if not isinstance(part, str)]
                self.advised += [str(part["option"]) for part in named]
                said = "".join(map(_said, event[kind]))
                self.messages += f"{kind}: {said}\n"
                self.notes += [said] if kind != "error" else []
        except (ValueError, TypeError, KeyError, OverflowError):
            self.messages += line.decode("utf-8", "replace")
        self._changed(self)

    def _wait(self) -> None:
        for line in _lines(self._process.stdout):
            self.output += line.decode("utf-8", "replace")
        status = self._process.wait()
        self._events.join(GRACE)
        self.status = status
        self._changed(self)


def _said(part: Any) -> str:
    """Return a part of a message: a text, or an argument, which has a field or an option."""
    return part if isinstance(part, str) else str(part["field"] or part["option"])


def _lines(pipe: IO[bytes] | None) -> Iterator[bytes]:
    assert pipe is not None
    with pipe:
        yield from iter(lambda: pipe.readline(LONGEST), b"")
