"""A dated series: the edit at many frames, a file each, and an index of them.

The index says from which state of the sidecar and with which options each file was made and what
its hash is. So a series can be interrupted and resumed: what is there and matches is left alone,
and nothing that does not match is replaced unasked.

Frames are baked in other processes or on other machines; what they make comes back to this one,
which alone writes in the folder.
"""

import hashlib
import math
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palette4d.lut_export.bake import bake
from palette4d.lut_export.bake_options import BakeOptions, check_options, check_target
from palette4d.lut_export.formats import format_named
from palette4d.lut_export.frame_edit import frame_text
from palette4d.lut_export.series_index import (
    Entry,
    document_of,
    entry_of,
    header_of,
    read_index,
    write_index,
)

from palette4d import _core
from palette4d.colour.ocio_config import from_anywhere
from palette4d.common.errors import Palette4dError, WriteError
from palette4d.common.files import make_folder, replacing
from palette4d.common.text import checked_name, file_safe
from palette4d.jobs.workers import Failed, Workers
from palette4d.media.source_clip import frame_colours

#: Seconds between two writings of the index while frames are baked.
INDEX_EVERY = 2.0


@dataclass(frozen=True)
class SeriesOptions:
    """What to export.

    Attributes
    ----------
    frames : tuple of int
        Rising frame numbers.
    bake : BakeOptions
        For every frame; its own frame is not looked at. ``format`` must be set.
    name : str or None
        The files' common name; None: the clip's.
    padding : int
        Digits of the frame numbers in the names.
    clip : str or None
        The clip, for shapers and errors; None: where the sidecar says.
    workers : Workers
        Who bakes.
    force : bool
        Replace files that differ.
    """

    frames: tuple[int, ...]
    bake: BakeOptions
    name: str | None = None
    padding: int = 4
    clip: str | None = None
    workers: Workers = field(default_factory=Workers)
    force: bool = False


@dataclass(frozen=True)
class Series:
    """What was exported.

    Attributes
    ----------
    index : Path
        The index file.
    document : dict
        Its content.
    baked, kept : list of int
        Frames whose files were written, and those that were there already.
    failed : dict of int to str
        What kept the others from being written.
    """

    index: Path
    document: dict[str, Any]
    baked: list[int]
    kept: list[int]
    failed: dict[int, str]


@dataclass(frozen=True)
class FrameTask:
    """One file to bake; can be sent to another process or machine."""

    sidecar: Path
    file: str
    options: BakeOptions
    clip: str | None


@dataclass(frozen=True)
class Baked:
    """One file that was baked: its entry of the index and its content."""

    entry: Entry
    data: bytes


@dataclass(frozen=True)
class Request:
    """A series to export: from which sidecar, to which folder, how."""

    sidecar: Path
    folder: Path
    options: SeriesOptions


def every(sidecar: _core.Sidecar, step: int) -> tuple[int, ...]:
    """Return every `step`-th frame of the clip, from its first."""
    first, last = _limits(sidecar)
    return tuple(range(first, last + 1, step))


def stops(sidecar: _core.Sidecar) -> tuple[int, ...]:
    """Return the frames at which the edit turns.

    These are the times of the colour stops and of the edited palette colours, and those of the
    palette colours beside them, where an edit begins or has faded; each rounded to a frame.

    Raises
    ------
    Palette4dError
        Nothing is edited.
    """
    polytope, edits = sidecar.polytope, sidecar.edits
    index = {name: i for i, name in enumerate(polytope.vertex_ids)}
    edges = dict(zip(polytope.edge_ids, polytope.edges.tolist(), strict=True))
    edited = {index[name] for name in edits.vertex_rgb}
    around = set(edited)
    for first, last in edges.values():
        if first in edited or last in edited:
            around |= {first, last}
    times = []
    for stop in edits.stops:
        times.append(float(stop["frame"]))
        around |= set(edges[stop["edge"]])
    times += [float(polytope.vertices[i, 3]) for i in around]
    if not times:
        raise Palette4dError(
            "nothing is edited in this sidecar, so that there are no stops; edit it, or choose "
            "--every or --frames"
        )
    low, high = _limits(sidecar)
    return tuple(sorted({min(max(math.floor(t + 0.5), low), high) for t in times}))


def check_frames(sidecar: _core.Sidecar, frames: tuple[int, ...]) -> tuple[int, ...]:
    """Return `frames`, all within the clip.

    Raises
    ------
    Palette4dError
        Names the first that is not.
    """
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
    """Return a file's name; the sign of a negative number counts as a digit, as in C's printf.

    >>> file_name("shot010", 1001, 4, ".cube"), file_name("a", 7, 0, ".clf")
    ('shot010.1001.cube', 'a.7.clf')
    """
    return f"{name}.{frame:0{padding}d}{extension}" if padding else f"{name}.{frame}{extension}"


def export(
    sidecar: Path,
    folder: Path,
    options: SeriesOptions,
    progress: Callable[[int, int], None] | None = None,
) -> Series:
    """Bake frames into a folder; see `export_all`."""
    return export_all([Request(sidecar, folder, options)], options.workers, progress)[0]


def export_all(
    requests: Sequence[Request],
    workers: Workers,
    progress: Callable[[int, int], None] | None = None,
) -> list[Series]:
    """Bake the frames of several series together.

    Parameters
    ----------
    requests : sequence of Request
        What to bake; folders are made when they are missing. Their own `workers` are not looked at.
    workers : Workers
        Who bakes; a sidecar is read where they are.
    progress : callable, optional
        Called with (frames done, frames in all), the first time before any is baked.

    Returns
    -------
    list of Series
        One for each request, also when frames failed: what could be baked was.

    Raises
    ------
    Palette4dError
        Nothing can be baked, or files that differ are there and `force` is false; then nothing was
        written. `WriteError`: the disk is full, say; the files that are there are whole.
    KeyboardInterrupt
        Ctrl-C; the files that are there are whole, and the indexes list them.
    """
    exports = [_Export(request) for request in requests]
    for one in exports:
        make_folder(one.request.folder)
    tell = progress or (lambda done, total: None)
    total = sum(len(one.request.options.frames) for one in exports)

    def take(key: tuple[int, int], outcome: Baked | Failed) -> None:
        which, frame = key
        exports[which].take(frame, outcome)
        tell(sum(one.done for one in exports), total)

    tell(sum(one.done for one in exports), total)
    tasks = {(i, f): task for i, one in enumerate(exports) for f, task in one.tasks.items()}
    try:
        try:
            workers.run(bake_frame, tasks, take)
        finally:
            for one in exports:
                one.finish()
    except WriteError as error:
        raise WriteError(
            f"{error}; the files that are there are whole, and the same command goes on from them"
        ) from error
    return [one.series() for one in exports]


class _Export:
    """A series on its way: what is to do, and what came of it."""

    def __init__(self, request: Request) -> None:
        """Refuse what can be refused before the first frame is baked."""
        self.request, options = request, request.options
        sidecar = _core.read_sidecar(str(request.sidecar))
        assert options.bake.format is not None
        format_ = format_named(options.bake.format)
        frames = check_frames(sidecar, options.frames)
        for frame in frames[:1]:
            check_options(replace(options.bake, frame=float(frame)), format_, sidecar)
        name = checked_name(options.name) if options.name else file_safe(sidecar.clip["name"])
        self.index = request.folder / f"{name}.series.json"
        self.header = header_of(sidecar, request.sidecar, options.bake)
        known = read_index(self.index, self.header, options.force)
        names = {f: file_name(name, f, options.padding, format_.extension) for f in frames}
        self.kept = [f for f in frames if _matches(request.folder / names[f], known.get(f))]
        todo = [f for f in frames if f not in set(self.kept)]
        _refuse_changed(request.folder, names, todo, known, options.force)
        # Absolute: other processes may run elsewhere.
        clip = None if options.clip is None else str(Path.cwd() / options.clip)
        baked = replace(options.bake, ocio_config=from_anywhere(options.bake.ocio_config))
        self.tasks = {
            f: FrameTask(
                sidecar=request.sidecar.absolute(),
                file=names[f],
                options=replace(baked, frame=float(f)),
                clip=clip,
            )
            for f in todo
        }
        self.entries = {f: entry for f, entry in known.items() if f not in self.tasks}
        self.baked: list[int] = []
        self.failed: dict[int, str] = {}
        self.written = time.monotonic()

    @property
    def done(self) -> int:
        """How many frames are there, or failed."""
        return len(self.kept) + len(self.baked) + len(self.failed)

    def take(self, frame: int, outcome: Baked | Failed) -> None:
        """Write a file that was baked; note what failed."""
        if isinstance(outcome, Failed):
            self.failed[frame] = outcome.text
            return
        target = self.request.folder / self.tasks[frame].file
        try:
            _put(target, outcome.data, self.request.options.force)
        except WriteError:
            raise  # so would all others
        except Palette4dError as error:
            self.failed[frame] = str(error)
            return
        self.entries[frame] = outcome.entry
        self.baked.append(frame)
        if time.monotonic() - self.written > INDEX_EVERY:
            write_index(self.index, self.header, self.entries)
            self.written = time.monotonic()

    def finish(self) -> None:
        """Write the index."""
        if self.entries and (self.baked or not self.index.exists()):
            write_index(self.index, self.header, self.entries)

    def series(self) -> Series:
        """Return what was exported."""
        return Series(
            index=self.index,
            document=document_of(self.header, self.entries),
            baked=sorted(self.baked),
            kept=self.kept,
            failed=dict(sorted(self.failed.items())),
        )


def bake_frame(task: FrameTask, threads: int) -> Baked:
    """Bake one file of a series, aside.

    Raises
    ------
    Palette4dError
        It cannot be baked.
    """
    sidecar = _core.read_sidecar(str(task.sidecar))
    image, number = frame_colours(task.sidecar, sidecar.clip, task.options.frame, task.clip)
    with tempfile.TemporaryDirectory(prefix="palette4d-") as scratch:
        path = Path(scratch) / task.file
        options = replace(task.options, threads=threads)
        result = bake(task.sidecar, path, options, image=image, image_frame=number)
        return Baked(entry_of(path, result), path.read_bytes())


def _put(target: Path, data: bytes, force: bool) -> None:
    """Write a file, whole; one that is there already is left alone when it has the same bytes."""
    if target.is_file() and target.read_bytes() == data:
        return
    if target.exists() and not force:
        raise Palette4dError(f"{target}: another file is there already; use --force to replace it")
    check_target(target, force)
    with replacing(target, force=force) as temporary:
        temporary.write_bytes(data)


def _matches(path: Path, entry: Entry | None) -> bool:
    if entry is None or entry.get("file") != path.name or not path.is_file():
        return False
    return hashlib.sha256(path.read_bytes()).hexdigest() == str(entry["sha256"])


def _refuse_changed(
    folder: Path, names: dict[int, str], todo: list[int], known: dict[int, Entry], force: bool
) -> None:
    """Refuse before the first frame what can be known to fail."""
    for frame in todo:
        target = folder / names[frame]
        if target.exists():
            # Without an entry it may be the very file, left by an export that was killed.
            check_target(target, force or frame not in known)


def failures_text(failed: dict[int, str]) -> str:
    """Return what went wrong, a line each, most of them once when they are alike."""
    by_text: dict[str, list[int]] = {}
    for frame, text in failed.items():
        by_text.setdefault(text, []).append(frame)
    lines = []
    for text, frames in by_text.items():
        some = ", ".join(frame_text(frame) for frame in frames[:8])
        more = f" and {len(frames) - 8} more" if len(frames) > 8 else ""
        lines.append(f"  frame{'s' if len(frames) > 1 else ''} {some}{more}: {text}")
    return "\n".join(lines)
