"""The actions of ``edit`` for picks, on a small clip of files, and all that they refuse."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clip_files import write_image
from numpy.typing import NDArray

import palette4d
from palette4d.cli import main
from palette4d.grade import sidecar
from palette4d.grade.document import Document
from palette4d.media.clip import open_clip

FRAMES = 6
Run = Callable[..., tuple[int, str, str]]


def picture(frame: int) -> NDArray[np.float32]:
    """A blue sky, a green meadow that turns yellow, a red barn with grey grain; 24 x 16."""
    grain = 0.02 * np.sin(np.arange(24 * 16 * 3) * 7.3).reshape(16, 24, 3)
    out = np.empty((16, 24, 3))
    out[:8] = (0.4, 0.6, 0.9)
    out[8:] = (0.2 + 0.08 * frame, 0.6, 0.2)
    out[5:11, 15:21] = (0.7, 0.15, 0.1)
    out[12:15, 2:6] = (0.5, 0.5, 0.5)
    return np.clip(out + grain, 0, 1).astype(np.float32)


@pytest.fixture(scope="module")
def analysed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with clip/ (frames 0 to 5, 8-bit PNG) and its sidecar."""
    folder = tmp_path_factory.mktemp("picks")
    (folder / "clip").mkdir()
    for frame in range(FRAMES):
        pixels = np.rint(picture(frame) * 255).astype(np.uint8)
        write_image(folder / "clip" / f"clip.{frame:04d}.png", pixels)
    palette4d.analyze(str(folder / "clip")).save(folder / "clip.p4d.json")
    return folder


@pytest.fixture
def path(analysed: Path) -> str:
    """A fresh copy of the sidecar, beside its clip."""
    copy = analysed / "edited.p4d.json"
    copy.write_bytes((analysed / "clip.p4d.json").read_bytes())
    return str(copy)


@pytest.fixture
def run(path: str, capsys: pytest.CaptureFixture[str]) -> Run:
    """Run an action of `edit`; return the exit status, output and errors."""

    def edit(*words: str) -> tuple[int, str, str]:
        capsys.readouterr()
        try:
            status = main.main(["edit", path, *words])
        except SystemExit as end:
            status = int(end.code or 0)
        found = capsys.readouterr()
        return status, found.out, found.err

    return edit


def picks_of(path: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = sidecar.load(path)["edits"].get("picks", [])
    return found


def moved(path: str, frame: int, rgb: tuple[float, float, float]) -> NDArray[np.float32]:
    colour = np.array(rgb, np.float32).reshape(1, 1, 3)
    found: NDArray[np.float32] = (Document.load(path).recolour(colour, frame) - colour)[0, 0]
    return found


def test_pick_a_pixel_and_see_how_it_is_met(path: str, run: Run) -> None:
    status, out, _ = run(
        "pick", "--frame", "0", "--pixel", "10,13", "--box", "3", "--by", "0.1,0,0"
    )
    assert status == 0
    [pick] = picks_of(path)
    np.testing.assert_allclose(pick["rgb"], (0.2, 0.6, 0.2), atol=0.02)
    np.testing.assert_allclose(np.subtract(pick["to"], pick["rgb"]), (0.1, 0, 0), atol=1e-9)
    assert (pick["pixel"], pick["box"]) == ([10, 13], 3)
    assert pick["path"][-1]["frame"] == FRAMES - 1
    np.testing.assert_allclose(pick["path"][-1]["rgb"], (0.6, 0.6, 0.2), atol=0.06)
    assert "p1: pick at frame 0" in out
    assert re.search(r"follows its colour: #339933 at frame 0, #\w{6} at frame 5", out)
    assert re.search(r"at frame 5 it is 0\.\d\d away .* change p1 --until \d\b", out)  # yellow
    assert re.search(r"takes \d+(\.\d)? % of frame 0", out)
    assert pick["matte"] in sidecar.load(path)["mattes"]["grids"]
    np.testing.assert_allclose(moved(path, 0, tuple(pick["rgb"])), (0.1, 0, 0), atol=0.01)


def test_hold_lock_list_and_remove(path: str, run: Run) -> None:
    assert run("pick", "--frame", "2", "--colour", "0.36,0.6,0.2", "--to", "#5c6699")[0] == 0
    assert run("hold", "--frame", "2", "--colour", "0.7", "0.15", "0.1", "--no-follow")[0] == 0
    np.testing.assert_allclose(moved(path, 2, (0.7, 0.15, 0.1)), 0, atol=0.01)
    vertex = sidecar.load(path)["polytope"]["vertices"][0]["id"]
    assert f"vertex {vertex}" in run("lock", vertex)[1]
    status, out, _ = run("picks", "--json")
    assert status == 0
    listed = json.loads(out)
    assert [pick["kind"] for pick in listed["picks"]] == ["pick", "hold"]
    assert listed["locks"] == [vertex]
    out = run("picks")[1]
    assert "p1: pick" in out
    assert "p2: hold" in out
    assert "stays" in out
    assert run("unpick", "p1", "p2")[0] == 0
    assert run("unlock", vertex)[0] == 0
    assert picks_of(path) == []
    assert "mattes" in sidecar.load(path)  # undo needs them
    assert run("undo", "--steps", "2")[0] == 0
    assert [pick["id"] for pick in picks_of(path)] == ["p1", "p2"]


def test_disable_enable_and_change(path: str, run: Run) -> None:
    run("pick", "--frame", "2", "--colour", "0.36,0.6,0.2", "--by", "0.1,0,0", "--no-follow")
    assert run("disable", "p1")[0] == 0
    np.testing.assert_array_equal(moved(path, 2, (0.36, 0.6, 0.2)), 0)
    assert run("enable", "p1")[0] == 0
    np.testing.assert_allclose(moved(path, 2, (0.36, 0.6, 0.2)), (0.1, 0, 0), atol=0.01)
    assert run("change", "p1", "--by", "0,0,0.2", "--from", "1", "--until", "3")[0] == 0
    np.testing.assert_allclose(moved(path, 2, (0.36, 0.6, 0.2)), (0, 0, 0.2), atol=0.01)
    np.testing.assert_array_equal(moved(path, 5, (0.36, 0.6, 0.2)), 0)
    assert run("change", "p1", "--frame", "3", "--pixel", "18,8")[0] == 0
    np.testing.assert_allclose(picks_of(path)[0]["rgb"], (0.7, 0.15, 0.1), atol=0.05)


def test_a_pick_that_is_not_to_be_followed_needs_no_clip(path: str, run: Run) -> None:
    run("pick", *BARN, "--no-follow")
    assert "was not found" not in run("change", "p1", "--reach", "0.5")[1]
    assert "follows its colour" in run("change", "p1", "--follow")[1]


def test_a_change_can_be_taken_back(path: str, run: Run) -> None:
    run("pick", "--frame", "2", "--pixel", "10,13", "--box", "3", "--by", "0.1,0,0")
    before = picks_of(path)[0]
    assert before["path"]
    assert before["matte"]
    assert run("change", "p1", "--whole-hue", "--no-follow")[0] == 0
    assert not picks_of(path)[0].get("path")
    assert "matte" not in picks_of(path)[0]
    assert run("change", "p1", "--no-whole-hue", "--follow")[0] == 0
    assert picks_of(path)[0] == before


def test_the_matte_has_sliders(path: str, run: Run) -> None:
    run("pick", "--frame", "2", "--pixel", "10,13", "--box", "3", "--by", "0.2,0,0")
    grass = (0.36, 0.6, 0.2)
    full = moved(path, 2, grass)[0]
    assert full > 0.15
    assert run("change", "p1", "--lightness", "0.8,1")[0] == 0
    assert moved(path, 2, grass)[0] < 0.1 * full
    assert run("change", "p1", "--lightness", "0,1", "--reach", "-8", "--softness", "0")[0] == 0
    away = (0.36, 0.6, 0.45)  # a paler green than the meadow's
    narrow = moved(path, 2, away)[0]
    assert run("change", "p1", "--reach", "8")[0] == 0
    assert moved(path, 2, away)[0] > narrow
    out = run("picks")[1]
    assert "reach 8" in out
    assert "softness 0" in out


def test_an_area_belongs_to_the_pick(path: str, run: Run) -> None:
    run("pick", "--frame", "0", "--pixel", "4,13", "--box", "3", "--by", "0.2,0,0")
    before = picks_of(path)[0]["matte"]
    assert moved(path, 0, (0.4, 0.6, 0.9))[0] < 0.02  # the sky
    status, out, _ = run("area", "p1", "--frame", "0", "--stroke", "2,2", "12,3", "--width", "3")
    assert status == 0
    assert "1 more area" in out
    [pick] = picks_of(path)
    assert pick["areas"] == [{"frame": 0, "points": [[2, 2], [12, 3]], "radius": 1.5}]
    assert pick["matte"] != before
    assert run("undo")[0] == 0
    assert picks_of(path)[0]["matte"] == before
    status, _, err = run("area", "p1", "--frame", "0", "--pixel", "99,2")
    assert status == 1
    assert "99,2" in err


def test_a_hold_changes_what_picks_have_learned(path: str, run: Run) -> None:
    run("pick", "--frame", "2", "--pixel", "10,13", "--box", "3", "--by", "0.2,0,0")
    before = picks_of(path)[0]["matte"]
    barn = ("hold", "--frame", "2", "--pixel", "17,8", "--box", "3")
    assert run(*barn)[0] == 0
    np.testing.assert_allclose(moved(path, 2, (0.7, 0.15, 0.1)), 0, atol=0.005)
    assert run("unpick", "p2")[0] == 0
    assert picks_of(path)[0]["matte"] == before


def test_a_range_changes_nothing_beyond(path: str, run: Run, analysed: Path) -> None:
    words = ("--frame", "2", "--colour", "0.36,0.6,0.2", "--by", "0.2,0,0")
    assert run("pick", *words, "--from", "2", "--until", "3", "--fade", "1")[0] == 0
    document = Document.load(path)
    for frame, image in open_clip(str(analysed / "clip")):
        pixels = np.ascontiguousarray(image[..., :3])
        same = np.array_equal(document.recolour(pixels, frame), pixels)
        assert same == (frame not in (2, 3))


def test_another_pick_corrects_the_path(path: str, run: Run) -> None:
    run("pick", "--frame", "0", "--colour", "0.2,0.6,0.2", "--by", "0.1,0,0")
    status, out, _ = run("pick", "--frame", "4", "--colour", "0.5,0.5,0.5", "--with", "p1")
    assert status == 0
    assert "p1" in out
    [pick] = picks_of(path)
    given = {key["frame"]: key["rgb"] for key in pick["path"] if key.get("given")}
    assert set(given) == {0, 4}
    np.testing.assert_allclose(moved(path, 4, (0.5, 0.5, 0.5)), (0.1, 0, 0), atol=0.02)


def test_without_its_clip_a_pick_stays_and_says_so(path: str, run: Run, analysed: Path) -> None:
    fields = sidecar.load(path)
    fields["clip"]["source"] = "gone.####.png"
    sidecar.save(fields, path, on_edits="drop")
    status, out, _ = run("pick", "--frame", "2", "--colour", "0.36,0.6,0.2", "--by", "0.1,0,0")
    assert status == 0
    assert "the same colour in all frames" in out
    assert "gone.####.png" in out
    words = ("--frame", "2", "--pixel", "3,3", "--by", "0.1,0,0")
    assert "gone.####.png" in run("pick", *words)[2]
    assert "follows" in run("pick", *words, "--clip", str(analysed / "clip"))[1]


def test_the_same_pick_again_is_named(path: str, run: Run) -> None:
    words = ("pick", "--frame", "2", "--pixel", "3,3", "--box", "3", "--by", "0.1,0,0")
    assert run(*words)[0] == 0
    status, _, err = run(*words)
    assert status == 1
    assert "p1 is this pick already" in err
    assert run("disable", "p1")[0] == 0
    assert "enable p1" in run(*words)[2]
    assert [pick["id"] for pick in picks_of(path)] == ["p1"]
    assert run(*words[:-1], "0.2,0,0")[0] == 0  # another change is another pick


def test_a_range_without_the_own_frame_is_told(run: Run) -> None:
    words = ("pick", "--frame", "2", "--colour", "0.36,0.6,0.2", "--no-follow", "--until", "5")
    assert "outside of its range" in run(*words, "--by", "0.1,0,0", "--from", "4")[1]
    assert "outside of its range" not in run(*words, "--by", "0.2,0,0", "--from", "1")[1]


def test_a_target_far_outside_is_told(run: Run) -> None:
    words = ("--frame", "2", "--colour", "0.36,0.6,0.2", "--no-follow")
    status, _, err = run("pick", *words, "--to", "1.4,0.2,-0.3")
    assert status == 0
    assert "far outside 0..1" in err


@pytest.mark.parametrize(
    ("words", "status", "says"),
    [
        (("pick", "--frame", "9", "--colour", "#336633", "--by", "0,0,0"), 1, "from 0 to 5"),
        (("pick", "--frame", "2", "--pixel", "24,3", "--by", "0,0,0"), 1, "23,15"),
        (("pick", "--frame", "2", "--pixel", "-1,3", "--by", "0,0,0"), 1, "23,15"),
        (("pick", "--frame", "2", "--pixel", "3,3", "--box", "25", "--by", "0,0,0"), 1, "1 to 24"),
        (("pick", "--frame", "2.5", "--pixel", "3,3", "--by", "0,0,0"), 1, "no frame 2.5"),
        (("pick", "--frame", "2", "--colour", "nan,0,0", "--by", "0,0,0"), 2, "finite"),
        (("pick", "--frame", "2", "--colour", "255,3,3", "--by", "0,0,0"), 1, "display white"),
        (("pick", "--frame", "2", "--colour", "#336633"), 1, "--to"),
        (("pick", "--frame", "2", "--by", "0,0,0"), 2, "--colour"),
        (("pick", "--frame", "2", "--pixel", "3", "--by", "0,0,0"), 2, "X,Y"),
        (
            ("pick", "--frame", "2", "--colour", "#336633", "--box", "3", "--by", "0,0,0"),
            1,
            "--box",
        ),
        (("hold", "--frame", "2", "--colour", "#336633", "--from", "4", "--until", "3"), 1, "4"),
        (("hold", "--frame", "2", "--colour", "#336633", "--from", "9"), 1, "outside"),
        (("hold", "--frame", "2", "--colour", "#336633", "--with", "p7"), 1, "p7"),
        (("hold", "--frame", "2", "--colour", "#336633", "--clip", "none.mov"), 1, "none.mov"),
        (("unpick", "p1"), 1, "p1"),
        (("enable", "p1"), 1, "p1"),
        (("change", "p1", "--reach", "2"), 1, "p1"),
        (("change", "p1", "--reach", "9"), 2, "8"),
        (("change", "p1", "--lightness", "0.5,0.2"), 2, "A,B"),
        (("area", "p1", "--frame", "2", "--pixel", "3,3"), 1, "p1"),
        (("window", "p1", "--frame", "2", "--box", "3,3,9,9"), 1, "p1"),
        (("window", "p1", "--frame", "2", "--box", "9,3,3,9"), 2, "L < R"),
        (("window", "p1", "--frame", "2", "--box", "3,3,9"), 2, "L,T,R,B"),
        (("window", "p1", "--frame", "2", "--box", "3,3,nan,9"), 2, "L,T,R,B"),
        (("window", "p1", "--frame", "2", "--box", "3,3,9,9", "--none"), 2, "--none"),
        (("window", "p1", "--box", "3,3,9,9"), 1, "--frame"),
        (("window", "p1", "--frame", "2"), 1, "--box"),
        (("window", "p1", "--none", "--feather", "3"), 1, "--feather"),
        (("window", "p1", "--feather", "-3"), 2, "0"),
        (("window", "p1"), 1, "nothing to change"),
        (("hold", "--frame", "2", "--colour", "#336633", "--window", "3,3,9,9"), 2, "--window"),
        (
            ("pick", "--frame", "2", "--colour", "#336633", "--by", "0,0,0", "--feather", "3"),
            1,
            "--window",
        ),
        (("lock", "v999"), 1, "v999"),
        (("unlock", "v1"), 1, "v1"),
    ],
)
def test_bad_input(path: str, run: Run, words: tuple[str, ...], status: int, says: str) -> None:
    before = Path(path).read_bytes()
    found, _, errors = run(*words)
    assert found == status
    assert says in errors
    assert Path(path).read_bytes() == before


def test_another_clip_is_refused(path: str, run: Run, tmp_path: Path) -> None:
    for frame in range(FRAMES):
        write_image(tmp_path / f"wide.{frame:04d}.png", np.zeros((16, 32, 3), np.uint8))
    (tmp_path / "short").mkdir()
    write_image(tmp_path / "short" / "clip.0000.png", np.zeros((16, 24, 3), np.uint8))
    words = ("pick", "--frame", "0", "--pixel", "3,3", "--by", "0,0,0.1", "--clip")
    for clip, says in ((tmp_path / "wide.####.png", "32x16"), (tmp_path / "short", "frame 5")):
        status, _, errors = run(*words, str(clip))
        assert status == 1
        assert says in errors
        assert "another clip" in errors


def test_another_clip_of_the_same_size_is_told(run: Run, path: str, tmp_path: Path) -> None:
    for frame in range(FRAMES):
        pixels = np.rint(picture(frame)[::-1, :, ::-1] * 255).astype(np.uint8)
        write_image(tmp_path / f"clip.{frame:04d}.png", pixels)
    words = ("pick", "--frame", "0", "--pixel", "3,3", "--by", "0,0,0.1")
    assert "another clip" not in run(*words)[2]
    _, _, errors = run(*words, "--clip", str(tmp_path / "clip.####.png"))
    assert "another clip, give the analysed one as --clip" in errors
    document = Document.load(path)
    (told, *_) = document.pick_warnings("p2", str(tmp_path / "clip.####.png"))
    assert "give the analysed one as clip=…" in told


def test_a_colour_that_no_pixel_has_is_told(run: Run) -> None:
    words = ("pick", "--frame", "2", "--by", "0,0,0.1", "--colour")
    assert "no pixel" not in run(*words, "0.36,0.6,0.2")[2]
    status, _, errors = run(*words, "0.9,0.6,0.1")
    assert status == 0
    assert re.search(r"no pixel of frame 2 .* p2: the nearest one, #\w{6}, is 0.4", errors)


def test_history_says_what_changed(path: str, run: Run) -> None:
    run("pick", "--frame", "2", "--colour", "0.36,0.6,0.2", "--by", "0.1,0,0", "--no-follow")
    for words in (
        ("--reach", "1.5"),
        ("--to", "#112233"),
        ("--from", "1", "--until", "3", "--fade", "2"),
        ("--fade-out", "0.5"),
        ("--fade-out", "2"),
        ("--toward", "colour", "--whole-hue"),
    ):
        assert run("change", "p1", *words)[0] == 0
    assert [step.label for step in Document.load(path).history.done[1:]] == [
        "change p1: reach 1.5",
        "change p1: to #112233",
        "change p1: from frame 1 to 3, fades of 2 frames",
        "change p1: fades of 2 and 0.5 frames",
        "change p1: fades of 2 frames",
        "change p1: the same new colour at all frames, all of its hue",
    ]


def test_pixels_without_a_colour(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pixels = np.full((8, 8, 4), 0.5, np.float32)
    pixels[..., 3] = 1
    pixels[2, 2, 3] = 0
    pixels[4, 4, 0] = np.nan
    pixels[6:, :, 1] = 0.2
    write_image(tmp_path / "clip.0000.exr", pixels)
    path = tmp_path / "clip.p4d.json"
    palette4d.analyze(str(tmp_path / "clip.0000.exr")).save(path)
    for pixel in ("2,2", "4,4"):
        words = ["edit", str(path), "pick", "--frame", "0", "--pixel", pixel, "--by", "0,0,0.1"]
        assert main.main(words) == 1
        assert "has no colour" in capsys.readouterr().err
    assert main.main([*words[:7], "--box", "3", *words[7:]]) == 0


BARN = ("--frame", "2", "--pixel", "17,8", "--box", "3", "--to", "#2040b0")


def test_a_window_is_set_listed_changed_and_removed(path: str, run: Run) -> None:
    assert run("pick", *BARN)[0] == 0
    assert run("window", "p1", "--frame", "2", "--box", "13,3,23,13")[0] == 0
    [pick] = picks_of(path)
    assert pick["window"]["feather"] == 1
    assert {"frame": 2, "box": [13, 3, 23, 13], "given": True} in pick["window"]["keys"]
    assert json.loads(run("picks", "--json")[1])["picks"] == [pick]
    listed = run("picks")[1]
    assert "window 13,3,23,13 at frame 2; feather 1; followed, and moves by up to " in listed
    status, out, _ = run("window", "p1", "--frame", "4", "--box", "12,3,23,13", "--feather", "3")
    assert status == 0
    assert "window 13,3,23,13 at frame 2, 12,3,23,13 at frame 4; feather 3" in out
    assert re.search(r"takes \d+(\.\d)? % of frame 2", out)
    assert "feather 2.5" in run("window", "p1", "--feather", "2.5")[1]
    assert "outside of window 13,3,23,13" in run("window", "p1", "--invert")[1]
    assert picks_of(path)[0]["window"]["inverted"] is True
    assert "outside of window" in run("picks")[1]
    assert "outside of" in run("window", "p1", "--frame", "4", "--box", "12,3,23,12")[1]  # it stays
    assert run("window", "p1", "--invert", "--none")[0] == 1
    assert "outside of" not in run("window", "p1", "--no-invert")[1]
    assert "at frame 4" not in run("window", "p1", "--frame", "4", "--none")[1]
    assert run("window", "p1", "--frame", "4", "--none")[0] == 1
    assert run("window", "p1", "--none")[0] == 0
    assert "window" not in picks_of(path)[0]
    labels = [step.label for step in Document.load(path).history.done]
    assert labels[1] == "change p1: window 13,3,23,13 at frame 2, feather 1"
    assert labels[-1] == "change p1: no window"


def test_a_pick_may_have_its_window_at_once(
    path: str, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, _ = run("pick", *BARN, "--window", "-9,3,23,13", "--feather", "2")
    assert status == 0
    assert "  window -9,3,23,13 at frame 2; feather 2" in out
    assert main.main(["info", path]) == 0
    assert "1 pick (1 window)" in capsys.readouterr().out
    out = run("pick", *BARN, "--window", "-9,3,23,13", "--invert")[1]
    assert "  outside of window -9,3,23,13" in out
    assert run("pick", *BARN, "--invert")[0] == 1


def test_a_window_that_is_lost_or_cannot_follow_says_so(
    path: str, run: Run, analysed: Path
) -> None:
    run("pick", *BARN)
    out = run("window", "p1", "--frame", "2", "--box", "2,1,6,3")[1]  # the flat sky
    assert "the window is lost from frame 3" in out
    assert "the window is lost until frame 1" in out
    assert "window p1 --frame 3 --box L,T,R,B" in out
    out = run("window", "p1", "--frame", "2", "--box", "-2,1,30,6")[1]
    assert "; not followed: it reaches across the picture" in out
    out = run("window", "p1", "--frame", "2", "--box", "2,1,6,4", "--no-follow")[1]
    assert "feather 0.2; not followed\n" in out
    (analysed / "clip").rename(analysed / "away")
    try:
        out = run("window", "p1", "--frame", "2", "--box", "2,1,6,3")[1]
    finally:
        (analysed / "away").rename(analysed / "clip")
    assert re.search(r"not followed: the clip '.*' was not found; give it with --clip", out)


def test_a_window_that_is_proposed_can_be_pasted(tmp_path: Path, run: Run, path: str) -> None:
    from palette4d.cli.picks import _noted
    from palette4d.grade.answer import Note

    note = Note("words", gesture="window", effect="then takes 3 %", id="p1", window=(1, 2, 9, 8.5))
    (words, command) = _noted(note, 2)
    assert words == "words"
    assert command == "  window p1 --frame 2 --box 1,2,9,8.5 (then takes 3 %)"
    run("pick", *BARN)
    assert run(*command.split(" (")[0].split())[0] == 0
