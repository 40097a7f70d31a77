"""Solving picks and holds: displacements of the palette, and bumps for the local remainder.

Input: the members of a sidecar. Output: its member ``edits.solution``. Pure NumPy, and the same
numbers every time.

A palette colour's displacement moves a colour c by its mean value weight w(c) (eqs. 6, 7). So each
frame has a linear least-squares problem for the displacements d of its palette colours and the
sizes a of the bumps around the picked colours. At a frame, with all colours in code values:

- a pick at colour p wants ``w(p) d + phi(p) a = change - U(p)``, where U is what the user's own
  handles do there;
- the guard: each colour of the clip wants to stay, the more pixels have it and the greyer it is,
  unless it is near a pick or a shade of it. A pick of few pixels moves no palette colour that many
  pixels are mixed from. Changes are reweighted: most of the picture stays, instead of changing a
  little everywhere;
- few palette colours move (reweighted); bumps are small.

What is left at the picks is then met by the bumps alone. A bump grows with the change, else colours
would fold over and posterise, up to a limit: beyond are other things. A pick of a box with a wide
spread of colours has a bump at several of them.

A hold takes no part in this. It scales what all else does to the colours near it, to nothing at
its own. So no colour ever changes more with a hold than without. A hold ends at the nearest pick.

Near means one thing in all of this: the shades of a colour, lighter and darker, are nearer than
others (`bumps.squares`).

Solved are the clip's vertices, the picks' own frames and every few frames between; the core
interpolates linearly. The problems of all frames are one: a colour that is there at two of them
wants to change alike. Else one palette colour would move at one frame, and at the next another that
does the same for the pick, and all that is near would swing. Each set of picks that ask at the same
time is solved as if there were no others, and with their whole changes. So a pick that ends at a
frame has no effect at all beyond. In its ramps the solution goes from the one without it to the one
with it.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.grade.bumps import alongs, bump_values, bumped, squares
from palette4d.grade.edits import Colour
from palette4d.grade.keyframes import needed
from palette4d.grade.picks import MOST_PICKS, Pick, all_picks
from palette4d.grade.sidecar import Fields

F64 = NDArray[np.float64]

# The constants below hold for all clips. docs/lab/picks.md shows what they were chosen by.

# A colour of few pixels counts as if it had this share of them: a lamp.
LEAST_SHARE = 5e-4
# The guard's weight beside a pick that has all the pixels.
GUARD = 1.15
# A change of another colour is as visible beside a pick that asks for much. So from LARGE_CHANGE on
# the guard no longer counts in shares of what is asked for.
LARGE_CHANGE = 0.35
# A change of a colour is noticed 1 + CHROMA (max - min) times less than that of a grey.
CHROMA = 6.0
# A guarded colour that would change by more than LARGE times the largest change that is asked for
# weighs up to so much, however few pixels have it: they must not overshoot either.
OVERSHOOT, LARGE = 0.3, 1.1
# The radius of a bump is RADIUS_0 + RADIUS_1 |change|, at most LARGEST. A hold has LARGEST, or ends
# at the nearest pick. Where that is nearer than LEAST, it keeps less and less.
RADIUS_0, RADIUS_1, LARGEST, LEAST = 0.06, 0.87, 0.3, 0.05
# Distances to the shades of a colour, lighter and darker, count so much.
SHADE = 0.55
# The guard is off at a pick, and is back to full strength at this distance.
NEAR = 0.265
# A colour of a pick's spread has a bump of its own if the pick's bump would leave more than this of
# its change undone. A hold's change counts as 1.
UNDONE = 0.04
# Cost of a slope: of a displacement that changes along an edge of the palette by as much as the
# colour. Near greys, where colours are close together, the palette would tear them apart.
SLOPE = 2e-4
# Cost of a swing: of changes that differ between two frames by as much as is asked for, where all
# pixels have the same colours at both. From 10 to 80 do much the same.
STEADY = 40.0
# Costs of a palette colour's displacement and of a bump, beside the weight 1 of a pick.
RIDGE, BUMP = 1e-4, 0.33
# Reweighting: rounds, and the sizes, as shares of the largest change, below which a palette
# colour's displacement and a guarded colour's change no longer cost more per size. A displacement
# below FEW of the largest change is none. The exponent is between absolute changes (1) and squared
# ones (0): the former would give up a whole sky to keep the rest.
EXPONENT = 0.7
ROUNDS, SMALL_MOVE, SMALL_CHANGE, FEW = 5, 0.03, 0.03, 0.1
# Picks that nearly coincide and ask for different things: the bumps' sizes stay bounded by
# 1 / (2 TIKHONOV) times the difference. A lone pick's residual is TIKHONOV^2 of its remainder.
TIKHONOV = 0.1
# The colours of a pick's spread count so much beside the picked one, which has to be met.
SPREAD = 0.1

# Frames are solved at least every STEP frames; in long clips at MOST_TIMES frames.
STEP, MOST_TIMES = 4, 40
# Keys that a straight line between their neighbours meets within this are left out.
STRAIGHT = 4e-4
# A colour that is guarded by at least this is none of those that the user wants to change.
OTHER = 0.9
# Displacements below this (a quarter of an 8-bit step) are none.
NONE = 1e-3
# Stored numbers are rounded, so that the last bits of a LAPACK never show.
DIGITS = 6


def solve(fields: Mapping[str, Any]) -> tuple[Fields, dict[str, Fields]]:
    """Solve all enabled picks and holds of a sidecar together.

    Parameters
    ----------
    fields : mapping
        The members of a sidecar (docs/sidecar.md). Without the member "colours" the palette's own
        colours are guarded.

    Returns
    -------
    solution : dict
        The member ``edits.solution``.
    measured : dict
        For each pick that is solved, by its id: ``residual``, ``worst``, ``worst_frame`` and
        ``global`` (`picks.Pick`).
    """
    enabled = [pick for pick in all_picks(fields["edits"]) if pick.enabled]
    clip = ClipAtTimes(fields)
    problem = Problem(clip, enabled[:MOST_PICKS])
    solution = problem.solution(problem.solved())
    return solution, _measured(fields, solution, problem)


class ClipAtTimes:
    """The palette, the user's own displacements and the clip's colours at a time."""

    def __init__(self, fields: Mapping[str, Any]) -> None:
        self.core = parsed(fields, {})
        self.polytope = self.core.polytope
        found = fields["clip"]["frames"]
        self.first, self.last, self.step = found["first"], found["last"], found["step"]
        # Without pixels a frame has no colours, whatever a file says.
        entries = [e for e in fields.get("colours", ()) if any(row[3] > 0 for row in e["rgbw"])]
        self.frames = [entry["frame"] for entry in entries]
        self.colours = [np.array(entry["rgbw"], float).reshape(-1, 4) for entry in entries]
        edits = fields["edits"]
        knots: dict[str, list[tuple[float, bool]]] = {}
        locks = set(edits.get("locks", ()))
        vertices = fields["polytope"]["vertices"]
        frame_of = {vertex["id"]: vertex["frame"] for vertex in vertices}
        for edge in fields["polytope"]["edges"]:
            knots[edge["id"]] = [
                (frame_of[end], end in locks) for end in (edge["from"], edge["to"])
            ]
        for stop in edits["stops"]:
            knots[stop["edge"]].append((stop["frame"], stop["id"] in locks))
        #: Frames of an edge's handles, and whether each may move (1) or is locked (0).
        self.handles = {
            id_: (
                np.array([f for f, _ in sorted(of)]),
                np.array([1.0 - lock for _, lock in sorted(of)]),
            )
            for id_, of in knots.items()
        }
        self.free_vertices = np.array([vertex["id"] not in locks for vertex in vertices], float)

    def colours_at(self, time: float) -> F64:
        """Return (m, 4) colours of the clip, and each one's share of the pixels.

        Without colours of the clip: the palette's, and the middles of its faces.
        """
        if not self.frames:
            cut = _core.slice_at(self.polytope, time)
            palette, faces = cut.rgb, cut.faces
            middles = palette[faces].mean(axis=1) if len(faces) else palette
            rgb = np.concatenate([palette, middles])
            return np.column_stack([rgb, np.full(len(rgb), 1 / len(rgb))])
        after = int(np.searchsorted(self.frames, time))
        if after == 0 or after == len(self.frames):
            return self.colours[min(after, len(self.frames) - 1)]
        before = after - 1
        part = (time - self.frames[before]) / (self.frames[after] - self.frames[before])
        rows = [self.colours[before], self.colours[after]]
        return np.concatenate([rows[0] * [1, 1, 1, 1 - part], rows[1] * [1, 1, 1, part]])


@dataclass(frozen=True)
class _Unknowns:
    """What is unknown at a time: displacements of distinct places, then sizes of bumps.

    `places` has the place of each palette colour; `free` how much each distinct one may move, 0..1;
    `local` is 0 for the points of a pick without a bump.
    """

    time: float
    cut: _core.Slice
    places: list[tuple[str, int]]
    free: F64
    picked: NDArray[np.intp]
    local: NDArray[np.bool_]


@dataclass(frozen=True)
class _Terms:
    """The least-squares problem at one time, in shares of `scale`, the largest change.

    `far` is how much each of the `guarded` colours is guarded, 0..1, `guard` its weight.
    """

    of: _Unknowns
    scale: float
    rows: F64
    weights: F64
    wanted: F64
    guarded: F64
    guard_rows: F64
    guard: F64
    far: F64
    slopes: F64
    bump_costs: F64


@dataclass(frozen=True)
class _Solved:
    """The solution at one time: displacements by place, bumps and holds by the number of the point.

    A place is ("v", vertex index) or ("e", edge index). A bump is its displacement, a hold its
    radius and how much it keeps.
    """

    time: float
    moves: dict[tuple[str, int], F64]
    bumps: dict[int, F64]


class Problem:
    """The picks of a clip, solved at one time after the other.

    A pick has a point in colour for itself and for each colour of its spread. All have the same
    change and a bump each.
    """

    def __init__(self, clip: ClipAtTimes, picks: Sequence[Pick]) -> None:
        self.clip, self.picks = clip, picks
        self._known: dict[tuple[str, float], F64] = {}
        points = [
            (number, offset, radius, shade)
            for number, pick in enumerate(picks)
            for radius in [self._radius_of(pick)]
            for shade in [self._shade_of(pick, radius)]
            for offset in ((0.0, 0.0, 0.0), *pick.spread)
            if not any(offset) or _undone(pick, offset, radius, shade) > UNDONE
        ]
        of, offsets, radii, shades = zip(*points, strict=True) if points else ((), (), (), ())
        self.of = np.array(of, int)
        self.moving = np.array([pick.to is not None for pick in picks], bool)
        self.offsets = np.array(offsets).reshape(-1, 3)
        self.radii, self.shades = np.array(radii, float), np.array(shades, float)
        #: Share of the pixels near each point where it was picked.
        self.pixels = np.array(
            [self._pixels(picks[n].frame)[i] for i, n in enumerate(self.of)], float
        )
        #: Frames where the effect of a pick begins or ends: nothing may pass them.
        self.borders = sorted(
            {
                float(knot)
                for pick in picks
                for knot in (
                    pick.knots(clip.step)[0],
                    pick.knots(clip.step)[3],
                    *(key.frame for key in pick.path if key.there == 0),
                )
                if clip.first <= knot <= clip.last
            }
        )
        self.times = self._times()

    def _radius_of(self, pick: Pick) -> float:
        """Return the radius of a pick's bumps, or where a hold ends at most."""
        if pick.radius is not None or pick.to is None:
            return pick.radius or LARGEST
        change = float(np.linalg.norm(pick.change_at(pick.frame)))
        return min(RADIUS_0 + RADIUS_1 * change, LARGEST)

    def _shade_of(self, pick: Pick, radius: float) -> float:
        """Return what distances to the shades of a pick count.

        A bump is longer towards them, unless it has several times as many pixels then. So many are
        another thing's: hair is a shade of an orange sign.
        """
        if pick.to is None or not self.clip.frames:
            return SHADE
        guarded, centre = self.clip.colours_at(pick.frame), np.array([pick.rgb])
        round_, long = (
            float(guarded[:, 3] @ bump_values(guarded[:, :3], centre, radius, along)[:, 0])
            for along in (np.zeros((1, 3)), alongs(centre, SHADE))
        )
        more = long / max(round_, LEAST_SHARE)
        return 1 - (1 - SHADE) * min(1.0, max(0.0, 3 - more))

    def near(self, colours: F64, time: float, points: NDArray[np.intp], radii: F64 | float) -> F64:
        """Return (n, m) values, 0..1, of bumps of such radii around points, at n colours."""
        centres = self.centres(time)[points]
        return bump_values(colours, centres, radii, alongs(centres, self.shades[points]))

    def _pixels(self, time: float) -> F64:
        """Return the share of the clip's pixels near each point."""
        guarded = self.clip.colours_at(time)
        near = self.near(guarded[:, :3], time, np.arange(len(self.of)), NEAR)
        return np.asarray(guarded[:, 3] @ near, np.float64)

    def _once(self, what: str, time: float, compute: Callable[[], F64]) -> F64:
        """Return what is computed once for a time."""
        if (what, time) not in self._known:
            self._known[what, time] = compute()
        return self._known[what, time]

    def strengths(self, time: float) -> F64:
        """Return how much of its change each point asks for, 0..1."""

        def compute() -> F64:
            found = [pick.strength_at(time, self.clip.step) for pick in self.picks]
            return np.asarray(np.array(found)[self.of], np.float64)

        return self._once("strengths", time, compute)

    def certain(self, time: float) -> F64:
        """Return how certain it is that each point belongs to what was picked, 0..1.

        A colour of a box's spread that twice as many pixels have at another frame is another
        thing's there: gaps between leaves have the sky's colour.
        """
        spread = self.offsets.any(axis=1) & self.moving[self.of]
        if not (self.clip.frames and spread.any()):
            return np.ones(len(self.of))

        def compute() -> F64:
            more = self._pixels(time) / np.maximum(self.pixels, LEAST_SHARE)
            return np.where(spread, np.clip(2 - more, 0.0, 1.0), 1.0)

        return self._once("certain", time, compute)

    def guard_at(self, colours: F64, time: float, asked: F64) -> F64:
        """Return how much colours are guarded at a time, 0..1: not at all at a picked one.

        `asked` is how much of its change each point asks for.
        """
        at = np.flatnonzero(self.moving[self.of])
        share = asked[at] / max(float(asked[at].max(initial=0)), NONE)
        far = 1 - share * self.near(colours, time, at, np.minimum(self.radii[at], NEAR))
        found: F64 = far.prod(axis=1)
        return found

    def _counts(self, guarded: F64, of: NDArray[np.int64], within: F64) -> F64:
        """Return how much each point counts beside the others, 0..1: by the pixels of its pick.

        Else a pick of few pixels could move what many are mixed from, at the price of a large one.
        """
        counts = np.ones(len(of))
        if self.clip.frames:
            for number in np.unique(of):
                pixels = float(guarded[:, 3] @ within[:, of == number].max(axis=1))
                counts[of == number] = max(pixels, LEAST_SHARE)
        counts /= counts.max()
        return counts

    def centres(self, time: float) -> F64:
        """Return where each point is at a time, (n, 3)."""

        def compute() -> F64:
            found = np.array([pick.colour_at(time) for pick in self.picks]).reshape(-1, 3)
            return np.asarray(found[self.of] + self.offsets, np.float64)

        return self._once("centres", time, compute)

    def _times(self) -> list[float]:
        clip = self.clip
        frames = (clip.last - clip.first) // clip.step
        step = clip.step * max(STEP, -(-frames // MOST_TIMES))
        times = {*range(clip.first, clip.last, step), clip.last}
        times |= set(clip.polytope.vertices[:, 3].tolist())
        for pick in self.picks:
            times |= {pick.frame, *(key.frame for key in pick.path), *pick.knots(clip.step)}
        borders = set(self.borders)
        return sorted(
            float(t)
            for t in times
            if clip.first <= t <= clip.last
            and (t in borders or any(p.strength_at(t, clip.step) > 0 for p in self.picks))
        )

    def solved(self) -> list[_Solved]:
        """Solve all times.

        Picks that ask for something at the same times are solved together, as if there were no
        others: so a pick has no effect beyond its begin and end. In the ramps of a pick the
        solution goes from the one without it to the one with it.
        """
        parts = {time: self._parts(time) for time in self.times}
        found = {
            picks: self._whole(picks) for picks in {key for part in parts.values() for key in part}
        }
        mixed = []
        for time, part in parts.items():
            moves: dict[tuple[str, int], F64] = {}
            bumps: dict[int, F64] = {}
            for picks, weight in part.items():
                one = self._at(found[picks], time)
                for place, by in one.moves.items():
                    moves[place] = moves.get(place, np.zeros(3)) + weight * by
                for point, by in one.bumps.items():
                    bumps[point] = bumps.get(point, np.zeros(3)) + weight * by
            mixed.append(self._with_holds(_Solved(time, moves, bumps)))
        return mixed

    def _parts(self, time: float) -> dict[frozenset[int], float]:
        """Return sets of picks, each within the next, and how much of each solution is asked for.

        What the picks of such sets get in sum is what each asks for at this time.
        """
        asked = {
            number: strength
            for number, pick in enumerate(self.picks)
            if self.moving[number] and (strength := pick.strength_at(time, self.clip.step)) > 0
        }
        order = sorted(asked, key=lambda number: -asked[number])
        steps = [*(asked[number] for number in order), 0.0]
        return {
            frozenset(order[:count]): more - less
            for count, (more, less) in enumerate(itertools.pairwise(steps), start=1)
            if more > less
        }

    def _whole(self, picks: frozenset[int]) -> list[_Solved]:
        """Solve some picks alone, with their whole changes, at the times when all ask for some."""
        alone = self
        if len(picks) < self.moving.sum():
            alone = Problem(self.clip, [self.picks[number] for number in sorted(picks)])
        own = np.flatnonzero(alone.moving[alone.of])
        points = np.flatnonzero(np.isin(self.of, sorted(picks)) & self.moving[self.of])
        number = dict(zip(own.tolist(), points.tolist(), strict=True))
        asked = [
            time
            for time in alone.times
            if all(self.picks[i].strength_at(time, self.clip.step) > 0 for i in picks)
        ]
        return [
            replace(one, bumps={number[at]: size for at, size in one.bumps.items()})
            for one in alone.met(asked or alone.times)
        ]

    def _at(self, solved: Sequence[_Solved], time: float) -> _Solved:
        """Return a solution at a time, as the core interpolates between solved times."""
        times = [one.time for one in solved]
        at = int(np.searchsorted(times, time))
        before, after = solved[max(at - 1, 0)], solved[min(at, len(solved) - 1)]
        if after.time == time:
            return after
        part = float(np.interp(time, [before.time, after.time], [0, 1]))
        none, moves = np.zeros(3), {}
        for edge in _core.slice_at(self.clip.polytope, time).edges.tolist():
            start, end = self.clip.polytope.edges[edge].tolist()
            places = ("e", edge), ("v", start), ("v", end)
            one, other = (
                next((by.moves[place] for place in places if place in by.moves), none)
                for by in (before, after)
            )
            moves["e", edge] = (1 - part) * one + part * other
        bumps = {
            point: (1 - part) * before.bumps.get(point, none) + part * after.bumps.get(point, none)
            for point in {*before.bumps, *after.bumps}
        }
        return _Solved(time, moves, bumps)

    def asked(self, time: float) -> F64:
        """Return how much of its change each point asks for, 0..1."""
        return self.strengths(time) * self.certain(time)

    def met(self, times: Sequence[float]) -> list[_Solved]:
        """Solve some times together, without holds, as if all picks asked for their whole changes.

        Bumps meet what is left at the picks.
        """
        terms = [term for term in map(self._terms, times) if term]
        links = [self._links(one, other) for one, other in itertools.pairwise(terms)]
        solved = {time: _Solved(time, {}, {}) for time in times}
        for term, found in zip(terms, _least_squares(terms, links), strict=True):
            of, count = term.of, len(term.of.free)
            left = self.certain(of.time)[of.picked, None] * (term.wanted - term.rows @ found)
            weights = np.where(self.offsets[of.picked].any(axis=1), SPREAD, 1.0)
            sizes = found[count:] + _interpolated(term.rows[:, count:], left, weights)
            sizes *= term.scale * of.local[:, None]
            by = term.scale * found[:count] * of.free[:, None]
            moves = dict(zip(dict.fromkeys(of.places), by, strict=True))
            bumps = dict(zip(of.picked.tolist(), sizes, strict=True))
            solved[of.time] = _Solved(of.time, moves, bumps)
        return [*solved.values()]

    def _with_holds(self, one: _Solved) -> _Solved:
        """Return the solution at a time with its holds."""
        asked = self.asked(one.time)
        held = np.flatnonzero((asked > 0) & ~self.moving[self.of])
        centres = self.centres(one.time)[held]
        own = np.array([self.picks[i].radius or LARGEST for i in self.of[held]])
        radii, keep = self.hold_sizes(
            centres, alongs(centres, self.shades[held]), own, one.time, asked[held]
        )
        holds = dict(zip(held.tolist(), np.column_stack([radii, keep]), strict=True))
        return replace(one, bumps=one.bumps | holds)

    def hold_sizes(
        self, centres: F64, along: F64, own: F64, time: float, asked: F64 | float = 1.0
    ) -> tuple[F64, F64]:
        """Return the radii of holds at a time, and how much they keep.

        They end at the nearest pick, `own` away at most.
        """
        every = self.asked(time)
        picked = np.flatnonzero((every > 0) & self.moving[self.of])
        away = np.sqrt(squares(self.centres(time)[picked], centres, along)).T
        most = (away / every[picked]).min(axis=1, initial=np.inf)
        radii = np.maximum(np.minimum(own, most), np.minimum(own, LEAST))
        return radii, asked * np.minimum(1.0, most / LEAST)

    def _terms(self, time: float) -> _Terms | None:
        """Return the problem at a time; none where nothing is asked for."""
        clip = self.clip
        certain = self.certain(time)
        picked = np.flatnonzero((certain > 0) & self.moving[self.of])
        if not len(picked):
            return None
        cut = _core.slice_at(clip.polytope, time)
        edited = _core.edited_colours(clip.polytope, clip.core.edits, cut) - cut.rgb
        centres, points = self.centres(time)[picked], self.of[picked]
        weights = _core.palette_weights(centres, cut.rgb, cut.faces)[0]
        changes = np.array([pick.change_at(time) for pick in self.picks])[points]
        wanted = changes - weights @ edited
        scale = float(np.linalg.norm(wanted, axis=1).max())
        if scale < NONE:
            return None
        local = np.array([not self.picks[i].global_only for i in points])
        of = _Unknowns(time, cut, *self._places(cut, time), picked, local)
        guarded = clip.colours_at(time)
        guard_rows, within = self._rows(guarded[:, :3], of)
        far = self.guard_at(guarded[:, :3], time, certain)
        guard = _noticed(guarded)
        counts = self._counts(guarded, points, within)
        if clip.frames:
            # A pick of few pixels moves no palette colour that many pixels are mixed from.
            near = self.near(guarded[:, :3], time, picked, NEAR)
            pixels = float(guarded[:, 3] @ near.max(axis=1))
            guard *= GUARD / max(pixels, LEAST_SHARE) * max(1.0, scale / LARGE_CHANGE) ** 2
        return _Terms(
            of,
            scale,
            self._rows(centres, of)[0],
            certain[picked] * counts,
            wanted / scale,
            guarded,
            guard_rows,
            far * guard,
            far,
            _gathered(_slopes(cut.rgb, cut.faces), of.places) * of.free,
            BUMP * counts,
        )

    def _rows(self, colours: F64, of: _Unknowns) -> tuple[F64, F64]:
        """Return what each unknown does to colours, and how near they are to the picked points."""
        weights = _core.palette_weights(colours, of.cut.rgb, of.cut.faces)[0]
        near = self.near(colours, of.time, of.picked, self.radii[of.picked])
        return np.hstack([_gathered(weights, of.places) * of.free, near * of.local]), near

    def _links(self, one: _Terms, other: _Terms) -> tuple[F64, F64]:
        """Return rows whose difference is how the changes of the clip's colours change in time.

        None for colours of which more or less is asked, beside the others.
        """
        colours, shares = other.guarded[:, :3], other.guarded[:, 3]
        steps = max((other.of.time - one.of.time) / self.clip.step, 1.0)
        weights = STEADY / steps * shares / shares.sum()
        asked = self.certain(one.of.time)
        if (asked != self.certain(other.of.time)).any():
            before = self.guard_at(colours, other.of.time, asked)
            weights *= np.abs(before - other.far) < 1 - OTHER
        root = np.sqrt(weights)[:, None]
        return root * self._rows(colours, one.of)[0], root * other.guard_rows

    def _places(self, cut: _core.Slice, time: float) -> tuple[list[tuple[str, int]], F64]:
        """Return the place of each palette colour, and how free each distinct place is, 0..1.

        Towards a locked handle its edge is less and less free.
        """
        ids = self.clip.polytope.edge_ids
        places: list[tuple[str, int]] = []
        free: dict[tuple[str, int], float] = {}
        for edge, end in zip(cut.edges.tolist(), cut.ends[:, 0].tolist(), strict=True):
            place = ("v", end) if edge < 0 else ("e", edge)
            places.append(place)
            if edge < 0:
                free[place] = self.clip.free_vertices[end]
            else:
                free[place] = float(np.interp(time, *self.clip.handles[ids[edge]]))
        return places, np.array(list(free.values()))

    def hold_at(self, rgb: F64, time: float) -> str:
        """Return the id of the hold that is nearest to a colour."""
        held = np.flatnonzero(~self.moving[self.of])
        away = np.linalg.norm(self.centres(time)[held] - rgb, axis=1)
        return self.picks[int(self.of[held[away.argmin()]])].id

    def solution(self, solved: Sequence[_Solved]) -> Fields:
        """Return the sidecar's member: few keys, rounded."""
        polytope = self.clip.polytope
        borders = set(self.borders)
        at_vertex: dict[int, F64] = {}
        on_edge: dict[int, list[tuple[float, F64]]] = {}
        for one in solved:
            for (kind, index), by in one.moves.items():
                if kind == "v":
                    at_vertex[index] = by
                else:
                    on_edge.setdefault(index, []).append((one.time, by))
        vertices = [
            {"vertex": polytope.vertex_ids[index], "by": _rounded(by)}
            for index, by in sorted(at_vertex.items())
            if _rounded(by) != [0.0] * 3
        ]
        keys = []
        for index, (start, end) in enumerate(polytope.edges.tolist()):
            frames = [float(polytope.vertices[end_, 3]) for end_ in (start, end)]
            inside = dict(on_edge.get(index, ()))
            zeros = {t: np.zeros(3) for t in borders - inside.keys() if frames[0] < t < frames[1]}
            ends = {
                frame: at_vertex.get(vertex, np.zeros(3))
                for frame, vertex in zip(frames, (start, end), strict=True)
            }
            values = {**inside, **zeros, **ends}
            times = sorted(values)
            kept = _kept(times, np.array([values[t] for t in times]), borders)
            keys += [
                {"edge": polytope.edge_ids[index], "frame": _whole(t), "by": _rounded(values[t])}
                for t in kept
                if frames[0] < t < frames[1]
            ]
        bumps, holds = self._bumps(solved, borders)
        found = {"vertices": vertices, "keys": keys, "bumps": bumps}
        return found | ({"holds": holds} if holds else {})

    def _bumps(
        self, solved: Sequence[_Solved], borders: set[float]
    ) -> tuple[list[Fields], list[Fields]]:
        bumps, holds = [], []
        for number, pick in enumerate(self.picks[i] for i in self.of):
            begin, _, _, end = pick.knots(self.clip.step)
            size = 3 if self.moving[self.of[number]] else 2
            keys: dict[float, F64] = {}
            for one in solved:
                if begin <= one.time <= end:
                    centre = self.centres(one.time)[number]
                    # A hold that keeps nothing needs a radius all the same.
                    by = one.bumps.get(number, np.zeros(3) if size == 3 else np.array([LEAST, 0]))
                    keys[one.time] = np.concatenate([centre, by])
            values = np.array(list(keys.values())).reshape(-1, 3 + size)
            if not (np.linalg.norm(values[:, -size:], axis=1) >= NONE).any():
                continue
            times = list(keys)
            steps = []
            for t in _kept(times, values, borders):
                row = _rounded(keys[t])
                what = {"by": row[3:]} if size == 3 else {"radius": row[3], "keep": row[4]}
                steps.append({"frame": _whole(t), "rgb": row[:3], **what})
            shade = round(float(self.shades[number]), DIGITS)
            if size == 3:
                radius = round(float(self.radii[number]), DIGITS)
                bumps.append({"radius": radius, "shade": shade, "keys": steps})
            else:
                holds.append({"shade": shade, "keys": steps})
        return bumps, holds


def _undone(pick: Pick, offset: Colour, radius: float, shade: float) -> float:
    """Return how much of a pick's change its bump leaves undone at an offset from its centre."""
    change = 1.0 if pick.to is None else float(np.linalg.norm(pick.change_at(pick.frame)))
    centre = np.array([pick.rgb])
    done = bump_values(centre + offset, centre, radius, alongs(centre, shade))
    return change * (1 - float(done[0, 0]))


def _noticed(colours: F64) -> F64:
    """Return how much a change of (m, 4) colours with shares of the picture is noticed.

    In the square root of its share: a small sky too is seen as a whole. Tints of greys are noticed
    most, as in CIE94.
    """
    found = np.sqrt(np.maximum(colours[:, 3], LEAST_SHARE))
    found /= 1 + CHROMA * np.ptp(colours[:, :3], axis=1)
    noticed: F64 = found / found.sum()
    return noticed


def _slopes(palette: F64, faces: NDArray[np.int32]) -> F64:
    """Return the rows (edges, palette colours) of how steeply displacements change along edges."""
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges = np.column_stack(np.divmod(np.unique(ends @ [len(palette), 1]), len(palette)))
    lengths = np.linalg.norm(palette[edges[:, 0]] - palette[edges[:, 1]], axis=1)
    rows = np.zeros((len(edges), len(palette)))
    each = np.arange(len(edges))
    rows[each, edges[:, 0]] = 1 / np.maximum(lengths, NONE)
    rows[each, edges[:, 1]] = -1 / np.maximum(lengths, NONE)
    return rows


def _gathered(weights: F64, places: Sequence[tuple[str, int]]) -> F64:
    """Return weights (n, palette colours) as weights of the distinct places, in order."""
    order = {place: at for at, place in enumerate(dict.fromkeys(places))}
    if len(order) == len(places):
        return weights
    gathered = np.zeros((len(weights), len(order)))
    for column, place in enumerate(places):
        gathered[:, order[place]] += weights[:, column]
    return gathered


def _least_squares(terms: Sequence[_Terms], links: Sequence[tuple[F64, F64]]) -> list[F64]:
    """Return the unknowns at all times: displacements, then sizes of bumps, (n, 3) each."""
    counts = [len(term.of.free) for term in terms]
    fixed, targets, costs, weights = [], [], [], []
    for term, count in zip(terms, counts, strict=True):
        weighted = term.rows.T * term.weights
        fixed.append(weighted @ term.rows)
        fixed[-1][:count, :count] += SLOPE * term.slopes.T @ term.slopes
        targets.append(weighted @ term.wanted)
        costs.append(np.concatenate([np.full(count, RIDGE), term.bump_costs]))
        weights.append(term.guard)
    for at, (one, other) in enumerate(links):
        fixed[at] += one.T @ one
        fixed[at + 1] += other.T @ other
    between = [-one.T @ other for one, other in links]
    shares = list(weights)
    for _ in range(ROUNDS):
        normals = [
            fixed[at] + (term.guard_rows.T * weights[at]) @ term.guard_rows + np.diag(costs[at])
            for at, term in enumerate(terms)
        ]
        found = _solved_chain(normals, between, targets)
        for at, (term, count) in enumerate(zip(terms, counts, strict=True)):
            costs[at][:count] = RIDGE / (np.linalg.norm(found[at][:count], axis=1) + SMALL_MOVE)
            changed = np.linalg.norm(term.guard_rows @ found[at], axis=1)
            over = term.far * OVERSHOOT * np.minimum(np.maximum(changed - LARGE, 0), 1)
            shares[at] = np.maximum(shares[at], over)
            weight = shares[at] * (SMALL_CHANGE / (changed + SMALL_CHANGE)) ** EXPONENT
            weights[at] = weight * float(shares[at].sum()) / max(float(weight.sum()), 1e-9)
    few = [np.linalg.norm(one, axis=1) > FEW for one in found]
    for one, count in zip(few, counts, strict=True):
        one[count:] = True
    again = _solved_chain(
        [normal[np.ix_(one, one)] for normal, one in zip(normals, few, strict=True)],
        [
            both[np.ix_(one, other)]
            for both, (one, other) in zip(between, itertools.pairwise(few), strict=True)
        ],
        [target[one] for target, one in zip(targets, few, strict=True)],
    )
    for at, one in enumerate(few):
        found[at][:] = 0.0
        found[at][one] = again[at]
    return found


def _solved_chain(
    normals: Sequence[F64], between: Sequence[F64], targets: Sequence[F64]
) -> list[F64]:
    """Solve a symmetric system of blocks, each of which meets its neighbours (block Thomas)."""
    found: list[F64] = []
    ahead: list[F64] = []
    for at, (block, target) in enumerate(zip(normals, targets, strict=True)):
        normal: NDArray[np.floating[Any]] = block
        if at:
            normal = normal - between[at - 1].T @ ahead[-1]
            target = target - between[at - 1].T @ found[-1]
        both = [target, between[at]] if at < len(between) else [target]
        solved: F64 = np.linalg.solve(normal, np.hstack(both))
        found.append(solved[:, :3])
        ahead.append(solved[:, 3:])
    for at in range(len(found) - 2, -1, -1):
        found[at] = found[at] - ahead[at] @ found[at + 1]
    return found


def _kept(times: Sequence[float], values: F64, borders: set[float]) -> list[float]:
    """Return the times of the keys that are needed, all borders among them; none for zeros."""
    fixed = [i for i, time in enumerate(times) if time in borders]
    return [times[i] for i in needed(times, values, fixed, STRAIGHT)] if values.any() else []


def _interpolated(bumps: F64, left: F64, weights: F64) -> F64:
    """Return sizes of bumps that meet what is left at their centres, bounded (Tikhonov)."""
    weighted = bumps.T * weights
    normal: NDArray[np.floating[Any]] = weighted @ bumps + TIKHONOV**2 * np.eye(len(bumps))
    sizes: F64 = np.linalg.solve(normal, weighted @ left)
    return sizes


def _measured(fields: Mapping[str, Any], solution: Fields, problem: Problem) -> dict[str, Fields]:
    """Return the residuals and the palette's share of each pick, from the stored solution."""
    core = parsed(fields, solution)
    clip, picks = problem.clip, problem.picks
    between = [(a + b) / 2 for a, b in itertools.pairwise(problem.times)]
    times = {*problem.times, *(float(round(t)) for t in between), *(pick.frame for pick in picks)}
    found: list[dict[float, tuple[float, float]]] = [{} for _ in picks]
    for time in sorted(t for t in times if clip.first <= t <= clip.last):
        full = [i for i, pick in enumerate(picks) if pick.strength_at(time, clip.step) == 1]
        if not full:
            continue
        cut = _core.slice_at(core.polytope, time)
        colours = np.array([picks[i].colour_at(time) for i in full])
        wanted = np.array([picks[i].change_at(time) for i in full])
        weights = _core.palette_weights(colours, cut.rgb, cut.faces)[0]
        user = _core.edited_colours(core.polytope, clip.core.edits, cut)
        both = _core.edited_colours(core.polytope, core.edits, cut)
        total = bumped(colours, weights @ (both - cut.rgb), core.bumps_at(time))
        off = np.linalg.norm(total - wanted, axis=1)
        asked = wanted - weights @ (user - cut.rgb)
        largest = max(float(np.linalg.norm(asked, axis=1).max()), NONE)
        for row, i in enumerate(full):
            share = _share(weights[row] @ (both - user), asked[row], largest)
            found[i][time] = float(off[row]), share
    return {pick.id: _measures(pick, at) for pick, at in zip(picks, found, strict=True) if at}


def _measures(pick: Pick, found: Mapping[float, tuple[float, float]]) -> Fields:
    """Return a pick's measured members from its residual and the palette's share by time."""
    own = min(found, key=lambda time: abs(time - pick.frame))
    worst = max(found, key=lambda time: found[time][0])
    return {
        "residual": round(found[own][0], DIGITS),
        "worst": round(found[worst][0], DIGITS),
        "worst_frame": _whole(worst),
        "global": round(found[own][1], 4),
    }


def _share(done: F64, asked: F64, largest: float) -> float:
    """Return the palette's share of a change; of a hold, how well the palette keeps it."""
    length = float(asked @ asked)
    if length < NONE**2:
        return max(0.0, 1 - float(np.linalg.norm(done)) / largest)
    return min(1.0, max(0.0, float(done @ asked) / length))


def parsed(fields: Mapping[str, Any], solution: Fields) -> _core.Sidecar:
    """Return the core's view of the palette and of the user's edits, with a solution."""
    without = {n: v for n, v in fields.items() if n not in ("colours", "versions", "history")}
    edits = {n: v for n, v in fields["edits"].items() if n not in ("picks", "locks", "solution")}
    document = {**without, "edits": edits | ({"solution": solution} if solution else {})}
    # Not `sidecar.validate`, which first puts all members into the file's order.
    return _core.parse_sidecar(json.dumps(document).encode(), "<document>")


def _rounded(values: F64) -> list[float]:
    return [float(value) + 0.0 for value in np.round(values, DIGITS)]


def _whole(frame: float) -> float:
    return int(frame) if float(frame).is_integer() else frame
