"""What does an analysis cost, and how good is its palette?

Runs `palette4d analyze` in fresh processes on a clip and, in turn, a process that only reads the
same frames (the peer). Prints medians of their user CPU seconds, the ratio, the time by stage and
the losses by stage.

    python benchmarks/bench_analysis.py CLIP [--runs 5] [-- options of analyze]
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

READ = """
import sys
from palette4d.analysis.clip import open_clip
for _ in open_clip(sys.argv[1]).iter_colours():
    pass
"""


def user_seconds(command: list[str]) -> tuple[float, str]:
    """Return the user CPU seconds of a command, its children included, and what it printed."""
    before = os.times().children_user
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return os.times().children_user - before, done.stdout


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("clip")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("options", nargs="*", help="options of analyze, after --")
    args = parser.parse_args()
    reads, analyses, stages = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        sidecar = str(Path(folder) / "clip.p4d.json")
        analyze = [sys.executable, "-m", "palette4d", "analyze", args.clip, "-o", sidecar, "--json"]
        for run in range(args.runs):
            reads.append(user_seconds([sys.executable, "-c", READ, args.clip])[0])
            seconds, report = user_seconds([*analyze, *args.options])
            analyses.append(seconds)
            stages.append(json.loads(report))
            print(f"run {run + 1}: read {reads[-1]:.2f} s, analyze {seconds:.2f} s", flush=True)
    read, analysis = statistics.median(reads), statistics.median(analyses)
    ratio = statistics.median(a / r for a, r in zip(analyses, reads, strict=True))
    print(f"\nuser CPU, medians: read {read:.2f} s, analyze {analysis:.2f} s, ratio {ratio:.1f}")
    print("\nstage               wall s  vertices  blocks        L       L'")
    rows = {row["stage"]: row for row in stages[-1]["stages"]}
    for stage in stages[-1]["seconds"]:
        wall = statistics.median(s["seconds"][stage] for s in stages)
        row = rows.get(stage)
        figures = (
            f"{row['vertices']:>9} {row['blocks']:>7} {row['L']:>8.4f} {row['L_prime']:>8.4f}"
            if row
            else ""
        )
        print(f"{stage:<18} {wall:>7.2f} {figures}")


if __name__ == "__main__":
    main()
