"""The error of looks at the frames between the baked frames.

Each frame shows the look of the nearest baked frame. Between the frames at which the edit changes
its slope, the palette's colours move linearly in time. So the error is largest halfway between two
baked frames, or where the slope changes. Only these frames are measured.
"""

import bisect
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export import lut3d, series
from palette4d.lut_export.bake import SidecarBytes
from palette4d.lut_export.frame_edit import frame_edit
from palette4d.lut_export.shaper import choose

from palette4d import _core
from palette4d.colour.difference import delta_e_2000, viewing_of
from palette4d.media.source_clip import frame_colours

#: Above this deltaE 2000 between two looks, a config is written only with `anyway`.
LARGEST_DELTA_E = 2.0

#: At most about this many colours of a frame are compared.
COLOURS = 1 << 15


@dataclass(frozen=True)
class BetweenError:
    """The largest deltaE 2000 at a frame between two looks, and that frame.

    Attributes
    ----------
    delta_e : between the edit at `frame` and the edit at `look`, the frame whose look is shown
        there.
    frame, look : the frame with the largest error, and the baked frame whose look it shows.
    on_clip : measured on the clip's colours at `frame`; False: on a grid over the palette's range.
    """

    delta_e: float
    frame: int
    look: int
    on_clip: bool


def nearest(baked: tuple[int, ...], frame: int) -> int:
    """Return the baked frame whose look a frame shows: the nearest, the earlier of two."""
    place = bisect.bisect_left(baked, frame)
    return min(baked[max(place - 1, 0) : place + 1], key=lambda other: (abs(other - frame), other))


def between_error(
    source: Path | SidecarBytes,
    baked: tuple[int, ...],
    strength: float = 1.0,
    clip: str | None = None,
) -> BetweenError | None:
    """Return the largest error between looks; None if every frame has its own look.

    `baked` are the frames that have a look, in rising order. Without `clip` the sidecar's clip is
    used.
    """
    read = SidecarBytes.of(source)
    sidecar = read.parsed()
    own = set(baked)
    between = [frame for frame in series.every(sidecar, 1) if frame not in own]
    if not between:
        return None
    farthest: dict[tuple[int, bool], int] = {}
    for frame in between:
        look = nearest(baked, frame)
        if frame < look:
            farthest.setdefault((look, False), frame)
        else:
            farthest[look, True] = frame
    chosen = set(farthest.values())
    if not sidecar.edits.empty:
        chosen |= set(series.stops(sidecar)) - own
    viewing = viewing_of(str(sidecar.clip["encoding"]))
    worst: BetweenError | None = None
    for frame in sorted(chosen):
        look = nearest(baked, frame)
        edits = [frame_edit(sidecar, time, strength) for time in (frame, look)]
        if all(edit.identity for edit in edits):
            error = BetweenError(0.0, frame, look, on_clip=False)
        else:
            colours, on_clip = _colours(read.path, sidecar, frame, clip)
            here, there = (viewing.lab(edit.exact(colours)) for edit in edits)
            largest = float(delta_e_2000(here, there).max(initial=0.0))
            error = BetweenError(largest, frame, look, on_clip)
        worst = error if worst is None or error.delta_e > worst.delta_e else worst
    return worst


def _colours(
    path: Path, sidecar: _core.Sidecar, frame: int, clip: str | None
) -> tuple[NDArray[np.floating], bool]:
    """Return (n, 3) colours in the palette's space: the clip's frame, or a grid if unreadable."""
    image, _ = frame_colours(path, sidecar.clip, frame, clip)
    if image is None:
        palette = sidecar.polytope.vertices[:, :3]
        shaper = choose("auto", float(palette.min()), float(palette.max()))
        channel = shaper.inverse(np.linspace(0, 1, round(COLOURS ** (1 / 3))))
        return lut3d.grid(channel.astype(np.float32)).reshape(-1, 3), False
    flat = image.reshape(-1, 3)
    flat = flat[np.isfinite(flat).all(axis=1)]
    flat = flat[:: max(1, len(flat) // COLOURS)]
    own = sidecar.conversion
    return flat if own is None else own.steps.to_palette(flat), True
