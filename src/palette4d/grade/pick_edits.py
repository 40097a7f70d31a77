"""Picks and holds of a palette: made, changed, removed; and what they do."""

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.text import hex_of
from palette4d.grade import edits
from palette4d.grade.colour_moves import range_text
from palette4d.grade.edits import Change, Colour, Edit, as_colour
from palette4d.grade.handles import unknown
from palette4d.grade.picks import MOST_PICKS, Area, Pick, Toward, all_picks, check
from palette4d.grade.recolouring import Recolouring

if TYPE_CHECKING:
    from palette4d.grade.answer import Answer
    from palette4d.grade.clip_of_picks import ClipOfPicks

Path = str | os.PathLike[str]
#: A picked colour that is farther than this from what was asked, 3 of 255, is told.
MET = 0.012
Progress = Callable[[int, int], object]


class PickEdits(Recolouring):
    """The picks and locks of a palette. `mattes` learns what colours they take."""

    _reading: "ClipOfPicks | None" = None  # the clip of a trial, open already

    def trial_of_picks(self, of_clip: "ClipOfPicks") -> Self:
        """Return a trial whose picks are learned from frames of a clip that were read already."""
        new = self.trial()
        new._reading = of_clip
        return new

    @property
    def picks(self) -> tuple[Pick, ...]:
        """The picks and holds, in the order of their ids."""
        return all_picks(edits.to_fields(self._state, ()))

    def pick(
        self,
        frame: float,
        *,
        colour: Iterable[float] | str | None = None,
        pixel: tuple[float, float] | None = None,
        box: int = 1,
        areas: Sequence[Area] = (),
        to: Iterable[float] | str | None = None,
        by: Iterable[float] | None = None,
        clip: Path | None = None,
        follow: bool = True,
        toward: Toward = "shift",
        start: float | None = None,
        until: float | None = None,
        fade: float = 0.0,
        whole_hue: bool = False,
        reach: float = 0.0,
        softness: float = 0.5,
        lightness: tuple[float, float] = (0.0, 1.0),
        any_value: bool = False,
        progress: Progress | None = None,
    ) -> Pick:
        """Change a thing's colour into another one, and nothing else.

        Which colours are the thing's is learned from the frame and from a few further frames of the
        clip: what is connected with the picked place is the thing (docs/grading.md).

        Parameters
        ----------
        frame : float
            Where the colour is picked.
        colour : 3 floats or "#rrggbb"
            The picked colour as it is before edits, in the palette's code values.
        pixel : (float, float)
            Instead of `colour`: a pixel of the clip's frame, x from the left, y from the top.
        box : int
            With `pixel`: the side of the box around it whose mean is picked.
        areas : sequence of Area
            More parts of the thing: boxes and strokes.
        to, by : 3 floats
            The new colour, or the change; one of them.
        clip : path, optional
            The clip; default: the sidecar's. Without a clip the pick takes all of its hue.
        follow : bool
            Follow the colour through the clip. Without the clip, or without this, the pick is at
            the same colour in all frames.
        toward : {"shift", "colour"}
            At other frames: the same change, or the same new colour.
        start, until : float, optional
            First and last frame with the full change; default: the clip's.
        fade : float
            Frames of the ramps before `start` and after `until`; beyond them nothing changes.
        whole_hue : bool
            Take all colours of the hue, as a qualifier does; learn nothing.
        reach : float
            Log odds, -8..8: above 0 the pick takes more colours, below 0 fewer.
        softness : float
            How soft the matte is, 0..1.
        lightness : (float, float)
            The lowest and the highest lightness that change.
        any_value : bool
            Take colours such as 255 128 0 as they are.
        progress : callable, optional
            Called as progress(done, total) while frames are read.

        Returns
        -------
        Pick
            With its id and its path.

        Raises
        ------
        Palette4dError
            A value is out of range, or the clip does not fit.
        """
        at = self._picked(frame, colour, pixel, box, clip, any_value)
        if to is not None and by is None:
            new = self._checked(to, any_value)
        elif by is not None and to is None:
            change = as_colour(by, "change")
            new = as_colour([a + b for a, b in zip(at.rgb, change, strict=True)])
        else:
            raise Palette4dError(
                f"found {'neither' if to is None else 'both'} of the new colour (to) and the "
                "change (by), expected one of them"
            )
        found = replace(at, kind="pick", to=new, toward=toward, start=start, until=until, fade=fade)
        found = replace(found, areas=tuple(areas), whole_hue=whole_hue)
        found = replace(found, reach=reach, softness=softness, lightness=lightness)
        return self._add_pick(found, clip, follow, progress)

    def hold(
        self,
        frame: float,
        *,
        colour: Iterable[float] | str | None = None,
        pixel: tuple[float, float] | None = None,
        box: int = 1,
        areas: Sequence[Area] = (),
        clip: Path | None = None,
        follow: bool = True,
        start: float | None = None,
        until: float | None = None,
        fade: float = 0.0,
        any_value: bool = False,
        progress: Progress | None = None,
    ) -> Pick:
        """Keep a thing's colour as it is, whatever picks and handles do; as `pick`."""
        at = self._picked(frame, colour, pixel, box, clip, any_value)
        found = replace(at, start=start, until=until, fade=fade, areas=tuple(areas))
        return self._add_pick(found, clip, follow, progress)

    def correct_path(
        self,
        id: str,
        frame: float,
        *,
        colour: Iterable[float] | str | None = None,
        pixel: tuple[float, float] | None = None,
        box: int = 1,
        clip: Path | None = None,
        any_value: bool = False,
        progress: Progress | None = None,
    ) -> Pick:
        """Say where the colour of a pick or hold is at another frame; it is followed again.

        Between two given frames the path goes gradually from what follows the one to what follows
        the other.
        """
        from palette4d.grade.clip_of_picks import corrected

        at = self._picked(frame, colour, pixel, box, clip, any_value)
        found = corrected(self._pick(id), at.frame, at.rgb)
        of_clip = self._clip_of_picks(clip)
        found = replace(found, path=of_clip.path(found, progress))
        label = f"correct {id}: {hex_of(at.rgb)} at frame {frame:g}"
        self._put_learned(found, of_clip, label)
        return self._pick(id)

    def add_area(
        self,
        id: str,
        area: Area,
        *,
        clip: Path | None = None,
    ) -> Pick:
        """Say that a box or a stroke of a frame belongs to a pick or hold too; it learns again."""
        old = self._pick(id)
        self.check_frame(area.frame)
        of_clip = self._clip_of_picks(clip)
        if of_clip.open() is None:
            raise Palette4dError(
                f"the clip {self._fields['clip']['source']!r} is not there, so that nothing can be "
                f"learned from its pixels; give {Arg('clip')}"
            )
        of_clip.check_places(area.frame, area.points)
        found = replace(old, areas=(*old.areas, area), whole_hue=False)
        what = "a box" if len(area.points) == 1 else "a stroke"
        self._put_learned(found, of_clip, f"add {what} at frame {area.frame:g} to {id}")
        return self._pick(id)

    def change_pick(
        self,
        id: str,
        *,
        by: Iterable[float] | None = None,
        follow: bool | None = None,
        any_value: bool = False,
        clip: Path | None = None,
        progress: Progress | None = None,
        **changes: Any,
    ) -> Pick:
        """Change a pick or hold: any of the attributes of `Pick` but id, kind, path and matte.

        `by` gives the new colour as offsets from the picked colour. A new `frame`, `rgb` or range
        is followed again, if the pick was followed. `follow` begins or ends that. Where its place
        or a hold changes, mattes are learned again.
        """
        old = self._pick(id)
        if by is not None:
            base = as_colour(changes.get("rgb", old.rgb))
            changes["to"] = [a + b for a, b in zip(base, as_colour(by, "offset"), strict=True)]
        for name in ("rgb", "to"):
            if name in changes:
                changes[name] = self._checked(changes[name], any_value)
        bad = {"to", "toward", "whole_hue", "reach", "softness", "lightness"} & changes.keys()
        if old.kind == "hold" and bad:
            raise Palette4dError(f"{id} is a hold, which has no {' and no '.join(sorted(bad))}")
        new = replace(old, **changes)
        self._check_pick(new)
        moved = {"frame", "rgb", "start", "until", "fade"} & changes.keys()
        if follow is False:
            new = replace(new, path=())
        elif follow or (moved and old.path):
            given = tuple(key for key in old.path if key.given and key.frame != old.frame)
            path = self._clip_of_picks(clip).path(replace(new, path=given), progress)
            new = replace(new, path=path)
        label = f"change {id}: {_changed(old, new)}"
        if old.enabled != new.enabled:
            label = f"{'enable' if new.enabled else 'disable'} {id}"
        learns = moved or {"pixel", "box", "areas", "whole_hue"} & changes.keys()
        if learns or follow is not None or (new.kind == "hold" and old.enabled != new.enabled):
            self._put_learned(new, self._clip_of_picks(clip), label)
        else:
            self._put("pick", id, new.to_fields(), label)
        return self._pick(id)

    def unpick(self, *ids: str, clip: Path | None = None) -> None:
        """Remove picks and holds. Without a hold, the others' mattes are learned again."""
        holds = any(self._pick(id_).kind == "hold" for id_ in ids)
        with self.one_step(f"remove {' '.join(ids)}"):
            self._remove([("pick", id_) for id_ in dict.fromkeys(ids)], "")
            if holds:
                self._learn_again(self._clip_of_picks(clip))

    def lock(self, *ids: str) -> None:
        """Keep vertices and stops where they are: moves of tracks and of the palette leave them."""
        for id_ in ids:
            if id_ not in self._settings:
                self._handles.vertex(id_, self._settings)
        with self.one_step(f"lock {' '.join(ids)}"):
            for id_ in ids:
                self._put("lock", id_, True, "")

    def unlock(self, *ids: str) -> None:
        """Let tracks and the palette move these vertices and stops again."""
        for id_ in ids:
            if ("lock", id_) not in self._state:
                locked = [known for kind, known in self._state if kind == "lock"]
                raise unknown(id_, "lock", locked, "`picks` or `Document.locks`")
        self._remove([("lock", id_) for id_ in dict.fromkeys(ids)], f"unlock {' '.join(ids)}")

    @property
    def locks(self) -> tuple[str, ...]:
        """The ids of the handles that stay when tracks or the palette move."""
        return tuple(edits.to_fields(self._state, ()).get("locks", ()))

    def answer(self, id: str, clip: Path | None = None, *, tries: bool = True) -> "Answer | None":
        """Return what a pick takes of its frame, what else it takes, and what would help.

        None where the clip is not there. Without `tries` nothing is proposed; it is quicker.
        """
        from palette4d.grade import answer

        return answer.of(self, self._pick(id), self._clip_of_picks(clip), tries=tries)

    def pick_warnings(self, id: str, clip: Path | None = None) -> tuple[str, ...]:
        """Return what speaks against the clip of a pick or hold, and its colour."""
        from palette4d.grade.clip_colours import ClipColours

        pick = self._pick(id)
        known = ClipColours(self.core.polytope, self._fields)
        stored = [known.colours_at(pick.frame), *known.colours] if known.colours else []
        found = self._clip_of_picks(clip).warnings(pick, stored)
        found += self._unmet(pick)
        outside = pick.to is not None and not all(-0.05 <= value <= 1.05 for value in pick.to)
        if outside and not self.scene_linear:
            found += (f"the new colour of {id} lies far outside 0..1; most files clip it",)
        return found

    def _unmet(self, pick: Pick) -> tuple[str, ...]:
        """Return a line if a picked colour does not become what is asked, with the likely cause."""
        step = self.frames[2]
        if not pick.enabled or pick.strength_at(pick.frame, step) < 1:
            return ()
        image = np.array(pick.rgb, np.float32)[None, None]
        found = self.recolour(image, pick.frame, space="palette", clean_up=0)[0, 0]
        off = float(np.linalg.norm(found - pick.rgb - pick.change_at(pick.frame)))
        others = [p for p in self.picks if p.enabled and p.id != pick.id]
        if off <= MET or not others:
            return ()
        away = [float(np.linalg.norm(p.colour_at(pick.frame) - pick.rgb)) for p in others]
        near = others[int(np.argmin(away))]
        return (
            f"{pick.id} is off by {off:.3f}: {near.id} has nearly the same colour, {min(away):.3f} "
            f"away, and asks for something else. Change or disable one of {pick.id} and {near.id}",
        )

    def colour_of_pixel(
        self,
        frame: float,
        pixel: tuple[float, float],
        box: int = 1,
        clip: Path | None = None,
    ) -> Colour:
        """Return the mean colour of a box around a pixel of the clip, in the palette's values."""
        self.check_frame(frame)
        return self._clip_of_picks(clip).colour(frame, pixel, box)

    def _clip_of_picks(self, clip: Path | None) -> "ClipOfPicks":
        from palette4d.grade.clip_of_picks import ClipOfPicks

        if self._reading is not None:
            return self._reading
        conversion = self._conversion("input")
        return ClipOfPicks(self._fields["clip"], conversion, self.path, clip)

    def _picked(
        self,
        frame: float,
        colour: Iterable[float] | str | None,
        pixel: tuple[float, float] | None,
        box: int,
        clip: Path | None,
        any_value: bool,
    ) -> Pick:
        """Return a hold of a colour at a frame."""
        self.check_frame(frame)
        if colour is not None and pixel is None:
            return Pick("", "hold", frame, self._checked(colour, any_value))
        if colour is None and pixel is not None:
            rgb = self._clip_of_picks(clip).colour(frame, pixel, box)
            return Pick("", "hold", frame, rgb, pixel=pixel, box=box)
        raise Palette4dError(
            f"found {'neither' if colour is None else 'both'} of a colour and a pixel, expected "
            "one of them"
        )

    def _add_pick(
        self,
        found: Pick,
        clip: Path | None,
        follow: bool,
        progress: Callable[[int, int], object] | None,
    ) -> Pick:
        enabled = sum(
            kind == "pick" and v.get("enabled", True) for (kind, _), v in self._state.items()
        )
        if enabled >= MOST_PICKS:
            raise Palette4dError(
                f"there are {enabled} picks and holds, and at most {MOST_PICKS} can be "
                "enabled; remove or disable some (`unpick`, `disable`)"
            )
        self._check_pick(found)
        of_clip = self._clip_of_picks(clip)
        for area in found.areas:
            of_clip.check_places(area.frame, area.points)
        if follow:
            found = replace(found, path=of_clip.path(found, progress))
        for kind, id_ in self._state:
            if kind == "pick" and _same(self._pick(id_), found):
                off = "" if self._pick(id_).enabled else f", disabled: `enable {id_}`"
                raise Palette4dError(f"{id_} is this {found.kind} already{off}; nothing was added")
        taken = (id_ for kind, id_ in self._state if kind == "pick")
        found = replace(found, id=edits.new_id("p", taken))
        self._put_learned(found, of_clip, f"{found.kind} {found.id}: {_asked(found)}")
        return self._pick(found.id)

    def _take_picks(self, picks: Iterable[Pick], clip: Path | None) -> tuple[str, ...]:
        """Take over picks of another clip, learned here; return those whose colour is not here.

        Without the clip they take all of their hue, as they cannot be learned.
        """
        of_clip = self._clip_of_picks(clip)
        left_out = []
        # Holds first: they are background for the picks.
        for pick in sorted(picks, key=lambda pick: pick.kind == "pick"):
            if of_clip.open() is None or pick.whole_hue:
                found: Pick | None = pick
            else:
                found = of_clip.at_home(pick, self._display_of_clip())
            if found is None:
                left_out.append(f"{pick.id} ({_asked(pick)})")
                continue
            if of_clip.open() is not None:
                found = replace(found, path=of_clip.path(replace(found, path=())))
            self._put("pick", pick.id, self._learned(found, of_clip).to_fields(), "")
        return tuple(left_out)

    def _put_learned(self, pick: Pick, of_clip: "ClipOfPicks", label: str) -> None:
        """Set a pick or hold with a new matte, as one step; a hold changes the others' mattes."""
        learned = self._learned(pick, of_clip)
        with self.one_step(label):
            self._put("pick", pick.id, learned.to_fields(), "")
            if pick.kind == "hold":
                self._learn_again(of_clip)

    def _learn_again(self, of_clip: "ClipOfPicks") -> None:
        """Learn the mattes of all picks again, where the clip is there: their holds changed."""
        changes = []
        for old in self.picks:
            if old.kind == "pick" and (new := self._learned(old, of_clip)) != old:
                changes.append(Change("pick", old.id, old.to_fields(), new.to_fields()))
        self.apply(Edit(tuple(changes), ""))

    def _learned(self, pick: Pick, of_clip: "ClipOfPicks") -> Pick:
        """Return a pick with the matte of its colour; without the clip it keeps the one it has."""
        if pick.whole_hue:
            return replace(pick, matte=None)
        others = self.picks if pick.kind == "pick" else ()
        holds = [p for p in others if p.kind == "hold" and p.enabled and p.id != pick.id]
        learned = of_clip.learn(pick, holds, self._display_of_clip())
        if learned is None:
            return pick
        self._mattes[learned.id] = learned.text
        return replace(pick, matte=learned.id if learned.found else None)

    def _check_pick(self, found: Pick) -> None:
        self.check_frame(found.frame)
        check(found, self.frames)

    def _pick(self, id_: str) -> Pick:
        """Return a pick or hold by its id."""
        found = self._state.get(("pick", id_))
        if found is None:
            known = [known for kind, known in self._state if kind == "pick"]
            raise unknown(id_, "pick or hold", known, "`picks`")
        return Pick.from_fields(found)


def _same(old: Pick, new: Pick) -> bool:
    """Return whether two picks ask for the same, whatever paths were found or corrected."""
    unlike = bool(old.path) != bool(new.path)
    mine = replace(old, path=(), enabled=True, matte=None)
    return not unlike and mine == replace(new, id=old.id, path=(), matte=None)


def _changed(old: Pick, new: Pick) -> str:
    """Return what is new of a pick, for people: "to #803020, fades of 4 frames"."""
    both = [
        (
            f"{hex_of(pick.rgb)} at frame {pick.frame:g}",
            "" if pick.to is None else f"to {hex_of(pick.to)}",
            "all frames"
            if pick.start is None and pick.until is None
            else range_text(pick.start, pick.until),
            f"fades of {pick.fade:g} frames",
            f"the same {'new colour' if pick.toward == 'colour' else 'change'} at all frames",
            "all of its hue" if pick.whole_hue else "learned colours",
            f"reach {pick.reach:g}",
            f"softness {pick.softness:g}",
            f"lightness {pick.lightness[0]:g} to {pick.lightness[1]:g}",
            "followed" if pick.path else "not followed",
        )
        for pick in (old, new)
    ]
    found = [after for before, after in zip(*both, strict=True) if before != after]
    return ", ".join(found) or _asked(new)


def _asked(pick: Pick) -> str:
    """Return what a pick asks for, for people: "#5ca832 to #803020 at frame 30"."""
    text = hex_of(pick.rgb)
    if pick.to is not None:
        text += f" to {hex_of(pick.to)}"
    text += f" at frame {pick.frame:g}"
    if pick.start is not None or pick.until is not None:
        text += f", {range_text(pick.start, pick.until)}"
    if pick.fade:
        text += f", fades of {pick.fade:g} frames"
    return text
