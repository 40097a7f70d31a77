"""The verb ``edit``: by id, by nearness, stops, and everything that must leave the file alone."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from palette4d import Palette4dError, _core
from palette4d.cli import main
from palette4d.grade import edits, sidecar

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
    assert {**after, "edits": 0} == {**before, "edits": 0}
    out = capsys.readouterr().out
    assert "vertex v4 (frame 0): #1a1ae6" in out
    assert "-> #e61a1a" in out


def test_set_again_replaces_and_order_does_not_matter(plain: str, tmp_path: Path) -> None:
    other = str(tmp_path / "other.p4d.json")
    Path(other).write_bytes(Path(plain).read_bytes())
    for path, ids in ((plain, ["v9", "v2", "v9"]), (other, ["v2", "v9"])):
        for name in ids:
            assert main.main(["edit", path, "set", name, "--rgb", "1,0,0.5"]) == 0
    assert Path(plain).read_bytes() == Path(other).read_bytes()
    assert [entry["vertex"] for entry in edits_of(plain)["vertices"]] == ["v2", "v9"]


@pytest.mark.parametrize(
    ("words", "colour"),
    [
        (["-0.1", "-1e-3", "-.5"], [-0.1, -0.001, -0.5]),
        (["2", "1.5", "1e2"], [2, 1.5, 100]),
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


def test_near_on_a_vertex(plain: str, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["edit", plain, "set", "--near", "0.2,0.2,1.0", "--frame", "9"]
    assert main.main([*arguments, "--rgb", "1", "1", "1"]) == 0
    assert edits_of(plain)["vertices"] == [{"vertex": "v8", "rgb": [1.0, 1.0, 1.0]}]
    out = capsys.readouterr().out
    assert "vertex v8 (frame 9)" in out
    assert "exact hit" not in out


@pytest.mark.parametrize(("frame", "vertex"), [("3", "v2"), ("6", "v6"), ("4.5", "v2")])
def test_near_on_an_edge_takes_the_nearest_end(
    plain: str, capsys: pytest.CaptureFixture[str], frame: str, vertex: str
) -> None:
    arguments = ["edit", plain, "set", "--near", "#e61a1a", "--frame", frame, "--rgb", "#ffffff"]
    assert main.main(arguments) == 0
    assert [entry["vertex"] for entry in edits_of(plain)["vertices"]] == [vertex]
    out = capsys.readouterr().out
    assert f"chose its nearest handle in time, vertex {vertex}" in out
    assert f"stop e2 --frame {frame} --rgb '#ffffff'" in out


def test_the_suggestion_is_an_exact_hit(plain: str, capsys: pytest.CaptureFixture[str]) -> None:
    """What the output suggests can be pasted into a shell and does what it says."""
    near = ["edit", plain, "set", "--near", "-1,1,-0.5", "--frame", "3", "--rgb", "-0.5", "1", "0"]
    assert main.main(near) == 0
    line = next(text for text in capsys.readouterr().out.splitlines() if "exact hit: " in text)
    command = line.split("exact hit: ")[1].replace("palette4d", "-m palette4d", 1)
    done = subprocess.run(
        ["/bin/sh", "-c", f"'{sys.executable}' {command}"], check=True, capture_output=True
    )
    assert done.stderr == b""
    assert edited_slice(plain, 3)[2] == [-0.5, 1.0, 0.0]


def test_near_chooses_an_existing_stop(edited: str) -> None:
    assert main.main(
        ["edit", edited, "set", "--near", "0.1,0.9,0.1", "--frame", "6.5", "--rgb", "1,1,1"]
    ) == 0  # fmt: skip
    assert edits_of(edited)["stops"][1]["rgb"] == [1.0, 1.0, 1.0]
    assert main.main(
        ["edit", edited, "set", "--near", "0.1,0.9,0.1", "--frame", "4.5", "--rgb", "0,0,0"]
    ) == 0  # fmt: skip
    assert edited_slice(edited, 4.5)[2] == [0.0, 0.0, 0.0]


def test_stop_changes_its_moment_and_fades(plain: str) -> None:
    assert main.main(["edit", plain, "stop", "e2", "--frame", "3", "--rgb", "0", "0", "1"]) == 0
    assert edits_of(plain)["stops"] == [
        {"id": "s1", "edge": "e2", "frame": 3, "rgb": [0.0, 0.0, 1.0]}
    ]
    assert edited_slice(plain, 3)[1] == [0.0, 0.0, 1.0]
    assert edited_slice(plain, 0)[1] == [0.9, 0.1, 0.1]
    assert edited_slice(plain, 9)[1] == [0.92, 0.1, 0.11]
    assert edited_slice(plain, 1.5)[1] == pytest.approx([0.45, 0.05, 0.55])
    assert edited_slice(plain, 15)[1] == pytest.approx([0.935, 0.115, 0.105])


def test_stop_near(plain: str, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["edit", plain, "stop", "--near", "0.6,0.6,0.6", "--frame", "15.5"]
    assert main.main([*arguments, "--rgb", "-0.25", "0", "2"]) == 0
    (stop,) = edits_of(plain)["stops"]
    assert (stop["edge"], stop["frame"], stop["rgb"]) == ("e9", 15.5, [-0.25, 0.0, 2.0])
    assert "on edge e9" in capsys.readouterr().out
    assert (
        main.main(["edit", plain, "stop", "--near", "1,0,0", "--frame", "0", "--rgb", "1,1,1"]) == 1
    )
    assert "set v2" in capsys.readouterr().err


def test_stop_again_recolours(plain: str) -> None:
    for colour in ("1,0,0", "0,1,0"):
        assert main.main(["edit", plain, "stop", "e2", "--frame", "3", "--rgb", colour]) == 0
    assert [stop["rgb"] for stop in edits_of(plain)["stops"]] == [[0.0, 1.0, 0.0]]


def test_stop_ids_are_stable_and_new(edited: str) -> None:
    assert main.main(["edit", edited, "reset", "s1"]) == 0
    assert main.main(["edit", edited, "stop", "e1", "--frame", "3", "--rgb", "1,1,1"]) == 0
    assert [stop["id"] for stop in edits_of(edited)["stops"]] == ["s3", "s2", "s4"]


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


def test_reset_gives_the_file_back(plain: str) -> None:
    before = Path(plain).read_bytes()
    assert main.main(["edit", plain, "set", "v4", "--rgb", "1,1,1"]) == 0
    assert main.main(["edit", plain, "stop", "e3", "--frame", "2.5", "--rgb", "1,1,1"]) == 0
    assert main.main(["edit", plain, "reset"]) == 0
    assert Path(plain).read_bytes() == before


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["set", "v44", "--rgb", "1,1,1"], "did you mean v4"),
        (["set", "e3", "--rgb", "1,1,1"], "stop e3"),
        (["set", "v4", "--rgb", "1,1"], "three finite numbers"),
        (["set", "v4", "--rgb", "1", "1", "nan"], "three finite numbers"),
        (["set", "v4", "--rgb", "1", "1", "inf"], "three finite numbers"),
        (["set", "v4", "--rgb", "#12345"], "#rrggbb"),
        (["set", "v4", "--rgb", "2e6", "0", "0"], "1e+06"),
        (["set", "--rgb", "1,1,1"], "neither ID nor --near"),
        (["set", "--rgb", "1", "0", "0", "v3"], "has taken 'v3'"),
        (["set", "--rgb", "v3", "1", "0", "0"], "expected the ID before --rgb: `v3 --rgb 1 0 0`"),
        (["set", "--rgb", "#ff0000", "v3"], "`v3 --rgb '#ff0000'`"),
        (["stop", "--frame", "3", "--rgb", "1,0,0", "e3"], "expected the EDGE before --rgb"),
        (["set", "v4", "--near", "1,1,1", "--frame", "3", "--rgb", "1,1,1"], "both"),
        (["set", "--near", "1,1,1", "--rgb", "1,1,1"], "go together"),
        (["set", "v4", "--frame", "3", "--rgb", "1,1,1"], "go together"),
        (["set", "--near", "1,1", "--frame", "3", "--rgb", "1,1,1"], "three finite numbers"),
        (["set", "--near", "1,1,1", "--frame", "21", "--rgb", "1,1,1"], "outside of the clip"),
        (["set", "--near", "1,1,1", "--frame", "-1", "--rgb", "1,1,1"], "0 to 20"),
        (["stop", "e99", "--frame", "3", "--rgb", "1,1,1"], "e9"),
        (["stop", "e3", "--frame", "9", "--rgb", "1,1,1"], "set v7"),
        (["stop", "e3", "--frame", "0", "--rgb", "1,1,1"], "set v3"),
        (["stop", "e3", "--frame", "12", "--rgb", "1,1,1"], "runs from v3 at frame 0"),
        (["stop", "e3", "--frame", "21", "--rgb", "1,1,1"], "outside of the clip"),
        (["stop", "--frame", "3", "--rgb", "1,1,1"], "neither EDGE nor --near"),
        (["move", "s1"], "neither --frame nor --by"),
        (["move", "s1", "--frame", "7"], "s3"),
        (["move", "s1", "--frame", "9"], "set v7"),
        (["move", "s1", "--frame", "22"], "outside of the clip"),
        (["move", "v4", "--frame", "3"], "only stops move in time"),
        (["move", "s9", "--frame", "3"], "did you mean"),
        (["move", "v4", "--by", "1e6", "0", "0"], "1e+06"),
        (["reset", "v99"], "did you mean"),
        (["reset", "e1"], "is an edge"),
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
        ["stop", "e3", "--rgb", "1,1,1"],
        ["stop", "e3", "--frame", "nan", "--rgb", "1,1,1"],
        ["move", "s1", "--by", "1", "2"],
        ["move", "s1", "--by", "1", "2", "nan"],
        ["set", "v4"],
    ],
)
def test_wrong_usage_is_2(edited: str, words: list[str]) -> None:
    before = Path(edited).read_bytes()
    with pytest.raises(SystemExit) as caught:
        main.main(["edit", edited, *words])
    assert caught.value.code == 2
    assert Path(edited).read_bytes() == before


@pytest.mark.parametrize(
    ("words", "count"),
    [
        (["set", "v1", "--rgb", "-0.5", "0", "1"], (3, 3)),
        (["set", "--near", "-0.1,0.9,0.1", "--frame", "0", "--rgb", "1", "0", "1"], (3, 3)),
        (["stop", "e1", "--frame", "2.5", "--rgb", "#102030"], (2, 4)),
        (["move", "s1", "--frame", "3", "--by", "-0.1", "-0.1", "-0.1"], (2, 3)),
        (["reset", "s1"], (2, 2)),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else None,
)
def test_in_a_process(edited: str, words: list[str], count: tuple[int, int]) -> None:
    result = subprocess.run(
        [sys.executable, "-m", "palette4d", "edit", edited, *words],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout
    found = edits_of(edited)
    assert (len(found["vertices"]), len(found["stops"])) == count


def test_a_read_only_folder(edited: str, capsys: pytest.CaptureFixture[str]) -> None:
    folder = Path(edited).parent
    folder.chmod(0o555)
    try:
        if (folder / "probe").exists() or _writable(folder):
            pytest.skip("this user may write everywhere")
        assert main.main(["edit", edited, "set", "v1", "--rgb", "1,1,1"]) == 1
        assert "cannot be written" in capsys.readouterr().err
    finally:
        folder.chmod(0o755)


def _writable(folder: Path) -> bool:
    try:
        (folder / "probe").touch()
    except OSError:
        return False
    (folder / "probe").unlink()
    return True


# --------------------------------------------------------------------------- the functions beneath


def test_functions_leave_their_argument_alone() -> None:
    document = sidecar.load(GOLDEN / "v1_edited.p4d.json")
    text = json.dumps(document)
    edits.set_colour(document, "v1", (1, 1, 1))
    edits.shift_colour(document, "s1", (1, 1, 1))
    edits.set_stop(document, "e1", 3, (1, 1, 1))
    edits.move_stop(document, "s1", 3)
    edits.reset(document)
    edits.nearest_handle(document, (1, 1, 1), 3)
    assert json.dumps(document) == text


@pytest.mark.parametrize("path", sorted(GOLDEN.glob("*.json")), ids=lambda path: path.name)
def test_edited_colours_are_linear_between_handles(path: Path) -> None:
    document = sidecar.load(path)
    vertices = {vertex["id"]: vertex for vertex in document["polytope"]["vertices"]}
    for edge in document["polytope"]["edges"]:
        ends = [vertices[edge[end]] for end in ("from", "to")]
        handles = [(end["frame"], edits.colour_of(document, end["id"])) for end in ends]
        handles += [
            (stop["frame"], stop["rgb"])
            for stop in document["edits"]["stops"]
            if stop["edge"] == edge["id"]
        ]
        frames, colours = zip(*sorted(handles), strict=True)
        for frame in [*frames, *np.linspace(frames[0], frames[-1], 7).tolist()]:
            expected = [
                np.interp(frame, frames, component) for component in zip(*colours, strict=True)
            ]
            found = edits.edited_at(document, edge["id"], frame)
            assert found == pytest.approx(expected, abs=1e-12), (edge["id"], frame)
        with pytest.raises(Palette4dError, match="expected one in between"):
            edits.edited_at(document, edge["id"], frames[-1] + 0.5)


def test_nearest_handle_says_what_it_found() -> None:
    document = sidecar.load(GOLDEN / "v1_edited.p4d.json")
    handle = edits.nearest_handle(document, (0.12, 0.9, 0.1), 6)
    assert (handle.kind, handle.id, handle.frame, handle.edge) == ("stop", "s3", 7, "e3")
    assert not handle.exact
    assert handle.rgb == pytest.approx((0.1 + 0.02 * 6 / 9, 0.9, 0.1 + 0.01 * 6 / 9))
    with pytest.raises(Palette4dError, match="outside"):
        edits.nearest_handle(document, (0, 0, 0), float("nan"))
