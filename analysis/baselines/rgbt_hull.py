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

A slice without volume has one colour, two colours or a two-sided polygon, as in other palettes.
The first or last slice may be flat (a fade from black), or all slices (grey or two-coloured clips).
Colours within half an 8-bit step of a flat space over time are moved into that space. The space is
a colour, line or plane that may move at constant speed. The move may leave the gamut by as much.

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
from palette4d.common.errors import Palette4dError

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
            "expected colours that fill a volume or are exactly flat; another number of vertices "
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
    frames : at least one frame, in order of time.
    gamut : the box that vertices are clipped to.
    vertices : the largest number of 4D vertices, at least `LEAST_VERTICES`. Clipping may leave
        fewer.
    progress : called as progress(done, total) while vertices are removed.

    Raises
    ------
    Palette4dError
        When fewer than `LEAST_VERTICES` vertices are asked for, or rounding leaves no usable hull.
    """
    if vertices < LEAST_VERTICES:
        raise Palette4dError(
            f"vertices of the RGBT hull: found {vertices}, expected at least {LEAST_VERTICES}: "
            "four at either end of the clip enclose a volume"
        )
    numbers = np.array([frame.frame for frame in frames], float)
    points = all_extremes(frames, gamut)
    if len(frames) > 1:
        points = simplified(points, numbers[0], numbers[-1], gamut, vertices, progress)
        points[:, 3] = _nearest(numbers, points[:, 3])
        points[:, :3] = gamut.clip(points[:, :3])
        return convex_polytope(points, numbers, gamut.scale)
    colours = _simplified_colours(points[:, :3], gamut, vertices)
    return _still(gamut.clip(colours), numbers[0], gamut.scale)


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

    More points are left only if the hull cannot be simplified further. Points without volume (see
    `THIN`) are moved into the flat space around them.
    """
    flat = _Flat.around(_normalised(points, first, last, gamut), THIN)
    hull = _hull(flat.coordinates)
    low, scale = gamut.low, gamut.scale
    if hull.points.shape[1] > 1:
        limits = flat.limits((gamut.high - low) / scale)
        hull = _simplify(hull, vertices, limits, progress)
        hull = _simplify(hull, vertices, limits[:2])  # limits in time alone, if too many are left
    unit = flat.back(hull.points)
    return np.column_stack([low + scale * unit[:, :3], first + (last - first) * unit[:, 3]])


def convex_polytope(points: F64, frames: F64, scale: float = 1.0) -> SkewPolytope:
    """Return the 4D convex hull of (n, 4) points (r, g, b, frame) as a skew polytope.

    Points without volume are moved into the flat space that they nearly fill (see `THIN`).

    Parameters
    ----------
    points : every time is one of `frames`; the first and the last frame both occur.
    frames : (m,) frame numbers, increasing, at least two; each lies in a block of the result.
    scale : the size of the colours; the tolerance for flat points is relative to it.

    Raises
    ------
    Palette4dError
        When rounding leaves no usable hull.
    """
    points = np.unique(points[:, [3, 0, 1, 2]], axis=0)[:, [1, 2, 3, 0]]  # in order of time
    unit = _normalised(points, frames[0], frames[-1], Gamut(np.zeros(3), np.full(3, scale)))
    flat = _Flat.around(unit, THIN)
    if len(flat.axes) < 3:
        points = np.column_stack([scale * flat.back(flat.coordinates)[:, :3], points[:, 3]])
    rng = np.random.default_rng(0)
    noise = rng.uniform(-1, 1, flat.coordinates.shape)
    noise[:, -1] = 0
    for jitter in JITTERS:
        try:
            moved = flat.coordinates + jitter * noise
            hull = _hull(moved)
            lattice = _Lattice(points[hull.used], hull, flat.back(moved)[hull.used])
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
            fewer = _hull(_core.progressive_hull_nd(hull.points, hull.simplices, target, limits))
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


@dataclasses.dataclass(frozen=True)
class _Flat:
    """Points r, g, b, t in the flat space that they fill: a moving origin, some colour axes, time.

    rgb = origin + t * drift + coordinates[:, :-1] @ axes; the last coordinate is the time.
    """

    coordinates: F64
    origin: F64
    drift: F64
    axes: F64

    @classmethod
    def around(cls, points: F64, tolerance: float) -> _Flat:
        """Find the space of fewest dimensions that the (n, 4) points lie in within `tolerance`."""
        t = points[:, 3:]
        with_time = np.column_stack([np.ones_like(t), t])
        (origin, drift), *_ = np.linalg.lstsq(with_time, points[:, :3], rcond=None)
        axes = _axes(points[:, :3] - origin - t * drift, tolerance)
        if len(axes) == 3:  # a solid clip: the colours are their own coordinates
            origin, drift, axes = np.zeros(3), np.zeros(3), np.eye(3)
        along = (points[:, :3] - origin - t * drift) @ axes.T
        return cls(np.column_stack([along, t]), origin, drift, axes)

    def limits(self, most: F64) -> F64:
        """Return rows a, b for 0 <= t <= 1 and then for colours from 0 to `most`, and `OVERSHOOT`
        beyond: a . coordinates >= b."""
        d = self.coordinates.shape[1]
        time = np.zeros((1, d + 1))
        time[0, -2] = 1
        colour = np.column_stack([self.axes.T, self.drift, -self.origin])
        rows = np.vstack([time, time, colour, colour])
        rows[1:2, -1] = 1
        rows[2:5, -1] -= OVERSHOOT
        rows[5:, -1] += most + OVERSHOOT
        rows[[1, 5, 6, 7]] *= -1
        return rows

    def back(self, coordinates: F64) -> F64:
        """Return (n, 4) points r, g, b, t from coordinates."""
        t = coordinates[:, -1:]
        return np.column_stack([self.origin + t * self.drift + coordinates[:, :-1] @ self.axes, t])


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


def _simplified_colours(rgb: F64, gamut: Gamut, vertices: int) -> F64:
    """Return at most `vertices` colours around the (n, 3) colours of a single frame."""
    scale = gamut.scale
    axes = _axes(rgb, THIN * scale)
    centre: F64 = rgb.mean(axis=0)
    if len(axes) == 0:
        return centre[None]
    hull = _hull((rgb - centre) @ axes.T)
    if len(axes) > 1:
        floor = gamut.low - OVERSHOOT * scale - centre
        ceiling = gamut.high + OVERSHOOT * scale - centre
        limits = np.vstack([np.column_stack([axes.T, floor]), np.column_stack([-axes.T, -ceiling])])
        hull = _simplify(hull, vertices, limits)
        hull = _simplify(hull, vertices, limits[:0])
    return centre + hull.points @ axes


def _still(rgb: F64, frame: float, scale: float) -> SkewPolytope:
    """Return the convex hull of (n, 3) colours as the polytope of a single frame."""
    ends = [np.column_stack([rgb, np.full(len(rgb), frame + i)]) for i in range(2)]
    prism = convex_polytope(np.vstack(ends), np.array([frame, frame + 1]), scale)
    block = prism.blocks[0]
    used = [track[0] for track in block.tracks]
    tracks = tuple((i,) for i in range(len(used)))
    return SkewPolytope(prism.vertices[used], (Section(frame, frame, tracks, block.faces),), ())


def _nearest(numbers: F64, times: F64) -> F64:
    """Return the frame number nearest to each time, the earlier of two."""
    nearest: F64 = numbers[np.argmin(np.abs(times[:, None] - numbers[None]), axis=1)]
    return nearest


# ------------------------------------------------------------------------------------- slices


class _Lattice:
    """The vertices, edges and facets of a hull in d dimensions, the last of which is time.

    `shape` are the normalised vertices without duplicates, as the hull uses them.
    """

    def __init__(self, vertices: F64, hull: _Hull, shape: F64) -> None:
        self.vertices, self.shape = vertices, shape
        self.dimensions = hull.points.shape[1]
        self.times, self.level = np.unique(vertices[:, 3], return_inverse=True)
        around: dict[Cut, set[int]] = {}
        for simplex, facet in zip(hull.simplices.tolist(), hull.facets.tolist(), strict=True):
            for v in simplex:
                around.setdefault((v,), set()).add(facet)
            for u, w in itertools.combinations(sorted(simplex, key=self._place), 2):
                around.setdefault((u, w), set()).add(facet)
        if self.dimensions == 1:
            around[tuple(sorted((0, 1), key=self._place))] = set()
        # Fewer facets meet in the diagonals that triangulation adds to flat facets.
        self.facets = {
            cut: facets
            for cut, facets in sorted(around.items())
            if len(cut) == 1 or len(facets) >= self.dimensions - 1
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
