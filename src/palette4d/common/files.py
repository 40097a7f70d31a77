"""Writing a file so that nobody ever sees half of it: a temporary name, then a rename."""

import os
import tempfile
from collections.abc import Generator
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
    """Make a folder and those above it.

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


@contextmanager
def replacing(path: Path, *, force: bool = False) -> Generator[Path]:
    """Yield a temporary name beside `path`, with its suffix; rename it when the body succeeds.

    Whatever ends the body otherwise (an error, Ctrl-C) removes the temporary file and leaves
    `path` as it was.

    Raises
    ------
    Palette4dError
        As `refuse_existing`; `WriteError` where the folder cannot be written to, or the disk is
        full.
    """
    refuse_existing(path, force)
    try:
        handle, name = tempfile.mkstemp(
            prefix=f".{path.stem}.", suffix=f".part{path.suffix}", dir=path.parent
        )
    except OSError as error:
        raise _closed(path, f": {error.strerror}") from error
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        with temporary.open("rb+") as written:
            os.fsync(written.fileno())
        # mkstemp makes private files; a result has the permissions that any new file would have.
        temporary.chmod(0o666 & ~_umask())
        refuse_existing(path, force)
        temporary.replace(path)
    except OSError as error:
        raise WriteError(
            f"{path}: could not be written: {error.strerror or error}; expected a disk with room, "
            "make some or choose another folder"
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def _closed(path: Path, why: str = "") -> WriteError:
    return WriteError(
        f"{path}: cannot write in {path.parent}{why}; choose another folder or mend its permissions"
    )


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
