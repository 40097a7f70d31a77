"""Clips of image files, read through OpenImageIO."""

from __future__ import annotations

import collections.abc
import functools
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.arguments import MAX_FRAMES, parse_frames
from palette4d.media.clip_base import (
    DEFAULT_RATE,
    F32,
    STRIP_BYTES,
    Clip,
    ClipError,
    Fill,
    FrameError,
    Image,
    all_hidden,
    as_rate,
    describe,
    named,
    progression_step,
)
from palette4d.media.clip_sequence import Sequence

#: Metadata that a recoloured copy of the frame keeps.
CARRIED = (
    "FramesPerSecond",
    "smpte:TimeCode",
    "smpte:KeyCode",
    "oiio:ColorSpace",
    "chromaticities",
    "colorInteropID",
    "PixelAspectRatio",
    "ICCProfile",
    "whiteLuminance",
    "reelName",
    "DateTime",
    "Copyright",
    "Artist",
    "ImageDescription",
    "Make",
    "Model",
)
#: Rows that are decompressed together in one file format or another (256 in a DWAB EXR).
_CHUNK = 256
_RATE_NAMES = ("FramesPerSecond", "dpx:FrameRate", "dpx:TemporalFrameRate")
_DEPTHS = {"uint": "uint32", "int": "int32"}
# OpenImageIO's names for what people call sRGB and so on; other names pass as they are.
_ENCODINGS = {
    "srgb_rec709_scene": "sRGB",
    "srgb_rec709_display": "sRGB",
    "srgb": "sRGB",
    "lin_rec709_scene": "linear Rec.709",
    "lin_rec709": "linear Rec.709",
    "scene_linear": "linear",
    "linear": "linear",
    "rec709": "Rec.709",
    "ocio:lin_rec709_scene": "linear Rec.709",
}


@dataclass
class ImageClip(Clip):
    """An image sequence, or a single image as a clip of one frame."""

    sequence: Sequence = field(kw_only=True)

    def file(self, frame: int) -> Path:
        """File that holds a frame, whether it exists or not."""
        return self.sequence.path(frame)

    def load(self, frame: int) -> Image:
        """Read one frame; FrameError when it is missing, unreadable, or of another size."""
        header, pixels = read_image(self._path(frame), f"frame {frame}")
        self._check(header, frame)
        return Image(frame, pixels, header.metadata)

    def fills(self, frames: collections.abc.Sequence[int]) -> Iterator[tuple[int, Fill]]:
        """For each frame its number and what reads and bins it, in strips."""
        for frame in frames:
            yield frame, functools.partial(self._fill, frame)

    def _fill(self, frame: int, binner: _core.ColourBinner) -> bool:
        path, what = self._path(frame), f"frame {frame}"
        source, spec = _open(path, what)
        self._check(_header(path, spec, _channel_choice(spec)), frame)
        _bin_image(source, path, what, binner, self.row_step, self.has_alpha)
        if not self.has_alpha or not all_hidden(binner):
            return False
        # Nothing shows: see `straight_colours`.
        binner.clear()
        _bin_image(_open(path, what)[0], path, what, binner, self.row_step, False)
        return True

    def _path(self, frame: int) -> Path:
        if frame not in self.sequence.files:
            raise _missing(self.sequence, [frame])
        return self.sequence.path(frame)

    def _check(self, header: Header, frame: int) -> None:
        """Refuse a frame unlike the first."""
        path = self.sequence.path(frame)
        if (header.width, header.height) != (self.width, self.height):
            raise FrameError(
                f"{path}: frame {frame} is {header.width}x{header.height} pixels, expected "
                f"{self.width}x{self.height} as in the frames before. Mend the clip, take a range "
                "with --frames, or leave such frames out with --skip-bad-frames."
            )
        if (header.has_alpha, header.premultiplied) != (self.has_alpha, self.premultiplied):
            raise FrameError(
                f"{path}: frame {frame} has {_channels(header)}, expected "
                f"{_channels(self)} as in the frames before. Mend the clip, take a range "
                "with --frames, or leave such frames out with --skip-bad-frames."
            )


@dataclass(frozen=True)
class Header:
    """What an image file says about itself; width and height upright."""

    width: int
    height: int
    has_alpha: bool
    premultiplied: bool
    depth: str
    encoding: str
    rate: Fraction | None
    metadata: tuple[tuple[str, Any, Any], ...]


def open_images(
    sequence: Sequence,
    frames: str | None,
    embedded: str | None,
    rate: Fraction | None,
    skip_bad_frames: bool,
    single: bool = False,
) -> ImageClip:
    """Open a sequence over the asked range; ClipError or FrameError as `open_clip` says."""
    wanted = _wanted_frames(sequence, frames, embedded)
    missing = [frame for frame in wanted if frame not in sequence.files]
    if missing and not skip_bad_frames:
        raise _missing(sequence, missing)
    source = str(next(iter(sequence.files.values()))) if single else sequence.pattern
    header: Header | None = None
    for frame in wanted:
        if frame in missing:
            continue
        try:
            header = read_header(sequence.path(frame), f"frame {frame}")
            break
        except FrameError:
            if not skip_bad_frames:
                raise
    if header is None:
        raise FrameError(
            f"{source}: found none readable of {named(wanted)}; expected at least one "
            "good frame. Run without --skip-bad-frames to see the cause."
        )
    return ImageClip(
        name=sequence.name,
        source=source,
        frames=wanted,
        rate=rate or header.rate or DEFAULT_RATE,
        width=header.width,
        height=header.height,
        encoding=header.encoding,
        has_alpha=header.has_alpha,
        premultiplied=header.premultiplied,
        depth=header.depth,
        skip_bad_frames=skip_bad_frames,
        skipped=missing,
        sequence=sequence,
    )


def _wanted_frames(sequence: Sequence, frames: str | None, embedded: str | None) -> list[int]:
    found = sequence.numbers
    if embedded is not None:
        inside = parse_frames(embedded)
        if frames is None:
            wanted = inside
        else:
            wanted = parse_frames(frames)
            if outside := sorted(set(wanted) - set(inside)):
                raise ClipError(
                    f"{sequence.pattern}: --frames {frames} asks for {describe(outside)}, which "
                    f"the pattern's own range {embedded} leaves out. Give one of the two."
                )
    elif frames is not None:
        wanted = parse_frames(frames)
    else:
        step = progression_step(found)
        count = (found[-1] - found[0]) // step + 1
        if count > MAX_FRAMES:
            raise ClipError(
                f"{sequence.pattern}: the {len(found)} files are numbered from {found[0]} to "
                f"{found[-1]}, which looks like dates or ids; expected frame numbers. "
                "Number the files, or choose a range with --frames."
            )
        return list(range(found[0], found[-1] + 1, step))
    if not set(wanted) & set(found):
        raise ClipError(
            f"{sequence.pattern}: found no {named(wanted)}, the clip has "
            f"{describe(found)}. Choose a range inside the clip."
        )
    return wanted


def _missing(sequence: Sequence, missing: list[int]) -> FrameError:
    found = sequence.numbers
    inside = [frame for frame in missing if found[0] < frame < found[-1]]
    if not inside:
        return FrameError(
            f"{sequence.pattern}: the range asks for frame{'s' * (len(missing) > 1)} "
            f"{describe(missing)}, the clip has {describe(found)}. Choose a range inside the clip, "
            "or leave such frames out with --skip-bad-frames."
        )
    return FrameError(
        f"{sequence.pattern}: frame{'s' * (len(missing) > 1)} {describe(missing)} missing between "
        f"{found[0]} and {found[-1]} (no file {sequence.path(missing[0]).name}). Bring the file "
        "back, choose a range with --frames, or leave such frames out with --skip-bad-frames."
    )


def _channels(what: Header | Clip) -> str:
    if not what.has_alpha:
        return "no alpha"
    return "premultiplied alpha" if what.premultiplied else "straight alpha"


def read_header(path: Path, what: str) -> Header:
    """Open an image for its header alone; FrameError names `what` and the file."""
    source, spec = _open(path, what)
    source.close()
    return _header(path, spec, _channel_choice(spec))


def read_image(path: Path, what: str = "the image") -> tuple[Header, F32]:
    """Header and (h, w, 3 or 4) float32 pixels; FrameError names `what` and the file."""
    source, spec = _open(path, what)
    chosen = _channel_choice(spec)
    first, last = min(chosen), max(chosen) + 1
    stored = source.read_image(source.current_subimage(), 0, first, last, spec.format)
    problem = source.geterror()
    source.close()
    # JPEG returns grey pixels together with an error: both count.
    if stored is None or problem:
        raise _unreadable(path, what, problem)
    pixels = _scaled(np.asarray(stored), _bits(spec))
    pixels = pixels[..., [channel - first for channel in chosen]]
    pixels = _in_display_window(pixels, spec)
    pixels = _upright(pixels, spec.get_int_attribute("Orientation", 1))
    return _header(path, spec, chosen), np.ascontiguousarray(pixels)


def _bin_image(
    source: Any, path: Path, what: str, binner: _core.ColourBinner, row_step: int, alpha: bool
) -> None:
    """Bin every `row_step`-th row of an image, of which memory holds a strip."""
    spec = source.spec()
    chosen = _channel_choice(spec)[: 4 if alpha else 3]
    premultiplied = alpha and not spec.get_int_attribute("oiio:UnassociatedAlpha", 0)
    left, right = max(spec.full_x - spec.x, 0), spec.full_x + spec.full_width - spec.x
    below = spec.full_y + spec.full_height  # the first row under the display window
    rows = 0
    for top, stored in _strips(source, spec, path, what, min(chosen), max(chosen) + 1):
        # Rows are counted from the middle of the first step of the display window.
        first = max(top, spec.full_y)
        first += (spec.full_y + row_step // 2 - first) % row_step
        strip = stored[first - top : max(below - top, 0) : row_step, left : max(right, 0)]
        if chosen != list(range(chosen[0], chosen[0] + stored.shape[2])):
            strip = strip[..., [channel - min(chosen) for channel in chosen]]
        if strip.dtype not in (np.uint8, np.uint16, np.float32):
            strip = _scaled(strip, 0)
        if strip.size:
            binner.add(strip, bits=_bits(spec) or 16, premultiplied=premultiplied)
            rows += strip.shape[0]
    # The display window beyond the data is black.
    height = len(range(row_step // 2, spec.full_height, row_step))
    width = max(min(right, spec.width) - left, 0) if rows else 0
    for count, length in ((rows, spec.full_width - width), (height - rows, spec.full_width)):
        if count > 0 and length > 0:
            black = np.zeros((1, length, len(chosen)), strip.dtype)
            binner.add(
                np.broadcast_to(black, (count, length, len(chosen))), premultiplied=premultiplied
            )


def _strips(
    source: Any, spec: Any, path: Path, what: str, first: int, last: int
) -> Iterator[tuple[int, NDArray[Any]]]:
    """(y of its first row, (rows, w, c) samples) of strips of the channels `first` to `last`."""
    part = source.current_subimage()
    samples = "float" if str(spec.format) in ("half", "double") else spec.format
    row = spec.width * (last - first) * spec.format.size()
    rows = max(STRIP_BYTES // max(row, 1), 1)
    if rows > _CHUNK:
        rows -= rows % _CHUNK
    if spec.tile_width:
        rows = max(rows - rows % spec.tile_height, spec.tile_height)
    bottom = spec.y + spec.height
    for top in range(spec.y, bottom, rows):
        end = min(top + rows, bottom)
        if spec.tile_width:
            right = spec.x + spec.width
            strip = source.read_tiles(part, 0, spec.x, right, top, end, 0, 1, first, last, samples)
        else:
            strip = source.read_scanlines(part, 0, top, end, 0, first, last, samples)
        problem = source.geterror()
        # JPEG returns grey pixels together with an error: both count.
        if strip is None or problem:
            source.close()
            raise _unreadable(path, what, problem)
        yield top, np.asarray(strip)
    source.close()


def _unreadable(path: Path, what: str, problem: str) -> FrameError:
    reason = problem.strip().splitlines()[0] if problem.strip() else "no reason given"
    return FrameError(
        f"{path}: {what} cannot be read ({reason}); expected a whole image file. Bring a good "
        "copy, or leave such frames out with --skip-bad-frames."
    )


def _open(path: Path, what: str) -> tuple[Any, Any]:
    import OpenImageIO as oiio

    if not path.is_file():
        raise FrameError(f"{path}: {what} is missing; expected a file")
    if path.stat().st_size == 0:
        raise _unreadable(path, what, "the file is empty")
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # values as they are stored
    source = oiio.ImageInput.open(str(path), config)
    if source is None:
        raise _unreadable(path, what, oiio.geterror())
    # The part of a multi-part EXR that holds the colours; the first one otherwise.
    part = 0
    while source.seek_subimage(part, 0):
        if {"R", "G", "B"} <= set(source.spec().channelnames):
            break
        part += 1
    else:
        source.geterror()
        source.seek_subimage(0, 0)
    spec = source.spec()
    if spec.deep:
        source.close()
        raise _unreadable(path, what, "it is a deep image, expected a flat one")
    if spec.width < 1 or spec.height < 1 or spec.nchannels < 1:
        source.close()
        raise _unreadable(path, what, f"its size is {spec.width}x{spec.height}")
    return source, spec


def _channel_choice(spec: Any) -> list[int]:
    """Channels to read as R, G, B and perhaps A; a grey one stands for all three."""
    names = list(spec.channelnames)
    alpha = [spec.alpha_channel] if 0 <= spec.alpha_channel < len(names) else []
    if {"R", "G", "B"} <= set(names):
        return [names.index(name) for name in "RGB"] + alpha
    colours = [index for index in range(len(names)) if index not in alpha]
    if len(colours) < 3:
        grey = colours[0] if colours else alpha[0]
        return [grey] * 3 + (alpha if colours else [])
    for red in names:  # a layer: diffuse.R, diffuse.G, diffuse.B
        if red.endswith(".R") and {red[:-1] + "G", red[:-1] + "B"} <= set(names):
            layer = [names.index(red[:-1] + one) for one in "RGB"]
            return layer + ([names.index(red[:-1] + "A")] if red[:-1] + "A" in names else [])
    return colours[:3] + alpha


def _bits(spec: Any) -> int:
    """Bits a sample where they are fewer than its memory type's, else 0."""
    bits = int(spec.get_int_attribute("oiio:BitsPerSample", 0))
    return bits if str(spec.format) == "uint16" and 8 < bits < 16 else 0


def _scaled(stored: NDArray[Any], bits: int) -> F32:
    """Integers over their largest value, floats as they are, as (h, w, c) float32."""
    if stored.dtype.kind == "f":
        with np.errstate(over="ignore"):
            return stored.astype(np.float32, copy=False)
    if bits:
        # OpenImageIO widens 10 and 12 bits to 16: the upper bits are the stored value.
        return (stored >> (16 - bits)).astype(np.float32) / np.float32((1 << bits) - 1)
    largest = np.iinfo(stored.dtype).max
    if stored.dtype.itemsize > 2:
        return (stored / np.float64(largest)).astype(np.float32)
    return stored.astype(np.float32) / np.float32(largest)


def _in_display_window(pixels: F32, spec: Any) -> F32:
    """An EXR's data window laid into its display window: black outside, overscan cut off."""
    if (spec.x, spec.y, spec.width, spec.height) == (
        spec.full_x,
        spec.full_y,
        spec.full_width,
        spec.full_height,
    ):
        return pixels
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    framed = np.zeros((spec.full_height, spec.full_width, pixels.shape[2]), np.float32)
    x0, y0 = max(left, 0), max(top, 0)
    x1, y1 = min(left + spec.width, spec.full_width), min(top + spec.height, spec.full_height)
    if x0 < x1 and y0 < y1:
        framed[y0:y1, x0:x1] = pixels[y0 - top : y1 - top, x0 - left : x1 - left]
    return framed


def _upright(pixels: F32, orientation: int) -> F32:
    """Apply Exif's orientation 1 to 8."""
    turned = {
        2: lambda p: p[:, ::-1],
        3: lambda p: p[::-1, ::-1],
        4: lambda p: p[::-1],
        5: lambda p: p.swapaxes(0, 1),
        6: lambda p: np.rot90(p, -1),
        7: lambda p: p[::-1, ::-1].swapaxes(0, 1),
        8: lambda p: np.rot90(p, 1),
    }.get(orientation)
    return turned(pixels) if turned else pixels


def _header(path: Path, spec: Any, chosen: list[int]) -> Header:
    width, height = spec.full_width, spec.full_height
    if 5 <= spec.get_int_attribute("Orientation", 1) <= 8:
        width, height = height, width
    has_alpha = len(chosen) == 4
    straight = bool(spec.get_int_attribute("oiio:UnassociatedAlpha", 0))
    bits = _bits(spec)
    space = str(spec.get_string_attribute("oiio:ColorSpace"))
    return Header(
        width=width,
        height=height,
        has_alpha=has_alpha,
        premultiplied=has_alpha and not straight,
        depth=f"uint{bits}" if bits else _DEPTHS.get(str(spec.format), str(spec.format)),
        encoding=_ENCODINGS.get(space.lower(), space) or _dpx_encoding(spec) or "unknown",
        rate=_rate(spec),
        metadata=tuple(
            (param.name, param.type, param.value)
            for param in spec.extra_attribs
            if param.name in CARRIED
        ),
    )


def _dpx_encoding(spec: Any) -> str:
    transfer = str(spec.get_string_attribute("dpx:Transfer"))
    return "" if transfer in ("", "Undefined", "User defined") else transfer


def _rate(spec: Any) -> Fraction | None:
    for name in _RATE_NAMES:
        value = spec.getattribute(name)
        if value is None:
            continue
        if isinstance(value, tuple):
            if len(value) == 2 and value[0] > 0 and value[1] > 0:
                return Fraction(int(value[0]), int(value[1]))
        elif isinstance(value, int | float) and (rate := as_rate(float(value))):
            return rate
    return None
