"""Clips of image files, read through OpenImageIO. `image_header` reads their headers."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.arguments import MAX_FRAMES, parse_frames
from palette4d.common.message import Arg
from palette4d.media import dpx_alpha, oiio_text
from palette4d.media.clip_base import (
    DEFAULT_RATE,
    F32,
    LEAVE_OUT,
    Clip,
    ClipError,
    Fill,
    FrameError,
    Image,
    all_hidden,
    describe,
    named,
    progression_step,
    strips,
)
from palette4d.media.clip_sequence import ImageSequence
from palette4d.media.exr_around import Around
from palette4d.media.image_header import Header, header_of, opened, read_header, unreadable
from palette4d.media.reading import Reading
from palette4d.media.stated import Stated


@dataclass(repr=False)
class ImageClip(Clip):
    """An image sequence, or a single image as a clip of one frame."""

    sequence: ImageSequence = field(kw_only=True)
    #: Other contents of EXR files, in words: channels, parts, overscan; "" for none.
    more: str = field(kw_only=True, default="")
    #: Whether frames are read with their overscan: the data window, not the display window.
    whole: bool = field(kw_only=True, default=False)
    reading: Reading = field(kw_only=True, default_factory=Reading)

    @property
    def separable(self) -> bool:
        """Whether the picture can be replaced in its files: EXR, upright, with its own channels."""
        first = next(iter(self.sequence.files.values()))
        header = read_header(first, "the first file", self.reading)
        exr = self.sequence.suffix.lower() == ".exr"
        return exr and header.is_upright and len(set(header.channels)) == len(header.channels)

    def surroundings(self) -> str:
        """Other contents of the sequence's EXR files, in words: of the first file that has some."""
        if self.more or self.sequence.suffix.lower() != ".exr":
            return self.more
        for frame in self.sequence.numbers:
            with contextlib.suppress(FrameError):
                if more := read_header(self.file(frame), f"frame {frame}", self.reading).more:
                    return more
        return ""

    def file(self, frame: int) -> Path:
        """The file of a frame, whether it exists or not."""
        return self.sequence.path(frame)

    @property
    def all_frames(self) -> Sequence[int]:
        """The numbers of the sequence's files."""
        return self.sequence.numbers

    @property
    def outside(self) -> list[int]:
        """The frames before the first and behind the last file."""
        first, last = min(self.sequence.files), max(self.sequence.files)
        return [frame for frame in self.frames if not first <= frame <= last]

    def load(self, frame: int) -> Image:
        """Read one frame; FrameError when it is missing, unreadable, or of another size."""
        header, stored, spec = self._read(frame)
        pixels = _upright(_scaled(stored, header.bits), spec.get_int_attribute("Orientation", 1))
        left, top = (spec.full_x - spec.x, spec.full_y - spec.y) if self.whole else (0, 0)
        picture = left, top, header.width, header.height
        around = Around(self.file(frame), header.part, header.channels, picture)
        return Image(frame, np.ascontiguousarray(pixels), header.metadata, around)

    def fills(self, frames: Sequence[int]) -> Iterator[tuple[int, Fill]]:
        """Yield for each frame its number and the function that reads and bins it."""
        for frame in frames:
            yield frame, functools.partial(self._fill, frame)

    def _fill(self, frame: int, binner: _core.ColourBinner) -> bool:
        header, stored, _ = self._read(frame)
        rows = stored[self.row_step // 2 :: self.row_step]
        if rows.dtype not in (np.uint8, np.uint16, np.float32):
            rows = _scaled(rows, 0)
        bits = header.bits or 16
        binner.add(rows, bits=bits, premultiplied=self.premultiplied)
        if not self.has_alpha or not all_hidden(binner):
            return False
        # No pixel is visible: see `straight_colours`.
        binner.clear()
        binner.add(rows[..., :3], bits=bits)
        return True

    def _read(self, frame: int) -> tuple[Header, NDArray[Any], Any]:
        """Header, (h, w, 3 or 4) stored samples, and what OpenImageIO says of the file."""
        path, what = self._path(frame), f"frame {frame}"
        source, spec, chosen = opened(path, what, self.reading)
        header = header_of(spec, chosen, source.current_subimage())
        self._check(header, frame)
        first, last = min(chosen), max(chosen) + 1
        stored = source.read_image(source.current_subimage(), 0, first, last, spec.format)
        problem = oiio_text.problem_of(source)
        source.close()
        # A damaged JPEG returns grey pixels together with an error.
        if stored is None or problem:
            raise unreadable(path, what, problem)
        samples = np.asarray(stored)
        if chosen != list(range(first, last)):
            samples = samples[..., [channel - first for channel in chosen]]
        samples = dpx_alpha.with_last(samples, path, header.bits)
        if not self.whole:
            samples = _in_display_window(samples, spec)
        return header, samples, spec

    def _path(self, frame: int) -> Path:
        path = self.sequence.path(frame)
        if frame not in self.sequence.files and not path.is_file():  # it may have come since
            raise _missing(self.sequence, [frame])
        return path

    def _check(self, header: Header, frame: int) -> None:
        """Raise an error if a frame's size or channels differ from the first frame's."""
        for own, expected in (
            (_size_of(header), _size_of(self)),
            (_alpha_of(header), _alpha_of(self)),
        ):
            if own != expected:
                raise FrameError(
                    f"{self.sequence.path(frame)}: frame {frame} has {own}, expected {expected} "
                    "as in the frames before.",
                    LEAVE_OUT,
                )


def open_images(
    sequence: ImageSequence,
    frames: str | None,
    embedded: str | None,
    rate: Fraction | None,
    skip_bad_frames: bool,
    single: bool = False,
    reading: Reading | None = None,
) -> ImageClip:
    """Open a sequence over the given range; raises ClipError or FrameError as `open_clip`."""
    wanted = _wanted_frames(sequence, frames, embedded, gaps=skip_bad_frames)
    missing = [frame for frame in wanted if frame not in sequence.files]
    if missing and not skip_bad_frames:
        raise _missing(sequence, missing)
    source = str(next(iter(sequence.files.values()))) if single else sequence.pattern
    header: Header | None = None
    # A chunk of a render may hold bad frames alone: the frame before it in the clip is shown.
    others = sorted(
        set(sequence.files) - set(wanted), key=lambda one: (one > wanted[0], abs(one - wanted[0]))
    )
    for frame in [*wanted, *(others if skip_bad_frames else ())]:
        if frame in missing:
            continue
        try:
            header = read_header(sequence.path(frame), f"frame {frame}", reading or Reading())
            break
        except FrameError:
            if not skip_bad_frames:
                raise
    if header is None:
        raise FrameError(
            f"{source}: found none readable of {named(wanted)}; expected at least one "
            f"good frame. Run without {Arg('skip_bad_frames', True)} to see the cause."
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
        notes=[f"{source}: {header.note}"] if header.note else [],
        skipped=missing,
        stated=_stated(header),
        more=header.more,
        reading=reading or Reading(),
        sequence=sequence,
    )


def _stated(header: Header) -> Stated:
    """Return the first frame's metadata, for a movie that is made of the sequence."""
    values = {name: value for name, _, value in header.metadata}
    aspect = float(values.get("PixelAspectRatio", 1.0))
    return Stated(
        tags=header.tags,
        pixel_aspect=Fraction(aspect).limit_denominator(1000) if aspect > 0 else Fraction(1),
        reel=str(values.get("reelName", "")),
    )


def _wanted_frames(
    sequence: ImageSequence, frames: str | None, embedded: str | None, *, gaps: bool
) -> list[int]:
    """Return the frames asked for; with `gaps` they may all lie between the files."""
    numbers = sequence.numbers
    if embedded is not None:
        whole = parse_frames(embedded)
        if frames is None:
            wanted = whole
        else:
            wanted = parse_frames(frames)
            if outside := sorted(set(wanted) - set(whole)):
                raise ClipError(
                    f"{sequence.pattern}: {Arg('frames', frames)} includes {describe(outside)}, "
                    f"which the pattern's own range {embedded} leaves out. Give one of the two."
                )
    elif frames is not None:
        wanted = parse_frames(frames)
    else:
        step = progression_step(numbers)
        count = (numbers[-1] - numbers[0]) // step + 1
        if count > MAX_FRAMES:
            raise ClipError(
                f"{sequence.pattern}: the {len(numbers)} files are numbered from {numbers[0]} to "
                f"{numbers[-1]}, which looks like dates or ids; expected frame numbers. "
                f"Number the files, or choose a range with {Arg('frames')}."
            )
        return list(range(numbers[0], numbers[-1] + 1, step))
    inside = any(numbers[0] < frame < numbers[-1] for frame in wanted)
    if not set(wanted) & set(numbers) and not (gaps and inside):
        raise ClipError(
            f"{sequence.pattern}: found no {named(wanted)}, the clip has "
            f"{describe(numbers)}. Choose a range inside the clip."
        )
    return wanted


def _missing(sequence: ImageSequence, missing: list[int]) -> FrameError:
    numbers = sequence.numbers
    if outside := [frame for frame in missing if not numbers[0] <= frame <= numbers[-1]]:
        return FrameError(
            f"{sequence.pattern}: the clip has {named(numbers)}; {named(outside)} "
            f"{'is' if len(outside) == 1 else 'are'} outside. Choose a range inside the clip with "
            f"{Arg('frames')}, or leave such frames out with {Arg('skip_bad_frames', True)}."
        )
    gap = any(numbers[0] < frame < numbers[-1] for frame in missing)
    no_file = f" (no file {sequence.path(missing[0]).name})" if gap else ""
    return FrameError(
        f"{sequence.pattern}: {named(missing)} missing{no_file}, the clip has {describe(numbers)}.",
        LEAVE_OUT,
    )


def _size_of(what: Header | Clip) -> str:
    return f"{what.width}x{what.height} pixels"


def _alpha_of(what: Header | Clip) -> str:
    if not what.has_alpha:
        return "no alpha"
    return "premultiplied alpha" if what.premultiplied else "straight alpha"


def _scaled(stored: NDArray[Any], bits: int) -> F32:
    """(h, w, c) float32: integers divided by their largest value, floats unchanged."""
    if stored.dtype == np.float32:
        return stored
    out = np.empty(stored.shape, np.float32)
    for rows in strips(*stored.shape[:2]):
        out[rows] = _scaled_strip(stored[rows], bits)
    return out


def _scaled_strip(stored: NDArray[Any], bits: int) -> F32:
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


def _in_display_window(samples: NDArray[Any], spec: Any) -> NDArray[Any]:
    """An EXR's display window: black outside the data window, without overscan."""
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    size = spec.full_height, spec.full_width
    if (left, top) == (0, 0) and samples.shape[:2] == size:
        return samples
    framed = np.zeros((*size, samples.shape[2]), samples.dtype)
    inside = samples[max(-top, 0) : max(size[0] - top, 0), max(-left, 0) : max(size[1] - left, 0)]
    y, x = max(top, 0), max(left, 0)
    framed[y : y + inside.shape[0], x : x + inside.shape[1]] = inside
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
