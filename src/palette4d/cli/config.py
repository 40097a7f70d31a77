"""The verb ``palette4d config``."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from palette4d.cli.export import add_frame_choice, add_run_options, export_settings
from palette4d.cli.lut_options import add_lut_options, wide_help
from palette4d.cli.progress import frames_bar
from palette4d.cli.terminal import tell
from palette4d.common.text import on_lines

if TYPE_CHECKING:
    from palette4d.lut_export.config import WrittenConfig

EPILOG = """\
Writes DIR/config.ocio, and 3D LUTs in DIR/luts. The context variable FRAME (no leading zeros)
chooses a shot's LUT. The look palette4d takes the shot from the variable SHOT, too; each view of
the base has one more view with that look. Without FRAME a shot shows its middle frame. With
--every, --stops or --frames the other frames use the nearest LUT, and the report states that error.

examples:
  palette4d config shot010.p4d.json shot020.p4d.json -o show
  palette4d config shots/edit.shots.json -o show --base aces/config.ocio --every 5
  OCIO=show/config.ocio SHOT=shot010 FRAME=1001 VIEWER frame.1001.exr
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb ``config``."""
    parser = subparsers.add_parser(
        "config",
        help="write an OpenColorIO config with a look for each shot",
        description="Write an OpenColorIO config with one look a shot, which follows the frame.",
        epilog=EPILOG,
        usage="%(prog)s SIDECAR... -o DIR [options]",
        formatter_class=wide_help,
    )
    add = parser.add_argument
    sidecars = "the sidecars, one a shot, or the manifest of a show (.shots.json)"
    add("sidecars", metavar="SIDECAR", type=Path, nargs="+", help=sidecars)
    add("-o", "--output", metavar="DIR", type=Path, required=True, help="the folder to write")
    base = "the config to add to a copy of: a file, .ocioz or ocio:// name (default: ACES studio)"
    add("--base", metavar="CONFIG", help=base)
    add("--names", metavar="A,B", help="the shots' names, one a sidecar (default: the clips')")
    space = "the config's colour space of clips whose encoding it does not know"
    add("--process-space", metavar="SPACE", help=space)
    add_frame_choice(parser, required=False)
    anyway = "allow a deltaE 2000 above 2 at the frames between"
    add("--anyway", action="store_true", help=anyway)
    add_lut_options(parser, "clf", space=False)
    add_run_options(parser)
    add("--json", action="store_true", help="print what was written as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write the config; print its content."""
    from palette4d.shows.exports import config

    settings = export_settings(args)
    with frames_bar("config", hidden=args.quiet) as progress:
        done = config(
            args.sidecars,
            args.output,
            base=args.base,
            names=None if args.names is None else args.names.split(","),
            process_space=args.process_space,
            anyway=args.anyway,
            progress=progress,
            **settings,
        )
    if args.json:
        print(json.dumps(as_json(done), indent=2))
    elif not args.quiet:
        print("\n".join(on_lines(list(report(done)))))
    for note in done.notes:
        tell(args, "note", note)
    return 0


def as_json(done: WrittenConfig) -> dict[str, object]:
    """Return the result as plain JSON values."""
    shots = [
        {
            "look": shot.name,
            "sidecar": shot.sidecar,
            "process_space": shot.process_space,
            "frames": [shot.first, shot.last],
            "luts": len(shot.baked.baked) + len(shot.baked.kept),
            "error": shot.error,
            "error_space": shot.process_space,
            "between": None if shot.between is None else asdict(shot.between),
            "index": str(shot.baked.index),
        }
        for shot in done.shots
    ]
    views = [list(view) for view in done.views]
    notes = done.notes
    return {
        "config": str(done.path), "base": done.base, "shots": shots, "views": views, "notes": notes
    }  # fmt: skip


def report(done: WrittenConfig) -> list[str]:
    """Return the report on the config."""
    from palette4d.common.text import counted
    from palette4d.lut_export.bake_error import stated

    lines = [f"{done.path}: {counted(len(done.shots), 'look')}, added to {done.base}"]
    width = max(len(shot.name) for shot in done.shots)
    for shot in done.shots:
        luts = len(shot.baked.baked) + len(shot.baked.kept)
        lines.append(
            f"  {shot.name:<{width}}  frames {shot.first} to {shot.last}, {counted(luts, 'LUT')}, "
            f"largest |a-b|/max(|b|,0.1) in {shot.process_space} {stated(shot.error)}"
        )
        if (between := shot.between) is not None:
            where = "the clip's colours" if between.on_clip else "a grid"
            lines.append(
                f"  {'':<{width}}  between the LUTs: deltaE 2000 of up to "
                f"{stated(between.delta_e)} on {where}, at frame {between.frame} with the LUT of "
                f"frame {between.look}"
            )
    if done.views:
        display, view = done.views[0]
        lines.append(f"  {counted(len(done.views), 'view')} more, such as {view!r} of {display!r}")
    shot = done.shots[0]
    lines.append(
        f"next: OCIO={done.path} SHOT={shot.name} FRAME={shot.first} and a viewer, with the look "
        f"{shot.name} or one of these views"
    )
    return lines
