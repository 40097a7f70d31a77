"""The bar below the picture."""

from __future__ import annotations

from palette4d.studio.window import Window


def test_the_window_fits_a_screen_of_1920_pixels_at_200_percent(window: Window) -> None:
    bar = window.transport
    window.docks["shots"].show()
    window.file_facts.setText("a_long_name_of_a_shot_of_a_show_v017.p4d.json  ·  not saved yet")
    window.view_facts.setText("unknown encoding: code values as they are")
    window.resize(940, 490)
    window.arrange()
    assert (window.width(), window.height()) == (940, 490)
    always = [bar.buttons["play"], *bar.compare.values(), bar.look, bar.exposure, bar.gamma]
    for widget in always:
        assert widget.isVisible()
        assert widget.geometry().right() < bar.width()
    window.docks["shots"].hide()
    window.resize(1800, 900)
    assert all(widget.isVisible() for widget in [*bar.buttons.values(), *always])
    assert bar.look.y() == bar.compare["after"].y()
