"""The verb ``palette4d bake``."""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from palette4d.cli.lut_options import add_space_options, add_table_options, bake_options
from palette4d.common.arguments import number
from palette4d.common.errors import WriteError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from palette4d import _core
    from palette4d.lut_export.bake import BakeResult
    from palette4d.lut_export.error import Figures, Measure
    from palette4d.lut_export.formats import LutFormat

EPILOG = """\
The extension chooses the format, --format between two of one extension:
  .cube  resolve_cube (default), iridas_cube     .csp   cinespace
  .clf   clf, Academy/ASC Common LUT Format      .3dl   flame (default), lustre
  .ctf   ctf, Color Transform Format             .lut   houdini
  .spi3d spi3d                                   .itx   iridas_itx
  .cub   truelight                               .cc .ccc .cdl  an ASC CDL, fitted
Both dialects of .cube are the same table; Resolve's can have a shaper as well. A CDL is ten numbers
and only comes near to an edit; what is left over is its error.

The error of the file is printed and, where the format has comments or metadata, stored in it: mean
and largest |a-b|/max(|b|,0.1) per channel and deltaE 2000 between the file, read back and applied
by OpenColorIO, and the exact recolouring, on the clip's colours at that frame (when the clip is
given or found) and on a dense grid of 67 x 67 x 67 colours. Where a format does not say how to
interpolate, linear and tetrahedral are stated, and the worse of them counts. Colours outside the
domain are clamped.

examples:
  palette4d bake seasons.p4d.json --frame 40 -o autumn.cube --size 65
  palette4d bake seasons.p4d.json --frame 40 -o autumn.clf --clip seasons/ --max-error 0.005
  palette4d bake seasons.p4d.json --frame 40 -o - --format spi3d > autumn.spi3d
  palette4d bake seasons.p4d.json --frame 40 -o autumn.cc
  palette4d bake cg.p4d.json --frame 1010 -o look.clf --space ACES2065-1     an ACES look transform
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb ``bake``."""
    parser = subparsers.add_parser(
        "bake",
        help="write the edit at one time as a LUT file or a CDL",
        description="Bake the edit at one time into a 3D LUT, written through OpenColorIO, "
        "and state its error.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sidecar", metavar="SIDECAR", type=Path, help="the sidecar (.p4d.json)")
    parser.add_argument(
        "--frame",
        metavar="T",
        type=number(),
        required=True,
        help="the time, a frame number of the clip; fractions are allowed",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        required=True,
        help="the file, OUT.cube and so on; - for standard output, with --format",
    )
    add_table_options(parser, None)
    add_space_options(parser)
    parser.add_argument("--force", action="store_true", help="replace an existing file")
    parser.add_argument(
        "--json",
        action="store_true",
        help="print the result as JSON (on standard error with -o -)",
    )
    parser.set_defaults(run=run, usage_error=parser.error)


def run(args: argparse.Namespace) -> int:
    """Bake; print what was written and its error."""
    from palette4d import _core
    from palette4d.lut_export.bake import bake
    from palette4d.lut_export.bake_options import check_options, check_target
    from palette4d.lut_export.formats import format_named, format_of
    from palette4d.media.source_clip import frame_colours

    piped = args.output == "-"
    if piped and args.format is None:
        args.usage_error("-o - has no extension; expected --format FORMAT with it")

    # What can be refused is refused before any frame is read.
    format_ = format_named(args.format) if piped else format_of(Path(args.output), args.format)
    if not piped:
        check_target(Path(args.output), args.force)
    options = bake_options(args, format_.name, args.frame)
    sidecar = _core.read_sidecar(str(args.sidecar))
    check_options(options, format_, sidecar)

    image, number_ = frame_colours(args.sidecar, sidecar.clip, args.frame, args.clip)
    if image is None:
        _note_no_clip(sidecar)
    if piped:
        with tempfile.TemporaryDirectory(prefix="palette4d-") as folder:
            path = Path(folder) / f"baked{format_.extension}"
            result = bake(args.sidecar, path, options, image=image, image_frame=number_)
            _to_stdout(path.read_bytes(), format_)
        result = replace(result, output="-")
    else:
        result = bake(
            args.sidecar,
            Path(args.output),
            options,
            image=image,
            image_frame=number_,
            force=args.force,
        )
    out = sys.stderr if piped else sys.stdout
    if args.json:
        print(json.dumps(result.as_json(), indent=2), file=out)
    else:
        print("\n".join(report(result)), file=out)
    for line in warnings(result, format_):
        print(f"palette4d: warning: {line}", file=sys.stderr)
    return 0


def _note_no_clip(sidecar: _core.Sidecar) -> None:
    print(
        f"palette4d: note: the clip's frame could not be read from {sidecar.clip['source']!r}; "
        "the error is stated on the dense grid only (name the clip with --clip)",
        file=sys.stderr,
    )


def _to_stdout(data: bytes, format_: LutFormat) -> None:
    """Write everything or raise; past Python's buffer, which would fail again at exit."""
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
    """Yield the lines that say what was written and its error."""
    from palette4d.lut_export.error import table
    from palette4d.lut_export.frame_edit import frame_text

    name = "standard output" if result.output == "-" else result.output
    size = "" if result.size is None else f", {result.size} samples a side"
    yield f"{name}: {result.title}{size}, frame {frame_text(result.frame)}"
    if result.identity:
        yield "  nothing is edited at this time: it changes nothing"
    if result.cdl is not None:
        cdl = result.cdl
        for label, values in (
            ("slope", cdl.slope),
            ("offset", cdl.offset),
            ("power", cdl.power),
            ("saturation", (cdl.saturation,)),
        ):
            yield f"  {label:<10} {' '.join(f'{value:g}' for value in values)}"
    elif result.shaper.kind != "none":
        yield f"  shaper {result.shaper.text()}"
    if result.conversion is not None:
        yield f"  takes and returns {result.encoding}; {result.conversion}"
    rows: list[tuple[str, Figures]] = []
    for where, found in (
        (f"clip's colours at frame {result.clip_frame}", result.clip),
        ("dense grid", result.grid),
    ):
        if found is not None:
            rows += _rows(where, found)
    yield from (f"  {line}" for line in table(rows))
    yield f"  deltaE: {result.viewing}; numbers in the file: {result.rounding}"


def _rows(where: str, found: Measure) -> list[tuple[str, Figures]]:
    if len(found.by_reading) == 1:
        return [(where, found.worst)]
    return [(f"{where}, {name}", figures) for name, figures in found.by_reading.items()]


def warnings(result: BakeResult, format_: LutFormat) -> Iterator[str]:
    """Yield what a user should know beside the figures."""
    from palette4d.lut_export.bake import PREVIEW_TIER
    from palette4d.lut_export.error import stated
    from palette4d.lut_export.formats import shaper_warning, with_shaper
    from palette4d.lut_export.lattice import nearer

    shaper = result.shaper
    if shaper.kind != "none" and (about := shaper_warning(format_.name)):
        yield about
    (low, high), clip = result.palette, result.clip
    beyond = clip.outside_domain > 0 if clip else low < shaper.low or high > shaper.high
    if beyond and result.cdl is None:
        if shaper.kind != "none":
            help_ = "widen --domain"
        elif format_.shaper:
            help_ = "--shaper auto covers them"
        else:
            help_ = f"{with_shaper()} can hold a shaper that covers them"
        what = (
            f"{clip.outside_domain:.3%} of the frame's colours lie"
            if clip
            else f"the palette reaches from {low:g} to {high:g},"
        )
        yield f"{what} outside {shaper.low:g} to {shaper.high:g}, where the table clamps; {help_}"
    if not result.preview_tier:
        where = "the dense grid" if result.clip is None else "the clip's colours"
        yield (
            f"the largest error on {where}, {stated(result.error)}, misses the preview tier "
            f"{PREVIEW_TIER:g}; {nearer(result.size)}"
        )
