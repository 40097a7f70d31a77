"""Timeline files, read through OpenTimelineIO and its EDL adapter, in a child process.

A small file can crash the library, or take all memory. So only plain data leaves the child.
"""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

from palette4d.common.child import Child, ChildError
from palette4d.common.errors import Arg, Palette4dError, in_words
from palette4d.common.json_files import read_regular
from palette4d.common.text import counted
from palette4d.shows import edl_timeline

Result = TypeVar("Result")

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


def is_timeline(spec: str) -> bool:
    """Whether a file is a timeline, by its extension."""
    return Path(spec).suffix.lower().lstrip(".") in EXTENSIONS


def is_edl(path: Path) -> bool:
    """Whether a file is an EDL, by its extension."""
    return path.suffix.lower() == ".edl"


def in_child(path: Path, call: Callable[..., Result], *arguments: object) -> Result:
    """Return a module's function of a timeline's file, called in a child process with limits."""
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
    try:
        read_regular(regular, LARGEST_FILE)
        with Child(SECONDS, MEGABYTES, [path]) as child:
            return child.call(call, *arguments)
    except OSError as error:
        raise Palette4dError(in_words(error)) from error
    except ChildError as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> Palette4dError:
    extension = path.suffix.lower()
    return Palette4dError(
        f"{path}: it cannot be read as a timeline ({_first_line(error)}); expected a whole "
        f"{extension} file"
        + (f", and its timecodes' rate as {Arg('rate')}" if extension == ".edl" else "")
    )


@contextlib.contextmanager
def faults_of(path: Path) -> Iterator[None]:
    """Say in words what OpenTimelineIO raises for a file, which may be anything."""
    try:
        yield
    except (Palette4dError, MemoryError):
        raise
    except Exception as error:
        raise _unreadable(path, error) from error


def load(path: Path, rate: Fraction | None = None) -> Any:
    """Return the only timeline of a file; call it in a child process."""
    otio = library()
    if is_edl(path):
        return edl_timeline.timeline_of(path, read_regular(path, LARGEST_FILE), rate, otio)
    timeline = otio.adapters.read_from_file(str(path))
    if isinstance(timeline, otio.schema.SerializableCollection):
        timelines = [child for child in timeline if isinstance(child, otio.schema.Timeline)]
        if len(timelines) != 1:
            raise Palette4dError(
                f"{path}: found a collection of {counted(len(timelines), 'timeline')}, expected "
                "one; write the timeline to a file of its own"
            )
        timeline = timelines[0]
    if not isinstance(timeline, otio.schema.Timeline):
        known = isinstance(timeline, otio.core.SerializableObject)
        what = f"an object of the type {type(timeline).__name__}" if known else "no OTIO_SCHEMA"
        raise Palette4dError(
            f"{path}: found {what}, expected a timeline; write the edit to a file as a whole"
        )
    return timeline


def as_json(path: Path, rate: Fraction) -> str:
    """Return the timeline of a file as OpenTimelineIO's JSON; `rate` is that of an EDL."""
    with faults_of(path):
        return str(library().adapters.write_to_string(load(path, rate), "otio_json"))


def check_json(path: Path, text: str) -> None:
    """Raise an error if OpenTimelineIO cannot read a text for a file."""
    with faults_of(path):
        library().adapters.read_from_string(text, "otio_json")


def _first_line(error: Exception) -> str:
    """Return why a file cannot be read; errors of an adapter's own code say nothing to a user."""
    if isinstance(error, (AttributeError, LookupError, NameError, TypeError)):
        return "OpenTimelineIO's reader found something that it does not expect"
    return str(error).strip().partition("\n")[0] or type(error).__name__


def sha256(path: Path) -> str:
    """Return the hash of a timeline's file; for a folder (.otiod), of the timeline file in it."""
    file = path / "content.otio" if path.is_dir() else path
    return hashlib.sha256(read_regular(file, LARGEST_FILE)).hexdigest()
