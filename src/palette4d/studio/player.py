"""The player: reads a clip's frames in threads, ahead of the playhead, into a bounded cache.

Input: an opened clip. Output: frames as (h, w, 3 or 4) float32 code values. Of waiting requests
only the newest counts: what is not wanted any more is not read. A bad frame is an error of that
frame alone.
"""

import contextlib
import dataclasses
import math
import os
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from palette4d.media.clip import Clip
from palette4d.media.clip_movie import MovieClip
from palette4d.studio.session_events import words_of

F32 = NDArray[np.float32]
F16 = NDArray[np.float16]
Taps = NDArray[np.intp]

#: Bytes of whole frames that are kept; one frame is kept whatever its size.
CACHE_BYTES = 250 << 20
#: Bytes of scaled frames that are kept.
SMALL_BYTES = 200 << 20

#: The most pixels of a picture that moves; a larger one is made at a half, a third, … of its size.
MOST_MOVING = 400_000
#: Pixels of a strip that is resampled at once.
ROWS = 30_000

K = TypeVar("K", bound=Hashable)
V = TypeVar("V")


@dataclass(frozen=True)
class Region:
    """A part of a frame, in pixels of the frame, and the size that it is shown at.

    The size is never larger than the part: what is larger on screen is scaled up by the screen.
    """

    left: int
    top: int
    right: int
    bottom: int
    width: int
    height: int

    @property
    def part(self) -> tuple[int, int, int, int]:
        """Left, top, right and bottom."""
        return self.left, self.top, self.right, self.bottom

    @property
    def whole(self) -> bool:
        """Whether its pixels are the frame's, not scaled."""
        return (self.width, self.height) == (self.right - self.left, self.bottom - self.top)

    @property
    def coarse(self) -> "Region":
        """The part at the size that pictures of drags, jumps and playing have."""
        by = math.ceil(math.sqrt(self.width * self.height / MOST_MOVING))
        width, height = max(1, self.width // by), max(1, self.height // by)
        return dataclasses.replace(self, width=width, height=height)


class ByteCache(Generic[K, V]):
    """Values by key, at most so many bytes; the one that was used longest ago goes first."""

    def __init__(self, limit: int) -> None:
        """Start empty."""
        self.limit, self.bytes = limit, 0
        self._held: OrderedDict[K, tuple[V, int]] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: K) -> V | None:
        """Return a value, or None."""
        with self._lock:
            if key not in self._held:
                return None
            self._held.move_to_end(key)
            return self._held[key][0]

    def put(self, key: K, value: V, size: int) -> None:
        """Keep a value of so many bytes; the newest is kept whatever its size."""
        with self._lock:
            if (old := self._held.pop(key, None)) is not None:
                self.bytes -= old[1]
            self._held[key] = value, size
            self.bytes += size
            while self.bytes > self.limit and len(self._held) > 1:
                self.bytes -= self._held.popitem(last=False)[1][1]

    def clear(self) -> None:
        """Forget all."""
        with self._lock:
            self._held.clear()
            self.bytes = 0

    def __contains__(self, key: object) -> bool:
        """Whether a value is kept."""
        return key in self._held

    def __len__(self) -> int:
        """How many values are kept."""
        return len(self._held)


class Player:
    """Reads frames of a clip in threads.

    Parameters
    ----------
    clip : Clip
        The clip; the player alone reads it.
    ready : callable
        Called in a player's thread with the number of a frame that was read, or that cannot be.
    limit, small_limit : int
        Bytes of whole frames, and of scaled frames, that are kept.
    """

    def __init__(
        self,
        clip: Clip,
        ready: Callable[[int], object],
        *,
        limit: int = CACHE_BYTES,
        small_limit: int = SMALL_BYTES,
    ) -> None:
        """Start the threads; a movie has one, because its frames are decoded in order."""
        self.clip = clip
        self.numbers = frozenset(clip.frames)
        self.errors: dict[int, str] = {}
        self._again: set[int] = set()  # frames with an error that are to be tried again
        self._frames = ByteCache[int, F32](limit)
        self._small = ByteCache[tuple[int, Region], F16](small_limit)
        self._ready = ready
        self._wanted: list[tuple[int, Region | None]] = []
        self._later: list[tuple[int, Region | None]] = []
        self._reading: set[tuple[int, Region | None]] = set()
        self._wake = threading.Condition()
        self._closed = False
        self._order = threading.Lock() if clip.is_movie else contextlib.nullcontext()
        for k in range(1 if clip.is_movie else min(2, os.cpu_count() or 1)):
            name = f"palette4d player {k}"
            threading.Thread(target=self._run, name=name, daemon=True).start()

    def frame(self, number: int) -> F32 | None:
        """Return a frame that has been read, or None."""
        return self._frames.get(number)

    def small(self, number: int, region: Region) -> F32 | None:
        """Return a part of a frame at a smaller size, rounded to half floats, or None."""
        found = self._small.get((number, region))
        return None if found is None else found.astype(np.float32)

    def has_small(self, number: int, region: Region) -> bool:
        """Whether `small` has that part."""
        return (number, region) in self._small

    def want(self, frames: Sequence[int], region: Region | None = None) -> None:
        """Read these frames, in this order, and no others; what was wanted before is dropped.

        With a region only its scaled pixels are kept: for playing.
        """
        with self._wake:
            self._wanted = [(n, region) for n in frames if n in self.numbers]
            self._wanted = [each for each in self._wanted if not self._have(*each)]
            self._wake.notify_all()

    def want_later(self, frames: Sequence[int], region: Region) -> None:
        """Read these parts of frames when nothing else is wanted; replaces what was asked so."""
        with self._wake:
            self._later = [(n, region) for n in frames if n in self.numbers]
            self._later = [each for each in self._later if not self._have(*each)]
            if self._later:
                self._wake.notify()

    def _have(self, number: int, region: Region | None) -> bool:
        if (number, region) in self._reading:
            return True
        if number in self.errors:
            return number not in self._again
        return number in self._frames if region is None else (number, region) in self._small

    def read(self, number: int) -> F32:
        """Return a frame, and read it now if need be.

        Raises
        ------
        Palette4dError, OSError
            It cannot be read.
        """
        found = self.frame(number)
        if found is None:
            with self._order:
                found = self.clip.load(number).pixels
            self._frames.put(number, found, found.nbytes)
        return found

    @property
    def room(self) -> int:
        """How many frames as those that are kept have room, at least one."""
        return max(1, self._frames.limit * len(self._frames) // max(self._frames.bytes, 1))

    @property
    def idle(self) -> bool:
        """Whether everything that was wanted is read."""
        with self._wake:
            return not self._wanted and not self._reading

    def try_again(self, number: int) -> None:
        """Read a frame again that could not be read; until it is read, its error stays."""
        with self._wake:
            self._again.add(number)
            self._wanted.insert(0, (number, None))
            self._wake.notify()

    def forget_errors(self) -> None:
        """Try frames again that could not be read."""
        self.errors.clear()

    def close(self) -> None:
        """End the threads; each ends after the frame that it reads."""
        with self._wake:
            self._closed = True
            self._wake.notify_all()

    def _run(self) -> None:
        while True:
            with self._wake:
                while not self._wanted and not self._later and not self._closed:
                    self._wake.wait()
                if self._closed:
                    return
                number, region = (self._wanted or self._later).pop(0)
                if self._have(number, region):
                    continue
                self._again.discard(number)
                self._reading.add((number, region))
            try:
                self._take(number, region)
                self.errors.pop(number, None)
            except Exception as error:  # a decoder may fail in any way: the window stays
                self.errors[number] = words_of(error)
            finally:
                with self._wake:
                    self._reading.discard((number, region))
            if not self._closed:
                self._ready(number)

    def _take(self, number: int, region: Region | None) -> None:
        if region is None:
            self.read(number)
            return
        pixels = self.frame(number)
        whole = (0, 0, self.clip.width, self.clip.height)
        if pixels is None:
            with self._order:
                if isinstance(self.clip, MovieClip) and region.part == whole:
                    pixels = self.clip.load_small(number, region.width, region.height)
                else:
                    pixels = self.clip.load(number).pixels
        if pixels.shape[:2] != (region.height, region.width):
            pixels = resampled(pixels, region)
        with np.errstate(over="ignore"):
            small = pixels.astype(np.float16)
        self._small.put((number, region), small, small.nbytes)


def resampled(pixels: F32, region: Region) -> F32:
    """Return a part of a frame at a smaller size: whole pixels are averaged, then interpolated."""
    part = pixels[region.top : region.bottom, region.left : region.right]
    if region.whole:
        return np.ascontiguousarray(part)
    height, width = part.shape[:2]
    step = max(1, min(width // region.width, height // region.height))
    if step > 1:
        rows, columns, channels = height // step, width // step, part.shape[2]
        cut = part[: rows * step, : columns * step]
        cut = np.add.reduce(cut.reshape(rows, step, columns * step, channels), axis=1)
        part = np.add.reduce(cut.reshape(rows, columns, step, channels), axis=2)
        part *= np.float32(1 / step**2)
        height, width = rows, columns
    if (height, width) == (region.height, region.width):
        return np.ascontiguousarray(part)
    down, up, across = _taps(height, region.height)
    left, right, along = _taps(width, region.width)
    result = np.empty((region.height, region.width, part.shape[2]), np.float32)
    # In strips that stay in the processor's cache.
    rows = max(1, ROWS // max(width, 1))
    for top in range(0, region.height, rows):
        strip = slice(top, top + rows)
        upper = _between(part, down[strip], up[strip], across[strip, None, None], 0)
        result[strip] = _between(upper, left, right, along[:, None], 1)
    return result


def nearest(pixels: F32, region: Region) -> F32:
    """Return a part of a frame at a smaller size: of each new pixel the nearest one."""
    part = pixels[region.top : region.bottom, region.left : region.right]
    for axis, wanted in enumerate((region.height, region.width)):
        size = part.shape[axis]
        at = np.minimum((np.arange(wanted) + 0.5) * size / wanted, size - 1).astype(np.intp)
        part = np.take(part, at, axis)
    return part


def _between(image: F32, low: Taps, high: Taps, share: F32, axis: int) -> F32:
    """Return what lies between two taps of each new pixel of an axis."""
    first, second = np.take(image, low, axis), np.take(image, high, axis)
    second -= first
    second *= share
    first += second
    return first


def _taps(size: int, wanted: int) -> tuple[Taps, Taps, F32]:
    """Return the two neighbours of each new pixel, and the share of the second."""
    at = np.clip((np.arange(wanted) + 0.5) * size / wanted - 0.5, 0, size - 1)
    first = np.floor(at).astype(np.intp)
    return first, np.minimum(first + 1, size - 1), (at - first).astype(np.float32)
