"""The verbs `export` and `config` from the command line."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from palette4d.cli.main import main
from palette4d.grade.document import Document

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
EDITED, SPLIT = GOLDEN / "v1_edited.p4d.json", GOLDEN / "v1_split.p4d.json"


@pytest.fixture(autouse=True)
def small_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure errors on 13^3 colours instead of 67^3 in this process."""
    monkeypatch.setattr("palette4d.lut_export.lut3d.DENSE", 13)


def export(*words: object) -> int:
    return main(["export", str(EDITED), "--size", "5", "--jobs", "1", *map(str, words)])


def config(*words: object) -> int:
    return main(["config", "--size", "5", "--jobs", "1", *map(str, words)])


class TestExport:
    def test_it_says_what_it_wrote(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert export("--every", "10", "-o", tmp_path, "--name", "shot") == 0
        printed = capsys.readouterr()
        assert f"3 files, {tmp_path / 'shot.0000.cube'} to shot.0020.cube: 3 baked" in printed.out
        assert "%|" not in printed.err  # a bar is for terminals alone
        assert "--clip" in printed.err
        assert export("--every", "10", "-o", tmp_path, "--name", "shot") == 0
        printed = capsys.readouterr()
        assert "0 baked, 3 kept" in printed.out
        assert "%" not in printed.err.replace("--clip", "")

    def test_a_cube_with_a_shaper_is_warned_of(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        words = ("--frames", "4", "-o", tmp_path)
        assert export(*words) == 0
        assert "give those a .csp" not in capsys.readouterr().err
        assert export(*words, "--domain", "-0.5", "4", "--force") == 0
        assert capsys.readouterr().err.count("give those a .csp") == 1

    def test_json_is_the_index(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert export("--frames", "4,9", "-o", tmp_path, "--format", "clf", "--json") == 0
        printed = json.loads(capsys.readouterr().out)
        (index,) = tmp_path.glob("*.series.json")
        assert printed == json.loads(index.read_text("utf-8"))
        assert [entry["frame"] for entry in printed["frames"]] == [4, 9]

    def test_failures_are_listed_and_the_status_is_1(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        words = ("--frames", "4,5", "--format", "cc", "--max-error", "0", "-o", tmp_path)
        assert export(*words) == 1
        err = capsys.readouterr().err
        assert "palette4d: error: 2 frames could not be baked" in err
        assert "frame 4: the error stays above the limit" in err
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize(
        "words",
        [
            ("-o", "x"),
            ("--every", "0", "-o", "x"),
            ("--every", "2", "--stops", "-o", "x"),
            ("--frames", "5-1", "-o", "x"),
            ("--every", "2"),
            ("--every", "2", "-o", "x", "--format", "jpg"),
            ("--every", "2", "-o", "x", "--padding", "-1"),
        ],
    )
    def test_wrong_usage(
        self, words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        with pytest.raises(SystemExit) as stop:
            export(*words)
        assert stop.value.code == 2
        assert not list(tmp_path.iterdir())

    def test_errors(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert export("--frames", "0-99", "-o", tmp_path / "x") == 1
        assert "frame 21 is outside the clip" in capsys.readouterr().err
        (tmp_path / "file").write_text("", "utf-8")
        assert export("--frames", "4", "-o", tmp_path / "file") == 1
        assert "the folder cannot be made" in capsys.readouterr().err
        assert main(["export", str(SPLIT), "--stops", "-o", str(tmp_path / "x")]) == 1
        assert "nothing is edited" in capsys.readouterr().err
        assert not (tmp_path / "x").exists()


def on_terminal(*words: object) -> list[str]:
    """Return the lines that a terminal shows of a command's standard error."""
    pty, termios = pytest.importorskip("pty"), pytest.importorskip("termios")
    terminal, error = pty.openpty()
    termios.tcsetwinsize(error, (25, 200))
    command = [sys.executable, "-m", "palette4d", *map(str, words)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=error) as process:
        os.close(error)
        written = b""
        with contextlib.suppress(OSError):  # Linux reports the end of a terminal as an error
            while some := os.read(terminal, 4096):
                written += some
        assert process.wait(timeout=60) in (0, 1)
    os.close(terminal)
    lines = []
    for line in written.decode("utf-8").replace("\r\n", "\n").split("\n"):
        seen = ""
        for part in line.split("\r"):
            seen = part + seen[len(part) :]
        lines.append(seen.rstrip())
    return lines


def test_an_error_takes_the_bar_away(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    words = (EDITED, "--size", "5", "--jobs", "1", "--frames", "4")
    (shown, *_) = on_terminal("export", *words, "-o", tmp_path / "there")
    assert "export: 100%|" in shown
    (shown, *_) = on_terminal("export", *words, "-o", tmp_path / "file")
    assert shown.startswith("palette4d: error: ")


class TestConfig:
    def test_it_says_what_it_wrote(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        show = tmp_path / "show"
        words = (EDITED, "-o", show, "--every", "10", "--process-space", "srgb_tx")
        # The edit changes too much between these frames.
        assert config(*words, "--names", "shot010") == 1
        assert "--anyway" in capsys.readouterr().err
        assert not show.exists()
        words = (*words, "--anyway", "--size", "9")
        assert config(*words, "--names", "shot010") == 0
        printed = capsys.readouterr()
        assert printed.out.startswith(f"{show / 'config.ocio'}: 1 look, added to ocio://")
        assert "shot010  frames 0 to 20, 3 LUTs, " in printed.out
        assert "between the LUTs: deltaE 2000 of up to " in printed.out
        assert f"OCIO={show / 'config.ocio'} SHOT=shot010 FRAME=0" in printed.out
        assert config(*words, "--names", "shot010") == 1
        assert "--force" in capsys.readouterr().err
        assert config(*words, "--names", "shot010", "--force", "--json") == 0
        report = json.loads(capsys.readouterr().out)
        assert report["shots"][0]["look"] == "shot010"
        assert report["shots"][0]["process_space"] == "sRGB - Texture"
        assert report["shots"][0]["error_space"] == "sRGB - Texture"
        assert 0 < report["shots"][0]["error"] < 1
        assert report["shots"][0]["between"]["delta_e"] > 2
        assert len(report["views"]) > 5

    def test_two_shots_of_one_name(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        words = (EDITED, EDITED, "-o", tmp_path / "show", "--process-space", "srgb_tx")
        assert config(*words) == 1
        assert "two shots have the name" in capsys.readouterr().err
        assert not (tmp_path / "show").exists()

    def test_one_clip_for_two_sidecars(self, tmp_path: Path) -> None:
        assert config(EDITED, SPLIT, "-o", tmp_path / "show", "--clip", "x.####.png") == 1
        assert not (tmp_path / "show").exists()


def dctl(*words: object) -> int:
    return main(["export", str(EDITED), *map(str, words)])


def test_glsl_is_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("shot.glsl", "shot.hook"):
        assert dctl("--glsl", tmp_path / name, "--frames", "2-5") == 0
        assert "frames 2 to 5 from " in capsys.readouterr().out
    assert dctl("--glsl", tmp_path / "shot.txt") == 1
    assert "NAME.hook" in capsys.readouterr().err


def test_a_dctl_is_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "shot.dctl"
    assert dctl("--dctl", output) == 0
    assert "frames 0 to 20 from " in capsys.readouterr().out
    assert "p4d_at_frame" in output.read_text(encoding="ascii")
    assert dctl("--dctl", output, "--frames", "2-5", "--json") == 1
    assert dctl("--dctl", output, "--frames", "2-5", "--json", "--force", "--max-error", "0") == 0
    assert json.loads(capsys.readouterr().out)["last"] == 5


def test_a_dctl_says_its_error_and_refuses_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    document = Document.load(EDITED)
    seen = document.grade.palette(4).rgb.mean(axis=0)
    document.pick(4, colour=seen, by=(0.2, 0, 0), follow=False)
    document.save(tmp_path / "picked.p4d.json")
    words = ["export", tmp_path / "picked.p4d.json", "--dctl", tmp_path / "a.dctl"]
    monkeypatch.setattr("palette4d.lut_export.clip_text.MOST_BYTES", 6000)
    assert main([*map(str, words), "--max-error", "0.0001"]) == 1
    assert "(--frames), or accept that (--max-error 0.0" in capsys.readouterr().err
    assert not (tmp_path / "a.dctl").exists()
    assert main([*map(str, words)]) == 0
    printed = capsys.readouterr()
    assert "off by about 0.0" in printed.err
    assert " of picks, " in printed.out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--dctl", "a.dctl", "--every", "1"), "--dctl"),
        (("--dctl", "a.dctl", "--size", "9"), "--dctl"),
        (("--dctl", "a.dctl", "--strength", "0.5"), "--dctl"),
        (("--glsl", "a.glsl", "--format", "clf"), "--glsl"),
        (("--glsl", "a.glsl", "--max-error", "0.1"), "--glsl"),
        (("--dctl", "a.dctl", "--glsl", "a.glsl"), "--glsl"),
        (("--every", "1", "-o", "luts", "--alpha"), "--dctl"),
        (("--every", "1"), "--output"),
        (("-o", "luts"), "--stops"),
    ],
)
def test_one_kind_of_export_is_chosen(
    words: tuple[str, ...], expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as error:
        dctl(*words)
    assert error.value.code == 2
    assert expected in capsys.readouterr().err


def test_windows_that_files_lack_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = Document.load(EDITED)
    seen = document.grade.palette(4).rgb.mean(axis=0)
    document.pick(4, colour=seen, by=(0.2, 0, 0), follow=False, until=9, window=(1, 1, 4, 4))
    path = str(tmp_path / "windowed.p4d.json")
    document.save(path)
    words = ("--size", "5", "--jobs", "1", "--force")
    lacks = "note: no LUT has the window of p1: "
    for frames, told in (("4,12", 1), ("12", 0)):
        series = ("--frames", frames, "-o", str(tmp_path / frames))
        assert main(["export", path, *words, *series]) == 0
        assert capsys.readouterr().err.count(lacks) == told
    series = ("--frames", "4,12", "-o", str(tmp_path / "config"), "--anyway")
    assert main(["config", path, *words, *series]) == 0
    assert "note: look golden: no LUT has the window of p1: " in capsys.readouterr().err
    for option, name in (("--dctl", "a.dctl"), ("--glsl", "a.glsl"), ("--glsl", "a.hook")):
        assert main(["export", path, option, str(tmp_path / name)]) == 1
        assert "found windows of p1" in capsys.readouterr().err
        assert not (tmp_path / name).exists()
    assert main(["export", path, "--dctl", str(tmp_path / "a.dctl"), "--frames", "12-20"]) == 0
