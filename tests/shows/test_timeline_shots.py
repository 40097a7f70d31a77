"""Edits: which frames of which media a timeline shows, in the media's own numbers."""

from __future__ import annotations

import math
import os
import time
import zipfile
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import opentimelineio as otio
import pytest
from clip_files import TimeCode, write_image
from edits import (
    clip,
    dissolve,
    external,
    gap,
    movie,
    numbered,
    picture,
    save,
    sequence,
    span,
    timeline,
)
from opentimelineio.opentime import RationalTime
from posix_files import pipes
from wine import unlimited
from without_module import run_without

from palette4d.common.errors import Palette4dError
from palette4d.shows import timeline_clips, timeline_files
from palette4d.shows import timeline_shots as timelines
from palette4d.shows.analysis import analyze_shots
from palette4d.shows.find_media import Folder
from palette4d.shows.shots import numbered as unlike


@pytest.fixture
def plates(tmp_path: Path) -> Path:
    """A folder of media: a sequence 1001-1040, a movie of 30 frames, one with a timecode."""
    folder = tmp_path / "plates"
    sequence(folder / "a", "sh010", 1001, 40)
    movie(folder / "b" / "take.mov", 30)
    movie(folder / "b" / "A001C003.mov", 30, timecode="01:00:10:00")
    return folder


def found_in(
    path: Path, plates: Path | None = None, rate: Fraction | None = None, handles: int = 0
):
    listed = timeline_clips.read(path, rate)
    folder = None if plates is None else Folder(plates)
    shots, counting = timelines.shots_of(listed, folder, handles)
    return SimpleNamespace(
        shots=shots, notes=listed.notes, rate=listed.rate, counting=tuple(counting)
    )


def edit(made, tmp_path: Path, plates: Path | None = None, handles: int = 0):
    return found_in(save(made, tmp_path / "edit.otio"), plates, handles=handles)


def frames(made, tmp_path: Path, plates: Path | None = None, handles: int = 0) -> list:
    found = edit(made, tmp_path, plates, handles)
    assert [shot.problem for shot in found.shots] == [""] * len(found.shots)
    return [(shot.name, shot.first, shot.last) for shot in found.shots]


class TestTimes:
    """In-points, handles and timecodes as the media's frame numbers."""

    def test_a_sequence_by_its_reference(self, tmp_path: Path, plates: Path) -> None:
        reference = numbered("plates/a", "sh010", 1001, 40, starts=86400)
        made = timeline(clip("sh010", reference, 86410, 12))
        assert frames(made, tmp_path) == [("sh010", 1011, 1022)]

    def test_a_sequence_whose_numbers_are_its_time(self, tmp_path: Path, plates: Path) -> None:
        for url in (
            "plates/a/sh010.1001.png",
            "plates/a/sh010.%04d.png",
            "plates/a/sh010.####.png",
        ):
            made = timeline(clip("sh010", external(url, span(1001, 40)), 1011, 12))
            assert frames(made, tmp_path) == [("sh010", 1011, 1022)]

    def test_a_sequence_whose_time_is_from_elsewhere(self, tmp_path: Path, plates: Path) -> None:
        reference = external("plates/a/sh010.1001.png", span(0, 40))
        assert frames(timeline(clip("x", reference, 10, 12)), tmp_path) == [("x", 1011, 1022)]

    def test_a_movie_counts_from_its_start(self, tmp_path: Path, plates: Path) -> None:
        reference = external("plates/b/take.mov", span(86400, 30))
        made = timeline(clip("take", reference, 86405, 10))
        assert frames(made, tmp_path) == [("take", 5, 14)]
        made = timeline(clip("take", external("plates/b/take.mov"), 5, 10))
        assert frames(made, tmp_path) == [("take", 5, 14)]

    def test_a_movie_by_its_own_timecode(self, tmp_path: Path, plates: Path) -> None:
        at = otio.opentime.from_timecode("01:00:10:12", 24).value
        made = timeline(clip("c", external("plates/b/A001C003.mov"), at, 6))
        assert frames(made, tmp_path) == [("c", 12, 17)]

    def test_frames_by_the_timecode_in_their_headers(self, tmp_path: Path) -> None:
        for i in range(6):
            path = tmp_path / "scan" / f"reel.{i + 1:04d}.dpx"
            deep = picture(i).astype(np.uint16) * 257
            write_image(path, deep, smpte__TimeCode=TimeCode(0x02000000 + i))
        at = otio.opentime.from_timecode("02:00:00:02", 24).value
        made = timeline(clip("reel", external("scan/reel.0001.dpx"), at, 3))
        assert frames(made, tmp_path) == [("reel", 3, 5)]

    def test_another_rate_than_the_media_s(self, tmp_path: Path, plates: Path) -> None:
        # 48 half frames of the timeline are 24 of the media.
        reference = external("plates/b/take.mov", span(0, 30, 24))
        made = timeline()
        item = otio.schema.Clip("take", reference, span(8, 48, 48))
        made.tracks[0].append(item)
        assert frames(made, tmp_path) == [("take", 4, 27)]

    def test_handles_end_where_the_media_does(self, tmp_path: Path, plates: Path) -> None:
        made = timeline(
            clip("early", external("plates/b/take.mov"), 2, 10),
            clip("late", external("plates/b/take.mov"), 15, 12),
        )
        assert frames(made, tmp_path, handles=5) == [("early", 0, 16), ("late", 10, 29)]
        shots = edit(made, tmp_path, handles=5).shots
        assert [shot.used for shot in shots] == [(2, 11), (15, 26)]

    def test_a_still_is_one_frame(self, tmp_path: Path) -> None:
        write_image(tmp_path / "card.png", picture(0))
        made = timeline(clip("card", external("card.png"), 0, 48))
        shot = edit(made, tmp_path, handles=4).shots[0]
        assert (shot.count, shot.problem) == (1, "")

    def test_what_the_media_lacks_is_a_problem(self, tmp_path: Path, plates: Path) -> None:
        made = timeline(
            clip("take", external("plates/b/take.mov"), 20, 20),
            clip("far", external("plates/b/take.mov"), 86400, 10),
        )
        problems = [shot.problem for shot in edit(made, tmp_path).shots]
        assert "the edit shows frames 20 to 39, the media has 0-29" in problems[0]
        assert "86400" in problems[1]


class TestEdits:
    """Gaps, transitions, speed, nesting."""

    def test_gaps_and_record_times(self, tmp_path: Path, plates: Path) -> None:
        take = external("plates/b/take.mov")
        made = timeline(clip("a", take, 0, 10), gap(14), clip("b", take, 10, 10))
        made.global_start_time = otio.opentime.RationalTime(86400, 24)
        found = edit(made, tmp_path)
        assert [shot.place.record for shot in found.shots] == ["01:00:00:00", "01:00:01:00"]
        assert [shot.place.path for shot in found.shots] == [(0, 0), (0, 2)]
        assert found.notes == ("1 gap",)
        assert found.rate == 24

    def test_transitions_take_frames_of_both(self, tmp_path: Path, plates: Path) -> None:
        take = external("plates/b/take.mov")
        made = timeline(clip("a", take, 2, 8), dissolve(3, 4), clip("b", take, 15, 10))
        assert frames(made, tmp_path) == [("a", 2, 13), ("b", 12, 24)]

    @pytest.mark.parametrize(
        ("speed", "last"), [(2.0, 22), (0.5, 8), (1.0, 13), (1.5, 17)], ids=str
    )
    def test_speed(self, tmp_path: Path, plates: Path, speed: float, last: int) -> None:
        """Ten frames from frame 4: the last shown is 9 steps of `speed` later."""
        warp = otio.schema.LinearTimeWarp(time_scalar=speed)
        made = timeline(clip("a", external("plates/b/take.mov"), 4, 10, effects=[warp]))
        ((_, first, found),) = frames(made, tmp_path)
        assert (first, found) == (4, last)

    def test_a_freeze_frame_is_one(self, tmp_path: Path, plates: Path) -> None:
        freeze = otio.schema.FreezeFrame()
        made = timeline(clip("a", external("plates/b/take.mov"), 4, 10, effects=[freeze]))
        assert frames(made, tmp_path) == [("a", 4, 4)]

    @pytest.mark.parametrize(
        ("speed", "last"), [(-1.0, 13), (-2.0, 22), (-0.5, 8), (-1.5, 17)], ids=str
    )
    def test_backwards(self, tmp_path: Path, plates: Path, speed: float, last: int) -> None:
        """The in-point is the earliest frame, which is played last."""
        warp = otio.schema.LinearTimeWarp(time_scalar=speed)
        made = timeline(clip("a", external("plates/b/take.mov"), 4, 10, effects=[warp]))
        (shot,) = edit(made, tmp_path).shots
        assert (shot.used, shot.speed) == ((4, last), speed)

    def test_backwards_in_a_trimmed_track_and_a_dissolve(
        self, tmp_path: Path, plates: Path
    ) -> None:
        """The record's first frames show the media's last ones."""
        take = external("plates/b/take.mov")
        warp = otio.schema.LinearTimeWarp(time_scalar=-1)
        made = timeline(clip("a", take, 4, 10, effects=[warp]))
        made.tracks[0].source_range = span(0, 3)
        assert edit(made, tmp_path).shots[0].used == (11, 13)
        made = timeline(
            clip("a", take, 4, 10, effects=[warp]), dissolve(0, 2), clip("b", take, 9, 9)
        )
        assert edit(made, tmp_path).shots[0].used == (2, 13)

    def test_what_is_not_followed_is_a_problem(self, tmp_path: Path, plates: Path) -> None:
        take = external("plates/b/take.mov")
        wild = otio.schema.LinearTimeWarp(time_scalar=math.nan)
        ramp = otio.schema.TimeEffect(effect_name="ramp")
        curve = otio.schema.TimeEffect(name="curve")
        made = timeline(
            clip("wild", take, 4, 5, effects=[wild]),
            clip("ramp", take, 4, 5, effects=[ramp]),
            clip("curve", take, 4, 5, effects=[curve]),
        )
        wild_is, ramp_is, curve_is = (shot.problem for shot in edit(made, tmp_path).shots)
        assert "plays at nan times its speed" in wild_is
        assert "time effect 'ramp'" in ramp_is
        assert "time effect 'curve'" in curve_is

    def test_nested_stacks_and_what_they_cut_away(self, tmp_path: Path, plates: Path) -> None:
        take = external("plates/b/take.mov")
        inner = otio.schema.Track(
            kind="Video", children=[clip("a", take, 0, 10), clip("b", take, 10, 10), gap(10)]
        )
        # The compound shows frames 6 to 13 of its inside: the end of a and the start of b.
        compound = otio.schema.Stack(name="comp", children=[inner], source_range=span(6, 8))
        made = timeline(clip("first", take, 20, 5), compound)
        found = edit(made, tmp_path)
        assert [(s.name, s.first, s.last) for s in found.shots] == [
            ("first", 20, 24),
            ("a", 6, 9),
            ("b", 10, 13),
        ]
        assert [s.place.path for s in found.shots] == [(0, 0), (0, 1, 0, 0), (0, 1, 0, 1)]
        assert [s.place.record for s in found.shots] == [
            "00:00:00:00",
            "00:00:00:05",
            "00:00:00:09",
        ]

    def test_a_compound_at_another_speed_is_a_problem(self, tmp_path: Path, plates: Path) -> None:
        inner = otio.schema.Track(
            kind="Video", children=[clip("a", external("plates/b/take.mov"), 0, 10)]
        )
        warp = otio.schema.LinearTimeWarp(time_scalar=2)
        compound = otio.schema.Stack(name="comp", children=[inner], effects=[warp])
        (shot,) = edit(timeline(compound), tmp_path).shots
        assert "compound 'comp'" in shot.problem

    def test_a_trimmed_track(self, tmp_path: Path, plates: Path) -> None:
        take = external("plates/b/take.mov")
        made = timeline(clip("a", take, 0, 10), clip("b", take, 10, 10))
        made.tracks[0].source_range = span(12, 5)
        found = edit(made, tmp_path)
        assert [(s.name, s.first, s.last) for s in found.shots] == [("b", 12, 16)]
        assert found.notes == ("1 clip is cut away",)

    def test_what_is_off_audio_and_generators_are_no_shots(
        self, tmp_path: Path, plates: Path
    ) -> None:
        take = external("plates/b/take.mov")
        off = clip("off", take, 0, 5)
        off.enabled = False
        bars = clip("bars", otio.schema.GeneratorReference(generator_kind="SMPTEBars"), 0, 5)
        made = timeline(off, bars, clip("on", take, 0, 5))
        made.tracks.append(otio.schema.Track(kind="Audio", children=[clip("sound", take, 0, 5)]))
        dark = otio.schema.Track(kind="Video", children=[clip("dark", take, 0, 5)])
        dark.enabled = False
        made.tracks.append(dark)
        found = edit(made, tmp_path)
        assert [shot.name for shot in found.shots] == ["on"]
        assert set(found.notes) == {"1 clip is off", "1 generated picture", "1 track is off"}


class TestMedia:
    """Where media is found."""

    def test_relinked_by_name_in_any_folder(self, tmp_path: Path, plates: Path) -> None:
        made = timeline(
            clip("a", external("file:///volumes/old/take.mxf"), 0, 5),
            clip("b", numbered("/volumes/old/a", "sh010", 1001, 40), 3, 5),
            clip("A001C003", otio.schema.MissingReference(), 86640, 5),
        )
        found = edit(made, tmp_path, plates)
        assert [Path(s.clip).name for s in found.shots] == [
            "take.mov",
            "sh010.####.png",
            "A001C003.mov",
        ]
        assert [(s.first, s.last) for s in found.shots] == [(0, 4), (1004, 1008), (0, 4)]

    def test_the_folder_goes_before_what_the_edit_names(self, tmp_path: Path, plates: Path) -> None:
        movie(tmp_path / "old" / "take.mov", 10)
        made = timeline(clip("a", external("old/take.mov"), 0, 5))
        assert edit(made, tmp_path).shots[0].clip == str(tmp_path / "old" / "take.mov")
        found = edit(made, tmp_path, plates)
        assert found.shots[0].clip == str(plates / "b" / "take.mov")

    def test_the_likest_folder_wins_and_a_tie_is_a_problem(self, tmp_path: Path) -> None:
        for day in ("day1", "day2"):
            movie(tmp_path / "m" / day / "clip.mov", 8)
        made = timeline(
            clip("a", external("/vol/day2/clip.mov"), 0, 5),
            clip("b", external("/vol/other/clip.mov"), 0, 5),
        )
        one, other = edit(made, tmp_path, tmp_path / "m").shots
        assert Path(one.clip).parts[-2:] == ("day2", "clip.mov")
        assert "found 2 media named 'clip.mov'" in other.problem

    def test_missing_media_is_a_problem_of_its_shot_alone(
        self, tmp_path: Path, plates: Path
    ) -> None:
        made = timeline(
            clip("gone", external("/vol/gone.mov"), 0, 5),
            clip("web", external("https://example.com/x.mov"), 0, 5),
            clip("none", otio.schema.MissingReference(), 0, 5),
            clip("take", external("plates/b/take.mov"), 0, 5),
        )
        gone, web, none, take = edit(made, tmp_path, plates).shots
        assert f"'{Path('/vol/gone.mov')}' is not there" in gone.problem
        assert "media=…" in gone.problem
        assert "expected a file" in web.problem
        assert "the edit names no file for it, and nothing under" in none.problem
        assert not take.problem

    @pytest.mark.parametrize(
        "url",
        [
            "S:\\show\\b\\take.mov",
            "S:/show/b/take.mov",
            "\\\\server\\show\\b\\take.mov",
            "file:///S:/show/b/take.mov",
            "file://localhost/show/b/take.mov",
            "file://server/show/b/take.mov",
        ],
    )
    def test_paths_of_windows_are_found_by_name(
        self, url: str, tmp_path: Path, plates: Path
    ) -> None:
        (shot,) = edit(timeline(clip("a", external(url), 0, 5)), tmp_path, plates).shots
        assert shot.clip == str(plates / "b" / "take.mov")

    def test_a_path_of_another_computer_is_none_of_this_one(
        self, tmp_path: Path, plates: Path
    ) -> None:
        here = (plates / "b" / "take.mov").as_uri().removeprefix("file://")
        one, other = edit(
            timeline(
                clip("a", external(f"file://localhost{here}"), 0, 5),
                clip("b", external(f"file://server{here}"), 0, 5),
            ),
            tmp_path,
        ).shots
        assert one.clip == str(plates / "b" / "take.mov")
        assert "another computer" in other.problem

    def test_no_such_folder(self, tmp_path: Path) -> None:
        with pytest.raises(Palette4dError, match="no such folder"):
            Folder(tmp_path / "nowhere")


EDL = """TITLE: reel 1
FCM: NON-DROP FRAME

001  A001C003 V     C        01:00:10:04 01:00:10:16 01:00:00:00 01:00:00:12
* FROM CLIP NAME: A001C003
002  TAKE     V     C        00:00:00:02 00:00:00:08 01:00:00:12 01:00:00:18
* FROM CLIP NAME: take
003  TAKE     V     C        00:00:00:08 00:00:00:08 01:00:00:18 01:00:00:18
003  A001C003 V     D    004 01:00:10:18 01:00:11:00 01:00:00:18 01:00:01:00
* FROM CLIP NAME: take
* TO CLIP NAME: A001C003
004  BL       V     C        00:00:00:00 00:00:01:00 01:00:01:00 01:00:02:00
005  TAKE     V     C        00:00:00:00 00:00:00:12 01:00:02:00 01:00:02:06
* FROM CLIP NAME: fast
M2   TAKE       048.0                00:00:00:00
"""


class TestFiles:
    """EDLs, other kinds of files, and broken ones."""

    def test_an_edl(self, tmp_path: Path, plates: Path) -> None:
        path = tmp_path / "reel.edl"
        path.write_text(EDL)
        found = found_in(path, plates)
        assert [(s.name, s.first, s.last, s.place.record) for s in found.shots] == [
            ("A001C003", 4, 15, "01:00:00:00"),
            ("take", 2, 11, "01:00:00:12"),  # the dissolve takes four more
            ("A001C003", 18, 23, "01:00:00:18"),
            ("fast", 0, 10, "01:00:02:00"),
        ]
        assert found.notes == ("1 generated picture",)

    def test_an_edl_of_another_rate(self, tmp_path: Path, plates: Path) -> None:
        path = tmp_path / "reel.edl"
        events = EDL.partition("003  TAKE")[0].replace("00:00:00:08", "00:00:00:20")
        path.write_text(events.replace("01:00:00:18", "01:00:01:05"))
        found = found_in(path, plates, Fraction(25))
        assert found.rate == 25
        assert (found.shots[1].first, found.shots[1].last) == (2, 19)

    @pytest.mark.parametrize("kind", ["otioz", "otiod"])
    def test_bundles(self, kind: str, tmp_path: Path, plates: Path) -> None:
        url = (plates / "b" / "take.mov").as_uri()
        made = timeline(clip("take", external(url, span(0, 30)), 5, 10))
        path = tmp_path / f"edit.{kind}"
        otio.adapters.write_to_file(made, str(path), media_policy="AllMissing")
        found = found_in(path, plates)
        assert [(s.first, s.last) for s in found.shots] == [(5, 14)]
        quick = {"method": "static", "colours": 512, "coarse_colours": 128, "jobs": 1}
        show = analyze_shots(path, tmp_path / "shots", media=plates, **quick)
        assert [entry.status for entry in show.manifest.entries] == ["done"]

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("", "cannot be read as a timeline"),
            ("{", "cannot be read as a timeline"),
            ('{"OTIO_SCHEMA": "Timeline.1", "tracks": 3}', "cannot be read as a timeline"),
            ('{"OTIO_SCHEMA": "Nonsense.1"}', "the type UnknownSchema"),
            ("[]", "expected a timeline"),
            ('{"a": 1}', "found no OTIO_SCHEMA"),
        ],
    )
    def test_broken_files(self, text: str, words: str, tmp_path: Path) -> None:
        path = tmp_path / "bad.otio"
        path.write_text(text)
        with pytest.raises(Palette4dError, match=words):
            timeline_clips.read(path)

    def test_a_broken_edl(self, tmp_path: Path) -> None:
        path = tmp_path / "bad.edl"
        path.write_text("TITLE: x\n\n001 A V C 00:00:00:00\n")
        with pytest.raises(Palette4dError, match=r"line 3: .*expected an event such as 001"):
            timeline_clips.read(path)

    def test_empty_timelines(self, tmp_path: Path) -> None:
        for made, words in (
            (otio.schema.Timeline(name="none"), "found 0 tracks"),
            (timeline(), "found 1 track;"),
            (timeline(gap(10)), "found 1 track, 1 gap;"),
        ):
            with pytest.raises(Palette4dError, match=words):
                edit(made, tmp_path)
        path = tmp_path / "empty.edl"
        path.write_text("TITLE: nothing\n")
        with pytest.raises(Palette4dError, match="found no events"):
            found_in(path)

    def test_a_collection(self, tmp_path: Path, plates: Path) -> None:
        made = timeline(clip("take", external("plates/b/take.mov"), 5, 10))
        collection = otio.schema.SerializableCollection(children=[made])
        assert frames(collection, tmp_path) == [("take", 5, 14)]
        collection.append(otio.schema.Timeline(name="another"))
        with pytest.raises(Palette4dError, match="collection of 2 timelines"):
            edit(collection, tmp_path)

    def test_without_opentimelineio_the_error_says_what_to_install(self, tmp_path: Path) -> None:
        done = run_without("opentimelineio", tmp_path, "analyze", "edit.otio", "-o", "out")
        assert done.returncode == 1
        assert "pip install 'palette4d[timeline]'" in done.stderr
        assert not list(tmp_path.iterdir())


class TestHostile:
    """Files that crash or exhaust the library: an error, and the other shots are there."""

    @pytest.mark.parametrize(
        "metadata", ["[" * 200_000, '{"a":' * 200_000], ids=["lists", "objects"]
    )
    def test_nested_brackets(self, tmp_path: Path, metadata: str) -> None:
        path = tmp_path / "deep.otio"
        path.write_text('{"OTIO_SCHEMA": "Timeline.1", "metadata": ' + metadata)
        with pytest.raises(Palette4dError, match="cannot be read as a timeline"):
            timeline_clips.read(path)

    @unlimited
    def test_an_archive_that_unpacks_to_too_much(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(timeline_files, "MEGABYTES", 300)
        path = tmp_path / "bomb.otioz"
        content = '{"OTIO_SCHEMA": "Timeline.1", "metadata": {"a": [0' + ",0" * 10_000_000 + "]}}"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("content.otio", content)
            archive.writestr("version.txt", "1.0.0")
        assert path.stat().st_size < 100_000
        with pytest.raises(Palette4dError, match=r"more than 300 MB of memory|crashed"):
            timeline_clips.read(path)

    def test_a_file_that_takes_too_long(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        path = save(timeline(clip("x", external("x.mov"), 5, 10)), tmp_path / "slow.otio")
        monkeypatch.setattr(timeline_files, "SECONDS", 0.0)
        with pytest.raises(Palette4dError, match="longer than 0 seconds"):
            timeline_clips.read(path)

    @pipes
    def test_a_pipe(self, tmp_path: Path) -> None:
        os.mkfifo(tmp_path / "pipe.otio")
        with pytest.raises(Palette4dError, match="expected a file"):
            timeline_clips.read(tmp_path / "pipe.otio")

    def test_a_name_that_no_disk_can_hold(self, tmp_path: Path, plates: Path) -> None:
        good = external("plates/b/take.mov")
        made = timeline(
            clip("n" * 300, good, 5, 10),
            clip("m" * 300, external("m" * 300 + ".mov"), 5, 10),
            clip("a\0b", external("a\0b.mov"), 5, 10),
            clip("take", good, 5, 10),
        )
        found = edit(made, tmp_path).shots
        assert [bool(shot.problem) for shot in found] == [False, True, True, False]
        assert all(len(f"{shot.name}.p4d.json.0123") < 255 for shot in found)

    @pytest.mark.parametrize(
        ("limit", "least"), [("SECONDS", 0.0), pytest.param("MEGABYTES", 64, marks=unlimited)]
    )
    def test_media_that_exceeds_a_limit(
        self,
        limit: str,
        least: float,
        tmp_path: Path,
        plates: Path,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        monkeypatch.setattr(timelines, limit, least)
        (shot,) = edit(timeline(clip("x", external("plates/b/take.mov"), 5, 10)), tmp_path).shots
        assert "take.mov: the media is unusable" in shot.problem

    def test_odd_numbers_cost_their_shot(self, tmp_path: Path, plates: Path) -> None:
        good = external("plates/b/take.mov")
        long_number = otio.schema.ImageSequenceReference(
            target_url_base="plates", name_suffix=".png", rate=24, frame_zero_padding=2 * 10**9
        )
        odd = [clip("nan", good, 5, 10), clip("rate", good, 5, 10), clip("one", good, 0, math.inf)]
        odd[0].source_range = span(math.nan, 10)
        odd[1].source_range = span(0, 4, math.nan)
        odd += [clip("pad", long_number, 0, 4), clip("reel", external("gone.mov"), 0, 4)]
        odd[-1].metadata["cmx_3600"] = [1, 2]
        for one in odd:
            take, *rest = edit(timeline(clip("take", good, 5, 10), one), tmp_path).shots
            assert not take.problem
            assert all(shot.problem for shot in rest)

    @pytest.mark.parametrize("rate", [math.nan, math.inf, 0.0, -24.0, 5e-324])
    def test_a_start_time_of_no_rate(self, tmp_path: Path, plates: Path, rate: float) -> None:
        made = timeline(clip("take", external("plates/b/take.mov"), 5, 10))
        made.global_start_time = RationalTime(0, rate)
        with pytest.raises(Palette4dError, match="expected frames per second above 0"):
            edit(made, tmp_path)

    @pytest.mark.parametrize("kind", ["Gap", "Clip"])
    def test_what_has_no_length_costs_the_places_behind_it(
        self, kind: str, tmp_path: Path, plates: Path
    ) -> None:
        """The frames of the shots behind it are known, unless the track is cut somewhere."""
        good = external("plates/b/take.mov")
        item = otio.schema.Clip("x", good) if kind == "Clip" else otio.schema.Gap()
        item.source_range = None
        made = timeline(clip("a", good, 5, 10), item, clip("b", good, 7, 10))
        found = {shot.name: shot for shot in edit(made, tmp_path).shots}
        assert [found[name].used for name in "ab"] == [(5, 14), (7, 16)]
        assert [found[name].place.record for name in "ab"] == ["00:00:00:00", ""]
        assert [name for name, shot in found.items() if shot.problem] == ["x"] * (kind == "Clip")
        made.tracks[0].source_range = span(2, 20)
        found = {shot.name: shot.problem for shot in edit(made, tmp_path).shots}
        assert not found["a"]
        assert f"a {kind.lower()} before it has no length" in found["b"]

    def test_nested_compounds(self, tmp_path: Path) -> None:
        inner = clip("take", external("gone.mov"), 5, 10)
        for _ in range(900):
            inner = otio.schema.Stack(children=[inner])
        with pytest.raises(Palette4dError, match="nested deeper than 64"):
            edit(timeline(inner), tmp_path)

    def test_many_clips_of_one_name_take_linear_time(self, tmp_path: Path) -> None:
        """Each step grew with the clips before: 16 times as long for four times as many."""

        def taken(count: int) -> float:
            made = timeline(*(clip("x", external("gone.mov"), 5, 10) for _ in range(count)))
            path = save(made, tmp_path / "edit.otio")
            begin = time.process_time()
            shots, _ = unlike(timelines.shots_of(timeline_clips.clips_of(path))[0])
            assert len({shot.name for shot in shots}) == count
            if count == 2000:
                assert shots[-1].place.record == "00:13:52:22"
            return time.process_time() - begin

        assert taken(2000) < 8 * min(taken(500), taken(500))
