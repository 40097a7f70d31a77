"""A show's manifest, ``NAME.shots.json``: its shots, their sidecars, and what failed.

`docs/files.md` explains the format; `shots_v1.schema.json` is its JSON Schema. The file is replaced
after each shot, so that an interrupted run keeps its results.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d import _core
from palette4d.common.errors import Message, Palette4dError, in_words
from palette4d.common.files import replacing
from palette4d.common.json_files import UnusableFile, read_json
from palette4d.common.text import some_of
from palette4d.shows.edl_cdl import Cdl
from palette4d.shows.shots import Place, Shot

SCHEMA, VERSION = "palette4d.shots", 1
ENDING = ".shots.json"

#: The largest frame number, and part of a rate.
LARGEST_NUMBER = 2**31 - 1

#: Bytes of a shot's name with its suffix, such as _f120.
_LONGEST_NAME = 200

DONE, FAILED, TO_DO = "done", "failed", "to do"
#: The options that a shot may have of its own.
SPACES = ("input_space", "palette_space", "ocio_config")


@dataclasses.dataclass(frozen=True)
class Entry:
    """A shot and its result.

    Attributes
    ----------
    shot : the shot before the analysis.
    status : `DONE`, `FAILED` or `TO_DO`.
    frames : (int, int) or None; the first and last frame of the sidecar. At cuts of the media there
        are fewer head or tail frames.
    error : the reason of a failure.
    spaces : the shot's own `SPACES`, by name; it has the show's where this is empty.
    """

    shot: Shot
    status: str = TO_DO
    frames: tuple[int, int] | None = None
    error: str = ""
    spaces: Mapping[str, str] = dataclasses.field(default_factory=dict)

    @property
    def sidecar(self) -> str:
        """The sidecar's file, beside the manifest."""
        return f"{self.shot.name}.p4d.json"


@dataclasses.dataclass(frozen=True)
class Manifest:
    """A show.

    Attributes
    ----------
    source : the timeline or the movie, relative to the manifest's folder.
    source_sha256 : the hash of the timeline's file; "" for a movie.
    rate : frames per second of the timeline, or of the movie.
    options : the options of the analysis, as sidecars record them.
    entries : in the order of the timeline.
    """

    source: str
    source_sha256: str
    rate: Fraction
    options: dict[str, Any]
    entries: tuple[Entry, ...]

    @property
    def is_timeline(self) -> bool:
        """Whether the shots come from a timeline, not from a movie."""
        return bool(self.source_sha256)


def path_of(folder: Path, name: str) -> Path:
    """Return the path of the manifest for a show with this name."""
    return folder / f"{name}{ENDING}"


def is_manifest(path: Path) -> bool:
    """Whether a file's name is a manifest's name."""
    return path.name.endswith(ENDING)


def write(manifest: Manifest, path: Path) -> None:
    """Replace a manifest atomically; one line per shot."""
    head = {
        "schema": SCHEMA,
        "version": VERSION,
        "generator": f"palette4d {_core.__version__}",
        "source": {"file": manifest.source, "sha256": manifest.source_sha256},
        "rate": [manifest.rate.numerator, manifest.rate.denominator],
        "options": manifest.options,
    }
    lines = [json.dumps(_row(entry), ensure_ascii=False) for entry in manifest.entries]
    text = json.dumps(head, indent=2, ensure_ascii=False).removesuffix("\n}")
    text += ',\n  "shots": [\n    ' + ",\n    ".join(lines) + "\n  ]\n}\n"
    with replacing(path, force=True) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _row(entry: Entry) -> dict[str, Any]:
    shot, place = entry.shot, entry.shot.place
    row: dict[str, Any] = {
        "name": shot.name,
        "status": entry.status,
        "sidecar": entry.sidecar,
        "clip": shot.clip,
        "asked": [shot.first, shot.last],
        **({} if entry.frames is None else {"frames": list(entry.frames)}),
        "step": shot.step,
        "used": list(shot.used),
    }
    if place is not None:
        row["edit"] = {"track": place.track, "record": place.record, "path": list(place.path)}
    if shot.speed != 1:
        row["speed"] = shot.speed
    if shot.cdl is not None:
        row["cdl"] = dataclasses.asdict(shot.cdl)
    if entry.error:
        row["error"] = Message(entry.error)
    return {**row, **entry.spaces}


def read(path: Path) -> Manifest:
    """Read a manifest."""
    try:
        document = read_json(path)
    except FileNotFoundError as error:
        raise Palette4dError(f"{path}: there is no such manifest; check the path") from error
    except OSError as error:
        raise Palette4dError(in_words(error)) from error
    except UnusableFile as error:
        raise Palette4dError(f"{error}{_MEND}") from error
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != SCHEMA:
        raise Palette4dError(
            f"{path}: found the schema {schema!r}, expected {SCHEMA!r}: a manifest that `palette4d "
            "analyze` wrote beside the sidecars of a show"
        )
    if document.get("version") != VERSION:
        raise Palette4dError(
            f"{path}: found a manifest of version {document.get('version')!r}, expected {VERSION}; "
            "use the palette4d that wrote it, or analyse again with this one"
        )
    try:
        return Manifest(
            source=_text(document["source"]["file"]),
            source_sha256=_text(document["source"]["sha256"]),
            rate=_rate(*document["rate"]),
            options=dict(document["options"]),
            entries=tuple(_entry(row) for row in document["shots"]),
        )
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise Palette4dError(
            f"{path}: the manifest is broken ({type(error).__name__}: {error}){_MEND}"
        ) from error


_MEND = "; move it away and run `palette4d analyze` again, which keeps the sidecars"


def _entry(row: dict[str, Any]) -> Entry:
    place = None
    if place_of := row.get("edit"):
        path = tuple(map(_whole, place_of["path"]))
        place = Place(_text(place_of["track"]), _text(place_of["record"]), path)
    first, last = map(_whole, row["asked"])
    used_first, used_last = map(_whole, row["used"])
    frames, step = row.get("frames"), _whole(row["step"])
    if row["status"] not in (DONE, FAILED, TO_DO) or (row["status"] == DONE) != bool(frames):
        raise ValueError(f"status {row['status']!r}")
    if step < 1:
        raise ValueError(f"step {step}")
    name = _text(row["name"])
    if row["sidecar"] != f"{name}.p4d.json" or _core.file_safe(name, _LONGEST_NAME) != name:
        raise ValueError(f"sidecar {row['sidecar']!r} of the shot {name!r}")
    shot = Shot(
        name,
        _text(row["clip"]),
        first,
        last,
        (used_first, used_last),
        step,
        place,
        speed=_number(row.get("speed", 1)),
        cdl=_cdl(row["cdl"]) if "cdl" in row else None,
    )
    return Entry(
        shot=shot,
        status=row["status"],
        frames=(_whole(frames[0]), _whole(frames[1])) if frames else None,
        error=Message(_text(row.get("error", ""))),  # a file's NUL is no mark of an argument
        spaces={name: _text(row[name]) for name in SPACES if name in row},
    )


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r:.40} instead of a text")
    return value


def _whole(value: Any) -> int:
    if type(value) is not int or abs(value) > LARGEST_NUMBER:
        raise TypeError(f"{value!r:.40} instead of a whole number up to {LARGEST_NUMBER}")
    return value


def _number(value: Any) -> float:
    if type(value) not in (int, float) or not math.isfinite(value):
        raise TypeError(f"{value!r:.40} instead of a number")
    return float(value)


def _cdl(row: dict[str, Any]) -> Cdl:
    three = {}
    for name in ("slope", "offset", "power"):
        r, g, b = map(_number, row[name])
        three[name] = (r, g, b)
    return Cdl(**three, saturation=_number(row["saturation"]))


def _rate(numerator: Any, denominator: Any) -> Fraction:
    rate = Fraction(_whole(numerator), _whole(denominator))
    if rate <= 0:
        raise ValueError(f"the rate {rate}")
    return rate


def sidecars(path: Path, manifest: Manifest | None = None) -> tuple[list[Path], list[str]]:
    """Return the sidecars of a show's finished shots, and the names of the other shots.

    `manifest` is what was read already.
    """
    manifest = manifest or read(path)
    done = [path.parent / e.sidecar for e in manifest.entries if e.status == DONE]
    others = [e.shot.name for e in manifest.entries if e.status != DONE]
    if gone := [file.name for file in done if not file.exists()]:
        raise Palette4dError(
            f"{path}: found no sidecar {some_of(gone)} beside it, expected those of shots that are "
            "done; bring them back, or run `palette4d analyze` again, which makes what is missing"
        )
    if not done:
        raise Palette4dError(
            f"{path}: none of its {len(others)} shots is analysed; run `palette4d analyze` again"
        )
    return done, others
