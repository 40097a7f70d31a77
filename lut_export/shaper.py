"""The 1D shaper before a 3D LUT: from a clip's code values to the LUT's 0..1.

A 3D LUT covers 0..1 and clamps everything outside. For a larger domain low..high a shaper comes
before it:

- "none": the code values themselves, 0..1;
- "linear": u = (x - low) / (high - low);
- "log": u = (f(x) - f(low)) / (f(high) - f(low)) with f(x) = log2(x / OFFSET + 1) for x >= 0 and
  its tangent below. In scene-linear code values the nodes are then about evenly spaced in stops.
  The curve is straight through black. It is exactly a camera-style Log of CLF, without a 1D LUT.

Colours outside low..high are clamped.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.common.errors import Arg, Palette4dError

F64 = NDArray[np.float64]

Kind = Literal["none", "linear", "log"]
#: The kinds of shaper; with "auto" the colours decide.
Choice = Literal["auto", "none", "linear", "log"]

#: The log curve is about linear below this code value, which is 0.85 stops below middle grey.
OFFSET = 0.1

#: "auto" chooses a linear shaper up to this domain width: log encodings just beyond 0..1.
LINEAR_WIDTH = 2.0

#: The largest colour value that a sidecar allows.
LARGEST = 1e6


@dataclass(frozen=True)
class Shaper:
    """A curve from low..high to 0..1; see the module's docstring."""

    kind: Kind = "none"
    low: float = 0.0
    high: float = 1.0

    def __post_init__(self) -> None:
        """Refuse an impossible domain."""
        if not (-LARGEST <= self.low < self.high <= LARGEST):
            raise Palette4dError(
                f"found the domain {self.low:g} to {self.high:g}, expected two code values within "
                f"±{LARGEST:g}, the smaller one first"
            )
        if self.kind == "none" and (self.low, self.high) != (0.0, 1.0):
            raise Palette4dError(
                f"found the domain {self.low:g} to {self.high:g} without a shaper, which covers 0 "
                f'to 1; choose {Arg("shaper", "log")} or "linear", or leave out {Arg("domain")}'
            )

    def forward(self, x: ArrayLike) -> F64:
        """Return u, unclamped, of code values x of any shape."""
        values = np.asarray(x, dtype=np.float64)
        if self.kind == "log":
            return np.asarray((_log(values) - _log(self.low)) / self._span)
        return (values - self.low) / (self.high - self.low)

    def inverse(self, u: ArrayLike) -> F64:
        """Return x of u of any shape; exact at 0 and 1."""
        values = np.asarray(u, dtype=np.float64)
        if self.kind == "log":
            x = _unlog(values * self._span + _log(self.low))
        else:
            x = self.low + values * (self.high - self.low)
        return np.asarray(np.where(values == 0, self.low, np.where(values == 1, self.high, x)))

    @property
    def _span(self) -> float:
        return float(_log(self.high) - _log(self.low))

    def transforms(self) -> list[Any]:
        """Return OpenColorIO's transforms of `forward`: none or one, invertible, not clamping."""
        import PyOpenColorIO as ocio

        if self.kind == "none":
            return []
        if self.kind == "linear":
            scale = 1 / (self.high - self.low)
            matrix = np.diag([scale, scale, scale, 1.0])
            return [ocio.MatrixTransform(matrix.ravel(), [-self.low * scale] * 3 + [0.0])]
        slope = 1 / self._span
        return [
            ocio.LogCameraTransform(
                linSideBreak=[0.0] * 3,
                base=2.0,
                logSideSlope=[slope] * 3,
                logSideOffset=[float(-_log(self.low) * slope - math.log2(OFFSET) * slope)] * 3,
                linSideSlope=[1.0] * 3,
                linSideOffset=[OFFSET] * 3,
            )
        ]

    def samples(self) -> int:
        """Return how many samples a 1D LUT of the curve needs: 1,024 to 65,536.

        Linear interpolation is then within 1e-5 of u, where that is possible.
        """
        if self.kind != "log":
            return 1024
        # The second derivative of u is largest at 0.
        bend = 1 / (math.log(2) * OFFSET**2 * self._span)
        steps = (self.high - self.low) * math.sqrt(bend / 8 / 1e-5)
        return int(np.clip(2 ** math.ceil(math.log2(max(steps, 1))), 1024, 65536))

    def text(self) -> str:
        """Return a phrase such as "none, input 0 to 1"."""
        return f"{self.kind}, input {self.low:g} to {self.high:g}"


#: No shaper: code values within 0..1, unchanged.
UNSHAPED = Shaper()


def _log(x: ArrayLike) -> F64:
    values = np.asarray(x, dtype=np.float64)
    above = np.log2(np.maximum(values, 0) / OFFSET + 1)
    return np.where(values >= 0, above, values / (OFFSET * math.log(2)))


def _unlog(y: F64) -> F64:
    above = (np.exp2(np.maximum(y, 0)) - 1) * OFFSET
    return np.where(y >= 0, above, y * (OFFSET * math.log(2)))


def choose(kind: str, low: float, high: float) -> Shaper:
    """Return the shaper for colours from low to high.

    Parameters
    ----------
    kind : {"auto", "none", "linear", "log"}; "auto" is none if low..high lies within 0..1, linear
        if its width is at most `LINEAR_WIDTH`, else log. "none" ignores low and high.
    low, high : the smallest and largest code value to cover. 0..1 is always covered, and the limits
        are rounded outwards to two digits.
    """
    low, high = min(0.0, -_outwards(-low)), max(1.0, _outwards(high))
    if kind == "auto":
        if (low, high) == (0.0, 1.0):
            kind = "none"
        else:
            kind = "linear" if high - low <= LINEAR_WIDTH else "log"
    if kind == "none":
        return UNSHAPED
    if kind == "linear":
        return Shaper("linear", low, high)
    return Shaper("log", low, high)


def _outwards(value: float) -> float:
    """Round up to two significant digits: 50.3 -> 51, 1.004 -> 1.1; values up to 0 stay."""
    if value <= 0:
        return value
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / step - 1e-9) * step:.2g}")
