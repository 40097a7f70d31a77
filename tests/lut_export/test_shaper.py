"""Shapers: curves and their inverses, OpenColorIO's transforms of them, the choice among them."""

from __future__ import annotations

import numpy as np
import PyOpenColorIO as ocio
import pytest
from palette4d.lut_export.shaper import UNSHAPED, Shaper, choose

from palette4d import Palette4dError

SHAPERS = [
    UNSHAPED,
    Shaper("linear", -0.1, 1.4),
    Shaper("log", 0.0, 50.0),
    Shaper("log", -0.3, 50.0),
    Shaper("log", -2.0, 65504.0),
    Shaper("log", 0.0, 1.0),
]


def ids(shaper: Shaper) -> str:
    return shaper.text()


@pytest.mark.parametrize("shaper", SHAPERS, ids=ids)
def test_inverse_is_the_inverse(shaper: Shaper) -> None:
    u = np.linspace(0, 1, 1001)
    x = shaper.inverse(u)
    assert (x[0], x[-1]) == (shaper.low, shaper.high)
    assert (np.diff(x) > 0).all()
    np.testing.assert_allclose(shaper.forward(x), u, atol=1e-12)


@pytest.mark.parametrize("shaper", SHAPERS, ids=ids)
def test_opencolorio_computes_the_same(shaper: Shaper) -> None:
    # Beyond the domain, too: what an edit moves out of it must come back.
    x = shaper.inverse(np.linspace(-0.2, 1.2, 3 * 500)).astype(np.float32)
    got = x.reshape(1, -1, 3).copy()
    group = ocio.GroupTransform(shaper.transforms())
    processor = ocio.Config.CreateRaw().getProcessor(group)
    processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS).applyRGB(got)
    np.testing.assert_allclose(got.ravel(), shaper.forward(x), atol=2e-6)


def test_log_is_smooth_at_black_and_even_in_stops() -> None:
    shaper = Shaper("log", -1.0, 64.0)
    step = 1e-6
    below = (shaper.forward(0.0) - shaper.forward(-step)) / step
    above = (shaper.forward(step) - shaper.forward(0.0)) / step
    assert below == pytest.approx(above, rel=1e-4)
    stops = np.diff(shaper.forward(2.0 ** np.arange(1, 7)))
    assert stops.max() / stops.min() < 1.1


@pytest.mark.parametrize(
    ("asked", "low", "high", "want"),
    [
        ("auto", 0.0, 1.0, UNSHAPED),
        ("auto", 0.2, 0.7, UNSHAPED),
        ("auto", 0.0, 1.09, Shaper("linear", 0.0, 1.1)),
        ("auto", -0.073, 1.0, Shaper("linear", -0.073, 1.0)),
        ("auto", -0.0731, 1.0, Shaper("linear", -0.074, 1.0)),
        ("auto", 0.0, 50.3, Shaper("log", 0.0, 51.0)),
        ("auto", -0.1, 50.0, Shaper("log", -0.1, 50.0)),
        ("none", -0.1, 50.0, UNSHAPED),
        ("linear", 0.0, 50.0, Shaper("linear", 0.0, 50.0)),
        ("log", 0.1, 0.5, Shaper("log", 0.0, 1.0)),
    ],
)
def test_choice(asked: str, low: float, high: float, want: Shaper) -> None:
    assert choose(asked, low, high) == want


@pytest.mark.parametrize("low_high", [(1.0, 1.0), (2.0, 1.0), (0.0, np.nan), (0.0, np.inf)])
def test_no_domain(low_high: tuple[float, float]) -> None:
    with pytest.raises(Palette4dError, match="the smaller one first"):
        Shaper("log", *low_high)


def test_no_shaper_no_other_domain() -> None:
    with pytest.raises(Palette4dError, match='shaper="log" or'):
        Shaper("none", 0.0, 2.0)


@pytest.mark.parametrize("shaper", SHAPERS[1:4], ids=ids)
def test_samples_are_enough(shaper: Shaper) -> None:
    x = np.linspace(shaper.low, shaper.high, shaper.samples())
    fine = np.linspace(shaper.low, shaper.high, 7 * shaper.samples() + 3)
    got = np.interp(fine, x, shaper.forward(x))
    assert np.abs(got - shaper.forward(fine)).max() <= 1e-5
