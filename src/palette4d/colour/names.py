"""Names of colours for people: a hue with a modifier, such as "deep red" or "pale blue".

The list is fixed and short. A colour's name follows from its place in OKLCh. The bounds are those
at which the names change that people gave to 949 colours in the survey of xkcd.com (2010).
"""

import bisect

import numpy as np
from numpy.typing import ArrayLike

from palette4d.colour.oklch import Lch

#: Each hue ends at an angle of OKLCh. It has its first name from a lightness and a chroma on, and
#: the second one below either.
HUES = (
    (19, "pink", 0.61, 0, "red"),
    (38, "pink", 0.68, 0, "red"),
    (79, "orange", 0.56, 0.105, "brown"),
    (100, "yellow", 0.66, 0, "brown"),
    (119, "yellow", 0.7, 0, "olive"),
    (138, "lime", 0.78, 0.16, "green"),
    (165, "green", 0, 0, "green"),
    (210, "cyan", 0.82, 0, "teal"),
    (288, "blue", 0, 0, "blue"),
    (326, "purple", 0, 0, "purple"),
    (341, "magenta", 0.6, 0.2, "purple"),
    (354, "pink", 0.62, 0, "magenta"),
    (360, "pink", 0.61, 0, "red"),
)
#: Hues from and to, lightnesses from and to, and the chroma up to which a colour has this name.
MUTED = ((45, 112, 0.63, 9, 0.1, "beige"), (12, 38, 0.42, 0.63, 0.105, "brown"))
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
#: Below this lightness every colour is black: nobody sees its hue.
BLACK = 0.2
#: Up to the first lightness a colour is dark, or deep if it is strong. From the second on it is
#: pale, or light if it is strong; a vivid one has no modifier.
DARK, LIGHT, STRONG, VIVID = 0.42, 0.78, 0.11, 0.13


def _hue(lightness: float, chroma: float, hue: float) -> str:
    for first, last, dark, light, most, name in MUTED:
        if first <= hue < last and dark < lightness < light and chroma < most:
            return name
    ends = [end for end, *_ in HUES]
    _, name, light, strong, other = HUES[bisect.bisect(ends[:-1], hue)]
    return name if lightness >= light and chroma >= strong else other


def of_lch(lightness: float, chroma: float, hue: float) -> str:
    """Return the name of a colour in OKLCh (`Lch.of`).

    >>> of_lch(0.63, 0.26, 29)
    'red'
    >>> of_lch(0.3, 0.12, 29)
    'deep red'
    """
    if chroma < GREY or lightness < BLACK:
        return next(name for end, name in GREYS if lightness < end or end == GREYS[-1][0])
    name = _hue(lightness, chroma, hue % 360)
    strong = chroma >= STRONG
    if lightness < DARK:
        return f"deep {name}" if strong else f"dark {name}"
    if lightness > LIGHT and chroma < VIVID:
        return f"light {name}" if strong else f"pale {name}"
    return f"greyish {name}" if chroma < GREYISH and name != "beige" else name


def named_lch(rgb: ArrayLike, encoding: str) -> list[tuple[float, str]]:
    """Return the lightness and the name of (n, 3) code values of an encoding.

    An unknown encoding counts as sRGB.
    """
    values = np.reshape(np.asarray(rgb, np.float64), (-1, 3))
    return [(row[0], of_lch(*row)) for row in Lch(encoding).of(values).tolist()]
