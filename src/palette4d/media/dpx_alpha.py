"""The last alpha of a line in DPX files of 10 bits, for which OpenImageIO returns 0 or any value.

Three samples fill a word of 32 bits (SMPTE ST 268). A line of RGBA may leave one for its last word:
OpenImageIO writes it into the word's highest bits, where the first sample belongs.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: The first image element: where in the file its descriptor is, and after three bytes that say
#: nothing here its packing, encoding, offset and padding of lines.
_ELEMENT, _FIELDS, _RGBA = 800, "BxxxHHII", 51
#: How far right the first of three samples is, by the packing: filled by method A, and B.
_SHIFTS = {1: 22, 2: 20}


def with_last(samples: NDArray[Any], path: Path, bits: int, top: int = 0) -> NDArray[Any]:
    """Return the samples (h, w, c) that were read from a file, with the last alpha of each line.

    `bits` is the depth that the file states, and `top` the first line that was read. Samples of 10
    bits are the upper ones of 16, and repeated below.
    """
    height, width, channels = samples.shape
    if bits != 10 or channels != 4 or width % 3 != 1 or path.suffix.lower() != ".dpx":
        return samples
    with path.open("rb") as file:
        order = ">" if file.read(4) == b"SDPX" else "<"
        file.seek(_ELEMENT)
        fields = file.read(struct.calcsize(order + _FIELDS))
        if len(fields) < struct.calcsize(order + _FIELDS):
            return samples
        descriptor, packing, encoding, offset, padding = struct.unpack(order + _FIELDS, fields)
        stored_so = descriptor == _RGBA and packing in _SHIFTS and encoding == 0
        if not stored_so or padding % 4 or padding > 1 << 16:
            return samples
        words = (width * channels + 2) // 3
        line = words + padding // 4
        file.seek(offset + 4 * line * top)
        lines = np.fromfile(file, order + "u4", line * height)
    if lines.size < line * height:
        return samples
    last = lines.reshape(height, line)[:, words - 1]
    alpha = (last >> _SHIFTS[packing] & 0x3FF).astype(np.uint16)
    mended = samples.copy()
    mended[:, -1, -1] = alpha << 6 | alpha >> 4
    return mended
