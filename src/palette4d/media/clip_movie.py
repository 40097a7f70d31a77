"""Clips of movie files, decoded in order through PyAV (FFmpeg's libraries).

Frame numbers start at 0 and count pictures in presentation order. A first pass reads the packets'
time stamps without decoding. So a picture that cannot be decoded keeps its number and shifts no
other picture. Damage is reported if the decoder reports it, as H.264, ProRes and most others do.
FFV1 and VP9 conceal damage.
"""

from __future__ import annotations

import bisect
import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.codec.codec import Capabilities
from av.error import FFmpegError
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.arguments import MAX_FRAMES, parse_frames
from palette4d.media.clip_base import (
    DEFAULT_RATE,
    F32,
    LEAVE_OUT,
    MOST_SAMPLES,
    Clip,
    ClipError,
    Fill,
    FrameError,
    Image,
    all_hidden,
    describe,
    named,
)

# H.273 code points; libswscale and PyAV use the same numbers.
_TRANSFERS = {
    1: "Rec.709",
    4: "gamma 2.2",
    5: "gamma 2.8",
    6: "Rec.601",
    7: "SMPTE 240M",
    8: "linear",
    13: "sRGB",
    14: "Rec.2020",
    15: "Rec.2020",
    16: "Rec.2100 PQ",
    18: "Rec.2100 HLG",
}
_UNSPECIFIED = 2
# Weights of red and blue in luma, by matrix coefficients.
LUMA_WEIGHTS = {
    1: (0.2126, 0.0722),
    4: (0.30, 0.11),
    5: (0.299, 0.114),
    6: (0.299, 0.114),
    7: (0.212, 0.087),
    9: (0.2627, 0.0593),
    10: (0.2627, 0.0593),
}
_LIMITED_RANGE, _FULL_RANGE = 1, 2
_GREYS = ("gray", "gray10le", "gray12le", "gray16le")
_PLANAR_DEPTHS = (8, 9, 10, 12, 14, 16)
#: Prefixes of the names of Y'CbCr layouts.
_LUMA_CHROMA = ("yuv", "nv", "p0", "p2", "p4", "yuyv", "uyvy", "yvyu", "y2", "xv", "v")

#: FFmpeg's names of the formats of `MOVIE_EXTENSIONS`. It recognises formats by content, and
#: playlists such as ffconcat or HLS would lead it to other files.
_FORMATS = (
    *("asf", "avi", "flv", "gif", "m4v", "matroska", "mov", "mpeg", "mpegts", "mpegvideo", "mxf"),
    *("nut", "ogg", "yuv4mpegpipe"),
)
#: The options of `av.open` for a movie.
ONLY_FILES = {"format_whitelist": ",".join(_FORMATS), "protocol_whitelist": "file"}


#: Pixels of a strip that is converted at once: it stays in the processor's cache.
_STRIP = 30_000
#: Pictures whose decoding takes longer than opening the file again for a seek.
WORTH_SEEKING = 4


@dataclass(repr=False)
class MovieClip(Clip):
    """A movie file. Reading in order decodes each picture once; reading elsewhere seeks."""

    path: Path = field(kw_only=True)
    count: int = field(kw_only=True)
    #: Presentation time stamps in order; None if the file has none and pictures are counted.
    stamps: list[int] | None = field(kw_only=True, default=None)
    #: The numbers of the key frames, in order; empty if they are not known.
    key_frames: list[int] = field(kw_only=True, default_factory=list)
    _decoder: Iterator[tuple[int, av.VideoFrame]] | None = field(default=None, init=False)
    _next: int = field(default=0, init=False)
    _held: tuple[int, av.VideoFrame] | None = field(default=None, init=False)
    _problem: str = field(default="", init=False)

    def file(self, frame: int) -> Path:
        """Return the movie file, which holds every frame."""
        return self.path

    def load(self, frame: int) -> Image:
        """Decode one picture; FrameError if it is damaged, missing or of another size."""
        picture = self._picture(frame)
        return Image(frame, _upright(picture_pixels(picture), picture))

    def load_small(self, frame: int, width: int, height: int) -> F32:
        """Decode one picture for a preview, scaled before it is converted where that is quicker.

        Returns
        -------
        (height, width, 3 or 4) float32, or the whole picture as `load` where the layout needs it.
        """
        picture = self._picture(frame)
        if picture.rotation or not _is_luma_chroma(picture):
            return _upright(picture_pixels(picture), picture)
        matrix, full = _matrix(picture), int(picture.color_range) == _FULL_RANGE
        spread = 2 if full else 1
        small = picture.reformat(
            width=width,
            height=height,
            src_colorspace=5,
            dst_colorspace=5,
            src_color_range=spread,
            dst_color_range=spread,
            interpolation="AREA",
        )
        small.colorspace, small.color_range = matrix, spread
        return picture_pixels(small)

    def fills(self, frames: Sequence[int]) -> Iterator[tuple[int, Fill]]:
        """Decode the frames in order; one frame may be binned while the next is decoded."""
        for frame in frames:
            try:
                fill: Fill = functools.partial(_bin_picture, self._picture(frame), self.row_step)
            except FrameError as error:
                fill = functools.partial(_fail, error)
            yield frame, fill

    def _picture(self, frame: int) -> av.VideoFrame:
        picture = self._find(frame)
        if picture is None:
            why = f" ({self._problem})" if self._problem else ""
            raise FrameError(
                f"{self.path}: frame {frame} cannot be decoded{why}; expected {self.count} whole "
                f"frames. {LEAVE_OUT}"
            )
        shape = _shape(picture)
        if shape != (self.height, self.width, 4 if self.has_alpha else 3):
            height, width, channels = shape
            raise FrameError(
                f"{self.path}: frame {frame} is {width}x{height} pixels with {channels} channels, "
                f"expected {self.width}x{self.height} with {4 if self.has_alpha else 3} as in the "
                f"frames before. {LEAVE_OUT}"
            )
        return picture

    def _find(self, frame: int) -> av.VideoFrame | None:
        if self._decoder is None or frame < self._next or self._passes_key(frame):
            seek = self.stamps is not None and frame > 0
            self._start(frame if seek else 0)
            picture = self._advance(frame)
            if picture is not None or not seek:
                return picture
            # Some containers seek too far: then only decoding from the start is safe.
            self._start(0)
        return self._advance(frame)

    def _passes_key(self, frame: int) -> bool:
        """Whether seeking to a key frame before a frame saves decoding of the pictures between."""
        at = bisect.bisect_right(self.key_frames, frame) - 1
        return at >= 0 and self.key_frames[at] >= self._next + WORTH_SEEKING

    def _start(self, frame: int) -> None:
        self._decoder = self._decode(frame)
        self._next, self._held, self._problem = 0, None, ""

    def _advance(self, frame: int) -> av.VideoFrame | None:
        """Decode up to a picture; a later picture is kept for the next call."""
        assert self._decoder is not None
        self._next = frame + 1
        if self._held is None:
            self._held = next(self._decoder, None)
        while self._held is not None and self._held[0] < frame:
            self._held = next(self._decoder, None)
        if self._held is None or self._held[0] > frame:
            return None
        picture = self._held[1]
        self._held = None
        if picture.is_corrupt:
            self._problem = "the decoder marks it as damaged"
            return None
        return picture

    def _decode(self, start: int) -> Iterator[tuple[int, av.VideoFrame]]:
        """(number, picture) from the key frame before `start`, or a little later."""
        numbers = {stamp: index for index, stamp in enumerate(self.stamps or ())}
        counted = 0
        with _open(self.path) as container:
            stream = _video_stream(container, self.path)
            # Report a damaged picture instead of concealing the damage.
            stream.codec_context.options = {"err_detect": "crccheck+explode"}
            stream.thread_type = "AUTO"
            if start and len(self.key_frames) == self.count and _has_slices(stream):
                stream.thread_type = "SLICE"  # frame threads would decode later pictures too
            if start and self.stamps:
                try:
                    container.seek(self.stamps[start], stream=stream, backward=True)
                except FFmpegError:
                    container.seek(0)
            for pictures in self._packets(container, stream):
                for picture in pictures:
                    if self.stamps is None:
                        yield counted, picture
                        counted += 1
                    elif picture.pts in numbers:
                        yield numbers[picture.pts], picture

    def _packets(self, container: Any, stream: Any) -> Iterator[list[av.VideoFrame]]:
        """Decoded pictures of each packet; damaged pictures are recorded and skipped."""
        packets = container.demux(stream)
        while True:
            try:
                packet = next(packets, None)
                if packet is None:
                    return
            except FFmpegError as error:  # the file ends in the middle
                self._problem = error.strerror or str(error)
                return
            try:
                yield packet.decode()
            except FFmpegError as error:
                self._problem = error.strerror or str(error)


def open_movie(
    path: Path, frames: str | None, rate: Fraction | None, skip_bad_frames: bool
) -> MovieClip:
    """Open a movie file over the given range; raises ClipError or FrameError as `open_clip`."""
    with _open(path) as container:
        stream = _video_stream(container, path)
        first, promised, stamps, packets, keys = _index(container, stream, path)
        own_rate = stream.average_rate or stream.guessed_rate or stream.base_rate
        base = stream.time_base
    count = max(promised, packets)
    wanted = list(range(count))
    if frames is not None:
        wanted = parse_frames(frames)
        if wanted[0] < 0 or wanted[-1] >= count:
            raise ClipError(
                f"{path}: asked for {named(wanted)}, the movie has "
                f"{describe(range(count))} (its frame numbers start at 0). Choose a range inside."
            )
    if wanted[-1] >= packets and not skip_bad_frames:
        raise FrameError(
            f"{path}: frame {packets} is missing: the file ends after {packets} of {count} frames. "
            f"{LEAVE_OUT}"
        )
    height, width, channels = _shape(first)
    if height * width * channels > MOST_SAMPLES:
        raise ClipError(
            f"{path}: found {width}x{height} pixels, expected at most 13000x13000; scale it down"
        )
    notes = []
    if stamps is not None and base is not None and _varies(stamps, base, own_rate):
        notes.append(f"{path}: the frame rate varies; frames are counted, their times are not used")
    bits = max((component.bits for component in first.format.components), default=8)
    return MovieClip(
        name=path.stem,
        source=str(path),
        frames=wanted,
        rate=rate or (Fraction(own_rate) if own_rate else DEFAULT_RATE),
        width=width,
        height=height,
        encoding=_encoding(first),
        has_alpha=channels == 4,
        premultiplied=False,
        depth="float" if bits == 32 else f"uint{max(bits, 8)}",
        skip_bad_frames=skip_bad_frames,
        is_movie=True,
        notes=notes,
        path=path,
        count=count,
        stamps=stamps,
        key_frames=keys,
    )


def _open(path: Path) -> Any:
    try:
        # Without the protocol FFmpeg would read a name such as "cam:01.mov" as an address.
        return av.open(f"file:{path}", mode="r", options=ONLY_FILES)
    except (FFmpegError, OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        if isinstance(error, ValueError):  # EINVAL: not on the whitelist
            reason = f"its content is none of {', '.join(_FORMATS)}"
        if path.is_file() and path.stat().st_size == 0:
            reason = "the file is empty"
        raise ClipError(
            f"{path}: the movie cannot be opened ({reason}); expected a whole movie file that "
            "FFmpeg can read. Bring a good copy, or convert it to an image sequence."
        ) from error


def _has_slices(stream: Any) -> bool:
    """Whether several threads can decode one picture."""
    return bool(int(stream.codec_context.codec.capabilities) & int(Capabilities.slice_threads))


def _video_stream(container: Any, path: Path) -> Any:
    stream = container.streams.best("video")
    if stream is None:
        raise ClipError(f"{path}: found no video stream, expected one; give a movie with a picture")
    return stream


def _index(
    container: Any, stream: Any, path: Path
) -> tuple[av.VideoFrame, int, list[int] | None, int, list[int]]:
    """First picture, frames the header promises, stamps in order, packets, and key frames."""
    first: av.VideoFrame | None = None
    stamps: list[int | None] = []
    keys: set[int | None] = set()
    discarded = 0
    # Old VP8 files have packets without a picture; only decoding shows this.
    by_decoding = stream.codec_context.name == "vp8"
    try:
        for packet in container.demux(stream):
            if max(stream.frames, len(stamps)) > MAX_FRAMES:
                raise ClipError(
                    f"{path}: found more than {MAX_FRAMES} frames in the movie, expected fewer; "
                    "cut it into parts"
                )
            pictures: list[Any] = []
            if first is None or by_decoding:
                try:
                    pictures = packet.decode()
                except FFmpegError:
                    pictures = []
                first = first or next(iter(pictures), None)
            if packet.size == 0:
                stamps += [picture.pts for picture in pictures if by_decoding]
            elif packet.is_discard:
                discarded += 1
            elif by_decoding:
                stamps += [picture.pts for picture in pictures]
            elif not packet.is_corrupt or packet.pts is not None:
                stamps.append(packet.pts)
                if packet.is_keyframe:
                    keys.add(packet.pts)
    except FFmpegError:
        pass  # the file ends in the middle; the earlier packets count
    if first is None:
        raise ClipError(
            f"{path}: no frame can be decoded (codec {stream.codec_context.name}); expected a "
            "movie with at least one whole frame. Bring a good copy, or convert it to images."
        )
    promised = 0 if by_decoding else max(stream.frames - discarded, 0)
    known = [stamp for stamp in stamps if stamp is not None]
    if len(known) == len(stamps) == len(set(known)):
        known.sort()
        numbers = [number for number, stamp in enumerate(known) if stamp in keys]
        return first, promised, known, len(stamps), numbers
    return first, promised, None, len(stamps), []


def _varies(stamps: list[int], base: Fraction, rate: Fraction | None) -> bool:
    """Whether the time between frames varies by more than the rounding of time stamps."""
    if len(stamps) < 3 or not rate:
        return False
    gaps = np.diff(np.asarray(stamps, dtype=np.int64))
    return bool(np.ptp(gaps) > max(2, float(Fraction(1, 4) / (rate * base))))


def _encoding(picture: av.VideoFrame) -> str:
    if named := _TRANSFERS.get(int(picture.color_trc)):
        return named
    if int(picture.color_primaries) == 1 or int(picture.colorspace) == 1:
        return "Rec.709"
    return "unknown"


def _upright(pixels: F32, picture: av.VideoFrame) -> F32:
    """Apply the display matrix' rotation (anticlockwise degrees) where it is a quarter turn."""
    turns = round(picture.rotation / 90)
    return np.ascontiguousarray(np.rot90(pixels, turns)) if turns else pixels


def _fail(error: FrameError, binner: _core.ColourBinner) -> bool:
    """Return a function that raises a bad frame's error instead of filling."""
    raise error


def _shape(picture: av.VideoFrame) -> tuple[int, int, int]:
    """(h, w, 3 or 4) of its pixels, upright."""
    turned = round(picture.rotation / 90) % 2
    size = (picture.width, picture.height) if turned else (picture.height, picture.width)
    return (*size, 4 if _has_alpha(picture) else 3)


def _has_alpha(picture: av.VideoFrame) -> bool:
    layout = picture.format
    return layout.has_palette or any(component.is_alpha for component in layout.components)


def _bits(picture: av.VideoFrame) -> int:
    return max(component.bits for component in picture.format.components)


def _bin_picture(picture: av.VideoFrame, row_step: int, binner: _core.ColourBinner) -> bool:
    """Bin every `row_step`-th row of a picture; return whether all are invisible (`Fill`)."""
    if _is_luma_chroma(picture) and not _has_alpha(picture):
        bits, matrix = _bits(picture), _matrix(picture)
        red_weight, blue_weight = LUMA_WEIGHTS[matrix]
        binner.add_luma_chroma(
            *_thinned(picture, row_step),
            red_weight=red_weight,
            blue_weight=blue_weight,
            bits=bits,
            full_range=int(picture.color_range) == _FULL_RANGE,
        )
        return False
    packed = _packed(picture)
    pixels = (picture_pixels(picture) if packed is None else packed)[row_step // 2 :: row_step]
    binner.add(pixels)
    if not all_hidden(binner):
        return False
    # No pixel is visible: see `Clip.straight_colours`.
    binner.clear()
    binner.add(pixels[..., :3])
    return True


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
        lines = _plane(plane, samples)[rows * plane.height // picture.height]
        wide = np.repeat(lines, -(-picture.width // plane.width), axis=1)
        planes.append(wide[:, : picture.width])
    return planes


def picture_pixels(picture: av.VideoFrame) -> F32:
    """(h, w, 3 or 4) float32 R'G'B'(A) in 0..1 of a decoded picture, alpha straight.

    Y'CbCr is converted here in floating point with the stream's own matrix and range. Defaults are
    Rec.709 above 576 lines, else Rec.601, and limited range. libswscale only scales chroma to full
    size, because its conversion rounds.
    """
    packed = _packed(picture)
    if packed is not None:
        return packed.astype(np.float32) / np.float32(255)
    bits = _bits(picture)
    kind = np.uint8 if bits == 8 else np.uint16
    if picture.format.name in _GREYS and int(picture.color_range) != _LIMITED_RANGE:
        grey = _plane(picture.planes[0], kind).astype(np.float32) / np.float32((1 << bits) - 1)
        return np.repeat(grey[..., None], 3, axis=2)
    if picture.format.is_rgb and bits in _PLANAR_DEPTHS:
        alpha = "a" if _has_alpha(picture) else ""
        planar = _to(picture, f"gbr{alpha}p{bits}le")
        green, blue, red, *rest = [_plane(plane, kind) for plane in planar.planes]
        samples = np.stack([red, green, blue, *rest], axis=-1)
        return samples.astype(np.float32) / np.float32((1 << bits) - 1)
    if _is_luma_chroma(picture):
        return _from_luma_chroma(picture)
    wide = _to(picture, "rgba64le" if _has_alpha(picture) else "rgb48le").to_ndarray()
    return wide.astype(np.float32) / np.float32(65535)


def _packed(picture: av.VideoFrame) -> NDArray[np.uint8] | None:
    """(h, w, 3 or 4) samples of R'G'B' of up to 8 bits; None for everything else."""
    layout = picture.format
    if not (layout.is_rgb or layout.has_palette) or _bits(picture) > 8:
        return None
    packed = _to(picture, "rgba" if _has_alpha(picture) else "rgb24").to_ndarray()
    return np.asarray(packed, np.uint8)


def _to(picture: av.VideoFrame, layout: str) -> av.VideoFrame:
    """Another sample layout of the same depth, with neither matrix nor range changed."""
    if picture.format.name == layout:
        return picture
    matrix = int(picture.colorspace) if int(picture.colorspace) in (1, 4, 5, 7, 9) else 5
    # Without a stated range libswscale assumes limited range for Y'CbCr, full range for R'G'B'.
    full = int(picture.color_range) == _FULL_RANGE or picture.format.is_rgb
    return picture.reformat(
        format=layout,
        src_colorspace=matrix,
        dst_colorspace=matrix,
        src_color_range=2 if full else 1,
        dst_color_range=2 if full or layout.startswith(("rgb", "gbr")) else 1,
        interpolation="BICUBIC",
    )


def _plane(plane: Any, samples: type) -> NDArray[Any]:
    """(h, w) samples of a plane; its lines in memory may be longer."""
    kind = np.dtype(samples).newbyteorder("<")
    lines = np.frombuffer(plane, dtype=kind)[: plane.height * plane.line_size // kind.itemsize]
    return lines.reshape(plane.height, -1)[:, : plane.width]


def _is_luma_chroma(picture: av.VideoFrame) -> bool:
    """Whether a picture is Y'CbCr of a known matrix and depth."""
    return (
        picture.format.name.startswith(_LUMA_CHROMA)
        and not picture.format.is_rgb
        and _matrix(picture) in LUMA_WEIGHTS
        and _bits(picture) in _PLANAR_DEPTHS
        and not (_has_alpha(picture) and _bits(picture) == 14)
    )


def _full_chroma(picture: av.VideoFrame) -> av.VideoFrame:
    """Planar Y'CbCr(A) with as many chroma samples as luma samples."""
    bits = _bits(picture)
    depth = "" if bits == 8 else f"{bits}le"
    return _to(picture, f"yuv{'a' if _has_alpha(picture) else ''}444p{depth}")


def _matrix(picture: av.VideoFrame) -> int:
    """Matrix coefficients; if the file states none, by the number of lines."""
    stated = int(picture.colorspace)
    return (1 if picture.height > 576 else 5) if stated == _UNSPECIFIED else stated


def _from_luma_chroma(picture: av.VideoFrame) -> F32:
    """Y'CbCr -> R'G'B' in floating point (ITU-T H.273, section 8.3), clamped to 0..1."""
    bits, unit = _bits(picture), float(1 << (_bits(picture) - 8))
    kind = np.uint8 if bits == 8 else np.uint16
    planes = [_plane(plane, kind) for plane in _full_chroma(picture).planes]
    largest = float((1 << bits) - 1)
    full = int(picture.color_range) == _FULL_RANGE
    black, white = (0.0, largest) if full else (16 * unit, 219 * unit)
    span = largest if full else 224 * unit
    red_weight, blue_weight = LUMA_WEIGHTS[_matrix(picture)]
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
            np.clip(values, 0, 1, out=out[top : top + rows, :, channel])
    return out
