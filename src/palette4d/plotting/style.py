"""Colours, sizes and text of the picture: neutral greys, as in grading software.

Nothing around a colour may tint it: every surface, line and letter is grey.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core

F64 = NDArray[np.float64]

PAGE = "#202020"
PANEL = "#2a2a2a"
PANEL_ALTERNATE = "#303030"
TRANSITION = "#262626"
LINE = "#4a4a4a"
GUIDE = "#6a6a6a"
FAINT = "#8c8c8c"
TEXT = "#c9c9c9"
BRIGHT = "#f0f0f0"
RIM = "#5a5a5a"
RING = "#9a9a9a"
INK = "#141414"

FONT = "DejaVu Sans"  # comes with matplotlib, so that every machine draws the same picture

#: matplotlib settings, so that a user's own matplotlibrc does not change the picture.
RC: dict[Any, Any] = {
    "font.family": [FONT],
    "svg.fonttype": "none",  # text stays text: ids can be searched for
    "svg.hashsalt": "palette4d",  # the same picture gives the same file
    "pdf.fonttype": 42,
    "path.simplify": False,
    "text.hinting": "no_hinting",  # as wide at every resolution as it was measured
}

_LINEAR = ("linear", "lin_", "acescg", "aces2065", "scene")


def shown(rgb: NDArray[np.floating], encoding: str) -> F64:
    """Return colours as a screen shows them: (…, 3) in the clip's encoding -> (…, 3) in 0..1.

    Display encodings are shown as they are; scene-linear ones get the sRGB curve, and logs that
    OpenColorIO knows are brought to sRGB. All are clamped.
    """
    values = np.nan_to_num(np.asarray(rgb, dtype=np.float64), nan=0.0)
    if (display := _from_log(encoding)) is not None:
        return np.clip(display.to_palette(values), 0.0, 1.0)
    values = np.clip(values, 0.0, 1.0)
    if any(word in encoding.lower() for word in _LINEAR):
        low = values <= 0.0031308
        values = np.where(
            low, 12.92 * values, 1.055 * np.maximum(values, 1e-9) ** (1 / 2.4) - 0.055
        )
    return np.clip(values, 0.0, 1.0)


@cache
def _from_log(encoding: str) -> _core.ColourConversion | None:
    """Return the way from a log encoding to sRGB; None for other encodings."""
    from palette4d.colour.conversion import conversion
    from palette4d.colour.conversion_steps import ConversionError
    from palette4d.colour.ocio_config import BUILT_IN, load_config, same_encodings

    if any(word in encoding.lower() for word in (*_LINEAR, "srgb")):
        return None
    config = load_config(BUILT_IN, "")
    for name in same_encodings(encoding):
        space = config.getColorSpace(name)
        if space is not None and space.getEncoding() == "log":
            try:
                return conversion(config, str(space.getName()), "sRGB - Texture").chain
            except ConversionError:
                return None
    return None


@cache
def _has_glyph(character: str) -> bool:
    from matplotlib.font_manager import FontProperties, findfont, get_font

    font = get_font(findfont(FontProperties(family=[FONT])))
    return font.get_char_index(ord(character)) != 0


def printable(text: str, longest: int = 60) -> str:
    """Return `text` as the font can draw it, on one line, shortened in the middle if need be."""
    drawn = "".join(c if c.isprintable() and _has_glyph(c) else "\N{WHITE SQUARE}" for c in text)
    if len(drawn) > longest:
        drawn = drawn[: longest // 2] + "…" + drawn[-(longest - longest // 2 - 1) :]
    return drawn


def number(value: float) -> str:
    """Return a frame number without needless decimals, with a real minus sign."""
    return f"{value:.6g}".replace("-", "−")


def ticks(first: float, last: float, most: int) -> list[int]:
    """Return whole frame numbers for an axis, at most about `most`, at round distances."""
    span = max(last - first, 1e-9)
    step = 1
    for power in range(12):
        for digit in (1, 2, 5):
            step = digit * 10**power
            if span / step <= most:
                start = int(np.ceil(first / step))
                return [k * step for k in range(start, int(np.floor(last / step)) + 1)]
    return [int(np.ceil(first))]
