"""The verb `bake` from the command line: what it prints, where it writes, what it refuses."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from clip_files import write_image
from posix_files import pipes

from palette4d.cli.main import main
from palette4d.grade.document import Document
from palette4d.grade.later import Unread
from palette4d.grade.unread_steps import as_unread
from palette4d.shows.manifest import Manifest, write

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
EDITED = GOLDEN / "v1_edited.p4d.json"


@pytest.fixture(autouse=True)
def small_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure errors on 13^3 colours instead of 67^3 in this process."""
    monkeypatch.setattr("palette4d.lut_export.lut3d.DENSE", 13)


def command(*words: object, **options: object) -> subprocess.CompletedProcess[bytes]:
    """`palette4d bake EDITED --frame 4 WORDS` in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "palette4d", "bake", EDITED, "--frame", "4", *map(str, words)],
        capture_output=True,
        timeout=120,
        check=False,
        **options,  # type: ignore[call-overload]
    )


def run(*words: object) -> int:
    return main(["bake", str(EDITED), "--frame", "4", *map(str, words)])


def usage(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """Wrong usage: exit status 2, and what is said."""
    with pytest.raises(SystemExit) as stop:
        run(*words)
    assert stop.value.code == 2
    return capsys.readouterr().err


def error(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """An error: exit status 1, and what is said."""
    assert run(*words) == 1
    text = capsys.readouterr().err
    assert "palette4d: error: " in text
    return text


class TestPiping:
    def test_the_same_bytes_as_the_file(
        self, tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]
    ) -> None:
        for name, extension in (("resolve_cube", "cube"), ("cc", "cc")):
            out = tmp_path / f"a.{extension}"
            assert run("--size", 5, "-o", out) == 0
            capfdbinary.readouterr()
            assert run("--size", 5, "-o", "-", "--format", name) == 0
            piped = capfdbinary.readouterr()
            assert piped.out == out.read_bytes()
            # The report is on the other stream.
            assert b"standard output: " in piped.err
            assert b"dense grid" in piped.err

    def test_json_is_on_standard_error(self, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
        assert run("--size", 5, "-o", "-", "--format", "spi3d", "--json") == 0
        piped = capfdbinary.readouterr()
        assert piped.out.startswith(b"SPILUT 1.0")
        text = piped.err[piped.err.index(b"{") : piped.err.rindex(b"}") + 1]
        report = json.loads(text)
        assert (report["output"], report["format"]) == ("-", "spi3d")

    def test_without_a_format(self, capsys: pytest.CaptureFixture[str]) -> None:
        assert "expected --format FORMAT" in usage(capsys, "-o", "-")

    @pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full here")
    def test_a_full_disk(self) -> None:
        with Path("/dev/full").open("wb") as full:
            done = subprocess.run(
                [sys.executable, "-m", "palette4d", "bake", EDITED, "--frame", "4",
                 "-o", "-", "--format", "clf", "--size", "5"],
                stdout=full, stderr=subprocess.PIPE, timeout=120, check=False,
            )  # fmt: skip
        assert done.returncode == 1
        assert b"palette4d: error: standard output: only 0 of the " in done.stderr
        assert b"bytes of the clf file could be written: No space left" in done.stderr
        assert done.stderr.rstrip().endswith(b"make some or choose another folder with -o FILE.clf")
        assert b"Traceback" not in done.stderr

    def test_a_reader_that_goes_away(self) -> None:
        process = subprocess.Popen(
            [sys.executable, "-m", "palette4d", "bake", EDITED, "--frame", "4",
             "-o", "-", "--format", "spi3d", "--size", "65"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.read(100)
        process.stdout.close()
        text = process.stderr.read()
        process.stderr.close()
        assert process.wait(120) == 1
        assert b"Traceback" not in text


class TestFiles:
    def test_a_disk_that_is_full_midway(self, tmp_path: Path) -> None:
        """Files of this process may not grow beyond 50 kB."""
        resource = pytest.importorskip("resource")
        out = tmp_path / "a.clf"
        out.write_text("mine", "utf-8")
        done = command(
            "-o", out, "--force",
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000)),
        )  # fmt: skip
        assert done.returncode == 1, done.stderr
        assert str(out).encode() in done.stderr
        assert b"Traceback" not in done.stderr
        assert out.read_text("utf-8") == "mine"
        assert [path.name for path in tmp_path.iterdir()] == ["a.clf"]

    def test_a_folder_that_cannot_be_written(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        folder = Path("/proc/self")
        if not folder.is_dir():
            pytest.skip("there is no /proc here")
        assert "cannot write in" in error(capsys, "-o", folder / "a.cube")
        if os.name == "posix" and os.geteuid() != 0:  # root may write everywhere
            closed = tmp_path / "closed"
            closed.mkdir(mode=0o555)
            assert "cannot write in" in error(capsys, "-o", closed / "a.cube")

    def test_no_such_folder(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert "create it first" in error(capsys, "-o", tmp_path / "no" / "a.cube")

    @pipes
    def test_a_device_is_not_replaced(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "a.cube"
        out.symlink_to("/dev/null")
        assert "found a device or a pipe" in error(capsys, "-o", out, "--force")
        assert out.is_char_device()

    @pipes
    def test_a_pipe_is_not_replaced(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        pipe = tmp_path / "a.cube"
        os.mkfifo(pipe)
        assert "-o - --format" in error(capsys, "-o", pipe, "--force")
        assert pipe.is_fifo()

    def test_the_sidecar_itself_is_not_replaced(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        for name, verb in (("a.cube", "bake --frame 4 -o"), ("a.dctl", "export --dctl")):
            own = tmp_path / name
            shutil.copyfile(EDITED, own)
            assert main([verb.split()[0], str(own), *verb.split()[1:], str(own), "--force"]) == 1
            assert "read for this output" in capsys.readouterr().err
            assert own.read_bytes() == Path(EDITED).read_bytes()

    def test_overwriting_needs_force(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "a.clf"
        out.write_text("mine", "utf-8")
        assert "--force" in error(capsys, "-o", out)
        assert out.read_text("utf-8") == "mine"
        assert run("-o", out, "--size", 5, "--force") == 0
        assert "LUT3D" in out.read_text("utf-8")


class TestWrongUsage:
    @pytest.mark.parametrize("size", ["0", "1", "130", "1000", "-1", "x", "17.5"])
    def test_sizes(self, size: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        text = usage(capsys, "-o", tmp_path / "a.cube", "--size", size)
        assert "expected a whole number from 2 to 129" in text
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize(
        ("words", "said"),
        [
            (("--format", "clg"), "expected clf"),
            (("--format", "spi1d"), "mixes the channels"),
            (("--shaper", "cubic"), "invalid choice"),
            (("--domain", "1", "0"), "the smaller one first"),
            (("--domain", "0"), "expected 2 arguments"),
            (("--max-error", "-1"), "of at least 0"),
            (("--strength", "2"), "from 0 to 1"),
        ],
    )
    def test_options(
        self, words: tuple[str, ...], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert said in usage(capsys, "-o", tmp_path / "a.clf", *words)
        assert not list(tmp_path.iterdir())


class TestErrors:
    @pytest.mark.parametrize(
        ("words", "said"),
        [
            (("-o", "a.xyz"), "expected one of .cube, .clf, .ctf, .spi3d"),
            (("-o", "a"), "no extension"),
            (("-o", "a.txt", "--format", "clf"), "expected .clf"),
            (("-o", "a.spi3d", "--shaper", "log"), "cannot hold a shaper"),
            (("-o", "a.3dl", "--size", "20"), "expected 5, 9, 17, 33, 65, 129"),
            (("-o", "a.cube", "--frame", "21"), "from 0 to 20"),
            (("-o", "a.cc", "--max-error", "0"), "nothing was written"),
        ],
    )
    def test_what_takes_a_second_option_or_a_file(
        self,
        words: tuple[str, ...],
        said: str,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        monkeypatch.chdir(tmp_path)
        assert said in error(capsys, *words)
        assert not list(tmp_path.iterdir())

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            (lambda text: text[: len(text) // 2], "take an earlier copy"),
            (lambda text: text.replace('"version": 1', '"version": 999', 1), "update palette4d"),
            (lambda text: "", "expected JSON text (RFC 8259); correct it there"),
            (lambda text: text.replace('"rgb": [', '"rgb": [7, ', 1), "or analyse the clip again"),
        ],
    )
    def test_sidecars(
        self, change, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        sidecar = tmp_path / "bad.p4d.json"
        sidecar.write_text(change(EDITED.read_text("utf-8")), "utf-8")
        for verb in (
            ["bake", str(sidecar), "--frame", "4", "-o", str(tmp_path / "a.cube")],
            ["export", str(sidecar), "--every", "1", "-o", str(tmp_path / "luts")],
            ["config", str(sidecar), "-o", str(tmp_path / "show")],
        ):
            assert main(verb) == 1
            text = capsys.readouterr().err
            assert "bad.p4d.json" in text
            assert said in text
            assert ("correct it there" in text) != ("update palette4d" in text)
        assert [path.name for path in tmp_path.iterdir()] == ["bad.p4d.json"]

    def test_a_manifest(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        path = tmp_path / "edit.shots.json"
        write(Manifest("edit.edl", "0" * 64, Fraction(24), {}, ()), path)
        for words in (["bake", str(path), "--frame", "4", "-o", "a.cube"], ["info", str(path)]):
            assert main(words) == 1
            text = capsys.readouterr().err
            assert "edit.shots.json: /schema: " in text
            assert "this is a manifest of shots: name the sidecar (.p4d.json) of one" in text
            assert "correct it there" not in text


class TestReport:
    def test_the_table(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        image = np.random.default_rng(1).random((20, 30, 3), dtype=np.float32)
        picture = write_image(tmp_path / "frame.4.exr", image)
        out = tmp_path / "a.cube"
        assert run("-o", out, "--clip", picture, "--size", 9) == 0
        printed = capsys.readouterr()
        lines = printed.out.splitlines()
        assert lines[0] == f"{out}: Resolve .cube, 9 samples a side, frame 4"
        assert "|a-b|/max(|b|,0.1)" in lines[1]
        assert "deltaE 2000" in lines[1]
        rows = [line.strip() for line in lines[3:7]]
        assert [row.partition(",")[0] for row in rows] == [
            "clip's colours at frame 4", "clip's colours at frame 4", "dense grid", "dense grid",
        ]  # fmt: skip
        assert "deltaE: " in lines[7]

    def test_an_error_that_can_be_seen_on_the_clip_is_warned_of(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        image = np.random.default_rng(1).random((20, 30, 3), dtype=np.float32)
        picture = write_image(tmp_path / "frame.4.exr", image)
        grey = write_image(tmp_path / "grey.4.exr", np.full((4, 4, 3), 0.5, dtype=np.float32))
        for words, seen in (
            (("-o", tmp_path / "small.clf", "--clip", picture, "--size", 2), True),
            (("-o", tmp_path / "a.cc", "--clip", picture), True),
            (("-o", tmp_path / "large.clf", "--clip", grey, "--size", 65), False),
            # Without the clip the grid has colours that no picture may have.
            (("-o", tmp_path / "grid.clf", "--size", 2), False),
        ):
            assert run(*words, "--json") == 0
            printed = capsys.readouterr()
            clip = json.loads(printed.out)["clip"]
            assert (clip is not None and clip["worst"]["delta_e_largest"] > 1) == seen
            assert ("can be seen" in printed.err) == seen

    def test_clamped_colours_are_warned_of(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        image = np.full((4, 5, 3), 0.5, dtype=np.float32)
        image[0, 0] = 3.0
        picture = write_image(tmp_path / "frame.4.exr", image)
        assert run("-o", tmp_path / "a.spi3d", "--clip", picture, "--size", 5) == 0
        err = capsys.readouterr().err
        assert "5.000% of the frame's colours are outside 0 to 1" in err
        assert "resolve_cube" in err
        assert run("-o", tmp_path / "a.clf", "--clip", picture, "--size", 5) == 0
        printed = capsys.readouterr()
        assert "shaper log, input " in printed.out
        assert "are outside" not in printed.err
        assert "give those a .csp" not in printed.err
        assert run("-o", tmp_path / "a.cube", "--clip", picture, "--size", 5) == 0
        assert "only Resolve and OpenColorIO know the shaper" in capsys.readouterr().err

    def test_without_the_clip_the_palette_decides(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        beyond = str(GOLDEN / "v1_beyond_unit.p4d.json")
        words = ["bake", beyond, "--frame", "3", "--size", "5", "-o"]
        assert main([*words, str(tmp_path / "a.clf")]) == 0
        printed = capsys.readouterr()
        assert "shaper log, input -0.53 to 13" in printed.out
        assert "clamps" not in printed.err
        assert main([*words, str(tmp_path / "a.spi3d")]) == 0
        assert "from -0.53 to 12.28, is partly outside 0 to 1" in capsys.readouterr().err

    def test_nothing_edited(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        assert run("-o", tmp_path / "a.clf", "--strength", "0", "--size", 5) == 0
        printed = capsys.readouterr()
        assert "warning" not in printed.err
        assert "nothing is edited at this time" in printed.out

    def test_json(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        words = ("--json", "--max-error", "0.05", "--size", "5")
        assert run("-o", tmp_path / "a.clf", *words) == 0
        report = json.loads(capsys.readouterr().out)
        assert report["error"] <= 0.05
        assert report["shaper"] == {"kind": "none", "low": 0.0, "high": 1.0}
        assert report["grid"]["by_reading"]["tetrahedral"]["delta_e_mean"] > 0
        assert report["viewing"]


def windowed(tmp_path: Path) -> Path:
    """EDITED, with a pick that has a window until frame 9."""
    document = Document.load(EDITED)
    seen = document.grade.palette(4).rgb.mean(axis=0)
    where = {"colour": seen, "by": (0.2, 0, 0), "follow": False, "until": 9}
    document.pick(4, **where, window=(1, 1, 4, 4))
    path = tmp_path / "windowed.p4d.json"
    document.save(path)
    return path


def test_a_window_that_the_file_lacks_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, words = windowed(tmp_path), ("--size", "5", "--force", "-o")
    assert main(["bake", str(path), "--frame", "4", *words, str(tmp_path / "a.cube")]) == 0
    assert capsys.readouterr().err.count("warning: no LUT has the window of p1: ") == 1
    assert main(["bake", str(path), "--frame", "12", *words, str(tmp_path / "a.cube")]) == 0
    assert "window" not in capsys.readouterr().err
    assert main(["bake", str(path), "--frame", "4", *words, str(tmp_path / "a.cc")]) == 0
    assert "mattes" in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["bake", "export", "config"])
def test_picks_that_are_not_followed_yet_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: str
) -> None:
    document = Document.load(EDITED)
    seen = document.grade.palette(4).rgb[0].tolist()
    document.pick(4, colour=seen, by=(0.1, 0, 0), clip=Unread(seen))
    document.history = as_unread(document.history)
    document.save(path := tmp_path / "a.p4d.json")
    words = {
        "bake": ["--frame", "4", "-o", tmp_path / "a.cube"],
        "export": ["--frames", "4", "-o", tmp_path / "luts"],
        "config": ["--frames", "4", "--anyway", "-o", tmp_path / "config"],
    }
    main([verb, str(path), *map(str, words[verb])])
    assert "p1 not yet followed" in capsys.readouterr().err
