"""Many shots: `palette4d analyze` on edits and on movies with cuts."""

from __future__ import annotations

import importlib.resources
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import jsonschema
import opentimelineio as otio
import PyOpenColorIO as ocio
import pytest
from any_clips import harbour
from clip_files import write_image
from edits import clip, external, movie, picture, save, sequence, timeline

from palette4d.cli import main
from palette4d.grade.document import Document
from palette4d.media.clip import open_clip
from palette4d.shows import batch

#: A palette that does not change: these tests are about shots, not about the search.
QUICK = ("--method", "static", "--set", "colours=512", "--set", "coarse_colours=128")


def analyze(source: Path | str, out: Path, *words: str) -> int:
    return main.main(["analyze", str(source), "-o", str(out), "--jobs", "1", *QUICK, *words])


def manifest(folder: Path) -> dict[str, Any]:
    (path,) = folder.glob("*.shots.json")
    document: dict[str, Any] = json.loads(path.read_text("utf-8"))
    schema = json.loads(
        (importlib.resources.files("palette4d") / "shots_v1.schema.json").read_text("utf-8")
    )
    jsonschema.Draft202012Validator(schema).validate(document)
    return document


def shots(folder: Path) -> list[tuple[str, str, list[int] | None]]:
    return [(s["name"], s["status"], s.get("frames")) for s in manifest(folder)["shots"]]


def sidecar(folder: Path, name: str) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / f"{name}.p4d.json").read_text("utf-8"))
    return document


def state(folder: Path) -> dict[str, tuple[bytes, int]]:
    """Content and time of change of the sidecars."""
    return {
        path.name: (path.read_bytes(), path.stat().st_mtime_ns)
        for path in sorted(folder.glob("*.p4d.json"))
    }


def recolour(path: Path) -> None:
    """Edit a sidecar as a user does."""
    words = ["edit", str(path), "set", "--near", "0.5,0.5,0.5", "--anyway", "--frame"]
    first = json.loads(path.read_text("utf-8"))["clip"]["frames"]["first"]
    assert main.main([*words, str(first), "--rgb", "0.1", "0.9", "0.2"]) == 0


@pytest.fixture
def cut_movie(tmp_path: Path) -> Path:
    """Six frames of a landscape, four of a harbour."""
    return movie(tmp_path / "media" / "rushes.mov", 10, cut=6)


@pytest.fixture
def edit(tmp_path: Path) -> Path:
    """An edit of three shots, the second of which lacks its media."""
    sequence(tmp_path / "media", "sh010", 1001, 12)
    movie(tmp_path / "media" / "take.mov", 12)
    made = timeline(
        clip("sh010", external("media/sh010.1001.png"), 1003, 5),
        clip("gone", external("media/gone.mov"), 0, 4),
        clip("take", external("media/take.mov"), 2, 5),
    )
    return save(made, tmp_path / "edit.otio")


class TestMovies:
    """--detect-shots."""

    def test_a_sidecar_a_shot(
        self, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out, log = tmp_path / "shots", tmp_path / "progress.txt"
        assert analyze(cut_movie, out, "--detect-shots", "--progress", str(log)) == 0
        *_, last, end = map(json.loads, log.read_text().splitlines())
        assert (last["done"], last["total"], end) == (10, 10, {"finished": True})
        printed = capsys.readouterr()
        assert "2 shots of 2: 2 analysed" in printed.out
        assert printed.err == ""
        assert shots(out) == [("rushes_s001", "done", [0, 5]), ("rushes_s002", "done", [6, 9])]
        document = sidecar(out, "rushes_s002")
        assert document["clip"]["frames"] == {"first": 6, "last": 9, "step": 1, "skipped": []}
        assert document["clip"]["name"] == "rushes_s002"
        assert document["clip"]["source"] == str(cut_movie)
        assert {v["frame"] for v in document["polytope"]["vertices"]} <= {6, 7, 8, 9}
        assert manifest(out)["source"] == {"file": str(cut_movie), "sha256": ""}

    def test_it_is_what_a_range_of_frames_gives(self, cut_movie: Path, tmp_path: Path) -> None:
        out, alone = tmp_path / "shots", tmp_path / "alone.p4d.json"
        assert analyze(cut_movie, out, "--detect-shots") == 0
        words = ["analyze", str(cut_movie), "--frames", "6-9", "-o", str(alone), *QUICK]
        assert main.main(words) == 0
        other = json.loads(alone.read_text("utf-8"))
        other["clip"]["name"] = "rushes_s002"
        assert sidecar(out, "rushes_s002") == other

    def test_no_cut_is_one_shot_and_a_shot_may_be_one_frame(self, tmp_path: Path) -> None:
        whole = sequence(tmp_path / "whole", "a", 1001, 6)
        assert analyze(whole, tmp_path / "one", "--detect-shots") == 0
        assert shots(tmp_path / "one") == [("whole_s001", "done", [1001, 1006])]
        sequence(tmp_path / "tail", "b", 1, 8)
        write_image(tmp_path / "tail" / "b.0009.png", picture(0, harbour))
        assert analyze(tmp_path / "tail", tmp_path / "two", "--detect-shots") == 0
        assert [frames for _, _, frames in shots(tmp_path / "two")] == [[1, 8], [9, 9]]

    def test_a_range_with_a_step(self, tmp_path: Path) -> None:
        sequence(tmp_path / "a", "take", 1, 12)
        for i in range(12):
            write_image(tmp_path / "a" / f"take.{i + 13:04d}.png", picture(i, harbour))
        out = tmp_path / "out"
        assert analyze(tmp_path / "a", out, "--detect-shots", "--frames", "1-23x2") == 0
        assert [frames for _, _, frames in shots(out)] == [[1, 11], [13, 23]]
        assert sidecar(out, "take_s002")["clip"]["frames"]["step"] == 2


class TestEdits:
    """Timelines."""

    def test_what_fails_is_listed_and_done_later(
        self, edit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "shots"
        assert analyze(edit, out) == 1
        printed = capsys.readouterr()
        assert "1 shot of 3 could not be analysed" in printed.err
        assert "gone: the media is missing" in printed.err
        assert shots(out) == [
            ("sh010", "done", [1003, 1007]),
            ("gone", "failed", None),
            ("take", "done", [2, 6]),
        ]
        assert sidecar(out, "sh010")["clip"]["source"] == str(tmp_path / "media" / "sh010.####.png")
        before = state(out)
        movie(tmp_path / "media" / "gone.mov", 6)
        assert analyze(edit, out) == 0
        assert "1 analysed, 2 kept" in capsys.readouterr().out
        after = state(out)
        assert {name: after[name] for name in before} == before
        assert [status for _, status, _ in shots(out)] == ["done"] * 3

    def test_a_fault_of_a_library_costs_its_shot(
        self, edit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def opened(spec: str, **options: Any) -> Any:
            if "sh010" in spec:
                raise RuntimeError("a library's own")
            return open_clip(spec, **options)

        monkeypatch.setattr(batch, "open_clip", opened)
        assert analyze(edit, tmp_path / "shots") == 1
        assert [status for _, status, _ in shots(tmp_path / "shots")] == [
            *("failed", "failed", "done")
        ]

    def test_names_of_others_are_made_unlike(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        take = external(str(movie(tmp_path / "take.mov", 20)))
        made = timeline(
            clip("A", take, 0, 4),
            clip("a", take, 8, 4),
            clip("A", take, 8, 4),
            clip("B/1", take, 3, 3),
        )
        out = tmp_path / "shots"
        assert analyze(save(made, tmp_path / "edit.otio"), out) == 0
        assert [name for name, _, _ in shots(out)] == ["A", "a_f8", "A_f8_2", "B_1"]
        assert "2 shots have the names of others" in capsys.readouterr().err

    def test_handles_end_at_cuts_of_the_media(
        self, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        rushes = external(str(cut_movie))
        made = timeline(clip("land", rushes, 3, 2), clip("sea", rushes, 7, 2))
        path = save(made, tmp_path / "edit.otio")
        out = tmp_path / "shots"
        assert analyze(path, out, "--handles", "3") == 0
        assert shots(out) == [("land", "done", [0, 5]), ("sea", "done", [6, 9])]
        assert "cuts inside of the head and tail frames" in capsys.readouterr().err
        (land, _) = manifest(out)["shots"]
        assert (land["asked"], land["used"]) == ([0, 7], [3, 4])
        assert analyze(path, out, "--handles", "3") == 0
        assert "0 analysed, 2 kept" in capsys.readouterr().out

    def test_a_cut_inside_of_what_is_shown_fails_alone(
        self, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        rushes = external(str(cut_movie))
        made = timeline(clip("both", rushes, 0, 10), clip("sea", rushes, 6, 4))
        path = save(made, tmp_path / "edit.otio")
        assert analyze(path, tmp_path / "shots") == 1
        assert "both: found 1 sudden cut" in capsys.readouterr().err
        assert [status for _, status, _ in shots(tmp_path / "shots")] == ["failed", "done"]
        assert analyze(path, tmp_path / "shots", "--allow-cuts") == 0

    def test_an_edl(self, tmp_path: Path) -> None:
        movie(tmp_path / "media" / "take.mov", 30)
        path = tmp_path / "reel.edl"
        path.write_text(
            "TITLE: reel\n\n001 TAKE V C 00:00:00:05 00:00:00:10 10:00:00:00 10:00:00:05\n"
            "* FROM CLIP NAME: take\n"
        )
        out = tmp_path / "shots"
        assert analyze(path, out, "--media", str(tmp_path / "media"), "--rate", "25") == 0
        (shot,) = manifest(out)["shots"]
        assert (shot["used"], shot["edit"]["record"]) == ([5, 9], "10:00:00:00")
        assert manifest(out)["rate"] == [25, 1]
        # The sidecar's own rate is the media's.
        assert sidecar(out, "take")["clip"]["rate"] == [24, 1]

    def test_an_edl_without_a_rate_is_told(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        movie(tmp_path / "take.mov", 12)
        path = tmp_path / "reel_2.edl"
        path.write_text(
            "TITLE: another\n\n001 TAKE V C 00:00:00:05 00:00:00:10 10:00:00:00 10:00:00:05\n"
            "* FROM CLIP NAME: take\n"
        )
        assert analyze(path, tmp_path / "out", "--media", str(tmp_path)) == 0
        assert "24 frames per second are assumed" in capsys.readouterr().err
        assert (tmp_path / "out" / "reel_2.shots.json").is_file()

    def test_relative_names_stay_relative(
        self, edit: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        assert analyze("edit.otio", Path("out/shots")) == 1
        assert sidecar(Path("out/shots"), "take")["clip"]["source"] == "../../media/take.mov"
        assert manifest(Path("out/shots"))["source"]["file"] == "../../edit.otio"
        assert main.main(["bake", "out/shots/take.p4d.json", "--frame", "3", "-o", "x.cube"]) == 0


class TestAgain:
    """Nothing is done twice, and no edit is lost."""

    def test_what_is_there_is_left_alone(self, cut_movie: Path, tmp_path: Path) -> None:
        out = tmp_path / "shots"
        assert analyze(cut_movie, out, "--detect-shots") == 0
        recolour(out / "rushes_s001.p4d.json")
        before = state(out)
        assert analyze(cut_movie, out, "--detect-shots") == 0
        assert state(out) == before
        (out / "rushes_s002.p4d.json").unlink()
        assert analyze(cut_movie, out, "--detect-shots") == 0
        assert {n: d for n, (d, _) in state(out).items()} == {n: d for n, (d, _) in before.items()}

    def test_edits_are_not_lost(
        self, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "shots"
        assert analyze(cut_movie, out, "--detect-shots") == 0
        edited = out / "rushes_s001.p4d.json"
        recolour(edited)
        mine = edited.read_bytes()
        assert analyze(cut_movie, out, "--detect-shots", "--set", "palette_size=5") == 1
        assert re.search(
            r"1 shot has edits .*: rushes_s001; .*--keep-edits", capsys.readouterr().err
        )
        # The show can still be exported.
        assert edited.read_bytes() == mine
        assert [status for _, status, _ in shots(out)] == ["done", "done"]
        assert analyze(cut_movie, out, "--detect-shots", "--force", "--keep-edits") == 0
        assert edited.read_bytes() == mine
        assert (
            analyze(cut_movie, out, "--detect-shots", "--set", "palette_size=5", "--drop-edits")
            == 0
        )
        assert sidecar(out, "rushes_s001")["edits"]["vertices"] == []

    def test_only_some(
        self, edit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "shots"
        assert analyze(edit, out, "--only", "take") == 1  # the missing media is still told
        assert [status for _, status, _ in shots(out)] == ["to do", "failed", "done"]
        capsys.readouterr()
        assert analyze(edit, out, "--only", "tke") == 1
        assert "--only: there is no shot 'tke'; expected names such as" in capsys.readouterr().err

    def test_shots_of_one_clip_keep_their_names_and_grades(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        """Wherever the editor puts them, and if he trims them."""
        take, out = movie(tmp_path / "take.mov", 30), tmp_path / "shots"

        def run(*events: tuple[int, int]) -> dict[str, Any]:
            items = [clip("A", external(str(take)), first, count) for first, count in events]
            path = save(timeline(*items), tmp_path / "edit.otio")
            assert analyze(path, out, "--keep-edits") == 0
            return {shot["name"]: shot["used"] for shot in manifest(out)["shots"]}

        assert run((2, 4), (12, 4)) == {"A": [2, 5], "A_f12": [12, 15]}
        recolour(out / "A_f12.p4d.json")
        before = (out / "A_f12.p4d.json").read_bytes()
        assert run((12, 4), (2, 4), (22, 4)) == {"A_f12": [12, 15], "A": [2, 5], "A_f22": [22, 25]}
        assert (out / "A_f12.p4d.json").read_bytes() == before
        assert run((13, 4), (2, 4)) == {"A_f12": [13, 16], "A": [2, 5]}
        assert Document.load(out / "A_f12.p4d.json").grade.edited
        assert "no longer" not in capsys.readouterr().err
        assert run((2, 4)) == {"A": [2, 5]}
        assert "1 graded shot is no longer in the edit" in capsys.readouterr().err
        assert Document.load(out / "A_f12.p4d.json").grade.edited

    def test_shots_that_are_not_named_stay_as_they_were(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        take = movie(tmp_path / "take.mov", 30)
        items = [clip(n, external(str(take)), at, 4) for n, at in (("A", 2), ("B", 12), ("C", 22))]
        path, out = save(timeline(*items), tmp_path / "edit.otio"), tmp_path / "shots"
        assert analyze(path, out, "--handles", "1") == 0
        before, files = manifest(out)["shots"], state(out)
        assert analyze(path, out, "--handles", "2", "--only", "B") == 0
        assert "1 analysed, 2 kept" in capsys.readouterr().out
        assert [shot["frames"] for shot in manifest(out)["shots"]] == [[1, 6], [10, 17], [21, 26]]
        assert manifest(out)["shots"][::2] == before[::2]
        assert {n: s for n, s in state(out).items() if n[0] in "AC"} == {
            n: s for n, s in files.items() if n[0] in "AC"
        }
        # Also with its media away, and of an edited shot, which itself is told.
        take.rename(tmp_path / "away.mov")
        recolour(out / "C.p4d.json")
        assert analyze(path, out, "--handles", "1", "--only", "B", "--force") == 1
        assert [status for _, status, _ in shots(out)] == ["done", "failed", "done"]
        assert manifest(out)["shots"][::2] == before[::2]

    @pytest.mark.parametrize("sandbox", [(), ("--sandbox", "off")])
    def test_kept_picks_learn_from_the_shots_clip(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sandbox: tuple[str, ...]
    ) -> None:
        """The show's folder lies below the working folder: the clip's path has other beginnings."""
        take = movie(tmp_path / "plates" / "take.mov", 12)
        save(timeline(clip("A", external(str(take)), 2, 6)), tmp_path / "edit.otio")
        (tmp_path / "work").mkdir()
        monkeypatch.chdir(tmp_path / "work")
        words = [sys.executable, "-m", "palette4d", "analyze", "../edit.otio", "-o", "show", *QUICK]
        words += ["--media", "../plates"]
        subprocess.run(words, check=True, capture_output=True)
        path = Path("show/A.p4d.json")
        document = Document.load(path)
        document.pick(3, pixel=(5, 5), to=(0.2, 0.9, 0.2), follow=False)
        document.save()
        assert document.grade.pick("p1").matte
        words += ["--set", "palette_size=6", "--force", "--keep-edits", *sandbox]
        done = subprocess.run(words, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert "the grade was copied" in done.stdout + done.stderr
        assert Document.load(path).grade.pick("p1").matte

    def test_a_sidecar_that_cannot_be_replaced_costs_its_shot_alone(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        take = external(str(movie(tmp_path / "take.mov", 30)))
        items = [clip("A", take, 2, 4), clip("B", take, 12, 4), clip("C", take, 22, 4)]
        path, out = save(timeline(*items), tmp_path / "edit.otio"), tmp_path / "shots"
        assert analyze(path, out) == 0
        (out / "B.p4d.json").unlink()
        (out / "B.p4d.json").mkdir()
        (out / "C.p4d.json").unlink()
        for words in ((), ("--keep-edits",), ("--drop-edits",)):
            assert analyze(path, out, *words) == 1
            assert [status for _, status, _ in shots(out)] == ["done", "failed", "done"]
            assert "would lose" not in capsys.readouterr().err
            (out / "C.p4d.json").unlink()
        (out / "B.p4d.json").rmdir()
        assert analyze(path, out) == 0
        # What may hold edits stops the command before it begins.
        (out / "B.p4d.json").write_text("broken")
        (out / "C.p4d.json").unlink()
        assert analyze(path, out) == 1
        assert "would lose: B" in capsys.readouterr().err
        assert not (out / "C.p4d.json").exists()

    def test_shots_that_are_not_named_follow_a_new_edit(self, tmp_path: Path) -> None:
        take = external(str(movie(tmp_path / "take.mov", 30)))
        out = tmp_path / "shots"
        old = timeline(clip("A", take, 2, 4), clip("B", take, 12, 4), clip("C", take, 22, 4))
        assert analyze(save(old, tmp_path / "edit.otio"), out, "--handles", "1") == 0
        # B comes first; A is a frame longer, within its handle; C goes beyond its own.
        new = timeline(clip("B", take, 12, 4), clip("A", take, 2, 5), clip("C", take, 22, 6))
        path = save(new, tmp_path / "edit.otio")
        assert analyze(path, out, "--handles", "2", "--only", "B") == 0
        rows = {row["name"]: row for row in manifest(out)["shots"]}
        assert {name: row["status"] for name, row in rows.items()} == {
            "B": "done",
            "A": "done",
            "C": "to do",
        }
        assert (rows["A"]["frames"], rows["A"]["used"]) == ([1, 6], [2, 6])
        assert rows["A"]["edit"]["path"] == [0, 1]

    def test_another_clip_s_sidecar_is_not_replaced(
        self, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "shots"
        other = movie(tmp_path / "other" / "rushes.mov", 6)
        assert analyze(cut_movie, out, "--detect-shots") == 0
        (out / "rushes.shots.json").unlink()
        before = state(out)
        assert analyze(other, out, "--detect-shots") == 1
        assert "sidecar of another clip" in capsys.readouterr().err
        assert state(out) == before
        assert analyze(other, out, "--detect-shots", "--force") == 0
        assert sidecar(out, "rushes_s001")["clip"]["source"] == str(other)

    def test_a_new_version_of_an_edit(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        take = external(str(movie(tmp_path / "take.mov", 30)))
        out = tmp_path / "shots"
        for name, items in (
            ("v1", (clip("A", take, 0, 5), clip("B", take, 10, 5), clip("C", take, 20, 5))),
            ("v2", (clip("A", take, 0, 5), clip("C", take, 20, 5), clip("B", take, 12, 5))),
        ):
            assert analyze(save(timeline(*items), tmp_path / f"{name}.otio"), out) == 0
        assert "1 analysed, 2 kept" in capsys.readouterr().out.partition("wrote")[2]
        document = json.loads((out / "v2.shots.json").read_text("utf-8"))
        assert [shot["frames"] for shot in document["shots"]] == [[0, 4], [20, 24], [12, 16]]

    @pytest.mark.slow
    def test_processes_give_the_same_bytes(self, cut_movie: Path, tmp_path: Path) -> None:
        for jobs in ("1", "2"):
            assert analyze(cut_movie, tmp_path / jobs, "--detect-shots", "--jobs", jobs) == 0
        one, two = ({n: d for n, (d, _) in state(tmp_path / j).items()} for j in "12")
        assert one == two
        assert (tmp_path / "1/rushes.shots.json").read_bytes() == (
            tmp_path / "2/rushes.shots.json"
        ).read_bytes()

    @pytest.mark.skipif(os.name == "nt", reason="Windows sends a program no such signal")
    def test_ctrl_c_leaves_whole_files_and_a_manifest(self, tmp_path: Path) -> None:
        made = timeline()
        for i in range(30):
            take = external(str(movie(tmp_path / f"t{i}.mov", 6)))
            made.tracks[0].append(clip(f"t{i}", take, 0, 6))
        path, out = save(made, tmp_path / "edit.otio"), tmp_path / "shots"
        words = [sys.executable, "-m", "palette4d", "analyze", str(path), "-o", str(out)]
        process = subprocess.Popen(
            [*words, "--jobs", "2"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        deadline = time.monotonic() + 120
        while len(list(out.glob("t*.p4d.json"))) < 2:
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=120)
        assert process.returncode == 130, err
        assert "Traceback" not in err
        done = [name for name, status, _ in shots(out) if status == "done"]
        assert 0 < len(done) < 30
        assert {f"{name}.p4d.json" for name in done} == {p.name for p in out.glob("*.p4d.json")}
        assert not [p for p in out.iterdir() if p.name.startswith(".")]


class TestColourSpaces:
    """--input-space and its like, for every shot."""

    def test_each_shot_has_its_conversion(self, cut_movie: Path, tmp_path: Path) -> None:
        out = tmp_path / "shots"
        words = ("--detect-shots", "--input-space", "ACEScg")
        assert analyze(cut_movie, out, *words) == 0
        alone = tmp_path / "alone.p4d.json"
        verb = ["analyze", str(cut_movie), "--frames", "6-9", "-o", str(alone), *QUICK]
        assert main.main([*verb, "--input-space", "ACEScg"]) == 0
        other = json.loads(alone.read_text("utf-8"))
        other["clip"]["name"] = "rushes_s002"
        assert sidecar(out, "rushes_s002") == other
        assert other["clip"]["conversion"]["input_space"] == "ACEScg"
        assert manifest(out)["options"]["input_space"] == "ACEScg"

    def test_another_space_is_another_palette(
        self, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "shots"
        for words, done in (
            (("--input-space", "ACEScg"), "2 analysed, 0 kept"),
            (("--input-space", "ACEScg"), "0 analysed, 2 kept"),
            ((), "2 analysed, 0 kept"),
            ((), "0 analysed, 2 kept"),
        ):
            assert analyze(cut_movie, out, "--detect-shots", *words) == 0
            assert done in capsys.readouterr().out
        assert "conversion" not in sidecar(out, "rushes_s001")["clip"]

    def test_a_shot_of_another_space(
        self, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "shots"
        one = ("--only", "rushes_s002")
        for words, done in (
            ((), "2 analysed, 0 kept"),
            ((*one, "--input-space", "ACEScg"), "1 analysed, 1 kept"),
            ((), "0 analysed, 2 kept"),
            (("--force",), "2 analysed, 0 kept"),
            (("--input-space", "ACES2065-1"), "1 analysed, 1 kept"),
            ((*one, "--input-space", "ACES2065-1"), "1 analysed, 1 kept"),
            (("--input-space", "ACEScg"), "2 analysed, 0 kept"),
            ((*one, "--input-space", "ACES2065-1"), "1 analysed, 1 kept"),
            (one, "1 analysed, 1 kept"),
        ):
            assert analyze(cut_movie, out, "--detect-shots", *words) == 0
            assert done in capsys.readouterr().out, words
            own = manifest(out)["shots"][1].get("input_space")
            space = sidecar(out, "rushes_s002")["clip"].get("conversion", {}).get("input_space")
            assert space == (own or manifest(out)["options"].get("input_space"))

    def test_only_gives_spaces_to_its_shots_alone(self, tmp_path: Path) -> None:
        take = external(str(movie(tmp_path / "take.mov", 30)))
        out, path = tmp_path / "shots", tmp_path / "edit.otio"

        def spaces() -> dict[str, str | None]:
            return {row["name"]: row.get("input_space") for row in manifest(out)["shots"]}

        save(timeline(clip("A", take, 2, 4), clip("B", take, 12, 4)), path)
        one = ("--only", "A", "--force", "--input-space")
        assert analyze(path, out, *one, "ACEScg") == 0  # the first command of the show
        assert analyze(path, out) == 0
        assert spaces() == {"A": "ACEScg", "B": None}
        assert "conversion" not in sidecar(out, "B")["clip"]
        assert analyze(path, out, "--only", "B", "--input-space", "ACEScct") == 0
        # C is new, and B is longer.
        save(timeline(clip("A", take, 2, 4), clip("B", take, 12, 8), clip("C", take, 22, 4)), path)
        assert analyze(path, out, *one, "ACES2065-1") == 0
        assert spaces() == {"A": "ACES2065-1", "B": "ACEScct", "C": None}
        assert analyze(path, out) == 0
        assert "conversion" not in sidecar(out, "C")["clip"]
        assert sidecar(out, "B")["clip"]["encoding"] == "ACEScct"

    def test_a_shot_of_another_config(self, cut_movie: Path, tmp_path: Path) -> None:
        out, own = tmp_path / "shots", tmp_path / "own.ocio"
        config = ocio.Config.CreateFromBuiltinConfig("ocio://studio-config-latest")
        config.addColorSpace(ocio.ColorSpace(name="mine", encoding="sdr-video"))
        own.write_text(config.serialize(), "utf-8")
        spaces = ("--input-space", "mine", "--palette-space", "ACEScct", "--ocio-config", str(own))
        assert analyze(cut_movie, out, "--detect-shots") == 0
        assert analyze(cut_movie, out, "--detect-shots", "--only", "rushes_s002", *spaces) == 0
        before = sidecar(out, "rushes_s002")
        assert before["clip"]["conversion"]["config"] == str(own)
        assert analyze(cut_movie, out, "--detect-shots", "--force") == 0
        assert sidecar(out, "rushes_s002") == before
        assert "conversion" not in sidecar(out, "rushes_s001")["clip"]

    def test_shots_of_one_movie_have_configs_of_their_own(self, tmp_path: Path) -> None:
        """Where clips are decoded by confined processes, these read the configs of all."""
        take = movie(tmp_path / "media" / "take.mov", 30)
        items = [clip(n, external(str(take)), at, 4) for n, at in (("A", 2), ("B", 12))]
        path, out, folder = tmp_path / "edit.otio", tmp_path / "shots", tmp_path / "configs"
        save(timeline(*items), path)
        config = ocio.Config.CreateFromBuiltinConfig("ocio://studio-config-latest")
        config.addColorSpace(ocio.ColorSpace(name="mine", encoding="sdr-video"))
        folder.mkdir()
        (folder / "own.ocio").write_text(config.serialize(), "utf-8")
        words = [sys.executable, "-m", "palette4d", "analyze", str(path), "-o", str(out), *QUICK]
        spaces = ("--input-space", "mine", "--palette-space", "ACEScct")
        one = ["--only", "A", *spaces, "--ocio-config", str(folder / "own.ocio")]
        for more in (one, ["--force"]):
            done = subprocess.run([*words, *more], capture_output=True, text=True)
            assert done.returncode == 0, done.stderr
        assert [status for _, status, _ in shots(out)] == ["done", "done"]

    def test_an_unknown_space_fails_each_shot(
        self, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "shots"
        assert analyze(cut_movie, out, "--detect-shots", "--input-space", "ACEScgg") == 1
        assert "ACEScg" in capsys.readouterr().err
        assert [status for _, status, _ in shots(out)] == ["failed", "failed"]


class TestRefusals:
    """What cannot be done is said, and leaves nothing."""

    @pytest.mark.parametrize(
        "words",
        [
            ("edit.otio", "-o", "x", "--detect-shots"),
            ("edit.otio", "-o", "x", "--frames", "1-5"),
            ("edit.otio", "-o", "x.p4d.json"),
            ("edit.otio", "-o", "x", "--handles", "-1"),
            ("edit.otio", "-o", "x", "--only", "a,,b"),
            ("edit.otio", "-o", "x", "--cluster", "farm"),
            ("edit.otio", "-o", "x", "--cluster", "somewhere"),
            ("a.mov", "-o", "x", "--handles", "3"),
            ("a.mov", "-o", "x", "--media", "m"),
            ("a.mov", "-o", "x", "--detect-shots", "--media", "m"),
            ("a.mov", "-o", "x", "--only", "a"),
            ("a.mov", "-o", "x", "--cluster", "farm:8786"),
            ("a.mov", "-o", "x", "--jobs", "2"),
            ("a.mov", "-o", "x", "--force"),
        ],
    )
    def test_wrong_usage(
        self, words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        with pytest.raises(SystemExit) as stop:
            main.main(["analyze", *words])
        assert stop.value.code == 2
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize(
        ("name", "text", "words"),
        [
            ("bad.otio", "{", "cannot be read as a timeline"),
            ("none.edl", "TITLE: none\n", "the timeline shows no clip"),
        ],
    )
    def test_timelines(
        self,
        name: str,
        text: str,
        words: str,
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        (tmp_path / name).write_text(text)
        assert analyze(tmp_path / name, tmp_path / "out") == 1
        assert words in capsys.readouterr().err
        assert [path.name for path in tmp_path.iterdir()] == [name]

    def test_no_such_timeline(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert analyze(tmp_path / "no.otio", tmp_path / "out") == 1
        assert "there is no such timeline" in capsys.readouterr().err

    def test_a_folder_that_cannot_be(
        self, edit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        (tmp_path / "file").write_text("mine")
        assert analyze(edit, tmp_path / "file" / "out") == 1
        assert "the folder cannot be made" in capsys.readouterr().err
        assert (tmp_path / "file").read_text() == "mine"

    @pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
    def test_a_folder_that_cannot_be_written(
        self, edit: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "out"
        out.mkdir(mode=0o500)
        assert analyze(edit, out) == 1
        assert "cannot write in" in capsys.readouterr().err

    @pytest.mark.parametrize(
        "text", ["", "{}", "[]", '{"schema": "palette4d.shots", "version": 1, "shots": [{}]}']
    )
    def test_a_manifest_that_is_none(
        self, text: str, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "shots"
        out.mkdir()
        (out / "rushes.shots.json").write_text(text)
        assert analyze(cut_movie, out, "--detect-shots") == 1
        assert "rushes.shots.json: " in capsys.readouterr().err
        assert (out / "rushes.shots.json").read_text() == text
        assert len(list(out.iterdir())) == 1

    def test_a_newer_manifest(
        self, cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "shots"
        assert analyze(cut_movie, out, "--detect-shots") == 0
        path = out / "rushes.shots.json"
        path.write_text(path.read_text().replace('"version": 1', '"version": 2'))
        assert analyze(cut_movie, out, "--detect-shots") == 1
        assert "found a manifest of version 2, expected 1" in capsys.readouterr().err

    def test_a_full_disk(self, edit: Path, tmp_path: Path) -> None:
        """Files of more than 2,500 bytes cannot be written, as sidecars are."""
        out = tmp_path / "shots"
        resource = pytest.importorskip("resource")
        words = [sys.executable, "-m", "palette4d", "analyze", str(edit), "-o", str(out)]
        done = subprocess.run(
            [*words, "--jobs", "1", "--quiet", *QUICK],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2500, 2500)),
        )
        assert done.returncode == 1, done.stderr
        assert "3 shots of 3 could not be analysed" in done.stderr
        assert "written" in done.stderr
        assert [path.name for path in out.iterdir()] == ["edit.shots.json"]
        assert [status for _, status, _ in shots(out)] == ["failed"] * 3


def test_json_is_the_manifest(
    cut_movie: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert analyze(cut_movie, tmp_path / "shots", "--detect-shots", "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == manifest(tmp_path / "shots")


def test_the_timeline_is_not_touched(edit: Path, tmp_path: Path) -> None:
    before = edit.read_bytes()
    analyze(edit, tmp_path / "shots")
    assert edit.read_bytes() == before
    assert isinstance(otio.adapters.read_from_file(str(edit)), otio.schema.Timeline)
