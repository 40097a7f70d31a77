"""What the scopes measure: waveform, parade, vectorscope and histogram of the frame that is shown.

Input: pixels of a frame, as display code values. Output: counts of pixels, and pictures of them
with the brightness of a trace. While something moves, the picture on screen is measured, in 8 bits
and sampled; when nothing moves, the frame is, in floats. It knows no toolkit.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.studio.display import Display, Look
from palette4d.studio.preview import Grade, Preview

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]
U32 = NDArray[np.uint32]

#: The most pixels that are measured while something moves, and when nothing does.
MOVING, RESTING = 140_000, 240_000
#: Columns of the waveform; a third of the parade has as many halves.
COLUMNS = 480
#: The brightness of a trace: this times the share of a column's pixels at a level, times the levels
#: of 8 bits; and the same for the vectorscope's bins. 1 is the brightest, roots tell little apart.
TRACE_GAIN, VECTOR_GAIN = 0.16, 0.012
#: The colours of the traces: luma, red, green, blue.
TRACES = ((214, 214, 214), (255, 92, 84), (92, 226, 120), (104, 142, 255))
#: Rec.709: the weights of luma, and what scales B' - Y' and R' - Y' to ±0.5.
LUMA, CB, CR = np.array([0.2126, 0.7152, 0.0722]), 1.8556, 1.5748
#: The angle of skin tones: the +I axis of NTSC, in degrees from Cb towards Cr.
SKIN_ANGLE = 123.0
#: The targets of a vectorscope: primaries and their complements, at three quarters.
TARGETS = {
    "R": (0.75, 0.0, 0.0),
    "Yl": (0.75, 0.75, 0.0),
    "G": (0.0, 0.75, 0.0),
    "Cy": (0.0, 0.75, 0.75),
    "B": (0.0, 0.0, 0.75),
    "Mg": (0.75, 0.0, 0.75),
}


@dataclass(frozen=True)
class Measured:
    """The scopes of one picture.

    Attributes
    ----------
    luma : (levels, columns) uint8
        The brightness of the waveform, from the highest level down.
    parade : (3, levels, columns / 2) uint8
        The same of red, green and blue.
    vectors : (bins, bins, 3) uint8
        The picture of the vectorscope.
    histogram : (4, levels) float
        The share of the pixels at each level, luma first.
    clipped : (3, 2) float
        The share of the pixels at or below black, and at or above white, of red, green and blue.
    """

    luma: U8
    parade: U8
    vectors: U8
    histogram: F64
    clipped: F64


def measure(values: F32, zoom: float) -> Measured:
    """Return the scopes of (h, w, 3) display code values; `zoom` enlarges the vectorscope."""
    waveform, vectors = _core.scope_counts(values, columns=COLUMNS, zoom=zoom)
    count = max(float(vectors.sum()), 1.0)
    histogram = waveform.sum(axis=0) / count
    below, levels = _core.SCOPE_BELOW, waveform.shape[2]
    white = levels - 1 - below
    clipped = [(h[: below + 1].sum(), h[white:].sum()) for h in histogram[1:]]
    halves = waveform if len(waveform) < 2 else waveform[: len(waveform) // 2 * 2 : 2]
    if len(waveform) > 1:
        halves = halves + waveform[1::2]
    return Measured(
        _trace(waveform[:, 0]),
        np.stack([_trace(halves[:, trace]) for trace in (1, 2, 3)]),
        _vector_trace(vectors, count, zoom),
        histogram,
        np.array(clipped),
    )


def _trace(counts: U32) -> U8:
    """Return the brightness of a waveform: (columns, levels) counts."""
    own = _as_beam(counts.astype(np.float32))
    own *= np.float32(256 * TRACE_GAIN) / np.maximum(own.sum(axis=1, keepdims=True), 1)
    return np.ascontiguousarray(_brightness(own).T[::-1])


def _brightness(shares: F32) -> U8:
    """Return 0..255 for shares, of which 1 is the brightest; changes these."""
    np.minimum(shares, 1, out=shares)
    np.sqrt(shares, out=shares)
    shares *= np.float32(255)
    return shares.astype(np.uint8)


def _as_beam(counts: F32) -> F32:
    """Return four times the counts with the width of a beam, which fills gaps between samples."""
    tall = counts.copy()
    tall[1:-1] += np.float32(0.5) * (counts[2:] + counts[:-2])
    beam = tall.copy()
    beam[:, 1:-1] += np.float32(0.5) * (tall[:, 2:] + tall[:, :-2])
    return beam


_TINTS: dict[float, NDArray[np.uint16]] = {}


def _vector_trace(counts: U32, count: float, zoom: float) -> U8:
    """Return the picture of the vectorscope; each bin has the hue that it stands for."""
    if zoom not in _TINTS:
        _TINTS[zoom] = _tints(len(counts), zoom)
    beam = _as_beam(counts.astype(np.float32))
    beam *= np.float32(len(counts) ** 2 * VECTOR_GAIN / 4 / count)
    return (_brightness(beam)[..., None] * _TINTS[zoom] >> 8).astype(np.uint8)


def _tints(size: int, zoom: float) -> NDArray[np.uint16]:
    """Return a bright colour for each bin of the vectorscope; grey in the middle."""
    axis = (np.arange(size) - size // 2) / (size - 1) / zoom
    cb, cr = axis[None, :], -axis[:, None]
    luma = 0.7
    red, blue = luma + CR * cr + 0 * cb, luma + CB * cb + 0 * cr
    green = (luma - LUMA[0] * red - LUMA[2] * blue) / LUMA[1]
    rgb = np.clip(np.stack([red, green, blue], axis=-1), 0.12, None)
    tints: NDArray[np.uint16] = (rgb / rgb.max(axis=-1, keepdims=True) * 235).astype(np.uint16)
    return tints


def vector_of(rgb: F64, zoom: float = 1.0) -> F64:
    """Return where display code values, (..., 3), stand in the vectorscope: x and y, -1..1.

    x grows to the right with Cb, y downwards against Cr.
    """
    luma = rgb @ LUMA
    cb, cr = (rgb[..., 2] - luma) / CB, (rgb[..., 0] - luma) / CR
    return np.stack([cb, -cr], axis=-1) * 2 * zoom


def strided(pixels: NDArray[Any], most: int) -> NDArray[Any]:
    """Return every n-th pixel of every n-th row, so that at most `most` remain."""
    step = max(1, math.ceil(math.sqrt(pixels.shape[0] * pixels.shape[1] / most)))
    return pixels[::step, ::step]


def values_of_picture(picture: U8) -> F32:
    """Return some of the display code values of a picture on screen, (h, w, 4) in 8 bits."""
    return strided(picture, MOVING)[..., :3].astype(np.float32) / np.float32(255)


@dataclass(frozen=True)
class Frame:
    """A frame to measure, when nothing moves.

    Attributes
    ----------
    pixels : (h, w, 3 or 4) float32
    grades : dict of str to Grade or None
        The edits of each side, "before" and "after"; None is the source.
    premultiplied : bool
    display : Display
    look : Look
        The display and view, without exposure and gamma.
    """

    pixels: F32
    grades: Mapping[str, Grade | None]
    premultiplied: bool
    display: Display
    look: Look

    def values(self, side: str, check: Callable[[], None]) -> F32:
        """Return the display code values of a side, at most `RESTING` pixels."""
        colours = np.ascontiguousarray(strided(self.pixels, RESTING))
        grade = self.grades[side]
        if grade is not None:
            colours = Preview.exact(colours, grade, self.premultiplied, check)
        check()
        alpha = colours[..., 3:]
        straight = _core.straight_colours(colours, premultiplied=self.premultiplied)
        values = self.display.painter(self.look).values(straight)
        # Over black, as on screen.
        return values * np.clip(np.nan_to_num(alpha), 0, 1) if alpha.size else values
