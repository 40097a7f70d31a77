"""The answer to a pick: what it takes, what else, and which gestures help."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import palette4d
from palette4d.grade.answer import Answer
from palette4d.grade.document import Document
from palette4d.grade.picks import Area
from palette4d.media.array_clip import ArrayClip
from palette4d.media.clip_base import Clip

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


def answer(document: Document, pixel: tuple[float, float] = (40.0, 60.0)) -> Answer:
    pick = document.pick(0, pixel=pixel, box=9, to="#2040b0")
    found = document.answer(pick.id)
    assert found is not None
    return found


def test_one_thing_needs_no_help(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    found = answer(document_of(monkeypatch, picture))
    assert found.share == pytest.approx(0.1, abs=0.01)
    assert (found.other, found.hold, found.part, found.floods) == (None, None, None, False)
    assert found.lines("p1") == ["takes 10 % of frame 0"]


def test_a_proposed_hold_keeps_the_other_thing(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 140:180] = RUST
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(40.0, 60.0), box=9, to="#2040b0", reach=8)
    found = document.answer("p1")
    assert found is not None
    assert found.other is not None
    assert 140 <= found.other.pixel[0] < 180
    if found.hold is None:
        pytest.fail("no hold was proposed")
    document.hold(0, pixel=found.hold.pixel, box=found.hold.box)
    again = document.answer("p1")
    assert again is not None
    assert again.others <= found.hold.left + 0.005
    assert again.share > 0.08


def test_a_pick_that_floods_is_warned_of(monkeypatch: pytest.MonkeyPatch) -> None:
    """A large region that runs on into other colours; a large wall of one colour is none."""
    part = np.linspace(0, 1, W)[None, :, None]
    picture = np.tile((1 - part) * RED + part * np.array([0.5, 0.36, 0.3]), (H, 1, 1))
    picture[:20] = GREY
    found = answer(document_of(monkeypatch, picture))
    assert found.floods
    assert any("more than one thing" in line for line in found.lines("p1"))
    wall = np.tile(RED, (H, W, 1))
    wall[:20] = GREY
    assert not answer(document_of(monkeypatch, wall)).floods


@pytest.mark.parametrize(
    ("gap", "elsewhere", "proposed"), [(3, False, True), (12, False, False), (3, True, False)]
)
def test_a_proposed_box_adds_the_rest_of_the_thing(
    monkeypatch: pytest.MonkeyPatch, gap: int, elsewhere: bool, proposed: bool
) -> None:
    """The dark part behind a narrow line may be the thing's, if nothing else has its colour."""
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 60 + gap : 100] = 0.35 * RED
    if elsewhere:
        picture[30:90, 150:190] = 0.35 * RED
    document = document_of(monkeypatch, picture)
    part = answer(document).part
    assert (part is not None) == proposed
    if part is None:
        return
    assert 60 <= part.pixel[0] < 100
    assert part.share == pytest.approx(0.092, abs=0.005)
    document.add_area("p1", Area(0, (part.pixel,), part.box / 2))
    again = document.answer("p1")
    assert again is not None
    assert again.share == pytest.approx(part.left, abs=0.01)
    assert again.share > 0.17


@pytest.mark.parametrize(("columns", "proposed"), [(2, True), (6, False)])
def test_a_proposed_hold_costs_the_thing_little(
    monkeypatch: pytest.MonkeyPatch, columns: int, proposed: bool
) -> None:
    """Some of the thing's 40 columns have the other thing's colour, which the hold keeps."""
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 140:180] = picture[30:90, 60 - columns : 60] = RUST
    document = document_of(monkeypatch, picture)
    document.pick(0, pixel=(30.0, 60.0), box=9, to="#2040b0", reach=8)
    found = document.answer("p1")
    assert found is not None
    assert found.other is not None
    assert (found.hold is not None) == proposed


@pytest.mark.parametrize("borders", [2, 3])
def test_a_region_along_three_borders_may_be_too_much(
    monkeypatch: pytest.MonkeyPatch, borders: int
) -> None:
    """A fifth of it is far from the picked colour: too much of a large region alone."""
    y, x = np.mgrid[:H, :W]
    part = np.where(x < 20, y, np.where(y >= H - 20, H + x, np.nan))
    if borders == 3:
        part = np.where((x >= W - 20) & (y < H - 20), H + W + H - y, part)
    region = np.isfinite(part)
    picture = np.tile(GREY, (H, W, 1))
    along = (part[region] / np.nanmax(part))[:, None]
    picture[region] = (1 - along) * RED + along * np.array([0.5, 0.36, 0.3])
    found = answer(document_of(monkeypatch, picture), (10.0, 20.0))
    assert found.share < 0.4
    assert found.floods == (borders == 3)


def test_a_hold_has_a_share_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    document = document_of(monkeypatch, picture)
    hold = document.hold(0, pixel=(40.0, 60.0), box=9)
    found = document.answer(hold.id)
    assert found is not None
    assert found.share == pytest.approx(0.1, abs=0.01)
    assert found.hold is None


def test_areas_of_the_frame_are_the_picked_thing(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = np.tile(GREY, (H, W, 1))
    picture[30:90, 20:60] = RED
    picture[30:90, 140:180] = RED
    document = document_of(monkeypatch, picture)
    assert answer(document).others > 0.05
    document.add_area("p1", Area(0, ((160.0, 60.0),), 4.0))
    found = document.answer("p1")
    assert found is not None
    assert found.others < 0.005


def test_without_the_clip_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    document = document_of(monkeypatch, np.tile(GREY, (H, W, 1)))
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: None)
    document.pick(0, colour=(0.7, 0.1, 0.1), to="#2040b0")
    assert document.answer("p1") is None
