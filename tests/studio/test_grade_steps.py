"""Every gesture that edits leaves the bytes of its verb of `palette4d edit`."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMenu, QWidget

from palette4d.cli.main import main
from palette4d.grade.document import Document
from palette4d.grade.picks import Pick
from palette4d.studio import grade_steps, texts
from palette4d.studio.inspector import Scope
from palette4d.studio.session import Session
from palette4d.studio.states import Place
from palette4d.studio.timeline_menu import menu_for
from palette4d.studio.window import Window

LEFT = Qt.MouseButton.LeftButton
NO_KEYS = Qt.KeyboardModifier.NoModifier
ALT = Qt.KeyboardModifier.AltModifier
CONTROL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier
FRAME = 6
Row = tuple[str, Callable[[], object], Callable[[], Sequence[object]]]


def drag(
    widget: QWidget, start: QPointF, end: QPointF, keys: Qt.KeyboardModifier = NO_KEYS
) -> None:
    """Press, move and let go, as a mouse does."""
    QTest.mousePress(widget, LEFT, keys, start.toPoint())
    for share in (0.5, 1.0):
        at = start + (end - start) * share
        kind, none = QEvent.Type.MouseMove, Qt.MouseButton.NoButton
        widget.mouseMoveEvent(QMouseEvent(kind, at, at, none, LEFT, keys))
    QTest.mouseRelease(widget, LEFT, keys, end.toPoint())


class Hand:
    """A person at a window."""

    def __init__(self, window: Window) -> None:
        self.window, self.session = window, window.session

    @property
    def document(self) -> Document:
        assert self.session.document is not None
        return self.session.document

    def pick_of(self, id_: str) -> Pick:
        return next(pick for pick in self.document.grade.picks if pick.id == id_)

    def pixel(self, x: int, y: int) -> QPointF:
        return self.window.viewer.point_of(x + 0.5, y + 0.5)

    def on_wheel(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag between two points of the wheel, in radii from its middle."""
        wheel = self.window.inspector.wheel
        middle, radius = wheel._circle()
        drag(wheel, *(middle + QPointF(x, y) * radius for x, y in (start, end)))

    def type_into(self, name: str, text: str) -> None:
        box = self.window.inspector.boxes[name]
        box.lineEdit().selectAll()
        QTest.keyClicks(box, text)
        QTest.keyClick(box, Qt.Key.Key_Return)

    def place(self, id_: str) -> QPointF:
        """Where a handle's disc is in the timeline."""
        disc = self.window.timeline.places.disc(id_)
        assert disc is not None
        return QPointF(disc.x, disc.y + self.window.timeline.places.top)

    def click_disc(self, id_: str, keys: Qt.KeyboardModifier = NO_KEYS) -> None:
        QTest.mouseClick(self.window.timeline, LEFT, keys, self.place(id_).toPoint())

    def on_row(self, edge: str, frame: float) -> QPointF:
        places = self.window.timeline.places
        assert places.timeline is not None
        layout = places.timeline[0]
        x, y = layout.at(layout.palette.edge_ids.index(edge), frame)
        return QPointF(x, y + places.top)

    def end_of_range(self, id_: str, which: int) -> QPointF:
        """An end of a pick's range: 0 of the fade in, 1, 2, 3 of the fade out."""
        places = self.window.timeline.places
        pick, lane = next(each for each in places.lanes() if each[0].id == id_)
        return QPointF(places.x_of(places.reach(pick)[which]), places.lane_y(lane))

    def in_lane(self, id_: str, frame: float) -> QPointF:
        """A frame in the lane of a pick's range."""
        return QPointF(self.window.timeline.places.x_of(frame), self.end_of_range(id_, 2).y())

    def choose(self, at: QPointF, *path: str) -> None:
        """Choose an entry of the timeline's menu at a point."""
        timeline = self.window.timeline
        menu: QMenu = menu_for(timeline, timeline.places.hit(at), at.x())
        for name in path[:-1]:
            menu = next(m for m in menu.findChildren(QMenu) if m.title() == name)
        next(entry for entry in menu.actions() if entry.text() == path[-1]).trigger()

    def drag_in_solid(self, index: int, by: QPointF) -> None:
        solid = self.window.solid
        palette = solid.palette_now()
        assert palette is not None
        x, y = solid.places(palette, solid.view_of(palette))[1][index, :2].tolist()
        drag(solid, QPointF(x, y), QPointF(x, y) + by)


def rows(hand: Hand) -> Iterator[Row]:
    """Yield each gesture with the verb's words, which are asked for after the gesture."""
    window, session = hand.window, hand.session
    viewer, timeline, inspector = window.viewer, window.timeline, window.inspector
    core = hand.document.grade.core
    first, *_ = core.polytope.vertex_ids
    times = np.asarray(core.polytope.vertices)[:, 3]
    spans = {
        id_: times[list(ends)]
        for id_, ends in zip(core.polytope.edge_ids, np.asarray(core.polytope.edges), strict=True)
    }
    edge = max(spans, key=lambda id_: float(spans[id_][1] - spans[id_][0]))

    def colour(id_: str) -> list[str]:
        return ["--rgb", *map(repr, hand.document.grade.colour(id_))]

    def key(key: Qt.Key, keys: Qt.KeyboardModifier = NO_KEYS) -> Callable[[], object]:
        return lambda: QTest.keyClick(window, key, keys)

    def new_colour(id_: str) -> list[str]:
        to = hand.pick_of(id_).to
        assert to is not None
        return ["--to", *map(repr, to)]

    def click_and_turn() -> None:
        QTest.mouseClick(viewer, LEFT, NO_KEYS, hand.pixel(40, 30).toPoint())
        hand.on_wheel((0.1, 0.1), (0.4, 0.3))

    yield (
        "click a pixel, turn the wheel",
        click_and_turn,
        lambda: ["pick", "--frame", FRAME, "--pixel", "40,30", *new_colour("p1")],
    )

    def box() -> None:
        drag(viewer, hand.pixel(100, 60), hand.pixel(104, 64))
        hand.type_into("R", "0.9")

    yield (
        "drag a box, type a number",
        box,
        lambda: [
            *("pick", "--frame", FRAME, "--pixel", "102,62", "--box", 5),
            *new_colour("p2"),
        ],
    )
    yield (
        "Alt-click a pixel",
        lambda: QTest.mouseClick(viewer, LEFT, ALT, hand.pixel(10, 10).toPoint()),
        lambda: ["hold", "--frame", FRAME, "--pixel", "10,10"],
    )
    yield (
        "choose another colour for a pick",
        lambda: (session.select("p2"), hand.type_into("G", "0.1")),
        lambda: ["change", "p2", *new_colour("p2")],
    )
    yield (
        "drag the end of a range",
        lambda: drag(timeline, hand.end_of_range("p1", 2), hand.in_lane("p1", 9)),
        lambda: ["change", "p1", "--until", 9],
    )
    yield (
        "Alt-drag the end of a range",
        lambda: drag(
            timeline, hand.end_of_range("p1", 2), hand.end_of_range("p1", 2) + _right(timeline), ALT
        ),
        lambda: ["change", "p1", "--fade-out", 2],
    )
    yield (
        "drag the tip of a fade",
        lambda: drag(
            timeline, hand.end_of_range("p1", 3), hand.end_of_range("p1", 2) + _right(timeline, 1)
        ),
        lambda: ["change", "p1", "--fade-out", 1],
    )

    def menu(*path: str) -> Callable[[], object]:
        middle = hand.end_of_range("p1", 1) + _right(timeline, 3)
        return lambda: hand.choose(middle, *path)

    yield "menu: acts", menu(texts.ACTS), lambda: ["disable", "p1"]
    yield "menu: acts again", menu(texts.ACTS), lambda: ["enable", "p1"]
    yield "menu: its hue", menu(texts.WHOLE_HUE), lambda: ["change", "p1", "--whole-hue"]
    panel = inspector.panel
    yield (
        "its own colours again",
        lambda: QTest.mouseClick(panel.whole_hue, LEFT, pos=QPoint(6, 6)),
        lambda: ["change", "p1", "--no-whole-hue"],
    )
    yield (
        "type a reach",
        lambda: panel.boxes["reach"].setValue(1.5),
        lambda: ["change", "p1", "--reach", 1.5],
    )
    yield (
        "drag the softness",
        lambda: drag(panel.bars["softness"], QPointF(20, 8), QPointF(60, 8)),
        lambda: ["change", "p1", "--softness", hand.pick_of("p1").softness],
    )
    yield (
        "drag the least lightness",
        lambda: drag(panel.lightness, QPointF(6, 8), QPointF(30, 8)),
        lambda: [
            *("change", "p1", "--lightness"),
            ",".join(map(repr, hand.pick_of("p1").lightness)),
        ],
    )

    def stroke() -> list[object]:
        area = hand.pick_of("p1").areas[0]
        points = [f"{x:g},{y:g}" for x, y in area.points]
        return ["area", "p1", "--frame", FRAME, "--stroke", *points, "--width", 2 * area.radius]

    yield (
        "Shift-drag a stroke",
        lambda: drag(viewer, hand.pixel(20, 20), hand.pixel(60, 24), SHIFT),
        stroke,
    )
    yield (
        "add to it by a click",
        lambda: (
            QTest.mouseClick(panel.add, LEFT),
            QTest.mouseClick(viewer, LEFT, NO_KEYS, hand.pixel(12, 8).toPoint()),
            QTest.mouseClick(panel.add, LEFT),
        ),
        lambda: [
            *("area", "p1", "--frame", FRAME, "--pixel", "12,8"),
            *("--box", round(2 * hand.pick_of("p1").areas[1].radius)),
        ],
    )
    on, bar = panel.window_rows.on, panel.window_rows.bar

    def box_of() -> tuple[float, ...]:
        own = hand.pick_of("p1").window
        assert own is not None
        return tuple(own.box_at(window.session.frame).tolist())

    def boxed() -> list[object]:
        return ["window", "p1", "--frame", FRAME, "--box", ",".join(map(repr, box_of()))]

    def feathered() -> list[object]:
        own = hand.pick_of("p1").window
        assert own is not None
        return ["window", "p1", "--feather", own.feather]

    def move_window() -> None:
        left, top, right, bottom = box_of()
        middle = viewer.point_of((left + right) / 2, (top + bottom) / 2)
        drag(viewer, middle, middle + QPointF(40, 60))

    yield "a window", lambda: QTest.mouseClick(on, LEFT, pos=QPoint(6, 6)), boxed
    yield "drag the window", move_window, boxed
    yield (
        "another box",
        lambda: (window.session.go(FRAME + 3), move_window()),
        lambda: [*("window", "p1", "--frame", FRAME + 3, "--box", ",".join(map(repr, box_of())))],
    )
    yield (
        "no box there",
        lambda: (window.inspector.panel.window_rows.remove.click(), window.session.go(FRAME)),
        lambda: ["window", "p1", "--frame", FRAME + 3, "--none"],
    )
    yield "the feather", lambda: drag(bar, QPointF(20, 8), QPointF(60, 8)), feathered
    yield (
        "no window",
        lambda: QTest.mouseClick(on, LEFT, pos=QPoint(6, 6)),
        lambda: ["window", "p1", "--none"],
    )
    yield (
        "menu: the same colour",
        menu(texts.SAME_COLOUR),
        lambda: ["change", "p1", "--toward", "colour"],
    )
    yield (
        "menu: fades",
        menu(texts.FADE, texts.FADE_OF.format(frames="5")),
        lambda: ["change", "p1", "--fade", 5, "--fade-out", 5],
    )
    yield "menu: remove", menu(texts.REMOVE), lambda: ["unpick", "p1"]
    yield (
        "the list: off",
        lambda: window.inspector.picks.list.topLevelItem(0).setCheckState(
            0, Qt.CheckState.Unchecked
        ),
        lambda: ["disable", "p2"],
    )
    yield (
        "the list: a hold off",
        lambda: window.inspector.picks.list.topLevelItem(1).setCheckState(
            0, Qt.CheckState.Unchecked
        ),
        lambda: ["disable", "p3"],
    )
    yield (
        "the list: a hold on",
        lambda: window.inspector.picks.list.topLevelItem(1).setCheckState(0, Qt.CheckState.Checked),
        lambda: ["enable", "p3"],
    )
    yield (
        "Del on picks",
        lambda: (session.select("p2", "p3"), key(Qt.Key.Key_Delete)()),
        lambda: ["unpick", "p2", "p3"],
    )
    yield (
        "click a disc, turn the wheel",
        lambda: (hand.click_disc(first), hand.on_wheel((0, 0.2), (0.3, 0.4))),
        lambda: ["set", first, *colour(first)],
    )
    yield (
        "a ramp in the inspector",
        lambda: (
            inspector.ramp.setCurrentIndex(inspector.ramp.findData("hold")),
            inspector.ramp.activated.emit(inspector.ramp.currentIndex()),
        ),
        lambda: ["ramp", "hold", first],
    )
    yield "lock by key", key(Qt.Key.Key_L, CONTROL), lambda: ["lock", first]
    yield (
        "unlock by menu",
        lambda: hand.choose(hand.place(first), texts.UNLOCK),
        lambda: [
            "unlock",
            first,
        ],
    )
    yield "Del on a vertex", key(Qt.Key.Key_Delete), lambda: ["reset", first]
    by: list[str] = []

    def in_scope(scope: Scope, red: str) -> None:
        inspector.set_scope(scope)
        assert inspector.target is not None
        by[:] = [repr(float(red) - float(inspector.target.after[0])), "0", "0"]
        hand.type_into("R", red)

    yield "a track", lambda: in_scope("track", "0.5"), lambda: ["track", first, "--by", *by]
    yield "the palette", lambda: in_scope("palette", "0.25"), lambda: ["palette", "--by", *by]
    yield "undo", key(Qt.Key.Key_Z, CONTROL), lambda: ["undo"]
    yield (
        "redo",
        key(Qt.Key.Key_Z, CONTROL | Qt.KeyboardModifier.ShiftModifier),
        lambda: ["redo"],
    )
    yield (
        "the history",
        lambda: window.history.go_to(window.history.list.count() - 4),
        lambda: ["undo", "--steps", 3],
    )
    inspector.set_scope("handle")
    yield (
        "double-click a row",
        lambda: QTest.mouseDClick(timeline, LEFT, NO_KEYS, hand.on_row(edge, 4).toPoint()),
        lambda: ["set", edge, "--frame", 4, *colour("s1")],
    )
    yield (
        "drag a stop",
        lambda: drag(timeline, hand.place("s1"), hand.place("s1") + _right(timeline, 2)),
        lambda: ["move", "s1", "--frame", 6],
    )
    yield (
        "a stop a frame earlier by key",
        lambda: (timeline.setFocus(), QTest.keyClick(timeline, Qt.Key.Key_Left, ALT)),
        lambda: ["move", "s1", "--frame", 5],
    )
    yield "Del on a stop", key(Qt.Key.Key_Delete), lambda: ["reset", "s1"]
    before: list[list[str]] = []

    def move_in_solid() -> None:
        session.go(FRAME)
        palette = window.solid.palette_now()
        assert palette is not None
        index = palette.ids.index(edge)
        before.append([repr(float(v)) for v in palette.edited[index]])
        hand.drag_in_solid(index, QPointF(-14, -9))

    yield (
        "drag a colour of the solid between handles",
        move_in_solid,
        lambda: ["set", "--near", *before[0], "--frame", FRAME, *colour(session.selection[0])],
    )
    session.select()
    yield "the clip's ramp", lambda: window._do("ramp_smooth"), lambda: ["ramp", "smooth"]
    yield "keep a version", key(Qt.Key.Key_V), lambda: ["version", "save", "A"]
    yield "reset everything", lambda: window._do("reset_all"), lambda: ["reset"]
    yield "use a version", key(Qt.Key.Key_1), lambda: ["version", "use", "A"]
    gallery = window.gallery

    def note() -> None:
        gallery.list.item(0).setSelected(True)
        gallery.note.setText("for the client")
        gallery.note.setModified(True)
        gallery.note.editingFinished.emit()

    yield "a version's note", note, lambda: ["version", "note", "A", "for the client"]
    yield (
        "a version's name",
        lambda: gallery.list.item(0).setText("warm"),
        lambda: ["version", "rename", "A", "warm"],
    )
    yield (
        "remove a version",
        lambda: (gallery.list.item(0).setSelected(True), gallery.buttons["delete"].click()),
        lambda: ["version", "remove", "warm"],
    )


def _right(timeline: Any, frames: float = 2) -> QPointF:
    return QPointF(timeline.places.scale.per_frame * frames, 0)


def test_every_gesture_leaves_the_bytes_of_its_verb(
    opened: Window, sidecar: Path, qtbot: Any
) -> None:
    twin = Path(shutil.copy(sidecar, sidecar.with_name("twin.p4d.json")))
    session: Session = opened.session
    done = 0
    for name, gesture, words in rows(Hand(opened)):
        revision = session.revision
        gesture()
        qtbot.waitUntil(
            lambda revision=revision: (
                session.revision > revision and not session.dragging and not session.following
            ),
            timeout=30_000,
        )
        said = [str(word) for word in words()]
        assert session.save()
        assert main(["edit", str(twin), *said]) == 0, name
        assert sidecar.read_bytes() == twin.read_bytes(), f"{name}: {' '.join(said)}"
        done += 1
    assert done >= 30


def test_a_switch_reads_the_clip_beside_the_window(opened: Window, qtbot: Any) -> None:
    """The holds are learned again without the pick: the window stood still for seconds."""
    session = opened.session
    grade_steps.hold(session, Place(6, 120, 70, 5, (0.2, 0.6, 0.3)))
    source = grade_steps.source_of(session)
    session.edit(lambda d: d.pick(6, pixel=(40, 30), to=(0.9, 0.1, 0.5), clip=source))
    qtbot.waitUntil(lambda: not session.following, timeout=20_000)
    for on in (False, True):
        grade_steps.enable(session, "p2", on)
        assert session.following
        assert session.document is not None
        assert session.document.grade.pick("p2").enabled == on
        qtbot.waitUntil(lambda: not session.following, timeout=20_000)
