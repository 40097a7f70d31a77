"""The verb ``palette4d bake``."""

import argparse
import json
import sys
from pathlib import Path

from palette4d.arguments import number, whole

EPILOG = """\
The extension chooses the format: .cube (Resolve) or .clf (Academy/ASC Common LUT Format).

The error of the file is printed and stored in it: mean and largest |a-b| per channel between the
file, read back and applied by OpenColorIO, and the exact recolouring; on the clip's colours at that
frame (when the clip is given or found) and on the midpoints of the lattice's cells. A .cube does
not say how to interpolate, so its error is the worse of linear and tetrahedral; its numbers have
six decimals. Colours outside 0..1 are clamped by such a table.

example:
  palette4d bake seasons.p4d.json --frame 40 -o autumn.cube --size 65
  palette4d bake seasons.p4d.json --frame 40 -o autumn.clf --clip seasons/#####.png --json
"""


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the verb ``bake``."""
    parser = subparsers.add_parser(
        "bake",
        help="write the edit at one time as a LUT file",
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
        "-o", "--output", metavar="OUT", type=Path, required=True, help="OUT.cube or OUT.clf"
    )
    parser.add_argument(
        "--size",
        metavar="N",
        type=whole(2, 129),
        default=33,
        help="samples a side, 2 to 129 (default 33)",
    )
    parser.add_argument(
        "--strength",
        metavar="S",
        type=number(0, 1),
        default=1.0,
        help="0 to 1, as in the node (default 1)",
    )
    parser.add_argument(
        "--clip",
        metavar="CLIP",
        help="the clip, to state the error on its colours (default: where the sidecar says)",
    )
    parser.add_argument("--force", action="store_true", help="replace an existing file")
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Bake; print what was written and its error."""
    from palette4d import _core
    from palette4d.lut_export.bake import BakeOptions, bake, check_options, frame_text, stated
    from palette4d.lut_export.formats import format_of
    from palette4d.replacing import refuse_existing
    from palette4d.source_clip import frame_colours

    # What can be refused is refused before any frame is read.
    format_of(args.output)
    refuse_existing(args.output, args.force)
    options = BakeOptions(frame=args.frame, size=args.size, strength=args.strength)
    sidecar = _core.read_sidecar(str(args.sidecar))
    check_options(options, sidecar.polytope, sidecar.clip["name"])

    image, number = frame_colours(args.sidecar, sidecar.clip, args.frame, args.clip)
    if image is None:
        print(
            f"palette4d: note: the clip's frame could not be read from {sidecar.clip['source']!r}; "
            "the error is stated on the lattice's midpoints only (name the clip with --clip)",
            file=sys.stderr,
        )
    result = bake(
        args.sidecar, args.output, options, image=image, image_frame=number, force=args.force
    )
    if args.json:
        print(json.dumps(result.as_json(), indent=2))
        return 0

    frame = frame_text(args.frame)
    print(f"{result.output}: {result.format}, {result.size} samples a side, frame {frame}")
    if result.identity:
        print("  nothing is edited at this time: the table is the identity")
    for name, measure in (
        (f"clip's colours at frame {result.clip_frame}", result.clip),
        ("lattice's midpoints", result.midpoints),
    ):
        if measure is None:
            continue
        mean, largest = stated(measure.mean), stated(measure.largest)
        print(f"  error |a-b| on the {name}: mean {mean}, largest {largest}")
        if len(measure.by_interpolation) > 1:
            for part in measure.by_interpolation:
                print(
                    f"    {part.interpolation + ':':13} mean {stated(part.mean)}, "
                    f"largest {stated(part.largest)}"
                )
    print(f"  numbers in the file: {result.rounding}")
    if result.clip is not None and result.clip.outside_domain > 0:
        print(
            f"palette4d: warning: {result.clip.outside_domain:.3%} of the frame's colours lie "
            "outside 0..1, where the table clamps",
            file=sys.stderr,
        )
    return 0
