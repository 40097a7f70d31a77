"""Timeline files, read through OpenTimelineIO and its EDL adapter.

A child process reads the file first: a small one can crash the library, or take all memory.
"""

from __future__ import annotations

import dataclasses
import hashlib
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d.common.child import Child
from palette4d.common.errors import Palette4dError, in_words
from palette4d.common.json_files import read_regular
from palette4d.common.text import counted

EXTENSIONS = frozenset({"otio", "otioz", "otiod", "edl"})

#: Limits for reading a timeline; one of 10,000 shots takes some seconds and 200 MB.
SECONDS, MEGABYTES = 120.0, 1024
LARGEST_FILE = 512 << 20


def library() -> Any:
    """Return OpenTimelineIO."""
    try:
        import opentimelineio
    except ImportError as error:
        raise Palette4dError(
            "timelines need OpenTimelineIO, which is not installed; run: "
            "pip install 'palette4d[timeline]'"
        ) from error
    return opentimelineio


@dataclasses.dataclass(frozen=True)
class TimelineFile:
    """A timeline that was read: its file and OpenTimelineIO's object."""

    path: Path
    timeline: Any


def is_timeline(spec: str) -> bool:
    """Whether a file is an edit, by its extension."""
    return Path(spec).suffix.lower().lstrip(".") in EXTENSIONS


def read(path: Path, rate: Fraction | None = None) -> TimelineFile:
    """Read an .otio, .otioz, .otiod or .edl file with exactly one timeline.

    `rate` is that of an EDL's timecodes, by default 24; other files state their rate.
    """
    otio = library()
    if not path.exists():
        raise Palette4dError(f"{path}: there is no such timeline; check the path")
    extension = path.suffix.lower().lstrip(".")
    known = otio.adapters.suffixes_with_defined_adapters(read=True)
    if extension not in known:
        raise Palette4dError(
            f"{path}: OpenTimelineIO has no adapter for .{extension}; run: "
            "pip install 'palette4d[timeline]'"
        )
    regular = path / "content.otio" if path.is_dir() else path
    arguments = {"rate": float(rate)} if rate is not None and extension == "edl" else {}
    try:
        read_regular(regular, LARGEST_FILE)
        with Child(SECONDS, MEGABYTES) as child:
            text = child.call(as_json, str(path), arguments)
    except OSError as error:
        raise Palette4dError(in_words(error)) from error
    except Palette4dError as error:
        raise _unreadable(path, error) from error
    return document_of(path, text)


def _unreadable(path: Path, error: Exception) -> Palette4dError:
    extension = path.suffix.lower()
    return Palette4dError(
        f"{path}: it cannot be read as a timeline ({_first_line(error)}); expected a whole "
        f"{extension} file" + (", and its timecodes' rate as rate=…" if extension == ".edl" else "")
    )


def document_of(path: Path, text: str) -> TimelineFile:
    """Return the only timeline of a file, from its `as_json`; `Palette4dError` if there is none."""
    otio = library()
    try:
        found = otio.adapters.read_from_string(text, "otio_json")
    except Exception as error:  # it does not read back everything that it writes
        raise _unreadable(path, error) from error
    if isinstance(found, otio.schema.SerializableCollection):
        timelines = [one for one in found if isinstance(one, otio.schema.Timeline)]
        if len(timelines) != 1:
            raise Palette4dError(
                f"{path}: found a collection of {counted(len(timelines), 'timeline')}, expected "
                "one; write the timeline to a file of its own"
            )
        found = timelines[0]
    if not isinstance(found, otio.schema.Timeline):
        raise Palette4dError(
            f"{path}: found a {type(found).__name__}, expected a timeline; write the edit to a "
            "file as a whole"
        )
    if path.suffix.lower() == ".edl":
        _rebase(found)
    return TimelineFile(path, found)


def as_json(path: str, arguments: dict[str, float]) -> str:
    """Return a timeline file as OpenTimelineIO's JSON, which it has read without harm."""
    otio = library()
    found = otio.adapters.read_from_file(path, **arguments)
    return str(otio.adapters.write_to_string(found, "otio_json", indent=0))


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0] or type(error).__name__


def _rebase(timeline: Any) -> None:
    """Let all tracks of an EDL begin with the first track; later tracks get a leading gap.

    The EDL adapter stores a track's first record timecode as a negative start. OpenTimelineIO would
    take it as a range and show nothing of the track.
    """
    otio = library()
    starts = [t.source_range.start_time for t in timeline.tracks if t.source_range is not None]
    if not starts:
        return
    first = max(starts)  # the least record timecode: the starts are its negative
    for track in timeline.tracks:
        if track.source_range is not None:
            late = first - track.source_range.start_time
            track.source_range = None
            if late.value > 0:
                track.insert(0, otio.schema.Gap(duration=late))
    timeline.global_start_time = otio.opentime.RationalTime(-first.value, first.rate)


def sha256(path: Path) -> str:
    """Return the hash of a timeline's file; for a folder (.otiod), of the timeline file in it."""
    file = path / "content.otio" if path.is_dir() else path
    return hashlib.sha256(read_regular(file, LARGEST_FILE)).hexdigest()
