"""What solved picks do to a clip: beside themselves, and to the colours near them.

Input: the members of a sidecar, with a solution. The clip is not read: its stored colours stand
for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.grade.bumps import alongs, bumped
from palette4d.grade.edits import Colour, as_colour
from palette4d.grade.picks import ALIKE, MOST_PICKS, all_picks
from palette4d.grade.solve import (
    LARGEST,
    LEAST_SHARE,
    NONE,
    OTHER,
    SHADE,
    ClipAtTimes,
    Problem,
    parsed,
)

F64 = NDArray[np.float64]
B = NDArray[np.bool_]


# A colour whose channels differ by less is a grey. Eyes see tints of greys first (CIE94): they
# count from half of what counts elsewhere, where a pick has less than half of its effect.
GREY = 0.1
# So many holds are proposed at most, none that takes more of what the picked thing gets, and none
# that does not lower the number of others by this share of the picture.
MOST_HOLDS, TAKEN, GAIN = 3, 0.1, 0.005


@dataclass(frozen=True)
class SideEffect:
    """What the picks do to the pixels of a clip, at the frame where they do most beside themselves.

    Attributes
    ----------
    frame : float
    share : float
        Share, 0..1, of the frame's pixels that change by more than asked for in a channel, or are
        greys that get a tint of more than half of that.
    others : float
        The same for pixels that are not near a picked colour or a shade of it.
    most : 3 floats
        The other colour for which this matters most; its share of the pixels counts.
    holds : tuple of 3 floats
        Colours to hold, tried: each leaves the fewest others. A colour is left out if its hold
        would take more than `TAKEN` of what the colours near a pick, or of its hue, get, or would
        help by less than `GAIN`.
    left : float
        What of `others` is left with these holds.
    """

    frame: float
    share: float
    others: float
    most: Colour
    holds: tuple[Colour, ...] = ()
    left: float = 0.0


def side_effect(fields: Mapping[str, Any], least: float) -> SideEffect:
    """Return what the picks' solution does; `least` is the change that counts."""
    clip, both, problem = _parts(fields)
    found, at = [SideEffect(float(clip.first), 0.0, 0.0, (0.0, 0.0, 0.0))], []
    for time in problem.times:
        now = _Colours.at(clip, both, problem, clip.colours_at(time), time)
        counted, other, size = now.counted(now.bumps, least)
        shares = now.shares
        worst = int(np.argmax(np.where(other, size * np.sqrt(shares), 0.0)))
        found.append(
            SideEffect(
                time,
                float(shares[counted].sum()),
                float(shares[counted & other].sum()),
                as_colour(now.rgb[worst]),
            )
        )
        at.append(now)
    most = max(range(len(found)), key=lambda i: (found[i].others, found[i].share))
    if found[most].others == 0:
        return found[most]
    time = found[most].frame
    near = [*_near_picks(clip, both, problem), *_near_picks(clip, both, problem, [time])]
    return _with_holds(found[most], at[most - 1], near, problem, least)


def _with_holds(
    effect: SideEffect, at: _Colours, picks: Sequence[_NearPick], problem: Problem, least: float
) -> SideEffect:
    """Return the effect with holds: each time the one that leaves the fewest others."""
    holds: list[Colour] = []
    bumps, left = at.bumps, effect.others
    while len(holds) < MOST_HOLDS:
        counted, other, _ = at.counted(bumps, least)
        tried = []
        for number in np.flatnonzero(counted & other).tolist():
            trial = np.vstack([bumps, _hold_row(problem, at.rgb[number], at.time)])
            counted, other, _ = at.counted(trial, least)
            tried.append((float(at.shares[counted & other].sum()), number, trial))
        tried = sorted((one for one in tried if one[0] <= left - GAIN), key=lambda one: one[:2])
        for rest, number, trial in tried:
            rgb = at.rgb[number]
            if all(one.taken(_hold_row(problem, rgb, one.time)) <= TAKEN for one in picks):
                holds.append(as_colour(rgb))
                bumps, left = trial, rest
                break
        else:
            break
    return replace(effect, holds=tuple(holds), left=left)


def _hold_row(problem: Problem, rgb: F64, time: float) -> F64:
    """Return the row of bumps of a hold that is not there yet, (11,)."""
    centre = rgb[None]
    along = alongs(centre, SHADE)
    radii, keep = problem.hold_sizes(centre, along, np.array([LARGEST]), time)
    return np.concatenate([rgb, radii, np.zeros(3), keep, along[0]])


@dataclass(frozen=True)
class _Colours:
    """The clip's colours at a time, and what moves them: the palette `moved`, and `bumps`.

    `guarded` is how much each wants to stay.
    """

    time: float
    rgb: F64
    shares: F64
    moved: F64
    bumps: F64
    guarded: F64

    @classmethod
    def at(
        cls, clip: ClipAtTimes, both: _core.Sidecar, problem: Problem, rgbw: F64, time: float
    ) -> _Colours:
        cut = _core.slice_at(clip.polytope, time)
        solved = _core.edited_colours(clip.polytope, both.edits, cut)
        user = _core.edited_colours(clip.polytope, clip.core.edits, cut)
        rgb, shares = rgbw[:, :3], rgbw[:, 3] / max(float(rgbw[:, 3].sum()), 1e-9)
        moved = _core.palette_weights(rgb, cut.rgb, cut.faces)[0] @ (solved - user)
        guarded = problem.guard_at(rgb, time, problem.asked(time))
        return cls(time, rgb, shares, moved, both.bumps_at(time), guarded)

    def counted(self, bumps: F64, least: float) -> tuple[B, B, F64]:
        """Return which colours change by what counts, which are not picked, and their changes."""
        change = bumped(self.rgb, self.moved, bumps)
        size = np.abs(change).max(axis=1)
        tint = np.abs(change - change.mean(axis=1, keepdims=True)).max(axis=1)
        grey = (np.ptp(self.rgb, axis=1) < GREY) & (self.guarded > 0.5)
        tinted = grey & (tint > least / 2)
        return (size > least) | tinted, (self.guarded > OTHER) | tinted, size


@dataclass(frozen=True)
class Around:
    """What the clip's colours near a pick get of its change.

    Attributes
    ----------
    frame : float
        The pick's own frame, or the nearest one at which all of its change is asked for.
    share : float
        The mean share of the change, over the frame's pixels near the picked colour.
    shades : float or None
        The same over those of its hue, however dark or light. None for a grey.
    taken : dict of float
        By the id of each hold: the share, 0..1, that it takes of what they, or the darker and
        lighter colours of their hue, would get without it.
    """

    frame: float
    share: float
    shades: float | None
    taken: dict[str, float]


def surroundings(fields: Mapping[str, Any]) -> dict[str, Around]:
    """Return what the colours near each enabled pick get of its change, by the pick's id."""
    found = {}
    clip, core, problem = _parts(fields)
    for near in _near_picks(clip, core, problem):
        taken: dict[str, float] = {}
        for hold in near.held:
            id_ = problem.hold_at(hold[:3], near.time)
            taken[id_] = max(taken.get(id_, 0.0), near.taken(hold))
        done = near.done(np.vstack([near.free, near.held]))
        shades = float(near.hue @ done) if near.hue.any() else None
        found[near.id] = Around(near.time, float(near.shares @ done), shades, taken)
    return found


@dataclass(frozen=True)
class _NearPick:
    """Colours, and what moves them: palette, bumps, and holds.

    `shares` counts those near the pick, `hue` those of its hue, however dark or light.
    """

    id: str
    time: float
    rgb: F64
    shares: F64
    hue: F64
    along: F64
    moved: F64
    free: F64
    held: F64

    def done(self, bumps: F64) -> F64:
        """Return which share of the pick's change each colour gets."""
        return np.asarray(bumped(self.rgb, self.moved, bumps) @ self.along, np.float64)

    def taken(self, hold: F64) -> float:
        """Return which share a hold takes of what the colours get without holds, 0..1.

        Of those near the pick or of those of its hue, where it takes more.
        """
        alone, held = self.done(self.free), self.done(np.vstack([self.free, hold]))
        both = np.array([self.shares, self.hue])
        before, after = both @ alone, both @ held
        return float((1 - after[before > NONE] / before[before > NONE]).max(initial=0.0))


def _of_hue(rgb: F64, picked: F64) -> B:
    """Return which colours have the hue of a picked one: shadows and highlights of the same thing.

    Their chromaticity is as near to the picked one's as to grey's, or nearer. Greys have no hue.
    """
    found, own = (
        (c - c.mean(axis=-1, keepdims=True)) / np.maximum(c.sum(axis=-1, keepdims=True), GREY)
        for c in (rgb, picked)
    )
    away = np.linalg.norm(found - own, axis=-1)
    most = np.minimum(np.linalg.norm(found, axis=-1), np.linalg.norm(own))
    return np.asarray((away <= most) & (np.ptp(picked) >= GREY))


def _near_picks(
    clip: ClipAtTimes, core: _core.Sidecar, problem: Problem, times: Sequence[float] = ()
) -> list[_NearPick]:
    """Return each pick's surroundings at one of some times, the nearest to its own frame.

    They are about as near as pixels of the same thing.
    """
    found = []
    for number, pick in enumerate(problem.picks):
        full = [t for t in times or problem.times if pick.strength_at(t, clip.step) == 1]
        time = min(full, key=lambda t: abs(t - pick.frame), default=None)
        if time is None or (length := float(np.linalg.norm(pick.change_at(time)))) < NONE:
            continue
        own = np.flatnonzero(problem.of == number)
        # The picked colour itself counts where the stored colours have none near it.
        few = np.full((len(own), 1), LEAST_SHARE)
        rgbw = np.vstack([clip.colours_at(time), np.hstack([problem.centres(time)[own], few])])
        near = problem.near(rgbw[:, :3], time, own, np.minimum(problem.radii[own], 2 * ALIKE))
        shares = rgbw[:, 3] * near.max(axis=1)
        cut = _core.slice_at(core.polytope, time)
        weights = _core.palette_weights(rgbw[:, :3], cut.rgb, cut.faces)[0]
        moved = weights @ (_core.edited_colours(core.polytope, core.edits, cut) - cut.rgb)
        bumps = core.bumps_at(time)
        held = bumps[:, 7] > 0
        along = pick.change_at(time) / length**2
        rgb, shares = rgbw[:, :3], shares / shares.sum()
        hue = rgbw[:, 3] * _of_hue(rgb, np.array(pick.colour_at(time)))
        hue /= max(float(hue.sum()), NONE)
        found.append(
            _NearPick(pick.id, time, rgb, shares, hue, along, moved, bumps[~held], bumps[held])
        )
    return found


def _parts(fields: Mapping[str, Any]) -> tuple[ClipAtTimes, _core.Sidecar, Problem]:
    """Return the clip, the edits with their solution, and the problem that was solved."""
    clip = ClipAtTimes(fields)
    enabled = [pick for pick in all_picks(fields["edits"]) if pick.enabled]
    solved = parsed(fields, fields["edits"].get("solution", {}))
    return clip, solved, Problem(clip, enabled[:MOST_PICKS])
