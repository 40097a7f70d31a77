"""Edits of mixed rates: frames against a count with integers."""

from __future__ import annotations

import itertools
import struct
from fractions import Fraction
from pathlib import Path

import numpy as np
import opentimelineio as otio
import pytest
from clip_files import write_movie
from edits import external, save, span

from palette4d.media.clip import open_clip
from palette4d.media.timecode import frames_of, label_of, start_timecode
from palette4d.shows import timeline_clips, timeline_shots
from palette4d.shows.find_media import Folder

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
    if path.exists():
        return path
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


def edl_shots(folder: Path, rate: Fraction, sources: list[tuple[int, int]], **more):
    """The shots of events at a rate, with source timecodes as counts of frames, and the notes."""
    lines, at = [], 0
    for number, (start, length) in enumerate(sources, start=1):
        times = [label_of(frame, rate) for frame in (start, start + length, at, at + length)]
        lines.append(f"{number:03d} AX V C {' '.join(times)}\n* FROM CLIP NAME: take.mov\n")
        at += length
    path = folder / "cut.edl"
    path.write_text("FCM: NON-DROP FRAME\n" + "".join(lines))
    edit = timeline_clips.clips_of(path, rate)
    return timeline_shots.shots_of(edit, Folder(folder), **more)


@pytest.mark.parametrize(
    ("counted", "times"),
    [
        (Fraction(25), 2),
        (Fraction(30000, 1001), 2),
        (Fraction(24), 5),
    ],
)
@pytest.mark.parametrize("timecode", ["", "01:00:00:00", "01:00:00:23"])
def test_an_edl_counts_pairs_of_frames_of_a_movie_of_twice_its_rate(
    tmp_path: Path, counted: Fraction, times: int, timecode: str
) -> None:
    """SMPTE ST 12-1: frame k of the EDL is frame 2 k of the movie."""
    movie(tmp_path, counted * times, timecode).rename(tmp_path / "take.mov")
    begin = frames_of(timecode, counted * times) if timecode else 0
    sources = [(-(-begin // times) + i, 4) for i in range(0, 60 // times, 3)]
    found, notes = edl_shots(tmp_path, counted, sources)
    assert {shot.problem for shot in found} == {""}
    assert [shot.used for shot in found] == [
        (times * start - begin, times * (start + 4) - 1 - begin) for start, _ in sources
    ]
    assert len(notes) == 1
    # The same movie, played frame for frame.
    begin = frames_of(timecode, counted) if timecode else 0
    found, notes = edl_shots(
        tmp_path, counted, [(begin + i, 4) for i in range(9)], conform="frame-for-frame"
    )
    assert [shot.used for shot in found] == [(i, i + 3) for i in range(9)]
    assert not notes


def test_frames_that_a_movie_of_twice_the_rate_does_not_have(tmp_path: Path) -> None:
    movie(tmp_path, Fraction(50), "01:00:00:00").rename(tmp_path / "take.mov")
    good, bad = edl_shots(tmp_path, Fraction(25), [(90000, 9), (90120, 9)])[0]
    assert not good.problem
    assert "the edit shows frames 240 to 257, the media has 0-204" in bad.problem


def test_a_timecode_that_the_edit_s_rate_does_not_have(tmp_path: Path) -> None:
    movie(tmp_path, Fraction(50), "01:00:00:30").rename(tmp_path / "take.mov")
    (shot,) = edl_shots(tmp_path, Fraction(25), [(90000, 9)], conform="frame-for-frame")[0]
    assert "01:00:00:30, which 25 frames per second do not have" in shot.problem


def test_other_rates_of_an_edl_are_frames_or_by_rates(tmp_path: Path) -> None:
    movie(tmp_path, Fraction(24), "01:00:00:00").rename(tmp_path / "take.mov")
    (shot,), notes = edl_shots(tmp_path, Fraction(25), [(90050, 10)])
    assert shot.used == (50, 59)
    assert len(notes) == 1
    (shot,), notes = edl_shots(tmp_path, Fraction(25), [(90050, 10)], conform="by-rates")
    assert shot.used == (48, 57)  # 48.0 to 57.6
    assert not notes


def test_timecode_tracks_of_frame_pairs(tmp_path: Path) -> None:
    """A movie of 50 frames a second, whose timecode track counts 25."""
    path = movie(tmp_path, Fraction(50), "01:00:00:12")
    data = bytearray(path.read_bytes())
    struct.pack_into(">IIB", data, data.rindex(b"tmcd") + 20, 25, 1, 25)
    counted, pairs = (struct.pack(">I", 3600 * rate + 12) for rate in (50, 25))
    assert data.count(counted) == 1
    path.write_bytes(data.replace(counted, pairs))
    assert start_timecode(open_clip(str(path))) == "01:00:00:24"
    path.rename(tmp_path / "take.mov")
    (shot,) = edl_shots(tmp_path, Fraction(25), [(90013, 10)])[0]
    assert shot.used == (2, 21)
