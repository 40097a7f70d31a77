"""Hue, chroma and lightness of code values as they are displayed: OKLCh (Ottosson 2020).

coloraide converts sRGB to Oklab. OpenColorIO converts an encoding to linear Rec. 709.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, isfinite, radians, sin
from typing import Any

import numpy as np

from palette4d.colour.difference import viewing_of
from palette4d.colour.ocio_config import space_of_encoding
from palette4d.colour.ocio_processor import ExactProcessor
from palette4d.common.errors import Palette4dError

Colour = tuple[float, float, float]
Convert = Callable[[Any], list[float]]


@dataclass(frozen=True)
class Adjustment:
    """A change of displayed colours.

    Attributes
    ----------
    hue : float
        Degrees added to the hue; positive from red over yellow to green.
    chroma, lightness : float
        Factors.
    """

    hue: float = 0.0
    chroma: float = 1.0
    lightness: float = 1.0

    def __str__(self) -> str:
        """Return the parts that change, for people."""
        parts = (("hue", self.hue, 0), ("chroma", self.chroma, 1), ("lightness", self.lightness, 1))
        return ", ".join(f"{name} {value:g}" for name, value, same in parts if value != same)


def adjuster(encoding: str, change: Adjustment) -> Callable[[Colour], Colour]:
    """Return the function that adjusts code values of an encoding.

    Raises
    ------
    Palette4dError
        A number is not finite, or a factor is negative.

    Notes
    -----
    An encoding that OpenColorIO does not know is taken as sRGB. Results are not limited to the
    display's gamut: pixels lie inside of the palette, and two opposite changes cancel out.
    """
    from coloraide import Color

    numbers = (change.hue, change.chroma, change.lightness)
    if not all(map(isfinite, numbers)) or min(numbers[1:]) < 0:
        raise Palette4dError(
            f"found hue {change.hue:g}, chroma {change.chroma:g} and lightness "
            f"{change.lightness:g}; expected finite numbers, and factors of 0 or more"
        )
    there, back = _linear(encoding)
    space = "srgb" if there is None else "srgb-linear"
    turn = cos(radians(change.hue)) * change.chroma, sin(radians(change.hue)) * change.chroma

    def adjusted(colour: Colour) -> Colour:
        if change == Adjustment():
            return colour
        before = Color(space, colour if there is None else there(colour))
        light, a, b = before.convert("oklab").coords()
        after = Color(
            "oklab",
            [light * change.lightness, a * turn[0] - b * turn[1], a * turn[1] + b * turn[0]],
        ).convert(space)
        r, g, b = after.coords() if back is None else back(after.coords())
        return float(r), float(g), float(b)

    return adjusted


def _linear(encoding: str) -> tuple[Convert | None, Convert | None]:
    """Return the conversions to linear Rec. 709 and back; None if the encoding is taken as sRGB."""
    if viewing_of(encoding).to_srgb is None:
        return None, None
    import PyOpenColorIO as ocio

    config = ocio.Config.CreateFromBuiltinConfig("ocio://studio-config-latest")
    own, linear = (space_of_encoding(config, name) for name in (encoding, "lin_rec709"))

    def processor(source: Any, target: Any) -> Convert:
        found = ExactProcessor(config.getProcessor(source.getName(), target.getName()))
        return lambda colour: np.asarray(found(colour), dtype=np.float64).tolist()

    return processor(own, linear), processor(linear, own)
