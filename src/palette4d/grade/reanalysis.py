"""A new analysis in the place of an old sidecar: what becomes of the user's work in it."""

import itertools
from pathlib import Path
from typing import Any

from palette4d import _core
from palette4d.common.errors import SidecarError
from palette4d.common.files import link_target, replacing
from palette4d.grade import edits, sidecar
from palette4d.grade.document import Document
from palette4d.grade.sidecar import Fields, OnEdits

#: `quality.options.method` of a palette that `analyze --like` moved.
_MOVED = "like"


def save(
    fields: Fields, path: Path, *, on_edits: OnEdits = "refuse"
) -> tuple[tuple[_core.Sidecar, Fields, bytes], list[str]]:
    """Write the sidecar of a new analysis; return what `sidecar.save` does, and notes for the user.

    With `on_edits` "keep" and another palette than before, the edits stay with their handles if
    these are the same (`analyze --like`). Else the grade is copied to the new palette, with its
    versions and picks, and the old file is kept under another name.

    Parameters
    ----------
    fields, path, on_edits
        As for `sidecar.save`.

    Raises
    ------
    Palette4dError
        As `sidecar.save`; or the grade cannot be copied.
    """
    target = link_target(path)
    old = sidecar.existing(target, on_edits) if on_edits == "keep" else None
    keeps = old is not None and sidecar.has_edits(old) and not sidecar.has_edits(fields)
    if old is None or not keeps or sidecar.same_palette(old, fields):
        return sidecar.save(fields, target, on_edits=on_edits), []
    read = sidecar.read_bytes(target)
    former, new = Document.load(target), Document(fields)
    if (moved := _with_same_handles(former.fields(), new)) is not None:
        return sidecar.save(moved, target, on_edits="drop", replaces=read), []
    notes = []
    with new.one_step("copy the grade of the former analysis"):
        for name in former.versions:
            if (version := former.version(name)).edited:
                new.copy_from(version)
                new.save_version(name)
                new.reset()
        if former.edited:
            fit = new.copy_from(former)
            notes.append(f"the palette changed, so that the grade was copied: {fit}")
    kept = _former(target, read)
    if not kept.exists():
        with replacing(kept, force=False) as temporary:
            temporary.write_bytes(read)
    notes.append(f"the former palette with its edits is kept in {kept.name}")
    members: dict[str, Any] = {**new.fields(), "extra": fields.get("extra") or old["extra"]}
    return sidecar.save(members, target, on_edits="drop", replaces=read), notes


def _with_same_handles(old: Fields, new: Document) -> Fields | None:
    """Return the new document with the old edits, if its palette is the old one, moved, and they
    fit.

    Two palettes that were found may have the same ids for other colours.
    """
    fields = new.fields()
    method = fields.get("quality", {}).get("options", {}).get("method")
    if method != _MOVED or _handles(old) != _handles(fields):
        return None
    try:
        state = sidecar.state_of(old)
        for (kind, name), version in state.items():
            if kind == "version":
                state[kind, name] = new.at(edits.from_fields(version)).fields()["edits"]
        found = new.with_mattes_of(old).at(state).fields()
        found |= {name: old[name] for name in ("history",) if name in old}
        found["extra"] = fields.get("extra") or old["extra"]
        sidecar.validate(found)
    except SidecarError:  # a handle has moved in time beyond an edit
        return None
    return found


def _handles(document: Fields) -> tuple[Any, ...]:
    """Return what edits refer to, and what the moves of a palette keep."""
    polytope, frames = document["polytope"], document["clip"]["frames"]
    vertices = {vertex["id"] for vertex in polytope["vertices"]}
    edges = {(edge["id"], edge["from"], edge["to"]) for edge in polytope["edges"]}
    faces = [block["faces"] for block in polytope["blocks"]]
    return vertices, edges, faces, frames["first"], frames["last"], document["clip"]["encoding"]


def _former(target: Path, content: bytes) -> Path:
    """Return a name beside `target` that is free, or whose file a run that was killed kept."""
    stem = target.name.removesuffix(".p4d.json")
    names = itertools.chain(["former"], (f"former{number}" for number in itertools.count(2)))
    paths = (target.with_name(f"{stem}.{name}.p4d.json") for name in names)
    return next(p for p in paths if not p.exists() or sidecar.read_bytes(p) == content)
