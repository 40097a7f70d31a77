"""The sidecar's files: the reader and the only writer.

Input and output are a sidecar's members as plain dicts and lists (`members`). The core reads and
writes their text.
"""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

from palette4d import _core
from palette4d.common.errors import Arg, Palette4dError, SidecarError
from palette4d.common.files import link_target, refuse_existing, replacing
from palette4d.common.json_files import UnusableFile, read_regular
from palette4d.common.locking import locked
from palette4d.common.text import counted
from palette4d.grade.members import Fields, edits_fields, edits_from
from palette4d.media.clip_sequence import IMAGE_EXTENSIONS, MOVIE_EXTENSIONS, extension

#: The core's view of a file, its members and its bytes.
Saved = tuple[_core.Sidecar, Fields, bytes]
OnEdits = Literal["refuse", "keep", "drop"]

SCHEMA = "palette4d.sidecar"
#: The members of steps, of the mattes that their picks name, and of the format that picks need.
_HISTORY = ("version", "history", "mattes")


class WouldLoseEdits(Palette4dError):
    """A file holds edits, or may hold some, that a save would lose."""


def new_document(
    clip: Mapping[str, Any],
    polytope: Mapping[str, Any],
    quality: Mapping[str, Any] | None = None,
) -> Fields:
    """Return a document without edits from the analysis' members (docs/sidecar.md).

    It has plain dicts, lists, texts and numbers; NumPy values are converted. `save` validates it.
    """
    quality = quality or {}
    document: Fields = {
        "schema": SCHEMA,
        "version": 1,
        "generator": f"palette4d {_core.__version__}",
        "clip": clip,
        "polytope": polytope,
        "quality": {"stages": [], "options": {}, "versions": {}, **quality},
        "edits": {"vertices": [], "stops": []},
        "extra": {},
    }
    plain: Fields = _core.plain(document)
    return plain


def dumps(document: Mapping[str, Any]) -> str:
    """Return the text of a valid document: equal documents give equal text."""
    return _core.encode_sidecar(document)[1].decode("utf-8")


def validate(document: Mapping[str, Any], name: str = "<document>") -> _core.Sidecar:
    """Return the core's view of a document; `SidecarError` with `name` if it is not valid."""
    return _core.encode_sidecar(document, name)[0]


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """Return a file's bytes; `SidecarError` for pictures, movies and what cannot be read."""
    kind = Path(path).suffix.lower().lstrip(".")
    if kind in IMAGE_EXTENSIONS | MOVIE_EXTENSIONS and Path(path).is_file():
        what = "a picture" if kind in IMAGE_EXTENSIONS else "a movie"
        raise SidecarError(
            os.fspath(path),
            "",
            f"{what}, which is no sidecar",
            "a .p4d.json file, which `palette4d analyze CLIP -o OUT.p4d.json` writes",
        )
    try:
        return read_regular(Path(path))
    except UnusableFile:
        reason = "no regular file, or too large"
    except OSError as error:
        reason = str(error.strerror)
    _core.read_sidecar(path)  # raises the error that names the kind of file
    raise SidecarError(os.fspath(path), "", f"an unreadable file ({reason})", "a sidecar file")


def load(path: str | os.PathLike[str]) -> Fields:
    """Read the members of a sidecar; `SidecarError` where the core refuses it."""
    return decoded(read_bytes(path), os.fspath(path))[1]


def decoded(data: bytes, name: str) -> tuple[_core.Sidecar, Fields]:
    """Return the core's view of a text, and its members; 24.0 becomes 24 where it is whole."""
    core, members = _core.decode_sidecar(data, name)
    return core, up_to_date(members)


def up_to_date(members: Fields) -> Fields:
    """Bring members up to date in place: picks of version 1 moved palette colours."""
    vertices = [vertex["id"] for vertex in members["polytope"]["vertices"]]
    for part in (members, *members.get("versions", ())):
        if members["version"] == 1 and {"picks", "solution"} & part["edits"].keys():
            part["edits"] = edits_fields(edits_from(part["edits"]), vertices)
    clip = members["clip"]
    frames = clip["frames"]
    for holder, names in ((frames, ("first", "last", "step", "skipped")), (clip, ("rate", "size"))):
        holder.update({name: _whole(holder[name]) for name in names})
    return members


def _whole(value: Any) -> Any:
    return [int(number) for number in value] if isinstance(value, list) else int(value)


def has_edits(document: Mapping[str, Any]) -> bool:
    """Return whether a document holds edits or versions."""
    return bool(any(document["edits"].values()) or document.get("versions"))


def check_target(path: str | os.PathLike[str], *, on_edits: OnEdits = "refuse") -> None:
    """Raise the errors of `save` before a long analysis, where they are certain."""
    target = link_target(path)
    refuse_existing(target, force=True)
    old = existing(target, on_edits)
    if old is not None and has_edits(old[1]) and on_edits == "refuse":
        raise _would_lose(target, old[1])


def save(
    document: Mapping[str, Any],
    path: str | os.PathLike[str],
    *,
    on_edits: OnEdits = "refuse",
    replaces: bytes | None = None,
) -> Saved:
    """Write a sidecar; return the core's view of it, its members and its text.

    The core validates the text before it replaces the file. After any failure, also Ctrl-C, the old
    file is unchanged and no temporary file remains.

    Parameters
    ----------
    path : path
        A symbolic link is followed; permissions of an existing file are kept.
    on_edits : {"refuse", "keep", "drop"}
        What to do if the file exists and holds edits or versions that `document` lacks. "keep"
        copies them (and the history, and ``extra``). It needs the same polytope, because edits
        refer to its vertices and edges; `grade.reanalysis` copies grades to another polytope.
    replaces : bytes, optional
        The expected content of the file; another one is an error.
    """
    name = os.fspath(path).encode("utf-8", "backslashreplace").decode()
    members: Fields = _core.plain(document, name)
    target = link_target(path)
    with locked(target) as held:
        old = existing(target, on_edits)
        if old is not None and _lacks(members, old[1]):
            if on_edits == "refuse":
                raise _would_lose(target, old[1])
            members = _with_edits_of(old[1], members, target)
        elif old is not None and on_edits == "keep" and _is_new(members, old[1]):
            # Undone edits alone: redo brings them back.
            members |= {name: old[1][name] for name in _HISTORY if name in old[1]}
        core, data = _core.encode_sidecar(members, os.fspath(target))
        write(target, data, held, replaces=replaces)
    return core, members, data


def write(
    target: Path, data: bytes, held: Callable[[], None], *, replaces: bytes | None = None
) -> None:
    """Replace a file's content by the bytes of a validated document.

    The caller has the lock of `target`, which `held` checks. `replaces`, the expected old content,
    is checked just before the rename: other programs ignore the lock.
    """

    def unchanged() -> None:
        held()
        try:
            content = None if replaces is None else target.read_bytes()
        except FileNotFoundError:
            content = b""
        if content != replaces:
            raise Palette4dError(
                f"{target} was changed by another program meanwhile; nothing was written. Try again"
            )

    with replacing(target, force=True, check=unchanged) as temporary:
        temporary.write_bytes(data)


# ----------------------------------------------------------------------------------- edits at stake


def same_palette(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Return whether two documents have the same polytope, so that the edits fit both."""
    return bool(_core.plain(old["polytope"]) == _core.plain(new["polytope"]))


def existing(target: Path, on_edits: OnEdits) -> Saved | None:
    """Return what a save would replace; None if no edits would be lost."""
    if on_edits not in ("refuse", "keep", "drop"):
        raise ValueError(f"on_edits: found {on_edits!r}, expected 'refuse', 'keep' or 'drop'")
    if extension(target) in IMAGE_EXTENSIONS | MOVIE_EXTENSIONS and target.exists():
        raise Palette4dError(
            f"{target}: found a picture or a movie, expected a sidecar or no file; choose another "
            "name"
        )
    if on_edits == "drop":
        return None
    try:
        if target.stat().st_size == 0:
            return None
        data = read_bytes(target)
        return (*decoded(data, os.fspath(target)), data)
    except FileNotFoundError:
        return None
    except Palette4dError as error:
        raise WouldLoseEdits(
            f"{target} exists and cannot be read as a sidecar ({error}); it may hold edits. "
            f"Move it away, choose another output, or replace it with {Arg('on_edits', 'drop')}"
        ) from error


def _lacks(document: Fields, old: Fields) -> bool:
    """Return whether a document lacks edits or versions of an old one."""
    versions = document.get("versions", ())
    gone = any(version not in versions for version in old.get("versions", ()))
    return gone or (has_edits(old) and old["edits"] != document.get("edits"))


def _is_new(document: Fields, old: Fields) -> bool:
    """Return whether a document is an analysis with an old one's palette, without any steps."""
    return "history" not in document and same_palette(old, document)


def _summary(document: Fields) -> str:
    vertices = counted(len(document["edits"]["vertices"]), "edited vertex", "edited vertices")
    stops = counted(len(document["edits"]["stops"]), "stop")
    picks = counted(len(document["edits"].get("picks", ())), "pick or hold", "picks and holds")
    versions = counted(len(document.get("versions", ())), "version")
    return f"{vertices}, {stops}, {picks}, {versions}"


def _would_lose(target: Path, old: Fields) -> WouldLoseEdits:
    return WouldLoseEdits(
        f"{target} holds edits ({_summary(old)}) that this would lose. "
        f"Keep them with {Arg('on_edits', 'keep')} (a changed palette gets a copy of the grade), "
        f"discard them with {Arg('on_edits', 'drop')}, or choose another output"
    )


def _with_edits_of(old: Fields, new: Fields, target: Path) -> Fields:
    if has_edits(new):
        raise Palette4dError(
            f"{target} holds edits ({_summary(old)}) and so does what is to be written; they "
            "cannot be mixed. Choose another output"
        )
    if not same_palette(old, new):
        raise Palette4dError(
            f"{target} holds edits ({_summary(old)}) for a palette that differs from "
            f"the new one, so they cannot be kept. Discard them with {Arg('on_edits', 'drop')}, or "
            "choose another output"
        )
    names = ("edits", "versions", *_HISTORY)
    users = {name: old[name] for name in names if name in old}
    return {**new, **users, "extra": new.get("extra") or old["extra"]}
