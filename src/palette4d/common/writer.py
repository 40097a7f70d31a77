"""A process that writes for one that is confined, and only what that was begun for.

It is a fork of the command, from before the command confines itself. The command writes its files
into a folder of their own; this process moves them to their places, makes folders, and holds locks.
It refuses other names, for the command may have fallen into the hands of a file that it reads.
Requests are JSON, answers are pickles: the command trusts this process, and never the reverse.
"""

from __future__ import annotations

import contextlib
import json
import os
import pickle
import secrets
import shutil
import signal
import stat
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Literal

from palette4d.common import files, locking
from palette4d.common.errors import Palette4dError


@dataclass(frozen=True)
class Promise:
    """What a command may write.

    Attributes
    ----------
    folder : with its files; it need not exist yet.
    ending : of their names.
    below : whether folders in it belong to it, but for hidden ones.
    linked : the file itself, or that to which it is a link, whatever its name.
    replaces : which files that exist it may replace.
    copies : beside `linked`, also names that begin with its name and this.
    """

    folder: Path
    ending: str | tuple[str, ...]
    below: bool = False
    linked: Path | None = None
    replaces: Literal["all", "the file itself", "none"] = "all"
    copies: str = ""

    @classmethod
    def of_file(
        cls,
        path: Path,
        replaces: Literal["all", "the file itself", "none"] = "the file itself",
        copies: str = "",
    ) -> Promise:
        """Return the promise to write a file, or others of its kind beside it."""
        whole = path.name.endswith(".p4d.json")
        suffix = ".p4d.json" if whole else path.suffix or path.name
        with contextlib.suppress(Palette4dError, OSError):  # the write says so
            linked = files.link_target(path)
            return cls(path.parent, suffix, linked=linked, replaces=replaces, copies=copies)
        return cls(path.parent, suffix, replaces=replaces)

    def holds(self, path: Path) -> bool:
        """Whether a file's path is among those that were promised."""
        if self.linked is not None and path.parent == self.linked.absolute().parent:
            copy = self.linked.name.removesuffix(".p4d.json") + self.copies
            is_copy = path.name.startswith(copy) and path.name.endswith(".p4d.json")
            if path.name == self.linked.name or (self.copies and is_copy):
                return True
        if path.name.startswith(".") or not path.name.endswith(self.ending):
            return False
        own, there = os.path.realpath(self.folder), Path(os.path.realpath(path.parent))
        if not self.below or not there.is_relative_to(own):
            return str(there) == own
        return not any(part.startswith(".") for part in there.relative_to(own).parts)

    def may_replace(self, path: Path) -> bool:
        """Whether a file may be replaced, if it exists."""
        if self.replaces == "the file itself":
            return self.linked is not None and files.same_file(path, self.linked)
        return self.replaces == "all"

    def leads_to(self, folder: Path) -> bool:
        """Whether a folder may be made: this one, one on the way to it, or one in it."""
        own, there = os.path.realpath(self.folder), os.path.realpath(folder)
        return Path(own).is_relative_to(there) or (self.below and Path(there).is_relative_to(own))


class Writer:
    """The confined command's side.

    Attributes
    ----------
    folder : the one folder that the command writes in; None where it can write nothing.
    """

    def __init__(self, requests: IO[str], answers: IO[bytes]) -> None:
        self._requests, self._answers = requests, answers
        self.folder: Path | None = self._answer()

    def ask(self, what: str, *arguments: object) -> Any:
        """Let the other process do something; raise its error."""
        with contextlib.suppress(BrokenPipeError):  # it has ended: there is no answer
            print(json.dumps([what, *arguments]), file=self._requests, flush=True)
        return self._answer()

    def owns(self, path: Path) -> bool:
        """Whether a path lies in the command's own folder, where it writes by itself."""
        return self.folder is not None and path.absolute().is_relative_to(self.folder)

    def _answer(self) -> Any:
        try:
            found, error = pickle.load(self._answers)  # noqa: S301 - of the process that we trust
        except EOFError:
            raise Palette4dError(
                "the process that writes files was ended, such as for want of memory; what was "
                "begun was not written. Run the command again"
            ) from None
        if error is not None:
            raise error
        return found

    @contextlib.contextmanager
    def replacing(
        self, path: Path, *, force: bool, check: Callable[[], None] | None
    ) -> Iterator[Path]:
        """Yield a temporary file; move it to `path` when the body succeeds (`files.replacing`)."""
        files.refuse_existing(files.link_target(path), force)
        if self.folder is None:
            raise files.closed(path)
        temporary = self.folder / f"{secrets.token_hex(8)}{path.suffix}"
        try:
            yield temporary
            if check is not None:
                check()
            self.ask("place", temporary.name, os.fspath(path.absolute()), force)
        except OSError as error:
            raise files.unwritten(path, error) from error
        finally:
            temporary.unlink(missing_ok=True)

    @contextlib.contextmanager
    def locked(self, target: Path) -> Iterator[Callable[[], None]]:
        """Hold the lock of a file (`locking.locked`)."""
        self.ask("lock", os.fspath(target.absolute()))
        try:
            yield lambda: self.ask("held")
        finally:
            self.ask("unlock")


@contextlib.contextmanager
def writer_for(promise: Promise) -> Iterator[Writer]:
    """Start the process that writes; it ends, and clears up, when the body or this process ends."""
    if sys.platform == "win32":
        raise AssertionError("Windows has no sandbox")
    requests, ask = os.pipe()
    answer, answers = os.pipe()
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            os.close(ask)
            os.close(answer)
            with os.fdopen(requests) as asked, os.fdopen(answers, "wb") as answering:
                _serve(promise, asked, answering)
            status = 0
        finally:
            os._exit(status)
    os.close(requests)
    os.close(answers)
    try:
        with os.fdopen(ask, "w") as asking, os.fdopen(answer, "rb") as answered:
            locking.delegate = writer = Writer(asking, answered)
            if writer.folder is not None:
                tempfile.tempdir = str(writer.folder)
            yield writer
    finally:
        locking.delegate = tempfile.tempdir = None
        os.waitpid(pid, 0)


def _serve(promise: Promise, requests: IO[str], answers: IO[bytes]) -> None:
    if sys.platform == "win32":
        return
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # it ends with the command
    held: list[Callable[[], None]] = []
    with contextlib.ExitStack() as stack, contextlib.ExitStack() as lock:
        folder = _own_folder(promise, stack)

        def do(what: str, *arguments: Any) -> None:
            if what == "place" and folder is not None:
                name, path, force = arguments
                _place(_taken(folder, name), Path(path), force, promise)
            elif what == "make_folder" and promise.leads_to(Path(arguments[0])):
                files.make_folder(Path(arguments[0]))
            elif what == "lock" and promise.holds(Path(arguments[0])):
                held[:] = [lock.enter_context(locking.locked(Path(arguments[0])))]
            elif what == "held" and held:
                held[0]()
            elif what == "unlock":
                lock.close()
            else:
                raise _unasked(*arguments)

        _send(answers, folder)
        for line in requests:
            try:
                do(*json.loads(line))
            except Exception as error:
                _send(answers, None, error)
            else:
                _send(answers, None)


def _send(answers: IO[bytes], found: object, error: Exception | None = None) -> None:
    with contextlib.suppress(BrokenPipeError):
        pickle.dump((found, error), answers)
        answers.flush()


def _own_folder(promise: Promise, stack: contextlib.ExitStack) -> Path | None:
    """Return a folder on the disk of the promise; None where none can be made.

    It lies in another one, in which the command can change nothing.
    """
    parent = (promise.linked or promise.folder / "file").absolute().parent
    while not parent.is_dir() and parent != parent.parent:
        parent = parent.parent
    try:
        folder = stack.enter_context(files.temporary_folder(parent)) / "out"
        folder.mkdir()
        return folder
    except OSError:
        return None  # the write says so


def _taken(folder: Path, name: str) -> Path:
    """Return a file of the command's folder, where the command can no longer exchange it."""
    return (folder / Path(name).name).rename(folder.parent / "taken")


def _place(taken: Path, path: Path, force: bool, promise: Promise) -> None:
    if not promise.holds(path) or not stat.S_ISREG(taken.lstat().st_mode):
        raise _unasked(path)
    taken.chmod(0o600)  # its maker may have closed it, or made it setuid
    replaces = force and promise.may_replace(path)
    with files.in_use(taken), files.replacing(path, force=replaces) as own:
        taken.chmod(stat.S_IMODE(own.stat().st_mode))
        shutil.move(taken, own)


def _unasked(*what: object) -> Palette4dError:
    return Palette4dError(
        f"{' '.join(map(str, what))}: the command is confined, and this is none of the files that "
        "it was begun for; was a file that it reads made to take it over?"
    )
