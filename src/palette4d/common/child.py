"""A child process with limits, for files that may crash or exhaust the library that reads them.

It is no sandbox: a file that takes over the child has the user's rights.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
from collections.abc import Callable
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any, TypeVar

from palette4d.common.errors import Palette4dError, in_words

Result = TypeVar("Result")


class ChildError(Palette4dError):
    """The call crashed, or exceeded a limit; the message says which."""


class Child:
    """A process that runs one call after the other; it starts with the first.

    Parameters
    ----------
    seconds : float
        The longest time for a call.
    megabytes : int
        The most memory for all calls, where the system can limit it.
    """

    def __init__(self, seconds: float, megabytes: int) -> None:
        self.seconds, self.megabytes = seconds, megabytes
        self._process: Any = None
        self._pipe: Connection | None = None

    def __enter__(self) -> Child:
        """Return the child; it ends with the body."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the process."""
        self.close()

    def call(self, function: Callable[..., Result], *arguments: object) -> Result:
        """Return function(*arguments), called in the child.

        Parameters
        ----------
        function : callable
            A module's function. Arguments and result can be pickled.

        Raises
        ------
        ChildError
            It crashed, or took too much time or memory. The next call has a new process.
        Palette4dError
            Any error of the function.
        """
        if self._pipe is None:
            self._start()
        assert self._pipe is not None
        try:
            self._pipe.send((function, arguments))
            if not self._pipe.poll(self.seconds):
                self.close()
                raise ChildError(f"reading it takes longer than {self.seconds:g} seconds")
            result, problem = self._pipe.recv()
        except (EOFError, BrokenPipeError, ConnectionResetError) as error:
            self._process.join()
            status = self._process.exitcode
            self.close()
            raise ChildError(f"the library that reads it crashed ({_cause(status)})") from error
        except BaseException:  # Ctrl-C: the answer must not be taken for the next one
            self.close()
            raise
        if problem is MemoryError:
            self.close()
            raise ChildError(f"reading it takes more than {self.megabytes} MB of memory")
        if problem is not None:
            raise problem
        found: Result = result
        return found

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
        if self._pipe is not None:
            self._pipe.close()
        self._process = self._pipe = None

    def _start(self) -> None:
        # Spawned, not forked: the libraries run threads, which a fork would break.
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, self.megabytes), daemon=True)
        self._process.start()
        theirs.close()


def _serve(pipe: Connection, megabytes: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    _limit(megabytes)
    while True:
        try:
            function, arguments = pipe.recv()
        except EOFError:
            return
        result: Any = None
        problem: Any = None
        try:
            result = function(*arguments)
        except MemoryError:
            problem = MemoryError
        except Palette4dError as error:
            problem = error
        except Exception as error:  # anything may come of a hostile file
            problem = Palette4dError(in_words(error) or type(error).__name__)
        pipe.send((result, problem))


def _limit(megabytes: int) -> None:
    try:
        import resource
    except ImportError:  # Windows
        return
    limits = ((resource.RLIMIT_AS, megabytes << 20), (resource.RLIMIT_CORE, 0))
    for kind, most in limits:
        # macOS does not limit memory.
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(kind, (most, most))


def _cause(status: int | None) -> str:
    if status is not None and status < 0:
        with contextlib.suppress(ValueError):
            return signal.Signals(-status).name
    return f"exit status {status}"
