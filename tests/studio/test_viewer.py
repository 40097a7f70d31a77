"""The picture: before and after, probe, matte and zoom, driven by mouse and keyboard."""

from __future__ import annotations

import dataclasses
import shutil
import threading
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from windows import FRAME, Settle, busiest, seen

from palette4d.cli.main import main
from palette4d.studio import player
from palette4d.studio.pixels import probe_at
from palette4d.studio.viewer import REST
from palette4d.studio.window import Window


def result_of(window: Window) -> NDArray[np.float32]:
    """Return the code values that the exact picture was painted from."""
    picture = window.viewer.picture
    assert picture is not None
    assert picture.exact
    request = picture.request
    assert request.region.whole
    assert request.grade is not None
    result = window.viewer.preview.exact(request.pixels, request.grade, request.premultiplied)
    painter = request.display.painter(request.look)
    assert np.array_equal(picture.after, painter.paint(result[..., :3]))
    return result


def pixels_of(window: Window) -> NDArray[np.float64]:
    """Return the picture after, as it is drawn, 0..255."""
    assert window.viewer.picture is not None
    assert window.viewer.picture.after is not None
    return window.viewer.picture.after[..., :3].astype(np.float64)


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
    result = result_of(opened)
    assert np.array_equal(result, rendered[..., : result.shape[2]])
    assert opened.viewer.picture is not None
    assert not np.array_equal(result, opened.viewer.picture.request.pixels)


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
    session.select()
    settle(opened)
    session.save()
    clip, out = str(tmp_path / "clip"), str(tmp_path / "picked.####.tif")
    words = ["render", str(sidecar), clip, "-o", out, "--bits", "32", "--frames", str(FRAME)]
    assert main([*words, "--quiet"]) == 0
    rendered = oiio.ImageBuf(str(tmp_path / "picked.0006.tif")).get_pixels(oiio.FLOAT)
    result = result_of(opened)
    assert np.array_equal(result, rendered[..., : result.shape[2]])
    y, x = place.y, place.x
    # The clean-up averages around each pixel: much of such a small picture.
    assert np.abs(result[y, x] - (0.9, 0.1, 0.5)).max() < 0.15
    for x, y in ((0, 0), (159, 89), (60, 60), (101, 33), (7, 88)):  # the probe has these bits too
        probe = probe_at(session, x, y)
        assert probe is not None
        assert probe.result == tuple(result[y, x].tolist())


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
        lambda: (
            session.document is not None
            and len(session.document.grade.picks) == 1
            and not session.following
        ),
        timeout=30_000,
    )
    assert session.save()
    words = ["edit", str(twin), "hold", "--frame", str(FRAME), "--pixel", f"{place.x},{place.y}"]
    assert main(words) == 0
    assert sidecar.read_bytes() == twin.read_bytes()


def test_a_late_picture_of_an_older_drag_is_not_shown(
    opened: Window, settle: Settle, qtbot: Any
) -> None:
    session, viewer, id_ = opened.session, opened.viewer, busiest(opened)
    waiting: list[Any] = []
    posts, session.post = session.post, waiting.append

    def pictures() -> list[Any]:
        return [call for call in waiting if "_arrived" in str(call.__code__.co_names)]

    for number, value in enumerate((0.2, 0.8), 1):
        session.drag(lambda document, v=value: document.set(id_, rgb=(v, v, v)))
        qtbot.waitUntil(lambda number=number: len(pictures()) == number, timeout=20_000)
    session.post = posts
    for call in reversed(waiting):
        call()
    assert viewer.current
    session.cancel()
    settle(opened)


def test_a_click_before_its_frame_is_read_is_done_when_it_is(
    window: Window, sidecar: Path, qtbot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on, read = threading.Event(), player.Player.read
    monkeypatch.setattr(
        player.Player, "read", lambda self, number: read(self, number) if go_on.wait(20) else None
    )
    window.open_path(str(sidecar))
    session, viewer = window.session, window.viewer
    QTest.mouseClick(viewer, Qt.MouseButton.LeftButton, pos=viewer.rect().center())
    assert session.place is None
    go_on.set()
    qtbot.waitUntil(lambda: session.place is not None, timeout=20_000)
    # Another frame has another picture: there the click is not done.
    session.select()
    frame = session.frame
    assert session.player is not None
    session.player.close()
    session.player._frames.clear()
    QTest.mouseClick(viewer, Qt.MouseButton.LeftButton, pos=viewer.rect().center())
    session.go(frame - 1)
    session.emit("pixels")
    assert session.place is None


def test_a_picture_of_another_frame_says_so_after_a_while(
    opened: Window, settle: Settle, qtbot: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    viewer, session = opened.viewer, opened.session
    assert session.player is not None
    read, go_on = session.player.clip.load, threading.Event()

    def waits(number: int) -> Any:
        go_on.wait(20)
        return read(number)

    monkeypatch.setattr(session.player.clip, "load", waits)
    session.player._frames.clear()
    before = seen(opened)
    session.go(11)
    assert not viewer.late
    qtbot.waitUntil(lambda: viewer.late)
    assert viewer.shown_frame == 6
    assert (seen(opened) != before).any()
    go_on.set()
    settle(opened)
    assert not viewer.late


def test_the_picture_of_a_drag_is_near_the_exact_one(
    opened: Window, settle: Settle, monkeypatch: pytest.MonkeyPatch
) -> None:
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(0.9, 0.3, 0.1)))
    settle(opened)
    exact = opened.viewer.picture
    assert exact is not None
    monkeypatch.setattr(player, "MOST_MOVING", 160 * 90 // 3)
    moving = dataclasses.replace(exact.request, settled=False)
    coarse = opened.viewer.preview.make(moving, exact=False).after
    assert exact.after is not None
    assert coarse is not None
    assert coarse.shape == (45, 80, 4)
    mean = exact.after.reshape(45, 2, 80, 2, 4).mean(axis=(1, 3))
    assert np.abs(coarse - mean).mean() < 1.5
    # Back from another frame, the exact picture that was made is there at once.
    opened.session.go(FRAME + 1)
    settle(opened)
    opened.session.go(FRAME)
    settle(opened)
    assert opened.viewer.picture is not None
    assert opened.viewer.picture.after is exact.after


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


def test_the_key_may_come_up_over_a_menu(opened: Window) -> None:
    QTest.keyPress(opened, Qt.Key.Key_C)
    assert opened.viewer.comparing
    menu = opened.menus["file"]
    QTest.keyRelease(menu, Qt.Key.Key_C)
    assert not opened.viewer.comparing


def test_the_probe_says_what_the_frame_has(opened: Window, settle: Settle) -> None:
    id_ = busiest(opened)
    opened.session.edit(lambda document: document.set(id_, rgb=(0.9, 0.3, 0.1)))
    settle(opened)
    QTest.mouseMove(opened.viewer, opened.viewer.point_of(100.5, 40.5).toPoint())
    probe = opened.session.probe
    picture = opened.viewer.picture
    assert probe is not None
    assert picture is not None
    x, y = probe.x, probe.y
    assert abs(x - 100) <= 1
    assert abs(y - 40) <= 1
    assert probe.source == tuple(float(v) for v in picture.request.pixels[y, x])
    assert probe.result == tuple(float(v) for v in result_of(opened)[y, x])
    assert sum(probe.weights.values()) == pytest.approx(1, abs=1e-6)


def test_a_frame_that_fills_the_memory_can_be_picked(
    opened: Window, settle: Settle, qtbot: Any
) -> None:
    player = opened.session.player
    assert player is not None
    player._frames.limit = 1
    opened.session.go(FRAME + 1)
    settle(opened)
    qtbot.wait(3 * REST)  # the frames around it would be read meanwhile
    QTest.mouseClick(opened.viewer, Qt.MouseButton.LeftButton, pos=opened.viewer.rect().center())
    assert opened.session.place is not None


def test_hovering_over_a_handle_shows_its_matte(opened: Window, settle: Settle) -> None:
    plain = seen(opened)
    opened.session.hover_over(busiest(opened))
    settle(opened)
    opened.viewer.repaint()
    matte = seen(opened)
    assert not np.array_equal(matte, plain)
    opened.session.hover_over(None)
    settle(opened)


def test_pointing_at_a_pick_shows_what_it_takes(opened: Window, settle: Settle) -> None:
    session = opened.session
    session.edit(
        lambda document: document.pick(
            FRAME, pixel=(60, 60), to=(0.9, 0.1, 0.5), follow=False, clip=session.clip.source
        )
    )
    settle(opened)
    plain = pixels_of(opened)
    session.hover_over("p1")
    settle(opened)
    assert opened.viewer.picture is not None
    assert opened.viewer.picture.matte
    matte = pixels_of(opened)
    assert np.abs(matte[60, 60] - plain[60, 60]).max() < 30
    rest = np.abs(matte - plain).max(axis=2) > 30
    assert rest.mean() > 0.2
    dark = matte[rest]
    assert (np.ptp(dark, axis=1) < 200).mean() > 0.99  # but for the edges of what it takes
    assert dark.mean() < 0.6 * plain[rest].mean()
    session.hover_over(None)
    settle(opened)
    assert np.array_equal(pixels_of(opened), plain)
    session.select("p1")
    QTest.keyClick(opened, Qt.Key.Key_M)
    settle(opened)
    assert np.array_equal(pixels_of(opened), matte)
    session.edit(lambda document: document.change_pick("p1", to=(0.02, 0.02, 0.03)))
    settle(opened)
    assert pixels_of(opened)[60, 60].min() > dark.mean() + 25  # also a dark colour is seen
    session.edit(lambda document: document.change_pick("p1", enabled=False))
    settle(opened)
    assert not opened.viewer.picture.matte


def test_a_click_shows_what_a_pick_would_take_until_its_colour_is_dragged(
    opened: Window, settle: Settle, qtbot: Any
) -> None:
    session, at = opened.session, opened.viewer.point_of(60.5, 60.5).toPoint()
    plain = pixels_of(opened)
    QTest.mouseClick(opened.viewer, Qt.MouseButton.LeftButton, pos=at)
    qtbot.waitUntil(lambda: session.draft is not None, timeout=20_000)
    settle(opened)
    taken = pixels_of(opened)
    assert not np.array_equal(taken, plain)
    opened.inspector.wheel.moved.emit((0.2, 30.0))
    qtbot.waitUntil(lambda: opened.viewer.picture.request.matte is None, timeout=20_000)
    session.cancel()
    settle(opened)
    assert np.array_equal(pixels_of(opened), taken)
    session.select()
    settle(opened)
    assert np.array_equal(pixels_of(opened), plain)


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


def test_a_frame_that_does_not_decode_is_a_message(
    window: Window, sidecar: Path, analysed: Path, qtbot: Any, settle: Settle
) -> None:
    shutil.rmtree(sidecar.parent / "clip")
    shutil.copytree(analysed / "clip", sidecar.parent / "clip")
    broken = sidecar.parent / "clip" / "frame.0005.png"
    window.open_path(str(sidecar), str(sidecar.parent / "clip"))
    settle(window)
    broken.write_bytes(b"no picture")
    assert window.session.player is not None
    window.session.player._frames.clear()
    window.session.go(5)
    qtbot.waitUntil(lambda: "0005" in window.viewer.problem, timeout=20_000)
    assert "read by itself" in window.viewer.problem
    window.viewer.repaint()
    window.session.go(7)
    settle(window)
    assert not window.viewer.problem


@pytest.mark.parametrize("x", [8, 80, 150])
def test_the_probe_covers_no_plate(opened: Window, settle: Settle, x: int) -> None:
    opened.resize(800, 500)
    opened.session.edit(
        lambda document: document.pick(6, pixel=(120, 70), to="#2040b0", follow=False)
    )
    settle(opened)
    at = opened.viewer.point_of(x + 0.5, 45.5).toPoint()
    QTest.mouseMove(opened.viewer, at)
    QTest.mouseClick(opened.viewer, Qt.MouseButton.LeftButton, pos=at)
    settle(opened)
    opened.viewer.grab()
    painter = opened.viewer.painter
    assert len(painter.plates) >= 2
    assert painter.probe.height() > 0
    for plate in painter.plates:
        assert not plate.intersects(painter.probe)
