"""The sidecar's only writer. Input: a document (plain dicts and lists); output: a validated file.

`docs/sidecar.md` explains the format. The core (`palette4d._core`) is the judge of every document:
nothing is written that it would refuse, and what was written is read back through it before the
file takes its final name. Readers therefore see the old file or the new one, never a part of one.
"""

import contextlib
import copy
import errno
import json
import os
import secrets
import stat
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from palette4d import _core
from palette4d.common.errors import Palette4dError

if sys.platform != "win32":
    import fcntl

Document = dict[str, Any]
OnEdits = Literal["refuse", "keep", "drop"]

SCHEMA = "palette4d.sidecar"

#: Seconds to wait for another palette4d that writes in the same folder.
LOCK_SECONDS = 10.0

# Member order in the file; what is not named here keeps the document's order.
_ORDER: dict[str, tuple[str, ...]] = {
    "": ("schema", "version", "generator", "clip", "polytope", "quality", "edits", "extra"),
    "/clip": ("name", "source", "frames", "rate", "size", "encoding", "conversion"),
    "/clip/conversion": ("input_space", "config", "error", "steps"),
    "/clip/conversion/steps/*": ("kind", "direction"),
    "/clip/frames": ("first", "last", "step", "skipped"),
    "/polytope": ("vertices", "edges", "blocks", "transitions"),
    "/polytope/vertices/*": ("id", "frame", "rgb"),
    "/polytope/edges/*": ("id", "from", "to"),
    "/polytope/blocks/*": ("first", "last", "tracks", "faces"),
    "/polytope/transitions/*": ("tracks", "faces"),
    "/quality": ("stages", "options", "versions"),
    "/quality/stages/*": ("stage",),
    "/edits": ("vertices", "stops"),
    "/edits/vertices/*": ("vertex", "rgb"),
    "/edits/stops/*": ("id", "edge", "frame", "rgb"),
}

# Containers that are spread over lines; everything else stands on one line, so that a difference
# between two files shows one vertex, edge, track or edit a line.
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
) -> Document:
    """Return a document without edits from the analysis' results.

    Parameters
    ----------
    clip : mapping
        ``name``, ``source``, ``frames`` (``first``, ``last``, ``step``, ``skipped``), ``rate``
        (numerator, denominator), ``size`` (width, height in pixels), ``encoding``, and
        ``conversion`` where the palette is in another space than the clip.
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
    document: Document = {
        "schema": SCHEMA,
        "version": _core.SIDECAR_VERSION,
        "generator": f"palette4d {_core.__version__}",
        "clip": clip,
        "polytope": polytope,
        "quality": {"stages": [], "options": {}, "versions": {}, **quality},
        "edits": {"vertices": [], "stops": []},
        "extra": {},
    }
    plain: Document = _canonical(document, "")
    return plain


def dumps(document: Mapping[str, Any]) -> str:
    """Return the document's text: the same text for equal documents, one row a line.

    Floats are written with the fewest digits that read back to the same double.
    """
    return _text(_canonical(document, ""), "", 0) + "\n"


def validate(document: Mapping[str, Any], name: str = "<document>") -> _core.Sidecar:
    """Return the core's view of a document.

    Raises
    ------
    SidecarError
        Naming `name`, the JSON pointer, what was found and what was expected.
    """
    return _core.parse_sidecar(dumps(document), name)


def load(path: str | os.PathLike[str]) -> Document:
    """Read a sidecar that the core accepts.

    Raises
    ------
    SidecarError
        When there is no such file or the core refuses it.
    """
    return _load_bytes(_read_bytes(path), os.fspath(path))


def has_edits(document: Mapping[str, Any]) -> bool:
    """Return whether a document holds edited vertices or stops."""
    return bool(document["edits"]["vertices"] or document["edits"]["stops"])


def check_target(path: str | os.PathLike[str], *, on_edits: OnEdits = "refuse") -> None:
    """Refuse early, before an analysis, what `save` would certainly refuse after it.

    Raises
    ------
    Palette4dError
        When `path` holds edits and `on_edits` is "refuse", holds something that is not a sidecar
        and `on_edits` is not "drop", or lies in a folder that cannot be written.
    """
    target = _target(path)
    if target.is_dir():
        raise Palette4dError(f"{target}: found a folder, expected the name of a file to write")
    if not target.parent.is_dir():
        raise Palette4dError(
            f"{target}: there is no folder {target.parent}; make it, or choose another output"
        )
    if not os.access(target.parent, os.W_OK):
        raise Palette4dError(
            f"{target}: the folder {target.parent} cannot be written; choose another output"
        )
    old = _existing(target, on_edits)
    if old is not None and has_edits(old) and on_edits == "refuse":
        raise _would_lose(target, old)


def save(
    document: Mapping[str, Any],
    path: str | os.PathLike[str],
    *,
    on_edits: OnEdits = "refuse",
) -> Document:
    """Write a sidecar and return the document as written.

    The document is validated by the core, written to a temporary file in the same folder, synced,
    read back through the core, compared, and renamed. Whatever fails, Ctrl-C included, leaves the
    old file as it was and no temporary file.

    Parameters
    ----------
    document : mapping
        As `new_document` returns it.
    path : path
        A symbolic link is followed; permissions of an existing file are kept.
    on_edits : {"refuse", "keep", "drop"}
        What to do when the file exists and holds edits that `document` lacks. "keep" carries them
        (and ``extra``) over, which needs the same polytope: an edit means nothing without the
        vertices and edges that it names.

    Raises
    ------
    Palette4dError
        When edits would be lost, or the file cannot be written.
    SidecarError
        When the core refuses the document.
    """
    target = _target(path)
    canonical: Document = _canonical(document, "")
    with _locked(target):
        old = _existing(target, on_edits)
        if old is not None and has_edits(old) and old["edits"] != canonical.get("edits"):
            if on_edits == "refuse":
                raise _would_lose(target, old)
            if on_edits == "keep":
                canonical = _with_edits_of(old, canonical, target)
        _replace(target, canonical, replaces=None)
    return canonical


def update_edits(
    path: str | os.PathLike[str], function: Callable[[Document], Mapping[str, Any]]
) -> Document:
    """Load a sidecar, let `function` return it with other edits, write it, and return it.

    Two programs that edit one file at once wait for each other (advisory lock on the folder); where
    a file system has no locks, or the other program takes none, a change of the file in the
    meantime is an error and its content is left alone.

    Raises
    ------
    Palette4dError
        When the file changed meanwhile or cannot be written; whatever `function` raises.
    SidecarError
        When the file, or what `function` returned, is not a valid sidecar.
    """
    target = _target(path)
    with _locked(target):
        before = _read_bytes(target)
        document = _load_bytes(before, os.fspath(path))
        changed: Document = _canonical(function(copy.deepcopy(document)), "")
        if {**changed, "edits": None} != {**_canonical(document, ""), "edits": None}:
            raise ValueError("update_edits: the function changed more than the edits")
        _replace(target, changed, replaces=before)
    return changed


# ------------------------------------------------------------------------------------- documents


def _canonical(value: Any, where: str) -> Any:
    """Return plain JSON values in the file's member order and number forms."""
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


def _load_bytes(data: bytes, name: str) -> Document:
    _core.parse_sidecar(data, name)
    document: Document = json.loads(data)
    return document


def _read_bytes(path: str | os.PathLike[str]) -> bytes:
    _core.read_sidecar(path)  # its errors are the better ones: missing, folder, pipe, too large
    return Path(path).read_bytes()


# ----------------------------------------------------------------------------------- edits at stake


def _existing(target: Path, on_edits: OnEdits) -> Document | None:
    """Return the document that a save would replace, None when there is nothing to lose."""
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
            "Move it away, choose another output, or replace it with --drop-edits"
        ) from error


def _summary(document: Document) -> str:
    vertices = len(document["edits"]["vertices"])
    stops = len(document["edits"]["stops"])
    return (
        f"{vertices} edited {'vertex' if vertices == 1 else 'vertices'} and "
        f"{stops} {'stop' if stops == 1 else 'stops'}"
    )


def _would_lose(target: Path, old: Document) -> Palette4dError:
    return Palette4dError(
        f"{target} holds edits ({_summary(old)}) that this would lose. "
        "Keep them with --keep-edits (works when the palette comes out unchanged), "
        "discard them with --drop-edits, or choose another output"
    )


def _with_edits_of(old: Document, new: Document, target: Path) -> Document:
    if has_edits(new):
        raise Palette4dError(
            f"{target} holds edits ({_summary(old)}) and so does what is to be written; they "
            "cannot be mixed. Choose another output"
        )
    if _canonical(old, "")["polytope"] != new["polytope"]:
        raise Palette4dError(
            f"{target} holds edits ({_summary(old)}) that belong to a palette which differs from "
            "the new one, so they cannot be kept. Discard them with --drop-edits, or choose "
            "another output"
        )
    return {**new, "edits": old["edits"], "extra": new.get("extra") or old["extra"]}


# ------------------------------------------------------------------------------------------- files


def _target(path: str | os.PathLike[str]) -> Path:
    """Return the file itself: a link to it stays a link."""
    return Path(os.path.realpath(path)) if Path(path).is_symlink() else Path(path)


def _cannot_write(target: Path, error: OSError) -> Palette4dError:
    return Palette4dError(
        f"{target}: cannot be written ({error.strerror or error}); check that its folder exists, "
        "may be written and has room, or choose another output"
    )


def _replace(target: Path, document: Document, *, replaces: bytes | None) -> None:
    """Validate, write aside, read back, compare, rename. `replaces` is what must be there still."""
    text = dumps(document)
    # A lone surrogate (a file name that is not UTF-8) passes here for the core to name its place.
    data = text.encode("utf-8", "surrogatepass")
    _core.parse_sidecar(data, os.fspath(target))
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(6)}.tmp")
    try:
        # 0o666 less the umask, as for any new file; tempfile's 0o600 would shut out colleagues.
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        with contextlib.suppress(OSError):
            temporary.chmod(stat.S_IMODE(target.stat().st_mode))
        _read_back(temporary, target, data, document)
        if replaces is not None and _bytes_or_none(target) != replaces:
            raise Palette4dError(
                f"{target} was changed by another program meanwhile; nothing was written. Try again"
            )
        temporary.replace(target)
    except OSError as error:
        raise _cannot_write(target, error) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
    _sync_folder(target.parent)


def _read_back(temporary: Path, target: Path, data: bytes, document: Document) -> None:
    sidecar = _core.read_sidecar(temporary)
    polytope = sidecar.polytope
    vertices = document["polytope"]["vertices"]
    index = {vertex["id"]: i for i, vertex in enumerate(vertices)}
    agrees = (
        temporary.read_bytes() == data
        and polytope.vertices.tolist() == [[*v["rgb"], v["frame"]] for v in vertices]
        and polytope.vertex_ids == [v["id"] for v in vertices]
        and polytope.edge_ids == [e["id"] for e in document["polytope"]["edges"]]
        and polytope.edges.tolist()
        == [[index[e["from"]], index[e["to"]]] for e in document["polytope"]["edges"]]
        and sidecar.edits.vertex_rgb
        == {e["vertex"]: tuple(e["rgb"]) for e in document["edits"]["vertices"]}
        and sidecar.edits.stops
        == [{**stop, "rgb": tuple(stop["rgb"])} for stop in document["edits"]["stops"]]
    )
    if not agrees:
        raise Palette4dError(
            f"{target}: what was written reads back differently; nothing was replaced. Check the "
            "disk, and report this if it is sound"
        )


def _bytes_or_none(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None


def _sync_folder(folder: Path) -> None:
    """Make the rename itself durable, where folders can be opened and synced."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


@contextlib.contextmanager
def _locked(target: Path) -> Iterator[None]:
    """Hold the folder's advisory lock, which leaves no file behind and ends with the process."""
    try:
        handle = os.open(target.parent, os.O_RDONLY)
    except OSError:
        yield  # no such folder, or folders cannot be opened here: writing will tell
        return
    try:
        _lock(handle, target)
        yield
    finally:
        os.close(handle)  # releases the lock


def _lock(handle: int, target: Path) -> None:
    if sys.platform == "win32":
        return
    deadline = time.monotonic() + LOCK_SECONDS
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno not in (errno.EWOULDBLOCK, errno.EAGAIN):
                return  # a file system without locks
        else:
            return
        if time.monotonic() > deadline:
            raise Palette4dError(
                f"{target}: another program has kept the folder {target.parent} locked for "
                f"{LOCK_SECONDS:g} seconds; wait for it to finish, or end it"
            )
        time.sleep(0.05)
