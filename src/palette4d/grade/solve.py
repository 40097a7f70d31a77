"""Solving picks and holds: displacements of the palette, and bumps for the local remainder.

Input: the members of a sidecar. Output: its member ``edits.solution``. Pure NumPy, and the same
numbers every time.

A palette colour's displacement moves a colour c by its mean value weight w(c) (eqs. 6, 7). So each
frame is a linear least-squares problem for the displacements d of its palette colours and the
sizes a of one bump around each pick and hold. At a frame, with all colours in code values:

- a pick at colour p wants ``w(p) d + phi(p) a = change - U(p)``, where U is what the user's own
  handles do there; a hold wants the same with no change;
- the guard: each colour of the clip wants to stay, by its share of the pixels, unless it is near
  a picked colour. It counts absolute, not squared changes (reweighted): the rest of the picture
  stays, instead of changing a little everywhere;
- few palette colours move (reweighted); bumps are small.

What is left at the picks is then met by the bumps alone. How near "near" is grows with the change:
the change must fade out over a distance of about its own length, or the grade would fold colours
over and posterise.

Frames are solved one by one, at the clip's vertices, at the picks' own frames and every few frames
between; the core interpolates linearly. So a pick that ends at a frame has no effect at all beyond.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.grade import sidecar
from palette4d.grade.edits import Colour, as_colour
from palette4d.grade.picks import MOST_PICKS, Pick, all_picks
from palette4d.grade.sidecar import Fields

F64 = NDArray[np.float64]

# The constants below hold for all clips. docs/lab/picks.md shows what they were chosen by.

# A pick or a hold weighs 1; the weights of the guard sum to GUARD, or less if less than the share
# LEAST_GUARDED of the picture is guarded at all.
GUARD, LEAST_GUARDED = 3.0, 0.2
# A colour of few pixels counts in the guard as if it had this share of them: a lamp.
LEAST_SHARE = 5e-4
# A guarded colour that would change by more than LARGE times the largest change that is asked for
# counts as if it had up to this share of the picture: few pixels must not overshoot either.
OVERSHOOT, LARGE = 0.03, 1.1
# The guard is off within NEAR_0 + NEAR_1 |change| of a pick, and full at NEAR_END times that.
NEAR_0, NEAR_1, NEAR_END = 0.03, 0.3, 5.0
# The radius of a pick's bump is RADIUS_0 + RADIUS_1 |change|; that of a hold's is HOLD_RADIUS.
RADIUS_0, RADIUS_1, HOLD_RADIUS = 0.08, 0.8, 0.16
# Cost of a slope: of a displacement that changes along an edge of the palette by as much as the
# colour. Near greys, where colours are close together, the palette would tear them apart.
SLOPE = 2.5e-4
# Costs of a palette colour's displacement and of a bump, beside the weights above.
RIDGE, BUMP = 1e-4, 0.3
# Reweighting: rounds, and the sizes, as shares of the largest change, below which a palette
# colour's displacement and a guarded colour's change no longer cost more per size. A changed
# colour's weight falls with the power ROBUST; a displacement below FEW of the
# largest change is none.
ROUNDS, SMALL_MOVE, SMALL_CHANGE, ROBUST, FEW = 5, 0.03, 0.017, 0.6, 0.1
# Picks that nearly coincide and ask for different things: the bumps' sizes stay bounded by
# 1 / (2 TIKHONOV) times the difference. A lone pick's residual is TIKHONOV^2 of its remainder.
TIKHONOV = 0.1

# Frames are solved at least every STEP frames; in long clips at MOST_TIMES frames.
STEP, MOST_TIMES = 4, 40
# Keys that a straight line between their neighbours meets within this are left out.
STRAIGHT = 4e-4
# A colour that is guarded by at least this is none of those that the user wants to change.
OTHER = 0.5
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
        For each enabled pick, by its id: ``residual`` and ``global`` (`picks.Pick`).
    """
    enabled = [pick for pick in all_picks(fields["edits"]) if pick.enabled]
    clip = _ClipAtTimes(fields)
    problem = _Problem(clip, enabled[:MOST_PICKS])
    solved = [problem.at(time) for time in problem.times]
    solution = problem.solution(solved)
    return solution, _measured(fields, solution, enabled, problem.times, clip.core)


def side_effect(fields: Mapping[str, Any], frame: float, least: float) -> tuple[float, Colour]:
    """Return what the picks' solution does to other colours of the clip at a frame.

    Returns
    -------
    share : float
        Share, 0..1, of the pixels that are not near a picked colour and change by more than
        `least` in a channel.
    most : 3 floats
        The colour for which this matters most; its share of the pixels counts.
    """
    clip = _ClipAtTimes(fields)
    both = _parsed(fields, fields["edits"].get("solution", {}))
    cut = _core.slice_at(clip.polytope, frame)
    solved = _core.edited_colours(clip.polytope, both.edits, cut)
    user = _core.edited_colours(clip.polytope, clip.core.edits, cut)
    guarded = clip.guarded(cut.rgb, cut.faces, frame)
    rgb, shares = guarded[:, :3], guarded[:, 3]
    bumps = both.bumps_at(frame)
    changes = _core.palette_weights(rgb, cut.rgb, cut.faces)[0] @ (solved - user)
    changes += _bump(rgb, bumps[:, :3], bumps[:, 3]) @ bumps[:, 4:]
    size = np.abs(changes).max(axis=1)
    picks = [p for p in all_picks(fields["edits"]) if p.enabled and p.to is not None]
    centres = np.array([pick.colour_at(frame) for pick in picks]).reshape(-1, 3)
    reach = np.array([np.linalg.norm(pick.change_at(frame)) for pick in picks])
    other = _far(rgb, centres, reach, np.ones(len(picks))) > OTHER
    share = float(shares[other & (size > least)].sum() / max(float(shares.sum()), 1e-9))
    worst = int(np.argmax(np.where(other, size * np.sqrt(shares), 0.0)))
    return share, as_colour(rgb[worst])


class _ClipAtTimes:
    """The palette, the user's own displacements and the clip's colours at a time."""

    def __init__(self, fields: Mapping[str, Any]) -> None:
        self.core = _parsed(fields, {})
        self.polytope = self.core.polytope
        found = fields["clip"]["frames"]
        self.first, self.last, self.step = found["first"], found["last"], found["step"]
        entries = fields.get("colours", ())
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

    def guarded(self, palette: F64, faces: NDArray[np.int32], time: float) -> F64:
        """Return (m, 4) colours and shares to guard."""
        if not self.frames:
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
class _Solved:
    """The solution at one time: displacements by place, and bumps by the number of the pick.

    A place is ("v", vertex index) or ("e", edge index).
    """

    time: float
    moves: dict[tuple[str, int], F64]
    bumps: dict[int, tuple[F64, F64]]


class _Problem:
    """The picks of a clip, solved at one time after the other."""

    def __init__(self, clip: _ClipAtTimes, picks: Sequence[Pick]) -> None:
        self.clip, self.picks = clip, picks
        self.radii = np.array([_radius(pick) for pick in picks])
        #: Frames where the effect of a pick begins or ends: nothing may pass them.
        self.borders = sorted(
            {
                float(knot)
                for pick in picks
                for knot in (pick.knots(clip.step)[0], pick.knots(clip.step)[3])
                if clip.first <= knot <= clip.last
            }
        )
        self.times = self._times()

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

    def at(self, time: float) -> _Solved:
        clip = self.clip
        strengths = np.array([pick.strength_at(time, clip.step) for pick in self.picks])
        active = np.flatnonzero(strengths > 0)
        if not len(active):
            return _Solved(time, {}, {})
        most = strengths[active].max()
        share = strengths[active] / most
        picks = [self.picks[i] for i in active.tolist()]
        radii = self.radii[active]
        reach = np.array([np.linalg.norm(pick.change_at(time)) for pick in picks])
        centres = np.array([pick.colour_at(time) for pick in picks])
        cut = _core.slice_at(clip.polytope, time)
        edited = _core.edited_colours(clip.polytope, clip.core.edits, cut)
        weights = _core.palette_weights(centres, cut.rgb, cut.faces)[0]
        wanted = np.array([pick.change_at(time) for pick in picks]) - weights @ (edited - cut.rgb)
        scale = float(np.linalg.norm(wanted, axis=1).max())
        if scale < NONE:
            return _Solved(time, {}, {})
        guarded = clip.guarded(cut.rgb, cut.faces, time)
        places, free = self._places(cut, time)
        local = np.array([not pick.global_only for pick in picks])
        bumps = _bump(centres, centres, radii) * local
        rows = np.hstack([_gathered(weights, places) * free, bumps])
        guard_rows = np.hstack(
            [
                _gathered(_core.palette_weights(guarded[:, :3], cut.rgb, cut.faces)[0], places)
                * free,
                _bump(guarded[:, :3], centres, radii) * local,
            ]
        )
        slopes = _gathered(_slopes(cut.rgb, cut.faces), places) * free
        moving = np.array([pick.to is not None for pick in picks])
        guard = np.maximum(guarded[:, 3], LEAST_SHARE)
        far = _far(guarded[:, :3], centres[moving], reach[moving], share[moving])
        unit = GUARD / max(float(guard @ far), LEAST_GUARDED * float(guard.sum()))
        count = len(free)
        found = _least_squares(
            rows, share, wanted, guard_rows, (unit * far * guard, unit * far), slopes, scale
        )
        moves = found[:count] * free[:, None]
        sizes = found[count:] * local[:, None]
        left = (wanted - _gathered(weights, places) @ moves - bumps @ sizes) * share[:, None]
        sizes += _interpolated(bumps, left)
        return _Solved(
            time,
            {place: most * move for place, move in zip(dict.fromkeys(places), moves, strict=True)},
            {int(i): (c, most * a) for i, c, a in zip(active, centres, sizes, strict=True)},
        )

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
            kept = _few(times, np.array([values[t] for t in times]), borders)
            keys += [
                {"edge": polytope.edge_ids[index], "frame": _whole(t), "by": _rounded(values[t])}
                for t in kept
                if frames[0] < t < frames[1]
            ]
        return {"vertices": vertices, "keys": keys, "bumps": self._bumps(solved, borders)}

    def _bumps(self, solved: Sequence[_Solved], borders: set[float]) -> list[Fields]:
        bumps = []
        for number, pick in enumerate(self.picks):
            begin, _, _, end = pick.knots(self.clip.step)
            keys: dict[float, F64] = {}
            for one in solved:
                if number in one.bumps:
                    keys[one.time] = np.concatenate(one.bumps[number])
                elif begin <= one.time <= end:
                    keys[one.time] = np.concatenate([pick.colour_at(one.time), np.zeros(3)])
            values = np.array(list(keys.values())).reshape(-1, 6)
            if not (np.linalg.norm(values[:, 3:], axis=1) >= NONE).any():
                continue
            times = list(keys)
            bumps.append(
                {
                    "radius": round(float(self.radii[number]), DIGITS),
                    "keys": [
                        {
                            "frame": _whole(t),
                            "rgb": _rounded(keys[t][:3]),
                            "by": _rounded(keys[t][3:]),
                        }
                        for t in _few(times, values, borders | {times[0], times[-1]})
                    ],
                }
            )
        return bumps


def _radius(pick: Pick) -> float:
    if pick.radius is not None:
        return pick.radius
    if pick.to is None:
        return HOLD_RADIUS
    return RADIUS_0 + RADIUS_1 * min(float(np.linalg.norm(pick.change_at(pick.frame))), 1.0)


def _bump(colours: F64, centres: F64, radii: F64) -> F64:
    """Return (n, m) values, 0..1, of m bumps at n colours, as the core computes them."""
    away = ((colours[:, None] - centres) ** 2).sum(axis=2) / radii**2
    values: F64 = np.maximum(0.0, 1.0 - away) ** 3
    return values


def _far(colours: F64, centres: F64, reach: F64, share: F64) -> F64:
    """Return how much each colour is guarded, 0..1: not at all near a pick, smoothly more away."""
    if not len(centres):
        return np.ones(len(colours))
    near = NEAR_0 + NEAR_1 * np.minimum(reach, 1.0)
    away = np.linalg.norm(colours[:, None] - centres, axis=2)
    ease = np.clip((away - near) / (near * (NEAR_END - 1)), 0.0, 1.0)
    far: F64 = (1 - share * (1 - ease**2 * (3 - 2 * ease))).min(axis=1)
    return far


def _slopes(palette: F64, faces: NDArray[np.int32]) -> F64:
    """Return the rows (edges, palette colours) of how steeply displacements change along edges."""
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
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


def _least_squares(
    rows: F64,
    pick: F64,
    wanted: F64,
    guard_rows: F64,
    guard: tuple[F64, F64],
    slopes: F64,
    scale: float,
) -> F64:
    """Return the displacements of the palette colours, then the sizes of the bumps, (n, 3).

    `guard` has each guarded colour's weight, and its weight if it were the whole picture.
    """
    moves = slopes.shape[1]
    picked = rows.T @ (pick[:, None] * rows)
    picked[:moves, :moves] += SLOPE * slopes.T @ slopes
    target = rows.T @ (pick[:, None] * wanted)
    weights, whole = guard
    cost = np.full(rows.shape[1], BUMP)
    cost[:moves] = RIDGE
    weight: F64 = weights
    normal: NDArray[np.floating[Any]] = picked
    found: NDArray[np.floating[Any]] = target
    for _ in range(ROUNDS):
        normal = picked + guard_rows.T @ (weight[:, None] * guard_rows) + np.diag(cost)
        found = np.linalg.solve(normal, target)
        cost[:moves] = RIDGE / (np.linalg.norm(found[:moves], axis=1) / scale + SMALL_MOVE)
        changed = np.linalg.norm(guard_rows @ found, axis=1) / scale
        weights = np.maximum(weights, whole * OVERSHOOT * np.clip(changed - LARGE, 0, 1))
        weight = weights * np.power(SMALL_CHANGE / (changed + SMALL_CHANGE), ROBUST)
        weight *= float(weights.sum()) / max(float(weight.sum()), 1e-9)
    few = np.linalg.norm(found, axis=1) > FEW * scale
    few[moves:] = True
    found[~few] = 0.0
    found[few] = np.linalg.solve(normal[np.ix_(few, few)], target[few])
    return found.astype(np.float64)


def _interpolated(bumps: F64, left: F64) -> F64:
    """Return sizes of bumps that meet what is left at their centres, bounded (Tikhonov)."""
    normal: NDArray[np.floating[Any]] = bumps.T @ bumps + TIKHONOV**2 * np.eye(len(bumps))
    sizes: F64 = np.linalg.solve(normal, bumps.T @ left)
    return sizes


def _few(times: Sequence[float], values: F64, kept: Iterable[float]) -> list[float]:
    """Return the times of the keys that are needed, with both ends (Douglas and Peucker)."""
    wanted = set(kept)
    fixed = [0, *(i for i in range(1, len(times) - 1) if times[i] in wanted), len(times) - 1]
    chosen = set(fixed)
    parts = list(itertools.pairwise(fixed))
    while parts:
        a, b = parts.pop()
        if b - a < 2:
            continue
        share = (np.array(times[a + 1 : b]) - times[a]) / (times[b] - times[a])
        straight = values[a] + share[:, None] * (values[b] - values[a])
        off = np.abs(values[a + 1 : b] - straight).max(axis=1)
        if off.max() > STRAIGHT:
            middle = a + 1 + int(off.argmax())
            chosen.add(middle)
            parts += [(a, middle), (middle, b)]
    found = sorted(chosen)
    if not np.any(values[found]):
        return []
    return [times[i] for i in found]


def _measured(
    fields: Mapping[str, Any],
    solution: Fields,
    picks: Sequence[Pick],
    times: Sequence[float],
    own: _core.Sidecar,
) -> dict[str, Fields]:
    """Return the residual and the palette's share of each pick, from the stored solution.

    `own` is the sidecar without a solution.
    """
    core = _parsed(fields, solution)
    step = fields["clip"]["frames"]["step"]
    first, last = core.polytope.first_frame, core.polytope.last_frame
    between = [(a + b) / 2 for a, b in itertools.pairwise(times)]
    grid = sorted({*times, *(round(t) for t in between)})
    residual = np.zeros(len(picks))
    share = np.ones(len(picks))
    for time in sorted({*grid, *(pick.frame for pick in picks)}):
        full = [i for i, pick in enumerate(picks) if pick.strength_at(time, step) == 1]
        full = [i for i in full if first <= time <= last]
        if not full:
            continue
        cut = _core.slice_at(core.polytope, time)
        colours = np.array([picks[i].colour_at(time) for i in full])
        wanted = np.array([picks[i].change_at(time) for i in full])
        weights = _core.palette_weights(colours, cut.rgb, cut.faces)[0]
        user = _core.edited_colours(core.polytope, own.edits, cut)
        both = _core.edited_colours(core.polytope, core.edits, cut)
        active = core.bumps_at(time)
        palette = weights @ (both - cut.rgb)
        total = palette + _bump(colours, active[:, :3], active[:, 3]) @ active[:, 4:]
        residual[full] = np.maximum(residual[full], np.linalg.norm(total - wanted, axis=1))
        asked = wanted - weights @ (user - cut.rgb)
        largest = max(float(np.linalg.norm(asked, axis=1).max()), NONE)
        for row, i in enumerate(full):
            if time == picks[i].frame or share[i] == 1:
                share[i] = _share(weights[row] @ (both - user), asked[row], largest)
    return {
        pick.id: {"residual": round(float(off), DIGITS), "global": round(float(part), 4)}
        for pick, off, part in zip(picks, residual, share, strict=True)
    }


def _share(done: F64, asked: F64, largest: float) -> float:
    """Return the palette's share of a change; of a hold, how well the palette keeps it."""
    length = float(asked @ asked)
    if length < NONE**2:
        return max(0.0, 1 - float(np.linalg.norm(done)) / largest)
    return min(1.0, max(0.0, float(done @ asked) / length))


def _parsed(fields: Mapping[str, Any], solution: Fields) -> _core.Sidecar:
    """Return the core's view of the palette and of the user's edits, with a solution."""
    without = {n: v for n, v in fields.items() if n not in ("colours", "versions", "history")}
    edits = {n: v for n, v in fields["edits"].items() if n not in ("picks", "locks", "solution")}
    return sidecar.validate(
        {**without, "edits": edits | ({"solution": solution} if solution else {})}
    )


def _rounded(values: F64) -> list[float]:
    return [float(value) + 0.0 for value in np.round(values, DIGITS)]


def _whole(frame: float) -> float:
    return int(frame) if float(frame).is_integer() else frame
