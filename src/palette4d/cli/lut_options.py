"""The options that `bake`, `export` and `config` share."""

from __future__ import annotations

import argparse
from typing import Any

from palette4d.common.arguments import checked, number, whole
from palette4d.lut_export.formats import format_named


def wide_help(prog: str) -> argparse.HelpFormatter:
    """Return the help formatter of the exports, with the width of their epilogs."""
    return argparse.RawDescriptionHelpFormatter(prog, max_help_position=26, width=100)


def add_lut_options(parser: argparse.ArgumentParser, default: str | None, *, space: bool) -> None:
    """Add --format, --size, --shaper, --domain, --strength, --max-error, --clip.

    `default` is the default format; None: by the extension. `space`: also --space, --ocio-config.
    """
    add = parser.add_argument
    by = "by the extension" if default is None else default
    add("--format", type=checked(str, format_named), default=default, help=f"default: {by}")
    size = "samples a side, 2 to 129 (default 33; 65 with picks or where 33 shows)"
    add("--size", metavar="N", type=whole(2, 129), help=size)
    shapers = ("auto", "none", "linear", "log")
    shaper = "1D shaper for code values beyond 0..1: %(choices)s (default auto)"
    add("--shaper", choices=shapers, metavar="KIND", default="auto", help=shaper)
    domain = "what the shaper covers (default: the frame and the palette)"
    add("--domain", metavar=("LOW", "HIGH"), nargs=2, type=number(), help=domain)
    strength = "0 to 1, as in the node (default 1)"
    add("--strength", metavar="S", type=number(0, 1), default=1.0, help=strength)
    limit = "enlarge the 3D LUT until its largest |a-b|/max(|b|,0.1) is E, or fail"
    add("--max-error", metavar="E", type=number(0), help=limit)
    add("--clip", help="the clip, to measure on its colours (default: the sidecar's)")
    if space:
        spaces = "input (the clip's), palette, or a colour space"
        add("--space", default="input", help=f"takes and returns: {spaces} (default input)")
        config = (
            "the config that defines SPACE (default: the sidecar's, $OCIO, or the studio config)"
        )
        add("--ocio-config", metavar="CONFIG", help=config)


def lut_settings(args: argparse.Namespace) -> dict[str, Any]:
    """Return these options as arguments of the API; an impossible --domain is wrong usage."""
    if args.domain is not None and not args.domain[0] < args.domain[1]:
        args.parser.error("argument --domain: expected two code values, the smaller one first")
    names = ("size", "strength", "shaper", "max_error", "space", "ocio_config")
    settings = {name: vars(args)[name] for name in names if name in args}
    domain = None if args.domain is None else tuple(args.domain)
    return {**settings, "domain": domain}
