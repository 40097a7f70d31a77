"""`palette4d install-plugin --kdenlive --shotcut`: where the files go, and what they replace."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from posix_files import homes, links, pipes

import palette4d
from palette4d.cli import main
from palette4d.common.errors import Palette4dError
from palette4d.common.text import quoted
from palette4d.hosts import MARK, kdenlive, shotcut
from palette4d.hosts.editors import data_folder, install_kdenlive, install_shotcut

EFFECT = "kdenlive/effects/palette4d.xml"
FILTER = "Meltytech/Shotcut/extensions/filters/palette4d"


def names(root: Path) -> list[str]:
    """Everything below a folder that is no folder, hidden names included."""
    return sorted(
        path.relative_to(root).as_posix() for path in root.rglob("*") if not path.is_dir()
    )


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the user's data."""
    folder = tmp_path / "data"
    monkeypatch.setenv("XDG_DATA_HOME", str(folder))
    return folder


def test_every_file_names_its_writer_and_version() -> None:
    texts = [kdenlive.effect_file("1.2.3"), *shotcut.filter_files("1.2.3").values()]
    assert len(texts) == 3
    for text in texts:
        assert f"{MARK} 1.2.3" in text[:200]
        assert text.isascii()
        assert text.endswith("\n")


def test_the_effect_file_is_xml() -> None:
    ET.fromstring(kdenlive.effect_file("1.2.3").encode())


def test_the_filters_files_are_whole() -> None:
    for text in shotcut.filter_files("1.2.3").values():
        assert "@" not in text
        for opening, closing in ("{}", "()", "[]"):
            assert text.count(opening) == text.count(closing)
        assert text.count("'") % 2 == 0
        assert all(line == line.rstrip() for line in text.splitlines())


def test_what_makes_shotcut_look_is_written_last() -> None:
    assert list(shotcut.filter_files("1.2.3")) == ["ui.qml", "meta.qml"]


def test_folders_follow_the_environment(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert data_folder("kdenlive", "linux") == home / "kdenlive/effects"
    shotcuts = "Meltytech/Shotcut/extensions/filters"
    assert data_folder("shotcut", "linux") == home / shotcuts
    for nothing in ("", "relative"):
        monkeypatch.setenv("XDG_DATA_HOME", nothing)
        assert data_folder("shotcut", "linux") == Path.home() / ".local/share" / shotcuts
    monkeypatch.delenv("XDG_DATA_HOME")
    assert data_folder("kdenlive", "linux") == Path.home() / ".local/share/kdenlive/effects"


def test_folders_of_other_systems(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    filters = "Meltytech/Shotcut/extensions/filters"
    monkeypatch.setenv("APPDATA", str(tmp_path / "Roaming"))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "Local"))
    assert data_folder("kdenlive", "win32") == tmp_path / "Roaming/kdenlive/effects"
    assert data_folder("shotcut", "win32") == tmp_path / "Local" / filters
    monkeypatch.delenv("LOCALAPPDATA")
    assert data_folder("shotcut", "win32") == Path.home() / "AppData/Local" / filters
    support = Path.home() / "Library/Application Support"
    assert data_folder("kdenlive", "darwin") == support / "kdenlive/effects"
    assert data_folder("shotcut", "darwin") == support / filters


def test_writes_the_files_and_nothing_else(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    assert install_kdenlive(folder) == [folder / "palette4d.xml"]
    filters = install_shotcut(folder)
    assert sorted(filters) == [folder / "palette4d/meta.qml", folder / "palette4d/ui.qml"]
    assert names(folder) == ["palette4d.xml", "palette4d/meta.qml", "palette4d/ui.qml"]
    for path in folder.rglob("*.*"):
        assert path.stat().st_mode & 0o600 == 0o600
        assert f"{MARK} {palette4d.__version__}" in path.read_text(encoding="utf-8")


def test_replaces_an_earlier_version(tmp_path: Path) -> None:
    folder = tmp_path / "palette4d"
    folder.mkdir()
    for name in ("palette4d.xml", "palette4d/meta.qml", "palette4d/ui.qml"):
        (tmp_path / name).write_text(f"// {MARK} 0.0.1\nold")
    install_kdenlive(tmp_path)
    install_shotcut(tmp_path)
    for name in names(tmp_path):
        assert "old" not in (tmp_path / name).read_text().splitlines()


@pytest.mark.parametrize("name", ["palette4d.xml", "palette4d/meta.qml", "palette4d/ui.qml"])
@pytest.mark.parametrize(
    "kind",
    ["file", pytest.param("dangling link", marks=links), pytest.param("pipe", marks=pipes)],
)
def test_refuses_to_replace_somebody_elses(tmp_path: Path, name: str, kind: str) -> None:
    install = install_kdenlive if name.endswith(".xml") else install_shotcut
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    if kind == "file":
        path.write_text("precious")
    elif kind == "pipe":  # that nobody writes to
        os.mkfifo(path)
    else:
        path.symlink_to("gone")
    with pytest.raises(Palette4dError, match="force=True"):
        install(tmp_path)
    # Not even the other of the two files.
    assert names(tmp_path) == [name]
    if kind == "file":
        assert path.read_text() == "precious"
    if kind == "pipe":
        path.unlink()
    install(tmp_path, force=True)
    assert MARK in path.read_text()


def test_a_folder_in_a_files_place_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "palette4d.xml").mkdir()
    with pytest.raises(Palette4dError, match="force=True"):
        install_kdenlive(tmp_path)
    with pytest.raises(Palette4dError, match="found a folder"):
        install_kdenlive(tmp_path, force=True)


def test_a_file_in_the_folders_place_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "effects").write_text("precious")
    with pytest.raises(Palette4dError, match="cannot be made"):
        install_kdenlive(tmp_path / "effects")


def test_a_failed_write_leaves_the_earlier_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install_kdenlive(tmp_path)
    before = (tmp_path / "palette4d.xml").read_bytes()

    def fail(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(Palette4dError, match="No space left"):
        install_kdenlive(tmp_path)
    assert names(tmp_path) == ["palette4d.xml"]
    assert (tmp_path / "palette4d.xml").read_bytes() == before


@homes
def test_the_verb_writes_both_to_the_users_own_folders(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for _ in range(2):
        assert main.main(["install-plugin", "--kdenlive", "--shotcut"]) == 0
    assert names(home) == [f"{FILTER}/meta.qml", f"{FILTER}/ui.qml", EFFECT]
    out = capsys.readouterr().out
    assert f"installed {home / EFFECT}\n" in out
    assert "Allow External Plugins" in out
    # The node is installed when it is asked for, and then only.
    assert "OFX" not in out


def test_the_verb_takes_folders_and_installs_the_node_beside_them(
    tmp_path: Path, home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plugins, effects = tmp_path / "OFX", tmp_path / "effects"
    words = ["install-plugin", "--dest", str(plugins), "--kdenlive", str(effects)]
    assert main.main(words) == 0
    assert names(effects) == ["palette4d.xml"]
    assert (plugins / "Palette4D.ofx.bundle").is_dir()
    assert not home.exists()
    out = capsys.readouterr().out
    assert re.search(rf"OFX_PLUGIN_PATH[= ]{re.escape(quoted(plugins))}\n", out)


@homes
def test_the_verb_says_what_is_in_the_way(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    effect = home / EFFECT
    effect.parent.mkdir(parents=True)
    effect.write_text("precious")
    assert main.main(["install-plugin", "--kdenlive"]) == 1
    assert f"palette4d: error: {effect}: found something" in capsys.readouterr().err
    assert main.main(["install-plugin", "--kdenlive", "--force"]) == 0


def test_a_link_is_the_nodes(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["install-plugin", "--kdenlive", "--link"]) == 1
    assert "--dest" in capsys.readouterr().err
    assert not home.exists()
