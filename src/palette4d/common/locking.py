"""Locks between programs that replace one file.

A lock file beside the file says who holds it: created exclusively, it excludes on every file
system, also where locks of the system are refused, or exclude nobody. If its owner died on this
computer, the next program removes it.
"""

import contextlib
import os
import platform
import random
import re
import secrets
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from palette4d.common.errors import Palette4dError
from palette4d.common.json_files import UnusableFile, read_regular

if sys.platform == "win32":
    from palette4d.common import windows

#: Locks and writes for this process, where it is confined (`common.writer`).
delegate: Any = None

#: Seconds to wait while another program holds the lock.
LOCK_SECONDS = 10.0

#: Seconds after which a half-written lock file is that of a program that was killed.
UNFINISHED_SECONDS = 2.0

_LOCK = re.compile(r"\..*\.lock", re.DOTALL)
_LONGEST = 4096
_OWNER = re.compile(r"\S+ [0-9]+ [0-9a-f]{16}")


@contextlib.contextmanager
def locked(target: Path) -> Iterator[Callable[[], None]]:
    """Hold the lock of a file; yield a check that raises if the lock was lost."""
    if not target.parent.is_dir():
        yield lambda: None  # the write reports the error
        return
    if delegate is not None and not delegate.owns(target):
        with delegate.locked(target) as held_there:
            yield held_there
        return
    deadline = time.monotonic() + LOCK_SECONDS
    # File names have at most 255 bytes; two that begin alike take turns.
    short = os.fsencode(target.name)[:200].decode("utf-8", "ignore")
    path = target.with_name(f".{short}.lock")
    mine = f"{_computer()} {os.getpid()} {secrets.token_hex(8)}"
    while not _created(path, mine):
        owner = _content(path)
        left_over = owner is not None and (_is_dead(owner) or _is_unfinished(path, owner))
        if left_over and _remove(path, owner or ""):
            continue
        if time.monotonic() > deadline:
            if owner is None and not path.exists():
                raise _cannot(path)
            raise Palette4dError(
                f"{target}: another program ({owner or 'unknown'}) has held {path} for "
                f"{LOCK_SECONDS:g} seconds; wait for it to finish. If it no longer runs, remove "
                "that file"
            )
        time.sleep(random.uniform(0.002, 0.03))

    def held() -> None:
        if _content(path) != mine:
            raise Palette4dError(
                f"{target}: the lock file {path} was taken away; nothing was written. Try again"
            )

    try:
        yield held
    finally:
        _let_go(path, mine)


def _let_go(path: Path, mine: str) -> None:
    """Remove the own lock file. Windows refuses while another program reads who holds it."""
    for _ in range(100 if sys.platform == "win32" else 1):
        # One that cannot be read now is still ours: nobody takes away a running program's.
        if _content(path) not in (mine, None):
            return
        try:
            path.unlink(missing_ok=True)
            return
        except OSError:
            time.sleep(random.uniform(0.002, 0.02))


def remove_left_over(path: Path) -> None:
    """Remove the lock file of a program that was killed, and no other file."""
    if _LOCK.fullmatch(path.name):
        owner = _content(path)
        if owner is not None and _OWNER.fullmatch(owner) and _is_dead(owner):
            _remove(path, owner)


def _created(path: Path, content: str) -> bool:
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
    except FileExistsError:
        return False
    except OSError as error:
        if sys.platform == "win32" and isinstance(error, PermissionError):
            return False  # another program is just removing it
        raise _cannot(path, error.strerror) from None
    try:
        if sys.platform != "win32":  # whatever the umask: read by all, changed by its owner
            with contextlib.suppress(OSError):
                os.fchmod(handle, 0o644)
        os.write(handle, content.encode())
    except OSError as error:
        with contextlib.suppress(OSError):
            path.unlink(missing_ok=True)
        raise _cannot(path, error.strerror) from None
    finally:
        os.close(handle)
    return True


def _cannot(path: Path, reason: str | None = "unknown") -> Palette4dError:
    return Palette4dError(
        f"{path}: the lock file cannot be created ({reason}); choose another folder, or make this "
        "one writable"
    )


def _content(path: Path) -> str | None:
    try:
        return read_regular(path, _LONGEST).decode("utf-8", "replace")
    except (OSError, UnusableFile):
        return None


def _computer() -> str:
    """Return a name of this computer since it was started.

    Containers count as computers of their own, and so do two machines that are called `localhost`.
    """
    space = start = ""
    with contextlib.suppress(OSError):
        space = str(Path("/proc/self/ns/pid").readlink())
        start = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    return f"{platform.node() or 'computer'}{space}{start}".replace(" ", "_")


def _is_dead(owner: str) -> bool:
    """Whether the owner ran on this computer and has ended."""
    computer, _, rest = owner.partition(" ")
    pid = rest.partition(" ")[0]
    if computer != _computer() or not pid.isdecimal():
        return False
    if sys.platform == "win32":  # there os.kill() ends a process, whatever the signal
        return windows.has_ended(int(pid))
    try:
        os.kill(int(pid), 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False


def _is_unfinished(path: Path, owner: str) -> bool:
    """Whether a lock file was created some time ago, and its owner never written completely."""
    try:
        age = time.time() - path.stat().st_mtime
    except OSError:
        return False
    return age > UNFINISHED_SECONDS and not _OWNER.fullmatch(owner)


def _remove(path: Path, owner: str) -> bool:
    """Remove the lock file of an owner that died, and no other; return whether it is gone.

    One program at a time may: between the look and the removal another one could remove it too, and
    a third take the lock.
    """
    turn = path.with_name(f"{path.name}.removing")
    with contextlib.suppress(OSError):
        # Of a program that was killed; one of the future is from before a clock was put back.
        if abs(time.time() - turn.lstat().st_mtime) > LOCK_SECONDS:
            turn.unlink()
    with contextlib.suppress(OSError):
        os.close(os.open(turn, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        try:
            if _content(path) == owner:
                path.unlink()
                return True
        finally:
            turn.unlink(missing_ok=True)
    return False
