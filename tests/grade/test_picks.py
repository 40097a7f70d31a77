"""Picks as values: their change along a path, where it stays alike, and what is said of it."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from grade.test_answer import document_of

import palette4d
from palette4d.common.errors import Palette4dError, SidecarError
from palette4d.grade import copying, later, mattes, pick_edits, sidecar, unread_steps
from palette4d.grade.clip_colours import ClipColours
from palette4d.grade.clip_of_picks import ClipOfPicks, largest_part
from palette4d.grade.document import Document
from palette4d.grade.later import with_readings
from palette4d.grade.picks import MOST_AREAS, MOST_PICKS, Area, PathKey, Pick, Window, WindowKey
from palette4d.media.array_clip import ArrayClip

GREY = (0.5, 0.5, 0.5)
SPLIT = Path(__file__).parents[1] / "golden" / "sidecars" / "v1_split.p4d.json"


def test_a_path_is_alike_until_it_leaves_the_picked_colour() -> None:
    path = (PathKey(0, (0.88, 0.5, 0.5)), PathKey(10, GREY), PathKey(30, (0.54, 0.5, 0.5)))
    assert Pick("p1", "hold", 10, GREY, path=path).alike() == (8, 30)
    assert Pick("p1", "hold", 10, GREY, path=path, start=9, until=20).alike() == (9, 20)
    gone = (
        PathKey(10, GREY),
        PathKey(20, GREY),
        PathKey(22, GREY, there=0),
        PathKey(30, GREY, there=0),
    )
    assert Pick("p1", "hold", 10, GREY, path=gone).alike() == (10, 21)


def test_a_range_keeps_to_its_frames_where_not_all_were_analysed(tmp_path: Path) -> None:
    """The node draws the frames between the analysed ones too."""
    document = Document.load(shutil.copy(SPLIT.with_name("v1_step_two.p4d.json"), tmp_path))
    first, _, step = document.grade.frames
    assert step == 2
    within = {"start": first + 4, "until": first + 6}
    document.pick(first + 4, colour=(0.6, 0.2, 0.2), to=(0.2, 0.6, 0.2), **within)
    image = np.full((1, 1, 3), (0.6, 0.2, 0.2), np.float32)

    def changed() -> list[bool]:
        frames = range(first + 2, first + 9)
        recoloured = [document.recolour(image, n, space="palette") for n in frames]
        return [bool((one != image).any()) for one in recoloured]

    assert changed() == [False, False, True, True, True, False, False]
    document.undo()
    document.adjust(by=(0.1, 0.1, 0.1), **within)
    for frame, moves in zip(range(first + 2, first + 9), [0, 0, 1, 1, 1, 0, 0], strict=True):
        palette = document.grade.palette(frame)
        assert (palette.edited != palette.rgb).any() == moves


def test_a_darker_colour_changes_less_and_a_lighter_one_no_more() -> None:
    rgb = ((0.8, 0.2, 0.2), (0.4, 0.1, 0.1), (1.0, 0.25, 0.25))
    path = tuple(PathKey(10 * i, colour) for i, colour in enumerate(rgb))
    pick = Pick("p1", "pick", 0, (0.8, 0.2, 0.2), (0.7, 0.6, 0.3), path=path)
    assert pick.change_at(0) == pytest.approx([-0.1, 0.4, 0.1])
    assert pick.change_at(10) == pytest.approx([-0.05, 0.2, 0.05])
    assert pick.change_at(20) == pytest.approx([-0.1, 0.4, 0.1])


@pytest.mark.parametrize(("path", "frames"), [
    ((), [0, 2, 6, 10]),
    # Where less than half of the change is asked for, most of the thing is out of sight.
    ((PathKey(0, GREY), PathKey(4, GREY), PathKey(5, GREY, there=0.4)), [0, 2, 4]),
])  # fmt: skip
def test_mattes_are_learned_from_frames_spread_over_the_clip(
    path: tuple[PathKey, ...], frames: list[int]
) -> None:
    picture = np.random.default_rng(0).random((8, 12, 3), np.float32)
    seen: list[int] = []

    def read(frame: int) -> mattes.F32:
        seen.append(frame)
        return picture

    pick = Pick("p1", "pick", 0, GREY, (0.6, 0.5, 0.5), path=path)
    mattes.learn(pick, (), range(12), read, None)
    assert seen == frames


def test_a_pick_that_does_not_act_yet_is_not_told_to_be_off() -> None:
    document = Document.load(SPLIT)
    seen = document.grade.palette(8).rgb.mean(axis=0)
    pick = document.pick(8, colour=seen, by=(0.2, 0, 0), follow=False, start=12)
    document.pick(8, colour=seen + 0.02, by=(0, 0.2, 0), follow=False)
    grade = document.grade
    assert pick_edits.warnings(grade, ClipOfPicks.of(grade), pick.id) == ()


def test_the_nearer_colours_of_the_clip_count_more() -> None:
    grade = Document.load(SPLIT).grade
    stored = [{"frame": frame, "rgbw": [[*GREY, 1.0]]} for frame in (0, 10)]
    found = ClipColours(grade.core.polytope, {"colours": stored}).colours_at(2)
    assert found[:, 3] == pytest.approx([0.8, 0.2])


def test_readings_are_taken_by_the_pick_that_they_are_of() -> None:
    old = Pick("p1", "pick", 0, GREY, (0.6, 0.5, 0.5))
    readings = ((old, replace(old, matte="m1")),)
    for own, matte in (
        (old, "m1"),
        (replace(old, reach=1.0), "m1"),  # a matte does not depend on it
        (replace(old, rgb=(0.4, 0.5, 0.5)), None),
        (replace(old, matte="m2"), "m2"),
    ):
        assert with_readings({("pick", "p1"): own}, readings) == {
            ("pick", "p1"): replace(own, matte=matte)
        }
    assert with_readings({}, readings) == {}


def test_a_step_that_was_undone_and_forgotten_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It was undone while the clip was read, and another step was made then."""
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    document.hold(0, pixel=(60, 8), box=9)
    before = document.grade
    document.add_area("p1", Area(0, ((60, 50),), 3), clip=later.Unread())
    document.history = unread_steps.as_unread(document.history)
    made, step = document.grade, document.history.done[-1]
    trial = Document(before)
    later.do_again(trial, step, ClipOfPicks.of(before), None)
    readings = later.readings_of(trial.grade, made)
    assert readings
    steps = step, trial.history.done[-1]
    document.undo()
    document.adjust(by=(0.1, 0, 0))
    grade, history = later.completed(document.grade, document.history, steps, readings, {})
    assert grade.state == document.grade.state
    assert history == document.history
    # A step that was merged with others is there, if what it read for is.
    document = Document(before)
    with document.one_step("both"):
        document.add_area("p1", Area(0, ((60, 50),), 3), clip=later.Unread())
        document.adjust(by=(0.1, 0, 0))
    mattes = trial.grade.mattes
    grade, _ = later.completed(document.grade, document.history, steps, readings, mattes)
    assert grade.pick("p1").matte == trial.grade.pick("p1").matte != before.pick("p1").matte


def test_an_area_that_is_added_meanwhile_leaves_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    document, where = moving(monkeypatch), {"pixel": (20, 30), "box": 9, "to": "#2040b0"}
    before = document.grade
    document.pick(0, **where)
    read, done = document.grade, document.history.done[-1]
    document = Document(before)
    document.pick(0, **where, clip=later.Unread(read.pick("p1").rgb))
    made, step = document.grade, document.history.done[-1]
    document.add_area("p1", Area(0, ((20, 36),), 3), clip=later.Unread())
    readings = later.readings_of(read, made)
    steps = step, done
    grade, _ = later.completed(document.grade, document.history, steps, readings, read.mattes)
    assert grade.pick("p1").path == read.pick("p1").path
    assert grade.pick("p1").matte is None  # it is learned with the area


def test_versions_that_are_kept_meanwhile_have_what_is_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Those that have the pick, also changed since; not what it was with an area since undone."""
    document, where = moving(monkeypatch), {"pixel": (20, 30), "box": 9, "to": "#2040b0"}
    before = document.grade
    document.pick(0, **where)
    read, colour = document.grade, document.grade.pick("p1").rgb
    done = document.history.done[-1]
    document = Document(before)
    document.save_version("before")
    document.pick(0, **where, clip=later.Unread(colour))
    made, step = document.grade, document.history.done[-1]
    document.change_pick("p1", reach=2.0)
    document.save_version("changed")
    readings = later.readings_of(read, made)
    steps = step, done
    grade, _ = later.completed(document.grade, document.history, steps, readings, read.mattes)
    (kept,) = grade.version("changed").picks
    assert (kept.path, kept.matte) == (read.pick("p1").path, read.pick("p1").matte)
    assert kept.reach == 2
    assert grade.version("before").picks == ()
    document = Document(read)
    document.hold(0, pixel=(60, 8), box=9)
    both = document.grade
    document.add_area("p1", Area(0, ((60, 50),), 3), clip=later.Unread())
    made, step = document.grade, document.history.done[-1]
    trial = Document(both)
    later.do_again(trial, step, ClipOfPicks.of(both), None)
    document.undo()
    document.save_version("without")
    readings = later.readings_of(trial.grade, made)
    steps, mattes = (step, trial.history.done[-1]), trial.grade.mattes
    grade, _ = later.completed(document.grade, document.history, steps, readings, mattes)
    assert grade.version("without").picks == both.picks


def test_a_window_that_was_followed_meanwhile_keeps_its_feather() -> None:
    given, followed = WindowKey(0, (1, 1, 5, 5), True), WindowKey(3, (2, 1, 6, 5))
    old = Pick("p1", "pick", 0, GREY, (0.6, 0.5, 0.5), window=Window(2, (given,)))
    readings = ((old, replace(old, matte="m1", window=Window(2, (given, followed)))),)
    other = WindowKey(0, (1, 1, 5, 6), True)
    for window, expected in (
        (Window(9, (given,)), Window(9, (given, followed))),
        (Window(2, (other,)), Window(2, (other,))),
        (None, None),
    ):
        own = replace(old, window=window)
        assert with_readings({("pick", "p1"): own}, readings) == {
            ("pick", "p1"): replace(own, matte="m1", window=expected)
        }


@pytest.mark.parametrize(("side", "box"), [(1, 1), (5, 5), (9, 9), (40, 15)])
def test_the_middle_of_the_largest_part(side: int, box: int) -> None:
    mask = np.zeros((60, 80), bool)
    mask[10 : 10 + side, 20 : 20 + side] = True
    mask[58:60, 70:79] = side > 5  # larger than a pixel, not as deep
    part, middle, size = largest_part(mask)
    assert part.sum() == side**2
    assert size == box
    if side % 2:
        assert middle == (20 + side // 2, 10 + side // 2)


def test_numbers_and_lists_of_any_kind_are_saved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    picture = np.tile(np.float32([0.4, 0.4, 0.4]), (20, 30, 1))
    picture[5:15, 5:15] = 0.8, 0.3, 0.2
    document = document_of(monkeypatch, picture)
    one, half = np.int64(1), np.float32(0.5)
    document.pick(np.int64(0), pixel=np.array([10, 10]), box=one, to=np.array([0.1, 0.5, 0.2]))
    document.add_area("p1", Area(0, [(6, 8), (7, 9)], 2))
    document.add_area("p1", Area(one, np.array([[6.5, 8], [7, 9]]), half))
    document.hold(0, pixel=[20, 10], box=3, start=one, fade=half)
    document.change_pick("p1", reach=half, lightness=np.array([0, 0.5]), enabled=np.bool_(True))
    document.set_window("p1", one, np.array([1, 2, 20, 18]), feather=half)
    for wrong in ({"enabled": "no"}, {"enabled": 0}, {"areas": [Area(0, (), 1)]}):
        with pytest.raises(Palette4dError):
            document.change_pick("p1", **wrong)
    document.save(tmp_path / "s.p4d.json")
    again = Document.load(tmp_path / "s.p4d.json")
    assert again.grade.picks == document.grade.picks
    assert again.history == document.history


def test_another_pixel_without_a_box_is_that_pixel(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(np.float32([0.4, 0.4, 0.4]), (20, 30, 1))
    picture[10, 20] = 0.8, 0.3, 0.2
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(5, 5), box=5, to=(0.3, 0.4, 0.6))
    document.change_pick("p1", pixel=(20, 10))
    pick = document.grade.pick("p1")
    assert (pick.box, pick.rgb) == (1, pytest.approx((0.8, 0.3, 0.2), abs=0.04))
    # Another palette takes the pick over with its box.
    pick = document.change_pick("p1", pixel=(20, 10), box=5)
    source = document.grade.put("pick", "p1", replace(pick, rgb=(0.41, 0.4, 0.4)))
    source = replace(source, members={**source.members, "colours": []})  # of other pictures
    empty = document.grade.put("pick", "p1", None)
    grade, _ = copying.copied(empty, source, ClipOfPicks.of(empty), same_clip=True)
    taken = grade.pick("p1")
    assert (taken.rgb, taken.path, taken.box) == (pick.rgb, pick.path, 5)
    assert taken.rgb == pytest.approx((0.4, 0.4, 0.4), abs=0.04)


def moving(monkeypatch: pytest.MonkeyPatch, frames: int = 6) -> Document:
    """A red thing that moves by 6 pixels a frame before a wall, and another one that stays."""
    rng = np.random.default_rng(0)
    wall = 0.5 + 0.08 * rng.normal(size=(60, 120, 1)) * np.ones(3)
    thing = np.float64([0.7, 0.15, 0.15]) * (1 + 0.2 * rng.normal(size=(20, 20, 1)))
    pictures = np.tile(wall, (frames, 1, 1, 1))
    for frame in range(frames):
        pictures[frame, 20:40, 10 + 6 * frame : 30 + 6 * frame] = thing
        pictures[frame, 20:40, 90:110] = thing[::-1]
    pixels = pictures.clip(0, 1).astype(np.float32)
    clip = ArrayClip(pixels)
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: clip)
    return palette4d.analyze(pixels, vertices=8)


def test_a_pick_of_a_still_is_followed_in_a_clip(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a palette of one frame nothing can be followed: that is no wish."""
    document = moving(monkeypatch)
    clip = ClipOfPicks.of(document.grade, None).open()
    assert clip is not None
    own = document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    document.undo()
    monkeypatch.setattr(
        "palette4d.grade.clip_of_picks.find_clip", lambda *_: ArrayClip(clip.read(0)[None])
    )
    still = palette4d.analyze(clip.read(0)[None], vertices=8)
    assert not still.pick(0, pixel=(20, 30), box=9, to="#2040b0").path
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: clip)
    document.copy_from(still)
    (copied,) = document.grade.picks
    assert copied.path
    assert own.path


BOX = (6.0, 16.0, 34.0, 44.0)


def test_a_window_follows_its_thing(monkeypatch: pytest.MonkeyPatch) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    pick = document.set_window("p1", 0, BOX)
    assert pick.window is not None
    assert pick.window.feather == 2.8
    assert pick.window.box_at(5) == pytest.approx(np.add(BOX, (30, 0, 30, 0)), abs=0.5)
    assert pick.lost(document.grade.frames) == (None, None)
    assert document.history.done[-1].label == (
        "change p1: window 6,16,34,44 at frame 0, feather 2.8"
    )
    # At a frame that has a given box it is replaced; at another one a box is added.
    pick = document.set_window("p1", 0, (6, 16, 34, 46), feather=5)
    pick = document.set_window("p1", 5, (36, 16, 64, 44))
    assert pick.window is not None
    assert pick.window.feather == 5
    assert [key for key in pick.window.keys if key.given] == [
        WindowKey(0, (6, 16, 34, 46), True),
        WindowKey(5, (36, 16, 64, 44), True),
    ]
    assert pick.window.box_at(2)[3] == pytest.approx(45.2, abs=0.5)
    # Without following, and when that begins and ends.
    pick = document.set_window("p1", 2, (20, 16, 48, 44), follow=False)
    assert pick.window is not None
    assert [key.frame for key in pick.window.keys] == [0, 2, 5]
    # A box that was given is taken back; the others are followed again, the last one is the window.
    pick = document.set_window("p1", 2, None)
    assert pick.window is not None
    assert [key.frame for key in pick.window.given.keys] == [0, 5]
    assert document.history.done[-1].label == "change p1: no box at frame 2"
    assert document.set_window("p1", None, None).window is None
    document.undo()
    document.set_window("p1", 0, None)
    assert document.set_window("p1", 5, None).window is None
    pick = document.set_window("p1", 0, BOX, follow=False)
    assert pick.window == Window(2.8, (WindowKey(0, BOX, True),))
    assert document.change_pick("p1", follow=True).window != pick.window
    window = document.set_window("p1", 2, (20, 16, 48, 44), follow=False).window
    assert window is not None
    assert [key.frame for key in window.keys] == [0, 2]
    document.undo()
    assert document.change_pick("p1", follow=False).window == pick.window


def test_a_window_across_the_picture_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    for box in ((-1, 16, 121, 44), (6, -1, 34, 61)):
        pick = document.set_window("p1", 0, box)
        assert pick.window is not None
        assert pick.window.keys == (WindowKey(0, box, True),)
    # Beyond one side there is a thing that leaves the picture.
    for box in ((-1, 16, 34, 44), (0, 16, 120, 44)):
        pick = document.set_window("p1", 0, box)
        assert pick.window is not None
        assert not pick.window.keys[-1].given


def test_a_new_range_is_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0", until=2, window=BOX, feather=3)
    window = document.grade.pick("p1").window
    assert window is not None
    assert window.keys[-1].frame == 3  # a ramp of one frame
    window = document.change_pick("p1", until=None).window
    assert window is not None
    assert window.box_at(5) == pytest.approx(np.add(BOX, (30, 0, 30, 0)), abs=0.5)
    assert window.feather == 3


def test_a_range_of_which_all_is_known_is_not_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0", window=BOX, feather=3)
    before, read = document.grade.pick("p1"), list[int]()

    def change(**changes: float | None) -> Pick:
        read.clear()
        return document.change_pick("p1", progress=lambda done, _: read.append(done), **changes)

    for changes in ({"start": 1, "until": 3}, {"fade": 1}, {"start": None, "until": 4}):
        pick = change(**changes)
        assert (pick.path, pick.window) == (before.path, before.window)
        assert not read
    document.undo()
    document.change_pick("p1", follow=True)  # its range is shorter now
    assert change(until=None).path[-1].frame == 5
    assert read


def test_the_feather_changes_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    with pytest.raises(Palette4dError, match="p1 has no window"):
        document.change_pick("p1", feather=3)
    before = document.set_window("p1", 0, BOX).window
    assert before is not None
    after = document.change_pick("p1", feather=8.5).window
    assert after == replace(before, feather=8.5)
    assert "feather 8.5" in document.history.done[-1].label


def test_an_inverted_window_leaves_out_what_is_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    image = np.full((60, 120, 3), document.grade.pick("p1").rgb, np.float32)
    assert (document.recolour(image, 0) != image).all(2).all()
    document.set_window("p1", 0, (20, 16, 30, 44), feather=0, follow=False, inverted=True)
    changed = (document.recolour(image, 0, clean_up=0) != image).any(2)
    assert not changed[16:44, 20:30].any()
    changed[15:45, 19:31] = True  # the edge is as soft as a pixel
    assert changed.all()
    both = document.grade.pick("p1").window
    assert both is not None
    assert document.set_window("p1", 0, (20, 16, 31, 44), follow=False).window != both
    assert "outside of window" in document.history.done[-1].label
    again = document.grade.pick("p1")
    assert Pick.from_fields(again.to_fields()).window == again.window == again.scaled(1, 1).window


def test_windows_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    document.hold(0, pixel=(100, 30), box=9)
    state = document.grade.state
    for id_, frame, box, feather, says in (
        ("p2", 0, BOX, None, "p2 is a hold, which has no window"),
        ("p1", 9, BOX, None, "outside of the clip"),
        ("p1", 1.5, BOX, None, "no frame 1.5"),
        ("p1", 0, (30, 16, 20, 44), None, "a left edge before the right one"),
        ("p1", 0, (20, 44, 30, 16), None, "a top above the bottom"),
        ("p1", 0, (20, 44, 30), None, "expected left, top, right and bottom"),
        ("p1", 0, (20, 4, 30, float("nan")), None, "expected left, top, right and bottom"),
        ("p1", 0, BOX, -1, "found a feather of -1 pixels"),
        ("p1", 0, None, None, "p1 has no window"),
    ):
        with pytest.raises(Palette4dError, match=says):
            document.set_window(id_, frame, box, feather=feather)
    document.set_window("p1", 0, BOX)
    with pytest.raises(Palette4dError, match="no box at frame 3 that was given; expected one of 0"):
        document.set_window("p1", 3, None)
    with pytest.raises(Palette4dError, match="without its frame"):
        document.set_window("p1", None, BOX)
    document.undo()
    with pytest.raises(Palette4dError, match="without window"):
        document.pick(0, pixel=(20, 30), box=9, to="#2040c0", feather=3)
    with pytest.raises(Palette4dError, match="without window"):
        document.pick(0, pixel=(20, 30), box=9, to="#2040c0", inverted=True)
    with pytest.raises(Palette4dError, match="p1 has no window"):
        document.change_pick("p1", inverted=True)
    with pytest.raises(Palette4dError, match="no window"):
        document.change_pick("p2", window=Window(0, (WindowKey(0, BOX, True),)))
    assert document.grade.state == state


def test_a_window_is_undone_kept_in_versions_saved_and_merged(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    document.save_version("everywhere")
    window = document.set_window("p1", 0, BOX).window
    assert document.undo().label.startswith("change p1: window")
    assert document.grade.pick("p1").window is None
    document.redo()
    assert document.grade.pick("p1").window == window
    assert document.version("everywhere").grade.pick("p1").window is None
    path = tmp_path / "a.p4d.json"
    document.save(path)
    assert Document.load(path).grade.pick("p1").window == window
    # Another program changes another pick meanwhile.
    other = Document.load(path)
    other.pick(0, pixel=(60, 8), box=9, by=(0, 0.1, 0))
    other.save()
    document.set_window("p1", 0, (0, 0, 60, 60), feather=9)
    document.save()
    merged = Document.load(path).grade
    assert [pick.id for pick in merged.picks] == ["p1", "p2"]
    assert merged.pick("p1").window == document.grade.pick("p1").window
    document.change_pick("p1", enabled=False)
    assert document.change_pick("p1", enabled=True).window == merged.pick("p1").window
    # The same pick with another window is another one.
    same = {"pixel": (20, 30), "box": 9, "to": "#2040b0"}
    with pytest.raises(Palette4dError, match="p1 is this pick already"):
        document.pick(0, **same, window=(0, 0, 60, 60), feather=9)
    unread = later.Unread(document.grade.pick("p1").rgb)  # as Studio makes it at once
    with pytest.raises(Palette4dError, match="p1 is this pick already"):
        document.pick(0, **same, window=(0, 0, 60, 60), feather=9, clip=unread)
    assert document.pick(0, **same, window=BOX).id == "p3"


def test_a_version_keeps_what_its_picks_have_learned(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    document = moving(monkeypatch)
    pick = document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    document.save_version("blue")
    document.reset()
    document.forget_history()
    document.save(tmp_path / "a.p4d.json")
    again = Document.load(tmp_path / "a.p4d.json", version="blue").grade
    assert again.pick("p1") == pick
    assert pick.matte in again.mattes


def test_what_follows_tells_its_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    document, told = moving(monkeypatch), list[tuple[int, int]]()
    how: dict[str, Any] = {"progress": lambda done, total: told.append((done, total))}
    for edit in (
        lambda: document.pick(0, pixel=(20, 30), box=9, to="#2040b0", **how),
        lambda: document.hold(0, pixel=(60, 8), box=9, **how),
        lambda: document.correct_path("p1", 5, pixel=(50, 30), box=9, **how),
        lambda: document.set_window("p1", 0, BOX, **how),
    ):
        told.clear()
        edit()
        assert told == [(done, 6) for done in range(1, 7)]


def test_a_window_is_followed_when_the_clip_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    before = document.grade
    document.set_window("p1", 0, BOX, clip=later.Unread())
    document.history = unread_steps.as_unread(document.history)
    made, step = document.grade, document.history.done[-1]
    assert made.pick("p1").window == Window(2.8, (WindowKey(0, BOX, True),))
    assert unread_steps.unread_picks(document.grade, document.history) == ["p1"]
    # The program that made it ended: the next one does it again.
    trial = Document(before)
    later.do_again(trial, step, ClipOfPicks.of(before), None)
    window = trial.grade.pick("p1").window
    assert window is not None
    assert window.box_at(5) == pytest.approx(np.add(BOX, (30, 0, 30, 0)), abs=0.5)
    readings = later.readings_of(trial.grade, made)
    steps = step, trial.history.done[-1]
    grade, history = later.completed(made, document.history, steps, readings, {})
    assert grade.pick("p1") == trial.grade.pick("p1")
    assert not history.done[-1].unread
    assert unread_steps.unread_picks(trial.grade, trial.history) == []


@pytest.mark.parametrize("same_clip", [True, False])
def test_what_the_clip_was_not_read_for_is_read_in_a_copy(
    monkeypatch: pytest.MonkeyPatch, same_clip: bool
) -> None:
    """Of the same pictures picks stay as they are, but for these."""
    document = moving(monkeypatch)
    empty = document.grade
    where: dict[str, Any] = {"pixel": (20, 30), "box": 9, "to": "#2040b0"}
    document.pick(0, **where)
    document.set_window("p1", 0, BOX)
    read = document.grade
    document.reset()
    document.pick(0, **where, clip=later.Unread(read.pick("p1").rgb))
    document.set_window("p1", 0, BOX, clip=later.Unread())
    document.history = unread_steps.as_unread(document.history)
    assert document.grade.pick("p1").matte is None
    target = Document(empty)
    if same_clip:
        clip = ClipOfPicks.of(empty)
        grade, _ = copying.copied(empty, document.grade, clip, same_clip=True, unread=["p1"])
    else:
        target.copy_from(document)
        grade = target.grade
    assert grade.pick("p1").path == read.pick("p1").path
    assert grade.pick("p1").matte == read.pick("p1").matte
    assert grade.pick("p1").window == read.pick("p1").window


def test_a_pick_that_moves_in_time_leaves_its_pixel(monkeypatch: pytest.MonkeyPatch) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    assert document.change_pick("p1", frame=3).pixel is None
    assert document.change_pick("p1", frame=4, pixel=(44, 30)).pixel == (44, 30)
    assert document.change_pick("p1", frame=4, reach=1.0).pixel == (44, 30)


@pytest.mark.parametrize("kept", [False, True])
def test_a_newer_window_is_read_in_place_of_an_older_one_that_no_version_has(
    monkeypatch: pytest.MonkeyPatch, kept: bool
) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    for box in (BOX, (0, 0, 60, 60)):
        document.set_window("p1", 0, box, clip=later.Unread())
        document.history = unread_steps.as_unread(document.history)
        if kept and box == BOX:
            document.save_version("first")
    old, new = document.history.done[-2:]
    assert unread_steps.replaces(new, old, document.grade.state) == (not kept)
    waiting = [step for _, _, step in unread_steps.unread(document.grade, document.history)]
    assert waiting == ([old, new] if kept else [new])


def test_a_window_that_was_not_to_be_followed_stays_when_other_things_are_read_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    document = moving(monkeypatch)
    document.pick(0, pixel=(20, 30), box=9, to="#2040b0")
    document.set_window("p1", 0, BOX, follow=False)
    before = document.grade
    with document.one_step("edits of two programs"):
        document.change_pick("p1", feather=9, clip=later.Unread())
        document.change_pick("p1", until=4, clip=later.Unread())
    trial = Document(before)
    later.do_again(trial, document.history.done[-1], ClipOfPicks.of(before), None)
    assert trial.grade.pick("p1").window == Window(9, (WindowKey(0, BOX, True),))


def test_python_and_the_core_allow_as_many_enabled_picks(tmp_path: Path) -> None:
    fields = sidecar.load(SPLIT)
    made = [Pick(f"q{i}", "hold", 8, (i / 500, 0.5, 0.5)) for i in range(MOST_PICKS + 30)]
    picks = [replace(p, enabled=i < MOST_PICKS).to_fields() for i, p in enumerate(made)]
    fields |= {"version": 2, "edits": {**fields["edits"], "picks": picks}}
    full = Document(fields)
    assert [pick.id for pick in full.grade.picks] == [pick.id for pick in made]  # q2 before q10
    with pytest.raises(Palette4dError, match=f"at most {MOST_PICKS} can be enabled"):
        full.pick(8, colour=GREY, by=(0.2, 0, 0), follow=False)
    with pytest.raises(Palette4dError, match=f"at most {MOST_PICKS} can be enabled"):
        full.change_pick(made[-1].id, enabled=True)
    # One that is disabled makes room; the steps, which are not drawn, name one more.
    full.change_pick("q0", enabled=False)
    full.change_pick(made[-1].id, enabled=True)
    full.save(tmp_path / "full.p4d.json")
    again = Document.load(tmp_path / "full.p4d.json")
    assert sum(one.enabled for one in again.grade.picks) == MOST_PICKS
    picks[-1]["enabled"] = True
    with pytest.raises(SidecarError, match=rf"/edits/picks: found {MOST_PICKS + 1} enabled"):
        Document(fields)


def test_python_and_the_core_allow_as_many_areas(tmp_path: Path) -> None:
    document = Document.load(SPLIT)
    areas = [Area(8, ((float(n), 1.0),), 1.0) for n in range(MOST_AREAS)]
    document.pick(8, colour=GREY, by=(0.2, 0, 0), follow=False, areas=areas)
    document.save(tmp_path / "full.p4d.json")
    assert Document.load(tmp_path / "full.p4d.json").grade.pick("p1").areas == tuple(areas)
    with pytest.raises(Palette4dError, match=f"{MOST_AREAS + 1} areas .* at most {MOST_AREAS}"):
        document.change_pick("p1", areas=(*areas, areas[0]), clip=later.Unread())
    assert document.grade.pick("p1").areas == tuple(areas)
    fields = document.fields()
    fields["edits"]["picks"][0]["areas"] *= 2
    with pytest.raises(
        SidecarError, match=f"areas in all.*at most {MOST_AREAS}|{2 * MOST_AREAS} areas"
    ):
        Document(fields)
