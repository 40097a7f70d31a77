"""Whether Wine runs these tests: it stands in for Windows, and lacks some of it."""

import ctypes
import sys

WINE = sys.platform == "win32" and hasattr(ctypes.WinDLL("ntdll"), "wine_get_version")
