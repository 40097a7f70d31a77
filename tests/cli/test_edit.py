"""The verb ``edit``: by id, by the nearest colour, stops, and refusals that change nothing."""

import json
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from posix_files import modes

from palette4d import _core, load
from palette4d.cli import main
from palette4d.grade import sidecar
from palette4d.shows import manifest
from palette4d.shows.shots import Shot

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"


@pytest.fixture
def plain(tmp_path: Path) -> str:
    """v1_split: e1 runs from v1 (frame 0) to v5 (frame 9); v8 splits into v12 and v13."""
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    return str(path)


@pytest.fixture
def edited(tmp_path: Path) -> str:
    """v1_edited: v4 and v17 edited; stops s1 (4.5) and s3 (7) on e3, s2 (9.25) on e13."""
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_edited.p4d.json").read_bytes())
    return str(path)


def edits_of(path: str) -> dict[str, Any]:
    found: dict[str, Any] = sidecar.load(path)["edits"]
    return found


def edited_slice(path: str, frame: float) -> list[list[float]]:
    read = _core.read_sidecar(path)
    cut = _core.slice_at(read.polytope, frame)
    colours: list[list[float]] = _core.edited_colours(read.polytope, read.edits, cut).tolist()
    return colours


def test_set_a_vertex(plain: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = sidecar.load(plain)
    assert main.main(["edit", plain, "set", "v4", "--rgb", "0.9", "0.1", "0.1"]) == 0
    after = sidecar.load(plain)
    assert after["edits"] == {"vertices": [{"vertex": "v4", "rgb": [0.9, 0.1, 0.1]}], "stops": []}
    assert {**after, "edits": 0, "history": 0} == {**before, "edits": 0, "history": 0}
    out = capsys.readouterr().out
    assert "vertex v4 (frame 0): #1a1ae6" in out
    assert "-> #e61a1a" in out


def test_set_again_replaces_and_order_does_not_matter(plain: str, tmp_path: Path) -> None:
    other = str(tmp_path / "other.p4d.json")
    Path(other).write_bytes(Path(plain).read_bytes())
    for path, ids in ((plain, ["v9", "v2", "v9"]), (other, ["v2", "v9"])):
        for name in ids:
            assert main.main(["edit", path, "set", name, "--rgb", "1,0,0.5"]) == 0
    assert main.main(["edit", plain, "history", "--clear"]) == 0
    assert main.main(["edit", other, "history", "--clear"]) == 0
    assert Path(plain).read_bytes() == Path(other).read_bytes()
    assert [entry["vertex"] for entry in edits_of(plain)["vertices"]] == ["v2", "v9"]


@pytest.mark.parametrize(
    ("words", "colour"),
    [
        (["-0.1", "-1e-3", "-.5"], [-0.1, -0.001, -0.5]),
        (["2", "1.5", "1e1"], [2, 1.5, 10]),
        (["-0.1,0.2,-3e-1"], [-0.1, 0.2, -0.3]),
        (["#ff0080"], [1, 0, 128 / 255]),
    ],
)
def test_colours_in_all_forms(plain: str, words: list[str], colour: list[float]) -> None:
    assert main.main(["edit", plain, "set", "v1", "--rgb", *words]) == 0
    assert edits_of(plain)["vertices"] == [{"vertex": "v1", "rgb": colour}]


def test_set_a_stop(edited: str) -> None:
    assert main.main(["edit", edited, "set", "s1", "--rgb", "0", "0", "1"]) == 0
    assert edits_of(edited)["stops"][0] == {
        "id": "s1", "edge": "e3", "frame": 4.5, "rgb": [0.0, 0.0, 1.0]
    }  # fmt: skip


@pytest.mark.parametrize("frame", ["3", "6", "4.5", "0", "9", "15"])
def test_near_hits_exactly(plain: str, capsys: pytest.CaptureFixture[str], frame: str) -> None:
    arguments = ["edit", plain, "set", "--near", "#e61a1a", "--frame", frame]
    assert main.main([*arguments, "--rgb", "-0.5", "1", "0.125"]) == 0
    assert edited_slice(plain, float(frame))[1] == [-0.5, 1, 0.125]
    out = capsys.readouterr().out
    assert " away" in out
    assert f"frame {frame}" in out
    # Again, by what is seen now.
    assert main.main([*arguments[:3], "--near=-0.5,1,0.125", *arguments[5:], "--rgb=0,0,0"]) == 0
    assert edited_slice(plain, float(frame))[1] == [0, 0, 0]
    edited = edits_of(plain)
    assert len(edited["vertices"]) + len(edited["stops"]) == 1


def test_near_refuses_what_is_far(plain: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = Path(plain).read_bytes()
    arguments = ["edit", plain, "set", "--near", "0.5", "0.1", "0.1", "--frame", "3"]
    assert main.main([*arguments, "--rgb", "1,1,1"]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    for part in ("% e1", "% e2", "--anyway", "0.25"):
        assert part in captured.err
    assert Path(plain).read_bytes() == before
    assert main.main([*arguments, "--rgb", "1,1,1", "--anyway"]) == 0
    assert len(edits_of(plain)["stops"]) == 1


@pytest.mark.parametrize("words", [["255", "128", "0"], ["255,128,0"], ["1023", "0", "0"]])
def test_integers_are_refused_with_the_remedy(
    plain: str, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    before = Path(plain).read_bytes()
    assert main.main(["edit", plain, "set", "v4", "--rgb", *words]) == 1
    error = capsys.readouterr().err
    assert "1 0" in error
    assert "--float" in error
    near = ["--near", *words, "--frame", "3", "--rgb", "0,0,0", "--anyway"]
    assert main.main(["edit", plain, "set", *near]) == 1
    assert Path(plain).read_bytes() == before
    assert main.main(["edit", plain, "set", "v4", "--rgb", *words, "--float"]) == 0
    document = sidecar.load(plain)
    assert max(document["edits"]["vertices"][0]["rgb"]) >= 255
    document["clip"]["encoding"] = "ACEScg"
    document["edits"]["vertices"] = []
    sidecar.save(document, plain, on_edits="drop")
    assert main.main(["edit", plain, "set", "v4", "--rgb", *words]) == 0


@pytest.mark.parametrize("by", [["0.1", "-0.1", "0"], ["0.1,-0.1,0"], ["#1a0000"]])
def test_by_reads_what_rgb_reads(plain: str, by: list[str]) -> None:
    assert main.main(["edit", plain, "move", "v4", "--by", *by]) == 0
    assert edits_of(plain)["vertices"][0]["rgb"][0] == pytest.approx(0.2, abs=0.01)


def test_an_edge_at_a_frame(plain: str) -> None:
    assert main.main(["edit", plain, "set", "e2", "--frame", "3", "--rgb", "0", "0", "1"]) == 0
    assert edits_of(plain)["stops"] == [
        {"id": "s1", "edge": "e2", "frame": 3, "rgb": [0.0, 0.0, 1.0]}
    ]


def test_stop_again_recolours(plain: str) -> None:
    for colour in ("1,0,0", "0,1,0"):
        assert main.main(["edit", plain, "set", "e2", "--frame", "3", "--rgb", colour]) == 0
    assert [stop["rgb"] for stop in edits_of(plain)["stops"]] == [[0.0, 1.0, 0.0]]


def test_move(edited: str) -> None:
    assert main.main(["edit", edited, "move", "s1", "--frame", "6"]) == 0
    assert edits_of(edited)["stops"][0]["frame"] == 6
    assert (
        main.main(["edit", edited, "move", "s1", "--frame", "2", "--by", "-0.5", "0", "-.25"]) == 0
    )
    stop = edits_of(edited)["stops"][0]
    assert (stop["frame"], stop["rgb"]) == (2, pytest.approx([-0.3, 0.4, 0.65]))
    assert main.main(["edit", edited, "move", "v4", "--by", "0.05", "0", "-0.1"]) == 0
    assert edits_of(edited)["vertices"][0]["rgb"] == pytest.approx([0.95, 0.1, 0.0])
    assert main.main(["edit", edited, "move", "v1", "--by", "-1", "0", "0"]) == 0
    assert edits_of(edited)["vertices"][0] == {
        "vertex": "v1", "rgb": pytest.approx([-0.9, 0.1, 0.1])
    }  # fmt: skip


def test_reset(edited: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main.main(["edit", edited, "reset", "v4"]) == 0
    assert [entry["vertex"] for entry in edits_of(edited)["vertices"]] == ["v17"]
    assert main.main(["edit", edited, "reset", "s3"]) == 0
    assert [stop["id"] for stop in edits_of(edited)["stops"]] == ["s1", "s2"]
    assert "removed" in capsys.readouterr().out
    assert main.main(["edit", edited, "reset"]) == 0
    assert edits_of(edited) == {"vertices": [], "stops": []}
    capsys.readouterr()
    assert main.main(["edit", edited, "reset", "v4"]) == 0
    assert capsys.readouterr().out == "nothing to reset\n"


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["set", "v44", "--rgb", "1,1,1"], "v4"),
        (["set", "e3", "--rgb", "1,1,1"], "--frame"),
        (["set", "v4", "--rgb", "2e6", "0", "0", "--float"], "1e+06"),
        (["set", "--rgb", "1,1,1"], "--near"),
        (["set", "v4", "--near", "1,1,1", "--frame", "3", "--rgb", "1,1,1"], "--near"),
        (["set", "--near", "1,1,1", "--rgb", "1,1,1"], "--frame"),
        (["set", "v4", "--frame", "3", "--rgb", "1,1,1"], "--frame"),
        (["set", "--near", "1,1,1", "--frame", "21", "--rgb", "1,1,1"], "0 to 20"),
        (["set", "--near", "1,1,1", "--frame", "-1", "--rgb", "1,1,1"], "0 to 20"),
        (["set", "e99", "--frame", "3", "--rgb", "1,1,1"], "e9"),
        (["set", "e3", "--frame", "9", "--rgb", "1,1,1"], "set v7"),
        (["set", "e3", "--frame", "0", "--rgb", "1,1,1"], "set v3"),
        (["set", "e3", "--frame", "12", "--rgb", "1,1,1"], "v3 at frame 0"),
        (["set", "e3", "--frame", "21", "--rgb", "1,1,1"], "0 to 20"),
        (["move", "s1"], "--frame"),
        (["move", "s1", "--frame", "7"], "s3"),
        (["move", "s1", "--frame", "9"], "set v7"),
        (["move", "s1", "--frame", "22"], "0 to 20"),
        (["move", "v4", "--frame", "3"], "--by"),
        (["move", "s9", "--frame", "3"], "s1"),
        (["move", "v4", "--by", "-20", "0", "0"], "--float"),
        (["move", "v4", "--by", "1e6", "0", "0", "--float"], "1e+06"),
        (["reset", "v99"], "v9"),
        (["reset", "e1"], "edge"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_errors_leave_the_file_alone(
    edited: str, capsys: pytest.CaptureFixture[str], words: list[str], part: str
) -> None:
    before = Path(edited).read_bytes()
    assert main.main(["edit", edited, *words]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("palette4d: error: ")
    assert part in captured.err
    assert Path(edited).read_bytes() == before
    assert [entry.name for entry in Path(edited).parent.iterdir()] == ["clip.p4d.json"]


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["paint", "v4"],
        ["set", "e3", "--frame", "nan", "--rgb", "1,1,1"],
        ["move", "s1", "--by", "1", "2"],
        ["move", "s1", "--by", "1", "2", "nan"],
        ["set", "v4"],
        ["set", "v4", "--rgb", "1,1"],
        ["set", "v4", "--rgb", "1", "1", "nan"],
        ["set", "v4", "--rgb", "1", "1", "inf"],
        ["set", "v4", "--rgb", "#12345"],
        ["set", "--rgb", "1", "0", "0", "v3"],
        ["set", "--near", "1,1", "--frame", "3", "--rgb", "1,1,1"],
    ],
)
def test_wrong_usage_is_2(edited: str, words: list[str]) -> None:
    before = Path(edited).read_bytes()
    with pytest.raises(SystemExit) as caught:
        main.main(["edit", edited, *words])
    assert caught.value.code == 2
    assert Path(edited).read_bytes() == before


def test_in_a_process(edited: str) -> None:
    words = ["set", "--near", "-0.1,0.9,0.1", "--frame", "0", "--rgb", "1", "0", "1"]
    result = subprocess.run(
        [sys.executable, "-m", "palette4d", "edit", edited, *words],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout
    assert [entry["vertex"] for entry in edits_of(edited)["vertices"]] == ["v3", "v4", "v17"]


@modes
def test_a_read_only_folder(edited: str, capsys: pytest.CaptureFixture[str]) -> None:
    folder = Path(edited).parent
    folder.chmod(0o555)
    try:
        if (folder / "probe").exists() or _writable(folder):
            pytest.skip("this user may write everywhere")
        assert main.main(["edit", edited, "set", "v1", "--rgb", "1,1,1"]) == 1
        assert str(folder) in capsys.readouterr().err
    finally:
        folder.chmod(0o755)


def _writable(folder: Path) -> bool:
    try:
        (folder / "probe").touch()
    except OSError:
        return False
    (folder / "probe").unlink()
    return True


# ------------------------------------------------------------------- steps, versions, tracks, ramps


def run(path: str, words: str) -> int:
    return main.main(["edit", path, *words.split()])


def test_undo_and_redo(plain: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = edits_of(plain)
    assert run(plain, "undo") == 1
    assert "nothing to undo" in capsys.readouterr().err
    assert run(plain, "set v1 --rgb #ff0000") == 0
    assert run(plain, "set e1 --frame 3 --rgb 0.5,0.5,0.5") == 0
    after = edits_of(plain)
    assert run(plain, "undo --steps 2") == 0
    assert edits_of(plain) == before
    assert run(plain, "undo") == 1
    assert run(plain, "redo --steps 3") == 1
    assert edits_of(plain) == before
    assert run(plain, "redo --steps 2") == 0
    assert edits_of(plain) == after
    assert run(plain, "undo") == 0
    capsys.readouterr()
    assert run(plain, "history") == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[:3] for line in lines] == [["1", "set", "v1"], ["2", "set", "e1"]]
    assert ["undone" in line for line in lines] == [False, True]
    assert run(plain, "history --json") == 0
    assert {n: len(v) for n, v in json.loads(capsys.readouterr().out).items()} == {
        "done": 1,
        "undone": 1,
    }


def test_versions(plain: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(plain, "version list") == 0
    assert run(plain, "version use warm") == 1
    assert run(plain, "set v1 --rgb #ff0000") == 0
    assert run(plain, "version save warm") == 0
    warm = edits_of(plain)
    assert run(plain, "set v1 --rgb #0000ff") == 0
    cold = edits_of(plain)
    capsys.readouterr()
    assert run(plain, "version use warm") == 0
    assert "before warm" in capsys.readouterr().out
    assert edits_of(plain) == warm
    assert run(plain, "version list") == 0
    assert capsys.readouterr().out.splitlines() == ["  before warm", "* warm"]
    assert run(plain, "undo") == 0
    assert edits_of(plain) == cold
    assert run(plain, "version remove warm") == 0
    assert run(plain, "version remove warm") == 1
    assert run(plain, "undo") == 0
    assert run(plain, "version use warm") == 0


def test_a_track_and_the_palette(plain: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(plain, "track v4 --by 0.1,0,0") == 0
    assert "vertex v13" in capsys.readouterr().out
    assert {entry["vertex"] for entry in edits_of(plain)["vertices"]} == {
        *("v4", "v8", "v12", "v13", "v17", "v18")
    }
    assert run(plain, "palette --chroma 0 --from 5 --until 8 --fade 2 --ramp smooth") == 0
    assert run(plain, "undo") == 0
    assert run(plain, "set --near 0.12,0.1,0.1 --frame 9 --chroma 0.5 --lightness 1.1") == 0
    assert run(plain, "set --near 0.12,0.1,0.1 --frame 9 --by 0.1,0,0 --from 8") == 0


def test_ramps(plain: str) -> None:
    assert run(plain, "ramp smooth") == 0
    assert run(plain, "set v1 --rgb #ff0000 --ramp step") == 0
    assert run(plain, "ramp linear v2 v3") == 0
    edits = edits_of(plain)
    assert edits["ramp"] == "smooth"
    assert [entry["ramp"] for entry in edits["vertices"]] == ["hold", "linear", "linear"]
    assert run(plain, "ramp hold v2") == 0  # what a step was called
    assert [entry["ramp"] for entry in edits_of(plain)["vertices"]] == ["hold", "hold", "linear"]
    assert run(plain, "ramp linear") == 0
    assert "ramp" not in edits_of(plain)


@pytest.mark.parametrize(
    "words",
    [
        "set v1 --rgb #ff0000 --by 1,1,1",
        "track v1",
        "palette --hue 3 --by 1,1,1",
        "track v1 --chroma -1",
        "ramp round",
        "undo --steps 0",
        "version",
        "version save",
        "history --json --clear",
        "set v1 --rgb #ff0000 --fade -1",
    ],
)
def test_wrong_usage_of_the_new_actions(plain: str, words: str) -> None:
    before = Path(plain).read_bytes()
    with pytest.raises(SystemExit) as caught:
        run(plain, words)
    assert caught.value.code == 2
    assert Path(plain).read_bytes() == before


# ------------------------------------------------------------------------------------ copied grades


def test_copy(plain: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = tmp_path / "other.p4d.json"
    other.write_bytes(Path(plain).read_bytes())
    assert run(plain, "track v4 --by 0.2,0.1,0") == 0
    capsys.readouterr()
    assert run(str(other), f"copy {plain}") == 0
    assert "0.0 of 255 on average" in capsys.readouterr().out
    found, expected = (
        {entry["vertex"]: entry["rgb"] for entry in edits_of(path)["vertices"]}
        for path in (str(other), plain)
    )
    assert found.keys() == expected.keys()
    for id_, rgb in expected.items():
        assert found[id_] == pytest.approx(rgb, abs=1e-6)
    assert run(str(other), f"copy {plain} --time frame 3") == 0
    assert run(str(other), f"copy {plain} --time frame 99") == 1
    assert run(str(other), "reset") == 0
    assert run(plain, f"copy {other}") == 1
    assert "no edits" in capsys.readouterr().err
    for words in ("--time never", "--time frame", "--time frame x", "--time relative 3"):
        with pytest.raises(SystemExit):
            run(str(other), f"copy {plain} {words}")


def test_copy_to_the_shots_of_a_show(
    plain: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(plain, "track v4 --by 0.2,0.1,0") == 0
    show = tmp_path / "show"
    show.mkdir()
    entries = []
    for name in ("a_1", "a_2", "b_1"):
        (show / f"{name}.p4d.json").write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
        shot = Shot(name, "clip.mov", 0, 20, (0, 20))
        entries.append(manifest.Entry(shot, manifest.DONE, (0, 20)))
    path = show / "film.shots.json"
    manifest.write(manifest.Manifest("film.mov", "", Fraction(24), {}, tuple(entries)), path)
    source = show / "a_1.p4d.json"
    source.write_bytes(Path(plain).read_bytes())
    before = source.read_bytes()
    assert run(str(path), f"copy {source} --shots a_*") == 0
    assert "1 shot of 1" in capsys.readouterr().out
    assert run(str(path), f"copy {source}") == 0
    assert source.read_bytes() == before
    for name in ("a_2", "b_1"):
        assert {e["vertex"] for e in edits_of(str(show / f"{name}.p4d.json"))["vertices"]} == {
            *("v4", "v8", "v12", "v13", "v17", "v18")
        }
    assert run(str(path), f"copy {source} --shots c_*") == 1
    (show / "b_1.p4d.json").write_text("{}")
    assert run(str(path), f"copy {source}") == 1
    assert "1 shot of 2" in capsys.readouterr().out


def test_resetting_many_stops_takes_linear_time(plain: str) -> None:
    document = sidecar.load(plain)
    count = 20_000
    document["edits"]["stops"] = [
        {"id": f"t{i}", "edge": "e1", "frame": 9 * (i + 1) / (count + 1), "rgb": [0.5, 0.5, 0.5]}
        for i in range(count)
    ]
    sidecar.save(document, plain, on_edits="drop")
    start = time.process_time()
    assert main.main(["edit", plain, "reset"]) == 0
    assert time.process_time() - start < 5  # about a second; quadratic time took 11 s
    assert edits_of(plain)["stops"] == []


def test_the_help_of_an_action_needs_no_sidecar(capsys: pytest.CaptureFixture[str]) -> None:
    helps = []
    for words in (["clip.p4d.json", "undo"], ["undo"]):
        with pytest.raises(SystemExit):
            main.main(["edit", *words, "--help"])
        helps.append(capsys.readouterr().out)
    assert helps[0] == helps[1]
    assert "--steps" in helps[0]


def test_versions_have_names_and_notes(plain: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(plain, "set v1 --rgb #ff0000") == 0
    assert run(plain, "version save warm") == 0
    assert (
        main.main(["edit", plain, "version", "note", "warm", "  for the client, 2nd round "]) == 0
    )
    assert run(plain, "version rename warm warmer") == 0
    assert run(plain, "version rename warm warmest") == 1
    assert run(plain, "set v1 --rgb #0000ff") == 0
    assert run(plain, "version save cold") == 0
    assert run(plain, "version rename cold warmer") == 1
    capsys.readouterr()
    assert run(plain, "version list") == 0
    lines = ["* cold", "  warmer: for the client, 2nd round"]
    assert capsys.readouterr().out.splitlines() == lines
    fields = json.loads(Path(plain).read_text(encoding="utf-8"))
    assert [sorted(version) for version in fields["versions"]] == [
        ["edits", "name"],
        ["edits", "name", "note"],
    ]
    assert run(plain, "version remove warmer") == 0
    assert run(plain, "undo") == 0
    assert load(plain).grade.note("warmer") == "for the client, 2nd round"
    assert main.main(["edit", plain, "version", "note", "warmer", ""]) == 0
    assert load(plain).grade.note("warmer") == ""
    assert main.main(["edit", plain, "version", "note", "warmer", "x" * 301]) == 1
    assert main.main(["edit", plain, "version", "note", "warmer", "two\nlines"]) == 1
    assert run(plain, "undo --steps 2") == 0  # the note is there again, and then the cold edit
    assert load(plain).grade.note("warmer") == "for the client, 2nd round"
