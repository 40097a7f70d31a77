"""The folder for Windows: `make test-windows` names where it lies, with Wine, in PALETTE4D_WINDOWS.

Without that variable no test is collected here.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

GIVEN = os.environ.get("PALETTE4D_WINDOWS", "")
FOLDER = Path(GIVEN, "Grüße 色", "palette4d")
collect_ignore_glob = [] if GIVEN else ["test_*.py"]

Run = Callable[..., "subprocess.CompletedProcess[str]"]


def wine(
    program: str, *words: str | Path, cwd: Path, timeout: int = 600
) -> subprocess.CompletedProcess[str]:
    """Run a program of the folder; its output goes through a pipe, since Wine writes to no file."""
    # Wine removes what links lead to: no temporary folder of Linux is pytest's there.
    own = {name: value for name, value in os.environ.items() if name != "PYTEST_DEBUG_TEMPROOT"}
    environment = {
        "WINEPREFIX": str(Path(GIVEN) / "wine"),
        "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree,mshtml=",
        "LC_ALL": "C.UTF-8",  # file names in UTF-8
        # Qt without a screen looks nowhere else. Wine keeps QT_… of Linux to itself.
        "WINEQT_QPA_FONTDIR": r"C:\windows\Fonts",
    }
    return subprocess.run(
        ["wine", FOLDER / program, *words],
        cwd=cwd,
        env={**own, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        timeout=timeout,
        check=False,
    )


@pytest.fixture(scope="session")
def folder() -> Path:
    """The folder as it was unpacked."""
    return FOLDER


@pytest.fixture(scope="session")
def drive() -> Path:
    """Drive C of Windows."""
    return Path(GIVEN, "wine", "drive_c")


@pytest.fixture(scope="session")
def windows_program() -> Run:
    """A program of the folder."""
    return wine


@pytest.fixture(scope="session")
def windows_pytest() -> Run:
    """Pytest, with Python of the folder."""
    tools = f"Z:{Path(GIVEN) / 'tools'}"
    start = f"import sys; sys.path.append({tools!r}); import pytest; sys.exit(pytest.main())"

    def run(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
        return wine("python/python.exe", "-c", start, *words, cwd=cwd, timeout=1700)

    return run


@pytest.fixture(scope="session")
def windows() -> Run:
    """A verb on Windows."""

    def run(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
        return wine("palette4d.exe", *words, cwd=cwd)

    return run


@pytest.fixture(scope="session")
def linux() -> Run:
    """A verb on this machine."""

    def run(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "palette4d", *map(str, words)]
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done

    return run
