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
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d import _core
from palette4d.common.arguments import parse_frames
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
    describe,
    named,
)
from palette4d.media.colour_tags import LUMA_WEIGHTS, MATRICES, UNKNOWN, UNREADABLE, encoding_of
from palette4d.media.movie_index import index_of, opened_movie, varies, video_stream
from palette4d.media.movie_pixels import (
    bin_picture,
    is_luma_chroma,
    picture_pixels,
    shape_of,
    turn,
    upright,
)
from palette4d.media.movie_stated import stated_by
from palette4d.media.pyav import Capabilities, FFmpegError, av

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
    time_base: Fraction = field(kw_only=True, default=Fraction(1))
    #: Whether the time between frames varies.
    varies: bool = field(kw_only=True, default=False)
    #: The matrix of pictures that state none.
    matrix: int = field(kw_only=True, default=1)
    _decoder: Iterator[tuple[int, av.VideoFrame]] | None = field(default=None, init=False)
    _next: int = field(default=0, init=False)
    _held: tuple[int, av.VideoFrame] | None = field(default=None, init=False)
    _problems: list[str] = field(default_factory=list, init=False)

    def file(self, frame: int) -> Path:
        """Return the movie file, which holds every frame."""
        return self.path

    @property
    def all_frames(self) -> Sequence[int]:
        """The frames of the file that can be looked for."""
        return range(len(self.stamps) if self.stamps else self.count)

    def time(self, frame: int) -> Fraction:
        """Return the time at which a frame is shown, in seconds of the file."""
        return Fraction(self.stamps[frame] * self.time_base) if self.stamps else frame / self.rate

    def load(self, frame: int) -> Image:
        """Decode one picture; FrameError if it is damaged, missing or of another size."""
        picture = self._picture(frame)
        return Image(frame, upright(picture_pixels(picture), picture))

    def load_small(self, frame: int, width: int, height: int) -> F32:
        """Decode one picture for a preview, scaled before it is converted where that is quicker.

        Returns
        -------
        (height, width, 3 or 4) float32, or the whole picture as `load` where the layout needs it.
        """
        picture = self._picture(frame)
        if any(turn(picture)) or not is_luma_chroma(picture):
            return upright(picture_pixels(picture), picture)
        matrix, spread = picture.colorspace, 2 if self.stated.tags.full_range else 1
        small = picture.reformat(
            width=width,
            height=height,
            src_colorspace=5,
            dst_colorspace=5,
            src_color_range=spread,
            dst_color_range=spread,
            interpolation="AREA",
            threads=1,  # as `movie_pixels` has it
        )
        small.colorspace, small.color_range = matrix, spread
        return picture_pixels(small)

    def fills(self, frames: Sequence[int]) -> Iterator[tuple[int, Fill]]:
        """Decode the frames in order; one frame may be binned while the next is decoded."""
        for frame in frames:
            try:
                fill: Fill = functools.partial(bin_picture, self._picture(frame), self.row_step)
            except FrameError as error:
                fill = functools.partial(_fail, error)
            yield frame, fill

    def _picture(self, frame: int) -> av.VideoFrame:
        picture = self._find(frame)
        if picture is not None and int(picture.colorspace) == UNKNOWN:
            picture.colorspace = self.matrix
        if picture is None:
            why = f" ({self._problems[-1]})" if self._problems else ""
            raise FrameError(
                f"{self.path}: frame {frame} cannot be decoded{why}; expected {self.count} whole "
                "frames.",
                LEAVE_OUT,
            )
        shape = shape_of(picture)
        if shape != (self.height, self.width, 4 if self.has_alpha else 3):
            height, width, channels = shape
            raise FrameError(
                f"{self.path}: frame {frame} is {width}x{height} pixels with {channels} channels, "
                f"expected {self.width}x{self.height} with {4 if self.has_alpha else 3} as in the "
                "frames before.",
                LEAVE_OUT,
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
        index = bisect.bisect_right(self.key_frames, frame) - 1
        return index >= 0 and self.key_frames[index] >= self._next + WORTH_SEEKING

    def _start(self, frame: int) -> None:
        self._next, self._held, self._problems = 0, None, []
        all_keys = len(self.key_frames) == self.count
        self._decoder = _decode(self.path, self.stamps, frame, all_keys, self._problems)

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
            self._problems.append("the decoder marks it as damaged")
            return None
        return picture


# Not methods: a clip that is in its own decoder would keep the movie open after its last use, and
# Windows replaces and renames no open file.
def _decode(
    path: Path, stamps: list[int] | None, start: int, all_keys: bool, problems: list[str]
) -> Iterator[tuple[int, av.VideoFrame]]:
    """(number, picture) from the key frame before `start`, or a little later."""
    numbers = {stamp: index for index, stamp in enumerate(stamps or ())}
    counted = 0
    with opened_movie(path) as container:
        stream = video_stream(container, path)
        # Report a damaged picture instead of concealing the damage. FFmpeg's TIFF decoder also
        # reports whole files, because of their Exif.
        if stream.codec_context.name != "tiff":
            stream.codec_context.options = {"err_detect": "crccheck+explode"}
        stream.thread_type = "AUTO"
        if start and all_keys and _has_slices(stream):
            stream.thread_type = "SLICE"  # frame threads would decode later pictures too
        if start and stamps:
            try:
                last = len(stamps) - 1  # of a movie that was cut short
                container.seek(stamps[min(start, last)], stream=stream, backward=True)
            except FFmpegError:
                container.seek(0)
        for pictures in _packets(container, stream, problems):
            for picture in pictures:
                if stamps is None:
                    yield counted, picture
                    counted += 1
                elif picture.pts in numbers:
                    yield numbers[picture.pts], picture


def _packets(container: Any, stream: Any, problems: list[str]) -> Iterator[list[av.VideoFrame]]:
    """Decoded pictures of each packet; damaged pictures are recorded and skipped."""
    packets = container.demux(stream)
    while True:
        try:
            packet = next(packets, None)
            if packet is None:
                return
        except FFmpegError as error:  # the file ends in the middle
            problems.append(error.strerror or str(error))
            return
        try:
            yield packet.decode()
        except FFmpegError as error:
            problems.append(error.strerror or str(error))


def open_movie(
    path: Path,
    frames: str | None,
    rate: Fraction | None,
    skip_bad_frames: bool,
    matrix: str | None = None,
) -> MovieClip:
    """Open a movie file over the given range; raises ClipError or FrameError as `open_clip`."""
    with opened_movie(path) as container:
        stream = video_stream(container, path)
        index = index_of(container, stream, path)
        first, stamps, count = index.first, index.stamps, index.count
        untagged, notes = _resolve_matrix(first, path, matrix)
        stated = stated_by(container, stream, first)
        own_rate = stream.average_rate or stream.guessed_rate or stream.base_rate
        # PyAV has rationals of its own since 19.
        base = Fraction(stream.time_base) if stream.time_base else None
    if index.is_cut_short:
        notes.append(
            f"{path}: the file ends in the middle of its frames, and does not say how many are "
            f"missing behind the {index.packets} that are there; bring a whole copy"
        )
    wanted = list(range(count))
    if frames is not None:
        wanted = parse_frames(frames)
        if wanted[0] < 0 or wanted[-1] >= count:
            raise ClipError(
                f"{path}: asked for {named(wanted)}, the movie has "
                f"{describe(range(count))} (its frame numbers start at 0). Choose a range inside."
            )
    if wanted[-1] >= index.packets and not skip_bad_frames:
        raise FrameError(
            f"{path}: frame {index.packets} is missing: the file ends after {index.packets} of "
            f"{count} frames.",
            LEAVE_OUT,
        )
    height, width, channels = shape_of(first)
    if height * width * channels > MOST_SAMPLES:
        raise ClipError(
            f"{path}: found {width}x{height} pixels, expected at most 13000x13000; scale it down"
        )
    uneven = stamps is not None and base is not None and varies(stamps, base, own_rate)
    if uneven:
        notes.append(f"{path}: the frame rate varies; frames are counted, their times are not used")
    bits = max((component.bits for component in first.format.components), default=8)
    return MovieClip(
        name=path.stem,
        source=str(path),
        frames=wanted,
        rate=rate or (Fraction(own_rate) if own_rate else DEFAULT_RATE),
        width=width,
        height=height,
        encoding=encoding_of(stated.tags if not untagged else replace(stated.tags, matrix=UNKNOWN)),
        stated=stated,
        has_alpha=channels == 4,
        premultiplied=False,
        depth="float" if bits == 32 else f"uint{max(bits, 8)}",
        skip_bad_frames=skip_bad_frames,
        is_movie=True,
        notes=notes,
        path=path,
        count=count,
        stamps=stamps,
        key_frames=index.key_frames,
        time_base=base or Fraction(1),
        varies=uneven,
        matrix=untagged or int(first.colorspace),
    )


def _resolve_matrix(picture: av.VideoFrame, path: Path, asked: str | None) -> tuple[int, list[str]]:
    """Give a Y'CbCr picture without a matrix one; returns that (0 for others), and notes.

    Unless the user asks for another, HD is Rec.709 and SD is Rec.601.
    """
    stated = int(picture.colorspace)
    if stated in UNREADABLE and not picture.format.is_rgb:
        raise ClipError(
            f"{path}: found the Y'CbCr matrix {UNREADABLE[stated]}, expected one of Rec.709, "
            "Rec.601, Rec.2020 (non-constant luminance) or SMPTE 240M; convert the movie, as with "
            "FFmpeg's zscale=matrix=709"
        )
    if stated == UNKNOWN and not picture.format.is_rgb:
        hd = picture.width >= 1280 or picture.height > 576
        picture.colorspace = MATRICES[asked] if asked else 1 if hd else 5
        return int(picture.colorspace), []
    notes = []
    if stated == 10:
        notes.append(f"{path}: Rec.2020 with constant luminance is read as if it were not constant")
    if asked and stated in LUMA_WEIGHTS:
        notes.append(f"{path}: the movie states its matrix itself; matrix={asked} is not used")
    return 0, notes


def _has_slices(stream: Any) -> bool:
    """Whether several threads can decode one picture."""
    return bool(int(stream.codec_context.codec.capabilities) & int(Capabilities.slice_threads))


def _fail(error: FrameError, binner: _core.ColourBinner) -> bool:
    """Return a function that raises a bad frame's error instead of filling."""
    raise error
