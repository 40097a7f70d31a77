"""Marks of tests about what files are on Linux and macOS, and not on Windows."""

import os

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
folders = pytest.mark.skipif(_WINDOWS, reason="Windows opens no folders as files")
