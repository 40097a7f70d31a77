"""The verb ``palette4d export``."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palette4d.cli.lut_options import add_lut_options, lut_settings, wide_help
from palette4d.cli.progress import frames_bar
from palette4d.cli.terminal import tell
from palette4d.cli.worker_options import add_worker_options
from palette4d.common.arguments import frame_range, whole
from palette4d.common.errors import UnfinishedError
from palette4d.common.text import counted, on_lines

if TYPE_CHECKING:
    from palette4d.lut_export.series import Series
    from palette4d.shows.exports import Exported

EPILOG = """\
Files are NAME.FRAME.EXTENSION; NAME.series.json lists them with hashes and errors. The same command
again bakes only files that are missing or changed. Ctrl-C leaves whole files only.
--stops are the times of the colour stops, of the edited palette colours and of their neighbours.
With a manifest each shot's files go to a folder of its name; --otio writes a copy of the edit whose
clips name the shot's sidecar and files in their metadata ("palette4d").
--dctl writes palette, edits and picks through time as one file for DaVinci Resolve, without LUTs;
--glsl the same as a fragment function (NAME.glsl; with picks a texture NAME.rgba beside it) or as a
shader for mpv (NAME.hook). A DCTL has room for 64 KB: then mattes of picks get fewer values. If
code values are off by more than 0.02, nothing is written: choose --frames, switch picks off, or
accept more by --max-error. All these files draw what `render --clean-up 0` does.

examples:
  palette4d export shot010.p4d.json --every 1 -o luts
  palette4d export shot010.p4d.json --frames 1001-1100x10 -o luts --format clf --max-error 0.02
  palette4d export shots/edit.shots.json --stops -o luts --otio edit_luts.otio
  palette4d export shots/edit.shots.json --stops -o cdls --format ccc --ccc show.ccc
  palette4d export shot010.p4d.json --dctl shot010.dctl --max-error 0.05
  palette4d export shot010.p4d.json --glsl shot010.hook
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb ``export``."""
    parser = subparsers.add_parser(
        "export",
        help="bake many frames: a dated series of LUT files",
        description="Bake the edit at many frames, a file each, in parallel, with an index.",
        epilog=EPILOG,
        usage="%(prog)s SIDECAR (--every N | --stops | --frames RANGE) -o DIR [options]\n"
        "       %(prog)s SIDECAR --dctl OUT.dctl [--alpha] [--frames RANGE] [--max-error E]\n"
        "       %(prog)s SIDECAR --glsl OUT.glsl [--frames RANGE]",
        formatter_class=wide_help,
    )
    add = parser.add_argument
    sidecar = "the sidecar (.p4d.json), or the manifest of a show (.shots.json)"
    add("sidecar", metavar="SIDECAR", type=Path, help=sidecar)
    add_frame_choice(parser, required=False)
    add("-o", "--output", metavar="DIR", type=Path, help="the folder for the files")
    dctl = "write one DCTL file instead"
    add("--dctl", metavar="OUT.dctl", type=Path, help=dctl)
    glsl = "write GLSL instead: OUT.glsl, or OUT.hook for mpv"
    add("--glsl", metavar="OUT.glsl", type=Path, help=glsl)
    alpha = "with --dctl: keep alpha, for DaVinci Resolve 19.1 and later"
    add("--alpha", action="store_true", help=alpha)
    add("--name", metavar="NAME", help="the files' name (default: the clip's)")
    padding = "digits of the frame number in the names (default 4)"
    add("--padding", metavar="N", type=whole(0, 12), default=4, help=padding)
    add_lut_options(parser, "resolve_cube", space=True)
    add_run_options(parser)
    otio = "write the edit of a show with references to its files"
    add("--otio", metavar="OUT.otio", type=Path, help=otio)
    ccc = "write one collection with a CDL for each shot of a show (--format ccc)"
    add("--ccc", metavar="OUT.ccc", type=Path, help=ccc)
    edl = "write the EDL of a show with these CDLs as comments"
    add("--edl", metavar="OUT.edl", type=Path, help=edl)
    add("--json", action="store_true", help="print the index")
    parser.set_defaults(run=run)


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
    parser.add_argument("--quiet", action="store_true", help="no progress bar, no report")


def export_settings(args: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments that `export` and `config` share."""
    names = ("every", "stops", "frames", "clip", "format", "jobs", "cluster", "force")
    return {name: vars(args)[name] for name in names} | lut_settings(args)


def run(args: argparse.Namespace) -> int:
    """Export; print the written files."""
    if args.dctl is not None or args.glsl is not None:
        return _one_file(args)
    if args.alpha:
        args.parser.error("--alpha: only with --dctl")
    if args.output is None:
        args.parser.error("the following arguments are required: -o/--output")
    if args.every is None and not args.stops and args.frames is None:
        args.parser.error("one of the arguments --every --stops --frames is required")
    from palette4d.shows.exports import export

    failed: UnfinishedError | None = None
    settings = export_settings(args)
    with frames_bar("export", hidden=args.quiet) as progress:
        try:
            done: Any = export(
                args.sidecar,
                args.output,
                name=args.name,
                padding=args.padding,
                otio=args.otio,
                ccc=args.ccc,
                edl=args.edl,
                progress=progress,
                **settings,
            )
        except UnfinishedError as error:
            done, failed = error.done, error
    for note in done.notes:
        tell(args, "note", note)
    if args.json:
        print(json.dumps(_index(done, args.sidecar), indent=2))
    elif not args.quiet:
        if args.otio is not None:
            print(f"{args.otio}: references in {counted(done.references, 'clip')}")
        for written in (args.ccc, args.edl):
            if written is not None:
                print(f"{written}: a CDL for each of {counted(len(done.series), 'shot')}")
        for series_of_shot in done.series:
            print("\n".join(on_lines(list(report(series_of_shot)))))
    warn(args, done.series)
    if failed:
        raise failed
    return 0


def _one_file(args: argparse.Namespace) -> int:
    """Write a DCTL or GLSL file; print its size."""
    from dataclasses import asdict

    from palette4d.lut_export.clip_text import MAX_ERROR, MOST_BYTES
    from palette4d.lut_export.dctl import export_dctl
    from palette4d.lut_export.glsl import export_glsl

    name = "--glsl" if args.dctl is None else "--dctl"
    of_series = {*export_settings(args), "output", "name", "padding", "otio", "ccc", "edl"}
    others = of_series - {"frames", "force", *(["max_error"] if args.glsl is None else [])}
    if any(vars(args)[other] != args.parser.get_default(other) for other in others):
        limit = "--max-error, " if args.glsl is None else ""
        args.parser.error(f"{name}: only with --frames, {limit}--force, --json and --quiet")
    if args.glsl is None:
        done = export_dctl(
            args.sidecar,
            args.dctl,
            frames=args.frames,
            alpha=args.alpha,
            max_error=MAX_ERROR if args.max_error is None else args.max_error,
            force=args.force,
        )
    elif args.dctl is not None or args.alpha:
        args.parser.error("--glsl: not with --dctl or --alpha")
    else:
        done = export_glsl(args.sidecar, args.glsl, frames=args.frames, force=args.force)
    if args.json:
        print(json.dumps(asdict(done), indent=2))
    elif not args.quiet:
        print(
            f"{done.output}: frames {done.first} to {done.last} from {counted(done.keys, 'key')}"
            f"{f' and {done.pick_keys} of picks' if done.pick_keys else ''}, "
            f"{done.constant_bytes / 1024:.1f} KB of {MOST_BYTES // 1024} KB"
        )
        if done.has_picks:
            print("  picks are drawn without Clean up, as by `render --clean-up 0`")
        if done.texture is not None:
            print(f"{done.texture}: the texture for its picks")
    if done.matte_levels:
        about = (
            f"the mattes of picks have {done.matte_levels} values, to have room: code values are "
            f"off by about {done.error:.2g}; fewer picks, or frames, leave more room"
        )
        tell(args, "warning", about)
    return 0


def _index(done: Exported, source: Path) -> dict[str, Any]:
    """Return the index, or the indexes of a show's shots by their names."""
    from palette4d.shows.manifest import is_manifest

    if is_manifest(source):
        return {shot.document["clip"]["name"]: shot.document for shot in done.series}
    return done.series[0].document


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


def warn(args: argparse.Namespace, done: list[Series]) -> None:
    """Print the notes and warnings for the user."""
    from palette4d.lut_export.bake import nearer
    from palette4d.lut_export.bake_error import stated
    from palette4d.lut_export.formats import shaper_warning

    entries = [entry for shot in done for entry in shot.document["frames"]]
    shaped = {
        shot.document["options"]["format"]
        for shot in done
        for entry in shot.document["frames"]
        if entry["shaper"]["kind"] != "none"
    }
    for name in shaped:
        if about := shaper_warning(name):
            tell(args, "warning", about)
    if any(entry["clip"] is None for entry in entries):
        tell(
            args,
            "note",
            "not all of the clip's frames could be read; the errors of the others are measured on "
            "the dense grid (name the clip with --clip)",
        )
    missed = [entry for entry in entries if entry.get("visible")]
    if missed:
        smallest = min((e["size"] for e in missed if e["size"] is not None), default=None)
        worst = stated(max(e["clip"]["delta_e_largest"] for e in missed))
        tell(
            args,
            "warning",
            f"the error of {counted(len(missed), 'file')} of {len(entries)} can be seen: deltaE "
            f"2000 of up to {worst} on the clip's colours; {nearer(smallest)}",
        )
