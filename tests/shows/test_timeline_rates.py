"""Edits of mixed rates: frames against a count with integers."""

from __future__ import annotations

import itertools
from fractions import Fraction
from pathlib import Path

import numpy as np
import opentimelineio as otio
import pytest
from clip_files import write_movie
from edits import external, save, span

from palette4d.media.timecode import frames_of
from palette4d.shows import timeline_clips, timeline_shots

RATES = [
    Fraction(24000, 1001),
    *map(Fraction, (24, 25)),
    Fraction(30000, 1001),
    *map(Fraction, (30, 48, 50)),
    Fraction(60000, 1001),
]
LENGTH, FRAMES = 3, 205


def movie(folder: Path, rate: Fraction, timecode: str = "") -> Path:
    """A movie of 205 frames of 16 x 16 pixels."""
    path = folder / f"{float(rate):.3f}{timecode.replace(':', '_').replace(';', 'd')}.mov"
    picture = np.zeros((16, 16, 3), np.uint8)

    def prepare(stream) -> None:
        if timecode:
            stream.metadata["timecode"] = timecode

    pictures = [picture] * FRAMES
    write_movie(path, "mpeg4", "yuv420p", pictures, "rgb24", rate=rate, prepare=prepare)
    return path


def shots(tracks, folder: Path) -> list:
    made = otio.schema.Timeline("mix", global_start_time=otio.opentime.RationalTime(0, 24))
    for items in tracks:
        made.tracks.append(otio.schema.Track(kind="Video", children=items))
    path = save(made, folder / "mix.otio")
    found, notes = timeline_shots.shots_of(timeline_clips.clips_of(path))
    assert not notes
    return found


def gap(count: int, rate: Fraction):
    time = otio.opentime.RationalTime
    return otio.schema.Gap(duration=time(count, float(rate)))


def sweep(tmp_path: Path, points: range, timecodes: bool, known: bool = False) -> None:
    """Clips of every rate behind a gap of every rate, at each in-point, begin at that frame."""
    tracks, expected = [], []
    for rate, starts in itertools.product(RATES, ["", "01:00:00:00", "01:00:00;00"]):
        begin = frames_of(starts, rate) if starts else 0
        drops = starts.endswith(";00")
        if bool(starts) != timecodes or (drops and (rate.denominator == 1 or round(rate) % 30)):
            continue
        url = movie(tmp_path, rate, starts).name
        available = span(begin, FRAMES, float(rate)) if known else None
        for beside in RATES:
            items = []
            for i in points:
                items.append(gap(1 + i % 7, beside))
                items.append(
                    otio.schema.Clip(
                        "x", external(url, available), span(begin + i, LENGTH, float(rate))
                    )
                )
                expected.append((i, i + LENGTH - 1))
            tracks.append(items)
    found = shots(tracks, tmp_path)
    assert {shot.problem for shot in found} == {""}
    assert [shot.used for shot in found] == expected


@pytest.mark.parametrize("timecodes", [False, True], ids=["from 0", "timecode"])
def test_no_rate_beside_a_clip_counts(tmp_path: Path, timecodes: bool) -> None:
    sweep(tmp_path, range(3, 200, 28), timecodes)


@pytest.mark.slow
@pytest.mark.parametrize("timecodes", [False, True], ids=["from 0", "timecode"])
@pytest.mark.parametrize("known", [False, True], ids=["alone", "available"])
def test_each_of_200_in_points(tmp_path: Path, timecodes: bool, known: bool) -> None:
    sweep(tmp_path, range(200), timecodes, known)


def test_times_of_another_rate_than_the_movie_s_are_seconds(tmp_path: Path) -> None:
    """Frame k of the edit at one rate begins in the movie's frame k x movie's rate / edit's."""
    items, expected = [], []
    for media, counted in itertools.product(RATES, RATES):
        if round(media) == round(counted):
            continue
        url = movie(tmp_path, media).name
        for k in (0, 7, 50):
            items.append(otio.schema.Clip("x", external(url), span(k, 20, float(counted))))
            ratio = media / counted
            end = (k + 20) * ratio
            expected.append((int(k * ratio), -(-end.numerator // end.denominator) - 1))
    assert [shot.used for shot in shots([items], tmp_path)] == expected


def test_all_of_a_movie_at_another_rate_plays_frame_for_frame(tmp_path: Path) -> None:
    """24 frames per second, conformed to 25."""
    url = movie(tmp_path, Fraction(24)).name
    clip = otio.schema.Clip("x", external(url, span(0, FRAMES, 25)), span(50, 10, 25))
    assert shots([[clip]], tmp_path)[0].used == (50, 59)


def test_rates_as_programs_round_them(tmp_path: Path) -> None:
    """An hour at 23.976 and at 24000/1001 differ by less than a frame."""
    url = movie(tmp_path, Fraction(24000, 1001)).name
    for rate, other in itertools.permutations([23.976, 23.98, 24000 / 1001], 2):
        reference = external(url, span(86400, FRAMES, other))
        clip = otio.schema.Clip("x", reference, span(86410, 10, rate))
        assert shots([[clip]], tmp_path)[0].used == (10, 19)
