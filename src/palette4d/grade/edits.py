"""Edits: the state that the user makes, and undoable steps between two states of it.

A state maps keys to values. A key is a kind and an id:

- ``("handle", id)``: a `Setting` of a palette vertex or of a colour stop. A vertex without one
  keeps its own colour; a stop without one does not exist.
- ``("ramp", "")``: the clip's ramp between handles, one of `RAMPS`; absent: "linear".
- ``("pick", id)``: a `Pick`: a pick or a hold.
- ``("lock", id)``: True for a handle that does not move.
- ``("version", name)``: the state that the user keeps under a name, without versions.
- ``("note", name)``: what the user says about a version.

Input and output are plain values: this module knows neither files nor palettes.
"""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

from palette4d.common.errors import Palette4dError

Colour = tuple[float, float, float]
Ramp = Literal["linear", "smooth", "hold"]
RAMPS: tuple[Ramp, ...] = get_args(Ramp)
#: The words for ramps; files say "hold", which is also a kind of pick.
RAMP_WORDS: dict[Ramp, str] = {"linear": "linear", "smooth": "smooth", "hold": "step"}

Kind = Literal["handle", "ramp", "pick", "lock", "version", "note"]
KINDS: tuple[Kind, ...] = get_args(Kind)
Key = tuple[Kind, str]
State = Mapping[Key, Any]

#: The kinds that recolouring uses.
ACTIVE: tuple[Kind, ...] = ("handle", "ramp", "pick", "lock")

#: The key of the clip's ramp.
RAMP: Key = ("ramp", "")

#: The largest absolute code value that the file format allows (docs/sidecar.md).
LARGEST_COLOUR = 1e6

#: Tolerance in code values, three steps of 8 bits, that is not seen in a graded picture: keys of a
#: path and stops of a copy that change less are left out.
VISIBLE = 3 / 255

#: Decimal places of measured code values and shares in sidecars: a tenth of an 8-bit step.
DIGITS = 4

_HEX = re.compile(r"#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})")


def as_colour(values: Iterable[float] | str, what: str = "colour") -> Colour:
    """Return three finite code values, also from #rrggbb.

    >>> as_colour("#ff0033")
    (1.0, 0.0, 0.2)
    """
    if isinstance(values, str) and (match := _HEX.fullmatch(values)):
        r, g, b = (int(digits, 16) / 255 for digits in match.groups())
        return (r, g, b)
    try:
        listed = [] if isinstance(values, str) else [float(value) for value in values]
    except (TypeError, ValueError):
        listed = []
    if len(listed) != 3 or not all(abs(value) <= LARGEST_COLOUR for value in listed):
        raise Palette4dError(
            f"found the {what} {values!r}, expected #rrggbb or 3 finite numbers of at most "
            f"{LARGEST_COLOUR:g}; give red, green and blue"
        )
    return (listed[0], listed[1], listed[2])


def as_ramp(ramp: str) -> Ramp:
    """Return a ramp as files name it, from its name in files or its word."""
    for known in RAMPS:
        if ramp in (known, RAMP_WORDS[known]):
            return known
    raise Palette4dError(f"found the ramp {ramp!r}, expected {', '.join(RAMP_WORDS.values())}")


@dataclass(frozen=True)
class Setting:
    """The user's setting for a handle: its colour, in the palette's code values, and more.

    Attributes
    ----------
    edge, frame : str and float, or None
        The place of a stop; None for a vertex, which never moves in time.
    ramp : str or None
        One of `RAMPS`: the way to the next handle in time; None: the clip's ramp.
    """

    rgb: Colour
    edge: str | None = None
    frame: float | None = None
    ramp: Ramp | None = None


Settings = Mapping[str, Setting]


@dataclass(frozen=True)
class Change:
    """One value before and after an edit; None: there is none."""

    kind: Kind
    id: str
    before: Any
    after: Any

    @property
    def key(self) -> Key:
        """The value's key in the state."""
        return self.kind, self.id

    def renamed(self, names: Mapping[Key, str]) -> "Change":
        """Return the change with the new id of its key, which a pick has too."""
        id_ = names.get(self.key, self.id)
        values = [self.before, self.after]
        if self.kind == "pick":
            values = [None if value is None else replace(value, id=id_) for value in values]
        return Change(self.kind, id_, *values)


@dataclass(frozen=True)
class Edit:
    """One undoable step: at most one change for each key, and a label: "set v14 to #e66b9e".

    `unread`: its picks are neither learned nor followed yet (`grade.later`).
    """

    changes: tuple[Change, ...]
    label: str = ""
    unread: bool = False

    def inverse(self) -> "Edit":
        """Return the edit that reverts this edit."""
        back = tuple(Change(c.kind, c.id, c.after, c.before) for c in reversed(self.changes))
        return replace(self, changes=back)

    def apply(self, state: State) -> dict[Key, Any]:
        """Return the state after this edit; refuse a value that has changed since it was made."""
        result = dict(state)
        # A name that has other edits now keeps them, and a version that cannot have it its own.
        taken = [c for c in self.changes if c.kind == "version" and state.get(c.key) != c.before]
        homeless = [change.after for change in taken if change.after is not None]
        for change in self.changes:
            if change in taken or (change.kind == "version" and change.before in homeless):
                continue
            if result.get(change.key) != change.before:
                what = _named(change.key)
                raise Palette4dError(
                    f"{what} was changed meanwhile, so that the step "
                    f"{self.label or 'of it'!r} no longer fits; edit {what} again instead"
                )
            _put(result, change.key, change.after)
        return result

    def undoable(self) -> "Edit":
        """Return the edit without the versions that it makes: no step takes a version away."""
        changes = [c for c in self.changes if c.kind == "version"]
        renamed = (None, *(c.before for c in changes if c.after is None))
        made = {c.id for c in changes if c.after not in renamed}
        kept = (c for c in self.changes if c.kind not in ("version", "note") or c.id not in made)
        return replace(self, changes=tuple(kept))


def difference(before: State, after: State, label: str = "") -> Edit:
    """Return the edit from one state to another."""
    keys = [*before, *(key for key in after if key not in before)]
    return Edit(
        tuple(
            Change(*key, before.get(key), after.get(key))
            for key in keys
            if before.get(key) != after.get(key)
        ),
        label,
    )


def merged(
    base: State, mine: State, theirs: State, taken: Collection[str]
) -> tuple[dict[Key, Any], dict[str, str]]:
    """Return the state with the changes of two writers since `base`, and my ids that are new there.

    `taken` are ids of the palette, which stops must not use. An error where both writers changed
    one value, or set a stop at one place, in different ways.
    """
    renamed: dict[Key, str] = {}
    result = dict(theirs)
    for change in difference(base, mine).changes:
        key, there = change.key, theirs.get(change.key)
        if there == change.after:
            continue
        if there != change.before:
            # Two new stops or picks may have the same id by chance.
            if change.before is not None or there is None or not _are_two(change, there):
                raise _conflict(_named(key))
            used = [id_ for kind, id_ in (*result, *mine) if kind == change.kind]
            renamed[key] = new_id(change.id[0], {*taken, *used})
            if change.kind == "handle":
                renamed["lock", change.id] = renamed[key]
        mine_renamed = change.renamed(renamed)
        _put(result, mine_renamed.key, mine_renamed.after)
    for key in [key for key in result if key[0] == "note" and ("version", key[1]) not in result]:
        del result[key]
    stops: dict[tuple[str, float], str] = {}
    for (kind, id_), value in result.items():
        place = _place(value) if kind == "handle" else None
        if place and stops.setdefault(place, id_) != id_:
            raise _conflict(f"edge {place[0]} at frame {place[1]:g}")
    return result, {id_: new for (_, id_), new in renamed.items()}


def _put(state: dict[Key, Any], key: Key, value: Any) -> None:
    if value is None:
        state.pop(key, None)
    else:
        state[key] = value


def _are_two(mine: Change, theirs: Any) -> bool:
    if mine.kind == "handle":
        return _place(mine.after) is not None and _place(theirs) != _place(mine.after)
    return mine.kind == "pick"


def _place(setting: Setting | None) -> tuple[str, float] | None:
    if setting is None or setting.edge is None or setting.frame is None:
        return None
    return setting.edge, setting.frame


def _named(key: Key) -> str:
    kind, id_ = key
    names = {"handle": id_, "ramp": "the clip's ramp", "version": f"the version {id_!r}"}
    names["note"] = f"the note of {names['version']}"
    return names.get(kind, f"the {kind} {id_}")


def _conflict(where: str) -> Palette4dError:
    return Palette4dError(
        f"another program has edited {where} as well since the file was loaded; nothing was "
        "written. Load the file again and repeat this edit, or save under another name"
    )


def new_id(letter: str, taken: Iterable[str]) -> str:
    """Return s1, s2, …: a number above the largest in use, so that removed ids are not reused.

    >>> new_id("s", {"s1", "s7", "v9"})
    's8'
    """
    numbers = [int(id_[1:]) for id_ in taken if id_[:1] == letter and _is_number(id_[1:])]
    return f"{letter}{max(numbers, default=0) + 1}"


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) <= 9


def in_order(key: Key) -> tuple[int, int, str]:
    """Sort s2 before s10, so that equal states give equal bytes."""
    id_ = key[1]
    number = int(id_[1:]) if _is_number(id_[1:]) else -1
    return KINDS.index(key[0]), number, id_
