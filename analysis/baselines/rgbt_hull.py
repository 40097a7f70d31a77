"""The simplified convex hull in RGB and time: a comparison method of section 6.2.

Input: the frames' colours. Output: a `SkewPolytope` whose slices are the slices of a convex 4D
polytope. It encloses every colour of every frame, apart from the clipping in step 3.

1. qhull computes the hull of the vertices of all frame hulls in RGB and time. The clip's length is
   one unit of time, as in the paper. The result does not depend on that unit.
2. The hull is simplified as by Tan et al. (2016), but in 4D. Each step contracts the edge that adds
   the least volume. The new vertex minimises that volume and keeps all colours enclosed.
   New vertices stay inside the clip's time range, so nothing is cut off at its ends. Where possible
   they also stay near the gamut: clipping a far vertex leaves many colours outside (`OVERSHOOT`).
   After each loss of a fifth of the vertices the convex hull is computed again. Otherwise
   concavities would block most contractions.
3. The vertices are clipped to the gamut, as by Tan et al., and moved to the nearest frame. So the
   topology changes only at frames. Both moves may leave colours of the clip outside. On SEASONS the
   move in time changes no loss by more than 0.002. Then the convex hull is computed once more.

In the sidecar: the slice of a convex polytope changes its topology exactly at the vertices. Each
vertex time is a block of one frame, and the frames between two vertex times are a block. A
transition between two blocks has the tracks and faces of the longer block. If all colours pass a
vertex time one to one, the block continues through it. This always holds in a plane and in a clip
that does not change. Tracks are the hull's edges. Faces are slices of its facets: polygons that
stay flat and convex between two vertex times, with one fixed triangulation. All slices are closed,
convex and oriented outwards.

The first or last slice may be flat (a fade from black). It has one colour, two colours or a
two-sided polygon, as in other palettes. Colours that are flat all the time are refused.

A solid clip needs four vertices at either end, so it never has fewer than eight.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis.convex_hulls import THIN, hull_mesh, two_sided
from palette4d.analysis.frame_statistics import FrameStatistics, Gamut
from palette4d.analysis.losses import NO_FACES
from palette4d.analysis.polytope import LEAST_COLOURS, Section, SkewPolytope
from scipy.spatial import ConvexHull, QhullError

from palette4d import _core
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.text import counted

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Cut = tuple[int, ...]
"""A part of the hull that a slice cuts: a vertex (v,), or an edge (u, w), u earlier than w."""

# Default cap on the 4D vertices, and the fewest that enclose a volume at either end of the clip.
VERTICES = 20
LEAST_VERTICES = 2 * LEAST_COLOURS
# Share of the vertices at which the convex hull is recomputed.
ROUND = 0.8
# How far beyond the gamut a new vertex may lie, in units of the gamut, before it is clipped.
OVERSHOOT = 0.3
# Tolerance of colours without extent on an axis, in units of the gamut: rounding.
EXACTLY_FLAT = 1e-9
# Noise in units of the gamut, tried in turn until qhull separates the facets of a hull.
JITTERS = (0.0, 1e-9, 1e-7, 1e-5)


class _IllFormedError(Palette4dError):
    """Rounding has left a hull whose facets do not fit together."""

    def __init__(self) -> None:
        super().__init__(
            "the convex hull in RGB and time is degenerate: its facets do not fit together; "
            "expected colours that fill a volume; another number of vertices "
            "may do"
        )


def rgbt_polytope(
    frames: Sequence[FrameStatistics],
    gamut: Gamut,
    vertices: int = VERTICES,
    progress: Callable[[int, int], object] | None = None,
) -> SkewPolytope:
    """Return the simplified convex hull of all frames' colours in RGB and time.

    Parameters
    ----------
    frames : at least two frames, in order of time.
    gamut : the box that vertices are clipped to.
    vertices : the largest number of 4D vertices, at least `LEAST_VERTICES`. Clipping may leave
        fewer.
    progress : called as progress(done, total) while vertices are removed.

    Raises
    ------
    Palette4dError
        When fewer than `LEAST_VERTICES` vertices are asked for, the colours fill no volume, or
        rounding leaves no usable hull.
    """
    if vertices < LEAST_VERTICES:
        raise Palette4dError(
            f"vertices of the RGBT hull: found {vertices}, expected at least {LEAST_VERTICES}: "
            "four at either end of the clip enclose a volume"
        )
    numbers = np.array([frame.frame for frame in frames], float)
    points = all_extremes(frames, gamut)
    _refuse_flat(points, frames, gamut)
    points = simplified(points, numbers[0], numbers[-1], gamut, vertices, progress)
    points[:, 3] = _nearest(numbers, points[:, 3])
    points[:, :3] = gamut.clip(points[:, :3])
    return convex_polytope(points, numbers, gamut.scale)


def _refuse_flat(points: F64, frames: Sequence[FrameStatistics], gamut: Gamut) -> None:
    """Raise an error for colours without volume, apart from a motion at constant speed."""
    with_time = np.column_stack([np.ones(len(points)), points[:, 3]])
    still, *_ = np.linalg.lstsq(with_time, points[:, :3], rcond=None)
    if len(frames) < 2 or len(_axes(points[:, :3] - with_time @ still, THIN * gamut.scale)) < 3:
        raise Palette4dError(
            f"a hull in RGB and time: found {counted(len(frames), 'frame')} whose colours fill no "
            "volume in time, expected two frames or more whose colours do; use "
            f"{Arg('method', 'static')}"
        )


def all_extremes(frames: Sequence[FrameStatistics], gamut: Gamut) -> F64:
    """Return the (n, 4) corners of every frame's hull: r, g, b, frame."""
    return np.vstack(
        [
            np.column_stack([rgb, np.full(len(rgb), float(frame.frame))])
            for frame in frames
            for rgb in (_extremes(frame.colours.rgb, gamut.scale),)
        ]
    )


def simplified(
    points: F64,
    first: float,
    last: float,
    gamut: Gamut,
    vertices: int,
    progress: Callable[[int, int], object] | None = None,
) -> F64:
    """Return at most `vertices` points, between the frames `first` and `last`, around the (n, 4)
    points.

    More points are left only if the hull cannot be simplified further.
    """
    low, scale = gamut.low, gamut.scale
    hull = _hull(_normalised(points, first, last, gamut))
    # Rows a, b: a . (r, g, b, t) >= b. Time from 0 to 1, colours to `OVERSHOOT` beyond the gamut.
    sides = np.eye(4)[[3, 0, 1, 2]]
    most = np.concatenate([[1], (gamut.high - low) / scale + OVERSHOOT])
    limits = np.column_stack(
        [np.vstack([sides, -sides]), np.concatenate([[0.0], [-OVERSHOOT] * 3, -most])]
    )
    hull = _simplify(hull, vertices, limits, progress)
    hull = _simplify(hull, vertices, limits[[0, 4]])  # limits in time alone, if too many are left
    unit = hull.points
    return np.column_stack([low + scale * unit[:, :3], first + (last - first) * unit[:, 3]])


def convex_polytope(points: F64, frames: F64, scale: float = 1.0) -> SkewPolytope:
    """Return the 4D convex hull of (n, 4) points (r, g, b, frame) as a skew polytope.

    Points without volume are moved into the flat space that they nearly fill (see `THIN`).

    Parameters
    ----------
    points : every time is one of `frames`; the first and the last frame both occur.
    frames : (m,) frame numbers, increasing, at least two; each lies in a block of the result.
    scale : the size of the colours.

    Raises
    ------
    Palette4dError
        When rounding leaves no usable hull.
    """
    points = np.unique(points[:, [3, 0, 1, 2]], axis=0)[:, [1, 2, 3, 0]]  # in order of time
    unit = _normalised(points, frames[0], frames[-1], Gamut(np.zeros(3), np.full(3, scale)))
    noise = np.random.default_rng(0).uniform(-1, 1, unit.shape)
    noise[:, -1] = 0
    for jitter in JITTERS:
        try:
            moved = unit + jitter * noise
            hull = _hull(moved)
            lattice = _Lattice(points[hull.used], hull, moved[hull.used])
            return _sections(lattice, frames)
        except _IllFormedError:
            continue
    raise _IllFormedError


# ------------------------------------------------------------------------------------- hulls


@dataclasses.dataclass(frozen=True)
class _Hull:
    """A convex hull in d dimensions.

    `points` (n, d) are its vertices, rows `used` of the input points. `simplices` (m, d) are its
    triangulated facets. `facets` (m,) is the facet that each simplex belongs to.
    """

    points: F64
    used: I64
    simplices: I64
    facets: I64

    def closed(self) -> bool:
        """Whether each ridge lies between two simplices."""
        d = self.simplices.shape[1]
        rows = np.sort(self.simplices, axis=1)
        ridges = np.vstack([np.delete(rows, skip, axis=1) for skip in range(d)])
        _, counts = np.unique(ridges, axis=0, return_counts=True)
        return bool((counts == 2).all())


def _hull(points: F64) -> _Hull:
    """Return the convex hull of (n, d) points that fill d dimensions, d from 1 to 4."""
    if points.shape[1] == 1:
        ends = np.array([np.argmin(points[:, 0]), np.argmax(points[:, 0])])
        return _Hull(points[ends], ends, np.array([[0], [1]]), np.array([0, 1]))
    # Facets of nearly flat or nearly equal points may not close; qhull's joggling closes them.
    for settings in ("Qt", "QJ"):
        try:
            hull = ConvexHull(points, qhull_options=settings)
        except QhullError:
            continue
        used = np.unique(hull.simplices)
        _, facets = np.unique(hull.equations, axis=0, return_inverse=True)
        result = _Hull(
            points[used],
            used.astype(np.int64),
            np.searchsorted(used, hull.simplices).astype(np.int64),
            facets.ravel().astype(np.int64),
        )
        if result.closed():
            return result
    raise _IllFormedError


def _simplify(
    hull: _Hull, vertices: int, limits: F64, progress: Callable[[int, int], object] | None = None
) -> _Hull:
    """Contract edges until at most `vertices` are left, the new ones within the limits."""
    total = max(len(hull.points) - vertices, 0)
    start = len(hull.points)
    while len(hull.points) > vertices:
        target = max(vertices, int(ROUND * len(hull.points)))
        try:
            fewer = _hull(_core.progressive_hull_4d(hull.points, hull.simplices, target, limits))
        except _IllFormedError:
            break
        if len(fewer.points) >= len(hull.points):
            break
        hull = fewer
        if progress:
            progress(min(start - len(hull.points), total), total)
    if progress:
        progress(total, total)
    return hull


def _normalised(points: F64, first: float, last: float, gamut: Gamut) -> F64:
    """Colours in units of the gamut, and times in units of the clip's length."""
    colours = (points[:, :3] - gamut.low) / gamut.scale
    return np.column_stack([colours, (points[:, 3] - first) / (last - first)])


def _axes(residual: F64, tolerance: float) -> F64:
    """Return the (d, 3) principal axes along which (n, 3) points spread by more than twice the
    tolerance."""
    centred = residual - residual.mean(axis=0)
    _, vectors = np.linalg.eigh(centred.T @ centred)
    axes: F64 = vectors.T[::-1]
    kept: F64 = axes[np.ptp(centred @ axes.T, axis=0) > 2 * tolerance]
    return kept


def _extremes(rgb: F64, scale: float) -> F64:
    """Return the corners of the convex hull of (n, 3) colours."""
    axes = _axes(rgb, EXACTLY_FLAT * scale)
    if len(axes) == 0:
        return rgb[:1]
    try:
        return rgb[_hull(rgb @ axes.T if len(axes) < 3 else rgb).used]
    except _IllFormedError:  # too thin for a hull; the clip's own hull may still separate them
        return rgb


def _nearest(numbers: F64, times: F64) -> F64:
    """Return the frame number nearest to each time, the earlier of two."""
    nearest: F64 = numbers[np.argmin(np.abs(times[:, None] - numbers[None]), axis=1)]
    return nearest


# ------------------------------------------------------------------------------------- slices


class _Lattice:
    """The vertices, edges and facets of a hull, whose last dimension is time.

    `shape` are the normalised vertices without duplicates, as the hull uses them.
    """

    def __init__(self, vertices: F64, hull: _Hull, shape: F64) -> None:
        self.vertices, self.shape = vertices, shape
        self.times, self.level = np.unique(vertices[:, 3], return_inverse=True)
        around: dict[Cut, set[int]] = {}
        for simplex, facet in zip(hull.simplices.tolist(), hull.facets.tolist(), strict=True):
            for v in simplex:
                around.setdefault((v,), set()).add(facet)
            for u, w in itertools.combinations(sorted(simplex, key=self._place), 2):
                around.setdefault((u, w), set()).add(facet)
        # Fewer facets meet in the diagonals that triangulation adds to flat facets.
        self.facets = {
            cut: facets
            for cut, facets in sorted(around.items())
            if len(cut) == 1 or len(facets) >= 3
        }

    def _place(self, v: int) -> tuple[int, int]:
        return int(self.level[v]), v

    def at_level(self, i: int) -> list[Cut]:
        """Return the vertices and edges that the slice at the i-th vertex time cuts."""
        level = self.level
        return [
            c
            for c in self.facets
            if (len(c) == 1 and level[c[0]] == i) or (len(c) == 2 and level[c[0]] < i < level[c[1]])
        ]

    def after_level(self, i: int) -> list[Cut]:
        """Return the edges that slices between the i-th vertex time and the next one cut."""
        level = self.level
        return [c for c in self.facets if len(c) == 2 and level[c[0]] <= i < level[c[1]]]

    def colours(self, cuts: Sequence[Cut], t: float) -> F64:
        """Return the (n, 3) colours of the shape in the slice at t."""
        early, late = ([cut[end] for cut in cuts] for end in (0, -1))
        start, end = self.vertices[early, 3], self.vertices[late, 3]
        weight = (t - start) / np.where(end > start, end - start, 1)
        out: F64 = self.shape[early, :3] + weight[:, None] * (
            self.shape[late, :3] - self.shape[early, :3]
        )
        return out

    def surface(self, cuts: Sequence[Cut], t: float) -> I32:
        """Return the outward triangles over the cuts of the slice at t, which is convex; none for a
        point or a line, two sides for a polygon."""
        if len(cuts) <= 2:
            return NO_FACES
        colours = self.colours(cuts, t)
        axes = _axes(colours, EXACTLY_FLAT)
        try:
            if len(axes) == 2:
                polygon = ConvexHull(colours @ axes.T).vertices
                faces, corners = two_sided(polygon), len(polygon)
            else:
                mesh = hull_mesh(colours)
                faces, corners = mesh.faces, len(mesh.rgb)
        except QhullError:
            raise _IllFormedError from None
        if corners != len(cuts):  # all cuts of a convex polytope are corners
            raise _IllFormedError
        return faces


# ------------------------------------------------------------------------------------- sections


@dataclasses.dataclass
class _Run:
    """Slices of one topology: from the vertex time `start` to the vertex time `end` (indices).

    Tracks are chains of vertices. `opens` and `closes`: whether the start and the end belong to it.
    """

    start: int
    end: int
    tracks: list[list[int]]
    faces: I32
    opens: bool = False
    closes: bool = False


def _sections(lattice: _Lattice, frames: F64) -> SkewPolytope:
    """Return the polytope's blocks and transitions."""
    times = lattice.times
    runs: list[_Run] = []
    for i in range(len(times) - 1):
        cuts = lattice.after_level(i)
        faces = lattice.surface(cuts, (times[i] + times[i + 1]) / 2)
        runs.append(_Run(i, i + 1, [list(cut) for cut in cuts], faces))
    sequence: list[_Run] = []
    for i in range(len(times)):
        before = sequence[-1] if i > 0 else None
        after = runs[i] if i < len(runs) else None
        cuts = lattice.at_level(i)
        ways = [_passing(lattice, run, cuts, i) for run in (before, after) if run is not None]
        if any(set(way) != set(range(len(cuts))) for way in ways):
            raise _IllFormedError  # a colour that ends or begins in the middle of the clip
        through = [len(way) == len(cuts) for way in ways]
        if before and after and all(through) and _join(before, after, *ways):
            continue
        if before and through[0]:
            before.closes = True
        elif after and through[-1]:
            after.opens = True
        else:
            faces = lattice.surface(cuts, times[i])
            sequence.append(_Run(i, i, [list(cut) for cut in cuts], faces, True, True))
        if after:
            sequence.append(after)
    return _assembled(lattice, sequence, frames)


def _passing(lattice: _Lattice, run: _Run, cuts: list[Cut], i: int) -> list[int]:
    """Return, for each track of a neighbouring run, its cut at the i-th vertex time."""
    place = {cut: n for n, cut in enumerate(cuts)}
    end = -1 if run.end == i else 0
    out = []
    for track in run.tracks:
        if lattice.level[track[end]] == i:
            out.append(place.get((track[end],), -1))
        else:
            out.append(place.get(tuple(track[-2:] if end else track[:2]), -1))
    return out


def _join(before: _Run, after: _Run, ends: list[int], starts: list[int]) -> bool:
    """Join `after` to `before` if every colour continues and the faces stay the same."""
    follower = [starts.index(n) for n in ends]  # the track of `after` that continues each track
    place = {track: n for n, track in enumerate(follower)}
    renamed = {_rotated([place[n] for n in face]) for face in after.faces.tolist()}
    if renamed != {_rotated(face) for face in before.faces.tolist()}:
        return False
    for track, n in zip(before.tracks, follower, strict=True):
        if track[-1] == after.tracks[n][0]:
            track.append(after.tracks[n][1])
    before.end = after.end
    return True


def _rotated(face: Sequence[int]) -> tuple[int, ...]:
    start = list(face).index(min(face))
    return (*face[start:], *face[:start])


def _assembled(lattice: _Lattice, sequence: list[_Run], frames: F64) -> SkewPolytope:
    """Give each run the frames that it covers, and put transitions between them."""
    times = lattice.times
    blocks: list[Section] = []
    transitions: list[Section] = []
    pending: _Run | None = None  # the run just before the next block
    for run in sequence:
        first, last = times[run.start], times[run.end]
        covered = frames[(frames > first) & (frames < last)]
        begins = [first] if run.opens else covered[:1].tolist()
        ends = [last] if run.closes else covered[-1:].tolist()
        own_frames = sorted([*begins, *ends])
        if not own_frames:
            pending = run  # without frames of its own the run is only a transition
            continue
        if blocks:
            inner = run if not run.opens else pending
            assert inner is not None
            transitions.append(_between(lattice, inner, blocks[-1].last, own_frames[0]))
        tracks = tuple(_part(lattice, track, own_frames[0], own_frames[-1]) for track in run.tracks)
        blocks.append(Section(own_frames[0], own_frames[-1], tracks, run.faces))
        pending = run
    return SkewPolytope(lattice.vertices, tuple(blocks), tuple(transitions))


def _between(lattice: _Lattice, run: _Run, first: float, last: float) -> Section:
    """Return the transition from `first` to `last`, which lies inside a run."""
    tracks = tuple(_part(lattice, track, first, last) for track in run.tracks)
    return Section(first, last, tracks, run.faces)


def _part(lattice: _Lattice, track: Sequence[int], first: float, last: float) -> Cut:
    """Return the shortest run of a track's vertices that covers [first, last]."""
    times = lattice.vertices[list(track), 3]
    start = max(int(np.searchsorted(times, first, side="right")) - 1, 0)
    end = int(np.searchsorted(times, last, side="left"))
    return tuple(track[start : end + 1])
