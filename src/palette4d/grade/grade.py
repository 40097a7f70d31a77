"""A grade: a palette and the user's edits, as a value. Edits give another one.

Handles are edited in `handle_edits`, picks in `pick_edits`, versions in `versions`: functions of a
grade and arguments that return a grade. `Document` adds the steps and the file.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from palette4d import _core
from palette4d.colour.ocio_config import says_linear
from palette4d.common.errors import Arg, Palette4dError
from palette4d.grade import members
from palette4d.grade.edits import (
    ACTIVE,
    RAMP,
    Colour,
    Edit,
    Key,
    Kind,
    Ramp,
    Setting,
    Settings,
    State,
    as_colour,
    in_order,
)
from palette4d.grade.handle_names import colours_by_id
from palette4d.grade.handles import Handles, unknown
from palette4d.grade.mattes import Display, display_curve
from palette4d.grade.members import Fields
from palette4d.grade.palette import Near, Palette, palette_at
from palette4d.grade.picks import Pick
from palette4d.grade.tracks import Track, tracks_of


@dataclass(frozen=True, eq=False)
class Grade:
    """A palette and the user's edits.

    Colours are code values of the palette (``encoding`` says which). Frames are the clip's frame
    numbers; fractions are times between frames.

    Attributes
    ----------
    members, analysed : dict and Sidecar
        The sidecar's members as analysed, with the edits of the file, and the core's view of them.
    path : Path or None
        The sidecar, beside which the clip is looked for.
    state : mapping
        Everything that the user set, by kind and id (`palette4d.grade.edits`).
    mattes : mapping of str to str
        Texts of learned mattes by id, also of removed picks.
    label : str
        What the last change did, for people.
    """

    members: Fields
    analysed: _core.Sidecar
    handles: Handles
    path: Path | None
    state: State
    mattes: Mapping[str, str] = field(default_factory=dict)
    label: str = ""

    @classmethod
    def of(cls, analysed: _core.Sidecar, fields: Fields, path: Path | None) -> Self:
        """Return the grade of a sidecar's members."""
        mattes = fields.get("mattes", {}).get("grids", {})
        state = MappingProxyType(members.state_of(fields))
        handles = Handles(fields["polytope"])
        return cls(fields, analysed, handles, path, state, mattes)

    # -------------------------------------------------------------------------------- other grades

    def with_state(self, state: State, label: str = "") -> Self:
        """Return the grade with another state."""
        return replace(self, state=MappingProxyType(dict(state)), label=label)

    def after(self, edit: Edit) -> Self:
        """Return the grade after an edit."""
        return self.with_state(edit.apply(self.state), edit.label)

    def put(self, kind: Kind, id: str, value: Any, label: str = "") -> Self:
        """Return the grade with one other value; None removes it."""
        return self.having({(kind, id): value}, label)

    def having(self, values: Mapping[Key, Any], label: str = "") -> Self:
        """Return the grade with other values; None removes one."""
        state = {k: v for k, v in {**self.state, **values}.items() if v is not None}
        return self.with_state(state, label)

    def only(self, *kinds: Kind) -> Self:
        """Return the grade with values of these kinds alone."""
        return self.with_state({k: v for k, v in self.state.items() if k[0] in kinds})

    def labelled(self, label: str) -> Self:
        """Return the grade with another label."""
        return replace(self, label=label)

    def with_mattes(self, texts: Mapping[str, str]) -> Self:
        """Return the grade with further mattes, texts by id."""
        return replace(self, mattes={**texts, **self.mattes})

    # ------------------------------------------------------------------------------- what it holds

    @cached_property
    def core(self) -> _core.Sidecar:
        """The core's view, for this package."""
        fields = members.edits_fields(self.state, self.handles.vertices)
        mattes = members.mattes_of(self.picks, self.mattes, self.display)
        return self.analysed.with_edits(fields, mattes, self.name)

    @property
    def name(self) -> str:
        """The file's name, for errors."""
        return "<document>" if self.path is None else str(self.path)

    def fields(self, done: Iterable[Edit] = (), undone: Iterable[Edit] = ()) -> Fields:
        """Return the members of a sidecar with this grade and these steps (docs/sidecar.md).

        They share values with the grade.
        """
        history = (tuple(done), tuple(undone))
        return members.with_state(self.members, self.state, history, self.mattes, self.display)

    def display(self) -> Display | None:
        """Return the curve from the palette's code values to a display's."""
        return display_curve(self.encoding)

    def of_kind(self, *kinds: Kind) -> dict[Key, Any]:
        """Return the state's values of some kinds."""
        return {key: value for key, value in self.state.items() if key[0] in kinds}

    @property
    def active(self) -> dict[Key, Any]:
        """The state without versions: what recolouring uses."""
        return self.of_kind(*ACTIVE)

    @property
    def frames(self) -> tuple[int, int, int]:
        """First and last frame number of the clip, and the step between frames."""
        frames = self.members["clip"]["frames"]
        return frames["first"], frames["last"], frames["step"]

    @property
    def encoding(self) -> str:
        """The colour space of the palette's code values, or "unknown"."""
        return str(self.members["clip"]["encoding"])

    @property
    def scene_linear(self) -> bool:
        """Whether the clip is scene-linear, or its palette reaches far above 1."""
        clip = self.members["clip"]
        names = (clip["encoding"], clip.get("conversion", {}).get("input_space", ""))
        brightest = max(max(v["rgb"]) for v in self.handles.vertices.values())
        return any(map(says_linear, names)) or brightest > 2

    @cached_property
    def settings(self) -> Settings:
        """The settings of the edited vertices and of the stops, by id."""
        return MappingProxyType({id_: value for (_, id_), value in self.of_kind("handle").items()})

    @property
    def edited(self) -> bool:
        """Whether any handle is edited or any colour is picked."""
        return any(kind in ("handle", "pick") for kind, _ in self.state)

    @property
    def ramp(self) -> Ramp:
        """The clip's ramp between handles: "linear", "smooth" or "hold"."""
        ramp: Ramp = self.state.get(RAMP, "linear")
        return ramp

    @cached_property
    def picks(self) -> tuple[Pick, ...]:
        """The picks and holds, in the order of their ids."""
        return tuple(self.state[key] for key in self._ordered("pick"))

    @property
    def locks(self) -> tuple[str, ...]:
        """The ids of the handles that stay when tracks or the palette move."""
        return tuple(id_ for _, id_ in self._ordered("lock"))

    def _ordered(self, kind: Kind) -> list[Key]:
        return sorted(self.of_kind(kind), key=in_order)

    def pick(self, id: str) -> Pick:
        """Return a pick or hold by its id."""
        pick: Pick | None = self.state.get(("pick", id))
        if pick is None:
            raise unknown(id, "pick or hold", [pick.id for pick in self.picks], "`picks`")
        return pick

    @property
    def versions(self) -> tuple[str, ...]:
        """The names of the versions, sorted."""
        return tuple(sorted(name for _, name in self.of_kind("version")))

    def version(self, name: str) -> Self:
        """Return the grade with the edits of a version as the active edits; "" returns this one."""
        kept = self.of_kind("version", "note")
        return self.with_state({**self.of_version(name), **kept}) if name else self

    def of_version(self, name: str) -> State:
        """Return the state of a version."""
        state: State | None = self.state.get(("version", name))
        if state is None:
            there = ", ".join(map(repr, self.versions)) or "none"
            raise Palette4dError(f"there is no version {name!r}; the palette has {there}")
        return state

    def note(self, name: str) -> str:
        """Return the note of a version; "" without one."""
        return str(self.state.get(("note", name), ""))

    @property
    def same_edits(self) -> tuple[str, ...]:
        """The names of the versions that hold the active edits."""
        active = self.active
        return tuple(name for name in self.versions if self.of_version(name) == active)

    @cached_property
    def tracks(self) -> list[Track]:
        """The palette's colours through time: the rows of `palette4d plot`."""
        return tracks_of(self.handles, colours_by_id(self.handles, self.encoding))

    @property
    def colour_names(self) -> dict[str, str]:
        """The names of the unedited colours of vertices and stops by id, such as "deep red"."""
        return colours_by_id(self.handles, self.encoding, self.settings)

    @property
    def names(self) -> dict[str, str]:
        """The names of vertices and stops by id: colour and frame, such as "deep red, 13"."""
        colours = self.colour_names
        return {id_: f"{colour}, {round(self.frame_of(id_))}" for id_, colour in colours.items()}

    def called(self, id: str) -> str:
        """Return the name of a vertex or stop, or of an edge's track; "" for other ids."""
        tracks = (track.called for track in self.tracks if id in track.edges)
        return self.names.get(id) or next(tracks, "")

    def named(self, id: str) -> str:
        """Return a handle with its place, for people: "stop s1 (edge e3, frame 4.5)"."""
        setting = self.settings.get(id)
        if setting is not None and setting.edge is not None:
            return f"stop {id} (edge {setting.edge}, frame {setting.frame:g})"
        if id in self.handles.vertices:
            return f"vertex {id} (frame {self.handles.vertices[id]['frame']:g})"
        return id

    # ------------------------------------------------------------------------------ colours, times

    def palette(self, frame: float) -> Palette:
        """Return the palette at a time: ids, colours as analysed and as edited, faces.

        Frames outside the clip give its first or last.
        """
        return palette_at(self.core, _finite(frame))

    def colour(self, id: str, *, frame: float | None = None) -> Colour:
        """Return the edited colour of a vertex or stop, or of an edge at a frame."""
        if (setting := self.settings.get(id)) is not None:
            return setting.rgb
        if frame is None or id in self.handles.vertices:
            return as_colour(self.handles.vertex(id, self.settings)["rgb"])
        self.check_frame(frame)
        self.check_inside(id, frame)
        return self.colour_on_edge(id, frame)

    def colour_on_edge(self, edge: str, frame: float) -> Colour:
        """Return the colour of an edge at a frame, its ends included."""
        palette = self.palette(frame)
        return as_colour(palette.edited[palette.ids.index(edge)])

    def near(self, rgb: Iterable[float], *, frame: float, id: str | None = None) -> Near:
        """Return the palette colour nearest to a given colour at a frame, or that of an id.

        The edited palette is compared. The handle is the stop at that time, or the vertex of the
        colour's edge less than a frame step from that time.
        """
        wanted = as_colour(rgb)
        self.check_frame(frame)
        palette = self.palette(frame)
        if id is not None and id not in palette.ids:
            raise unknown(id, "palette colour", palette.ids)
        index, distance = palette.nearest(wanted, id)
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
        if (stop := self.stop_at(id_, frame)) is not None:
            return stop
        away = {end: abs(self.handles.vertex(end)["frame"] - frame) for end in ends}
        nearest = min(ends, key=lambda end: away[end])
        return nearest if away[nearest] < self.frames[2] else None

    def stop_at(self, edge: str, frame: float) -> str | None:
        """Return the id of the stop of an edge at a frame."""
        for id_, setting in self.settings.items():
            if setting.edge == edge and setting.frame == frame:
                return id_
        return None

    def frame_of(self, id: str | None, frame: float | None = None) -> float:
        """Return the frame of a vertex or stop; for an edge, the frame that is given."""
        if id in self.handles.edges:
            if frame is None:
                raise Palette4dError(
                    f"{id} is an edge, whose colour changes in time; give the frame at which it "
                    f"gets one as {Arg('frame')}"
                )
            return frame
        setting = self.settings.get(id or "")
        if setting is not None and setting.frame is not None:
            return setting.frame
        own: float = self.handles.vertex(id or "", self.settings)["frame"]
        return own

    def setting(self, id: str) -> Setting:
        """Return the setting of a handle; of one that is not edited, its own colour."""
        return self.settings.get(id) or Setting(self.colour(id))

    # -------------------------------------------------------------------------------------- checks

    def check_frame(self, frame: float) -> None:
        """Refuse a time outside the clip."""
        first, last, _ = self.frames
        if not first <= _finite(frame) <= last:
            raise Palette4dError(
                f"frame {frame:g} is outside of the clip; choose one from {first} to {last}"
            )

    def check_inside(self, edge: str, frame: float) -> None:
        """Refuse a place that is not inside an edge."""
        if edge in self.settings or edge in self.handles.vertices:
            raise Palette4dError(
                f"{self.named(edge)} has a time of its own, and only edges get stops; set "
                f"{edge} itself, without {Arg('frame')}"
            )
        self.handles.check_inside(edge, frame)

    def checked(
        self, rgb: Iterable[float] | str, any_value: bool = False, what: str = "colour"
    ) -> Colour:
        """Return a colour or offset; refuse one that looks like integers of 8 bits or more.

        Scene-linear clips accept all colours: their code values may be large.
        """
        values = as_colour(rgb, what)
        largest = max(map(abs, values))
        whole = largest > 1 and all(value.is_integer() for value in values)
        if any_value or self.scene_linear or not (whole or largest > 16):
            return values
        bits = next(n for n in (8, 10, 12, 16, 32) if largest < 2**n)
        shown = " ".join(f"{value:g}" for value in values)
        scaled = " ".join(f"{value / (2**bits - 1):.4g}" for value in values)
        raise Palette4dError(
            f"found the {what} {shown}, expected code values where 1 is display white; "
            f"{shown} in {bits} bits is {scaled}. Give that, or add {Arg('any_value', True)} if "
            f"{shown} is meant"
        )


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
