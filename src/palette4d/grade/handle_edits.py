"""Edits of handles: the colours of vertices and stops, stops in time, and ramps."""

from collections.abc import Iterable
from dataclasses import replace
from typing import TypedDict, Unpack

from palette4d.colour.oklch import Adjustment, adjuster
from palette4d.common.errors import Arg, Palette4dError
from palette4d.grade import colour_moves, edits
from palette4d.grade.edited_palette import EditedPalette, text_of
from palette4d.grade.edits import RAMP, Change, Colour, Edit, Key, Ramp, Setting, as_colour, as_ramp
from palette4d.grade.handles import unknown
from palette4d.grade.palette import FAR, Near, palette_at
from palette4d.grade.tracks import way_of

#: A vertex that has less of the colour at a frame than this is left alone: it would move too far.
LEAST_SHARE = 0.5


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


class HandleEdits(EditedPalette):
    """The edits of a palette's handles."""

    def set(self, id: str, *, rgb: Iterable[float] | str, any_value: bool = False) -> None:
        """Set the colour of a vertex or a stop.

        Colours are three code values or "#rrggbb". Integers of 8 bits or more, such as 255 128 0,
        are refused unless `any_value` is true (`check_code_values`); this holds for all methods.
        """
        self._set(id, self._checked(rgb, any_value))

    def _set(self, id: str, new: Colour) -> None:
        before = self._settings.get(id)
        if before is None:
            self._handles.vertex(id, self._settings)
        after = Setting(new) if before is None else replace(before, rgb=new)
        self._put("handle", id, after, f"set {id} to {text_of(new)}")

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
        self._put("handle", id_, setting, f"set {edge} at frame {frame:g} to {text_of(new)}")
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

        The stop at that time moves, or a vertex less than a frame step away, so that the colour at
        the frame is exactly the new one. Otherwise a stop is added.

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
        if colour_moves.range_of(start, until, fade, self.frames) is not None:
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
        with self.one_step(f"set {handle or found.id} at frame {frame:g} to {text_of(new)}"):
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

    def shift(self, id: str, *, by: Iterable[float], any_value: bool = False) -> None:
        """Add three offsets to the colour of a vertex or a stop."""
        offset = self._offset(by, any_value)
        new = as_colour([a + b for a, b in zip(self.colour(id), offset, strict=True)])
        with self.one_step(f"move {id} by {text_of(offset)}"):
            self._set(id, new)

    def move(self, stop: str, *, frame: float) -> None:
        """Move a stop in time, within its edge."""
        before = self._settings.get(stop)
        if before is None or before.edge is None:
            if stop in self._handles.vertices:
                raise Palette4dError(
                    f"{stop} is a palette vertex, whose time the analysis found; only stops move "
                    f"in time. Its colour moves with {Arg('by')}"
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
        within = colour_moves.range_of(start, until, fade, self.frames)
        ramp = how.get("ramp")
        known = None if ramp is None else as_ramp(ramp)
        move, what = self._move(id, frame, how, any_value)
        rgb = how.get("rgb")
        if rgb is not None and within is not None and within.weight(self.frame_of(id, frame)) < 1:
            raise Palette4dError(
                f"the colour is meant at frame {self.frame_of(id, frame):g}, outside of the "
                f"range {colour_moves.range_text(start, until)}; expected a range with this frame"
            )
        stop = self._settings.get(id or "")
        if id is None:
            name, way = "palette", (set(self._handles.vertices), set(self._handles.edges))
        elif within is not None or track:
            name, way = f"track {id}", way_of(self._handles, (stop and stop.edge) or id)
        elif id in self._handles.edges:
            new = as_colour(move(self._colour_on_edge(id, self.frame_of(id, frame))))
            return (self._stop(id, self.frame_of(id, frame), new, known),)
        else:
            name, way = id, ({id}, set())
        changed = colour_moves.moved(
            *(self._handles, self._settings, way, move, self._colour_on_edge),
            within=within,
            ramp=known,
            clip_ramp=self.ramp,
            exact=None if id is None or rgb is None or frame is None else (id, frame),
        )
        if track or id is None:
            # Locked handles stay. One that is named itself moves.
            locked = {n for kind, n in self._state if kind == "lock" and n != id}
            changed = {n: setting for n, setting in changed.items() if n not in locked}
        if within is not None:
            what += f" {colour_moves.range_text(start, until)}"
        changes = [Change("handle", n, self._settings.get(n), v) for n, v in changed.items()]
        self.apply(Edit(tuple(changes), f"{'move' if rgb is None else 'set'} {name} {what}"))
        return tuple(change.id for change in changes if change.before != change.after)

    def _move(
        self, id: str | None, frame: float | None, how: How, any_value: bool
    ) -> tuple[colour_moves.Move, str]:
        """Return the move that the user asked for, and its text for people."""
        rgb, by = how.get("rgb"), how.get("by")
        change = Adjustment(how.get("hue", 0.0), how.get("chroma", 1.0), how.get("lightness", 1.0))
        if [rgb is None, by is None, change == Adjustment()].count(False) != 1:
            raise Palette4dError(
                f"expected one kind of change: a new colour {Arg('rgb')}, offsets {Arg('by')}, or "
                f"{Arg('hue')}, {Arg('chroma')} and {Arg('lightness')}"
            )
        if by is not None:
            offset = self._offset(by, any_value)
            return colour_moves.shift(offset), f"by {text_of(offset)}"
        if rgb is None:
            return adjuster(self.encoding, change), str(change)
        if id is None:
            raise Palette4dError(
                f"the whole palette cannot get one colour; expected offsets as {Arg('by')}, or "
                "hue, chroma and lightness"
            )
        new, at = self._checked(rgb, any_value), self.frame_of(id, frame)
        before = self._colour_on_edge(id, at) if id in self._handles.edges else self.colour(id)
        return colour_moves.shift_to(before, new), f"to {text_of(new)}"

    def _offset(self, by: Iterable[float], any_value: bool) -> Colour:
        offset = as_colour(by, "offset")
        if not any_value:
            self.check_code_values(offset, "offset")
        return offset

    def _colour_on_edge(self, edge: str, frame: float) -> Colour:
        """Return the colour of an edge at a frame, its ends included."""
        palette = palette_at(self.core, frame)
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
