"""Whether other users could change a program: then nobody else may be made to run it."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
from pathlib import Path

from palette4d.common.access_list import ACCESS_LIST

#: Links on the way of a path, as on Linux.
MOST_LINKS = 40


def changeable(path: Path, owner: int = 0) -> str | None:
    """Return what is wrong with a path that others than root and `owner` could change, or None.

    Looked at are the path, each link on the way and where it leads, and all folders above these;
    of a path that is not there, whether others could make it. The node does the same before it
    starts a program (`node/program_file.cpp`).

    Parameters
    ----------
    path : absolute path of a file or a folder
    owner : int
        The user who may change it besides root.
    """
    done, ahead, links = Path(path.anchor), list(reversed(path.parts[1:])), 0
    problem = _changeable_itself(done, owner)
    while ahead and problem is None:
        name = ahead.pop()
        if name == "..":
            done = done.parent
            continue
        place = done / name
        if not os.path.lexists(place):
            return _changeable_itself(done, owner, new=True)
        problem = _changeable_itself(place, owner)
        if place.is_symlink():
            target, links = place.readlink(), links + 1
            if links > MOST_LINKS:
                return f"{path} leads through more than {MOST_LINKS} links"
            done = Path(target.anchor) if target.is_absolute() else done
            ahead += reversed(target.parts[1:] if target.is_absolute() else target.parts)
        else:
            done = place
    return problem


def changeable_within(folder: Path, owner: int = 0) -> str | None:
    """Return the same of a folder with all that is in it; of links in it, where they lead too."""
    problem = changeable(folder, owner)
    for parent, folders, names in os.walk(folder):
        for name in (*folders, *names):
            about = os.lstat(f"{parent}/{name}")
            if about.st_uid in (0, owner) and not about.st_mode & 0o022:  # nearly all; links not
                continue
            place = Path(parent, name)
            check = changeable if place.is_symlink() else _changeable_itself
            problem = problem or check(place, owner)
        if problem is not None:
            return problem
    return problem


def _changeable_itself(place: Path, owner: int, new: bool = False) -> str | None:
    """Return what is wrong with a file, a folder or a link, whatever is above it.

    `new`: what is not there yet may be made in the folder.
    """
    about = place.lstat()
    if about.st_uid not in (0, owner):
        return f"{place} belongs to another user than root"
    if stat.S_ISLNK(about.st_mode):
        return None
    sticky = not new and stat.S_ISDIR(about.st_mode) and about.st_mode & stat.S_ISVTX
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
