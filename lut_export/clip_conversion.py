"""A conversion of colour spaces as functions of the kernel's text, for exports of whole clips."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from palette4d import _core

#: As in the core: exponents of 2 are clamped here.
_LARGEST_EXPONENT = 120


def number(value: float) -> str:
    """Return a float literal."""
    text = f"{np.float32(value):.9g}"
    return text + ("f" if "." in text or "e" in text else ".0f")


class Conversion:
    """The functions p4d_to_palette and p4d_to_clip, and the samples of curves that they read.

    The samples are P4D_C(i).
    """

    def __init__(self, conversion: _core.ColourConversion) -> None:
        self.samples: list[float] = []
        self._functions: list[str] = []
        steps = [self._step(i, step) for i, step in enumerate(conversion.members)]
        forward = [name for name, _ in steps]
        backward = [name for _, name in reversed(steps)]
        self.text = "\n".join(
            [
                *([_core.kernel_text("sampled")] if self.samples else []),
                *self._functions,
                _chain("p4d_to_palette", forward),
                _chain("p4d_to_clip", backward),
            ]
        )

    def _step(self, index: int, step: dict[str, Any]) -> tuple[str, str]:
        """Add a step's two functions; return their names."""
        names = f"p4d_step{index}", f"p4d_back{index}"
        if step["kind"] == "matrix":
            matrix, offset = np.reshape(step["matrix"], (3, 3)), np.asarray(step["offset"])
            inverse = np.linalg.inv(matrix)
            self._functions += [
                _matrix(names[0], matrix, offset),
                _matrix(names[1], inverse, -inverse @ offset),
            ]
            return names
        make = {"log": _log, "gamma": _gamma, "curve": self._curve}[step["kind"]]
        for name, against in zip(names, (False, True), strict=True):
            channels = [make(step, c, bool(step["inverse"]) != against) for c in range(3)]
            self._functions.append(_curves(name, channels))
        return names

    def _curve(self, step: dict[str, Any], channel: int, backward: bool) -> str:
        """Return the lookup in samples, which are stored once for both directions."""
        curves = step["curves"]
        x, y = curves[channel if len(curves) > 1 else 0]
        samples = [*x, *y]
        if (first := _position(self.samples, samples)) < 0:
            first = len(self.samples)
            self.samples += samples
        other = first + len(x)
        start, to = (other, first) if backward else (first, other)
        return f"    return p4d_sampled(x, {start}, {to}, {len(x)});"


def _position(all_of: Sequence[float], part: Sequence[float]) -> int:
    """Return where a run of numbers begins, or -1."""
    ends = range(len(all_of) - len(part) + 1)
    return next((i for i in ends if list(all_of[i : i + len(part)]) == list(part)), -1)


def _chain(name: str, functions: Iterable[str]) -> str:
    """Return a function that calls others in turn."""
    calls = "".join(f"    c = {function}(c);\n" for function in functions)
    return f"P4D_FN p4d_rgb {name}(p4d_rgb c) {{\n{calls}    return c;\n}}"


def _matrix(name: str, matrix: Any, offset: Any) -> str:
    """Return a function of a matrix and an offset."""
    rows = [
        f"    m.{to} = "
        + " + ".join(f"{number(x)} * c.{channel}" for x, channel in zip(row, "rgb", strict=True))
        + f" + {number(more)};"
        for to, row, more in zip("rgb", matrix, offset, strict=True)
    ]
    text = "\n".join(["    p4d_rgb m;", *rows, "    return m;"])
    return f"P4D_FN p4d_rgb {name}(p4d_rgb c) {{\n{text}\n}}"


def _curves(name: str, channels: Sequence[str]) -> str:
    """Return a function for three channels, whose curves are the bodies of functions of x."""
    bodies = list(dict.fromkeys(channels))
    texts = [f"P4D_FN float {name}_{i}(float x) {{\n{body}\n}}" for i, body in enumerate(bodies)]
    calls = "".join(
        f"    c.{channel} = {name}_{bodies.index(body)}(c.{channel});\n"
        for channel, body in zip("rgb", channels, strict=True)
    )
    return "\n".join([*texts, f"P4D_FN p4d_rgb {name}(p4d_rgb c) {{\n{calls}    return c;\n}}"])


def _log(step: dict[str, Any], c: int, backward: bool) -> str:
    """Return a camera's log, or its inverse."""
    slope, offset = step["linear_slope"][c], step["linear_offset"][c]
    start, below, more = step["start"][c], step["below"][c], step["log_offset"][c]
    scale = step["log_slope"][c] / np.log2(step["base"])
    turn = scale * np.log2(slope * start + offset) + more
    if backward:
        straight = f"{number(start)} + (x - {number(turn)}) / {number(below)}"
        power = f"P4D_EXP2(P4D_MIN((x - {number(more)}) / {number(scale)}, {_LARGEST_EXPONENT}.0f))"
        curve = f"({power} - {number(offset)}) / {number(slope)}"
        return f"    if (x <= {number(turn)}) return {straight};\n    return {curve};"
    straight = f"{number(turn)} + {number(below)} * (x - {number(start)})"
    curve = f"{number(scale)} * P4D_LOG2({number(slope)} * x + {number(offset)}) + {number(more)}"
    return f"    if (x <= {number(start)}) return {straight};\n    return {curve};"


def _gamma(step: dict[str, Any], c: int, backward: bool) -> str:
    """Return a power with a straight toe, or its inverse."""
    gamma, offset = step["gamma"][c], step["offset"][c]
    end, slope = 0.0, 1.0
    if offset:
        end = offset / (gamma - 1)
        slope = gamma / (1 + offset) * ((end + offset) / (1 + offset)) ** (gamma - 1)
    if backward:
        toe = f"x / {number(slope)}"
        power = f"{number(1 + offset)} * P4D_POW(x, {number(1 / gamma)}) - {number(offset)}"
        limit = slope * end
    else:
        toe = f"{number(slope)} * x"
        power = f"P4D_POW((x + {number(offset)}) / {number(1 + offset)}, {number(gamma)})"
        limit = end
    lines = ["    float s = 1.0f;"]
    if step["mirrored"]:
        lines.append("    if (x < 0.0f) {\n        s = -1.0f;\n        x = -x;\n    }")
    lines.append(f"    if (x <= {number(limit)}) return s * ({toe});\n    return s * ({power});")
    return "\n".join(lines)
