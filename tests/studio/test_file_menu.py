"""Opening clips, sidecars and manifests; what is missing or broken is a message."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import OpenImageIO as oiio
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog
from windows import Settle, drop

from palette4d.cli.main import main
from palette4d.shows import manifest
from palette4d.studio.session import Session
from palette4d.studio.window import Window


def test_a_clip_that_vanished_is_said_and_the_palette_stays(window: Window, sidecar: Path) -> None:
    shutil.rmtree(sidecar.parent / "clip")
    fields = json.loads(sidecar.read_text())
    fields["clip"]["source"] = "clip/frame.####.png"
    sidecar.write_text(json.dumps(fields))
    window.open_path(str(sidecar))
    assert window.session.document is not None
    assert window.session.clip is None
    assert window.session.status.level == "warning"
    window.viewer.repaint()


@pytest.mark.parametrize("text", ["", "{", '{"schema": "palette4d.sidecar", "version": 99}'])
def test_a_broken_sidecar_is_a_message(window: Window, tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.p4d.json"
    path.write_text(text)
    window.open_path(str(path))
    assert window.session.status.level == "error"
    assert window.isVisible()


def test_a_palette_of_one_colour_and_a_clip_of_another_size(
    window: Window, tmp_path: Path, settle: Settle, qtbot: Any
) -> None:
    clip, other = tmp_path / "grey", tmp_path / "other"
    for folder, width in ((clip, 64), (other, 32)):
        folder.mkdir()
        for number in range(1, 4):
            buffer = oiio.ImageBuf(oiio.ImageSpec(width, 36, 3, oiio.UINT8))
            oiio.ImageBufAlgo.fill(buffer, (0.5, 0.5, 0.5))
            buffer.write(str(folder / f"g.{number:04d}.png"))
    out = tmp_path / "grey.p4d.json"
    assert main(["analyze", str(clip), "-o", str(out), "--quiet"]) == 0
    window.open_path(str(out))
    settle(window)
    window.commands.calls["outside"]()
    settle(window)
    window.session.find_clip(str(other))
    settle(window)
    assert "32x36" in window.session.status.text
    QTest.mouseClick(window.viewer, Qt.MouseButton.LeftButton, pos=window.viewer.rect().center())
    window.inspector.boxes["R"].setValue(0.9)
    qtbot.waitUntil(lambda: window.session.status.level == "error", timeout=10_000)
    assert "File > Find the clip" in window.session.status.text


def test_an_edit_is_analysed_and_its_manifest_opens_as_a_list_of_shots(
    window: Window, sidecar: Path, settle: Settle, qtbot: Any
) -> None:
    edit = sidecar.with_name("edit.otio")
    _write_edit(edit, str(sidecar.parent / "clip" / "frame.####.png"))
    drop(window, str(edit))
    (dialog,) = window.verbs.dialogs
    shots = edit.with_name("edit_shots")
    assert dialog.words() == ["analyze", str(edit), "-o", str(shots)]
    dialog.start()
    qtbot.waitUntil(lambda: window.shots.count() == 2, timeout=120_000)
    window.open_path(str(sidecar))
    window.open_path(str(next(shots.glob(f"*{manifest.ENDING}"))))
    assert window.shots.count() == 2
    settle(window)
    window.activateWindow()
    assert QTest.qWaitForWindowActive(window)
    first = window.session.path
    QTest.keyClick(window, Qt.Key.Key_PageDown)
    assert window.session.path != first
    QTest.keyClick(window, Qt.Key.Key_PageUp)
    assert window.session.path == first
    # Another shot is marked; with a file that is none the list goes, also at the next start.
    second = window.shots.folder / window.shots.entries[1].sidecar
    window.open_path(str(second))
    assert window.shots.list.currentRow() == 1
    window.settings.setValue("state", window.saveState())
    window.open_path(str(sidecar))
    assert (window.docks["shots"].isVisible(), window.shots.count()) == (False, 0)
    window.restore()
    assert not window.docks["shots"].isVisible()


def _write_edit(path: Path, clip: str) -> None:
    import opentimelineio as otio

    time = otio.opentime.RationalTime
    folder, name = str(Path(clip).parent), "frame."
    track = otio.schema.Track(name="V1", kind="Video")
    for number in (0, 1):
        reference = otio.schema.ImageSequenceReference(
            target_url_base=folder + "/",
            name_prefix=name,
            name_suffix=".png",
            start_frame=1,
            frame_step=1,
            rate=24,
            frame_zero_padding=4,
            available_range=otio.opentime.TimeRange(time(0, 24), time(12, 24)),
        )
        source = otio.opentime.TimeRange(time(6 * number, 24), time(3, 24))
        shot = otio.schema.Clip(
            name=f"shot{number}", media_reference=reference, source_range=source
        )
        track.append(shot)
    timeline = otio.schema.Timeline(name="edit")
    timeline.tracks.append(track)
    otio.adapters.write_to_file(timeline, str(path))


def test_a_clip_without_a_palette_is_offered_to_be_analysed(
    window: Window, analysed: Path, tmp_path: Path, qtbot: Any
) -> None:
    (tmp_path / "new").mkdir()
    for frame in sorted((analysed / "clip").iterdir())[:3]:
        shutil.copy(frame, tmp_path / "new")
    window.open_path(str(tmp_path / "new" / "frame.####.png"))
    assert window.session.document is None
    (dialog,) = window.verbs.dialogs
    assert dialog.command.toPlainText().startswith("palette4d analyze ")
    dialog.start()
    qtbot.waitUntil(lambda: window.session.document is not None, timeout=120_000)
    assert (tmp_path / "new" / "frame.p4d.json").is_file()


@pytest.mark.parametrize("dropped", [False, True])
def test_one_image_of_a_sequence_opens_the_sequence(
    window: Window, analysed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, dropped: bool
) -> None:
    folder = tmp_path / "beach"
    folder.mkdir()
    for number, frame in enumerate(sorted((analysed / "clip").glob("*.png"))):
        shutil.copy(frame, folder / f"t{number:03d}.png")
    shutil.copy(folder / "t000.png", folder / "still.png")
    chosen = str(folder / "t003.png")
    if dropped:
        drop(window, chosen)
    else:
        monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (chosen, ""))
        window.files.open()
    assert window.session.clip is not None
    assert list(window.session.clip.frames) == list(range(12))
    offered = window.verbs.dialogs[-1]
    assert offered.value("") == str(folder / "t###.png")
    out = folder / "t.p4d.json"
    assert offered.value("-o") == str(out)
    offered.close()
    # The next time that sidecar is found; an image without numbered neighbours stays alone.
    out.write_bytes((analysed / "clip.p4d.json").read_bytes())
    drop(window, chosen)
    assert window.session.path == out
    drop(window, str(folder / "still.png"))
    assert window.session.clip is not None
    assert len(window.session.clip.frames) == 1


def test_a_dropped_folder_opens_its_sequence(window: Window, sidecar: Path) -> None:
    drop(window, str(sidecar.with_name("clip")))
    assert window.session.path == sidecar
    sidecar.unlink()
    drop(window, str(sidecar.with_name("clip")))
    assert window.session.clip is not None
    assert len(window.session.clip.frames) == 12
    assert window.session.document is None


def test_the_root_folder_is_no_clip(window: Window) -> None:
    drop(window, "/")
    assert window.session.status.level == "error"


def test_of_many_recent_files_the_newest_are_listed(window: Window) -> None:
    window.settings.setValue("recent", [f"{k}.p4d.json" for k in range(20_000)])
    assert window.files.recent_files() == [f"{k}.p4d.json" for k in range(10)]


def test_a_file_opens_at_the_frame_where_it_was_left(opened: Window, sidecar: Path) -> None:
    opened.session.go(9)
    opened.close()
    again = Window(Session(), opened.settings)
    again.open_path(str(sidecar))
    assert again.session.frame == 9
    again.shut()
    again.deleteLater()
