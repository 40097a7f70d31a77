"""Sound of a movie, copied to the movie that is made of it: packets, without decoding them."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
from av.error import FFmpegError

from palette4d.media.clip_movie import MovieClip, opened_movie


@dataclass(frozen=True)
class Sound:
    """Streams of sound to copy.

    Attributes
    ----------
    path : the movie.
    streams : their numbers in it; empty if there are none that the new movie can hold.
    start, end : seconds in the movie; None: from its beginning, to its end. `origin` becomes 0.
    notes : for the user, what is not copied.
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
            for one in movie.streams:
                if one.index == video.index or "timecode" in one.metadata:
                    continue  # timecode is written anew
                if one.type == "audio" and _fits(one, extension):
                    streams.append(one.index)
                elif one.type == "audio":
                    name = one.codec_context.name
                    notes.append(f"sound in {name} is not copied: .{extension} cannot hold it")
                else:
                    notes.append(f"a stream of {one.type} is not copied")
        if streams and (clip.step != 1 or clip.stamps is None or clip.varies):
            why = "the frame rate varies" if clip.varies else "frames are left out"
            return cls(clip.path, notes=(*notes, f"sound is not copied, because {why}"))
        if not streams:
            return cls(clip.path, notes=tuple(notes))
        first, last = clip.frames[0], clip.frames[-1]
        return cls(
            clip.path,
            tuple(streams),
            clip.time(first),
            None if first == 0 else clip.time(first),
            None if last == clip.count - 1 else clip.time(last) + 1 / clip.rate,
            tuple(notes),
        )

    @contextlib.contextmanager
    def into(self, movie: Any) -> Generator[Copier]:
        """Add the streams to a movie that is written; yields what copies their packets."""
        with opened_movie(self.path) as source:
            chosen = [source.streams[index] for index in self.streams]
            targets = {one.index: movie.add_stream_from_template(one) for one in chosen}
            packets = source.demux(chosen) if chosen else iter(())
            yield Copier(self, targets, packets)


def _fits(stream: Any, extension: str) -> bool:
    """Whether a container holds a stream: FFmpeg says so when it writes the header."""
    try:
        with av.open(io.BytesIO(), "w", format=extension) as trial:
            trial.add_stream_from_template(stream)
            trial.start_encoding()
    except (FFmpegError, ValueError):
        return False
    return True


class Copier:
    """Packets of sound, moved to the time of the new movie."""

    def __init__(self, sound: Sound, targets: dict[int, Any], packets: Any) -> None:
        self._sound, self._targets, self._packets = sound, targets, packets
        self._held: Any = None

    def until(self, time: Fraction | None = None) -> Sequence[Any]:
        """Return the packets before a time of the new movie, or all that are left."""
        found = []
        while (packet := self._next()) is not None:
            at = packet.pts * packet.time_base
            if time is not None and at >= time:
                self._held = packet
                break
            packet.stream = self._targets[packet.stream_index]
            found.append(packet)
        return found

    def _next(self) -> Any:
        if self._held is not None:
            packet, self._held = self._held, None
            return packet
        sound = self._sound
        for packet in self._packets:
            if packet.size == 0 or packet.pts is None:
                continue
            at = packet.pts * packet.time_base
            if (sound.start is not None and at < sound.start) or (
                sound.end is not None and at >= sound.end
            ):
                continue
            moved = round(sound.origin / packet.time_base)
            packet.pts -= moved
            packet.dts = None if packet.dts is None else packet.dts - moved
            return packet
        return None
