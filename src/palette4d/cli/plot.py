"""The verb ``palette4d plot``: a picture of a palette and its edits."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from palette4d.cli.lut_options import wide_help
from palette4d.cli.terminal import tell
from palette4d.common.arguments import times, whole
from palette4d.plotting import EXTENSIONS

if TYPE_CHECKING:
    from palette4d.grade.document import Document

EPILOG = """\
Each row is a palette colour through time. At its left is the id of its track, which `info` lists
and `edit track` takes. At its right is how much of the picture it moves. Each disc is a palette
vertex. An edited disc or band shows the colour before in its upper half and the colour after in its
lower half. A smaller disc with two rings is a colour stop. Rows fork where a colour splits and join
where colours merge. A disc without room moves aside; a line leads to its time.
Below is the palette as a polyhedron in the RGB cube at some frames, with the ids of tracks; with
the clip also the frames, before and after the edits, and their pixels.

examples:
  palette4d plot seasons.p4d.json -o seasons.png
  palette4d plot seasons.p4d.json -o seasons.svg --frames 0,12,40 --clip seasons/#####.png
"""


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the verb ``plot``."""
    parser = subparsers.add_parser(
        "plot",
        help="draw the palette's timeline and polyhedra",
        description="Draw a palette and its edits: the timeline, and the polyhedra of some frames.",
        epilog=EPILOG,
        formatter_class=wide_help,
    )
    add = parser.add_argument
    add("sidecar", metavar="SIDECAR", type=Path, help="the sidecar (.p4d.json)")
    choice = f"the picture; its extension chooses: {', '.join(EXTENSIONS)}"
    add("-o", "--output", metavar="OUT", type=Path, required=True, help=choice)
    chosen = "the frames to show (default: up to six that stand for all others, and edited ones)"
    add("--frames", metavar="A,B,C", type=times, help=chosen)
    add(
        "--clip",
        metavar="CLIP",
        help="the clip (default: the sidecar's, beside the sidecar or in the working folder)",
    )
    either = parser.add_mutually_exclusive_group()
    either.add_argument(
        "--version",
        metavar="NAME",
        default="",
        help="the version whose edits are used (default: the active edits)",
    )
    either.add_argument(
        "--compare",
        metavar="A,B",
        help="compare two versions: A in the place of the clip's colours; A alone: with the active "
        "edits",
    )
    width = "width of a .png (default 2400)"
    add("--width", metavar="PIXELS", type=whole(400, 16000), default=2400, help=width)
    add("--force", action="store_true", help="replace an existing file")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Draw the picture, and print its path."""
    from palette4d.grade.document import Document
    from palette4d.plotting import plot

    document = Document.load(args.sidecar)
    before = None
    if args.compare is not None:
        before, args.version = _compared(document, args.compare)
    missing = plot(
        document,
        args.output,
        frames=args.frames,
        clip=args.clip,
        version=args.version,
        before=before,
        width=args.width,
        force=args.force,
    )
    if missing:
        which = ", ".join(f"{frame:g}" for frame in missing)
        tell(
            args,
            "note",
            f"the clip's pixels could not be read at frame {which}; only the palette is drawn "
            "there (name the clip with --clip)",
        )
    print(args.output)
    return 0


def _compared(document: "Document", names: str) -> tuple[str, str]:
    """Return the names of two versions; "" is the active edits."""
    first, _, second = names.partition(",")
    if names in document.grade.versions:  # a name with a comma
        return names, ""
    return first.strip(), second.strip()
