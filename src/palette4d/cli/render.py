"""The verb `render`: recolour the frames of a clip with the node's own core."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.arguments import frame_range, number, whole
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted

if TYPE_CHECKING:
    from palette4d.media.clip_base import Clip, Image
    from palette4d.media.frame_writer import FramePattern

F32 = NDArray[np.float32]

DESCRIPTION = """\
Recolour the frames of a clip with the edits of a sidecar, by the same code as the OpenFX node.
Frame numbers are kept: frame 1017 of the clip is recoloured with the palette at time 1017 and
written as frame 1017. Movies count from 0. Where nothing is edited a picture keeps its exact
values. Where the palette was found in another colour space than the clip's, pixels go there and
back; what is not edited keeps its exact values all the same.

EXR is written as 32-bit float (or half with --half), PNG with 8 bits for an 8-bit source and 16 for
others, TIFF likewise or as 32-bit float for a float source; --bits chooses."""

EPILOG = """\
examples:
  palette4d render clip.p4d.json clip/ -o graded/clip.####.exr
  palette4d render clip.p4d.json beach.%04d.dpx -o graded/beach.####.png --frames 1001-1100x2
  palette4d render clip.p4d.json clip/ -o still.png --frames 24 --strength 0.5"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "render",
        help="recolour frames with the edits of a sidecar",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sidecar", metavar="SIDECAR", help="file with the polytope and its edits")
    parser.add_argument(
        "clip",
        metavar="CLIP",
        help="name.####.exr, name.%%04d.exr, a folder with one sequence, an image, or a movie",
    )
    parser.add_argument(
        "-o",
        "--output",
        required=True,
        metavar="OUT.####.exr",
        help="frames to write, .exr, .png or .tif, one # a digit; a plain name for a single frame",
    )
    parser.add_argument(
        "--frames",
        metavar="RANGE",
        type=frame_range,
        help="frames to render: 10, 1-20, 1001-1100x2, 0,12,30 (default: all)",
    )
    parser.add_argument(
        "--strength",
        type=number(0, 1),
        default=1.0,
        metavar="S",
        help="0 the original, 1 the edit (1)",
    )
    parser.add_argument(
        "--space",
        choices=("input", "palette"),
        default="input",
        help="what the clip's numbers are: as those that were analysed, or the palette's own "
        "(default input)",
    )
    parser.add_argument("--half", action="store_true", help="EXR with 16-bit float")
    parser.add_argument(
        "--bits", type=int, choices=(8, 16, 32), help="bits a sample of PNG (8, 16) or TIFF"
    )
    parser.add_argument(
        "--threads", type=whole(0), default=0, metavar="N", help="0: one per processor (default)"
    )
    parser.add_argument("--force", action="store_true", help="replace frames that exist already")
    parser.add_argument(
        "--skip-bad-frames", action="store_true", help="leave out missing or unreadable frames"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(run=run)


@dataclass(frozen=True)
class RenderOptions:
    """How to recolour: strength is 0 (original) to 1 (edit), threads 0 means one per processor.

    in_palette_space: the pixels are in the palette's numbers already.
    """

    strength: float = 1.0
    threads: int = 0
    in_palette_space: bool = False


def recoloured(
    sidecar: _core.Sidecar, frame: float, pixels: F32, premultiplied: bool, options: RenderOptions
) -> F32:
    """(h, w, 3 or 4) float32 pixels recoloured with the palette at a frame, as the node does it.

    Times outside the sidecar's range take its first or last frame. Returns a new array.
    """
    palette = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, sidecar.edits, palette)
    recolourer = _core.Recolourer(palette.rgb, edited, palette.faces)
    return recolourer.apply(
        np.ascontiguousarray(pixels),
        strength=options.strength,
        premultiplied=premultiplied and pixels.shape[2] == 4,
        threads=options.threads,
        precision="single",
        conversion=None
        if sidecar.conversion is None or options.in_palette_space
        else sidecar.conversion.steps,
    )


def run(args: argparse.Namespace) -> int:
    """Render; returns the exit status."""
    from palette4d.media.clip import open_clip
    from palette4d.media.frame_writer import FramePattern, make_folder, sample_type

    sidecar = _core.read_sidecar(args.sidecar)
    pattern = FramePattern.parse(args.output)
    clip = open_clip(args.clip, frames=args.frames, skip_bad_frames=args.skip_bad_frames)
    samples = sample_type(pattern.extension, clip.depth, half=args.half, bits=args.bits)
    _check_outputs(clip, pattern, args)
    _warn(clip, sidecar)
    make_folder(pattern.folder)
    options = RenderOptions(args.strength, args.threads, args.space == "palette")
    written = render(sidecar, clip, pattern, samples, options, quiet=args.quiet)
    first, last = pattern.path(written[0]), pattern.path(written[-1])
    what = (
        f"{first}"
        if len(written) == 1
        else f"{counted(len(written), 'frame')}, {first} to {last.name}"
    )
    print(f"rendered {what}")
    if clip.skipped:
        print(f"palette4d: skipped bad {_named(clip.skipped)}", file=sys.stderr)
    return 0


def render(
    sidecar: _core.Sidecar,
    clip: Clip,
    pattern: FramePattern,
    samples: str,
    options: RenderOptions,
    *,
    quiet: bool = False,
) -> list[int]:
    """Recolour and write every frame of the clip; returns the numbers of the written frames.

    One frame is written while the next is read and recoloured: memory holds three at most.
    """
    from palette4d.cli.progress import frames_bar
    from palette4d.media.frame_writer import write_frame

    written: list[int] = []
    images: Iterator[Image] = clip.iter_images()
    pending: Future[None] | None = None
    with (
        ThreadPoolExecutor(1) as writer,
        frames_bar("render", hidden=quiet, total=len(clip.frames)) as bar,
    ):
        for image in images:
            pixels = recoloured(sidecar, image.frame, image.pixels, clip.premultiplied, options)
            if pending is not None:
                pending.result()
                bar.update()
            pending = writer.submit(
                write_frame,
                pattern.path(image.frame),
                pixels,
                samples,
                premultiplied=clip.premultiplied,
                metadata=_with_rate(image, clip),
            )
            written.append(image.frame)
        if pending is not None:
            pending.result()
            bar.update()
    return written


def _with_rate(image: Image, clip: Clip) -> tuple[tuple[str, object, object], ...]:
    """The frame's metadata, with the clip's rate where it states none (a movie's, say)."""
    import OpenImageIO as oiio

    if any(name == "FramesPerSecond" for name, _, _ in image.metadata) or not clip.is_movie:
        return image.metadata
    rate = (clip.rate.numerator, clip.rate.denominator)
    return (*image.metadata, ("FramesPerSecond", oiio.TypeDesc("rational"), rate))


def _check_outputs(clip: Clip, pattern: FramePattern, args: argparse.Namespace) -> None:
    """Refuse before the first frame: several frames in one file, its own input, existing files."""
    if pattern.width is None and len(clip.frames) > 1:
        raise Palette4dError(
            f"output {args.output}: {len(clip.frames)} frames would go into one file; expected a "
            "pattern such as OUT.####.exr, or one frame chosen with --frames"
        )
    targets = [pattern.path(frame) for frame in clip.frames]
    inputs = {_identity(path) for path in {clip.file(frame) for frame in clip.frames}}
    existing = [target for target in targets if os.path.lexists(target)]
    for target in existing:
        if _identity(target) in inputs:
            raise Palette4dError(
                f"output {target}: it is a frame of the clip itself; expected another place. "
                "Choose another folder or name."
            )
        if target.is_dir():
            raise Palette4dError(f"output {target}: it is a folder; choose another name")
    if existing and not args.force:
        raise Palette4dError(
            f"output {existing[0]}: it exists already"
            + (f", as {len(existing) - 1} more of {len(targets)} do" if len(existing) > 1 else "")
            + "; choose another place, or replace with --force"
        )


def _identity(path: Path) -> tuple[int, int] | str:
    """Device and inode of a file, links followed; its name where there is none."""
    try:
        status = path.stat()
    except OSError:
        return str(path.absolute())
    return status.st_dev, status.st_ino


def _warn(clip: Clip, sidecar: _core.Sidecar) -> None:
    first, last = sidecar.polytope.first_frame, sidecar.polytope.last_frame
    for note in clip.notes:
        print(f"palette4d: note: {note}", file=sys.stderr)
    outside = [frame for frame in clip.frames if not first <= frame <= last]
    if outside:
        take = "takes" if len(outside) == 1 else "take"
        print(
            f"palette4d: warning: the sidecar's palette spans frames {first:g} to {last:g}; "
            f"{_named(outside)} {take} the nearest end's palette",
            file=sys.stderr,
        )
    size = (sidecar.clip.get("width"), sidecar.clip.get("height"))
    if size != (clip.width, clip.height):
        print(
            f"palette4d: note: the sidecar was made from {size[0]}x{size[1]} pixels, this clip has "
            f"{clip.width}x{clip.height}",
            file=sys.stderr,
        )


def _named(frames: list[int]) -> str:
    from palette4d.media.clip_base import named

    return named(frames)
