"""Visible colour differences: CIE L*a*b* of code values, and CIEDE2000 between two colours.

OpenColorIO converts an encoding to sRGB. scikit-image converts sRGB to L*a*b* (white point D65) and
computes CIEDE2000 (Sharma, Wu and Dalal 2005).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.colour.ocio_config import SAME_ENCODINGS, same_encodings, space_of_encoding
from palette4d.colour.ocio_processor import ExactProcessor

F64 = NDArray[np.float64]

#: The deltaE 2000 that is just visible in a direct comparison.
VISIBLE = 1.0


@dataclass(frozen=True)
class Viewing:
    """How code values are converted for viewing.

    Attributes
    ----------
    assumption : one phrase about the encoding, to print beside every deltaE.
    to_srgb : from the encoding to sRGB; None if it is sRGB or assumed to be sRGB.
    encoding : OpenColorIO's kind of the encoding: "log", "scene-linear", …; "" if unknown.
    """

    assumption: str
    to_srgb: ExactProcessor | None = None
    encoding: str = ""

    def lab(self, colours: ArrayLike) -> F64:
        """Return the (n, 3) CIE L*a*b* (D65) of (n, 3) code values.

        What a display shows: where the encoding is one of displays, values are clamped to 0..1.
        """
        from skimage.color import rgb2lab

        srgb = np.asarray(colours if self.to_srgb is None else self.to_srgb(colours), np.float64)
        if self.encoding in ("", "sdr-video"):
            srgb = srgb.clip(0, 1)
        return np.asarray(rgb2lab(srgb))


def viewing_of(encoding: str) -> Viewing:
    """Return the viewing conversion for an encoding.

    If OpenColorIO's built-in studio config does not know the encoding, sRGB is assumed, and
    `Viewing.assumption` says so.
    """
    import PyOpenColorIO as ocio

    if same_encodings(encoding)[-1] in SAME_ENCODINGS[0]:
        return Viewing("sRGB (IEC 61966-2-1), D65", encoding="sdr-video")
    if encoding.strip().lower() in ("", "unknown"):
        return Viewing("encoding unknown, taken as sRGB, D65")
    config = ocio.Config.CreateFromBuiltinConfig("ocio://studio-config-latest")
    space = space_of_encoding(config, encoding)
    if space is None:
        return Viewing(f"encoding {encoding!r} unknown, taken as sRGB, D65")
    return Viewing(
        f"{space.getName()} by OpenColorIO's studio config, D65",
        ExactProcessor(config.getProcessor(space.getName(), "srgb_tx")),
        str(space.getEncoding()),
    )


def delta_e_2000(first: ArrayLike, second: ArrayLike) -> F64:
    """Return the (n,) CIEDE2000 differences of (n, 3) and (n, 3) L*a*b*.

    >>> round(float(delta_e_2000([50, 2.6772, -79.7751], [50, 0, -82.7485])), 4)
    2.0425
    """
    from skimage.color import deltaE_ciede2000

    one, two = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    return np.asarray(deltaE_ciede2000(one, two))  # type: ignore[no-untyped-call]
