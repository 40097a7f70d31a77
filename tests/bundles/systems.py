"""How programs that were built for other systems run on this machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest


def needed(program: str, packages: str) -> str:
    """The path of a program, or an error that names Debian's packages."""
    found = shutil.which(program)
    if found is None:
        pytest.fail(f"{program} is missing; install Debian's packages {packages}")
    return found


@dataclass(frozen=True)
class System:
    """A system, and the build folder of its programs."""

    build: Path  #: the build folder
    suffix: str  #: of programs
    command: list[str]  #: before a program
    environment: dict[str, str]
    path: Callable[[Path], str]  #: how the system writes a path of this machine
    folder: str  #: a new folder for files, as the system writes it

    def run(self, program: str, *words: str) -> subprocess.CompletedProcess[str]:
        executable = self.build / "tests" / "host" / f"{program}{self.suffix}"
        assert executable.exists(), f"{executable} is missing: make test-bundles builds it"
        # Files, since the services that Wine starts keep a pipe open for as long as they run.
        with tempfile.TemporaryFile() as said:
            done = subprocess.run(
                [*self.command, str(executable), *words],
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=subprocess.STDOUT,
                env={**os.environ, **self.environment},
                check=False,
            )
            said.seek(0)
            text = said.read().decode("utf-8", errors="replace")
        return subprocess.CompletedProcess(done.args, done.returncode, text)


def wine_path(path: Path) -> str:
    r"""A path of this machine as Wine has it, on its drive Z, with backslashes."""
    return "Z:" + str(path).replace("/", "\\")
