"""The index of a series, ``NAME.series.json`` (docs/files.md)."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from palette4d.lut_export.bake import BakeResult
from palette4d.lut_export.measured_write import BakeSettings
from palette4d.lut_export.spaces import INPUT, PALETTE, space_of

from palette4d import _core
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.files import replacing
from palette4d.common.json_files import UnusableFile, read_json
from palette4d.common.text import counted

SCHEMA, VERSION = "palette4d.series", 1

Entry = dict[str, Any]

#: For each member of an index, the words for a difference in it.
_CHANGED = {
    "schema": "another program",
    "version": "another version of the index",
    "generator": "another version of palette4d",
    "options": "other options",
}


def header_of(
    sidecar: _core.Sidecar, name: str, data: bytes, settings: BakeSettings, given: str | None
) -> dict[str, Any]:
    """Return the index members for all files: the sidecar's file, its bytes, and the settings.

    `given` is the clip, if it is not the sidecar's. A config may change under its name, so that its
    conversion counts.
    """
    clip = sidecar.clip
    options = {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(settings).items()}
    if given is not None:
        options["clip"] = given
    if settings.space not in (INPUT, PALETTE):
        steps = space_of(data, sidecar, settings.space, settings.ocio_config).steps
        options["conversion"] = hashlib.sha256(json.dumps(steps).encode()).hexdigest()
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "generator": f"palette4d {_core.__version__}",
        "sidecar": {
            "file": name,
            "sha256": hashlib.sha256(data).hexdigest(),
        },
        "clip": {
            "name": clip["name"],
            "first": clip["first"],
            "last": clip["last"],
            "rate": list(clip["rate"]),
            "encoding": clip["encoding"],
        },
        "options": options,
    }


def entry_of(path: Path, result: BakeResult) -> Entry:
    """Return the index entry of one file."""
    clip = None if result.clip is None else asdict(result.clip.worst)
    return {
        "frame": int(result.frame),
        "file": path.name,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "id": result.id,
        "identity": result.identity,
        "size": result.size,
        "shaper": asdict(result.shaper),
        "error": result.error,
        "error_space": result.encoding,
        "visible": result.visible,
        "clip": clip,
        "grid": asdict(result.grid.worst),
    }


def document_of(header: dict[str, Any], entries: dict[int, Entry]) -> dict[str, Any]:
    """Return an index, its entries in rising order."""
    return {**header, "frames": [entries[frame] for frame in sorted(entries)]}


def write_index(path: Path, header: dict[str, Any], entries: dict[int, Entry]) -> None:
    """Replace an index atomically; one line per entry."""
    lines = [json.dumps(entry) for entry in document_of(header, entries)["frames"]]
    head = json.dumps(header, indent=2).removesuffix("\n}")
    text = head + ',\n  "frames": [\n    ' + ",\n    ".join(lines) + "\n  ]\n}\n"
    with replacing(path, force=True) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def read_index(path: Path, header: dict[str, Any], force: bool) -> dict[int, Entry]:
    """Return the entries of an earlier export with the same sidecar and options."""
    if not path.exists():
        return {}
    try:
        document = read_json(path)
        if not all(map(_is_entry, document["frames"])):
            raise TypeError
        entries = {entry["frame"]: entry for entry in document["frames"]}
        known = {key: document[key] for key in header}
        sha256 = known["sidecar"]["sha256"]
    except (UnusableFile, KeyError, TypeError) as error:
        if force:
            return {}
        raise Palette4dError(
            f"{path}: found no index of a series that can be read, expected the one that an "
            f"earlier export wrote; replace it with {Arg('force', True)}, or choose another folder"
        ) from error
    changed = [word for key, word in _CHANGED.items() if known[key] != header[key]]
    if sha256 != header["sidecar"]["sha256"]:
        changed.append("another state of the sidecar")
    if not changed:
        return entries
    if not force:
        raise Palette4dError(
            f"{path}: it lists a series of {counted(len(entries), 'file')} that was made with "
            f"{' and '.join(changed)}; replace it with {Arg('force', True)}, or choose another "
            "folder"
        )
    return {}


def _is_entry(entry: Any) -> bool:
    """Whether a value has the members of an entry that are used again, with their types."""
    try:
        clip = entry["clip"]
        numbers = [entry["frame"], entry["error"], 0 if entry["size"] is None else entry["size"]]
        numbers += [] if clip is None else [clip["delta_e_largest"]]
        texts = [entry["file"], entry["sha256"], entry["shaper"]["kind"]]
        flags = [entry["identity"], entry["visible"]]
    except (KeyError, TypeError):
        return False
    return (
        type(entry["frame"]) is int
        and all(type(number) in (int, float) and abs(number) < 1e12 for number in numbers)
        and all(isinstance(text, str) for text in texts)
        and all(isinstance(flag, bool) for flag in flags)
        and not (entry["visible"] and clip is None)
    )
