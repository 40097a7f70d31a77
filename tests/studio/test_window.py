"""The window: what a person does in it and sees, driven by mouse and keyboard."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog

import palette4d
from palette4d.cli.main import main
from palette4d.shows import manifest
from palette4d.studio import actions
from palette4d.studio.jobs import Job
from palette4d.studio.window import Window

Settle = Callable[[Window], None]
FRAME = 6


def busiest(window: Window) -> str:
    """The id of a vertex of the palette colour that the frame has most of."""
    document, player = window.session.document, window.session.player
    assert document is not None
    assert player is not None
    frame = window.session.frame
    palette = document.palette(frame)
    shares = document.weights(player.read(frame), frame).mean(axis=(0, 1))
    at = int(np.argmax(shares))
    return palette.ends[at][int(palette.weights[at] > 0.5)]


def seen(window: Window) -> Any:
    """What the viewer draws, (h, w, 3) of 8 bits."""
    image = window.viewer.grab().toImage()
    image = image.convertToFormat(image.Format.Format_RGB888)
    rows = np.array(np.frombuffer(image.constBits(), np.uint8)).reshape(image.height(), -1)
    return rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3)


def test_the_exact_picture_has_the_bits_of_render(
    opened: Window, sidecar: Path, settle: Settle, tmp_path: Path
) -> None:
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(0.9, 0.3, 0.1)))
    settle(opened)
    opened.session.save()
    out = tmp_path / "out.0006.tif"
    clip = str(tmp_path / "clip")
    words = ["render", str(sidecar), clip, "-o", str(tmp_path / "out.####.tif"), "--bits", "32"]
    assert main([*words, "--frames", str(FRAME), "--quiet"]) == 0
    rendered = oiio.ImageBuf(str(out)).get_pixels(oiio.FLOAT)
    picture = opened.viewer.picture
    assert picture is not None
    assert picture.exact
    assert picture.result is not None
    assert np.array_equal(picture.result, rendered[..., : picture.result.shape[2]])
    assert not np.array_equal(picture.result, picture.request.pixels)


def test_a_picked_colour_has_the_bits_of_render(
    opened: Window, sidecar: Path, settle: Settle, tmp_path: Path
) -> None:
    at = opened.viewer.point_of(60.5, 60.5).toPoint()
    QTest.mouseClick(opened.viewer, Qt.MouseButton.LeftButton, pos=at)
    session = opened.session
    assert session.document is not None
    place = opened.viewer.place(at.toPointF(), at.toPointF())
    assert place is not None
    session.edit(
        lambda document: document.pick(FRAME, colour=place.colour, to=(0.9, 0.1, 0.5), follow=False)
    )
    settle(opened)
    session.save()
    clip, out = str(tmp_path / "clip"), str(tmp_path / "picked.####.tif")
    words = ["render", str(sidecar), clip, "-o", out, "--bits", "32", "--frames", str(FRAME)]
    assert main([*words, "--quiet"]) == 0
    rendered = oiio.ImageBuf(str(tmp_path / "picked.0006.tif")).get_pixels(oiio.FLOAT)
    picture = opened.viewer.picture
    assert picture is not None
    assert picture.result is not None
    assert np.array_equal(picture.result, rendered[..., : picture.result.shape[2]])
    y, x = place.y, place.x
    assert np.abs(picture.result[y, x] - (0.9, 0.1, 0.5)).max() < 0.05


def test_alt_click_is_a_hold_as_the_verb_makes_it(
    opened: Window, sidecar: Path, tmp_path: Path, qtbot: Any
) -> None:
    twin = Path(shutil.copy(sidecar, tmp_path / "twin.p4d.json"))
    at = opened.viewer.point_of(60.5, 60.5).toPoint()
    place = opened.viewer.place(at.toPointF(), at.toPointF())
    assert place is not None
    alt = Qt.KeyboardModifier.AltModifier
    QTest.mouseClick(opened.viewer, Qt.MouseButton.LeftButton, alt, at)
    session = opened.session
    qtbot.waitUntil(
        lambda: session.document is not None and len(session.document.picks) == 1, timeout=30_000
    )
    assert session.save()
    words = ["edit", str(twin), "hold", "--frame", str(FRAME), "--pixel", f"{place.x},{place.y}"]
    assert main(words) == 0
    assert sidecar.read_bytes() == twin.read_bytes()


def test_the_picture_of_a_drag_is_near_the_exact_one(opened: Window, settle: Settle) -> None:
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(0.9, 0.3, 0.1)))
    settle(opened)
    exact = opened.viewer.picture
    assert exact is not None
    quick = opened.viewer.preview.make(exact.request, exact=False)
    assert exact.after is not None
    assert quick.after is not None
    assert quick.after.shape == exact.after.shape
    assert np.abs(quick.after.astype(int) - exact.after.astype(int)).mean() < 1.5


def test_the_view_is_not_clamped_before_the_display(opened: Window, settle: Settle) -> None:
    opened.session.look(exposure=-3.0)
    settle(opened)
    before = int(seen(opened).max())
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(3.1, 3.2, 3.3)))
    settle(opened)
    assert seen(opened).max() > before + 10


def test_a_wipe_is_dragged_and_shows_both_sides(opened: Window, settle: Settle) -> None:
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(1.0, 0.0, 0.0)))
    QTest.keyClick(opened, Qt.Key.Key_W)
    settle(opened)
    viewer = opened.viewer
    height = viewer.height() // 2
    start = QPoint(round(viewer.wipe_x()), height)
    QTest.mousePress(viewer, Qt.MouseButton.LeftButton, pos=start)
    QTest.mouseMove(viewer, start + QPoint(-150, 0))
    QTest.mouseRelease(viewer, Qt.MouseButton.LeftButton, pos=start + QPoint(-150, 0))
    assert opened.session.view.wipe < 0.45
    settle(opened)
    both = seen(opened)
    opened.session.look(compare="before")
    settle(opened)
    before = seen(opened)
    x = round(viewer.wipe_x())
    assert np.array_equal(both[60:, 20 : x - 8], before[60:, 20 : x - 8])
    assert not np.array_equal(both[60:, x + 8 :], before[60:, x + 8 :])


def test_holding_the_key_shows_the_picture_before(opened: Window, settle: Settle) -> None:
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(1.0, 0.0, 0.0)))
    settle(opened)
    after = seen(opened)
    QTest.keyPress(opened, Qt.Key.Key_C)
    settle(opened)
    during = seen(opened)
    QTest.keyRelease(opened, Qt.Key.Key_C)
    settle(opened)
    assert not np.array_equal(during, after)
    assert np.array_equal(seen(opened)[60:], after[60:])


def test_the_probe_says_what_the_frame_has(opened: Window, settle: Settle) -> None:
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(0.9, 0.3, 0.1)))
    settle(opened)
    QTest.mouseMove(opened.viewer, opened.viewer.point_of(100.5, 40.5).toPoint())
    probe = opened.session.probe
    picture = opened.viewer.picture
    assert probe is not None
    assert picture is not None
    assert picture.result is not None
    x, y = probe.x, probe.y
    assert abs(x - 100) <= 1
    assert abs(y - 40) <= 1
    assert probe.source == tuple(float(v) for v in picture.request.pixels[y, x])
    assert probe.result == tuple(float(v) for v in picture.result[y, x])
    assert sum(probe.weights.values()) == pytest.approx(1, abs=1e-6)


def test_hovering_over_a_handle_shows_its_matte(opened: Window, settle: Settle) -> None:
    plain = seen(opened)
    opened.session.hover_over(busiest(opened))
    settle(opened)
    opened.viewer.repaint()
    matte = seen(opened)
    assert not np.array_equal(matte, plain)
    opened.session.hover_over(None)
    settle(opened)


def test_zoom_keeps_the_point_and_one_to_one_has_the_frames_pixels(
    opened: Window, settle: Settle
) -> None:
    viewer = opened.viewer
    at = viewer.point_of(40, 30)
    viewer.zoom_by(1.5, at)
    after = viewer.point_of(40, 30)
    assert (after - at).manhattanLength() < 0.01
    QTest.keyClick(opened, Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    settle(opened)
    region = viewer.region()
    assert region is not None
    assert region.whole
    viewer.fit()
    assert viewer.zoom is None


def test_versions_are_kept_used_and_compared(opened: Window, settle: Settle) -> None:
    id_ = busiest(opened)
    session = opened.session
    session.edit(lambda document: document.set(id_, rgb=(1.0, 0.0, 0.0)))
    QTest.keyClick(opened, Qt.Key.Key_V)
    session.edit(lambda document: document.set(id_, rgb=(0.0, 0.0, 1.0)))
    QTest.keyClick(opened, Qt.Key.Key_V)
    assert session.versions == ("A", "B")
    QTest.keyClick(opened, Qt.Key.Key_1)
    assert session.document is not None
    assert session.document.colour(id_) == (1.0, 0.0, 0.0)
    opened.commands.compare_version()
    assert session.view.version == "A"
    settle(opened)
    picture = opened.viewer.picture
    assert picture is not None
    assert np.array_equal(picture.before, picture.after)
    opened.commands.compare_version()
    settle(opened)
    picture = opened.viewer.picture
    assert picture is not None
    assert not np.array_equal(picture.before, picture.after)


def test_undo_redo_and_the_history_by_hand(opened: Window) -> None:
    id_ = busiest(opened)
    session = opened.session
    for value in (0.1, 0.2, 0.3):
        session.edit(lambda document, v=value: document.set(id_, rgb=(v, v, v)))
    QTest.keyClick(opened, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert session.document is not None
    assert session.document.colour(id_) == (0.2, 0.2, 0.2)
    opened.history.go_to(1)
    assert session.document.colour(id_) == (0.1, 0.1, 0.1)
    opened.history.go_to(3)
    assert session.document.colour(id_) == (0.3, 0.3, 0.3)


def test_arrows_in_and_out_points_and_playing(opened: Window, qtbot: Any) -> None:
    session = opened.session
    QTest.keyClick(opened, Qt.Key.Key_Right)
    assert session.frame == FRAME + 1
    QTest.keyClick(opened, Qt.Key.Key_Home)
    QTest.keyClick(opened, Qt.Key.Key_I)
    session.go(4)
    QTest.keyClick(opened, Qt.Key.Key_O)
    assert session.marks == (1, 4)
    visited = set()
    session.on("frame", lambda: visited.add(session.frame))
    QTest.keyClick(opened, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: visited == {1, 2, 3, 4}, timeout=30_000)
    QTest.keyClick(opened, Qt.Key.Key_Space)
    assert session.playing == 0
    QTest.keyClick(opened, Qt.Key.Key_J)
    assert session.playing == -1
    QTest.keyClick(opened, Qt.Key.Key_K)
    assert session.playing == 0


def test_a_clip_that_vanished_is_said_and_the_palette_stays(window: Window, sidecar: Path) -> None:
    (sidecar.parent / "clip").unlink()
    fields = json.loads(sidecar.read_text())
    fields["clip"]["source"] = "clip/frame.####.png"
    sidecar.write_text(json.dumps(fields))
    window.open_path(str(sidecar))
    assert window.session.document is not None
    assert window.session.clip is None
    assert window.session.status.level == "warning"
    window.viewer.repaint()


def test_a_frame_that_does_not_decode_is_a_message(
    window: Window, sidecar: Path, analysed: Path, qtbot: Any, settle: Settle
) -> None:
    (sidecar.parent / "clip").unlink()
    shutil.copytree(analysed / "clip", sidecar.parent / "clip")
    broken = sidecar.parent / "clip" / "frame.0005.png"
    window.open_path(str(sidecar), str(sidecar.parent / "clip"))
    settle(window)
    broken.write_bytes(b"no picture")
    assert window.session.player is not None
    window.session.player._frames.clear()
    window.session.go(5)
    qtbot.waitUntil(lambda: "0005" in window.viewer.problem, timeout=20_000)
    window.viewer.repaint()
    window.session.go(7)
    settle(window)
    assert not window.viewer.problem


@pytest.mark.parametrize("text", ["", "{", '{"schema": "palette4d.sidecar", "version": 99}'])
def test_a_broken_sidecar_is_a_message(window: Window, tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.p4d.json"
    path.write_text(text)
    window.open_path(str(path))
    assert window.session.status.level == "error"
    assert window.isVisible()


def test_a_sidecar_that_cannot_be_written_is_kept_elsewhere(
    opened: Window, sidecar: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from palette4d.common.errors import WriteError
    from palette4d.grade import sidecar as sidecars
    from palette4d.studio.session import recovery_file

    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    write = sidecars.write

    def full(path: Path, *words: Any, **more: Any) -> None:
        if path == sidecar:
            raise WriteError(f"{path}: cannot be written: no space left on the device")
        write(path, *words, **more)

    monkeypatch.setattr(sidecars, "write", full)
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(1.0, 0.0, 0.0)))
    assert not opened.session.save()
    assert "no space" in opened.session.status.text
    assert not opened.session.saved
    assert palette4d.load(recovery_file(sidecar)).colour(id_) == (1.0, 0.0, 0.0)
    monkeypatch.setattr(sidecars, "write", write)
    assert opened.session.save()
    assert palette4d.load(sidecar).colour(id_) == (1.0, 0.0, 0.0)
    assert not recovery_file(sidecar).exists()


@pytest.mark.slow
def test_fifty_thousand_frames(
    window: Window, analysed: Path, settle: Settle, repo_root: Path, tmp_path: Path
) -> None:
    golden = repo_root / "tests" / "golden" / "sidecars" / "v1_split.p4d.json"  # frames 0 to 20
    fields = json.loads(golden.read_text())
    for part in (fields["polytope"]["vertices"], fields["polytope"]["blocks"]):
        for entry in part:
            entry.update({k: 2500 * entry[k] for k in ("frame", "first", "last") if k in entry})
    last = fields["clip"]["frames"]["last"] = 50_000
    (tmp_path / "many").mkdir()
    image = next((analysed / "clip").glob("*.png"))
    for frame in range(last + 1):
        (tmp_path / "many" / f"f.{frame:05d}.png").symlink_to(image)
    fields["clip"]["source"] = str(tmp_path / "many" / "f.#####.png")
    sidecar = tmp_path / "many.p4d.json"
    sidecar.write_text(json.dumps(fields))
    window.open_path(str(sidecar))
    window.session.go(last)
    settle(window)
    id_ = busiest(window)
    for _ in range(30):
        window.timeline.zoom_in()
    window.session.edit(lambda document: document.set(id_, rgb=(0.9, 0.3, 0.1)))
    settle(window)
    start, end = window.timeline.places.span
    assert (round(end), round(end - start)) == (last, 4)
    assert window.session.save()


def test_panels_follow_the_picture_of_a_drag(opened: Window, settle: Settle, qtbot: Any) -> None:
    id_ = busiest(opened)
    opened.session.select(id_)
    for red in (0.2, 0.4, 0.6):
        opened.session.drag(lambda document, red=red: document.set(id_, rgb=(red, 0.1, 0.2)))
        assert opened.inspector.boxes["R"].value() != red  # later, when the picture is shown
    qtbot.waitUntil(lambda: opened.turns.settled, timeout=10_000)
    assert opened.inspector.boxes["R"].value() == pytest.approx(0.6)
    assert opened.timeline.places.revision == opened.session.revision
    picture = opened.viewer.picture
    assert picture is not None
    assert picture.request.revision == opened.session.revision
    opened.session.cancel()
    assert opened.inspector.boxes["R"].value() != pytest.approx(0.6)


def test_a_palette_of_one_colour_and_a_clip_of_another_size(
    window: Window, tmp_path: Path, settle: Settle
) -> None:
    clip = tmp_path / "grey"
    clip.mkdir()
    for number in range(1, 4):
        buffer = oiio.ImageBuf(oiio.ImageSpec(64, 36, 3, oiio.UINT8))
        oiio.ImageBufAlgo.fill(buffer, (0.5, 0.5, 0.5))
        buffer.write(str(clip / f"g.{number:04d}.png"))
    out = tmp_path / "grey.p4d.json"
    assert main(["analyze", str(clip), "-o", str(out), "--quiet"]) == 0
    window.open_path(str(out))
    settle(window)
    window.commands.outside()
    settle(window)
    other = tmp_path / "other"
    assert main(["sample-clip", "-o", str(other / "f.####.png"), "--frames", "3", "--quiet"]) == 0
    window.session.find_clip(str(other))
    settle(window)
    assert "320x180" in window.session.status.text


def test_a_manifest_opens_as_a_list_of_shots(
    window: Window, sidecar: Path, settle: Settle, qtbot: Any
) -> None:
    folder = sidecar.parent
    clip = str(folder / "clip" / "frame.####.png")
    edit = folder / "edit.otio"
    _write_edit(edit, clip)
    assert main(["analyze", str(edit), "-o", str(folder / "shots"), "--quiet"]) == 0
    found = next((folder / "shots").glob(f"*{manifest.ENDING}"))
    window.open_path(str(found))
    assert window.shots.count() == 2
    settle(window)
    first = window.session.path
    QTest.keyClick(window, Qt.Key.Key_PageDown)
    assert window.session.path != first
    QTest.keyClick(window, Qt.Key.Key_PageUp)
    assert window.session.path == first


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
        source = otio.opentime.TimeRange(time(6 * number, 24), time(6, 24))
        shot = otio.schema.Clip(
            name=f"shot{number}", media_reference=reference, source_range=source
        )
        track.append(shot)
    timeline = otio.schema.Timeline(name="edit")
    timeline.tracks.append(track)
    otio.adapters.write_to_file(timeline, str(path))


def test_a_job_does_what_the_command_does_and_reports(tmp_path: Path, analysed: Path) -> None:
    out = tmp_path / "by_job.p4d.json"
    words = ["analyze", str(analysed / "clip"), "-o", str(out)]
    heard: list[float | None] = []
    job = Job(words, lambda job: heard.append(job.fraction))
    assert job.wait(120) == 0
    assert job.command == " ".join(["palette4d", *words])
    assert any(fraction is not None for fraction in heard)
    assert palette4d.load(out).frames == (1, 12, 1)


def test_a_stopped_job_leaves_nothing(tmp_path: Path, analysed: Path) -> None:
    out = tmp_path / "stopped.p4d.json"
    job = Job(["analyze", str(analysed / "clip"), "-o", str(out)], lambda job: None)
    job.stop()
    assert job.wait(30) != 0
    assert not out.exists()


def test_a_clip_without_a_palette_is_offered_to_be_analysed(
    window: Window, analysed: Path, tmp_path: Path, qtbot: Any
) -> None:
    shutil.copytree(analysed / "clip", tmp_path / "new")
    window.open_path(str(tmp_path / "new" / "frame.####.png"))
    assert window.session.document is None
    (dialog,) = window.tasks.dialogs
    assert dialog.command.text().startswith("palette4d analyze ")
    dialog.start()
    qtbot.waitUntil(lambda: window.session.document is not None, timeout=120_000)
    assert (tmp_path / "new" / "frame.p4d.json").is_file()


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
    offered = window.tasks.dialogs[-1]
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


def drop(window: Window, path: str) -> None:
    """Drop a file on the window."""
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(path)])
    copy, left, none = (
        Qt.DropAction.CopyAction,
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
    )
    window.dropEvent(QDropEvent(QPointF(50, 50), copy, data, left, none))


@pytest.mark.parametrize("name", ["hex", "L"])
def test_a_field_gives_the_keyboard_back(opened: Window, name: str) -> None:
    session, panel = opened.session, opened.inspector
    assert session.document is not None
    id_ = busiest(opened)
    session.select(id_)
    before = session.document.colour(id_)
    field = panel.hex if name == "hex" else panel.boxes[name]
    text = "#3366ff" if name == "hex" else "0.4"

    def press(key: Qt.Key, modifier: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
        QTest.keyClick(opened.windowHandle(), key, modifier)

    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, text)
    QTest.keyClick(field, Qt.Key.Key_Return)
    after = session.document.colour(id_)
    assert after != before
    assert not field.hasFocus()
    control, shift = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
    press(Qt.Key.Key_Z, control)
    assert session.document.colour(id_) == before
    # So it is in a field that has the keyboard, but no text that waits for Enter.
    field.setFocus()
    press(Qt.Key.Key_Z, control | shift)
    assert session.document.colour(id_) == after
    QTest.keyClick(field, Qt.Key.Key_Return)
    press(Qt.Key.Key_Space)
    assert session.playing
    press(Qt.Key.Key_Space)
    assert not session.playing


def test_every_action_has_a_method_and_no_key_twice(window: Window) -> None:
    keys = [key for action in actions.ACTIONS for key in action.keys]
    assert len(keys) == len(set(keys))
    for action in actions.ACTIONS:
        assert callable(window.action(action.name))


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
