"""The sidecar's text and files: the reader and the only writer.

Input and output are a sidecar's members as plain dicts and lists; `docs/sidecar.md` explains them.
The core (`palette4d._core`) validates every text before it is written.
"""

import itertools
import json
import os
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from palette4d import _core
from palette4d.common.errors import Palette4dError, SidecarError
from palette4d.common.files import link_target, refuse_existing, replacing
from palette4d.common.locking import locked
from palette4d.common.text import counted
from palette4d.grade import edits
from palette4d.media.clip_sequence import IMAGE_EXTENSIONS, MOVIE_EXTENSIONS

if TYPE_CHECKING:
    from palette4d.grade.mattes import Display

Fields = dict[str, Any]
OnEdits = Literal["refuse", "keep", "drop"]

SCHEMA = "palette4d.sidecar"

#: The longest text that the core accepts.
_LARGEST_FILE = 64 << 20

# Member order in the file; other members keep the document's order.
_ORDER: dict[str, tuple[str, ...]] = {
    "": (
        *("schema", "version", "generator", "clip", "polytope", "colours", "quality"),
        *("edits", "mattes", "versions", "history", "extra"),
    ),
    "/clip": ("name", "source", "frames", "rate", "size", "encoding", "conversion"),
    "/clip/conversion": ("input_space", "config", "error", "steps"),
    "/clip/conversion/steps/*": ("kind", "direction"),
    "/clip/frames": ("first", "last", "step", "skipped"),
    "/polytope": ("vertices", "edges", "blocks", "transitions"),
    "/polytope/vertices/*": ("id", "frame", "rgb", "name"),
    "/polytope/edges/*": ("id", "from", "to"),
    "/polytope/blocks/*": ("first", "last", "tracks", "faces"),
    "/polytope/transitions/*": ("tracks", "faces"),
    "/quality": ("stages", "options", "versions"),
    "/quality/stages/*": ("stage",),
    "/edits": ("ramp", "vertices", "stops", "picks", "locks"),
    "/edits/vertices/*": ("vertex", "rgb", "ramp"),
    "/edits/stops/*": ("id", "edge", "frame", "rgb", "ramp"),
    "/mattes": ("display", "grids"),
    "/mattes/display": ("from", "to", "values"),
    "/versions/*": ("name", "edits"),
    "/history": ("done", "undone"),
}

# Containers that take several lines. All others take one line, so that a diff of two files has one
# line per vertex, edge, track or edit.
_SPREAD = {
    "",
    "/clip",
    "/clip/conversion",
    "/clip/conversion/steps",
    "/polytope",
    "/polytope/vertices",
    "/polytope/edges",
    "/polytope/blocks",
    "/polytope/blocks/*",
    "/polytope/blocks/*/tracks",
    "/polytope/transitions",
    "/polytope/transitions/*",
    "/polytope/transitions/*/tracks",
    "/quality",
    "/quality/stages",
    "/quality/options",
    "/quality/versions",
    "/edits",
    "/edits/vertices",
    "/edits/stops",
    "/edits/picks",
    "/mattes",
    "/mattes/grids",
    "/colours",
    "/versions",
    "/history",
    "/history/done",
    "/history/undone",
    "/extra",
}

_FRAME_NUMBERS = {
    "/clip/frames/first",
    "/clip/frames/last",
    "/clip/frames/step",
    "/clip/frames/skipped/*",
    "/polytope/vertices/*/frame",
    "/polytope/blocks/*/first",
    "/polytope/blocks/*/last",
    "/edits/stops/*/frame",
}


def new_document(
    clip: Mapping[str, Any],
    polytope: Mapping[str, Any],
    quality: Mapping[str, Any] | None = None,
) -> Fields:
    """Return a document without edits from the analysis' results.

    Parameters
    ----------
    clip : mapping
        ``name``, ``source``, ``frames`` (``first``, ``last``, ``step``, ``skipped``), ``rate``
        (numerator, denominator), ``size`` (width, height in pixels), ``encoding``, and
        ``conversion`` if the palette's colour space differs from the clip's.
    polytope : mapping
        ``vertices``, ``edges``, ``blocks``, ``transitions`` as in `docs/sidecar.md`.
    quality : mapping, optional
        ``stages``, ``options``, ``versions``; each may be missing.

    Returns
    -------
    dict
        Plain dicts, lists, texts and numbers (NumPy values are converted). Not yet validated:
        `save` does that.
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
    plain: Fields = _canonical(document, "")
    return plain


def dumps(document: Mapping[str, Any]) -> str:
    """Return the document's text: equal documents give equal text, one row per line.

    Floats have the fewest digits that read back to the same double.
    """
    return _text(_canonical(document, ""), "", 0) + "\n"


def validate(document: Mapping[str, Any], name: str = "<document>") -> _core.Sidecar:
    """Return the core's view of a document.

    Raises
    ------
    SidecarError
        Naming `name`, the JSON pointer, what was found and what was expected.
    """
    return _core.parse_sidecar(encoded(document), name)


def encoded(document: Mapping[str, Any]) -> bytes:
    """Return the bytes of `dumps`; names that are not Unicode pass, and the core refuses them."""
    return dumps(document).encode("utf-8", "surrogatepass")


def read_bytes(path: str | os.PathLike[str]) -> bytes:
    """Return a file's bytes without validation.

    Raises
    ------
    SidecarError
        The file is missing or cannot be read, or is a picture or a movie.
    """
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
        # Opening a pipe would block until a program writes into it.
        if stat.S_ISREG(Path(path).stat().st_mode):
            with Path(path).open("rb") as stream:
                return stream.read(_LARGEST_FILE + 1)
    except OSError as error:
        reason = error.strerror
    else:
        reason = "it is not a regular file"
    _core.read_sidecar(path)  # raises the error that names the kind of file
    raise SidecarError(os.fspath(path), "", f"an unreadable file ({reason})", "a sidecar file")


def load(path: str | os.PathLike[str]) -> Fields:
    """Read the members of a sidecar that the core accepts.

    Raises
    ------
    SidecarError
        When there is no such file or the core refuses it.
    """
    data = read_bytes(path)
    _core.parse_sidecar(data, os.fspath(path))
    return fields_of(data)


def fields_of(data: bytes) -> Fields:
    """Return the members of a text that the core accepts; 24.0 becomes 24 where it is whole."""
    document: Fields = json.loads(data)
    if document["version"] < _core.SIDECAR_VERSION:
        _upgrade(document)
    clip = document["clip"]
    frames = clip["frames"]
    for holder, names in ((frames, ("first", "last", "step", "skipped")), (clip, ("rate", "size"))):
        holder.update({name: _whole(holder[name]) for name in names})
    return document


def _upgrade(document: Fields) -> None:
    """Bring the members of version 1 up to date: picks no longer move palette colours."""
    for part in (document["edits"], *(v["edits"] for v in document.get("versions", ()))):
        part.pop("solution", None)
        for pick in part.get("picks", ()):
            for name in edits.FORMER:
                pick.pop(name, None)


def _whole(value: Any) -> Any:
    return [int(one) for one in value] if isinstance(value, list) else int(value)


def has_edits(document: Mapping[str, Any]) -> bool:
    """Return whether a document holds edits or versions."""
    return bool(any(document["edits"].values()) or document.get("versions"))


def state_of(document: Mapping[str, Any]) -> dict[edits.Key, Any]:
    """Return what the user set: the state of `edits` and `versions`."""
    state = edits.from_fields(document["edits"])
    for version in document.get("versions", ()):
        state["version", version["name"]] = version["edits"]
    return state


def with_state(document: Fields, state: edits.State, vertex_ids: Iterable[str]) -> Fields:
    """Return a document with the `edits` and `versions` of a state."""
    found = {**document, "edits": edits.to_fields(state, vertex_ids)}
    names = sorted(name for kind, name in state if kind == "version")
    found["versions"] = [{"name": name, "edits": state["version", name]} for name in names]
    return found if names else {n: v for n, v in found.items() if n != "versions"}


def with_mattes(
    document: Fields, texts: Mapping[str, str], curve: Callable[[], "Display | None"]
) -> Fields:
    """Return a document with the mattes of its picks, those of versions and steps too.

    Without picks the file has the first version of the format, so that older programs read it.
    """
    picks = list(_picks_in(document))
    document = {name: value for name, value in document.items() if name != "mattes"}
    document["version"] = 2 if picks else 1
    used = sorted({pick["matte"] for pick in picks if "matte" in pick} & texts.keys())
    mattes: Fields = {}
    if picks and (display := curve()) is not None:
        start, end, values = display
        mattes["display"] = {"from": start, "to": end, "values": values}
    if used or mattes:
        document["mattes"] = {**mattes, "grids": {id_: texts[id_] for id_ in used}}
    return document


def _picks_in(document: Fields) -> Iterator[Fields]:
    """Yield all picks of a document: of its edits, its versions and its steps."""
    for part in (document["edits"], *(v["edits"] for v in document.get("versions", ()))):
        yield from part.get("picks", ())
    for step in itertools.chain(*document.get("history", {}).values()):
        for kind, _, *values in step["changes"]:
            for value in filter(None, values):
                if kind == "pick":
                    yield value
                elif kind == "version":
                    yield from value.get("picks", ())


def history_of(document: Mapping[str, Any], name: str) -> tuple[list[edits.Edit], list[edits.Edit]]:
    """Return the done and the undone steps of a document.

    Raises
    ------
    SidecarError
        The member "history" is unusable.
    """
    history = document.get("history", {})
    found = []
    for part in ("done", "undone"):
        try:
            steps = [edits.step_from_fields(step) for step in history.get(part, [])]
        except (Palette4dError, TypeError, ValueError, LookupError, AttributeError) as error:
            raise SidecarError(
                name,
                f"/history/{part}",
                f"an unusable list of steps ({error})",
                "the steps that palette4d wrote; remove the member `history` to go on without them",
            ) from None
        # Older files have steps that make versions.
        found.append([kept for step in steps if (kept := step.undoable()).changes])
    return found[0], found[1]


def with_history(
    document: Fields, done: Sequence[edits.Edit], undone: Sequence[edits.Edit]
) -> Fields:
    """Return a document with these steps; without steps it has no member "history"."""
    parts = {"done": done, "undone": undone}
    history = {
        n: [edits.step_to_fields(step) for step in part] for n, part in parts.items() if part
    }
    if history:
        return {**document, "history": history}
    return {name: value for name, value in document.items() if name != "history"}


def check_target(path: str | os.PathLike[str], *, on_edits: OnEdits = "refuse") -> None:
    """Raise the errors of `save` before a long analysis, where they are certain.

    Raises
    ------
    Palette4dError
        When `path` holds edits and `on_edits` is "refuse", holds something that is not a sidecar
        and `on_edits` is not "drop", or lies in a folder that cannot be written.
    """
    target = link_target(path)
    refuse_existing(target, force=True)
    old = existing(target, on_edits)
    if old is not None and has_edits(old) and on_edits == "refuse":
        raise _would_lose(target, old)


def save(
    document: Mapping[str, Any],
    path: str | os.PathLike[str],
    *,
    on_edits: OnEdits = "refuse",
    replaces: bytes | None = None,
) -> Fields:
    """Write a sidecar and return the document as written.

    The core validates the text before it replaces the file. After any failure, also Ctrl-C, the old
    file is unchanged and no temporary file remains.

    Parameters
    ----------
    document : mapping
        As `new_document` returns it.
    path : path
        A symbolic link is followed; permissions of an existing file are kept.
    on_edits : {"refuse", "keep", "drop"}
        What to do if the file exists and holds edits that `document` lacks. "keep" copies the edits
        (and ``extra``). It needs the same polytope, because edits refer to its vertices and edges;
        `grade.reanalysis` copies grades to another polytope.
    replaces : bytes, optional
        The expected content of the file; another one is an error.

    Raises
    ------
    Palette4dError
        When edits would be lost, or the file cannot be written.
    SidecarError
        When the core refuses the document.
    """
    canonical: Fields = _canonical(document, "")
    target = link_target(path)
    with locked(target) as held:
        old = existing(target, on_edits)
        if old is not None and has_edits(old) and old["edits"] != canonical.get("edits"):
            if on_edits == "refuse":
                raise _would_lose(target, old)
            if on_edits == "keep":
                canonical = _with_edits_of(old, canonical, target)
        data = encoded(canonical)
        _core.parse_sidecar(data, os.fspath(target))
        write(target, data, held, replaces=replaces)
    return canonical


def write(
    target: Path, data: bytes, held: Callable[[], None], *, replaces: bytes | None = None
) -> None:
    """Replace a file's content by the bytes of a validated document.

    Parameters
    ----------
    target : Path
        The file; the caller holds its lock.
    data : bytes
        The new content.
    held : callable
        The check of the lock, from `locked`.
    replaces : bytes, optional
        The expected old content, checked just before the rename: other programs ignore the lock.

    Raises
    ------
    Palette4dError
        The file holds something else, or cannot be written.
    """

    def unchanged() -> None:
        held()
        if replaces is not None and _bytes_or_none(target) != replaces:
            raise Palette4dError(
                f"{target} was changed by another program meanwhile; nothing was written. Try again"
            )

    with replacing(target, force=True, check=unchanged) as temporary:
        temporary.write_bytes(data)


# ------------------------------------------------------------------------------------- documents


def _canonical(value: Any, where: str) -> Any:
    """Return plain JSON values, with the file's member order and number formats."""
    if where in ("/history", "/mattes") or type(value) is str:
        return value  # steps are plain values in their order already, and many
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        order = _ORDER.get(where, ())
        names = [name for name in order if name in value]
        names += [name for name in value if name not in order]
        return {str(name): _canonical(value[name], f"{where}/{name}") for name in names}
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return [_canonical(item, f"{where}/*") for item in value]
    if where in _FRAME_NUMBERS and isinstance(value, float) and value.is_integer():
        return int(value)
    colour = where.endswith("/rgb/*") and not where.startswith("/extra")
    if colour and type(value) is int and abs(value) <= 2**53:
        return float(value)
    return value


def _text(value: Any, where: str, depth: int) -> str:
    if not isinstance(value, dict | list) or not value or where not in _SPREAD:
        try:
            return json.dumps(value, ensure_ascii=False)
        except TypeError as error:
            raise TypeError(f"a sidecar holds JSON values only; at {where}: {error}") from None
    inner = "  " * (depth + 1)
    if isinstance(value, dict):
        rows = [
            f"{json.dumps(name, ensure_ascii=False)}: {_text(item, f'{where}/{name}', depth + 1)}"
            for name, item in value.items()
        ]
    else:
        rows = [_text(item, f"{where}/*", depth + 1) for item in value]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    body = ",\n".join(inner + row for row in rows)
    return f"{opening}\n{body}\n{'  ' * depth}{closing}"


# ----------------------------------------------------------------------------------- edits at stake


def same_palette(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Return whether two documents have the same polytope, so that edits of one fit the other."""
    return bool(_canonical(one, "")["polytope"] == _canonical(other, "")["polytope"])


def existing(target: Path, on_edits: OnEdits) -> Fields | None:
    """Return the document that a save would replace; None if no edits would be lost."""
    if on_edits not in ("refuse", "keep", "drop"):
        raise ValueError(f"on_edits: found {on_edits!r}, expected 'refuse', 'keep' or 'drop'")
    try:
        if target.stat().st_size == 0:
            return None
    except FileNotFoundError:
        return None
    if on_edits == "drop":
        return None
    try:
        return load(target)
    except Palette4dError as error:
        raise Palette4dError(
            f"{target} exists and cannot be read as a sidecar ({error}); it may hold edits. "
            'Move it away, choose another output, or replace it with on_edits="drop"'
        ) from error


def _summary(document: Fields) -> str:
    vertices = counted(len(document["edits"]["vertices"]), "edited vertex", "edited vertices")
    stops = counted(len(document["edits"]["stops"]), "stop")
    picks = counted(len(document["edits"].get("picks", ())), "pick or hold", "picks and holds")
    return f"{vertices}, {stops} and {picks}"


def _would_lose(target: Path, old: Fields) -> Palette4dError:
    return Palette4dError(
        f"{target} holds edits ({_summary(old)}) that this would lose. "
        'Keep them with on_edits="keep" (a changed palette gets a copy of the grade), '
        'discard them with on_edits="drop", or choose another output'
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
            'the new one, so they cannot be kept. Discard them with on_edits="drop", or choose '
            "another output"
        )
    names = ("edits", "mattes", "versions", "history")
    users = {name: old[name] for name in names if name in old}
    kept: Fields = _canonical({**new, **users, "extra": new.get("extra") or old["extra"]}, "")
    return kept


# ------------------------------------------------------------------------------------------- files


def _bytes_or_none(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
