"""How different two colours look: CIE L*a*b* of an encoding, and CIEDE2000 between two colours.

Sources: CIE 15:2004 (L*a*b*, white point D65); IEC 61966-2-1 (sRGB); Sharma, Wu and Dalal 2005,
"The CIEDE2000 color-difference formula: implementation notes, supplementary test data, and
mathematical observations" (the formula and the pairs that the tests compare with).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.colour.ocio_config import SAME_ENCODINGS, same_encodings
from palette4d.colour.ocio_processor import ExactProcessor

F64 = NDArray[np.float64]

#: Linear light with Rec.709 primaries to XYZ of 1931, D65 (IEC 61966-2-1, more digits).
_XYZ = np.array(
    [
        [0.4123907992659595, 0.3575843393838780, 0.1804807884018343],
        [0.2126390058715104, 0.7151686787677559, 0.0721923153607337],
        [0.0193308187155918, 0.1191947797946259, 0.9505321522496608],
    ]
)
_WHITE = _XYZ.sum(axis=1)


@dataclass(frozen=True)
class Viewing:
    """How the numbers of an encoding are taken as colours.

    Attributes
    ----------
    assumption : str
        One phrase that says so, to be stated beside every deltaE.
    linear : callable
        (n, 3) float64 numbers -> (n, 3) float64 linear light, Rec.709 primaries, 1 is white.
    """

    assumption: str
    linear: Callable[[F64], F64]

    def lab(self, colours: ArrayLike) -> F64:
        """Return the (n, 3) CIE L*a*b* (D65) of (n, 3) numbers in the encoding."""
        return lab_of_linear(self.linear(np.asarray(colours, dtype=np.float64)))


def viewing_of(encoding: str) -> Viewing:
    """Return how colours of an encoding are seen.

    sRGB is converted here; every other name is looked up in OpenColorIO's built-in studio config; a
    name that is unknown there is taken as sRGB, and `Viewing.assumption` says so.
    """
    names = same_encodings(encoding)
    if names[-1] in SAME_ENCODINGS[0]:
        return Viewing("sRGB (IEC 61966-2-1), D65", srgb_to_linear)
    if encoding.strip().lower() in ("", "unknown"):
        return Viewing("encoding unknown, taken as sRGB, D65", srgb_to_linear)
    converted = _by_opencolorio(names)
    if converted is not None:
        found, linear = converted
        return Viewing(f"{found} by OpenColorIO's studio config, D65", linear)
    return Viewing(f"encoding {encoding!r} unknown, taken as sRGB, D65", srgb_to_linear)


def _by_opencolorio(names: list[str]) -> tuple[str, Callable[[F64], F64]] | None:
    import PyOpenColorIO as ocio

    config = ocio.Config.CreateFromBuiltinConfig("ocio://studio-config-latest")
    spaces = (config.getColorSpace(name) for name in names)
    space = next((found for found in spaces if found is not None and not found.isData()), None)
    if space is None:
        return None
    to_linear = ExactProcessor(config.getProcessor(space.getName(), "lin_rec709"))
    return space.getName(), lambda colours: to_linear(colours).astype(np.float64)


def srgb_to_linear(colours: F64) -> F64:
    """Return linear light of sRGB numbers; below 0 mirrored, above 1 continued.

    >>> float(srgb_to_linear(np.array([1.0]))[0])
    1.0
    """
    size = np.abs(colours)
    curve = np.where(size <= 0.04045, size / 12.92, ((size + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.copysign(curve, colours))


def lab_of_linear(linear: F64) -> F64:
    """Return the (n, 3) CIE L*a*b* of (n, 3) linear Rec.709 light; white is D65, its L* is 100."""
    # White as the sum of the primaries: greys have no chroma, to the last digit.
    ratio = linear @ (_XYZ / _WHITE[:, None]).T
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio * (841 / 108) + 4 / 29)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def delta_e_2000(first: ArrayLike, second: ArrayLike) -> F64:
    """Return the (n,) CIEDE2000 differences (kL = kC = kH = 1) of (n, 3) and (n, 3) L*a*b*.

    Numbers in brackets are the equations of Sharma, Wu and Dalal 2005.

    >>> round(float(delta_e_2000([50, 2.6772, -79.7751], [50, 0, -82.7485])), 4)
    2.0425
    """
    one, two = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    l1, a1, b1 = one[..., 0], one[..., 1], one[..., 2]
    l2, a2, b2 = two[..., 0], two[..., 1], two[..., 2]
    c7 = ((np.hypot(a1, b1) + np.hypot(a2, b2)) / 2) ** 7  # [2], [3]
    g = 0.5 * (1 - np.sqrt(c7 / (c7 + 25.0**7)))  # [4]
    a1, a2 = a1 * (1 + g), a2 * (1 + g)  # [5]
    c1, c2 = np.hypot(a1, b1), np.hypot(a2, b2)  # [6]
    h1, h2 = np.arctan2(b1, a1), np.arctan2(b2, a2)  # [7], in radians, -pi..pi
    grey = c1 * c2 == 0

    turn = 2 * np.pi
    dh = np.where(grey, 0.0, (h2 - h1 + np.pi) % turn - np.pi)  # [10]
    big_dh = 2 * np.sqrt(c1 * c2) * np.sin(dh / 2)  # [11]
    dl, dc = l2 - l1, c2 - c1  # [8], [9]

    h1, h2 = h1 % turn, h2 % turn
    far = np.abs(h1 - h2) > np.pi
    total = h1 + h2
    mean = np.where(far, np.where(total < turn, total + turn, total - turn), total) / 2
    h = np.where(grey, total, mean)  # [14]
    l50 = ((l1 + l2) / 2 - 50) ** 2  # [12]
    c = (c1 + c2) / 2  # [13]
    t = (
        1
        - 0.17 * np.cos(h - np.pi / 6)
        + 0.24 * np.cos(2 * h)
        + 0.32 * np.cos(3 * h + np.radians(6))
        - 0.20 * np.cos(4 * h - np.radians(63))
    )  # [15]
    theta = np.radians(30) * np.exp(-(((np.degrees(h) - 275) / 25) ** 2))  # [16]
    c7 = c**7
    rc = 2 * np.sqrt(c7 / (c7 + 25.0**7))  # [17]
    sl = 1 + 0.015 * l50 / np.sqrt(20 + l50)  # [18]
    sc = 1 + 0.045 * c  # [19]
    sh = 1 + 0.015 * c * t  # [20]
    rt = -np.sin(2 * theta) * rc  # [21]
    x, y, z = dl / sl, dc / sc, big_dh / sh
    # Rounding may leave less than nothing of colours that are the same.
    return np.asarray(np.sqrt(np.maximum(x * x + y * y + z * z + rt * y * z, 0.0)))  # [22]
