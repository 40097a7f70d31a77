"""The options of `analyze` and `render` that say how a clip is read."""

from __future__ import annotations

import argparse


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Add --layer, --view and --matrix."""
    parser.add_argument(
        "--layer", metavar="NAME", help="of EXR: channels NAME.R, NAME.G, NAME.B, or a part's name"
    )
    parser.add_argument("--view", metavar="NAME", help="of EXR with several views: left, right")
    parser.add_argument(
        "--matrix",
        choices=("601", "709", "2020"),
        help="of Y'CbCr movies that state none (default: HD 709, SD 601)",
    )


def clip_name(args: argparse.Namespace) -> str:
    """Return the clip's name with what these options say."""
    from palette4d.media.reading import read_as

    return read_as(args.clip, layer=args.layer, view=args.view, matrix=args.matrix)
