"""Sudden cuts are found at cuts, and not in flashes, fades, motion or noise."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
from any_clips import harbour, landscape, linear
from palette4d.analysis.colour_statistics import gather
from palette4d.analysis.frame_statistics import FrameStatistics
from palette4d.analysis.options import AnalysisOptions

from palette4d.media import cuts
from palette4d.media.clip import open_clip
from palette4d.media.colour_histogram import histogram


def gathered(pictures, first: int = 0, step: int = 1) -> list[FrameStatistics]:
    """Return the statistics of (h, w, 3) pictures."""
    return [
        gather(first + step * i, np.ascontiguousarray(p, np.float32), AnalysisOptions())
        for i, p in enumerate(pictures)
    ]


def pairs(frames):
    """Return what cuts are found by."""
    return [(frame.frame, frame.histogram) for frame in frames]


def found(pictures, first: int = 0, step: int = 1) -> list[int]:
    """Return the cuts of (h, w, 3) pictures."""
    return cuts.find_cuts(pairs(gathered(pictures, first, step)))


def frames(count: int) -> list:
    """The landscape, a thirtieth of its day a frame."""
    return [landscape(i / 30) for i in range(count)]


def night(count: int) -> list:
    return [harbour(i / 30) for i in range(count)]


def snow(count: int) -> list:
    grey = [landscape(i / 30).mean(axis=2, keepdims=True) for i in range(count)]
    return [0.75 + 0.2 * picture * [1, 1, 1.1] for picture in grey]


@pytest.mark.parametrize(
    "lengths",
    [(6, 6), (8, 2), (8, 1), (2, 8), (1, 8), (1, 2), (3, 3), (2, 2)],
    ids=str,
)
def test_a_cut_is_found_wherever_it_is(lengths):
    before, after = lengths
    assert found(frames(before) + night(after)) == [before]


def test_cuts_near_each_other():
    assert found([*frames(4), *night(3), *snow(4)]) == [4, 7]
    assert found([*frames(6), *night(2), *snow(6)]) == [6, 8]
    assert found([*frames(5), *night(5), *snow(3), *frames(5)]) == [5, 10, 13]


def test_frame_numbers_are_the_clips_own():
    assert found(frames(4) + night(4), first=1001, step=2) == [1009]


@pytest.mark.parametrize(
    "encode",
    [np.sqrt, linear, lambda p: 40 * linear(p)],
    ids=["sqrt", "linear", "bright"],
)
def test_cuts_in_any_encoding(encode):
    assert found([encode(p) for p in frames(6) + night(6)]) == [6]
    assert found([encode(p) for p in frames(12)]) == []


def test_cuts_through_grain_flicker_and_letterbox():
    generator = np.random.default_rng(0)
    pictures = frames(8) + night(8)
    assert found([p + 0.05 * generator.standard_normal(p.shape) for p in pictures]) == [8]
    assert found([p * (1 + 0.02 * generator.standard_normal()) for p in pictures]) == [8]
    for picture in pictures:
        picture[:10] = picture[-10:] = 0
    assert found(pictures) == [8]


def test_cuts_in_light_far_above_one():
    bright = [2 + p for p in frames(6)] + [12 + 30 * p for p in night(6)]
    assert found(bright) == [6]


def test_what_lasts_three_frames_is_a_shot():
    assert found(flashes(3)) == [6, 9]


def flashes(length: int) -> list:
    pictures = frames(14)
    for i in range(length):
        pictures[6 + i] = 0.1 * pictures[6 + i] + 0.9
    return pictures


def lightning() -> list:
    pictures = frames(14)
    for i in (5, 8, 9, 12):
        pictures[i] = 0.3 * pictures[i] + 0.7
    return pictures


def flicker(share: float) -> list:
    generator = np.random.default_rng(1)
    return [p * (1 + share * generator.standard_normal()) for p in frames(30)]


def grain() -> list:
    generator = np.random.default_rng(2)
    return [p + 0.08 * generator.standard_normal(p.shape) for p in frames(10)]


def fade(length: int) -> list:
    pictures = frames(24)
    return [p * np.clip(min(i, 23 - i) / length, 0, 1) for i, p in enumerate(pictures)]


def whip_pan() -> list:
    """Still, then half the picture's width a frame, then still."""
    wide = np.concatenate([landscape(0.2), landscape(0.9)[:, ::-1], harbour(0), harbour(1)], axis=1)
    return [wide[:, x : x + 96] for x in [0] * 5 + list(range(0, 289, 48)) + [288] * 5]


def dissolve() -> list:
    shares = np.clip((np.arange(16) - 4) / 8, 0, 1)
    return [(1 - s) * landscape(0.3) + s * harbour(0.3) for s in shares]


def banner() -> list:
    """A banner that covers an eighth of the picture from one frame to the next."""
    pictures = frames(12)
    for picture in pictures[6:]:
        picture[-8:] = [0.1, 0.1, 0.6]
    return pictures


def exposure_step() -> list:
    return [p * (1 if i < 5 else 0.97) for i, p in enumerate(frames(10))]


def slow_ramp(levels: int) -> list:
    """A flat picture that brightens by one step of 8 bits every seven frames."""
    return [np.full((4, 4, 3), (i // 7) / 255) for i in range(7 * levels)]


def one_step(level: int) -> list:
    """A still whose code values change once, by one step of 8 bits."""
    return [np.full((4, 4, 3), (level + i // 6) / 255) for i in range(12)]


SINGLE_SHOTS = {
    "slow ramp from black": lambda: slow_ramp(24),
    "one step from black": lambda: one_step(0),
    "one step in the dark": lambda: one_step(5),
    "still": lambda: [landscape(0.5)] * 6,
    "moving": lambda: frames(10),
    "one flash frame": lambda: flashes(1),
    "two flash frames": lambda: flashes(2),
    "lightning": lightning,
    "flicker": lambda: flicker(0.1),
    "strong flicker": lambda: flicker(0.3),
    "grain": grain,
    "slow fade": lambda: fade(10),
    "fast fade": lambda: fade(3),
    "whip pan": whip_pan,
    "dissolve": dissolve,
    "banner": banner,
    "iris": exposure_step,
    "one frame": lambda: frames(1),
    "two frames": lambda: [landscape(0), harbour(0)],
    "black": lambda: [np.zeros((8, 8, 3))] * 5,
    "huge values": lambda: [1e4 * p for p in frames(6)],
}


@pytest.mark.parametrize("name", SINGLE_SHOTS)
def test_a_single_shot_has_no_cut(name):
    assert found(SINGLE_SHOTS[name]()) == []


def test_cuts_between_dark_shots():
    assert found([0.06 * p for p in frames(6) + night(6)]) == [6]


def test_repeated_frames_are_no_stand_still():
    """Pulldown and animation on twos: most neighbours are alike, and the others are no cuts."""
    pictures = [landscape(t) for t in np.linspace(0, 6, 10) % 1]
    for pattern in ((2,), (2, 3)):
        repeated = [p for i, p in enumerate(pictures) for _ in range(pattern[i % len(pattern)])]
        assert found(repeated) == []


def test_seasons_has_no_cut_however_it_is_sampled(seasons):
    clip = open_clip(str(seasons))
    gathered = [gather(n, image[::2, ::2], AnalysisOptions()) for n, image in clip.iter_colours()]
    for step in (1, 2, 3, 5):
        sampled = gathered[::step]
        assert cuts.find_cuts(pairs(sampled)) == []
        for length in (3, 5, 8):
            for start in range(len(sampled) - length + 1):
                assert cuts.find_cuts(pairs(sampled[start : start + length])) == []
    # Winter beside summer is one.
    spliced = [
        dataclasses.replace(s, frame=i) for i, s in enumerate([*gathered[:8], *gathered[20:28]])
    ]
    assert cuts.find_cuts(pairs(spliced)) == [8]


def test_the_measure_is_the_share_of_other_pixels():
    grey, other = np.full((1, 3), 0.25), np.array([[0.81, 0.0, 0.0]])
    whole = histogram(grey, np.array([10.0]))
    assert np.sort(whole)[-9:].tolist() == [0, *[1 / 8] * 8]  # half-way between cells
    assert cuts.difference(whole, whole) == 0
    assert cuts.difference(whole, histogram(other, np.array([3.0]))) == pytest.approx(1)
    mixed = histogram(np.vstack([grey, other]), np.array([6.0, 2.0]))
    assert cuts.difference(whole, mixed) == pytest.approx(0.25)
    # A small shift of all colours moves a small share of each pixel to the next cells.
    slightly = histogram(grey + 0.004, np.array([10.0]))
    assert 0 < cuts.difference(whole, slightly) < 0.1


def test_time_is_linear_and_small():
    picture = np.random.default_rng(0).random((128, 192, 3))
    one = gather(0, picture.astype(np.float32), AnalysisOptions())
    some = [dataclasses.replace(one, frame=i) for i in range(100)]
    start = time.process_time()
    assert cuts.find_cuts(pairs(some)) == []
    assert time.process_time() - start < 1.0  # 10 ms a frame, ten times what it takes


def test_the_refusal_names_ranges_that_the_command_reads():
    frames_of_clip = list(range(1001, 1021, 2))
    text = cuts.refusal(frames_of_clip, [1009, 1019])
    assert "2 sudden cuts" in text
    assert "frames 1009, 1019" in text
    assert 'frames="1001-1007x2", frames="1009-1017x2", frames="1019"; analyze_shots()' in text
    assert "allow_cuts=True" in text
    assert 'frames="0-4", frames="5-9";' in cuts.refusal(range(10), [5])
    assert "flash" not in cuts.refusal(range(10), [3])
    for found, rest in (([1], "1-9"), ([2], "2-9"), ([8], "0-7"), ([2, 9], "2-8")):
        assert f'flash at the end of the clip, leave it out: frames="{rest}".' in cuts.refusal(
            range(10), found
        )
    many = cuts.refusal(range(100), list(range(5, 100, 5)))
    assert many.count("frames=") == 8
    assert "19 sudden cuts" in many
    assert "…" in many
    assert "1 sudden cut, at frame 5" in cuts.note([5])
