"""Shots that the edit plays at another speed: their names, sidecars and the node's settings."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import opentimelineio as otio
import pytest
from edits import clip, external, movie, save, timeline

from palette4d.cli.info import _edit_line
from palette4d.grade import sidecar
from palette4d.grade.document import Document
from palette4d.shows.analysis import analyze_shots

#: A palette that does not change: these tests are about times, not about the search.
FEW = {"method": "static", "colours": 512, "coarse_colours": 128, "allow_cuts": True}


@pytest.fixture
def media(tmp_path: Path) -> Path:
    movie(tmp_path / "media" / "A001C001.mov", 40, timecode="01:00:00:00")
    return tmp_path / "media"


def edl(tmp_path: Path, m2: str, out: str = "00:20") -> Path:
    path = tmp_path / "cut.edl"
    path.write_text(
        "TITLE: t\nFCM: NON-DROP FRAME\n\n"
        f"001  AX V C 01:00:00:10 01:00:{out} 02:00:00:00 02:00:00:10\n"
        f"M2   AX             {m2}                01:00:00:10\n"
        "* FROM CLIP NAME: A001C001.mov\n* ASC_SOP (1 1 1)(0.1 0 0)(1 1 1)\n* ASC_SAT 0.8\n"
    )
    return path


def node_frame(document: dict, k: int) -> float:
    """The frame that the node shows k host frames after the first, as docs/node.md says."""
    edit, frames = document["extra"]["edit"], document["clip"]["frames"]
    first, last = frames["first"], frames["last"]
    frame = first + k * edit["speed"] + edit["inPoint"]
    return first + last - frame if edit["reverse"] else frame


@pytest.mark.parametrize(
    ("m2", "out", "used"),
    [
        ("048.0", "00:20", (10, 28)),
        ("012.0", "00:20", (10, 14)),
        ("-024.0", "00:20", (10, 19)),
        ("-048.0", "01:06", (10, 28)),
    ],
)
def test_the_sidecar_says_how_the_edit_plays_it(
    tmp_path: Path, media: Path, m2: str, out: str, used: tuple[int, int]
) -> None:
    path = edl(tmp_path, m2, out)
    done = analyze_shots(path, tmp_path / "s", rate=Fraction(24), media=media, handles=3, **FEW)
    (entry,) = done.manifest.entries
    assert (entry.sidecar, entry.shot.used) == ("A001C001.p4d.json", used)
    document = sidecar.load(tmp_path / "s" / entry.sidecar)
    speed = float(m2) / 24
    begin = used[0] if speed > 0 else used[1]
    assert [node_frame(document, k) for k in range(10)] == [begin + k * speed for k in range(10)]
    assert document["extra"]["edit"]["cdl"]["offset"] == [0.1, 0, 0]
    line = _edit_line(document["extra"]["edit"])
    assert f"Speed {abs(speed):g}" in line
    assert ("Reverse on" in line) == (speed < 0)
    (row,) = json.loads(done.path.read_text())["shots"]
    assert (row["speed"], row["cdl"]["saturation"]) == (speed, 0.8)


def test_a_speed_that_changes_keeps_the_grade(tmp_path: Path, media: Path) -> None:
    """The same frames at another speed: the sidecar stays, but says the new speed."""
    arguments = {"rate": Fraction(24), "media": media, **FEW}
    analyze_shots(edl(tmp_path, "024.0"), tmp_path / "s", **arguments)
    target = tmp_path / "s" / "A001C001.p4d.json"
    document = Document.load(target)
    document.set(next(iter(document.grade.tracks)).vertices[0], rgb=(0.1, 0.2, 0.3))
    document.save()
    edits = sidecar.load(target)["edits"]
    assert "speed" not in sidecar.load(target)["extra"]["edit"]
    done = analyze_shots(edl(tmp_path, "-024.0"), tmp_path / "s", **arguments)
    assert done.kept == ["A001C001"]
    found = sidecar.load(target)
    assert found["extra"]["edit"]["reverse"] is True
    assert found["edits"] == edits


def test_a_timeline_that_plays_backwards(tmp_path: Path, media: Path) -> None:
    warp = otio.schema.LinearTimeWarp(time_scalar=-1)
    made = timeline(
        clip("A001C001.mov", external("media/A001C001.mov"), 86405, 8, effects=[warp]),
        clip("plain", external("media/A001C001.mov"), 86405, 8),
    )
    done = analyze_shots(save(made, tmp_path / "cut.otio"), tmp_path / "s", handles=2, **FEW)
    one, other = (sidecar.load(tmp_path / "s" / e.sidecar) for e in done.manifest.entries)
    assert one["extra"]["edit"] == {"speed": 1, "reverse": True, "inPoint": 2}
    assert node_frame(one, 0) == 12
    assert other["extra"] == {}


@pytest.mark.parametrize("edit", [None, 3, {}, {"speed": "x"}, {"speed": [], "inPoint": {}}])
def test_what_other_programs_wrote_there_is_passed_over(edit: object) -> None:
    assert _edit_line(edit) == ""
