"""The base class of clips: frame numbers, a rate, a size, and pixels, read frame by frame.

`clip.py` opens clips; `clip_images.py` and `clip_movie.py` implement them. Memory holds one frame
for clips of any length. The analysis only counts pixels (`Clip.fills`).
"""

from __future__ import annotations

import abc
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Arg, Message, Palette4dError
from palette4d.media.exr_around import Around
from palette4d.media.stated import Stated

F32 = NDArray[np.float32]

Fill = Callable[[_core.ColourBinner], bool]
"""Adds a frame's pixels to a binner; FrameError if the frame is bad. Returns whether the frame is
`hidden`; then its colours were added without regard to alpha."""

DEFAULT_RATE = Fraction(24)

COUNTED_PIXELS = 4_000_000
"""In larger frames the analysis counts only every n-th row, so about this many pixels."""

MOST_SAMPLES = 1 << 29
"""The most samples of a frame, 13,000 x 13,000 pixels in R, G and B: a small file can state any."""

LEAVE_OUT = Message(
    f"Bring a good copy, choose a range with {Arg('frames')}, or leave such frames out with "
    f"{Arg('skip_bad_frames', True)}."
)
"""The advice for a bad frame."""


STRIP = 4_000_000
"""Pixels per strip of a large frame. Larger strips need more memory, smaller ones more time."""


def strips(height: int, width: int, together: int = 1) -> Iterator[slice]:
    """Yield slices of rows that divide a picture into strips of about `STRIP` pixels.

    All but the last one have a multiple of `together` rows.
    """
    rows = max(1, STRIP // max(1, width) // together) * together
    for top in range(0, height, rows):
        yield slice(top, min(top + rows, height))


class ClipError(Palette4dError):
    """A clip cannot be opened; the message says what was found and expected, and the remedy."""


class FrameError(ClipError):
    """One frame is missing, unreadable or of another size; `skip_bad_frames` skips it."""


@dataclass(frozen=True)
class Image:
    """One frame with its stored code values, upright.

    pixels is (h, w, 3 or 4) float32. Integer formats are divided by their largest value; float
    formats are unchanged, also negatives, values above 1, NaNs and infinities. Y'CbCr has values
    below 0 and above 1, too: sub-blacks, super-whites and colours outside R'G'B'. metadata holds
    (name, OpenImageIO type, value) for a recoloured copy of the file, around the picture's place
    in it.
    """

    frame: int
    pixels: F32
    metadata: tuple[tuple[str, Any, Any], ...] = ()
    around: Around | None = None


@dataclass(repr=False)
class Clip(abc.ABC):
    """An opened clip; see `palette4d.media.clip.open_clip`.

    Attributes
    ----------
    name : str
        Short name, for people.
    source : str
        The sequence with one `#` for each digit, the movie, or the single image.
    frames : list of int
        Frame numbers in rising order, with the bad frames that `skip_bad_frames` will skip.
    rate : Fraction
        Frames per second.
    width, height : int
        Pixels, after the file's orientation is applied.
    encoding : str
        The colour encoding that the file states ("sRGB", "Rec.709", …), or "unknown".
    has_alpha : bool
        The pixels have four channels, the last is alpha.
    premultiplied : bool
        Colours are multiplied by alpha: in EXR and DPX by convention, in TIFF if the file says so.
        PNG and movies hold straight colours. Reading converts nothing; see `straight_colours`.
    depth : str
        The stored sample type: "uint8", "uint10", "uint12", "uint16", "half", "float", …
    is_movie : bool
        The clip is a movie file: its frame numbers start at 0.
    notes : list of str
        Notes for the user, such as a variable frame rate.
    skipped : list of int
        Frames skipped so far, in rising order.
    stated : Stated
        Metadata of the files: colour tags, timecode, pixel aspect and so on.
    """

    name: str
    source: str
    frames: list[int]
    rate: Fraction
    width: int
    height: int
    encoding: str
    has_alpha: bool
    premultiplied: bool
    depth: str
    skip_bad_frames: bool = False
    is_movie: bool = False
    notes: list[str] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)
    stated: Stated = field(default_factory=Stated)

    def __repr__(self) -> str:
        """Return one line: the name, the frames, the size, and the encoding."""
        return (
            f"<{type(self).__name__} {self.name!r}: frames {self.frames[0]} to {self.frames[-1]}, "
            f"{self.width} x {self.height}, {self.depth}, {self.encoding}>"
        )

    @property
    def step(self) -> int:
        """Distance between neighbouring frame numbers (1 for a single frame); 0 when it varies."""
        return even_step(self.frames)

    @property
    def outside(self) -> list[int]:
        """The frames before the first and behind the last file, which `skip_bad_frames` allows."""
        return []

    @property
    def all_frames(self) -> Sequence[int]:
        """The frames that the files hold, also those outside the range that was opened."""
        return self.frames

    def nearest_to(self, frame: int) -> list[int]:
        """Return the files' other frames: those before a frame, backwards, then those behind it."""
        before = [other for other in self.all_frames if other < frame]
        return before[::-1] + [other for other in self.all_frames if other > frame]

    @abc.abstractmethod
    def load(self, frame: int) -> Image:
        """Read one frame with its metadata; FrameError when it is missing or unreadable."""

    @abc.abstractmethod
    def file(self, frame: int) -> Path:
        """The file of a frame, whether it exists or not."""

    @abc.abstractmethod
    def fills(self, frames: Sequence[int]) -> Iterator[tuple[int, Fill]]:
        """Yield for each frame, in order, its number and the function that fills a binner.

        It adds the colours for recolouring (`straight_colours`). Each function may run in any
        thread, with a separate binner. The caller must consume the iterator in order.
        """

    @property
    def row_step(self) -> int:
        """The analysis counts every n-th row: n is 1 up to 6 million pixels, 8 for 8K."""
        return max(1, round(self.width * self.height / COUNTED_PIXELS))

    def iter_images(self) -> Iterator[Image]:
        """Read the frames in order, one at a time.

        Raises
        ------
        FrameError
            For the first bad frame, or, with `skip_bad_frames`, when every frame is bad.
        """
        good = 0
        for frame in self.frames:
            try:
                image = self.load(frame)
            except FrameError:
                if not self.skip_bad_frames:
                    raise
                self.skip(frame)
                continue
            good += 1
            yield image
        if not good:
            raise self.none_readable()

    def __iter__(self) -> Iterator[tuple[int, F32]]:
        """(frame number, (h, w, 3 or 4) float32 pixels), in order, one frame at a time."""
        for image in self.iter_images():
            yield image.frame, image.pixels

    def iter_colours(self) -> Iterator[tuple[int, F32]]:
        """(frame number, (h, w, 3) float32 straight colours): see `straight_colours`."""
        for image in self.iter_images():
            yield image.frame, self.straight_colours(image.pixels)

    def read(self, frame: int) -> F32:
        """(h, w, 3 or 4) float32 pixels of one frame; ClipError when it is not in the clip."""
        if frame not in self.frames:
            raise ClipError(
                f"{self.source}: frame {frame} was asked for, the clip has {describe(self.frames)}"
            )
        return self.load(frame).pixels

    def straight_colours(self, pixels: F32) -> F32:
        """(h, w, 3) float32 straight colours, the input of a recolouring.

        Premultiplied colours are divided by alpha, as in the node (`_core.straight_colours`).
        Pixels with an alpha below 1/255 are invisible, and the division would turn their noise into
        extreme colours. They become NaN, which the analysis leaves out. If a frame has no other
        pixels (`hidden`), its colours stay unchanged: if all frames are hidden, alpha is not used.
        """
        if pixels.shape[2] == 3:
            return pixels
        unused = hidden(pixels)
        divided = self.premultiplied and not unused
        colours = _core.straight_colours(pixels, premultiplied=divided)
        if not unused:
            colours[~_visible(pixels)] = np.nan
        return colours

    def skip(self, frame: int) -> None:
        """List a bad frame in `skipped`."""
        if frame not in self.skipped:
            self.skipped.append(frame)
            self.skipped.sort()

    def none_readable(self) -> FrameError:
        """Return the error for a clip without a good frame."""
        return FrameError(
            f"{self.source}: found none readable of {named(self.frames)}; "
            f"expected at least one good frame. Run without {Arg('skip_bad_frames', True)} to see "
            "the cause."
        )


def hidden(pixels: F32) -> bool:
    """Whether all pixels (h, w, 3 or 4) are invisible: alpha is below 1/255 everywhere."""
    return pixels.shape[2] == 4 and not _visible(pixels).any()


def _visible(pixels: F32) -> NDArray[np.bool_]:
    """Whether each of the pixels (h, w, 4) is visible in 8 bits; NaN is not."""
    return pixels[..., 3] >= np.float32(_core.LEAST_ALPHA)


def all_hidden(binner: _core.ColourBinner) -> bool:
    """Whether all pixels that were binned with alpha are invisible, as `hidden`."""
    return 0 < binner.transparent == binner.pixels + binner.ignored


def even_step(numbers: Sequence[int]) -> int:
    """Distance between neighbours of the (rising) numbers, 1 for one number, 0 when it varies."""
    steps = {after - before for before, after in itertools.pairwise(numbers)} or {1}
    return steps.pop() if len(steps) == 1 else 0


def progression_step(numbers: Sequence[int]) -> int:
    """Largest step of a range that holds all of the (rising) numbers; 1 for one number."""
    step = 0
    for before, after in itertools.pairwise(numbers):
        step = math.gcd(step, after - before)
    return step or 1


def describe(frames: Sequence[int]) -> str:
    """Frames for a message, short: `3`, `1-10`, `1-9x2`, or a list that ends in an ellipsis."""
    if len(frames) == 1:
        return f"{frames[0]}"
    step = frames[1] - frames[0]
    if len(frames) > 2 and all(b - a == step for a, b in itertools.pairwise(frames)):
        return f"{frames[0]}-{frames[-1]}" + (f"x{step}" if step != 1 else "")
    if len(frames) == 2 and step == 1:
        return f"{frames[0]}-{frames[1]}"
    shown = ", ".join(str(frame) for frame in frames[:8])
    return shown + (f", … ({len(frames)} in all)" if len(frames) > 8 else "")


def named(frames: Sequence[int]) -> str:
    """Frames for a message, with the noun: `frame 3`, `frames 1-10`."""
    return f"frame{'s' * (len(frames) != 1)} {describe(frames)}"


def as_rate(value: float) -> Fraction | None:
    """Usual rate nearest to a floating-point rate; None if it is no rate.

    >>> as_rate(23.976), as_rate(23.98), as_rate(59.94), as_rate(24.0)
    (Fraction(24000, 1001), Fraction(24000, 1001), Fraction(60000, 1001), Fraction(24, 1))
    """
    if not math.isfinite(value) or value <= 0:
        return None
    for whole in range(1, 241):
        ntsc = whole * 1000 / 1001
        # People round to two decimals, which are too few to tell 5 from 5000/1001.
        if abs(value - ntsc) < 2e-4 * whole / 24 or (whole >= 12 and value == round(ntsc, 2)):
            return Fraction(whole * 1000, 1001)
    return Fraction(value).limit_denominator(1001) or None
