"""The answer to a pick: what it takes, what else, and which gestures help."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import palette4d
from palette4d.common.errors import Palette4dError
from palette4d.common.text import percent
from palette4d.grade.answer import Answer, Note, answer_to
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.document import Document
from palette4d.grade.picks import Area, PathKey
from palette4d.media.array_clip import ArrayClip
from palette4d.media.clip_base import Clip, FrameError

H, W = 120, 200
RED, RUST, GREY = np.array([[0.7, 0.12, 0.15], [0.6, 0.19, 0.14], [0.55, 0.57, 0.6]])


def document_of(
    monkeypatch: pytest.MonkeyPatch, picture: NDArray[np.float64], frames: int = 2
) -> Document:
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(frames, *picture.shape)) * 0.01
    pictures = np.clip(picture + noise, 0, 1).astype(np.float32)
    clip: Clip = ArrayClip(pictures)
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: clip)
    found: Document = palette4d.analyze(pictures, vertices=10)
    return found


def note(found: Answer, words: str) -> Note | None:
    return next((each for each in found.notes if words in each.words), None)


def again(document: Document, id: str = "p1") -> Answer:
    found = document.answer(id)
    assert found is not None
    return found


def answer(document: Document, pixel: tuple[float, float] = (40.0, 60.0)) -> Answer:
    pick = document.pick(0, pixel=pixel, box=9, to="#2040b0")
    found = document.answer(pick.id)
    assert found is not None
    return found


@pytest.mark.parametrize("strap", [0, 6])
def test_one_thing_needs_no_help(monkeypatch: pytest.MonkeyPatch, strap: int) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20 : 60 + strap] = RED
    picture[30:90, 50 : 50 + strap] = GREY
    found = answer(document_of(monkeypatch, picture))
    assert found.share == pytest.approx(0.1, abs=0.01)
    assert found.notes == ()


def test_a_range_without_the_picks_frame_takes_as_much_of_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    document = document_of(monkeypatch, picture, frames=4)
    found = answer(document)
    document.change_pick("p1", start=2, until=3)
    assert again(document) == found


@pytest.mark.parametrize(("size", "box"), [(1, 15), (5, 30)])
def test_another_thing_of_its_colour_is_shown_in_pixels_of_the_clip(
    monkeypatch: pytest.MonkeyPatch, size: int, box: int
) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = picture[30:90, 140:180] = RED
    large = picture.repeat(size, axis=0).repeat(size, axis=1)
    found = answer(document_of(monkeypatch, large), (40.0 * size, 60.0 * size))
    also = note(found, "elsewhere")
    assert also is not None
    assert also.place is not None
    assert also.place.pixel == pytest.approx((160 * size, 60 * size), abs=15 * size)
    assert also.place.box == box


def test_a_proposed_hold_keeps_the_other_thing(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 140:180] = RUST
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", reach=8)
    also = again(document).notes[0]
    assert also.place is not None
    assert 140 <= also.place.pixel[0] < 180
    assert also.gesture == "hold"
    document.hold(0, pixel=also.place.pixel, box=also.place.box)
    found = again(document)
    assert note(found, "also takes") is None
    assert found.share == pytest.approx(0.1, abs=0.02)


def touching() -> NDArray[np.float64]:
    """Return a red thing that stands on litter of its colours, which is larger than it."""
    picture = np.tile(GREY, (H, W, 1))
    picture[30:72, 80:110] = RED
    light = np.random.default_rng(1).random((40, W, 1))
    picture[70:110] = light * (0.62, 0.3, 0.26) + (1 - light) * np.array((0.4, 0.14, 0.13))
    return picture


@pytest.mark.parametrize(("half", "told"), [(6, True), (30, False)])
def test_beside_a_small_thing_small_areas_are_named(
    monkeypatch: pytest.MonkeyPatch, half: int, told: bool
) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[60 - half : 60 + half, 40 - half : 40 + half] = RED
    picture[30:38, 140:148] = RED  # 0.3 % of the frame
    found = answer(document_of(monkeypatch, picture))
    assert (note(found, "its colour elsewhere") is not None) == told


def test_what_touches_within_a_window_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 60:150] = RUST
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", reach=8, window=(10, 20, 80, 100))
    told = note(again(document), "touches it")
    assert told is not None
    assert told.place is not None
    assert 60 <= told.place.pixel[0] < 80 + 14
    document.set_window("p1", 0, (10, 20, 56, 100), feather=0)
    assert note(again(document), "touches it") is None


def test_a_frame_that_a_correction_floods_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile((0.15, 0.25, 0.6), (H, W, 1))
    picture[50:60, 80:95] = RED
    document = document_of(monkeypatch, picture, frames=5)
    document.pick(0, pixel=(87.0, 55.0), box=5, to="#20b040")
    assert note(again(document), "of frame") is None
    document.correct_path("p1", 4, pixel=(20.0, 20.0), box=5)  # beside the thing
    told = note(again(document), "of frame 4: correct p1 there")
    assert told is not None
    assert told.warns


def test_of_many_corrections_a_few_frames_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    document = document_of(monkeypatch, picture, frames=40)
    pick = document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", follow=False)
    path = tuple(PathKey(frame, pick.rgb, True) for frame in range(40))
    grade = document.grade.put("pick", "p1", replace(pick, path=path))
    clip, frames, read = ClipOfPicks.of(grade), set(), ClipOfPicks.read

    def counted(self: ClipOfPicks, frame: int) -> NDArray[np.float32]:
        frames.add(frame)
        return read(self, frame)

    monkeypatch.setattr(ClipOfPicks, "read", counted)
    assert answer_to(grade, grade.pick("p1"), clip) is not None
    assert len(frames) <= 12


def test_frames_outside_the_range_and_bad_ones_are_not_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    picture = np.tile((0.15, 0.25, 0.6), (H, W, 1))
    picture[50:60, 80:95] = RED
    document = document_of(monkeypatch, picture, frames=5)
    document.pick(0, pixel=(87.0, 55.0), box=5, to="#20b040")
    document.correct_path("p1", 4, pixel=(20.0, 20.0), box=5)
    assert note(again(document), "of frame 4") is not None
    read = ClipOfPicks.read

    def bad(self: ClipOfPicks, frame: int) -> NDArray[np.float32]:
        if frame == 4:
            raise FrameError("frame 4 cannot be read")
        return read(self, frame)

    with monkeypatch.context() as patched:
        patched.setattr(ClipOfPicks, "read", bad)
        assert note(again(document), "of frame 4") is None
    document.change_pick("p1", until=1)
    assert note(again(document), "of frame 4") is None


@pytest.mark.parametrize("there", [0.0, 0.8])
def test_following_that_loses_what_stays_is_told(
    monkeypatch: pytest.MonkeyPatch, there: float
) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    document = document_of(monkeypatch, picture, frames=6)
    pick = document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", follow=False)
    assert again(document).notes == ()
    path = (PathKey(0, pick.rgb, True), PathKey(1, pick.rgb, there=there))
    grade = document.grade.put("pick", "p1", replace(pick, path=path))
    told = answer_to(grade, grade.pick("p1"), ClipOfPicks.of(grade))
    assert told is not None
    assert (note(told, "following loses its colour") is not None) == (there == 0)


def test_a_larger_thing_that_touches_is_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    document = document_of(monkeypatch, touching())
    document.pick(0, pixel=(95.0, 45.0), box=9, to="#2040b0", reach=2)
    before = again(document)
    (told,) = before.notes
    assert told.warns
    assert told.place is not None
    assert 70 <= told.place.pixel[1] < 110
    assert told.gesture == "hold"
    hold = document.hold(0, pixel=told.place.pixel, box=told.place.box, follow=False)
    found = again(document)
    assert percent(found.share) in told.effect
    assert found.share < before.share / 2
    costs = note(again(document, hold.id), "of its thing")
    assert (costs is None) == ("less of the thing" not in told.effect)


def test_a_hold_that_costs_the_lit_part_of_a_dark_thing_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = 0.7 * RED
    picture[30:90, 60:140] = picture[30:90, 165:190] = 0.95, 0.35, 0.33
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", reach=2)
    hold = document.hold(0, pixel=(178.0, 60.0), box=9, follow=False)
    costs = note(again(document, hold.id), "of its thing")
    assert costs is not None
    share = re.search(r"(\d+) %", costs.words)
    assert share is not None
    assert int(share[1]) > 50  # two thirds are lit


@pytest.mark.parametrize("kind", ["wall", "mottled", "shaded"])
def test_shades_of_one_thing_are_no_others(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    y, x = np.mgrid[:H, :W]
    part = {
        "wall": np.zeros((H, W)),
        "mottled": ((x // 5 + y // 5) % 2).astype(float),
        "shaded": x / W,
    }[kind][..., None]
    picture = (1 - part) * RED + part * 0.6 * RED
    picture[:20] = GREY
    assert answer(document_of(monkeypatch, picture)).notes == ()


@pytest.mark.parametrize(("columns", "told"), [(0, True), (130, False)])
def test_a_pick_that_fills_the_frame_with_unlike_colours_is_told(
    monkeypatch: pytest.MonkeyPatch, columns: int, told: bool
) -> None:
    """Haze that goes from red to a pale red without an edge, beside grey columns."""
    part = np.clip((np.arange(W) - columns) / (W - columns), 0, 1)[:, None]
    picture = np.tile((1 - part) * RED + part * np.array([0.6, 0.3, 0.3]), (H, 1, 1))
    picture[:, :columns] = GREY
    found = answer(document_of(monkeypatch, picture), ((W + columns) / 2, 60.0))
    line = note(found, "takes what looks like one thing, out to the frame's edges")
    assert (line is not None and line.warns) == told


@pytest.mark.parametrize(("columns", "proposed"), [(2, True), (10, False)])
def test_a_proposed_hold_costs_the_thing_little(
    monkeypatch: pytest.MonkeyPatch, columns: int, proposed: bool
) -> None:
    """Some of the thing's 40 columns have the other thing's colour, which the hold keeps."""
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 140:180] = picture[30:90, 60 - columns : 60] = RUST
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(30.0, 60.0), box=9, to="#2040b0", reach=8)
    assert (again(document).notes[0].gesture == "hold") == proposed


def test_a_share_is_that_of_the_matte(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pixel with half of the change counts as half."""
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 60:100] = 0.5 * (RED + GREY)
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", reach=8)
    matte = document.matte(picture.astype(np.float32), 0, "pick:p1")
    assert again(document).share == pytest.approx(float(matte.mean()), abs=0.005)
    assert again(document).share == pytest.approx(0.15, abs=0.015)


def test_a_hold_has_a_share_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    document = document_of(monkeypatch, picture)
    hold = document.hold(0, pixel=(40.0, 60.0), box=9)
    found = again(document, hold.id)
    assert found.share == pytest.approx(0.1, abs=0.01)
    assert found.notes == ()


def test_areas_of_the_frame_are_the_picked_thing(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 140:180] = RED
    document = document_of(monkeypatch, picture)
    assert note(answer(document), "its colour elsewhere") is not None
    document.add_area("p1", Area(0, ((160.0, 60.0),), 4.0))
    assert note(again(document), "its colour elsewhere") is None


def test_a_hold_that_costs_the_thing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the thing's two parts, the hold on what looks like the second one takes it."""
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 40:60] = picture[30:90, 140:180] = 0.5 * (RED + RUST)
    document = document_of(monkeypatch, picture)
    answer(document, (30.0, 60.0))
    hold = document.hold(0, pixel=(160.0, 60.0), box=9)
    for id_ in ("p1", hold.id):
        costs = note(again(document, id_), f"{hold.id} also costs p1")
        assert costs is not None
        assert costs.place is not None
        assert 40 <= costs.place.pixel[0] < 60
    other = document.hold(0, pixel=(110.0, 10.0), box=9)
    assert note(again(document, other.id), "no pick takes less") is not None


@pytest.mark.parametrize("colour", [np.array([0.2, 0.3, 0.7]), RUST])
def test_what_was_marked_and_is_held_names_the_hold(
    monkeypatch: pytest.MonkeyPatch, colour: NDArray[np.float64]
) -> None:
    """The pick changes no blue, held or not."""
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 60:100] = picture[30:90, 140:180] = colour
    document = document_of(monkeypatch, picture)
    answer(document)
    document.add_area("p1", Area(0, ((80.0, 60.0),), 4.0))
    hold = document.hold(0, pixel=(160.0, 60.0), box=9)
    for id_ in ("p1", hold.id) if colour is RUST else ("p1",):
        left = note(again(document, id_), "what you marked")
        assert left is not None
        assert left.warns
        assert (hold.id in left.words) == (colour is RUST)
        assert left.place is not None
        assert 75 <= left.place.pixel[0] < 85
    assert len(again(document).notes) == 1


def test_a_pick_over_an_earlier_one_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    document = document_of(monkeypatch, picture)
    answer(document)
    document.pick(0, pixel=(41.0, 61.0), box=9, to="#20b040")
    assert note(again(document, "p2"), "p1 takes") is not None
    assert note(again(document, "p1"), "p2 takes") is None
    document.pick(0, pixel=(42.0, 61.0), box=9, to="#20b041")
    told = note(again(document, "p3"), "p1 takes")
    assert told is not None
    assert "p2" not in told.words  # it changes them in the same way


def test_another_hue_that_is_connected_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """A face above a red shirt has nearly its colour."""
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = [0.67, 0.39, 0.4]
    picture[30:55, 20:60] = [0.63, 0.41, 0.29]
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(40.0, 75.0), box=9, to="#2040b0", reach=6)
    also = note(again(document), "another hue")
    assert also is not None
    assert also.place is not None
    assert 30 <= also.place.pixel[1] < 55


def test_a_box_on_two_colours_has_the_main_one(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    document = document_of(monkeypatch, picture)
    pick = document.pick(0, pixel=(57.0, 60.0), box=9, to="#2040b0")
    assert pick.rgb == pytest.approx(tuple(RED), abs=0.02)
    assert not any("of the box" in line for line in document.pick_warnings(pick.id))
    pick = document.pick(0, pixel=(59.0, 60.0), box=11, to="#2040b0")
    assert any("of the box" in line for line in document.pick_warnings(pick.id))


def test_without_the_clip_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    document = document_of(monkeypatch, np.tile(GREY, (H, W, 1)))
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: None)
    document.pick(0, colour=(0.7, 0.1, 0.1), to="#2040b0")
    assert document.answer("p1") is None


def test_a_hold_on_what_the_pick_floods_is_no_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    """The hold's place touches the thing, and is what the hold is for."""
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 60:120] = np.array([0.7, 0.3, 0.2])
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", reach=3)
    before = again(document).share
    hold = document.hold(0, pixel=(90.0, 60.0), box=9)
    after = again(document).share
    assert after < before - 0.1
    (told,) = again(document, hold.id).notes
    assert not told.warns
    assert percent(after) in told.words
    assert percent(before) in told.words


def test_a_hold_helps_in_its_own_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    """What only a later frame has is held there, though the picked frame does not change."""
    pictures = np.tile(GREY, (2, H, W, 1))
    pictures[:, 30:90, 20:60] = RED
    pictures[1, 30:90, 120:160] = RUST
    noise = np.random.default_rng(0).normal(size=pictures.shape) * 0.01
    clip: Clip = ArrayClip(np.clip(pictures + noise, 0, 1).astype(np.float32))
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: clip)
    document: Document = palette4d.analyze(
        np.stack([clip.read(frame)[..., :3] for frame in clip.frames]), vertices=10
    )
    document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", reach=3)
    hold = document.hold(1, pixel=(140.0, 60.0), box=9)
    (told,) = again(document, hold.id).notes
    assert not told.warns


def test_a_marked_area_is_no_other_thing(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 60:100] = np.array([0.7, 0.5, 0.15])
    document = document_of(monkeypatch, picture)
    pick = document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0")
    document.add_area(pick.id, Area(0, ((80.0, 60.0),), 4))
    found = again(document)
    assert found.share > 0.15
    assert found.notes == ()


def test_all_of_a_hue_takes_no_area(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    document = document_of(monkeypatch, picture)
    before = document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", whole_hue=True)
    with pytest.raises(Palette4dError, match="all of its hue"):
        document.add_area("p1", Area(0, ((50.0, 60.0),), 4.0))
    assert document.grade.pick("p1") == before


def test_a_proposed_window_leaves_the_same_colour_elsewhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[20:100, 120:180] = RED
    document = document_of(monkeypatch, picture)
    found = answer(document)
    assert note(found, "its colour elsewhere") is not None
    proposed = note(found, "if that is not part of it, a window around the thing")
    assert proposed is not None
    assert (proposed.gesture, proposed.id) == ("window", "p1")
    assert proposed.window is not None
    left, top, right, bottom = proposed.window
    assert 0 < left < 20 < 60 < right < 120
    assert 0 < top < 30 < 90 < bottom < H
    document.set_window("p1", found.frame, proposed.window)
    after = again(document)
    assert proposed.effect == f"then takes {percent(after.share)}"
    assert after.share == pytest.approx(0.1, abs=0.01)
    assert after.notes == ()


def test_a_window_that_leaves_little_of_the_rest_out_is_not_proposed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The same colour is all around in small parts; a window around the thing has most of them."""
    picture = np.tile(GREY, (H, W, 1))
    picture[4:16, 4:150] = RED  # a frame that is the thing
    picture[4:112, 4:16] = RED
    picture[104:116, 4:150] = RED
    for x in (40, 70, 100, 130):
        picture[40:80, x : x + 16] = RED
    picture[10:110, 188:196] = RED
    document = document_of(monkeypatch, picture)
    found = answer(document, (10.0, 60.0))
    assert note(found, "its colour elsewhere") is not None
    assert all(told.window is None for told in found.notes)


def test_a_thing_that_stands_alone_needs_no_window(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 100:140] = 0.8, 0.2, 0.12  # a hold parts it
    found = answer(document_of(monkeypatch, picture))
    assert note(found, "a window") is None


def test_what_a_window_leaves_out_of_the_marks_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 100:140] = RED
    document = document_of(monkeypatch, picture)
    pick = document.pick(0, pixel=(40, 60), box=9, to="#2040b0", window=(10, 20, 70, 100))
    document.add_area(pick.id, Area(0, ((120.0, 60.0),), 4))
    found = note(again(document), "does not take what you marked (its window leaves that out)")
    assert found is not None
    assert found.warns
