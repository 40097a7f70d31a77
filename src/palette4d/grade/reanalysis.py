"""A new analysis that replaces an old sidecar: edits are kept, moved or copied."""

import itertools
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from palette4d.common import sandbox
from palette4d.common.child import Child
from palette4d.common.errors import SidecarError
from palette4d.common.files import link_target, replacing
from palette4d.grade import sidecar
from palette4d.grade.clip_of_picks import ClipOfPicks
from palette4d.grade.copying import copied
from palette4d.grade.edits import Edit, difference
from palette4d.grade.grade import Grade
from palette4d.grade.handle_edits import reset
from palette4d.grade.members import Fields, history_of
from palette4d.grade.sidecar import OnEdits, Saved
from palette4d.grade.versions import save_version, set_note
from palette4d.media.clip_files import files_of

#: `quality.options.method` of a palette that `analyze --like` moved.
_MOVED = "like"


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
    keeps = old is not None and sidecar.has_edits(old[1]) and not sidecar.has_edits(fields)
    if old is None or not keeps or sidecar.same_palette(old[1], fields):
        return sidecar.save(fields, target, on_edits=on_edits), []
    read, before = old[2], old[1]
    former = Grade.of(*old[:2], target)
    new = Grade.of(sidecar.validate(fields, str(target)), fields, None)
    extra = fields.get("extra") or before["extra"]
    if (moved := _with_same_handles(former, new)) is not None:
        done, undone = history_of(before, str(target))
        kept_fields = {**moved.fields(done, undone), "extra": extra}
        return sidecar.save(kept_fields, target, on_edits="drop", replaces=read), []
    if clip is not None and sandbox.of_command():
        with Child(reads=files_of(clip)) as child:
            copy, notes = child.call(_copied, read, fields, target, clip)
    else:
        copy, notes = _copied(read, fields, target, clip)
    kept = _former(target, read)
    if not kept.exists():
        with replacing(kept, force=False) as temporary:
            temporary.write_bytes(read)
    notes.append(f"the former palette with its edits is kept in {kept.name}")
    kept_fields = {**copy, "extra": extra}
    return sidecar.save(kept_fields, target, on_edits="drop", replaces=read), notes


def _copied(
    read: bytes, fields: Fields, target: Path, given: str | None
) -> tuple[Fields, list[str]]:
    """Return the new sidecar with the look of the former one and of its versions, and notes."""
    core, members = sidecar.decoded(read, str(target))
    former = Grade.of(core, members, target)
    analysed = new = Grade.of(sidecar.validate(fields, str(target)), fields, None)
    clip, notes = ClipOfPicks.of(new, given), []
    own, other = (grade.members["clip"] for grade in (new, former))
    same = all(own[name] == other[name] for name in ("source", "size", "frames"))
    for name in former.versions:
        if (version := former.version(name)).edited:
            new, _ = copied(new, version, clip, same_clip=same)
        new, _ = save_version(new, name)
        new = set_note(new, name, former.note(name))
        new = reset(new)
    if former.edited:
        new, fit = copied(new, former, clip, same_clip=same)
        fit = replace(fit, nothing=False)  # the former edits do not stay here
        notes.append(f"the palette changed, so that the grade was copied: {fit}")
    name = "copy the grade of the former analysis"
    step = difference(analysed.state, new.state, name).undoable()
    steps: list[Edit] = [step] if step.changes else []
    return new.fields(steps), notes


def _with_same_handles(old: Grade, new: Grade) -> Grade | None:
    """Return the new palette with the old edits, if `analyze --like` moved the old one to it."""
    method = new.members.get("quality", {}).get("options", {}).get("method")
    if method != _MOVED or _handles(old.members) != _handles(new.members):
        return None
    moved = new.with_mattes(old.mattes).with_state(old.state)
    try:
        sidecar.validate(moved.fields())
    except SidecarError:  # a handle has moved in time beyond an edit
        return None
    return moved


def _handles(document: Fields) -> tuple[Any, ...]:
    """Return the ids, topology, frames and encoding that edits refer to."""
    polytope, frames = document["polytope"], document["clip"]["frames"]
    vertices = {vertex["id"] for vertex in polytope["vertices"]}
    edges = {(edge["id"], edge["from"], edge["to"]) for edge in polytope["edges"]}
    faces = [block["faces"] for block in polytope["blocks"]]
    return vertices, edges, faces, frames["first"], frames["last"], document["clip"]["encoding"]


def _former(target: Path, content: bytes) -> Path:
    """Return a free name beside `target`, or that of the same copy by a killed run."""
    stem = target.name.removesuffix(".p4d.json")
    names = itertools.chain(["former"], (f"former{number}" for number in itertools.count(2)))
    paths = (target.with_name(f"{stem}.{name}.p4d.json") for name in names)
    return next(p for p in paths if not os.path.lexists(p) or _has(p, content))


def _has(path: Path, content: bytes) -> bool:
    return path.is_file() and not path.is_symlink() and sidecar.read_bytes(path) == content
