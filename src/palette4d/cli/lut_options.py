"""The options that `bake`, `export` and `config` share."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from palette4d.common.arguments import checked, number, whole
from palette4d.lut_export.formats import format_named, format_names

if TYPE_CHECKING:
    from palette4d.lut_export.bake_options import BakeOptions


def add_table_options(parser: argparse.ArgumentParser, default: str | None) -> None:
    """Add --format, --size, --shaper, --domain, --strength, --max-error and --clip.

    `default` is the format when nothing is said; None: by the extension.
    """
    parser.add_argument(
        "--format",
        metavar="FORMAT",
        type=checked(str, format_named),
        default=default,
        help=f"{', '.join(format_names())} (default: "
        + ("by the extension)" if default is None else f"{default})"),
    )
    parser.add_argument(
        "--size",
        metavar="N",
        type=whole(2, 129),
        default=33,
        help="samples a side: 17, 33, 65 or any from 2 to 129, OpenColorIO's limits (default 33)",
    )
    parser.add_argument(
        "--shaper",
        choices=("auto", "none", "linear", "log"),
        default="auto",
        help="the curve in front of the table that brings numbers beyond 0..1 into it; auto: none "
        "for colours within 0..1, linear for little more, else log (default auto)",
    )
    parser.add_argument(
        "--domain",
        metavar=("LOW", "HIGH"),
        nargs=2,
        type=number(),
        help="what the shaper covers (default: the colours of the frame and of the palette)",
    )
    parser.add_argument(
        "--strength",
        metavar="S",
        type=number(0, 1),
        default=1.0,
        help="0 to 1, as in the node (default 1)",
    )
    parser.add_argument(
        "--max-error",
        metavar="E",
        type=number(0),
        help="make the table larger until its largest |a-b|/max(|b|,0.1) on the clip's colours is "
        "at most E, or fail and write nothing (0.002 is fit for previews)",
    )
    parser.add_argument(
        "--clip",
        metavar="CLIP",
        help="the clip, to state the error on its colours (default: where the sidecar says)",
    )


def add_space_options(parser: argparse.ArgumentParser) -> None:
    """Add --space and --ocio-config."""
    parser.add_argument(
        "--space",
        metavar="SPACE",
        default="input",
        help="what the file takes and returns: input, the clip's numbers (default); palette, those "
        "that the palette is in; or a colour space such as ACES2065-1. In .clf and .ctf the "
        "conversion stands beside the table as transforms of its own",
    )
    parser.add_argument(
        "--ocio-config",
        metavar="CONFIG",
        help="the config that knows SPACE: a config.ocio, .ocioz or ocio:// name (default: the one "
        "that the sidecar names, else $OCIO, else OpenColorIO's built-in studio config)",
    )


def bake_options(args: argparse.Namespace, format_name: str, frame: float = 0.0) -> BakeOptions:
    """Return what the options ask for; a --domain that is none is wrong usage."""
    from palette4d.lut_export.bake_options import BakeOptions

    if args.domain is not None and not args.domain[0] < args.domain[1]:
        args.usage_error("argument --domain: expected two numbers, the smaller one first")
    # `config` has neither: it chooses the space itself.
    spaces = {name: vars(args)[name] for name in ("space", "ocio_config") if name in args}
    return BakeOptions(
        frame=frame,
        size=args.size,
        strength=args.strength,
        format=format_name,
        shaper=args.shaper,
        domain=None if args.domain is None else (args.domain[0], args.domain[1]),
        max_error=args.max_error,
        **spaces,
    )
