"""Hue, chroma and lightness of code values as they are displayed: OKLCh (Ottosson 2020).

OpenColorIO converts an encoding to linear Rec. 709.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.colour.difference import viewing_of
from palette4d.colour.ocio_config import space_of_encoding
from palette4d.colour.ocio_processor import ExactProcessor
from palette4d.common.errors import Palette4dError

F64 = NDArray[np.float64]
Colour = tuple[float, float, float]

# Linear sRGB to cone responses, and these to lightness, a, b (Ottosson 2020), in the digits of
# CSS Color 4, so that greys have no chroma.
_CONES = np.array(
    [
        [0.4122214694707628, 0.5363325372617349, 0.05144599326750219],
        [0.2119034958178251, 0.6806995506452344, 0.10739695353694051],
        [0.08830245919005637, 0.2817188391361215, 0.6299787016738222],
    ]
)
_LAB = np.array(
    [
        [0.21045426830931396, 0.7936177747023053, -0.00407204301161926],
        [1.9779985324311686, -2.42859224204858, 0.450593709617411],
        [0.02590404246554773, 0.7827717124575297, -0.8086757549230774],
    ]
)
_FROM_CONES, _FROM_LAB = np.linalg.inv(_CONES), np.linalg.inv(_LAB)
#: Halvings of the chroma in the search for the largest that can be displayed.
HALVINGS = 14


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
    numbers = (change.hue, change.chroma, change.lightness)
    if not all(map(isfinite, numbers)) or min(numbers[1:]) < 0:
        raise Palette4dError(
            f"found hue {change.hue:g}, chroma {change.chroma:g} and lightness "
            f"{change.lightness:g}; expected finite numbers, and factors of 0 or more"
        )
    lch = Lch(encoding)
    factors, turn = np.array([change.lightness, change.chroma, 1.0]), np.array([0, 0, change.hue])

    def adjusted(colour: Colour) -> Colour:
        if change == Adjustment():
            return colour
        r, g, b = lch.back(lch.of(colour) * factors + turn).tolist()
        return r, g, b

    return adjusted


class Lch:
    """The conversion between an encoding's code values and OKLCh; unknown counts as sRGB.

    Attributes
    ----------
    display : bool
        Code values 0..1 are what a screen can show.
    """

    def __init__(self, encoding: str) -> None:
        viewing = viewing_of(encoding)
        self.display = viewing.encoding in ("", "sdr-video")
        self._there: ExactProcessor | None = None
        self._back: ExactProcessor | None = None
        if viewing.to_srgb is not None:
            import PyOpenColorIO as ocio

            config = ocio.Config.CreateFromBuiltinConfig("ocio://studio-config-latest")
            own: Any = space_of_encoding(config, encoding)
            self._there = ExactProcessor(config.getProcessor(own.getName(), "lin_rec709_srgb"))
            self._back = ExactProcessor(config.getProcessor("lin_rec709_srgb", own.getName()))

    def of(self, rgb: ArrayLike) -> F64:
        """Return (…, 3) lightness 0..1, chroma, hue in degrees 0..360 of (…, 3) code values."""
        values = np.asarray(rgb, dtype=np.float64)
        linear = _linear(values) if self._there is None else np.float64(self._there(values))
        lab = np.cbrt(linear @ _CONES.T) @ _LAB.T
        chroma = np.hypot(lab[..., 1], lab[..., 2])
        hue = np.degrees(np.arctan2(lab[..., 2], lab[..., 1])) % 360
        return np.stack([lab[..., 0], chroma, np.where(chroma < 1e-6, 0.0, hue)], axis=-1)

    def back(self, lch: ArrayLike) -> F64:
        """Return (…, 3) code values of (…, 3) lightness, chroma, hue."""
        light, chroma, hue = np.moveaxis(np.asarray(lch, dtype=np.float64), -1, 0)
        angle = np.radians(hue)
        lab = np.stack([light, chroma * np.cos(angle), chroma * np.sin(angle)], axis=-1)
        linear = (lab @ _FROM_LAB.T) ** 3 @ _FROM_CONES.T
        if self._back is None:
            return _curve(linear)
        return np.asarray(self._back(linear), dtype=np.float64)

    def fits(self, rgb: F64) -> NDArray[np.bool_]:
        """Return which code values a screen can show, (…,)."""
        if not self.display:
            return np.asarray(np.isfinite(rgb).all(axis=-1))
        return np.asarray(((rgb >= -1e-4) & (rgb <= 1 + 1e-4)).all(axis=-1))

    def fitted(self, lch: ArrayLike) -> F64:
        """Return (…, 3) code values with the chroma reduced to what can be displayed."""
        wanted = np.array(lch, dtype=np.float64)
        rgb = self.back(wanted)
        if self.fits(rgb).all():
            return rgb
        low, high = np.zeros(wanted.shape[:-1]), wanted[..., 1].copy()
        for _ in range(HALVINGS):
            wanted[..., 1] = (low + high) / 2
            fits = self.fits(self.back(wanted))
            low, high = np.where(fits, wanted[..., 1], low), np.where(fits, high, wanted[..., 1])
        wanted[..., 1] = low
        return np.where(self.fits(rgb)[..., None], rgb, np.clip(self.back(wanted), 0, 1))


def _linear(srgb: F64) -> F64:
    size = np.abs(srgb)
    return np.sign(srgb) * np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)


def _curve(linear: F64) -> F64:
    size = np.abs(linear)
    high = 1.055 * size ** (1 / 2.4) - 0.055
    return np.sign(linear) * np.where(size <= 0.0031308, 12.92 * size, high)
