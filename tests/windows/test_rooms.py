"""Pytest on Windows, a room at a time: what is left out is marked in the tests, with the reason."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., "subprocess.CompletedProcess[str]"]

# The page for releases says what is known of the others.
ROOMS = (
    "analysis",
    "bindings",
    "cli",
    "colour",
    "common",
    "grade",
    "hosts",
    "jobs/test_pool.py",
    "lut_export",
    "media",
    "parity",
    "plotting",
    *(f"shows/test_{name}.py" for name in ("edl", "find_media", "manifest", "shots", "show_cdls")),
    "shows/test_timeline_references.py",
)


@pytest.mark.parametrize("room", ROOMS)
def test_room(room: str, windows_pytest: Run, repo_root: Path) -> None:
    options = ("-q", "-p", "no:cacheprovider", "-m", "not slow")
    done = windows_pytest(*options, f"tests/{room}", cwd=repo_root)
    assert done.returncode == 0, done.stdout
