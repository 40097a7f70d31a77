"""The window of a pick over the picture: seen, moved, sized, taken back, and never in the way."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from windows import FRAME, Settle, pixels_of, seen, send

import palette4d
from palette4d.cli.main import main
from palette4d.grade.picks import Pick
from palette4d.studio import grade_steps
from palette4d.studio.pixels import REACH, probe_at
from palette4d.studio.session import Session
from palette4d.studio.window import Window

LEFT = Qt.MouseButton.LeftButton
SHAPE = Qt.CursorShape
LATER = 1e9
#: The window that tests begin with.
BOX = (30.0, 20.0, 70.0, 60.0)
FEATHER = 12.0


@pytest.fixture
def boxed(opened: Window, settle: Settle, qtbot: Any) -> Iterator[Window]:
    """A window with a pick that is selected, and has a window of its own."""
    session = opened.session
    assert session.clip is not None
    clip = session.clip.source
    session.edit(
        lambda document: document.pick(FRAME, pixel=(40, 30), to=(0.9, 0.1, 0.5), clip=clip)
    )
    session.edit(lambda document: document.set_window("p1", FRAME, BOX, feather=FEATHER, clip=clip))
    session.select("p1")
    assert box_of(opened) == BOX
    settle(opened)
    yield opened
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)


def picked(window: Window) -> Pick:
    document = window.session.document
    assert document is not None
    return document.grade.pick("p1")


def box_of(window: Window) -> tuple[float, ...]:
    """The box at the playhead."""
    own = picked(window).window
    assert own is not None
    return tuple(own.box_at(window.session.frame).tolist())


def feather_of(window: Window) -> float:
    own = picked(window).window
    assert own is not None
    return own.feather


def given(window: Window) -> list[float]:
    """The frames at which the user gave the box."""
    own = picked(window).window
    assert own is not None
    return [key.frame for key in own.keys if key.given]


def steps(window: Window) -> int:
    document = window.session.document
    assert document is not None
    return len(document.history.done)


def at(window: Window, x: float, y: float) -> QPoint:
    """Where a point of the frame is drawn."""
    return window.viewer.point_of(x, y).toPoint()


def begin(window: Window, start: QPoint, end: QPoint) -> None:
    """Press, and move the pointer there on the way."""
    QTest.mousePress(window.viewer, LEFT, pos=start)
    for share in (0.5, 1.0):
        send(window.viewer, QPointF(start) + QPointF(end - start) * share)


def drag(window: Window, start: QPoint, end: QPoint) -> None:
    begin(window, start, end)
    QTest.mouseRelease(window.viewer, LEFT, pos=end)


def shape_over(window: Window, point: QPoint) -> Qt.CursorShape:
    QTest.mouseMove(window.viewer, point)
    return window.viewer.cursor().shape()


def test_the_middle_moves_it_as_one_step_that_can_be_undone(
    boxed: Window, settle: Settle, sidecar: Path
) -> None:
    session, viewer, before = boxed.session, boxed.viewer, steps(boxed)
    scale = viewer.scale()
    begin(boxed, at(boxed, 50, 40), at(boxed, 60, 35))
    assert session.dragging
    assert box_of(boxed) == pytest.approx((40, 15, 80, 55), abs=1 / scale + 0.5)
    QTest.mouseRelease(viewer, LEFT, pos=at(boxed, 60, 35))
    moved = box_of(boxed)
    assert not session.dragging
    assert moved == pytest.approx((40, 15, 80, 55), abs=1 / scale + 0.5)
    assert steps(boxed) == before + 1
    assert session.document is not None
    assert "p1: window" in session.document.history.done[-1].label
    session.undo()
    assert box_of(boxed) == BOX
    session.redo()
    assert box_of(boxed) == moved
    assert session.selection == ("p1",)
    session.tick(LATER)
    (found,) = palette4d.load(sidecar).grade.picks
    assert found.window is not None
    assert tuple(found.window.box_at(FRAME)) == moved


#: Where a drag begins and ends, the box then, and the pointer's shape over the beginning.
DRAGS = (
    ((30, 40), (10, 48), (10, 20, 70, 60), SHAPE.SizeHorCursor),
    ((70, 30), (90, 30), (30, 20, 90, 60), SHAPE.SizeHorCursor),
    ((50, 20), (50, 5), (30, 5, 70, 60), SHAPE.SizeVerCursor),
    ((50, 60), (50, 80), (30, 20, 70, 80), SHAPE.SizeVerCursor),
    ((30, 20), (20, 10), (20, 10, 70, 60), SHAPE.SizeFDiagCursor),
    ((70, 60), (80, 75), (30, 20, 80, 75), SHAPE.SizeFDiagCursor),
    ((70, 20), (80, 10), (30, 10, 80, 60), SHAPE.SizeBDiagCursor),
    ((30, 60), (35, 50), (35, 20, 70, 50), SHAPE.SizeBDiagCursor),
    ((30, 40), (95, 40), (69, 20, 70, 60), SHAPE.SizeHorCursor),  # not past the other side
    ((50, 40), (-10, 40), (-30, 20, 10, 60), SHAPE.SizeAllCursor),  # beyond the picture
)


@pytest.mark.parametrize("view", ["fitted", "zoomed", "side"])
def test_edges_and_corners_size_it(boxed: Window, settle: Settle, view: str) -> None:
    session = boxed.session
    if view == "zoomed":
        boxed.viewer.zoom_to(8.0, at(boxed, 50, 40).toPointF())
    elif view == "side":
        session.look(compare="side")
    settle(boxed)
    for start, end, wanted, shape in DRAGS:
        assert shape_over(boxed, at(boxed, *start)) == shape
        drag(boxed, at(boxed, *start), at(boxed, *end))
        assert box_of(boxed) == pytest.approx(wanted, abs=1)
        session.undo()
        assert box_of(boxed) == BOX


def test_a_drag_is_seen_at_once_and_esc_takes_it_back(
    boxed: Window, settle: Settle, qtbot: Any
) -> None:
    session, viewer, before = boxed.session, boxed.viewer, steps(boxed)
    start, end = at(boxed, 50, 40), at(boxed, 80, 40)
    still = seen(boxed)
    begin(boxed, start, end)
    qtbot.waitUntil(lambda: viewer.current, timeout=20_000)
    assert (seen(boxed) != still).any()
    assert viewer.picture is not None
    assert not viewer.picture.request.settled
    QTest.keyClick(boxed, Qt.Key.Key_Escape)
    assert box_of(boxed) == BOX
    send(viewer, QPointF(end + QPoint(30, 0)))
    assert box_of(boxed) == BOX
    QTest.mouseRelease(viewer, LEFT, pos=end)
    assert box_of(boxed) == BOX
    assert steps(boxed) == before
    assert session.selection == ("p1",)
    assert session.place is None
    drag(boxed, start, end)  # the next one is a drag again
    assert steps(boxed) == before + 1


def test_a_drag_leaves_the_bytes_of_the_edit(boxed: Window, sidecar: Path, qtbot: Any) -> None:
    session = boxed.session
    session.save()
    twin = palette4d.load(shutil.copy(sidecar, sidecar.with_name("twin.p4d.json")))
    drag(boxed, at(boxed, 50, 40), at(boxed, 60, 35))
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    session.save()
    assert session.clip is not None
    twin.set_window("p1", FRAME, box_of(boxed), clip=session.clip.source)
    twin.save()
    assert twin.path is not None
    assert sidecar.read_bytes() == twin.path.read_bytes()


def test_at_another_frame_a_drag_gives_a_key_there(boxed: Window, settle: Settle) -> None:
    session = boxed.session
    assert given(boxed) == [FRAME]
    session.go(9)
    settle(boxed)
    left, top, right, bottom = box_of(boxed)
    drag(boxed, at(boxed, (left + right) / 2, (top + bottom) / 2), at(boxed, 90, 50))
    assert given(boxed) == [FRAME, 9]
    assert not np.array_equal(lane_at(boxed, 9), lane_at(boxed, 8))  # it is on the pick's bar
    assert np.array_equal(lane_at(boxed, 8), lane_at(boxed, 4))
    moved = box_of(boxed)
    assert ((moved[0] + moved[2]) / 2, (moved[1] + moved[3]) / 2) == pytest.approx((90, 50), abs=1)
    session.go(FRAME)
    assert box_of(boxed) == BOX
    session.undo()
    assert given(boxed) == [FRAME]


def lane_at(window: Window, frame: float) -> Any:
    """What the timeline draws of the pick's bar at a frame, without the playhead."""
    window.session.go(1)
    timeline = window.timeline
    y, x = round(timeline.places.lane_y(0)), round(timeline.places.x_of(frame))
    rows = pixels_of(timeline)[y - 4 : y + 5, x - 4 : x + 5]
    window.session.go(9)
    return rows


def test_the_dashed_line_is_dragged_for_the_feather(boxed: Window) -> None:
    before = steps(boxed)
    assert shape_over(boxed, at(boxed, 70 + FEATHER, 40)) == SHAPE.SizeHorCursor
    assert shape_over(boxed, at(boxed, 50, 60 + FEATHER)) == SHAPE.SizeVerCursor
    drag(boxed, at(boxed, 70 + FEATHER, 40), at(boxed, 70 + FEATHER + 10, 40))
    assert feather_of(boxed) == pytest.approx(FEATHER + 10, abs=1)
    assert box_of(boxed) == BOX
    assert steps(boxed) == before + 1
    drag(boxed, at(boxed, 50, 60 + FEATHER + 10), at(boxed, 50, 45))  # no less than none
    assert feather_of(boxed) == 0


def test_what_is_no_drag_of_a_handle_picks(boxed: Window) -> None:
    session, viewer, before = boxed.session, boxed.viewer, steps(boxed)
    for point in ((30, 40), (50, 40), (70, 60), (70 + FEATHER, 40), (40, 50)):
        session.select("p1")
        QTest.mouseClick(viewer, LEFT, pos=at(boxed, *point))
        assert session.place is not None
        assert (session.place.x, session.place.y) == pytest.approx(point, abs=1)
    session.select("p1")
    assert shape_over(boxed, at(boxed, 40, 50)) == SHAPE.CrossCursor
    drag(boxed, at(boxed, 40, 50), at(boxed, 48, 56))  # inside: a box's main colour
    assert session.place is not None
    assert session.place.box > 1
    assert steps(boxed) == before
    assert box_of(boxed) == BOX


def test_tools_and_keys_go_before_the_handles(boxed: Window, qtbot: Any) -> None:
    session, viewer = boxed.session, boxed.viewer
    session.take("add")
    drag(boxed, at(boxed, 30, 40), at(boxed, 36, 40))
    assert box_of(boxed) == BOX
    assert len(picked(boxed).areas) == 1
    session.take("")
    QTest.mouseClick(viewer, LEFT, Qt.KeyboardModifier.AltModifier, at(boxed, 30, 40))
    assert session.document is not None
    assert [pick.kind for pick in session.document.grade.picks] == ["pick", "hold"]
    session.select("p2")  # a hold has no window
    QTest.mouseMove(viewer, at(boxed, 50, 40))
    assert viewer.cursor().shape() == SHAPE.CrossCursor


def test_it_is_drawn_while_its_pick_is_selected(boxed: Window, settle: Settle) -> None:
    with_window = seen(boxed).astype(int)
    boxed.session.select()
    settle(boxed)
    change = np.abs(seen(boxed).astype(int) - with_window).max(axis=2) > 20
    for x, y in ((30, 52), (70, 52), (58, 20), (58, 60), (70 + FEATHER, 45), (50, 40)):
        point = at(boxed, x, y)
        part = change[point.y() - 4 : point.y() + 5, point.x() - 4 : point.x() + 5]
        assert part.any(), (x, y)
    inside = at(boxed, 60, 30)
    assert not change[inside.y() - 4 : inside.y() + 5, inside.x() - 4 : inside.x() + 5].any()
    # Bright and dark, so that it is seen over any picture.
    edge = at(boxed, 70, 52)
    row = with_window[edge.y(), edge.x() - 4 : edge.x() + 5]
    assert row.max() > 220
    assert row.max(axis=1).min() < 110


@pytest.mark.parametrize("zoom", [None, 16.0])
def test_the_picture_and_the_probe_change_inside_alone(
    boxed: Window, settle: Settle, zoom: float | None
) -> None:
    boxed.session.edit(lambda document: document.change_pick("p1", whole_hue=True, reach=8.0))
    if zoom is not None:
        boxed.viewer.zoom_to(zoom, at(boxed, 65, 55).toPointF())
    settle(boxed)
    change = drawn(boxed, ((65, 55), (31, 21), (74, 40), (50, 66), (90, 40), (10, 80)))
    assert change[25:55, 35:65].max() > 0.1
    assert change[:, 70 + int(FEATHER) + REACH :].max() == 0  # beyond what the clean-up spreads


def test_it_is_where_it_is_in_a_proxy_of_the_clip(
    boxed: Window, settle: Settle, tmp_path: Path
) -> None:
    session, viewer = boxed.session, boxed.viewer
    proxy = str(tmp_path / "proxy" / "frame.####.png")
    assert main(["sample-clip", "-o", proxy, "--size", "320x180", "--frames", "12", "--quiet"]) == 0
    session.edit(lambda document: document.change_pick("p1", whole_hue=True, reach=8.0))
    session.find_clip(proxy)
    settle(boxed)
    rects = viewer.handles.rects()
    assert rects is not None
    assert rects[0].topLeft() == viewer.point_of(60, 40)
    assert rects[1].bottomRight() == viewer.point_of(140 + 2 * FEATHER, 120 + 2 * FEATHER)
    viewer.zoom_to(8.0, at(boxed, 130, 110).toPointF())
    settle(boxed)
    change = drawn(boxed, ((130, 110), (61, 41), (148, 80), (250, 80)))
    assert change[45:115, 65:135].max() > 0.1
    viewer.fit()
    drag(boxed, at(boxed, 100, 80), at(boxed, 120, 80))  # pixels of the proxy
    assert box_of(boxed) == pytest.approx((40, 20, 80, 60), abs=1)


def drawn(window: Window, points: tuple[tuple[int, int], ...]) -> NDArray[np.float32]:
    """What changes in the whole frame, (h, w); the probe and pictures of a drag have it too."""
    session, viewer = window.session, window.viewer
    assert session.player is not None
    assert session.document is not None
    pixels = session.player.frame(FRAME)
    assert pixels is not None
    result = session.document.recolour(pixels, FRAME)
    assert viewer.picture is not None
    request, after = viewer.picture.request, viewer.picture.after
    painted = request.display.painter(request.look).paint(result).astype(int)
    left, top, right, bottom = request.region.part
    assert request.region.whole
    assert after is not None
    assert np.array_equal(after, painted[top:bottom, left:right])
    for x, y in points:
        probe = probe_at(session, x, y)
        assert probe is not None
        np.testing.assert_allclose(probe.result, result[y, x], atol=1e-6)
    exact, moving = viewer.picture, dataclasses.replace(viewer.picture.request, settled=False)
    assert exact.exact
    moving = dataclasses.replace(moving, pixels=pixels)
    coarse = viewer.preview.make(moving, exact=False).after
    assert coarse is not None
    assert exact.after is not None
    assert coarse.shape == exact.after.shape
    assert np.abs(coarse.astype(int) - exact.after).mean() < 3  # elsewhere: 19
    change: NDArray[np.float32] = np.abs(result - pixels[..., :3]).max(axis=2)
    return change


def test_what_is_released_is_on_disk_before_it_is_followed(
    boxed: Window, sidecar: Path, qtbot: Any
) -> None:
    session = boxed.session
    session.save()
    go_on = waiting_calls(session)
    drag(boxed, at(boxed, 50, 40), at(boxed, 60, 40))
    moved = box_of(boxed)
    session.tick(LATER)
    kept = palette4d.load(sidecar)
    own = kept.grade.pick("p1").window
    assert own is not None
    assert tuple(own.box_at(FRAME)) == moved
    grade_steps.feather_window(session, "p1", 30.0)  # meanwhile
    qtbot.waitUntil(go_on, timeout=60_000)
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    assert box_of(boxed) == moved
    assert feather_of(boxed) == 30
    own = picked(boxed).window
    assert own is not None
    assert any(not key.given for key in own.keys)  # it was followed
    assert session.unfollowed == []


def test_of_releases_that_follow_each_other_the_last_one_is_followed(
    boxed: Window, sidecar: Path, qtbot: Any
) -> None:
    session = boxed.session
    for x in (60, 62, 64):
        drag(boxed, at(boxed, 50, 40), at(boxed, x, 40))
        drag(boxed, at(boxed, x, 40), at(boxed, 50, 40))
        assert session.following == 1
    drag(boxed, at(boxed, 50, 40), at(boxed, 60, 40))
    moved = box_of(boxed)
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    assert box_of(boxed) == moved
    assert session.unfollowed == []
    assert [step.unread for step in session.document.history.done[-7:]] == [True] * 6 + [False]
    # What was replaced is followed when it comes back; also from the next window.
    session.save()
    session.revert()
    assert session.unfollowed == []
    session.undo()
    assert box_of(boxed) == BOX
    assert session.following == 1
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    own = picked(boxed).window
    assert own is not None
    assert any(not key.given for key in own.keys)
    session.redo()
    assert not session.following
    assert box_of(boxed) == moved
    assert [step.unread for step in session.document.history.done[-3:]] == [True, False, False]


def test_a_window_is_followed_in_the_last_of_ranges(boxed: Window, qtbot: Any) -> None:
    session = boxed.session
    for start in (2, 3, 4):
        grade_steps.set_range(session, "p1", start, 9)
    assert session.following == 2  # the first one leaves the window to be followed
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    assert session.unfollowed == []
    own = picked(boxed).window
    assert own is not None
    assert any(not key.given for key in own.keys)
    assert picked(boxed).start == 4


def test_what_a_version_keeps_is_followed_too(boxed: Window, qtbot: Any) -> None:
    session = boxed.session
    drag(boxed, at(boxed, 50, 40), at(boxed, 60, 40))
    grade_steps.keep_version(session)
    drag(boxed, at(boxed, 60, 40), at(boxed, 66, 40))
    assert session.following == 2
    qtbot.waitUntil(lambda: not session.following, timeout=60_000)
    grade_steps.use_version(session, "A")
    own = picked(boxed).window
    assert own is not None
    assert any(not key.given for key in own.keys)


def waiting_calls(session: Session) -> Callable[[], bool]:
    """Keep what threads bring to the window; return what does it at last, once it is there."""
    waiting: list[Callable[[], object]] = []
    posts, session.post = session.post, waiting.append

    def go_on() -> bool:
        if session.following and not any("_work.<locals>" in repr(call) for call in waiting):
            return False
        session.post = posts
        for call in waiting:
            call()
        return True

    return go_on
