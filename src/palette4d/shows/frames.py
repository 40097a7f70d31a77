"""The frames of a clip, rendered on this machine or on a farm.

On a farm each task is some frames in a row. Workers read the clip under the same path and return
files; only the command writes.
"""

from __future__ import annotations

import functools
import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from palette4d.common.errors import Arg, Palette4dError, UnfinishedError
from palette4d.common.files import make_folder, replacing
from palette4d.common.text import counted
from palette4d.grade import rendering, sidecar
from palette4d.grade.document import Document
from palette4d.grade.output import Output
from palette4d.grade.rendering import Missing, Painter, Rendered
from palette4d.jobs.workers import Failed, Workers
from palette4d.media.clip import Clip, open_clip
from palette4d.media.codecs import is_movie
from palette4d.media.frame_tags import frame_notes
from palette4d.media.frame_writer import FramePattern, sample_type
from palette4d.media.reading import like_source

#: Frames of a task: a worker decodes a movie from a key frame, and returns the files of a task
#: together.
FRAMES, OF_MOVIE = 1, 8


@dataclass(frozen=True)
class FramesTask:
    """Frames to render; can be sent to another machine.

    Attributes
    ----------
    sidecar : the sidecar's bytes.
    clip, asked : the clip's name, and the range of all frames that are rendered.
    frames : those of this task.
    drawn, compare, space, missing : as `Painter` has them.
    pattern, samples : of the files.
    by : what `rendering.made_by` returns.
    """

    sidecar: bytes
    clip: str
    asked: str | None
    frames: tuple[int, ...]
    drawn: Output
    compare: rendering.Compare | None
    space: Literal["input", "palette"]
    missing: Missing | Literal["leave out"]
    pattern: FramePattern
    samples: str
    by: str


@dataclass(frozen=True)
class Files:
    """The files of a task by their frames, and the frames that were bad, and filled."""

    content: dict[int, bytes]
    skipped: tuple[int, ...]
    filled: tuple[int, ...]


def render(
    document: str | os.PathLike[str] | Document,
    clip: str | os.PathLike[str] | Clip,
    output: str | os.PathLike[str],
    *,
    cluster: str | None = None,
    **arguments: Any,
) -> Rendered:
    """Recolour every frame of a clip and write it.

    Parameters
    ----------
    document, clip, output, **arguments
        As for `palette4d.grade.rendering.render`.
    cluster : str, optional
        The address of a Dask scheduler, whose workers read the clip under the same path. For
        frames, not for movies.

    Raises
    ------
    UnfinishedError
        Some frames could not be rendered on the farm; the others are there.
    Palette4dError
        The output cannot be written, or a frame cannot be read.
    """
    if cluster is None:
        return rendering.render(document, clip, output, **arguments)
    if isinstance(clip, Clip):
        raise Palette4dError(f"{Arg('cluster')} needs the clip's name, by which workers open it")
    if not isinstance(document, Document):
        document = Document.load(document)
    return _on_farm(document, os.fspath(clip), Path(output), cluster, **arguments)


def _on_farm(
    document: Document,
    spec: str,
    output: Path,
    cluster: str,
    *,
    frames: str | None = None,
    compare: rendering.Compare | None = None,
    space: Literal["input", "palette"] = "input",
    half: bool = False,
    bits: int | None = None,
    codec: str | None = None,
    crf: int | None = None,
    sound: bool = True,
    threads: int = 0,
    missing: Missing = "hold",
    skip_bad_frames: bool = False,
    skip_existing: bool = False,
    force: bool = False,
    progress: Callable[[int, int], object] | None = None,
    tell: Callable[[str, str], object] | None = None,
    **picture: Any,
) -> Rendered:
    if is_movie(output):
        raise Palette4dError(
            f"output {output}: a movie is encoded frame after frame, on one machine; expected "
            f"OUT.####.exr, .png or .tif with {Arg('cluster')}, or leave {Arg('cluster')} out"
        )
    rendering.refuse_codec(str(output), codec, crf)
    spec = like_source(spec, str(document.grade.core.clip["source"]))
    clip, fill = rendering.opened_for_render(spec, frames, missing, skip_bad_frames, movie=False)
    pattern = FramePattern.parse(str(output))
    samples = sample_type(pattern.extension, clip.depth, half=half, bits=bits)
    drawn = Output(**picture)
    one = rendering.pictures_of(clip) if pattern.width is None else ()
    by = rendering.made_by(document, clip, drawn, compare, space, samples, *one)
    size = clip.width * (2 if compare == "side" else 1), clip.height
    todo, repeated = rendering.frames_to_render(
        clip, pattern, size, by, fill, skip_existing=skip_existing, force=force
    )
    make_folder(pattern.folder)
    warnings = rendering.mismatches(document, clip, frames is None)
    _, left_out = rendering.with_surroundings(clip, pattern, drawn, compare)
    notes = [*clip.notes, *repeated, *frame_notes(clip, pattern.extension), *left_out]
    if tell is not None:
        for kind, texts in (("warning", warnings), ("note", notes)):
            for text in texts:
                tell(kind, text)
    data = sidecar.dumps(document.fields()).encode("utf-8")
    at_once = OF_MOVIE if clip.is_movie else FRAMES
    rows = [tuple(todo[i : i + at_once]) for i in range(0, len(todo), at_once)]
    place = str(Path.cwd() / spec)
    tasks = {
        row: FramesTask(data, place, frames, row, drawn, compare, space, fill, pattern, samples, by)
        for row in rows
    }
    done = Rendered([], [], [], [*warnings, *notes], sorted(set(clip.frames) - set(todo)))
    failed: dict[int, str] = {}

    def take(row: tuple[int, ...], answer: Files | Failed) -> None:
        if isinstance(answer, Failed):
            failed[row[0]] = answer.text
            return
        if {*answer.content, *answer.skipped} != set(row):
            failed[row[0]] = "a worker answered with other frames than it was asked for"
            return
        for frame, content in answer.content.items():
            path = pattern.path(frame)
            with replacing(path, force=True) as temporary:
                temporary.write_bytes(content)
            done.frames.append(frame)
            done.files.append(path)
        done.skipped.extend(answer.skipped)
        done.filled.extend(answer.filled)
        if progress is not None:
            progress(len(done.frames), len(todo))

    Workers(cluster=cluster).run(render_frames, tasks, take)
    for numbers in (done.frames, done.skipped, done.filled):
        numbers[:] = sorted(set(numbers))
    done.files.sort()
    if failed:
        lines = "\n".join(f"  from frame {frame}: {text}" for frame, text in sorted(failed.items()))
        raise UnfinishedError(
            f"{counted(len(todo) - len(done.frames), 'frame')} of {len(todo)} could not be "
            f"rendered; the others are there, and {Arg('skip_existing', True)} renders only "
            f"these:\n{lines}",
            done,
        )
    if todo and not done.frames:
        raise clip.none_readable()
    return done


def render_frames(task: FramesTask, threads: int) -> Files:
    """Render the frames of a task, on a worker."""
    document, clip = _document(task.sidecar), _clip(task.clip, task.asked, task.missing)
    clip, _ = rendering.with_surroundings(clip, task.pattern, task.drawn, task.compare)
    painter = Painter(document, clip, task.drawn, task.compare, task.space, threads, task.missing)
    content = {}
    with tempfile.TemporaryDirectory(prefix="palette4d-") as folder:
        pattern = FramePattern(Path(folder), "", task.pattern.suffix, 1)
        write = rendering.frame_files(clip, pattern, task.samples, task.by, painter.filled)
        for frame in task.frames:
            if (painted := painter.paint(frame)) is not None:
                path = write(*painted)
                content[frame] = path.read_bytes()
                path.unlink()
    bad = set(clip.skipped) & set(task.frames)
    return Files(content, tuple(sorted(bad)), tuple(painter.filled))


@functools.lru_cache(maxsize=1)
def _document(data: bytes) -> Document:
    return Document(sidecar.decoded(data, "<document>")[1])


@functools.lru_cache(maxsize=1)
def _clip(spec: str, frames: str | None, missing: str) -> Clip:
    return open_clip(spec, frames=frames, skip_bad_frames=missing != "error")
