"""The ASC CDL nearest to the edit at one time, for hosts without LUTs.

A CDL is ten numbers: slope, offset and power for each channel, and a saturation (ASC CDL 1.2). A
least-squares fit of the relative error (`bake_error`) finds them. It uses the clip's colours at
that time, or the dense grid without a clip. The remaining error is stated as for a 3D LUT.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.bake_error import FLOOR
from palette4d.lut_export.frame_edit import FrameEdit
from palette4d.lut_export.writers import Description, one_line

from palette4d.common.errors import Arg, Palette4dError

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

#: The luma weights of ASC CDL 1.2 (those of Rec.709).
LUMA = np.array([0.2126, 0.7152, 0.0722])

#: The fit uses at most about this many of the given colours, evenly spread.
FITTED = 10_000

#: Decimal places of the ten numbers.
DIGITS = 6

#: OpenColorIO's names of the formats.
_WRITTEN_AS = {
    "cc": "ColorCorrection",
    "ccc": "ColorCorrectionCollection",
    "cdl": "ColorDecisionList",
}

#: The numbers of a correction in the text that OpenColorIO writes.
_NUMBERS = re.compile(r"(?<=>)[^<>]+(?=</(?:Slope|Offset|Power|Saturation)>)")

_ESCAPED = str.maketrans({"&": "+", "<": "(", ">": ")", '"': "\u201d", "'": "\u2019"})

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Cdl:
    """out = sat(max(in * slope + offset, 0) ** power); the default changes nothing."""

    slope: Triple = (1.0, 1.0, 1.0)
    offset: Triple = (0.0, 0.0, 0.0)
    power: Triple = (1.0, 1.0, 1.0)
    saturation: float = 1.0

    def apply(self, colours: F64) -> F64:
        """Return (n, 3) results for (n, 3) colours, not clamped; power skips negatives."""
        return _apply(np.array([*self.slope, *self.offset, *self.power, self.saturation]), colours)


def _apply(numbers: F64, colours: F64) -> F64:
    linear = colours * numbers[0:3] + numbers[3:6]
    powered = np.maximum(linear, 0) ** numbers[6:9] + np.minimum(linear, 0)
    luma = (powered @ LUMA)[:, None]
    return np.asarray(luma + numbers[9] * (powered - luma))


def fit(edit: FrameEdit, colours: F32) -> Cdl:
    """Return the CDL nearest to an edit on (h, w, 3) float32 colours; only finite ones count."""
    if edit.identity:
        return Cdl()
    from scipy.optimize import least_squares

    flat = colours.reshape(-1, 3)
    flat = flat[np.isfinite(flat).all(axis=1)]
    points = flat[:: max(1, len(flat) // FITTED)].astype(np.float64)
    if len(points) < 4:
        return Cdl()
    wanted = edit.exact(points)
    scale = np.maximum(np.abs(wanted), FLOOR)

    def solved(goal: F64) -> F64:
        def residual(numbers: F64) -> F64:
            return ((_apply(numbers, points) - goal) / scale).ravel()

        found: F64 = least_squares(residual, start, bounds=(low, high), max_nfev=200).x
        return found

    def seen(numbers: F64) -> float:
        off = np.maximum(_apply(numbers, points), 0) - np.maximum(wanted, 0)
        return float((np.abs(off) / scale).mean())

    start = np.array([1.0] * 3 + [0.0] * 3 + [1.0] * 3 + [1.0])
    # The standard forbids negative slope, power and saturation; powers near 0 make steps.
    low = np.array([0.0] * 3 + [-10.0] * 3 + [0.1] * 3 + [0.0])
    high = np.array([100.0] * 3 + [10.0] * 3 + [10.0] * 3 + [10.0])
    solutions = [solved(wanted)]
    if (wanted < 0).any():
        # Below 0 a CDL gets by large offsets without saturation, which other colours pay for.
        solutions.append(solved(np.maximum(wanted, 0)))
    rounded = [round(float(value), DIGITS) + 0.0 for value in min(solutions, key=seen)]
    return Cdl(_triple(rounded[0:3]), _triple(rounded[3:6]), _triple(rounded[6:9]), rounded[9])


def _triple(values: list[float]) -> Triple:
    r, g, b = values
    return (r, g, b)


def _unescaped(text: str) -> str:
    """Return one line without the characters that OpenColorIO's CDL writer escapes twice."""
    return one_line(text).translate(_ESCAPED)


def write(cdl: Cdl, format_name: str, shot: str, description: Description) -> str:
    """Return the text of a .cc, .ccc or .cdl file (`format_name` without the dot).

    `shot` becomes the correction's id, by which a host finds it in a collection.
    """
    import PyOpenColorIO as ocio

    transform = _transform(cdl, shot)
    metadata = transform.getFormatMetadata()
    metadata.addChildElement("InputDescription", _unescaped(description.space))
    for line in (description.name, *description.lines, f"id {description.identifier}"):
        metadata.addChildElement(ocio.METADATA_DESCRIPTION, _unescaped(line))
    return _text([transform], _WRITTEN_AS[format_name])


def collection(shots: Mapping[str, Cdl]) -> str:
    """Return the text of a .ccc with a correction for each shot, whose id is the shot's name."""
    return _text([_transform(cdl, name) for name, cdl in shots.items()], _WRITTEN_AS["ccc"])


def read(path: Path) -> Cdl:
    """Return the first correction of a .cc, .ccc or .cdl file."""
    import PyOpenColorIO as ocio

    try:
        transform: Any = ocio.CDLTransform.CreateFromFile(str(path), "")
    except ocio.Exception as error:
        raise Palette4dError(
            f"{path}: no CDL can be read ({error}); export it again with {Arg('force', True)}"
        ) from error
    return Cdl(
        _triple(transform.getSlope()),
        _triple(transform.getOffset()),
        _triple(transform.getPower()),
        float(transform.getSat()),
    )


def _transform(cdl: Cdl, shot: str) -> Any:
    import PyOpenColorIO as ocio

    transform: Any = ocio.CDLTransform()
    transform.setSlope(list(cdl.slope))
    transform.setOffset(list(cdl.offset))
    transform.setPower(list(cdl.power))
    transform.setSat(cdl.saturation)
    transform.setID(_unescaped(shot))
    return transform


def _text(transforms: list[Any], format_name: str) -> str:
    import PyOpenColorIO as ocio

    group = ocio.GroupTransform(transforms)
    text = str(group.write(formatName=format_name, config=ocio.Config.CreateRaw()))
    return _NUMBERS.sub(_rounded, text)


def _rounded(numbers: re.Match[str]) -> str:
    """Return numbers without the last digits, which are only rounding of binary floats."""
    return " ".join(f"{float(number):.9g}" for number in numbers[0].split())
