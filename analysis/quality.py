"""How good a palette is: the fit of each frame, and what the losses do not say about its use.

Input: the polytope as the sidecar holds it, and the frames' statistics. Output: a `Report`, whose
figures go into the sidecar, and warnings for the user, each with the option that would help.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d import _core
from palette4d.analysis.losses import NO_FACES, loss_weights
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.statistics import FrameStatistics
from scipy.spatial import ConvexHull, QhullError

F64 = NDArray[np.float64]

# Frames on which the use of handles is measured, evenly spaced: mean value coordinates of every
# colour of every frame would cost more than the rest of the analysis.
USE_FRAMES = 12
# What is worth a warning.
BAD_FRAME = 4.0  # times the median frame's L ...
BAD_L = 0.3  # ... and at least this, or the clip's mean
LOOKALIKE = 0.06  # RGB distance of two handles ...
DENT = 0.05  # share of its convex hull that a slice lacks
NARROW = 4 * LOOKALIKE  # frames whose colours extend less than this, such as black ones: neither
UNUSED = 0.001  # largest mean weight of a handle in any frame


@dataclasses.dataclass(frozen=True)
class FrameFit:
    """One frame's L (eq. 4), share of pixels outside, and farthest pixel outside."""

    frame: int
    L: float
    outside: float
    farthest: float


@dataclasses.dataclass(frozen=True)
class Report:
    """Figures of a finished palette.

    Attributes
    ----------
    fits : one a frame, in order of time.
    closest : the least distance of two handles at one time (colours in the middle of a split or
        merge do not count, nor do frames that are nearly of one colour, such as black ones), its
        frame and the two nearest vertices' ids; None where there are no two.
    least_used : the handle of least use and its largest mean weight (eq. 7) in any frame.
    dent : the largest share of its convex hull that a slice lacks, and its frame (frames that are
        nearly of one colour do not count).
    splits, merges : vertices where a colour becomes several, or several one.
    colours : palette colours of a frame, on average.
    """

    fits: tuple[FrameFit, ...]
    closest: tuple[float, int, str, str] | None
    least_used: tuple[str, float]
    dent: tuple[float, int]
    splits: int
    merges: int
    colours: float

    @property
    def worst(self) -> FrameFit:
        """The frame of the largest L."""
        return max(self.fits, key=lambda fit: fit.L)

    @property
    def median_loss(self) -> float:
        """The median frame's L."""
        return float(np.median([fit.L for fit in self.fits]))

    def figures(self) -> dict[str, float | int | str]:
        """Return the figures as scalars, for the sidecar."""
        farthest = max(self.fits, key=lambda fit: fit.farthest)
        out: dict[str, float | int | str] = {
            "worst_frame": self.worst.frame,
            "worst_frame_L": self.worst.L,
            "median_frame_L": self.median_loss,
            "farthest_frame": farthest.frame,
            "colours_a_frame": self.colours,
            "least_used": self.least_used[0],
            "least_use": self.least_used[1],
            "deepest_dent": self.dent[0],
            "deepest_dent_frame": self.dent[1],
            "splits": self.splits,
            "merges": self.merges,
        }
        if self.closest:
            distance, frame, one, other = self.closest
            out |= {"closest_handles": distance, "closest_handles_frame": frame}
            out |= {"closest_handle_ids": f"{one} {other}"}
        return out

    def warnings(self) -> tuple[str, ...]:
        """Return what does not fit, with what would help."""
        out = []
        mean = float(np.mean([fit.L for fit in self.fits]))
        bad = [f.frame for f in self.fits if max(BAD_L, BAD_FRAME * self.median_loss) < f.L]
        if mean > BAD_L:
            out.append(
                f"the palette fits the clip loosely (mean L {mean:.2f}): lower --handle-cost or "
                "raise --blocks for more handles, or analyse parts of the clip apart with --frames"
            )
        elif bad:
            names = ", ".join(map(str, bad[:8])) + (", ..." if len(bad) > 8 else "")
            out.append(
                f"{len(bad)} of {len(self.fits)} frames fit badly (L up to {self.worst.L:.2f}, "
                f"the median frame {self.median_loss:.2f}): {names}; lower --handle-cost for more "
                "handles, or analyse parts of the clip apart with --frames"
            )
        if self.closest and self.closest[0] < LOOKALIKE:
            distance, frame, one, other = self.closest
            out.append(
                f"near frame {frame} the handles {one} and {other} are hard to tell apart "
                f"({distance:.2f} apart): raise --separation or --merge-distance"
            )
        if self.dent[0] > DENT:
            out.append(
                f"at frame {self.dent[1]} the palette is dented ({self.dent[0]:.0%} of its convex "
                "hull): raise --convexity, or recoloured gradients may step there"
            )
        if self.least_used[1] < UNUSED:
            out.append(
                f"the handle {self.least_used[0]} weighs less than {UNUSED:.1%} in every frame: "
                "raise --handle-cost, or ask for fewer --vertices"
            )
        return tuple(out)


def report(
    polytope: _core.Polytope, statistics: Sequence[FrameStatistics], options: AnalysisOptions
) -> Report:
    """Measure a polytope on the clip's frames."""
    slices = [_core.slice_at(polytope, float(s.frame)) for s in statistics]
    fits = tuple(_fit(cut, s, options) for cut, s in zip(slices, statistics, strict=True))
    dents = [
        (0.0 if _narrow(s) else _dent(cut), s.frame)
        for cut, s in zip(slices, statistics, strict=True)
    ]
    sources, targets = np.unique(polytope.edges[:, 0]), np.unique(polytope.edges[:, 1])
    out_degree = np.bincount(polytope.edges[:, 0], minlength=len(polytope.vertices))
    in_degree = np.bincount(polytope.edges[:, 1], minlength=len(polytope.vertices))
    return Report(
        fits=fits,
        closest=_closest(polytope, slices, statistics),
        least_used=_least_used(polytope, slices, statistics),
        dent=max(dents, key=lambda dent: dent[0]),
        splits=int((out_degree[sources] > 1).sum()),
        merges=int((in_degree[targets] > 1).sum()),
        colours=float(np.mean([len(cut.rgb) for cut in slices])),
    )


def _fit(cut: _core.Slice, frame: FrameStatistics, options: AnalysisOptions) -> FrameFit:
    r, c, _, outside, farthest, _ = _core.palette_loss(
        frame.colours, cut.rgb, NO_FACES, loss_weights(options)
    )
    return FrameFit(frame.frame, options.lambda_ * r + c, outside, farthest)


def _narrow(frame: FrameStatistics) -> bool:
    return float(np.max(frame.high - frame.low)) < NARROW


def _dent(cut: _core.Slice) -> float:
    """Return the share of its convex hull that a slice lacks, 0 where it fills no volume."""
    if len(cut.rgb) < 4 or len(cut.faces) == 0:
        return 0.0
    a, b, c = (cut.rgb[cut.faces[:, i]] for i in range(3))
    volume = float(np.einsum("ij,ij->i", a - cut.rgb[0], np.cross(b - a, c - a)).sum()) / 6
    try:
        hull = float(ConvexHull(cut.rgb).volume)
    except QhullError:
        return 0.0
    return max(0.0, 1 - volume / hull) if hull > 1e-9 else 0.0


def _closest(
    polytope: _core.Polytope,
    slices: Sequence[_core.Slice],
    statistics: Sequence[FrameStatistics],
) -> tuple[float, int, str, str] | None:
    best: tuple[float, int, str, str] | None = None
    ids = polytope.vertex_ids
    for cut, frame in zip(slices, statistics, strict=True):
        if _narrow(frame):
            continue
        gaps = np.linalg.norm(cut.rgb[:, None] - cut.rgb[None], axis=2)
        # Colours that come from one vertex, or go to one, are meant to be close there.
        related = (cut.ends[:, None, 0] == cut.ends[None, :, 0]) | (
            cut.ends[:, None, 1] == cut.ends[None, :, 1]
        )
        gaps[related] = np.inf
        i, j = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
        if np.isfinite(gaps[i, j]) and (best is None or gaps[i, j] < best[0]):
            near = [ids[cut.ends[k, int(cut.weights[k] > 0.5)]] for k in (int(i), int(j))]
            best = float(gaps[i, j]), frame.frame, near[0], near[1]
    return best


def _least_used(
    polytope: _core.Polytope,
    slices: Sequence[_core.Slice],
    statistics: Sequence[FrameStatistics],
) -> tuple[str, float]:
    """Return the vertex whose largest mean weight in any frame is least."""
    use = np.zeros(len(polytope.vertices))
    count = len(slices)
    chosen = set(np.linspace(0, count - 1, min(count, USE_FRAMES)).round().astype(int).tolist())
    # A vertex weighs most at its own time.
    times = np.array([s.frame for s in statistics], float)
    chosen |= {int(np.argmin(np.abs(times - t))) for t in polytope.vertices[:, 3]}
    for at in sorted(chosen):
        cut, colours = slices[at], statistics[at].coarse
        if len(cut.faces) == 0:  # a line or a point: every colour is needed
            use[cut.ends] = 1.0
            continue
        weights, _ = _core.palette_weights(colours.rgb, cut.rgb, cut.faces)
        mean = colours.counts @ weights / colours.total
        here = np.zeros(len(use))
        np.add.at(here, cut.ends[:, 0], mean * (1 - cut.weights))
        np.add.at(here, cut.ends[:, 1], mean * cut.weights)
        use = np.maximum(use, here)
    least = int(np.argmin(use))
    return polytope.vertex_ids[least], float(use[least])
