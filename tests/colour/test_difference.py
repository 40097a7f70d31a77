"""CIEDE2000 against the published pairs, L*a*b* against published colours, encodings by name."""

from __future__ import annotations

import numpy as np
import pytest

from palette4d.colour.difference import (
    delta_e_2000,
    same_encodings,
    viewing_of,
)

# Sharma, Wu and Dalal 2005, table 1: L a b of one colour, L a b of the other, their difference.
PAIRS = """
50 2.6772 -79.7751  50 0 -82.7485  2.0425
50 3.1571 -77.2803  50 0 -82.7485  2.8615
50 2.8361 -74.0200  50 0 -82.7485  3.4412
50 -1.3802 -84.2814  50 0 -82.7485  1.0000
50 -1.1848 -84.8006  50 0 -82.7485  1.0000
50 -0.9009 -85.5211  50 0 -82.7485  1.0000
50 0 0  50 -1 2  2.3669
50 -1 2  50 0 0  2.3669
50 2.4900 -0.0010  50 -2.4900 0.0009  7.1792
50 2.4900 -0.0010  50 -2.4900 0.0010  7.1792
50 2.4900 -0.0010  50 -2.4900 0.0011  7.2195
50 2.4900 -0.0010  50 -2.4900 0.0012  7.2195
50 -0.0010 2.4900  50 0.0009 -2.4900  4.8045
50 -0.0010 2.4900  50 0.0010 -2.4900  4.8045
50 -0.0010 2.4900  50 0.0011 -2.4900  4.7461
50 2.5 0  50 0 -2.5  4.3065
50 2.5 0  73 25 -18  27.1492
50 2.5 0  61 -5 29  22.8977
50 2.5 0  56 -27 -3  31.9030
50 2.5 0  58 24 15  19.4535
50 2.5 0  50 3.1736 0.5854  1.0000
50 2.5 0  50 3.2972 0  1.0000
50 2.5 0  50 1.8634 0.5757  1.0000
50 2.5 0  50 3.2592 0.3350  1.0000
60.2574 -34.0099 36.2677  60.4626 -34.1751 39.4387  1.2644
63.0109 -31.0961 -5.8663  62.8187 -29.7946 -4.0864  1.2630
61.2901 3.7196 -5.3901  61.4292 2.2480 -4.9620  1.8731
35.0831 -44.1164 3.7933  35.0232 -40.0716 1.5901  1.8645
22.7233 20.0904 -46.6940  23.0331 14.9730 -42.5619  2.0373
36.4612 47.8580 18.3852  36.2715 50.5065 21.2231  1.4146
90.8027 -2.0831 1.4410  91.1528 -1.6435 0.0447  1.4441
90.9257 -0.5406 -0.9208  88.6381 -0.8985 -0.7239  1.5381
6.7747 -0.2908 -2.4247  5.8714 -0.0985 -2.2286  0.6377
2.0776 0.0795 -1.1350  0.9033 -0.0636 -0.5514  0.9082
"""


@pytest.fixture(scope="module")
def pairs() -> np.ndarray:
    table = np.array([[float(v) for v in line.split()] for line in PAIRS.strip().splitlines()])
    assert table.shape == (34, 7)
    return table


def test_published_pairs(pairs: np.ndarray) -> None:
    got = delta_e_2000(pairs[:, :3], pairs[:, 3:6])
    np.testing.assert_allclose(got, pairs[:, 6], atol=5e-5, rtol=0)


def test_the_other_way_round(pairs: np.ndarray) -> None:
    got = delta_e_2000(pairs[:, 3:6], pairs[:, :3])
    np.testing.assert_allclose(got, pairs[:, 6], atol=5e-5, rtol=0)


def test_a_colour_does_not_differ_from_itself() -> None:
    lab = np.random.default_rng(3).uniform([0, -128, -128], [100, 128, 128], (1000, 3))
    assert not delta_e_2000(lab, lab).any()


@pytest.mark.parametrize(
    ("rgb", "lab"),
    [
        ((1, 1, 1), (100, 0, 0)),
        ((0, 0, 0), (0, 0, 0)),
        # Of sRGB's primaries, as published in many tables.
        ((1, 0, 0), (53.241, 80.092, 67.203)),
        ((0, 1, 0), (87.735, -86.183, 83.179)),
        ((0, 0, 1), (32.297, 79.188, -107.860)),
    ],
)
def test_lab_of_srgb(rgb: tuple[float, ...], lab: tuple[float, ...]) -> None:
    got = viewing_of("sRGB").lab(np.array([rgb], dtype=np.float64))[0]
    np.testing.assert_allclose(got, lab, atol=0.02)


@pytest.mark.parametrize(
    ("encoding", "word"),
    [
        ("sRGB", "sRGB (IEC"),
        ("srgb_rec709_scene", "sRGB (IEC"),
        ("Rec.709", "2.4"),
        ("lin_ap1", "ACEScg"),
        ("ACEScct", "ACEScct"),
        ("", "unknown, taken as sRGB"),
        ("unknown", "unknown, taken as sRGB"),
        ("my camera", "'my camera' unknown, taken as sRGB"),
    ],
)
def test_the_assumption_is_stated(encoding: str, word: str) -> None:
    assert word in viewing_of(encoding).assumption


def test_linear_light_is_not_taken_as_srgb() -> None:
    grey = np.full((1, 3), 0.18)
    assert viewing_of("lin_rec709").lab(grey)[0, 0] == pytest.approx(49.5, abs=0.1)
    assert viewing_of("sRGB").lab(grey)[0, 0] < 20
    # ACEScg's white is not D65's, but greys stay grey: the config adapts.
    np.testing.assert_allclose(viewing_of("ACEScg").lab(grey)[0, 1:], 0, atol=0.05)


def test_displays_show_nothing_beyond_their_range() -> None:
    beyond, shown = np.array([[1.3, -0.2, 0.5]]), np.array([[1.0, 0.0, 0.5]])
    for encoding in ("sRGB", "Rec.709", "unknown"):
        lab = viewing_of(encoding).lab
        assert delta_e_2000(lab(beyond), lab(shown))[0] < 0.01
    lab = viewing_of("ACEScg").lab
    assert delta_e_2000(lab(beyond), lab(shown))[0] > 1


def test_negative_and_bright_light_is_finite() -> None:
    light = np.array([[-0.5, 0.2, 60.0], [50.0, 50.0, 50.0]])
    lab = viewing_of("lin_rec709").lab(light)
    assert np.isfinite(lab).all()
    assert np.isfinite(delta_e_2000(lab, lab + 1)).all()


def test_names_of_one_encoding() -> None:
    assert "srgb_tx" in same_encodings("SRGB")
    assert same_encodings("Sony something") == ["Sony something"]
