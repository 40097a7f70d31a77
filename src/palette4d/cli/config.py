"""The verb ``palette4d config``."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from palette4d.cli.export import add_frame_choice, add_run_options, chosen_frames, with_bar
from palette4d.cli.lut_options import add_table_options, bake_options
from palette4d.jobs.workers import Workers

if TYPE_CHECKING:
    from palette4d.lut_export.config import WrittenConfig

EPILOG = """\
Writes DIR/config.ocio, and the tables beside it in DIR/luts. Each shot is a look, in the encoding
of its sidecar; which of its tables applies is said by the context variable FRAME. The look
palette4d takes the shot from the variable SHOT, too, and each view of the base has a twin that
applies it. A frame number has no leading zeros; where FRAME is not set, the shot's middle frame is
shown.

Without --every, --stops or --frames each frame has a table of its own; with one of them the frames
between are links to the nearest table.

examples:
  palette4d config shot010.p4d.json shot020.p4d.json -o show
  palette4d config shot010.p4d.json -o show --base /configs/aces/config.ocio --every 5
  palette4d config shots/edit.shots.json -o show --every 5
  OCIO=show/config.ocio SHOT=shot010 FRAME=1001 VIEWER frame.1001.exr
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb ``config``."""
    parser = subparsers.add_parser(
        "config",
        help="write an OpenColorIO config with a look for each shot",
        description="Write an OpenColorIO config with one look a shot, which follows the frame.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "sidecars",
        metavar="SIDECAR",
        type=Path,
        nargs="+",
        help="the sidecars, one a shot, or the manifest of a show (.shots.json)",
    )
    parser.add_argument(
        "-o", "--output", metavar="DIR", type=Path, required=True, help="the folder to write"
    )
    parser.add_argument(
        "--base",
        metavar="CONFIG",
        help="the config to add to a copy of: a file, .ocioz or ocio:// name (default: "
        "OpenColorIO's built-in ACES studio config)",
    )
    parser.add_argument(
        "--names",
        metavar="A,B",
        help="the shots' names, one for each sidecar (default: the clips')",
    )
    parser.add_argument(
        "--process-space",
        metavar="SPACE",
        help="the config's colour space of the clips' numbers (default: by the sidecar's encoding)",
    )
    add_frame_choice(parser, required=False)
    add_table_options(parser, "clf")
    add_run_options(parser)
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")
    parser.set_defaults(run=run, usage_error=parser.error)


def run(args: argparse.Namespace) -> int:
    """Write the config; print what is in it."""
    from palette4d.lut_export.config import ConfigOptions, write_config
    from palette4d.lut_export.formats import format_named
    from palette4d.lut_export.series import SeriesOptions
    from palette4d.shows import export_luts

    sidecars, remarks = export_luts.sidecars(args.sidecars)
    # A manifest is a show, also one of a single shot.
    show = len(sidecars) > 1 or sidecars != args.sidecars
    if args.clip is not None and len(sidecars) > 1:
        args.usage_error("--clip names one clip; with several sidecars each must name its own")
    options = ConfigOptions(
        series=SeriesOptions(
            frames=(),
            bake=bake_options(args, format_named(args.format).name),
            clip=args.clip,
            workers=Workers(args.jobs, args.cluster),
        ),
        choose=lambda sidecar: chosen_frames(args, sidecar, show=show),
        base=args.base,
        names=None if args.names is None else tuple(args.names.split(",")),
        process_space=args.process_space,
        force=args.force,
    )
    done = with_bar(
        "config",
        args.quiet,
        lambda progress: write_config(sidecars, args.output, options, progress),
    )
    if args.json:
        print(json.dumps(as_json(done), indent=2))
    else:
        print("\n".join(report(done)))
    for note in [*remarks, *done.notes]:
        print(f"palette4d: note: {note}", file=sys.stderr)
    return 0


def as_json(done: WrittenConfig) -> dict[str, object]:
    """Return what was written as plain JSON values."""
    return {
        "config": str(done.path),
        "base": done.base,
        "shots": [
            {
                "look": shot.name,
                "sidecar": shot.sidecar,
                "process_space": shot.process_space,
                "frames": [shot.first, shot.last],
                "tables": len(shot.baked.baked) + len(shot.baked.kept),
                "error": shot.error,
                "error_space": shot.process_space,
                "index": str(shot.baked.index),
            }
            for shot in done.shots
        ],
        "views": [list(view) for view in done.views],
        "notes": done.notes,
    }


def report(done: WrittenConfig) -> list[str]:
    """Return the lines that say what was written."""
    from palette4d.common.text import counted
    from palette4d.lut_export.error import stated

    lines = [f"{done.path}: {counted(len(done.shots), 'look')}, added to {done.base}"]
    width = max(len(shot.name) for shot in done.shots)
    for shot in done.shots:
        tables = len(shot.baked.baked) + len(shot.baked.kept)
        lines.append(
            f"  {shot.name:<{width}}  frames {shot.first} to {shot.last}, "
            f"{counted(tables, 'table')}, process space {shot.process_space}, largest "
            f"|a-b|/max(|b|,0.1) in it {stated(shot.error)}"
        )
    if done.views:
        lines.append(
            f"  {counted(len(done.views), 'view')} more, such as {done.views[0][1]!r} of "
            f"{done.views[0][0]!r}"
        )
    shot = done.shots[0]
    lines.append(
        f"next: OCIO={done.path} SHOT={shot.name} FRAME={shot.first} and a viewer, with the look "
        f"{shot.name} or one of these views"
    )
    return lines
