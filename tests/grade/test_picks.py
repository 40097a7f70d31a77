"""Picks as values: their change along a path, where it stays alike, and what is said of it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from grade.test_answer import document_of

from palette4d.grade import mattes, pick_edits
from palette4d.grade.clip_colours import ClipColours
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.document import Document
from palette4d.grade.later import with_readings
from palette4d.grade.picks import PathKey, Pick

GREY = (0.5, 0.5, 0.5)
SPLIT = Path(__file__).parents[1] / "golden" / "sidecars" / "v1_split.p4d.json"


def test_a_path_is_alike_until_it_leaves_the_picked_colour() -> None:
    path = (PathKey(0, (0.88, 0.5, 0.5)), PathKey(10, GREY), PathKey(30, (0.54, 0.5, 0.5)))
    assert Pick("p1", "hold", 10, GREY, path=path).alike() == (8, 30)
    assert Pick("p1", "hold", 10, GREY, path=path, start=9, until=20).alike() == (9, 20)


def test_a_darker_colour_changes_less() -> None:
    path = (PathKey(0, (0.8, 0.2, 0.2)), PathKey(10, (0.4, 0.1, 0.1)))
    pick = Pick("p1", "pick", 0, (0.8, 0.2, 0.2), (0.8, 0.6, 0.2), path=path)
    assert pick.change_at(0) == pytest.approx([0, 0.4, 0])
    assert pick.change_at(10) == pytest.approx([0, 0.2, 0])


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


def test_another_pixel_without_a_box_is_that_pixel(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(np.float32([0.4, 0.4, 0.4]), (20, 30, 1))
    picture[10, 20] = 0.8, 0.3, 0.2
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(5, 5), box=5, to=(0.3, 0.4, 0.6))
    document.change_pick("p1", pixel=(20, 10))
    pick = document.grade.pick("p1")
    assert (pick.box, pick.rgb) == (1, pytest.approx((0.8, 0.3, 0.2), abs=0.04))
