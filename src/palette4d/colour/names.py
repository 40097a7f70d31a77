"""Names of colours for people: a hue with a modifier, such as "deep red" or "pale blue".

The list is fixed and short, in the manner of level 2 of the ISCC-NBS names (Kelly and Judd 1955),
by the colour's place in OKLCh.
"""

import bisect

import numpy as np
from numpy.typing import ArrayLike

from palette4d.colour.oklch import Lch

#: Each hue ends at this angle of OKLCh.
HUES = (
    (12, "pink"),
    (42, "red"),
    (83, "orange"),
    (118, "yellow"),
    (160, "green"),
    (215, "cyan"),
    (275, "blue"),
    (318, "purple"),
    (352, "magenta"),
    (360, "pink"),
)
#: Each grey ends at this lightness.
GREYS = (
    (0.25, "black"),
    (0.45, "dark grey"),
    (0.70, "grey"),
    (0.93, "light grey"),
    (9, "white"),
)
#: Below these chromas a colour is a grey, or greyish.
GREY, GREYISH = 0.025, 0.07
#: Up to the first lightness a colour is dark, or deep if it is strong. From the second on it is
#: pale, or light if it is strong; a vivid one has no modifier.
DARK, LIGHT, STRONG, VIVID = 0.42, 0.78, 0.11, 0.13
#: From these lightnesses on, brown is orange, olive is yellow and red is pink.
ORANGE, PINK = 0.62, 0.69


def _at(table: tuple[tuple[float, str], ...], value: float) -> str:
    return table[min(bisect.bisect(table, (value, "")), len(table) - 1)][1]


def of_lch(lightness: float, chroma: float, hue: float) -> str:
    """Return the name of a colour in OKLCh (`Lch.of`).

    >>> of_lch(0.63, 0.26, 29)
    'red'
    >>> of_lch(0.3, 0.12, 29)
    'deep red'
    """
    if chroma < GREY or lightness < 0.12:
        return _at(GREYS, lightness)
    name = _at(HUES, hue % 360)
    if name in ("orange", "yellow") and lightness < ORANGE:
        name = "brown" if name == "orange" else "olive"
    if name in ("red", "pink"):
        name = "pink" if lightness > PINK else "red"
    if name == "magenta" and lightness < DARK:
        name = "purple"
    strong = chroma >= STRONG
    if lightness < DARK:
        return f"deep {name}" if strong else f"dark {name}"
    if lightness > LIGHT and chroma < VIVID:
        return f"light {name}" if strong else f"pale {name}"
    return f"greyish {name}" if chroma < GREYISH else name


def named_lch(rgb: ArrayLike, encoding: str) -> list[tuple[float, str]]:
    """Return the lightness and the name of (n, 3) code values of an encoding.

    An unknown encoding counts as sRGB.
    """
    values = np.reshape(np.asarray(rgb, np.float64), (-1, 3))
    return [(row[0], of_lch(*row)) for row in Lch(encoding).of(values).tolist()]
