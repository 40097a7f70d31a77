"""The metadata of a movie file: tags, pixel aspect, fields, timecode and reel."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from palette4d.media.colour_tags import ColourTags
from palette4d.media.movie_boxes import boxes
from palette4d.media.movie_pixels import FULL_RANGE, is_luma_chroma, side_data, turn
from palette4d.media.pyav import FFmpegError, Graph, Type, av
from palette4d.media.stated import Fields, Stated
from palette4d.media.timecode import nominal

# What is about the source's file, or is stated elsewhere.
_OF_THE_FILE = re.compile(
    ".*_brands?|minor_version|encoder|duration|timecode|reel_name|(.*_)?u(id|mid|l)|product_.*|"
    "company_name|application_platform|toolkit_version|modification_date",
    re.IGNORECASE,
)
_TIMECODE = re.compile(r"([0-9]{2}:[0-9]{2}:[0-9]{2}[:;.][0-9]{2,3})")
# AVFieldOrder: unknown, progressive, then four of interlaced pictures.
_PROGRESSIVE, _TOP_FIRST = 1, (2, 4)
#: Bytes of the largest index of a movie that is searched for its timecode track.
_MOST_INDEX = 256 << 20


def stated_by(container: Any, stream: Any, picture: av.VideoFrame) -> Stated:
    """Return a movie's metadata; `picture` is the first one, with its matrix resolved."""
    full = int(picture.color_range) == FULL_RANGE
    aspect = stream.sample_aspect_ratio or stream.codec_context.sample_aspect_ratio
    aspect = Fraction(aspect) if aspect else Fraction(1)
    transposed, _, upside_down = turn(picture)
    order = int(stream.codec_context.field_order)
    fields = "" if transposed else _fields(picture, order)
    if upside_down and picture.height % 2 == 0 and fields:
        fields, order = ("bff" if fields == "tff" else "tff"), 0
    return Stated(
        tags=ColourTags(
            int(picture.color_primaries),
            int(picture.color_trc),
            int(picture.colorspace),
            full or picture.format.is_rgb,
        ),
        headroom=is_luma_chroma(picture) or (picture.format.name.startswith("gray") and not full),
        pixel_aspect=1 / aspect if transposed else aspect,
        fields=fields,
        field_order=order if fields else 0,
        reel=_first(container, "reel_name"),
        timecode=timecode_of(container, stream.average_rate),
        texts=tuple(
            (str(name), str(text))
            for name, text in container.metadata.items()
            if not _OF_THE_FILE.fullmatch(name)
        ),
        handler=str(stream.metadata.get("handler_name", "")),
        hdr10=_hdr10(picture),
        made_by=str(stream.metadata.get("name", "")),
    )


def _hdr10(picture: av.VideoFrame) -> str:
    """Return the static metadata of HDR10 (SMPTE ST 2086, CTA-861.3) as x265 takes them."""
    by_type = side_data(picture)
    texts = []
    if (display := by_type.get(Type.MASTERING_DISPLAY_METADATA)) is not None:
        # Ten fractions: x and y of red, green, blue and white, least and largest luminance.
        pairs = np.frombuffer(display[:80], "=i4").reshape(10, 2).astype(float)
        numbers = np.divide(pairs[:, 0], pairs[:, 1], where=pairs[:, 1] != 0, out=np.zeros(10))
        r, g, b, white = (
            "({:.0f},{:.0f})".format(*pair) for pair in numbers[:8].reshape(4, 2) * 50_000
        )
        low, high = numbers[8:] * 10_000
        texts.append(f"master-display=G{g}B{b}R{r}WP{white}L({high:.0f},{low:.0f})")
    if (light := by_type.get(Type.CONTENT_LIGHT_LEVEL)) is not None:
        texts.append("max-cll={},{}".format(*np.frombuffer(light[:8], "=u4").tolist()))
    return ":".join(texts)


def timecode_of(container: Any, rate: Fraction | None) -> str:
    """Return the timecode of a movie's first frame, `HH:MM:SS:FF`, or "".

    It counts at the movie's rate. The track of a file may count pairs of frames (SMPTE ST 12-1).
    """
    match = _TIMECODE.search(_first(container, "timecode"))
    if match is None:
        return ""
    # PyAV has rationals of its own since 19.
    text, base = match[0], nominal(Fraction(rate)) if rate else 0
    counted = _counted_by_track(container.name.removeprefix("file:")) if base > 30 else 0
    if 0 < counted < base and base % counted == 0:
        return f"{text[:9]}{int(text[9:]) * (base // counted):02d}"
    return text


def _counted_by_track(path: str) -> int:
    """Return the frames a second that the timecode track of a .mov counts; 0 if there is none."""
    head = b""
    try:
        with Path(path).open("rb") as file:
            for kind, size in boxes(file):
                if kind == b"moov" and size < _MOST_INDEX:
                    head = file.read(size)
    except OSError:
        return 0
    # QuickTime File Format, "Timecode sample description": time scale and a frame's duration.
    # FFmpeg counts at their ratio and ignores the number of frames that follows.
    match = re.search(rb"stsd.{12}tmcd.{16}(.{4})(.{4})", head, re.DOTALL)
    scale, duration = (
        (int.from_bytes(number, "big") for number in match.groups()) if match else (0, 0)
    )
    return round(scale / duration) if duration else 0


def _first(container: Any, name: str) -> str:
    """Return a text that the file or one of its streams states, or ""."""
    stated = [container.metadata, *(stream.metadata for stream in container.streams)]
    return next((str(texts[name]) for texts in stated if texts.get(name)), "")


def _fields(picture: av.VideoFrame, order: int) -> Fields:
    """Return which field comes first; the decoder knows better than the container."""
    if not picture.interlaced_frame and order <= _PROGRESSIVE:
        return ""
    if not picture.interlaced_frame:
        return "tff" if order in _TOP_FIRST else "bff"
    return "tff" if _top_field_first(picture) else "bff"


def _top_field_first(picture: av.VideoFrame) -> bool:
    """Ask FFmpeg's filter for the flag, which PyAV does not offer."""
    graph = Graph()
    source = graph.add_buffer(
        width=picture.width,
        height=picture.height,
        format=picture.format,
        time_base=Fraction(1, 25),
    )
    chosen = graph.add("select", "eq(interlace_type\\,TOPFIRST)")
    sink = graph.add("buffersink")
    source.link_to(chosen)
    chosen.link_to(sink)
    graph.configure()
    graph.push(picture)
    try:
        graph.pull()
    except (FFmpegError, EOFError):
        return False
    return True
