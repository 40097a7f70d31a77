"""PALETTE4D_REQUIRE_HOST: a run whose host tests could not run is a failed run."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SKIPPED = "import pytest\n\ndef test_host():\n    pytest.skip('no host here')\n"
SKIPPED_MODULE = "import pytest\n\npytest.skip('no host here', allow_module_level=True)\n"
PASSED = "def test_host():\n    pass\n"
OTHER = "def test_other():\n    pass\n"


def run(folder: Path, host_test: str | None, required: str) -> subprocess.CompletedProcess[str]:
    """Run a little project with this repository's conftest and one host test."""
    tests = folder / "tests"
    (tests / "host").mkdir(parents=True)
    for name in ("conftest.py", "wine.py"):
        shutil.copy(Path(__file__).with_name(name), tests)
    (tests / "test_other.py").write_text(OTHER, encoding="utf-8")
    if host_test is not None:
        (tests / "host" / "test_host.py").write_text(host_test, encoding="utf-8")
    (folder / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "tests"],
        cwd=folder,
        env={**os.environ, "PALETTE4D_REQUIRE_HOST": required, "PYTEST_ADDOPTS": ""},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("host_test", [SKIPPED, SKIPPED_MODULE])
def test_a_skipped_host_test_fails_the_run_that_requires_it(host_test: str, tmp_path: Path) -> None:
    done = run(tmp_path, host_test, required="1")
    assert done.returncode == 1, done.stdout
    assert "could not run" in done.stdout
    assert "no host here" in done.stdout.partition("could not run")[2]


def test_no_host_test_fails_the_run_that_requires_one(tmp_path: Path) -> None:
    done = run(tmp_path, None, required="1")
    assert done.returncode == 1, done.stdout
    assert "no test under tests/host ran at all" in done.stdout


def test_a_host_test_that_ran_is_enough(tmp_path: Path) -> None:
    done = run(tmp_path, PASSED, required="1")
    assert done.returncode == 0, done.stdout


def test_a_skipped_host_test_is_fine_where_none_is_required(tmp_path: Path) -> None:
    done = run(tmp_path, SKIPPED, required="")
    assert done.returncode == 0, done.stdout
