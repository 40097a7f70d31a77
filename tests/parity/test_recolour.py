"""From a sidecar to a picture: the core and the reference, every document.

What holds of any picture is in tests/core/recolour/.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from parity.cases import (
    DOCUMENTS,
    EDITED,
    FAST_TOLERANCE,
    PICTURE_TOLERANCE,
    learned_odds,
    pick,
    picked,
    picked_documents,
    picture,
    random_hull,
    same_bits,
    times_of,
)
from parity.implementations import (
    CORE,
    FAST,
    REFERENCE,
)
from parity.reference import (
    Document,
    Picked,
    Picks,
    change_of,
    hue_odds,
    on_path,
    picks_at,
    recolour,
    strength_of,
)

from palette4d import _core


@pytest.mark.parametrize(
    ("channels", "premultiplied", "strength"), [(3, False, 1.0), (4, False, 0.4), (4, True, 0.7)]
)
@pytest.mark.parametrize("name", EDITED)
def test_the_core_recolours_as_the_reference(
    name: str, channels: int, premultiplied: bool, strength: float
) -> None:
    image = picture(channels)
    for frame in times_of(name):
        arguments = image, DOCUMENTS[name], frame, strength, premultiplied
        expected, found = REFERENCE.recolour(*arguments), CORE.recolour(*arguments)
        np.testing.assert_allclose(found, expected, **PICTURE_TOLERANCE)
        fast = FAST.recolour(*arguments)
        np.testing.assert_allclose(fast, expected, **FAST_TOLERANCE)


def test_rounds_are_rare_where_the_implementations_differ() -> None:
    """Both compute in float64 and round once, so that nearly all results share all bits."""
    image = picture(3)
    result = CORE.recolour(image, DOCUMENTS["changes-stops"], 12.5)
    expected = REFERENCE.recolour(image, DOCUMENTS["changes-stops"], 12.5)
    assert same_bits(result, expected).mean() > 0.98


PICKED = sorted(picked_documents())
GRIDS = {"a": learned_odds(1)}


@pytest.mark.parametrize("name", PICKED)
def test_the_core_has_the_mattes_of_the_reference(name: str) -> None:
    document = DOCUMENTS[name]
    for frame in times_of(name):
        expected, found = picks_at(document, frame), CORE.sidecar(document).picks_at(frame)
        assert len(found.picks) == len(expected.picks)
        for wanted, (*_, matte) in zip(expected.picks, found.picks, strict=True):
            np.testing.assert_allclose(matte, wanted.matte, rtol=0, atol=1e-6)
        assert (found.left is None) == (expected.left is None)
        if found.left is not None:
            np.testing.assert_allclose(found.left, expected.left, rtol=0, atol=1e-6)


def changing_picks() -> list[Document]:
    """Picks whose changes end at 0, at 1 or at their paths, with every kind of range."""
    red, to = (0.5, 0.25, 0.25), (0.25, 0.75, 0.25)
    inside = [(0, red, 1), (10, (0.75, 0.75, 0.25), 0.5), (20, (0.125, 0.5, 0.25), 1)]
    beyond = [(0, red, 1), (5, (-1, 0.25, 0.25), 1), (10, (2, 2, 0.25), 0), (20, red, 1)]
    return [
        pick("at-1", red, to, path=inside),
        pick("at-a-path", red, to, path=beyond),
        pick("to-a-colour", red, to, toward="colour", path=inside, **{"from": 9}, fade=4),
        pick("in-and-out", red, to, until=20, fade=3, fade_out=6),
        pick("overlapping", red, to, **{"from": 12}, until=14, fade=8, fade_out=0),
    ]


@pytest.mark.parametrize("picks", [document["edits"]["picks"] for document in (
    *(DOCUMENTS[name] for name in PICKED), {"edits": {"picks": changing_picks()}},
)], ids=[*PICKED, "changing"])  # fmt: skip
def test_the_core_has_the_changes_of_the_reference(picks: list[Document]) -> None:
    document = picked(DOCUMENTS["changes"], [{**one, "matte": "a"} for one in picks], GRIDS)
    sidecar = CORE.sidecar(document)
    for frame in np.arange(-2, 33, 1.25).tolist():
        at = min(max(frame, 0.0), 30.0)
        found = [made[:3] for made in sidecar.picks_at(frame).picks]
        expected = [
            (on_path(one, at)[0], change_of(one, at), strength)
            for one in picks
            if one["kind"] == "pick" and (strength := strength_of(one, at)) > 0
        ]
        assert len(found) == len(expected)
        for values, wanted in zip(found, expected, strict=True):
            for value, own in zip(values, wanted, strict=True):
                np.testing.assert_allclose(value, own, rtol=0, atol=1e-14)


@pytest.mark.parametrize("colour", [(0.6, 0.3, 0.2), (0.5, 0.52, 0.5), (0, 0, 0), (0.1, 0.2, 1.4)])
def test_the_core_has_the_hue_mattes_of_the_reference(colour: tuple[float, float, float]) -> None:
    found, expected = _core.hue_matte(colour), hue_odds(np.array(colour, float))
    # Where a value is half a step, rounding decides.
    assert np.abs(found.astype(int) - expected).max() <= 1
    assert (found != expected).sum() <= 3


@pytest.mark.parametrize("curve", [None, (-0.5, 1.5, [0.0, 0.1, 0.5, 0.7, 1.0])])
@pytest.mark.parametrize("count", [1, 2, 5])
@pytest.mark.parametrize("held", [False, True])
def test_picks_of_any_mattes_are_as_the_reference_has_them(
    count: int, held: bool, curve: tuple[float, float, list[float]] | None
) -> None:
    rng = np.random.default_rng(count + 10 * held)
    rgb, faces = random_hull(3, 8)
    edited = rgb + rng.uniform(-0.2, 0.2, rgb.shape)

    def matte() -> NDArray[np.float32]:
        coarse = rng.uniform(-1, 1.5, (12, 12, 4)).clip(0, 1)
        return np.kron(coarse, np.ones((8, 8, 4))).astype(np.float32)

    picks = [
        Picked(rng.uniform(0, 1, 3), rng.uniform(-0.3, 0.3, 3), rng.uniform(0.1, 1), matte())
        for _ in range(count)
    ]
    left = matte() if held else None
    given = [(tuple(p.colour), tuple(p.change), p.strength, p.matte) for p in picks]
    recolourer = _core.Recolourer(
        rgb, edited, faces, picks=_core.FramePicks(given, left=left, display=curve)
    )
    image = picture(4)
    expected = recolour(image, rgb, edited, faces, 0.8, True, Picks(picks, left, curve))
    found = recolourer.apply(image, strength=0.8, premultiplied=True, precision="double")
    np.testing.assert_allclose(found, expected, **PICTURE_TOLERANCE)
    fast = recolourer.apply(image, strength=0.8, premultiplied=True, precision="single")
    np.testing.assert_allclose(fast, expected, **FAST_TOLERANCE)
