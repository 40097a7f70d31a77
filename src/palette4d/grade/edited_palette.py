"""A palette with the user's edits: what it holds.

`steps` changes it and takes changes back. Handles are edited in `handle_edits`, picks in
`pick_edits`.
"""

import copy
import math
import re
from collections.abc import Iterable
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Self

from palette4d import _core
from palette4d.common.errors import Arg, Palette4dError
from palette4d.grade import edits, sidecar
from palette4d.grade.edits import (
    RAMP,
    Colour,
    Ramp,
    Setting,
    Settings,
    State,
    as_colour,
)
from palette4d.grade.handle_names import colours_by_id
from palette4d.grade.handles import Handles
from palette4d.grade.palette import Near, Palette, palette_at
from palette4d.grade.sidecar import Fields
from palette4d.grade.steps import Steps
from palette4d.grade.tracks import Track, tracks_of

if TYPE_CHECKING:
    from palette4d.grade.mattes import Display

#: Names of scene-linear colour spaces: "Linear", "lin_rec709", "ACEScg", "ACES2065-1", ...
_LINEAR = re.compile(r"\blin(ear)?(\b|_)|scene.linear|acescg|aces2065", re.IGNORECASE)


class EditedPalette(Steps):
    """A palette and its edits in memory; `Document` adds the file.

    Attributes
    ----------
    path : Path or None
        The sidecar; None until it is saved.
    """

    path: Path | None
    _disk: bytes | None  # the sidecar's bytes, as they were read or saved last

    def _become(self, state: State) -> None:
        super()._become(state)
        self._core: _core.Sidecar | None = None  # the core's view, on demand
        self._settings: dict[str, Setting] = {
            id_: value for (kind, id_), value in state.items() if kind == "handle"
        }

    def _start(self, core: _core.Sidecar, fields: Fields) -> None:
        self._fields = fields
        self._analysed = core
        self._handles = Handles(self._fields["polytope"])
        self._mattes: dict[str, str] = dict(self._fields.get("mattes", {}).get("grids", {}))
        self._become(sidecar.state_of(self._fields))
        self._core = core
        self._done, self._undone = sidecar.history_of(self._fields, self._name)
        self._mark_saved()

    def _mark_saved(self) -> None:
        self._saved = (self._state, self._done, self._undone)

    def trial(self) -> Self:
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
            fields = edits.to_fields(self._state, self._handles.vertices)
            picks = fields.get("picks", ())
            mattes = sidecar.mattes_of(picks, self._mattes, self._display_of_clip)
            self._core = self._analysed.with_edits(fields, mattes, self._name)
        return self._core

    @property
    def _name(self) -> str:
        return "<document>" if self.path is None else str(self.path)

    def fields(self) -> Fields:
        """Return the members of the sidecar that `save` would write (docs/sidecar.md)."""
        plain: Fields = _core.plain(self._members())
        return plain

    def _members(self) -> Fields:
        """Return the sidecar's members; they share values with the document."""
        fields = sidecar.with_state(self._fields, self._state, self._handles.vertices)
        fields = sidecar.with_history(fields, self._done, self._undone)
        return sidecar.with_mattes(fields, self._mattes, self._display_of_clip)

    def _display_of_clip(self) -> "Display | None":
        from palette4d.grade.mattes import display_curve

        return display_curve(self.encoding)

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
    def edited(self) -> bool:
        """Whether any handle is edited or any colour is picked."""
        return any(kind in ("handle", "pick") for kind, _ in self._state)

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

    def check_code_values(self, rgb: Iterable[float], what: str = "colour") -> None:
        """Refuse a colour or offset that looks like integers of 8 bits or more, such as 255 128 0.

        Scene-linear clips accept all colours: their code values may be large.
        """
        values = as_colour(rgb)
        largest = max(map(abs, values))
        whole = largest > 1 and all(value.is_integer() for value in values)
        if self.scene_linear or not (whole or largest > 16):
            return
        bits = next(n for n in (8, 10, 12, 16, 32) if largest < 2**n)
        shown = " ".join(f"{value:g}" for value in values)
        scaled = " ".join(f"{value / (2**bits - 1):.4g}" for value in values)
        raise Palette4dError(
            f"found the {what} {shown}, expected code values where 1 is display white; "
            f"{shown} in {bits} bits is {scaled}. Give that, or add {Arg('any_value', True)} if "
            f"{shown} is meant"
        )

    @property
    def tracks(self) -> list[Track]:
        """The palette's colours through time: the rows of `palette4d plot`."""
        return tracks_of(self._handles, colours_by_id(self._handles, self.encoding))

    @property
    def colour_names(self) -> dict[str, str]:
        """The names of the unedited colours of vertices and stops by id, such as "deep red"."""
        return colours_by_id(self._handles, self.encoding, self._settings)

    @property
    def names(self) -> dict[str, str]:
        """The names of vertices and stops by id: colour and frame, such as "deep red, 13"."""
        colours = self.colour_names
        return {id_: f"{colour}, {round(self.frame_of(id_))}" for id_, colour in colours.items()}

    def called(self, id: str) -> str:
        """Return the name of a vertex or stop, or of an edge's track; "" for other ids."""
        tracks = (track.called for track in self.tracks if id in track.edges)
        return self.names.get(id) or next(tracks, "")

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
        colour's edge less than a frame step from that time.
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
        return nearest if away[nearest] < self.frames[2] else None

    # ------------------------------------------------------------------------------------ details

    def _checked(self, rgb: Iterable[float] | str, any_value: bool) -> Colour:
        colour = as_colour(rgb)
        if not any_value:
            self.check_code_values(colour)
        return colour

    def _conversion(self, space: str) -> _core.ColourConversion | None:
        if space not in ("input", "palette"):
            raise Palette4dError(f"found the space {space!r}, expected 'input' or 'palette'")
        own = self._analysed.conversion
        return None if own is None or space == "palette" else own.steps

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
                f"{self.named(edge)} has a time of its own, and only edges get stops; set "
                f"{edge} itself, without {Arg('frame')}"
            )
        self._handles.check_inside(edge, frame)


def text_of(colour: Colour) -> str:
    """Return three code values for people."""
    return " ".join(f"{value:.4g}" for value in colour)


def _finite(frame: float) -> float:
    try:
        number = math.nan if isinstance(frame, str) else float(frame)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise Palette4dError(f"found the frame {frame!r}, expected a finite number")
    return number
