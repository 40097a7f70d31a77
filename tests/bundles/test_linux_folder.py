"""The folder for Linux with a Python of its own, unpacked where a path has blanks."""

from __future__ import annotations

import os
import subprocess
import tarfile
from pathlib import Path

import pytest

ARCHIVE = Path(os.environ.get("PALETTE4D_LINUX_TAR", ""))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("Grüße 色")
    with tarfile.open(ARCHIVE) as packed:
        packed.extractall(place, filter="data")
    return place / "palette4d"


def test_it_grades_a_clip_without_another_python(folder: Path, tmp_path: Path) -> None:
    # No program of this machine, and no Python's variable, helps.
    bare = {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "QT_QPA_PLATFORM": "offscreen"}

    def run(program: str, *words: str) -> None:
        subprocess.run([folder / program, *words], cwd=tmp_path, env=bare, check=True)

    run("palette4d", "sample-clip", "-o", "clip/f.####.png", "--frames", "8")
    run("palette4d", "analyze", "clip", "-o", "a.p4d.json")
    run("palette4d", "render", "a.p4d.json", "clip", "-o", "graded.mp4")
    run("palette4d-studio", "a.p4d.json", "--screenshot", "studio.png")
    run("palette4d", "install-plugin", "--dest", "OFX")
    told = tmp_path / "OFX" / "Palette4D.ofx.bundle" / "Contents" / "Resources" / "program"
    assert told.read_text("utf-8") == f"{folder / 'python' / 'bin' / 'python3.13'}\n"


def test_every_package_has_its_licence(folder: Path, repo_root: Path) -> None:
    listed = (folder / "LICENSES" / "README.txt").read_text("utf-8").lower().replace("_", "-")
    for line in (repo_root / "locks" / "linux.txt").read_text("utf-8").splitlines():
        if "==" in line:
            assert f"  {line.split()[0].replace('==', ' ')}:" in listed
