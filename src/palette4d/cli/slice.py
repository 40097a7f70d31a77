"""The verb `slice`: the palette at one frame, or at many."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any

from palette4d.cli.swatches import row
from palette4d.common.arguments import (
    frame_range_or_all,
    frames_between,
    number,
    parse_frames,
)
from palette4d.common.text import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from palette4d.grade.document import Document
    from palette4d.grade.palette import Palette

EPILOG = """\
example:
  palette4d slice clip.p4d.json --frame 23
  palette4d slice clip.p4d.json --frame 23.5 --json
  palette4d slice clip.p4d.json --frames all --json
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "slice",
        help="print the palette at one frame, or at many",
        description="Print the palette at one frame, or at many: each colour as analysed and as\n"
        "edited, where it lies, and the triangles between the colours. A frame outside\n"
        "the clip gives its first or last.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sidecar", metavar="SIDECAR", help="the sidecar file (*.p4d.json)")
    when = parser.add_mutually_exclusive_group(required=True)
    when.add_argument(
        "--frame", type=number(), metavar="T", help="the frame number; may lie between two frames"
    )
    when.add_argument(
        "--frames",
        metavar="RANGE",
        type=frame_range_or_all,
        help="many frames: all, 10, 1-20, 1001-1100x2, 1-9,15",
    )
    parser.add_argument("--json", action="store_true", help="print JSON (a list with --frames)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the palette at one or more frames."""
    from palette4d.grade.document import Document

    document = Document.load(args.sidecar)
    frames = [args.frame] if args.frames is None else _frames(args.frames, document)
    separator = "[" if args.frames is not None else ""
    for frame in frames:
        palette = document.grade.palette(frame)
        if args.frames is None and palette.frame != args.frame:
            print(
                f"palette4d: frame {args.frame:g} is outside of the clip; this is frame "
                f"{palette.frame:g}",
                file=sys.stderr,
            )
        if args.json:
            print(separator + json.dumps(_as_json(palette), allow_nan=False), end="")
            separator = ", "
        else:
            _print(palette)
    if args.json:
        print("]" if args.frames is not None else "")
    return 0


def _frames(text: str, document: Document) -> Sequence[int]:
    first, last, step = document.grade.frames
    if text == "all":
        return frames_between(first, last, step)
    frames = parse_frames(text)
    for end in (frames[0], frames[-1]):
        document.grade.check_frame(end)
    return frames


def _as_json(palette: Palette) -> dict[str, Any]:
    """Return the slice as JSON values. ``tracks``: the place of each colour; ``edge`` is None on
    a vertex, ``weight`` is the weight of ``to`` (eq. 6)."""
    return {
        "frame": palette.frame,
        "vertices": palette.rgb.tolist(),
        "edited": palette.edited.tolist(),
        "faces": palette.faces.tolist(),
        "tracks": [
            {"edge": None if id_ == a else id_, "from": a, "to": b, "weight": weight}
            for id_, (a, b), weight in zip(
                palette.ids, palette.ends, palette.weights.tolist(), strict=True
            )
        ],
    }


def _print(palette: Palette) -> None:
    print(
        f"frame {palette.frame:g}: {counted(len(palette.ids), 'colour')}, "
        f"{counted(len(palette.faces), 'face')}"
    )
    for i, (id_, (a, b)) in enumerate(zip(palette.ids, palette.ends, strict=True)):
        where = id_ if id_ == a else f"{id_} ({a} to {b} at {palette.weights[i]:.4g})"
        line = f"{i:4}  {row(palette.rgb[i])}  {where:32}"
        if (palette.edited[i] != palette.rgb[i]).any():
            line += f" now {row(palette.edited[i])}"
        print(line.rstrip())
    if len(palette.faces):
        print("      faces " + " ".join("-".join(map(str, face)) for face in palette.faces))
