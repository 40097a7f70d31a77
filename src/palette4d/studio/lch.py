"""Lightness, chroma and hue of code values as they are displayed: OKLCh (Ottosson 2020), in arrays.

For the inspector's wheel, which shows many colours at once. Edits themselves are code values.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.colour.difference import viewing_of
from palette4d.colour.ocio_config import space_of_encoding
from palette4d.colour.ocio_processor import ExactProcessor

F64 = NDArray[np.float64]

# Linear sRGB to cone responses, and these to lightness, a, b (Ottosson 2020).
_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
#: Halvings of the chroma in the search for the largest that can be displayed.
HALVINGS = 14


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
        linear = (lab @ np.linalg.inv(_LAB).T) ** 3 @ np.linalg.inv(_CONES).T
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
