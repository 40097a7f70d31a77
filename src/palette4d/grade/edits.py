"""Edits: the settings of handles, and undoable steps between two states of them.

A handle is a palette vertex or a colour stop; an id names it. The state maps ids to `Setting`s. A
vertex without a setting keeps its own colour; a stop without a setting does not exist. Input and
output are plain values: this module knows neither files nor palettes.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from palette4d.common.errors import Palette4dError

Colour = tuple[float, float, float]

#: The largest absolute code value that the file format allows (docs/sidecar.md).
LARGEST_COLOUR = 1e6


def as_colour(values: Iterable[float], what: str = "colour") -> Colour:
    """Return three finite code values.

    Raises
    ------
    Palette4dError
        `values` are not three numbers of at most `LARGEST_COLOUR`.
    """
    try:
        listed = [float(value) for value in values]
    except (TypeError, ValueError):
        listed = []
    if len(listed) != 3 or not all(abs(value) <= LARGEST_COLOUR for value in listed):
        raise Palette4dError(
            f"found the {what} {values!r}, expected 3 finite numbers of at most {LARGEST_COLOUR:g}"
        )
    return (listed[0], listed[1], listed[2])


@dataclass(frozen=True)
class Setting:
    """The user's setting for a handle.

    Attributes
    ----------
    rgb : tuple of float
        The colour, in the palette's code values.
    edge, frame : str and float, or None
        The place of a stop; None for a vertex, which never moves in time.
    """

    rgb: Colour
    edge: str | None = None
    frame: float | None = None


Settings = Mapping[str, Setting]


@dataclass(frozen=True)
class Change:
    """One handle's setting before and after an edit; None: unedited vertex, or no stop."""

    id: str
    before: Setting | None
    after: Setting | None


@dataclass(frozen=True)
class Edit:
    """One undoable step: changes that belong together."""

    changes: tuple[Change, ...]

    def inverse(self) -> "Edit":
        """Return the edit that reverts this edit."""
        return Edit(tuple(Change(c.id, c.after, c.before) for c in reversed(self.changes)))

    def apply(self, settings: Settings) -> dict[str, Setting]:
        """Return the settings after this edit.

        Raises
        ------
        Palette4dError
            A handle has changed since this edit was made.
        """
        result = dict(settings)
        for change in self.changes:
            if result.get(change.id) != change.before:
                raise Palette4dError(
                    f"{change.id} was changed meanwhile, so that this edit no longer fits; give "
                    f"{change.id} a colour again instead"
                )
            if change.after is None:
                result.pop(change.id, None)
            else:
                result[change.id] = change.after
        return result

    def renamed(self, names: Mapping[str, str]) -> "Edit":
        """Return the same edit with new ids of its handles."""
        return Edit(tuple(replace(c, id=names.get(c.id, c.id)) for c in self.changes))


def difference(before: Settings, after: Settings) -> Edit:
    """Return the edit from one state to another."""
    ids = [*before, *(id_ for id_ in after if id_ not in before)]
    return Edit(
        tuple(
            Change(id_, before.get(id_), after.get(id_))
            for id_ in ids
            if before.get(id_) != after.get(id_)
        )
    )


def merged(
    base: Settings, mine: Settings, theirs: Settings, taken: Collection[str]
) -> tuple[dict[str, Setting], dict[str, str]]:
    """Merge the changes of two writers; return the state and the new ids of my stops.

    Parameters
    ----------
    base, mine, theirs : mapping of str to Setting
        The common start, and the two changed states.
    taken : collection of str
        Ids of the palette, which stops must not use.

    Raises
    ------
    Palette4dError
        Both changed one handle, or set a stop at one place, in different ways.
    """
    renamed: dict[str, str] = {}
    result = dict(theirs)
    for change in difference(base, mine).changes:
        id_, there = change.id, theirs.get(change.id)
        if there == change.after:
            continue
        if there != change.before:
            # Two new stops with the same id by chance are two stops.
            if change.before is not None or there is None or _place(there) == _place(change.after):
                raise _conflict(id_)
            renamed[id_] = id_ = new_stop_id({*taken, *result, *mine})
        if change.after is None:
            result.pop(id_, None)
        else:
            result[id_] = change.after
    places: dict[tuple[str, float], str] = {}
    for id_, setting in result.items():
        if (place := _place(setting)) and places.setdefault(place, id_) != id_:
            raise _conflict(f"edge {place[0]} at frame {place[1]:g}")
    return result, renamed


def _place(setting: Setting | None) -> tuple[str, float] | None:
    if setting is None or setting.edge is None or setting.frame is None:
        return None
    return setting.edge, setting.frame


def _conflict(where: str) -> Palette4dError:
    return Palette4dError(
        f"another program has edited {where} as well since the file was loaded; nothing was "
        "written. Load the file again and repeat this edit, or save under another name"
    )


def new_stop_id(taken: Collection[str]) -> str:
    """Return s1, s2, …: one more than the largest in use; ids of removed stops are not reused.

    >>> new_stop_id({"s1", "s7", "v9"})
    's8'
    """
    numbers = [int(id_[1:]) for id_ in taken if id_[0] == "s" and _is_number(id_[1:])]
    return f"s{max(numbers, default=0) + 1}"


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) <= 9


def from_fields(fields: Mapping[str, Any]) -> dict[str, Setting]:
    """Return the state for a sidecar's member "edits"."""
    settings = {entry["vertex"]: Setting(as_colour(entry["rgb"])) for entry in fields["vertices"]}
    for stop in fields["stops"]:
        settings[stop["id"]] = Setting(as_colour(stop["rgb"]), stop["edge"], stop["frame"])
    return settings


def to_fields(settings: Settings, vertex_ids: Iterable[str]) -> dict[str, Any]:
    """Return a sidecar's member "edits": vertices in the palette's order, stops as in the state."""
    return {
        "vertices": [
            {"vertex": id_, "rgb": list(settings[id_].rgb)} for id_ in vertex_ids if id_ in settings
        ],
        "stops": [
            {"id": id_, "edge": setting.edge, "frame": setting.frame, "rgb": list(setting.rgb)}
            for id_, setting in settings.items()
            if setting.edge is not None
        ],
    }
