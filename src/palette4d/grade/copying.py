"""Copied grades: another palette gets the look of a graded palette.

Each handle of the target gets the colour that the source's grade makes of its colour at the
corresponding time. Stops are added where the change along an edge is not linear. Picks are learned
again from the target's clip: there their colour is, connected, or they are not copied.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palette4d import _core
from palette4d.colour.encoding_conversion import between
from palette4d.common.arguments import frames_between
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.files import same_file
from palette4d.grade import recolouring
from palette4d.grade.clip_colours import ClipColours
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.edits import VISIBLE, Colour, Key, Kind, Setting, as_colour, new_id
from palette4d.grade.grade import Grade
from palette4d.grade.keyframes import needed
from palette4d.grade.pick_edits import taken
from palette4d.grade.picks import Pick
from palette4d.grade.versions import with_active_kept
from palette4d.media.source_clip import nearest

F64 = NDArray[np.float64]
Time = Literal["relative", "same"] | float
Convert = Callable[[F64], F64]

#: The edits that the handles' grade is made of.
HANDLES: tuple[Kind, ...] = ("handle", "ramp")
#: Smaller changes of a handle, in code values, are treated as zero: floats round by as much.
LEAST = 1e-6
#: Distance in code values from the source's palette above which a colour is not in its clip.
NEAR = 0.05
#: Largest differences of a copy that fits, as shares of the grade's mean change: the second
#: while the difference is below a step of 8 bits. A tenth of such a step is rounding.
FITS, FITS_BELOW_A_STEP, ROUNDING = 0.3, 0.5, 0.1 / 255
#: Times between two handles at which a smooth ramp is looked at.
ON_SMOOTH = 7


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
    left_out : tuple of str
        The picks whose colour is not in the target's clip, with what they are, for people.
    everywhere : tuple of str
        The ids of copied picks that have a window in the source: windows are not copied.
    elsewhere : tuple of str
        The ids of copied picks whose place in the clip has another colour now, or is gone.
    unlearned : tuple of str
        The ids of copied picks that take all of their hue, as there is no clip to learn from.
    nothing : bool
        All of the grade are picks that are left out: nothing is copied.
    """

    change: float
    mean: float
    largest: float
    foreign: float
    left_out: tuple[str, ...] = ()
    everywhere: tuple[str, ...] = ()
    elsewhere: tuple[str, ...] = ()
    unlearned: tuple[str, ...] = ()
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
        return text + self.lost

    @property
    def lost(self) -> str:
        """What of the picks is not as it was, for people; "" if nothing."""
        text = ""
        if self.elsewhere:
            why = "their place has another colour here, or their frame is gone"
            text += f"; picked where their colour is, since {why}: {', '.join(self.elsewhere)}"
        if self.left_out:
            why = "nothing connected has the colour here"
            text += f"; not copied, since {why}: {', '.join(self.left_out)}"
            text += "; the edits stay" * self.nothing
        if self.everywhere:
            why = "that is a place in the other clip"
            text += f"; without a window, since {why}: {', '.join(self.everywhere)}"
        if self.unlearned:
            why = "the clip was not found"
            text += f"; of all colours of their hue, since {why}: {', '.join(self.unlearned)}"
        return text


@dataclass(frozen=True)
class Match:
    """The times and the colours of two grades."""

    target: Grade
    source: Grade
    time: Time

    def there(self, frame: float) -> float:
        """Return the source's time for a time of the target."""
        if not isinstance(self.time, str):
            return float(self.time)
        first, last, _ = self.target.frames
        begin, end, _ = self.source.frames
        if self.time == "same":
            return min(max(frame, begin), end)
        return begin + (frame - first) * (end - begin) / max(last - first, 1)

    def back(self, frame: float) -> float:
        """Return the target's time for a time of the source, unless `time` is a frame."""
        if self.time == "same":
            return frame
        first, last, _ = self.target.frames
        begin, end, _ = self.source.frames
        return first + (frame - begin) * (last - first) / max(end - begin, 1)

    @cached_property
    def conversions(self) -> tuple[Convert | None, Convert | None]:
        """From the target's code values to the source's, and back; None where they are equal."""
        clips = (grade.members["clip"] for grade in (self.target, self.source))
        configs = [name for clip in clips if (name := clip.get("conversion", {}).get("config"))]
        own, other = self.target.encoding, self.source.encoding
        return between(own, other, configs), between(other, own, configs)

    @property
    def knots(self) -> list[float]:
        """The target's times that show all of the source's ramps.

        They may lie between frames that were analysed: those of vertices and stops, between which
        the source goes along lines; the last frame before each, where a step ends; and some on
        smooth ramps.
        """
        if not isinstance(self.time, str):
            return []
        stops = [stop.frame for stop in self.source.settings.values() if stop.frame is not None]
        own = {vertex["frame"] for vertex in self.source.members["polytope"]["vertices"]}
        times = sorted(map(self.back, own.union(stops)))
        frames = [float(math.ceil(time)) for time in times]
        smooth = {self.source.ramp, *(set_.ramp for set_ in self.source.settings.values())}
        between = [np.linspace(*pair, ON_SMOOTH + 2) for pair in itertools.pairwise(times)]
        curved = np.concatenate([[], *between]).tolist() if "smooth" in smooth else []
        first, last, _ = self.target.frames
        wanted = {*times, *frames, *(frame - 1 for frame in frames), *curved}
        return [time for time in wanted if first <= time <= last]

    @property
    def pace(self) -> float:
        """Frames of the target for one frame of the source."""
        return self.back(1.0) - self.back(0.0)


def copied(
    target: Grade,
    source: Grade,
    clip: ClipOfPicks,
    time: Time = "relative",
    *,
    same_clip: bool = False,
) -> tuple[Grade, Fit]:
    """Take over the grade of another palette (`Document.copy_from`); return also how it fits.

    In palettes of the same clip picks stay where they were picked.
    """
    if source.path is not None and target.path is not None and same_file(source.path, target.path):
        raise Palette4dError(
            f"{source.name} is the palette itself, which has this grade already; expected "
            "another palette to copy from"
        )
    if not source.edited:
        raise Palette4dError(f"{source.name} has no edits; expected a graded palette to copy from")
    match = _match(target, source, time)
    state = dict(_handles(match, _grade(match, source.only(*HANDLES))))
    kept, _ = with_active_kept(target, "before copy")
    after = kept.with_state({**kept.of_kind("version", "note", "lock"), **state})
    first, last, step = target.frames
    opened = clip.open()
    there = None if opened is None else [n for n in opened.frames if first <= n <= last]
    frames = there or range(first, last + 1, step)
    picks = (_pick(match, pick, frames, same_clip=same_clip) for pick in source.picks)
    spaces = {target.encoding, source.encoding}
    told = len(spaces) == 1 or "unknown" not in spaces  # else no colours can be compared
    # In a palette of one frame nothing could be followed.
    begin, end, _ = source.frames
    still = {pick.id for pick in source.picks if not pick.path and begin < end}
    here = [pick for pick in picks if pick is not None]
    colours = {pick.id for pick in source.picks if same_clip and pick.pixel is None}
    # Their frames are not in the target.
    trimmed = [p.id for p in here if same_clip and p.pixel is None and p.id not in colours]
    after, left_out, away = taken(after, clip, here, still, colours, told=told)
    copies = {pick.id: pick for pick in after.picks}
    everywhere = [
        pick.id
        for pick in source.picks
        if pick.window and pick.id in copies and not copies[pick.id].window
    ]
    unlearned = [
        pick.id for pick in source.picks if pick.matte and pick.id in copies and opened is None
    ]
    label = f"copy the grade of {source.members['clip']['name']}"
    measured = fit(after, source, time)
    whole = replace(
        measured,
        left_out=tuple(left_out),
        everywhere=tuple(everywhere),
        elsewhere=tuple(id_ for id_ in (*away, *trimmed) if id_ in copies),
        unlearned=tuple(unlearned),
        nothing=bool(left_out) and not after.edited,
    )
    return after.labelled(label), whole


def fit(target: Grade, source: Grade, time: Time = "relative") -> Fit:
    """Measure how near the handles' grade is to that of another palette on its colours."""
    match = _match(target, source, time)
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


def _match(target: Grade, source: Grade, time: Time) -> Match:
    if not isinstance(time, str):
        source.check_frame(time)
    elif time not in ("relative", "same"):
        raise Palette4dError(f"found the time {time!r}, expected 'relative', 'same' or a frame")
    (first, last, _), (begin, end, _) = target.frames, source.frames
    if time == "same" and not (first <= end and begin <= last):
        raise Palette4dError(
            f"found the frames {first} to {last} here and {begin} to {end} in {source.name}, "
            f"expected frames in common; leave out {Arg('time', 'same')}"
        )
    return Match(target, source, time)


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


def _pick(match: Match, pick: Pick, frames: Sequence[int], *, same_clip: bool) -> Pick | None:
    """Return a pick as it is in the target, or None if it does nothing at the chosen frame.

    `frames` are those of the target's clip.
    """
    _, into = match.conversions

    def colour(rgb: ArrayLike) -> Colour:
        own = np.array(rgb, float)
        return as_colour((own if into is None else into(own)).tolist())

    def time(frame: float) -> int:
        return nearest(frames, round(match.back(frame)))

    def end(frame: float | None) -> float | None:
        if frame is None or match.time == "same":
            return frame
        return float(round(match.back(frame)))

    always: dict[str, Any] = {"start": None, "until": None, "fade": 0.0, "fade_out": None}
    copy = replace(pick, path=(), matte=None, **always)
    if not same_clip:
        copy = replace(copy, pixel=None, box=None, areas=(), window=None)
    if pick.to is not None:
        copy = replace(copy, to=colour(pick.to))

    def picked_at(moment: float) -> Pick:
        rgb = pick.colour_at(moment)
        if pick.to is not None and pick.toward == "shift":
            return replace(copy, rgb=colour(rgb), to=colour(rgb + pick.change_at(moment)))
        return replace(copy, rgb=colour(rgb))

    if isinstance(match.time, str):
        first, last, _ = match.target.frames
        keys = {time(k.frame): k for k in pick.path if first <= match.back(k.frame) <= last}
        frame = time(pick.frame)
        if first <= match.back(pick.frame) <= last:
            copy = replace(copy, rgb=colour(pick.rgb))
        else:  # it was picked at a frame that is not in the target
            copy = replace(picked_at(match.there(frame)), pixel=None, box=None)
        inside = [area for area in copy.areas if first <= match.back(area.frame) <= last]
        window = copy.window
        if window is not None:
            boxes = {round(match.back(key.frame)): key for key in window.keys}
            window = replace(
                window, keys=tuple(replace(boxes[f], frame=float(f)) for f in sorted(boxes))
            )
        return replace(
            copy,
            frame=frame,
            areas=tuple(replace(area, frame=time(area.frame)) for area in inside),
            window=window,
            start=end(pick.start),
            until=end(pick.until),
            fade=pick.fade * match.pace,
            fade_out=None if pick.fade_out is None else pick.fade_out * match.pace,
            path=tuple(replace(keys[f], frame=f, rgb=colour(keys[f].rgb)) for f in sorted(keys)),
        )
    moment = float(match.time)
    start, until = (moment if end is None else end for end in (pick.start, pick.until))
    if not start <= moment <= until:
        return None
    return replace(picked_at(moment), frame=match.target.frames[0])


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
