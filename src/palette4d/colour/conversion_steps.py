"""OpenColorIO's transforms as the steps of a sidecar's conversion: matrices and curves.

Input: one of OpenColorIO's transforms, or a list of steps. Output: the steps that
`palette4d._core.ColourConversion` applies, in either direction; docs/sidecar.md explains them.

A chain never clamps, unlike OpenColorIO. Its curves continue below black and above the largest code
value of an encoding, so that every code value has an inverse.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.colour.ocio_processor import ExactProcessor
from palette4d.common.errors import Palette4dError

F64 = NDArray[np.float64]
Step = dict[str, Any]

#: Below 2^-24 a logarithm without a straight part is continued by a straight line.
_DARKEST = 2.0**-24

#: A sample of a curve is left out if the line through the others differs by at most this.
_STRAIGHT = 3e-7

#: Curves end at this value, which no picture reaches.
_LARGEST = 1e9


class ConversionError(Palette4dError):
    """A conversion is not a chain of matrices and curves; the message says why, and the remedy."""


def steps_of(transform: Any) -> list[Step]:
    """Return one of OpenColorIO's transforms as steps of a sidecar."""
    name = type(transform).__name__
    translate = {
        "MatrixTransform": _matrix,
        "RangeTransform": _range,
        "LogTransform": _log,
        "LogAffineTransform": _log_affine,
        "LogCameraTransform": _log_camera,
        "ExponentTransform": _exponent,
        "ExponentWithLinearTransform": _exponent_with_linear,
        "Lut1DTransform": _table,
    }.get(name, _sampled)
    return translate(transform)


def _direction(transform: Any) -> str:
    import PyOpenColorIO as ocio

    return "inverse" if transform.getDirection() == ocio.TRANSFORM_DIR_INVERSE else "forward"


def _matrix_step(matrix: F64, offset: F64) -> Step:
    return {"kind": "matrix", "matrix": matrix.tolist(), "offset": offset.tolist()}


def _matrix(transform: Any) -> list[Step]:
    whole = np.array(transform.getMatrix(), dtype=np.float64).reshape(4, 4)
    offset = np.array(transform.getOffset(), dtype=np.float64)[:3]
    if np.any(whole[:3, 3] != 0):
        raise ConversionError("found a matrix that adds alpha to the colours")
    matrix = whole[:3, :3]
    if abs(np.linalg.det(matrix)) < 1e-9:
        raise ConversionError("found a matrix without an inverse")
    if _direction(transform) == "inverse":
        matrix = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
        offset = -matrix @ offset
    return [_matrix_step(matrix, offset)]


def _range(transform: Any) -> list[Step]:
    """Return the straight line of a range; the encoding ends where the range clamps."""
    ends = ("MinIn", "MaxIn", "MinOut", "MaxOut")
    has = [getattr(transform, f"has{end}Value")() for end in ends]
    if not all(has):
        return []  # it only clamps
    low, high, to_low, to_high = (getattr(transform, f"get{end}Value")() for end in ends)
    if not (high > low and to_high > to_low):
        raise ConversionError(f"found a range from {low:g} to {high:g}, which has no inverse")
    scale = (to_high - to_low) / (high - low)
    step = _matrix_step(np.eye(3) * scale, np.full(3, to_low - low * scale))
    if _direction(transform) == "inverse":
        step = _matrix_step(np.eye(3) / scale, np.full(3, low - to_low / scale))
    return [step]


def _log_step(transform: Any, start: F64, below: F64 | None, **parts: F64) -> Step:
    base = float(transform.getBase())
    slope, offset = parts["linear_slope"], parts["linear_offset"]
    if below is None:  # as steep as the curve there
        below = parts["log_slope"] * slope / ((slope * start + offset) * np.log(base))
    return {
        "kind": "log",
        "direction": _direction(transform),
        "base": base,
        **{name: values.tolist() for name, values in parts.items()},
        "start": start.tolist(),
        "below": below.tolist(),
    }


def _log(transform: Any) -> list[Step]:
    ones, zeros = np.ones(3), np.zeros(3)
    parts = {
        "log_slope": ones,
        "log_offset": zeros,
        "linear_slope": ones,
        "linear_offset": zeros,
    }
    return [_log_step(transform, np.full(3, _DARKEST), None, **parts)]


def _log_parts(transform: Any) -> dict[str, F64]:
    return {
        "log_slope": np.array(transform.getLogSideSlopeValue()),
        "log_offset": np.array(transform.getLogSideOffsetValue()),
        "linear_slope": np.array(transform.getLinSideSlopeValue()),
        "linear_offset": np.array(transform.getLinSideOffsetValue()),
    }


def _log_affine(transform: Any) -> list[Step]:
    parts = _log_parts(transform)
    start = (_DARKEST - parts["linear_offset"]) / parts["linear_slope"]
    return [_log_step(transform, start, None, **parts)]


def _log_camera(transform: Any) -> list[Step]:
    below = transform.getLinearSlopeValue() if _has_linear_slope(transform) else None
    start = np.array(transform.getLinSideBreakValue())
    given = None if below is None else np.array(below)
    return [_log_step(transform, start, given, **_log_parts(transform))]


def _has_linear_slope(transform: Any) -> bool:
    return bool(np.all(np.isfinite(transform.getLinearSlopeValue())))


def _gamma_step(transform: Any, gamma: list[float], offset: list[float], mirrored: bool) -> Step:
    return {
        "kind": "gamma",
        "direction": _direction(transform),
        "gamma": gamma[:3],
        "offset": offset[:3],
        "negative": "mirror" if mirrored else "line",
    }


def _exponent(transform: Any) -> list[Step]:
    import PyOpenColorIO as ocio

    # If OpenColorIO clamps at 0, the curve continues as its mirror image.
    line = transform.getNegativeStyle() == ocio.NEGATIVE_PASS_THRU
    return [_gamma_step(transform, list(transform.getValue()), [0.0] * 3, not line)]


def _exponent_with_linear(transform: Any) -> list[Step]:
    import PyOpenColorIO as ocio

    mirrored = transform.getNegativeStyle() == ocio.NEGATIVE_MIRROR
    return [
        _gamma_step(transform, list(transform.getGamma()), list(transform.getOffset()), mirrored)
    ]


def _table(transform: Any) -> list[Step]:
    import PyOpenColorIO as ocio

    if transform.getHueAdjust() != ocio.HUE_NONE:
        raise ConversionError("found a 1D LUT that keeps hues, where channels depend on each other")
    values = np.array(transform.getData(), dtype=np.float64).reshape(-1, 3)
    if transform.getInputHalfDomain():
        at = np.arange(len(values), dtype=np.uint16).view(np.float16).astype(np.float64)
    else:
        at = np.linspace(0, 1, len(values))
    return [_curve_step(at, values, _direction(transform))]


def _sampled(transform: Any) -> list[Step]:
    """Return the curves of a transform of any other kind that works on each channel alone."""
    import PyOpenColorIO as ocio

    direction = _direction(transform)
    transform.setDirection(ocio.TRANSFORM_DIR_FORWARD)
    apply = ExactProcessor(ocio.Config.CreateRaw().getProcessor(transform))
    at = np.arange(65536, dtype=np.uint16).view(np.float16)
    at = at[np.isfinite(at)]
    ramps = apply(np.repeat(at.astype(np.float32)[:, None], 3, axis=1))
    mixed = np.stack([np.roll(at, shift) for shift in (0, 911, 20011)], axis=1).astype(np.float32)
    alone = np.stack([np.roll(ramps[:, c], s) for c, s in enumerate((0, 911, 20011))], axis=1)
    if not np.allclose(apply(mixed), alone, rtol=1e-6, atol=1e-6, equal_nan=True):
        what = type(transform).__name__
        if isinstance(transform, ocio.FixedFunctionTransform):
            what += f" ({str(transform.getStyle()).rpartition('.')[2]})"
        raise ConversionError(f"found a {what}, in which channels depend on each other")
    return [_curve_step(at.astype(np.float64), ramps.astype(np.float64), direction)]


def _curve_step(at: F64, values: F64, direction: str) -> Step:
    """Return a curve for each channel, or one curve if all three are the same."""
    curves = []
    red, *others = values.T
    for y in [red] if all(np.array_equal(red, other) for other in others) else values.T:
        x, rising = _rising(at, y)
        kept = _bends(x, rising)
        curves.append({"x": x[kept].tolist(), "y": rising[kept].tolist()})
    return {"kind": "curve", "direction": direction, "curves": curves}


def _rising(at: F64, values: F64) -> tuple[F64, F64]:
    """Return the rising part of a curve's samples; the encoding ends where the curve is level."""
    good = np.isfinite(at) & np.isfinite(values) & (np.abs(values) <= _LARGEST)
    x, first = np.unique(at[good], return_index=True)
    y = values[good][first]
    falls = np.diff(y) < -1e-6 * np.maximum(np.abs(y[1:]), 1)
    if len(x) < 2 or falls.any():
        raise ConversionError("found a curve that falls, which has no inverse")
    rises = np.flatnonzero(np.diff(y) > 0)
    if not len(rises):
        raise ConversionError("found a curve that is level, which has no inverse")
    x, y = x[rises[0] :], y[rises[0] :]
    above = np.ones(len(y), dtype=bool)
    above[1:] = y[1:] > np.maximum.accumulate(y)[:-1]
    x, y = x[above], y[above]
    return x, y


def _bends(x: F64, y: F64) -> NDArray[np.intp]:
    """Return which samples to keep: straight lines between them are near all other samples.

    Distances are measured along y and along x (Douglas and Peucker 1973).
    """
    if len(x) <= 4096:
        return np.arange(len(x))
    kept = [0, len(x) - 1]
    parts = [(0, len(x) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        slope = (y[last] - y[first]) / (x[last] - x[first])
        off = np.abs(y[first] + (x[inner] - x[first]) * slope - y[inner])
        away = np.maximum(
            off / np.maximum(np.abs(y[inner]), 1), off / slope / np.maximum(np.abs(x[inner]), 1)
        )
        worst = int(np.argmax(away))
        if away[worst] > _STRAIGHT:
            middle = first + 1 + worst
            kept.append(middle)
            parts += [(first, middle), (middle, last)]
    return np.array(sorted(kept))


def joined(steps: list[Step]) -> Iterator[Step]:
    """Yield the steps; join neighbouring matrices and drop steps that change nothing."""
    held: tuple[F64, F64] | None = None
    for step in [*steps, None]:
        if step is not None and step["kind"] == "matrix":
            matrix, offset = np.array(step["matrix"]), np.array(step["offset"])
            held = (
                (matrix, offset) if held is None else (matrix @ held[0], matrix @ held[1] + offset)
            )
            continue
        if held is not None:
            if not (np.allclose(held[0], np.eye(3), atol=1e-12) and np.allclose(held[1], 0)):
                yield _matrix_step(*held)
            held = None
        if step is not None:
            yield step
