"""The command where a package is not installed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def run_without(module: str, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a folder as if a module were not installed."""
    program = (
        f"import sys; sys.modules[{module!r}] = None\n"
        "from palette4d.cli.main import main\n"
        f"sys.exit(main({list(words)!r}))"
    )
    return subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        encoding="utf-8",  # as palette4d writes, also on Windows
        timeout=120,
        cwd=folder,
        check=False,
    )
