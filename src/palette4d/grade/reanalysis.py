"""A new analysis that replaces an old sidecar: edits are kept, moved or copied."""

import contextlib
import itertools
import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeVar

from palette4d.common import sandbox
from palette4d.common.child import Child
from palette4d.common.errors import Palette4dError, SidecarError
from palette4d.common.files import link_target, replacing
from palette4d.common.text import counted, some_of
from palette4d.grade import sidecar
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.copied_picks import in_place
from palette4d.grade.copying import copied
from palette4d.grade.correspondence import same_pictures
from palette4d.grade.edits import RAMP_WORDS, Edit, Key, Kind, State, difference
from palette4d.grade.grade import Grade
from palette4d.grade.handle_edits import reset
from palette4d.grade.history import History
from palette4d.grade.members import Fields, history_of
from palette4d.grade.sidecar import OnEdits, Saved
from palette4d.grade.unread_steps import unread_picks
from palette4d.grade.versions import save_version, set_note
from palette4d.media.clip_files import files_of

T = TypeVar("T")

#: `quality.options.method` of a palette that `analyze --like` moved.
_MOVED = "like"
_SCALED = "this clip has another size: the places of picks, and their windows, are scaled with it"


def save(
    fields: Fields, path: Path, *, on_edits: OnEdits = "refuse", clip: str | None = None
) -> tuple[Saved, list[str]]:
    """Write the sidecar of a new analysis; return what `sidecar.save` does, and notes for the user.

    With `on_edits` "keep" and another palette than before, the edits stay with their handles if
    these are the same (`analyze --like`). Else the grade is copied to the new palette, with its
    versions and picks, and the old file is kept under another name. Picks learn from `clip`, by
    default the one that `fields` name; a command that is not confined reads `clip` in a child.
    """
    target = link_target(path)
    old = sidecar.existing(target, on_edits) if on_edits == "keep" else None
    # Undone edits count: redo brings them back.
    has_any = old is not None and (sidecar.has_edits(old[1]) or "history" in old[1])
    if old is None or not has_any or sidecar.has_edits(fields):
        return sidecar.save(fields, target, on_edits=on_edits), []
    by = _growth(fields["clip"], old[1]["clip"])
    if sidecar.same_palette(old[1], fields) and by == (1, 1):
        saved = sidecar.save(fields, target, on_edits=on_edits)
        return saved, _misplaced(saved, target, clip)
    read, before = old[2], old[1]
    former = Grade.of(*old[:2], target)
    new = Grade.of(sidecar.validate(fields, str(target)), fields, None)
    extra = fields.get("extra") or before["extra"]
    places = any(pick.marks or pick.window for pick in former.picks)
    scaled = [_SCALED] if places and by != (1, 1) else []
    later = new.frames[0] - former.frames[0]
    if (moved := _with_same_handles(former, new, by, later)) is not None:
        steps = [_moved_steps(part, by, later) for part in history_of(before, str(target))]
        kept_fields = {**moved.fields(*steps), "extra": extra}
        saved = sidecar.save(kept_fields, target, on_edits="drop", replaces=read)
        return saved, scaled + _misplaced(saved, target, clip)
    copy, notes = _reading(clip, _copied, read, fields, target, clip)
    kept = _former(target, read)
    if not kept.exists():
        with replacing(kept, force=False) as temporary:
            temporary.write_bytes(read)
    notes.append(f"the former palette with its edits is kept in {kept.name}")
    kept_fields = {**copy, "extra": extra}
    return sidecar.save(kept_fields, target, on_edits="drop", replaces=read), scaled + notes


def _reading(clip: str | None, work: Callable[..., T], *arguments: object) -> T:
    """Do work that reads a clip; a confined command does it in a child."""
    if clip is None or not sandbox.of_command():
        return work(*arguments)
    with Child(reads=files_of(clip)) as child:
        return child.call(work, *arguments)


def _misplaced(saved: Saved, target: Path, clip: str | None) -> list[str]:
    """Return a note on picks whose places have other colours in the clip than were picked."""
    _, fields, text = saved
    placed = any("pixel" in pick for pick in fields["edits"].get("picks", ()))
    moved = _reading(clip, _with_other_colours, text, target, clip) if placed else []
    if not moved:
        return []
    return [f"there are other colours now where these were picked: {', '.join(moved)}"]


def _with_other_colours(text: bytes, target: Path, given: str | None) -> list[str]:
    grade = Grade.of(*sidecar.decoded(text, str(target)), target)
    clip = ClipOfPicks.of(grade, given, target)
    moved: list[str] = []
    with contextlib.suppress(Palette4dError):  # a clip that is not the sidecar's
        if not clip.missing:
            placed = (pick for pick in grade.picks if pick.pixel is not None)
            moved = [pick.id for pick in placed if in_place(clip, pick) is None]
    return moved


def _copied(
    read: bytes, fields: Fields, target: Path, given: str | None
) -> tuple[Fields, list[str]]:
    """Return the new sidecar with the look of the former one and of its versions, and notes."""
    core, members = sidecar.decoded(read, str(target))
    former = Grade.of(core, members, target)
    analysed = new = Grade.of(sidecar.validate(fields, str(target)), fields, None)
    clip, notes = ClipOfPicks.of(new, given, target), []
    own, other = (grade.members["clip"] for grade in (new, former))
    time = _time(new, former)
    unread = unread_picks(former, History(*history_of(members, str(target))))
    former = former.with_state(_moved(former.state, _growth(own, other)))
    for name in former.versions:
        if (version := former.version(name)).edited:
            new, fit = copied(new, version, clip, time, same_clip=True, unread=unread)
            if lost := str(fit.lost):
                notes.append(f"version {name}{lost}")
        new, _ = save_version(new, name)
        new = set_note(new, name, former.note(name))
        new = reset(new)
    if former.edited:
        new, fit = copied(new, former, clip, time, same_clip=True, unread=unread)
        fit = replace(fit, nothing=False)  # the former edits do not stay here
        notes.append(f"the palette changed, so that the grade was copied: {fit}")
    if locks := [id_ for kind, id_ in former.state if kind == "lock"]:
        notes.append(f"{counted(len(locks), 'lock')} of former handles left out: {some_of(locks)}")
    if former.ramp != new.ramp:
        notes.append(f"the ramp between edits is {new.ramp}; it was {RAMP_WORDS[former.ramp]}")
    name = "copy the grade of the former analysis"
    step = difference(analysed.state, new.state, name).undoable()
    steps: list[Edit] = [step] if step.changes else []
    return new.fields(steps), notes


def _time(new: Grade, former: Grade) -> Literal["relative", "same"]:
    """Return how the frames of a new analysis correspond to the former ones.

    Clips that have numbers in common have these frames in common, unless the pictures or `--like`
    tell that they are numbered anew.
    """
    (first, last, _), (begin, end, _) = new.frames, former.frames
    common = first <= end and begin <= last
    corresponds = _is_moved(new) or same_pictures(new, former)
    return "same" if common and not corresponds else "relative"


def _with_same_handles(
    old: Grade, new: Grade, by: tuple[float, float], later: float
) -> Grade | None:
    """Return the new palette with the old edits, if it is the old one or `--like` moved that to it.

    `by` is how many times as wide and as high its clip is, `later` by how much its frame numbers
    are higher.
    """
    moved_to_it = _is_moved(new) and _handles(old.members) == _handles(new.members)
    if not moved_to_it and not sidecar.same_palette(old.members, new.members):
        return None
    moved = new.with_mattes(old.mattes).with_state(_moved(old.state, by, later))
    try:
        sidecar.validate(moved.fields())
    except SidecarError:  # a handle has moved in time beyond an edit
        return None
    return moved


def _is_moved(new: Grade) -> bool:
    """Return whether a palette is an earlier one that `analyze --like` moved to its clip."""
    options = new.members.get("quality", {}).get("options", {})
    return bool(options.get("method") == _MOVED)


def _growth(own: Fields, other: Fields) -> tuple[float, float]:
    """Return how many times as wide and as high a clip is as the former one."""
    (width, height), (before, high) = own["size"], other["size"]
    return width / before, height / high


def _moved(state: State, by: tuple[float, float], later: float = 0) -> dict[Key, Any]:
    """Return a state in a clip of another size, and of other frame numbers."""
    return {key: _moved_value(key[0], value, by, later) for key, value in state.items()}


def _moved_value(kind: Kind, value: Any, by: tuple[float, float], later: float) -> Any:
    if value is None or (by == (1, 1) and later == 0):
        return value
    if kind == "version":
        return _moved(value, by, later)
    if kind == "handle" and value.frame is not None:
        return replace(value, frame=value.frame + later)
    if kind == "pick":
        return (value if by == (1, 1) else value.scaled(*by)).shifted(later)
    return value


def _moved_steps(steps: Iterable[Edit], by: tuple[float, float], later: float) -> list[Edit]:
    return [
        replace(
            step,
            changes=tuple(
                replace(
                    change,
                    before=_moved_value(change.kind, change.before, by, later),
                    after=_moved_value(change.kind, change.after, by, later),
                )
                for change in step.changes
            ),
        )
        for step in steps
    ]


def _handles(document: Fields) -> tuple[Any, ...]:
    """Return the ids, topology, length and encoding that edits refer to."""
    polytope, frames = document["polytope"], document["clip"]["frames"]
    vertices = {vertex["id"] for vertex in polytope["vertices"]}
    edges = {(edge["id"], edge["from"], edge["to"]) for edge in polytope["edges"]}
    faces = [block["faces"] for block in polytope["blocks"]]
    length = frames["last"] - frames["first"]
    return vertices, edges, faces, length, document["clip"]["encoding"]


def _former(target: Path, content: bytes) -> Path:
    """Return a free name beside `target`, or that of the same copy by a killed run."""
    stem = target.name.removesuffix(".p4d.json")
    names = itertools.chain(["former"], (f"former{number}" for number in itertools.count(2)))
    paths = (target.with_name(f"{stem}.{name}.p4d.json") for name in names)
    return next(p for p in paths if not os.path.lexists(p) or _has(p, content))


def _has(path: Path, content: bytes) -> bool:
    return path.is_file() and not path.is_symlink() and sidecar.read_bytes(path) == content
