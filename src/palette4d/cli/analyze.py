"""The verb `analyze`: a clip in, a sidecar out."""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import shlex
import sys
import time
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palette4d.analysis.options import LIMITS, METHODS, METHODS_OF, AnalysisOptions
from palette4d.cli import analyze_shots
from palette4d.common.arguments import frame_range, number, whole
from palette4d.common.text import counted

if TYPE_CHECKING:
    from palette4d.media.clip import Clip

DESCRIPTION = """\
Find the time-varying palette of a clip: a 4D skew polytope in RGB and time whose slice at a frame
is that frame's palette (Du, Lei, Xu, Tan and Gingold 2021), and write it to a sidecar file.

CLIP is an image sequence (shot.####.exr, shot.%04d.png, shot.1001-1100x2#.dpx, or a folder that
holds one), a single image, or a movie file. The clip should be one shot: a palette must not span a
cut. Of more than 3000 frames one in n is analysed.

The report says for each stage how far the palette is from the pixels: R, the mean distance of all
pixels to it, 0 inside; C, of its colours from the pixels nearest to them; L = 50 R + C; K, how
restless it is; L_prime = L + 0.01 K; farthest, the distance of the farthest pixel outside. In its
shares a pixel is outside when it is more than 1/255, one step of 8 bits, from the convex hull of
its frame's palette. docs/palettes.md explains the figures.

"""
DESCRIPTION += analyze_shots.DESCRIPTION

EPILOG = """\
example:
  palette4d analyze shot010.####.exr -o shot010.p4d.json
  palette4d analyze plates/ --frames 1001-1100x2 -o plates.p4d.json
  palette4d analyze take3.mov -o take3.p4d.json --vertices 16      fewer handles, looser fit
  palette4d analyze cg.####.exr -o cg.p4d.json --input-space ACEScg     found in ACEScct
  palette4d analyze a.####.dpx -o a.p4d.json --input-space 'ARRI LogC4'  found in LogC4 itself
"""
EPILOG += analyze_shots.EPILOG

# option, metavar, field, help
PAPER_OPTIONS = (
    ("--lambda", "X", "lambda_", "weight of the reconstruction loss, eq. 4"),
    ("--k", "N", "k", "pixels a palette colour is compared with, eq. 3"),
    ("--alpha", "X", "alpha", "block merging: weight of the block's length, eq. 10"),
    ("--beta", "X", "beta", "block merging: weight of the palette's size, eq. 10"),
    ("--eta1", "X", "eta1", "merging stops above this multiple of the first loss"),
    ("--eta2", "X", "eta2", "removal stops above this multiple of the first loss"),
    ("--gamma", "X", "gamma", "weight of smoothness in time, eq. 12"),
    ("--removal-candidates", "N", "removal_candidates", "vertices tried for each removal"),
    ("--refinement-box", "X", "refinement_box", "how far a colour may move in refinement"),
    ("--refinement-cycles", "N", "refinement_cycles", "rounds of vertex refinement"),
)
HANDLE_OPTIONS = (
    ("--handle-cost", "X", "handle_cost", "what a handle must be worth: the rise of L' without it"),
    ("--vertices", "N", "vertices", "most handles; 0 keeps all that are worth it"),
    ("--blocks", "N", "blocks", "most stretches of time with a topology of their own"),
)
OUR_OPTIONS = (
    ("--palette-size", "N", "palette_size", "most colours of one frame's palette"),
    ("--merge-distance", "X", "merge_distance", "palette colours closer than this become one"),
    ("--hull-box", "X", "hull_box", "how far a colour may move when a frame's hull is refined"),
    ("--convexity", "X", "convexity", "weight of keeping the palettes convex; 0 is the paper"),
    ("--separation", "X", "separation", "palette colours nearer than this repel; 0 is the paper"),
    ("--reach", "X", "reach", "pixels this far outside count twice; 0: once, as in the paper"),
    ("--colours", "N", "colours", "most colour bins kept of a frame, for the losses"),
    ("--coarse-colours", "N", "coarse_colours", "the same for the search; of short clips more"),
    ("--seed", "N", "seed", "accepted and recorded; nothing is random at present"),
    ("--threads", "N", "threads", "threads; 0 is one a processor; never changes the result"),
)


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "analyze",
        help="find a clip's time-varying palette",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("clip", metavar="CLIP", help="image sequence, folder, image or movie file")
    parser.add_argument(
        "-o",
        "--output",
        required=True,
        metavar="OUT",
        type=Path,
        help="the sidecar to write, such as clip.p4d.json; for many shots a folder",
    )
    parser.add_argument(
        "--frames",
        metavar="A-B[xN]",
        type=frame_range,
        help="only these frames, evenly spaced (1001-1100x2)",
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
        help="pass over missing and unreadable frames instead of stopping at the first",
    )
    parser.add_argument(
        "--allow-cuts",
        action="store_true",
        help="analyse a clip with sudden cuts as one shot instead of stopping",
    )
    _add_space_options(parser)
    edits = parser.add_mutually_exclusive_group()
    edits.add_argument(
        "--keep-edits",
        dest="on_edits",
        action="store_const",
        const="keep",
        help="carry the edits of an existing OUT over (needs the same palette)",
    )
    edits.add_argument(
        "--drop-edits",
        dest="on_edits",
        action="store_const",
        const="drop",
        help="throw the edits of an existing OUT away",
    )
    parser.set_defaults(on_edits="refuse")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument("--quiet", action="store_true", help="no progress, no report")
    defaults = AnalysisOptions()
    parser.add_argument(
        "--method",
        choices=METHODS,
        default=defaults.method,
        help="; ".join(f"{name}: {text}" for name, text in METHODS.items())
        + "; an option below that names methods is refused with the others",
    )
    analyze_shots.add_options(parser)
    for title, table in (
        ("how many handles", HANDLE_OPTIONS),
        ("options of the paper", PAPER_OPTIONS),
        ("options of this program", OUR_OPTIONS),
    ):
        group = parser.add_argument_group(title)
        for flag, metavar, field, text in table:
            default = getattr(defaults, field)
            kind = whole if isinstance(default, int) else number
            methods = f"; method {', '.join(METHODS_OF[field])}" if field in METHODS_OF else ""
            group.add_argument(
                flag,
                dest=field,
                metavar=metavar,
                type=kind(*LIMITS[field]),
                default=argparse.SUPPRESS,  # what is there was given: `_options`
                help=f"{text} (default {default:g}{methods})",
            )
    parser.set_defaults(run=run, usage_error=parser.error)


def _add_space_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group(
        "colour spaces",
        "Without any of these, and without $OCIO, the palette is found in the numbers of the\n"
        "clip's files. Names, aliases and roles of an OpenColorIO config;\n"
        "docs/colour_spaces.md says how to choose.",
    )
    group.add_argument(
        "--input-space",
        metavar="SPACE",
        help="what the clip's numbers are (default: by the config's file rules and what the files "
        "say)",
    )
    group.add_argument(
        "--palette-space",
        metavar="SPACE",
        help="what the palette is found and edited in (default: for scene-linear clips the "
        "config's log encoding, ACEScct as a rule; else the input space)",
    )
    group.add_argument(
        "--ocio-config",
        metavar="CONFIG",
        help="a config.ocio, .ocioz or ocio:// name (default: $OCIO, else OpenColorIO's built-in "
        "studio config)",
    )


def _rate(text: str) -> Fraction:
    try:
        rate = Fraction(text)
    except (ValueError, ZeroDivisionError):
        rate = Fraction(0)
    if rate <= 0:
        raise argparse.ArgumentTypeError(
            f"found {text!r}, expected frames a second such as 24 or 24000/1001"
        )
    return rate


def run(args: argparse.Namespace) -> int:
    """Run `palette4d analyze`."""
    from palette4d.analysis import pipeline
    from palette4d.cli import analysis_report
    from palette4d.grade import sidecar
    from palette4d.media import colour_space
    from palette4d.media.clip import open_clip

    many = analyze_shots.is_show(args)
    options = _options(args)
    if many:
        return analyze_shots.run(args, options)
    sidecar.check_target(args.output, on_edits=args.on_edits)
    clip = open_clip(
        args.clip, frames=args.frames, rate=args.rate, skip_bad_frames=args.skip_bad_frames
    )
    spaces = colour_space.spaces_of(
        clip, colour_space.SpaceOptions(args.input_space, args.palette_space, args.ocio_config)
    )
    clip = colour_space.converted(clip, spaces)
    show = _Bars(hidden=args.quiet or args.json)
    try:
        document, analysis = pipeline.analyze_clip(clip, options, show, allow_cuts=args.allow_cuts)
    finally:
        show.close()
    document["clip"]["source"] = _beside(document["clip"]["source"], args.output)
    beyond = colour_space.record(document, clip, spaces)
    sidecar.save(document, args.output, on_edits=args.on_edits)
    for remark in (*_skipped(clip), *beyond, *analysis.remarks):
        print(f"palette4d: note: {remark}", file=sys.stderr)
    if args.json:
        print(json.dumps(analysis_report.figures(args.output, analysis, show.seconds), indent=2))
    elif not args.quiet:
        spaces_used = colour_space.described(spaces)
        print("\n".join(analysis_report.lines(clip, analysis, show.seconds, spaces_used)))
        colours = counted(analysis.stages[-1].vertices, "palette colour")
        print(f"wrote {args.output}: {colours} to edit")
        print(f"next: palette4d plot {shlex.quote(str(args.output))} -o palette.png")
    return 0


def _options(args: argparse.Namespace) -> AnalysisOptions:
    """Return the options; one that was given and that the method does not look at is wrong
    usage."""
    fields = {field.name for field in dataclasses.fields(AnalysisOptions)}
    given = {name: value for name, value in vars(args).items() if name in fields}
    for name in given:
        methods = METHODS_OF.get(name, METHODS)
        if args.method not in methods:
            flag = name.rstrip("_").replace("_", "-")
            args.usage_error(
                f"--{flag} has no effect with --method {args.method}; it belongs to "
                f"{', '.join(methods)}"
            )
    return AnalysisOptions(**given)


def _beside(source: str, output: Path) -> str:
    """Return a relative source as seen from the sidecar's folder: both may then move together."""
    if Path(source).is_absolute():
        return source
    try:
        return Path(os.path.relpath(source, output.absolute().parent)).as_posix()
    except ValueError:  # on another drive
        return str(Path(source).absolute())


def _skipped(clip: Clip) -> list[str]:
    from palette4d.media.clip_base import describe

    if not clip.skipped:
        return []
    what = counted(len(clip.skipped), "bad frame was", "bad frames were")
    return [f"{what} skipped: {describe(clip.skipped)}"]


class _Bars:
    """A progress bar a stage, and the time each took: from the end of the stage before it."""

    def __init__(self, hidden: bool) -> None:
        self.hidden = hidden
        self.seconds: dict[str, float] = {}
        self.stage = ""
        self.bar: Any = None
        self.since = self.last = time.perf_counter()

    def __call__(self, stage: str, done: int, total: int) -> None:
        from tqdm import tqdm

        if stage != self.stage:
            self.close()
            self.stage, self.since = stage, self.last
            self.bar = tqdm(total=total, desc=f"{stage:<18}", unit="", disable=self.hidden or None)
        self.bar.update(done - self.bar.n)
        self.last = time.perf_counter()
        self.seconds[stage] = round(self.last - self.since, 3)

    def close(self) -> None:
        """End the last bar."""
        if self.bar is not None:
            self.bar.close()
        self.bar = None
