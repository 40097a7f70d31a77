"""What a frame shows: mattes as arrays, and values that are refused.

`tests/host/test_parity_node.py` compares every output with the node, bit by bit.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document
from palette4d.grade.output import LIGHTNESS_OF

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
EDITED, PICKS = GOLDEN / "v1_edited.p4d.json", GOLDEN / "v2_picks.p4d.json"


@pytest.fixture
def document() -> Document:
    return Document.load(EDITED)


@pytest.fixture
def image() -> np.ndarray:
    return np.random.default_rng(4).uniform(-0.2, 1.2, (40, 50, 3)).astype(np.float32)


def test_the_weights_of_a_frames_colours_sum_to_one(document, image):
    frame = document.grade.frames[0]
    mattes = [
        document.matte(image, frame, f"weight:{id_}") for id_ in document.grade.palette(frame).ids
    ]
    assert mattes[0].shape == (40, 50)
    assert mattes[0].dtype == np.float32
    np.testing.assert_allclose(np.sum(mattes, axis=0), 1, atol=1e-3)
    weights = document.weights(image, frame)
    for index, matte in enumerate(mattes):
        np.testing.assert_allclose(matte, weights[..., index], atol=3e-4)


@pytest.mark.parametrize(("space", "lightness"), [("input", "rec709"), ("palette", "ap1")])
def test_the_lightness_is_that_of_the_images_own_space(image, space, lightness):
    """The clip is linear Rec. 709, its palette ACEScct."""
    document = Document.load(GOLDEN / "v1_scene_linear.p4d.json")
    document.adjust(by=(0.2, -0.1, 0.05))
    kept = {
        how: document.recolour(image, 0, keep_lightness=1, lightness_of=how, space=space)
        for how in LIGHTNESS_OF
    }
    assert kept["auto"].tobytes() == kept[lightness].tobytes()
    assert len({picture.tobytes() for picture in kept.values()}) == len(LIGHTNESS_OF) - 1


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"show": "weight"}, "weight:ID"),
        ({"show": "weight:"}, "weight:ID"),
        ({"show": "outside:v1"}, "outside"),
        ({"show": "weight:nothing"}, "nothing"),
        ({"show": "pick"}, "pick:ID"),
        ({"show": "pick:"}, "pick:ID"),
        ({"show": "pick:p1"}, "there is no pick or hold 'p1'; there are none"),
        ({"clean_up": 1.1}, "clean up 1.1, expected 0 to 1"),
        ({"keep_lightness": 1.5}, "0 to 1"),
        ({"mix": float("nan")}, "0 to 1"),
        ({"strength": -0.1}, "0 to 1"),
        ({"lightness_of": "xyz"}, "rec709"),
        ({"matte_in": "red"}, "alpha"),
        ({"outside_at": 0}, "0.0001"),
        ({"space": "lab"}, "input"),
    ],
)
def test_other_values_are_refused(document, image, given, said):
    with pytest.raises(Palette4dError, match=said):
        document.recolour(image, 3, **given)


@pytest.fixture
def picked() -> Document:
    return Document.load(PICKS)


@pytest.fixture
def pair(picked) -> np.ndarray:
    """The colour of pick p1, left, and another one, right, both with noise."""
    noise = np.random.default_rng(2).normal(0, 0.01, (40, 80, 3))
    image = np.broadcast_to(picked.grade.picks[0].rgb, (40, 80, 3)) + noise
    image[:, 40:] = (0.7, 0.15, 0.1) + noise[:, 40:]
    return image.astype(np.float32)


def test_the_matte_of_a_pick_is_1_at_its_colour(picked, pair):
    matte = picked.matte(pair, 2, "pick:p1")
    assert matte.shape == (40, 80)
    assert matte[:, :36].mean() == pytest.approx(1, abs=0.05)
    assert matte[:, 64:].max() == 0
    held = picked.matte(pair, 2, "pick:p3")
    assert held[:, 44:].mean() == pytest.approx(1, abs=0.05)
    # A pick that is off takes nothing.
    assert picked.matte(pair, 2, "pick:p2").max() == 0


def test_cleaning_up_follows_the_picture_and_leaves_far_colours_alone(picked, pair):
    plain, cleaned = (picked.recolour(pair, 2, clean_up=amount) - pair for amount in (0, 1))
    assert np.abs(plain[:, :40]).max() > 0.1
    assert 0 < cleaned[:, 5:35].std((0, 1)).max() < plain[:, 5:35].std((0, 1)).max()
    middle = np.s_[:, 5:35]
    np.testing.assert_allclose(cleaned[middle].mean((0, 1)), plain[middle].mean((0, 1)), atol=5e-3)
    assert not cleaned[:, 64:].any()
    half = picked.recolour(pair, 2, clean_up=0.5) - pair
    np.testing.assert_allclose(half, (plain + cleaned) / 2, atol=1e-6)


def test_an_unknown_pick_is_told_with_those_there_are(picked, pair):
    with pytest.raises(Palette4dError, match=r"no pick or hold 'p9'; expected p1 or p2 or p3"):
        picked.matte(pair, 2, "pick:p9")
    with pytest.raises(Palette4dError, match=r"'pick:p1'"):
        picked.matte(pair, 2, "weight:p1")


@pytest.mark.parametrize("show", ["palette", "recoloured"])
def test_a_picture_is_no_matte(document, image, show):
    with pytest.raises(Palette4dError, match="weight:ID"):
        document.matte(image, 3, show)
