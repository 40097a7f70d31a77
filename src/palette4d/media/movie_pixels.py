"""The pixels of a decoded picture: its samples as R'G'B'(A), upright, or in an analysis' bins.

Y'CbCr is converted in floating point with the stream's own matrix and range, and is not clamped:
limited range has room below black and above white, and colours beyond R'G'B' 0..1 between.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.media.clip_base import F32, all_hidden
from palette4d.media.colour_tags import LUMA_WEIGHTS
from palette4d.media.pyav import Type, av

_LIMITED_RANGE, FULL_RANGE = 1, 2
_GREYS = ("gray", "gray10le", "gray12le", "gray16le")
_PLANAR_DEPTHS = (8, 9, 10, 12, 14, 16)
#: Prefixes of the names of Y'CbCr layouts.
_LUMA_CHROMA = ("yuv", "nv", "p0", "p2", "p4", "yuyv", "uyvy", "yvyu", "y2", "xv", "v")
#: Pixels of a strip that is converted at once: it stays in the processor's cache.
_STRIP = 30_000


def _newer(cls: type[Type], value: int) -> Type:
    """Return a member for a type that PyAV does not know, such as Exif.

    Else PyAV raises an error for all side data of the frame, its display matrix too.
    """
    made: Any = object.__new__(cls)
    made._value_, made._name_ = value, f"TYPE_{value}"
    return cast(Type, made)


Type._missing_ = classmethod(_newer)  # type: ignore[assignment] # mypy: no method is assigned


def side_data(picture: av.VideoFrame) -> dict[Type, bytes]:
    """Return what stands beside a picture, by its kind."""
    every: Any = picture.side_data
    # PyAV lists the kinds since 19, before it the data.
    entries = [every[entry] if isinstance(entry, Type) else entry for entry in every]
    return {entry.type: bytes(entry) for entry in entries}


def turn(picture: av.VideoFrame) -> tuple[bool, bool, bool]:
    """Return how the display matrix turns a picture: (transposed, mirrored, upside down).

    Mirrored and upside down are about the picture after it is transposed. The matrix has the rows
    (a, b, u), (c, d, v), (x, y, w): the point (x, y) is shown at (ax + cy, bx + dy).
    """
    stated = side_data(picture).get(Type.DISPLAYMATRIX)
    if stated is None:
        return False, False, False
    a, b, _, c, d = np.frombuffer(stated, "=i4")[:5].tolist()
    if abs(a) + abs(d) >= abs(b) + abs(c):
        return False, a < 0, d < 0
    return True, c < 0, b < 0


def upright(pixels: F32, picture: av.VideoFrame) -> F32:
    """Return the pixels (h, w, c) of a picture as its display matrix shows them."""
    transposed, mirrored, upside_down = turn(picture)
    if transposed:
        pixels = pixels.swapaxes(0, 1)
    across, down = -1 if mirrored else 1, -1 if upside_down else 1
    return np.ascontiguousarray(pixels[::down, ::across])


def shape_of(picture: av.VideoFrame) -> tuple[int, int, int]:
    """(h, w, 3 or 4) of its pixels, upright."""
    size = (picture.height, picture.width)
    return (*(size[::-1] if turn(picture)[0] else size), 4 if has_alpha(picture) else 3)


def has_alpha(picture: av.VideoFrame) -> bool:
    """Whether a picture has an alpha channel, or a palette of colours that may have one."""
    layout = picture.format
    return layout.has_palette or any(component.is_alpha for component in layout.components)


def _bits(picture: av.VideoFrame) -> int:
    return max(component.bits for component in picture.format.components)


def _thinned(picture: av.VideoFrame, step: int) -> list[NDArray[Any]]:
    """Every `step`-th row of Y', Cb and Cr, each as wide as the picture.

    In a large picture chroma comes from the nearest sample, because filtering would cost more than
    decoding.
    """
    samples = np.uint8 if _bits(picture) == 8 else np.uint16
    if step == 1 or len(picture.planes) != 3:
        return [_plane(plane, samples)[step // 2 :: step] for plane in _full_chroma(picture).planes]
    rows = np.arange(step // 2, picture.height, step)
    planes = []
    for plane in picture.planes:
        lines = _plane(plane, samples)[_chroma_rows(picture, plane, rows)]
        wide = np.repeat(lines, -(-picture.width // plane.width), axis=1)
        planes.append(wide[:, : picture.width])
    return planes


def _chroma_rows(picture: av.VideoFrame, plane: Any, rows: NDArray[Any]) -> NDArray[Any]:
    """The nearest row of a plane for each row of a picture, in its own field if interlaced."""
    if picture.interlaced_frame and plane.height < picture.height:
        return np.asarray(np.minimum(rows // 4 * 2 + rows % 2, plane.height - 1))
    return np.asarray(rows * plane.height // picture.height)


def picture_pixels(picture: av.VideoFrame) -> F32:
    """(h, w, 3 or 4) float32 R'G'B'(A) of a decoded picture, alpha straight.

    libswscale only scales chroma to full size, because its conversion rounds. Without a stated
    range Y'CbCr is limited.
    """
    packed = _packed(picture)
    if packed is not None:
        return packed.astype(np.float32) / np.float32(255)
    bits = _bits(picture)
    kind = np.uint8 if bits == 8 else np.uint16
    if picture.format.name in _GREYS:
        limited = int(picture.color_range) == _LIMITED_RANGE
        unit = 1 << (bits - 8)
        black, white = (16 * unit, 219 * unit) if limited else (0, (1 << bits) - 1)
        grey = _plane(picture.planes[0], kind).astype(np.float32)
        grey = (grey - np.float32(black)) / np.float32(white)
        return np.repeat(grey[..., None], 3, axis=2)
    if picture.format.is_rgb and bits in _PLANAR_DEPTHS:
        alpha = "a" if has_alpha(picture) else ""
        planar = _to(picture, f"gbr{alpha}p{bits}le")
        green, blue, red, *rest = [_plane(plane, kind) for plane in planar.planes]
        samples = np.stack([red, green, blue, *rest], axis=-1)
        return samples.astype(np.float32) / np.float32((1 << bits) - 1)
    if is_luma_chroma(picture):
        return _from_luma_chroma(picture)
    wide = _to(picture, "rgba64le" if has_alpha(picture) else "rgb48le").to_ndarray()
    return wide.astype(np.float32) / np.float32(65535)


def _packed(picture: av.VideoFrame) -> NDArray[np.uint8] | None:
    """(h, w, 3 or 4) samples of R'G'B' of up to 8 bits; None for everything else."""
    layout = picture.format
    if not (layout.is_rgb or layout.has_palette) or _bits(picture) > 8:
        return None
    packed = _to(picture, "rgba" if has_alpha(picture) else "rgb24").to_ndarray()
    return np.asarray(packed, np.uint8)


def _to(picture: av.VideoFrame, layout: str) -> av.VideoFrame:
    """Another sample layout of the same depth, with neither matrix nor range changed."""
    if picture.format.name == layout:
        return picture
    matrix = int(picture.colorspace) if int(picture.colorspace) in (1, 4, 5, 7, 9) else 5
    # Without a stated range libswscale assumes limited range for Y'CbCr, full range for R'G'B'.
    full = int(picture.color_range) == FULL_RANGE or picture.format.is_rgb
    # One thread: where a plane's width is no multiple of 8, each of several writes beyond its rows,
    # over the first samples of the next one's.
    return picture.reformat(
        format=layout,
        src_colorspace=matrix,
        dst_colorspace=matrix,
        src_color_range=2 if full else 1,
        dst_color_range=2 if full or layout.startswith(("rgb", "gbr")) else 1,
        interpolation="BICUBIC",
        threads=1,
    )


def _plane(plane: Any, samples: type) -> NDArray[Any]:
    """(h, w) samples of a plane; its lines in memory may be longer."""
    kind = np.dtype(samples).newbyteorder("<")
    lines = np.frombuffer(plane, dtype=kind)[: plane.height * plane.line_size // kind.itemsize]
    return lines.reshape(plane.height, -1)[:, : plane.width]


def is_luma_chroma(picture: av.VideoFrame) -> bool:
    """Whether a picture is Y'CbCr of a known matrix and depth."""
    return (
        picture.format.name.startswith(_LUMA_CHROMA)
        and not picture.format.is_rgb
        and int(picture.colorspace) in LUMA_WEIGHTS
        and _bits(picture) in _PLANAR_DEPTHS
        and not (has_alpha(picture) and _bits(picture) == 14)
    )


def _full_chroma(picture: av.VideoFrame) -> av.VideoFrame:
    """Planar Y'CbCr(A) with as many chroma samples as luma samples."""
    bits = _bits(picture)
    depth = "" if bits == 8 else f"{bits}le"
    return _to(picture, f"yuv{'a' if has_alpha(picture) else ''}444p{depth}")


def _from_luma_chroma(picture: av.VideoFrame) -> F32:
    """Y'CbCr -> R'G'B' in floating point (ITU-T H.273, section 8.3), not clamped."""
    bits, unit = _bits(picture), float(1 << (_bits(picture) - 8))
    kind = np.uint8 if bits == 8 else np.uint16
    planes = [_plane(plane, kind) for plane in _full_chroma(picture).planes]
    largest = float((1 << bits) - 1)
    full = int(picture.color_range) == FULL_RANGE
    black, white = (0.0, largest) if full else (16 * unit, 219 * unit)
    span = largest if full else 224 * unit
    red_weight, blue_weight = LUMA_WEIGHTS[int(picture.colorspace)]
    green_weight = 1 - red_weight - blue_weight
    height, width = planes[0].shape
    out = np.empty((height, width, len(planes)), np.float32)
    rows = max(1, _STRIP // width)
    for top in range(0, height, rows):
        luma, blue, red, *rest = [plane[top : top + rows].astype(np.float32) for plane in planes]
        luma -= np.float32(black)
        luma /= np.float32(white)
        for chroma, weight in ((blue, blue_weight), (red, red_weight)):
            chroma -= np.float32(128 * unit)
            chroma /= np.float32(span)
            chroma *= np.float32(2 * (1 - weight))
            chroma += luma
        luma -= np.float32(red_weight) * red
        luma -= np.float32(blue_weight) * blue
        luma /= np.float32(green_weight)
        for alpha in rest:
            alpha /= np.float32(largest)
        for channel, values in enumerate((red, luma, blue, *rest)):
            out[top : top + rows, :, channel] = values
    return out


def bin_picture(picture: av.VideoFrame, row_step: int, binner: _core.ColourBinner) -> bool:
    """Bin every `row_step`-th row of a picture; return whether all are invisible (`Fill`)."""
    if is_luma_chroma(picture) and not has_alpha(picture):
        bits, matrix = _bits(picture), int(picture.colorspace)
        red_weight, blue_weight = LUMA_WEIGHTS[matrix]
        binner.add_luma_chroma(
            *_thinned(picture, row_step),
            red_weight=red_weight,
            blue_weight=blue_weight,
            bits=bits,
            full_range=int(picture.color_range) == FULL_RANGE,
        )
        return False
    packed = _packed(picture)
    # The analysis takes 0 to 1, as `add_luma_chroma` does.
    pixels = np.clip(picture_pixels(picture), 0, 1) if packed is None else packed
    pixels = pixels[row_step // 2 :: row_step]
    binner.add(pixels)
    if not all_hidden(binner):
        return False
    # No pixel is visible: see `Clip.straight_colours`.
    binner.clear()
    binner.add(pixels[..., :3])
    return True
