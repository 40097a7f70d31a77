"""Quality of a palette: the fit of each frame, and figures that no loss contains.

Input: the polytope as the sidecar holds it, and the frames' statistics. Output: a `Report`, whose
figures the sidecar records. `advice` turns them into warnings.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.convex_hulls import CONCAVE, concavity, narrow
from palette4d.analysis.frame_statistics import CODE_STEP, FrameStatistics
from palette4d.analysis.handle_use import handle_use
from palette4d.analysis.losses import LOST, NO_FACES
from palette4d.analysis.options import AnalysisOptions

from palette4d import _core

F64 = NDArray[np.float64]
# Mean value weights sum to 1. Where their absolute values sum to more than this, an edit moves
# colours by more than it moves any handle; in palettes that do not cross themselves they sum to 1.
WILD = 3.0


@dataclasses.dataclass(frozen=True)
class FrameFit:
    """The L of a frame (eq. 4), its shares of pixels outside at all and by more than 1/255, the
    distance of the farthest pixel, and the share of lost pixels (more than `LOST` outside)."""

    frame: int
    L: float
    outside: float
    outside_1_255: float
    farthest: float
    lost: float = 0.0


@dataclasses.dataclass(frozen=True)
class Report:
    """Figures of a finished palette.

    Attributes
    ----------
    fits : one a frame, in order of time.
    closest : the least distance of two colours at one time, its frame and the ids of the nearest
        vertices; None if there are no two. Colours of one split or merge and frames of nearly one
        colour, such as black ones, do not count.
    least_used : the least used handle and its largest mean weight (eq. 7) in any frame.
    concavity : the largest share of its convex hull that a slice lacks, and its frame; frames of
        nearly one colour do not count.
    crossed : the largest share of a frame's colours whose weights nearly cancel, as the palette
        crosses itself there, and that frame.
    splits, merges : vertices where a colour becomes several, or several one.
    colours : palette colours of a frame, on average.
    """

    fits: tuple[FrameFit, ...]
    closest: tuple[float, int, str, str] | None
    least_used: tuple[str, float]
    concavity: tuple[float, int]
    crossed: tuple[float, int]
    splits: int
    merges: int
    colours: float

    @property
    def worst(self) -> FrameFit:
        """The frame of the largest L."""
        return max(self.fits, key=lambda fit: fit.L)

    @property
    def farthest(self) -> FrameFit:
        """The frame of the farthest pixel."""
        return max(self.fits, key=lambda fit: fit.farthest)

    @property
    def most_lost(self) -> FrameFit:
        """The frame of the largest share of lost pixels."""
        return max(self.fits, key=lambda fit: fit.lost)

    @property
    def median_loss(self) -> float:
        """The median frame's L."""
        return float(np.median([fit.L for fit in self.fits]))

    @property
    def mean_loss(self) -> float:
        """The clip's L (eq. 8)."""
        return float(np.mean([fit.L for fit in self.fits]))

    @property
    def outside(self) -> float:
        """The share of pixels more than 1/255 outside, of all frames."""
        return float(np.mean([fit.outside_1_255 for fit in self.fits]))

    def figures(self) -> dict[str, float | int | str]:
        """Return the figures as scalars, for the sidecar."""
        out: dict[str, float | int | str] = {
            "worst_frame": self.worst.frame,
            "worst_frame_L": self.worst.L,
            "median_frame_L": self.median_loss,
            "outside_1_255": self.outside,
            "farthest_frame": self.farthest.frame,
            "colours_a_frame": self.colours,
            "least_used": self.least_used[0],
            "least_use": self.least_used[1],
            "deepest_concavity": self.concavity[0],
            "deepest_concavity_frame": self.concavity[1],
            "splits": self.splits,
            "merges": self.merges,
        }
        if self.closest:
            distance, frame, first, second = self.closest
            out |= {"closest_handles": distance, "closest_handles_frame": frame}
            out |= {"closest_handle_ids": f"{first} {second}"}
        return out


def report(
    polytope: _core.Polytope, frames: Sequence[FrameStatistics], options: AnalysisOptions
) -> Report:
    """Measure a polytope on the clip's frames."""
    slices = [_core.slice_at(polytope, float(f.frame)) for f in frames]
    pairs = list(zip(slices, frames, strict=True))
    concavities = [(0.0 if narrow(f) else concavity(s.rgb, s.faces), f.frame) for s, f in pairs]
    sources, targets = np.unique(polytope.edges[:, 0]), np.unique(polytope.edges[:, 1])
    out_degree = np.bincount(polytope.edges[:, 0], minlength=len(polytope.vertices))
    in_degree = np.bincount(polytope.edges[:, 1], minlength=len(polytope.vertices))
    return Report(
        fits=tuple(_fit(s, f, options) for s, f in pairs),
        closest=_closest(polytope, slices, frames),
        least_used=_least_used(polytope, slices, frames),
        concavity=max(concavities, key=lambda depth_and_frame: depth_and_frame[0]),
        crossed=max(
            (
                (_crossed(s, f), f.frame)
                for (s, f), (depth, _) in zip(pairs, concavities, strict=True)
                if depth > CONCAVE  # a convex one does not cross itself
            ),
            default=(0.0, frames[0].frame),
        ),
        splits=int((out_degree[sources] > 1).sum()),
        merges=int((in_degree[targets] > 1).sum()),
        colours=float(np.mean([len(s.rgb) for s in slices])),
    )


def _fit(cut: _core.Slice, frame: FrameStatistics, options: AnalysisOptions) -> FrameFit:
    def measured(**slight: float) -> tuple[float, float, float, float, float, F64]:
        weights = _core.LossWeights(options.lambda_, options.k, **slight)
        return _core.palette_loss(frame.colours, cut.rgb, NO_FACES, weights, False)

    r, c, _, outside, farthest, _ = measured()
    visible, lost = (
        measured(slight=limit)[3] if farthest > limit else 0.0 for limit in (CODE_STEP, LOST)
    )
    return FrameFit(frame.frame, options.lambda_ * r + c, outside, visible, farthest, lost)


def _crossed(cut: _core.Slice, frame: FrameStatistics) -> float:
    """Return the share of a frame's colours whose weights, but for their signs, sum to `WILD`."""
    if len(cut.faces) == 0:
        return 0.0
    weights, _ = _core.palette_weights(frame.coarse.rgb, cut.rgb, cut.faces)
    wild = np.abs(weights).sum(axis=1) > WILD
    return float(frame.coarse.counts @ wild / frame.coarse.total)


def _closest(
    polytope: _core.Polytope, slices: Sequence[_core.Slice], frames: Sequence[FrameStatistics]
) -> tuple[float, int, str, str] | None:
    best: tuple[float, int, str, str] | None = None
    ids = polytope.vertex_ids
    for cut, frame in zip(slices, frames, strict=True):
        if narrow(frame):
            continue
        gaps = np.linalg.norm(cut.rgb[:, None] - cut.rgb[None], axis=2)
        # Colours with a common vertex are close by design.
        related = (cut.ends[:, None] == cut.ends[None]).any(axis=2)
        gaps[related] = np.inf
        i, j = np.unravel_index(int(np.argmin(gaps)), gaps.shape)
        if np.isfinite(gaps[i, j]) and (best is None or gaps[i, j] < best[0]):
            near = [ids[cut.ends[k, int(cut.weights[k] > 0.5)]] for k in (int(i), int(j))]
            best = float(gaps[i, j]), frame.frame, near[0], near[1]
    return best


def _least_used(
    polytope: _core.Polytope, slices: Sequence[_core.Slice], frames: Sequence[FrameStatistics]
) -> tuple[str, float]:
    """Return the vertex whose largest mean weight in any frame is least, and that weight."""
    use = handle_use(polytope.vertices, slices.__getitem__, frames)
    least = int(np.argmin(use))
    return polytope.vertex_ids[least], float(use[least])
