"""A sidecar's members and what they say: the user's state, its steps, and the mattes of picks.

Input and output are plain dicts and lists, as the core reads and writes them; `docs/sidecar.md`
explains them. All conversions between members and the types of `edits` and `picks` are here.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from palette4d.common.errors import Palette4dError, SidecarError
from palette4d.grade.edits import (
    RAMP,
    Change,
    Edit,
    Key,
    Kind,
    Setting,
    State,
    as_colour,
    as_ramp,
    in_order,
)
from palette4d.grade.mattes import Display
from palette4d.grade.picks import Pick

Fields = dict[str, Any]

#: Limits of the history in a file: its steps, and their characters as JSON.
MOST_STEPS, MOST_TEXT = 200, 256_000


def state_of(members: Mapping[str, Any]) -> dict[Key, Any]:
    """Return what the user set: the state of `edits` and `versions`."""
    state = edits_from(members["edits"])
    for version in members.get("versions", ()):
        state["version", version["name"]] = edits_from(version["edits"])
        if version.get("note"):
            state["note", version["name"]] = version["note"]
    return state


def with_state(
    members: Mapping[str, Any],
    state: State,
    history: tuple[Sequence[Edit], Sequence[Edit]],
    mattes: Mapping[str, str],
    display: Callable[[], Display | None],
) -> Fields:
    """Return members with a state, its done and undone steps, and the mattes of its picks.

    Mattes (texts by their ids) that nothing uses are left out. Without picks the file has the first
    version of the format, so that older programs read it.
    """
    result = {n: v for n, v in members.items() if n not in ("versions", "history", "mattes")}
    vertices = [vertex["id"] for vertex in members["polytope"]["vertices"]]
    result["edits"] = edits_fields(state, vertices)
    versions = sorted((name, value) for (kind, name), value in state.items() if kind == "version")
    if versions:
        result["versions"] = [_version_fields(state, n, v, vertices) for n, v in versions]
    steps = dict(zip(("done", "undone"), history, strict=True))
    kept = {n: v for n, v in members.get("history", {}).items() if n not in steps}
    for name, part in steps.items():
        if part:
            kept[name] = [_step_fields(step, vertices) for step in part]
    if kept:
        result["history"] = kept
    picks = [*_picks_in(state), *_picks_of((*history[0], *history[1]))]
    result["version"] = 2 if picks else 1
    used = mattes_of(picks, mattes, display)
    if len(used) > 1 or used["grids"]:
        result["mattes"] = used
    return result


def _version_fields(state: State, name: str, edits: State, vertices: Iterable[str]) -> Fields:
    note = state.get(("note", name))
    told = {} if note is None else {"note": note}
    return {"name": name, **told, "edits": edits_fields(edits, vertices)}


def mattes_of(
    picks: Iterable[Pick], texts: Mapping[str, str], display: Callable[[], Display | None]
) -> Fields:
    """Return the member "mattes" for picks."""
    picks, mattes = list(picks), Fields()
    if picks and (curve := display()) is not None:
        start, end, values = curve
        mattes["display"] = {"from": start, "to": end, "values": values}
    used = sorted({pick.matte for pick in picks if pick.matte is not None} & texts.keys())
    return {**mattes, "grids": {id_: texts[id_] for id_ in used}}


def _picks_in(state: State) -> Iterator[Pick]:
    for (kind, _), value in state.items():
        if kind == "pick":
            yield value
        elif kind == "version":
            yield from _picks_in(value)


def _picks_of(steps: Iterable[Edit]) -> Iterator[Pick]:
    for change in (change for step in steps for change in step.changes):
        for value in (change.before, change.after):
            if value is not None:
                yield from _picks_in({change.key: value})


def history_of(members: Mapping[str, Any], name: str) -> tuple[tuple[Edit, ...], tuple[Edit, ...]]:
    """Return the done and the undone steps; `SidecarError` with `name` if they are unusable."""
    parts = []
    for part in ("done", "undone"):
        try:
            steps = [_step(fields) for fields in members.get("history", {}).get(part, [])]
        except (Palette4dError, TypeError, ValueError, LookupError, AttributeError) as error:
            raise SidecarError(
                name,
                f"/history/{part}",
                f"an unusable list of steps ({error})",
                "the steps that palette4d wrote; remove the member `history` to go on without them",
            ) from None
        # Older files have steps that make versions.
        parts.append(tuple(kept for step in steps if (kept := step.undoable()).changes))
    return parts[0], parts[1]


def bounded(steps: Sequence[Edit]) -> Sequence[Edit]:
    """Return the newest steps within `MOST_STEPS` and `MOST_TEXT`, the last one in any case."""
    kept, length = 0, 0
    for step in reversed(steps[-MOST_STEPS:]):
        length += len(json.dumps(_step_fields(step, ())))
        if kept and length >= MOST_TEXT:
            break
        kept += 1
    return steps[len(steps) - kept :]


# -------------------------------------------------------------------------------- values and steps


def edits_from(fields: Mapping[str, Any]) -> dict[Key, Any]:
    """Return the state of a member "edits"."""
    state: dict[Key, Any] = {}
    for entry in fields["vertices"]:
        state["handle", entry["vertex"]] = _setting(entry)
    for stop in fields["stops"]:
        state["handle", stop["id"]] = _setting(stop)
    if fields.get("ramp", "linear") != "linear":
        state[RAMP] = as_ramp(fields["ramp"])
    for pick in fields.get("picks", ()):
        state["pick", pick["id"]] = _pick(pick)
    for id_ in fields.get("locks", ()):
        state["lock", id_] = True
    for _, id_ in state:
        _typed(id_, str)
    return state


def edits_fields(state: State, vertex_ids: Iterable[str]) -> Fields:
    """Return the member "edits" of a state.

    Vertices have the palette's order; stops, picks and locks have the order of their ids.
    """
    ordered = sorted(state, key=in_order)
    handles = {key[1]: state[key] for key in ordered if key[0] == "handle"}
    fields: Fields = {
        "ramp": state.get(RAMP),
        "vertices": [
            {"vertex": id_, **_setting_fields(handles[id_])} for id_ in vertex_ids if id_ in handles
        ],
        "stops": [
            {"id": id_, **_setting_fields(setting)}
            for id_, setting in handles.items()
            if setting.edge is not None
        ],
        "picks": [state[key].to_fields() for key in ordered if key[0] == "pick"],
        "locks": [key[1] for key in ordered if key[0] == "lock"],
    }
    return {n: v for n, v in fields.items() if v or n in ("vertices", "stops")}


def _setting(entry: Mapping[str, Any]) -> Setting:
    ramp, edge, frame = entry.get("ramp"), entry.get("edge"), entry.get("frame")
    if edge is not None and not isinstance(edge, str):
        raise ValueError(f"found the edge {edge!r}, expected an id")
    if type(frame) not in (int, float, type(None)):
        raise ValueError(f"found the frame {frame!r}, expected a number")
    return Setting(as_colour(entry["rgb"]), edge, frame, None if ramp is None else as_ramp(ramp))


def _setting_fields(setting: Setting) -> Fields:
    fields: Fields = {"edge": setting.edge, "frame": setting.frame, "rgb": list(setting.rgb)}
    if setting.frame is not None and float(setting.frame).is_integer():
        fields["frame"] = int(setting.frame)  # in steps, whose values the core writes as they are
    fields["ramp"] = setting.ramp
    return {name: value for name, value in fields.items() if value is not None}


def _pick(fields: Mapping[str, Any]) -> Pick:
    for name in ("frame", "from", "until", "fade", "fade_out", "reach", "softness"):
        if type(fields.get(name)) not in (int, float, type(None)):
            raise ValueError(f"found the {name} {fields[name]!r}, expected a number")
    if fields["kind"] not in ("pick", "hold") or fields["frame"] is None:
        raise ValueError(f"found the pick {fields['id']!r}, expected its kind and frame")
    pick = Pick.from_fields(fields)
    pick.to_fields()  # refuses other things in the place of numbers
    try:
        hash(pick)
    except TypeError:
        raise ValueError(f"found lists in the pick {pick.id!r}, expected texts") from None
    return pick


def _typed(value: Any, kind: type) -> Any:
    if type(value) is not kind or value is False:
        raise ValueError(f"found {value!r}, expected {'true' if kind is bool else 'a text'}")
    return value


#: How each kind's values are read from JSON.
_READ: dict[Kind, Callable[[Any], Any]] = {
    "handle": _setting,
    "ramp": as_ramp,
    "pick": _pick,
    "lock": lambda value: _typed(value, bool),
    "version": edits_from,
    "note": lambda value: _typed(value, str),
}


def _step_fields(step: Edit, vertex_ids: Iterable[str]) -> Fields:
    def plain(kind: Kind, value: Any) -> Any:
        if value is None or kind in ("ramp", "lock", "note"):
            return value
        if kind == "version":
            return edits_fields(value, vertex_ids)
        return value.to_fields() if kind == "pick" else _setting_fields(value)

    changes = [
        [c.kind, c.id, plain(c.kind, c.before), plain(c.kind, c.after)] for c in step.changes
    ]
    return {"step": step.label, "changes": changes, **({"unread": True} if step.unread else {})}


def _step(fields: Any) -> Edit:
    """Return the step of an entry of the member "history"; any error if it is none."""
    changes = []
    for kind, id_, *values in fields["changes"]:
        before, after = (None if v is None else _READ[kind](v) for v in values)
        if not isinstance(id_, str) or before == after:
            raise ValueError(f"the change {kind!r} of {id_!r}")
        changes.append(Change(kind, id_, before, after))
    label, unread = fields["step"], fields.get("unread", False)
    if not isinstance(label, str) or not isinstance(unread, bool) or not changes:
        raise ValueError(f"the step {label!r}")
    return Edit(tuple(changes), label, unread)
