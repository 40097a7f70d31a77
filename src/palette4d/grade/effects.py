"""What solved picks do to a clip: beside themselves, and to the colours near them.

Input: the members of a sidecar, with a solution. The clip is not read: its stored colours stand
for it.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.grade.bumps import bumped
from palette4d.grade.edits import Colour, as_colour
from palette4d.grade.picks import MOST_PICKS, all_picks
from palette4d.grade.solve import LEAST_SHARE, NEAR, NONE, OTHER, ClipAtTimes, Problem, parsed

F64 = NDArray[np.float64]


@dataclass(frozen=True)
class SideEffect:
    """What the picks do to the pixels of a clip, at the frame where they do most beside themselves.

    Attributes
    ----------
    frame : float
    share : float
        Share, 0..1, of the frame's pixels that change by more than asked for in a channel.
    others : float
        The same for pixels that are not near a picked colour or a shade of it.
    most : 3 floats
        The other colour for which this matters most; its share of the pixels counts.
    """

    frame: float
    share: float
    others: float
    most: Colour


def side_effect(fields: Mapping[str, Any], least: float) -> SideEffect:
    """Return what the picks' solution does; `least` is the change that counts."""
    clip, both, problem = _parts(fields)
    found = [SideEffect(float(clip.first), 0.0, 0.0, (0.0, 0.0, 0.0))]
    for time in problem.times:
        cut = _core.slice_at(clip.polytope, time)
        solved = _core.edited_colours(clip.polytope, both.edits, cut)
        user = _core.edited_colours(clip.polytope, clip.core.edits, cut)
        guarded = clip.colours_at(time)
        rgb, shares = guarded[:, :3], guarded[:, 3] / max(float(guarded[:, 3].sum()), 1e-9)
        moved = _core.palette_weights(rgb, cut.rgb, cut.faces)[0] @ (solved - user)
        change = bumped(rgb, moved, both.bumps_at(time))
        size = np.abs(change).max(axis=1)
        other = problem.guard_at(rgb, time, problem.asked(time)) > OTHER
        worst = int(np.argmax(np.where(other, size * np.sqrt(shares), 0.0)))
        found.append(
            SideEffect(
                time,
                float(shares[size > least].sum()),
                float(shares[other & (size > least)].sum()),
                as_colour(rgb[worst]),
            )
        )
    return max(found, key=lambda one: (one.others, one.share))


@dataclass(frozen=True)
class Around:
    """What the clip's colours near a pick get of its change.

    Attributes
    ----------
    frame : float
        The pick's own frame, or the nearest one at which all of its change is asked for.
    share : float
        The mean share of the change, over the frame's pixels near the picked colour.
    taken : dict of float
        By the id of each hold: the share, 0..1, of what they would get without it.
    """

    frame: float
    share: float
    taken: dict[str, float]


def surroundings(fields: Mapping[str, Any]) -> dict[str, Around]:
    """Return what the colours near each enabled pick get of its change, by the pick's id."""
    clip, core, problem = _parts(fields)
    found = {}
    for number, pick in enumerate(problem.picks):
        full = [t for t in problem.times if pick.strength_at(t, clip.step) == 1]
        time = min(full, key=lambda t: abs(t - pick.frame), default=None)
        if time is None or (length := float(np.linalg.norm(pick.change_at(time)))) < NONE:
            continue
        own = np.flatnonzero(problem.of == number)
        # The picked colour itself counts where the stored colours have none near it.
        few = np.full((len(own), 1), LEAST_SHARE)
        rgbw = np.vstack([clip.colours_at(time), np.hstack([problem.centres(time)[own], few])])
        near = problem.near(rgbw[:, :3], time, own, np.minimum(problem.radii[own], NEAR))
        shares = rgbw[:, 3] * near.max(axis=1)
        cut = _core.slice_at(core.polytope, time)
        weights = _core.palette_weights(rgbw[:, :3], cut.rgb, cut.faces)[0]
        moved = weights @ (_core.edited_colours(core.polytope, core.edits, cut) - cut.rgb)
        bumps = core.bumps_at(time)
        along = pick.change_at(time) / length**2
        share = functools.partial(_share, rgbw[:, :3], moved, shares / shares.sum(), along)
        holds = bumps[:, 7] > 0
        free = share(bumps[~holds])
        taken: dict[str, float] = {}
        for hold in bumps[holds] if free > NONE else ():
            id_ = problem.hold_at(hold[:3], time)
            lost = 1 - share(np.vstack([bumps[~holds], hold])) / free
            taken[id_] = max(taken.get(id_, 0.0), lost)
        found[pick.id] = Around(time, share(bumps), taken)
    return found


def _share(rgb: F64, moved: F64, shares: F64, along: F64, bumps: F64) -> float:
    """Return the mean share of a change that colours get, which the palette moves by `moved`."""
    return float(shares @ bumped(rgb, moved, bumps) @ along)


def _parts(fields: Mapping[str, Any]) -> tuple[ClipAtTimes, _core.Sidecar, Problem]:
    """Return the clip, the edits with their solution, and the problem that was solved."""
    clip = ClipAtTimes(fields)
    enabled = [pick for pick in all_picks(fields["edits"]) if pick.enabled]
    solved = parsed(fields, fields["edits"].get("solution", {}))
    return clip, solved, Problem(clip, enabled[:MOST_PICKS])
