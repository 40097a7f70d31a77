"""EDLs over midnight, in any order, with transitions and keys: against counts with integers."""

from __future__ import annotations

import random
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from clip_files import write_movie

from palette4d.common.errors import Palette4dError
from palette4d.shows import timeline_clips, timeline_shots
from palette4d.shows.find_media import Folder

NTSC = Fraction(30000, 1001)
HEAD = "TITLE: reel\nFCM: NON-DROP FRAME\n\n"


def clock(base: int, drop: int, begin: tuple[int, int, int]) -> Iterator[str]:
    """Timecodes one after the other; `drop` numbers are left out a minute, but for each tenth."""
    hours, minutes, seconds, frame = (*begin, 0)
    while True:
        yield f"{hours:02d}:{minutes:02d}:{seconds:02d}{';' if drop else ':'}{frame:02d}"
        frame += 1
        if frame == base:
            frame, seconds = 0, seconds + 1
        if seconds == 60:
            seconds, minutes = 0, minutes + 1
            frame = drop if minutes % 10 else 0
        if minutes == 60:
            minutes, hours = 0, (hours + 1) % 24


def movie(path: Path, rate: Fraction, timecode: str, count: int = 260) -> None:
    def prepare(stream) -> None:
        stream.metadata["timecode"] = timecode

    pictures = [np.zeros((16, 16, 3), np.uint8)] * count
    write_movie(path, "mpeg4", "yuv420p", pictures, "rgb24", rate=rate, prepare=prepare)


def shots(text: str, folder: Path, rate: Fraction) -> list:
    path = folder / "cut.edl"
    path.write_text(text)
    return timeline_shots.shots_of(timeline_clips.clips_of(path, rate), Folder(folder))[0]


def clips(text: str, folder: Path, rate: Fraction = Fraction(24)) -> list:
    path = folder / "cut.edl"
    path.write_text(text)
    return list(timeline_clips.clips_of(path, rate).clips)


@pytest.mark.parametrize(
    ("rate", "drop"),
    [
        (Fraction(24000, 1001), 0),
        (Fraction(24), 0),
        (Fraction(25), 0),
        (NTSC, 0),
        (NTSC, 2),
        (Fraction(50), 0),
        (2 * NTSC, 4),
    ],
)
def test_over_midnight(tmp_path: Path, rate: Fraction, drop: int) -> None:
    """Record and source pass midnight between events, and inside one, in any order."""
    count = clock(round(rate), drop, (23, 59, 58))
    labels = [next(count) for _ in range(900)]
    movie(tmp_path / "take.mov", rate, labels[0])
    midnight = 2 * round(rate)
    chance = random.Random(int(rate) + drop)
    events, expected, at = [], [], 0
    for number in range(1, 40):
        length = chance.randint(2, 20)
        length += at + length == midnight  # one event shows the frames of both days
        source = chance.randint(0, 259 - length)
        if at < midnight < at + length:
            source = midnight - 1
        times = labels[source], labels[source + length], labels[at], labels[at + length]
        events.append(f"{number:03d} AX V C {' '.join(times)}\n* FROM CLIP NAME: take.mov\n")
        expected.append((source, source + length - 1, labels[at]))
        at += length + (0 if at + length < midnight < at + length + 3 else chance.randint(0, 2))
    assert any(first < midnight <= last for first, last, _ in expected)
    assert {label[:2] for _, _, label in expected} == {"23", "00"}
    for _ in range(2):
        found = shots(HEAD + "".join(events), tmp_path, rate)
        assert {shot.problem for shot in found} == {""}
        assert [(*shot.used, shot.place.record) for shot in found] == expected
        chance.shuffle(events)


@pytest.mark.parametrize("m2", ["-024.0", "-048.0"])
def test_backwards_over_midnight(tmp_path: Path, m2: str) -> None:
    movie(tmp_path / "take.mov", Fraction(24), "23:59:59:00")
    fast = round(abs(float(m2)) / 24)
    ends = {1: "00:00:00:12", 2: "00:00:01:12"}[fast]
    for source, at in (
        (f"23:59:59:12 {ends}", "23:59:59:12"),
        (f"23:59:59:12 {ends}", ends),
        (f"{ends} 23:59:59:12", ends),
    ):
        text = f"001 AX V C {source} 01:00:00:00 01:00:01:00\nM2 AX {m2} {at}\n"
        (shot,) = shots(HEAD + text + "* FROM CLIP NAME: take\n", tmp_path, Fraction(24))
        assert not shot.problem
        first = 12 + (source.startswith("0") and 1)
        assert shot.used[1] - shot.used[0] == 23 * fast
        assert shot.used[0] == (first if fast == 1 else 12 + 2 * (first - 12))
        assert shot.speed == -fast


class TestNumbersThatAreLeftOut:
    """The media's timecodes leave numbers out, those of the EDL do not, or the other way."""

    @pytest.mark.parametrize("fcm", ["NON-DROP", "DROP"])
    @pytest.mark.parametrize("drop", [0, 2])
    def test_a_timecode_is_found_in_the_media(self, tmp_path: Path, fcm: str, drop: int) -> None:
        count = clock(30, drop, (1, 0, 58))
        labels = [next(count) for _ in range(100)]
        movie(tmp_path / "take.mov", NTSC, labels[0])
        source = labels.index(f"01:01:00{';' if drop else ':'}05")
        head = HEAD.replace("NON-DROP", fcm)
        text = "001 AX V C 01:01:00:05 01:01:00:25 01:00:00:00 01:00:00:20\n* FROM CLIP NAME: take"
        (shot,) = shots(head + text, tmp_path, NTSC)
        assert (shot.used, shot.place.record[-3]) == (
            (source, source + 19),
            ";" if fcm == "DROP" else ":",
        )

    def test_a_number_that_the_media_leaves_out(self, tmp_path: Path) -> None:
        movie(tmp_path / "take.mov", NTSC, "01:00:58;00")
        text = "001 AX V C 01:01:00:00 01:01:00:20 01:00:00:00 01:00:00:20\n* FROM CLIP NAME: take"
        (shot,) = shots(HEAD + text, tmp_path, NTSC)
        assert "01:01:00:00, which the media does not have" in shot.problem

    def test_of_a_line_m2(self, tmp_path: Path) -> None:
        text = "001 AX V C 00:10:00:00 00:10:02:00 01:00:00:00 01:00:01:00\nM2 AX 060.0 "
        text = HEAD.replace("NON-DROP", "DROP") + text + "00:10:00:00"
        (clip,) = clips(text, tmp_path, NTSC)
        assert not clip.problem
        assert clip.shown.frames(NTSC) == (17982, 17982 + 58)


A = "001 A V C 01:00:00:00 01:00:02:00 01:00:00:00 01:00:02:00\n* FROM CLIP NAME: a\n"
TO_B = "002 B V D 024 02:00:00:00 02:00:03:00 01:00:02:00 01:00:05:00\n"
FROM_A = "002 A V C 01:00:02:00 01:00:02:00 01:00:02:00 01:00:02:00\n"
FROM_X = FROM_A.replace(" A ", " X ").replace("C 01:00:02:00 01:00:02", "C 03:00:02:00 03:00:02")
NAMES = "* FROM CLIP NAME: a\n* TO CLIP NAME: b\n"
HOUR = 24 * 3600
SHOWN_A, SHOWN_B = ("a", HOUR, HOUR + 71), ("b", 2 * HOUR, 2 * HOUR + 71)


TAIL_X = ("x", 3 * HOUR + 48, 3 * HOUR + 71)
FROM, TO = "* FROM CLIP NAME: {}\n".format, "* TO CLIP NAME: {}\n".format
UNNAMED_B = ("002", *SHOWN_B[1:])
CUT_A = ("a", HOUR, HOUR + 47)
BLACK = FROM_A.replace(" A ", " BL ")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (A + FROM_A + TO_B + NAMES, [SHOWN_A, SHOWN_B]),
        (A + FROM_A + FROM("a") + TO_B + TO("b"), [SHOWN_A, SHOWN_B]),
        (A + TO_B + FROM("b"), [SHOWN_A, SHOWN_B]),
        (A.replace("001", "002") + TO_B + FROM("b"), [SHOWN_A, SHOWN_B]),
        (A + FROM_A + TO_B.replace("D", "W001") + NAMES, [SHOWN_A, SHOWN_B]),
        (A + FROM_A + TO_B.replace(" 024", ""), [CUT_A, UNNAMED_B]),
        (BLACK + TO_B + TO("b"), [SHOWN_B]),
        (BLACK + TO_B + FROM("b"), [SHOWN_B]),
        (A + (FROM_A + TO_B).replace(" B ", " BL ") + FROM("a"), [SHOWN_A]),
        (A + FROM_A + TO_B + FROM("a"), [SHOWN_A, UNNAMED_B]),
        (A + FROM_X + TO_B + FROM("x") + TO("b"), [CUT_A, TAIL_X, SHOWN_B]),
        (FROM_X + TO_B + FROM("x") + TO("b"), [TAIL_X, SHOWN_B]),
    ],
    ids=[
        *("plain", "comments between", "one line", "one number", "wipe", "no length", "fade in"),
        *("fade in from", "fade out", "one name", "from a third clip", "at the beginning"),
    ],
)
def test_both_clips_have_all_frames_of_a_transition(
    text: str, expected: list, tmp_path: Path
) -> None:
    """However programs write it."""
    found = clips(HEAD + text, tmp_path)
    assert [(clip.name, *clip.shown.frames(clip.rate)) for clip in found] == expected


@pytest.mark.parametrize("channel", ["B", "A/V", "AV", "AA/V", "VA1A2", "V1A1A2", "V2"])
def test_channels_with_a_picture(channel: str, tmp_path: Path) -> None:
    found = clips(HEAD + A.replace(" V ", f" {channel} "), tmp_path)
    assert [clip.place.track for clip in found] == ["V2" if channel == "V2" else "V"]


@pytest.mark.parametrize("channel", ["NONE", "A", "AA", "A12", "A4"])
def test_channels_of_sound_are_no_shots(channel: str, tmp_path: Path) -> None:
    sound = A.replace(" V ", f" {channel} ").replace(": a", ": sound")
    assert [clip.name for clip in clips(HEAD + sound + A, tmp_path)] == ["a"]


@pytest.mark.parametrize("kinds", [("K B", "K 000"), ("KB", "K"), ("K B", "K O 024")])
def test_keys(kinds: tuple[str, str], tmp_path: Path) -> None:
    """The background is a cut; what lies over it is a shot of a track of its own."""
    record = "01:00:02:00 01:00:04:00\n"
    text = (
        A
        + f"002 BG V {kinds[0]} 02:00:00:00 02:00:02:00 {record}"
        + f"002 FG V {kinds[1]} 03:00:00:00 03:00:02:00 {record}"
        + "* FROM CLIP NAME: bg\n* KEY CLIP NAME: fg\n"
    )
    found = [
        (clip.name, clip.place.track, clip.shown.frames(clip.rate)[0] // HOUR)
        for clip in clips(HEAD + text, tmp_path)
    ]
    assert found == [("a", "V", 1), ("bg", "V", 2), ("fg", "V_KEY", 3)]


def test_two_events_of_a_track_at_one_time(tmp_path: Path) -> None:
    text = A + A.replace("001", "002").replace("00 01:00:00:00 01", "00 01:00:01:00 01")
    with pytest.raises(Palette4dError, match=r"line 7: .*at 01:00:01:00 .* goes on to 01:00:02:00"):
        clips(HEAD + text, tmp_path)


def test_a_record_that_ends_before_it_begins(tmp_path: Path) -> None:
    with pytest.raises(Palette4dError, match=r"line 4: .* ends before it begins"):
        clips(HEAD + A.replace("01:00:00:00 01:00:02:00\n", "01:00:02:00 01:00:00:00\n"), tmp_path)


def test_a_source_file_is_found_before_the_clip_s_name(tmp_path: Path) -> None:
    for name in ("scene 1", "A001_C002"):
        movie(tmp_path / f"{name}.mov", Fraction(24), "01:00:00:00", 60)
    text = A.replace(": a", ": S:\\show\\A001_C002.mov")
    (shot,) = shots(HEAD + text, tmp_path, Fraction(24))
    assert (Path(shot.clip).stem, shot.name, shot.problem) == ("A001_C002", "A001_C002", "")
    text = A.replace(": a", ": scene 1") + "* SOURCE FILE: A001_C002\n* FROM CLIP IS A STILL\n"
    (shot,) = shots(HEAD + text, tmp_path, Fraction(24))
    assert (Path(shot.clip).stem, shot.name, shot.problem) == ("A001_C002", "scene_1", "")
