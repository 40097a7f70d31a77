"""Names of colours are those that a person would give."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import XKCD_COLORS, to_rgb

from palette4d.colour.names import HUES, named_lch

NAMES = {
    "#000000": "black",
    "#ffffff": "white",
    "#808080": "grey",
    "#404040": "dark grey",
    "#c8c8c8": "light grey",
    "#ff0000": "red",
    "#00ff00": "green",
    "#0000ff": "blue",
    "#ffff00": "yellow",
    "#ffa500": "orange",
    "#ff00ff": "magenta",
    "#00e0e0": "cyan",
    "#8000c0": "purple",
    "#8b0000": "deep red",
    "#1a2a6c": "deep blue",
    "#05001f": "black",
    "#0c001d": "black",
    "#001300": "black",
    "#add8e6": "pale blue",
    "#8b4513": "brown",
    "#808000": "olive",
    "#ffc0cb": "pale pink",
    "#5f7a5f": "greyish green",
    "#1f3020": "dark green",
    "#404561": "dark blue",  # slate
    "#6a5acd": "blue",  # slate blue
    "#000080": "deep blue",
    "#4b0082": "deep purple",
    "#bfff00": "lime",
    "#b1e008": "lime",
    "#c8861c": "orange",  # amber
    "#feb308": "orange",
    "#daa520": "yellow",  # gold
    "#008080": "teal",
    "#40e0d0": "cyan",  # turquoise
    "#f5f5dc": "pale beige",
    "#c4a882": "beige",
    "#fa8072": "pink",  # salmon
    "#ff69b4": "pink",
    "#c20078": "magenta",
    "#228b22": "green",
    "#033500": "dark green",
    "#654321": "dark brown",
    "#b57edc": "purple",  # lavender
    "#dc143c": "red",  # crimson
    "#80473e": "brown",
}


def colour_names(colours, encoding):
    return [name for _, name in named_lch(colours, encoding)]


@pytest.mark.parametrize(("code", "name"), NAMES.items())
def test_a_colour_has_the_name_that_people_give_it(code, name):
    rgb = np.array([int(code[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    assert colour_names(rgb[None], "sRGB") == [name]


def test_most_colours_of_a_survey_have_the_word_that_people_gave_them():
    """The survey of xkcd.com: 949 colours, such as "dusty rose" and "windows blue"."""
    words = {word for _, *two in HUES for word in (two[0], two[-1])} | {"beige"}
    named = [(name.split()[-1], code) for name, code in XKCD_COLORS.items()]
    asked = [(word.split(":")[-1], to_rgb(code)) for word, code in named]
    asked = [(word, rgb) for word, rgb in asked if word in words]
    found = colour_names([rgb for _, rgb in asked], "sRGB")
    right = [word == name.split()[-1] for (word, _), name in zip(asked, found, strict=True)]
    assert len(right) > 500
    assert np.mean(right) > 0.75


def test_scene_linear_colours_are_named_as_they_are_seen():
    display = np.array([[0.55, 0.02, 0.03], [0.2, 0.2, 0.2]])
    linear = np.where(display > 0.04045, ((display + 0.055) / 1.055) ** 2.4, display / 12.92)
    assert colour_names(linear, "lin_rec709_srgb") == colour_names(display, "sRGB")


def test_any_number_has_a_name():
    generator = np.random.default_rng(1)
    colours = generator.uniform(-0.5, 2, (500, 3))
    assert all(colour_names(colours, "unknown"))
