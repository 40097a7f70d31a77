"""Following a window: a textured thing that moves before another texture, both still and moving."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from palette4d.common.errors import Palette4dError
from palette4d.grade import follow, follow_window
from palette4d.grade.keyframes import MOST_KEYS
from palette4d.grade.picks import Box, Pick, Window, WindowKey
from palette4d.media.array_clip import ArrayClip

H, W, SIDE, FRAMES = 135, 240, 40, 24
F64 = NDArray[np.float64]


def texture(seed: int, height: int, width: int, size: float) -> F64:
    rough = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(height, width)), size)
    return np.asarray(0.5 + 0.12 * rough / rough.std())


def place(frame: float) -> F64:
    """Left and top of the thing: not in whole pixels, and not on a line."""
    return np.array([30 + 4.3 * frame + 6 * np.sin(frame / 4), 30 + 1.6 * frame])


def picture(frame: int, zoom: float = 0, light: float = 0, shown: bool = True) -> F64:
    back, thing = texture(1, H, W, 5), texture(2, SIDE, SIDE, 2.5)
    y, x = np.mgrid[:H, :W] + 0.5
    left, top = place(frame)
    grown = 1 + zoom * frame
    places = [
        (at - first - SIDE / 2) / grown + SIDE / 2 - 0.5 for at, first in ((y, top), (x, left))
    ]
    inside = np.hypot(places[0] - SIDE / 2 + 0.5, places[1] - SIDE / 2 + 0.5) < 0.45 * SIDE
    if shown:
        back = np.where(inside, ndimage.map_coordinates(thing, places, mode="nearest"), back)
    return back * (1 - light * frame / FRAMES)


def clip_of(pictures: list[F64], noise: float = 0.01) -> ArrayClip:
    rng = np.random.default_rng(0)
    grey = np.array(pictures)[..., None] + noise * rng.normal(size=(len(pictures), H, W, 3))
    return ArrayClip(np.clip(grey, 0, 1).astype(np.float32))


def box(frame: float, size: float = SIDE) -> Box:
    left, top = (place(frame) + (SIDE - size) / 2).tolist()
    return left, top, left + size, top + size


def off(keys: tuple[WindowKey, ...], frame: float) -> float:
    """Return how far the middle of a followed box is from that of the thing, in pixels."""
    found = Window(0, keys).box_at(frame)
    return float(np.linalg.norm((found[:2] + found[2:]) / 2 - place(frame) - SIDE / 2))


@pytest.mark.parametrize(("zoom", "light"), [(0, 0), (0.01, 0), (0, 0.6)])
@pytest.mark.parametrize("frame", [0, 11])
def test_a_thing_is_followed_both_ways(frame: int, zoom: float, light: float) -> None:
    clip = clip_of([picture(t, zoom, light) for t in range(FRAMES)])
    keys = follow_window.boxes(clip, {frame: box(frame)}, (0, FRAMES - 1))
    assert (keys[0].frame, keys[-1].frame) == (0, FRAMES - 1)
    assert max(off(keys, t) for t in range(FRAMES)) < 1.5
    assert [key.frame for key in keys if key.given] == [frame]
    assert len(keys) <= MOST_KEYS + 3


def test_a_still_box_stays_and_drifts_nowhere() -> None:
    clip = clip_of([picture(5) for _ in range(FRAMES)], noise=0.03)
    keys = follow_window.boxes(clip, {7: box(5)}, (0, FRAMES - 1))
    assert max(np.abs(np.subtract(key.box, box(5))).max() for key in keys) < 0.5


def test_only_the_range_is_read() -> None:
    clip, seen = clip_of([picture(t) for t in range(FRAMES)]), []
    keys = follow_window.boxes(
        clip, {9: box(9)}, (8, 14), progress=lambda done, total: seen.append((done, total))
    )
    assert (keys[0].frame, keys[-1].frame) == (8, 14)
    assert seen == [(done, 7) for done in range(1, 8)]


def test_a_long_range_is_read_in_part(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(follow_window, "MOST_FRAMES", 12)
    assert follow.MOST_FRAMES == 600
    clip, seen = clip_of([picture(t) for t in range(FRAMES)]), []
    keys = follow_window.boxes(
        clip, {0: box(0)}, (0, FRAMES - 1), progress=lambda done, total: seen.append(total)
    )
    assert seen[-1] == 13
    assert max(off(keys, t) for t in range(FRAMES)) < 2


def test_more_given_boxes_than_frames_that_are_read_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(follow, "MOST_FRAMES", 12)
    clip = clip_of([picture(t) for t in range(FRAMES)])
    with pytest.raises(Palette4dError, match=r"found 13 frames where boxes .* at most 12"):
        follow_window.boxes(clip, {t: box(t) for t in range(13)}, (0, FRAMES - 1))


@pytest.mark.parametrize("box", [(1, 100, 6, 120), (0, 0, 8, 20000)])
def test_of_a_tall_picture_no_more_pixels_are_kept_than_of_another(
    monkeypatch: pytest.MonkeyPatch, box: Box
) -> None:
    monkeypatch.setattr(follow_window, "WIDTH", 100)
    kept, middles = [], follow_window._middles

    def seen(greys: list[NDArray[np.int8]], *rest: object) -> object:
        kept.extend(grey.size for grey in greys)
        return middles(greys, *rest)

    monkeypatch.setattr(follow_window, "_middles", seen)
    pictures = np.random.default_rng(1).random((3, 20000, 8, 3), np.float32)
    keys = follow_window.boxes(ArrayClip(pictures), {1: box}, (0, 2))
    assert max(kept) <= 100**2
    assert any(key.box == box for key in keys)


def test_given_boxes_are_met_and_their_size_is_between() -> None:
    clip = clip_of([picture(t) for t in range(FRAMES)])
    given = {4: box(4), 20: box(20, 60)}
    keys = follow_window.boxes(clip, given, (0, FRAMES - 1))
    window = Window(0, keys)
    for frame, known in given.items():
        assert window.box_at(frame) == pytest.approx(known)
    for frame, size in ((0, SIDE), (12, 50), (16, 55), (23, 60)):
        left, top, right, bottom = window.box_at(frame)
        assert (right - left, bottom - top) == pytest.approx((size, size), abs=0.5)
        assert off(keys, frame) < 1.5


def test_where_the_thing_is_gone_the_box_stays_and_says_so() -> None:
    cut = [picture(t) if t < 15 else texture(9, H, W, 1.5) for t in range(FRAMES)]
    keys = follow_window.boxes(clip_of(cut), {3: box(3)}, (0, FRAMES - 1))
    pick = Pick("p1", "pick", 3, (0, 0, 0), (1, 1, 1), window=Window(0, keys))
    assert pick.lost((0, FRAMES - 1, 1)) == (None, 15)
    assert off(keys, 14) < 1.5
    assert Window(0, keys).box_at(23) == pytest.approx(Window(0, keys).box_at(14), abs=0.5)


def test_a_short_disappearance_is_bridged() -> None:
    clip = clip_of([picture(t, shown=t not in (10, 11)) for t in range(FRAMES)])
    keys = follow_window.boxes(clip, {3: box(3)}, (0, FRAMES - 1))
    assert keys[-1].frame == FRAMES - 1
    assert max(off(keys, t) for t in range(FRAMES)) < 2.5


def test_a_box_beyond_the_picture_moves_with_it() -> None:
    wide = texture(3, H + 60, W + 60, 4)
    clip = clip_of([wide[10 + t : 10 + t + H, 5 + 2 * t : 5 + 2 * t + W] for t in range(20)])
    keys = follow_window.boxes(clip, {0: (-500, -400, 900, 60)}, (0, 19))
    assert Window(0, keys).box_at(19) == pytest.approx((-538, -419, 862, 41), abs=1)
    # Without anything in the picture there is nothing to follow.
    keys = follow_window.boxes(clip, {0: (-500, -400, -300, -60)}, (0, 19))
    assert [key.box for key in keys] == [(-500, -400, -300, -60)] * 2
    assert Pick("p1", "pick", 0, (0, 0, 0), window=Window(0, keys)).lost((0, 19, 1)) == (None, 1)


def test_a_box_that_ends_at_the_pictures_edge_has_room_there() -> None:
    wide = texture(3, H + 60, W + 60, 4)
    clip = clip_of([wide[10:145, 35 - t : 35 - t + W] for t in range(20)])
    keys = follow_window.boxes(clip, {0: (0, 20, 80, 100)}, (0, 19))
    assert keys[0].box == (0, 20, 80, 100)
    assert Window(0, keys).box_at(19) == pytest.approx((19 - 20, 20, 80 + 19, 100), abs=1)


def test_a_flat_box_is_lost_at_once() -> None:
    clip = clip_of([np.full((H, W), 0.5) for _ in range(5)])
    keys = follow_window.boxes(clip, {0: (20, 20, 60, 60)}, (0, 4))
    assert Pick("p1", "pick", 0, (0, 0, 0), window=Window(0, keys)).lost((0, 4, 1)) == (None, 1)


def test_the_same_frames_give_the_same_keys() -> None:
    clip = clip_of([picture(t) for t in range(FRAMES)])
    first, again = (follow_window.boxes(clip, {3: box(3)}, (0, FRAMES - 1)) for _ in range(2))
    assert first == again
