"""True colours: each view as OpenColorIO has it, and its LUT near to it."""

from __future__ import annotations

import numpy as np
import pytest

from palette4d.colour.ocio_config import BUILT_IN, load_config
from palette4d.studio.display import LOW, Display, Look

CODES = np.random.default_rng(3).uniform(-0.1, 1.2, (70, 40, 3)).astype(np.float32)


@pytest.fixture(autouse=True)
def without_a_config(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OCIO", raising=False)


def by_ocio(space: str, look: Look) -> np.ndarray:
    import PyOpenColorIO as ocio

    steps = ocio.DisplayViewTransform(src=space, display=look.display, view=look.view)
    done = CODES.copy()
    load_config(BUILT_IN, "test").getProcessor(steps).getDefaultCPUProcessor().applyRGB(done)
    return np.clip(done, 0, 1) * 255


@pytest.mark.parametrize(("space", "display_referred"), [("sRGB", True), ("ACEScg", False)])
def test_a_view_is_the_configs(space: str, display_referred: bool) -> None:
    display = Display(space)
    assert display.display_referred == display_referred
    look = display.chosen(Look())
    shown = display.painter(look).paint(CODES)
    assert shown[..., 3].min() == 255
    source = {"sRGB": "sRGB - Texture"}.get(space, space)
    assert np.abs(shown[..., :3] - by_ocio(source, look)).max() < 1
    if display_referred:  # its own code values
        near = np.abs(shown[..., :3] - np.clip(CODES, 0, 1) * 255)
        assert near.max() < 1


def test_a_slow_view_has_a_lut_whose_error_is_known() -> None:
    display = Display("ACEScg")
    slow = next(view for view in display.views(display.displays()[0]) if "SDR" in view)
    painter = display.painter(Look(display.displays()[0], slow))
    assert 0 < painter.error < 0.5
    quick, exact = painter.paint(CODES, exact=False), painter.paint(CODES)
    assert not np.array_equal(quick, exact)
    seen = np.abs(quick.astype(float) - exact)[CODES.min(axis=2) > LOW].max()
    assert seen <= 255 * painter.error + 1
    plain = display.painter(display.chosen(Look(view="Raw")))
    assert plain.error == 0
    assert np.array_equal(plain.paint(CODES, exact=False), plain.paint(CODES))


def test_exposure_and_gamma() -> None:
    display = Display("unknown")
    assert (display.known, display.displays(), display.views("")) == (False, [], [])
    half = display.painter(Look(exposure=-1.0)).paint(CODES)[..., :3]
    assert np.abs(half - np.clip(CODES / 2, 0, 1) * 255).max() <= 0.51
    bright = display.painter(Look(gamma=2.0)).paint(CODES)[..., :3]
    assert np.abs(bright - np.sqrt(np.clip(CODES, 0, 1)) * 255).max() <= 0.6


def test_an_unknown_view_is_the_default_one_and_a_config_that_is_missing_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    display = Display("ACEScg")
    assert display.chosen(Look("no such display", "no such view")) == display.chosen(Look())
    assert display.scene_linear
    monkeypatch.setenv("OCIO", "/no/such/config.ocio")
    display = Display("ACEScg")
    assert "/no/such/config.ocio" in display.problem
    assert display.known
