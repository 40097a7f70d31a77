"""The bar below the picture."""

from __future__ import annotations

from palette4d.studio.window import Window


def test_the_window_fits_a_screen_of_1920_pixels_at_200_percent(window: Window) -> None:
    bar = window.transport
    window.resize(960, 600)
    assert window.width() == 960
    assert not bar.exposure.isVisible()
    assert bar.look.isVisible()
    assert bar.look.geometry().right() < bar.width()
    window.resize(1800, 900)
    assert bar.exposure.isVisible()
    assert all(button.isVisible() for button in bar.compare.values())
