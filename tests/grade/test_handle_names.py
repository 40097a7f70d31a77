"""Handles and tracks have names for people, and no two handles at one frame share a name."""

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np

from palette4d import Document
from palette4d.grade.handle_names import vertex_colours
from palette4d.grade.handles import Handles
from palette4d.grade.tracks import Chain, Run, runs_of, tracks_of

SPLIT = Path(__file__).resolve().parent.parent / "golden/sidecars/v1_split.p4d.json"


def palette_of(*tracks: list[tuple[float, float, float, float]]) -> Any:
    """Vertices and edges of tracks of (frame, r, g, b)."""
    vertices, edges = [], []
    for track in tracks:
        ids = [f"v{len(vertices) + n}" for n in range(1, len(track) + 1)]
        vertices += [
            {"id": id_, "frame": frame, "rgb": rgb}
            for id_, (frame, *rgb) in zip(ids, track, strict=True)
        ]
        edges += [{"from": a, "to": b} for a, b in itertools.pairwise(ids)]
    for number, edge in enumerate(edges, 1):
        edge["id"] = f"e{number}"
    return {"vertices": vertices, "edges": edges}


def test_a_track_keeps_its_number_and_the_lightest_of_one_name_comes_first() -> None:
    fields = palette_of(
        [(0, 0, 0, 0.5), (9, 0, 0, 0.5), (20, 0.9, 0, 0)],
        [(0, 0.25, 0, 0), (9, 0, 0, 0.6), (20, 0, 0.8, 0)],
        [(0, 0.1, 0.1, 0.1), (20, 0, 0.8, 0)],
        [(0, 0.95, 0.9, 0), (20, 0.8, 0.8, 0.8)],
    )
    names = vertex_colours(fields["vertices"], fields["edges"], "sRGB")
    assert names[:3] == ["deep blue 2", "deep blue 2", "red"]
    assert names[3:6] == ["dark red", "deep blue 1", "green 1"]
    assert names[6:] == ["black", "green 2", "yellow", "light grey"]
    handles = Handles(fields)
    named = dict(zip(handles.vertices, names, strict=True))
    called = [track.called for track in tracks_of(handles, named)]
    assert called == [
        "deep blue 2 > red, 0-20",
        "dark red > deep blue 1 > green 1, 0-20",
        "black > green 2, 0-20",
        "yellow > light grey, 0-20",
    ]


def test_a_track_is_called_by_the_colours_that_it_has() -> None:
    steady = [(0, 0.6, 0.7, 1), (9, 0.1, 0.2, 1)]  # pale blue and blue are blue
    there_and_back = [(0, 0.9, 0, 0), (4, 0, 0.8, 0), (9, 0.9, 0, 0)]
    many = [(0, 0.95, 0.9, 0), (2, 0.9, 0.85, 0), (5, 0, 0.8, 0), (7, 0.5, 0.9, 0), (9, 0.9, 0, 0)]
    fields = palette_of(steady, there_and_back, many)
    names = vertex_colours(fields["vertices"], fields["edges"], "sRGB")
    handles = Handles(fields)
    tracks = tracks_of(handles, dict(zip(handles.vertices, names, strict=True)))
    assert [track.called for track in tracks] == [
        "blue, 0-9",
        "red 1 > green 1 > red 1, 0-9",
        "yellow > lime > red 2, 0-9",
    ]


def test_a_fork_ends_before_the_vertex_of_another_track() -> None:
    called = [
        next(t.called for t in Document.load(SPLIT.with_name(name)).grade.tracks if t.name == track)
        for name, track in ((SPLIT.name, "v13"), ("v1_merge.p4d.json", "v5"))
    ]
    assert called == ["light grey, 10-20", "grey, 0-9"]


def test_a_fork_between_tracks_is_called_by_what_it_comes_from_and_becomes() -> None:
    fields = palette_of([(0, 0.9, 0, 0), (9, 0.9, 0, 0)], [(0, 0, 0.8, 0), (9, 0, 0.8, 0)])
    fields["edges"].append({"id": "e3", "from": "v1", "to": "v4"})
    handles = Handles(fields)
    tracks = tracks_of(handles, {"v1": "red", "v2": "red", "v3": "green", "v4": "green"})
    assert [track.called for track in tracks] == ["red, 0-9", "green, 0-9", "red > green, 0-9"]


def test_names_are_of_the_unedited_colours_and_at_whole_frames() -> None:
    document = Document.load(SPLIT)
    names, tracks = document.grade.names, [track.called for track in document.grade.tracks]
    assert set(names) == {v["id"] for v in document.fields()["polytope"]["vertices"]}
    assert len(set(names.values())) == len(names)
    assert len(set(tracks)) == len(tracks)
    document.set("v1", rgb=(1, 0, 0))
    assert (document.grade.names, [t.called for t in document.grade.tracks]) == (names, tracks)


def test_a_stop_has_the_name_of_the_nearer_end() -> None:
    document = Document.load(SPLIT)
    edge = document.grade.handles.edges["e9"]  # from grey to light grey
    start, end = (document.grade.frame_of(edge[end]) for end in ("from", "to"))
    for share, near in ((0.25, edge["from"]), (0.75, edge["to"])):
        stop = document.stop(edge["id"], frame=start + share * (end - start), rgb=(0, 1, 0))
        assert document.grade.colour_names[stop] == document.grade.colour_names[near]
    track = next(track for track in document.grade.tracks if edge["id"] in track.edges)
    assert document.grade.called(edge["id"]) == track.called
    assert document.grade.called("nothing") == ""


def test_names_in_the_file_are_kept(tmp_path: Path) -> None:
    fields = json.loads(SPLIT.read_text(encoding="utf-8"))
    for number, vertex in enumerate(fields["polytope"]["vertices"]):
        vertex["name"] = f"hue {number}"
    path = tmp_path / "named.p4d.json"
    path.write_text(json.dumps(fields), encoding="utf-8")
    document = Document.load(path)
    assert document.grade.colour_names["v1"] == "hue 0"
    document.set("v1", rgb=(1, 0, 0))
    document.save()
    assert Document.load(path).grade.colour_names["v1"] == "hue 0"


def test_encodings_do_not_change_names() -> None:
    display = np.array([[0.55, 0.02, 0.03], [0.2, 0.3, 0.7]])
    linear = ((display + 0.055) / 1.055) ** 2.4
    seen, light = (
        vertex_colours(
            palette_of(*([(0, *rgb)] for rgb in colours.tolist()))["vertices"], (), encoding
        )
        for colours, encoding in ((display, "sRGB"), (linear, "lin_rec709_srgb"))
    )
    assert seen == light


def test_a_label_changes_half_way_between_vertices() -> None:
    chain = Chain((0, 1, 2), (0, 1), 0.0, 20.0)
    runs = runs_of(chain, [0.0, 10.0, 20.0], ["red", "red", "blue"])
    assert runs == [Run((0, 1), 0.0, 15.0), Run((2,), 15.0, 20.0)]
