"""The answer to a pick or hold: the pixels that it takes, and notes with what would help.

Input: a grade with a pick, and its clip. Output: an `Answer`. Each gesture that a note proposes has
been tried on the frame.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.text import percent
from palette4d.grade import pick_edits, thing
from palette4d.grade.clip_of_picks import SAME_COLOUR, ClipOfPicks, largest_part
from palette4d.grade.edits import Colour, as_colour
from palette4d.grade.grade import Grade
from palette4d.grade.mattes import further_frames
from palette4d.grade.pick_edits import When
from palette4d.grade.picks import ALIKE, Area, Box, Pick, as_box
from palette4d.media.clip_base import FrameError
from palette4d.media.source_clip import nearest_frame

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
B = NDArray[np.bool_]

#: The frame is reduced to about this width, in pixels: more take longer and show nothing more.
WIDTH = 480
#: Least share of the change of a pixel that counts as taken. A marked pixel with less than LEAST is
#: reported: pale parts of a thing change a little.
TAKEN, LEAST = 0.25, 0.05
#: Least share of the frame of other things to report, and of what the pick takes: beside a small
#: thing smaller areas are seen. None is reported below a tenth of the first.
OTHERS, OF_TAKEN = 0.005, 0.1
#: Largest share of the change of a thing, and of what was marked, that a hold may cost unreported.
COST = 0.1
#: A pick that takes more than this share of the pixels of another pick is reported.
SHARED = 0.2
#: A thing of more than FLOOD of the frame that reaches three of its edges, and has more than FAR of
#: its pixels in colours unlike the marked ones, is reported: it is seldom what was meant.
FLOOD, FAR = 0.4, 0.3
#: At most so many frames where a pick was corrected are looked at.
MOST_CORRECTED = 8
#: A taken colour farther than this from the line of the picked hue, in pick space, has another hue:
#: faces beside red clothes have 0.08 to 0.12. A picked colour with less chroma than GREY has none.
HUE, GREY = 0.08, 0.1


@dataclass(frozen=True)
class Place:
    """A frame, a pixel and a box that a gesture may name, with their colour (code values)."""

    frame: int
    pixel: tuple[int, int]
    box: int
    rgb: Colour


@dataclass(frozen=True)
class Note:
    """A line of an answer.

    Attributes
    ----------
    words : str
    place : Place or None
        Where it is seen.
    gesture : {"", "hold", "area", "window"}
        What helps there: a hold, an area of the pick `id`, or a window of it. It was tried.
    effect : str
        What the gesture leads to.
    id : str
        The pick that the note is about.
    warns : bool
        Something does not do what it looks like.
    window : Box or None
        The box of a proposed window at the answer's frame, in pixels of the clip.
    """

    words: str
    place: Place | None = None
    gesture: Literal["", "hold", "area", "window"] = ""
    effect: str = ""
    id: str = ""
    warns: bool = False
    window: Box | None = None

    def proposing(
        self, gesture: Literal["hold", "area", "window"], after: F32, cost: float = 0
    ) -> Note:
        """Return the note with a gesture: what it leaves of the change, and costs the thing."""
        effect = f"then takes {percent(float(after.mean()))}"
        if cost > COST:
            effect += f", and {percent(cost)} less of the thing"
        return replace(self, gesture=gesture, effect=effect)


@dataclass(frozen=True)
class Answer:
    """What a pick or hold does in the frame that it was picked in.

    Attributes
    ----------
    frame : int
    share : float
        Share of the frame that is taken, or kept by a hold: the mean of its matte, so that a pixel
        with half of the change counts as half.
    notes : tuple of Note
        What else the user should know.
    kind : 'pick' or 'hold'
    """

    frame: int
    share: float
    notes: tuple[Note, ...] = ()
    kind: Literal["pick", "hold"] = "pick"


def answer_to(grade: Grade, pick: Pick, clip: ClipOfPicks) -> Answer | None:
    """Return the answer to a pick or hold; None where the clip is not there."""
    if clip.open() is None:
        return None
    # A range may leave the frame of the pick out: what it takes is the same.
    ranged, pick = pick, replace(pick, start=None, until=None)
    grade = grade.put("pick", pick.id, pick)
    view = _View.of(grade, clip, pick.frame)
    picks = [other for other in grade.picks if other.enabled and other.kind == "pick"]
    holds = [other for other in grade.picks if other.enabled and other.kind == "hold"]
    notes: list[Note] = []
    if pick.kind == "hold":
        without = pick_edits.unpick(grade, clip, pick.id)
        for other in picks:
            it = _Thing.of(_View.of(grade, clip, other.frame), other, holds)
            if (cost := _cost(view, it, pick, without)) is not None:
                now, before = (v.change(other).mean() for v in (view, view.under(without)))
                words = f"{other.id} takes {percent(now)} of frame {view.frame}"
                notes += [Note(f"{words}, {percent(before)} without it"), *cost]
        if picks and not notes:
            notes = [Note("no pick takes less by it: hold a place that one takes", warns=True)]
    else:
        it = _Thing.of(view, pick, holds)
        notes += _unmarked(it)
        for hold in holds:
            notes += _cost(view, it, hold, pick_edits.unpick(grade, clip, hold.id)) or ()
        notes += _shared(view, pick, [other for other in picks if other.id != pick.id])
        notes += _also(it)
        notes += _elsewhen(view, pick, ranged)
    kind: Literal["pick", "hold"] = "hold" if pick.kind == "hold" else "pick"
    return Answer(view.frame, float(view.change(pick).mean()), tuple(notes), kind)


@dataclass(frozen=True)
class _View:
    """A grade at a frame that is reduced: every n-th pixel of every n-th row, n = `every`."""

    grade: Grade
    clip: ClipOfPicks
    frame: int
    every: int
    rgb: F32
    real: B

    @classmethod
    def of(cls, grade: Grade, clip: ClipOfPicks, frame: float) -> _View:
        opened = clip.open()
        assert opened is not None
        nearest = nearest_frame(opened, frame)
        pixels = clip.read(nearest)
        every = max(1, round(pixels.shape[1] / WIDTH))
        rgb = pixels[every // 2 :: every, every // 2 :: every]
        real = np.asarray(np.isfinite(rgb).all(axis=2))
        shown = np.where(real[..., None], rgb, 0).astype(np.float32)
        return cls(grade, clip, nearest, every, shown, real)

    def under(self, grade: Grade) -> _View:
        """Return the same frame with another grade."""
        return replace(self, grade=grade)

    def change(self, pick: Pick, *, windowed: bool = True) -> F32:
        """Return the share of a pick's change that each pixel gets, 0..1."""
        # Any palette will do: none of its colours moves.
        corner, faces = np.zeros((1, 3)), np.zeros((0, 3), np.int32)
        matte = self.grade.core.pick_matte_at(pick.id, self.frame)
        drawing = _core.Recolourer(corner, corner, faces, picks=matte)
        drawn = drawing.apply(self.rgb, precision="single", picture=windowed)
        share = np.where(self.real, (drawn - self.rgb)[..., 0], 0)
        return np.clip(share, 0, 1).astype(np.float32)

    def points(self, rgb: NDArray[np.floating]) -> F64:
        """Return colours, (..., 3), as points of pick space."""
        points = _core.pick_points(rgb.reshape(-1, 3), self.grade.display())
        return np.asarray(points).reshape(rgb.shape)

    def hue(self, pick: Pick) -> F64:
        """Return each pixel's distance in pick space from the nearest marked hue."""
        points, hues = self.points(self.rgb), []
        marked = [self.rgb[mark & self.real] for mark in self.marks(pick.areas)]
        colours = [pick.rgb, *(np.median(rgb, axis=0) for rgb in marked if len(rgb))]
        for u, v, _ in self.points(np.asarray(colours)):
            chroma = float(np.hypot(u, v))
            if chroma < GREY:
                hues.append(np.hypot(points[..., 0] - u, points[..., 1] - v))
            else:
                hues.append(np.abs(points[..., 0] * v - points[..., 1] * u) / chroma)
        return np.asarray(np.min(hues, axis=0))

    def mark(self, area: Area) -> B:
        """Return the pixels of a box or stroke."""
        marked = np.zeros(self.real.shape, bool)
        half = max(area.radius / self.every, 0.5)
        for x, y in area.points:
            rows, columns = (
                slice(max(0, int(middle / self.every - half)), int(middle / self.every + half) + 1)
                for middle in (y, x)
            )
            marked[rows, columns] = True
        return marked

    def marks(self, areas: Sequence[Area]) -> list[B]:
        """Return the pixels of each area that was marked in this frame."""
        marks = [self.mark(area) for area in areas if round(area.frame) == self.frame]
        return [mark for mark in marks if mark.any()]

    def any_of(self, masks: Sequence[B]) -> B:
        """Return where one of some masks is."""
        return np.asarray(np.any([np.zeros(self.real.shape, bool), *masks], axis=0))

    def place(self, mask: B) -> Place:
        """Return the middle of a mask's largest part, and a box that lies in it."""
        largest, (column, row), box = largest_part(mask)
        pixel = column * self.every + self.every // 2, row * self.every + self.every // 2
        rgb = as_colour(np.median(self.rgb[largest], axis=0).tolist())
        return Place(self.frame, pixel, box * self.every, rgb)

    def after(
        self, pick: Pick, gesture: Literal["hold", "area"], place: Place, *, windowed: bool = True
    ) -> F32 | None:
        """Return a pick's change after a gesture at a place; None if the gesture is refused."""
        try:
            if gesture == "hold":
                where = When(pixel=place.pixel, box=place.box, follow=False)
                trial, _ = pick_edits.hold(self.grade, self.clip, self.frame, **where)
            else:
                area = Area(self.frame, (place.pixel,), place.box / 2)
                trial = pick_edits.add_area(self.grade, self.clip, pick.id, area)
        except Palette4dError:
            return None
        return self.under(trial).change(pick, windowed=windowed)

    def around(self, mask: B) -> Box:
        """Return the box around the pixels of a mask, with as much room as its feather."""
        spans = [np.flatnonzero(mask.any(axis=axis)) * self.every for axis in (0, 1)]
        room = pick_edits.FEATHER * min(float(np.ptp(span)) for span in spans) + self.every
        clip = self.clip.open()
        assert clip is not None
        ends = clip.width, clip.height
        (left, right), (top, bottom) = (
            (max(0, round(span[0] - room)), min(end, round(span[-1] + self.every + room)))
            for span, end in zip(spans, ends, strict=True)
        )
        return as_box((left, top, right, bottom))

    def within(self, pick: Pick, box: Box) -> F32:
        """Return a pick's change in a window."""
        trial = pick_edits.set_window(self.grade, self.clip, pick.id, self.frame, box, follow=False)
        return self.under(trial).change(pick)


@dataclass(frozen=True)
class _Thing:
    """A pick's thing in the frame that it was picked in, as it is without holds.

    What is outside the pick's window shows where the thing ends, and does not count. `own` is the
    thing, `beside` what is connected with it and is another thing, `joined` the part of that where
    it was noticed; `away` says how unlike the marks each pixel is. `free` is the grade without
    holds.
    """

    view: _View
    free: Grade
    pick: Pick
    marks: list[B]
    own: B
    beside: B
    joined: B
    away: F64 | None

    @classmethod
    def of(cls, view: _View, pick: Pick, holds: Sequence[Pick]) -> _Thing:
        grade = pick_edits.unpick(view.grade, view.clip, *(hold.id for hold in holds))
        free, marks, none = view.under(grade), view.marks(pick.marks), np.zeros_like(view.real)
        before = free.change(pick, windowed=False)
        taken, here = before > TAKEN, free.change(pick) > TAKEN
        if not marks:
            return cls(view, grade, pick, marks, here, none, none, None)
        marked, away = view.any_of(marks), thing.unlike(view.points(view.rgb), marks)
        whole = thing.connected(taken, marked, gap=4)
        for own, part in thing.joins(taken, marked, away, SAME_COLOUR, int(OTHERS * taken.size)):
            after = free.after(pick, "hold", view.place(part), windowed=False)
            if after is not None and _parted(before, after, part, own):
                own, beside, part = own & here, whole & here & ~own, part & here
                return cls(view, grade, pick, marks, own, beside, part, away)
        return cls(view, grade, pick, marks, whole & here, none, none, away)

    def side(self, part: B, others: B) -> B:
        """Return what of a part is not nearer to other pixels than to the marks."""
        if self.away is None or not others.any():
            return part
        return part & thing.nearer(self.away, self.view.any_of(self.marks), others)


def _parted(before: F32, after: F32, part: B, own: B) -> bool:
    """Return whether a hold takes most of a part's change, and much less of the thing's own."""
    return _lost(before, after, part) > max(0.5, 2 * _lost(before, after, own))


def _lost(before: F32, after: F32, part: B) -> float:
    """Return the share of a part's change that is lost."""
    lost = np.maximum(before - after, 0)[part].sum()
    return float(lost / max(float(before[part].sum()), 1e-9))


def _unmarked(it: _Thing) -> Iterator[Note]:
    """Report areas that the user marked as the pick's, and that it does not take without holds."""
    pick = it.pick
    for area in pick.marks:
        if (strength := pick.strength_at(area.frame)) < 0.5:
            if area.frame != pick.frame:
                yield Note(
                    f"{percent(strength)} of the change at frame {area.frame:g}, where you marked "
                    f"it: its colour was not found there (correct {pick.id})",
                    warns=True,
                )
            continue
        there = _View.of(it.free, it.view.clip, area.frame)
        marked = there.mark(area) & there.real
        left = marked & (there.change(pick) < LEAST)
        if left.sum() > 0.5 * marked.sum():
            why = "it looks like what is around it; pick it too, as a colour of its own"
            if there.change(pick, windowed=False)[left].mean() > TAKEN:
                why = "its window leaves that out"
            yield Note(f"does not take what you marked ({why})", there.place(left), warns=True)


def _cost(view: _View, it: _Thing, hold: Pick, without: Grade) -> list[Note] | None:
    """Report what a hold costs a pick's thing; None if the pick takes no less by it.

    `without` is the grade without the hold.
    """
    pick, there = it.pick, it.view
    if all((v.under(without).change(pick) - v.change(pick)).max() <= TAKEN for v in (view, there)):
        return None
    words = f"{hold.id} costs {pick.id} {{}} of what you marked for it"
    areas = [(area, _View.of(view.grade, view.clip, area.frame)) for area in pick.marks]
    parts = [(words, seen, seen.mark(area)) for area, seen in areas]
    held = there.any_of(there.marks(hold.marks))
    # What touches the thing may be its other shade.
    whole = it.side(it.own | it.beside, held)
    parts.append((f"{hold.id} also costs {pick.id} {{}} of its thing", there, whole))
    for words, there, part in parts:
        before, now = there.under(without).change(pick), there.change(pick)
        if (share := _lost(before, now, part)) <= COST:
            continue
        lost = np.where(part, np.maximum(before - now, 0), 0)
        place = there.place(lost >= min(TAKEN, float(lost.max())))
        words = words.format(percent(share))
        after = there.after(pick, "area", place)
        if after is not None:
            gained = np.maximum(after - now, 0)
            if np.minimum(gained, lost).sum() >= max(gained.sum(), lost.sum()) / 2:
                note = Note(f"{words}, most of it", place, id=pick.id, warns=True)
                return [note.proposing("area", after)]
        words += " (if that belongs to the thing, remove it or hold another place), most of it"
        return [Note(words, place, id=pick.id, warns=True)]
    return []


def _elsewhen(view: _View, pick: Pick, ranged: Pick) -> Iterator[Note]:
    """Report a frame that the pick floods, and one where following loses what it takes.

    Looked at are frames of its range, which `ranged` has: where the user corrected the pick, and
    some more.
    """
    clip = view.clip.open()
    assert clip is not None
    corrected = [nearest_frame(clip, key.frame) for key in pick.path if key.given]
    unfollowed = replace(ranged, path=())
    inside = [n for n in corrected if unfollowed.strength_at(n) > 0.5]
    some = inside[:: -(-len(inside) // MOST_CORRECTED) or 1]
    views = []
    for frame in sorted({*some, *further_frames(unfollowed, clip.frames)} - {view.frame}):
        with contextlib.suppress(FrameError):
            views.append(_View.of(view.grade, view.clip, frame))
    shares = [float(there.change(pick).mean()) for there in views]
    here = float(view.change(pick).mean())
    frames = [there.frame for there in views]
    most, frame = max(zip(shares, frames, strict=True), default=(0.0, view.frame))
    if most > FLOOD > 2 * here:
        words = f"takes {percent(most)} of frame {frame}: correct {pick.id} there"
        yield Note(f"{words}, or end it before", id=pick.id, warns=True)
    if not pick.path:
        return
    still = view.grade.put("pick", pick.id, replace(pick, path=()))
    for there, share in zip(views, shares, strict=True):
        without = float(there.under(still).change(pick).mean())
        if without > max(2 * share, here / 2):
            words = f"following loses its colour: takes {percent(share)} of frame {there.frame}"
            words += f", {percent(without)} if {pick.id} is not followed"
            yield Note(words, id=pick.id, warns=True)
            return


def _shared(view: _View, pick: Pick, picks: Sequence[Pick]) -> Iterator[Note]:
    """Report earlier picks that take the same pixels, and change them otherwise."""
    taken, ids = view.change(pick) > TAKEN, [each.id for each in view.grade.picks]
    shares = {}
    for other in picks:
        unlike = np.linalg.norm(pick.change_at(view.frame) - other.change_at(view.frame))
        if ids.index(other.id) > ids.index(pick.id) or unlike < ALIKE:
            continue
        share = float((taken & (view.change(other) > TAKEN)).sum() / max(taken.sum(), 1))
        if share > SHARED:
            shares[other.id] = percent(share)
    if shares:
        (first, most), *more = shares.items()
        also, them = "".join(f", {id_} {part}" for id_, part in more), "them" if more else "it"
        yield Note(
            f"{first} takes {most} of this too{also}; there the changes mix. If this one "
            f"replaces {them}, disable or remove {them}",
            warns=True,
        )


def _also(it: _Thing) -> Iterator[Note]:
    """Report what the pick takes beside the thing, the largest first."""
    from scipy import ndimage

    pick, view = it.pick, it.view
    change = left = view.change(pick)
    taken = change > TAKEN
    odd, beside = (
        ndimage.binary_opening(taken & where, iterations=2)  # without rims
        for where in (view.hue(pick) > HUE, it.beside)
    )
    beside, elsewhere = beside & ~odd, taken & ~(it.own | it.beside | odd)
    flood = bool(change[beside].sum() > change[it.own & ~odd].sum())
    kinds = [
        ("also takes another hue", odd),
        ("also takes what touches it and looks otherwise", beside),
        ("also takes its colour elsewhere", elsewhere),
    ]
    if not beside.any():
        yield from _flood(it, change)
    unparted, least = False, _least(change)
    for words, others in sorted(kinds, key=lambda kind: -change[kind[1]].sum()):
        if (share := float(change[others].sum() / change.size)) <= least:
            break
        touches = others is beside
        warns = touches and flood
        if not warns and _lost(change, left, others) > 0.5:
            continue  # a hold that is proposed helps here too
        spot = others & it.joined if touches and (others & it.joined).any() else others
        spot = largest_part(spot)[0]
        place = view.place(spot)
        note = Note(f"{words}, {percent(share)}", place, id=pick.id, warns=warns)
        cost = 0.0
        after, own = view.after(pick, "hold", place), it.side(it.own, spot) & ~others
        if after is not None and _parted(change, after, spot, own):
            cost = _lost(change, after, own)
            if cost <= COST or touches:
                note = note.proposing("hold", after, cost)
            if cost <= COST:
                left = np.minimum(left, after)
        unparted |= others is elsewhere or not note.gesture or cost > COST
        if note.gesture or others is not odd:
            yield note
    if unparted and pick.window is None and it.marks:
        yield from _apart(it, change)


def _least(change: F32) -> float:
    """Return the least share of the frame of other things to report."""
    return min(OTHERS, max(OTHERS / 10, OF_TAKEN * float(change.mean())))


def _flood(it: _Thing, change: F32) -> Iterator[Note]:
    """Report a thing that fills the frame with colours unlike the marked ones."""
    own, view = it.own, it.view
    edges = sum(edge.any() for edge in (own[0], own[-1], own[:, 0], own[:, -1]))
    much = change[own].sum() > FLOOD * change.size and edges >= 3
    if it.pick.window is None and it.marks and much:
        points = view.points(view.rgb) * (1, 1, thing.LIGHTNESS)
        away = [np.linalg.norm(points[own] - points[m].mean(axis=0), axis=1) for m in it.marks]
        if (np.min(away, axis=0) > SAME_COLOUR).mean() > FAR:
            words = "takes what looks like one thing, out to the frame's edges; if yours is smaller"
            yield Note(f"{words}, give it a window", id=it.pick.id, warns=True)


def _apart(it: _Thing, change: F32) -> Iterator[Note]:
    """Propose a window around a pick's thing, if that leaves out the rest and costs it little."""
    from scipy import ndimage

    thing_itself = it.view.any_of([ndimage.binary_opening(it.own), *it.marks])
    box = it.view.around(thing_itself)
    after = it.view.within(it.pick, box)
    rest = _lost(change, after, ~thing_itself)
    if (
        rest > 0.5
        and (change - after).mean() > _least(change)
        and _lost(change, after, it.own) <= COST
    ):
        words = "if that is not part of it, a window around the thing leaves it out"
        note = Note(words, id=it.pick.id, window=box)
        yield note.proposing("window", after)
