"""The edit of a sidecar at one time, as a function of colours.

Sampling, fitting and measuring take a `FrameEdit`; they know no sidecar.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade.bumps import bumped

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


@dataclass(frozen=True)
class FrameEdit:
    """p' = p + strength * (sum_i w_i(q(p)) (v'_i - v_i) + bumps at p), the edit at one time.

    Attributes
    ----------
    palette : (n, 3) float64; the slice's colours before the edit (eq. 5).
    edited : (n, 3) float64; the same colours after the edit.
    faces : (f, 3) int32; the slice's triangles.
    strength : 0 leaves colours alone, 1 is the edit.
    bumps : (b, 8) float64; what moves besides the palette, and holds (`bumped`).
    recolourer : the node's own code for the edit.
    conversion : from the colours' space to the palette's space; None if they are the same.
    """

    palette: F64
    edited: F64
    faces: NDArray[np.int32]
    strength: float
    bumps: F64
    recolourer: _core.Recolourer
    conversion: _core.ColourConversion | None = None

    @property
    def identity(self) -> bool:
        """Whether nothing changes."""
        return self.recolourer.identity or self.strength == 0

    def apply(self, colours: F32, threads: int = 0) -> F32:
        """Return the node's result for (h, w, 3) float32 colours; 0 threads: one per processor."""
        return self.recolourer.apply(
            colours, strength=self.strength, threads=threads, conversion=self.conversion
        )

    def exact(self, colours: ArrayLike) -> F64:
        """Return the (m, 3) float64 results for (m, 3) finite colours, without rounding."""
        points = np.asarray(colours, dtype=np.float64)
        if self.identity:
            return points
        at = points if self.conversion is None else self.conversion.to_palette(points)
        weights, _ = _core.palette_weights(at, self.palette, self.faces)
        step = self.strength * bumped(at, weights @ (self.edited - self.palette), self.bumps)
        if self.conversion is None:
            return points + step
        moved = (step != 0).any(axis=1, keepdims=True)
        return np.where(moved, self.conversion.to_clip(at + step), points)


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
    bumps = sidecar.edits.bumps_at(palette.frame)
    return FrameEdit(
        palette=palette.rgb,
        edited=edited,
        faces=palette.faces,
        strength=float(strength),
        bumps=bumps,
        recolourer=_core.Recolourer(palette.rgb, edited, palette.faces, bumps=bumps),
        conversion=conversion,
    )
