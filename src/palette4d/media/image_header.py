"""The headers of image files: part and channels of the picture, size, sample type, colours.

`opened` chooses the part and the channels that hold the picture; `header_of` reads their header.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d.common.sandbox import kept_closed
from palette4d.media import exr_layers, oiio_text
from palette4d.media.clip_base import LEAVE_OUT, MOST_SAMPLES, ClipError, FrameError, as_rate
from palette4d.media.colour_tags import (
    UNKNOWN,
    ColourTags,
    encoding_of,
    name_of,
    primaries_of,
    tags_of,
)
from palette4d.media.exr_around import described
from palette4d.media.exr_layers import COLOURS
from palette4d.media.oiio_text import is_utf8
from palette4d.media.reading import Reading
from palette4d.media.timecode import TIMECODE

#: Metadata that a recoloured copy of the frame does not keep: they describe how pixels are stored.
_STORAGE = (
    *("oiio:", "openexr:", "tiff:", "png:", "jpeg:", "planarconfig", "compression", "tile"),
    *("Orientation", "ResolutionUnit", "chunkCount", "dpx:EndOf", "dpx:Packing", "dpx:Version"),
    *("dpx:ImageDescriptor", "dpx:LowData", "dpx:HighData", "dpx:DittoKey"),
)
_RATE_NAMES = ("FramesPerSecond", "dpx:FrameRate", "dpx:TemporalFrameRate")
#: The bytes of all headers of a DPX (SMPTE ST 268), and the attributes of the first one.
_ALL_OF_DPX = 2048
_FIRST_OF_DPX = ("dpx:Transfer", "dpx:Colorimetric", "dpx:InputDevice")
#: OpenEXR writes no pixel aspect ratio below it.
_LEAST_ASPECT = 1e-6
_DEPTHS = {"uint": "uint32", "int": "int32"}


@dataclass(frozen=True)
class Header:
    """The properties that an image file states.

    Width and height are upright; is_upright: the file is, too. bits: the bits of a sample if fewer
    than its memory type has, else 0. note: for the user, or "".
    """

    width: int
    height: int
    is_upright: bool
    has_alpha: bool
    premultiplied: bool
    bits: int
    depth: str
    encoding: str
    rate: Fraction | None
    metadata: tuple[tuple[str, Any, Any], ...]
    note: str
    tags: ColourTags
    part: int
    channels: tuple[str, ...]
    more: str


def read_header(path: Path, what: str, reading: Reading) -> Header:
    """Open an image to read its header; FrameError names `what` and the file."""
    source, spec, chosen = opened(path, what, reading)
    part = source.current_subimage()
    source.close()
    return header_of(spec, chosen, part)


def unreadable(path: Path, what: str, problem: str) -> FrameError:
    """Return the error for a file that cannot be read."""
    reason = problem.strip().splitlines()[0] if problem.strip() else "no reason given"
    reason += kept_closed(path)
    return FrameError(
        f"{path}: {what} cannot be read ({reason}); expected a whole image file.",
        LEAVE_OUT,
    )


def opened(path: Path, what: str, reading: Reading) -> tuple[Any, Any, list[int]]:
    """Return an open file at the part that holds the picture, its header and the channels."""
    import OpenImageIO as oiio

    if not path.is_file():
        raise FrameError(f"{path}: {what} is missing; expected a file")
    if path.stat().st_size == 0:
        raise unreadable(path, what, "the file is empty")
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # values as they are stored
    source = oiio.ImageInput.open(oiio_text.file_name(path), config)
    if source is None:
        problem = oiio_text.problem_of(oiio)
        if "ubsampl" in problem:
            raise FrameError(
                f"{path}: {what} has subsampled channels (luminance and chroma), expected R, G and "
                "B of full size; write it so in the program that made it"
            )
        raise unreadable(path, what, problem)
    spec, layer = _part(source, path, reading)
    if source.format_name() == "dpx":
        spec = _without_pixels(path, spec)
    if spec.deep:
        source.close()
        raise FrameError(
            f"{path}: {what} is a deep image, expected a flat one; flatten it, as with "
            "`oiiotool IN --flatten -o OUT`"
        )
    if spec.width < 1 or spec.height < 1 or spec.nchannels < 1:
        source.close()
        raise unreadable(path, what, f"its size is {spec.width}x{spec.height}")
    chosen = layer or _channel_choice(spec)
    channels = max(chosen) + 1 - min(chosen)
    for width, height in ((spec.width, spec.height), (spec.full_width, spec.full_height)):
        if width * height * channels > MOST_SAMPLES:
            source.close()
            raise unreadable(
                path, what, f"{width}x{height} pixels in {channels} channels are too many"
            )
    return source, spec, chosen


def _without_pixels(path: Path, spec: Any) -> Any:
    """Return a DPX's header without attributes that are pixels.

    FFmpeg writes the first header alone. OpenImageIO reads the others where the picture is: rates
    and timecodes of film and television.
    """
    with path.open("rb") as file:
        head = file.read(8)
    begin = int.from_bytes(head[4:], "little" if head[:4] == b"XPDS" else "big")
    if begin >= _ALL_OF_DPX:
        return spec
    spec = spec.copy()
    for name in [param.name for param in spec.extra_attribs]:
        if name.startswith(("dpx:", "smpte:")) and not name.startswith(_FIRST_OF_DPX):
            spec.erase_attribute(name)
    return spec


def _part(source: Any, path: Path, reading: Reading) -> tuple[Any, list[int] | None]:
    """Go to the part that holds the picture; return its header, and the channels if asked for.

    Unless a layer or a view is asked for, that is the first one with red, green and blue.
    """
    asked = reading.layer is not None or reading.view is not None
    specs: list[Any] = []
    while source.seek_subimage(len(specs), 0):
        spec = source.spec().copy()
        if asked and (channels := exr_layers.channels_of(spec, reading)):
            return spec, channels
        if not asked and {"R", "G", "B"} <= set(spec.channelnames):
            return source.spec(), None
        specs.append(spec)
    oiio_text.problem_of(source)
    if asked:
        source.close()
        wanted = " and ".join(
            f"{name} {value!r}"
            for name, value in (("layer", reading.layer), ("view", reading.view))
            if value is not None
        )
        raise ClipError(
            f"{path}: found no {wanted}, the file has {exr_layers.described(specs)}; choose one, "
            "NAME.exr?layer= is the main layer"
        )
    source.seek_subimage(0, 0)
    return source.spec(), None


def _channel_choice(spec: Any) -> list[int]:
    """Channels to read as R, G, B and perhaps A; a grey channel is read three times."""
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
            layer = [names.index(red[:-1] + channel) for channel in "RGB"]
            return layer + ([names.index(red[:-1] + "A")] if red[:-1] + "A" in names else [])
    return colours[:3] + alpha


def _bits(spec: Any) -> int:
    """Bits per sample if fewer than its memory type has, else 0."""
    bits = int(spec.get_int_attribute("oiio:BitsPerSample", 0))
    return bits if str(spec.format) == "uint16" and 8 < bits < 16 else 0


def header_of(spec: Any, chosen: list[int], part: int) -> Header:
    """Return the header for the channels that are read."""
    width, height = spec.full_width, spec.full_height
    orientation = spec.get_int_attribute("Orientation", 1)
    if 5 <= orientation <= 8:
        width, height = height, width
    has_alpha = len(chosen) == 4
    straight = bool(spec.get_int_attribute("oiio:UnassociatedAlpha", 0))
    bits = _bits(spec)
    encoding, tags = _colours(spec)
    return Header(
        width=width,
        height=height,
        is_upright=not 2 <= orientation <= 8,
        has_alpha=has_alpha,
        premultiplied=has_alpha and not straight,
        bits=bits,
        depth=f"uint{bits}" if bits else _DEPTHS.get(str(spec.format), str(spec.format)),
        encoding=encoding,
        rate=_rate(spec),
        metadata=tuple(
            (param.name, param.type, oiio_text.readable(param.value))
            for param in spec.extra_attribs
            if _is_kept(param)
        ),
        note=_note(spec, chosen),
        tags=tags,
        part=part,
        channels=tuple(spec.channelnames[channel] for channel in chosen),
        more=described(spec, chosen, spec.get_int_attribute("oiio:subimages", 1)),
    )


def _is_kept(param: Any) -> bool:
    """Whether a recoloured copy keeps an attribute; FFmpeg's DPX has a pixel aspect ratio of 0."""
    name, value = param.name, param.value
    if name == "PixelAspectRatio":
        return isinstance(value, int | float) and _LEAST_ASPECT < value < 1 / _LEAST_ASPECT
    if name == TIMECODE and not _are_numbers(value, 2):
        return False
    return name == "oiio:ColorSpace" or (not name.startswith(_STORAGE) and is_utf8(name))


def _are_numbers(value: Any, count: int, kind: Any = int) -> bool:
    """Whether an attribute, whose type is free, has so many numbers at least."""
    return (
        isinstance(value, tuple)
        and len(value) >= count
        and all(isinstance(number, kind) for number in value)
    )


def _colours(spec: Any) -> tuple[str, ColourTags]:
    """Return the encoding that a file states, and the tags that mean the same."""
    space = oiio_text.readable(spec.get_string_attribute("oiio:ColorSpace"))
    stated = spec.getattribute("CICP")
    usable = _are_numbers(stated, 2) and all(0 <= number <= 255 for number in stated)
    if usable and UNKNOWN not in (cicp := ColourTags(*stated[:2])).pair:
        # OpenImageIO takes pairs that it has no name for as sRGB.
        known = tags_of(space).pair == cicp.pair
        return (name_of(space) if known else encoding_of(cicp)), cicp
    dpx = _dpx_encoding(spec)
    encoding = name_of(space) or dpx or "unknown"
    tags = tags_of(dpx) if tags_of(dpx).known else tags_of(encoding)
    xy = spec.getattribute("chromaticities")
    if not tags.known and _are_numbers(xy, 8, int | float):
        tags = ColourTags(primaries_of(xy))
    return encoding, tags


def _note(spec: Any, chosen: list[int]) -> str:
    """Return a note if the channels that are read have no names of colours."""
    names = [oiio_text.readable(spec.channelnames[channel]) for channel in chosen[:3]]
    if len(set(names)) == 1 or tuple(name.rpartition(".")[2] for name in names) in COLOURS:
        return ""
    return f"no channels R, G and B; {', '.join(names)} are used as red, green and blue"


def _dpx_encoding(spec: Any) -> str:
    transfer = oiio_text.readable(spec.get_string_attribute("dpx:Transfer"))
    return "" if transfer in ("", "Undefined", "User defined") else transfer


def _rate(spec: Any) -> Fraction | None:
    for name in _RATE_NAMES:
        value, rate = spec.getattribute(name), None
        if _are_numbers(value, 2) and min(value[:2]) > 0:
            rate = Fraction(*value[:2])
        elif _are_numbers(value, 2, int | float) and value[1]:
            rate = as_rate(value[0] / value[1])
        elif isinstance(value, int | float):
            rate = as_rate(float(value))
        if rate is not None:
            return rate
    return None
