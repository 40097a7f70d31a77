"""Picks and holds: colours of the clip that change or stay, as the user asked.

A pick is a matte over colours times the amount of the picked colour times a change. The matte is
learned from frames of the clip (`grade.mattes`); the core computes the rest for each pixel
(`core/recolour/frame_picks.hpp`). `grade.follow` finds where a picked colour is at other frames.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from palette4d.common.errors import Palette4dError
from palette4d.grade.edits import Colour, as_colour

F64 = NDArray[np.float64]
Kind = Literal["pick", "hold"]
Toward = Literal["shift", "colour"]

#: Most enabled picks and holds, as in the core (read_picks.cpp): each costs time for each pixel.
MOST_PICKS = 100

#: Most areas of all picks and holds, as in the core: each costs time when its pick is learned.
MOST_AREAS = 200

#: Standard deviation, in code values, of one object's colours when a colour is followed.
ALIKE = 0.08

#: The largest absolute `Pick.reach`: beyond, a matte takes all or nothing.
MOST_REACH = 8.0


#: The largest number of pixels in a window's sides and feather.
MOST_PIXELS = 1e6

#: Attributes with other names in a sidecar, and those that are frames or pixels.
_NAMES = {"start": "from"}
_WHOLE = {
    *("frame", "start", "until", "fade", "fade_out"),
    *("pixel", "points", "radius", "feather", "box"),
}


At = TypeVar("At", "PathKey", "Area", "WindowKey")


@dataclass(frozen=True)
class PathKey:
    """Where a picked colour is at a frame; `given` by the user, or followed.

    `there` is the share of the change that is asked for: 0 where the colour is out of the picture.
    """

    frame: float
    rgb: Colour
    given: bool = False
    there: float = 1.0


@dataclass(frozen=True)
class Area:
    """A part of the picked object that was drawn on a frame: a box, or a stroke of a brush.

    `points` are pixels, x from the left, y from the top: one for a box, more for a stroke. `radius`
    is half of the box's side, or of the brush's width, in pixels.
    """

    frame: float
    points: tuple[tuple[float, float], ...]
    radius: float


Box = tuple[float, float, float, float]


def as_box(sides: Iterable[float]) -> Box:
    """Return left, top, right and bottom as a box."""
    values = [float(side) for side in sides]
    if len(values) != 4 or not all(map(math.isfinite, values)):
        raise Palette4dError(
            f"found a box of {', '.join(f'{value:g}' for value in values) or 'nothing'}, expected "
            "left, top, right and bottom in pixels"
        )
    left, top, right, bottom = values
    return left, top, right, bottom


@dataclass(frozen=True)
class WindowKey:
    """A window's box at a frame; `given` by the user, or followed.

    `box` is left, top, right and bottom, in pixels from the clip's top left corner.
    """

    frame: float
    box: Box
    given: bool = False


@dataclass(frozen=True)
class Window:
    """The part of the picture that a pick changes: a box that moves over time.

    Beyond the box the change fades out over `feather` pixels; `inverted`, it fades in there, and
    the box keeps its colours. `keys` are in order of time; the box is linear between them.
    """

    feather: float
    keys: tuple[WindowKey, ...]
    inverted: bool = False

    def spans(self, width: int, height: int) -> bool:
        """Return whether a given box reaches across a picture of this size, beyond both sides."""
        return any(
            (left < 0 and right > width) or (top < 0 and bottom > height)
            for left, top, right, bottom in (key.box for key in self.given.keys)
        )

    def box_at(self, frame: float) -> F64:
        """Return the box at a frame, (4,)."""
        frames = [key.frame for key in self.keys]
        sides = np.array([key.box for key in self.keys]).T
        return np.array([np.interp(frame, frames, side) for side in sides])

    @property
    def given(self) -> Window:
        """The window with the user's keys alone; all keys where none is the user's."""
        given = tuple(key for key in self.keys if key.given)
        return dataclasses.replace(self, keys=given or self.keys)


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
    fade_out : float or None
        Frames of the ramp after `until`, where it is not as long as the one before `start`.
    enabled : bool
    path : tuple of PathKey
        Where the colour is at other frames, linear between the keys; empty: always `rgb`.
    pixel, box : (x, y) and int, or None
        The pixel and the side of the box around it whose main colour was picked.
    areas : tuple of Area
        More parts of the object, which its matte is learned from.
    matte : str or None
        The id of the learned matte; None: all colours of its hue.
    whole_hue : bool
        Takes all of its hue on purpose, as a qualifier does: nothing is learned.
    reach : float
        Log odds added to the matte, -8..8: above 0 it takes more colours, below 0 fewer.
    softness : float
        How soft the matte is, 0..1.
    lightness : (float, float)
        The lowest and the highest lightness (largest channel, display code values) that change.
    window : Window or None
        The part of the picture that changes; None: all of it.
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
    fade_out: float | None = None
    enabled: bool = True
    path: tuple[PathKey, ...] = ()
    pixel: tuple[float, float] | None = None
    box: int | None = None
    areas: tuple[Area, ...] = ()
    matte: str | None = None
    whole_hue: bool = False
    reach: float = 0.0
    softness: float = 0.5
    lightness: tuple[float, float] = (0.0, 1.0)
    window: Window | None = None

    @classmethod
    def from_fields(cls, fields: Mapping[str, Any]) -> Pick:
        """Return the pick of an entry of a sidecar's ``edits.picks``."""
        known = {
            field.name: _NAMES.get(field.name, field.name) for field in dataclasses.fields(cls)
        }
        values = {own: fields[name] for own, name in known.items() if name in fields}
        for name in ("rgb", "to"):
            if name in values:
                values[name] = as_colour(values[name])
        for name in ("pixel", "lightness"):
            if name in values:
                values[name] = (values[name][0], values[name][1])
        path, areas = values.pop("path", ()), values.pop("areas", ())
        if window := values.pop("window", None):
            keys = (WindowKey(**{**key, "box": tuple(key["box"])}) for key in window["keys"])
            values["window"] = Window(**{**window, "keys": tuple(keys)})
        return cls(
            **values,
            path=tuple(PathKey(**{**key, "rgb": as_colour(key["rgb"])}) for key in path),
            areas=tuple(
                Area(**{**area, "points": tuple((x, y) for x, y in area["points"])})
                for area in areas
            ),
        )

    def to_fields(self) -> dict[str, Any]:
        """Return the pick as an entry of a sidecar's ``edits.picks``; defaults are left out."""
        return _fields_of(self)

    @property
    def marks(self) -> tuple[Area, ...]:
        """The box and the areas of the clip that were marked."""
        if self.pixel is None:
            return self.areas
        return (Area(self.frame, (self.pixel,), (self.box or 1) / 2), *self.areas)

    def scaled(self, x: float, y: float) -> Pick:
        """Return the pick for a clip x times as wide and y times as high."""

        def at(point: tuple[float, float]) -> tuple[float, float]:
            return math.floor((point[0] + 0.5) * x), math.floor((point[1] + 0.5) * y)

        mean, change = math.sqrt(x * y), dataclasses.replace
        window = self.window and change(
            self.window,
            feather=self.window.feather * mean,
            keys=tuple(
                change(key, box=as_box(np.multiply(key.box, (x, y, x, y))))
                for key in self.window.keys
            ),
        )
        return change(
            self,
            pixel=self.pixel and at(self.pixel),
            box=self.box and max(1, round(self.box * mean)),
            areas=tuple(
                change(area, points=tuple(map(at, area.points)), radius=area.radius * mean)
                for area in self.areas
            ),
            window=window,
        )

    def shifted(self, by: float) -> Pick:
        """Return the pick for a clip whose frame numbers are higher by so much."""

        def moved(things: tuple[At, ...]) -> tuple[At, ...]:
            return tuple(dataclasses.replace(each, frame=each.frame + by) for each in things)

        return dataclasses.replace(
            self,
            frame=self.frame + by,
            start=None if self.start is None else self.start + by,
            until=None if self.until is None else self.until + by,
            path=moved(self.path),
            areas=moved(self.areas),
            window=self.window and dataclasses.replace(self.window, keys=moved(self.window.keys)),
        )

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
        """Return frames of a path, and the distances of its colours there from the picked colour.

        At most 1000 whole frames, within the pick's range and where the colour is there.
        """
        frames, _, there = self._keys
        low = frames[0] if self.start is None else max(frames[0], self.start)
        high = frames[-1] if self.until is None else min(frames[-1], self.until)
        whole = np.unique(np.linspace(low, max(low, high), 1000).round())
        whole = whole[(low <= whole) & (whole <= high) & (np.interp(whole, frames, there) > 0)]
        rgb = np.array([self.colour_at(frame) for frame in whole]).reshape(-1, 3)
        return whole, np.linalg.norm(rgb - self.rgb, axis=1)

    def alike(self) -> tuple[float, float]:
        """Return the frames between which a path stays near the picked colour."""
        times, away = self.followed()
        before = times[(away > ALIKE) & (times < self.frame)].max(initial=-math.inf)
        after = times[(away > ALIKE) & (times > self.frame)].min(initial=math.inf)
        near = times[(before < times) & (times < after)]
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
        # In proportion to the light: else a wall that is blue by day were bright blue by night.
        now, picked = float(colour.max()), float(old.max())
        light = max(0.0, now) / max(picked, 1e-9) if now < picked else 1.0
        low, high = self._limits
        room = np.where(change < 0, colour - low, high - colour)
        size = np.abs(change)
        part = np.where(size > 1e-9, room / np.maximum(size, 1e-9), 1.0)
        return change * min(light, max(0.0, float(part.min())))

    def covers(self, frame: float) -> bool:
        """Return whether a frame lies in the range or its ramps."""
        begin, start, until, end = self.knots
        return start <= frame <= until or begin < frame < end

    @property
    def knots(self) -> tuple[float, float, float, float]:
        """The frames where the ramp before begins and ends, and the ramp after.

        A ramp takes at least one frame: without a fade the range ends between two frames.
        """
        start = -math.inf if self.start is None else self.start
        until = math.inf if self.until is None else self.until
        return start - max(self.fade, 1.0), start, until, until + max(self.fades[1], 1.0)

    def span(self, frames: tuple[int, int, int]) -> tuple[float, float]:
        """Return the first and the last frame of a clip's frames that the pick changes."""
        first, last, _ = frames
        begin, _, _, end = self.knots
        return max(begin, first), min(end, last)

    def lost(self, frames: tuple[int, int, int]) -> tuple[float | None, float | None]:
        """Return the frame until which, and the one from which, the window could not be followed.

        There it stays where it was. None where it was followed to the end of the range in a clip's
        frames (first, last, step), or not at all.
        """
        keys = () if self.window is None else self.window.keys
        if all(key.given for key in keys):
            return None, None
        low, high = self.span(frames)
        first, last, step = keys[0], keys[-1], frames[2]
        before = first.frame if not first.given and first.frame - step >= low else None
        after = last.frame if not last.given and last.frame + step <= high else None
        return before, after

    @property
    def fades(self) -> tuple[float, float]:
        """Frames of the ramps before and after the range."""
        return self.fade, self.fade if self.fade_out is None else self.fade_out

    def strength_at(self, frame: float) -> float:
        """Return how much of the change is asked for at a frame, 0..1."""
        begin, start, until, end = self.knots
        before = (frame - begin) / (start - begin) if frame < start else 1.0
        after = (end - frame) / (end - until) if frame > until else 1.0
        return max(0.0, min(before, after)) * self._there(frame)

    def _there(self, frame: float) -> float:
        """Return the path's `there` at a frame, 0..1."""
        frames, _, there = self._keys
        return float(np.interp(frame, frames, there)) if there.size else 1.0


def checked(pick: Pick, frames: tuple[int, int, int]) -> Pick:
    """Return a pick with plain numbers and tuples, as files hold them.

    Refuses one whose range is empty or outside the clip, or whose values are out of range.
    """
    pick = _native(pick)
    if type(pick.enabled) is not bool:
        raise Palette4dError(f"found enabled={pick.enabled!r}, expected True or False")
    if not all(area.points for area in pick.areas):
        raise Palette4dError("found an area without points, expected one or more")
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
    for fade in pick.fades:
        if not 0 <= fade <= 1e9:
            raise Palette4dError(f"found a fade of {fade:g} frames, expected 0 or more")
    if not -MOST_REACH <= pick.reach <= MOST_REACH:
        raise Palette4dError(
            f"found the reach {pick.reach:g}, expected {-MOST_REACH:g} to {MOST_REACH:g}, such as 1"
        )
    if not 0 <= pick.softness <= 1:
        raise Palette4dError(f"found the softness {pick.softness:g}, expected 0 to 1")
    lowest, highest = pick.lightness
    if not 0 <= lowest < highest <= 1:
        raise Palette4dError(
            f"found the lightness {lowest:g} to {highest:g}, expected a lowest below a highest, "
            "both within 0 to 1"
        )
    if pick.window is not None:
        _check_window(pick.window)
    if pick.toward not in ("shift", "colour"):
        raise Palette4dError(f"found toward {pick.toward!r}, expected 'shift' or 'colour'")
    return pick


def _native(value: Any) -> Any:
    """Return a value of numbers and tuples, whatever NumPy's or lists it is made of."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return tuple(map(_native, value))
    if isinstance(value, Pick | PathKey | Area | Window | WindowKey):
        fields = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
        return dataclasses.replace(value, **{n: _native(part) for n, part in fields.items()})
    return value


def _check_window(window: Window) -> None:
    for key in window.keys:
        left, top, right, bottom = key.box
        if not (-MOST_PIXELS <= left < right <= MOST_PIXELS):
            raise Palette4dError(
                f"found a window from {left:g} to {right:g} from the left, expected a left edge "
                "before the right one"
            )
        if not (-MOST_PIXELS <= top < bottom <= MOST_PIXELS):
            raise Palette4dError(
                f"found a window from {top:g} to {bottom:g} from the top, expected a top above the "
                "bottom"
            )
    if not 0 <= window.feather <= MOST_PIXELS:
        raise Palette4dError(
            f"found a feather of {window.feather:g} pixels, expected 0 to {MOST_PIXELS:g}"
        )


def _fields_of(thing: Pick | PathKey | Area | Window | WindowKey) -> dict[str, Any]:
    values = {field.name: getattr(thing, field.name) for field in dataclasses.fields(thing)}
    left_out = {f.name for f in dataclasses.fields(thing) if values[f.name] == f.default}
    return {
        _NAMES.get(name, name): _plain(value, name in _WHOLE)
        for name, value in values.items()
        if name not in left_out
    }


def _plain(value: Any, whole: bool) -> Any:
    """Return a JSON value; whole numbers become int, so that the file has 40 and not 40.0."""
    if isinstance(value, tuple):
        return [_plain(part, whole) for part in value]
    if isinstance(value, PathKey | Area | Window | WindowKey):
        return _fields_of(value)
    return int(value) if whole and float(value).is_integer() else value
