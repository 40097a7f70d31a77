"""The user's folders on each system."""

from pathlib import Path

import pytest

from palette4d.common.folders import data_folder, state_folder


def test_each_system_has_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("APPDATA", "LOCALAPPDATA", "XDG_DATA_HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(name, str(tmp_path / name))
    support = Path.home() / "Library" / "Application Support"
    assert state_folder("win32") == data_folder("win32") == tmp_path / "LOCALAPPDATA"
    assert data_folder("win32", roaming=True) == tmp_path / "APPDATA"
    assert state_folder("darwin") == data_folder("darwin") == support
    assert data_folder("linux") == tmp_path / "XDG_DATA_HOME"
    assert state_folder("linux") == tmp_path / "XDG_STATE_HOME"


def test_relative_folders_do_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("", "relative"):
        monkeypatch.setenv("XDG_STATE_HOME", name)
        assert state_folder("linux") == Path.home() / ".local/state"
