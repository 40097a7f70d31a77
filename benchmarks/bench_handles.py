"""How good is a palette with a given number of handles, and what do more handles cost?

Runs `palette4d analyze --vertices N` from the fewest vertices that a clip's structure allows to 40,
and measures each palette on every pixel; the static hull stands at one end, hulls of single frames
that know nothing of each other at the other. A second table changes one option at a time.

    python benchmarks/bench_handles.py CLIP [--out DIR]

Prints Markdown; `--out` takes the plot of L' against vertices, handles.png.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import evaluator
import numpy as np
from evaluator import PAPER_RULES, Figures, Runs, TimedPalette, say, table
from palette4d.analysis import colour_statistics, frame_hulls
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.options import AnalysisOptions

from palette4d.media.clip import open_clip

SINGLY, THEN = 24, (26, 28, 32, 36, 40)
DEFAULT = "default"
HANDLE_COST = AnalysisOptions().handle_cost
# What the shape of a palette costs: one option at a time, then all of the shape terms off.
TRADES: dict[str, tuple[str, ...]] = {
    DEFAULT: (),
    "--set separation=0": ("--set", "separation=0"),
    "--set convexity=0": ("--set", "convexity=0"),
    "--set reach=0": ("--set", "reach=0"),
    "all three of these": ("--set", "separation=0", "--set", "convexity=0", "--set", "reach=0"),
    "--set merge_distance=0.15": ("--set", "merge_distance=0.15"),
    "--set merge_distance=0.05": ("--set", "merge_distance=0.05"),
    "--set handle_cost=0.001": ("--set", "handle_cost=0.001"),
    "--set handle_cost=0.005": ("--set", "handle_cost=0.005"),
    "--set blocks=1": ("--set", "blocks=1"),
}
STATIC = ("--method", "static")
# The paper's rules alone, and with this program's hulls and shape terms.
PURPLES = ("#8a5ab5", "#c9a9dd")
PAPER = {"the paper's rules": PAPER_RULES, "--method paper": ("--method", "paper")}


def counts(fewest: int) -> list[int]:
    """Return the numbers of vertices to ask for."""
    return [*range(fewest, SINGLY + 1), *(n for n in THEN if n > max(fewest, SINGLY))]


def groups(asked: dict[int, TimedPalette]) -> list[list[int]]:
    """Return the numbers asked for, together where one palette came out."""
    out: list[list[int]] = []
    for n, palette in asked.items():
        if out and np.array_equal(asked[out[-1][0]].vertices, palette.vertices):
            out[-1].append(n)
        else:
            out.append([n])
    return out


def same_result(group: list[int]) -> str:
    """Name the runs of one palette."""
    return f"`--vertices {group[0]}`" + (f" to {group[-1]}" if len(group) > 1 else "")


def code(words: str) -> str:
    """Return options as code, other words as they are."""
    return f"`{words}`" if words.startswith("--") else words


def single_hulls(clip: str, frames: str | None) -> TimedPalette:
    """Return each frame's own refined hull, as the analysis begins with."""
    options = AnalysisOptions()
    gathered = [
        colour_statistics.gather(number, image, options)
        for number, image in open_clip(clip, frames=frames).iter_colours()
    ]
    usable = [s for s in gathered if s is not None]
    gamut = Gamut.of(usable)
    palettes = {s.frame: frame_hulls.frame_palette(s.coarse, gamut, options) for s in usable}
    return TimedPalette.of_hulls({n: (p.rgb, p.faces) for n, p in palettes.items()})


def cells(x: Figures) -> list[str | None]:
    """Return a palette's cells below `header`."""
    return [
        str(x.vertices) if x.vertices else None,
        str(x.blocks) if x.blocks else None,
        f"{x.colours:.1f}",
        *evaluator.fit_cells(x),
        f"{x.L_prime + HANDLE_COST * x.vertices:.4f}" if x.vertices else None,
        f"{x.closest:.3f}",
        evaluator.share(x.concavity, 1),
    ]


def header() -> list[str]:
    """Return the heads of `cells`."""
    names = ["vertices", "blocks", "colours a frame", *evaluator.FIT_HEADER]
    price = f"L' + {HANDLE_COST} a vertex"
    return [*names, price, "nearest colours", "deepest concavity"]


def draw(
    line: Sequence[Figures],
    marks: Sequence[tuple[str, str, Figures]],
    hulls: Figures,
    output: Path,
) -> None:
    """Plot L' against vertices: the command's as a line, others as named marks."""
    import matplotlib.style
    from matplotlib.figure import Figure

    with matplotlib.style.context("default"):
        figure = Figure(figsize=(8, 4.8), layout="constrained")
        axes = figure.add_subplot()
        x = [f.vertices for f in line]
        axes.plot(x, [f.L_prime for f in line], "-o", color="#1f5fa8", markersize=3.5, label="L'")
        axes.plot(x, [f.L for f in line], "--", color="#7aa5d6", linewidth=1.2, label="L")
        name = "L of single frames' hulls"
        axes.axhline(hulls.L, color="#888888", linewidth=1, linestyle=":", label=name)
        for name, colour, f in marks:
            label = f"{name}: L' {f.L_prime:.4f}"
            axes.plot([f.vertices], [f.L_prime], "D", color=colour, markersize=6, label=label)
        axes.set_xlabel("vertices: handles that a user has, over the whole clip")
        axes.set_ylabel("loss (eqs. 4 and 12), every pixel counted")
        # A palette of four colours may be far above all others: the line may leave at the top.
        axes.set_ylim(0, 1.25 * max(f.L_prime for _, _, f in marks))
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.margins(x=0.06)
        axes.grid(color="#e4e4e4", linewidth=0.7)
        axes.set_axisbelow(True)
        axes.legend(frameon=False, fontsize=9)
        figure.savefig(output, dpi=120)
    say(f"wrote {output}")


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    evaluator.add_arguments(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, help="write handles.png here")
    args = parser.parse_args()
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(args.clip, args.frames, Path(folder))
        fewest = len(runs.palette("--vertices", "1").vertices)
        asked = {n: runs.palette("--vertices", str(n)) for n in counts(fewest)}
        palettes = {f"asked {n}": palette for n, palette in asked.items()}
        palettes |= {words: runs.palette(*options) for words, options in TRADES.items()}
        palettes |= {name: runs.palette(*options) for name, options in PAPER.items()}
        palettes["static hull"] = runs.palette(*STATIC)
        uses = {w: runs(*options)["palette"] for w, options in TRADES.items()}
        palettes["hulls"] = single_hulls(args.clip, args.frames)
        figures = evaluator.measure(args.clip, palettes, args.frames)
    rows = [["static hull (`--method static`)", *cells(figures["static hull"])]]
    rows += [[same_result(group), *cells(figures[f"asked {group[0]}"])] for group in groups(asked)]
    rows += [[code(name), *cells(figures[name])] for name in PAPER]
    rows += [["single frames' hulls", *cells(figures["hulls"])]]
    print("### L against vertices\n\n" + table(["palette", *header()], rows))
    rows = []
    for words in TRADES:
        use = uses[words]
        splits = f"{use['splits']}, {use['merges']}"
        cell = f"{use['least_use']:.1%}"
        rows.append([code(words), *cells(figures[words]), splits, cell])
    heads = ["options", *header(), "splits, merges", "use of the least used"]
    print("### What is traded for what\n\n" + table(heads, rows))
    if args.out:
        args.out.mkdir(parents=True, exist_ok=True)
        marks = [("default", "#1f5fa8", figures[DEFAULT])]
        marks += [("static hull", "#3c8a4e", figures["static hull"])]
        marks += [(name, c, figures[name]) for name, c in zip(PAPER, PURPLES, strict=True)]
        line = {f.vertices: f for f in (figures[f"asked {n}"] for n in asked)}
        chosen = [line[n] for n in sorted(line)]
        draw(chosen, marks, figures["hulls"], args.out / "handles.png")
    say(f"{time.perf_counter() - started:.0f} s in all, {os.cpu_count()} cores")


if __name__ == "__main__":
    main()
