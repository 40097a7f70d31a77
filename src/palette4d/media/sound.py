"""Sound of a movie, copied to the movie that is made of it: packets, without decoding them.

PCM becomes AAC in .mp4, where few programs read it.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d.media.clip_movie import MovieClip
from palette4d.media.movie_index import opened_movie
from palette4d.media.pyav import FFmpegError, av

_LAYOUTS = {1: "mono", 2: "stereo", 6: "5.1", 8: "7.1"}

# Metadata of a track of sound that is kept.
_KEPT = ("language", "handler_name", "title")


@dataclass(frozen=True)
class Sound:
    """Streams of sound to copy.

    Attributes
    ----------
    path : the movie.
    streams : their numbers in it; empty if there are none that the new movie can hold.
    start, end : seconds in the movie; None: from its beginning, to its end. `origin` becomes 0.
    notes : for the user, on streams that are not copied.
    """

    path: Path
    streams: tuple[int, ...] = ()
    origin: Fraction = Fraction(0)
    start: Fraction | None = None
    end: Fraction | None = None
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, clip: MovieClip, extension: str) -> Sound:
        """Plan the copy of a movie's sound for the frames of the clip, into .mp4 or .mov."""
        notes, streams = [], []
        with opened_movie(clip.path) as movie:
            video = movie.streams.best("video")
            for stream in movie.streams:
                context = stream.codec_context
                if stream.index == video.index or "timecode" in stream.metadata:
                    continue  # timecode is written anew
                if stream.type == "audio" and context is not None and _fits(stream, extension):
                    streams.append(stream.index)
                    if _encoded(stream, extension):
                        notes.append("sound in PCM becomes AAC in .mp4; .mov keeps it as it is")
                elif stream.type == "audio":
                    name = "an unknown codec" if context is None else context.name
                    notes.append(f"sound in {name} is not copied: .{extension} cannot hold it")
                else:
                    notes.append(f"a stream of {stream.type} is not copied")
        if streams and (clip.step != 1 or clip.stamps is None or clip.varies):
            why = "the frame rate varies" if clip.varies else "frames are left out"
            return cls(
                clip.path, notes=(*dict.fromkeys(notes), f"sound is not copied, because {why}")
            )
        if not streams:
            return cls(clip.path, notes=tuple(dict.fromkeys(notes)))
        first, last = clip.frames[0], clip.frames[-1]
        return cls(
            clip.path,
            tuple(streams),
            clip.time(first),
            None if first == 0 else clip.time(first),
            None if last == clip.count - 1 else clip.time(last) + 1 / clip.rate,
            tuple(dict.fromkeys(notes)),
        )

    @contextlib.contextmanager
    def into(self, movie: Any) -> Generator[Copier]:
        """Add the streams to a movie that is being written; yield the copier of their packets."""
        with opened_movie(self.path) as source:
            chosen = [source.streams[index] for index in self.streams]
            extension = "mp4" if "mp4" in movie.format.name else "mov"
            targets = {stream.index: _added(movie, stream, extension) for stream in chosen}
            for stream in chosen:
                kept = {name: stream.metadata[name] for name in _KEPT if name in stream.metadata}
                targets[stream.index].metadata.update(kept)
            packets = source.demux(chosen) if chosen else iter(())
            encoded = {stream.index for stream in chosen if _encoded(stream, extension)}
            yield Copier(self, targets, encoded, packets)


def _encoded(stream: Any, extension: str) -> bool:
    return extension == "mp4" and str(stream.codec_context.name).startswith("pcm_")


def _added(movie: Any, stream: Any, extension: str) -> Any:
    """Add a stream of sound to a movie, like another one."""
    if not _encoded(stream, extension):
        return movie.add_stream_from_template(stream)
    context = stream.codec_context
    count = context.layout.nb_channels
    # Recorders often leave the places of channels open.
    layout = _LAYOUTS.get(count, "") if "channels" in context.layout.name else context.layout.name
    added = movie.add_stream("aac", rate=context.sample_rate, layout=layout)
    added.bit_rate = 160_000 * max(1, count)
    return added


def _fits(stream: Any, extension: str) -> bool:
    """Whether a container holds a stream: FFmpeg says so when it writes the header."""
    try:
        with av.open(io.BytesIO(), "w", format=extension) as trial:
            _added(trial, stream, extension)
            trial.start_encoding()
    except (FFmpegError, ValueError):
        return False
    return True


class Copier:
    """Packets of sound, moved to the time of the new movie."""

    def __init__(
        self, sound: Sound, targets: dict[int, Any], encoded: set[int], packets: Any
    ) -> None:
        self._sound, self._targets, self._packets = sound, targets, packets
        self._encoded = encoded
        self._held: Any = None

    def until(self, time: Fraction | None = None) -> Sequence[Any]:
        """Return the packets before a time of the new movie, or all that are left."""
        packets: list[Any] = []
        while (packet := self._next()) is not None:
            time_of_packet = packet.pts * packet.time_base
            if time is not None and time_of_packet >= time:
                self._held = packet
                break
            packets += self._written(packet)
        if time is None:
            for index in self._encoded:
                packets += self._targets[index].encode(None)
        return packets

    def _written(self, packet: Any) -> Sequence[Any]:
        target = self._targets[packet.stream_index]
        if packet.stream_index in self._encoded:
            return [encoded for sound in packet.decode() for encoded in target.encode(sound)]
        packet.stream = target
        return [packet]

    def _next(self) -> Any:
        if self._held is not None:
            packet, self._held = self._held, None
            return packet
        sound = self._sound
        for packet in self._packets:
            if packet.size == 0 or packet.pts is None:
                continue
            time = packet.pts * packet.time_base
            if (sound.start is not None and time < sound.start) or (
                sound.end is not None and time >= sound.end
            ):
                continue
            moved = round(sound.origin / packet.time_base)
            packet.pts -= moved
            packet.dts = None if packet.dts is None else packet.dts - moved
            return packet
        return None
