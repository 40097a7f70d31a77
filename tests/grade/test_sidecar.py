"""Sidecar files: deterministic text, atomic replacement, edits that are never lost unasked."""

import copy
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from confining import forks

from palette4d import Palette4dError, SidecarError, _core
from palette4d.grade import sidecar
from palette4d.grade.document import Document

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
FILES = sorted(GOLDEN.glob("v*_*.p4d.json"))
PICKS_OF_VERSION_1 = {
    f"v1_{name}.p4d.json" for name in ("one_colour_bump", "picks", "picks_and_holds")
}

Fields = dict[str, Any]
PICK = {"kind": "pick", "frame": 0, "rgb": [0, 0, 0], "to": [1, 1, 1]}


def golden(name: str) -> Fields:
    return sidecar.load(GOLDEN / f"v1_{name}.p4d.json")


def names(folder: Path) -> list[str]:
    return sorted(entry.name for entry in folder.iterdir())


@pytest.fixture
def edited(tmp_path: Path) -> Path:
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_edited.p4d.json").read_bytes())
    return path


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_golden_files_are_written_as_they_are(path: Path, tmp_path: Path) -> None:
    sidecar.save(sidecar.load(path), tmp_path / "out.p4d.json")
    written = (tmp_path / "out.p4d.json").read_bytes()
    assert names(tmp_path) == ["out.p4d.json"]
    if path.name in PICKS_OF_VERSION_1:
        assert b"solution" in path.read_bytes()
        assert b"solution" not in written
        document = Document.load(path)
        assert document.fields()["version"] == (2 if document.grade.picks else 1)
        Document(document.fields()).save(tmp_path / "again.p4d.json")
        assert Document.load(tmp_path / "again.p4d.json").grade.picks == document.grade.picks
        return
    assert written == path.read_bytes()


def test_equal_documents_give_equal_text() -> None:
    document = golden("edited")
    shuffled = json.loads(json.dumps(document, sort_keys=True))
    shuffled["extra"] = document["extra"]
    shuffled["quality"] = document["quality"]
    shuffled["polytope"]["vertices"][0]["frame"] = 0.0
    shuffled["polytope"]["vertices"][0]["rgb"] = np.array([0.1, 0.1, 0.1])
    shuffled["clip"]["size"] = (np.int32(64), np.int64(36))
    assert sidecar.dumps(shuffled) == sidecar.dumps(document)


def test_every_double_survives(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    document = golden("split")
    for vertex in document["polytope"]["vertices"]:
        vertex["rgb"] = (rng.standard_normal(3) * 10.0 ** rng.integers(-300, 5, 3)).tolist()
    sidecar.save(document, tmp_path / "out.p4d.json")
    read = _core.read_sidecar(tmp_path / "out.p4d.json").polytope.vertices
    expected = np.array([[*v["rgb"], v["frame"]] for v in document["polytope"]["vertices"]])
    assert read.tobytes() == expected.tobytes()


# Another program puts the file and a pipe in each other's place. A reader that looks before it
# opens waits for the pipe's writer, once in some hundred reads; the alarm ends it then.
READS = """
import os, signal, sys
from pathlib import Path
from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade import sidecar

os.mkfifo("pipe")
os.link("a.p4d.json", "file")
parent = os.getpid()
swaps = os.fork()
if swaps == 0:
    while os.getppid() == parent:
        for name in ("pipe", "file"):
            os.link(name, "turn")
            os.rename("turn", "a.p4d.json")
    os._exit(0)
signal.alarm(60)
try:
    found = [0, 0]
    for _ in range(3000):
        for read in (sidecar.read_bytes, _core.read_sidecar):
            try:
                read("a.p4d.json")
            except Palette4dError:
                found[0] += 1
            else:
                found[1] += 1
    sys.exit(min(found) == 0)
finally:
    os.kill(swaps, signal.SIGKILL)
"""


@forks
def test_a_pipe_that_comes_into_the_files_place_holds_up_no_reader(tmp_path: Path) -> None:
    shutil.copyfile(GOLDEN / "v1_flat.p4d.json", tmp_path / "a.p4d.json")
    done = subprocess.run([sys.executable, "-c", READS], cwd=tmp_path, check=False, timeout=120)
    assert done.returncode == 0


def test_what_other_programs_keep_survives_an_edit(tmp_path: Path) -> None:
    """Values of any size and names in any order, wherever the format leaves room for them."""
    free = {"z": [1e16, 1e-5, 1.0, -0.0, 2**80, -(2**64), 1 << 63], "a": {"é\n": None, "": True}}
    path, fields = tmp_path / "clip.p4d.json", golden("edited")
    fields["extra"]["theirs"] = fields["history"] = free
    fields["quality"]["options"] = {"z": 1, "a": 2}
    fields["quality"]["stages"].append({"stage": "theirs", "z": 1, "a": 2.5})
    path.write_text(json.dumps(fields), "utf-8")
    document = Document.load(path)
    document.set("v1", rgb=(1, 1, 1))
    document.save()
    found = json.loads(path.read_text("utf-8"))
    assert json.dumps(found["extra"]) == json.dumps(fields["extra"])
    assert json.dumps(found["quality"]) == json.dumps(fields["quality"])
    assert found["history"].pop("done")
    assert json.dumps(found["history"]) == json.dumps(free)


def test_floats_are_written_as_python_writes_them() -> None:
    rng = np.random.default_rng(1)
    bits = rng.integers(0, 2**64, 20_000, np.uint64).view(np.float64)
    edges = [10.0**n for n in range(-10, 25)] + [5e-324, 2.0**53, 1 / 3, 123456789012345.6]
    numbers = [*bits[np.isfinite(bits)].tolist(), *edges, *rng.random(20_000).tolist()]
    fields = golden("tetrahedron")
    fields["extra"] = {"numbers": numbers}
    assert json.dumps(numbers) in sidecar.dumps(fields)


def test_one_vertex_a_line() -> None:
    document = golden("split")
    other = copy.deepcopy(document)
    other["polytope"]["vertices"][3]["rgb"][1] = 1 / 3
    a, b = sidecar.dumps(document).splitlines(), sidecar.dumps(other).splitlines()
    assert len(a) == len(b)
    assert [y for x, y in zip(a, b, strict=True) if x != y] == [
        '      {"id": "v4", "frame": 0, "rgb": [0.1, 0.3333333333333333, 0.9]},'
    ]


def test_new_document_is_complete() -> None:
    old = golden("tetrahedron")
    document = sidecar.new_document(old["clip"], old["polytope"], {"options": {"k": np.int64(50)}})
    assert document["version"] == 1
    sidecar.validate(document)
    assert document["generator"] == f"palette4d {_core.__version__}"
    assert document["quality"] == {"stages": [], "options": {"k": 50}, "versions": {}}
    assert type(document["quality"]["options"]["k"]) is int
    assert not sidecar.has_edits(document)


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), "red", None, 10**400])
def test_a_bad_document_leaves_no_file(tmp_path: Path, wrong: Any) -> None:
    document = golden("tetrahedron")
    document["polytope"]["vertices"][1]["rgb"][2] = wrong
    with pytest.raises(SidecarError) as caught:
        sidecar.save(document, tmp_path / "out.p4d.json")
    assert caught.value.pointer == "/polytope/vertices/1/rgb/2"
    assert caught.value.file == str(tmp_path / "out.p4d.json")
    assert names(tmp_path) == []


def test_a_name_that_is_no_unicode_is_refused_in_its_place(tmp_path: Path) -> None:
    document = golden("tetrahedron")
    document["clip"]["name"] = "\udcff"  # as Linux's Python reads the byte ff
    with pytest.raises(SidecarError) as caught:
        sidecar.save(document, tmp_path / "out.p4d.json")
    assert caught.value.pointer == "/clip/name"


class Interrupted(KeyboardInterrupt):
    pass


FULL = OSError(28, "No space left on device")


def test_edits_are_not_lost_unasked(edited: Path) -> None:
    before = edited.read_bytes()
    for attempt in (
        lambda: sidecar.save(golden("split"), edited),
        lambda: sidecar.check_target(edited),
    ):
        with pytest.raises(Palette4dError) as caught:
            attempt()
        assert "2 edited vertices, 3 stops, 0 picks and holds" in str(caught.value)
    assert edited.read_bytes() == before


def test_versions_without_an_edit_are_kept_and_not_lost_unasked(tmp_path: Path) -> None:
    path, other = tmp_path / "clip.p4d.json", tmp_path / "other.p4d.json"
    for target in (path, other):
        sidecar.save(golden("split"), target)
    document = Document.load(path)
    document.set("v1", rgb=(0.7, 0.2, 0.6))
    document.save_version("warm")
    document.undo()
    document.save()
    assert not document.grade.edited
    before = path.read_bytes()
    with pytest.raises(Palette4dError, match="1 version"):
        Document.load(other).save(path)
    assert path.read_bytes() == before
    sidecar.save(golden("split"), path, on_edits="keep")
    kept = Document.load(path)
    assert kept.grade.versions == ("warm",)
    assert kept.history.undone == document.history.undone


def test_undone_edits_are_kept_too(tmp_path: Path) -> None:
    path = tmp_path / "clip.p4d.json"
    sidecar.save(golden("split"), path)
    document = Document.load(path)
    document.set("v1", rgb=(0.7, 0.2, 0.6))
    document.pick(5, colour=(0.5, 0.5, 0.5), by=(0.1, 0, 0), follow=False)
    document.undo()
    document.undo()
    document.save()
    before = path.read_bytes()
    sidecar.save(golden("split"), path, on_edits="keep")
    assert path.read_bytes() == before
    kept = Document.load(path)
    kept.redo()
    assert kept.grade.colour("v1") == (0.7, 0.2, 0.6)


def test_edits_are_dropped_on_request(edited: Path) -> None:
    sidecar.check_target(edited, on_edits="drop")
    sidecar.save(golden("split"), edited, on_edits="drop")
    assert sidecar.load(edited) == golden("split")


@pytest.mark.parametrize("name", ["v1_edited", "v2_picks"])
def test_edits_are_kept_with_the_same_palette(tmp_path: Path, name: str) -> None:
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / f"{name}.p4d.json").read_bytes())
    old = sidecar.load(path)
    document = sidecar.new_document(old["clip"], old["polytope"], {"options": {"seed": 1}})
    sidecar.check_target(path, on_edits="keep")
    sidecar.save(document, path, on_edits="keep")
    new = sidecar.load(path)
    for member in ("version", "edits", "versions", "history", "mattes", "extra"):
        assert new.get(member) == old.get(member)
    assert new["quality"]["options"] == {"seed": 1}


def test_edits_are_not_kept_with_another_palette(edited: Path) -> None:
    before = edited.read_bytes()
    document = golden("split")
    document["polytope"]["vertices"][0]["rgb"][0] += 1e-12
    with pytest.raises(Palette4dError, match="cannot be kept"):
        sidecar.save(document, edited, on_edits="keep")
    assert edited.read_bytes() == before


@pytest.mark.parametrize("on_edits", ["refuse", "keep"])
def test_a_file_without_edits_is_replaced(tmp_path: Path, on_edits: Any) -> None:
    path = tmp_path / "clip.p4d.json"
    sidecar.save(golden("merge"), path)
    sidecar.save(golden("split"), path, on_edits=on_edits)
    assert sidecar.load(path) == golden("split")


def test_a_file_that_is_no_sidecar_is_not_replaced_unasked(tmp_path: Path) -> None:
    path = tmp_path / "notes.json"
    path.write_text('{"my": "notes"}', encoding="utf-8")
    with pytest.raises(Palette4dError, match="cannot be read as a sidecar"):
        sidecar.save(golden("split"), path)
    assert path.read_text(encoding="utf-8") == '{"my": "notes"}'
    sidecar.save(golden("split"), path, on_edits="drop")
    empty = tmp_path / "empty.json"
    empty.touch()
    sidecar.save(golden("split"), empty)


@pytest.mark.parametrize(("name", "what"), [("A.PNG", "a picture"), ("a.mov", "a movie")])
def test_a_picture_in_the_place_of_a_sidecar_is_told(tmp_path: Path, name: str, what: str) -> None:
    (tmp_path / name).write_bytes(b"\x89PNG")
    with pytest.raises(SidecarError, match=f"{what}, which is no sidecar"):
        sidecar.load(tmp_path / name)


def test_targets_that_cannot_be_written(tmp_path: Path) -> None:
    for target in (tmp_path, tmp_path / "missing" / "clip.p4d.json"):
        with pytest.raises(Palette4dError):
            sidecar.check_target(target)
        with pytest.raises(Palette4dError):
            sidecar.save(golden("split"), target)
    with pytest.raises(ValueError, match="on_edits"):
        sidecar.save(golden("split"), tmp_path / "x.json", on_edits="maybe")  # type: ignore[arg-type]
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("member", "pointer"),
    [
        ({"edits": {"picks": [dict(PICK, id=f"p{i}") for i in range(1001)]}}, "/edits/picks"),
        (
            {
                "edits": {
                    "picks": [
                        dict(PICK, id=id_, path=[{"frame": i / 1000, "rgb": [0, 0, 0]} for i in n])
                        for id_, n in (("p1", range(10_000)), ("p2", range(10_001)))
                    ]
                }
            },
            "/edits/picks/1/path",
        ),
        ({"colours": [{"frame": 0, "rgbw": []}]}, "/colours/0/rgbw"),
        ({"colours": [{"frame": 0, "rgbw": [[0, 0, 0, 1]] * 100_001}]}, "/colours/0/rgbw"),
    ],
    ids=["picks", "paths", "no colours", "colours"],
)
def test_what_would_take_all_time_is_refused(member: Any, pointer: str) -> None:
    fields = golden("split")
    edits = {**fields["edits"], **member.get("edits", {})}
    with pytest.raises(SidecarError) as caught:
        sidecar.validate({**fields, **member, "edits": edits})
    assert caught.value.pointer == pointer
