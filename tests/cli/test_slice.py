"""`palette4d slice`: one frame, many, all, and clips without end."""

import json
from pathlib import Path
from typing import Any

import pytest

from palette4d.cli.main import main
from palette4d.grade import sidecar
from palette4d.grade.grade import Grade

EDITED = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"


def with_last_frame(path: Path, last: int) -> str:
    """Write a sidecar whose last frame is another."""
    document: dict[str, Any] = json.loads(EDITED.read_text(encoding="utf-8"))
    frames, polytope = document["clip"]["frames"], document["polytope"]
    old, frames["last"] = frames["last"], last
    polytope["blocks"][-1]["last"] = last
    for vertex in polytope["vertices"]:
        if vertex["frame"] == old:
            vertex["frame"] = last
    path.write_text(json.dumps(document), encoding="utf-8")
    return str(path)


def test_all_frames_are_a_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["slice", str(EDITED), "--frames", "all", "--json"]) == 0
    every = json.loads(capsys.readouterr().out)
    assert [palette["frame"] for palette in every] == list(range(21))
    assert main(["slice", str(EDITED), "--frame", "7", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == every[7]


@pytest.mark.parametrize(
    "command",
    [
        ["slice", "SIDECAR", "--frames", "all"],
        ["export", "SIDECAR", "--every", "1", "-o", "out"],
        ["config", "SIDECAR", "-o", "out"],
    ],
    ids=lambda command: command[0],
)
def test_a_clip_without_end_is_refused_before_anything_is_made(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: list[str],
) -> None:
    endless = with_last_frame(tmp_path / "endless.p4d.json", 1_000_000_000)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Grade, "palette", None)  # the first slice would fail
    assert main([endless if word == "SIDECAR" else word for word in command]) == 1
    assert "more than 1000000 frames" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_whole_numbers_may_have_a_point(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """JSON Schema and docs/sidecar.md take 0.0 for an integer."""
    text = EDITED.read_text(encoding="utf-8")
    dotted = tmp_path / "dotted.p4d.json"
    dotted.write_text(
        text.replace('"first": 0, "last": 20, "step": 1', '"first": 0.0, "last": 2e1, "step": 1.0')
        .replace('"rate": [24, 1]', '"rate": [24.0, 1.0]')
        .replace('"size": [64, 36]', '"size": [64.0, 36.0]'),
        encoding="utf-8",
    )
    found = sidecar.load(dotted)["clip"]
    assert repr(found) == repr(sidecar.load(EDITED)["clip"])
    assert main(["slice", str(dotted), "--frames", "all", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)) == 21
