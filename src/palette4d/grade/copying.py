"""Copied grades: another palette gets the look of a graded palette.

Each handle of the target gets the colour that the source's grade makes of its colour at the
corresponding time. Stops are added where the change along an edge is not linear.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.arguments import frames_between
from palette4d.common.errors import Palette4dError
from palette4d.common.files import same_file
from palette4d.grade import recolouring
from palette4d.grade.clip_colours import ClipColours
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.copied_picks import NONE_LOST, Lost, with_picks
from palette4d.grade.correspondence import Match, Time, matched
from palette4d.grade.edits import VISIBLE, Key, Kind, Setting, as_colour, new_id
from palette4d.grade.grade import Grade
from palette4d.grade.keyframes import needed
from palette4d.grade.versions import with_active_kept

F64 = NDArray[np.float64]

#: The edits that the handles' grade is made of.
HANDLES: tuple[Kind, ...] = ("handle", "ramp")
#: Smaller changes of a handle, in code values, are treated as zero: floats round by as much.
LEAST = 1e-6
#: Distance in code values from the source's palette above which a colour is not in its clip.
NEAR = 0.05
#: Largest differences of a copy that fits, as shares of the grade's mean change: the second
#: while the difference is below a step of 8 bits. A tenth of such a step is rounding.
FITS, FITS_BELOW_A_STEP, ROUNDING = 0.3, 0.5, 0.1 / 255


@dataclass(frozen=True)
class Fit:
    """How well a copied grade fits, measured on the colours of the target's clip.

    Attributes
    ----------
    change : float
        The mean change that the source's grade makes of these colours, in code values.
    mean, largest : float
        The mean difference of the copy from the source's grade, and the difference that 99 % of the
        colours stay below.
    foreign : float
        The share of the colours, 0..1, that are farther than `NEAR` from the source's palette:
        there the source's grade says little.
    lost : Lost
        What of the picks is not as it was.
    nothing : bool
        All of the grade are picks that are left out: nothing is copied.
    """

    change: float
    mean: float
    largest: float
    foreign: float
    lost: Lost = NONE_LOST
    nothing: bool = False

    @property
    def fits(self) -> bool:
        """Whether the copy looks like the copied grade, on most of the clip's colours."""
        small = min(FITS_BELOW_A_STEP * self.change, 1 / 255)
        return self.mean <= max(FITS * self.change, small, ROUNDING) and self.foreign <= 0.5

    def __str__(self) -> str:
        """Return the figures for people, in steps of 8 bits."""
        text = "" if self.fits else "the copied grade does not fit this clip: "
        text += (
            f"the copy differs from the copied grade by {self.mean * 255:.1f} of 255 on average, "
            f"by {self.largest * 255:.1f} at most (99 % of the colours); the grade changes the "
            f"colours by {self.change * 255:.1f}"
            if self.change
            else "at the frames that were compared the grade moves no colours but by its picks"
        )
        if self.foreign >= 0.005:
            text += (
                f"; {self.foreign:.0%} of the clip's colours are not in the other clip's palette"
            )
        return f"{text}{self.lost}{'; the edits stay' * self.nothing}"


def copied(
    target: Grade,
    source: Grade,
    clip: ClipOfPicks,
    time: Time = "relative",
    *,
    same_clip: bool = False,
    unread: Collection[str] = (),
) -> tuple[Grade, Fit]:
    """Take over the grade of another palette (`Document.copy_from`); return also how it fits.

    In palettes of the same clip picks stay where they were picked. `unread` has the ids of the
    source's picks for which the clip was not read yet.
    """
    if source.path is not None and target.path is not None and same_file(source.path, target.path):
        raise Palette4dError(
            f"{source.name} is the palette itself, which has this grade already; expected "
            "another palette to copy from"
        )
    if not source.edited:
        raise Palette4dError(f"{source.name} has no edits; expected a graded palette to copy from")
    match = matched(target, source, time)
    state = dict(_handles(match, _grade(match, source.only(*HANDLES))))
    kept, _ = with_active_kept(target, "before copy")
    after = kept.with_state({**kept.of_kind("version", "note", "lock"), **state})
    after, lost = with_picks(after, match, clip, same_clip=same_clip, unread=unread)
    label = f"copy the grade of {source.members['clip']['name']}"
    nothing = bool(lost.left_out) and not after.edited
    return after.labelled(label), replace(fit(after, source, time), lost=lost, nothing=nothing)


def fit(target: Grade, source: Grade, time: Time = "relative") -> Fit:
    """Measure how near the handles' grade is to that of another palette on its colours."""
    match = matched(target, source, time)
    target, source = target.only(*HANDLES), source.only(*HANDLES)
    graded = _grade(match, source)
    into, _ = match.conversions
    figures = []
    for frame, colours, weights in _colours(target):
        result = _recoloured(target, colours, frame)
        expected = graded(colours, frame)
        palette = source.palette(match.there(frame))
        there = colours if into is None else into(colours)
        _, distances = _core.palette_weights(there, palette.rgb, palette.faces)
        changes = [np.abs(step).max(axis=1) for step in (expected - colours, result - expected)]
        figures.append(np.array([weights, *changes, distances > NEAR]))
    weight, change, off, foreign = np.hstack(figures)
    order = np.argsort(off, kind="stable")
    reached = np.cumsum(weight[order]) / weight.sum()
    worst = off[order][min(int(np.searchsorted(reached, 0.99)), len(off) - 1)]
    mean = [float(np.average(values, weights=weight)) for values in (change, off, foreign)]
    return Fit(mean[0], mean[1], float(worst), mean[2])


def _recoloured(grade: Grade, colours: F64, frame: float) -> F64:
    image = np.asarray(colours, dtype=np.float32)[None]
    result: F64 = recolouring.recolour(grade, image, frame, space="palette")[0].astype(np.float64)
    return result


def _grade(match: Match, source: Grade) -> Callable[[F64, float], F64]:
    """Return the function of (n, 3) colours and a time of the target by the source's grade."""
    there, back = match.conversions

    def graded(colours: F64, frame: float) -> F64:
        before = colours if there is None else there(colours)
        after = _recoloured(source, before, match.there(frame))
        moved = np.abs(after - before.astype(np.float32)).max(axis=1) > LEAST
        if back is not None:
            # Adds the difference: rounding of the conversions must not count as an edit.
            after = colours + back(after) - back(before)
        result: F64 = np.where(moved[:, None], after, colours)
        return result

    return graded


def _handles(match: Match, graded: Callable[[F64, float], F64]) -> Iterator[tuple[Key, Setting]]:
    """Yield the settings of vertices, and of the stops that edges need."""
    target = match.target
    polytope = target.members["polytope"]
    vertices = {vertex["id"]: vertex for vertex in polytope["vertices"]}
    taken = {*vertices, *(edge["id"] for edge in polytope["edges"])}
    shifts: dict[str, F64] = {}
    for id_, vertex in vertices.items():
        before = np.array([vertex["rgb"]], dtype=np.float64)
        after = graded(before, vertex["frame"])
        shifts[id_] = (after - before)[0]
        if shifts[id_].any():
            yield ("handle", id_), Setting(as_colour(after[0].tolist()))

    first, last, step = target.frames
    before_at: dict[str, list[tuple[float, F64, F64]]] = {}
    for frame_at in sorted({*frames_between(first, last, step), *match.knots}):
        palette = target.palette(frame_at)
        after = graded(palette.rgb, frame_at)
        for id_, colour, new in zip(palette.ids, palette.rgb, after, strict=True):
            before_at.setdefault(id_, []).append((float(frame_at), colour, new))
    for edge in polytope["edges"]:
        samples, (start, end) = before_at.get(edge["id"], []), (edge["from"], edge["to"])
        inner = [frame for frame, _, _ in samples]
        times = [vertices[start]["frame"], *inner, vertices[end]["frame"]]
        changes = [shifts[start], *(new - old for _, old, new in samples), shifts[end]]
        for index in needed(times, np.array(changes), (), VISIBLE)[1:-1]:
            frame, _, new = samples[index - 1]
            id_ = new_id("s", taken)
            taken.add(id_)
            yield ("handle", id_), Setting(as_colour(new.tolist()), edge["id"], frame)


def _colours(target: Grade) -> Iterator[tuple[float, F64, F64]]:
    """Yield frames with colours of the target's clip and their weights."""
    stored = ClipColours(target.core.polytope, target.members)
    for frame, rows in zip(stored.frames, stored.colours, strict=True):
        yield float(frame), rows[:, :3], rows[:, 3]
    if stored.frames:
        return
    # Without the clip's colours: even mixtures of the palette's colours.
    for time in np.unique(np.linspace(*target.frames[:2], 9)).tolist():
        rgb = target.palette(time).rgb
        pairs = [(a + b) / 2 for i, a in enumerate(rgb) for b in rgb[i + 1 :]] or [*rgb]
        yield time, np.array(pairs), np.ones(len(pairs))
