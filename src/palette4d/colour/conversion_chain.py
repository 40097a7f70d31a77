"""Conversions between colour spaces without OpenColorIO, and their distance from OpenColorIO's.

Input: an OpenColorIO config and the names of two of its colour spaces. Output: the chain of
matrices and curves from one to the other and back (`conversion_steps`). This module compares the
chain with OpenColorIO on probe colours. `Comparison` does so on a clip's own colours.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d import _core
from palette4d.colour.conversion_steps import ConversionError, Step, joined, steps_of
from palette4d.colour.ocio_config import failures
from palette4d.colour.ocio_processor import ExactProcessor
from palette4d.common.message import Arg

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

#: The largest difference from OpenColorIO, relative to the larger of 1 and the code value. Rounding
#: in single precision is allowed on top: two bits of the input, which a gamma enlarges near 0.
TOLERANCE = 1e-5

#: A colour is beyond the encoding if OpenColorIO's round trip changes it by more than this.
_COMES_BACK = 2e-6


@dataclass(frozen=True)
class Conversion:
    """A chain, and its distance from OpenColorIO.

    Attributes
    ----------
    steps : the steps in a sidecar's form.
    chain : applies the steps.
    error : the largest |a - b| / max(|b|, 1) between the chain and OpenColorIO in both directions,
        less the error of single precision. Colours that OpenColorIO cannot invert do not count.
    """

    steps: list[Step]
    chain: _core.ColourConversion
    error: float


def conversion(config: Any, source: str, target: str) -> Conversion:
    """Return the chain from one colour space of a config to another."""
    try:
        forward = ExactProcessor(config.getProcessor(source, target))
        backward = ExactProcessor(config.getProcessor(target, source))
    except failures() as error:
        raise ConversionError(
            f"OpenColorIO cannot convert {source!r} to {target!r} and back: {error}; choose "
            f"another {Arg('palette_space')}"
        ) from error
    steps: list[Step] = []
    for transform in forward.transforms():
        try:
            steps += steps_of(transform)
        except ConversionError as error:
            raise ConversionError(
                f"from {source!r} to {target!r}: {error}; expected matrices and curves of one "
                f"channel only, which have an inverse. Choose another {Arg('palette_space')}, or "
                "convert the clip first"
            ) from error
    steps = list(joined(steps))
    chain = _core.ColourConversion(json.dumps(steps), f"{source} to {target}")
    scene = [_is_scene_linear(config, name) for name in (source, target)]
    worst = max(
        _difference(_Way(chain.to_palette, scene[0]), forward, backward, _probes(scene[0])),
        _difference(_Way(chain.to_clip, scene[1]), backward, forward, _probes(scene[1])),
    )
    if worst > TOLERANCE:
        raise ConversionError(
            f"from {source!r} to {target!r}: found a difference of {worst:.2g} between matrices "
            f"and curves and OpenColorIO, expected at most {TOLERANCE:g}; choose another "
            f"{Arg('palette_space')}, or convert the clip first"
        )
    return Conversion(steps, chain, worst)


class Comparison:
    """The distance of a chain from OpenColorIO on a clip's own colours."""

    def __init__(self, config: Any, source: str, target: str, chain: _core.ColourConversion):
        self._forward = ExactProcessor(config.getProcessor(source, target))
        self._backward = ExactProcessor(config.getProcessor(target, source))
        self._there = _Way(chain.to_palette, _is_scene_linear(config, source))
        self._back = _Way(chain.to_clip, _is_scene_linear(config, target))
        self.colours = 0  #: number of compared colours
        self.beyond = 0  #: number of colours beyond the encoding, which OpenColorIO does not invert
        self.error = 0.0  #: the largest error of the other colours, in both directions

    def add(self, colours: F32) -> None:
        """Compare (n, 3) finite colours of the clip."""
        there = self._forward(colours)
        back = self._backward(there)
        inside = _comes_back(back, colours)
        self.colours += len(colours)
        # Colours whose round trip fails only by rounding are inside the encoding.
        lost, reached = colours[~inside], there[~inside]
        self.beyond += int((~_comes_back(back[~inside], lost, self._back.rounding(reached))).sum())
        if inside.any():
            kept, reached = colours[inside], there[inside]
            self.error = max(
                self.error,
                _worst(self._there, kept, reached),
                _worst(self._back, reached, back[inside]),
            )


def _is_scene_linear(config: Any, name: str) -> bool:
    return bool(config.getColorSpace(name).getEncoding() == "scene-linear")


def _probes(scene_linear: bool) -> F32:
    """Return (n, 3) colours: neutral ones, each channel alone, and mixtures."""
    if scene_linear:
        light = np.concatenate([[0.0], np.exp2(np.linspace(-20, np.log2(65504), 1600))])
        ramp = np.concatenate([-light[:-1:8], light])
    else:
        ramp = np.linspace(-0.25, 1.5, 3501)
    random = np.random.default_rng(1234)
    mixed = np.repeat(ramp[:, None], 3, axis=1)
    mixed = mixed * random.uniform(0.2, 1, mixed.shape)
    alone = [ramp[:, None] * axis for axis in np.eye(3)]
    neutral = np.repeat(ramp[:, None], 3, axis=1)
    return np.concatenate([neutral, mixed, *alone]).astype(np.float32)


class _Way:
    """A chain in one direction, and the rounding of OpenColorIO's single precision."""

    def __init__(self, apply: Callable[[ArrayLike], F64], scene_linear: bool) -> None:
        self.apply = apply
        # The constants of an encoding are about 1, so code values near 0 have the same precision.
        self._least = 0.0 if scene_linear else 1.0

    def rounding(self, colours: F32) -> F64:
        """Return how far two bits in each channel move the result, (n, 3) -> (n, 3).

        These are the last bits of the colour's largest channel, because matrices mix the channels.
        In an encoding they are at least the last bits of 1.
        """
        exact = self.apply(colours)
        moved = np.zeros_like(exact)
        with np.errstate(invalid="ignore", over="ignore"):
            size = np.maximum(np.abs(colours).max(axis=1, keepdims=True), self._least)
            for shift in size.astype(np.float64) * 2.0**-22 * np.eye(3)[:, None]:
                up, down = (np.abs(self.apply(colours + s) - exact) for s in (shift, -shift))
                moved += np.maximum(up, down)
        return moved


def _comes_back(back: F32, colours: F32, rounding: F64 | float = 0.0) -> NDArray[np.bool_]:
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.abs(back - colours)
        near = off <= _COMES_BACK * np.maximum(np.abs(colours), 1) + rounding
    return np.asarray(near.all(axis=1) & np.isfinite(back).all(axis=1))


def _difference(
    way: _Way, forward: ExactProcessor, backward: ExactProcessor, colours: F32
) -> float:
    there = forward(colours)
    inside = _comes_back(backward(there), colours) & np.isfinite(there).all(axis=1)
    if not inside.any():
        return float("inf")
    return _worst(way, colours[inside], there[inside])


def _worst(way: _Way, colours: F32, expected: F32) -> float:
    """Return the largest |a - b| / max(|b|, 1) beyond single precision."""
    a, b = way.apply(colours), expected.astype(np.float64)
    off = np.maximum(np.abs(a - b) - way.rounding(colours), 0) / np.maximum(np.abs(b), 1)
    return float(off.max())
