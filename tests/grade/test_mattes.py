"""Mattes of picks: learned from a clip, kept as text, and the curve to display code values."""

from __future__ import annotations

import base64
import zlib
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import palette4d
from palette4d import _core
from palette4d.colour.difference import viewing_of
from palette4d.common.errors import Palette4dError
from palette4d.grade import mattes
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.document import Document
from palette4d.grade.picks import Area, Pick
from palette4d.media.array_clip import ArrayClip
from palette4d.media.clip_base import Clip

F32 = NDArray[np.float32]
FRAMES, H, W = 6, 90, 160
CLICK = (60.0, 45.0)
COAT, DOOR, WALL = np.array([[0.7, 0.12, 0.15], [0.62, 0.3, 0.12], [0.55, 0.57, 0.6]])


def picture(frame: int) -> F32:
    """A lit and a shaded red coat before a grey wall; an orange door far from it."""
    rng = np.random.default_rng(frame)
    out = np.tile(WALL, (H, W, 1))
    out[20:80, 110:150] = DOOR
    light = np.linspace(1.1, 0.4, 40)[None, :, None]
    out[25:75, 40 + frame : 80 + frame] = COAT * light
    out += rng.normal(size=out.shape) * 0.01
    return np.clip(out, 0, 1).astype(np.float32)


@pytest.fixture(scope="module")
def pictures() -> F32:
    return np.stack([picture(frame) for frame in range(FRAMES)])


@pytest.fixture
def document(pictures: F32, monkeypatch: pytest.MonkeyPatch) -> Document:
    clip: Clip = ArrayClip(pictures)
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: clip)
    found: Document = palette4d.analyze(pictures, vertices=12)
    return found


def moved(document: Document, image: F32, frame: int = 0) -> NDArray[np.float64]:
    """How much each pixel changes."""
    found = document.recolour(image, frame, clean_up=0).astype(np.float64) - image
    return np.linalg.norm(found, axis=2)


def test_lights_and_shadows_change_and_other_things_stay(document: Document, pictures: F32) -> None:
    document.pick(0, pixel=CLICK, box=9, to="#2040b0")
    for frame in (0, 3, 5):
        image = pictures[frame]
        after = document.recolour(image, frame)
        coat = after[30:70, 45 + frame : 75 + frame]
        assert (coat[..., 2] > coat[..., 0]).all()  # blue, also in the shadow
        assert moved(document, image, frame)[:, :30].max() < 0.02  # wall
        assert np.median(moved(document, image, frame)[25:75, 115:145]) < 0.02  # door


def test_a_pick_meets_its_target_whatever_handles_do(document: Document) -> None:
    pick = document.pick(0, pixel=CLICK, box=9, to="#2040b0")
    document.adjust(chroma=0.2)
    image = np.array(pick.rgb, np.float32)[None, None]
    assert pick.to is not None
    np.testing.assert_allclose(document.recolour(image, 0)[0, 0], pick.to, atol=1e-4)


def test_a_hold_keeps_a_thing_while_the_palette_loses_its_colour(
    document: Document, pictures: F32
) -> None:
    document.adjust(chroma=0)
    document.hold(0, pixel=CLICK, box=9)
    change = moved(document, pictures[0])
    assert np.quantile(change[30:70, 45:75], 0.95) < 0.05
    assert np.median(change[25:75, 115:145]) > 0.1


def test_a_hold_of_a_box_keeps_what_is_connected_with_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A face beside a shirt of nearly its hue, from light to dark: held at its light side."""
    rng = np.random.default_rng(1)
    frame = np.tile(WALL, (H, W, 1))
    frame[60:, 20:140] = COAT
    light = np.linspace(1.25, 0.7, 40)[None, :, None]
    frame[10:60, 60:100] = np.array([0.68, 0.36, 0.28]) * light
    images = np.clip(frame + rng.normal(size=(2, H, W, 3)) * 0.01, 0, 1).astype(np.float32)
    clip: Clip = ArrayClip(images)
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: clip)
    found: Document = palette4d.analyze(images, vertices=12)
    found.pick(0, pixel=(40.0, 75.0), box=9, to="#2040b0")
    found.hold(0, pixel=(66.0, 30.0), box=7)
    change = moved(found, images[0])
    assert np.quantile(change[15:52, 62:98], 0.95) < 0.08
    assert np.median(change[65:, 25:135]) > 0.4


def test_an_area_adds_a_part(document: Document, pictures: F32) -> None:
    document.pick(0, pixel=CLICK, box=9, to="#2040b0")
    image = pictures[0]
    before = np.median(moved(document, image)[25:75, 115:145])
    document.add_area("p1", Area(0, ((115.0, 40.0), (145.0, 60.0)), 4.0))
    assert np.median(moved(document, image)[25:75, 115:145]) > before + 0.1
    with pytest.raises(Palette4dError, match="outside the picture"):
        document.add_area("p1", Area(0, ((1e6, 0.0),), 4.0))


@pytest.mark.parametrize("has_coat", [True, False])
def test_a_copy_learns_again_in_the_other_clip(
    document: Document, pictures: F32, monkeypatch: pytest.MonkeyPatch, has_coat: bool
) -> None:
    document.pick(0, pixel=CLICK, box=9, to=(0.1, 0.25, 0.8))
    mirrored = np.ascontiguousarray(pictures[:, :, ::-1])
    # A rose wall, near the coat's hue: the first clip's matte has not learned that it stays.
    mirrored[np.abs(mirrored - WALL).max(axis=3) < 0.06] += np.float32([0.1, -0.05, -0.05])
    coat = (mirrored[..., 0] > 2.5 * mirrored[..., 1]) & (mirrored[..., 0] > 0.25)
    if not has_coat:
        mirrored[coat] = np.float32(WALL) + np.float32([0.1, -0.05, -0.05])
    other: Document = palette4d.analyze(mirrored, vertices=12)
    clip: Clip = ArrayClip(mirrored)
    monkeypatch.setattr("palette4d.grade.clip_of_picks.find_clip", lambda *_: clip)
    fit = other.copy_from(document)
    if not has_coat:
        assert not other.grade.picks
        assert "p1" in str(fit)  # said, not dropped in silence
        assert np.abs(other.recolour(mirrored[0], 0) - mirrored[0]).max() < 0.02
        return
    (pick,) = other.grade.picks
    assert pick.matte != document.grade.picks[0].matte
    assert pick.pixel is not None
    assert coat[0][pick.pixel[1], pick.pixel[0]]
    change = moved(other, mirrored[0])
    assert change[coat[0]].mean() > 0.3
    assert change[5:15].max() < 0.04  # the wall
    assert change[25:75, 15:45].mean() < 0.04  # the door


def test_equal_picks_learn_equal_mattes(document: Document) -> None:
    first = document.pick(0, pixel=CLICK, box=9, to="#2040b0").matte
    second = document.pick(0, pixel=CLICK, box=9, to="#20b040").matte
    assert first == second
    assert list(document.fields()["mattes"]["grids"]) == [first]


def test_holds_that_are_disabled_are_not_learned_from(document: Document) -> None:
    alone = document.pick(0, pixel=CLICK, box=9, to="#2040b0").matte
    hold = document.hold(0, pixel=(130.0, 50.0), box=9)
    assert document.grade.pick("p1").matte != alone
    document.change_pick(hold.id, enabled=False)
    assert document.grade.pick("p1").matte == alone


def test_mattes_that_nothing_uses_are_left_out(document: Document) -> None:
    document.pick(0, pixel=CLICK, box=9, to="#2040b0")
    document.undo()
    assert "mattes" in document.fields()  # redo needs it
    document.forget_history()
    assert "mattes" not in document.fields()


def test_a_colour_without_a_place_is_looked_for(document: Document) -> None:
    r, g, b = (COAT * 0.8).tolist()
    placed = document.pick(0, colour=(r, g, b), to="#2040b0")
    assert placed.matte is not None
    nowhere = document.pick(0, colour=(0.1, 0.9, 0.9), to="#2040b0", follow=False)
    assert nowhere.matte is None  # nothing to learn: all of its hue


def test_all_of_a_hue_learns_nothing(document: Document) -> None:
    assert document.pick(0, pixel=CLICK, box=9, to="#2040b0", whole_hue=True).matte is None


@pytest.mark.parametrize(
    "rgb", [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.5, 0.5, 0.5), (0.02, 0.01, 0.0), (1.4, 1.2, 1.1)]
)
def test_black_white_and_grey_meet_their_targets(
    document: Document, rgb: tuple[float, float, float]
) -> None:
    document.pick(0, colour=rgb, by=(0.1, 0.05, -0.05), follow=False)
    image = np.array(rgb, np.float32)[None, None]
    found = document.recolour(image, 0, clean_up=0)[0, 0] - image[0, 0]
    np.testing.assert_allclose(found, (0.1, 0.05, -0.05), atol=1e-4)


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (64, 64)])
def test_frames_of_one_colour_and_tiny_frames(size: tuple[int, int]) -> None:
    frame = np.full((*size, 3), 0.4, np.float32)
    frame[..., 0] = 0.6
    given = [(frame, (0.6, 0.4, 0.4), [([(0.0, 0.0)], 0.5)], [], True)]
    found = _core.learn_matte(given, (0.6, 0.4, 0.4))
    assert found["found"]
    assert found["odds"].max() <= 126


def test_a_frame_of_nothing() -> None:
    frame = np.full((8, 8, 3), np.nan, np.float32)
    given = [(frame, (0.6, 0.4, 0.4), [([(2.0, 2.0)], 1.0)], [], True)]
    assert not _core.learn_matte(given, (0.6, 0.4, 0.4))["found"]


def test_text_is_a_zlib_stream_of_differences() -> None:
    odds = _core.hue_matte((0.7, 0.2, 0.1))
    learned, other = (mattes.Learned(each.reshape(-1), True) for each in (odds, 126 - odds))
    steps = np.frombuffer(zlib.decompress(base64.b64decode(learned.text)), np.uint8)
    np.testing.assert_array_equal(np.cumsum(steps, dtype=np.uint8), odds.reshape(-1))
    np.testing.assert_array_equal(mattes.odds_of(learned.text), odds.reshape(-1))
    assert learned.id == mattes.Learned(learned.odds.copy(), True).id != other.id


def test_a_colour_of_two_things_is_whose_it_more_certainly_is() -> None:
    own, other = np.array([100, 80, 63], np.uint8), np.array([40, 90, 120], np.uint8)
    left = mattes.Learned(own, True).against([other])
    np.testing.assert_array_equal(left.odds, [100, 40, 0])
    assert mattes.Learned(own, True).against([]).odds is own


def test_a_learned_matte_is_small(document: Document) -> None:
    document.pick(0, pixel=CLICK, box=9, to="#2040b0")
    [text] = document.fields()["mattes"]["grids"].values()
    assert len(text) < 25_000


@pytest.mark.parametrize("encoding", ["sRGB", "Rec.709", "unknown", ""])
def test_display_encodings_need_no_curve(encoding: str) -> None:
    assert mattes.display_curve(encoding) is None


@pytest.mark.parametrize("encoding", ["ACEScct", "ACEScg", "ARRI LogC4", "Rec.2100-PQ - Display"])
def test_other_encodings_lead_to_display_code_values(encoding: str) -> None:
    curve = mattes.display_curve(encoding)
    assert curve is not None
    start, end, values = curve
    assert start == 0 < end
    assert min(np.diff(values)) >= 0
    assert values[-1] >= 0.99
    exact, codes = viewing_of(encoding).to_srgb, np.random.default_rng(0).uniform(start, end, 500)
    assert exact is not None
    shown = np.asarray(exact(np.repeat(codes[:, None], 3, axis=1)))[:, 1].clip(0)
    found = np.interp(codes, np.linspace(start, end, len(values)), values)
    assert found == pytest.approx(shown, abs=1 / 255)


def test_a_log_clip_is_told_apart_as_its_picture_is(pictures: F32) -> None:
    """The same pictures in ACEScct: the pick takes the same display colours."""
    curve = mattes.display_curve("ACEScct")
    assert curve is not None
    start, end, values = curve
    codes = np.linspace(start, end, len(values))
    log = np.stack([np.interp(p, values, codes) for p in pictures]).astype(np.float32)
    taken = []
    for image, display in ((pictures[0], None), (log[0], curve)):
        box = image[41:50, 56:65].reshape(-1, 3).mean(axis=0, dtype=np.float64)
        r, g, b = box.tolist()
        pick = Pick("p1", "pick", 0, (r, g, b), (0.1, 0.2, 0.7), pixel=CLICK, box=9)
        learned = mattes.learn(pick, (), [0], {0: image}.__getitem__, display)
        assert learned.seen
        taken.append(learned.odds > learned.odds.max() / 2)
    either, both = np.any(taken, axis=0), np.all(taken, axis=0)
    assert both.sum() > 0.95 * either.sum()


@pytest.mark.parametrize("kind", ["pick", "hold"])
def test_a_sidecar_that_names_each_frame_does_not_fill_the_memory(
    document: Document, pictures: F32, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """A small file may have 100,000 areas; picks already learned keep no frames either."""
    monkeypatch.setattr(mattes, "MOST_SAMPLES", pictures[0].size)
    areas = [Area(frame, ((60.0, 45.0),), 4.0) for frame in range(FRAMES)]
    make = document.pick if kind == "pick" else document.hold
    change = {"to": "#2040b0"} if kind == "pick" else {}
    with pytest.raises(Palette4dError, match=f"{FRAMES} frames, .* at most 4 of this size"):
        make(0, pixel=CLICK, box=9, areas=areas, follow=False, **change)
    assert not document.grade.picks
    make(0, pixel=CLICK, box=9, areas=areas[:2], follow=False, until=1, **change)
    clip = ClipOfPicks.of(document.grade)
    for frame in range(FRAMES):
        np.testing.assert_array_equal(clip.read(frame), pictures[frame])
    assert list(clip._read) == [2, 3, 4, 5]


def test_frames_that_a_hold_marks_are_read(pictures: F32) -> None:
    """Its colour is background where it was marked, whichever frame the pick was made in."""
    pick = Pick("p1", "pick", 0, tuple(COAT.tolist()), to=(0.1, 0.2, 0.7), pixel=CLICK, box=9)
    pick = replace(pick, until=0)
    area = Area(5, ((130.0, 50.0),), 4.0)
    hold = Pick("p2", "hold", 5, tuple(DOOR.tolist()), areas=(area,))
    frames: list[int] = []

    def read(frame: int) -> F32:
        frames.append(frame)
        return pictures[frame]

    mattes.learn(pick, [hold], range(FRAMES), read, None)
    assert frames == [0, 5]
