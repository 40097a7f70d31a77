"""The colour space of a baked file's input and output.

The palette, the clip and the file may each have a different colour space. CLF and CTF hold a list
of transforms: there the 3D LUT is in the palette's colour space, with conversions before and after
it. In all other formats the 3D LUT contains the conversions.
"""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.colour.conversion_chain import conversion
from palette4d.colour.conversion_steps import Step
from palette4d.colour.ocio_config import (
    chosen_config,
    colour_space,
    config_of_sidecar,
    space_of_encoding,
)
from palette4d.common.errors import Arg, Palette4dError

F32 = NDArray[np.float32]

#: Names of the two spaces that every sidecar has.
INPUT, PALETTE = "input", "palette"


@dataclass(frozen=True)
class BakeSpace:
    """The colour space of a file.

    Attributes
    ----------
    name : the name for the file's metadata.
    steps : the conversion to the palette's colour space; empty if they are the same.
    chain : applies the steps; None without steps.
    clip : from the clip's colour space to the palette's; None if they are the same.
    """

    name: str
    steps: tuple[Step, ...] = ()
    chain: _core.ColourConversion | None = None
    clip: _core.ColourConversion | None = None

    def of_clip(self, colours: F32) -> F32:
        """Return (h, w, 3) float32 colours of the clip in this space."""
        if self.chain is self.clip:
            return colours
        palette = colours if self.clip is None else self.clip.to_palette(colours)
        return self.of_palette(palette).astype(np.float32)

    def of_palette(self, colours: NDArray[Any]) -> NDArray[Any]:
        """Return (..., 3) colours of the palette's space in this space."""
        return colours if self.chain is None else self.chain.to_clip(colours)

    def to_palette(self, colours: F32) -> F32:
        """Return (..., 3) colours of this space in the palette's space."""
        return colours if self.chain is None else self.chain.to_palette(colours).astype(np.float32)


def space_of(
    data: bytes, sidecar: _core.Sidecar, wanted: str, config_name: str | None
) -> BakeSpace:
    """Return the space "input" (of the clip), "palette", or a colour space of the config.

    `data` is the sidecar's JSON text. Without `config_name` the sidecar's config is used, else
    ``$OCIO``, else the built-in one.
    """
    encoding = str(sidecar.clip["encoding"])
    own = sidecar.conversion
    clip = None if own is None or own.steps.identity else own.steps
    if wanted == PALETTE or (wanted == INPUT and clip is None):
        return BakeSpace(encoding, clip=clip)
    if wanted == INPUT:
        assert own is not None
        steps = json.loads(data)["clip"]["conversion"]["steps"]
        return BakeSpace(own.input_space, tuple(steps), clip, clip)
    if config_name is None and own is not None:
        config_name = own.config
        config = config_of_sidecar(config_name, f"{Arg('ocio_config')}")
    else:
        config, config_name = chosen_config(config_name)
    name = str(colour_space(config, config_name, wanted, Arg("space", wanted)).getName())
    palette = space_of_encoding(config, encoding)
    if palette is None:
        raise Palette4dError(
            f"the sidecar's palette is in {encoding!r}, which {config_name} does not know, so that "
            f"it cannot be converted; analyse with {Arg('input_space')}, or name the config that "
            f"knows it with {Arg('ocio_config')}"
        )
    made = conversion(config, name, str(palette.getName()))
    if not made.steps:
        return BakeSpace(name, clip=clip)
    return BakeSpace(name, tuple(made.steps), made.chain, clip)


def transforms(steps: tuple[Step, ...]) -> tuple[list[Any], list[Any]]:
    """Return OpenColorIO's transforms of the steps, and of their inverse."""
    there = [_transform(step, back=False) for step in steps]
    return there, [_transform(step, back=True) for step in reversed(steps)]


def _transform(step: Step, back: bool) -> Any:
    import PyOpenColorIO as ocio

    inverse = (step.get("direction") == "inverse") != back
    direction = ocio.TRANSFORM_DIR_INVERSE if inverse else ocio.TRANSFORM_DIR_FORWARD
    if step["kind"] == "matrix":
        matrix: Any = np.eye(4)
        offset: Any = np.zeros(4)
        matrix[:3, :3], offset[:3] = step["matrix"], step["offset"]
        if back:
            matrix = np.linalg.inv(matrix)
            offset = -matrix @ offset
        return ocio.MatrixTransform(matrix.ravel(), offset)
    if step["kind"] == "log":
        return ocio.LogCameraTransform(
            linSideBreak=step["start"],
            base=step["base"],
            logSideSlope=step["log_slope"],
            logSideOffset=step["log_offset"],
            linSideSlope=step["linear_slope"],
            linSideOffset=step["linear_offset"],
            linearSlope=step["below"],
            direction=direction,
        )
    if step["kind"] == "gamma" and not any(step["offset"]):
        style = ocio.NEGATIVE_MIRROR if step["negative"] == "mirror" else ocio.NEGATIVE_PASS_THRU
        return ocio.ExponentTransform([*step["gamma"], 1.0], style, direction)
    if step["kind"] == "gamma" and all(step["offset"]):
        style = ocio.NEGATIVE_MIRROR if step["negative"] == "mirror" else ocio.NEGATIVE_LINEAR
        return ocio.ExponentWithLinearTransform(
            [*step["gamma"], 1.0], [*step["offset"], 0.0], style, direction
        )
    return _half_lut(step, back)


def _half_lut(step: Step, back: bool) -> Any:
    """Return a 1D LUT over all half floats: their spacing suits every curve."""
    import PyOpenColorIO as ocio

    chain = _core.ColourConversion(json.dumps([step]))
    halves = np.arange(65536, dtype=np.uint16).view(np.float16).astype(np.float64)
    largest = float(np.finfo(np.float16).max)
    ramp = np.repeat(
        np.nan_to_num(halves, nan=0, posinf=largest, neginf=-largest)[:, None], 3, axis=1
    )
    values = chain.to_clip(ramp) if back else chain.to_palette(ramp)
    lut = ocio.Lut1DTransform(length=65536, inputHalfDomain=True)
    lut.setFileOutputBitDepth(ocio.BIT_DEPTH_F32)
    lut.setData(np.clip(values, -3e38, 3e38).astype(np.float32).ravel())
    return lut
