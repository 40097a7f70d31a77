"""A show's series, its config, and the references that an edit gets."""

from __future__ import annotations

import contextlib
import copy
import json
import shutil
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import opentimelineio as otio
import PyOpenColorIO as ocio
import pytest
from edits import clip, dissolve, external, gap, movie, save, timeline

from palette4d.cli import main
from palette4d.common.errors import Palette4dError
from palette4d.shows import timeline_references

#: A palette that does not change: these tests are about timelines.
QUICK = ("--method", "static", "--set", "colours=512", "--set", "coarse_colours=128")
#: What other programs keep in a timeline.
THEIRS = {"colour": {"lut": "théirs.cube", "big": 2**60, "share": 0.1, "none": None}}


@pytest.fixture(scope="module")
def analysed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An edit of two shots, one of them nested, and what its analysis leaves in the folder."""
    folder = tmp_path_factory.mktemp("analysed") / "show"
    movie(folder / "media" / "one.mov", 12)
    movie(folder / "media" / "two.mov", 12)
    inner = otio.schema.Track(
        kind="Video", children=[clip("two", external("media/two.mov"), 1, 6, metadata=THEIRS)]
    )
    made = timeline(
        clip("one", external("media/one.mov"), 2, 5),
        dissolve(0, 2),
        otio.schema.Stack(name="comp", children=[inner], metadata={"palette4d": {"old": 1}}),
        gap(3),
        clip("gone", external("media/gone.mov"), 0, 4),
    )
    made.metadata.update(THEIRS)
    save(made, folder / "edit.otio")
    with contextlib.chdir(folder):
        assert analyze("edit.otio") == 1
    return folder


def analyze(edit: str) -> int:
    return main.main(["analyze", edit, "-o", "shots", "--jobs", "1", "--quiet", *QUICK])


@pytest.fixture
def show(analysed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the analysed edit; the manifest."""
    shutil.copytree(analysed, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "shots" / "edit.shots.json"


def export(manifest: Path, *words: object) -> int:
    verb = ["export", str(manifest), "--every", "3", "--size", "3", "--jobs", "1"]
    return main.main([*verb, *map(str, words)])


def without_ours(value: Any) -> Any:
    """A document without the member that is ours in any metadata."""
    if isinstance(value, dict):
        return {
            name: without_ours(
                {k: v for k, v in item.items() if k != "palette4d"} if name == "metadata" else item
            )
            for name, item in value.items()
        }
    return [without_ours(item) for item in value] if isinstance(value, list) else value


class TestReferences:
    """--otio."""

    def test_clips_name_their_files(
        self, show: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        if sys.platform != "win32":  # Windows never asks whether the folder before ".." is there
            assert export(show, "-o", "luts", "--otio", "graded/../graded.otio") == 1
        assert export(show, "-o", "luts", "--otio", "graded.otio") == 0
        printed = capsys.readouterr()
        assert "graded.otio: references in 2 clips" in printed.out
        assert "1 shot not analysed and left out: gone" in printed.err
        found = otio.adapters.read_from_file("graded.otio")
        one = found.tracks[0][0].metadata["palette4d"]
        assert one["shot"] == "one"
        assert one["sidecar"] == "shots/one.p4d.json"
        assert list(one["frames"]) == [2, 8]  # the dissolve takes two more
        assert one["series"] == "luts/one/one.series.json"
        assert [(row["frame"], row["file"]) for row in one["luts"]] == [
            (frame, f"luts/one/one.{frame:04d}.cube") for frame in (2, 5, 8)
        ]
        for row in one["luts"]:
            assert (tmp_path / row["file"]).is_file()
        two = found.tracks[0][2][0][0].metadata["palette4d"]
        assert two["shot"] == "two"
        assert "palette4d" not in found.tracks[0][4].metadata
        assert found.metadata["palette4d"]["manifest"] == "shots/edit.shots.json"

    def test_all_is_of_the_manifest_that_was_read(
        self, show: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """`analyze` replaces it after each shot."""
        check = timeline_references.check

        def analyse_on(*arguments: Any) -> Any:
            document = json.loads(show.read_text("utf-8"))
            document["shots"][0] = {**document["shots"][0], "status": "to do"}
            show.write_text(json.dumps(document), "utf-8")
            return check(*arguments)

        monkeypatch.setattr(timeline_references, "check", analyse_on)
        assert export(show, "-o", "luts", "--otio", "graded.otio") == 0
        for name in ("one", "two"):
            index = json.loads(Path(f"luts/{name}/{name}.series.json").read_text("utf-8"))
            assert index["sidecar"]["file"] == f"{name}.p4d.json"

    def test_nothing_else_changes(self, show: Path, tmp_path: Path) -> None:
        source = tmp_path / "edit.otio"
        before = source.read_bytes()
        assert export(show, "-o", "luts", "--otio", "graded.otio") == 0
        assert source.read_bytes() == before
        graded = json.loads(Path("graded.otio").read_text("utf-8"))
        assert without_ours(graded) == without_ours(json.loads(before))
        # Metadata of ours that an earlier program left elsewhere stays, too.
        stack = graded["tracks"]["children"][0]["children"][2]
        assert stack["metadata"] == {"palette4d": {"old": 1}}

    def test_what_opentimelineio_does_not_know_stays(self, show: Path, tmp_path: Path) -> None:
        source = tmp_path / "edit.otio"
        document = json.loads(source.read_text("utf-8"))
        document["from_tomorrow"] = {"x": [1, 2.5, float("inf")]}
        document["tracks"]["children"][0]["children"][0]["effects"] = [
            {"OTIO_SCHEMA": "Effect.1", "effect_name": "Sparkle", "amount": 3, "metadata": THEIRS}
        ]
        source.write_text(json.dumps(document), "utf-8")
        assert (
            main.main(["analyze", "edit.otio", "-o", "shots", "--quiet", "--jobs", "1", *QUICK])
            == 1
        )
        assert export(show, "-o", "luts", "--otio", "graded.otio") == 0
        graded = json.loads(Path("graded.otio").read_text("utf-8"))
        assert without_ours(graded) == without_ours(document)

    def test_an_existing_file_is_kept_unless_forced(
        self, show: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        before = (tmp_path / "edit.otio").read_bytes()
        assert export(show, "-o", "luts", "--otio", "edit.otio") == 1
        assert "--force" in capsys.readouterr().err
        assert (tmp_path / "edit.otio").read_bytes() == before
        assert not Path("luts").exists()
        assert export(show, "-o", "luts", "--otio", "edit.otio", "--force") == 0
        assert without_ours(json.loads(Path("edit.otio").read_text("utf-8"))) == without_ours(
            json.loads(before)
        )

    def test_another_timeline_than_was_analysed(
        self, show: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        source = tmp_path / "edit.otio"
        source.write_text(source.read_text("utf-8").replace("comp", "pomc"), "utf-8")
        assert export(show, "-o", "luts", "--otio", "graded.otio") == 1
        assert "was changed since its shots were analysed" in capsys.readouterr().err
        source.unlink()
        assert export(show, "-o", "luts", "--otio", "graded.otio") == 1
        assert "is not there" in capsys.readouterr().err
        assert not Path("luts").exists()

    def test_an_edl_becomes_an_otio(self, show: Path, tmp_path: Path) -> None:
        """Its tracks begin at different times, the later one first in the file."""
        (tmp_path / "reel.edl").write_text(
            "TITLE: reel\n\n001 ONE V2 C 00:00:00:04 00:00:00:10 01:00:10:03 01:00:10:09\n"
            "* FROM CLIP NAME: one\n002 ONE V C 00:00:00:02 00:00:00:08 01:00:00:00 01:00:00:06\n"
            "* FROM CLIP NAME: one\n"
        )
        words = [
            "analyze",
            "reel.edl",
            "--media",
            "media",
            "-o",
            "reel",
            "--quiet",
            "--jobs",
            "1",
            *QUICK,
        ]
        assert main.main(words) == 0
        manifest = tmp_path / "reel" / "reel.shots.json"
        assert export(manifest, "-o", "luts", "--otio", "reel.otio") == 0
        found = otio.adapters.read_from_file("reel.otio")
        places = {}
        for one in found.find_clips():
            noted = one.metadata["palette4d"]
            at = found.global_start_time + one.range_in_parent().start_time
            places[noted["sidecar"]] = (list(noted["used"]), otio.opentime.to_timecode(at))
        assert places == {
            "reel/one.p4d.json": ([4, 9], "01:00:10:03"),
            "reel/one_f2.p4d.json": ([2, 7], "01:00:00:00"),
        }

    def test_a_movie_has_no_timeline(
        self, show: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        words = [
            "analyze",
            "media/one.mov",
            "--detect-shots",
            "-o",
            "cut",
            "--quiet",
            "--jobs",
            "1",
            *QUICK,
        ]
        assert main.main(words) == 0
        assert export(Path("cut/one.shots.json"), "-o", "luts", "--otio", "a.otio") == 1
        assert "expects those of a timeline" in capsys.readouterr().err


class TestSeries:
    """Every shot's LUTs."""

    def test_a_folder_a_shot_and_what_is_there_is_kept(
        self, show: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert export(show, "-o", "luts") == 0
        assert sorted(p.name for p in Path("luts").iterdir()) == ["one", "two"]
        times = {p: p.stat().st_mtime_ns for p in Path("luts").rglob("*.cube")}
        capsys.readouterr()
        assert export(show, "-o", "luts") == 0
        assert "0 baked, 3 kept" in capsys.readouterr().out
        assert {p: p.stat().st_mtime_ns for p in Path("luts").rglob("*.cube")} == times

    def test_stops_of_unedited_shots_are_their_first_frame(
        self, show: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        words = [
            "edit",
            "shots/two.p4d.json",
            "set",
            "--near",
            "0.5,0.5,0.5",
            "--frame",
            "6",
            "--anyway",
        ]
        assert main.main([*words, "--rgb", "0.2", "0.9", "0.1"]) == 0
        verb = ["export", str(show), "--stops", "--size", "3", "--jobs", "1", "--quiet", "--json"]
        capsys.readouterr()
        assert main.main([*verb, "-o", "luts"]) == 0
        printed = json.loads(capsys.readouterr().out)
        assert [row["frame"] for row in printed["one"]["frames"]] == [2]
        assert len(printed["two"]["frames"]) > 1

    def test_frames_that_fail_are_listed_by_shot(
        self, show: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        for name in ("one", "two"):
            words = [
                "edit",
                f"shots/{name}.p4d.json",
                "set",
                "--near",
                "0.5,0.5,0.5",
                "--anyway",
                "--frame",
            ]
            assert main.main([*words, "4", "--rgb", "0.2", "0.9", "0.1"]) == 0
        assert export(show, "-o", "luts", "--format", "cc", "--max-error", "0") == 1
        err = capsys.readouterr().err
        assert "of 2 shots could not be baked" in err
        assert "shot one:" in err
        assert "shot two:" in err

    @pytest.mark.parametrize(
        "words",
        [("--name", "x"), ("--clip", "x"), ("--frames", "1-5")],
        ids=str,
    )
    def test_wrong_usage(self, show: Path, words: tuple[str, ...]) -> None:
        frames = () if "--frames" in words else ("--every", "1")
        assert main.main(["export", str(show), *words, *frames, "-o", "luts"]) == 1
        sidecar = str(show.parent / "one.p4d.json")
        assert main.main(["export", sidecar, "--stops", "-o", "luts", "--otio", "a.otio"]) == 1
        assert not Path("luts").exists()

    def test_nothing_analysed(self, show: Path, capsys: pytest.CaptureFixture[str]) -> None:
        document = json.loads(show.read_text("utf-8"))
        for shot in document["shots"]:
            shot["status"] = "to do"
            shot.pop("frames", None)
        show.write_text(json.dumps(document), "utf-8")
        assert export(show, "-o", "luts") == 1
        assert "none of its 3 shots is analysed" in capsys.readouterr().err
        assert not Path("luts").exists()


def test_a_timeline_whose_readers_would_disagree_is_refused(show: Path, tmp_path: Path) -> None:
    """OpenTimelineIO reads the first of two members of one name, and others the last."""
    text = (tmp_path / "edit.otio").read_text()
    twice = tmp_path / "twice.otio"
    twice.write_text(text.replace('"name"', '"name": "another",\n"name"', 1))
    otio.adapters.read_from_file(str(twice))
    with pytest.raises(Palette4dError, match="two members 'name'"):
        timeline_references._document(twice, Fraction(24))


def test_a_config_has_a_look_a_shot(show: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "edit",
        "shots/two.p4d.json",
        "set",
        "--near",
        "0.5,0.5,0.5",
        "--anyway",
        "--frame",
        "4",
    ]
    assert main.main([*words, "--rgb", "0.2", "0.9", "0.1"]) == 0
    verb = ["config", str(show), "-o", "show", "--every", "4", "--size", "5", "--jobs", "1"]
    verb.append("--anyway")
    assert main.main([*verb, "--quiet", "--process-space", "sRGB - Texture"]) == 0
    assert "left out: gone" in capsys.readouterr().err
    config = ocio.Config.CreateFromFile("show/config.ocio")
    assert list(config.getLookNames())[-3:] == ["one", "two", "palette4d"]
    context = copy.deepcopy(config.getCurrentContext())
    changed = {}
    for shot in ("one", "two"):
        context["SHOT"], context["FRAME"] = shot, "4"
        look = ocio.LookTransform(src="sRGB - Texture", dst="sRGB - Texture", looks="palette4d")
        processor = config.getProcessor(context, look, ocio.TRANSFORM_DIR_FORWARD)
        grey = processor.getDefaultCPUProcessor().applyRGB([0.5, 0.5, 0.5])
        changed[shot] = max(abs(value - 0.5) for value in grey)
    assert changed["one"] < 1e-3
    assert changed["two"] > 0.01
    # A show of one shot, which is not edited, is still a show.
    document = json.loads(show.read_text("utf-8"))
    document["shots"] = [shot for shot in document["shots"] if shot["name"] == "one"]
    show.write_text(json.dumps(document), "utf-8")
    verb = ["config", str(show), "-o", "lone", "--stops", "--size", "5", "--jobs", "1", "--quiet"]
    assert main.main([*verb, "--process-space", "sRGB - Texture"]) == 0
