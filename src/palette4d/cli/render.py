"""The verb `render`: recolour the frames of a clip with the node's own core."""

from __future__ import annotations

import argparse
import functools
import json
import re
from typing import TYPE_CHECKING, Any

from palette4d.cli.reading import add_reading, clip_name
from palette4d.cli.terminal import tell
from palette4d.common.arguments import checked, frame_range, number, whole
from palette4d.common.errors import UnfinishedError
from palette4d.common.text import counted
from palette4d.jobs.dask_farm import check_address

if TYPE_CHECKING:
    from palette4d.grade.rendering import Rendered

DESCRIPTION = """\
Recolour the frames of a clip with the edits of a sidecar, by the same code as the OpenFX node.
Colours that no edit touches keep their exact code values. --output writes mattes instead.

Frames keep their numbers: frame 1017 of the clip gets the palette at frame 1017 and is written as
frame 1017. Movies count from 0. EXR is 32-bit float (half with --half). PNG has 8 bits for an 8-bit
source and 16 for others. TIFF is like PNG, but 32-bit float for a float source. DPX has 10 bits,
JPEG 8.

OUT.mov is ProRes 422 HQ, OUT.mp4 H.264, or HEVC in 10 bits for PQ and HLG; --codec chooses others.
Movies keep the clip's rate, colour tags, fields, timecode, pixel aspect, reel and sound. A note
says what cannot be kept."""

EPILOG = """\
examples:
  palette4d render clip.p4d.json clip/ -o graded/clip.####.exr
  palette4d render clip.p4d.json clip/ -o graded.mov
  palette4d render clip.p4d.json clip/ -o review.mp4 --compare wipe
  palette4d render clip.p4d.json beach.%04d.dpx -o graded/beach.####.png --frames 1001-1100x2
  palette4d render clip.p4d.json clip/ -o still.png --frames 24 --strength 0.5
  palette4d render clip.p4d.json clip/ -o key/sky.####.exr --output weight:v5
  palette4d render clip.p4d.json clip/ -o key/shirt.####.exr --output pick:p1"""


# What `Document.recolour` draws.
DRAWN = (
    "show",
    "strength",
    "keep_lightness",
    "lightness_of",
    "mix",
    "matte_in",
    "outside_at",
    "clean_up",
)
# Of movies, by the names of `media.codecs`.
CODECS = ("prores422hq", "prores4444", "dnxhr-hqx", "dnxhr-444", "h264", "hevc")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "render",
        help="recolour frames or a movie with the edits of a sidecar",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sidecar", metavar="SIDECAR", help="file with the palette and its edits")
    parser.add_argument(
        "clip",
        metavar="CLIP",
        help="name.####.exr, name.%%04d.exr, a folder with one sequence, an image, or a movie",
    )
    parser.add_argument(
        "-o",
        dest="output",
        required=True,
        metavar="OUT",
        help="frames as OUT.####.exr, .png, .tif, .dpx or .jpg, one # a digit (a plain name for "
        "one frame), "
        "or a movie as OUT.mp4 or OUT.mov",
    )
    parser.add_argument(
        "--frames",
        metavar="RANGE",
        type=frame_range,
        help="frames to render: 10, 1-20, 1001-1100x2, 0,12,30 (default: all)",
    )
    parser.add_argument(
        "--compare",
        choices=("wipe", "side"),
        help="with the source: wipe has the source's left half, a line and the edit's right half, "
        "side puts the source to the left of the edit",
    )
    parser.add_argument(
        "--strength",
        type=number(0, 1),
        default=1.0,
        metavar="S",
        help="0 the original, 1 the edit (default 1)",
    )
    parser.add_argument(
        "--output",
        dest="show",
        type=_show,
        default="recoloured",
        metavar="WHAT",
        help="weight:ID, a soft key of a vertex or stop that follows its colour through time; "
        "pick:ID, the matte of a pick or hold; outside, a matte of the colours outside the "
        "palette; palette, the edit with the frame's palette below, old colours above new "
        "(default: the edit)",
    )
    parser.add_argument(
        "--matte-in",
        choices=("picture", "alpha"),
        default="picture",
        help="a matte as a grey picture, or multiplied into alpha (default picture)",
    )
    parser.add_argument(
        "--outside-at",
        type=number(0.0001, 100),
        default=0.05,
        metavar="D",
        help="distance from the palette at which the matte of --output outside is 1 (default 0.05)",
    )
    parser.add_argument(
        "--keep-lightness",
        type=number(0, 1),
        default=0.0,
        metavar="K",
        help="how much of the source's lightness the edit keeps: 0 none (default), 1 all, so that "
        "only hue and saturation change",
    )
    parser.add_argument(
        "--lightness-of",
        choices=("auto", "rec709", "rec2020", "p3", "ap1", "rec601"),
        default="auto",
        help="whose luminance weights define lightness (default auto: the clip's colour space, or "
        "Rec.709 if it is unknown)",
    )
    parser.add_argument(
        "--clean-up",
        type=number(0, 1),
        default=1.0,
        metavar="C",
        help="how much of the change by picks is filtered along the picture's edges, so that codec "
        "blocks, soft chroma and rims do not show: 0 none, 1 all (default 1)",
    )
    parser.add_argument(
        "--mix",
        type=number(0, 1),
        default=1.0,
        metavar="M",
        help="0 the source, 1 the output (default 1)",
    )
    parser.add_argument(
        "--space",
        choices=("input", "palette"),
        default="input",
        help="colour space of the clip's code values: the one that was analysed, or the "
        "palette's (default input)",
    )
    parser.add_argument(
        "--version",
        metavar="NAME",
        default="",
        help="the version whose edits are used (default: the active edits)",
    )
    add_reading(parser)
    parser.add_argument("--half", action="store_true", help="EXR with 16-bit float")
    parser.add_argument(
        "--bits",
        type=int,
        choices=(8, 10, 16, 32),
        help="bits a sample of PNG (8, 16), TIFF (8, 16, 32) or DPX (10, 16)",
    )
    parser.add_argument(
        "--codec",
        choices=CODECS,
        help="of a movie: prores422hq (default of .mov), prores4444 (keeps alpha), dnxhr-hqx, "
        "dnxhr-444, h264 (default of .mp4), hevc (10 bits; of .mp4 for PQ and HLG)",
    )
    parser.add_argument(
        "--crf", type=whole(0, 51), metavar="N", help="quality of h264 and hevc: 0 lossless, 14"
    )
    parser.add_argument("--no-sound", action="store_true", help="do not copy a movie's sound")
    parser.add_argument(
        "--threads", type=whole(0), default=0, metavar="N", help="0: one per processor (default)"
    )
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        type=checked(str, check_address),
        help="render the frames on a Dask farm: its scheduler's address (tls://farm:8786)",
    )
    parser.add_argument("--force", action="store_true", help="replace files that exist already")
    parser.add_argument(
        "--skip-existing",
        action="store_true",
        help="keep files that are whole and of this grade, which they name, and files by others",
    )
    parser.add_argument(
        "--missing",
        choices=("hold", "black", "error"),
        help="what a missing or unreadable frame shows: the frame before (default), black, or "
        "an error",
    )
    parser.add_argument(
        "--skip-bad-frames",
        action="store_true",
        help="write no file for such a frame; movies follow --missing",
    )
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")
    parser.add_argument("--quiet", action="store_true", help="no progress bar, no report")
    parser.set_defaults(run=run)


def _show(text: str) -> str:
    """Argparse type of --output; the sidecar decides whether it has the handle or pick."""
    if text in ("recoloured", "outside", "palette") or re.fullmatch("(weight|pick):.+", text):
        return text
    raise argparse.ArgumentTypeError(
        f"found {text!r}, expected weight:ID with the id of a vertex or stop, pick:ID with that of "
        "a pick or hold, outside or palette; -o names the files"
    )


def run(args: argparse.Namespace) -> int:
    """Render; returns the exit status."""
    from palette4d.cli.progress import frames_bar
    from palette4d.grade.document import Document
    from palette4d.media.clip_base import named
    from palette4d.media.codecs import is_movie
    from palette4d.shows.frames import render

    if args.force and args.skip_existing:
        args.parser.error("--skip-existing keeps files that exist, --force replaces them; use one")
    if args.skip_bad_frames and args.missing == "error":
        args.parser.error(
            "--skip-bad-frames passes over such frames, --missing error stops; use one"
        )
    failed: UnfinishedError | None = None
    with frames_bar("render", hidden=args.quiet or args.json) as progress:
        try:
            done: Any = render(
                Document.load(args.sidecar, version=args.version),
                clip_name(args),
                args.output,
                frames=args.frames,
                compare=args.compare,
                space=args.space,
                half=args.half,
                bits=args.bits,
                codec=args.codec,
                crf=args.crf,
                sound=not args.no_sound,
                threads=args.threads,
                missing=args.missing or "hold",
                skip_bad_frames=args.skip_bad_frames,
                skip_existing=args.skip_existing,
                cluster=args.cluster,
                force=args.force,
                progress=progress,
                tell=functools.partial(tell, args),
                **{name: vars(args)[name] for name in DRAWN},
            )
        except UnfinishedError as error:
            done, failed = error.done, error
    left_out = sorted(set(done.skipped) - set(done.filled))
    if done.filled:
        shows = "black" if args.missing == "black" else "the frame before"
        tell(args, "note", f"missing or unreadable {named(done.filled)}: {shows} is shown")
    if left_out:
        tell(args, "note", f"skipped bad {named(left_out)}")
    if args.json:
        print(json.dumps(_report(done), ensure_ascii=True))
    elif not args.quiet:
        if done.frames:
            first, last = done.files[0], done.files[-1].name
            to = "" if len(done.files) == 1 else f" to {last}"
            print(f"rendered {first}{to}, {counted(len(done.frames), 'frame')}")
        if done.kept:
            movie = is_movie(done.files[0]) if done.files else False
            print("movie kept" if movie else f"kept {counted(len(done.kept), 'existing frame')}")
    if failed:
        raise failed
    return 0


def _report(done: Rendered) -> dict[str, object]:
    """Return the output of --json."""
    return {
        "files": [str(path) for path in done.files],
        "frames": done.frames,
        "kept": done.kept,
        "skipped": sorted(set(done.skipped) - set(done.filled)),
        "filled": done.filled,
        "notes": done.notes,
    }
