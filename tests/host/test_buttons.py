"""The node's buttons start the palette4d that has installed the node."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from palette4d.hosts.install import install_plugin
from palette4d.media.clip import open_clip

GOLDEN = Path(__file__).parent.parent / "golden" / "sidecars"
SCREEN = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first image of a sequence of three."""
    folder = tmp_path_factory.mktemp("clip")
    colours = np.random.default_rng(17).integers(20, 230, (3, 24, 32, 3), dtype=np.uint8)
    for number, image in enumerate(colours, start=1001):
        iio.imwrite(folder / f"shot.{number}.png", image)
    return folder / "shot.1001.png"


def push(driver: Path, bundle: Path, button: str, **settings: object) -> str:
    """The status in the end, on a machine without a screen."""
    words = [w for name, value in settings.items() for w in ("--set", f"{name}={value}")]
    # Hosts start anywhere, also where somebody else's module of this name lies.
    hostile = bundle.parent / "cwd"
    hostile.mkdir(exist_ok=True)
    (hostile / "palette4d.py").write_text("raise SystemExit('not me')")
    done = subprocess.run(
        [driver, "push", bundle, button, *words],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        cwd=hostile,
        env={name: value for name, value in os.environ.items() if name not in SCREEN},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_analyse_writes_the_sidecar_and_shows_it(
    strict_host: Path, clip: Path, tmp_path: Path
) -> None:
    (bundle,) = install_plugin(tmp_path / "OFX")
    status = push(strict_host, bundle, "analyse", clipFile=clip)
    sidecar = clip.with_name("shot.p4d.json")
    assert status.startswith("shot: frames 1001-1003"), status
    assert f"file {sidecar}\n" in status
    assert Path(json.loads(sidecar.read_text())["clip"]["source"]).name == "shot.####.png"


def test_analyse_keeps_the_programs_rules(strict_host: Path, clip: Path, tmp_path: Path) -> None:
    (bundle,) = install_plugin(tmp_path / "OFX")
    kept = tmp_path / "notes.json"
    kept.write_text("no sidecar")
    status = push(strict_host, bundle, "analyse", clipFile=clip, sidecar=kept)
    assert status.startswith(f"the analysis of {clip.parent}/shot.####.png failed: "), status
    assert kept.read_text() == "no sidecar"


def test_a_failed_analysis_advises_what_a_host_has(
    strict_host: Path, clip: Path, tmp_path: Path
) -> None:
    (bundle,) = install_plugin(tmp_path / "OFX")
    for number in (1, 2, 4):
        shutil.copy(clip, tmp_path / f"gap.{number}.png")
    status = push(strict_host, bundle, "analyse", clipFile=tmp_path / "gap.1.png")
    first = status.splitlines()[0]
    assert "leave such frames out with 'Skip bad frames'" in first
    assert first.endswith("Push Open in Studio for these, and choose File > Analyse…")
    assert "--" not in first


def test_open_in_studio_says_why_no_window_appears(strict_host: Path, tmp_path: Path) -> None:
    (bundle,) = install_plugin(tmp_path / "OFX")
    sidecar = GOLDEN / "v1_edited.p4d.json"
    status = push(strict_host, bundle, "openInStudio", sidecar=sidecar)
    # Without the toolkit: found no PySide6.
    assert status.startswith(f"Studio with {sidecar} ended: found no "), status


def test_a_linked_bundle_knows_its_python_too(
    strict_host: Path, clip: Path, tmp_path: Path
) -> None:
    (bundle,) = install_plugin(tmp_path / "OFX", link=True)
    missing = clip.with_name("gone.mov")
    status = push(strict_host, bundle, "analyse", clipFile=missing, sidecar=tmp_path / "s.p4d.json")
    assert "gone.mov failed: " in status
    assert "no such file or folder" in status


def test_the_hosts_frames_are_analysed_as_they_are(strict_host: Path, tmp_path: Path) -> None:
    (bundle,) = install_plugin(tmp_path / "OFX")
    frames = np.random.default_rng(4).uniform(0, 1, (3, 24, 32, 4)).astype(np.float32)
    frames[:, :, :2] = (0.9, 0.2, 0.1, 1)
    frames[:, :4] = (7.5, -0.25, 1e-6, 1)
    raw = tmp_path / "frames.raw"
    frames[:, ::-1].tofile(raw)  # the host's rows count upwards
    sidecar = tmp_path / "host.p4d.json"
    settings = ("--effect", "1", "--width", "32", "--height", "24", "--set", f"sidecar={sidecar}")
    done = subprocess.run(
        [strict_host, "push", bundle, "analyse", raw, *settings],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.stdout == f"{sidecar} is there: choose it in the node Palette4D\n", done
    clip = open_clip(json.loads(sidecar.read_text())["clip"]["source"])
    read = np.stack([image for _, image in clip])
    assert np.array_equal(read, frames[..., :3].astype(np.float16).astype(np.float32))
