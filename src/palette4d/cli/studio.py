"""The verb ``palette4d studio``: the window in which a palette is edited."""

import argparse
import re
import sys
from pathlib import Path

from palette4d.common.arguments import number

OLDEST_QT = (6, 5)
#: It loses a reference of None in every call without a result: older Pythons abort soon.
BROKEN_QT, OLDEST_PYTHON_FOR_IT = "6.12.0", (3, 12)

EPILOG = """\
Without a screen, --screenshot draws the whole window into a file.
docs/studio.md shows the window, and lists every gesture and key.

examples:
  palette4d studio shot010.p4d.json
  palette4d studio shot010.####.exr
  palette4d studio shot010.p4d.json --frame 30 --screenshot window.png
"""


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "studio",
        help="edit a palette in a window",
        description="Open a window with the picture, the palette through time and the RGB solid.\n"
        "It needs the package PySide6-Essentials.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    what = "a clip, a sidecar (.p4d.json) or a manifest of shots (default: an empty window)"
    add("path", metavar="PATH", nargs="?", help=what)
    add("--clip", metavar="CLIP", help="the sidecar's clip (default: where the sidecar says)")
    add("--frame", metavar="T", type=number(), help="go to this frame")
    add("--screenshot", metavar="OUT.png", type=Path, help="draw the window into a file, and end")
    add("--force", action="store_true", help="replace an existing screenshot")
    size = "the window's size in pixels (default: as it was left, 1600x1000 at first)"
    add("--size", metavar="WxH", type=_size, help=size)
    parser.set_defaults(run=run)


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{3,5})x(\d{3,5})", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"found {text!r}, expected WIDTHxHEIGHT such as 1600x1000")
    return int(match[1]), int(match[2])


def run(args: argparse.Namespace) -> int:
    """Open the window."""
    from palette4d.common.errors import Palette4dError

    try:
        import PySide6
    except ImportError as error:
        raise Palette4dError(
            "found no PySide6, expected it for the window; install it with "
            f"`{sys.executable} -m pip install PySide6-Essentials`"
        ) from error
    if tuple(map(int, PySide6.__version__.split(".")[:2])) < OLDEST_QT:
        raise Palette4dError(
            f"found PySide6 {PySide6.__version__}, expected 6.5 or later; update it with "
            f"`{sys.executable} -m pip install --upgrade PySide6-Essentials`"
        )
    if PySide6.__version__ == BROKEN_QT and sys.version_info < OLDEST_PYTHON_FOR_IT:
        raise Palette4dError(
            f"found PySide6 {BROKEN_QT}, which ends with a crash on this Python (3.11); expected "
            "another version; get one with "
            f"`{sys.executable} -m pip install 'PySide6-Essentials!={BROKEN_QT}'`"
        )
    from palette4d.studio import app

    return app.run(
        args.path,
        clip=args.clip,
        frame=args.frame,
        screenshot=args.screenshot,
        force=args.force,
        size=args.size,
    )
