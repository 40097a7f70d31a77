"""The program on Windows: `make test-windows` names a folder with Wine's in PALETTE4D_WINDOWS.

Without that variable no test is collected here.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

GIVEN = os.environ.get("PALETTE4D_WINDOWS")
collect_ignore_glob = [] if GIVEN else ["test_*.py"]

Run = Callable[..., "subprocess.CompletedProcess[str]"]


def wine(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run Windows' Python; its output goes through a pipe, which Wine cannot do to a file."""
    folder = Path(GIVEN or "")
    environment = {
        "WINEPREFIX": str(folder / "wine"),
        "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree,mshtml=",
        "LC_ALL": "C.UTF-8",  # file names in UTF-8
    }
    return subprocess.run(
        ["wine", folder / "python" / "python.exe", *words],
        cwd=cwd,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        timeout=600,
        check=False,
    )


@pytest.fixture(scope="session")
def windows_python() -> Run:
    """Python on Windows."""
    return wine


@pytest.fixture(scope="session")
def windows() -> Run:
    """A verb on Windows."""

    def run(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
        return wine("-m", "palette4d", *words, cwd=cwd)

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
