"""Writing movies through PyAV (FFmpeg's libraries), with the metadata of the source.

R'G'B' becomes Y'CbCr without any transfer curve. A codec without alpha gets the picture over black.
"""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d.common.files import replacing
from palette4d.common.message import Arg, Message
from palette4d.media.clip_base import F32, strips
from palette4d.media.codecs import Codec, codec_for
from palette4d.media.colour_tags import LUMA_WEIGHTS, UNKNOWN
from palette4d.media.frame_writer import OutputError, with_alpha_of
from palette4d.media.pyav import FFmpegError, Graph, av
from palette4d.media.sound import Sound
from palette4d.media.stated import Stated

#: FFmpeg's numbers: interlaced, top or bottom field first, in which order the lines are stored.
_FIELD_ORDERS = {"tff": (2, 4), "bff": (3, 5)}

#: The texts that FFmpeg writes into .mov and .mp4.
_BOTH_HOLD = {"title", "artist", "album", "comment", "copyright", "creation_time", "date", "genre"}
_BOTH_HOLD |= {"location"}
_HELD = {
    "mov": _BOTH_HOLD | {"make", "model"},
    "mp4": _BOTH_HOLD
    | {"album_artist", "composer", "description", "grouping", "keywords", "lyrics", "network"}
    | {"show", "synopsis", "episode_id", "track"},
}

#: Rows of a picture that share chroma samples at most: two of each field.
_ROWS = 4


@dataclass(frozen=True)
class Delivery:
    """How a movie is written.

    Attributes
    ----------
    codec : one of `CODECS`.
    stated : what the movie states; its tags have a matrix and a range that the codec can hold.
    alpha : whether the movie keeps alpha.
    crf : quality of H.264 and HEVC, 0 (lossless) to 51; None for the default.
    notes : for the user, on metadata that is lost.
    """

    codec: Codec
    stated: Stated
    alpha: bool = False
    crf: int | None = None
    notes: tuple[str, ...] = ()

    @classmethod
    def plan(
        cls,
        path: Path,
        stated: Stated,
        *,
        alpha: bool = False,
        codec: str | None = None,
        crf: int | None = None,
    ) -> Delivery:
        """Choose the codec, and check that it can hold the source's metadata.

        Raises
        ------
        OutputError
            The codec is unknown, does not fit the file's name, or cannot hold fields.
        """
        chosen = codec_for(path, codec, stated.tags.transfer)
        if crf is not None and "crf" not in chosen.options:
            raise OutputError(
                f"output {path}: found {Arg('crf', crf)} for {chosen.name}, expected it for h264 "
                f"and hevc alone; choose {Arg('codec')}"
            )
        if stated.fields and not chosen.interlaced:
            raise OutputError(
                f"output {path}: found an interlaced clip for {chosen.name}, which holds "
                f"progressive pictures alone; choose {Arg('codec', 'prores422hq')} or h264, or "
                "deinterlace the clip first"
            )
        tags = stated.tags.for_luma_chroma()
        notes = []
        if tags.full_range and not chosen.full_range:
            tags = dataclasses.replace(tags, full_range=False)
            notes.append(f"the clip has full range, {chosen.name} holds limited range; both match")
        if chosen.encoder == "dnxhd":
            # FFmpeg's DNxHR says Rec.709 in the stream, and .mov states both of these or nothing.
            tags = dataclasses.replace(tags, matrix=1)
            if not tags.known and tags.pair != (UNKNOWN, UNKNOWN):
                notes.append(
                    f"{chosen.name} states primaries and transfer together or not at all: the "
                    "clip states one, the movie none"
                )
        if stated.hdr10 and "x265-params" not in chosen.options:
            notes.append(
                f"the mastering display and the light levels of HDR10 are not kept: {chosen.name} "
                f"does not hold them; {Arg('codec', 'hevc')} does"
            )
        if alpha and not chosen.alpha_layout:
            notes.append(
                "the movie has no alpha, the picture is laid over black; frames and "
                f"{Arg('codec', 'prores4444')} keep it"
            )
        held = _HELD[path.suffix.lower().lstrip(".")]
        if lost := [name for name, _ in stated.texts if name not in held]:
            notes.append(f"the movie does not keep of the clip's metadata: {', '.join(lost)}")
        texts = tuple(text for text in stated.texts if text[0] in held)
        return cls(
            chosen,
            dataclasses.replace(stated, tags=tags, texts=texts),
            alpha and bool(chosen.alpha_layout),
            crf,
            tuple(map(Message, notes)),
        )

    @property
    def rows(self) -> int:
        """The height is a multiple of this."""
        return self.codec.down * (2 if self.stated.fields and self.codec.down > 1 else 1)

    def size(self, width: int, height: int) -> tuple[int, int]:
        """The size of the movie, in which chroma samples are whole."""
        return width + -width % self.codec.across, height + -height % self.rows

    def check_size(self, path: Path, width: int, height: int) -> None:
        """Refuse a picture that is too small for the codec."""
        least = self.codec.least
        if width < least[0] or height < least[1]:
            raise OutputError(
                f"output {path}: found {width}x{height} pixels for {self.codec.name}, expected at "
                f"least {least[0]}x{least[1]}; choose another {Arg('codec')}"
            )


@contextlib.contextmanager
def movie_writer(
    path: Path,
    size: tuple[int, int],
    rate: Fraction,
    delivery: Delivery | None = None,
    sound: Sound | None = None,
) -> Generator[Callable[[F32, bool], None]]:
    """Yield a function that appends a frame; the file appears when the body succeeds.

    After an error or Ctrl-C in the body, the old file is unchanged.

    Parameters
    ----------
    path : `.mp4` or `.mov`; a file that is there is replaced.
    size : (int, int); width and height in pixels. Where pixels share a chroma sample, an odd size
        grows by one: the last column or row is repeated.
    rate : frames per second.
    delivery : codec, tags and so on; by default the codec of the file's name, unknown colours.
    sound : the streams to copy.

    Yields
    ------
    callable
        ((h, w, 3 or 4) float32 R'G'B'(A), whether colours are premultiplied). NaN is 0. Values
        are clamped to 0..1, or, if the source has `Stated.headroom`, to the codec's code values.
    """
    how = delivery or Delivery.plan(path, Stated())
    how.check_size(path, *size)
    with replacing(path, force=True) as temporary:
        try:
            with (
                av.open(f"file:{temporary}", "w", options={"movflags": "+faststart"}) as movie,
                contextlib.ExitStack() as opened,
            ):
                stream = _stream(movie, size, rate, how)
                copier = opened.enter_context(sound.into(movie)) if sound else None
                field_flags = _FieldFlags(how.stated.fields)
                count, written = 0, itertools.count(-2)

                def append(pixels: F32, premultiplied: bool) -> None:
                    nonlocal count
                    picture = _picture(pixels, premultiplied, how)
                    picture.pts, picture.time_base = count, 1 / rate
                    picture = field_flags.set(picture)
                    # ProRes reads its tags from the picture, H.264 from the stream.
                    tags = how.stated.tags
                    picture.color_primaries, picture.color_trc = tags.primaries, tags.transfer
                    movie.mux(_timed(stream.encode(picture), how.codec, written))
                    count += 1
                    if copier is not None:
                        movie.mux(copier.until(count / rate))

                yield append
                movie.mux(_timed(stream.encode(None), how.codec, written))
                if copier is not None:
                    movie.mux(copier.until())
        except FFmpegError as error:
            raise OutputError(
                f"{path}: the movie cannot be written ({error.strerror}); expected room on the "
                "disk and a size that the encoder takes. Check both, or render frames: "
                "OUT.####.png"
            ) from error


def _stream(movie: Any, size: tuple[int, int], rate: Fraction, how: Delivery) -> Any:
    """Add the video stream with all that it states."""
    stated, tags = how.stated, how.stated.tags
    options = dict(how.codec.options)
    if how.crf is not None:
        options["crf"] = str(how.crf)
    if stated.fields:
        options["flags"] = "+ildct+ilme"
        if stated.fields == "bff" and how.codec.encoder == "libx264":
            options["x264-params"] = "bff=1"  # x264 reads the first picture's flag too late
    if stated.hdr10 and "x265-params" in options:
        options["x265-params"] += f":{stated.hdr10}"
    stream = movie.add_stream(how.codec.encoder, rate=rate, options=options)
    stream.width, stream.height = how.size(*size)
    stream.pix_fmt = how.codec.alpha_layout if how.alpha else how.codec.layout
    stream.color_primaries, stream.color_trc = tags.primaries, tags.transfer
    stream.colorspace, stream.color_range = tags.matrix, 2 if tags.full_range else 1
    context = stream.codec_context
    if stated.pixel_aspect != 1:
        context.sample_aspect_ratio = stated.pixel_aspect
    if stated.fields:
        orders = _FIELD_ORDERS[stated.fields]
        context.field_order = stated.field_order if stated.field_order in orders else orders[0]
    if how.codec.encoder == "libx265":
        context.codec_tag = "hvc1"  # which QuickTime needs
    movie.metadata.update(stated.texts)
    own = {"timecode": stated.timecode, "reel_name": stated.reel, "handler_name": stated.handler}
    own["title"] = stated.made_by  # of the track; FFmpeg reads it as "name"
    for name, text in own.items():
        if text:
            stream.metadata[name] = text
    # Threads that share a frame keep one in memory; those of x264 would code it worse.
    stream.thread_type = "SLICE" if how.codec.encoder == "prores_ks" else "AUTO"
    return stream


def _timed(packets: Any, codec: Codec, written: Iterator[int]) -> Any:
    """Return encoded packets with times of decoding.

    x265 leaves these undefined if a movie is shorter than its delay, which is two frames.
    """
    if codec.encoder == "libx265":
        for packet in packets:
            packet.dts = next(written)
    return packets


class _FieldFlags:
    """Marks pictures as interlaced with FFmpeg's filter, because PyAV cannot."""

    def __init__(self, fields: str) -> None:
        self._fields = fields
        self._graph: Any = None

    def set(self, picture: av.VideoFrame) -> av.VideoFrame:
        """Return the picture, marked."""
        if not self._fields:
            return picture
        self._graph = self._graph or self._made(picture)
        self._graph.push(picture)
        marked: av.VideoFrame = self._graph.pull()
        return marked

    def _made(self, picture: av.VideoFrame) -> Any:
        graph = Graph()
        chain = (
            graph.add_buffer(
                width=picture.width,
                height=picture.height,
                format=picture.format,
                time_base=picture.time_base,
            ),
            graph.add("setfield", f"mode={self._fields}"),
            graph.add("buffersink"),
        )
        chain[0].link_to(chain[1])
        chain[1].link_to(chain[2])
        graph.configure()
        return graph


def _with_alpha(pixels: F32, premultiplied: bool, how: Delivery) -> F32:
    """Return the pixels in the movie's kind of alpha: straight, or over black without alpha."""
    if pixels.shape[2] == 3:
        if not how.alpha:
            return pixels
        return np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=2)
    if how.alpha:
        return with_alpha_of("png", pixels, premultiplied)[0]
    return pixels[..., :3] * (np.float32(1) if premultiplied else pixels[..., 3:])


def _picture(pixels: F32, premultiplied: bool, how: Delivery) -> av.VideoFrame:
    """R'G'B'(A) (h, w, 3 or 4) as Y'CbCr(A), made strip by strip.

    An odd size grows: the last column or row is repeated.
    """
    codec = how.codec
    height, width = pixels.shape[:2]
    below, right = -height % how.rows, -width % codec.across
    layout = codec.alpha_layout if how.alpha else codec.layout
    picture = av.VideoFrame(width + right, height + below, layout)
    picture.colorspace = how.stated.tags.matrix
    picture.color_range = 2 if how.stated.tags.full_range else 1
    lines = [_lines(plane) for plane in picture.planes]
    for rows in strips(picture.height, picture.width, _ROWS):
        part = _with_alpha(pixels[rows], premultiplied, how)
        missing = rows.stop - rows.start - len(part)
        part = np.pad(part, ((0, missing), (0, right), (0, 0)), "edge")
        for k, samples in enumerate(_planes(part, how)):
            top = rows.start * len(lines[k]) // picture.height
            lines[k][top : top + len(samples), : samples.shape[1]] = samples
    return picture


def _lines(plane: Any) -> NDArray[Any]:
    """Return the lines of a plane's samples, as long as they are in its memory, and empty."""
    kind = np.dtype("<u2" if plane.line_size >= 2 * plane.width else "u1")
    length = plane.line_size // kind.itemsize
    lines = np.frombuffer(plane, kind)[: plane.height * length].reshape(plane.height, length)
    lines[:] = 0
    return lines


def _planes(pixels: F32, how: Delivery) -> Iterator[NDArray[np.floating[Any]]]:
    """Yield the samples of each plane (ITU-T H.273, section 8.3), rounded once.

    libswscale has errors of up to one 8-bit step, and is on average half a step too bright.
    """
    codec, tags = how.codec, how.stated.tags
    pixels = np.nan_to_num(pixels, nan=0.0, posinf=1.0, neginf=0.0)
    # Wider than the range of Y'CbCr, so that only the codec's limits clamp the colours.
    room = 1 if how.stated.headroom else 0
    pixels = np.clip(pixels, -room, 1 + room)
    red, blue = LUMA_WEIGHTS[tags.matrix]
    luma = pixels[..., :3] @ np.array([red, 1 - red - blue, blue], np.float32)
    unit, top = 1 << (codec.bits - 8), (1 << codec.bits) - 1
    black, white, span = (0, top, top) if tags.full_range else (16 * unit, 219 * unit, 224 * unit)
    limits = (0, top) if tags.full_range else (unit, 255 * unit - 1)
    yield np.clip(np.rint(black + white * luma), *limits)
    for channel, weight in ((2, blue), (0, red)):
        chroma = (pixels[..., channel] - luma) * np.float32(span / (2 * (1 - weight)))
        yield np.clip(np.rint(128 * unit + _shared(chroma, how)), *limits)
    if how.alpha:
        yield np.clip(np.rint(np.clip(pixels[..., 3], 0, 1) * top), 0, top)


def _shared(chroma: F32, how: Delivery) -> F32:
    """Return chroma (h, w) at the places of its samples: even columns, and between rows."""
    if how.codec.across == 2:
        before = np.concatenate([chroma[:, :1], chroma[:, 1:-1:2]], axis=1)
        chroma = (before + 2 * chroma[:, ::2] + chroma[:, 1::2]) / np.float32(4)
    if how.codec.down == 1:
        return chroma
    if not how.stated.fields:
        return np.asarray(chroma.reshape(-1, 2, chroma.shape[1]).mean(axis=1))
    # A quarter of the way from the field's upper row to its lower one, or three (H.264, 6.2).
    rows = chroma.reshape(-1, 4, chroma.shape[1])
    upper = 0.75 * rows[:, 0] + 0.25 * rows[:, 2]
    lower = 0.25 * rows[:, 1] + 0.75 * rows[:, 3]
    return np.stack([upper, lower], axis=1).reshape(-1, chroma.shape[1]).astype(np.float32)
