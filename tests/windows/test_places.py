"""The folder where users put it: deep down, for all users, on a screen with small pixels."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import OpenImageIO as oiio
import pytest
from bundles.systems import wine_path

Run = Callable[..., "subprocess.CompletedProcess[str]"]

NOBODY = 65534
#: Characters of a path in Windows' older calls, with a zero at the end.
MAX_PATH = 260


def test_the_folder_runs_in_a_path_of_200_characters(
    windows_program: Run, folder: Path, tmp_path: Path
) -> None:
    deep = tmp_path
    while (left := 200 - len(wine_path(deep / "palette4d")) - 1) > 1:
        deep /= "Grüße 色 deep"[:left].strip() if left < 40 else "a folder with blanks in its name"
    copy = shutil.copytree(folder, deep / "palette4d", copy_function=os.link)
    assert 195 <= len(wine_path(copy)) <= 200
    words = ("--screenshot", "studio.png", "--size", "900x700")
    done = windows_program(str(copy / "Palette4D Studio.exe"), *words, cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    done = windows_program(str(copy / "palette4d.exe"), "--version", cwd=tmp_path)
    assert done.stdout.startswith("palette4d "), done.stdout


def test_the_page_says_how_long_the_folders_path_may_be(folder: Path, repo_root: Path) -> None:
    """Windows itself has longer paths only where an administrator allows them."""
    longest = max(len(str(path.relative_to(folder.parent))) for path in folder.rglob("*"))
    allowed = MAX_PATH - 1 - len("\\") - longest
    assert allowed >= 100
    page = (repo_root / "docs" / "install.md").read_text("utf-8")
    assert "at most 100 characters" in " ".join(page.split())


def test_small_pixels_get_large_windows(
    windows_program: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WINEQT_SCALE_FACTOR", "2")  # Wine keeps QT_… of Linux to itself
    words = ("--screenshot", "studio.png", "--size", "1000x700")
    done = windows_program("Palette4D Studio.exe", *words, cwd=tmp_path)
    assert done.returncode == 0, done.stdout
    spec = oiio.ImageBuf(str(tmp_path / "studio.png")).spec()
    assert (spec.width, spec.height) == (2000, 1400)


@pytest.fixture
def own() -> Iterator[Path]:
    """A folder of another user; those of pytest are closed to him."""
    if os.geteuid() != 0:
        pytest.skip("only root may run programs as another user")
    with tempfile.TemporaryDirectory(prefix="palette4d-") as name:
        os.chown(name, NOBODY, NOBODY)
        yield Path(name)


@pytest.fixture
def as_user(folder: Path, own: Path) -> Run:
    """A program of the folder, run by a user who may write nowhere but in a folder of his own."""
    environment = {
        **os.environ,
        "HOME": str(own),
        "WINEPREFIX": str(own / "wine"),
        "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree,mshtml=",
        "LC_ALL": "C.UTF-8",
    }

    def run(program: str, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["wine", folder / program if program.endswith(".exe") else program, *words],
            cwd=own, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, encoding="utf-8", errors="replace", timeout=600, check=False,
            user=NOBODY, group=NOBODY, extra_groups=[],
        )  # fmt: skip

    run("wineboot", "--init")
    run("winecfg", "-v", "win10")
    return run


def test_a_user_without_rights(as_user: Run, folder: Path, own: Path) -> None:
    """An administrator unpacked the folder; he works in it, and gets the node for himself."""
    before = {path: path.stat().st_mtime for path in folder.rglob("*")}
    done = as_user("palette4d.exe", "sample-clip", "-o", "clip/f.####.png", "--frames", "4")
    assert done.returncode == 0, done.stdout
    done = as_user("palette4d.exe", "analyze", "clip", "-o", "a.p4d.json")
    assert done.returncode == 0, done.stdout
    done = as_user("Palette4D Studio.exe", "a.p4d.json", "--screenshot", "studio.png")
    assert done.returncode == 0, done.stdout
    plugins = own / "wine" / "drive_c" / "Program Files" / "Common Files" / "OFX" / "Plugins"
    plugins.mkdir(parents=True)  # root's
    done = as_user("palette4d.exe", "install-plugin")
    assert done.returncode == 1
    assert "as an administrator" in done.stdout
    assert "--dest" in done.stdout
    done = as_user("palette4d.exe", "install-plugin", "--dest", "OFX")
    assert done.returncode == 0, done.stdout
    assert (own / "OFX" / "Palette4D.ofx.bundle" / "Contents" / "Win64" / "Palette4D.ofx").is_file()
    assert {path: path.stat().st_mtime for path in folder.rglob("*")} == before
