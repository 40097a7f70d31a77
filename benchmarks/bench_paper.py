"""What do the paper's experiments give with this program, with its default and the paper's method?

Sections 6.1 and 6.2 on a clip, by the real command: Table 1 (alpha and eta1), Table 2 (beta),
figure 8 (eta2), figure 9 (vertex refinement), and the comparison of methods. The paper's rules are
`--method paper` with this program's own terms off; its defaults stand beside them. Of the paper's
clips only SEASONS can be had; the rows of its other clips are the paper's numbers, for orientation.

    python benchmarks/bench_paper.py CLIP [--out DIR]

Prints Markdown; `--out` takes the timelines of figures 8 and 9 and of the comparison (PNG).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import chang
import evaluator
import numpy as np
from evaluator import PAPER_RULES, Cut, Figures, Runs, TimedPalette, say, table
from palette4d.analysis.losses import NO_FACES

from palette4d import _core
from palette4d.media.clip import open_clip

MERGING_ALONE = ("--set", "eta2=1", "--set", "refinement_cycles=0")
UNREFINED = ("--set", "refinement_cycles=0")

ALPHAS, ETA1S = (5, 10, 15), (1.5, 3.5, 6.0)
BETAS = (0, 1, 2, 5)
ETA2S = (1.5, 3.0, 6.0)

# The paper's own numbers: blocks at first, then for each alpha and eta1; mean palette size.
TABLE_1 = {
    "FOREST": (61, 3, 1, 1, 3, 2, 1, 5, 2, 1),
    "STREET": (75, 8, 3, 1, 12, 3, 2, 13, 4, 2),
    "CLOUD": (77, 1, 1, 1, 2, 1, 1, 5, 1, 1),
    "NIGHT": (74, 1, 1, 1, 6, 3, 1, 6, 2, 1),
    "WATER": (98, 5, 2, 1, 9, 3, 2, 12, 5, 2),
}
TABLE_2 = {
    "FOREST": (8.0, 7.4, 7.4, 7.4),
    "STREET": (8.0, 8.0, 8.0, 8.0),
    "CLOUD": (8.0, 7.0, 7.0, 7.0),
    "NIGHT": (7.0, 7.0, 6.6, 6.6),
    "WATER": (7.4, 7.0, 7.0, 7.0),
}
FIGURE_8 = {1.5: 26, 3.0: 20, 6.0: 18}  # vertices, PLAYGROUND
# Section 6.2's compactness of SEASONS; no clip but that one has numbers here and frames.
COMPACTNESS = {"paper": 0.036, "static": 0.0649, "rgbt": 0.2635}


def row_of(report: dict[str, Any], stage: str) -> dict[str, Any]:
    """Return what a report says of a stage."""
    return next(row for row in report["stages"] if row["stage"] == stage)


def merged(runs: Runs, alpha: float, eta1: float, beta: float) -> dict[str, Any]:
    """Return the report of an analysis that hardly goes on after block merging."""
    weights = ("--set", f"alpha={alpha}", "--set", f"eta1={eta1}", "--set", f"beta={beta}")
    return runs(*PAPER_RULES, *MERGING_ALONE, *weights)


def table_1(runs: Runs, name: str) -> str:
    """Blocks left after merging."""
    cells: list[Any] = []
    for alpha in ALPHAS:
        for eta1 in ETA1S:
            report = merged(runs, alpha, eta1, 1)
            cells.append(row_of(report, "block_merging")["blocks"])
    first = row_of(report, "frame_hulls")["blocks"]
    header = ["clip", "at first", *(f"α {a}, η₁ {e}" for a in ALPHAS for e in ETA1S)]
    rows = [[f"**{name}**, this program", first, *cells]]
    rows += [[f"{clip}, the paper", *values] for clip, values in TABLE_1.items()]
    return "### Table 1: blocks left after merging\n\n" + table(header, rows)


def table_2(runs: Runs, name: str) -> str:
    """Mean palette size after merging."""
    cells = []
    for beta in BETAS:
        report = merged(runs, 10, 3.5, beta)
        cells.append(f"{report['palette']['colours_a_frame']:.2f}")
    header = ["clip", *(f"β {b}" for b in BETAS)]
    rows = [[f"**{name}**, this program", *cells]]
    rows += [[f"{clip}, the paper", *values] for clip, values in TABLE_2.items()]
    return "### Table 2: mean palette size after merging\n\n" + table(header, rows)


def figure_8_options() -> dict[str, tuple[str, ...]]:
    """Return the analyses of figures 8 and 9 by name."""
    out = {}
    for eta2 in ETA2S:
        out[f"η₂ {eta2}, not refined"] = (*PAPER_RULES, "--set", f"eta2={eta2}", *UNREFINED)
        out[f"η₂ {eta2}"] = (*PAPER_RULES, "--set", f"eta2={eta2}")
    return out


def comparison_options() -> dict[str, tuple[str, ...]]:
    """Return the analyses of section 6.2 by method."""
    return {
        "skew": (),
        "paper": (*PAPER_RULES, "--set", "eta2=3.0"),
        "static": ("--method", "static"),
        "rgbt": ("--method", "rgbt"),
    }


METHOD_NAMES = {
    "skew": "skew polytope, this program's default",
    "paper": "skew polytope, the paper's rules",
    "static": "static RGB hull, refined",
    "rgbt": "convex hull in RGB and time",
    "chang": "k-means palette, Chang et al. 2015",
}


def figure_8(figures: dict[str, Figures]) -> str:
    """Vertices and losses for each eta2, before and after refinement: figures 8 and 9."""
    rows = []
    for eta2 in ETA2S:
        for suffix, words in ((", not refined", "before"), ("", "after")):
            x = figures[f"η₂ {eta2}{suffix}"]
            rows.append(
                [
                    f"{eta2}",
                    words,
                    x.vertices,
                    *evaluator.fit_cells(x),
                    evaluator.share(x.concavity),
                    FIGURE_8[eta2],
                ]
            )
    header = ["η₂", "refinement", "vertices", *evaluator.FIT_HEADER]
    header += ["deepest concavity", "vertices, PLAYGROUND, the paper"]
    return "### Figures 8 and 9: η₂, and vertex refinement\n\n" + table(header, rows)


def comparison(figures: dict[str, Figures], pooled: dict[str, float], is_seasons: bool) -> str:
    """Section 6.2's comparison."""
    header = ["method", "vertices", "colours a frame", *evaluator.FIT_HEADER]
    header += ["nearest colours", "deepest concavity", "C against all frames"]
    if is_seasons:
        header.append("the paper's C")
    rows = []
    for name in METHOD_NAMES:
        x = figures[name]
        row: list[Any] = [METHOD_NAMES[name], x.vertices, f"{x.colours:.1f}"]
        row += [
            *evaluator.fit_cells(x),
            f"{x.closest:.3f}",
            evaluator.share(x.concavity),
            f"{pooled[name]:.4f}",
        ]
        if is_seasons:
            row.append(COMPACTNESS.get(name))
        rows.append(row)
    return "### Section 6.2: methods\n\n" + table(header, rows)


def pooled_compactness(
    clip: str, frames: str | None, palettes: dict[str, TimedPalette]
) -> dict[str, float]:
    """Eq. 3 with the 4D vertices against the pixels of all frames together.

    What the paper's figures come close to; every other column measures eq. 3 frame by frame.
    """
    rgb, counts = np.zeros((0, 3)), np.zeros(0)
    for _, image in open_clip(clip, frames=frames).iter_colours():
        new, many = evaluator.distinct_colours(image)
        rgb, counts = evaluator.merged_colours(
            np.vstack([rgb, new]), np.concatenate([counts, many])
        )
    tree = _core.ColourTree(rgb, counts)
    out = {}
    for name, palette in palettes.items():
        colours = palette.vertices[:, :3]
        gaps = colours - tree.nearest_mean(colours, evaluator.K_PIXELS)
        out[name] = float(np.linalg.norm(gaps, axis=1).mean())
    return out


def clusters(clip: str, frames: str | None) -> TimedPalette:
    """Return the k-means palette of all frames, with vertices at both ends of the clip."""
    numbers = []

    def colours() -> Iterator[tuple[evaluator.F64, evaluator.F64]]:
        for number, image in open_clip(clip, frames=frames).iter_colours():
            numbers.append(number)
            yield evaluator.distinct_colours(image)

    rgb = chang.srgb(chang.extract(*chang.binned(colours())))
    ends, count = (min(numbers), max(numbers)), len(rgb)
    cut = Cut(rgb, NO_FACES, np.eye(count, dtype=bool))
    vertices = np.vstack([np.column_stack([rgb, np.full(count, t)]) for t in ends])
    edges = np.column_stack([np.arange(count), np.arange(count) + count]).astype(np.int32)
    return TimedPalette(dict.fromkeys(numbers, cut), vertices, edges, [ends])


def draw_timelines(sidecars: Sequence[tuple[str, Path]], output: Path, width: int = 860) -> None:
    """Draw the timelines of some sidecars above each other."""
    import matplotlib.style
    from matplotlib.figure import Figure

    from palette4d.plotting import style, timeline
    from palette4d.plotting.rows import PlottedPalette, arrange

    room, margin, points = 30.0, 14.0, 800.0
    read = [(title, _core.read_sidecar(str(path))) for title, path in sidecars]
    panels = []
    for _, sidecar in read:
        palette = PlottedPalette.of(sidecar)
        rows = arrange(palette.frames, palette.rgb, palette.edges)
        tall = min(33.0, 500.0 / rows.count)
        panels.append(timeline.Panel(palette, rows, margin, points - margin, tall))
    height = sum(room + panel.height for panel in panels) + margin
    with matplotlib.style.context("default"), matplotlib.rc_context(style.RC):
        figure = Figure(figsize=(points / 72, height / 72), facecolor=style.PAGE)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_xlim(0, points)
        axes.set_ylim(0, height)
        axes.set_axis_off()
        axes.set_autoscale_on(False)
        top = height
        for (title, sidecar), panel in zip(read, panels, strict=True):
            axes.text(margin, top - 18, title, fontsize=10, color=style.BRIGHT, va="center")
            panel.top = top - room
            top = panel.bottom
            timeline.draw(axes, panel, str(sidecar.clip["encoding"]), {}, {})
        figure.savefig(output, dpi=width / (points / 72), facecolor=style.PAGE)
    say(f"wrote {output}")


def title(words: str, x: Figures) -> str:
    """Return a timeline's heading."""
    return f"{words}: {x.vertices} vertices, L {x.L:.4f}, K {x.K:.2f}"


def main() -> None:
    """Run the experiments."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    evaluator.add_arguments(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, help="write the timelines here")
    args = parser.parse_args()
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        runs = Runs(args.clip, args.frames, Path(folder))
        name = open_clip(args.clip, frames=args.frames).name
        is_seasons = name.lower() == "seasons" and args.frames is None
        texts = [table_1(runs, name), table_2(runs, name)]
        chosen = figure_8_options() | comparison_options()
        palettes = {words: runs.palette(*options) for words, options in chosen.items()}
        palettes["chang"] = clusters(args.clip, args.frames)
        figures = evaluator.measure(args.clip, palettes, args.frames)
        methods = {words: palettes[words] for words in METHOD_NAMES}
        pooled = pooled_compactness(args.clip, args.frames, methods)
        texts += [figure_8(figures), comparison(figures, pooled, is_seasons)]
        if args.out:
            args.out.mkdir(parents=True, exist_ok=True)

            def drawn(names: dict[str, str], file: str) -> None:
                draw_timelines(
                    [
                        (title(words, figures[key]), runs.path(*chosen[key]))
                        for key, words in names.items()
                    ],
                    args.out / file,
                )

            drawn({f"η₂ {e}": f"η₂ = {e}" for e in ETA2S}, "figure_8.png")
            # Where most stops are left, refinement has most to do.
            drawn(
                {"η₂ 1.5": "with vertex refinement", "η₂ 1.5, not refined": "without"},
                "figure_9.png",
            )
            drawn({key: METHOD_NAMES[key] for key in comparison_options()}, "methods.png")
    print("\n".join(texts))
    say(f"{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    main()
