"""Whether Wine runs these tests: it stands in for Windows, and lacks some of it."""

import ctypes
import sys

import pytest

WINE = sys.platform == "win32" and hasattr(ctypes.WinDLL("ntdll"), "wine_get_version")

#: Marks a test of the limit of memory for child processes.
unlimited = pytest.mark.skipif(
    WINE, reason="Wine takes a job's limit of memory and does not keep it"
)
