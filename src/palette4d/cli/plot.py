"""The verb ``palette4d plot``: a picture of a palette and its edits."""

import argparse
import sys
from pathlib import Path

from palette4d.common.arguments import times, whole

EXTENSIONS = (".png", ".svg", ".pdf")

EPILOG = """\
Each row is a palette colour through time. A disc is a palette vertex; where it is edited, its upper
half shows the colour before and its lower half the colour after, and so does the band. A smaller
disc with two rings is a colour stop. Rows fork where a colour splits and join where colours merge.
Discs that are too close to each other stand aside; a line shows where one belongs.
Below, the palette as a polyhedron in the RGB cube at some frames; with the clip at hand also the
frames, before and after the edits, and their pixels.

The clip is looked up where the sidecar says (relative to the sidecar, then to the working folder).

example:
  palette4d plot seasons.p4d.json -o seasons.png
  palette4d plot seasons.p4d.json -o seasons.svg --frames 0,12,40 --clip seasons/#####.png
"""


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the verb ``plot``."""
    parser = subparsers.add_parser(
        "plot",
        help="draw the palette's timeline and polyhedra",
        description="Draw a palette and its edits: the timeline, and the polyhedra of some frames.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sidecar", metavar="SIDECAR", type=Path, help="the sidecar (.p4d.json)")
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        type=Path,
        required=True,
        help=f"the picture; its extension chooses: {', '.join(EXTENSIONS)}",
    )
    parser.add_argument(
        "--frames",
        metavar="A,B,C",
        type=times,
        help="the frames to show (default: four or five over the clip, edited ones among them)",
    )
    parser.add_argument(
        "--clip", metavar="CLIP", help="the clip (default: where the sidecar says, if it is there)"
    )
    parser.add_argument(
        "--width",
        metavar="PIXELS",
        type=whole(400, 16000),
        default=2400,
        help="width of a .png (default 2400)",
    )
    parser.add_argument("--force", action="store_true", help="replace an existing file")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Draw the picture and say where it is."""
    from palette4d.common.errors import Palette4dError
    from palette4d.common.files import refuse_existing

    output: Path = args.output
    extension = output.suffix.lower()
    if extension not in EXTENSIONS:
        raise Palette4dError(
            f"{output}: found the extension {output.suffix!r}; expected one of "
            f"{', '.join(EXTENSIONS)}"
        )
    refuse_existing(output, args.force)
    plot(
        args.sidecar,
        output,
        frames=args.frames,
        clip=args.clip,
        width=args.width,
        force=args.force,
    )
    print(f"{output}")
    return 0


def plot(
    sidecar_path: Path,
    output: Path,
    *,
    frames: list[float] | None = None,
    clip: str | None = None,
    width: int = 2400,
    force: bool = False,
) -> None:
    """Write a picture of a sidecar to a .png, .svg or .pdf file.

    Parameters
    ----------
    sidecar_path, output : Path
        The sidecar and the picture.
    frames : list of float, optional
        Times to show; by default four or five over the clip, edited ones among them.
    clip : str, optional
        The clip; by default where the sidecar says. When it is not there, or lacks one of the
        frames, the palette is drawn without those pixels, and a note on stderr says so.
    width : int
        Pixels, for .png.
    force : bool
        Replace an existing picture.

    Raises
    ------
    Palette4dError
        The sidecar, a frame, the clip or the output cannot be used; nothing was written.
    """
    import matplotlib
    import matplotlib.style

    from palette4d import _core
    from palette4d.common.errors import Palette4dError
    from palette4d.common.files import replacing
    from palette4d.media.source_clip import frame_colours
    from palette4d.plotting import figure as pages
    from palette4d.plotting import style
    from palette4d.plotting.panel import Palette

    sidecar = _core.read_sidecar(str(sidecar_path))
    first, last = sidecar.polytope.first_frame, sidecar.polytope.last_frame
    if frames is None:
        chosen = pages.default_frames(first, last, Palette.of(sidecar).edited_times)
    else:
        chosen = sorted(set(frames))
    for frame in chosen:
        if not first <= frame <= last:
            raise Palette4dError(
                f"frame {frame:g} is outside the clip {sidecar.clip['name']!r}; expected times "
                f"from {first:g} to {last:g}"
            )
    moments, missing = [], []
    for frame in chosen:
        image, _ = frame_colours(sidecar_path, sidecar.clip, frame, clip)
        if image is not None and sidecar.conversion is not None:
            image = sidecar.conversion.steps.to_palette(image).astype("float32")
        moments.append(pages.moment(sidecar, frame, image))
        if image is None:
            missing.append(f"{frame:g}")
    if missing:
        which = "" if len(missing) == len(moments) else f" of frame {', '.join(missing)}"
        source = repr(sidecar.clip["source"]) if sidecar.clip["source"] else "anywhere"
        print(
            f"palette4d: note: the clip's pixels{which} could not be read from {source}; only the "
            "palette is drawn there (name the clip with --clip)",
            file=sys.stderr,
        )
    with (
        matplotlib.style.context("default"),
        matplotlib.rc_context(style.RC),
        replacing(output, force=force) as temporary,
    ):
        page = pages.build(sidecar, moments)
        pages.save(page, temporary, output.suffix.lower()[1:], width)
