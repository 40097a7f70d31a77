"""What does an analysis cost, and how good is its palette?

Runs `palette4d analyze` in fresh processes on a clip and, in turn, a process that only reads the
same frames (the peer). Prints medians of their user CPU seconds, wall seconds and peak memory, the
ratio, the time by stage, and the quality of the palette, measured on every pixel.

    python benchmarks/bench_analysis.py CLIP [--runs 5] [--frames A-B]
                                        [-- options of analyze]
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import evaluator
from evaluator import TimedPalette, say, table

READ = """
import sys
from palette4d.media.clip import open_clip
for _ in open_clip(sys.argv[1], frames=sys.argv[2] or None).iter_colours():
    pass
"""


@dataclasses.dataclass(frozen=True)
class Cost:
    """What a process took: user and system CPU seconds, wall seconds, peak memory in MB."""

    user: float
    system: float
    wall: float
    memory: float


def cost_of(command: Sequence[str | Path]) -> tuple[Cost, str]:
    """Run a command to its end; return what it took and what it printed."""
    started = time.perf_counter()
    with tempfile.TemporaryFile("w+") as out:
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - started
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            sys.exit(f"stopped: {' '.join(map(str, command))} ended with {process.returncode}")
        out.seek(0)
        text = out.read()
    # Linux counts in KiB, macOS in bytes.
    unit = 1 if sys.platform == "darwin" else 1024
    return Cost(used.ru_utime, used.ru_stime, wall, used.ru_maxrss * unit / 1e6), text


def median(costs: Sequence[Cost]) -> Cost:
    """Return the medians, each of its own."""
    columns = zip(*(dataclasses.astuple(c) for c in costs), strict=True)
    return Cost(*(statistics.median(column) for column in columns))


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    evaluator.add_arguments(parser)
    parser.add_argument("--runs", type=int, default=5)
    parser.epilog = "Options of analyze may follow after --."
    given = sys.argv[1:]
    split = given.index("--") if "--" in given else len(given)
    args, options = parser.parse_args(given[:split]), given[split + 1 :]
    reads, analyses, stages = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        sidecar = Path(folder) / "clip.p4d.json"
        read = [sys.executable, "-c", READ, args.clip, args.frames or ""]
        analyze = [sys.executable, "-m", "palette4d", "analyze", args.clip, "-o", sidecar, "--json"]
        analyze += ["--frames", args.frames] if args.frames else []
        for run in range(args.runs):
            reads.append(cost_of(read)[0])
            cost, text = cost_of([*analyze, *options])
            analyses.append(cost)
            stages.append(json.loads(text))
            say(f"run {run + 1}: read {reads[-1].user:.2f} s, analyze {cost.user:.2f} s")
        palettes = {"result": TimedPalette.of_sidecar(sidecar)}
        quality = evaluator.measure(args.clip, palettes, args.frames)["result"]
    frames = len(palettes["result"].cuts)
    rows = []
    for name, costs in (("read the frames", reads), ("analyze", analyses)):
        c = median(costs)
        cells = [f"{c.user:.2f}", f"{c.system:.2f}", f"{c.wall:.2f}", f"{c.memory:.0f}"]
        rows.append([name, *cells, f"{1000 * c.user / frames:.0f}"])
    heads = ["", "user CPU s", "system CPU s", "wall s", "peak memory MB", "user ms a frame"]
    ratio = statistics.median(a.user / r.user for a, r in zip(analyses, reads, strict=True))
    print(table(heads, rows))
    print(
        f"Medians of {args.runs} runs, {frames} frames, {os.cpu_count()} cores, load "
        f"{os.getloadavg()[0]:.1f} at the end; analyze takes {ratio:.1f} times the user CPU of "
        "reading.\n"
    )

    figures = {row["stage"]: row for row in stages[-1]["stages"]}
    names = [*stages[-1]["seconds"], *(f for f in figures if f not in stages[-1]["seconds"])]
    rows = []
    for stage in names:
        walls = [s["seconds"][stage] for s in stages if stage in s["seconds"]]
        row = figures.get(stage)
        cells = [f"{row['L']:.4f}", f"{row['L_prime']:.4f}"] if row else [None, None]
        structure = [row["vertices"], row["blocks"]] if row else [None, None]
        wall = f"{statistics.median(walls):.2f}" if walls else None
        rows.append([stage, wall, *structure, *cells])
    print(table(["stage", "wall s", "vertices", "blocks", "L", "L'"], rows))

    row = [quality.vertices, quality.blocks, *evaluator.fit_cells(quality)]
    print(table(["vertices", "blocks", *evaluator.FIT_HEADER], [row]))


if __name__ == "__main__":
    main()
