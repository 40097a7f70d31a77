"""Fixtures that every part of the test suite may use, and the rule that host tests must have run.

Environment
-----------
PALETTE4D_SHARED
    A folder with the paper's clips and reference results (``clips/seasons``, ``reference``).
    Default: ``shared`` beside the repository. Tests that need it skip, and say so, without it.
PALETTE4D_REQUIRE_HOST
    ``1`` turns every skipped test under ``tests/host`` into a failure of the run, and a run that
    collected no host test at all as well. ``.ci/run`` sets it.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
from collections.abc import Generator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray
from wine import WINE

REPO_ROOT = Path(__file__).resolve().parent.parent


if WINE:
    # Wine's Windows has no CopyFile2, which Python 3.13 copies files with; without it, shutil falls
    # back to its own copies. Only tests copy files so, and Windows itself has the call.
    del shutil._winapi.CopyFile2  # type: ignore[attr-defined]


def shared_folder() -> Path:
    """Where the shared material is expected; it need not exist."""
    return Path(os.environ.get("PALETTE4D_SHARED") or REPO_ROOT.parent / "shared").resolve()


@pytest.fixture(scope="session")
def repo_root() -> Path:
    """The repository's root folder (for files that the wheel does not carry)."""
    return REPO_ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """The shared material; the test skips where it is absent."""
    folder = shared_folder()
    if not folder.is_dir():
        pytest.skip(f"shared material absent: no folder {folder} (set PALETTE4D_SHARED)")
    return folder


@pytest.fixture(scope="session")
def seasons(shared: Path) -> Path:
    """The paper's SEASONS clip: a folder of 50 frames of 696 x 380."""
    folder = shared / "clips" / "seasons"
    if not folder.is_dir():
        pytest.skip(f"the SEASONS clip is absent: no folder {folder}")
    return folder


@pytest.fixture(scope="session")
def real_frame() -> NDArray[np.float32]:
    """A real clip's frame, (h, w, 3) within 0..1: autumn of SEASONS, or else of the sample clip."""
    seasons = shared_folder() / "clips" / "seasons"
    if not seasons.is_dir():
        from palette4d.demo.scene import Scene

        return Scene(320, 180).picture(0.6)
    from palette4d.media.clip import open_clip

    return np.ascontiguousarray(open_clip(str(seasons)).read(40)[..., :3], dtype=np.float32)


def host_tests_required() -> bool:
    """Whether a host test that could not run must make the whole run fail."""
    return os.environ.get("PALETTE4D_REQUIRE_HOST", "") not in ("", "0")


class HostWatch:
    """Remembers which tests under ``tests/host`` ran and which were skipped."""

    def __init__(self) -> None:
        self.ran: set[str] = set()
        self.skipped: dict[str, str] = {}

    @staticmethod
    def concerns(nodeid: str) -> bool:
        """Whether this node lies under ``tests/host``."""
        path = Path(nodeid.partition("::")[0])
        return not path.is_absolute() and path.parts[:2] == ("tests", "host")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note what became of one phase of one test."""
        if not self.concerns(report.nodeid):
            return
        if report.skipped:
            reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
            self.skipped[report.nodeid] = str(reason)
        elif report.when == "call":
            self.ran.add(report.nodeid)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Note a module that skipped itself as a whole."""
        if report.skipped and self.concerns(report.nodeid):
            reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
            self.skipped[report.nodeid] = str(reason)

    def complaints(self) -> list[str]:
        """What keeps this run from counting as tested in a real host."""
        found = [f"{node}: {reason}" for node, reason in sorted(self.skipped.items())]
        if not self.ran:
            found.append("no test under tests/host ran at all")
        return found


def pytest_configure(config: pytest.Config) -> None:
    """Watch the host tests when they are required; let tests of Ctrl-C see one."""
    # A shell has its background jobs ignore Ctrl-C, which Python and all that it starts inherit:
    # the tests of what Ctrl-C leaves behind would have nothing to see.
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # Under pytest-xdist only the process that hands out the tests hears of all of them.
    if host_tests_required() and not hasattr(config, "workerinput"):
        config.pluginmanager.register(HostWatch(), "palette4d-host-watch")


@pytest.hookimpl(wrapper=True)
def pytest_sessionfinish(session: pytest.Session) -> Generator[None, None, None]:
    """Turn a run whose host tests could not run into a failed one."""
    watch = session.config.pluginmanager.get_plugin("palette4d-host-watch")
    if watch is not None and watch.complaints() and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
    return (yield)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say which host tests could not run."""
    watch = terminalreporter.config.pluginmanager.get_plugin("palette4d-host-watch")
    if watch is None or not watch.complaints():
        return
    terminalreporter.section("host tests were required (PALETTE4D_REQUIRE_HOST) but could not run")
    for complaint in watch.complaints():
        terminalreporter.line(complaint)


@pytest.fixture(scope="session")
def tool(repo_root: Path) -> ModuleType:
    """`docs/sidecar_fields.py`, which writes a schema's table into its page."""
    spec = importlib.util.spec_from_file_location(
        "sidecar_fields", repo_root / "docs/sidecar_fields.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
