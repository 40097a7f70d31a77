"""Marks of tests about what files are on Linux and macOS, and not on Windows; deep folders."""

import contextlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

_WINDOWS = os.name == "nt"
links = pytest.mark.skipif(
    _WINDOWS, reason="Windows lets administrators alone make symbolic links, and Wine makes none"
)
modes = pytest.mark.skipif(_WINDOWS, reason="Windows has access lists in place of owners and modes")
pipes = pytest.mark.skipif(_WINDOWS, reason="Windows has no pipes in folders, and no /dev")
locks = pytest.mark.skipif(
    _WINDOWS, reason="Windows locks no temporary files: they count as left over after a day"
)
homes = pytest.mark.skipif(_WINDOWS, reason="Windows tells a user's folders by no variable")
gifts = pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0,
    reason="only root may give a file to another user",
)
lists = pytest.mark.skipif(
    sys.platform != "linux" or os.geteuid() != 0,
    reason="only root may be several users, and access lists are read as Linux stores them",
)
folders = pytest.mark.skipif(_WINDOWS, reason="Windows opens no folders as files")


@contextlib.contextmanager
def as_user(user: int, group: int | None = None) -> Iterator[None]:
    """Be another user, of no further groups; for root alone."""
    groups = os.getgroups()
    os.setgroups([])
    os.setegid(user if group is None else group)
    os.seteuid(user)
    try:
        yield
    finally:
        os.seteuid(0)
        os.setegid(0)
        os.setgroups(groups)


def make_deep(path: Path, levels: int) -> None:
    """Make a folder with a folder named "a" in it, and so on; paths of all of them are too long."""
    path.mkdir(exist_ok=True)
    handle = os.open(path, os.O_RDONLY)
    for _ in range(levels):
        os.mkdir("a", dir_fd=handle)
        inner = os.open("a", os.O_RDONLY, dir_fd=handle)
        os.close(handle)
        handle = inner
    os.close(handle)
