"""The verb ``palette4d bake``."""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from palette4d.cli.lut_options import add_lut_options, lut_settings, wide_help
from palette4d.cli.terminal import tell
from palette4d.common.arguments import number
from palette4d.common.errors import Arg, WriteError
from palette4d.common.text import on_lines

if TYPE_CHECKING:
    from collections.abc import Iterator

    from palette4d.lut_export.bake import BakeResult
    from palette4d.lut_export.formats import LutFormat

EPILOG = """\
formats, by extension (--format chooses between two of one extension):
  .cube resolve_cube, iridas_cube   .clf clf    .ctf ctf       .csp cinespace   .spi3d spi3d
  .3dl flame, lustre                .lut houdini               .itx iridas_itx  .cub truelight
  .cc .ccc .cdl  the nearest ASC CDL: ten numbers, which miss most of an edit
The report states how far the file, read back by OpenColorIO, is from the exact edit: on the clip's
colours at that frame, and on a dense grid. A deltaE 2000 of 1 is just visible.

examples:
  palette4d bake seasons.p4d.json --frame 40 -o autumn.cube --size 65
  palette4d bake seasons.p4d.json --frame 40 -o autumn.clf --clip seasons/ --max-error 0.005
  palette4d bake seasons.p4d.json --frame 40 -o - --format spi3d > autumn.spi3d
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb ``bake``."""
    parser = subparsers.add_parser(
        "bake",
        help="write the edit at one time as a LUT file or a CDL",
        description="Bake the edit at one time into a 3D LUT, and state its error.",
        epilog=EPILOG,
        usage="%(prog)s SIDECAR --frame T -o OUT [options]",
        formatter_class=wide_help,
    )
    add = parser.add_argument
    add("sidecar", metavar="SIDECAR", type=Path, help="the sidecar (.p4d.json)")
    frame = "the time, a frame number of the clip; fractions are allowed"
    add("--frame", metavar="T", type=number(), required=True, help=frame)
    output = "the file; - for standard output, with --format"
    add("-o", "--output", metavar="OUT", required=True, help=output)
    add_lut_options(parser, None, space=True)
    add(
        "--version",
        metavar="NAME",
        help="the version whose edits are used (default: the active edits)",
    )
    add("--force", action="store_true", help="replace an existing file")
    add("--json", action="store_true", help="print the result as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Bake; print the written file and its error."""
    from palette4d.grade.document import Document
    from palette4d.grade.unread_steps import unread_note, unread_picks
    from palette4d.lut_export.bake import bake
    from palette4d.lut_export.formats import format_named, format_of

    source = Document.load(args.sidecar)
    waiting = unread_picks(source.grade, source.history)
    source = source.version(args.version or "")
    piped = args.output == "-"
    if piped and args.format is None:
        args.parser.error("-o - has no extension; expected --format FORMAT with it")
    format_ = format_named(args.format) if piped else format_of(Path(args.output), args.format)
    settings = {**lut_settings(args), "format": format_.name, "clip": args.clip}
    if piped:
        with tempfile.TemporaryDirectory(prefix="palette4d-") as folder:
            path = Path(folder) / f"baked{format_.extension}"
            result = bake(source, args.frame, path, **settings)
            _to_stdout(path.read_bytes(), format_)
        result = replace(result, output="-")
    else:
        result = bake(source, args.frame, args.output, force=args.force, **settings)
    out = sys.stderr if piped else sys.stdout
    if args.json:
        print(json.dumps(asdict(result), indent=2), file=out)
    else:
        print("\n".join(on_lines(list(report(result)))), file=out)
    if result.clip is None:
        tell(
            args,
            "note",
            "the clip's frame could not be read; the error is measured on the dense grid only "
            "(name the clip with --clip)",
        )
    for line in [*warnings(result, format_), *([unread_note(waiting)] if waiting else [])]:
        tell(args, "warning", line)
    return 0


def _to_stdout(data: bytes, format_: LutFormat) -> None:
    """Write everything or raise; bypass Python's buffer, which would fail again at exit."""
    rest = memoryview(data)
    try:
        sys.stdout.flush()
        while rest:
            rest = rest[os.write(sys.stdout.fileno(), rest) :]
    except BrokenPipeError:
        raise
    except OSError as error:
        raise WriteError(
            f"standard output: only {len(data) - len(rest)} of the {len(data)} bytes of the "
            f"{format_.name} file could be written: {error.strerror or error}; expected a place "
            f"with room, make some or choose another folder with -o FILE{format_.extension}"
        ) from error


def report(result: BakeResult) -> Iterator[str]:
    """Yield the report on the written file and its error."""
    from palette4d.lut_export.bake_error import table
    from palette4d.lut_export.frame_edit import frame_text

    name = "standard output" if result.output == "-" else result.output
    size = "" if result.size is None else f", {result.size} samples a side"
    yield f"{name}: {result.title}{size}, frame {frame_text(result.frame)}"
    if result.identity:
        yield "  nothing is edited at this time: the file changes nothing"
    if result.cdl is not None:
        parts = {**asdict(result.cdl), "saturation": (result.cdl.saturation,)}
        for label, values in parts.items():
            yield f"  {label:<10} {' '.join(f'{value:g}' for value in values)}"
    elif result.shaper.kind != "none":
        yield f"  shaper {result.shaper.text()}"
    if result.conversion is not None:
        yield f"  takes and returns {result.encoding}; {result.conversion}"
    rows = []
    measures = ((f"clip's colours at frame {result.clip_frame}", result.clip),)
    for where, error in (*measures, ("dense grid", result.grid)):
        if error is not None and len(error.by_reading) == 1:
            rows.append((where, error.worst))
        elif error is not None:
            rows += [(f"{where}, {name}", each) for name, each in error.by_reading.items()]
    yield from (f"  {line}" for line in table(rows))
    yield f"  deltaE: {result.viewing}; code values in the file: {result.rounding}"


def warnings(result: BakeResult, format_: LutFormat) -> Iterator[str]:
    """Yield the notes and warnings for the user."""
    from palette4d.colour.difference import VISIBLE
    from palette4d.lut_export.bake import nearer
    from palette4d.lut_export.bake_error import stated
    from palette4d.lut_export.formats import shaper_warning, with_shaper

    shaper, (low, high), clip = result.shaper, result.palette, result.clip
    if shaper.kind != "none" and (about := shaper_warning(format_.name)):
        yield about
    beyond = clip.outside_domain > 0 if clip else low < shaper.low or high > shaper.high
    if beyond and result.cdl is None:
        if shaper.kind != "none":
            help_ = f"widen it with {Arg('domain')}"
        elif format_.shaper:
            help_ = f"{Arg('shaper', 'linear')} covers them"
        else:
            help_ = f"{with_shaper()} can hold a shaper that covers them"
        what = f"the palette, from {low:g} to {high:g}, is partly"
        if clip:
            what = f"{clip.outside_domain:.3%} of the frame's colours are"
        domain = f"{shaper.low:g} to {shaper.high:g}"
        yield f"{what} outside {domain}, where the LUT clamps; {help_}"
    if result.cdl is not None and result.has_picks:
        yield (
            "a CDL moves all colours alike, so that it holds no mattes of picks; a 3D LUT (.clf, "
            ".cube) does"
        )
    if result.windows and result.cdl is None:
        yield result.windows
    if result.clean_up is not None and result.cdl is None and result.clean_up.most > VISIBLE:
        cleaned = result.clean_up
        lacks = "Clean up or windows" if result.windows else "Clean up"
        yield (
            f"no LUT has {lacks}: from the picture of the node and `palette4d render` the file is "
            f"off by a deltaE 2000 of {stated(cleaned.mean)} on average, 99 % of the pixels by at "
            f"most {stated(cleaned.most)}"
        )
    if clip and result.visible:
        yield (
            f"the error can be seen: {clip.visible:.2%} of the frame's pixels are off by a deltaE "
            f"2000 above 1, up to {stated(clip.worst.delta_e_largest)}; {nearer(result.size)}"
        )
