"""The verb `analyze`: a clip in, a sidecar out."""

from __future__ import annotations

import argparse
import json
import time
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d import analyze, load
from palette4d.analysis.options import LIKE, METHODS, OPTIONS, check_methods, parse_setting
from palette4d.cli import analysis_report, analyze_shots
from palette4d.cli.progress import progress_bar
from palette4d.cli.reading import add_reading, clip_name
from palette4d.cli.terminal import option_of, tell
from palette4d.common.arguments import checked, frame_range, whole
from palette4d.common.errors import Palette4dError
from palette4d.common.text import counted, on_lines, quoted

USAGE = "palette4d analyze CLIP -o OUT [options]"

DESCRIPTION = """\
Find the time-varying palette of a clip and write it to a sidecar file.
CLIP is an image sequence (shot.####.exr, or a folder), an image or a movie;
for many shots an edit (.otio, .edl) or, with --detect-shots, a movie.
"""

EPILOG = """\
examples:
  palette4d analyze shot010.####.exr -o shot010.p4d.json
  palette4d analyze take3.mov -o take3.p4d.json --vertices 16
  palette4d analyze cg.####.exr -o cg.p4d.json --input-space ACEScg
  palette4d analyze edit.otio --media plates/ -o shots
  palette4d analyze v002.####.exr -o v002.p4d.json --like v001.p4d.json
"""

# The options of the first help screen; --help-all shows all of them.
FRONT = (
    *("clip", "output", "frames", "input_space", "palette_space", "ocio_config"),
    *("detect_shots", "media", "like", "method", "vertices", "settings", "json", "quiet"),
    *("help", "all"),
)

DESCRIPTION_ALL = """
The palette is a 4D skew polytope in RGB and time; its slice at a frame is the
palette of that frame (Du, Lei, Xu, Tan and Gingold 2021).
Of a clip with more than 3000 frames one in n is analysed.

The report says for each stage how far the palette is from the pixels:
  R         mean distance of all pixels to the palette, 0 inside
  C         mean distance of its colours from the pixels nearest to them
  L         50 R + C
  K         how much its colours change in time
  L_prime   L + 0.01 K
  farthest  distance of the farthest pixel outside
Its shares count pixels more than 1/255, one 8-bit step, outside.
docs/palettes.md explains the figures.

"""


class _HelpAll(argparse.Action):
    """Print the help of all options."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        for action, text in parser.get_default("hidden_help").items():
            action.help = text
        parser.description = DESCRIPTION + DESCRIPTION_ALL + analyze_shots.DESCRIPTION
        parser.epilog = "\n".join(("settings (--set NAME=VALUE):", *_settings_help())) + (
            "\n\n" + EPILOG + analyze_shots.EPILOG
        )
        parser.print_help()
        parser.exit()


def _formatter(prog: str) -> argparse.HelpFormatter:
    return argparse.RawDescriptionHelpFormatter(prog, max_help_position=26, width=79)


def _settings_help() -> list[str]:
    """Return the lines that explain `--set`, from the table of options."""
    lines = []
    for name, option in OPTIONS.items():
        if name == "vertices":  # it has its own option
            continue
        only = "" if set(METHODS) <= set(option.methods) else f"; {', '.join(option.methods)}"
        lines.append(f"  {name:<19} {option.text}")
        limits = f"{option.low:.10g} to {option.high:.10g}, default {option.default:g}{only}"
        lines.append(f"  {'':<19} ({limits})")
    return lines


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "analyze",
        help="find a clip's time-varying palette",
        usage=USAGE,
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=_formatter,
        add_help=False,
    )
    parser.add_argument("clip", metavar="CLIP", help="image sequence, folder, image, movie or edit")
    parser.add_argument(
        *("-o", "--output"),
        required=True,
        metavar="OUT",
        type=Path,
        help="the sidecar (shot.p4d.json); for many shots a folder",
    )
    parser.add_argument(
        "--frames", metavar="A-B[xN]", type=frame_range, help="only these frames (1001-1100x2)"
    )
    parser.add_argument(
        "--rate",
        metavar="N/D",
        type=_rate,
        help="frames a second (24000/1001); of an EDL's timecodes (default 24)",
    )
    parser.add_argument(
        "--skip-bad-frames",
        action="store_true",
        help="skip missing and unreadable frames instead of ending at the first",
    )
    parser.add_argument(
        "--allow-cuts",
        action="store_true",
        help="analyse a clip with sudden cuts as one shot instead of refusing it",
    )
    edits = parser.add_mutually_exclusive_group()
    for flag, text in (
        (
            "keep",
            "carry the edits of an existing OUT over (copies the grade if the palette changed)",
        ),
        ("drop", "discard the edits of an existing OUT"),
    ):
        edits.add_argument(
            f"--{flag}-edits", dest="on_edits", action="store_const", const=flag, help=text
        )
    parser.set_defaults(on_edits="refuse")
    add_reading(parser)
    parser.add_argument("--input-space", metavar="SPACE", help="colour space of the clip")
    parser.add_argument(
        "--palette-space",
        metavar="SPACE",
        help="of the palette (scene-linear clips: a log one)",
    )
    parser.add_argument(
        "--ocio-config", metavar="CONFIG", help="config.ocio, .ocioz or ocio:// (default: $OCIO)"
    )
    parser.add_argument(
        "--vertices",
        metavar="N",
        type=whole(OPTIONS["vertices"].low, OPTIONS["vertices"].high),
        help="most handles (default: all that are worth it)",
    )
    parser.add_argument(
        "--method",
        choices=METHODS,
        metavar="NAME",
        default=next(iter(METHODS)),
        help="; ".join(f"{name}: {text}" for name, text in METHODS.items()),
    )
    parser.add_argument(
        "--like",
        metavar="OLD",
        type=Path,
        help="keep the colours and stops of an earlier version's sidecar, moved to this clip",
    )
    parser.add_argument(
        "--set",
        dest="settings",
        metavar="NAME=VALUE",
        action="append",
        type=checked(str, parse_setting),
        default=[],
        help="a setting that --help-all lists; may be repeated",
    )
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument("--quiet", action="store_true", help="no progress, no report")
    analyze_shots.add_options(parser)
    parser.add_argument("-h", "--help", action="help", help="show this help")
    parser.add_argument("--help-all", dest="all", nargs=0, action=_HelpAll, help="all options")
    hidden = {action: action.help for action in parser._actions if action.dest not in FRONT}
    for action in hidden:
        action.help = argparse.SUPPRESS
    parser.set_defaults(run=run, hidden_help=hidden)


def _rate(text: str) -> Fraction:
    from palette4d.media.clip_base import as_rate

    try:
        rate = Fraction(text) if "/" in text else as_rate(float(text))
    except (ValueError, ZeroDivisionError):
        rate = None
    if rate is None or rate <= 0:
        raise argparse.ArgumentTypeError(
            f"found {text!r}, expected frames a second such as 24, 23.976 or 24000/1001"
        )
    return rate


def run(args: argparse.Namespace) -> int:
    """Run `palette4d analyze`."""
    settings = _settings(args)
    args.clip = clip_name(args)
    if analyze_shots.is_show(args):
        return analyze_shots.run(args, settings)
    from palette4d.grade import sidecar

    on_edits = settings.pop("on_edits")
    sidecar.check_target(args.output, on_edits=on_edits)
    bars = _Bars(hidden=args.quiet or args.json)
    try:
        document = analyze(args.clip, frames=args.frames, like=args.like, progress=bars, **settings)
    finally:
        bars.close()
    document.save(args.output, on_edits=on_edits)
    for note in document.notes:
        tell(args, "note", note)
    if args.json:
        seconds = {"seconds": bars.seconds, "cpu_seconds": round(time.process_time(), 3)}
        print(json.dumps({"sidecar": str(args.output)} | document.report | seconds, indent=2))
    elif not args.quiet:
        print("\n".join(on_lines(analysis_report.lines(document, bars.seconds))))
        colours = counted(len(document.grade.tracks), "palette colour")
        handles = counted(len(document.fields()["polytope"]["vertices"]), "handle")
        print(f"wrote {args.output}: {colours} through time, {handles}")
        out = quoted(args.output)
        print(f"next: palette4d plot {out} -o palette.png")
        first = document.grade.frames[0]
        print(f"      palette4d edit {out} pick --frame {first} --pixel X,Y --to '#rrggbb'")
        if args.like is not None and load(args.like).grade.edited and not document.grade.edited:
            print(f"      palette4d edit {out} copy {quoted(args.like)}")
    return 0


def _settings(args: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments of the API; an option without effect on the method is wrong usage."""
    given: dict[str, Any] = dict(map(parse_setting, args.settings))
    if args.vertices is not None:
        given["vertices"] = args.vertices
    if args.like is not None and args.method != "skew":
        args.parser.error("--like moves a palette, and --method finds one: give one of them")
    try:
        check_methods(args.method if args.like is None else LIKE, given)
    except Palette4dError as error:
        args.parser.error(error.message.said(lambda arg: option_of(arg, args.parser)))
    spaces = ("input_space", "palette_space", "ocio_config")
    names = ("rate", "skip_bad_frames", "allow_cuts", "method", "on_edits", *spaces)
    return {name: vars(args)[name] for name in names} | given


class _Bars:
    """One progress bar per stage, and the seconds of each stage."""

    def __init__(self, hidden: bool) -> None:
        self.hidden = hidden
        self.seconds: dict[str, float] = {}
        self.stage = ""
        self.bar: Any = None
        self.since = self.last = time.perf_counter()

    def __call__(self, stage: str, done: int, total: int) -> None:
        if stage != self.stage:
            self.close()
            self.stage, self.since = stage, self.last
            self.bar = progress_bar(f"{stage:<18}", total=total, unit="", hidden=self.hidden)
        self.bar.update(done - self.bar.n)
        self.last = time.perf_counter()
        self.seconds[stage] = round(self.last - self.since, 3)

    def close(self) -> None:
        """End the last bar."""
        if self.bar is not None:
            self.bar.close()
        self.bar = None
