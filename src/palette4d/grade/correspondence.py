"""How the times and the colours of two palettes correspond."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from palette4d.colour.encoding_conversion import between
from palette4d.common.errors import Arg, Palette4dError
from palette4d.grade.grade import Grade

F64 = NDArray[np.float64]
Time = Literal["relative", "same"] | float
Convert = Callable[[F64], F64]

#: Times between two handles at which a smooth ramp is looked at.
ON_SMOOTH = 7


@dataclass(frozen=True)
class Match:
    """The times and the colours of two grades."""

    target: Grade
    source: Grade
    time: Time

    def there(self, frame: float) -> float:
        """Return the source's time for a time of the target."""
        if not isinstance(self.time, str):
            return float(self.time)
        first, last, _ = self.target.frames
        begin, end, _ = self.source.frames
        if self.time == "same":
            return min(max(frame, begin), end)
        return begin + (frame - first) * (end - begin) / max(last - first, 1)

    def back(self, frame: float) -> float:
        """Return the target's time for a time of the source, unless `time` is a frame."""
        if self.time == "same":
            return frame
        first, last, _ = self.target.frames
        begin, end, _ = self.source.frames
        return first + (frame - begin) * (last - first) / max(end - begin, 1)

    @cached_property
    def conversions(self) -> tuple[Convert | None, Convert | None]:
        """From the target's code values to the source's, and back; None where they are equal."""
        clips = (grade.members["clip"] for grade in (self.target, self.source))
        configs = [name for clip in clips if (name := clip.get("conversion", {}).get("config"))]
        own, other = self.target.encoding, self.source.encoding
        return between(own, other, configs), between(other, own, configs)

    @property
    def knots(self) -> list[float]:
        """The target's times that show all of the source's ramps.

        They may lie between frames that were analysed: those of vertices and stops, between which
        the source goes along lines; the last frame before each, where a step ends; and some on
        smooth ramps.
        """
        if not isinstance(self.time, str):
            return []
        stops = [stop.frame for stop in self.source.settings.values() if stop.frame is not None]
        own = {vertex["frame"] for vertex in self.source.members["polytope"]["vertices"]}
        times = sorted(map(self.back, own.union(stops)))
        frames = [float(math.ceil(time)) for time in times]
        smooth = {self.source.ramp, *(set_.ramp for set_ in self.source.settings.values())}
        between = [np.linspace(*pair, ON_SMOOTH + 2) for pair in itertools.pairwise(times)]
        curved = np.concatenate([[], *between]).tolist() if "smooth" in smooth else []
        first, last, _ = self.target.frames
        wanted = {*times, *frames, *(frame - 1 for frame in frames), *curved}
        return [time for time in wanted if first <= time <= last]

    @property
    def pace(self) -> float:
        """Frames of the target for one frame of the source."""
        return self.back(1.0) - self.back(0.0)

    @property
    def same_pictures(self) -> bool:
        """Whether both palettes are of the same pictures, frame by frame."""
        begin, end, _ = self.source.frames
        whole = not isinstance(self.time, float | int)
        times = (self.back(begin), self.back(end)) if whole else ()
        return times == self.target.frames[:2] and same_pictures(self.target, self.source)


def matched(target: Grade, source: Grade, time: Time) -> Match:
    """Return the match of two grades; refuse times that do not go together."""
    if not isinstance(time, str):
        source.check_frame(time)
    elif time not in ("relative", "same"):
        raise Palette4dError(f"found the time {time!r}, expected 'relative', 'same' or a frame")
    (first, last, _), (begin, end, _) = target.frames, source.frames
    if time == "same" and not (first <= end and begin <= last):
        raise Palette4dError(
            f"found the frames {first} to {last} here and {begin} to {end} in {source.name}, "
            f"expected frames in common; leave out {Arg('time', 'same')}"
        )
    return Match(target, source, time)


def same_pictures(one: Grade, other: Grade) -> bool:
    """Whether two palettes are of the same pictures, maybe under other frame numbers.

    They are if all the colours that the sidecars keep of their clips are equal.
    """
    known = []
    for grade in (one, other):
        clip, (first, last, step) = grade.members["clip"], grade.frames
        colours = [(e["frame"] - first, e["rgbw"]) for e in grade.members.get("colours", ())]
        known.append((clip["size"], clip["encoding"], last - first, step, colours))
    return known[0] == known[1] and bool(known[0][-1])
