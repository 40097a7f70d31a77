"""Copies of EXR files around another picture.

OpenImageIO reads the picture. OpenEXR's own library copies the file around it, because it keeps
every type of channel and attribute.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.common.errors import WriteError
from palette4d.common.files import replacing
from palette4d.media.exr_around import Around, has_every_block
from palette4d.media.frame_writer import cannot_write, quantised

#: Compressions that lose nothing: none, RLE, ZIPS, ZIP, PIZ.
_LOSSLESS = (0, 1, 2, 3, 4)


def write_around(
    path: Path,
    around: Around,
    pixels: NDArray[np.float32],
    samples: str,
    timecode: str | None = None,
    *,
    software: str,
) -> None:
    """Write a copy of an EXR whose picture is replaced, under a temporary name, and rename it.

    Parameters
    ----------
    path : of the copy.
    around : the file and the place of the picture in it.
    pixels : (h, w, 3 or 4) float32, premultiplied; of the picture's whole data window.
    samples : "half" or "float", for the picture's channels; others keep their types.
    timecode : the frame's, `HH:MM:SS:FF`; by default the file's own.
    software : the program that made the copy.

    Raises
    ------
    WriteError
        The folder is not writable or the disk is full; no partial file remains.
    """
    import OpenEXR

    try:
        file = OpenEXR.File(str(around.file), separate_channels=True)
        channels = file.parts[around.part].channels
    except (RuntimeError, OSError, LookupError, ValueError) as error:
        raise WriteError(
            f"{path}: {around.file} cannot be copied around the picture ({error}); expected an EXR "
            "that OpenEXR reads. Render to another format, or mend the file"
        ) from error
    planes = quantised(pixels, samples)
    for index, name in enumerate(around.channels):
        channels[name].pixels = np.ascontiguousarray(planes[..., index])
    for part in file.parts:
        _lossless_rows(part.header)
        part.header["software"] = software
        if timecode is not None:
            _set_timecode(part.header, timecode)
    with replacing(path, force=True) as temporary:
        try:
            file.write(str(temporary))
        except (RuntimeError, OSError) as error:
            raise cannot_write(path, str(error)) from error
        if not has_every_block(temporary):
            raise cannot_write(path, "")


def _set_timecode(header: dict[str, Any], timecode: str) -> None:
    """Set the timecode of a part that has one; "" removes it."""
    if not timecode:
        header.pop("timeCode", None)
    elif own := header.get("timeCode"):
        numbers = [int(part) for part in re.split("[:;.]", timecode)]
        own.hours, own.minutes, own.seconds, own.frame = numbers
        own.dropFrame = timecode[8] != ":"


def _lossless_rows(header: dict[str, Any]) -> None:
    """Let a part be written in rows, by a compression without loss."""
    import OpenEXR

    header.pop("tiles", None)
    header.pop("chunkCount", None)
    if header.get("type") == OpenEXR.tiledimage:
        header["type"] = OpenEXR.scanlineimage
    if int(header["compression"]) not in _LOSSLESS:
        header["compression"] = OpenEXR.ZIP_COMPRESSION
