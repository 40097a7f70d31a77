"""Starting the window with and without a screen."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import OpenImageIO as oiio

from palette4d.studio.window import Window


def test_a_screenshot_is_drawn_without_a_screen(sidecar: Path, tmp_path: Path) -> None:
    out = tmp_path / "window.png"
    words = ["studio", str(sidecar), "--frame", "4", "--screenshot", str(out), "--size", "1400x700"]
    done = subprocess.run(
        [sys.executable, "-m", "palette4d", *words],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr
    spec = oiio.ImageBuf(str(out)).spec()
    assert (spec.width, spec.height) == (1400, 700)


def test_without_a_screen_it_says_how_to_do_without(sidecar: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "palette4d", "studio", str(sidecar)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
    )
    assert done.returncode == 1
    assert "--screenshot" in done.stderr


def test_another_start_with_the_same_sidecar_brings_this_window_to_the_frame(
    opened: Window, sidecar: Path, qtbot: Any
) -> None:
    from palette4d.studio.instance import bring_forward

    program = (
        "import sys\n"
        "from palette4d.studio.instance import bring_forward\n"
        "sys.exit(0 if bring_forward(sys.argv[1], 9.0) else 1)\n"
    )
    other = subprocess.Popen([sys.executable, "-c", program, str(sidecar)])
    qtbot.waitUntil(lambda: other.poll() is not None, timeout=20_000)
    assert other.returncode == 0
    qtbot.waitUntil(lambda: opened.session.frame == 9, timeout=5000)
    assert not bring_forward(sidecar.with_name("other.p4d.json"), None)
