"""The answer to a pick: the pixels that it takes, others that it also takes, and what would help.

Input: a grade with a pick, and its clip. Output: an `Answer`. Each proposed hold or box has been
tried on the frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.common.text import hex_of, percent
from palette4d.grade import pick_edits
from palette4d.grade.clip_of_picks import ClipOfPicks, largest_part
from palette4d.grade.edits import Colour, as_colour
from palette4d.grade.grade import Grade
from palette4d.grade.mattes import Display, display_curve
from palette4d.grade.picks import Area, Pick
from palette4d.media.source_clip import nearest_frame

F32 = NDArray[np.float32]
B = NDArray[np.bool_]

#: The frame is reduced to about this width, in pixels: more take longer and show nothing more.
WIDTH = 480
#: A pixel that gets at least this share of the change is taken.
TAKEN = 0.25
#: Least shares of the frame to report: of other things that are taken, and of a part of the thing
#: that is not. Smaller ones are seldom seen.
OTHERS, PART = 0.005, 0.01
#: A hold is proposed if it halves what else is taken, and costs the picked thing less than this
#: share of its pixels.
COST = 0.1
#: A pick may take more than one thing if more than MOST of its pixels are farther than FAR from the
#: picked colour (in pick space); more than SOME if it takes more than LARGE of the frame, or covers
#: three of its borders, as skies and walls do.
FAR, MOST, SOME, LARGE = 0.2, 0.6, 0.1, 0.4


@dataclass(frozen=True)
class Place:
    """A place in the frame that a gesture may name.

    Attributes
    ----------
    pixel : (int, int)
    box : int
    rgb : 3 floats
        Its colour, in the palette's code values.
    share : float
        Share of the frame's pixels that it stands for.
    left : float
        The share after the gesture: with a hold, of what is still taken elsewhere; with a box, of
        what the pick takes.
    """

    pixel: tuple[int, int]
    box: int
    rgb: Colour
    share: float
    left: float = 0.0


@dataclass(frozen=True)
class Answer:
    """What a pick or hold does in the frame that it was picked in.

    Attributes
    ----------
    frame : int
    share : float
        Share of the frame's pixels that are taken: they get at least a quarter of the change.
    others : float
        Share of pixels that are taken but not connected with the picked place.
    other : Place or None
        The largest of these regions.
    hold : Place or None
        A hold that helps.
    part : Place or None
        A neighbouring part of the same hue that is not taken; a box there would add it.
    floods : bool
        The pick takes so much that it may be more than one thing.
    """

    frame: int
    share: float
    others: float = 0.0
    other: Place | None = None
    hold: Place | None = None
    part: Place | None = None
    floods: bool = False

    def lines(self, id: str) -> list[str]:
        """Return the answer for people, and the gestures that help as arguments of `edit`."""
        lines = [f"takes {percent(self.share)} of frame {self.frame}"]

        def place(region: Place) -> str:
            return f"{region.pixel[0]},{region.pixel[1]}"

        if self.other is not None:
            lines.append(
                f"also takes {percent(self.others)} elsewhere, most of it {hex_of(self.other.rgb)} "
                f"at {place(self.other)}"
            )
        if self.hold is not None:
            lines.append(
                f"  to keep it: hold --frame {self.frame} --pixel {place(self.hold)} "
                f"--box {self.hold.box} (leaves {percent(self.hold.left)})"
            )
        if self.part is not None:
            lines.append(
                f"does not take {hex_of(self.part.rgb)} at {place(self.part)}, "
                f"{percent(self.part.share)} of the frame"
            )
            lines.append(
                f"  if it belongs to the thing: area {id} --frame {self.frame} "
                f"--pixel {place(self.part)} --box {self.part.box} "
                f"(then takes {percent(self.part.left)})"
            )
        if self.floods:
            lines.append(
                "  warning: this may be more than one thing. Look at its matte (render --output "
                f"pick:{id}); a hold on what must stay, or a lower --reach, takes less"
            )
        return lines


def answer_to(
    grade: Grade, pick: Pick, of_clip: ClipOfPicks, *, tries: bool = True
) -> Answer | None:
    """Return the answer to a pick; None where the clip is not there.

    Without `tries` no hold and no box are proposed, which takes most of the time.
    """
    clip = of_clip.open()
    if clip is None:
        return None
    frame = nearest_frame(clip, pick.frame)
    view = _View.of(grade, of_clip, frame)
    taken = view.taken(grade, pick)
    share = float(taken.mean())
    if pick.kind == "hold":
        return Answer(frame, share)
    seeds = view.seeds(pick, frame)
    own = _connected(taken, seeds)
    others = taken & ~own if seeds.any() else np.zeros_like(taken)
    beside = float(others.mean())
    large = share > LARGE or _borders(own) >= 3
    floods = view.far(pick, own) > (SOME if large else MOST)
    answer = Answer(frame, share, beside, floods=floods)
    if beside > OTHERS:
        answer = replace(answer, other=view.place(others))
        if tries:
            answer = replace(answer, hold=_hold(grade, pick, of_clip, view, own, others))
    part = view.beside(grade, pick, own, taken)
    if tries and part.mean() > max(PART, 0.1 * share) and not pick.whole_hue:
        answer = replace(answer, part=_part(grade, pick, of_clip, view, part, beside))
    return answer


def _hold(
    grade: Grade, pick: Pick, of_clip: ClipOfPicks, view: _View, own: B, others: B
) -> Place | None:
    """Return a hold on the largest other region, if it helps and spares the picked thing."""
    place = view.place(others)
    try:
        trial, _ = pick_edits.hold(
            grade, of_clip, view.frame, pixel=place.pixel, box=place.box, follow=False
        )
    except Palette4dError:
        return None
    taken = view.taken(trial, trial.pick(pick.id))
    left = float((taken & others).mean())
    if left > 0.5 * others.mean() or (taken & own).sum() < (1 - COST) * own.sum():
        return None
    return replace(place, left=left)


def _part(
    grade: Grade, pick: Pick, of_clip: ClipOfPicks, view: _View, part: B, beside: float
) -> Place | None:
    """Return a second box, if it adds the part and little else."""
    place = view.place(part)
    area = Area(view.frame, (place.pixel,), place.box / 2)
    try:
        trial = pick_edits.add_area(grade, of_clip, pick.id, area)
    except Palette4dError:
        return None
    grown = trial.pick(pick.id)
    taken = view.taken(trial, grown)
    others = taken & ~_connected(taken, view.seeds(grown, view.frame))
    if (taken & part).sum() < 0.5 * part.sum() or others.mean() > beside + OTHERS:
        return None
    return replace(place, left=float(taken.mean()))


@dataclass(frozen=True)
class _View:
    """A frame, reduced: every n-th pixel of every n-th row, n = `every`."""

    frame: int
    every: int
    rgb: F32
    real: B
    display: Display | None

    @classmethod
    def of(cls, grade: Grade, of_clip: ClipOfPicks, frame: int) -> _View:
        pixels = of_clip.read(frame)
        every = max(1, round(pixels.shape[1] / WIDTH))
        rgb = np.ascontiguousarray(pixels[every // 2 :: every, every // 2 :: every])
        real = np.asarray(np.isfinite(rgb).all(axis=2))
        shown = np.where(real[..., None], rgb, 0).astype(np.float32)
        return cls(frame, every, shown, real, display_curve(grade.encoding))

    def taken(self, grade: Grade, pick: Pick) -> B:
        """Return the pixels that get at least a quarter of a pick's change."""
        # Any palette will do: none of its colours moves.
        corner, faces = np.zeros((1, 3)), np.zeros((0, 3), np.int32)
        matte = grade.core.pick_matte_at(pick.id, self.frame)
        drawing = _core.Recolourer(corner, corner, faces, picks=matte)
        drawn = drawing.apply(self.rgb, precision="single")
        return np.asarray((drawn - self.rgb)[..., 0] > TAKEN) & self.real

    def far(self, pick: Pick, own: B) -> float:
        """Return the share of a region's pixels whose colours are far from the picked one."""
        if not own.any():
            return 0.0
        distances = _core.pick_distances(self.rgb[own], pick.rgb, self.display)
        return float((distances > FAR).mean())

    def beside(self, grade: Grade, pick: Pick, own: B, taken: B) -> B:
        """Return the largest part of the pick's hue that is connected with it and not taken."""
        from scipy import ndimage

        whole_hue = grade.put("pick", pick.id, replace(pick, matte=None))
        rest = self.taken(whole_hue, pick) & ~taken
        labels, count = ndimage.label(ndimage.binary_opening(rest, iterations=2))
        sizes = np.bincount(labels.ravel(), minlength=1)
        touching = np.zeros(count + 1, bool)
        touching[labels[ndimage.binary_dilation(own, iterations=4)]] = True
        touching[0] = False
        if not touching.any():
            return np.zeros_like(own)
        return np.asarray(labels == np.where(touching, sizes, 0).argmax())

    def seeds(self, pick: Pick, frame: int) -> B:
        """Return the pixels that the user marked in a frame."""
        marked = np.zeros(self.real.shape, bool)
        areas = [area for area in pick.areas if area.frame == frame]
        if pick.pixel is not None and round(pick.frame) == frame:
            areas.append(Area(frame, (pick.pixel,), (pick.box or 1) / 2))
        for area in areas:
            for x, y in area.points:
                half = max(area.radius / self.every, 0.5)
                row, column = y / self.every, x / self.every
                marked[
                    max(0, int(row - half)) : int(row + half) + 1,
                    max(0, int(column - half)) : int(column + half) + 1,
                ] = True
        return marked

    def place(self, mask: B) -> Place:
        """Return the middle of a mask's largest part, and a box that lies in it."""
        largest, (column, row), box = largest_part(mask)
        pixel = column * self.every + self.every // 2, row * self.every + self.every // 2
        rgb = as_colour(np.median(self.rgb[largest], axis=0).tolist())
        return Place(pixel, box * self.every, rgb, float(largest.mean()))


def _connected(mask: B, seeds: B) -> B:
    """Return the regions of a mask that are connected with seeds, across gaps of a pixel or two."""
    from scipy import ndimage

    labels, _ = ndimage.label(ndimage.binary_dilation(mask))
    kept = np.unique(labels[seeds])
    return np.asarray(np.isin(labels, kept[kept > 0]) & mask)


def _borders(mask: B) -> int:
    """Return how many of the frame's borders a mask covers for a third or more."""
    sides = (mask[0], mask[-1], mask[:, 0], mask[:, -1])
    return sum(bool(side.mean() >= 1 / 3) for side in sides)
