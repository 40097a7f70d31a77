"""The player: reads a clip's frames in threads, ahead of the playhead, into a bounded cache.

Input: an opened clip. Output: frames as (h, w, 3 or 4) float32 code values. Of waiting requests
only the newest counts: what is not wanted any more is not read. A bad frame is an error of that
frame alone.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from palette4d.common.errors import in_words
from palette4d.media.clip import Clip

F32 = NDArray[np.float32]

#: Bytes of whole frames that are kept; one frame is kept whatever its size.
CACHE_BYTES = 400 << 20

K = TypeVar("K", bound=Hashable)


class ByteCache(Generic[K]):
    """Arrays by key, at most so many bytes; the one that was used longest ago goes first."""

    def __init__(self, limit: int) -> None:
        """Start empty."""
        self.limit, self.bytes = limit, 0
        self._held: OrderedDict[K, NDArray[np.generic]] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: K) -> NDArray[np.generic] | None:
        """Return an array, or None."""
        with self._lock:
            if key in self._held:
                self._held.move_to_end(key)
            return self._held.get(key)

    def put(self, key: K, array: NDArray[np.generic]) -> None:
        """Keep an array; the newest is kept whatever its size."""
        with self._lock:
            if (old := self._held.pop(key, None)) is not None:
                self.bytes -= old.nbytes
            self._held[key] = array
            self.bytes += array.nbytes
            while self.bytes > self.limit and len(self._held) > 1:
                self.bytes -= self._held.popitem(last=False)[1].nbytes

    def clear(self) -> None:
        """Forget all."""
        with self._lock:
            self._held.clear()
            self.bytes = 0

    def __contains__(self, key: object) -> bool:
        """Whether an array is kept."""
        return key in self._held

    def __len__(self) -> int:
        """How many arrays are kept."""
        return len(self._held)


class Player:
    """Reads frames of a clip in a thread.

    Parameters
    ----------
    clip : Clip
        The clip; the player alone reads it.
    ready : callable
        Called in the player's thread with the number of a frame that was read, or that cannot be.
    limit : int
        Bytes of frames that are kept.
    """

    def __init__(
        self, clip: Clip, ready: Callable[[int], object], *, limit: int = CACHE_BYTES
    ) -> None:
        """Start the thread."""
        self.clip, self.cache = clip, ByteCache[int](limit)
        self.errors: dict[int, str] = {}
        self._ready, self._known = ready, frozenset(clip.frames)
        self._wanted: list[int] = []
        self._wake = threading.Condition()
        self._closed = False
        self._reading = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="palette4d player", daemon=True)
        self._thread.start()

    def frame(self, number: int) -> F32 | None:
        """Return a frame that has been read, or None."""
        return self.cache.get(number)  # type: ignore[return-value]

    def want(self, frames: Sequence[int]) -> None:
        """Read these frames, in this order, and no others; what was wanted before is dropped."""
        with self._wake:
            self._wanted = [n for n in frames if n not in self.cache and n not in self.errors]
            self._wake.notify()

    def read(self, number: int) -> F32:
        """Return a frame, and read it now if need be.

        Raises
        ------
        Palette4dError, OSError
            It cannot be read.
        """
        found = self.frame(number)
        if found is None:
            with self._reading:
                found = self.clip.load(number).pixels
            self.cache.put(number, found)
        return found

    def forget_errors(self) -> None:
        """Try frames again that could not be read."""
        self.errors.clear()

    def close(self) -> None:
        """End the thread; it ends after the frame that it reads."""
        with self._wake:
            self._closed = True
            self._wake.notify()

    def _run(self) -> None:
        while True:
            with self._wake:
                while not self._wanted and not self._closed:
                    self._wake.wait()
                if self._closed:
                    return
                number = self._wanted.pop(0)
            if number in self.cache:
                continue
            try:
                self.read(number)
            except Exception as error:  # a decoder may fail in any way: the window stays
                self.errors[number] = in_words(error) or type(error).__name__
            if not self._closed:
                self._ready(number)
