"""The app for macOS, which nobody has run: its files, and its environment with this Python."""

from __future__ import annotations

import os
import plistlib
import stat
import subprocess
import sys
import zipfile
from pathlib import Path

import lief
import pytest

ARCHIVE = Path(os.environ.get("PALETTE4D_MACOS_ZIP", ""))
FRAMEWORK = "/Library/Frameworks/Python.framework/Versions/3.13/bin"
RESOURCES = Path("Contents", "Resources")


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The app, unpacked with its modes and links."""
    place = tmp_path_factory.mktemp("Grüße 色")
    subprocess.run(["unzip", "-q", ARCHIVE, "-d", place], check=True)
    return place / "Palette4D Studio.app"


def test_what_the_finder_reads(app: Path) -> None:
    about = plistlib.loads((app / "Contents" / "Info.plist").read_bytes())
    program = app / "Contents" / "MacOS" / about["CFBundleExecutable"]
    assert program.stat().st_mode & stat.S_IXUSR
    (wheel,) = (app / RESOURCES).glob("python/lib/python3.13/site-packages/palette4d-*.dist-info")
    assert wheel.name == f"palette4d-{about['CFBundleShortVersionString']}.dist-info"
    assert about["CFBundleDocumentTypes"][0]["LSItemContentTypes"] == ["public.json"]
    with zipfile.ZipFile(ARCHIVE) as packed:
        assert all(entry.date_time[0] == 1980 for entry in packed.infolist())


def test_every_library_is_for_arm64_and_finds_what_it_needs(app: Path) -> None:
    """All that was left out of Qt is needed by nothing that stayed."""
    own = lief.MachO.LoadCommand.TYPE.ID_DYLIB
    names = {path.name for path in app.rglob("*")}
    libraries = [
        path
        for path in app.rglob("*")
        if path.is_file() and path.read_bytes()[:4] in (b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe")
    ]
    assert len(libraries) > 100
    for path in libraries:
        parsed = lief.MachO.parse(path)
        assert parsed is not None
        parts = [part for part in parsed if part.header.cpu_type.name == "ARM64"]
        assert len(parts) == 1, path
        for library in parts[0].libraries:
            name = str(library.name)
            of_system = name.startswith(("/usr/lib/", "/System/")) or library.command == own
            assert of_system or Path(name).name in names, f"{path} asks for {name}"


def test_its_environment_finds_its_packages(app: Path) -> None:
    """With this Python in the place of python.org's, which must be of the same version."""
    home = app / RESOURCES / "python"
    program = home / "bin" / "python3.13"
    assert str(program.readlink()) == f"{FRAMEWORK}/python3.13"
    settings = home / "pyvenv.cfg"
    assert f"home = {FRAMEWORK}\n" in settings.read_text()
    script = "import cycler, sys; print(cycler.__file__); print(sys.executable)"
    base = Path(sys.base_prefix, "bin")
    settings.write_text(settings.read_text().replace(FRAMEWORK, str(base)))
    program.unlink()
    program.symlink_to(base / "python3")
    # Of another version the packages lie in another folder.
    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    if version != "python3.13":
        (home / "lib" / "python3.13").rename(home / "lib" / version)
    command = [program, "-I", "-c", script]
    found, running = subprocess.check_output(command, text=True).splitlines()
    assert Path(found).is_relative_to(app)
    assert running == str(program)


def test_it_says_which_python_it_lacks(app: Path, tmp_path: Path) -> None:
    """macOS' osascript shows the words; here a script keeps them."""
    asked = tmp_path / "osascript"
    asked.write_text('#!/bin/sh\nprintf "%s" "$2" >"$(dirname "$0")/told"\n')
    asked.chmod(0o755)
    copy = tmp_path / "Palette4D Studio.app" / "Contents"
    (copy / "Resources" / "python" / "bin").mkdir(parents=True)
    (copy / "MacOS").mkdir()
    program = copy / "MacOS" / "Palette4D Studio"
    program.write_bytes((app / "Contents" / "MacOS" / program.name).read_bytes())
    program.chmod(0o755)
    path = {"PATH": f"{tmp_path}:/usr/bin:/bin"}
    assert subprocess.run([program], env=path, check=False).returncode == 1
    assert "Install Python 3.13 from python.org" in (tmp_path / "told").read_text()


def test_every_package_has_its_licence(app: Path, repo_root: Path) -> None:
    listed = (app / RESOURCES / "LICENSES" / "README.txt").read_text("utf-8")
    listed = listed.lower().replace("_", "-")
    for line in (repo_root / "locks" / "macos.txt").read_text("utf-8").splitlines():
        if "==" in line:
            assert f"  {line.split()[0].replace('==', ' ')}:" in listed
