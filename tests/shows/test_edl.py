"""EDLs as programs write them: encodings, motion effects, drop-frame timecodes, CDLs."""

from __future__ import annotations

import contextlib
import time
from fractions import Fraction
from pathlib import Path

import opentimelineio as otio
import pytest

from palette4d.common.errors import Palette4dError
from palette4d.shows import edl_text, timeline_clips
from palette4d.shows.edl_cdl import Cdl, of_comments

HEAD = "TITLE: reel\nFCM: NON-DROP FRAME\n\n"


def clips(text: str | bytes, tmp_path: Path, rate: Fraction = Fraction(24)):
    path = tmp_path / "cut.edl"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return timeline_clips.clips_of(path, rate).clips


def shown(text: str, tmp_path: Path, rate: Fraction = Fraction(24)) -> tuple:
    """The first and last frame, counted from the source timecode 01:00:00:00, and the speed."""
    (clip,) = clips(HEAD + text, tmp_path, rate)
    assert not clip.problem, clip.problem
    first, last = clip.shown.frames(clip.rate)
    hour = 3600 * round(rate)
    return first - hour, last - hour, clip.shown.speed


def problem(text: str, tmp_path: Path) -> str:
    (clip,) = clips(HEAD + text, tmp_path)
    return clip.problem


def event(source: str, record: str, *more: str) -> str:
    lines = [f"001  AX       V     C        {source} {record}", *more]
    return "\n".join([*lines, "* FROM CLIP NAME: A001"]) + "\n"


FOUR = "01:00:00:00 01:00:04:00"  # 96 frames at 24


class TestSpeed:
    """Which frames a motion effect plays: sources as long as records, and as long as what plays."""

    @pytest.mark.parametrize(
        ("m2", "expected"),
        [
            ("048.0", (0, 190, 2)),
            ("012.0", (0, 47, 0.5)),
            ("036.0", (0, 142, 1.5)),
            ("024.0", (0, 95, 1)),
            ("-024.0", (0, 95, -1)),
            ("000.0", (0, 0, 0)),
        ],
    )
    def test_as_resolve_writes_it(self, tmp_path: Path, m2: str, expected: tuple) -> None:
        """Source and record are equally long whatever the speed."""
        text = event(FOUR, FOUR, f"M2   AX             {m2}                01:00:00:00")
        assert shown(text, tmp_path) == expected

    @pytest.mark.parametrize(
        ("out", "m2", "at", "expected"),
        [
            ("01:00:08:00", "048.0", "01:00:00:00", (0, 190, 2)),
            ("01:00:02:00", "012.0", "01:00:00:00", (0, 47, 0.5)),
            ("01:00:08:00", "-048.0", "01:00:00:00", (0, 190, -2)),
            ("01:00:08:00", "-048.0", "01:00:07:23", (0, 190, -2)),
            ("01:00:08:00", "-048.0", "01:00:08:00", (0, 190, -2)),
            ("01:00:04:10", "026.4", "01:00:00:00", (0, 104, 1.1)),
            ("01:00:00:01", "000.0", "01:00:00:00", (0, 0, 0)),
            ("01:00:13:03", "-079.0", "01:00:00:00", (0, 312, -3.29)),
            ("01:00:13:01", "079.0", "01:00:00:00", (0, 312, 3.29)),
        ],
    )
    def test_as_cmx_defines_it(
        self, tmp_path: Path, out: str, m2: str, at: str, expected: tuple
    ) -> None:
        """The source is what plays."""
        text = event(f"01:00:00:00 {out}", FOUR, f"M2   AX    {m2}    {at}")
        found = shown(text, tmp_path)
        assert found[:2] == expected[:2]
        assert found[2] == pytest.approx(expected[2])

    def test_the_lengths_say_more_than_a_rounded_speed(self, tmp_path: Path) -> None:
        """31.325 frames a second is written as 31.3, which is a frame off after a thousand."""
        for out, speed in (("01:00:50:00", 1.25), ("01:00:50:03", 1.253)):
            text = event(f"01:00:00:00 {out}", "01:00:00:00 01:00:40:00", "M2 AX 031.3 01:00:00:00")
            last = int(speed * 999)
            assert shown(text, tmp_path, Fraction(25)) == (0, last, speed)

    @pytest.mark.parametrize("m2", ["048.0", "47.952", "047.95"])
    def test_ntsc(self, tmp_path: Path, m2: str) -> None:
        text = event(FOUR, FOUR, f"M2   AX   {m2}   01:00:00:00")
        assert shown(text, tmp_path, Fraction(24000, 1001))[:2] == (0, 190)

    @pytest.mark.parametrize(
        "m2",
        [
            "M2   Z682_156       048.0                01:00:00:00",
            "M2   Z682 156       048.0                01:00:00:00",
            "M2\t2\t48\t\t01:00:00:00",
            "M2   048.0  01:00:00:00",
            "M2   AX  048.0",
            "M2   AX  048.0  MSTR  I  +00:00:00:15",
        ],
    )
    def test_reels_with_numbers_and_lines_without_a_timecode(self, tmp_path: Path, m2: str) -> None:
        assert shown(event(FOUR, FOUR, m2), tmp_path) == (0, 190, 2)

    @pytest.mark.parametrize("words", ["* FREEZE FRAME", "* * FREEZE FRAME"])
    def test_freeze_frame_comments(self, tmp_path: Path, words: str) -> None:
        text = event("01:00:00:00 01:00:00:01", FOUR, words)
        assert shown(text, tmp_path) == (0, 0, 0)

    @pytest.mark.parametrize(
        ("source", "m2", "words"),
        [
            ("01:00:00:00 01:00:03:00", "048.0 01:00:00:00", "do not fit the 2 times"),
            (FOUR, "-048.0 01:00:00:00", "do not fit the -2 times"),
            (FOUR, "048.0 01:00:01:00", "begins 24 frames away"),
            (FOUR, "-024.0 01:00:01:00", "begins 24 frames away"),
        ],
    )
    def test_what_cannot_be_followed_fails_its_shot_alone(
        self, tmp_path: Path, source: str, m2: str, words: str
    ) -> None:
        assert words in problem(event(source, FOUR, f"M2 AX {m2}"), tmp_path)

    def test_lengths_that_differ_without_a_speed(self, tmp_path: Path) -> None:
        bad = "001 A V C 01:00:00:00 01:00:03:00 01:00:00:00 01:00:04:00\n"
        good = "002 B V C 01:00:00:00 01:00:03:00 01:00:04:00 01:00:07:00\n"
        one, other = clips(HEAD + bad + good, tmp_path)
        assert "no line M2 states the speed" in one.problem
        assert not other.problem

    def test_each_clip_of_a_dissolve_has_its_own_speed(self, tmp_path: Path) -> None:
        text = """001 A V C 01:00:00:00 01:00:02:00 01:00:00:00 01:00:01:00
M2 A 048.0 01:00:00:00
002 A V C 01:00:02:00 01:00:02:00 01:00:01:00 01:00:01:00
002 B V D 012 01:00:00:00 01:00:00:12 01:00:01:00 01:00:02:00
M2 A 048.0 01:00:02:00
M2 B 012.0 01:00:00:00
003 AX V C 01:00:00:00 01:00:01:00 01:00:02:00 01:00:03:00
004 AX V C 01:00:01:00 01:00:01:00 01:00:03:00 01:00:03:00
004 AX V D 012 01:00:02:00 01:00:03:00 01:00:03:00 01:00:04:00
M2 AX 048.0 01:00:01:00
"""
        found = clips(HEAD + text, tmp_path)
        assert [clip.shown.speed for clip in found] == [2, 0.5, 1, 1]


class TestLines:
    """Events as they stand in files, and errors with their line."""

    @pytest.mark.parametrize(
        "encoded",
        [
            lambda text: b"\xef\xbb\xbf" + text.encode(),
            lambda text: text.encode("latin-1"),
            lambda text: text.replace("Schön", "Schön “1”").encode("cp1252"),
            lambda text: text.encode("utf-16"),
            lambda text: text.encode("utf-16-le"),
            lambda text: text.encode("utf-16-be"),
            lambda text: text.replace("\n", "\r\n").encode(),
            lambda text: text.replace("\n", "\r").encode(),
        ],
        ids=["utf-8-sig", "latin-1", "cp1252", "utf-16", "le", "be", "crlf", "cr"],
    )
    def test_encodings(self, encoded, tmp_path: Path) -> None:
        text = HEAD.replace("reel", "Schön") + event(FOUR, FOUR).replace("A001", "Café")
        (clip,) = clips(encoded(text), tmp_path)
        assert clip.name == "Café"

    def test_sound_and_picture_with_one_number(self, tmp_path: Path) -> None:
        text = f"001 A V C {FOUR} {FOUR}\n001 A A C {FOUR} {FOUR}\n* FROM CLIP NAME: take\n"
        assert [clip.name for clip in clips(HEAD + text, tmp_path)] == ["take"]

    def test_an_event_without_comments_is_named_by_its_number(self, tmp_path: Path) -> None:
        (clip,) = clips(HEAD + f"017  REEL 1  V  C  {FOUR} {FOUR}\n", tmp_path)
        assert (clip.name, clip.reel) == ("017", "REEL_1")

    @pytest.mark.parametrize(
        ("line", "words"),
        [
            ("001 A V", "line 4: found '001 A V', expected an event such as"),
            (f"001 A V C {FOUR} 01:00:00:00 01:00:04:24", "line 4: found the timecode 01:00:04:24"),
        ],
    )
    def test_errors_name_the_line(self, line: str, words: str, tmp_path: Path) -> None:
        with pytest.raises(Palette4dError, match=words):
            clips(HEAD + line + "\n", tmp_path)

    def test_a_rate_without_timecodes(self, tmp_path: Path) -> None:
        with pytest.raises(Palette4dError, match=r"found the rate 12\.5.*23\.976"):
            clips(HEAD + event(FOUR, FOUR), tmp_path, Fraction(25, 2))

    def test_drop_frame_with_colons(self, tmp_path: Path) -> None:
        """Ten minutes have 17982 frames; without dropping they would be 18000."""
        text = "FCM: DROP FRAME\n001 A V C 00:10:00:00 00:10:01:00 00:10:00:00 00:10:01:00\n"
        rate = Fraction(30000, 1001)
        for written in (text, text.replace(":00 ", ";00 "), text.replace(":", ";")[3:]):
            written = written if written.startswith("FCM") else "FCM" + written
            (clip,) = clips(written.replace("FCM;", "FCM:"), tmp_path, rate)
            assert clip.shown.frames(clip.rate) == (17982, 18011)
        (clip,) = clips(text.replace("DROP", "NON-DROP"), tmp_path, rate)
        assert clip.shown.frames(clip.rate) == (18000, 18029)


class TestCdl:
    """* ASC_SOP and * ASC_SAT."""

    SOP = "* ASC_SOP (1.1 0.9 1.0)(0.01 -0.02 1e-05)(1.2 1.0 0.8)"

    def test_read_and_written(self) -> None:
        found = of_comments([self.SOP, "* ASC_SAT 0.9", "* FROM CLIP NAME: x"])
        assert found == Cdl((1.1, 0.9, 1.0), (0.01, -0.02, 1e-05), (1.2, 1.0, 0.8), 0.9)
        assert of_comments(found.comments) == found
        assert of_comments(["*ASC_SOP: (1,1,1) (0,0,0) (1,1,1)"]) == Cdl()
        assert of_comments(["* ASC_SOP (1 1)"]) is of_comments(["* FROM CLIP NAME: x"]) is None

    def test_in_the_timeline(self, tmp_path: Path) -> None:
        """A CDL that OpenTimelineIO's adapter refuses costs no shot."""
        from palette4d.shows import timeline_files

        path = tmp_path / "cut.edl"
        path.write_text(HEAD + event(FOUR, FOUR, self.SOP, "* ASC_SAT 0.9"))
        made = otio.adapters.read_from_string(
            timeline_files.as_json(path, Fraction(24)), "otio_json"
        )
        (clip,) = made.find_clips()
        assert list(clip.metadata["cdl"]["asc_sop"]["slope"]) == [1.1, 0.9, 1.0]
        assert clip.metadata["cdl"]["asc_sat"] == 0.9


@pytest.mark.parametrize(
    "line",
    [
        "001 " + "a " * 200_000,
        f"001 A V C {FOUR} {FOUR}\nM2 " + "1 " * 200_000 + "x",
        f"001 A V C {FOUR} {FOUR}\n* ASC_SOP " + "(" * 200_000,
        "9" * 5000 + f" A V C {FOUR} {FOUR}",
        f"001 A V C {'9' * 400} {'9' * 400} {FOUR}",
    ],
    ids=["event", "M2", "CDL", "number", "frames"],
)
def test_hostile_lines_take_no_time(line: str, tmp_path: Path) -> None:
    begin = time.process_time()
    with contextlib.suppress(Palette4dError):
        clips(HEAD + line + "\n", tmp_path)
    assert time.process_time() - begin < 5


@pytest.mark.parametrize("rate", [30, 60])
def test_drop_frame_has_ntsc_rates_alone(rate: int, tmp_path: Path) -> None:
    path = tmp_path / "cut.edl"
    path.write_text(
        "FCM: DROP FRAME\n" + event("00:10:00:00 00:10:01:00", "01:00:00:00 01:00:01:00")
    )
    edit = timeline_clips.clips_of(path, Fraction(rate))
    assert edit.rate == Fraction(rate * 1000, 1001)
    assert edit.clips[0].shown.frames(edit.rate) == (17982 * rate // 30, 18012 * rate // 30 - 1)
    path.write_text("FCM: NON-DROP FRAME\n" + event(FOUR, FOUR))
    assert timeline_clips.clips_of(path, Fraction(rate)).rate == rate


def test_no_events(tmp_path: Path) -> None:
    with pytest.raises(Palette4dError, match="found no events"):
        clips("some words\nand more\n", tmp_path)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-be"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_copy_has_the_encoding_and_the_line_ends(encoding: str, end: str) -> None:
    lines = ["TITLE: Schön", "", *event(FOUR, FOUR).splitlines()]
    data = (end.join(lines) + end).encode(encoding)
    assert edl_text.decoded(data).splitlines() == lines
    assert edl_text.encoded_like(data, lines) == data


def test_a_rate_of_decimals_is_the_ntsc_rate(tmp_path: Path) -> None:
    (clip,) = clips(HEAD + event(FOUR, FOUR), tmp_path, Fraction("23.976"))
    assert clip.rate == Fraction(24000, 1001)


def test_a_long_edl_takes_linear_time(tmp_path: Path) -> None:
    lines = [f"{i:06d} A V C {i} {i + 1} {i} {i + 1}\n" for i in range(20000)]
    events = edl_text.events_of("".join(lines), Fraction(24))
    assert [one.own.source[0] for one in events] == list(range(20000))


def test_the_frame_code_mode_in_small_letters(tmp_path: Path) -> None:
    text = event("00:10:00:00 00:10:01:00", "01:00:00:00 01:00:01:00")
    (clip,) = clips("fcm: drop frame\n" + text, tmp_path, Fraction(30000, 1001))
    assert clip.shown.frames(clip.rate) == (17982, 18011)
