"""Whether other users could change a program: then nobody else may be made to run it."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
from pathlib import Path

from palette4d.common.files import ACCESS_LIST


def changeable(path: Path, owner: int = 0) -> str | None:
    """Return what is wrong with a path that others than root and `owner` could change, or None.

    Looked at are the path, where its links lead, and all folders on the way. The node does the same
    before it starts a program (`node/program_file.cpp`).

    Parameters
    ----------
    path : absolute path of a file or a folder that exists
    owner : int
        The user who may change it besides root.
    """
    for way in (path, path.resolve()):
        for place in (way, *way.parents):
            about = place.lstat()
            if about.st_uid not in (0, owner):
                return f"{place} belongs to another user than root"
            if stat.S_ISLNK(about.st_mode):
                continue
            sticky = stat.S_ISDIR(about.st_mode) and about.st_mode & stat.S_ISVTX
            for_all = about.st_mode & stat.S_IWOTH
            # With an access list the group's bits are those of all whom it names.
            for_group = about.st_mode & stat.S_IWGRP and (about.st_gid != 0 or _has_list(place))
            if (for_all or for_group) and not sticky:
                return f"{place} may be changed by other users than root"
    return None


def _has_list(path: Path) -> bool:
    if sys.platform == "linux":
        with contextlib.suppress(OSError):  # FAT has no such lists
            return ACCESS_LIST in os.listxattr(path)
    return False


def runs_as_root() -> bool:
    """Return whether this process is root's; on Windows False."""
    return hasattr(os, "geteuid") and os.geteuid() == 0
