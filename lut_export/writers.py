"""The text of LUT files. OpenColorIO writes it, as its own tools do.

CLF and CTF are lists of transforms. OpenColorIO's baker writes the other formats: it samples a
conversion between two colour spaces. Here that conversion is the shaper and the 3D LUT. The baker
samples it at the LUT's own nodes, where interpolation is exact.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from palette4d.lut_export.lut3d import Lut3D
from palette4d.lut_export.spaces import transforms

from palette4d.common.errors import Palette4dError


@dataclass(frozen=True)
class Description:
    """A file's description of itself.

    Attributes
    ----------
    identifier : a URN that is the same for the same content.
    name : a title of one line.
    lines : sentences for a reader, one per line.
    space : the encoding of the input and output colours.
    """

    identifier: str
    name: str
    lines: tuple[str, ...] = ()
    space: str = ""


Writer = Callable[[Lut3D, Description], str]


#: Letters of a line; OpenColorIO reads no CLF with some thousand in an attribute.
LONGEST = 500


def one_line(text: str) -> str:
    """Return `text` fit for a comment line or an XML value: printable, no line breaks, not long."""
    kept = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return kept if len(kept) <= LONGEST else f"{kept[:LONGEST]}…"


def lut3d(values: Any) -> Any:
    """Return OpenColorIO's transform of (N, N, N, 3) float32 values, tetrahedral."""
    import PyOpenColorIO as ocio

    transform = ocio.Lut3DTransform(gridSize=values.shape[0])
    transform.setInterpolation(ocio.INTERP_TETRAHEDRAL)
    transform.setData(np.ascontiguousarray(values, dtype=np.float32).ravel())
    transform.setFileOutputBitDepth(ocio.BIT_DEPTH_F32)
    return transform


def nodes(lut: Lut3D) -> list[Any]:
    """Return OpenColorIO's transforms of a 3D LUT: conversion, shaper, LUT, inverse conversion."""
    before, after = transforms(lut.steps)
    return [*before, *_shaped(lut), *after]


def _shaped(lut: Lut3D) -> list[Any]:
    """Return the shaper, the 3D LUT and, with a log shaper, the inverse shaper.

    With a log shaper the LUT holds shaped colours. So unedited colours also stay the same between
    nodes, however steep the curve is.
    """
    import PyOpenColorIO as ocio

    shaper = lut.shaper
    if shaper.kind == "log":
        (before,), (after,) = shaper.transforms(), shaper.transforms()
        after.setDirection(ocio.TRANSFORM_DIR_INVERSE)
        return [before, lut3d(shaper.forward(lut.values)), after]
    if shaper.kind == "linear":
        domain = ocio.RangeTransform(
            minInValue=shaper.low, maxInValue=shaper.high, minOutValue=0.0, maxOutValue=1.0
        )
        return [domain, lut3d(lut.values)]
    return [lut3d(lut.values)]


def by_transforms(format_name: str) -> Writer:
    """Return a writer of one of OpenColorIO's transform formats, CLF or CTF."""

    def write(lut: Lut3D, description: Description) -> str:
        import PyOpenColorIO as ocio

        group = ocio.GroupTransform(nodes(lut))
        metadata = group.getFormatMetadata()
        metadata.setID(description.identifier)
        metadata.setName(one_line(description.name))
        for line in description.lines:
            metadata.addChildElement(ocio.METADATA_DESCRIPTION, one_line(line))
        for element in (ocio.METADATA_INPUT_DESCRIPTOR, ocio.METADATA_OUTPUT_DESCRIPTOR):
            metadata.addChildElement(element, one_line(description.space))
        text: str = group.write(formatName=format_name, config=ocio.Config.CreateRaw())
        return text

    return write


def by_baker(format_name: str) -> Writer:
    """Return a writer of one of the formats of OpenColorIO's baker."""

    def write(lut: Lut3D, description: Description) -> str:
        import PyOpenColorIO as ocio

        config = ocio.Config.CreateRaw()
        # Not "raw": OpenColorIO does not convert data, so the 3D LUT would be the identity.
        config.addColorSpace(ocio.ColorSpace(name="before"))
        after = ocio.ColorSpace(name="after")
        steps = [*lut.shaper.transforms(), lut3d(lut.values)]
        after.setTransform(ocio.GroupTransform(steps), ocio.COLORSPACE_DIR_FROM_REFERENCE)
        config.addColorSpace(after)

        baker = ocio.Baker()
        if lut.shaper.kind != "none":
            shaped = ocio.ColorSpace(name="shaped")
            shaped.setTransform(
                ocio.GroupTransform(lut.shaper.transforms()),
                ocio.COLORSPACE_DIR_FROM_REFERENCE,
            )
            config.addColorSpace(shaped)
            baker.setShaperSpace("shaped")
            baker.setShaperSize(lut.shaper.samples())
        baker.setConfig(config)
        baker.setFormat(format_name)
        baker.setInputSpace("before")
        baker.setTargetSpace("after")
        baker.setCubeSize(lut.size)
        metadata = baker.getFormatMetadata()
        spaces = f"input {description.space}, output {description.space}"
        for line in (description.name, *description.lines, spaces, f"id {description.identifier}"):
            metadata.addChildElement(ocio.METADATA_DESCRIPTION, one_line(line))
        try:
            text: str = baker.bake()
        except ocio.Exception as error:
            raise Palette4dError(f"OpenColorIO cannot write {format_name}: {error}") from error
        return text

    return write
