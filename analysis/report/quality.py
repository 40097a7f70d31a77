"""How good a palette is: the fit of each frame, and what the losses do not say about its use.

Input: the polytope as the sidecar holds it, and the frames' statistics. Output: a `Report`, whose
figures go into the sidecar. `advice` says what they mean for the user.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.frame_hulls import hull_mesh
from palette4d.analysis.losses import LOST, NO_FACES, loss_weights
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import SkewPolytope
from palette4d.analysis.statistics import FrameStatistics
from scipy.spatial import ConvexHull, QhullError

from palette4d import _core

F64 = NDArray[np.float64]

# Frames on which the use of handles is measured, evenly spaced: mean value coordinates of every
# colour of every frame would cost more than the rest of the analysis.
USE_FRAMES = 12
# Thinner than this, two steps of 8 bits, nobody sees how deep a dent is.
FLAT = 2 / 255
# Farther outside than this a pixel counts as outside in the report: one step of 8 bits.
VISIBLE = 1 / 255
# Share of its convex hull that a slice may lack before it is worth a warning.
DENT = 0.05
# Frames whose colours extend less than this, such as black ones, have no shape to judge.
NARROW = 0.24


@dataclasses.dataclass(frozen=True)
class FrameFit:
    """One frame's L (eq. 4), shares of pixels outside, by any distance and by more than 1/255,
    farthest pixel outside, and share of the pixels that are lost (more than `LOST` outside)."""

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


def report(
    polytope: _core.Polytope, statistics: Sequence[FrameStatistics], options: AnalysisOptions
) -> Report:
    """Measure a polytope on the clip's frames."""
    slices = [_core.slice_at(polytope, float(s.frame)) for s in statistics]
    fits = tuple(_fit(cut, s, options) for cut, s in zip(slices, statistics, strict=True))
    dents = [
        (0.0 if _narrow(s) else _dent(cut.rgb, cut.faces), s.frame)
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
    visible = _share_beyond(VISIBLE, cut, frame) if farthest > VISIBLE else 0.0
    lost = _share_beyond(LOST, cut, frame) if farthest > LOST else 0.0
    return FrameFit(frame.frame, options.lambda_ * r + c, outside, visible, farthest, lost)


def _share_beyond(limit: float, cut: _core.Slice, frame: FrameStatistics) -> float:
    """Return the share of pixels farther than `limit` from the convex hull of a slice."""
    rgb, faces = cut.rgb, cut.faces
    colours, counts = frame.colours.rgb, frame.colours.counts
    share = 0.0
    try:
        planes = ConvexHull(rgb).equations
    except QhullError:  # a point, a line or a polygon: its own convex hull
        pass
    else:
        mesh = hull_mesh(rgb)
        rgb, faces = mesh.rgb, mesh.faces
        # The distance to a plane is the least that it can be; beside an edge it is more.
        least = _beyond_planes(colours, planes)
        share = float(counts[least > limit].sum())
        unclear = (least > 0) & (least <= limit)
        colours, counts = colours[unclear], counts[unclear]
    if len(colours):
        _, distances = _core.palette_weights(colours, rgb, faces)
        share += float(counts[distances > limit].sum())
    return share / frame.colours.total


def _beyond_planes(points: F64, planes: F64) -> F64:
    """Return how far each of (n, 3) points lies beyond any of (m, 4) planes, negative inside.

    Plane by plane and axis by axis: a matrix product of three columns takes twelve times as long.
    """
    x, y, z = np.ascontiguousarray(points.T)
    farthest = np.full(len(points), -np.inf)
    for a, b, c, d in planes:
        distance = a * x
        distance += b * y
        distance += c * z
        distance += d
        np.maximum(farthest, distance, out=farthest)
    return farthest


def _narrow(frame: FrameStatistics) -> bool:
    return float(np.max(frame.high - frame.low)) < NARROW


def deepest_dent(polytope: SkewPolytope, statistics: Sequence[FrameStatistics]) -> float:
    """Return what `Report.dent` will be, of a polytope that is not finished: the largest share of
    its convex hull that a frame's slice lacks."""
    dents = (
        _dent(polytope.colours_at(block, frame.frame), block.faces)
        for frame in statistics
        for block in polytope.blocks
        if block.first <= frame.frame <= block.last and not _narrow(frame)
    )
    return max(dents, default=0.0)


def _dent(rgb: F64, faces: NDArray[np.int32]) -> float:
    """Return the share of its convex hull that a mesh lacks, 0 where that is practically flat."""
    if len(rgb) < 4 or len(faces) == 0:
        return 0.0
    a, b, c = (rgb[faces[:, i]] for i in range(3))
    volume = float(np.einsum("ij,ij->i", a - rgb[0], np.cross(b - a, c - a)).sum()) / 6
    try:
        hull = ConvexHull(rgb)
    except QhullError:
        return 0.0
    if hull.volume <= FLAT * hull.area / 2:  # its mean thickness
        return 0.0
    # A mesh that is turned inside out has a negative volume: it lacks everything.
    return float(np.clip(1 - volume / hull.volume, 0.0, 1.0))


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
