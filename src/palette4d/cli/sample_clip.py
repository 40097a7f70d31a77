"""The verb `sample-clip`: write the built-in procedural time-lapse (`palette4d.demo`)."""

from __future__ import annotations

import argparse
import re

from palette4d.common.arguments import whole
from palette4d.common.text import counted

FRAMES = 48
SIZE = (320, 180)
_LARGEST = 4096

DESCRIPTION = f"""\
Write the built-in sample clip: a lake in the hills, from a summer day to an autumn dusk. Its
colours appear, merge and split: trees of one green turn yellow and red, lights come on, and the
lake takes the colour of the sky. Drawn by the program itself, the same every time; {FRAMES} frames
of {SIZE[0]}x{SIZE[1]} pixels, as 16-bit PNG or TIFF, or EXR in 32-bit float (half with --half).
Frame numbers start at 1."""

EPILOG = """\
examples:
  palette4d sample-clip -o sample/sample.####.png
  palette4d sample-clip -o sample/sample.####.exr --half --frames 96 --size 640x360"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "sample-clip",
        help="write the built-in sample clip",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "-o", "--output", required=True, metavar="OUT.####.png", help="frames, .png, .exr or .tif"
    )
    parser.add_argument(
        "--frames",
        type=whole(1, 100_000),
        default=FRAMES,
        metavar="N",
        help=f"how many (default {FRAMES})",
    )
    parser.add_argument(
        "--size",
        type=parse_size,
        default=SIZE,
        metavar="WxH",
        help=f"pixels (default {SIZE[0]}x{SIZE[1]})",
    )
    parser.add_argument(
        "--first", type=whole(), default=1, metavar="N", help="first frame number (1)"
    )
    parser.add_argument("--half", action="store_true", help="EXR with 16-bit float")
    parser.add_argument("--force", action="store_true", help="replace frames that exist already")
    parser.add_argument("--quiet", action="store_true", help="no progress bar, no report")
    parser.set_defaults(run=run)


def parse_size(text: str) -> tuple[int, int]:
    """(width, height) of `WxH`, each 8 to 4096.

    >>> parse_size("320x180")
    (320, 180)
    """
    match = re.fullmatch(r"([0-9]{1,5})x([0-9]{1,5})", text.strip())
    size = (int(match[1]), int(match[2])) if match else (0, 0)
    if not all(8 <= edge <= _LARGEST for edge in size):
        raise argparse.ArgumentTypeError(
            f"found {text!r}, expected width x height, each 8 to {_LARGEST}, such as 320x180"
        )
    return size


def run(args: argparse.Namespace) -> int:
    """Write the clip; returns the exit status."""
    from palette4d.cli.progress import frames_bar
    from palette4d.demo.scene import sample_clip

    with frames_bar("sample clip", hidden=args.quiet, total=args.frames) as progress:
        written = sample_clip(
            args.output,
            frames=args.frames,
            size=args.size,
            first=args.first,
            half=args.half,
            force=args.force,
            progress=progress,
        )
    if not args.quiet:
        print(f"wrote {counted(len(written), 'frame')}, {written[0]} to {written[-1].name}")
    return 0
