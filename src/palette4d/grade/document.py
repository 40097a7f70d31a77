"""The document: a palette and the user's edits. It is loaded, edited, applied and saved.

Every change of a grade goes through `Document.apply`, which takes one `Edit`; `undo` reverts it.
The steps are part of the document and are saved with it. The core computes every colour, so that
results equal the node's bit by bit.
"""

import contextlib
import copy
import itertools
import math
import os
import re
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.colour.oklch import Adjustment, adjuster
from palette4d.common.errors import Palette4dError
from palette4d.common.files import link_target
from palette4d.common.locking import locked
from palette4d.common.text import counted
from palette4d.grade import edits, moves, sidecar
from palette4d.grade.copying import Fit, Time, copied, fit
from palette4d.grade.edits import (
    RAMP,
    Change,
    Colour,
    Edit,
    Key,
    Kind,
    Ramp,
    Setting,
    Settings,
    State,
    as_colour,
    as_ramp,
)
from palette4d.grade.handles import Handles, unknown
from palette4d.grade.output import Output
from palette4d.grade.palette import FAR, Near, Palette, palette_at
from palette4d.grade.picks import MOST_PICKS, Pick, Toward, all_picks, check_range
from palette4d.grade.sidecar import Fields, OnEdits
from palette4d.grade.tracks import Track, tracks_of, way_of

if TYPE_CHECKING:
    from palette4d.grade.picking import ClipOfPicks

F32 = NDArray[np.float32]

#: A vertex that has less of the colour at a frame than this is left alone: it would move too far.
LEAST_SHARE = 0.5

#: The most characters of a version's name.
LONGEST_NAME = 100

#: A member `edits.solution`, and the measured members of each pick by its id.
Solved = tuple[Fields, dict[str, Fields]]

#: The kinds that recolouring uses; versions wait.
_ACTIVE: tuple[Kind, ...] = ("handle", "ramp", "pick", "lock")

#: Names of scene-linear colour spaces: "Linear", "lin_rec709", "ACEScg", "ACES2065-1", ...
_LINEAR = re.compile(r"\blin(ear)?(\b|_)|scene.linear|acescg|aces2065", re.IGNORECASE)


class How(TypedDict, total=False):
    """A change of colours, and when: the keywords of `Document.adjust`."""

    rgb: Iterable[float] | str | None
    by: Iterable[float] | None
    hue: float
    chroma: float
    lightness: float
    start: float | None
    until: float | None
    fade: float | None
    ramp: str | None


class Document:
    """A clip's palette with its edits.

    Get one with `palette4d.load` or `palette4d.analyze`. Colours are code values of the palette
    (``encoding`` says which); 0..1 is the usual range, and any finite value is allowed. Frames are
    the clip's frame numbers; fractions are times between frames. A method that fails raises
    `Palette4dError` and changes nothing.

    Parameters
    ----------
    fields : mapping
        The members of a sidecar (docs/sidecar.md).
    notes : iterable of str
        Notes of the analysis about the palette.
    report : mapping, optional
        Figures of the analysis, as `palette4d analyze --json` prints them.

    Attributes
    ----------
    path : Path or None
        The sidecar; None until it is saved.
    notes : tuple of str
        As above.
    report : dict
        As above; empty for a loaded sidecar.
    """

    def __init__(
        self,
        fields: Mapping[str, Any],
        notes: Iterable[str] = (),
        report: Mapping[str, Any] | None = None,
    ) -> None:
        data = sidecar.encoded(fields)
        self.path: Path | None = None
        self._start(data, _core.parse_sidecar(data, self._name))
        self._disk: bytes | None = None
        self.notes = tuple(notes)
        self.report = dict(report or {})

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, version: str = "") -> "Document":
        """Load a sidecar (*.p4d.json), or a version in it (`Document.version`).

        Raises
        ------
        SidecarError
            There is no such file, or it is unusable.
        Palette4dError
            There is no such version.
        """
        document = cls.__new__(cls)
        data = sidecar.read_bytes(path)
        document._disk, document.path, document.notes = data, Path(path), ()
        document.report = {}
        document._start(data, _core.parse_sidecar(data, os.fspath(path)))
        return document.version(version)

    def _start(self, data: bytes, core: _core.Sidecar) -> None:
        self._fields: Fields = sidecar.fields_of(data)
        self._core: _core.Sidecar | None = core  # of `_state`; None: parse it on demand
        self._handles = Handles(self._fields["polytope"])
        self._become(sidecar.state_of(self._fields))
        self._solved: Solved | None = _stored_solution(self._fields["edits"])
        self._done, self._undone = sidecar.history_of(self._fields, self._name)
        self._mark_saved()

    def _become(self, state: State) -> None:
        self._state = state
        self._own: _core.Sidecar | None = None  # without the picks; None: parse it on demand
        self._settings: dict[str, Setting] = {
            id_: value for (kind, id_), value in state.items() if kind == "handle"
        }

    def _mark_saved(self) -> None:
        self._saved = (self._state, self._done, self._undone)

    def __repr__(self) -> str:
        """Return one line: the clip, its frames, and the numbers of edits."""
        first, last, _ = self.frames
        return (
            f"<Document {self._fields['clip']['name']!r}: frames {first} to {last}, "
            f"{counted(len(self._handles.vertices), 'vertex', 'vertices')}, "
            f"{counted(sum(kind in _ACTIVE for kind, _ in self._state), 'edit')}>"
        )

    def trial(self) -> "Document":
        """Return a copy to try edits on, without the history and without a file."""
        new = copy.copy(self)
        new._done, new._undone = [], []
        new.path, new._disk = None, None
        new._mark_saved()
        return new

    # ------------------------------------------------------------------------------ what it holds

    @property
    def core(self) -> _core.Sidecar:
        """The core's view of the document, for this package."""
        if self._core is None:
            fields = self._members()
            for member in ("history", "colours"):  # the core needs neither
                fields.pop(member, None)
            self._core = _core.parse_sidecar(sidecar.encoded(fields), self._name)
        return self._core

    @property
    def _name(self) -> str:
        return "<document>" if self.path is None else str(self.path)

    def fields(self) -> Fields:
        """Return the members of the sidecar that `save` would write (docs/sidecar.md)."""
        return copy.deepcopy(self._members())

    def _members(self) -> Fields:
        """Return the sidecar's members; they share values with the document."""
        ids = (vertex["id"] for vertex in self._fields["polytope"]["vertices"])
        fields = sidecar.with_state(self._fields, self._state, ids)
        if self._solved is None:
            self._solved = _solve(fields)
        solution, measured = self._solved
        found = fields["edits"]
        if measured:
            found["picks"] = [{**p, **measured.get(p["id"], {})} for p in found["picks"]]
        if solution:
            found["solution"] = solution
        return sidecar.with_history(fields, self._done, self._undone)

    @property
    def frames(self) -> tuple[int, int, int]:
        """First and last frame number of the clip, and the step between frames."""
        found = self._fields["clip"]["frames"]
        return found["first"], found["last"], found["step"]

    @property
    def encoding(self) -> str:
        """The colour space of the palette's code values, or "unknown"."""
        return str(self._fields["clip"]["encoding"])

    @property
    def scene_linear(self) -> bool:
        """Whether the clip is scene-linear, or its palette reaches far above 1."""
        clip = self._fields["clip"]
        names = (clip["encoding"], clip.get("conversion", {}).get("input_space", ""))
        brightest = max(max(v["rgb"]) for v in self._handles.vertices.values())
        return any(_LINEAR.search(name) for name in names) or brightest > 2

    @property
    def settings(self) -> Settings:
        """The settings of the edited vertices and of the stops, by id."""
        return MappingProxyType(self._settings)

    @property
    def state(self) -> State:
        """Everything that the user set, by kind and id (`palette4d.grade.edits`)."""
        return MappingProxyType(dict(self._state))

    @property
    def edited(self) -> bool:
        """Whether any handle is edited or any colour is picked."""
        return any(kind in ("handle", "pick") for kind, _ in self._state)

    @property
    def changed(self) -> bool:
        """Whether there are unsaved changes."""
        return self._disk is None or self._saved != (self._state, self._done, self._undone)

    @property
    def history(self) -> tuple[Edit, ...]:
        """The steps that `undo` reverts, oldest first; also those of earlier sessions."""
        return tuple(self._done)

    @property
    def undone(self) -> tuple[Edit, ...]:
        """The steps that `redo` applies again, the next one last."""
        return tuple(self._undone)

    @property
    def ramp(self) -> Ramp:
        """The clip's ramp between handles: "linear", "smooth" or "hold"."""
        found: Ramp = self._state.get(RAMP, "linear")
        return found

    def check_frame(self, frame: float) -> None:
        """Refuse a time outside the clip."""
        first, last, _ = self.frames
        if not first <= _finite(frame) <= last:
            raise Palette4dError(
                f"frame {frame:g} is outside of the clip; choose one from {first} to {last}"
            )

    def check_code_values(self, rgb: Iterable[float]) -> None:
        """Refuse a colour that looks like integers of 8 bits or more, such as 255 128 0.

        Scene-linear clips accept all colours: their code values may be large.
        """
        values = as_colour(rgb)
        largest = max(values)
        whole = largest > 1 and all(value.is_integer() for value in values)
        if self.scene_linear or not (whole or largest > 16):
            return
        bits = next(n for n in (8, 10, 12, 16, 32) if largest < 2**n)
        shown = " ".join(f"{value:g}" for value in values)
        scaled = " ".join(f"{value / (2**bits - 1):.4g}" for value in values)
        raise Palette4dError(
            f"found the colour {shown}, expected code values where 1 is display white; "
            f"{shown} in {bits} bits is {scaled}. Give that, or add any_value=True if "
            f"{shown} is meant"
        )

    @property
    def tracks(self) -> list[Track]:
        """The palette's colours through time: the rows of `palette4d plot`."""
        return tracks_of(self._handles)

    def palette(self, frame: float) -> Palette:
        """Return the palette at a time: ids, colours as analysed and as edited, faces.

        Frames outside the clip give its first or last.
        """
        return palette_at(self.core, _finite(frame))

    def colour(self, id: str, *, frame: float | None = None) -> Colour:
        """Return the edited colour of a vertex or stop, or of an edge at a frame."""
        if (setting := self._settings.get(id)) is not None:
            return setting.rgb
        if frame is None or id in self._handles.vertices:
            return as_colour(self._handles.vertex(id, self._settings)["rgb"])
        self.check_frame(frame)
        self._check_inside(id, frame)
        palette = self.palette(frame)
        return as_colour(palette.edited[palette.ids.index(id)])

    def named(self, id: str) -> str:
        """Return a handle with its place, for people: "stop s1 (edge e3, frame 4.5)"."""
        setting = self._settings.get(id)
        if setting is not None and setting.edge is not None:
            return f"stop {id} (edge {setting.edge}, frame {setting.frame:g})"
        if id in self._handles.vertices:
            return f"vertex {id} (frame {self._handles.vertices[id]['frame']:g})"
        return id

    def near(self, rgb: Iterable[float], *, frame: float) -> Near:
        """Return the palette colour nearest to a given colour at a frame.

        The edited palette is compared. The handle is the stop at that time, or the vertex of the
        colour's edge within half a frame step of that time.
        """
        wanted = as_colour(rgb)
        self.check_frame(frame)
        palette = self.palette(frame)
        index, distance = palette.nearest(wanted)
        id_ = palette.ids[index]
        return Near(
            frame=frame,
            id=id_,
            handle=self._handle_at(id_, palette.ends[index], frame),
            rgb=as_colour(palette.edited[index]),
            distance=distance,
            shares=palette.shares(wanted),
        )

    def _handle_at(self, id_: str, ends: tuple[str, str], frame: float) -> str | None:
        if id_ == ends[0]:
            return id_
        if (stop := self._stop_at(id_, frame)) is not None:
            return stop
        away = {end: abs(self._handles.vertex(end)["frame"] - frame) for end in ends}
        nearest = min(ends, key=lambda end: away[end])
        return nearest if away[nearest] <= self.frames[2] / 2 else None

    # ------------------------------------------------------------------------------------ editing

    def set(self, id: str, *, rgb: Iterable[float] | str, any_value: bool = False) -> None:
        """Set the colour of a vertex or a stop.

        Colours are three code values or "#rrggbb". Integers of 8 bits or more, such as 255 128 0,
        are refused unless `any_value` is true (`check_code_values`); this holds for all methods.
        """
        self._set(id, self._checked(rgb, any_value))

    def _checked(self, rgb: Iterable[float] | str, any_value: bool) -> Colour:
        colour = as_colour(rgb)
        if not any_value:
            self.check_code_values(colour)
        return colour

    def _set(self, id: str, new: Colour) -> None:
        before = self._settings.get(id)
        if before is None:
            self._handles.vertex(id, self._settings)
        after = Setting(new) if before is None else replace(before, rgb=new)
        self._put("handle", id, after, f"set {id} to {_text(new)}")

    def _put(self, kind: Kind, id: str, value: Any, label: str) -> None:
        """Set one value of the state (None: remove it) as one step."""
        self.apply(Edit((Change(kind, id, self._state.get((kind, id)), value),), label))

    def stop(
        self, edge: str, *, frame: float, rgb: Iterable[float] | str, any_value: bool = False
    ) -> str:
        """Set the colour of an edge at a time by a colour stop; return the stop's id.

        An existing stop at that time gets the colour.
        """
        return self._stop(edge, frame, self._checked(rgb, any_value))

    def _stop(self, edge: str, frame: float, new: Colour, ramp: Ramp | None = None) -> str:
        self.check_frame(frame)
        self._check_inside(edge, frame)
        there = self._stop_at(edge, frame)
        if there is not None:
            self._set(there, new)
            return there
        id_ = edits.new_id("s", self._taken() | self._settings.keys())
        setting = Setting(new, edge, float(frame), ramp)
        self._put("handle", id_, setting, f"set {edge} at frame {frame:g} to {_text(new)}")
        return id_

    def set_near(
        self,
        near: Iterable[float] | str,
        *,
        frame: float,
        anyway: bool = False,
        any_value: bool = False,
        **how: Unpack[How],
    ) -> Near:
        """Change the palette colour nearest to a given colour at a frame.

        A vertex within half a frame step moves, so that the colour at the frame is exactly the new
        one. Otherwise the stop at that time gets the colour, or a new stop.

        Parameters
        ----------
        near : 3 floats or "#rrggbb"
            The visible colour, after the edits so far.
        frame : float
            The time; within the clip.
        anyway : bool
            Edit the palette colour even if it is more than 0.25 away.
        any_value : bool
            Take colours such as 255 128 0 as they are.
        **how
            The change, as in `adjust`: ``rgb=``, or others.

        Returns
        -------
        Near
            The palette colour and its distance; `handle` is the vertex or stop that now has the
            colour, or None after the change of a range.

        Raises
        ------
        Palette4dError
            The nearest palette colour is more than 0.25 away; the message names the palette colours
            that `near` is mixed from.
        """
        wanted = self._checked(near, any_value)
        found = self.near(wanted, frame=frame)
        if found.distance > FAR and not anyway:
            raise Palette4dError(found.refusal(wanted))
        start, until, fade = how.get("start"), how.get("until"), how.get("fade")
        if moves.range_of(start, until, fade, self.frames) is not None:
            at = frame if found.id in self._handles.edges else None
            self.adjust(found.id, frame=at, any_value=any_value, **how)
            return replace(found, handle=None)
        move, _ = self._move(found.id, frame, how, any_value)
        new = as_colour(move(found.rgb))
        handle, moved = found.handle, new
        if handle in self._handles.vertices and handle != found.id:
            share = self._share(handle, found.id, frame)
            if share < LEAST_SHARE:
                handle = None
            else:
                own = self.colour(handle)
                moved = as_colour(
                    [o + (n - f) / share for o, n, f in zip(own, new, found.rgb, strict=True)]
                )
        ramp = how.get("ramp")
        with self.one_step(f"set {handle or found.id} at frame {frame:g} to {_text(new)}"):
            if handle is not None:
                self._set(handle, moved)
            else:
                handle = self._stop(found.id, frame, new)
            if ramp is not None:
                self.set_ramp(ramp, handle)
        return Near(frame, found.id, handle, found.rgb, found.distance, found.shares)

    def _share(self, vertex: str, edge: str, frame: float) -> float:
        """Return the weight, 0..1, of an end of an edge in the edge's displacement at a frame."""
        at: float = self._handles.vertex(vertex)["frame"]
        ends = self._handles.edges[edge]
        knots: list[float] = [self._handles.vertex(ends[end])["frame"] for end in ("from", "to")]
        stops = [each for each in self._settings.values() if each.edge == edge]
        knots += [stop.frame for stop in stops if stop.frame is not None]
        nearest: float = min(abs(knot - at) for knot in knots if knot != at)
        return max(0.0, 1 - abs(frame - at) / nearest)

    def shift(self, id: str, *, by: Iterable[float]) -> None:
        """Add three offsets to the colour of a vertex or a stop."""
        offset = as_colour(by, "offset")
        new = as_colour([a + b for a, b in zip(self.colour(id), offset, strict=True)])
        with self.one_step(f"move {id} by {_text(offset)}"):
            self._set(id, new)

    def move(self, stop: str, *, frame: float) -> None:
        """Move a stop in time, within its edge."""
        before = self._settings.get(stop)
        if before is None or before.edge is None:
            if stop in self._handles.vertices:
                raise Palette4dError(
                    f"{stop} is a palette vertex, whose time the analysis found; only stops move "
                    "in time. Its colour moves with by=…"
                )
            stops = [id_ for id_, setting in self._settings.items() if setting.edge is not None]
            raise unknown(stop, "stop", stops)
        self.check_frame(frame)
        self._check_inside(before.edge, frame)
        there = self._stop_at(before.edge, frame)
        if there not in (None, stop):
            raise Palette4dError(
                f"edge {before.edge} already has the stop {there} at frame {frame:g}; choose "
                "another frame, or reset that stop first"
            )
        after = replace(before, frame=float(frame))
        self._put("handle", stop, after, f"move {stop} to frame {frame:g}")

    def adjust(
        self,
        id: str | None = None,
        *,
        track: bool = False,
        frame: float | None = None,
        any_value: bool = False,
        **how: Unpack[How],
    ) -> tuple[str, ...]:
        """Move the colours of a handle, of a track or of the whole palette, as one step.

        Give either `rgb`, or `by`, or some of `hue`, `chroma` and `lightness`.

        Parameters
        ----------
        id : str, optional
            A vertex, a stop, or an edge with its `frame`; None: the whole palette.
        track : bool
            Move every handle along the colour's way: back to all colours that it comes from, and on
            to all that it becomes. A range implies it.
        frame : float, optional
            The frame at which an edge's colour is meant.
        rgb : 3 floats or "#rrggbb", optional
            The new colour; other handles of the track move by as much, and darker ones by less.
        by : 3 floats, optional
            Offsets in code values.
        hue : float
            Degrees added to the hue, in OKLCh of the displayed colour.
        chroma, lightness : float
            Factors of 0 or more, in OKLCh of the displayed colour.
        start, until, fade : float, optional
            Only from frame `start` to `until`, with ramps of `fade` frames (at least one frame
            step) before and after, and nothing beyond. A range without one end goes on to that end
            of the clip.
        ramp : {"linear", "smooth", "hold"}, optional
            The ramp of the handles that move, or of the fades of a range.
        any_value : bool
            Take colours such as 255 128 0 as they are.

        Returns
        -------
        tuple of str
            The vertices and stops that changed.
        """
        start, until, fade = how.get("start"), how.get("until"), how.get("fade")
        if frame is not None and id is not None:
            self.check_frame(frame)
            self._check_inside(id, frame)
        elif id is not None and id not in self._handles.edges:
            self.frame_of(id, None)  # refuses unknown ids
        within = moves.range_of(start, until, fade, self.frames)
        ramp = how.get("ramp")
        known = None if ramp is None else as_ramp(ramp)
        move, what = self._move(id, frame, how, any_value)
        rgb = how.get("rgb")
        if rgb is not None and within is not None and within.weight(self.frame_of(id, frame)) < 1:
            raise Palette4dError(
                f"the colour is meant at frame {self.frame_of(id, frame):g}, outside of the "
                f"range {moves.range_text(start, until)}; expected a range with this frame"
            )
        stop = self._settings.get(id or "")
        if id is None:
            name, way = "palette", (set(self._handles.vertices), set(self._handles.edges))
        elif within is not None or track:
            name, way = f"track {id}", way_of(self._handles, (stop and stop.edge) or id)
        elif id in self._handles.edges:
            new = as_colour(move(self._own_colour(id, self.frame_of(id, frame))))
            return (self._stop(id, self.frame_of(id, frame), new, known),)
        else:
            name, way = id, ({id}, set())
        changed = moves.moved(
            *(self._handles, self._settings, way, move, self._own_colour),
            within=within,
            ramp=known,
            clip_ramp=self.ramp,
            exact=None if id is None or rgb is None or frame is None else (id, frame),
        )
        if within is not None:
            what += f" {moves.range_text(start, until)}"
        changes = [Change("handle", n, self._settings.get(n), v) for n, v in changed.items()]
        self.apply(Edit(tuple(changes), f"{'move' if rgb is None else 'set'} {name} {what}"))
        return tuple(change.id for change in changes if change.before != change.after)

    def _move(
        self, id: str | None, frame: float | None, how: How, any_value: bool
    ) -> tuple[moves.Move, str]:
        """Return the move that the user asked for, and its text for people."""
        rgb, by = how.get("rgb"), how.get("by")
        change = Adjustment(how.get("hue", 0.0), how.get("chroma", 1.0), how.get("lightness", 1.0))
        if [rgb is None, by is None, change == Adjustment()].count(False) != 1:
            raise Palette4dError(
                "expected one kind of change: a new colour rgb=…, offsets by=…, or hue=…, "
                "chroma=… and lightness=…"
            )
        if by is not None:
            offset = as_colour(by, "offset")
            return moves.shift(offset), f"by {_text(offset)}"
        if rgb is None:
            return adjuster(self.encoding, change), str(change)
        if id is None:
            raise Palette4dError(
                "the whole palette cannot get one colour; expected offsets (by), or hue, chroma "
                "and lightness"
            )
        new, at = self._checked(rgb, any_value), self.frame_of(id, frame)
        before = self._own_colour(id, at) if id in self._handles.edges else self.colour(id)
        return moves.shift_to(before, new), f"to {_text(new)}"

    def frame_of(self, id: str | None, frame: float | None = None) -> float:
        """Return the frame of a vertex or stop; for an edge, the frame that is given."""
        if id in self._handles.edges:
            if frame is None:
                raise self._handles.needs_frame(id)
            return frame
        setting = self._settings.get(id or "")
        if setting is not None and setting.frame is not None:
            return setting.frame
        found: float = self._handles.vertex(id or "", self._settings)["frame"]
        return found

    def _own_colour(self, edge: str, frame: float) -> Colour:
        """Return the colour of an edge at a frame, without the solution of the picks."""
        if self._own is None:
            fields = self._members()
            own = {n: v for n, v in fields["edits"].items() if n not in ("picks", "solution")}
            if own != fields["edits"]:
                data = sidecar.encoded({**fields, "edits": own})
                self._own = _core.parse_sidecar(data, self._name)
        palette = palette_at(self._own or self.core, frame)
        return as_colour(palette.edited[palette.ids.index(edge)])

    def reset(self, id: str | None = None) -> None:
        """Reset a vertex to its original colour, remove a stop, or (None) reset everything.

        Everything: handles, picks, locks and the clip's ramp. Versions stay.
        """
        if id is None:
            self._remove(self._active(), "reset everything")
        elif id in self._settings:
            gone = self._settings[id].edge is not None
            keys: list[Key] = [("handle", id), ("lock", id)] if gone else [("handle", id)]
            self._remove([key for key in keys if key in self._state], f"reset {id}")
        else:
            self._handles.vertex(id, self._settings)

    def _remove(self, keys: Iterable[Key], label: str) -> None:
        changes = tuple(Change(*key, self._state[key], None) for key in keys)
        self.apply(Edit(changes, label))

    def set_ramp(self, ramp: str, id: str | None = None) -> None:
        """Set the ramp from a vertex or stop to the next handle in time, or the clip's ramp.

        Parameters
        ----------
        ramp : {"linear", "smooth", "hold"}
            Linear; the monotone cubic without overshoot; the handle's edit up to the next handle.
        id : str, optional
            The vertex or stop; None: all handles without a ramp of their own.
        """
        known = as_ramp(ramp)
        if id is None:
            self._put(*RAMP, None if known == "linear" else known, f"ramp {known}")
            return
        setting = self._settings.get(id) or Setting(self.colour(id))
        self._put("handle", id, replace(setting, ramp=known), f"ramp {known} from {id}")

    def apply(self, edit: Edit) -> None:
        """Apply an edit as one step, which `undo` reverts; an edit without change is no step."""
        edit = replace(edit, changes=tuple(c for c in edit.changes if c.before != c.after))
        if not edit.changes:
            return
        self._change(edit)
        self._done = [*self._done, edit]
        self._undone = []

    @contextlib.contextmanager
    def one_step(self, label: str) -> Generator[None]:
        """Make all edits in a ``with`` block one step; an error in it reverts them all."""
        state, done, undone = self._state, self._done, self._undone
        try:
            yield
        except BaseException:
            self._become(state)
            self._done, self._undone, self._core, self._solved = done, undone, None, None
            raise
        edit = edits.difference(state, self._state, label)
        self._done, self._undone = ([*done, edit], []) if edit.changes else (done, undone)

    def undo(self) -> Edit:
        """Revert the last step, and return it. Steps of earlier sessions can be reverted too."""
        if not self._done:
            raise Palette4dError("there is nothing to undo: the palette has no earlier step")
        step = self._done[-1]
        self._change(step.inverse())
        self._done, self._undone = self._done[:-1], [*self._undone, step]
        return step

    def redo(self) -> Edit:
        """Apply the last undone step again, and return it."""
        if not self._undone:
            raise Palette4dError("there is nothing to redo: no step was undone since the last edit")
        step = self._undone[-1]
        self._change(step)
        self._done, self._undone = [*self._done, step], self._undone[:-1]
        return step

    def forget_history(self) -> None:
        """Drop all steps, done and undone; the edits stay."""
        self._done, self._undone = [], []

    def _change(self, edit: Edit) -> None:
        self._become(edit.apply(self._state))
        self._core = None
        self._solved = None

    # -------------------------------------------------------------------------------------- picks

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
            With its id, its path and its measured residual.

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
        global_only: bool = False,
        any_value: bool = False,
        progress: Callable[[int, int], object] | None = None,
    ) -> Pick:
        """Keep a colour of the clip as it is, whatever picks and handles do; as `pick`."""
        at = self._picked(frame, colour, pixel, box, clip, any_value)
        found = replace(at, start=start, until=until, fade=fade, radius=radius)
        return self._add_pick(replace(found, global_only=global_only), clip, follow, progress)

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
        from palette4d.grade.picking import corrected

        at = self._picked(frame, colour, pixel, box, clip, any_value)
        found = corrected(self._pick(id), at.frame, at.rgb)
        found = replace(found, path=self._clip_of_picks(clip).path(found, progress))
        self._put("pick", id, found.to_fields(), f"correct {id} at frame {frame:g}")
        return self._pick(id)

    def change_pick(
        self,
        id: str,
        *,
        by: Iterable[float] | None = None,
        any_value: bool = False,
        clip: str | os.PathLike[str] | None = None,
        progress: Callable[[int, int], object] | None = None,
        **changes: Any,
    ) -> Pick:
        """Change a pick or hold: any of the attributes of `Pick` but id, kind and path.

        `by` gives the new colour as offsets from the picked colour. A new `frame`, `rgb` or range
        is followed again, if the pick was followed.
        """
        old = self._pick(id)
        if by is not None:
            base = as_colour(changes.get("rgb", old.rgb))
            changes["to"] = [a + b for a, b in zip(base, as_colour(by, "offset"), strict=True)]
        for name in ("rgb", "to"):
            if name in changes:
                changes[name] = self._checked(changes[name], any_value)
        if old.kind == "hold" and (bad := {"to", "toward"} & changes.keys()):
            raise Palette4dError(f"{id} is a hold, which has no {' and no '.join(sorted(bad))}")
        new = replace(old, **changes)
        self._check_pick(new)
        moved = {"frame", "rgb", "start", "until", "fade"} & changes.keys()
        if moved and old.path:
            given = tuple(key for key in old.path if key.given and key.frame != old.frame)
            path = self._clip_of_picks(clip).path(replace(new, path=given), progress)
            new = replace(new, path=path)
        self._put("pick", id, new.to_fields(), f"change {id}")
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
                raise unknown(id_, "lock", locked)
        self._remove([("lock", id_) for id_ in dict.fromkeys(ids)], f"unlock {' '.join(ids)}")

    @property
    def locks(self) -> tuple[str, ...]:
        """The ids of the handles that picks do not move."""
        return tuple(self._members()["edits"].get("locks", ()))

    @property
    def has_clip_colours(self) -> bool:
        """Whether the sidecar has colours of its clip; without, picks guard the palette's only."""
        return bool(self._fields.get("colours"))

    def moved_by_picks(self) -> tuple[int, int]:
        """Return how many vertices picks move by more than 1/255, and how many there are."""
        solution = self._members()["edits"].get("solution", {"vertices": [], "keys": []})
        moved = {
            entry["vertex"]
            for entry in solution["vertices"]
            if max(map(abs, entry["by"])) > 1 / 255
        }
        return len(moved), len(self._handles.vertices)

    def colour_of_pixel(
        self,
        frame: float,
        pixel: tuple[float, float],
        box: int = 1,
        clip: str | os.PathLike[str] | None = None,
    ) -> Colour:
        """Return the mean colour of a box around a pixel of the clip, in the palette's values."""
        self.check_frame(frame)
        return self._clip_of_picks(clip).colour(frame, pixel, box)

    def _clip_of_picks(self, clip: str | os.PathLike[str] | None) -> "ClipOfPicks":
        from palette4d.grade.picking import ClipOfPicks

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
            rgb = self.colour_of_pixel(frame, pixel, box, clip)
            return Pick("", "hold", frame, rgb, pixel=pixel, box=box)
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
        taken = (id_ for kind, id_ in self._state if kind == "pick")
        found = replace(found, id=edits.new_id("p", taken))
        self._put("pick", found.id, found.to_fields(), f"{found.kind} {_text(found.rgb)}")
        return self._pick(found.id)

    def _check_pick(self, found: Pick) -> None:
        self.check_frame(found.frame)
        check_range(found, self.frames)

    def _pick(self, id_: str) -> Pick:
        for found in self.picks:
            if found.id == id_:
                return found
        raise unknown(id_, "pick or hold", [found.id for found in self.picks])

    # ----------------------------------------------------------------------------------- versions

    @property
    def versions(self) -> tuple[str, ...]:
        """The names of the versions, sorted."""
        return tuple(sorted(name for kind, name in self._state if kind == "version"))

    def save_version(self, name: str) -> None:
        """Keep the active edits as a version; a version with this name is replaced."""
        if not 1 <= len(name.strip()) <= LONGEST_NAME or not name.isprintable():
            raise Palette4dError(
                f"found the version name {name!r}, expected 1 to {LONGEST_NAME} printable "
                "characters"
            )
        self._put("version", name, self.fields()["edits"], f"save version {name}")

    def use_version(self, name: str) -> str | None:
        """Make the edits of a version the active edits, as one step.

        Active edits that no version holds are kept as a new version.

        Returns
        -------
        str or None
            The name of the new version, such as "before NAME".
        """
        wanted = edits.from_fields(self._version(name))
        versions, kept = self._versions_with_active(f"before {name}")
        self.apply(edits.difference(self._state, {**wanted, **versions}, f"use version {name}"))
        return kept

    def _versions_with_active(self, name: str) -> tuple[dict[Key, Any], str | None]:
        """Return the versions, with the active edits as another one if none holds them."""
        versions = {key: value for key, value in self._state.items() if key[0] == "version"}
        if not self._active() or any(map(self.same_edits, self.versions)):
            return versions, None
        names = (name[: LONGEST_NAME - 4] + more for more in _suffixes())
        kept = next(each for each in names if ("version", each) not in versions)
        versions["version", kept] = self.fields()["edits"]
        return versions, kept

    def copy_from(self, source: "Document", *, time: Time = "relative") -> Fit:
        """Take over the grade of another document, as one step.

        Each handle gets the colour that the other grade makes of its colour at the corresponding
        time. Picks are copied and solved again. Active edits that no version holds are kept as the
        version "before copy".

        Parameters
        ----------
        source : Document
            The graded document.
        time : "relative" or float
            "relative": the first frame gets the look of the first frame, the last that of the last.
            A frame: all frames get the look of this frame of `source`.

        Returns
        -------
        Fit
            How near the result is to the copied grade; its text is for people.

        Raises
        ------
        Palette4dError
            The source has no edits, the frame is outside of its clip, or its colour space cannot be
            converted.
        """
        if not source.edited:
            raise Palette4dError(
                f"{source._name} has no edits; expected a graded palette to copy from"
            )
        state = copied(self, source, time)
        before = (self._state, self._done, self._undone)
        versions, _ = self._versions_with_active("before copy")
        label = f"copy the grade of {source._fields['clip']['name']}"
        locks = {key: value for key, value in self._state.items() if key[0] == "lock"}
        self.apply(edits.difference(self._state, {**state, **locks, **versions}, label))
        try:
            return fit(self, source, time)
        except BaseException:
            self._become(before[0])
            self._core, self._solved, (_, self._done, self._undone) = None, None, before
            raise

    def same_edits(self, name: str) -> bool:
        """Whether a version holds the active edits."""
        return edits.from_fields(self._version(name)) == self._active()

    def _active(self) -> dict[Key, Any]:
        return {key: value for key, value in self._state.items() if key[0] in _ACTIVE}

    def remove_version(self, name: str) -> None:
        """Remove a version."""
        self._version(name)
        self._put("version", name, None, f"remove version {name}")

    def at(self, state: State) -> "Document":
        """Return a document with another state of the user's edits, not bound to the file."""
        found = copy.copy(self)
        found._disk = None
        if state != self._state:
            found._become(state)
            found._core, found._solved = None, None
        found.forget_history()
        return found

    def version(self, name: str) -> "Document":
        """Return a document with the edits of a version as the active edits; "" returns this one.

        It is not bound to the file: `save` needs a name.
        """
        if not name:
            return self
        fields = self._version(name)
        others = {key: value for key, value in self._state.items() if key[0] == "version"}
        found = self.at({**edits.from_fields(fields), **others})
        found._solved = _stored_solution(fields)
        return found

    def _version(self, name: str) -> Fields:
        found: Fields | None = self._state.get(("version", name))
        if found is None:
            there = ", ".join(map(repr, self.versions)) or "none"
            raise Palette4dError(f"there is no version {name!r}; the palette has {there}")
        return found

    # ----------------------------------------------------------------------------------- applying

    def recolour(
        self,
        image: F32,
        frame: float,
        *,
        strength: float = 1.0,
        keep_lightness: float = 0.0,
        lightness_of: str = "auto",
        mix: float = 1.0,
        show: str = "recoloured",
        matte_in: Literal["picture", "alpha"] = "picture",
        outside_at: float = 0.05,
        premultiplied: bool = False,
        space: Literal["input", "palette"] = "input",
        threads: int = 0,
    ) -> F32:
        """Recolour an image with the palette at a time: the same bits as the node.

        Parameters
        ----------
        image : (h, w, 3 or 4) float32
            Code values of the clip, 0..1 as a rule; a grade never changes alpha.
        frame : float
            The time; frames outside the clip use its first or last frame.
        strength : float
            0 is the original, 1 the edit.
        keep_lightness : float
            The share of the source's lightness to keep: 0 none, 1 all.
        lightness_of : {"auto", "rec709", "rec2020", "p3", "ap1", "rec601"}
            Whose luminance weights define lightness; "auto": the image's colour space.
        mix : float
            0 is the image, 1 the output.
        show : str
            "recoloured"; "weight:ID", a soft key of a vertex or stop; "outside", a matte of the
            colours outside the palette; "palette", the recoloured picture above its palette.
        matte_in : {"picture", "alpha"}
            A key or matte as a grey picture, or multiplied into alpha.
        outside_at : float
            The distance from the palette, in its code values, at which "outside" is 1.
        premultiplied : bool
            Colours are multiplied by alpha.
        space : {"input", "palette"}
            "palette": the image is in the palette's own colour space, not in the clip's.
        threads : int
            0: one per processor. The result does not depend on it.

        Returns
        -------
        (h, w, 3 or 4) float32
            A new array. Without edits it equals `image` bit by bit.
        """
        output = Output(show, strength, keep_lightness, lightness_of, mix, matte_in, outside_at)
        pixels = _checked_image(image)
        palette = self.palette(frame)
        self._conversion(space)
        recolourer = _core.Recolourer(
            palette.rgb, palette.edited, palette.faces, bumps=palette.bumps
        )
        return output.draw(
            pixels,
            self.core,
            palette,
            recolourer,
            premultiplied=premultiplied,
            space=space,
            threads=threads,
        )

    def matte(
        self,
        image: F32,
        frame: float,
        show: str,
        *,
        outside_at: float = 0.05,
        space: Literal["input", "palette"] = "input",
        threads: int = 0,
    ) -> F32:
        """Return a matte of an image: the same values as the node's.

        Parameters
        ----------
        image : (h, w, 3 or 4) float32
            As in `recolour`; colours are not multiplied by alpha, and alpha is ignored.
        show : str
            "weight:ID", a soft key of a vertex or stop, which follows its colour through time, or
            "outside", the colours outside the palette.
        frame, outside_at, space, threads
            As in `recolour`.

        Returns
        -------
        (h, w) float32
            0..1.
        """
        if show == "palette" or show == "recoloured":
            raise Palette4dError(f"found {show!r}, expected a matte: 'weight:ID' or 'outside'")
        colours = np.ascontiguousarray(_checked_image(image)[..., :3])
        drawn = self.recolour(
            colours, frame, show=show, outside_at=outside_at, space=space, threads=threads
        )
        return np.ascontiguousarray(drawn[..., 0])

    def weights(
        self, image: F32, frame: float, *, space: Literal["input", "palette"] = "input"
    ) -> F32:
        """Return the weight of each palette colour in each pixel (mean value coordinates).

        Parameters
        ----------
        image : (h, w, 3 or 4) float32
            As in `recolour`; colours are not multiplied by alpha, and alpha is ignored.
        frame, space
            As in `recolour`.

        Returns
        -------
        (h, w, n) float32
            Weights in the order of ``palette(frame).ids``; they sum to 1. They reproduce the pixel,
            or, outside the palette, its nearest point. NaN for pixels that are not finite.
        """
        colours = _checked_image(image)[..., :3]
        palette = self.palette(frame)
        conversion = self._conversion(space)
        result = np.empty((*colours.shape[:2], len(palette.ids)), np.float32)

        def row(y: int) -> None:
            points: NDArray[Any] = colours[y]
            if conversion is not None:
                points = conversion.to_palette(points)
            result[y], _ = _core.palette_weights(points, palette.rgb, palette.faces)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(row, range(len(colours))))
        return result

    def _conversion(self, space: str) -> _core.ColourConversion | None:
        if space not in ("input", "palette"):
            raise Palette4dError(f"found the space {space!r}, expected 'input' or 'palette'")
        own = self.core.conversion
        return None if own is None or space == "palette" else own.steps

    # ------------------------------------------------------------------------------------- saving

    def save(
        self, path: str | os.PathLike[str] | None = None, *, on_edits: OnEdits = "refuse"
    ) -> None:
        """Write the sidecar atomically: readers see the old file or the new file.

        Another program may have edited the file since it was loaded. Then `save` merges the edits
        of both into the file and the document. If both changed one handle differently, it raises an
        error and writes nothing.

        Parameters
        ----------
        path : path, optional
            A file other than the loaded file.
        on_edits : {"refuse", "keep", "drop"}
            What to do with edits in that file, which would be lost. "keep" takes them over. If the
            palette differs, it copies the grade and keeps the old file under another name; `notes`
            says so.

        Raises
        ------
        Palette4dError
            Edits would be lost, or the file cannot be written.
        """
        if path is None and self.path is None:
            raise Palette4dError(
                "this palette has no file yet; expected a name: save('clip.p4d.json')"
            )
        target = Path(path if path is not None else self.path or "")
        if path is None and self._disk is None:
            raise Palette4dError(
                f"this is not the document in {self.path}; expected another name to save it under"
            )
        if self._disk is not None and self.path is not None and _same(target, self.path):
            self._save_again(link_target(target), self._disk)
            return
        self._done = edits.bounded(self._done)
        fields = self.fields()
        if self.path is None:
            fields["clip"]["source"] = _beside(fields["clip"]["source"], target)
        from palette4d.grade import renewal  # which needs this module

        path, self.path = self.path, target
        try:
            fields, notes = renewal.save(fields, target, on_edits=on_edits)
        except BaseException:
            self.path = path
            raise
        self.notes += tuple(notes)
        self._disk = sidecar.encoded(fields)
        self._start(self._disk, _core.parse_sidecar(self._disk, str(target)))

    def _save_again(self, target: Path, loaded: bytes) -> None:
        with locked(target) as held:
            found = sidecar.read_bytes(target)
            if found == loaded and not self.changed:
                return
            new = self._merged(found) if found != loaded else copy.copy(self)
            new._done = edits.bounded(new._done)
            data = sidecar.encoded(new._members())
            if found != loaded or new._core is None:
                new._core = _core.parse_sidecar(data, str(target))
            sidecar.write(target, data, held, replaces=found)
        new._disk = data
        new._mark_saved()
        self.__dict__ = new.__dict__

    def _merged(self, found: bytes) -> "Document":
        """Return the document in the file with this document's changes since it was loaded."""
        new = Document.__new__(Document)
        new.path, new.notes = self.path, self.notes
        new._start(found, _core.parse_sidecar(found, self._name))
        if new._fields["polytope"] != self._fields["polytope"]:
            raise Palette4dError(
                f"{self._name}: the clip was analysed again since this palette was loaded, and the "
                "edits belong to the old palette; nothing was written. Load the file again, or "
                "save under another name"
            )
        loaded, before, _ = self._saved
        try:
            state, names = edits.merged(loaded, self._state, new._state, self._taken())
        except Palette4dError as error:
            raise Palette4dError(f"{self._name}: {error}") from None
        both = zip(before, self._done, strict=False)
        shared = sum(1 for _ in itertools.takewhile(lambda pair: pair[0] == pair[1], both))
        steps = [
            replace(step.inverse(), label=f"undo: {step.label}")
            for step in reversed(before[shared:])
        ]
        steps += self._done[shared:]
        mine = edits.rebased([step.renamed(names) for step in steps], new._state)
        theirs = new._state
        for step in mine:
            new._change(step)
        if new._state != state:  # the steps on the way there met theirs
            mine = [edits.difference(theirs, state, "edits of two programs")]
            new._become(state)
        if mine:
            new._done = new._done + mine
            new._undone = [step.renamed(names) for step in self._undone]
        return new

    # ------------------------------------------------------------------------------------ details

    def _taken(self) -> frozenset[str]:
        return frozenset((*self._handles.vertices, *self._handles.edges))

    def _stop_at(self, edge: str, frame: float) -> str | None:
        for id_, setting in self._settings.items():
            if setting.edge == edge and setting.frame == frame:
                return id_
        return None

    def _check_inside(self, edge: str, frame: float) -> None:
        if edge in self._settings or edge in self._handles.vertices:
            raise Palette4dError(
                f"{self.named(edge)} has a time of its own: leave out frame=…, which is for "
                "edges and for near=…"
            )
        self._handles.check_inside(edge, frame)


def _stored_solution(found: Fields) -> Solved:
    measured = {
        pick["id"]: {name: pick[name] for name in edits.MEASURED if name in pick}
        for pick in found.get("picks", ())
    }
    return found.get("solution", {}), measured


def _solve(fields: Fields) -> Solved:
    """Return the solution of the picks in a sidecar's members, and what it measured of each."""
    if not any(pick.get("enabled", True) for pick in fields["edits"].get("picks", ())):
        return {}, {}
    from palette4d.grade import solve

    return solve.solve(fields)


def _suffixes() -> Iterator[str]:
    yield ""
    yield from (f" {number}" for number in itertools.count(2))


def _text(colour: Colour) -> str:
    return " ".join(f"{value:.4g}" for value in colour)


def _finite(frame: float) -> float:
    if not math.isfinite(frame):
        raise Palette4dError(f"found the frame {frame}, expected a finite number")
    return float(frame)


def _checked_image(image: F32) -> F32:
    array = np.asarray(image)
    if array.dtype.kind != "f" or array.dtype.itemsize != 4:
        if array.dtype.kind == "u":
            largest = 2 ** (8 * array.dtype.itemsize) - 1
            remedy = f"image.astype(numpy.float32) / {largest} makes code values of 0 to 1"
        else:
            remedy = "image.astype(numpy.float32) converts it"
        raise Palette4dError(
            f"found an image of {array.dtype}, expected float32 code values; {remedy}"
        )
    if array.ndim != 3 or array.shape[2] not in (3, 4):
        raise Palette4dError(
            f"found an image of the shape {array.shape}, expected (height, width, 3) or "
            "(height, width, 4)"
        )
    return np.ascontiguousarray(array, dtype=np.float32)


def _same(a: Path, b: Path) -> bool:
    return os.path.realpath(a) == os.path.realpath(b)


def _beside(source: str, output: Path) -> str:
    """Return the source relative to the sidecar's folder, so that both may move together."""
    if not source or Path(source).is_absolute():
        return source
    try:
        return Path(os.path.relpath(source, output.absolute().parent)).as_posix()
    except ValueError:  # on another drive
        return str(Path(source).absolute())
