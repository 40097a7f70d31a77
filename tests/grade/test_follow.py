"""Following a colour: a fountain that turns to red and back, still pictures, given colours."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from palette4d.common.errors import Palette4dError
from palette4d.grade import follow
from palette4d.grade.keyframes import MOST_KEYS
from palette4d.grade.picks import PathKey
from palette4d.media.array_clip import ArrayClip

FRAMES = 43
MINT, YELLOW, RED = np.array([[0.55, 0.95, 0.75], [0.95, 0.85, 0.3], [0.9, 0.2, 0.2]])


def fountain(frame: float) -> NDArray[np.float64]:
    """Mint, by yellow to red at the middle, and back."""
    u = 1 - np.cos(2 * np.pi * frame / (FRAMES - 1))
    colour: NDArray[np.float64] = (
        MINT + u * (YELLOW - MINT) if u < 1 else YELLOW + (u - 1) * (RED - YELLOW)
    )
    return colour


@pytest.fixture(scope="module")
def clip() -> ArrayClip:
    """The fountain before a still sky and meadow, all with grain."""
    rng = np.random.default_rng(0)
    still = np.empty((90, 160, 3))
    still[:50] = np.array([0.45, 0.6, 0.85]) + rng.normal(size=(50, 160, 3)) * [0.1, 0.1, 0.05]
    still[50:] = np.array([0.3, 0.5, 0.2]) + 0.08 * rng.normal(size=(40, 160, 1))
    frames = np.empty((FRAMES, 90, 160, 3), np.float32)
    for frame in range(FRAMES):
        picture = still + 0.01 * rng.normal(size=still.shape)
        picture[30:60, 60:100] = fountain(frame) + 0.04 * rng.normal(size=(30, 40, 1))
        frames[frame] = np.clip(picture, 0, 1)
    return ArrayClip(frames)


def at(path: tuple[PathKey, ...], frame: float) -> NDArray[np.float64]:
    frames = [key.frame for key in path]
    return np.array([np.interp(frame, frames, c) for c in np.transpose([k.rgb for k in path])])


def start(frame: int) -> tuple[int, tuple[float, float, float]]:
    r, g, b = fountain(frame).tolist()
    return frame, (r, g, b)


@pytest.mark.parametrize(
    ("frame", "span"),
    [(0, (0, 42)), (10, (0, 42)), (21, (0, 42)), (42, (0, 42)), (2, (24, 30)), (40, (12, 18))],
)
def test_the_fountain_is_followed_both_ways(
    clip: ArrayClip, frame: int, span: tuple[int, int]
) -> None:
    path = follow.paths(clip, [start(frame)], span)
    first, last = min(frame, *span), max(frame, *span)
    assert (path[0].frame, path[-1].frame) == (first, last)
    off = [np.linalg.norm(at(path, t) - fountain(t)) for t in range(first, last + 1)]
    assert max(off) < 0.12
    np.testing.assert_allclose(at(path, frame), fountain(frame), atol=1e-4)
    assert [key.frame for key in path if key.given] == [frame]


@pytest.mark.parametrize("colour", [(0.3, 0.5, 0.2), (0.45, 0.6, 0.85), (0.36, 0.56, 0.26)])
def test_a_still_colour_stays(clip: ArrayClip, colour: tuple[float, float, float]) -> None:
    path = follow.paths(clip, [(20, colour)], (0, FRAMES - 1))
    assert max(np.linalg.norm(np.array(key.rgb) - colour) for key in path) < 0.05


def test_only_the_range_is_read(clip: ArrayClip) -> None:
    seen: list[tuple[int, int]] = []
    path = follow.paths(
        clip, [start(10)], (8, 14), progress=lambda done, total: seen.append((done, total))
    )
    assert (path[0].frame, path[-1].frame) == (8, 14)
    assert seen == [(done, 7) for done in range(1, 8)]


def test_given_colours_are_met_and_joined(clip: ArrayClip) -> None:
    wrong = (0.3, 0.5, 0.2)  # another object, so that the ways differ
    path = follow.paths(clip, [start(0), (20, wrong)], (0, 30))
    np.testing.assert_allclose(at(path, 0), fountain(0), atol=1e-4)
    np.testing.assert_allclose(at(path, 20), wrong, atol=1e-4)
    np.testing.assert_allclose(at(path, 30), wrong, atol=0.05)
    between = np.linalg.norm(at(path, 10) - (fountain(10) + wrong) / 2)
    assert between < 0.1
    assert [key.frame for key in path if key.given] == [0, 20]


def test_few_keys_and_little_memory(clip: ArrayClip, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(follow, "MOST_FRAMES", 12)  # every fourth, and the last one
    seen: list[tuple[int, int]] = []
    path = follow.paths(
        clip,
        [start(21)],
        (0, FRAMES - 1),
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen[-1][1] <= 14
    assert len(path) <= MOST_KEYS + 1
    assert path[-1].frame == FRAMES - 1


def test_more_given_colours_than_frames_that_are_read_are_refused(
    clip: ArrayClip, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The time grows with their third power: 20,000, as a sidecar may have, took hours."""
    monkeypatch.setattr(follow, "MOST_FRAMES", 15)
    follow.paths(clip, [start(frame) for frame in range(15)], (0, FRAMES - 1))
    with pytest.raises(Palette4dError, match=r"found 16 frames where colours .* at most 15"):
        follow.paths(clip, [start(frame) for frame in range(16)], (0, FRAMES - 1))


def test_a_frame_that_the_clip_lacks_is_an_error(clip: ArrayClip) -> None:
    with pytest.raises(Palette4dError, match="no frame 99"):
        follow.paths(clip, [(99, (0.5, 0.5, 0.5))], (0, 42))


def test_a_path_ends_where_all_is_dark() -> None:
    picture = np.full((60, 80, 3), (0.5, 0.6, 0.7))
    picture[20:26, 30:36] = (0.8, 0.15, 0.1)
    light = np.clip(np.linspace(1.5, -0.5, 40), 0, 1)[:, None, None, None]
    grain = 0.01 * np.random.default_rng(3).normal(size=(40, *picture.shape))
    clip = ArrayClip(np.clip(light * picture + grain, 0, 1).astype(np.float32))
    path = follow.paths(clip, [(2, (0.8, 0.15, 0.1))], (0, 39))
    frames, there = [key.frame for key in path], [key.there for key in path]
    assert np.interp(15, frames, there) > 0.98  # still to be seen
    assert np.interp([34, 39], frames, there).max() == 0
    assert np.abs(np.diff(np.interp(range(40), frames, there))).max() < 0.3  # a fade
    sky = follow.paths(clip, [(2, (0.5, 0.6, 0.7))], (0, 39))
    assert all(key.there == 1 for key in sky)  # most of the picture, and still is


def test_what_enters_later_changes_nothing_before() -> None:
    """Without the car, a few other pixels are near its colour."""
    rng = np.random.default_rng(1)
    frames = np.empty((20, 60, 100, 3), np.float32)
    for frame in range(20):
        frames[frame] = [0.3, 0.45, 0.55] + 0.03 * rng.normal(size=(60, 100, 3))
        frames[frame, :2, :6] = [0.47, 0.3, 0.3]
        if frame >= 10:
            frames[frame, 20:40, 30:60] = [0.52, 0.26, 0.26] + 0.02 * rng.normal(size=(20, 30, 3))
    path = follow.paths(ArrayClip(frames), [(15, (0.52, 0.26, 0.26))], (0, 19))
    there = np.interp(range(20), [key.frame for key in path], [key.there for key in path])
    assert not there[:7].any()
    assert (there[13:] == 1).all()


@pytest.mark.parametrize("changed", ["light", "thing"])
def test_a_path_ends_on_a_thing_of_another_size(changed: str) -> None:
    """What gets darker is followed; what goes over into a larger thing of another colour is not."""
    rng = np.random.default_rng(5)
    start, end = np.array([0.8, 0.2, 0.15]), np.array([0.25, 0.06, 0.05])
    frames = np.empty((30, 60, 100, 3), np.float32)
    for i in range(30):
        frames[i] = [0.35, 0.5, 0.6]
        colour = start + (end - start) * i / 29
        size = 10 if changed == "light" else 10 + 12 * i // 29
        frames[i, 20 : 20 + size, 30 : 30 + size] = colour
    frames += 0.01 * rng.normal(size=frames.shape).astype(np.float32)
    path = follow.paths(ArrayClip(frames), [(0, (0.8, 0.2, 0.15))], (0, 29))
    there = np.interp(range(30), [key.frame for key in path], [key.there for key in path])
    assert there[0] == 1
    assert there[29] == (1 if changed == "light" else 0)


def test_small_errors_do_not_add_up() -> None:
    """Without its way home the colour would drift along the gradient, by the grain."""
    still = np.full((8, 12, 3), (0.2, 0.5, 0.3))
    still[..., 0] = np.linspace(0.1, 0.9, 12)
    grain = 0.06 * np.random.default_rng(1).normal(size=(300, *still.shape))
    clip = ArrayClip(np.clip(still + grain, 0, 1).astype(np.float32))
    path = follow.paths(clip, [(0, (0.5, 0.5, 0.3))], (0, 299))
    assert max(np.linalg.norm(np.subtract(key.rgb, (0.5, 0.5, 0.3))) for key in path) < 0.05


def test_a_flash_of_another_colour_is_not_followed() -> None:
    frames = np.empty((24, 40, 60, 3), np.float32)
    frames[:] = [0.2, 0.3, 0.7]
    frames[:, 10:30, 10:40] = [0.6, 0.3, 0.2]
    frames[12:14, 10:30, 10:40] = [0.6, 0.6, 0.2]
    path = follow.paths(ArrayClip(frames), [(2, (0.6, 0.3, 0.2))], (0, 23))
    assert max(np.linalg.norm(np.subtract(key.rgb, (0.6, 0.3, 0.2))) for key in path) < 0.02


def test_a_colour_that_comes_back_is_there_again() -> None:
    picture = np.full((40, 60, 3), (0.5, 0.6, 0.7))
    picture[10:16, 10:16] = (0.8, 0.15, 0.1)
    light = np.clip(np.abs(np.linspace(-1.5, 1.5, 40)), 0, 1)[:, None, None, None]
    grain = 0.01 * np.random.default_rng(3).normal(size=(40, *picture.shape))
    clip = ArrayClip(np.clip(light * picture + grain, 0, 1).astype(np.float32))
    path = follow.paths(clip, [(2, (0.8, 0.15, 0.1))], (0, 39))
    there = np.interp([2, 20, 38], [key.frame for key in path], [key.there for key in path])
    assert there.tolist() == [1, 0, 1]


def test_what_has_become_another_thing_does_not_come_back_by_its_size() -> None:
    rng = np.random.default_rng(5)
    start, end = np.array([0.8, 0.2, 0.15]), np.array([0.25, 0.06, 0.05])
    frames = np.empty((45, 60, 100, 3), np.float32)
    for i in range(45):
        part = min(i, 29) / 29
        frames[i] = [0.35, 0.5, 0.6]
        size = 10 + 12 * min(i, 29) // 29 if i < 30 else max(10, 22 - 3 * (i - 29))
        frames[i, 20 : 20 + size, 30 : 30 + size] = start + (end - start) * part
    frames += 0.01 * rng.normal(size=frames.shape).astype(np.float32)
    path = follow.paths(ArrayClip(frames), [(0, (0.8, 0.2, 0.15))], (0, 44))
    there = np.interp(range(45), [key.frame for key in path], [key.there for key in path])
    assert there[0] == 1
    assert there[29:].max() == 0
