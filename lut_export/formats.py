"""The files a lattice can be written to, all through OpenColorIO, and reading them back.

A format is one entry of `FORMATS`; a writer gets a lattice and its `Description` and returns the
file's text. OpenColorIO does the writing, so that what other programs get is what OpenColorIO's own
tools would have written.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.errors import Palette4dError
from palette4d.lut_export.lattice import Lattice

F32 = NDArray[np.float32]

#: The names of OpenColorIO's constants, so that this module can be imported without it.
INTERPOLATIONS = {"linear": "INTERP_LINEAR", "tetrahedral": "INTERP_TETRAHEDRAL"}


@dataclass(frozen=True)
class Description:
    """What a file says about itself.

    Attributes
    ----------
    identifier : str
        A URN that is the same for the same table.
    name : str
        One line: what it is.
    lines : tuple of str
        Sentences for a reader, a line each.
    input_space, output_space : str
        The encoding of the colours that go in and come out.
    info : dict
        Nested names and values for programs; where the format allows them.
    """

    identifier: str
    name: str
    lines: tuple[str, ...] = ()
    input_space: str = ""
    output_space: str = ""
    info: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class LutFormat:
    """A file format.

    Attributes
    ----------
    name : str
        For messages and ``--json``.
    extension : str
        With the dot, lower case.
    interpolations : tuple of str
        How readers may interpolate between nodes: one when the file says which, otherwise all that
        hosts use; an error is stated for each.
    rounding : str
        The precision of the file's numbers.
    write : callable
        (lattice, description) -> the file's text.
    """

    name: str
    extension: str
    interpolations: tuple[str, ...]
    rounding: str
    write: Callable[[Lattice, Description], str]


def one_line(text: str) -> str:
    """Return `text` fit for a comment line or an XML value: printable, no line breaks."""
    kept = "".join(c if c.isprintable() else " " for c in text)
    return " ".join(kept.split())


def _transform(lattice: Lattice) -> Any:
    import PyOpenColorIO as ocio

    if (lattice.low, lattice.high) != (0.0, 1.0):
        raise Palette4dError(
            f"a lattice over {lattice.low}..{lattice.high} needs a shaper, which this format's "
            "writer does not have; use the domain 0..1"
        )
    transform = ocio.Lut3DTransform(gridSize=lattice.size)
    transform.setInterpolation(ocio.INTERP_TETRAHEDRAL)
    transform.setData(np.ascontiguousarray(lattice.values, dtype=np.float32).ravel())
    transform.setFileOutputBitDepth(ocio.BIT_DEPTH_F32)
    return transform


def write_resolve_cube(lattice: Lattice, description: Description) -> str:
    """Return a Resolve .cube: comment lines, LUT_3D_SIZE, six decimals, red fastest.

    OpenColorIO's baker samples a conversion between two colour spaces; here the conversion is the
    lattice itself, sampled at its own nodes, where interpolation returns the node's value.
    """
    import PyOpenColorIO as ocio

    config = ocio.Config.CreateRaw()
    # Not "raw": a data space takes part in no conversion and the table would be the identity.
    config.addColorSpace(ocio.ColorSpace(name="before"))
    after = ocio.ColorSpace(name="after")
    after.setTransform(_transform(lattice), ocio.COLORSPACE_DIR_FROM_REFERENCE)
    config.addColorSpace(after)

    baker = ocio.Baker()
    baker.setConfig(config)
    baker.setFormat("resolve_cube")
    baker.setInputSpace("before")
    baker.setTargetSpace("after")
    baker.setCubeSize(lattice.size)
    metadata = baker.getFormatMetadata()
    spaces = f"input {description.input_space}, output {description.output_space}"
    for line in (description.name, *description.lines, spaces, f"id {description.identifier}"):
        metadata.addChildElement(ocio.METADATA_DESCRIPTION, one_line(line))
    text: str = baker.bake()
    return text


def write_clf(lattice: Lattice, description: Description) -> str:
    """Return an Academy/ASC Common LUT Format file: one tetrahedral LUT3D and its metadata."""
    import PyOpenColorIO as ocio

    transform = _transform(lattice)
    group = ocio.GroupTransform([transform])
    metadata = group.getFormatMetadata()
    metadata.setID(description.identifier)
    metadata.setName(one_line(description.name))
    for line in description.lines:
        metadata.addChildElement(ocio.METADATA_DESCRIPTION, one_line(line))
    metadata.addChildElement(ocio.METADATA_INPUT_DESCRIPTOR, one_line(description.input_space))
    metadata.addChildElement(ocio.METADATA_OUTPUT_DESCRIPTOR, one_line(description.output_space))
    if description.info:
        metadata.addChildElement(ocio.METADATA_INFO, "")
        _add_info(_last_child(metadata), description.info)
    text: str = group.write(
        formatName="Academy/ASC Common LUT Format", config=ocio.Config.CreateRaw()
    )
    return text


def _last_child(metadata: Any) -> Any:
    return list(metadata.getChildElements())[-1]


def _add_info(element: Any, info: dict[str, Any]) -> None:
    for name, value in info.items():
        if isinstance(value, dict):
            element.addChildElement(name, "")
            _add_info(_last_child(element), value)
        else:
            element.addChildElement(name, one_line(str(value)))


FORMATS = (
    LutFormat(
        name="Resolve .cube",
        extension=".cube",
        # The file does not say how to interpolate; hosts offer either.
        interpolations=("linear", "tetrahedral"),
        rounding="six decimals, 5e-7",
        write=write_resolve_cube,
    ),
    LutFormat(
        name="Academy/ASC Common LUT Format",
        extension=".clf",
        interpolations=("tetrahedral",),
        rounding="32-bit float",
        write=write_clf,
    ),
)


def format_of(path: Path) -> LutFormat:
    """Return the format that a file name's extension stands for.

    Raises
    ------
    Palette4dError
        The extension is not known; the message lists those that are.
    """
    extension = path.suffix.lower()
    for known in FORMATS:
        if known.extension == extension:
            return known
    listed = ", ".join(f"{f.extension} ({f.name})" for f in FORMATS)
    found = f"the extension {path.suffix!r}" if path.suffix else "no extension"
    raise Palette4dError(f"{path}: found {found}; expected one of {listed}")


class LoadedLut:
    """A LUT file as OpenColorIO applies it, read anew.

    Parameters
    ----------
    path : Path
        The file.
    interpolation : str
        "linear" or "tetrahedral"; a file that names its own keeps that.

    Raises
    ------
    Palette4dError
        OpenColorIO cannot read the file.
    """

    def __init__(self, path: Path, interpolation: str) -> None:
        """Read the file."""
        import PyOpenColorIO as ocio

        # OpenColorIO remembers files by name: what was at this name before must be forgotten.
        ocio.ClearAllCaches()
        transform = ocio.FileTransform(
            src=str(path.absolute()),
            interpolation=getattr(ocio, INTERPOLATIONS[interpolation]),
        )
        try:
            # An empty context: with the environment's, a "$HOME" in a folder's name is replaced.
            processor = ocio.Config.CreateRaw().getProcessor(
                ocio.Context(), transform, ocio.TRANSFORM_DIR_FORWARD
            )
            # Lossless: no step may be replaced by an approximation, the error is the file's own.
            self._processor = processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)
        except (ocio.Exception, ocio.ExceptionMissingFile) as error:
            raise Palette4dError(f"{path}: OpenColorIO cannot read it: {error}") from error

    def apply(self, colours: F32) -> F32:
        """Return the (…, 3) float32 colours that replace the (…, 3) float32 `colours`."""
        result = np.array(colours, dtype=np.float32, order="C")
        self._processor.applyRGB(result.reshape(1, -1, 3))
        return result
