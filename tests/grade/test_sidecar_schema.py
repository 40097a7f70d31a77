"""The JSON Schema, the page docs/sidecar.md and the reader say the same."""

import importlib.resources
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import jsonschema
import pytest

from palette4d import SidecarError, _core
from palette4d.grade import sidecar

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "tests" / "golden" / "sidecars").glob("v*_*.p4d.json"))
SCHEMA: dict[str, Any] = json.loads(
    (ROOT / "src/palette4d/sidecar_v2.schema.json").read_text(encoding="utf-8")
)


def test_the_page_shows_the_schema(tool: ModuleType) -> None:
    page = tool.PAGE.read_text(encoding="utf-8")
    assert tool.written(page, SCHEMA) == page, (
        "docs/sidecar.md is not up to date; run: python docs/sidecar_fields.py"
    )


def test_every_member_is_explained(tool: ModuleType) -> None:
    rows = tool.fields(SCHEMA)
    assert len(rows) > 40
    assert all(kind and text for _, kind, _, text in rows)


def test_the_table_notices_a_change(tool: ModuleType) -> None:
    changed = json.loads(json.dumps(SCHEMA))
    changed["$defs"]["clip"]["properties"]["colour"] = {"type": "string", "description": "new"}
    page = tool.PAGE.read_text(encoding="utf-8")
    assert tool.written(page, changed) != page


def test_the_package_carries_the_schema() -> None:
    installed = importlib.resources.files("palette4d") / "sidecar_v2.schema.json"
    assert json.loads(installed.read_text(encoding="utf-8")) == SCHEMA


def test_the_schema_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_golden_files_fit_the_schema(path: Path) -> None:
    found = sidecar.load(path)  # brought up to date
    jsonschema.Draft202012Validator(SCHEMA).validate(found)


GONE = object()


def _members(value: Any, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    # Of a list the first element stands for all.
    items = value.items() if isinstance(value, dict) else list(enumerate(value))[:1]
    found: list[tuple[str | int, ...]] = []
    for key, item in items:
        if (*path, key) == ("extra",):
            continue
        found.append((*path, key))
        if isinstance(item, dict | list):
            found += _members(item, (*path, key))
    return found


@pytest.mark.parametrize("name", ["v1_edited", "v2_picks"])
def test_what_the_schema_refuses_the_reader_refuses(name: str) -> None:
    """Each kind of value replaced or removed in turn: what the reader takes fits the schema."""
    validator = jsonschema.Draft202012Validator(SCHEMA)
    path = ROOT / "tests" / "golden" / "sidecars" / f"{name}.p4d.json"
    text = path.read_text(encoding="utf-8")
    refused = taken = 0
    places = _members(json.loads(text))
    if name == "v2_picks":
        places = [place for place in places if place[0] in ("edits", "mattes")]
    for place in places:
        wrong: list[Any] = [
            None,
            True,
            "",
            "é",
            -1,
            0,
            0.5,
            1e7,
            1e10,
            [],
            {},
            [[]],
            ["v1"],
            {"a": 1},
        ]
        wrong += [[0, 0], [1, 1, 1, 1], "a b", "a" * 101, "a" * 140_000, [0.5, 0.5, 2], GONE]
        for value in wrong:
            document = json.loads(text)
            holder = document
            for step in place[:-1]:
                holder = holder[step]
            if value is GONE:
                del holder[place[-1]]
            else:
                holder[place[-1]] = value
            try:
                _core.parse_sidecar(json.dumps(document))
            except SidecarError:
                refused += 1
                continue
            taken += 1
            assert validator.is_valid(document), (place, value)
    assert refused > 300
    assert taken > 30
