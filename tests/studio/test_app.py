"""Starting the window with and without a screen."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import OpenImageIO as oiio
import pytest
from PySide6.QtCore import QObject
from PySide6.QtGui import QFileOpenEvent
from PySide6.QtNetwork import QLocalSocket

from palette4d.cli.main import main
from palette4d.common.errors import Palette4dError
from palette4d.studio import app, instance
from palette4d.studio.application import Application
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


def test_a_screenshot_of_what_cannot_be_opened_fails_and_a_frame_beyond_is_noted(
    window: Window, sidecar: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "window.png"
    assert app.run(str(sidecar), frame=999, screenshot=out, size=(900, 600)) == 0
    assert "no frame 999; its frames are 1 to 12" in capsys.readouterr().err
    drawn = out.read_bytes()
    assert main(["studio", str(sidecar), "--screenshot", str(out)]) == 1
    assert "--force" in capsys.readouterr().err
    assert out.read_bytes() == drawn
    assert app.run(str(sidecar), screenshot=out, size=(800, 600), force=True) == 0
    assert out.read_bytes() != drawn
    frame = tmp_path / "clip" / "frame.0001.png"
    source = frame.read_bytes()
    frame.unlink()  # it is a link
    frame.write_bytes(source)
    with pytest.raises(Palette4dError, match="read for this output"):
        app.run(str(sidecar), clip=str(frame.parent), screenshot=frame, force=True)
    assert frame.read_bytes() == source
    out.unlink()
    sidecar.write_text("{")
    with pytest.raises(Palette4dError, match=r"clip\.p4d\.json"):
        app.run(str(sidecar), screenshot=out, size=(900, 600))
    assert not out.exists()


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


def brought_forward(sidecar: Path, qtbot: Any) -> bool:
    """Whether another program finds this window, which answers meanwhile."""
    program = (
        "import sys\n"
        "from palette4d.studio.instance import bring_forward\n"
        "sys.exit(0 if bring_forward(sys.argv[1], 9.0) else 1)\n"
    )
    other = subprocess.Popen([sys.executable, "-c", program, str(sidecar)])
    qtbot.waitUntil(lambda: other.poll() is not None, timeout=20_000)
    assert other.returncode in (0, 1)
    return other.returncode == 0


def test_another_start_with_the_same_sidecar_brings_this_window_to_the_frame(
    opened: Window, sidecar: Path, qtbot: Any
) -> None:
    assert brought_forward(sidecar, qtbot)
    qtbot.waitUntil(lambda: opened.session.frame == 9, timeout=5000)
    assert not instance.bring_forward(sidecar.with_name("other.p4d.json"), None)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of sockets are private")
def test_no_other_user_can_take_the_name_of_a_socket(
    sidecar: Path, monkeypatch: pytest.MonkeyPatch, qtbot: Any
) -> None:
    """In the folder of temporary files each user could listen there first."""
    with tempfile.TemporaryDirectory(dir="/tmp") as name:
        run, state = Path(name, "run"), Path(name, "state")
        run.mkdir()
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(run))
        monkeypatch.setenv("XDG_STATE_HOME", str(state))
        assert Path(instance.name_of(sidecar)).parent == run
        run.chmod(0o777)
        parent, heard = QObject(), []
        listener = instance.Listener(parent, heard.append)
        listener.listen(sidecar)
        socket = Path(instance.name_of(sidecar))
        assert socket.parent == state / "palette4d"
        assert socket.is_socket()
        assert not socket.parent.stat().st_mode & 0o077
        assert brought_forward(sidecar, qtbot)
        assert heard == [9]
        listener.listen(None)


HOSTILE = {
    "deep": b"[" * 4000,
    "NaN": b'{"frame": NaN}',
    "infinite": b'{"frame": 1e999}',
    "too large": b'{"frame": ' + b"9" * 400 + b"}",
    "no text": b"\xff",
    "infinite text": b'{"frame": "inf"}',
}


def test_hostile_questions_of_another_start_are_passed_over(
    opened: Window, sidecar: Path, qtbot: Any
) -> None:
    for number, line in enumerate(HOSTILE.values()):
        socket = QLocalSocket()
        socket.connectToServer(instance.name_of(sidecar))
        assert socket.waitForConnected(5000)
        socket.write(line + b"\n")
        socket.write(b'{"frame": 8}\n')
        qtbot.waitUntil(lambda own=socket: own.bytesToWrite() == 0, timeout=5000)
        socket.write(b'{"frame": %d}\n' % (9 + number % 2))
        wanted = (8, 9 + number % 2)
        qtbot.waitUntil(lambda wanted=wanted: opened.session.frame in wanted, timeout=5000)
        socket.disconnectFromServer()


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives a file to another user"
)
def test_a_socket_of_another_user_is_no_window(opened: Window, sidecar: Path, qtbot: Any) -> None:
    found = QLocalSocket()
    found.connectToServer(instance.name_of(sidecar))
    assert not Path(found.fullServerName()).stat().st_mode & 0o077
    os.chown(found.fullServerName(), 12345, -1)
    assert not brought_forward(sidecar, qtbot)
    assert opened.session.frame != 9


def test_a_file_of_the_finder_is_opened(
    qapp: Application, window: Window, sidecar: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On macOS a double click is no argument of the command: the running program is told."""
    monkeypatch.setattr(qapp, "open_path", window.open_path)
    qapp.sendEvent(qapp, QFileOpenEvent(str(sidecar)))
    assert window.session.document is not None
    assert window.session.document.path == sidecar
