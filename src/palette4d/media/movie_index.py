"""The index of a movie file: its pictures and their times, from packets, without decoding."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from palette4d.common.arguments import MAX_FRAMES
from palette4d.common.sandbox import kept_closed
from palette4d.media.clip_base import ClipError
from palette4d.media.movie_boxes import boxes
from palette4d.media.movie_length import is_cut_short, promised_frames
from palette4d.media.pyav import FFmpegError, av

#: FFmpeg's names of the formats of `MOVIE_EXTENSIONS`. It recognises formats by content, and
#: playlists such as ffconcat or HLS would lead it to other files.
_FORMATS = (
    *("asf", "avi", "flv", "gif", "m4v", "matroska", "mov", "mpeg", "mpegts", "mpegvideo", "mxf"),
    *("nut", "ogg", "yuv4mpegpipe"),
)
#: The options of `av.open` for a movie.
ONLY_FILES = {"format_whitelist": ",".join(_FORMATS), "protocol_whitelist": "file"}
#: The most pictures that a codec decodes before one that is shown earlier (H.264, HEVC).
REORDERED = 16


def opened_movie(path: Path) -> Any:
    """Open a movie file to read; ClipError if FFmpeg cannot."""
    try:
        # Without the protocol FFmpeg would read a name such as "cam:01.mov" as an address.
        return av.open(f"file:{path}", mode="r", options=ONLY_FILES)
    except (FFmpegError, OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        if isinstance(error, ValueError):  # EINVAL: not on the whitelist
            reason = f"its content is none of {', '.join(_FORMATS)}"
        if path.is_file() and path.stat().st_size == 0:
            reason = "the file is empty"
        elif _lacks_index(path):
            raise ClipError(
                f"{path}: the movie has no index yet: it is still being written, or its writing "
                "was cut short; wait until it is done, or bring a whole copy"
            ) from error
        reason += kept_closed(path)
        raise ClipError(
            f"{path}: the movie cannot be opened ({reason}); expected a whole movie file that "
            "FFmpeg can read. Bring a good copy, or convert it to an image sequence."
        ) from error


def _lacks_index(path: Path) -> bool:
    """Whether a file is a .mov or .mp4 without the box `moov`, which is written last."""
    try:
        with path.open("rb") as file:
            kinds = {kind for kind, _ in boxes(file)}
    except OSError:
        return False
    return bool(kinds & {b"ftyp", b"mdat", b"wide"}) and b"moov" not in kinds


@dataclass(frozen=True)
class Index:
    """A movie's pictures and their times.

    Attributes
    ----------
    first : the first picture that can be decoded.
    count : the frames that the header promises, or that are there if these are more.
    packets : the frames that are there.
    stamps : presentation time stamps in order; None if pictures can only be counted.
    key_frames : the numbers of the key frames, in order; empty if they are not known.
    is_cut_short : whether frames are missing at the end, and the file does not say how many.
    """

    first: av.VideoFrame
    count: int
    packets: int
    stamps: list[int] | None
    key_frames: list[int]
    is_cut_short: bool


def video_stream(container: Any, path: Path) -> Any:
    """Return the stream with the picture; `ClipError` if there is none."""
    stream = container.streams.best("video")
    if stream is None:
        raise ClipError(f"{path}: found no video stream, expected one; give a movie with a picture")
    if stream.codec_context is None:
        raise ClipError(
            f"{path}: FFmpeg does not know the codec of its picture; convert the movie to one of "
            "ProRes, DNxHR or H.264"
        )
    return stream


def index_of(container: Any, stream: Any, path: Path) -> Index:
    """Read all packets of a movie; `ClipError` if no picture can be decoded."""
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
    promised = 0
    if not by_decoding:
        promised = max(promised_frames(container, stream, path) - discarded, 0)
    known = sorted(stamp for stamp in stamps if stamp is not None)
    told = len(known) == len(stamps) == len(set(known))
    fragments = not promised and "mov" in container.format.name
    return Index(
        first,
        count=max(promised, len(stamps)),
        packets=len(stamps),
        stamps=known if told else None,
        key_frames=[i for i, stamp in enumerate(known) if stamp in keys] if told else [],
        is_cut_short=fragments and is_cut_short(path),
    )


def varies(stamps: list[int], base: Fraction, rate: Fraction | None) -> bool:
    """Whether the time between frames varies by more than the rounding of time stamps."""
    if len(stamps) < 3 or not rate:
        return False
    gaps = np.diff(np.asarray(stamps, dtype=np.int64)).astype(np.float64)
    allowed = max(2.0, float(Fraction(1, 4) / (rate * base)))
    # A stream that was trimmed without encoding lacks pictures at its ends, which others need.
    usual = max(1.0, float(np.median(gaps)))
    whole = np.abs(gaps - np.rint(gaps / usual) * usual) <= allowed
    index = np.arange(len(gaps))
    ends = np.logical_or(index < REORDERED, index >= len(gaps) - REORDERED)
    lacks = whole & (gaps > 1.5 * usual) & ends
    return bool(np.ptp(gaps[~lacks]) > allowed) if not lacks.all() else False
