"""The edit of a sidecar at one time, as a function of colours.

Sampling, fitting and measuring take a `FrameEdit`; they know no sidecar.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


def frame_text(frame: float) -> str:
    """Return a frame number without needless decimals: 24, 24.5."""
    return f"{frame:.15g}"


def check_frame(sidecar: _core.Sidecar, frame: float) -> None:
    """Refuse a time outside the clip."""
    first, last = sidecar.polytope.first_frame, sidecar.polytope.last_frame
    if not first <= frame <= last:
        raise Palette4dError(
            f"frame {frame_text(frame)} is outside the clip {sidecar.clip['name']!r}; expected a "
            f"time from {frame_text(first)} to {frame_text(last)} (fractions are allowed)"
        )


def without_windows(sidecar: _core.Sidecar, frames: Iterable[float]) -> str:
    """Return the note that LUTs of some frames lack windows of picks; "" where there are none."""
    found = dict.fromkeys(id_ for frame in frames for id_ in sidecar.edits.windows_at(frame))
    if not found:
        return ""
    ids, s = ", ".join(found), "s" * (len(found) > 1)
    return (
        f"no LUT has the window{s} of {ids}: it changes the colours of {ids} in the whole picture, "
        "and errors are those of that; the node and `palette4d render` have windows"
    )


@dataclass(frozen=True)
class FrameEdit:
    """The edit at one time: palette colours and picks.

    Attributes
    ----------
    strength : 0 leaves colours alone, 1 is the edit.
    has_picks : whether there are picks, whose mattes need a finer LUT.
    windows : the picks with windows: `exact` and `apply` without `clean_up` know no places.
    recolourer : the node's own code for the edit.
    conversion : from the colours' space to the palette's space; None if they are the same.
    """

    strength: float
    has_picks: bool
    windows: tuple[str, ...]
    recolourer: _core.Recolourer
    conversion: _core.ColourConversion | None = None

    @property
    def identity(self) -> bool:
        """Whether nothing changes."""
        return self.recolourer.identity or self.strength == 0

    def apply(self, colours: F32, threads: int = 0, clean_up: float = 0.0) -> F32:
        """Return the node's result for (h, w, 3) float32 colours; 0 threads: one per processor.

        `clean_up` needs the clip's picture: it looks at neighbouring pixels, and windows count.
        """
        if clean_up:
            return _core.draw(
                colours,
                "recoloured",
                self.recolourer,
                strength=self.strength,
                clean_up=clean_up,
                threads=threads,
                conversion=self.conversion,
            )
        return self.recolourer.apply(
            colours, strength=self.strength, threads=threads, conversion=self.conversion
        )

    def exact(self, colours: ArrayLike) -> F64:
        """Return the (m, 3) float64 results for (m, 3) finite colours, without rounding."""
        points = np.asarray(colours, dtype=np.float64)
        if self.identity:
            return points
        at = points if self.conversion is None else self.conversion.to_palette(points)
        displaced = self.recolourer.displaced(at, strength=self.strength)
        if self.conversion is None:
            return displaced
        moved = (displaced != at).any(axis=1, keepdims=True)
        return np.where(moved, self.conversion.to_clip(displaced), points)


def frame_edit(
    sidecar: _core.Sidecar,
    frame: float,
    strength: float = 1.0,
    conversion: _core.ColourConversion | None = None,
) -> FrameEdit:
    """Return the edit of a sidecar at a time of the clip, which may lie between frames.

    `conversion` goes from the space of the edit's colours to the palette's space. A time outside
    the clip and a strength outside 0..1 are refused.
    """
    check_frame(sidecar, frame)
    if not 0 <= strength <= 1:
        raise Palette4dError(f"strength {strength} is not possible; expected 0 to 1")
    palette = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, sidecar.edits, palette)
    picks = sidecar.picks_at(palette.frame)
    return FrameEdit(
        strength=float(strength),
        has_picks=bool(picks.count),
        windows=tuple(sidecar.edits.windows_at(palette.frame)),
        recolourer=_core.Recolourer(palette.rgb, edited, palette.faces, picks=picks),
        conversion=conversion,
    )
