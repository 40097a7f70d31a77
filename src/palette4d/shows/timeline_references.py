"""References from a timeline's clips to the files that were exported for its shots.

They are written to the member `palette4d` of `metadata`, in the timeline and in each clip with a
sidecar. The rest of the file does not change. docs/files.md explains the members.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d import _core
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.files import beside, names_a_server, refuse_existing, replacing
from palette4d.common.json_files import read_regular, with_unique_names
from palette4d.lut_export.series import Series
from palette4d.shows import timeline_files
from palette4d.shows.manifest import DONE, Entry, Manifest

NAMESPACE, VERSION = "palette4d", 1


def check(manifest: Manifest, manifest_path: Path, target: Path, force: bool, made: Path) -> Path:
    """Return the timeline of a show; refuse outputs that `write` would refuse.

    The export makes the folder `made`.
    """
    if target.suffix.lower() != ".otio":
        raise Palette4dError(f"{target}: expected the name of an .otio file")
    refuse_existing(target, force, made)
    return source_of(manifest, manifest_path, "otio")


def source_of(manifest: Manifest, manifest_path: Path, argument: str) -> Path:
    """Return the timeline of a show, which has not changed since; `argument` is for errors."""
    if not manifest.is_timeline:
        raise Palette4dError(
            f"{manifest_path}: its shots are those of the movie {manifest.source}; {Arg(argument)} "
            "expects those of a timeline"
        )
    source = Path(manifest.source)
    if not source.is_absolute():
        source = manifest_path.absolute().parent / source
    if names_a_server(manifest.source, manifest_path) or not source.exists():
        raise Palette4dError(
            f"{source}: the timeline of {manifest_path} is not there; bring it back"
        )
    check_unchanged(source, manifest)
    return source


def check_unchanged(source: Path, manifest: Manifest) -> None:
    """Refuse a timeline that was changed since; call it again after it was read for an output."""
    if timeline_files.sha256(source) != manifest.source_sha256:
        raise Palette4dError(
            f"{source}: the timeline was changed since its shots were analysed; run `palette4d "
            "analyze` again, which does the shots that changed"
        )


def write(
    source: Path,
    manifest: Manifest,
    manifest_path: Path,
    exported: Mapping[str, Series],
    target: Path,
    *,
    force: bool = False,
) -> int:
    """Write a copy of a timeline with references to exported files; return how many clips do.

    `source` comes from `check`, `exported` has the series of each shot by its name. File names are
    relative to the folder of `target`.
    """
    document = _document(source, manifest.rate)
    check_unchanged(source, manifest)
    timeline = _timeline(document, source)
    folder = target.absolute().parent
    count = 0
    for entry in manifest.entries:
        if entry.status != DONE or entry.shot.place is None:
            continue
        clip = _clip(timeline, entry, source)
        _metadata(clip)[NAMESPACE] = _references(
            entry, manifest_path.parent, exported.get(entry.shot.name), folder
        )
        count += 1
    _metadata(timeline)[NAMESPACE] = {
        "version": VERSION,
        "generator": f"palette4d {_core.__version__}",
        "manifest": beside(manifest_path, folder),
    }
    text = json.dumps(document, indent=4, ensure_ascii=False) + "\n"
    # The result must be a readable timeline.
    timeline_files.in_child(source, timeline_files.check_json, target, text)
    with replacing(target, force=force) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return count


def _document(source: Path, rate: Fraction) -> Any:
    """Return a timeline's JSON: from an .otio file, else converted by OpenTimelineIO."""
    text: str | bytes = timeline_files.in_child(source, timeline_files.as_json, source, rate)
    if source.suffix.lower() == ".otio":
        text = read_regular(source, timeline_files.LARGEST_FILE)
    try:
        return json.loads(text, object_pairs_hook=with_unique_names)
    except (ValueError, RecursionError) as error:
        raise Palette4dError(
            f"{source}: it cannot be read as JSON ({error}); expected finite numbers, and metadata "
            "that is not nested deeply"
        ) from error


def _timeline(document: Any, source: Path) -> Any:
    """Return the timeline of a document: the document itself, or the only one in a collection."""
    timelines = [document]
    if str(document.get("OTIO_SCHEMA", "")).startswith("SerializableCollection."):
        timelines = document["children"]
    timelines = [
        child for child in timelines if str(child.get("OTIO_SCHEMA", "")).startswith("Timeline.")
    ]
    if len(timelines) != 1:
        raise Palette4dError(f"{source}: found {len(timelines)} timelines, expected one")
    return timelines[0]


def _clip(timeline: Any, entry: Entry, source: Path) -> Any:
    """Return the clip of a shot."""
    assert entry.shot.place is not None
    item = timeline["tracks"]
    try:
        for index in entry.shot.place.path:
            item = item["children"][index]
        schema = str(item["OTIO_SCHEMA"])
    except (KeyError, IndexError, TypeError):
        schema = "nothing"
    if not schema.startswith("Clip."):
        raise Palette4dError(
            f"{source}: found {schema} where the manifest has the shot {entry.shot.name}, expected "
            "its clip; run `palette4d analyze` again"
        )
    return item


def _metadata(item: Any) -> Any:
    if not isinstance(item.get("metadata"), dict):
        item["metadata"] = {}
    return item["metadata"]


def _references(entry: Entry, shots: Path, series: Series | None, folder: Path) -> dict[str, Any]:
    assert entry.frames is not None
    references: dict[str, Any] = {
        "version": VERSION,
        "shot": entry.shot.name,
        "sidecar": beside(shots / entry.sidecar, folder),
        "frames": list(entry.frames),
        "used": list(entry.shot.used),
    }
    if series is not None:
        listed = {*series.baked, *series.kept}
        references["series"] = beside(series.index, folder)
        references["luts"] = [
            {"frame": row["frame"], "file": beside(series.index.parent / row["file"], folder)}
            for row in series.document["frames"]
            if row["frame"] in listed
        ]
    return references
