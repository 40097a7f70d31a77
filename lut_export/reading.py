"""Files read back through OpenColorIO, as a host reads them."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from palette4d.colour.ocio_config import failures
from palette4d.colour.ocio_processor import ExactProcessor
from palette4d.common.errors import Palette4dError

F32 = NDArray[np.float32]

#: How hosts may read a file: a name for people, then the settings of OpenColorIO's FileTransform.
#: The names of its constants, so that this module can be imported without it.
READINGS = {
    "linear": ("interpolation", "INTERP_LINEAR"),
    "tetrahedral": ("interpolation", "INTERP_TETRAHEDRAL"),
    "clamped": ("cdlStyle", "CDL_ASC"),
    "not clamped": ("cdlStyle", "CDL_NO_CLAMP"),
}


def load(path: Path, readings: Iterable[str]) -> dict[str, "LoadedLut"]:
    """Read a file anew, once, for several of `READINGS`.

    Raises
    ------
    Palette4dError
        OpenColorIO cannot read the file.
    """
    import PyOpenColorIO as ocio

    # OpenColorIO remembers files by name: what was at this name before must be forgotten.
    ocio.ClearAllCaches()
    return {name: LoadedLut(path, name) for name in readings}


class LoadedLut:
    """A file as OpenColorIO applies it; `load` makes them.

    Parameters
    ----------
    path : Path
        The file.
    reading : str
        One of `READINGS`. A table that names its own interpolation keeps that.

    Raises
    ------
    Palette4dError
        OpenColorIO cannot read the file.
    """

    def __init__(self, path: Path, reading: str) -> None:
        """Read the file."""
        import PyOpenColorIO as ocio

        setting, value = READINGS[reading]
        transform = ocio.FileTransform(src=str(path.absolute()))
        if setting == "cdlStyle":
            transform.setCDLStyle(getattr(ocio, value))
        else:
            transform.setInterpolation(getattr(ocio, value))
        try:
            # An empty context: with the environment's, a "$HOME" in a folder's name is replaced.
            processor = ocio.Config.CreateRaw().getProcessor(
                ocio.Context(), transform, ocio.TRANSFORM_DIR_FORWARD
            )
            # The error shall be the file's own.
            self._processor = ExactProcessor(processor)
        except failures() as error:
            raise Palette4dError(f"{path}: OpenColorIO cannot read it: {error}") from error

    def apply(self, colours: F32) -> F32:
        """Return the (…, 3) float32 colours that replace the (…, 3) float32 `colours`."""
        return self._processor(colours)
