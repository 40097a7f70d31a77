"""The answer to a pick or hold: the pixels that it takes, and notes with what would help.

Input: a grade with a pick, and its clip. Output: an `Answer`. Each gesture that a note proposes has
been tried on the frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.text import hex_of, percent
from palette4d.grade import pick_edits
from palette4d.grade.clip_of_picks import ClipOfPicks, largest_part
from palette4d.grade.edits import Colour, as_colour
from palette4d.grade.grade import Grade
from palette4d.grade.pick_edits import When
from palette4d.grade.picks import ALIKE, Area, Pick
from palette4d.media.source_clip import nearest_frame

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
B = NDArray[np.bool_]

#: The frame is reduced to about this width, in pixels: more take longer and show nothing more.
WIDTH = 480
#: Least share of the change of a pixel that counts as taken. A marked pixel with less than LEAST is
#: reported: pale parts of a thing change a little.
TAKEN, LEAST = 0.25, 0.05
#: Least shares of the frame to report: of other things that are taken, and of a part of the thing
#: that is not. Smaller areas are seldom seen.
OTHERS, PART = 0.005, 0.01
#: A proposed box may add at most this many times the part that it is for; more is a flood.
MULTIPLIES = 1.3
#: Largest share of the picked thing that a hold may cost unreported; a proposed one, half of it.
COST = 0.1
#: A pick that takes more than this share of the pixels of another pick is reported.
SHARED = 0.2
#: A taken colour farther than this from the line of the picked hue, in pick space, has another hue:
#: faces beside red clothes have 0.08 to 0.12. A picked colour with less chroma than GREY has none.
HUE, GREY = 0.08, 0.1
#: A pick may take more than one thing if more than MOST of its pixels are farther than FAR from the
#: picked colour in pick space; SOME are enough if it takes more than LARGE of the frame, or covers
#: three of its borders, as skies and walls do.
FAR, MOST, SOME, LARGE = 0.2, 0.6, 0.1, 0.25


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
    gesture : {"", "hold", "area"}
        What helps there: a hold, or an area of the pick `id`. It was tried.
    effect : str
        What the gesture leads to.
    id : str
        The pick that the note is about.
    warns : bool
        Something does not do what it looks like.
    """

    words: str
    place: Place | None = None
    gesture: Literal["", "hold", "area"] = ""
    effect: str = ""
    id: str = ""
    warns: bool = False

    def proposing(self, gesture: Literal["hold", "area"], taken: B) -> Note:
        """Return the note with a gesture, after which the pick takes some pixels."""
        return replace(self, gesture=gesture, effect=f"then takes {percent(taken.mean())}")

    def lines(self) -> list[str]:
        """Return the note for people, and the gesture as arguments of `edit`."""
        text, place = "warning: " * self.warns + self.words, self.place
        if place is None:
            return [text]
        pixel = f"{place.pixel[0]},{place.pixel[1]}"
        lines = [f"{text}: {hex_of(place.rgb)} at {pixel}"]
        if self.gesture:
            what = f"if it belongs to the thing: area {self.id}"
            if self.gesture == "hold":
                what = "to keep it: hold"
            where = f"--frame {place.frame} --pixel {pixel} --box {place.box}"
            lines.append(f"  {what} {where} ({self.effect})")
        return lines


@dataclass(frozen=True)
class Answer:
    """What a pick or hold does in the frame that it was picked in.

    Attributes
    ----------
    frame : int
    share : float
        Share of the frame's pixels that are taken: they get at least a quarter of the change. Of a
        hold: that it keeps.
    notes : tuple of Note
        What else the user should know.
    kind : 'pick' or 'hold'
    """

    frame: int
    share: float
    notes: tuple[Note, ...] = ()
    kind: Literal["pick", "hold"] = "pick"

    def lines(self) -> list[str]:
        """Return the answer for people."""
        verb = "takes" if self.kind == "pick" else "keeps"
        first = f"{verb} {percent(self.share)} of frame {self.frame}"
        return [first, *(line for note in self.notes for line in note.lines())]


def answer_to(grade: Grade, pick: Pick, clip: ClipOfPicks) -> Answer | None:
    """Return the answer to a pick or hold; None where the clip is not there."""
    if clip.open() is None:
        return None
    # A range may leave the frame of the pick out: what it takes is the same.
    pick = replace(pick, start=None, until=None)
    grade = grade.put("pick", pick.id, pick)
    view = _View.of(grade, clip, pick.frame)
    others = [other for other in grade.picks if other.enabled and other.id != pick.id]
    picks = [other for other in others if other.kind == "pick"]
    notes: list[Note] = []
    if pick.kind == "hold":
        without = pick_edits.unpick(grade, clip, pick.id)
        for other in picks:
            if (cost := _cost(view, other, pick, without)) is not None:
                notes += [_less(view, other, without), *cost]
        if picks and not notes:
            notes = [Note("no pick takes less by it: hold a place that one takes", warns=True)]
    else:
        holds = [other for other in others if other.kind == "hold"]
        notes += _unmarked(view, pick, holds)
        for hold in holds:
            notes += _cost(view, pick, hold, pick_edits.unpick(grade, clip, hold.id)) or ()
        notes += _shared(view, pick, picks)
        notes += _also(view, pick)
    kind: Literal["pick", "hold"] = "hold" if pick.kind == "hold" else "pick"
    return Answer(view.frame, float(view.taken(pick).mean()), tuple(notes), kind)


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

    def change(self, pick: Pick) -> F32:
        """Return the share of a pick's change that each pixel gets, with this view's grade."""
        # Any palette will do: none of its colours moves.
        corner, faces = np.zeros((1, 3)), np.zeros((0, 3), np.int32)
        matte = self.grade.core.pick_matte_at(pick.id, self.frame)
        drawing = _core.Recolourer(corner, corner, faces, picks=matte)
        drawn = drawing.apply(self.rgb, precision="single")
        return np.where(self.real, (drawn - self.rgb)[..., 0], 0).astype(np.float32)

    def taken(self, pick: Pick, grade: Grade | None = None) -> B:
        """Return the pixels that a pick takes, with this view's grade or another one."""
        view = self if grade is None else replace(self, grade=grade)
        return np.asarray(view.change(pick) > TAKEN)

    def away(self, pick: Pick) -> tuple[F64, F64]:
        """Return each pixel's distance in pick space from the nearest marked colour, and hue."""
        display = self.grade.display()
        points = _core.pick_points(self.rgb.reshape(-1, 3), display).reshape(self.rgb.shape)
        marked = [self.rgb[self.mark(area) & self.real] for area in pick.areas if self.has(area)]
        colours = [pick.rgb, *(np.median(rgb, axis=0) for rgb in marked if len(rgb))]
        distances, hues = [], []
        for own in _core.pick_points(np.asarray(colours), display):
            off = points - own
            chroma = float(np.hypot(own[0], own[1]))
            distances.append(np.linalg.norm(off, axis=2))
            if chroma < GREY:
                hues.append(np.hypot(off[..., 0], off[..., 1]))
            else:
                hues.append(np.abs(off[..., 0] * own[1] - off[..., 1] * own[0]) / chroma)
        return np.min(distances, axis=0), np.min(hues, axis=0)

    def has(self, area: Area) -> bool:
        """Return whether an area was marked in this frame."""
        return round(area.frame) == self.frame

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

    def seeds(self, pick: Pick) -> B:
        """Return the pixels that the user marked in this frame."""
        marks = [self.mark(area) for area in pick.marks if self.has(area)]
        return np.asarray(np.any([np.zeros(self.real.shape, bool), *marks], axis=0))

    def thing(self, pick: Pick, taken: B) -> B:
        """Return what is connected with what the user marked here; all, if nothing was."""
        from scipy import ndimage

        seeds = self.seeds(pick)
        if not seeds.any():
            return taken
        labels, _ = ndimage.label(ndimage.binary_dilation(taken))  # across gaps of a pixel or two
        kept = np.unique(labels[seeds])
        return np.asarray(np.isin(labels, kept[kept > 0]) & taken)

    def place(self, mask: B) -> Place:
        """Return the middle of a mask's largest part, and a box that lies in it."""
        largest, (column, row), box = largest_part(mask)
        pixel = column * self.every + self.every // 2, row * self.every + self.every // 2
        rgb = as_colour(np.median(self.rgb[largest], axis=0).tolist())
        return Place(self.frame, pixel, box * self.every, rgb)

    def beside(self, pick: Pick, thing: B, taken: B) -> B:
        """Return the largest part of the pick's hue that is connected with it and not taken."""
        from scipy import ndimage

        whole_hue = self.grade.put("pick", pick.id, replace(pick, matte=None))
        labels, count = ndimage.label(_opened(self.taken(pick, whole_hue) & ~taken))
        sizes = np.bincount(labels.ravel(), minlength=1)
        touching = np.zeros(count + 1, bool)
        touching[labels[_widened(thing)]] = True
        touching[0] = False
        if not touching.any():
            return np.zeros_like(thing)
        return np.asarray(labels == np.where(touching, sizes, 0).argmax())

    def after(self, pick: Pick, gesture: Literal["hold", "area"], place: Place) -> B | None:
        """Return what a pick takes after a gesture at a place; None if the gesture is refused."""
        try:
            if gesture == "hold":
                where = When(pixel=place.pixel, box=place.box, follow=False)
                trial, _ = pick_edits.hold(self.grade, self.clip, self.frame, **where)
            else:
                area = Area(self.frame, (place.pixel,), place.box / 2)
                trial = pick_edits.add_area(self.grade, self.clip, pick.id, area)
        except Palette4dError:
            return None
        return self.taken(trial.pick(pick.id), trial)

    def with_area(self, note: Note, place: Place, pick: Pick, part: B) -> Note:
        """Return a note with an area of a pick at its place, if that adds a part and no more."""
        most = self.taken(pick).sum() + MULTIPLIES * part.sum()
        taken = self.after(pick, "area", place)
        if taken is None or taken[part].mean() < 0.5 or taken.sum() > most:
            return note
        return note.proposing("area", taken)


def _unmarked(view: _View, pick: Pick, holds: Sequence[Pick]) -> Iterator[Note]:
    """Report areas that the user marked as the pick's and that it does not take."""
    for area in pick.marks:
        if (strength := pick.strength_at(area.frame, 1.0)) < 0.5:
            if area.frame != pick.frame:
                yield Note(
                    f"{percent(strength)} of the change at frame {area.frame:g}, where you marked "
                    f"it: its colour was not found there (correct {pick.id})",
                    warns=True,
                )
            continue
        there = _View.of(view.grade, view.clip, area.frame)
        marked = there.mark(area) & there.real
        left = marked & (there.change(pick) < LEAST)
        if left.sum() <= 0.5 * marked.sum():
            continue
        keepers = [hold.id for hold in holds if there.taken(hold)[left].mean() > 0.5]
        why = "it looks like what is around it; pick it too, as a colour of its own"
        if keepers:
            why = f"{' and '.join(keepers)} keeps it; remove that hold, or hold another place"
        yield Note(f"does not take what you marked ({why})", there.place(left), warns=True)


def _less(view: _View, pick: Pick, without: Grade) -> Note:
    """Report what a pick takes with a hold and without it."""
    now, before = (float(view.taken(pick, grade).mean()) for grade in (view.grade, without))
    return Note(
        f"{pick.id} takes {percent(now)} of frame {view.frame}, {percent(before)} without it"
    )


def _cost(view: _View, pick: Pick, hold: Pick, without: Grade) -> list[Note] | None:
    """Report what a hold costs a pick's thing; None if the pick takes no less by it.

    `without` is the grade without the hold.
    """
    there = _View.of(view.grade, view.clip, pick.frame)
    lost, elsewhere = (
        replace(each, grade=without).change(without.pick(pick.id)) - each.change(pick) > TAKEN
        for each in (there, view)
    )
    if not lost.any() and not elsewhere.any():
        return None
    thing, seeds = there.thing(pick, there.taken(without.pick(pick.id), without)), there.seeds(pick)
    words = f"{hold.id} lies on what you picked for {pick.id}, and costs it {{}}"
    if not seeds.any() or lost[seeds].mean() <= 0.5:
        words = f"{hold.id} also costs {pick.id} {{}} of its own thing"
        held = _widened(there.thing(hold, there.taken(hold)))
        thing = thing & ((there.away(pick)[0] < there.away(hold)[0]) | ~held)
        lost = _opened(lost & thing)
        if lost.sum() <= COST * thing.sum():
            return []
    words = words.format(percent(float(lost.sum() / max(thing.sum(), 1))))
    place = there.place(lost)
    note = Note(f"{words}, most of it", place, id=pick.id, warns=True)
    tried = there.with_area(note, place, pick, lost)
    if not tried.gesture:
        tried = replace(note, words=f"{words} (remove it, or hold another place), most of it")
    return [tried]


def _shared(view: _View, pick: Pick, picks: Sequence[Pick]) -> Iterator[Note]:
    """Report earlier picks that take the same pixels, and change them otherwise."""
    taken, ids = view.taken(pick), [each.id for each in view.grade.picks]
    shares = {}
    for other in picks:
        unlike = np.linalg.norm(pick.change_at(view.frame) - other.change_at(view.frame))
        if ids.index(other.id) > ids.index(pick.id) or unlike < ALIKE:
            continue
        share = float((taken & view.taken(other)).sum() / max(taken.sum(), 1))
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


def _also(view: _View, pick: Pick) -> Iterator[Note]:
    """Report what the pick takes beside the thing, a part that it may lack, and floods."""
    taken = view.taken(pick)
    thing = view.thing(pick, taken)
    away, hue = view.away(pick)
    odd = _opened(taken & (hue > HUE))
    for words, others in (
        ("also takes another hue", odd),
        ("also takes its colour elsewhere", taken & ~thing & ~odd),
    ):
        share, spared = float(others.mean()), thing & ~others
        if share > OTHERS:
            place = view.place(others)
            note = Note(f"{words}, {percent(share)}, most of it", place, id=pick.id)
            held = view.after(pick, "hold", place)
            if held is not None and held[others].mean() <= 0.5:
                cost = (~held & spared).sum()
                note = note.proposing("hold", held) if cost <= COST / 2 * spared.sum() else note
            yield note
    part = view.beside(pick, thing, taken)
    least = max(PART, 0.1 * taken.mean())
    if least < part.mean() < thing.mean() and not pick.whole_hue:  # a larger one is another thing
        words, place = f"does not take {percent(float(part.mean()))} beside it", view.place(part)
        note = view.with_area(Note(words, place, id=pick.id), place, pick, part)
        if note.gesture:
            yield note
    sides = (thing[0], thing[-1], thing[:, 0], thing[:, -1])
    large = taken.mean() > LARGE or sum(bool(side.mean() >= 1 / 3) for side in sides) >= 3
    if thing.any() and (away[thing] > FAR).mean() > (SOME if large else MOST):
        less = ", or a lower reach, takes less" if pick.reach >= 0 else " takes less"
        yield Note(
            f"this may be more than one thing: look at its matte. A hold on what must stay{less}",
            warns=True,
        )


def _opened(mask: B) -> B:
    """Return a mask without rims and single pixels."""
    from scipy import ndimage

    return np.asarray(ndimage.binary_opening(mask, iterations=2))


def _widened(mask: B) -> B:
    from scipy import ndimage

    return np.asarray(ndimage.binary_dilation(mask, iterations=4))
