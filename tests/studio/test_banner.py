"""What is wrong stands above the picture with what helps, until it is dealt with."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QSettings
from PySide6.QtWidgets import QAbstractButton, QFileDialog, QLabel, QToolButton
from windows import Settle

from palette4d.common.errors import Palette4dError
from palette4d.studio import banner as banner_module
from palette4d.studio import texts
from palette4d.studio.window import Window


def said(window: Window) -> str:
    """What the banner says."""
    labels = window.banner.findChildren(QLabel)
    return "\n".join(label.text() for label in labels if label.isVisible())


def push(window: Window, name: str) -> None:
    """Push a button of the banner."""
    button: QAbstractButton | None = window.banner.button(name)
    assert button is not None, said(window)
    button.click()


def own_clip(sidecar: Path, analysed: Path) -> Path:
    """A copy of the clip, which the test may break."""
    shutil.rmtree(sidecar.parent / "clip")
    shutil.copytree(analysed / "clip", sidecar.parent / "clip")
    return sidecar.parent / "clip"


@pytest.mark.parametrize("by_hand", [False, True])
def test_a_frame_that_was_missing_is_shown_when_it_comes(
    window: Window,
    sidecar: Path,
    analysed: Path,
    settle: Settle,
    qtbot: Any,
    monkeypatch: pytest.MonkeyPatch,
    by_hand: bool,
) -> None:
    lacked = own_clip(sidecar, analysed) / "frame.0005.png"
    kept = lacked.read_bytes()
    lacked.unlink()
    window.banner._again.setInterval(banner_module.READ_AGAIN * (100 if by_hand else 1) // 4)
    window.open_path(str(sidecar), str(sidecar.parent / "clip"))
    window.session.go(5)
    qtbot.waitUntil(lambda: "frame.0005.png" in said(window), timeout=20_000)
    lacked.write_bytes(kept[:100])  # half a file is no picture yet
    push(window, texts.TRY_AGAIN)
    qtbot.waitUntil(lambda: "cannot be read" in said(window), timeout=20_000)
    lacked.write_bytes(kept)
    if by_hand:
        push(window, texts.TRY_AGAIN)
    qtbot.waitUntil(lambda: not said(window), timeout=20_000)
    settle(window)
    assert window.viewer.shown_frame == 5


def test_a_clip_that_is_not_found_can_be_found(
    window: Window,
    sidecar: Path,
    analysed: Path,
    settle: Settle,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clip = str(analysed / "clip" / "frame.0001.png")
    shutil.rmtree(sidecar.with_name("clip"))
    fields = json.loads(sidecar.read_text())
    fields["clip"]["source"] = "clip/frame.####.png"
    sidecar.write_text(json.dumps(fields))
    window.open_path(str(sidecar))
    assert texts.NO_CLIP in said(window)
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (clip, ""))
    push(window, texts.FIND_CLIP)
    settle(window)
    assert not said(window)


def test_an_error_stays_until_it_is_closed_and_leaves_with_its_clip(
    opened: Window, sidecar: Path
) -> None:
    session = opened.session
    session.report(Palette4dError("the first error"))
    session.say("something else was done")
    assert "the first error" in said(opened)
    close = next(each for each in opened.banner.findChildren(QToolButton) if each.isVisible())
    close.click()
    assert not said(opened)
    session.report(Palette4dError("the second error"))
    assert "the second error" in said(opened)
    other = sidecar.with_name("other.p4d.json")
    shutil.copy(sidecar, other)
    opened.open_path(str(other))
    assert not said(opened)
    assert session.status.level == "info"


def test_the_first_thing_has_room_for_its_words(opened: Window, qtbot: Any) -> None:
    """The row kept the height that it had had before the banner was seen: none."""
    opened.banner.tell("notes", "the palette spans a sudden cut", "warning", {})

    def seen() -> bool:
        labels = opened.banner.findChildren(QLabel)
        return all(label.height() > 10 for label in labels if label.isVisible())

    qtbot.waitUntil(seen)
    assert "sudden cut" in said(opened)


def test_a_second_thing_that_is_wrong_is_seen_too(
    window: Window, sidecar: Path, tmp_path: Path, qtbot: Any
) -> None:
    fields = json.loads(sidecar.read_text())
    fields["clip"]["source"] = "gone/frame.####.png"
    sidecar.write_text(json.dumps(fields))
    window.open_path(str(sidecar))
    qtbot.waitUntil(lambda: window.banner.height() > 10)
    one = window.banner.height()
    (tmp_path / "bad.mp4").write_bytes(b"no movie")
    window.open_path(str(tmp_path / "bad.mp4"))
    qtbot.waitUntil(lambda: window.banner.height() > 1.5 * one)
    assert texts.NO_CLIP in said(window)


def test_what_cannot_be_saved_is_saved_elsewhere(
    opened: Window, sidecar: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    session = opened.session
    assert session.document is not None
    first = session.document.grade.core.polytope.vertex_ids[0]
    session.edit(lambda document: document.adjust(first, by=(0.1, 0, 0)))
    sidecar.unlink()
    sidecar.mkdir()  # nothing can be written there
    assert not session.save()
    assert texts.NOT_SAVED in said(opened)
    elsewhere = tmp_path / "elsewhere.p4d.json"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(elsewhere), ""))
    push(opened, texts.SAVE_ELSEWHERE)
    assert session.path == elsewhere
    assert not said(opened)


def test_a_clip_that_states_no_colour_space_says_what_is_assumed(
    window: Window, tmp_path: Path
) -> None:
    import av
    import numpy as np

    movie = tmp_path / "untagged.mp4"
    with av.open(str(movie), "w") as out:
        stream: Any = out.add_stream("mpeg4", rate=24)
        stream.width, stream.height, stream.pix_fmt = 64, 36, "yuv420p"
        for number in range(3):
            pixels = np.full((36, 64, 3), 60 * number, np.uint8)
            for packet in stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")):
                out.mux(packet)
        for packet in stream.encode():
            out.mux(packet)
    window.session.open_clip(str(movie))
    assert texts.ASSUMED in said(window)
    push(window, texts.CHANGE)
    (dialog,) = window.verbs.dialogs
    assert dialog.isVisible()
    assert dialog.value("") == str(movie)


def frames_of(settings: Path) -> object:
    """The frames that the settings in a file have."""
    return QSettings(str(settings), QSettings.Format.IniFormat).value("frames")


def test_after_a_crash_the_sidecar_is_offered_again(
    window: Window, sidecar: Path, tmp_path: Path, qtbot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "home"
    home.mkdir()
    # Both look for the other's socket in one place.
    monkeypatch.setenv("HOME", str(home))
    for folder in ("XDG_RUNTIME_DIR", "XDG_STATE_HOME"):
        monkeypatch.delenv(folder, raising=False)
    process = subprocess.Popen(
        [sys.executable, "-m", "palette4d", "studio", str(sidecar), "--frame", "3"],
        env={"PATH": os.environ["PATH"], "HOME": str(home), "QT_QPA_PLATFORM": "offscreen"},
    )
    kept = home / ".config" / "palette4d" / "studio.conf"
    try:
        qtbot.waitUntil(lambda: frames_of(kept) == {str(sidecar): 3}, timeout=60_000)
        window.settings = QSettings(str(kept), QSettings.Format.IniFormat)
        window.files.offer_crashed()
        assert not said(window)  # it is open there
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    window.files.offer_crashed()
    assert sidecar.name in said(window)
    push(window, texts.REOPEN)
    assert window.session.path == sidecar
    assert window.session.frame == 3
    assert not said(window)
    window.close()
    assert frames_of(kept) == {str(sidecar): 3}
    window.files.offer_crashed()
    assert not said(window)


def test_a_config_that_cannot_be_used_is_told(
    window: Window, sidecar: Path, settle: Settle, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The picture comes through another one: a colourist would grade what nobody else sees."""
    monkeypatch.setenv("OCIO", "/no/such/config.ocio")
    window.open_path(str(sidecar))
    settle(window)
    assert "/no/such/config.ocio: found no config there" in said(window)
    assert "ocio://" in said(window)
