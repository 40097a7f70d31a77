"""Colours, sizes and text of the picture: neutral greys, as in grading software.

Every surface, line and letter is grey, so that it does not change how colours look.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    "text.parse_math": False,
    "text.hinting": "no_hinting",  # the same width at every resolution
}

#: Text that is centred at its point, small and faint.
CENTRED: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8, "color": FAINT}


def shown(rgb: NDArray[np.floating], encoding: str) -> F64:
    """Return display colours: (…, 3) in the clip's encoding -> (…, 3) in 0..1.

    Scene-linear and log encodings that OpenColorIO knows are converted to sRGB. All others count as
    display encodings and are not converted. All values are clamped.
    """
    values = np.nan_to_num(np.asarray(rgb, dtype=np.float64), nan=0.0)
    if (to_srgb := _to_srgb(encoding)) is not None:
        values = to_srgb(values).astype(np.float64)
    return np.clip(values, 0.0, 1.0)


@cache
def _to_srgb(encoding: str) -> Any:
    from palette4d.colour.difference import viewing_of

    viewing = viewing_of(encoding)
    return viewing.to_srgb if viewing.encoding in ("log", "scene-linear") else None


@cache
def _has_glyph(character: str) -> bool:
    from matplotlib.font_manager import FontProperties, findfont, get_font

    font = get_font(findfont(FontProperties(family=[FONT])))
    return font.get_char_index(ord(character)) != 0


def printable(text: str, longest: int = 60) -> str:
    """Return `text` in drawable characters, on one line, shortened in the middle if too long."""
    drawn = "".join(c if c.isprintable() and _has_glyph(c) else "\N{WHITE SQUARE}" for c in text)
    if len(drawn) > longest:
        drawn = drawn[: longest // 2] + "…" + drawn[-(longest - longest // 2 - 1) :]
    return drawn


def number(value: float) -> str:
    """Return a frame number without needless decimals, with a real minus sign."""
    return f"{value:.6g}".replace("-", "−")
