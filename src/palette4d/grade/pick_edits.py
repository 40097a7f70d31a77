"""Picks and holds of a palette: made, changed, removed; and what they do."""

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palette4d.common.errors import Palette4dError
from palette4d.common.text import hex_of
from palette4d.grade import edits
from palette4d.grade.colour_moves import range_text
from palette4d.grade.edits import Colour, as_colour
from palette4d.grade.handles import unknown
from palette4d.grade.picks import MOST_PICKS, Pick, Toward, all_picks, check_range
from palette4d.grade.recolouring import Recolouring

if TYPE_CHECKING:
    from palette4d.grade.clip_of_picks import ClipOfPicks
    from palette4d.grade.effects import Around, SideEffect


class PickEdits(Recolouring):
    """The picks and locks of a palette. `solve` finds what they move."""

    @property
    def picks(self) -> tuple[Pick, ...]:
        """The picks and holds, with their measured residuals, in the order of their ids."""
        return all_picks(self._members()["edits"])

    def pick(
        self,
        frame: float,
        *,
        colour: Iterable[float] | str | None = None,
        pixel: tuple[float, float] | None = None,
        box: int = 1,
        to: Iterable[float] | str | None = None,
        by: Iterable[float] | None = None,
        clip: str | os.PathLike[str] | None = None,
        follow: bool = True,
        toward: Toward = "shift",
        start: float | None = None,
        until: float | None = None,
        fade: float = 0.0,
        radius: float | None = None,
        global_only: bool = False,
        any_value: bool = False,
        progress: Callable[[int, int], object] | None = None,
    ) -> Pick:
        """Change a colour of the clip into another one, and little else.

        All picks and holds are solved together, again after every edit (docs/grading.md).

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
        to, by : 3 floats
            The new colour, or the change; one of them.
        clip : path, optional
            The clip; default: the sidecar's.
        follow : bool
            Follow the colour through the clip. Without the clip, or without this, the pick is at
            the same colour in all frames.
        toward : {"shift", "colour"}
            At other frames: the same change, or the same new colour.
        start, until : float, optional
            First and last frame with the full change; default: the clip's.
        fade : float
            Frames of the ramps before `start` and after `until`; beyond them nothing changes.
        radius : float, optional
            Where the local remainder ends, in code values.
        global_only : bool
            No local remainder: only palette colours move.
        any_value : bool
            Take colours such as 255 128 0 as they are.
        progress : callable, optional
            Called as progress(done, total) while frames are read.

        Returns
        -------
        Pick
            With its id and its path. `picks` has it with what solving measures.

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
        found = replace(at, kind="pick", to=new, toward=toward, start=start, until=until)
        found = replace(found, fade=fade, radius=radius, global_only=global_only)
        if radius is not None:
            _needs_radius(found)
        return self._add_pick(found, clip, follow, progress)

    def hold(
        self,
        frame: float,
        *,
        colour: Iterable[float] | str | None = None,
        pixel: tuple[float, float] | None = None,
        box: int = 1,
        clip: str | os.PathLike[str] | None = None,
        follow: bool = True,
        start: float | None = None,
        until: float | None = None,
        fade: float = 0.0,
        radius: float | None = None,
        any_value: bool = False,
        progress: Callable[[int, int], object] | None = None,
    ) -> Pick:
        """Keep a colour of the clip as it is, whatever picks and handles do; as `pick`."""
        at = self._picked(frame, colour, pixel, box, clip, any_value)
        found = replace(at, start=start, until=until, fade=fade, radius=radius)
        return self._add_pick(found, clip, follow, progress)

    def correct_path(
        self,
        id: str,
        frame: float,
        *,
        colour: Iterable[float] | str | None = None,
        pixel: tuple[float, float] | None = None,
        box: int = 1,
        clip: str | os.PathLike[str] | None = None,
        any_value: bool = False,
        progress: Callable[[int, int], object] | None = None,
    ) -> Pick:
        """Say where the colour of a pick or hold is at another frame; it is followed again.

        Between two given frames the path goes gradually from what follows the one to what follows
        the other.
        """
        from palette4d.grade.clip_of_picks import corrected

        at = self._picked(frame, colour, pixel, box, clip, any_value)
        found = corrected(self._pick(id), at.frame, at.rgb)
        found = replace(found, path=self._clip_of_picks(clip).path(found, progress))
        self._put(
            "pick", id, found.to_fields(), f"correct {id}: {hex_of(at.rgb)} at frame {frame:g}"
        )
        return self._pick(id)

    def change_pick(
        self,
        id: str,
        *,
        by: Iterable[float] | None = None,
        follow: bool | None = None,
        any_value: bool = False,
        clip: str | os.PathLike[str] | None = None,
        progress: Callable[[int, int], object] | None = None,
        **changes: Any,
    ) -> Pick:
        """Change a pick or hold: any of the attributes of `Pick` but id, kind and path.

        `by` gives the new colour as offsets from the picked colour. A new `frame`, `rgb` or range
        is followed again, if the pick was followed. `follow` begins or ends that.
        """
        old = self._pick(id)
        if by is not None:
            base = as_colour(changes.get("rgb", old.rgb))
            changes["to"] = [a + b for a, b in zip(base, as_colour(by, "offset"), strict=True)]
        for name in ("rgb", "to"):
            if name in changes:
                changes[name] = self._checked(changes[name], any_value)
        if old.kind == "hold" and (bad := {"to", "toward", "global_only"} & changes.keys()):
            raise Palette4dError(f"{id} is a hold, which has no {' and no '.join(sorted(bad))}")
        new = replace(old, **changes)
        self._check_pick(new)
        if changes.get("radius") is not None:
            _needs_radius(new)
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
        self._put("pick", id, new.to_fields(), label)
        return self._pick(id)

    def unpick(self, *ids: str) -> None:
        """Remove picks and holds."""
        for id_ in ids:
            self._pick(id_)
        self._remove([("pick", id_) for id_ in dict.fromkeys(ids)], f"remove {' '.join(ids)}")

    def lock(self, *ids: str) -> None:
        """Keep vertices and stops where they are: picks do not move them."""
        for id_ in ids:
            if id_ not in self._settings:
                self._handles.vertex(id_, self._settings)
        with self.one_step(f"lock {' '.join(ids)}"):
            for id_ in ids:
                self._put("lock", id_, True, "")

    def unlock(self, *ids: str) -> None:
        """Let picks move these vertices and stops again."""
        for id_ in ids:
            if ("lock", id_) not in self._state:
                locked = [known for kind, known in self._state if kind == "lock"]
                raise unknown(id_, "lock", locked, "`picks` or `Document.locks`")
        self._remove([("lock", id_) for id_ in dict.fromkeys(ids)], f"unlock {' '.join(ids)}")

    @property
    def locks(self) -> tuple[str, ...]:
        """The ids of the handles that picks do not move."""
        return tuple(edits.to_fields(self._state, ()).get("locks", ()))

    @property
    def has_clip_colours(self) -> bool:
        """Whether the sidecar has colours of its clip; without, picks guard the palette's only."""
        return bool(self._fields.get("colours"))

    def moved_by_picks(self) -> tuple[int, int]:
        """Return how many tracks picks move by more than 1/255, and how many there are."""
        solution = self._members()["edits"].get("solution", {"vertices": [], "keys": []})
        moved = {
            entry.get("vertex") or entry["edge"]
            for entry in (*solution["vertices"], *solution["keys"])
            if max(map(abs, entry["by"])) > 1 / 255
        }
        tracks = [{*track.vertices, *track.edges} for track in self.tracks]
        return sum(not moved.isdisjoint(track) for track in tracks), len(tracks)

    def side_effect(self, *, least: float = 10 / 255) -> "SideEffect":
        """Return which share of the pixels picks change by more than `least` in a channel.

        It says how much of it is not near a picked colour, and which colour to hold.
        """
        from palette4d.grade import effects

        return effects.side_effect(self._members(), least)

    def around_picks(self) -> "dict[str, Around]":
        """Return what the clip's colours near each enabled pick get of its change, by its id."""
        from palette4d.grade import effects

        return effects.surroundings(self._members())

    def pick_notes(
        self,
        effect: "SideEffect | None" = None,
        around: "Mapping[str, Around] | None" = None,
    ) -> list[str]:
        """Return what speaks against the enabled picks, and what helps, one sentence or two each.

        `effect` and `around` are those of `side_effect` and `around_picks`, if they are at hand.
        """
        from palette4d.grade.pick_notes import notes

        enabled = [pick for pick in self.picks if pick.enabled]
        if not enabled:
            return []
        return notes(
            enabled,
            effect or self.side_effect(),
            self.around_picks() if around is None else around,
            scene_linear=self.scene_linear,
            has_clip_colours=self.has_clip_colours,
        )

    def pick_warnings(self, id: str, clip: str | os.PathLike[str] | None = None) -> tuple[str, ...]:
        """Return what speaks against the clip of a pick or hold, its colour and its box."""
        from palette4d.grade.clip_of_picks import MOST_COLOURS
        from palette4d.grade.solve import ClipAtTimes

        pick, known = self._pick(id), ClipAtTimes(self._members())
        stored = [known.colours_at(pick.frame), *known.colours] if known.colours else []
        of_clip = self._clip_of_picks(clip)
        found = of_clip.warnings(pick, stored)
        if pick.pixel is None or pick.box is None or pick.box == 1 or of_clip.open() is None:
            return found
        missed = self._missed(pick, of_clip.box(pick.frame, pick.pixel, pick.box))
        if missed <= 1 - MOST_COLOURS:
            return found
        what = "get less than half of the change"
        if pick.kind == "hold":
            what = "still change by more than 10 of 255"
        return (
            *found,
            f"{missed:.0%} of the pixels in the box of {id} {what}: they have other colours. "
            f"{pick.kind.capitalize()} them too, or choose a smaller box=…",
        )

    def _missed(self, pick: Pick, colours: NDArray[np.float64]) -> float:
        """Return which share of (n, 3) colours does not do what a pick of them asks for."""
        image = colours[None].astype(np.float32)
        done = (self.recolour(image, pick.frame, space="palette") - image)[0]
        if pick.kind == "hold":
            return float((np.abs(done).max(axis=1) > 10 / 255).mean())
        if pick.strength_at(pick.frame, self.frames[2]) < 1:
            return 0.0
        change = pick.change_at(pick.frame)
        return float((done @ change < 0.5 * change @ change).mean())

    def colour_of_pixel(
        self,
        frame: float,
        pixel: tuple[float, float],
        box: int = 1,
        clip: str | os.PathLike[str] | None = None,
    ) -> Colour:
        """Return the mean colour of a box around a pixel of the clip, in the palette's values."""
        self.check_frame(frame)
        return self._clip_of_picks(clip).colours(frame, pixel, box)[0]

    def _clip_of_picks(self, clip: str | os.PathLike[str] | None) -> "ClipOfPicks":
        from palette4d.grade.clip_of_picks import ClipOfPicks

        conversion = self._conversion("input")
        return ClipOfPicks(self._fields["clip"], conversion, self.path, clip)

    def _picked(
        self,
        frame: float,
        colour: Iterable[float] | str | None,
        pixel: tuple[float, float] | None,
        box: int,
        clip: str | os.PathLike[str] | None,
        any_value: bool,
    ) -> Pick:
        """Return a hold of a colour at a frame."""
        self.check_frame(frame)
        if colour is not None and pixel is None:
            return Pick("", "hold", frame, self._checked(colour, any_value))
        if colour is None and pixel is not None:
            rgb, spread = self._clip_of_picks(clip).colours(frame, pixel, box)
            return Pick("", "hold", frame, rgb, pixel=pixel, box=box, spread=spread)
        raise Palette4dError(
            f"found {'neither' if colour is None else 'both'} of a colour and a pixel, expected "
            "one of them"
        )

    def _add_pick(
        self,
        found: Pick,
        clip: str | os.PathLike[str] | None,
        follow: bool,
        progress: Callable[[int, int], object] | None,
    ) -> Pick:
        enabled = sum(
            kind == "pick" and v.get("enabled", True) for (kind, _), v in self._state.items()
        )
        if enabled >= MOST_PICKS:
            raise Palette4dError(
                f"there are {enabled} picks and holds, and at most {MOST_PICKS} can be "
                "solved together; remove or disable some (`unpick`, `disable`)"
            )
        self._check_pick(found)
        if follow:
            found = replace(found, path=self._clip_of_picks(clip).path(found, progress))
        for kind, id_ in self._state:
            if kind == "pick" and _same(self._pick(id_), found):
                off = "" if self._pick(id_).enabled else f", disabled: `enable {id_}`"
                raise Palette4dError(f"{id_} is this {found.kind} already{off}; nothing was added")
        taken = (id_ for kind, id_ in self._state if kind == "pick")
        found = replace(found, id=edits.new_id("p", taken))
        self._put("pick", found.id, found.to_fields(), f"{found.kind} {found.id}: {_asked(found)}")
        return self._pick(found.id)

    def _check_pick(self, found: Pick) -> None:
        self.check_frame(found.frame)
        check_range(found, self.frames)

    def _pick(self, id_: str) -> Pick:
        """Return a pick as the user asked for it; nothing is solved."""
        found = self._state.get(("pick", id_))
        if found is None:
            known = [known for kind, known in self._state if kind == "pick"]
            raise unknown(id_, "pick or hold", known, "`picks`")
        return Pick.from_fields(found)


def _needs_radius(found: Pick) -> None:
    if found.global_only:
        raise Palette4dError(
            "found a radius for a pick that moves palette colours only (global_only=True), which "
            "has no neighbourhood; leave out one of the two"
        )


def _same(old: Pick, new: Pick) -> bool:
    """Return whether two picks ask for the same, whatever paths were found or corrected."""
    unlike = bool(old.path) != bool(new.path)
    return not unlike and replace(old, path=(), enabled=True) == replace(new, id=old.id, path=())


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
            "default radius" if pick.radius is None else f"radius {pick.radius:g}",
            f"the same {'new colour' if pick.toward == 'colour' else 'change'} at all frames",
            "the palette alone" if pick.global_only else "the palette and near colours",
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
