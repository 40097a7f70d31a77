"""Long work in a child process: the command line's own verbs, with progress and a way to cancel.

A child's crash is a message in the window, not its end. Its command line can be copied.
"""

import contextlib
import fcntl
import os
import re
import shlex
import struct
import subprocess
import sys
import termios
import threading
from collections.abc import Callable, Sequence

#: tqdm's bars: "colour_statistics:  40%|████      | 20/50 [00:01<00:02]".
_BAR = re.compile(r"^(?P<what>[^%|\r\n]*?):?\s+(?P<percent>\d+)%\|")

#: A bar whose end is not known yet: "render: 0frame [00:00, ?frame/s]".
_OPEN_BAR = re.compile(r"\[\d+:\d\d[<,]")

#: Rows and columns of the terminal that a child sees.
TERMINAL = (24, 120)

#: Seconds in which a cancelled child may clean up.
GRACE = 3.0


def command_line(words: Sequence[str]) -> str:
    """Return the command as a user types it."""
    return shlex.join(["palette4d", *words])


class VerbProcess:
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
    status : int or None
        The exit status; None while it runs.
    """

    def __init__(self, words: Sequence[str], changed: Callable[["VerbProcess"], object]) -> None:
        """Start it."""
        self.words = tuple(words)
        self.what, self.fraction = "", None  # type: tuple[str, float | None]
        self.output = self.messages = ""
        self.status: int | None = None
        self.cancelled = False
        self._changed = changed
        # tqdm draws its bars only for a terminal.
        self._reader, writer = os.openpty()
        fcntl.ioctl(writer, termios.TIOCSWINSZ, struct.pack("HHHH", *TERMINAL, 0, 0))
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "palette4d", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=writer,
            start_new_session=True,
        )
        os.close(writer)
        self._bars = threading.Thread(target=self._read_bars, name="palette4d job", daemon=True)
        self._bars.start()
        threading.Thread(target=self._wait, name="palette4d job", daemon=True).start()

    @property
    def command(self) -> str:
        """The command line that does the same."""
        return command_line(self.words)

    def cancel(self) -> None:
        """End it as Ctrl-C does; a child that does not end is killed."""
        self.cancelled = True
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, 2)
        timer = threading.Timer(GRACE, self._kill)
        timer.daemon = True
        timer.start()

    def _kill(self) -> None:
        with contextlib.suppress(ProcessLookupError):
            if self._process.poll() is None:
                os.killpg(self._process.pid, 9)

    def wait(self, seconds: float | None = None) -> int:
        """Wait for the end; return the exit status."""
        status = self._process.wait(seconds)
        self._bars.join(GRACE)
        return status

    def _read_bars(self) -> None:
        rest = ""
        while True:
            try:
                data = os.read(self._reader, 4096)
            except OSError:  # the child has closed the terminal
                break
            if not data:
                break
            *lines, rest = re.split(r"[\r\n]+", rest + data.decode("utf-8", "replace"))
            for line in lines:
                self._take(line)
        self._take(rest)
        os.close(self._reader)

    def _take(self, line: str) -> None:
        line = re.sub(r"\x1b\[[0-9;]*[A-Za-z]", "", line)
        bar = _BAR.match(line)
        if bar is not None:
            self.what, self.fraction = bar["what"].strip(), int(bar["percent"]) / 100
        elif line.strip() and not _OPEN_BAR.search(line):
            self.messages += line + "\n"
        self._changed(self)

    def _wait(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as lines:
            for line in lines:
                self.output += line.decode("utf-8", "replace")
        status = self._process.wait()
        self._bars.join(GRACE)
        self.status = status
        self._changed(self)
