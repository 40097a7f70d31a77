"""A child process with limits, for files that may crash or exhaust the library that reads them.

It may be confined: then a file that takes it over reads what was named, and no more.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import tempfile
import types
from collections.abc import Callable, Iterable, Iterator
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from palette4d.common import answers, files, sandbox
from palette4d.common.errors import Palette4dError, in_words

if sys.platform == "win32":
    from palette4d.common import windows

Result = TypeVar("Result")

#: Seconds in which a process that has closed its pipe may end.
GRACE = 5.0


class ChildError(Palette4dError):
    """The call crashed, or exceeded a limit; the message says which."""


class Child:
    """A process that runs one call after the other; it starts with the first.

    Parameters
    ----------
    seconds : float, optional
        The longest time for a call.
    megabytes : int, optional
        The most memory for all calls, where the system can limit it: macOS cannot.
    reads : iterable of Path, optional
        The process is confined (`sandbox`), if that is wanted: it reads these, and writes into a
        folder for temporary files alone.
    """

    def __init__(
        self,
        seconds: float | None = None,
        megabytes: int | None = None,
        reads: Iterable[Path] | None = None,
    ) -> None:
        self.seconds, self.megabytes = seconds, megabytes
        self._reads = None if reads is None or not sandbox.wanted() else list(reads)
        self._own = contextlib.ExitStack()
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
        self.begin(function, *arguments)
        found: Result = self.finish()
        return found

    def begin(self, function: Callable[..., object], *arguments: object) -> None:
        """Begin a call; `finish` returns its result."""
        if self._pipe is None:
            self._start()
        assert self._pipe is not None
        try:
            self._pipe.send((function, arguments))
        except (BrokenPipeError, ConnectionResetError):
            pass  # `finish` says so
        except BaseException:
            self.close()
            raise

    def finish(self) -> Any:
        """Wait for the call that was begun; return its result, or raise as `call`."""
        assert self._pipe is not None
        try:
            if not self._pipe.poll(self.seconds):
                self.close()
                raise ChildError(f"reading it takes longer than {self.seconds:g} seconds")
            data = self._pipe.recv_bytes(answers.LARGEST)
        except (EOFError, OSError) as error:
            self._process.join(GRACE)
            status = self._process.exitcode
            self.close()
            raise ChildError(f"the library that reads it crashed ({_cause(status)})") from error
        except BaseException:  # Ctrl-C: the answer must not be taken for the next one
            self.close()
            raise
        try:
            result, problem = answers.read(data)
        except Palette4dError as error:
            self.close()
            raise ChildError(str(error)) from error
        if isinstance(problem, MemoryError):
            self.close()
            raise ChildError(f"reading it takes more than {self.megabytes} MB of memory")
        if problem is not None:
            raise problem
        return result

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
        if self._pipe is not None:
            self._pipe.close()
        self._process = self._pipe = None
        self._own.close()

    def _start(self) -> None:
        if self._reads is not None and self.megabytes is None and sandbox.may_fork():
            # It needs no second import of all libraries, which takes half a second.
            self._spawn(multiprocessing.get_context("fork"))
            return
        # Spawned, not forked: the libraries run threads, which a fork would break.
        with _safe_path():
            if sys.platform != "win32":
                # Its start ends the block of Ctrl-C.
                resource_tracker.ensure_running()
            self._spawn(multiprocessing.get_context("spawn"))

    def _spawn(self, context: Any) -> None:
        with _without_interrupts(), _without_main():
            self._pipe, theirs = context.Pipe()
            confined = None
            if self._reads is not None:
                folder = files.temporary_folder(Path(tempfile.gettempdir()))
                confined = self._reads, self._own.enter_context(folder)
            inherited = _handles(but=theirs) if context.get_start_method() == "fork" else []
            arguments = (theirs, self.seconds, self.megabytes, confined, inherited)
            process = context.Process(target=_serve, args=arguments, daemon=True)
            with theirs:
                try:
                    process.start()
                except OSError as error:
                    self.close()
                    raise Palette4dError(
                        f"the process that reads files cannot be started ({error.strerror}); end "
                        "other programs, or raise the limit of processes (ulimit -u), and try again"
                    ) from error
            self._process = process
        if sys.platform == "win32":  # before it gets its first call
            self._own.enter_context(windows.limited(self._process.sentinel, self.megabytes))


def done(children: Iterable[Child]) -> list[Child]:
    """Wait until calls that were begun have ended; return the children of these."""
    pipes: dict[Any, Child] = {child._pipe: child for child in children if child._pipe is not None}
    return [pipes[pipe] for pipe in wait(list(pipes))]


@contextlib.contextmanager
def _without_interrupts() -> Iterator[None]:
    """Block Ctrl-C for this thread and for processes that start meanwhile."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _safe_path() -> Iterator[None]:
    """Let Python processes that start not look for modules in the working folder.

    `python -c`, by which they start, would run a ``multiprocessing.py`` of a project's folder.
    """
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONSAFEPATH"]
        else:
            os.environ["PYTHONSAFEPATH"] = before


@contextlib.contextmanager
def _without_main() -> Iterator[None]:
    """Hide the program that runs: each process that starts would run the user's script again."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = types.ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _serve(
    pipe: Connection,
    seconds: float | None,
    megabytes: int | None,
    confined: tuple[list[Path], Path] | None,
    inherited: list[int],
) -> None:
    if inherited:
        sandbox.is_command = False
        nothing = os.open(os.devnull, os.O_RDWR)
        for handle in inherited:  # not closed: objects that know the number still exist
            os.dup2(nothing, handle)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    if confined is not None:
        reads, folder = confined
        tempfile.tempdir = str(folder)
        sandbox.confine(reads, [folder])
        if not inherited and (tracker := resource_tracker.getfd()) is not None:
            os.close(tracker)  # unconfined, it removes shared memory of any name
    if megabytes is not None:
        _limit(megabytes)
    while True:
        try:
            function, arguments = pipe.recv()
        except EOFError:
            return
        if seconds is not None and hasattr(signal, "alarm"):
            signal.alarm(int(seconds + GRACE))  # where the parent was killed, nobody else ends it
        try:
            answer = answers.written((function(*arguments), None))
        except MemoryError:
            answer = answers.written((None, MemoryError()))
        except Palette4dError as error:
            answer = answers.written((None, error))
        except Exception as error:  # anything may come of a hostile file
            problem = Palette4dError(in_words(error) or type(error).__name__)
            answer = answers.written((None, problem))
        if hasattr(signal, "alarm"):
            signal.alarm(0)
        pipe.send_bytes(answer)


def _handles(but: Connection) -> list[int]:
    """Return the open files that a fork is not to have: pipes to other children, locks."""
    found = set()
    for each in list(Path("/proc/self/fd").iterdir()):
        with contextlib.suppress(OSError):  # that of the list itself
            os.fstat(int(each.name))
            found.add(int(each.name))
    return sorted(found - {0, 1, 2, but.fileno()})


def _limit(megabytes: int) -> None:
    if sys.platform == "win32":  # the parent limits it
        return
    import resource

    limits = ((resource.RLIMIT_AS, megabytes << 20), (resource.RLIMIT_CORE, 0))
    for kind, most in limits:
        # macOS does not limit memory.
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(kind, (most, most))


def _cause(status: int | None) -> str:
    if status is not None and status < 0:
        with contextlib.suppress(ValueError):
            return signal.Signals(-status).name
    # Those of Windows are known by their digits: 0xc0000005 is a bad address.
    return f"exit status {status if status is None or status < 256 else hex(status)}"
