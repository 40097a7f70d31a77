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
from palette4d.grade.mattes import display_curve
from palette4d.grade.picks import ALIKE, Area, Pick
from palette4d.media.source_clip import nearest_frame

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
B = NDArray[np.bool_]

#: The frame is reduced to about this width, in pixels: more take longer and show nothing more.
WIDTH = 480
#: A pixel that gets at least this share of the change is taken. One that was marked is not taken if
#: it gets less than LEAST: pale parts of a thing change a little.
TAKEN, LEAST = 0.25, 0.05
#: Least shares of the frame to report: of other things that are taken, of a part of the thing that
#: is not, and of what a hold keeps. Smaller ones are seldom seen.
OTHERS, PART, KEPT = 0.005, 0.01, 0.001
#: An area may add this many times the part that it is for; one that adds more floods.
MULTIPLIES = 1.3
#: A hold may cost the picked thing this share of its pixels. One that costs more is not proposed,
#: and reported.
COST = 0.1
#: A pick that takes more than this share of what another one takes is reported.
SHARED = 0.2
#: A taken colour farther than this from the line of the picked hue in pick space has another hue:
#: faces beside red clothes have 0.08 to 0.12. Below GREY, a picked colour has no hue.
HUE, GREY = 0.08, 0.1
#: A pick may take more than one thing if more than MOST of its pixels are farther than FAR from the
#: picked colour in pick space. If it takes more than LARGE of the frame, or covers three of its
#: borders, as skies and walls do: if SOME are, or SCATTERED of them are not connected with it.
FAR, MOST, SOME, SCATTERED, LARGE = 0.2, 0.6, 0.1, 0.2, 0.25


@dataclass(frozen=True)
class Place:
    """A place that a gesture may name.

    Attributes
    ----------
    frame : int
    pixel : (int, int)
    box : int
    rgb : 3 floats
        Its colour, in the palette's code values.
    """

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

    def lines(self) -> list[str]:
        """Return the note for people, and the gesture as arguments of `edit`."""
        text, at = "warning: " * self.warns + self.words, self.place
        if at is None:
            return [text]
        pixel = f"{at.pixel[0]},{at.pixel[1]}"
        lines = [f"{text}: {hex_of(at.rgb)} at {pixel}"]
        if self.gesture:
            what = "  to keep it: hold"
            if self.gesture == "area":
                what = f"  if it belongs to the thing: area {self.id}"
            where = f"--frame {at.frame} --pixel {pixel} --box {at.box}"
            lines.append(f"{what} {where} ({self.effect})")
        return lines


@dataclass(frozen=True)
class Answer:
    """What a pick or hold does in the frame that it was picked in.

    Attributes
    ----------
    frame : int
    share : float
        Share of the frame's pixels that are taken: they get at least a quarter of the change.
    notes : tuple of Note
        What else the user should know.
    """

    frame: int
    share: float
    notes: tuple[Note, ...] = ()

    def lines(self) -> list[str]:
        """Return the answer for people."""
        first = f"takes {percent(self.share)} of frame {self.frame}"
        return [first, *(line for note in self.notes for line in note.lines())]


def answer_to(grade: Grade, pick: Pick, of_clip: ClipOfPicks) -> Answer | None:
    """Return the answer to a pick or hold; None where the clip is not there."""
    if of_clip.open() is None:
        return None
    view = _View.of(grade, of_clip, pick.frame)
    picks, holds = (
        [p for p in grade.picks if p.enabled and p.id != pick.id and p.kind == kind]
        for kind in ("pick", "hold")
    )
    share = float(view.taken(pick).mean())
    if pick.kind == "hold":
        costs = [_cost(view, other, pick) for other in picks]
        notes = [note for cost in costs for note in cost or ()]
        if picks and all(cost is None for cost in costs):
            notes = [Note("no pick takes less by it: hold a place that one takes", warns=True)]
    else:
        notes = [
            *_unmarked(view, pick, holds),
            *(note for hold in holds for note in _cost(view, pick, hold) or ()),
            *_shared(view, pick, picks),
            *_also(view, pick),
        ]
    return Answer(view.frame, share, tuple(notes))


@dataclass(frozen=True)
class _View:
    """A grade at a frame that is reduced: every n-th pixel of every n-th row, n = `every`."""

    grade: Grade
    of_clip: ClipOfPicks
    frame: int
    every: int
    rgb: F32
    real: B

    @classmethod
    def of(cls, grade: Grade, of_clip: ClipOfPicks, frame: float) -> _View:
        clip = of_clip.open()
        assert clip is not None
        nearest = nearest_frame(clip, frame)
        pixels = of_clip.read(nearest)
        every = max(1, round(pixels.shape[1] / WIDTH))
        rgb = np.ascontiguousarray(pixels[every // 2 :: every, every // 2 :: every])
        real = np.asarray(np.isfinite(rgb).all(axis=2))
        shown = np.where(real[..., None], rgb, 0).astype(np.float32)
        return cls(grade, of_clip, nearest, every, shown, real)

    def change(self, pick: Pick) -> F32:
        """Return how much of a pick's change each pixel gets, in a trial as this grade has it."""
        # Any palette will do: none of its colours moves.
        corner, faces = np.zeros((1, 3)), np.zeros((0, 3), np.int32)
        matte = self.grade.core.pick_matte_at(pick.id, self.frame)
        drawing = _core.Recolourer(corner, corner, faces, picks=matte)
        drawn = drawing.apply(self.rgb, precision="single")
        return np.where(self.real, (drawn - self.rgb)[..., 0], 0).astype(np.float32)

    def taken(self, pick: Pick) -> B:
        """Return the pixels that get at least a quarter of a pick's change."""
        return np.asarray(self.change(pick) > TAKEN)

    def away(self, pick: Pick) -> tuple[F64, F64]:
        """Return each pixel's distance from the picked colour in pick space, and from its hue."""
        display = display_curve(self.grade.encoding)
        points = _core.pick_points(self.rgb.reshape(-1, 3), display).reshape(self.rgb.shape)
        own = _core.pick_points([pick.rgb], display)[0]
        off = points - own
        length = float(np.hypot(own[0], own[1]))
        if length < GREY:
            hue = np.hypot(off[..., 0], off[..., 1])
        else:
            hue = np.abs(off[..., 0] * own[1] - off[..., 1] * own[0]) / length
        return np.linalg.norm(off, axis=2), hue

    def mark(self, area: Area) -> B:
        """Return the pixels of a box or stroke."""
        marked = np.zeros(self.real.shape, bool)
        for x, y in area.points:
            half = max(area.radius / self.every, 0.5)
            row, column = y / self.every, x / self.every
            marked[
                max(0, int(row - half)) : int(row + half) + 1,
                max(0, int(column - half)) : int(column + half) + 1,
            ] = True
        return marked

    def seeds(self, pick: Pick) -> B:
        """Return the pixels that the user marked in this frame."""
        marked = np.zeros(self.real.shape, bool)
        for area in _marks(pick):
            if round(area.frame) == self.frame:
                marked |= self.mark(area)
        return marked

    def own(self, pick: Pick, taken: B) -> B:
        """Return what is connected with what the user marked here; all, if nothing was."""
        seeds = self.seeds(pick)
        return _connected(taken, seeds) if seeds.any() else taken

    def place(self, mask: B) -> Place:
        """Return the middle of a mask's largest part, and a box that lies in it."""
        largest, (column, row), box = largest_part(mask)
        pixel = column * self.every + self.every // 2, row * self.every + self.every // 2
        rgb = as_colour(np.median(self.rgb[largest], axis=0).tolist())
        return Place(self.frame, pixel, box * self.every, rgb)

    def beside(self, pick: Pick, own: B, taken: B) -> B:
        """Return the largest part of the pick's hue that is connected with it and not taken."""
        from scipy import ndimage

        whole_hue = self.grade.put("pick", pick.id, replace(pick, matte=None))
        rest = replace(self, grade=whole_hue).taken(pick) & ~taken
        labels, count = ndimage.label(_opened(rest))
        sizes = np.bincount(labels.ravel(), minlength=1)
        touching = np.zeros(count + 1, bool)
        touching[labels[_widened(own)]] = True
        touching[0] = False
        if not touching.any():
            return np.zeros_like(own)
        return np.asarray(labels == np.where(touching, sizes, 0).argmax())

    def with_hold(self, note: Note, pick: Pick, others: B, thing: B) -> Note:
        """Return a note with a hold at its place, if that helps and spares the picked thing."""
        assert note.place is not None
        pixel, box = note.place.pixel, note.place.box
        try:
            trial, _ = pick_edits.hold(
                self.grade, self.of_clip, self.frame, pixel=pixel, box=box, follow=False
            )
        except Palette4dError:
            return note
        taken = replace(self, grade=trial).taken(trial.pick(pick.id))
        left = taken & others
        if left.sum() > 0.5 * others.sum() or (taken & thing).sum() < (1 - COST) * thing.sum():
            return note
        return replace(note, gesture="hold", effect=f"leaves {percent(left.mean())}")

    def with_area(self, note: Note, pick: Pick, wanted: B) -> Note:
        """Return a note with an area of a pick at its place, if that adds what is wanted alone."""
        assert note.place is not None
        area = Area(self.frame, (note.place.pixel,), note.place.box / 2)
        try:
            trial = pick_edits.add_area(self.grade, self.of_clip, pick.id, area)
        except Palette4dError:
            return note
        taken = replace(self, grade=trial).taken(trial.pick(pick.id))
        more = taken.sum() - self.taken(pick).sum()
        if (taken & wanted).sum() < 0.5 * wanted.sum() or more > MULTIPLIES * wanted.sum():
            return note
        return replace(note, gesture="area", effect=f"then takes {percent(taken.mean())}")


def _unmarked(view: _View, pick: Pick, holds: Sequence[Pick]) -> Iterator[Note]:
    """Tell of what the user marked as the pick's, and it does not take."""
    for area in _marks(pick):
        here = _View.of(view.grade, view.of_clip, area.frame)
        marked = here.mark(area) & here.real
        left = marked & (here.change(pick) < LEAST)
        if left.sum() <= 0.5 * marked.sum():
            continue
        by = [hold.id for hold in holds if (left & here.taken(hold)).sum() > 0.5 * left.sum()]
        why = "it looks like what is around it; pick it too, as a colour of its own"
        if by:
            why = f"{' and '.join(by)} keeps it; remove that hold, or hold another place"
        yield Note(f"does not take what you marked ({why})", here.place(left), warns=True)


def _cost(view: _View, pick: Pick, hold: Pick) -> list[Note] | None:
    """Tell of what a hold costs a pick's thing; None if the pick takes no less by it."""
    if round(pick.frame) != view.frame:
        view = _View.of(view.grade, view.of_clip, pick.frame)
    before = pick_edits.unpick(view.grade, view.of_clip, hold.id)
    was = replace(view, grade=before).taken(before.pick(pick.id))
    lost = was & ~view.taken(pick)
    if lost.mean() < KEPT:
        return None
    # What is connected with the hold is what it is for.
    held, own, seeds = view.own(hold, view.taken(hold)), view.own(pick, was), view.seeds(pick)
    if (held & seeds).sum() > 0.5 * seeds.sum():
        thing, words = own, f"{hold.id} lies on what {pick.id} takes, and costs it {{}}"
    else:
        thing, words = (
            own & ~_widened(held),
            f"{hold.id} also costs {pick.id} {{}} of its own thing",
        )
        lost = _opened(lost & thing)
        if lost.sum() <= COST * thing.sum():
            return []
    place, share = view.place(lost), percent(float(lost.sum() / max(thing.sum(), 1)))
    note = Note(f"{words.format(share)}, most of it", place, id=pick.id, warns=True)
    tried = view.with_area(note, pick, lost)
    if not tried.gesture:
        words = f"{words.format(share)} (remove it, or hold another place), most of it"
        tried = replace(note, words=words)
    return [tried]


def _shared(view: _View, pick: Pick, picks: Sequence[Pick]) -> Iterator[Note]:
    """Tell of earlier picks that take the same pixels, and change them otherwise."""
    taken, ids = view.taken(pick), [each.id for each in view.grade.picks]
    for other in picks:
        unlike = np.linalg.norm(pick.change_at(view.frame) - other.change_at(view.frame))
        if ids.index(other.id) > ids.index(pick.id) or unlike < ALIKE:
            continue
        both = taken & view.taken(other)
        if both.sum() > SHARED * taken.sum():
            share = percent(float(both.sum() / taken.sum()))
            words = f"{other.id} takes {share} of this too; there the changes mix"
            yield Note(
                f"{words}. If this one replaces it, disable or remove {other.id}", warns=True
            )


def _also(view: _View, pick: Pick) -> Iterator[Note]:
    """Tell of what the pick takes beside the thing, of what it may lack, and of floods."""
    taken = view.taken(pick)
    own = view.own(pick, taken)
    away, hue = view.away(pick)
    odd, elsewhere = _opened(taken & (hue > HUE)), taken & ~own
    for words, others in (
        ("also takes another hue", odd),
        ("also takes its colour elsewhere", elsewhere & ~odd),
    ):
        if others.mean() > OTHERS:
            share = percent(float(others.mean()))
            note = Note(f"{words}, {share}, most of it", view.place(others), id=pick.id)
            yield view.with_hold(note, pick, others, own & ~others)
    part = view.beside(pick, own, taken)
    least = max(PART, 0.1 * taken.mean())
    if least < part.mean() < own.mean() and not pick.whole_hue:  # a larger part is another thing
        words = f"does not take {percent(float(part.mean()))} beside it"
        note = view.with_area(Note(words, view.place(part), id=pick.id), pick, part)
        if note.gesture:
            yield note
    large = taken.mean() > LARGE or _borders(own) >= 3
    far = (away[own] > FAR).mean() if own.any() else 0
    if far > (SOME if large else MOST) or (large and elsewhere.sum() > SCATTERED * taken.sum()):
        less = ", or a lower reach, takes less" if pick.reach >= 0 else " takes less"
        words = (
            f"this may be more than one thing: look at its matte. A hold on what must stay{less}"
        )
        yield Note(words, warns=True)


def _marks(pick: Pick) -> list[Area]:
    """Return the box and the areas of a pick or hold."""
    own = [] if pick.pixel is None else [Area(pick.frame, (pick.pixel,), (pick.box or 1) / 2)]
    return [*own, *pick.areas]


def _connected(mask: B, seeds: B) -> B:
    """Return the regions of a mask that are connected with seeds, across gaps of a pixel or two."""
    from scipy import ndimage

    labels, _ = ndimage.label(ndimage.binary_dilation(mask))
    kept = np.unique(labels[seeds])
    return np.asarray(np.isin(labels, kept[kept > 0]) & mask)


def _opened(mask: B) -> B:
    """Return a mask without rims and single pixels."""
    from scipy import ndimage

    return np.asarray(ndimage.binary_opening(mask, iterations=2))


def _widened(mask: B) -> B:
    from scipy import ndimage

    return np.asarray(ndimage.binary_dilation(mask, iterations=4))


def _borders(mask: B) -> int:
    """Return how many of the frame's borders a mask covers for a third or more."""
    sides = (mask[0], mask[-1], mask[:, 0], mask[:, -1])
    return sum(bool(side.mean() >= 1 / 3) for side in sides)
