"""The verbs ``info`` and ``slice``, and the command line as a whole."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palette4d
from palette4d import _core
from palette4d.cli import main
from palette4d.cli.info import info_of
from palette4d.grade.document import Document
from palette4d.grade.grade import Grade
from palette4d.grade.palette import Palette

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
EDITED = str(GOLDEN / "v1_edited.p4d.json")
FILES = sorted(GOLDEN.glob("v*_*.p4d.json"))


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    return subprocess.run(
        [sys.executable, "-m", "palette4d", *arguments],
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=120,
        check=False,
    )


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such names")
def test_names_that_are_no_utf_8(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    named = tmp_path / os.fsdecode(b"b\xe9.p4d.json")
    named.write_bytes(Path(EDITED).read_bytes())
    assert main.main(["info", str(named)]) == 0
    assert main.main(["edit", str(named), "undo"]) in (0, 1)
    named.write_bytes(b"{")
    capsys.readouterr()
    assert main.main(["info", str(named)]) == 1
    assert "b\\udce9.p4d.json: " in capsys.readouterr().err


def test_a_palette_is_computed_once_for_all_tracks(monkeypatch: pytest.MonkeyPatch) -> None:
    document = Document.load(EDITED)
    frames: list[float] = []
    palette_at = document.grade.palette

    def palette(_: Grade, frame: float) -> Palette:
        frames.append(frame)
        return palette_at(frame)

    monkeypatch.setattr(Grade, "palette", palette)
    assert len(info_of(document)["tracks"]) > 2
    assert len(frames) == len({*frames})


def test_info_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["info", EDITED, "--json"]) == 0
    info = json.loads(capsys.readouterr().out)
    document = json.loads(Path(EDITED).read_text(encoding="utf-8"))
    assert info["vertices"] == 18
    assert info["edges"] == 14
    assert info["blocks"] == 2
    assert info["stops"] == 3
    assert info["edited_vertices"] == 2
    assert info["frame_range"] == [0, 20]
    assert info["rate"] == [24, 1]
    assert info["losses"] == document["quality"]["stages"][-1]
    assert info["block_ranges"] == [[0, 9], [10, 20]]
    by_id = {row["id"]: row for row in info["palette"]}
    assert by_id["v4"] == {
        "id": "v4", "frame": 0, "rgb": [0.1, 0.1, 0.9], "hex": "#1a1ae6",
        "called": "blue, 0", "edited": [0.9, 0.1, 0.1],
    }  # fmt: skip
    assert by_id["v5"]["edited"] is None
    assert info["palette_edges"][2] == {"id": "e3", "from": "v3", "to": "v7", "stops": ["s1", "s3"]}
    assert info["palette_stops"] == sorted(
        document["edits"]["stops"], key=lambda stop: str(stop["id"])
    )


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_info_for_people(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["info", str(path), "--handles", "--quality"]) == 0
    out = capsys.readouterr().out
    document = json.loads(path.read_text(encoding="utf-8"))
    ids = [row["id"] for part in ("vertices", "edges") for row in document["polytope"][part]]
    ids += [row["id"] for row in document["edits"]["stops"]]
    assert set(ids) <= {line.split()[0] for line in out.splitlines() if line}
    assert "\x1b" not in out


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_info_shows_tracks_first(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    document = Document.load(path)
    assert main.main(["info", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("track "))
    names = [line.split()[0] for line in lines[start + 1 : start + 1 + len(document.grade.tracks)]]
    assert names == [track.name for track in document.grade.tracks]
    assert len(lines) < start + len(names) + 6
    assert not any("deepest" in line or "K" in line.split() for line in lines)
    for name in names:
        assert document.adjust(name, track=True, by=(0.01, 0, 0))


def test_info_tells_of_all_edits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "clip.p4d.json"
    path.write_bytes(Path(EDITED).read_bytes())
    for words in ("ramp smooth", "version save warm", "set v1 --rgb #ff0000"):
        assert main.main(["edit", str(path), *words.split()]) == 0
    capsys.readouterr()
    assert main.main(["info", str(path)]) == 0
    out = capsys.readouterr().out
    assert "3 vertices, 3 stops, smooth ramps; 2 steps to undo" in out
    assert "versions  warm" in out
    assert main.main(["info", str(path), "--json"]) == 0
    info = json.loads(capsys.readouterr().out)
    assert (info["ramp"], info["steps"], info["versions"]) == ("smooth", 2, ["warm"])
    track = next(track for track in info["tracks"] if "v1" in track["vertices"])
    assert "v1" in track["edited"]
    assert track["rgb"] != track["edited_rgb"]


class Terminal:
    """A stdout that says it is a terminal."""

    def __init__(self, real: Any) -> None:
        self._real = real

    def __getattr__(self, name: str) -> Any:
        return getattr(self._real, name)

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("no_colour", ["", "1"])
def test_colours_are_shown_on_terminals(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, no_colour: str
) -> None:
    monkeypatch.setenv("NO_COLOR", no_colour)
    monkeypatch.setattr(sys, "stdout", Terminal(sys.stdout))
    assert main.main(["info", EDITED, "--handles"]) == 0
    assert ("\x1b[48;2;26;26;230m" in capsys.readouterr().out) == (not no_colour)


def test_slice_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["slice", EDITED, "--frame", "9.25", "--json"]) == 0
    cut = json.loads(capsys.readouterr().out)
    read = _core.read_sidecar(EDITED)
    core = _core.slice_at(read.polytope, 9.25)
    assert cut["frame"] == 9.25
    assert cut["vertices"] == core.rgb.tolist()
    assert cut["faces"] == core.faces.tolist()
    assert cut["edited"] == _core.edited_colours(read.polytope, read.edits, core).tolist()
    assert cut["tracks"][4] == {"edge": "e14", "from": "v8", "to": "v13", "weight": 0.25}
    # eq. 6, with the numbers of the file
    v8, v13 = np.array([0.12, 0.1, 0.91]), np.array([0.62, 0.61, 0.635])
    np.testing.assert_allclose(cut["vertices"][4], 0.75 * v8 + 0.25 * v13, atol=1e-15)
    assert cut["edited"][4] == cut["vertices"][4]
    assert cut["edited"][3] == [0.5, 0.5, 0.5]  # the stop s2


def test_slice_on_a_vertex(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["slice", EDITED, "--frame", "0", "--json"]) == 0
    cut = json.loads(capsys.readouterr().out)
    assert cut["tracks"][3] == {"edge": None, "from": "v4", "to": "v4", "weight": 0.0}
    assert cut["edited"][3] == [0.9, 0.1, 0.1]


@pytest.mark.parametrize(("asked", "given"), [("-5", 0), ("99.5", 20)])
def test_outside_the_clip_the_nearest_frame(
    capsys: pytest.CaptureFixture[str], asked: str, given: int
) -> None:
    assert main.main(["slice", EDITED, "--frame", asked, "--json"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["frame"] == given
    assert "outside of the clip" in captured.err


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("all", list(range(1001, 1100, 2))),
        ("1050", [1050]),
        ("1001-1004", [1001, 1002, 1003, 1004]),
        ("1001-1008x3,1050", [1001, 1004, 1007, 1050]),
    ],
)
def test_slice_of_many_frames(
    capsys: pytest.CaptureFixture[str], text: str, frames: list[int]
) -> None:
    path = str(GOLDEN / "v1_step_two.p4d.json")
    assert main.main(["slice", path, "--frames", text, "--json"]) == 0
    assert [cut["frame"] for cut in json.loads(capsys.readouterr().out)] == frames


def test_negative_frames(capsys: pytest.CaptureFixture[str]) -> None:
    path = str(GOLDEN / "v1_beyond_unit.p4d.json")
    assert main.main(["slice", path, "--frames", "-3--1", "--json"]) == 0
    assert [cut["frame"] for cut in json.loads(capsys.readouterr().out)] == [-3, -2, -1]


@pytest.mark.parametrize("text", ["0-21", "-1", "30,1"])
def test_frames_outside_the_clip(capsys: pytest.CaptureFixture[str], text: str) -> None:
    assert main.main(["slice", EDITED, "--frames", text]) == 1
    assert capsys.readouterr().err.startswith("palette4d: error: ")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_slice_for_people(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["slice", str(path), "--frames", "all"]) == 0
    frames = json.loads(path.read_text(encoding="utf-8"))["clip"]["frames"]
    count = (frames["last"] - frames["first"]) // frames["step"] + 1
    assert capsys.readouterr().out.count("frame ") == count


@pytest.mark.parametrize("number", ["nan", "inf", "one"])
def test_frames_are_finite_numbers(capsys: pytest.CaptureFixture[str], number: str) -> None:
    with pytest.raises(SystemExit) as caught:
        main.main(["slice", EDITED, "--frame", number])
    assert caught.value.code == 2
    assert number in capsys.readouterr().err


@pytest.mark.parametrize("verb", [["info"], ["slice", "--frame", "0"]])
def test_errors_of_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], verb: list[str]
) -> None:
    for content, word in (('{"schema": 1}', "/schema"), (None, "no such file")):
        path = tmp_path / "clip.p4d.json"
        path.unlink(missing_ok=True)
        if content is not None:
            path.write_text(content, encoding="utf-8")
        assert main.main([verb[0], str(path), *verb[1:]]) == 1
        captured = capsys.readouterr()
        assert captured.out == ""
        assert captured.err.startswith(f"palette4d: error: {path}: ")
        assert word in captured.err


def test_info_and_slice_in_a_process() -> None:
    result = run("info", EDITED, "--json")
    assert (result.returncode, result.stderr) == (0, "")
    assert json.loads(result.stdout)["vertices"] == 18
    result = run("slice", EDITED, "--frame", "3", "--json")
    assert (result.returncode, result.stderr) == (0, "")
    assert len(json.loads(result.stdout)["vertices"]) == 4
    result = run("info", "missing.p4d.json")
    assert result.returncode == 1
    assert result.stdout == ""
    assert result.stderr == (
        "palette4d: error: missing.p4d.json: found no such file, "
        "expected a sidecar file (*.p4d.json)\n"
    )


def test_version_and_usage() -> None:
    assert run("--version").stdout == f"palette4d {palette4d.__version__}\n"
    assert run().returncode == 2
    assert run("nonsense").returncode == 2


@pytest.mark.parametrize(
    "verb",
    ["analyze", "info", "slice", "edit", "render", "bake", "plot", "install-plugin", "sample-clip"],
)
def test_every_verb_has_help_with_an_example(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main.main([verb, "--help"])
    assert caught.value.code == 0
    out = capsys.readouterr().out
    assert f"palette4d {verb} " in out.split("example", 1)[1]


def test_help_does_not_load_what_it_does_not_need() -> None:
    code = (
        "import sys\n"
        "from palette4d.cli import main\n"
        "main.build_parser()\n"
        "heavy = {'matplotlib', 'OpenImageIO', 'PyOpenColorIO', 'nlopt', 'av', 'scipy'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    assert result.stdout == "[]\n"


@pytest.mark.skipif(os.name == "nt", reason="no pipes of this kind")
def test_a_reader_that_goes_away_is_no_traceback() -> None:
    command = f"'{sys.executable}' -m palette4d slice '{EDITED}' --frames all --json | head -c 10"
    result = subprocess.run(
        ["/bin/sh", "-c", command], capture_output=True, text=True, timeout=120, check=True
    )
    assert len(result.stdout) == 10
    assert "Traceback" not in result.stderr
    assert "Exception" not in result.stderr


def test_interruption_is_130(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(_path: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Document, "load", interrupted)
    assert main.main(["info", EDITED]) == 130
    assert "interrupted" in capsys.readouterr().err
