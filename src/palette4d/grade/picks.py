"""Picks and holds: colours of the clip that change or stay, as the user asked.

A pick or a hold is stored in the sidecar's ``edits.picks``. `grade.solve` finds the displacements
that meet all of them; `grade.follow` finds where a picked colour is at other frames.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from palette4d.common.errors import Palette4dError
from palette4d.grade.edits import Colour, as_colour

F64 = NDArray[np.float64]
Kind = Literal["pick", "hold"]
Toward = Literal["shift", "colour"]

#: More enabled picks and holds than this are refused: solving and recolouring would be slow.
MOST_PICKS = 100

#: Pixels within about this distance of a picked colour are taken for the same thing's: it is the
#: standard deviation when a colour is followed.
ALIKE = 0.08

#: A residual above this, 3 of 255, is told, and above this share of the change.
MET, MET_PART = 0.012, 0.02

#: Two picks nearer than this in colour are named together if one of them is not met. Below half a
#: step of 8 bits they have the same colour.
NEAR, SAME = 0.2, 0.5 / 255


@dataclass(frozen=True)
class PathKey:
    """Where a picked colour is at a frame.

    Attributes
    ----------
    frame, rgb : float and 3 floats
    given : bool
        By the user, not found by following it.
    there : float
        How much of the change is asked for, 0..1: 0 where the colour is no longer in the picture.
    """

    frame: float
    rgb: Colour
    given: bool = False
    there: float = 1.0


@dataclass(frozen=True)
class Pick:
    """A colour that changes (kind "pick") or stays (kind "hold").

    Attributes
    ----------
    id : str
        p1, p2, …
    kind : {"pick", "hold"}
    frame, rgb : float and 3 floats
        The colour, in the palette's code values, and the frame where it was picked; before edits.
    to : 3 floats or None
        The new colour; None for a hold.
    toward : {"shift", "colour"}
        At other frames: the same change as at `frame`, in proportion less where the colour is
        darker, and less where it would leave 0..1; or the same new colour.
    start, until : float or None
        First and last frame with the full change; None: the clip's first and last.
    fade : float
        Frames of the ramps before `start` and after `until`.
    radius : float or None
        Where the local remainder ends, in the palette's code values; None: chosen by the solver.
    global_only : bool
        No local remainder; picks only.
    enabled : bool
    path : tuple of PathKey
        Where the colour is at other frames, linear between the keys; empty: always `rgb`.
    pixel, box : (x, y) and int, or None
        The pixel and the side of the box around it whose mean was picked.
    spread : tuple of 3 floats
        Offsets from the picked colour to other colours of the box, where they differ much.
    residual : float or None
        How far the result is from what was asked at `frame`, or at the next frame where the change
        is full.
    worst, worst_frame : float or None
        The largest such distance of all frames, and where.
    share : float or None
        Share, 0..1, of the change that the palette does; the local remainder does the rest.
    """

    id: str
    kind: Kind
    frame: float
    rgb: Colour
    to: Colour | None = None
    toward: Toward = "shift"
    start: float | None = None
    until: float | None = None
    fade: float = 0.0
    radius: float | None = None
    global_only: bool = False
    enabled: bool = True
    path: tuple[PathKey, ...] = ()
    pixel: tuple[float, float] | None = None
    box: int | None = None
    spread: tuple[Colour, ...] = ()
    residual: float | None = None
    worst: float | None = None
    worst_frame: float | None = None
    share: float | None = None

    @classmethod
    def from_fields(cls, fields: Mapping[str, Any]) -> Pick:
        """Return the pick of an entry of a sidecar's ``edits.picks``."""
        to, pixel = fields.get("to"), fields.get("pixel")
        return cls(
            id=fields["id"],
            kind=fields["kind"],
            frame=fields["frame"],
            rgb=as_colour(fields["rgb"]),
            to=None if to is None else as_colour(to),
            toward=fields.get("toward", "shift"),
            start=fields.get("from"),
            until=fields.get("until"),
            fade=fields.get("fade", 0.0),
            radius=fields.get("radius"),
            global_only=fields.get("global_only", False),
            enabled=fields.get("enabled", True),
            path=tuple(
                PathKey(
                    key["frame"],
                    as_colour(key["rgb"]),
                    key.get("given", False),
                    key.get("there", 1.0),
                )
                for key in fields.get("path", ())
            ),
            pixel=None if pixel is None else (pixel[0], pixel[1]),
            box=fields.get("box"),
            spread=tuple(as_colour(offset) for offset in fields.get("spread", ())),
            residual=fields.get("residual"),
            worst=fields.get("worst"),
            worst_frame=fields.get("worst_frame"),
            share=fields.get("global"),
        )

    def to_fields(self) -> dict[str, Any]:
        """Return the pick as the user asked for it, without what was measured."""
        path = [
            {"frame": _number(key.frame), "rgb": list(key.rgb)}
            | ({"given": True} if key.given else {})
            | ({"there": key.there} if key.there < 1 else {})
            for key in self.path
        ]
        every: dict[str, Any] = {
            "id": self.id,
            "kind": self.kind,
            "frame": _number(self.frame),
            "rgb": list(self.rgb),
            "to": None if self.to is None else list(self.to),
            "toward": None if self.toward == "shift" else self.toward,
            "from": None if self.start is None else _number(self.start),
            "until": None if self.until is None else _number(self.until),
            "fade": _number(self.fade) or None,
            "radius": self.radius,
            "global_only": self.global_only or None,
            "enabled": None if self.enabled else False,
            "path": path or None,
            "pixel": None if self.pixel is None else [_number(value) for value in self.pixel],
            "box": self.box,
            "spread": [list(offset) for offset in self.spread] or None,
        }
        return {name: value for name, value in every.items() if value is not None}

    def colour_at(self, frame: float) -> F64:
        """Return where the colour is at a frame, (3,)."""
        if not self.path:
            return np.array(self.rgb)
        frames, colours, _ = self._keys
        return np.array([np.interp(frame, frames, channel) for channel in colours.T])

    @cached_property
    def _keys(self) -> tuple[F64, F64, F64]:
        """The path's frames (n,), colours (n, 3) and parts that are there (n,)."""
        return (
            np.array([key.frame for key in self.path], float),
            np.array([key.rgb for key in self.path], float).reshape(-1, 3),
            np.array([key.there for key in self.path], float),
        )

    @cached_property
    def _limits(self) -> tuple[F64, F64 | float]:
        """The least and the largest colour that a shift may lead to."""
        ends = np.vstack([np.array(self.to), np.array(self.rgb), self._keys[1]])
        high = np.maximum(1.0, ends[:2].max(axis=0)) if ends.max() <= 1 else np.inf
        return np.minimum(0.0, ends.min(axis=0)), high

    def followed(self) -> tuple[F64, F64]:
        """Return frames of a path, and how far its colour there is from the picked one.

        They are whole frames, some hundreds at most, within the pick's range and where the colour
        is there.
        """
        frames, _, there = self._keys
        low = frames[0] if self.start is None else max(frames[0], self.start)
        high = frames[-1] if self.until is None else min(frames[-1], self.until)
        at = np.unique(np.linspace(low, max(low, high), 1000).round())
        at = at[(low <= at) & (at <= high) & (np.interp(at, frames, there) > 0)]
        rgb = np.array([self.colour_at(frame) for frame in at]).reshape(-1, 3)
        return at, np.linalg.norm(rgb - self.rgb, axis=1)

    def alike(self) -> tuple[float, float]:
        """Return the frames between which a path stays near the picked colour."""
        at, away = self.followed()
        before = at[(away > ALIKE) & (at < self.frame)].max(initial=-math.inf)
        after = at[(away > ALIKE) & (at > self.frame)].min(initial=math.inf)
        near = at[(before < at) & (at < after)]
        start, end = near.min(initial=self.frame), near.max(initial=self.frame)
        return float(start), float(end)

    def change_at(self, frame: float) -> F64:
        """Return the full change that is asked for at a frame, (3,)."""
        if self.to is None:
            return np.zeros(3)
        new, old, colour = np.array(self.to), np.array(self.rgb), self.colour_at(frame)
        if self.toward == "colour":
            return new - colour
        change: F64 = new - old
        # The change that makes a wall blue by day would make its night black a bright blue.
        light = min(1.0, max(0.0, float(colour.max())) / max(float(old.max()), 1e-9))
        low, high = self._limits
        room = np.where(change < 0, colour - low, high - colour)
        size = np.abs(change)
        part = np.where(size > 1e-9, room / np.maximum(size, 1e-9), 1.0)
        return change * min(light, max(0.0, float(part.min())))

    def covers(self, frame: float, step: float) -> bool:
        """Return whether a frame lies in the range or its ramps."""
        begin, start, until, end = self.knots(step)
        return start <= frame <= until or begin < frame < end

    @property
    def tolerance(self) -> float:
        """The largest residual of a pick that counts as met."""
        change = np.zeros(3) if self.to is None else np.subtract(self.to, self.rgb)
        return max(MET, MET_PART * float(np.linalg.norm(change)))

    def knots(self, step: float) -> tuple[float, float, float, float]:
        """Return where the change begins, is full, is full for the last time, and ends.

        Without a fade the ramps take one frame of the clip (`step` frame numbers).
        """
        start = -math.inf if self.start is None else self.start
        until = math.inf if self.until is None else self.until
        ramp = max(self.fade, step)
        return start - ramp, start, until, until + ramp

    def strength_at(self, frame: float, step: float) -> float:
        """Return how much of the change is asked for at a frame, 0..1."""
        begin, start, until, end = self.knots(step)
        before = (frame - begin) / (start - begin) if frame < start else 1.0
        after = (end - frame) / (end - until) if frame > until else 1.0
        return max(0.0, min(before, after)) * self._there(frame)

    def _there(self, frame: float) -> float:
        """Return how much of the colour is in the picture at a frame, 0..1."""
        frames, _, there = self._keys
        return float(np.interp(frame, frames, there)) if there.size else 1.0


def all_picks(fields: Mapping[str, Any]) -> tuple[Pick, ...]:
    """Return the picks and holds of a sidecar's member "edits"."""
    return tuple(Pick.from_fields(entry) for entry in fields.get("picks", ()))


def unmet(picks: Iterable[Pick], step: float) -> dict[frozenset[str], str]:
    """Return a line for each enabled pick and hold that is not met, with the likely cause.

    The keys are the ids. Two that contradict each other have one line, under both ids.
    """
    enabled = [pick for pick in picks if pick.enabled]
    lines: dict[frozenset[str], str] = {}
    for number, pick in enumerate(enabled):
        _, start, until, _ = pick.knots(step)
        frame, at, off = min(max(pick.frame, start), until), "", pick.residual
        if pick.worst_frame is not None and (off is None or off <= pick.tolerance):
            frame, at, off = pick.worst_frame, f" at frame {pick.worst_frame:.0f}", pick.worst
        if number >= MOST_PICKS:
            lines[frozenset({pick.id})] = (
                f"{pick.id} is not solved: only the first {MOST_PICKS} enabled picks and holds "
                "are. Disable or remove some"
            )
        elif off is not None and off > pick.tolerance:
            rival = _rival(pick, enabled, frame, step)
            ids = frozenset({pick.id, rival[0]} if rival else {pick.id})
            cause = _cause(pick, enabled) if rival is None else rival[1]
            lines.setdefault(ids, f"{pick.id} is off by {off:.3f}{at}{cause}")
    return lines


def _rival(pick: Pick, others: Sequence[Pick], frame: float, step: float) -> tuple[str, str] | None:
    """Return the id of the pick that stands most in a pick's way at a frame, and what to say."""
    rivals = []
    for other in others:
        if other.id != pick.id and other.strength_at(frame, step) > 0:
            away = float(np.linalg.norm(pick.colour_at(frame) - other.colour_at(frame)))
            apart = float(np.linalg.norm(pick.change_at(frame) - other.change_at(frame)))
            if away < NEAR and apart > away:
                rivals.append((away, other.id, apart, other.frame))
    if not rivals:
        return None
    away, id_, apart, picked = min(rivals)
    near = f"at frame {frame:.0f} the colour of {id_} is only {away:.3f} away"
    if away < SAME:
        at = "" if pick.frame == picked else f" at frame {frame:.0f}"
        near = (
            f"{pick.id}, picked at frame {pick.frame:g}, and {id_}, picked at frame {picked:g}, "
            f"have the same colour{at}"
        )
    return id_, (
        f": {near}, and the two ask for changes that differ by {apart:.3f}. Change or disable one "
        f"of {pick.id} and {id_}"
    )


def _cause(pick: Pick, others: Sequence[Pick]) -> str:
    if pick.global_only:
        return ": the palette alone cannot express it; its neighbourhood is left out"
    if pick.to is not None and any(not -0.05 <= value <= 1.05 for value in pick.to):
        return ": its new colour lies far outside 0..1"
    if len(others) > 1:
        return ": picks and holds nearby, or locked handles, limit it"
    return ": near colours of the clip, which want to stay, limit it; radius=… widens the change"


def check_range(pick: Pick, frames: tuple[int, int, int]) -> None:
    """Refuse a pick whose range is empty or outside the clip, or whose radius is not positive.

    Raises
    ------
    Palette4dError
        As said.
    """
    first, last, _ = frames
    start = first if pick.start is None else pick.start
    until = last if pick.until is None else pick.until
    if start > last or until < first:
        raise Palette4dError(
            f"the range from frame {start:g} until {until:g} lies outside the clip; choose frames "
            f"from {first} to {last}"
        )
    if not start <= until:
        raise Palette4dError(
            f"found the range from frame {start:g} until {until:g}, expected a first frame that is "
            "not after the last one"
        )
    if not 0 <= pick.fade <= 1e9:
        raise Palette4dError(f"found a fade of {pick.fade:g} frames, expected 0 or more")
    if pick.radius is not None and not 1e-4 <= pick.radius <= 1e6:
        raise Palette4dError(
            f"found the radius {pick.radius:g}, expected 0.0001 or more, such as 0.2"
        )
    if pick.toward not in ("shift", "colour"):
        raise Palette4dError(f"found toward {pick.toward!r}, expected 'shift' or 'colour'")


def _number(value: float) -> float:
    """Return whole numbers as int, so that the file has 40 and not 40.0."""
    return int(value) if float(value).is_integer() else float(value)
