"""Is the default never worse than one static palette of the same clip?

Analyses each clip, or piece of one, with the defaults and as static palettes: `--method static` as
it is, and without the terms for shape. They are compared by L' and the cost of the handles. All of
them are measured on every pixel.

    python benchmarks/bench_never_worse.py CLIP[:A-B[xN]] ... [--evaluator PROGRAM]

Prints Markdown, with the concavity of the best static palette. One that lacks more than a twentieth
of its hull is no result and does not count. Ends with 1 where the default is worse than another.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import evaluator
from evaluator import Figures, Runs, say, table
from palette4d.analysis.convex_hulls import CONCAVE
from palette4d.analysis.options import AnalysisOptions

from palette4d.common.arguments import frame_range

STATIC = ("--method", "static")
PLAIN = ("separation=0", "reach=0")
PLAIN_HULLS = (PLAIN, (*PLAIN, "convexity=0"), (*PLAIN, "convexity=0", "hull_box=0.3"))
# What the command and these measurements may differ by: a sample of the colours is searched.
SAMPLED = 0.0005


def measured(clip: str, frames: str | None, program: Path | None) -> dict[str, Figures]:
    """Return the figures of the default, "", and of the static palettes."""
    ways = {"": (), "as it is": STATIC}
    for settings in PLAIN_HULLS:
        given = " ".join(f"--set {setting}" for setting in settings)
        ways[given] = (*STATIC, *given.split())
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(clip, frames, Path(folder))
        palettes = {name: runs.palette(*options) for name, options in ways.items()}
        return evaluator.measure(clip, palettes, program, frames)


def price(x: Figures) -> float:
    """L' and the cost of the handles: what the default is held to."""
    return x.L_prime + AnalysisOptions().handle_cost * x.vertices


def piece(text: str) -> tuple[str, str | None]:
    """Argparse type: a clip, with or without the frames of a piece."""
    clip, colon, frames = text.rpartition(":")
    try:
        return (clip, frame_range(frames)) if colon else (text, None)
    except argparse.ArgumentTypeError:  # a colon of the path's own
        return text, None


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("clips", metavar="CLIP[:A-B]", type=piece, nargs="+")
    parser.add_argument(
        "--evaluator", metavar="PROGRAM", type=Path, help="measure with it (8-bit clips)"
    )
    args = parser.parse_args()
    rows: list[list[object]] = []
    worse = False
    for clip, frames in args.clips:
        name = f"{Path(clip).stem} {frames or ''}".strip()
        figures = measured(clip, frames, args.evaluator)
        own = figures.pop("")
        convex = {way: x for way, x in figures.items() if x.concavity <= CONCAVE}
        best = min(convex or figures, key=lambda way: price(figures[way]))
        bound = figures[best].L_prime
        worse |= price(own) > price(figures[best]) + SAMPLED
        concavity = evaluator.share(figures[best].concavity)
        rows.append([name, f"{bound:.4f}", concavity, f"{own.L_prime:.4f}", own.vertices, best])
        say(f"{name}: " + ", ".join(f"{way}: {x.L_prime:.4f}" for way, x in figures.items()))
    heads = ["clip", "best static palette, L'", "its concavity", "default, L'", "handles"]
    heads.append("options of the static")
    print(table(heads, rows))
    sys.exit("stopped: the default is worse than a static palette" if worse else 0)


if __name__ == "__main__":
    main()
