"""`palette4d analyze` as a user calls it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from analysis_frames import mixture
from clip_files import write_image
from palette4d.analysis.options import OPTIONS

from palette4d.cli import main
from palette4d.grade.document import Document
from palette4d.grade.picks import Area

#: Without the search, where a test is not about it.
STATIC = ("--quiet", "--method", "static")
CORNERS = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])


@pytest.fixture
def clip(tmp_path) -> Path:
    folder = tmp_path / "clip"
    folder.mkdir()
    for i in range(6):
        write_image(folder / f"shot.{1001 + i}.png", mixture(CORNERS + 0.01 * i, i))
    return folder


def test_writes_a_sidecar_and_a_report(clip, tmp_path, capsys):
    out = tmp_path / "shot.p4d.json"
    assert main.main(["analyze", str(clip), "-o", str(out), "--rate", "24000/1001"]) == 0
    printed = capsys.readouterr().out
    for stage in ("frame_hulls", "block_merging", "vertex_removal", "vertex_refinement"):
        assert stage in printed
    for line in ("fit ", "handles ", "shape ", "seconds "):
        assert f"\n{line}" in printed
    document = json.loads(out.read_text())
    assert document["clip"]["rate"] == [24000, 1001]
    assert document["clip"]["frames"]["first"] == 1001
    assert document["quality"]["options"]["lambda"] == 50


def test_json_report_and_frames(clip, tmp_path, capsys):
    out = tmp_path / "shot.p4d.json"
    assert (
        main.main(["analyze", str(clip), "-o", str(out), "--frames", "1002-1006x2", "--json"]) == 0
    )
    report = json.loads(capsys.readouterr().out)
    assert report["stages"][-1]["stage"] == "vertex_refinement"
    assert [fit["frame"] for fit in report["frames"]] == [1002, 1004, 1006]
    assert report["palette"]["worst_frame"] in (1002, 1004, 1006)
    assert set(report["seconds"]) >= {"colour_statistics", "frame_hulls"}
    assert report["stages"][-1]["L_prime"] <= report["stages"][0]["L_prime"]
    frames = json.loads(out.read_text())["clip"]["frames"]
    assert (frames["first"], frames["last"], frames["step"]) == (1002, 1006, 2)


def test_picks_keep_their_places_when_a_clips_colour_space_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As the note on scene-linear clips asks: the pixels are the same, their numbers change."""
    halves = np.where(np.arange(24)[None, :, None] < 12, [0.5, 0.02, 0.02], [0.1, 0.1, 0.12])
    for frame in range(1, 5):
        pixels = (halves * (1 + frame / 100)).repeat(16, 0).astype(np.float32)
        write_image(tmp_path / "v" / f"g.{frame:04d}.exr", pixels)
    out = tmp_path / "g.p4d.json"
    analyze = ["analyze", str(tmp_path / "v"), "-o", str(out), "--quiet"]
    assert main.main(analyze) == 0
    for place, to, how in (
        ("5,8", "0.02 0.02 0.5", "--follow"),
        ("18,8", "0 0.3 0", "--no-follow"),
    ):
        pick = ["pick", "--pixel", place, "--to", *to.split(), "--frame", "2", how]
        assert main.main(["edit", str(out), *pick]) == 0
    capsys.readouterr()
    again = [*analyze, "--keep-edits", "--input-space", "Linear Rec.709 (sRGB)"]
    assert main.main(again) == 0
    said = capsys.readouterr().err
    assert "not copied" not in said
    assert "picked where" not in said
    kept = Document.load(out).grade.picks
    assert [pick.pixel for pick in kept] == [(5, 8), (18, 8)]
    assert [bool(pick.path) for pick in kept] == [True, False]  # followed, and not followed


@pytest.mark.parametrize("confined", [True, False])
def test_kept_picks_learn_from_the_analysed_clip_beside_their_sidecar(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, confined: bool
) -> None:
    """The sidecar names it relative to its own folder; in the working folder is another clip."""
    halves = np.where(np.arange(24)[None, :, None] < 12, [200, 40, 40], [90, 90, 95]).repeat(16, 0)
    for folder, pixels in (("A", 255 - halves), ("B", halves)):
        for frame in range(1, 5):
            write_image(tmp_path / folder / f"g.{frame:04d}.png", (pixels + frame).astype(np.uint8))
    monkeypatch.chdir(tmp_path / "A")
    out = "../B/g.p4d.json"
    analyze = ["analyze", "../B/g.####.png", "-o", out, "--quiet"]
    analyze += [] if confined else ["--sandbox", "off"]
    assert main.main([*analyze, "--method", "static"]) == 0
    pick = ["pick", "--pixel", "5,8", "--to", "#3060b0", "--frame", "2"]
    assert main.main(["edit", out, *pick]) == 0
    again = ["pick", "--pixel", "6,8", "--with", "p1", "--frame", "4"]
    assert main.main(["edit", out, *again]) == 0
    alone = ["pick", "--colour", "0.3", "0.3", "0.3", "--to", "#30b060", "--frame", "2"]
    assert main.main(["edit", out, *alone]) == 0
    # As an older sidecar is, which does not tell that the pictures are the same.
    fields = json.loads(Path(out).read_text())
    del fields["colours"]
    Path(out).write_text(json.dumps(fields))
    before = Document.load(out)
    assert before.grade.picks[0].matte is not None
    assert main.main([*analyze, "--keep-edits"]) == 0
    after = Document.load(out)
    kept, by_colour = after.grade.picks
    assert (by_colour.rgb, by_colour.pixel) == ((0.3, 0.3, 0.3), None)
    assert kept.matte is not None
    assert (kept.pixel, kept.rgb) == ((5, 8), before.grade.picks[0].rgb)
    assert kept.path == before.grade.picks[0].path
    assert [key.frame for key in kept.path if key.given and key.frame != 2] == [4]
    assert after.grade.mattes[kept.matte] == before.grade.mattes[before.grade.picks[0].matte]


def test_the_files_bytes_are_the_same_every_time(clip, tmp_path):
    for name, threads in (("a", "1"), ("b", "4")):
        arguments = [
            "analyze",
            str(clip),
            "-o",
            str(tmp_path / name),
            "--set",
            f"threads={threads}",
        ]
        assert main.main([*arguments, "--quiet"]) == 0
    texts = {(tmp_path / name).read_bytes() for name in "ab"}
    assert len(texts) == 1


def test_edits_are_not_lost(clip, tmp_path, capsys):
    out = tmp_path / "shot.p4d.json"
    assert main.main(["analyze", str(clip), "-o", str(out), *STATIC]) == 0
    edit = ["edit", str(out), "set", "--near", "0.9,0.2,0.2", "--frame", "1001"]
    assert main.main([*edit, "--rgb", "1", "0.5", "0"]) == 0
    edited = out.read_bytes()
    assert main.main(["analyze", str(clip), "-o", str(out), *STATIC]) == 1
    error = capsys.readouterr().err
    assert "--keep-edits" in error
    assert "--drop-edits" in error
    assert out.read_bytes() == edited
    assert main.main(["analyze", str(clip), "-o", str(out), *STATIC, "--keep-edits"]) == 0
    assert out.read_bytes() == edited
    assert main.main(["analyze", str(clip), "-o", str(out), *STATIC, "--drop-edits"]) == 0
    assert json.loads(out.read_text())["edits"] == {"vertices": [], "stops": []}


def test_a_pick_stays_where_it_was_picked_in_the_clip(clip, tmp_path):
    """Its colour lies in single pixels, as of a thing that is small or untagged."""
    out = tmp_path / "shot.p4d.json"
    assert main.main(["analyze", str(clip), "-o", str(out), *STATIC]) == 0
    edit = ["edit", str(out), "pick", "--frame", "1003", "--pixel", "5,4", "--to", "#305090"]
    assert main.main(edit) == 0
    (before,) = json.loads(out.read_text())["edits"]["picks"]
    again = ["analyze", str(clip), "-o", str(out), "--quiet", "--keep-edits"]
    assert main.main([*again, "--frames", "1001-1006"]) == 0
    (after,) = json.loads(out.read_text())["edits"]["picks"]
    for name in ("frame", "pixel", "box", "rgb", "to"):
        assert after[name] == before[name]
    assert "matte" in after


def test_no_picture_is_replaced_by_a_sidecar(clip, tmp_path, capsys):
    frame = clip / "shot.1001.png"
    before = frame.read_bytes()
    assert main.main(["analyze", str(clip), "-o", str(frame), *STATIC, "--drop-edits"]) == 1
    assert "a picture" in capsys.readouterr().err
    assert frame.read_bytes() == before


def test_a_new_version_keeps_handles_and_grade(clip, tmp_path, capsys):
    out = tmp_path / "shot.p4d.json"
    assert main.main(["analyze", str(clip), "-o", str(out), "--quiet"]) == 0
    graded = ["edit", str(out), "set", "--near", "0.9,0.2,0.2", "--frame", "1001"]
    assert main.main([*graded, "--rgb", "0.2", "0.2", "0.9"]) == 0
    old = json.loads(out.read_text())
    for i in range(6):
        write_image(clip / f"shot.{1001 + i}.png", mixture(CORNERS + 0.01 * i, 100 + i))
    again = ["analyze", str(clip), "-o", str(out), "--like", str(out), "--keep-edits"]
    assert main.main(again) == 0
    assert "earlier_palette" in capsys.readouterr().out
    new = json.loads(out.read_text())
    assert [v["id"] for v in new["polytope"]["vertices"]] == [
        v["id"] for v in old["polytope"]["vertices"]
    ]
    assert new["polytope"]["edges"] == old["polytope"]["edges"]
    assert new["polytope"] != old["polytope"]
    for part in ("edits", "history"):
        assert new[part] == old[part]
    fresh = tmp_path / "fresh.p4d.json"
    assert main.main(["analyze", str(clip), "-o", str(fresh), "--like", str(out)]) == 0
    assert f"edit {fresh} copy {out}" in capsys.readouterr().out


@pytest.mark.parametrize("frames", ["1001-1004", "1002-1006"])
def test_edits_stay_at_their_frames_when_a_clip_gets_more(clip, tmp_path, frames):
    """Frames that were added before or behind stretched all edits in time."""
    halves = np.where(np.arange(16)[None, :, None] < 8, [200, 40, 40], [90, 90, 95])
    for i, path in enumerate(sorted(clip.iterdir())):
        write_image(path, (halves + i).repeat(12, 0).astype(np.uint8))
    out = tmp_path / "shot.p4d.json"
    analyze = ["analyze", str(clip), "-o", str(out), "--quiet"]
    assert main.main([*analyze, "--frames", frames]) == 0
    when = ["--from", "1002", "--until", "1003", "--fade", "1"]
    pick = ["pick", "--frame", "1003", "--pixel", "3,4", *when, "--to", "#305090"]
    assert main.main(["edit", str(out), *pick]) == 0
    (before,) = Document.load(out).grade.picks
    assert main.main([*analyze, "--keep-edits"]) == 0
    (after,) = Document.load(out).grade.picks
    for name in ("frame", "pixel", "start", "until", "fade", "rgb"):
        assert getattr(after, name) == getattr(before, name)
    # Where the picked frame is gone, its colour is picked at the nearest one.
    assert main.main([*analyze, "--keep-edits", "--frames", "1004-1006"]) == 0
    (later,) = Document.load(out).grade.picks
    assert (later.frame, later.start, later.until) == (1004, 1002, 1003)
    assert later.rgb == pytest.approx(np.array([203, 43, 43]) / 255, abs=1e-4)


def test_picks_stay_at_their_places_in_a_clip_that_moved(clip, tmp_path, capsys):
    """There are two red things: the larger one is not the picked one."""
    things = np.full((12, 32, 3), [90, 90, 95])
    things[2:5, 2:6], things[2:5, 6:8], things[6:, 14:] = (
        [200, 40, 40],
        [210, 140, 140],
        [190, 45, 40],
    )
    for i, path in enumerate(sorted(clip.iterdir())):
        write_image(path, (things + i).astype(np.uint8))
    out = tmp_path / "shot.p4d.json"
    static = ["-o", str(out), *STATIC]
    assert main.main(["analyze", str(clip), *static]) == 0
    edit = ["edit", str(out)]
    window = ["--window", "0,0,10,7", "--no-follow"]
    pick = ["pick", "--frame", "1002", "--pixel", "3,3", "--to", "#305090", *window]
    assert main.main([*edit, *pick]) == 0
    assert main.main([*edit, "area", "p1", "--frame", "1002", "--pixel", "6,3"]) == 0
    assert main.main([*edit, "version", "save", "kept"]) == 0
    (before,) = Document.load(out).grade.picks
    moved = clip.rename(tmp_path / "elsewhere")
    again = ["--keep-edits", "--set", "colours=500"]
    assert main.main(["analyze", str(moved), *static, *again, "--set", "palette_size=5"]) == 0
    document = Document.load(out)
    for (after,) in (document.grade.picks, document.version("kept").grade.picks):
        for name in ("pixel", "areas", "window", "rgb"):
            assert getattr(after, name) == getattr(before, name)
    # Where the thing is no longer there, its colour is looked for, and that is said.
    things[2:5, 2:8] = [60, 160, 60]
    for path in moved.iterdir():
        write_image(path, things.astype(np.uint8))
    capsys.readouterr()
    assert main.main(["analyze", str(moved), *static, *again, "--set", "palette_size=6"]) == 0
    said = capsys.readouterr().err
    assert "version kept; picked where their colour is" in said
    assert said.count("without a window, since") == 2
    (after,) = Document.load(out).grade.picks
    assert after.pixel[0] > 12


def test_a_pick_of_a_still_keeps_its_frame(clip, tmp_path):
    out = tmp_path / "still.p4d.json"
    analyze = ["analyze", str(clip / "shot.1003.png"), "-o", str(out), "--quiet"]
    assert main.main(analyze) == 0
    pick = [
        "pick",
        "--frame",
        "1003",
        "--colour",
        "0.5,0.4,0.3",
        "--to",
        "#305090",
        "--from",
        "1003",
    ]
    assert main.main(["edit", str(out), *pick]) == 0
    before = Document.load(out)
    again = [*analyze, "--keep-edits", "--method", "static", "--set", "palette_size=5"]
    assert main.main(again) == 0
    after = Document.load(out)
    assert after.grade.handles.vertices != before.grade.handles.vertices
    assert after.grade.picks == before.grade.picks


def test_edits_go_along_with_frames_that_like_numbers_anew(clip, tmp_path):
    """Some numbers are those of other frames of the version before."""
    halves = np.where(np.arange(16)[None, :, None] < 8, [200, 40, 40], [90, 90, 95]).repeat(12, 0)
    for i, path in enumerate(sorted(clip.iterdir())):
        write_image(path, (halves + 4 * i).astype(np.uint8))
        write_image(tmp_path / "v2" / f"shot.{1003 + i}.png", (halves + 4 * i + 1).astype(np.uint8))
    out = tmp_path / "shot.p4d.json"
    assert main.main(["analyze", str(clip), "-o", str(out), "--quiet"]) == 0
    when = ["--frame", "1003", "--from", "1002", "--until", "1003"]
    pick = ["pick", *when, "--pixel", "3,4", "--to", "#305090"]
    assert main.main(["edit", str(out), *pick]) == 0
    again = ["analyze", str(tmp_path / "v2"), "-o", str(out), "--quiet", "--like", str(out)]
    assert main.main([*again, "--keep-edits"]) == 0
    (kept,) = Document.load(out).grade.picks
    assert (kept.frame, kept.start, kept.until) == (1005, 1004, 1005)


@pytest.mark.parametrize("name", ["link.p4d.json", "grade", "s.P4D.JSON", ".hidden.p4d.json"])
def test_the_former_file_has_its_name_from_any_sidecars(clip, tmp_path, name):
    out, folder = tmp_path / name, tmp_path
    if name == "link.p4d.json":
        folder = tmp_path / "there"
        folder.mkdir()
        out = tmp_path / "here" / name
        out.parent.mkdir()
        out.symlink_to(folder / "own.p4d.json")
        (folder / "own.p4d.json").touch()
    analyze = ["analyze", str(clip), "-o", str(out), "--quiet"]
    assert main.main([*analyze, "--method", "static"]) == 0
    assert main.main(["edit", str(out), "palette", "--by", "0.1", "0", "0"]) == 0
    edited = out.read_bytes()
    stem = "own" if name == "link.p4d.json" else name.removesuffix(".p4d.json")
    taken = folder / f"{stem}.former.p4d.json"
    taken.write_text("of another analysis")
    # A program of its own confines itself.
    subprocess.run([sys.executable, "-m", "palette4d", *analyze, "--keep-edits"], check=True)
    (former,) = {*folder.glob("*.former*.p4d.json")} - {taken}
    assert former.read_bytes() == edited
    assert Document.load(out).grade.settings


def test_picks_of_a_picture_that_was_mirrored_are_told(clip, tmp_path, capsys):
    """It has the same palette, so that all edits stay as they are."""
    halves = np.where(np.arange(16)[None, :, None] < 8, [200, 40, 40], [90, 90, 95]).repeat(12, 0)
    for mirrored in (False, True):
        for path in clip.iterdir():
            write_image(path, (halves[:, ::-1] if mirrored else halves).astype(np.uint8))
        out = tmp_path / "shot.p4d.json"
        assert main.main(["analyze", str(clip), "-o", str(out), *STATIC, "--keep-edits"]) == 0
        told = "other colours now where these were picked: p1" in capsys.readouterr().err
        assert told == mirrored
        if not mirrored:
            pick = ["pick", "--frame", "1002", "--pixel", "3,3", "--to", "#305090"]
            assert main.main(["edit", str(out), *pick, "--window", "0,0,7,11"]) == 0
            edits = Document.load(out).grade.state
            analyze = ["analyze", str(clip), "-o", str(out), *STATIC, "--keep-edits"]
            capsys.readouterr()
            assert main.main(analyze) == 0
            assert "other colours" not in capsys.readouterr().err
    assert Document.load(out).grade.state == edits


def test_the_places_of_picks_go_along_to_a_larger_version(clip, tmp_path, capsys):
    """A proxy's windows, boxes and areas lie at the same place of the full picture."""
    out, large = tmp_path / "shot.p4d.json", tmp_path / "large"
    assert main.main(["analyze", str(clip), "-o", str(out), "--quiet"]) == 0
    edit = ["edit", str(out)]
    where = ["--frame", "1003", "--pixel", "5,4", "--box", "3"]
    window = ["--window", "2,1,12,9", "--feather", "2"]
    assert main.main([*edit, "pick", *where, *window, "--to", "#305090"]) == 0
    assert main.main([*edit, "version", "save", "kept"]) == 0
    assert main.main([*edit, "area", "p1", "--frame", "1004", "--pixel", "7,3", "--box", "3"]) == 0
    large.mkdir()
    for path in clip.iterdir():
        pixels = oiio.ImageBuf(str(path)).get_pixels(oiio.UINT8)
        write_image(large / path.name, pixels.repeat(2, 0).repeat(2, 1))
    capsys.readouterr()
    again = ["analyze", str(large), "-o", str(out), "--quiet", "--like", str(out), "--keep-edits"]
    assert main.main(again) == 0
    assert "scaled with it" in capsys.readouterr().err
    (pick,) = Document.load(out).grade.picks
    assert (pick.pixel, pick.box) == ((11, 9), 6)
    assert pick.window
    assert pick.window.feather == 4
    assert pick.window.given.keys[0].box == (4, 2, 24, 18)
    assert pick.areas == (Area(1004, ((15, 7),), 3),)
    # Steps and versions too.
    assert main.main([*edit, "undo"]) == 0
    (undone,) = Document.load(out).grade.picks
    assert (undone.areas, undone.window) == ((), pick.window)
    assert main.main([*edit, "version", "use", "kept"]) == 0
    assert Document.load(out).grade.picks == (undone,)


def test_bad_frames(clip, tmp_path, capsys):
    out = tmp_path / "shot.p4d.json"
    (clip / "shot.1003.png").write_bytes((clip / "shot.1003.png").read_bytes()[:60])
    assert main.main(["analyze", str(clip), "-o", str(out), *STATIC]) == 1
    assert "1003" in capsys.readouterr().err
    assert not out.exists()
    assert main.main(["analyze", str(clip), "-o", str(out), *STATIC, "--skip-bad-frames"]) == 0
    assert "1003" in capsys.readouterr().err
    assert json.loads(out.read_text())["clip"]["frames"]["skipped"] == [1003]


def with_alpha(folder: Path, alphas: list[float], extension: str = "exr") -> Path:
    """Write a frame for each alpha, the same in all of its pixels."""
    for i, alpha in enumerate(alphas, start=1):
        colours = mixture(CORNERS + 0.01 * i, i)
        stored = colours * alpha if extension == "exr" and alpha else colours
        pixels = np.concatenate([stored, np.full_like(stored[..., :1], alpha)], axis=2)
        if extension == "png":
            pixels = np.rint(255 * pixels).astype(np.uint8)
        write_image(folder / f"shot.{i}.{extension}", pixels, oiio__UnassociatedAlpha=1)
    return folder


@pytest.mark.parametrize("extension", ["exr", "png"])
def test_alpha_that_is_0_everywhere_counts_as_unused(extension, tmp_path, capsys):
    palettes = []
    for alpha in (0.0, 1.0):
        folder = with_alpha(tmp_path / f"alpha{alpha:g}", [alpha] * 4, extension)
        out = tmp_path / "shot.p4d.json"
        assert main.main(["analyze", str(folder), "-o", str(out), "--json", *STATIC]) == 0
        printed = capsys.readouterr()
        palettes.append(json.loads(out.read_text())["polytope"])
        said = "alpha is 0 in every pixel of the clip"
        assert (said in printed.err) == (alpha == 0)
        notes = json.loads(printed.out)["notes"]
        assert len([note for note in notes if said in note]) == (alpha == 0)
        # What a recolouring does with such pixels depends on how the file holds its colours.
        asked = any("write the frames without alpha" in note for note in notes)
        assert asked == (alpha == 0 and extension == "exr")
        out.unlink()
    assert palettes[0] == palettes[1]


def test_a_frame_of_which_nothing_shows_is_passed_over(tmp_path, capsys):
    out = tmp_path / "shot.p4d.json"
    folder = with_alpha(tmp_path / "clip", [0, 1, 1, 0, 1, 1])
    assert main.main(["analyze", str(folder), "-o", str(out), "--json"]) == 0
    printed = capsys.readouterr()
    notes = json.loads(printed.out)["notes"]
    assert "2 frames have no usable pixel and were left out: 1, 4" in notes
    assert "frame 1 takes the palette of frame 2" in notes
    assert not any("it was ignored" in note for note in notes)
    assert json.loads(out.read_text())["clip"]["frames"]["first"] == 1


def test_wrong_usage(clip, tmp_path, capsys):
    out = str(tmp_path / "x.p4d.json")
    for arguments in (
        ["analyze", str(clip)],
        ["analyze", str(clip), "-o", out, "--rate", "fast"],
        ["analyze", str(clip), "-o", out, "--keep-edits", "--drop-edits"],
    ):
        with pytest.raises(SystemExit) as stop:
            main.main(arguments)
        assert stop.value.code == 2
    assert main.main(["analyze", str(clip), "-o", out, "--frames", "1001,1002,1004"]) == 1
    assert "not evenly spaced" in capsys.readouterr().err
    assert main.main(["analyze", str(tmp_path / "nothing"), "-o", out]) == 1
    assert not Path(out).exists()


@pytest.mark.skipif(os.name == "nt", reason="Windows sends a program no such signal")
def test_ctrl_c_leaves_nothing(clip, tmp_path):
    out = tmp_path / "shot.p4d.json"
    for i in range(6, 2000):  # long enough to be interrupted
        (clip / f"shot.{1001 + i}.png").hardlink_to(clip / "shot.1001.png")
    log = tmp_path / "progress"
    log.touch()
    command = [sys.executable, "-m", "palette4d", "analyze", str(clip), "-o", str(out)]
    command += ["--progress", str(log)]
    before = sorted(tmp_path.iterdir())
    process = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        # Where the tests run in the background, children inherit an ignored SIGINT.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 60
    while not log.read_text() and time.monotonic() < deadline:
        time.sleep(0.05)
    assert process.poll() is None, "ended before it could be interrupted"
    process.send_signal(signal.SIGINT)
    try:
        process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert sorted(tmp_path.iterdir()) == before


def test_the_source_is_found_from_the_sidecar(clip, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sidecars").mkdir()
    assert main.main(["analyze", "clip", "-o", "sidecars/a.p4d.json", *STATIC]) == 0
    source = json.loads(Path("sidecars/a.p4d.json").read_text())["clip"]["source"]
    assert source == "../clip/shot.####.png"
    assert main.main(["analyze", str(clip), "-o", "b.p4d.json", *STATIC]) == 0
    source = json.loads(Path("b.p4d.json").read_text())["clip"]["source"]
    assert source == str(clip / "shot.####.png")


@pytest.mark.parametrize("method", ["paper", "static", "rgbt"])
def test_other_methods(clip, tmp_path, method, capsys):
    out = tmp_path / f"{method}.p4d.json"
    assert main.main(["analyze", str(clip), "-o", str(out), "--method", method, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["stages"]
    document = json.loads(out.read_text())
    assert document["quality"]["options"]["method"] == method
    assert main.main(["info", str(out)]) == 0  # one stage or four, the tables are not torn
    assert max(map(len, capsys.readouterr().out.splitlines())) < 130


def test_few_vertices_are_given_when_asked_for(clip, tmp_path):
    counts = []
    for wanted in ("0", "10"):
        out = tmp_path / f"{wanted}.p4d.json"
        assert main.main(["analyze", str(clip), "-o", str(out), "--vertices", wanted]) == 0
        counts.append(len(json.loads(out.read_text())["polytope"]["vertices"]))
    assert counts[1] <= 10


@pytest.mark.parametrize(
    ("option", "value", "expected"),
    [
        ("--method", "magic", "invalid choice: 'magic'"),
        ("--vertices", "-1", "found '-1', expected a whole number from 0 to 1000000"),
        ("--set", "blocks=0", "option blocks: found 0, expected a number from 1"),
        ("--set", "handel_cost=1", "expected for example handle_cost"),
    ],
)
def test_wrong_options_are_wrong_usage(clip, tmp_path, option, value, expected, capsys):
    out = tmp_path / "never.p4d.json"
    with pytest.raises(SystemExit) as stop:
        main.main(["analyze", str(clip), "-o", str(out), option, value])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert f"argument {option}: " in error
    assert expected in error
    assert not out.exists()


@pytest.mark.parametrize(
    ("method", "given", "named"),
    [
        ("skew", ("--set", "eta2=3"), "eta2"),
        ("paper", ("--vertices", "9"), "vertices"),
        ("static", ("--set", "gamma=0.01"), "gamma"),
    ],
)
def test_options_of_another_method_are_wrong_usage(clip, tmp_path, method, given, named, capsys):
    out = tmp_path / "never.p4d.json"
    with pytest.raises(SystemExit) as stop:
        # Its own default, too: it would not count.
        main.main(["analyze", str(clip), "-o", str(out), "--method", method, *given])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert f"{named} has no effect with --method {method}" in error
    assert not out.exists()


def test_like_is_for_one_clip_and_a_sidecar(clip, tmp_path, capsys):
    out = tmp_path / "shot.p4d.json"
    command = ["analyze", str(clip), "-o", str(out), "--like", str(tmp_path / "none.p4d.json")]
    assert main.main(command) == 1
    assert "none.p4d.json" in capsys.readouterr().err
    for wrong in (["--vertices", "12"], ["--method", "paper"], ["--detect-shots"]):
        with pytest.raises(SystemExit) as ended:
            main.main([*command, *wrong])
        assert ended.value.code == 2
        assert "--like" in capsys.readouterr().err
    assert not out.exists()


def test_a_cut_is_refused_and_the_shots_are_named(tmp_path, capsys):
    folder = tmp_path / "cut"
    folder.mkdir()
    for i in range(12):
        rgb = CORNERS + 0.005 * i if i < 7 else 1 - 0.3 * CORNERS
        write_image(folder / f"cut.{1001 + i}.png", mixture(rgb, i))
    out = tmp_path / "cut.p4d.json"
    assert main.main(["analyze", str(folder), "-o", str(out), *STATIC]) == 1
    message = capsys.readouterr().err
    assert "1008" in message
    assert "--frames 1001-1007" in message
    assert "--frames 1008-1012" in message
    assert not out.exists()
    assert (
        main.main(["analyze", str(folder), "-o", str(out), *STATIC, "--frames", "1008-1012"]) == 0
    )
    assert main.main(["analyze", str(folder), "-o", str(out), *STATIC, "--allow-cuts"]) == 0
    assert "spans 1 sudden cut" in capsys.readouterr().err


def test_the_help_fits_a_screen_and_the_long_help_names_every_setting(capsys):
    texts = {}
    for option in ("--help", "--help-all", "--help"):
        with pytest.raises(SystemExit) as stop:
            main.main(["analyze", option])
        assert stop.value.code == 0
        texts.setdefault(option, capsys.readouterr().out)
    short = texts["--help"].splitlines()
    assert len(short) <= 40
    assert max(map(len, short)) < 80
    for name in OPTIONS.keys() - {"vertices"}:
        assert f"  {name} " in texts["--help-all"]
    for hidden in ("--rate", "--skip-bad-frames", "--keep-edits", "--cluster"):
        assert hidden in texts["--help-all"]
        assert hidden not in texts["--help"]
