"""A movie of a render: its codec, what it keeps of the clip, and notes on what it cannot keep."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from palette4d.common.message import Arg, Message
from palette4d.grade.document import Document
from palette4d.media.clip import Clip, Image
from palette4d.media.clip_base import F32
from palette4d.media.clip_images import ImageClip
from palette4d.media.clip_movie import MovieClip
from palette4d.media.colour_space import FLOATS
from palette4d.media.movie_writer import Delivery, movie_writer
from palette4d.media.sound import Sound
from palette4d.media.stated import Stated
from palette4d.media.timecode import moved, start_timecode


@dataclass(frozen=True)
class MoviePlan:
    """A movie that will be written; `notes` say what it cannot keep."""

    path: Path
    size: tuple[int, int]
    rate: Fraction
    delivery: Delivery
    sound: Sound | None
    premultiplied: bool
    notes: list[str]

    @classmethod
    def of(
        cls,
        clip: Clip,
        document: Document,
        path: Path,
        size: tuple[int, int],
        *,
        alpha: bool,
        codec: str | None,
        crf: int | None,
        sound: bool,
        made_by: str,
    ) -> MoviePlan:
        """Plan a movie that states `made_by`; OutputError if the codec does not fit."""
        rate = rate_of(clip, document)
        stated = _stated(clip, rate, made_by)
        delivery = Delivery.plan(path, stated, alpha=alpha, codec=codec, crf=crf)
        delivery.check_size(path, *size)
        copied, lost = None, []
        if sound and isinstance(clip, MovieClip):
            copied = Sound.of(clip, path.suffix.lower().lstrip("."))
        if isinstance(clip, ImageClip) and clip.more:
            lost = [f"not kept of the clip's files: {clip.more}"]
        notes = [*lost, *movie_notes(clip, delivery, size), *(copied.notes if copied else ())]
        return cls(path, size, rate, delivery, copied, clip.premultiplied, notes)

    @contextlib.contextmanager
    def opened(self) -> Generator[Callable[[Image, F32], Path]]:
        """Yield a function that appends a frame to the movie."""
        with movie_writer(self.path, self.size, self.rate, self.delivery, self.sound) as append:

            def write(image: Image, pixels: F32) -> Path:
                append(pixels, self.premultiplied)
                return self.path

            yield write


def rate_of(clip: Clip, document: Document) -> Fraction:
    """Return frames per second; image files rarely state them, so that the sidecar's count."""
    return clip.rate if clip.is_movie else Fraction(*document.grade.core.clip["rate"])


def movie_notes(clip: Clip, delivery: Delivery, size: tuple[int, int]) -> list[str]:
    """Return notes on what a movie of this clip cannot keep: size, alpha, colours."""
    notes = list(delivery.notes)
    across, rows = delivery.codec.across, delivery.rows
    if size[0] % across or size[1] % rows:
        notes.append(
            f"the picture is {size[0]}x{size[1]} pixels, {delivery.codec.name} needs multiples "
            f"of {across}x{rows}; the last column or row is repeated"
        )
    bits = int(clip.depth[4:]) if clip.is_movie and clip.depth.startswith("uint") else 0
    if bits > delivery.codec.bits == 8:
        notes.append(
            Message(
                f"the clip has {bits} bits a sample, {delivery.codec.name} has 8: smooth ramps may "
                f"show bands; {Arg('codec', 'hevc')} keeps 10 bits"
            )
        )
    if "linear" in clip.encoding:
        notes.append(
            f"the clip's code values are {clip.encoding} and stay so: the movie looks dark in most "
            "players. Render frames, and convert those to a display space"
        )
    elif clip.encoding != "unknown" and not clip.stated.tags.known and not clip.is_movie:
        notes.append(
            f"the movie cannot say that its colours are {clip.encoding}: no colour tag means that"
        )
    return notes


def _stated(clip: Clip, rate: Fraction, made_by: str) -> Stated:
    """Return what a movie of the clip's frames states; its timecode is that of the first frame.

    Floats have room above white and below black, as Y'CbCr has; highlights of scene-linear clips
    are so far out of it that they would lose their hue.
    """
    start = start_timecode(clip, rate) or ""
    if start and clip.is_movie:
        start = moved(start, clip.frames[0], rate)
    display = clip.depth in FLOATS and "linear" not in clip.encoding
    headroom = clip.stated.headroom or display
    return replace(clip.stated, timecode=start, headroom=headroom, made_by=made_by)
