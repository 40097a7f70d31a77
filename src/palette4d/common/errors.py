"""The errors of palette4d. Each says what was found, what was expected, and the remedy."""

import errno
import os

from palette4d.common.message import ANALYZE_SHOTS as ANALYZE_SHOTS
from palette4d.common.message import Arg as Arg
from palette4d.common.message import Message as Message


class Palette4dError(Exception):
    """An error in the input or the environment that the user can fix.

    The command line prints it as ``palette4d: error: …`` and exits with 1.

    Parameters
    ----------
    text : str
        What was found and expected, and what helps.
    advice : str
        What helps, where Studio gives other advice.
    """

    def __init__(self, text: str = "", advice: str = "") -> None:
        """Keep both, also as `args`, so that the error can be pickled."""
        self.text, self.advice = Message(text), Message(advice)
        super().__init__(self.text, *[self.advice] * bool(advice))

    def __str__(self) -> str:
        """Return the message as Python says it."""
        return str(self.message)

    @property
    def message(self) -> Message:
        """The text and the advice, with the arguments that they name."""
        return Message(f"{self.text.marked} {self.advice.marked}".strip())


class UnfinishedError(Palette4dError):
    """Some frames or shots failed; the others are complete.

    Attributes
    ----------
    done : object
        What the function would have returned, with the failures.
    """

    def __init__(self, text: str, done: object) -> None:
        """Store the message and the result."""
        super().__init__(text)
        self.done = done


class WriteError(Palette4dError):
    """A file cannot be written: no permission, or no space."""


class SidecarError(Palette4dError):
    """An unusable sidecar; `str()` is "FILE: POINTER: found X, expected Y".

    Attributes
    ----------
    file : str
        The file, or a name for the document.
    pointer : str
        JSON pointer (RFC 6901) of the offending value; "" is the whole document.
    found, expected : str
        The actual and the expected value.
    """

    def __init__(self, file: str, pointer: str, found: str, expected: str) -> None:
        """Store the four parts, also as `args`, so that the error can be pickled."""
        super().__init__()
        self.args = (file, pointer, found, expected)
        self.file = file
        self.pointer = pointer
        self.found = found
        self.expected = expected

    @property
    def message(self) -> Message:
        """ "FILE: POINTER: found X, expected Y", without the parts that are empty."""
        # As in the core: a file's members may have names of megabytes.
        place = self.pointer if len(self.pointer) <= 400 else f"{self.pointer[:400]}..."
        parts = [part for part in (self.file, place) if part]
        return Message(": ".join([*parts, f"found {self.found}, expected {self.expected}"]))


_REMEDIES = {
    errno.ENOENT: "found no such file or folder; check the path",
    errno.EACCES: "found no permission for it; change its permissions, or choose another",
    errno.EPERM: "found no permission for it; change its permissions, or choose another",
    errno.EROFS: "found a read-only disk; choose another place",
    errno.EISDIR: "found a folder, expected a file",
    errno.ENOTDIR: "found a file, expected a folder",
    errno.ENOSPC: "found no room on the disk; make some, or choose another place",
    errno.ENAMETOOLONG: "found a name that is too long for the disk; choose a shorter one",
    errno.EMFILE: "found too many open files; close some programs, or raise `ulimit -n`",
}


def in_words(error: Exception) -> Message:
    """Return an error as a message; for errors of the system it adds the file and the remedy.

    >>> in_words(FileNotFoundError(errno.ENOENT, "No such file or directory", "a.exr"))
    'a.exr: found no such file or folder; check the path'
    """
    if isinstance(error, Palette4dError):
        return error.message
    if not isinstance(error, OSError) or error.strerror is None:
        return Message(str(error))
    reason = error.strerror[:1].lower() + error.strerror[1:]
    remedy = _REMEDIES.get(
        error.errno or 0, f"it cannot be used ({reason}); check the file and its disk"
    )
    if isinstance(error.filename, str | bytes | os.PathLike):
        return Message(f"{os.fsdecode(error.filename)}: {remedy}")
    return Message(remedy)
