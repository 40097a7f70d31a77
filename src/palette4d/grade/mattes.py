"""Mattes of picks: learned from frames of the clip, and kept in the sidecar.

Input: a pick or a hold, and its clip. Output: a matte over colours, as the sidecar's member
``mattes`` holds it. The core learns (`core/fit/matte_learning.hpp`); this module chooses frames.
"""

from __future__ import annotations

import base64
import hashlib
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade.picks import Pick
from palette4d.media.clip_base import MOST_SAMPLES, FrameError
from palette4d.media.source_clip import nearest

F32 = NDArray[np.float32]
Bytes = NDArray[np.uint8]
#: (from, to, values): display code values of a palette's code values, evenly spaced.
Display = tuple[float, float, list[float]]
#: The points of a box (one) or a stroke, and its half width, in pixels of the clip.
Brush = tuple[list[tuple[float, float]], float]
ReadFrame = Callable[[int], F32]
"""The straight colours of a frame, (h, w, 3) in the palette's code values; NaN: no colour."""

#: Number of further frames along the pick's path that a matte is learned from, for colours which
#: come later. More cost a read of a frame each, and change little.
FURTHER_FRAMES = 3
#: How much of a thing's log odds another thing's lead takes away. Larger: edges between two things
#: are harder; smaller: colours that both may have change by half.
DECIDES = 4
#: Samples of a display curve: straight lines between them are within 1/255 of it.
SAMPLES = 1024
#: The brightest scene-linear code value that a curve tells from others.
BRIGHTEST = 2.0


@dataclass(frozen=True)
class Learned:
    """A learned matte: its id, and its text in the sidecar.

    `seen` says whether the frame has pixels of the colour.
    """

    odds: Bytes
    seen: bool

    def against(self, others: Sequence[Bytes]) -> Learned:
        """Return the matte without what is more certainly in others."""
        if not others:
            return self
        most = np.max(others, axis=0).astype(int)
        own = self.odds.astype(int)
        odds = np.clip(own - DECIDES * np.maximum(most - own, 0), 0, None).astype(np.uint8)
        return replace(self, odds=odds)

    @cached_property
    def id(self) -> str:
        """The matte's id: m and 16 digits of a hash of its log odds."""
        return "m" + hashlib.sha256(self.odds.tobytes()).hexdigest()[:16]

    @cached_property
    def text(self) -> str:
        """The matte's text: base64 of a zlib stream of the differences of its log odds."""
        steps = np.diff(self.odds.reshape(-1), prepend=np.zeros(1, np.uint8))  # modulo 256
        return base64.b64encode(zlib.compress(steps.tobytes())).decode()


def odds_of(text: str) -> Bytes:
    """Return the log odds of a matte's text."""
    steps = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8)
    return np.cumsum(steps, dtype=np.uint8)


def learn(
    pick: Pick,
    holds: Sequence[Pick],
    frames: Sequence[int],
    read: ReadFrame,
    display: Display | None,
) -> Learned:
    """Learn the matte of a pick or hold from `frames` of its clip; `holds` are background.

    Bad frames without marks are passed over.

    Raises
    ------
    Palette4dError
        Areas and holds are in more frames than fit in memory (`most_frames`).
    """
    own, background = _brushes([pick], frames), _brushes(holds, frames)
    first = nearest(frames, pick.frame)
    seeded = dict.fromkeys([first, *(nearest(frames, area.frame) for area in pick.areas)])
    others = dict.fromkeys([*background, *further_frames(pick, frames)])
    chosen = [*seeded, *(frame for frame in others if frame not in seeded)]
    image = read(first)
    if len(chosen) > (most := most_frames(image.size)):
        raise Palette4dError(
            f"{pick.id} would be learned from {len(chosen)} frames, in which it and holds have "
            f"areas; expected at most {most} of this size. Remove holds, or pick it again with "
            "fewer areas"
        )
    given = []
    for frame in chosen:
        colour = tuple(pick.colour_at(frame).tolist())
        places = own.get(frame, []), background.get(frame, [])
        try:
            pixels = image if frame == first else read(frame)
        except FrameError:  # a bad frame; what was marked in one is needed
            if any(places):
                raise
            continue
        given.append((pixels, colour, *places, frame in seeded))
    learned = _core.learn_matte(
        given,
        pick.rgb,
        holds=[tuple(hold.colour_at(pick.frame).tolist()) for hold in holds if not hold.marks],
        display=display,
    )
    return Learned(learned["odds"].reshape(-1), learned["found"])


def most_frames(samples: int) -> int:
    """Return how many frames with so many samples are in memory at most.

    They are no larger than those of a pick in the largest clip: a sidecar can name each frame.
    """
    return (1 + FURTHER_FRAMES) * MOST_SAMPLES // samples


def _brushes(picks: Sequence[Pick], frames: Sequence[int]) -> dict[int, list[Brush]]:
    """Return the places of frames that picks or holds name: points and a radius each."""
    found: dict[int, list[Brush]] = {}
    for area in (area for pick in picks for area in pick.marks):
        brush = (list(area.points), float(area.radius))
        found.setdefault(nearest(frames, area.frame), []).append(brush)
    return found


def further_frames(pick: Pick, frames: Sequence[int]) -> list[int]:
    """Return frames spread over those at which all of the pick is asked for."""
    first = frames[0] if pick.start is None else pick.start
    last = frames[-1] if pick.until is None else pick.until
    inside = [n for n in frames if first <= n <= last and pick.strength_at(n) > 0.5]
    count = min(FURTHER_FRAMES, len(inside))
    return [inside[(2 * k + 1) * len(inside) // (2 * count)] for k in range(count)]


@lru_cache(maxsize=16)
def display_curve(encoding: str) -> Display | None:
    """Return the curve from a palette's code values to a display's; None where they are the same.

    Saturation is measured in display code values. Each channel has the curve of greys: primaries
    stay those of the palette.
    """
    from palette4d.colour.difference import viewing_of

    viewing = viewing_of(encoding)
    if viewing.to_srgb is None or viewing.encoding in ("", "sdr-video"):
        return None
    top = BRIGHTEST if viewing.encoding == "scene-linear" else 1.0
    codes = np.linspace(0.0, top, SAMPLES)
    shown = np.asarray(viewing.to_srgb(np.repeat(codes[:, None], 3, axis=1)), np.float64)[:, 1]
    if not np.isfinite(shown).all():
        raise Palette4dError(
            f"found no finite display values for the encoding {encoding!r}; picks cannot be made"
        )
    rising = np.maximum.accumulate(np.clip(shown, 0.0, None))
    return 0.0, top, np.round(rising, 5).tolist()
