"""The one atomic writer: readers see the old file or the new one, never a part of one."""

import contextlib
import os
import secrets
import stat
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from palette4d.common.errors import Palette4dError, WriteError


def refuse_existing(path: Path, force: bool) -> None:
    """Refuse a target that exists, unless forced, and one that is not a file in a folder.

    Raises
    ------
    Palette4dError
        `path` is a folder, lies in a folder that does not exist, or exists and `force` is false;
        `WriteError` where its folder may not be written to.
    """
    if path.is_dir():
        raise Palette4dError(f"{path}: found a folder, expected a file name for the output")
    if not path.parent.is_dir():
        raise Palette4dError(f"{path}: there is no folder {path.parent}; create it first")
    if path.exists() and not force:
        raise Palette4dError(f"{path}: the file exists already; use --force to replace it")
    if not os.access(path.parent, os.W_OK):
        raise _closed(path)


def make_folder(folder: Path) -> None:
    """Make a folder and its parents.

    Raises
    ------
    Palette4dError
        It cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Palette4dError(
            f"{folder}: the folder cannot be made: {error.strerror}; choose another"
        ) from error


def link_target(path: str | os.PathLike[str]) -> Path:
    """Return the file that a link leads to, or the path itself where there is none."""
    path = Path(path)
    return Path(os.path.realpath(path)) if path.is_symlink() and path.exists() else path


@contextmanager
def replacing(
    path: Path, *, force: bool = False, check: Callable[[], None] | None = None
) -> Generator[Path]:
    """Yield a temporary file beside `path`; rename it to `path` when the body succeeds.

    The temporary file is new (O_EXCL), has an unpredictable name and the suffix of `path`, so that
    libraries which take a path can write it. File and folder are synced. A file that is replaced
    keeps its permissions. Whatever ends the body otherwise (an error, Ctrl-C) removes the temporary
    file and leaves `path` as it was.

    Parameters
    ----------
    path : Path
        The file to write; a symbolic link to a file stays and is followed.
    force : bool
        Replace a file that exists.
    check : callable, optional
        Called last, immediately before the rename; what it raises leaves `path` as it was.

    Raises
    ------
    Palette4dError
        As `refuse_existing`; `WriteError` where the folder cannot be written to, or the disk is
        full.
    """
    path = link_target(path)
    refuse_existing(path, force)
    # At most 250 bytes: 40 characters of the name are enough to recognise it by.
    temporary = path.with_name(f".{path.stem[:40]}.{secrets.token_hex(8)}.tmp{path.suffix}")
    try:
        # 0o666 less the umask, as for any new file.
        os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    except OSError as error:
        raise _closed(path, f": {error.strerror}") from error
    try:
        yield temporary
        with temporary.open("rb+") as written:
            os.fsync(written.fileno())
        with contextlib.suppress(FileNotFoundError):
            temporary.chmod(stat.S_IMODE(path.stat().st_mode))
        refuse_existing(path, force)
        if check is not None:
            check()
        temporary.replace(path)
    except OSError as error:
        raise WriteError(
            f"{path}: cannot be written: {error.strerror or error}; expected a disk with room, "
            "make some or choose another folder"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Make the rename itself durable, where folders can be opened and synced."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _closed(path: Path, why: str = "") -> WriteError:
    return WriteError(
        f"{path}: cannot write in {path.parent}{why}; choose another folder or mend its permissions"
    )
