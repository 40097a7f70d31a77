"""Rendering: a clip's frames, recoloured by the edits of a sidecar, as frame files or a movie."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Literal

import numpy as np

from palette4d.common.files import make_folder
from palette4d.grade.document import Document
from palette4d.grade.output import Output
from palette4d.media.clip_base import F32, Clip, Image, describe
from palette4d.media.frame_writer import (
    FramePattern,
    OutputError,
    check_targets,
    sample_type,
    write_frame,
)
from palette4d.media.movie_writer import is_movie, movie_writer


@dataclass(frozen=True)
class RenderOptions:
    """Options of recolouring and output.

    Attributes
    ----------
    output : Output
        What to draw.
    threads : int
        0: one per processor.
    space : {"input", "palette"}
        "palette": the clip's code values are already in the palette's colour space.
    compare : {"wipe", "side"} or None
        Show source and edit: "wipe" shows the left half of the source and the right half of the
        edit; "side" shows both whole, the source on the left.
    half, bits
        The sample type of frames (`sample_type`); not for movies.
    """

    output: Output = field(default_factory=Output)
    threads: int = 0
    space: Literal["input", "palette"] = "input"
    compare: Literal["wipe", "side"] | None = None
    half: bool = False
    bits: int | None = None


def compared(source: F32, edited: F32, how: Literal["wipe", "side"]) -> F32:
    """Return the source and the edit in one picture (`RenderOptions.compare`)."""
    if how == "side":
        return np.concatenate([source, edited], axis=1)
    middle = source.shape[1] // 2
    return np.concatenate([source[:, :middle], edited[:, middle:]], axis=1)


def with_alpha(pixels: F32) -> F32:
    """Return RGBA pixels; alpha is 1 where there was none."""
    if pixels.shape[2] == 4:
        return pixels
    return np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=2)


def mismatches(document: Document, clip: Clip, whole: bool) -> list[str]:
    """Return notes on differences between a clip and the sidecar's clip, and their effect.

    `whole`: the clip was opened with all its frames, not with a range.
    """
    sidecar = document.core
    found = []
    size = f"{sidecar.clip['width']}x{sidecar.clip['height']}"
    if size != f"{clip.width}x{clip.height}":
        found.append(
            f"the sidecar was made from {size} pixels, this clip has {clip.width}x{clip.height}; "
            "edits apply to colours, so the render goes on. Check that this is the clip you mean"
        )
    first, last = sidecar.polytope.first_frame, sidecar.polytope.last_frame
    spans = f"the sidecar spans frames {first:g} to {last:g}"
    outside = [frame for frame in clip.frames if not first <= frame <= last]
    if outside:
        found.append(
            f"{spans}, the frames to render are {describe(clip.frames)}; {describe(outside)} "
            f"{'takes' if len(outside) == 1 else 'take'} the palette of the nearest end"
        )
    elif whole and len(clip.frames) > 1 and (first, last) != (clip.frames[0], clip.frames[-1]):
        found.append(
            f"{spans}, this clip has {describe(clip.frames)}; each frame takes the palette of its "
            "own number. Check that this is the clip you mean"
        )
    return found


def movie_notes(clip: Clip, options: RenderOptions) -> list[str]:
    """Return notes on the limits of a movie of this clip: size, alpha, encoding."""
    found = []
    width = clip.width * (2 if options.compare == "side" else 1)
    if width % 2 or clip.height % 2:
        found.append(
            f"the picture is {width}x{clip.height} pixels; where the movie's encoder needs an "
            "even size, the last column or row is repeated"
        )
    if clip.has_alpha or options.output.in_alpha:
        found.append("the movie has no alpha, the picture is laid over black; frames keep it")
    if "linear" in clip.encoding:
        found.append(
            f"the clip's code values are {clip.encoding} and stay so: the movie looks dark in most "
            "players. Render frames, and convert those to a display space"
        )
    return found


def render(
    document: Document,
    clip: Clip,
    output: str,
    options: RenderOptions,
    *,
    force: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Recolour every frame of a clip and write it; memory holds at most three frames.

    Parameters
    ----------
    document : Document
        The palette and its edits.
    clip : Clip
        The frames; bad frames, which `Clip.skipped` lists afterwards, are left out.
    output : str
        `OUT.####.exr` (`.png`, `.tif`) for frames, which keep their numbers, or `OUT.mp4`,
        `OUT.mov` for a movie at the clip's rate.
    options : RenderOptions
        The options of recolouring and output.
    force : bool
        Replace files that exist. A clip's own files are never replaced.
    progress : callable, optional
        Called with (frames written, frames in all).

    Returns
    -------
    list of Path
        The written files. After Ctrl-C or an error, written frames are complete, and there is no
        movie.

    Raises
    ------
    Palette4dError
        The output cannot be written, or a frame cannot be read.
    """
    movie = is_movie(Path(output))
    inputs = {clip.file(frame) for frame in clip.frames}
    if movie:
        if options.half or options.bits is not None:
            raise OutputError(f"output {output}: --half and --bits are for frames, not for movies")
        check_targets([Path(output)], inputs, force)
        make_folder(Path(output).parent)
        opened = _movie(clip, document, Path(output), options)
    else:
        pattern = FramePattern.parse(output)
        samples = sample_type(pattern.extension, clip.depth, half=options.half, bits=options.bits)
        check_targets(pattern.paths(clip.frames), inputs, force)
        make_folder(pattern.folder)
        opened = _frames(clip, pattern, samples)
    written: list[Path] = []
    pending: Future[Path] | None = None

    def finish() -> None:
        if pending is not None:
            written.append(pending.result())
            if progress is not None:
                progress(len(written), len(clip.frames))

    # One frame is written while the next is read and recoloured.
    with opened as write, ThreadPoolExecutor(1) as writer:
        for image in clip.iter_images():
            source = with_alpha(image.pixels) if options.output.in_alpha else image.pixels
            pixels = document.recolour(
                source,
                image.frame,
                **asdict(options.output),
                premultiplied=clip.premultiplied,
                space=options.space,
                threads=options.threads,
            )
            if options.compare is not None:
                pixels = compared(source, pixels, options.compare)
            finish()
            pending = writer.submit(write, image, pixels)
        finish()
    return written[:1] if movie else written


_Write = Callable[[Image, F32], Path]


@contextlib.contextmanager
def _frames(clip: Clip, pattern: FramePattern, samples: str) -> Generator[_Write]:
    """Yield a function that writes a frame to its file, with the source frame's metadata."""
    import OpenImageIO as oiio

    def write(image: Image, pixels: F32) -> Path:
        metadata = image.metadata
        if clip.is_movie:
            rate = (clip.rate.numerator, clip.rate.denominator)
            metadata = (*metadata, ("FramesPerSecond", oiio.TypeDesc("rational"), rate))
        path = pattern.path(image.frame)
        premultiplied = clip.premultiplied
        write_frame(path, pixels, samples, premultiplied=premultiplied, metadata=metadata)
        return path

    yield write


@contextlib.contextmanager
def _movie(clip: Clip, document: Document, path: Path, options: RenderOptions) -> Generator[_Write]:
    """Yield a function that appends a frame to a movie."""
    # Image files rarely state a rate, so the sidecar's rate is used.
    rate = clip.rate if clip.is_movie else Fraction(*document.core.clip["rate"])
    width = clip.width * (2 if options.compare == "side" else 1)
    with movie_writer(path, (width, clip.height), rate, clip.encoding) as append:

        def write(image: Image, pixels: F32) -> Path:
            append(pixels, clip.premultiplied)
            return path

        yield write
