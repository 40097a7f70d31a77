"""A dated series: the edit at many frames, a file each, and an index of them.

The index (``NAME.series.json``, docs/exports.md) says from which state of the sidecar and with
which options each file was made and what its hash is. So a series can be interrupted and resumed:
what is there and matches is left alone, and nothing that does not match is replaced unasked.
"""

import contextlib
import functools
import hashlib
import itertools
import json
import math
import multiprocessing
import os
import re
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from palette4d import _core
from palette4d.errors import Palette4dError
from palette4d.lut_export.bake import BakeOptions, BakeResult, bake, check_options, check_target
from palette4d.lut_export.formats import format_named
from palette4d.lut_export.frame_edit import frame_text
from palette4d.replacing import replacing
from palette4d.source_clip import frame_colours
from palette4d.wording import counted

SCHEMA, VERSION = "palette4d.series", 1

#: Seconds between two writings of the index while frames are baked.
INDEX_EVERY = 2.0

Entry = dict[str, Any]

#: What differs when these parts of an index do.
_CHANGED = {
    "schema": "another program",
    "version": "another version of the index",
    "generator": "another version of palette4d",
    "options": "other options",
}


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
    jobs : int
        Processes; 0: one a processor.
    force : bool
        Replace files that differ.
    """

    frames: tuple[int, ...]
    bake: BakeOptions
    name: str | None = None
    padding: int = 4
    clip: str | None = None
    jobs: int = 0
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
    folder: Path
    file: str
    options: BakeOptions
    clip: str | None
    force: bool


def file_safe(name: str) -> str:
    """Return a name fit for files, looks and OpenColorIO's variables: letters, digits, . _ -.

    >>> file_safe("shot 010/a+b"), file_safe("-x")
    ('shot_010_a_b', 'x')
    """
    return re.sub(r"[^A-Za-z0-9._-]+", "_", name).strip("-.") or "clip"


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
    sidecar_path: Path,
    folder: Path,
    options: SeriesOptions,
    progress: Callable[[int, int], None] | None = None,
) -> Series:
    """Bake frames into a folder.

    Parameters
    ----------
    sidecar_path : Path
        The sidecar.
    folder : Path
        Where the files go; made when it is missing.
    options : SeriesOptions
        What to bake.
    progress : callable, optional
        Called with (frames done, frames in all), the first time before any is baked.

    Returns
    -------
    Series
        Also when frames failed: what could be baked was.

    Raises
    ------
    Palette4dError
        Nothing can be baked, or files that differ are there and `force` is false; then nothing was
        written.
    KeyboardInterrupt
        Ctrl-C; the files that are there are whole, and the index lists them.
    """
    sidecar = _core.read_sidecar(str(sidecar_path))
    assert options.bake.format is not None
    format_ = format_named(options.bake.format)
    frames = check_frames(sidecar, options.frames)
    for frame in frames[:1]:
        check_options(replace(options.bake, frame=float(frame)), format_, sidecar)
    name = _checked_name(options.name) if options.name else file_safe(sidecar.clip["name"])
    index_path = folder / f"{name}.series.json"
    header = _header(sidecar, sidecar_path, options.bake)
    known = _read_index(index_path, header, options.force)

    names = {f: file_name(name, f, options.padding, format_.extension) for f in frames}
    kept = [f for f in frames if _matches(folder / names[f], known.get(f))]
    todo = [f for f in frames if f not in set(kept)]
    _refuse_changed(folder, names, todo, known, options.force)
    make_folder(folder)
    jobs = min(options.jobs or os.cpu_count() or 1, max(1, len(todo)))
    threads = max(1, (os.cpu_count() or 1) // jobs)
    tasks = {
        f: FrameTask(
            sidecar=sidecar_path,
            folder=folder,
            file=names[f],
            options=replace(options.bake, frame=float(f), threads=threads),
            clip=options.clip,
            force=options.force,
        )
        for f in todo
    }
    entries = {f: entry for f, entry in known.items() if f not in tasks}
    baked: list[int] = []
    failed: dict[int, str] = {}
    report = progress or (lambda done, total: None)
    report(len(kept), len(frames))
    written = time.monotonic()

    def take(frame: int, outcome: Entry | str) -> None:
        nonlocal written
        if isinstance(outcome, str):
            failed[frame] = outcome
        else:
            entries[frame] = outcome
            baked.append(frame)
        report(len(kept) + len(baked) + len(failed), len(frames))
        if entries and time.monotonic() - written > INDEX_EVERY:
            _write_index(index_path, header, entries)
            written = time.monotonic()

    try:
        _run(tasks, jobs, take)
    finally:
        if entries and (baked or not index_path.exists()):
            _write_index(index_path, header, entries)
    return Series(
        index=index_path,
        document=_document(header, entries),
        baked=sorted(baked),
        kept=kept,
        failed=dict(sorted(failed.items())),
    )


def bake_frame(task: FrameTask) -> Entry:
    """Bake one file of a series and return its entry of the index.

    A file that is there already is left alone when it has the same bytes.

    Raises
    ------
    Palette4dError
        It cannot be baked, or what is there differs and may not be replaced.
    """
    sidecar = _core.read_sidecar(str(task.sidecar))
    frame = task.options.frame
    image, number = frame_colours(task.sidecar, sidecar.clip, frame, task.clip)
    target = task.folder / task.file
    if not target.exists() or task.force:
        result = bake(
            task.sidecar, target, task.options, image=image, image_frame=number, force=task.force
        )
        return _entry(target, result)
    with tempfile.TemporaryDirectory(prefix="palette4d-") as scratch:
        again = Path(scratch) / task.file
        result = bake(task.sidecar, again, task.options, image=image, image_frame=number)
        if again.read_bytes() != target.read_bytes():
            raise Palette4dError(
                f"{target}: another file is there already; use --force to replace it"
            )
    return _entry(target, result)


def _run(tasks: dict[int, FrameTask], jobs: int, take: Callable[[int, Entry | str], None]) -> None:
    """Call `take` with each frame's entry, or what kept it from being written, as they are done."""
    if jobs == 1:
        for frame, task in tasks.items():
            take(frame, _outcome(functools.partial(bake_frame, task)))
        return
    # Spawned, not forked: the libraries here have threads of their own.
    pool = ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn"))
    left = iter(tasks.items())
    running: dict[Future[Entry], int] = {}
    try:
        while True:
            # No more than are worked on, so that Ctrl-C waits for those alone. It goes to all
            # processes: the workers, who inherit this, finish the file they are at.
            with _without_interrupts():
                for frame, task in itertools.islice(left, jobs - len(running)):
                    running[pool.submit(bake_frame, task)] = frame
            if not running:
                break
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in sorted(done, key=lambda f: running[f]):
                take(running.pop(future), _outcome(future.result))
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        # After Ctrl-C: what was finished meanwhile.
        for future, frame in running.items():
            if not future.cancelled():
                take(frame, _outcome(future.result))


def _outcome(call: Callable[[], Entry]) -> Entry | str:
    try:
        return call()
    except (Palette4dError, OSError) as error:
        return str(error)
    except BrokenProcessPool:
        return (
            "its process was ended from outside (too little memory?); run the same command again, "
            "with fewer --jobs"
        )


@contextlib.contextmanager
def _without_interrupts() -> Iterator[None]:
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# ------------------------------------------------------------------------------------- the index


def _header(sidecar: _core.Sidecar, path: Path, options: BakeOptions) -> dict[str, Any]:
    clip = sidecar.clip
    settings = asdict(options)
    for own in ("frame", "threads"):
        del settings[own]
    settings["domain"] = None if options.domain is None else list(options.domain)
    return {
        "schema": SCHEMA,
        "version": VERSION,
        "generator": f"palette4d {_core.__version__}",
        "sidecar": {
            "file": path.name,
            "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        },
        "clip": {
            "name": clip["name"],
            "first": clip["first"],
            "last": clip["last"],
            "rate": list(clip["rate"]),
            "encoding": clip["encoding"],
        },
        "options": settings,
    }


def _entry(path: Path, result: BakeResult) -> Entry:
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
        "clip": clip,
        "grid": asdict(result.grid.worst),
    }


def _document(header: dict[str, Any], entries: dict[int, Entry]) -> dict[str, Any]:
    return {**header, "frames": [entries[frame] for frame in sorted(entries)]}


def _write_index(path: Path, header: dict[str, Any], entries: dict[int, Entry]) -> None:
    lines = [json.dumps(entry) for entry in _document(header, entries)["frames"]]
    head = json.dumps(header, indent=2).removesuffix("\n}")
    text = head + ',\n  "frames": [\n    ' + ",\n    ".join(lines) + "\n  ]\n}\n"
    with replacing(path, force=True) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _read_index(path: Path, header: dict[str, Any], force: bool) -> dict[int, Entry]:
    """Return the entries of an earlier export with the same sidecar and options."""
    if not path.exists():
        return {}
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        entries = {int(entry["frame"]): entry for entry in document["frames"]}
        known = {key: document[key] for key in header}
        if not all(isinstance(entry["sha256"], str) for entry in entries.values()):
            raise TypeError
    except (ValueError, KeyError, TypeError) as error:
        if force:
            return {}
        raise Palette4dError(
            f"{path}: found no index of a series that can be read, expected the one that an "
            "earlier export wrote; use --force to replace it, or another folder"
        ) from error
    changed = [word for key, word in _CHANGED.items() if known[key] != header[key]]
    if known["sidecar"].get("sha256") != header["sidecar"]["sha256"]:
        changed.append("another state of the sidecar")
    if not changed:
        return entries
    if not force:
        raise Palette4dError(
            f"{path}: it lists a series of {counted(len(entries), 'file')} that was made with "
            f"{' and '.join(changed)}; use --force to replace it, or choose another folder"
        )
    return {}


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


def _checked_name(name: str) -> str:
    if file_safe(name) != name:
        raise Palette4dError(
            f"found the name {name!r}, expected letters, digits, '.', '_' and '-' only, as in "
            f"{file_safe(name)!r}"
        )
    return name


def make_folder(folder: Path) -> None:
    """Make a folder and those above it.

    Raises
    ------
    Palette4dError
        It cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise Palette4dError(
            f"{folder}: the folder cannot be made: {error.strerror}; choose another"
        ) from error


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
