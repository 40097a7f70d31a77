"""Ramps, solutions, bumps and versions as Python sees them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from palette4d import _core

PICKS = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_picks.p4d.json"
RGB = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)


def test_what_the_file_says_arrives() -> None:
    document = json.loads(PICKS.read_text(encoding="utf-8"))
    read = _core.read_sidecar(PICKS)
    assert (read.edits.ramp, read.edits.vertex_ramp) == ("smooth", {"v4": "hold"})
    assert [stop.get("ramp") for stop in read.edits.stops] == [
        stop.get("ramp") for stop in document["edits"]["stops"]
    ]
    assert json.loads(json.dumps(read.edits.solution)) == document["edits"]["solution"]
    assert [name for name, _ in read.versions] == ["warm Grün", "none"]
    warm = read.versions[0][1]
    assert (warm.ramp, warm.vertex_rgb) == ("hold", {"v2": (0.8, 0.3, 0.05)})
    assert not read.edits.empty
    assert not warm.empty
    assert read.versions[1][1].empty


def test_a_version_outlives_its_sidecar() -> None:
    edits = _core.read_sidecar(PICKS).versions[0][1]
    assert edits.stops[0]["frame"] == 12


def test_bumps_at_a_frame() -> None:
    read = _core.read_sidecar(PICKS)
    moving = [0.405, 0.3, 0.25, 0.125, 0.05, -0.025, -0.025, 0, 0, 0, 0]
    still = [0.5, 0.35, 0.2, 0.3, -0.03, 0.08, 0.04, 0, 0, 0, 0]
    np.testing.assert_allclose(read.bumps_at(1), [moving, still], rtol=0, atol=1e-15)
    assert read.bumps_at(0).tolist() == [still]  # what does not move is left out
    assert read.bumps_at(-99).tolist() == read.bumps_at(0).tolist()
    assert read.bumps_at(1e9).tolist() == read.edits.bumps_at(20).tolist() == [still]
    assert read.versions[1][1].bumps_at(3).shape == (0, 11)
    for bad in (read.bumps_at, read.edits.bumps_at):
        with pytest.raises(ValueError, match="not a number"):
            bad(float("nan"))


@pytest.mark.parametrize(
    ("bumps", "message"),
    [
        ([[0, 0, 0, 1]], r"expected \(n, 11\)"),
        (np.zeros(11), r"expected \(n, 11\)"),
        ([[0, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0]], "no radius"),
        ([[0, 0, np.nan, 1, 1, 1, 1, 0, 0, 0, 0]], "not finite"),
        ([[0, 0, 0, 1, 1, 1, 1, 2, 0, 0, 0]], "expected 0 to 1"),
        ([[0, 0, 0, 1, 1, 1, 1, 0, 0.6, 0.8, 0]], "shorter `along`"),
        ([["a"] * 11], "real numbers"),
    ],
)
def test_bad_bumps_are_refused_in_words(bumps: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        _core.Recolourer(RGB, RGB, FACES, bumps=bumps)


def test_bumps_alone_are_no_identity() -> None:
    assert _core.Recolourer(RGB, RGB, FACES, bumps=None).identity
    assert _core.Recolourer(RGB, RGB, FACES, bumps=np.zeros((0, 11))).identity
    assert not _core.Recolourer(RGB, RGB, FACES, bumps=[[0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0]]).identity
