"""One .ccc for a show, and an EDL with CDLs, read back by OpenTimelineIO and by an XML reader."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from fractions import Fraction
from pathlib import Path

import opentimelineio as otio
import pytest
from edits import clip, external, movie, save, timeline

from palette4d.cli import main
from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document
from palette4d.shows import timeline_clips
from palette4d.shows.analysis import analyze_shots
from palette4d.shows.exports import export

QUICK = {"method": "static", "colours": 512, "coarse_colours": 128}
EDL = """TITLE: Schön
FCM: NON-DROP FRAME

001  AX       V     C        00:00:00:02 00:00:00:08 01:00:00:00 01:00:00:06
* FROM CLIP NAME: one.mov
* ASC_SOP (1 1 1)(0.5 0 0)(1 1 1)
* ASC_SAT 0.5
* COMMENT: stays

002  AX       V     C        00:00:00:00 00:00:00:06 01:00:00:12 01:00:00:18
* FROM CLIP NAME: two.mov
"""


@pytest.fixture
def show(tmp_path: Path) -> Path:
    """An analysed EDL of two shots, in Latin-1; the first is graded."""
    for name in ("one", "two"):
        movie(tmp_path / "media" / f"{name}.mov", 12)
    (tmp_path / "cut.edl").write_bytes(EDL.encode("latin-1"))
    done = analyze_shots(
        tmp_path / "cut.edl", tmp_path / "s", rate=Fraction(24), media=tmp_path / "media", **QUICK
    )
    document = Document.load(tmp_path / "s" / "one.p4d.json")
    document.set(document.grade.tracks[0].vertices[0], rgb=(0.4, 0.2, 0.1))
    document.save()
    return done.path


@pytest.fixture(autouse=True)
def small_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure errors on 13^3 colours instead of 67^3 in this process."""
    monkeypatch.setattr("palette4d.lut_export.lut3d.DENSE", 13)


def numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def test_a_collection_and_an_edl(
    show: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ccc = tmp_path / "cdls" / "show.ccc"  # in a folder that the export makes
    words = ("--every", 2, "--format", "ccc", "--ccc", ccc, "--edl", tmp_path / "o.edl")
    words = ("export", show, "-o", tmp_path / "cdls", *words, "--jobs", 1, "--quiet")
    assert main.main(list(map(str, words))) == 0
    # The CDL that the edit has of a shot is replaced, and that is said.
    assert re.search(r"1 event has a CDL.*: one$", capsys.readouterr().err, re.MULTILINE)
    corrections = {}
    for node in ElementTree.parse(tmp_path / "cdls" / "show.ccc").iter():
        if node.tag.endswith("}ColorCorrection"):
            corrections[node.get("id")] = [
                numbers(part.text)
                for part in node.iter()
                if part.tag.rpartition("}")[2] in ("Slope", "Offset", "Power", "Saturation")
            ]
    assert list(corrections) == ["one", "two"]
    assert corrections["two"] == [[1, 1, 1], [0, 0, 0], [1, 1, 1], [1]]
    assert corrections["one"] != corrections["two"]
    text = (tmp_path / "o.edl").read_bytes().decode("cp1252")
    assert "TITLE: Schön" in text
    assert "* COMMENT: stays" in text
    assert text.count("ASC_SOP") == text.count("ASC_SAT") == 2
    read = otio.adapters.read_from_string(text, "cmx_3600", rate=24)
    for found in read.find_clips():
        sop = found.metadata["cdl"]["asc_sop"]
        slope, offset, power, saturation = corrections[found.name.removesuffix(".mov")]
        assert list(sop["slope"]) == pytest.approx(slope, abs=1e-6)
        assert list(sop["offset"]) == pytest.approx(offset, abs=1e-6)
        assert list(sop["power"]) == pytest.approx(power, abs=1e-6)
        assert [found.metadata["cdl"]["asc_sat"]] == pytest.approx(saturation, abs=1e-6)
    # The file of the edit stays as it is.
    assert (tmp_path / "cut.edl").read_bytes() == EDL.encode("latin-1")


def test_what_is_refused_before_anything_is_baked(show: Path, tmp_path: Path) -> None:
    sidecar = show.parent / "one.p4d.json"
    for source, format_name, arguments, words in (
        (show, "clf", {"ccc": tmp_path / "x.ccc"}, "expected a CDL"),
        (show, "ccc", {"ccc": tmp_path / "x.cdl"}, r"expected the name of an \.ccc file"),
        (sidecar, "ccc", {"ccc": tmp_path / "x.ccc"}, "needs the manifest of a show"),
        (sidecar, "ccc", {"edl": tmp_path / "x.edl"}, "needs the manifest of a show"),
        (show, "ccc", {"edl": tmp_path / "cut.edl"}, "found a file there"),
    ):
        with pytest.raises(Palette4dError, match=words):
            export(source, tmp_path / "cdls", every=1, format=format_name, **arguments)
    made = timeline(clip("one", external(str(tmp_path / "media" / "one.mov")), 2, 6))
    other = analyze_shots(save(made, tmp_path / "cut.otio"), tmp_path / "t", **QUICK).path
    with pytest.raises(Palette4dError, match=r"edl=… expects those of an EDL"):
        export(other, tmp_path / "cdls", every=1, format="ccc", edl=tmp_path / "x.edl")
    assert not (tmp_path / "cdls").exists()


@pytest.mark.parametrize("kind", ["edl", "otio"])
def test_an_edit_that_changes_meanwhile(show: Path, tmp_path: Path, kind: str) -> None:
    def cut(*_: int) -> None:
        text = EDL.replace("one.mov", "1.mov").replace("two.mov", "one.mov")
        (tmp_path / "cut.edl").write_bytes(text.replace("1.mov", "two.mov").encode("latin-1"))

    target = tmp_path / f"o.{kind}"
    with pytest.raises(Palette4dError, match="was changed since its shots were analysed"):
        export(
            show, tmp_path / "cdls", every=2, format="ccc", jobs=1, progress=cut, **{kind: target}
        )
    assert not target.exists()


def test_an_edit_that_changes_while_it_is_read(
    show: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = timeline_clips.read

    def slow(path: Path, *rest: object) -> object:
        found = read(path, *rest)
        path.write_bytes(path.read_bytes() + b"\n")
        return found

    monkeypatch.setattr(timeline_clips, "read", slow)
    with pytest.raises(Palette4dError, match="was changed while it was read"):
        analyze_shots(tmp_path / "cut.edl", tmp_path / "t", rate=Fraction(24), **QUICK)
    assert not (tmp_path / "t").exists()
