"""Conversion of colours from one palette's encoding to another's."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d.colour.ocio_config import config_of_sidecar, same_encodings, space_of_encoding
from palette4d.colour.ocio_processor import ExactProcessor
from palette4d.common.errors import Palette4dError

F64 = NDArray[np.float64]
Convert = Callable[[ArrayLike], F64]

#: OpenColorIO's newest config with camera encodings.
NEWEST = "ocio://studio-config-latest"


def between(source: str, target: str, configs: Iterable[str] = ()) -> Convert | None:
    """Return the conversion of (…, 3) code values between two encodings; None if they are the same.

    Parameters
    ----------
    source, target : str
        Names of encodings; unknown counts as sRGB.
    configs : iterable of str
        OpenColorIO configs that may know them; the built-in studio config is tried last.

    Raises
    ------
    Palette4dError
        No config knows both.
    """
    source, target = ("sRGB" if name == "unknown" else name for name in (source, target))
    if target in same_encodings(source):
        return None
    for name in (*configs, NEWEST):
        try:
            config = config_of_sidecar(name, "the sidecar's config")
        except Palette4dError:
            continue  # a config of another computer
        spaces = [space_of_encoding(config, encoding) for encoding in (source, target)]
        if None not in spaces:
            own, other = (space.getName() for space in spaces if space is not None)
            return _converting(ExactProcessor(config.getProcessor(own, other)))
    raise Palette4dError(
        f"found colours in {source!r} and {target!r}, and no OpenColorIO config that knows both; "
        "expected palettes of one colour space. Analyse one of the clips again with "
        "--palette-space"
    )


def _converting(processor: Any) -> Convert:
    return lambda colours: np.asarray(processor(colours), dtype=np.float64)
