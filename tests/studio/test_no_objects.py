"""What Qt's streams hold, such as a file of settings, runs no code."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from PySide6.QtCore import QSettings

OPENS = """
import sys
from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QApplication
from palette4d.studio.session import Session
from palette4d.studio.window import Window
app = QApplication([])
window = Window(Session(), QSettings(sys.argv[1], QSettings.Format.IniFormat))
window.restore()
window.files.offer_crashed()
window.shut()
"""


class Object:
    """Unpickling it makes a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.folder),)


@pytest.mark.parametrize("name", ["recent", "open", "geometry", "state", "scopes", "display"])
def test_settings_run_no_code(tmp_path: Path, name: str) -> None:
    file = tmp_path / "settings.ini"
    settings = QSettings(str(file), QSettings.Format.IniFormat)
    settings.setValue(name, Object(tmp_path / "made"))
    settings.sync()
    assert "PyObject" in file.read_text()
    # In a process of its own: PySide looks for its function once.
    done = subprocess.run(
        [sys.executable, "-c", OPENS, str(file)],
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "made").exists()
