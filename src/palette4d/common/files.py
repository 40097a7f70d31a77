"""The only atomic writer: readers see the old file or the new file, never a part."""

import contextlib
import errno
import hashlib
import os
import platform
import re
import secrets
import shutil
import stat
import sys
import time
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from pathlib import Path

from palette4d.common import access_list, locking
from palette4d.common.access_list import ACCESS_LIST
from palette4d.common.errors import Arg, Palette4dError, WriteError
from palette4d.common.locking import remove_left_over

if sys.platform == "win32":
    from palette4d.common import windows
else:
    import fcntl

#: What is said of an output file that exists.
EXISTS = f"found a file there already; choose another name, or replace it with {Arg('force', True)}"
_TEMPORARY = re.compile(r"\..*\.([0-9a-f]{6})[0-9a-f]{10}\.p4d-tmp(\.[^.]*)?", re.DOTALL)
#: Seconds after which a temporary file counts as left over where files cannot be locked, or where
#: another computer made it: on some shares each computer has locks of its own.
_LEFT_OVER_AFTER = 86400.0
#: Mode of temporary folders: another user could give the name of one to any folder of ours that he
#: may rename, but not this mode. The sticky bit on a closed folder does nothing else.
_TEMPORARY_FOLDER = 0o1700
_swept: set[Path] = set()
#: As many links on the way to a file as Linux follows.
_MOST_LINKS = 40


def refuse_existing(
    path: Path, force: bool, made: Path | None = None, inputs: Iterable[Path | None] = ()
) -> None:
    """Check that a file may be written to `path`, which is none of the inputs.

    The folder `made` need not exist yet.
    """
    if path.is_dir():
        raise Palette4dError(f"{path}: found a folder, expected a file name for the output")
    if path.exists() and not path.is_file():
        # As root, a rename would replace even /dev/null.
        raise Palette4dError(
            f"{path}: found a device or a pipe, expected a file name for the output"
        )
    if _TEMPORARY.fullmatch(path.name):
        raise Palette4dError(
            f"{path}: found a name that palette4d gives its temporary files, which it removes; "
            "choose another name"
        )
    if made is not None and path.parent.absolute() == made.absolute() and not made.exists():
        return
    if not path.parent.is_dir():
        raise Palette4dError(f"{path}: there is no folder {path.parent}; create it first")
    if path.exists() and not force:
        raise Palette4dError(f"{path}: {EXISTS}")
    if path.exists() and any(one is not None and same_file(one, path) for one in inputs):
        raise Palette4dError(
            f"{path}: found a file that is read for this output, expected another; choose another "
            "name or folder"
        )
    if path.exists() and path.stat().st_nlink > 1:
        raise Palette4dError(
            f"{path}: found a file of {path.stat().st_nlink} names (hard links), which would part "
            "from the others; expected a file of its own. Write to another name, or make it a copy"
        )
    if path.exists() and not (path.stat().st_mode & 0o222 and os.access(path, os.W_OK)):
        # A rename would replace it, whatever its owner meant; root may write any file.
        change = "attrib -r" if sys.platform == "win32" else "chmod u+w"
        raise WriteError(
            f"{path}: found a read-only file, expected one that you may write; make it so "
            f"({change}), or choose another name"
        )
    if not os.access(path.parent, os.W_OK):
        raise closed(path)


def make_folder(folder: Path) -> None:
    """Make a folder and its parents."""
    if locking.delegate is not None and not locking.delegate.owns(folder):
        locking.delegate.ask("make_folder", os.fspath(folder.absolute()))
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Palette4dError(
            f"{folder}: the folder cannot be made: {error.strerror}; choose another"
        ) from error


def same_file(a: Path, b: Path) -> bool:
    """Return whether two paths lead to one file."""
    if a.absolute() == b.absolute():  # not two looks, with a rename by another program between them
        return True
    try:
        return a.samefile(b)
    except OSError:  # one is not there
        return os.path.realpath(a) == os.path.realpath(b)


def beside(path: Path, folder: Path) -> str:
    """Return a path relative to a folder, with slashes, so that both may move together.

    A folder that is a link has the names above it of where it leads. On another drive the path is
    absolute.
    """
    path, folder = path.absolute(), folder.absolute()
    try:
        relative = os.path.relpath(path, folder)
        if os.path.realpath(folder / relative) != os.path.realpath(path):
            there = Path(os.path.realpath(path.parent), path.name)
            relative = os.path.relpath(there, os.path.realpath(folder))
    except ValueError:
        return path.as_posix()
    return Path(relative).as_posix()


def names_a_server(path: str, named_in: Path) -> bool:
    r"""Return whether a path that a file names leads to another server than the file's own.

    To look for ``\\server\share``, Windows logs in there: the server gets the user's name and a
    hash of the password.
    """
    if sys.platform != "win32":
        return False
    return _server(path) not in ("", _server(os.fspath(named_in.absolute())))


def _server(path: str) -> str:
    found = re.match(r"[\\/]{2,}([^\\/]*)", path)
    return "" if found is None else found[1].lower() or "?"


def link_target(path: str | os.PathLike[str]) -> Path:
    """Return the target of a symbolic link, or the path itself.

    In a folder that others may write to, their links could lead a write to any file of ours. So
    each link on the way must be ours, root's or that of its folder's owner.
    """
    path = Path(path)
    if not path.exists():
        return path
    for _ in range(_MOST_LINKS):
        before = path.lstat()
        if not stat.S_ISLNK(before.st_mode):
            return path
        if sys.platform == "win32":
            return Path(os.path.realpath(path))
        if before.st_uid not in (0, os.geteuid(), path.parent.stat().st_uid):
            raise Palette4dError(
                f"{path}: found a symbolic link of another user, expected one of yours or of the "
                "folder's owner; remove it, or choose another name"
            )
        target = path.parent / path.readlink()
        after = path.lstat()
        if not os.path.samestat(before, after) or before.st_ctime_ns != after.st_ctime_ns:
            break
        path = target
    raise Palette4dError(
        f"{path}: found a symbolic link that another program changes, expected one that stays; "
        "choose another folder"
    )


@contextmanager
def replacing(
    path: Path, *, force: bool = False, check: Callable[[], None] | None = None
) -> Generator[Path]:
    """Yield a temporary file beside `path`; rename it to `path` when the body succeeds.

    The temporary file is new (O_EXCL) and has an unpredictable name. It has the suffix of `path`,
    because libraries choose the format by it. File and folder are synced. A replaced file keeps its
    owner, group, permissions, access list and extended attributes as far as the user may set them;
    nobody gets more rights. An error or Ctrl-C in the body removes the temporary file and leaves
    `path` unchanged. The user's next process that writes in the folder removes what a killed one
    left there.

    Parameters
    ----------
    path : the file to write; a symbolic link is kept and its target is written.
    force : replace a file that exists.
    check : called immediately before the rename; if it raises, `path` is unchanged.
    """
    if locking.delegate is not None and not locking.delegate.owns(path):
        with locking.delegate.replacing(path, force=force, check=check) as elsewhere:
            yield elsewhere
        return
    path = link_target(path)
    refuse_existing(path, force)
    _remove_leftovers(path.parent)
    try:
        temporary, lock = _new_temporary(path)
    except OSError as error:
        raise closed(path, f": {error.strerror}") from error
    try:
        yield temporary
        if temporary.is_symlink():
            raise Palette4dError(
                f"{path}: found a link in place of the temporary file; nothing was written here. "
                f"Another program changes {path.parent}: choose another folder"
            )
        # Not by name: another user of the folder could put a link there now.
        written = os.open(temporary, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
        try:
            if lock is not None and _lock(written):  # a library put a file of its own there
                lock, first = os.dup(written), lock
                os.close(first)
            os.fsync(written)
            with contextlib.suppress(FileNotFoundError):
                _copy_permissions(path, written)
        finally:
            os.close(written)
        refuse_existing(path, force)
        if check is not None:
            check()
        _rename(temporary, path)
    except OSError as error:
        raise unwritten(path, error) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if lock is not None:
            os.close(lock)
    _sync_folder(path.parent)


@contextmanager
def in_use(path: Path) -> Generator[None]:
    """Lock a file, so that it is not left over for other processes; also once it is renamed."""
    handle = os.open(path, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    try:
        _lock(handle)
        yield
    finally:
        os.close(handle)


def replace_by_link(path: Path, target: str) -> None:
    """Replace a file atomically by a symbolic link.

    Raises
    ------
    OSError
        The link cannot be made; `path` is unchanged.
    """
    _remove_leftovers(path.parent)
    temporary = _temporary_name(path)
    temporary.symlink_to(target)
    try:
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def temporary_folder(parent: Path) -> Generator[Path]:
    """Yield a new folder in `parent`; it is gone after the body, or in the next run after a kill.

    Raises
    ------
    OSError
        The folder cannot be made.
    """
    _remove_leftovers(parent)
    while True:
        folder = _temporary_name(parent / "palette4d")
        folder.mkdir(0o700)
        try:
            lock = None if sys.platform == "win32" else os.open(folder, os.O_RDONLY)
        except FileNotFoundError:  # Another process, which removes what is left over, was faster.
            continue
        if sys.platform == "win32" or lock is None:
            break
        if _is_locked(lock):
            with contextlib.suppress(OSError):  # a file system without modes
                kept = os.fstat(lock).st_mode & stat.S_ISGID  # what is made in it has its group
                os.fchmod(lock, _TEMPORARY_FOLDER | kept)
            break
        os.close(lock)
        _remove_folder(folder)
    try:
        yield folder
    finally:
        _remove_folder(folder)
        if lock is not None:
            os.close(lock)


def _remove_folder(folder: Path) -> None:
    """Remove a folder; what cannot be removed stays, such as one that is 1,000s deep."""
    with contextlib.suppress(RecursionError):
        shutil.rmtree(folder, ignore_errors=True)


def _temporary_name(path: Path) -> Path:
    # File names have at most 250 bytes; 40 characters are enough to recognise the file.
    token = _mark() + secrets.token_hex(5)
    return path.with_name(f".{path.stem[:40]}.{token}.p4d-tmp{path.suffix}")


def _mark() -> str:
    """Return six digits that tell this computer's temporary files from those of most others."""
    return hashlib.blake2s(platform.node().encode(), digest_size=3).hexdigest()


def _new_temporary(path: Path) -> tuple[Path, int | None]:
    """Create a temporary file; return it with a handle that locks it until it is closed.

    Windows locks nothing here, and would not rename an open file.
    """
    while True:
        temporary = _temporary_name(path)
        # 0o666 less the umask, as for any new file; what will have an old one's rights is closed.
        mode = 0o600 if path.exists() else 0o666
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        ours = _is_locked(handle)
        if ours and sys.platform != "win32":
            return temporary, handle
        os.close(handle)
        if ours:
            return temporary, None
        temporary.unlink(missing_ok=True)


def _rename(temporary: Path, path: Path) -> None:
    """Replace `path`. Windows refuses while a program has it open, as a reader has for a moment."""
    if sys.platform != "win32":
        temporary.replace(path)
    else:
        for left in reversed(range(40)):
            try:
                temporary.replace(path)
                return
            except PermissionError as error:
                if not left:
                    raise _held(path, ", ".join(windows.holders(path))) from error
                time.sleep(0.05)


def _held(path: Path, who: str) -> WriteError:
    """Return the error for a file that Windows does not replace."""
    return WriteError(
        f"{path}: found it open in {who or 'another program'}, and Windows replaces no open file; "
        "close it there and try again, or choose another name"
    )


def _copy_permissions(path: Path, handle: int) -> None:
    """Give an open file the owner and rights of another one, which is no link, and never more."""
    old = path.lstat()
    if not stat.S_ISREG(old.st_mode) or sys.platform == "win32":
        return
    for owner, group in ((old.st_uid, -1), (-1, old.st_gid)):
        with contextlib.suppress(OSError):
            os.fchown(handle, owner, group)
    mode, new = old.st_mode & 0o777, os.fstat(handle)
    # With an access list the group's bits are those of the list.
    if not _copy_attributes(path, handle) or new.st_gid != old.st_gid:
        mode &= ~0o070 | (mode & 0o007) << 3
    os.fchmod(handle, mode)
    if sys.platform == "linux" and (new.st_uid, new.st_gid) != (old.st_uid, old.st_gid):
        with contextlib.suppress(OSError):  # a file system without lists
            os.setxattr(handle, ACCESS_LIST, access_list.with_names(_list_of(path), old, new))


def _list_of(path: Path) -> bytes:
    """Return a file's access list; nothing where it has none."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            return os.getxattr(path, ACCESS_LIST, follow_symlinks=False)
    return b""


def _copy_attributes(path: Path, handle: int) -> bool:
    """Copy extended attributes; return whether an access list, if there is one, was copied."""
    if sys.platform != "linux":
        return True
    names: list[str] = []
    with contextlib.suppress(OSError):
        names = os.listxattr(path, follow_symlinks=False)
    if ACCESS_LIST not in names:
        with contextlib.suppress(OSError):  # what the folder gives to new files
            os.removexattr(handle, ACCESS_LIST)
    copied = True
    for name in names:
        try:
            os.setxattr(handle, name, os.getxattr(path, name, follow_symlinks=False))
        except OSError:
            copied = copied and name != ACCESS_LIST
    return copied


def _is_locked(handle: int) -> bool:
    """Lock a new file; False if another process, which removes what is left over, was faster."""
    return _lock(handle) is not False and bool(os.fstat(handle).st_nlink)


def _remove_leftovers(folder: Path) -> None:
    """Remove what killed processes left, once for each folder: temporary files, folders, locks.

    Only the user's own: in a shared folder, others could give such names to anything.
    """
    if folder in _swept:
        return
    _swept.add(folder)
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in list(entries):
            with contextlib.suppress(OSError, RecursionError):  # of folders that are 1,000s deep
                if not entry.name.startswith(".") or not _is_own(entry.stat(follow_symlinks=False)):
                    continue
                remove_left_over(Path(entry))
                if _TEMPORARY.fullmatch(entry.name):
                    _remove_left_over(entry)


def _is_own(about: os.stat_result) -> bool:
    """Whether a file is of the user who runs this process; Windows does not say."""
    return sys.platform == "win32" or about.st_uid == os.geteuid()


def _remove_left_over(entry: os.DirEntry[str]) -> None:
    """Remove a temporary file or folder that no process uses: its lock ends with the process."""
    if entry.is_symlink():
        Path(entry).unlink()
    elif sys.platform == "win32":
        if time.time() - entry.stat().st_mtime > _LEFT_OVER_AFTER:
            if entry.is_dir():
                shutil.rmtree(entry)
            else:
                Path(entry).unlink()
    else:
        # Another user may put something else in its place meanwhile, such as a pipe.
        access = os.O_RDONLY if entry.is_dir() else os.O_RDWR
        flags = access | os.O_NONBLOCK | os.O_NOFOLLOW
        handle = os.open(entry.path, flags)
        try:
            about = os.fstat(handle)
            if not _is_own(about) or not _is_unused(handle, about, entry.path, flags):
                return
            # While it is locked: a process that has just made it sees that it must make another.
            if stat.S_ISREG(about.st_mode):
                Path(entry).unlink()
            elif stat.S_ISDIR(about.st_mode):
                if stat.S_IMODE(about.st_mode) & ~stat.S_ISGID == _TEMPORARY_FOLDER:
                    _empty(handle)
                Path(entry).rmdir()
        finally:
            os.close(handle)


def _empty(folder: int) -> None:
    """Remove all that is in an open folder."""
    if sys.platform != "win32":
        with os.scandir(folder) as inside:
            for one in list(inside):
                if one.is_dir(follow_symlinks=False):
                    shutil.rmtree(one.name, dir_fd=folder)
                else:
                    os.unlink(one.name, dir_fd=folder)


def _is_unused(handle: int, about: os.stat_result, path: str, flags: int) -> bool:
    """Lock a temporary file; return whether no process has it locked."""
    name = _TEMPORARY.fullmatch(Path(path).name)
    locked = _lock(handle) if name is not None and name[1] == _mark() else None
    if locked:
        # Some file systems grant every lock.
        again = os.open(path, flags)
        try:
            locked = None if _lock(again) else True
        finally:
            os.close(again)
    if locked is None:
        return time.time() - about.st_mtime > _LEFT_OVER_AFTER
    return locked


def _lock(handle: int) -> bool | None:
    """Lock a file; return whether that worked, None where files cannot be locked.

    Nobody waits: another user may hold a lock for ever.
    """
    if sys.platform != "win32":
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return True
        except BlockingIOError:
            return False
        except OSError:
            pass
    return None


def _sync_folder(folder: Path) -> None:
    """Sync the folder, so that the rename is durable, where the system allows it."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def unwritten(path: Path, error: OSError) -> WriteError:
    """Return the error for a file that the disk did not take, or the folder did not give up."""
    if error.errno in (errno.EPERM, errno.EACCES):
        return closed(path, f": {error.strerror}")
    return WriteError(
        f"{path}: cannot be written: {error.strerror or error}; expected a disk with room, "
        "make some or choose another folder"
    )


def closed(path: Path, why: str = "") -> WriteError:
    """Return the error for a file whose folder cannot be written to."""
    return WriteError(
        f"{path}: cannot write in {path.parent}{why}; choose another folder, or change its "
        "permissions"
    )
