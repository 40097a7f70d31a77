"""Small image and movie files for the tests of clip reading and rendering."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import OpenImageIO as oiio
from av.video.reformatter import ColorRange, Colorspace
from numpy.typing import NDArray


class TimeCode(int):
    """The 32 bits of a SMPTE timecode, to be written as such."""


def write_image(
    path: Path,
    pixels: NDArray[Any],
    samples: str = "",
    *,
    names: tuple[str, ...] = (),
    full: tuple[int, int, int, int] | None = None,
    origin: tuple[int, int] = (0, 0),
    **attributes: Any,
) -> Path:
    """Write pixels (h, w, c) as they are; `samples` is the file's sample type."""
    height, width, channels = pixels.shape
    samples = samples or str(pixels.dtype)
    samples = {"float32": "float", "float16": "half", "uint32": "uint"}.get(samples, samples)
    spec = oiio.ImageSpec(width, height, channels, samples)
    if names:
        spec.channelnames = names
        spec.alpha_channel = names.index("A") if "A" in names else -1
    elif channels in (2, 4):
        spec.alpha_channel = channels - 1
    spec.x, spec.y = origin
    if full:
        spec.full_x, spec.full_y, spec.full_width, spec.full_height = full
    for name, value in attributes.items():
        key = name.replace("__", ":")
        if isinstance(value, Fraction):
            rational = (value.numerator, value.denominator)
            spec.attribute(key, oiio.TypeDesc("rational"), rational)
        elif isinstance(value, TimeCode):
            spec.attribute(key, oiio.TypeTimeCode, (int(value), 0))
        else:
            spec.attribute(key, value)
    path.parent.mkdir(parents=True, exist_ok=True)
    target = oiio.ImageOutput.create(str(path))
    assert target is not None, oiio.geterror()
    assert target.open(str(path), spec), target.geterror()
    if pixels.dtype == np.uint32:  # long on Windows, which OpenImageIO takes for 64 bits
        pixels = pixels.view(np.uintc)
    assert target.write_image(np.ascontiguousarray(pixels)), target.geterror()
    assert target.close(), target.geterror()
    return path


def grey_levels(path: Path, frames: range, name: str = "clip.{:04d}.png") -> Path:
    """Write flat 8x6 16-bit frames whose red is the frame number / 65535; returns the folder."""
    for frame in frames:
        pixels = np.zeros((6, 8, 3), np.uint16)
        pixels[..., 0] = abs(frame)
        write_image(path / name.format(frame), pixels)
    return path


def _picture(pixels: NDArray[Any], layout: str) -> av.VideoFrame:
    """One picture; also layouts that PyAV does not make: planes (3, h, w), or packed (h, w, 4)."""
    if layout not in ("yuv444p10le", "bgr0"):
        return av.VideoFrame.from_ndarray(pixels, format=layout)
    planes = list(pixels) if layout.startswith("yuv") else [pixels.reshape(pixels.shape[0], -1)]
    height = planes[0].shape[0]
    width = planes[0].shape[1] // (1 if layout.startswith("yuv") else 4)
    frame = av.VideoFrame(width, height, layout)
    for plane, samples in zip(frame.planes, planes, strict=True):
        padded = np.zeros((height, plane.line_size // samples.itemsize), samples.dtype)
        padded[:, : samples.shape[1]] = samples
        plane.update(padded.tobytes())
    return frame


def write_movie(
    path: Path,
    codec: str,
    layout: str,
    frames: list[NDArray[Any]],
    source_layout: str,
    *,
    rate: Fraction = Fraction(24),
    options: dict[str, str] | None = None,
    stamps: list[int] | None = None,
    size: tuple[int, int] | None = None,
    prepare: Callable[[Any], None] | None = None,
    colorspace: Colorspace | None = None,
    color_range: ColorRange | None = None,
) -> Path:
    """Encode frames given in `source_layout` (converted by libswscale only where it differs)."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate)
        stream.height, stream.width = size or frames[0].shape[:2]
        stream.pix_fmt = layout
        stream.options = options or {}
        if colorspace is not None:
            stream.codec_context.colorspace = int(colorspace)
        if color_range is not None:
            stream.codec_context.color_range = int(color_range)
        if prepare:
            prepare(stream)
        for index, pixels in enumerate(frames):
            frame = _picture(pixels, source_layout)
            if source_layout != layout:
                frame = frame.reformat(format=layout)
            frame.pts = stamps[index] if stamps else index
            frame.time_base = 1 / rate
            for packet in stream.encode(frame):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)
    return path


def damage(movie: Path, picture: int) -> None:
    """Overwrite part of a movie's n-th picture (in order of time) with zeros."""
    with av.open(str(movie)) as container:
        packets = [(p.pts, p.pos, p.size) for p in container.demux(video=0) if p.size]
    _, position, size = sorted(packets)[picture]
    whole = bytearray(movie.read_bytes())
    whole[position + size // 2 : position + size // 2 + 40] = bytes(40)
    movie.write_bytes(whole)
