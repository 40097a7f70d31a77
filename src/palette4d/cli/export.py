"""The verb ``palette4d export``."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from palette4d.cli.lut_options import add_lut_options, lut_settings, wide_help
from palette4d.cli.progress import frames_bar
from palette4d.cli.worker_options import add_worker_options
from palette4d.common.arguments import frame_range, parse_frames, whole
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted
from palette4d.jobs.workers import Workers

if TYPE_CHECKING:
    from palette4d import _core
    from palette4d.lut_export.series import Request, Series

EPILOG = """\
Files are NAME.FRAME.EXTENSION; NAME.series.json lists them with hashes and errors. The same command
again bakes only files that are missing or changed. Ctrl-C leaves whole files only.
--stops are the times of the colour stops, of the edited palette colours and of their neighbours.
With a manifest each shot's files go to a folder of its name; --otio writes a copy of the edit whose
clips name the shot's sidecar and files in their metadata ("palette4d").

examples:
  palette4d export shot010.p4d.json --every 1 -o luts
  palette4d export shot010.p4d.json --frames 1001-1100x10 -o luts --format clf --max-error 0.02
  palette4d export shots/edit.shots.json --stops -o luts --otio edit_luts.otio
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb ``export``."""
    parser = subparsers.add_parser(
        "export",
        help="bake many frames: a dated series of LUT files",
        description="Bake the edit at many frames, a file each, in parallel, with an index.",
        epilog=EPILOG,
        usage="%(prog)s SIDECAR (--every N | --stops | --frames RANGE) -o DIR [options]",
        formatter_class=wide_help,
    )
    add = parser.add_argument
    sidecar = "the sidecar (.p4d.json), or the manifest of a show (.shots.json)"
    add("sidecar", metavar="SIDECAR", type=Path, help=sidecar)
    add_frame_choice(parser, required=True)
    add("-o", "--output", metavar="DIR", type=Path, required=True, help="the folder for the files")
    add("--name", metavar="NAME", help="the files' name (default: the clip's)")
    padding = "digits of the frame number in the names (default 4)"
    add("--padding", metavar="N", type=whole(0, 12), default=4, help=padding)
    add_lut_options(parser, "resolve_cube", space=True)
    add_run_options(parser)
    otio = "write the edit of a show with references to its files"
    add("--otio", metavar="OUT.otio", type=Path, help=otio)
    add("--json", action="store_true", help="print the index")
    parser.set_defaults(run=run, usage_error=parser.error)


def add_frame_choice(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add --every, --stops and --frames, of which one is chosen."""
    add = parser.add_mutually_exclusive_group(required=required).add_argument
    every = "every N-th frame, from the first"
    add("--every", metavar="N", type=whole(1, 1_000_000), help=every)
    add("--stops", action="store_true", help="the frames at which the edit turns")
    add("--frames", metavar="RANGE", type=frame_range, help="10, 1-20, 1001-1100x10, 0,12,30")


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Add --jobs, --cluster, --force and --quiet."""
    add_worker_options(parser, "frames")
    parser.add_argument("--force", action="store_true", help="replace existing files")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")


def chosen_frames(
    args: argparse.Namespace, sidecar: _core.Sidecar, *, show: bool = False
) -> tuple[int, ...]:
    """Return the frames of --every, --stops or --frames; without these options, all frames.

    In a show, --stops of an unedited shot gives its first frame.
    """
    from palette4d.lut_export import series

    if args.stops and show and sidecar.edits.empty:
        return series.every(sidecar, 1)[:1]
    if args.stops:
        return series.stops(sidecar)
    if args.frames is not None:
        return series.check_frames(sidecar, tuple(parse_frames(args.frames)))
    return series.every(sidecar, args.every or 1)


def run(args: argparse.Namespace) -> int:
    """Export; print the written files."""
    from palette4d import _core
    from palette4d.lut_export import series
    from palette4d.lut_export.bake_job import BakeSettings
    from palette4d.lut_export.formats import format_named
    from palette4d.shows.manifest import is_manifest

    show = is_manifest(args.sidecar)
    _check_show(args, show)
    request = series.Request(
        sidecar=args.sidecar,
        folder=args.output,
        frames=(),
        settings=BakeSettings(**lut_settings(args, format_named(args.format).name)),
        name=args.name,
        padding=args.padding,
        clip=args.clip,
        force=args.force,
    )
    if show:
        return _run_show(args, request)
    request = replace(request, frames=chosen_frames(args, _core.read_sidecar(str(args.sidecar))))
    workers = Workers(args.jobs, args.cluster)
    with frames_bar("export", hidden=args.quiet) as progress:
        (done,) = series.export([request], workers, progress)
    if args.json:
        print(json.dumps(done.document, indent=2))
    else:
        print("\n".join(report(done)))
    warn([done])
    if done.failed:
        raise failures(done)
    return 0


def _check_show(args: argparse.Namespace, show: bool) -> None:
    """Refuse options that conflict with a manifest, or that need one, as wrong usage."""
    if not show:
        if args.otio is not None:
            args.usage_error("--otio needs the manifest of a show (.shots.json)")
        return
    for option, value, why in (
        ("--name", args.name, "each shot has its own"),
        ("--clip", args.clip, "each shot has its own"),
        ("--frames", args.frames, "each shot has its own; use --every or --stops"),
    ):
        if value is not None:
            args.usage_error(f"{option} does not go with the manifest of a show: {why}")


def _run_show(args: argparse.Namespace, request: Request) -> int:
    from palette4d.shows import export_luts

    with frames_bar("export", hidden=args.quiet) as progress:
        exported = export_luts.export(
            args.sidecar,
            args.output,
            request,
            lambda sidecar: chosen_frames(args, sidecar, show=True),
            Workers(args.jobs, args.cluster),
            progress,
            otio=args.otio,
        )
    done = exported.series
    for note in exported.notes:
        print(f"palette4d: note: {note}", file=sys.stderr)
    if args.json:
        print(export_luts.as_json(done))
    else:
        if args.otio is not None:
            print(f"{args.otio}: references in {counted(exported.references, 'clip')}")
        for one in done:
            print("\n".join(report(one)))
    warn(done)
    if error := export_luts.failures(done):
        raise error
    return 0


def report(done: Series) -> list[str]:
    """Return the report on the written files."""
    from palette4d.lut_export.bake_error import stated

    listed = {entry["frame"]: entry for entry in done.document["frames"]}
    frames = [listed[frame] for frame in sorted([*done.baked, *done.kept])]
    if not frames:
        return []
    folder = done.index.parent
    lines = [
        f"{counted(len(frames), 'file')}, {folder / frames[0]['file']} to {frames[-1]['file']}: "
        f"{len(done.baked)} baked, {len(done.kept)} kept",
    ]
    worst = max(frames, key=lambda entry: entry["error"])
    where = "the clip's colours" if worst["clip"] is not None else "the dense grid"
    lines.append(
        f"  largest |a-b|/max(|b|,0.1): {stated(worst['error'])} on {where} of frame "
        f"{worst['frame']}"
    )
    same = [entry["frame"] for entry in frames if entry["identity"]]
    if same:
        lines.append(f"  nothing is edited at {counted(len(same), 'frame')} of them")
    lines.append(f"  index {done.index}")
    return lines


def warn(done: list[Series]) -> None:
    """Print the notes and warnings for the user."""
    from palette4d.colour.difference import VISIBLE
    from palette4d.lut_export.bake import nearer
    from palette4d.lut_export.bake_error import stated
    from palette4d.lut_export.formats import shaper_warning

    entries = [entry for one in done for entry in one.document["frames"]]
    shaped = {
        one.document["options"]["format"]
        for one in done
        for entry in one.document["frames"]
        if entry["shaper"]["kind"] != "none"
    }
    for name in shaped:
        if about := shaper_warning(name):
            print(f"palette4d: warning: {about}", file=sys.stderr)
    if any(entry["clip"] is None for entry in entries):
        print(
            "palette4d: note: not all of the clip's frames could be read; the errors of the others "
            "are measured on the dense grid (name the clip with --clip)",
            file=sys.stderr,
        )
    missed = [e for e in entries if e["clip"] and e["clip"]["delta_e_largest"] > VISIBLE]
    if missed:
        smallest = min((e["size"] for e in missed if e["size"] is not None), default=None)
        worst = stated(max(e["clip"]["delta_e_largest"] for e in missed))
        print(
            f"palette4d: warning: the error of {counted(len(missed), 'file')} of {len(entries)} "
            f"can be seen: deltaE 2000 of up to {worst} on the clip's colours; {nearer(smallest)}",
            file=sys.stderr,
        )


def failures(done: Series) -> Palette4dError:
    """Return the error that lists the frames that could not be baked."""
    from palette4d.lut_export.series import failures_text

    return Palette4dError(
        f"{counted(len(done.failed), 'frame')} could not be baked; the others are there, and the "
        f"same command tries only these again:\n{failures_text(done.failed)}"
    )
