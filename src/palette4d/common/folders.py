"""The user's folders for the data of programs, as each system has them."""

import os
import sys
from pathlib import Path

from palette4d.common.errors import Palette4dError


def home() -> Path:
    """Return the user's home folder.

    Raises
    ------
    Palette4dError
        There is none: the user has no entry in the system's list, and $HOME is not set.
    """
    try:
        return Path.home()
    except RuntimeError as error:
        raise Palette4dError(
            "found no home folder of this user, expected one; set HOME to a folder"
        ) from error


def data_folder(system: str = sys.platform, *, roaming: bool = False) -> Path:
    """Return the folder in which programs keep a user's data, on a system (`sys.platform`).

    `roaming`: on Windows the one that follows the user to other computers.
    """
    if system == "win32":
        kind = "Roaming" if roaming else "Local"
        variable = "APPDATA" if roaming else "LOCALAPPDATA"
        return _named(variable) or home() / "AppData" / kind
    if system == "darwin":
        return home() / "Library" / "Application Support"
    return _named("XDG_DATA_HOME") or home() / ".local/share"


def state_folder(system: str = sys.platform) -> Path:
    """Return the folder for what a program must remember, and the user does not look for."""
    if system in ("win32", "darwin"):
        return data_folder(system)
    return _named("XDG_STATE_HOME") or home() / ".local/state"


def runtime_folder() -> Path | None:
    """Return the user's folder for sockets, where the system has one (XDG)."""
    return _named("XDG_RUNTIME_DIR")


def _named(variable: str) -> Path | None:
    """Return a variable's folder; the XDG standard lets programs ignore relative ones."""
    folder = Path(os.environ.get(variable, ""))
    return folder if folder.is_absolute() else None
