"""Manifests: written and read back, the schema, the page; what is no manifest."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import jsonschema
import pytest

from palette4d.common.errors import Palette4dError
from palette4d.shows import manifest as manifests
from palette4d.shows.manifest import DONE, FAILED, Entry, Manifest
from palette4d.shows.shots import Place, Shot

ROOT = Path(__file__).resolve().parents[2]
SCHEMA: dict[str, Any] = json.loads(
    (ROOT / "src/palette4d/shots_v1.schema.json").read_text(encoding="utf-8")
)


def show() -> Manifest:
    """A show with a shot of each kind."""
    place = Place("V1", "01:00:00:00", (0, 2, 1))
    entries = (
        Entry(Shot("a", "m/é.mov", 0, 19, (4, 15), place=place), DONE, (0, 17)),
        Entry(Shot("b", "", 0, 0, (0, 0), place=place), FAILED, error='no "b"'),
        Entry(Shot("c_f-5", "c.####.exr", -5, 5, (-5, 5), 2)),
    )
    return Manifest("../edit.otio", "0" * 64, Fraction(24000, 1001), {"method": "skew"}, entries)


def text_of(path: Path, change: Any = None) -> str:
    manifests.write(show(), path)
    document = json.loads(path.read_text("utf-8"))
    if change:
        change(document)
    return json.dumps(document)


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    path = manifests.path_of(tmp_path, "edit")
    assert path.name == "edit.shots.json"
    assert manifests.is_manifest(path)
    assert not manifests.is_manifest(tmp_path / "edit.p4d.json")
    manifests.write(show(), path)
    assert manifests.read(path) == show()
    jsonschema.Draft202012Validator(SCHEMA).validate(json.loads(path.read_text("utf-8")))
    before = path.read_bytes()
    manifests.write(manifests.read(path), path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_reason_with_nul_is_read_as_it_is_written(tmp_path: Path) -> None:
    path, copy = tmp_path / "x.shots.json", tmp_path / "y.shots.json"
    path.write_text(text_of(path, lambda d: d["shots"][1].update(error="no\0 b")), "utf-8")
    found = manifests.read(path)
    manifests.write(found, copy)
    assert manifests.read(copy) == found


def test_the_sidecars_of_shots_that_are_done(tmp_path: Path) -> None:
    path = tmp_path / "x.shots.json"
    manifests.write(show(), path)
    with pytest.raises(Palette4dError, match=r"no sidecar a\.p4d\.json beside it.*analyze` again"):
        manifests.sidecars(path)
    (tmp_path / "a.p4d.json").touch()
    assert manifests.sidecars(path) == ([tmp_path / "a.p4d.json"], ["b", "c_f-5"])


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.pop("shots"),
        lambda d: d.update(rate=[24, 0]),
        lambda d: d.update(rate=24),
        lambda d: d.update(rate=["1e9999999"]),  # a fraction of ten million digits
        lambda d: d.update(rate=[-24, 1]),
        lambda d: d["shots"][0].update(used=[0, 1e308]),
        lambda d: d["shots"][0].update(asked=[0, 10**300]),
        lambda d: d["shots"][0].update(clip=["m.mov"]),
        lambda d: d["shots"][0].update(status="ready"),
        lambda d: d["shots"][0].pop("frames"),
        lambda d: d["shots"][0].update(frames=None),
        lambda d: d["shots"][0].update(step=0),
        lambda d: d["shots"][0].update(name="a\0", sidecar="a\0.p4d.json"),
        lambda d: d.update(source="edit.otio"),
        lambda d: d.update(options="none"),
        lambda d: d["shots"][0].update(sidecar="../../a.p4d.json"),
        lambda d: d["shots"][0].update(name="../a", sidecar="../a.p4d.json"),
        lambda d: d["shots"][0].update(asked=[1]),
        lambda d: d["shots"][0].update(edit={"track": 1}),
        lambda d: d.update(shots=[3]),
    ],
)
def test_a_broken_one_is_refused(change: Any, tmp_path: Path) -> None:
    path = tmp_path / "x.shots.json"
    path.write_text(text_of(tmp_path / "y.shots.json", change), "utf-8")
    with pytest.raises(Palette4dError, match=r"the manifest is broken .* move it away"):
        manifests.read(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "cannot be read"),
        pytest.param("[" * 100_000, "cannot be read", id="deep"),
        ("\ud800".encode("utf-8", "surrogatepass"), "cannot be read"),
        ("[]", "found the schema None"),
        ('{"schema": "palette4d.series"}', "found the schema 'palette4d.series'"),
        ('{"schema": "palette4d.shots", "version": 7}', "found a manifest of version 7"),
    ],
)
def test_another_file_is_refused(text: str | bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / "x.shots.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(Palette4dError, match=words):
        manifests.read(path)
    with pytest.raises(Palette4dError, match="no such manifest"):
        manifests.read(tmp_path / "y.shots.json")


def test_the_page_shows_the_schema(tool: ModuleType) -> None:
    page = (ROOT / "docs" / "files.md").read_text(encoding="utf-8")
    assert tool.written(page, SCHEMA) == page, (
        "docs/files.md is not up to date; run: python docs/sidecar_fields.py"
    )
    rows = tool.fields(SCHEMA)
    assert all(kind and text for _, kind, _, text in rows)
