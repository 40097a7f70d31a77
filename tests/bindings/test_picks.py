"""Ramps, picks, mattes and versions as Python sees them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from parity.cases import coded, hold, learned_odds, pick, picked, still_document

from palette4d import _core

PICKS = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_picks.p4d.json"
RGB = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
RED = (0.6, 0.3, 0.2)
GRID = (96, 96, 16)


def sidecar(*picks: dict[str, object], **learned: np.ndarray) -> _core.Sidecar:
    document = picked(still_document(), list(picks), learned)
    return _core.parse_sidecar(json.dumps(document), "picks")


def test_what_the_file_says_arrives() -> None:
    document = json.loads(PICKS.read_text(encoding="utf-8"))
    read = _core.read_sidecar(PICKS)
    assert (read.edits.ramp, read.edits.vertex_ramp) == ("smooth", {"v4": "hold"})
    assert [stop.get("ramp") for stop in read.edits.stops] == [
        stop.get("ramp") for stop in document["edits"]["stops"]
    ]
    assert [name for name, _ in read.versions] == ["warm Grün", "none"]
    warm = read.versions[0][1]
    assert (warm.ramp, warm.vertex_rgb) == ("hold", {"v2": (0.8, 0.3, 0.05)})
    assert not read.edits.empty
    assert not warm.empty
    assert read.versions[1][1].empty


def test_picks_alone_are_edits() -> None:
    assert not sidecar(pick("a", RED, (0.2, 0.3, 0.6))).edits.empty
    assert sidecar(hold("a", RED)).edits.empty
    assert sidecar(pick("a", RED, (0.2, 0.3, 0.6), enabled=False)).edits.empty
    assert sidecar().edits.empty


def test_a_version_outlives_its_sidecar() -> None:
    edits = _core.read_sidecar(PICKS).versions[0][1]
    assert edits.stops[0]["frame"] == 12


def test_picks_at_a_frame() -> None:
    path = [(5, RED, 1), (9, (0.5, 0.4, 0.2), 0.5)]
    read = sidecar(
        pick("a", RED, (0.2, 0.3, 0.6), matte="m", path=path), hold("h", (0.3, 0.6, 0.3)),
        m=learned_odds(4),
    )  # fmt: skip
    found = read.picks_at(7)
    ((colour, _, strength, matte),) = found.picks
    np.testing.assert_allclose(colour, (0.55, 0.35, 0.2), rtol=0, atol=1e-15)
    assert strength == 0.75
    assert matte.shape == GRID
    assert matte.dtype == np.float32
    assert matte.min() == 0
    assert matte.max() == 1
    assert found.left is not None
    assert found.left.min() == 0
    # Outside of the clip, at its ends.
    assert read.picks_at(-99).picks[0][0] == read.picks_at(7).picks[0][0]
    for bad in (read.picks_at, lambda frame: read.pick_matte_at("a", frame)):
        with pytest.raises(ValueError, match="not a number"):
            bad(float("nan"))


def test_frame_picks_keep_what_they_are_given() -> None:
    matte, left = np.random.default_rng(2).uniform(size=(2, *GRID)).astype(np.float32)
    given = [(RED, (0.1, -0.2, 0.0), 0.5, matte), ((0.1, 0.2, 0.3), (0.0, 0.0, 0.1), 1.0, left)]
    picks = _core.FramePicks(given, left=left, display=(0, 1, [0.0, 0.5, 1.0]))
    for found, wanted in zip(picks.picks, given, strict=True):
        assert (tuple(found[0]), tuple(found[1]), found[2]) == wanted[:3]
        assert found[3].tobytes() == wanted[3].tobytes()
    assert picks.left is not None
    assert picks.left.tobytes() == left.tobytes()
    assert _core.FramePicks([]).left is None


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"matte": np.zeros((96, 96, 15), np.float32)}, ValueError, r"expected \(96, 96, 16\)"),
        ({"matte": np.zeros(96 * 96 * 16, np.float32)}, ValueError, r"expected \(96, 96, 16\)"),
        ({"left": np.zeros((1, 2, 3), np.float32)}, ValueError, r"left: found the shape"),
        ({"display": (1, 1, [0.0, 1.0])}, ValueError, "from < to"),
        ({"display": (0, 1, [0.0])}, ValueError, "2 values or more"),
        ({"display": (float("nan"), 1, [0.0, 1.0])}, ValueError, "from < to"),
        ({"colour": (0.1, 0.2)}, TypeError, "incompatible"),
    ],
)
def test_bad_frame_picks_are_refused_in_words(
    change: dict[str, Any], error: type[Exception], message: str
) -> None:
    good: dict[str, Any] = {
        "colour": RED,
        "matte": np.zeros(GRID, np.float32),
        "left": None,
        "display": None,
    }
    given = {**good, **change}
    with pytest.raises(error, match=message):
        _core.FramePicks(
            [(given["colour"], (0.0, 0.0, 0.0), 1.0, given["matte"])],
            left=given["left"],
            display=given["display"],
        )


@pytest.mark.parametrize(
    ("colour", "change", "strength"),
    [
        ((0.1, float("nan"), 0.2), (0.0, 0.0, 0.1), 1.0),
        (RED, (0.0, float("inf"), 0.1), 1.0),
        (RED, (0.0, 0.0, 0.1), 0.0),
        (RED, (0.0, 0.0, 0.1), 1.01),
        (RED, (0.0, 0.0, 0.1), float("nan")),
    ],
)
def test_picks_that_are_no_picks_are_refused(
    colour: tuple[float, float, float], change: tuple[float, float, float], strength: float
) -> None:
    picks = _core.FramePicks([(colour, change, strength, np.ones(GRID, np.float32))])
    with pytest.raises(ValueError, match="not finite, without a matte, or with a strength"):
        _core.Recolourer(RGB, RGB, FACES, picks=picks)


def test_picks_alone_are_no_identity() -> None:
    some = _core.FramePicks([(RED, (0.0, 0.0, 0.1), 1.0, np.ones(GRID, np.float32))])
    assert _core.Recolourer(RGB, RGB, FACES, picks=None).identity
    assert _core.Recolourer(RGB, RGB, FACES, picks=_core.FramePicks([])).identity
    assert not _core.Recolourer(RGB, RGB, FACES, picks=some).identity
    held = _core.FramePicks([], left=np.zeros(GRID, np.float32))
    assert _core.Recolourer(RGB, RGB, FACES, picks=held).identity


def test_odd_curves_and_mattes_do_no_harm() -> None:
    """NaN and infinity in what Python gives: a picture comes back, whatever it shows."""
    for curve in (
        (float("-inf"), float("inf"), [0.0, 1.0]),
        (0.0, 1.0, [float("nan"), 1.0]),
        (0.0, 1.0, [0.0, float("inf")]),
        (-1e308, 1e308, [0.0, 1.0]),
    ):
        matte = np.full(GRID, np.nan, np.float32)
        picks = _core.FramePicks([(RED, (0.0, 0.0, 0.1), 1.0, matte)], left=matte, display=curve)
        image = np.random.default_rng(1).uniform(-1, 2, (4, 70, 3)).astype(np.float32)
        map_ = _core.Recolourer(RGB, RGB + 0.1, FACES, picks=picks)
        for precision in ("single", "double"):
            assert map_.apply(image, precision=precision).shape == image.shape


def test_a_hue_matte_and_a_learned_one_can_be_stored() -> None:
    odds = _core.hue_matte(RED)
    assert (odds.shape, odds.dtype) == (GRID, np.uint8)
    assert odds.max() <= 126
    # A file with these odds has the same mattes as one without any.
    without, with_odds = (
        sidecar(pick("a", RED, RED)),
        sidecar(pick("a", RED, RED, matte="m"), m=odds),
    )
    ((*_, first),), ((*_, second),) = without.picks_at(7).picks, with_odds.picks_at(7).picks
    assert first.tobytes() == second.tobytes()
    assert len(coded(odds)) < 1 << 17


def scene() -> np.ndarray:
    """A red square before a grey wall."""
    image = np.full((90, 160, 3), 0.4, np.float32)
    image[30:60, 40:80] = RED
    image += np.random.default_rng(3).uniform(-0.01, 0.01, image.shape).astype(np.float32)
    return image


def test_a_matte_is_learned() -> None:
    frame = scene(), RED, [([(55.0, 45.0), (60.0, 45.0)], 3.0)], [([(5.0, 5.0)], 4.0)], True
    learned = _core.learn_matte([frame], RED, holds=[(0.4, 0.4, 0.4)])
    odds = learned["odds"]
    assert (odds.shape, odds.dtype) == (GRID, np.uint8)
    assert learned["found"] is True
    read = sidecar(pick("a", RED, (0.2, 0.3, 0.6), matte="m"), m=odds)
    recolourer = _core.Recolourer(RGB, RGB, FACES, picks=read.picks_at(7))
    moved = np.abs(recolourer.apply(scene()) - scene()).max(axis=2)
    assert moved[35:55, 45:75].min() > 0.2
    assert moved[:25].max() == 0
    # Rows may have any stride.
    turned = np.ascontiguousarray(scene()[::-1])[::-1]
    again = _core.learn_matte([(turned, *frame[1:])], RED, holds=[(0.4, 0.4, 0.4)])
    assert again["odds"].tobytes() == odds.tobytes()


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        ([], "found no frame"),
        ([(np.zeros((0, 4, 3), np.float32), RED, [], [], True)], "without pixels"),
        ([(np.zeros((4, 4, 4), np.float32), RED, [], [], True)], "3 channels"),
        ([(np.zeros((4, 4, 3)), RED, [], [], True)], "float32"),
        ([(scene(), RED, [([(float("nan"), 1.0)], 2.0)], [], True)], "NaN or beyond"),
        ([(scene(), RED, [], [([(1.0, 1.0)], 1e300)], True)], "NaN or beyond"),
    ],
)
def test_frames_that_cannot_be_learned_from_are_refused(frames: list, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        _core.learn_matte(frames, RED)
