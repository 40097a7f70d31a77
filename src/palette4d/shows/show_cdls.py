"""One CDL for each shot of a show: as a collection (.ccc), and in the comments of an EDL.

A shot's CDL is the one of the exported frame nearest to the middle of the timeline's range.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path

from palette4d.common.errors import Palette4dError
from palette4d.common.files import refuse_existing, replacing
from palette4d.common.json_files import read_regular
from palette4d.common.text import counted, some_of
from palette4d.lut_export import cdl as cdls
from palette4d.lut_export.series import Series
from palette4d.shows import edl_cdl, edl_text, edl_timeline, timeline_files, timeline_references
from palette4d.shows.edl_cdl import Cdl
from palette4d.shows.manifest import DONE, Manifest


def check(target: Path, ending: str, format_name: str | None, force: bool, made: Path) -> None:
    """Refuse outputs that cannot be written; the export makes the folder `made`."""
    if target.suffix.lower() != ending:
        raise Palette4dError(f"{target}: expected the name of an {ending} file")
    if format_name not in ("cc", "ccc", "cdl"):
        raise Palette4dError(
            f"{target}: found the format {format_name!r}, expected a CDL: format='ccc', 'cc' or "
            "'cdl'"
        )
    refuse_existing(target, force, made)


def of_shots(manifest: Manifest, exported: Mapping[str, Series]) -> dict[str, Cdl]:
    """Return the CDL of each shot that was exported, by its name."""
    found = {}
    for entry in manifest.entries:
        series = exported.get(entry.shot.name)
        if entry.status != DONE or series is None:
            continue
        listed = {*series.baked, *series.kept}
        rows = [row for row in series.document["frames"] if row["frame"] in listed]
        if not rows:
            continue
        middle = sum(entry.shot.used) / 2
        row = min(rows, key=lambda look: (abs(look["frame"] - middle), look["frame"]))
        read = cdls.read(series.index.parent / row["file"])
        found[entry.shot.name] = Cdl(read.slope, read.offset, read.power, read.saturation)
    return found


def write_collection(shots: Mapping[str, Cdl], target: Path, *, force: bool) -> None:
    """Write a .ccc in which each correction has its shot's name as id."""
    text = cdls.collection(
        {name: cdls.Cdl(c.slope, c.offset, c.power, c.saturation) for name, c in shots.items()}
    )
    with replacing(target, force=force) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_edl(
    source: Path, manifest: Manifest, shots: Mapping[str, Cdl], target: Path, *, force: bool
) -> list[str]:
    """Write a copy of an EDL with the shots' CDLs as comments; return notes for the user."""
    places = timeline_files.in_child(source, places_of, source, manifest.rate)
    data = read_regular(source, timeline_files.LARGEST_FILE)
    timeline_references.check_unchanged(source, manifest)
    text = edl_text.decoded(data)
    events = edl_text.events_of(text, manifest.rate)
    lines = text.splitlines()
    gone: set[int] = set()
    replaced = []
    added: dict[int, tuple[str, str]] = {}
    for entry in manifest.entries:
        if entry.shot.name not in shots or entry.shot.place is None:
            continue
        event = events[places[entry.shot.place.path]]
        first = event.place - len(event.comments)
        for index in range(first, event.place):
            if edl_cdl.is_cdl(lines[index].strip()):
                gone.add(index)
                replaced.append(entry.shot.name)
        added[event.place] = shots[entry.shot.name].comments
    out: list[str] = []
    for index, line in enumerate(lines):
        out += [] if index in gone else [line]
        out += added.get(index + 1, ())
    with replacing(target, force=force) as temporary:
        temporary.write_bytes(edl_text.encoded_like(data, out))
    names = list(dict.fromkeys(replaced))
    if not names:
        return []
    return [
        f"{counted(len(names), 'event has', 'events have')} a CDL in {source}; in the copy that of "
        f"the palette takes its place: {some_of(names)}"
    ]


def places_of(path: Path, rate: Fraction) -> dict[tuple[int, ...], int]:
    """Return the numbers of an EDL's events by their clips' places; call it in a child process."""
    with timeline_files.faults_of(path):
        data = read_regular(path, timeline_files.LARGEST_FILE)
        return edl_timeline.places_of(path, data, rate, timeline_files.library())
