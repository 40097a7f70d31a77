"""The node's buttons on Windows: a host pushes them, and the folder's palette4d starts."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path, PureWindowsPath

import imageio.v3 as iio
import numpy as np
import pytest
from bundles.systems import wine_path

Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first image of a sequence of three, in a folder of no code page."""
    folder = tmp_path_factory.mktemp("Grüße 色 clip")
    colours = np.random.default_rng(17).integers(20, 230, (3, 24, 32, 3), dtype=np.uint8)
    for number, image in enumerate(colours, start=1001):
        iio.imwrite(folder / f"shot.{number}.png", image)
    return folder / "shot.1001.png"


@pytest.fixture(scope="module")
def bundle(windows: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The node as the folder's command installs it."""
    place = tmp_path_factory.mktemp("OFX plugins")
    done = windows("install-plugin", "--dest", wine_path(place), cwd=place)
    assert done.returncode == 0, done.stdout
    return place / "Palette4D.ofx.bundle"


@pytest.fixture
def push(windows_program: Run, repo_root: Path, bundle: Path, tmp_path: Path) -> Callable[..., str]:
    """Push a button in the strict host; return the node's status in the end."""
    host = repo_root / "build" / "cmake" / "windows" / "tests" / "host" / "strict_host.exe"
    # Hosts start anywhere, also where somebody else's module of this name lies.
    (tmp_path / "palette4d.py").write_text("raise SystemExit('not me')")

    def run(button: str, **settings: Path) -> str:
        words = [f"{name}={wine_path(path)}" for name, path in settings.items()]
        words = [word for setting in words for word in ("--set", setting)]
        done = windows_program(str(host), "push", wine_path(bundle), button, *words, cwd=tmp_path)
        assert done.returncode == 0, done.stdout
        return done.stdout.replace("\r\n", "\n")

    return run


def test_analyse_writes_the_sidecar_and_shows_it(push: Callable[..., str], clip: Path) -> None:
    status = push("analyse", clipFile=clip)
    sidecar = clip.with_name("shot.p4d.json")
    assert status.startswith("shot: frames 1001-1003"), status
    source = json.loads(sidecar.read_text("utf-8"))["clip"]["source"]
    assert PureWindowsPath(source).name == "shot.####.png"


def test_a_failed_analysis_advises_what_a_host_has(
    push: Callable[..., str], clip: Path, tmp_path: Path
) -> None:
    for number in (1, 2, 4):
        shutil.copy(clip, tmp_path / f"gap.{number}.png")
    status = push("analyse", clipFile=tmp_path / "gap.1.png")
    assert "leave such frames out with 'Skip bad frames'" in status


def test_open_in_studio_starts_it(
    push: Callable[..., str], repo_root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Studio ends where it finds no screen, and the node says so."""
    monkeypatch.setenv("QT_QPA_PLATFORM", "nowhere")
    sidecar = repo_root / "tests" / "golden" / "sidecars" / "v1_edited.p4d.json"
    status = push("openInStudio", sidecar=sidecar)
    assert status.startswith(f"Studio with {wine_path(sidecar)} ended: "), status
