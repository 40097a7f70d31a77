"""A series: the edit at many frames, one file per frame, and an index of the files.

For each file, the index records the sidecar's state, the settings and the file's hash. So a series
can be interrupted and resumed. A matching file is kept. A file that does not match is replaced only
with ``force``.

Other processes or machines bake the frames. Only this process writes in the folder.
"""

import hashlib
import itertools
import math
import os
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.bake import SidecarBytes, bake, check_settings, check_target
from palette4d.lut_export.formats import format_named
from palette4d.lut_export.frame_edit import frame_text
from palette4d.lut_export.measured_write import BakeSettings
from palette4d.lut_export.series_index import (
    Entry,
    document_of,
    entry_of,
    header_of,
    read_index,
    write_index,
)

from palette4d import _core
from palette4d.colour.ocio_config import files_of_config, from_anywhere
from palette4d.common.arguments import frames_between
from palette4d.common.errors import Arg, Palette4dError, WriteError
from palette4d.common.files import make_folder, replacing, temporary_folder, unwritten
from palette4d.common.text import checked_name, file_safe
from palette4d.jobs.workers import Failed, Workers
from palette4d.media.clip_files import files_of_sidecar

#: Seconds between two updates of the index file while frames are baked.
INDEX_EVERY = 2.0

#: How far a smooth ramp may be from a line between two frames of `stops`, in code values.
STRAIGHT = 0.004


@dataclass(frozen=True)
class Request:
    """A series to export.

    Attributes
    ----------
    sidecar, folder : the input, and the folder for the files.
    frames : frame numbers in rising order.
    settings : for every frame. ``format`` must be set.
    name : the files' common name; None: the clip's name.
    padding : digits of the frame numbers in the names.
    clip : the clip, for shapers and errors; None: the clip that the sidecar names.
    force : replace files that differ.
    replaces_links : a link in a file's place is replaced; False: the file that it leads to.
    """

    sidecar: Path | SidecarBytes
    folder: Path
    frames: tuple[int, ...]
    settings: BakeSettings
    name: str | None = None
    padding: int = 4
    clip: str | None = None
    force: bool = False
    replaces_links: bool = False


@dataclass(frozen=True)
class Series:
    """An exported series.

    Attributes
    ----------
    index : Path
        The index file.
    document : dict
        Its content.
    baked, kept : list of int
        Frames whose files were written, and frames whose files were kept.
    failed : dict of int to str
        The error message of each frame that failed.
    """

    index: Path
    document: dict[str, Any] = field(repr=False)
    baked: list[int]
    kept: list[int]
    failed: dict[int, str]


@dataclass(frozen=True)
class FrameTask:
    """One file to bake; can be sent to another process or machine."""

    sidecar: SidecarBytes
    frame: int
    file: str
    settings: BakeSettings
    clip: str | None


def every(sidecar: _core.Sidecar, step: int) -> tuple[int, ...]:
    """Return every `step`-th frame of the clip, from its first.

    Raises
    ------
    Palette4dError
        There are too many.
    """
    return tuple(frames_between(*_limits(sidecar), step))


def stops(sidecar: _core.Sidecar) -> tuple[int, ...]:
    """Return the frames between which the grade changes along a line.

    These are the frames of the stops, of the edited palette colours and of their neighbours, where
    an edit begins or ends, and those of picks: of their paths and ramps. A smooth ramp has more
    between them, a held edit its last frame. Each time is rounded to a
    frame. A sidecar without edits is refused.
    """
    polytope, edits = sidecar.polytope, sidecar.edits
    index = {name: i for i, name in enumerate(polytope.vertex_ids)}
    edges = dict(zip(polytope.edge_ids, polytope.edges.tolist(), strict=True))
    edited = {index[name] for name in edits.vertex_rgb}
    around = edited | {end for ends in edges.values() if edited & set(ends) for end in ends}
    marks = edits.stops
    around |= {end for mark in marks for end in edges[mark["edge"]]}
    times = [float(mark["frame"]) for mark in marks]
    times += [float(polytope.vertices[i, 3]) for i in around]
    times += [time for edge in edges for time in _ramp_times(sidecar, edge)]
    times += edits.pick_times if times or not edits.empty else []
    if not times:
        raise Palette4dError(
            "nothing is edited in this sidecar, so that there are no stops; edit it, or choose "
            f"{Arg('every')} or {Arg('frames')}"
        )
    low, high = _limits(sidecar)
    return tuple(sorted({min(max(math.floor(t + 0.5), low), high) for t in times}))


def _ramp_times(sidecar: _core.Sidecar, edge: str) -> list[float]:
    """Return the times on an edge, besides its handles, that its ramps need."""
    polytope, edits = sidecar.polytope, sidecar.edits
    number = polytope.edge_ids.index(edge)
    ends = [polytope.vertex_ids[i] for i in polytope.edges[number]]
    stops = sorted((s for s in edits.stops if s["edge"] == edge), key=lambda s: float(s["frame"]))
    if not stops and not edits.vertex_rgb.keys() & set(ends):
        return []
    times = [float(polytope.vertices[polytope.edges[number, 0], 3])]
    times += [float(stop["frame"]) for stop in stops]
    times += [float(polytope.vertices[polytope.edges[number, 1], 3])]
    ramps = [edits.vertex_ramp.get(ends[0]), *(stop.get("ramp") for stop in stops)]

    def moved(time: float) -> NDArray[np.float64]:
        cut = _core.slice_at(polytope, time)
        row = cut.edges.tolist().index(number)
        by: NDArray[np.float64] = _core.edited_colours(polytope, edits, cut)[row] - cut.rgb[row]
        return by

    def bends(start: float, end: float) -> list[float]:
        if end - start <= 1:
            return []
        parts = np.linspace(0, 1, 5)
        # Just inside: at its ends the edge has no place of its own in a slice.
        inner = start + (end - start) * np.clip(parts, 1e-6, 1 - 1e-6)
        colours = np.array([moved(time) for time in inner.tolist()])
        line = colours[0] + parts[:, None] * (colours[-1] - colours[0])
        if np.abs(colours - line).max() <= STRAIGHT:
            return []
        middle = (start + end) / 2
        return [*bends(start, middle), middle, *bends(middle, end)]

    result = []
    for (start, end), own in zip(itertools.pairwise(times), ramps, strict=True):
        ramp = own or edits.ramp
        if ramp == "smooth":
            result += bends(start, end)
        elif ramp == "hold" and start < math.ceil(end) - 1:
            result.append(math.ceil(end) - 1.0)
    return result


def check_frames(sidecar: _core.Sidecar, frames: tuple[int, ...]) -> tuple[int, ...]:
    """Return `frames`, all within the clip."""
    low, high = _limits(sidecar)
    outside = [frame for frame in frames if not low <= frame <= high]
    if outside:
        raise Palette4dError(
            f"frame {outside[0]} is outside the clip {sidecar.clip['name']!r}"
            + (f", as {len(outside) - 1} more are" if len(outside) > 1 else "")
            + f"; expected frames from {low} to {high}"
        )
    return frames


def _limits(sidecar: _core.Sidecar) -> tuple[int, int]:
    polytope = sidecar.polytope
    return math.ceil(polytope.first_frame), math.floor(polytope.last_frame)


def file_name(name: str, frame: int, padding: int, extension: str) -> str:
    """Return a file's name; the sign of a negative frame counts as a digit, as in C's printf.

    >>> file_name("shot010", 1001, 4, ".cube"), file_name("a", 7, 0, ".clf")
    ('shot010.1001.cube', 'a.7.clf')
    """
    return f"{name}.{frame:0{padding}d}{extension}" if padding else f"{name}.{frame}{extension}"


def export(
    requests: Sequence[Request],
    workers: Workers | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[Series]:
    """Bake the frames of one or several series together.

    Parameters
    ----------
    requests : sequence of Request
        The series to bake; missing folders are created.
    workers : Workers, optional
        The processes or the farm that bake; they read the sidecars. By default a process for each
        processor.
    progress : callable, optional
        Called with (frames done, frames in all), the first time before any is baked.

    Returns
    -------
    list of Series
        One for each request, even if some frames failed.

    Raises
    ------
    Palette4dError
        Nothing was written: nothing can be baked, or other files exist and `force` is false.
        `WriteError`: for example, the disk is full; all written files are complete.
    KeyboardInterrupt
        Ctrl-C; all written files are complete, and the indexes list them.
    """
    exports = [_Export(request) for request in requests]
    for running in exports:
        make_folder(running.request.folder)
    total = sum(len(running.request.frames) for running in exports)

    def tell() -> None:
        if progress is not None:
            progress(sum(running.done for running in exports), total)

    def take(key: tuple[int, int], outcome: tuple[Entry, bytes] | Failed) -> None:
        exports[key[0]].take(key[1], outcome)
        tell()

    tell()
    tasks = {(i, f): task for i, running in enumerate(exports) for f, task in running.tasks.items()}
    try:
        try:
            (workers or Workers()).run(bake_frame, tasks, take, reads=_files(requests))
        finally:
            for running in exports:
                running.finish()
    except WriteError as error:
        raise WriteError(
            f"{error}; the files that are there are whole, and the same command goes on from them"
        ) from error
    return [running.series() for running in exports]


def _files(requests: Sequence[Request]) -> list[Path]:
    """Return what the processes that bake must read."""
    files: list[Path] = []
    for request in requests:
        own = request.sidecar
        file = own.path if isinstance(own, SidecarBytes) else own
        files += files_of_sidecar(file, request.clip)
        files += files_of_config(request.settings.ocio_config or os.environ.get("OCIO") or "")
    return list(dict.fromkeys(files))


class _Export:
    """A series in progress: the frames to bake, and the frames that are done."""

    def __init__(self, request: Request) -> None:
        """Check the request before the first frame is baked."""
        self.request, settings = request, request.settings
        read = SidecarBytes.of(request.sidecar)
        self.file, sidecar = read.path, read.parsed()
        assert settings.format is not None
        format_ = format_named(settings.format)
        frames = check_frames(sidecar, request.frames)
        for frame in frames[:1]:
            check_settings(settings, format_, sidecar, frame)
        name = checked_name(request.name) if request.name else file_safe(sidecar.clip["name"])
        self.index = request.folder / f"{name}.series.json"
        self.header = header_of(sidecar, self.file.name, read.data, settings, request.clip)
        known = read_index(self.index, self.header, request.force)
        names = {f: file_name(name, f, request.padding, format_.extension) for f in frames}
        self.kept = [
            f
            for f in frames
            if _matches(request.folder / names[f], known.get(f))
            and not self.is_own_link(request.folder / names[f])
        ]
        todo = [f for f in frames if f not in set(self.kept)]
        for frame in todo:
            target = request.folder / names[frame]
            if target.exists() and not self.is_own_link(target):
                # A file without an entry may match: a killed export may have left it.
                check_target(target, request.force or frame not in known, self.file)
        # Absolute: other processes may have another working folder. All bake the grade of now.
        clip = None if request.clip is None else str(Path.cwd() / request.clip)
        settings = replace(settings, ocio_config=from_anywhere(settings.ocio_config))
        read = replace(read, path=self.file.absolute())
        self.tasks = {f: FrameTask(read, f, names[f], settings, clip) for f in todo}
        self.entries = {f: entry for f, entry in known.items() if f not in self.tasks}
        self.baked: list[int] = []
        self.failed: dict[int, str] = {}
        self.written = time.monotonic()

    @property
    def done(self) -> int:
        """The number of frames that are done or failed."""
        return len(self.kept) + len(self.baked) + len(self.failed)

    def is_own_link(self, target: Path) -> bool:
        """Whether a file's place has a link that is to be replaced."""
        return self.request.replaces_links and target.is_symlink()

    def take(self, frame: int, outcome: tuple[Entry, bytes] | Failed) -> None:
        """Write a baked file, or record its failure."""
        if isinstance(outcome, Failed):
            self.failed[frame] = outcome.text
            return
        entry, data = outcome
        try:
            target = self.request.folder / self.tasks[frame].file
            if self.is_own_link(target):
                _put_for_link(target, data)
            else:
                _put(target, data, self.file, self.request.force)
        except WriteError:
            raise  # all other files would fail, too
        except Palette4dError as error:
            self.failed[frame] = str(error)
            return
        self.entries[frame] = entry
        self.baked.append(frame)
        if time.monotonic() - self.written > INDEX_EVERY:
            write_index(self.index, self.header, self.entries)
            self.written = time.monotonic()

    def finish(self) -> None:
        """Write the index."""
        if self.entries and (self.baked or not self.index.exists()):
            write_index(self.index, self.header, self.entries)

    def series(self) -> Series:
        """Return the exported series."""
        document = document_of(self.header, self.entries)
        failed = dict(sorted(self.failed.items()))
        return Series(self.index, document, sorted(self.baked), self.kept, failed)


def bake_frame(task: FrameTask, threads: int) -> tuple[Entry, bytes]:
    """Bake one file of a series in a temporary folder; return its entry and its content."""
    with temporary_folder(Path(tempfile.gettempdir())) as scratch:
        path = scratch / task.file
        settings = asdict(task.settings)
        result = bake(task.sidecar, task.frame, path, clip=task.clip, threads=threads, **settings)
        return entry_of(path, result), path.read_bytes()


def _put(target: Path, data: bytes, sidecar: Path, force: bool) -> None:
    """Write a file atomically; one with the same bytes is kept."""
    if target.is_file() and target.read_bytes() == data:
        return
    check_target(target, force, sidecar)
    with replacing(target, force=force) as temporary:
        temporary.write_bytes(data)


def _put_for_link(link: Path, data: bytes) -> None:
    """Replace a link atomically by a file."""
    try:
        with temporary_folder(link.parent) as folder:
            with replacing(folder / link.name) as temporary:
                temporary.write_bytes(data)
            (folder / link.name).replace(link)
    except OSError as error:
        raise unwritten(link, error) from error


def _matches(path: Path, entry: Entry | None) -> bool:
    if entry is None or entry.get("file") != path.name or not path.is_file():
        return False
    return hashlib.sha256(path.read_bytes()).hexdigest() == str(entry["sha256"])


def failures_text(failed: dict[int, str]) -> str:
    """Return the failures: one line per message, with its frames."""
    by_text: dict[str, list[int]] = {}
    for frame, text in failed.items():
        by_text.setdefault(text, []).append(frame)
    lines = []
    for text, frames in by_text.items():
        some = ", ".join(frame_text(frame) for frame in frames[:8])
        more = f" and {len(frames) - 8} more" if len(frames) > 8 else ""
        lines.append(f"  frame{'s' if len(frames) > 1 else ''} {some}{more}: {text}")
    return "\n".join(lines)
