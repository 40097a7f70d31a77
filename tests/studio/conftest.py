"""Fixtures of the window's tests: no screen, a small clip with its palette, and a window."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pytest

os.environ["QT_QPA_PLATFORM"] = "offscreen"

if os.environ.get("PALETTE4D_REQUIRE_HOST", "") in ("", "0"):
    pytest.importorskip(
        "PySide6.QtWidgets",
        reason="the extra palette4d[studio], or a library that Qt needs (libEGL, ...), is missing",
        exc_type=ImportError,
    )

from PySide6.QtCore import QSettings
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from palette4d.cli.main import main
from palette4d.studio import theme
from palette4d.studio.application import Application
from palette4d.studio.session import Session
from palette4d.studio.window import Window

LATER = 1e9


@pytest.fixture(scope="session")
def analysed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small clip, clip/frame.####.png, and its palette, clip.p4d.json."""
    folder = tmp_path_factory.mktemp("analysed")
    clip = str(folder / "clip" / "frame.####.png")
    assert main(["sample-clip", "-o", clip, "--size", "160x90", "--frames", "12", "--quiet"]) == 0
    out = str(folder / "clip.p4d.json")
    assert main(["analyze", clip, "-o", out, "--quiet"]) == 0
    return folder


@pytest.fixture
def sidecar(analysed: Path, tmp_path: Path) -> Path:
    """The clip's sidecar, to be edited."""
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((analysed / "clip.p4d.json").read_bytes())
    shutil.copytree(analysed / "clip", tmp_path / "clip", copy_function=os.link)
    return path


@pytest.fixture(scope="session")
def qapp_cls() -> type[Application]:
    """The application that pytest-qt makes."""
    return Application


@pytest.fixture
def window(qapp: QApplication, tmp_path: Path) -> Generator[Window]:
    """A window without a document."""
    theme.dress(qapp)
    settings = QSettings(str(tmp_path / "settings.ini"), QSettings.Format.IniFormat)
    made = Window(Session(), settings)
    made.resize(1200, 900)
    made.show()
    QTest.qWaitForWindowActive(made)
    yield made
    made.shut()
    made.deleteLater()
    qapp.processEvents()


@pytest.fixture
def settle(qtbot: Any) -> Callable[[Window], None]:
    """Wait until the exact picture of now is shown."""

    def shown(window: Window) -> bool:
        picture, session = window.viewer.picture, window.session
        return (
            window.settled
            and picture is not None
            and picture.request.look == session.looked
            and picture.request.sides == frozenset(window.viewer.sides)
            and picture.request.region == window.viewer.region()
            and picture.request.matte == session.shown_matte
            and picture.request.against == window.viewer._before_key()
        )

    return lambda window: qtbot.waitUntil(lambda: shown(window), timeout=30_000)


@pytest.fixture
def opened(window: Window, sidecar: Path, settle: Callable[[Window], None]) -> Window:
    """A window with the clip and its palette, at frame 6."""
    window.open_path(str(sidecar))
    window.session.go(6)
    settle(window)
    return window
