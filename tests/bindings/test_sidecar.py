"""The sidecar reader as Python sees it: values, typed errors, and a table of broken documents."""

import json
import os
import pickle
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import palette4d
from palette4d import Palette4dError, SidecarError, _core

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
FILES = sorted(GOLDEN.glob("v*_*.p4d.json"))

Document = dict[str, Any]


def golden(name: str) -> Document:
    document: Document = json.loads((GOLDEN / f"v1_{name}.p4d.json").read_text(encoding="utf-8"))
    return document


def refusal(document: Document | str | bytes) -> SidecarError:
    text = document if isinstance(document, str | bytes) else json.dumps(document)
    with pytest.raises(SidecarError) as caught:
        _core.parse_sidecar(text, "clip.p4d.json")
    return caught.value


def test_there_is_a_corpus() -> None:
    assert len(FILES) >= 12


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_golden_files_arrive_unchanged(path: Path) -> None:
    document = json.loads(path.read_text(encoding="utf-8"))
    read = _core.read_sidecar(path)
    clip, polytope = document["clip"], document["polytope"]
    assert (read.conversion is None) == ("conversion" not in clip)
    assert read.clip == {
        "name": clip["name"],
        "source": clip["source"],
        "first": clip["frames"]["first"],
        "last": clip["frames"]["last"],
        "step": clip["frames"]["step"],
        "rate": tuple(clip["rate"]),
        "width": clip["size"][0],
        "height": clip["size"][1],
        "encoding": clip["encoding"],
    }
    np.testing.assert_array_equal(
        read.polytope.vertices, [[*v["rgb"], v["frame"]] for v in polytope["vertices"]]
    )
    assert read.polytope.vertex_ids == [v["id"] for v in polytope["vertices"]]
    assert read.polytope.edge_ids == [e["id"] for e in polytope["edges"]]
    assert len(read.polytope.sections) == len(polytope["blocks"]) + len(polytope["transitions"])
    assert read.edits.vertex_rgb == {
        e["vertex"]: tuple(e["rgb"]) for e in document["edits"]["vertices"]
    }
    assert read.edits.stops == [
        {**stop, "rgb": tuple(stop["rgb"])} for stop in document["edits"]["stops"]
    ]


def test_the_time_of_a_palette_hardly_grows_with_the_stops_of_an_edge() -> None:
    def seconds(stops: int) -> float:
        document = golden("split")
        edge = document["polytope"]["edges"][0]
        frames = {v["id"]: v["frame"] for v in document["polytope"]["vertices"]}
        first, last = frames[edge["from"]], frames[edge["to"]]
        document["edits"]["ramp"] = "smooth"
        document["edits"]["stops"] = [
            {
                "id": f"s{i}",
                "edge": edge["id"],
                "frame": first + (last - first) * (i + 1) / (stops + 1),
                "rgb": [0.5, 0.5, i / stops],
            }
            for i in range(stops)
        ]
        read = _core.parse_sidecar(json.dumps(document), "many")
        palette = _core.slice_at(read.polytope, (first + last) / 2)
        start = time.process_time()
        for _ in range(500):
            _core.edited_colours(read.polytope, read.edits, palette)
        return time.process_time() - start

    # Windows counts in steps of 1/64 s.
    assert seconds(20_000) < 8 * max(min(seconds(100) for _ in range(3)), 1 / 64)


def test_versions_do_not_multiply_the_memory() -> None:
    document = golden("split")
    empty = {"vertices": [], "stops": []}
    document["versions"] = [{"name": f"v{i}", "edits": empty} for i in range(1_000_000 // 18 + 1)]
    error = refusal(document)
    assert error.pointer == "/versions"
    assert "55556 versions of 18 vertices" in str(error)
    del document["versions"][1000:]
    assert len(_core.parse_sidecar(json.dumps(document), "many").versions) == 1000


def test_picks_of_many_versions_take_little_memory() -> None:
    """Each would take 150 KB for its matte, if it were made."""
    document = golden("one_colour")
    picks = [
        {"id": f"p{i}", "kind": "hold", "frame": 0, "rgb": [0, 0, i / 100]} for i in range(100)
    ]
    edits = {"vertices": [], "stops": [], "picks": picks}
    document["versions"] = [{"name": f"v{i}", "edits": edits} for i in range(500)]
    resource = pytest.importorskip("resource")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert len(_core.parse_sidecar(json.dumps(document), "many").versions) == 500
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000


def test_parts_outlive_their_sidecar() -> None:
    edits = _core.read_sidecar(GOLDEN / "v1_edited.p4d.json").edits
    assert edits.vertex_rgb["v4"] == (0.9, 0.1, 0.1)


def test_error_has_its_parts_and_can_be_pickled() -> None:
    document = golden("edited")
    document["edits"]["stops"][2]["frame"] = 9
    error = refusal(document)
    assert isinstance(error, Palette4dError)
    assert palette4d.SidecarError is _core.SidecarError
    assert (error.file, error.pointer) == ("clip.p4d.json", "/edits/stops/2/frame")
    assert error.found == "the number 9"
    assert "e13" in error.expected
    assert (
        str(error)
        == f"clip.p4d.json: {error.pointer}: found {error.found}, expected {error.expected}"
    )
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is SidecarError
    assert str(again) == str(error)


# What to break in v1_edited.p4d.json, and the pointer that the error must give. Polytopes that are
# broken otherwise: tests/core/model/test_polytope.cpp.
def _put(*path: str | int, value: Any) -> Callable[[Document], None]:
    def change(document: Any) -> None:
        for step in path[:-1]:
            document = document[step]
        document[path[-1]] = value

    return change


def _drop(*path: str | int) -> Callable[[Document], None]:
    def change(document: Any) -> None:
        for step in path[:-1]:
            document = document[step]
        del document[path[-1]]

    return change


def _add(*path: str | int, value: Any) -> Callable[[Document], None]:
    def change(document: Any) -> None:
        for step in path:
            document = document[step]
        document.append(value)

    return change


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("extra", "anything"), {"deep": [[[{"er": None}]]], "": 1e-300}),
        (("quality", "options", "a new option"), "text"),
        (("quality", "versions", "libm"), None),
        (("quality", "stages", 0, "seconds"), 1.5),
    ],
)
def test_free_members_are_free(path: tuple[str | int, ...], value: Any) -> None:
    document = golden("edited")
    _put(*path, value=value)(document)
    assert _core.parse_sidecar(json.dumps(document)).clip


BROKEN: list[tuple[str, Callable[[Document], None], str]] = [
    ("unknown member", _put("clip", "a/b~c", value=0), "/clip/a~1b~0c"),
    ("member missing", _drop("clip", "frames", "step"), "/clip/frames/step"),
    ("newer version", _put("version", value=3), "/version"),
    ("fractional version", _put("version", value=1.25), "/version"),
    ("first after last", _put("clip", "frames", "first", value=21), "/clip/frames/last"),
    ("step does not divide", _put("clip", "frames", "step", value=7), "/clip/frames/step"),
    ("huge integer", _put("clip", "frames", "last", value=10**30), "/clip/frames/last"),
    ("skipped twice", _put("clip", "frames", "skipped", value=[3, 3]), "/clip/frames/skipped/1"),
    ("skipped outside", _put("clip", "frames", "skipped", value=[21]), "/clip/frames/skipped/0"),
    ("no vertices", _put("polytope", "vertices", value=[]), "/polytope/vertices"),
    ("id too long", _put("polytope", "vertices", 0, "id", value="v" * 65),
     "/polytope/vertices/0/id"),
    ("vertex id twice", _put("polytope", "vertices", 1, "id", value="v1"),
     "/polytope/vertices/1/id"),
    ("edge id twice", _put("polytope", "edges", 1, "id", value="e1"), "/polytope/edges/1/id"),
    ("edge with a vertex's id", _put("polytope", "edges", 1, "id", value="v1"),
     "/polytope/edges/1/id"),
    ("edge from nowhere", _put("polytope", "edges", 1, "from", value="v99"),
     "/polytope/edges/1/from"),
    ("edge backwards", _put("polytope", "edges", 1, value={"id": "e2", "from": "v6", "to": "v2"}),
     "/polytope/edges/1"),
    ("no blocks", _put("polytope", "blocks", value=[]), "/polytope/blocks"),
    ("transition missing", _put("polytope", "transitions", value=[]), "/polytope/transitions"),
    ("transition too many",
     _add("polytope", "transitions", value={"tracks": [["v1"]], "faces": []}),
     "/polytope/transitions"),
    ("late first block", _put("polytope", "blocks", 0, "first", value=0.5),
     "/polytope/blocks/0/first"),
    ("early last block", _put("polytope", "blocks", 1, "last", value=19),
     "/polytope/blocks/1/last"),
    ("unknown vertex in a track", _put("polytope", "blocks", 0, "tracks", 1, 0, value="v0"),
     "/polytope/blocks/0/tracks/1/0"),
    ("edit of nothing", _put("edits", "vertices", 0, "vertex", value="v99"),
     "/edits/vertices/0/vertex"),
    ("second edit", _put("edits", "vertices", 1, "vertex", value="v4"), "/edits/vertices/1/vertex"),
    ("stop on nothing", _put("edits", "stops", 0, "edge", value="e99"), "/edits/stops/0/edge"),
    ("stop at the edge's start", _put("edits", "stops", 0, "frame", value=0),
     "/edits/stops/0/frame"),
    ("stop at the edge's end", _put("edits", "stops", 0, "frame", value=9), "/edits/stops/0/frame"),
    ("stop beyond", _put("edits", "stops", 0, "frame", value=9.001), "/edits/stops/0/frame"),
    ("two stops at once", _put("edits", "stops", 1, "frame", value=4.5), "/edits/stops/1/frame"),
    ("stop id twice", _put("edits", "stops", 1, "id", value="s1"), "/edits/stops/1/id"),
    ("stop with an edge's id", _put("edits", "stops", 1, "id", value="e1"), "/edits/stops/1/id"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("change", "where"), [row[1:] for row in BROKEN], ids=[r[0] for r in BROKEN]
)
def test_broken_documents(change: Callable[[Document], None], where: str) -> None:
    document = golden("edited")
    change(document)
    error = refusal(document)
    assert error.pointer == where
    assert error.file == "clip.p4d.json"
    assert error.found
    assert error.expected


def test_newer_version_asks_for_an_update() -> None:
    document = golden("tetrahedron")
    document["version"] = 3
    document["something new"] = {}
    assert "written by a newer palette4d" in str(refusal(document))
    assert "update" in str(refusal(document))


TETRAHEDRON = (GOLDEN / "v1_tetrahedron.p4d.json").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "where", "word"),
    [
        ("", "", "empty"),
        (" ", "", "JSON"),
        ("{", "", "JSON"),
        (TETRAHEDRON + "x", "", "JSON"),
        (TETRAHEDRON + "\0", "", "NUL"),
        (TETRAHEDRON.replace("golden", "gol\0den", 1), "", "NUL"),
        ("\ufeff" + TETRAHEDRON, "", "byte order mark"),
        (TETRAHEDRON.encode("utf-16"), "", "byte order mark"),
        (TETRAHEDRON.encode("utf-16-le"), "", "JSON"),
        (TETRAHEDRON.replace("golden", "\udc80", 1), "/clip/name", "JSON"),
        (TETRAHEDRON.replace("golden", "\\ud800", 1), "/clip/name", "JSON"),
        (TETRAHEDRON.encode().replace(b"golden", b"\xff", 1), "/clip/name", "JSON"),
        (TETRAHEDRON.replace("0.9", "NaN", 1), "/polytope/vertices/1/rgb/0", "JSON"),
        (TETRAHEDRON.replace("0.9", "Infinity", 1), "/polytope/vertices/1/rgb/0", "JSON"),
        (TETRAHEDRON.replace("0.9", "1e999", 1), "/polytope/vertices/1/rgb/0", "too large"),
        (TETRAHEDRON.replace("0.9", "9" * 400, 1), "/polytope/vertices/1/rgb/0", "too large"),
        (TETRAHEDRON.replace('"extra": {', '"extra": {"a": 1, "a": 1', 1), "/extra/a", "second"),
        (TETRAHEDRON.replace('"extra": {', '"extra": {"a":' + "[" * 70, 1), None, "nesting"),
        ("[" * 100_000, None, "nesting"),
        ('{"a":' * 100_000, None, "nesting"),
        ("[]", "", "a list"),
        ("0", "", "the number 0"),
    ],
)
def test_text_that_is_no_sidecar(text: str | bytes, where: str | None, word: str) -> None:
    error = refusal(text)
    assert word in str(error)
    if where is not None:
        assert error.pointer == where
    str(error).encode("utf-8")


def test_parse_takes_text_only() -> None:
    with pytest.raises(TypeError):
        _core.parse_sidecar(12)  # type: ignore[arg-type]


def test_paths(tmp_path: Path) -> None:
    # Windows' names are characters, and those of Linux may be any bytes.
    bytes_alone = [] if os.name == "nt" else [tmp_path / "é\udcff.json"]
    for path in (tmp_path, tmp_path / "missing.json", *bytes_alone):
        with pytest.raises(SidecarError) as caught:
            _core.read_sidecar(path)
        assert caught.value.file == str(path)
        assert caught.value.pointer == ""
    target = tmp_path / "é ❄.p4d.json"
    target.write_text(TETRAHEDRON, encoding="utf-8")
    assert _core.read_sidecar(str(target)).clip["name"] == "golden"
    empty = tmp_path / "empty.json"
    empty.touch()
    with pytest.raises(SidecarError, match="empty"):
        _core.read_sidecar(empty)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_pipe_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(SidecarError, match="no regular file"):
        _core.read_sidecar(tmp_path / "pipe")
