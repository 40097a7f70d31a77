"""How do time and memory of an analysis grow with a clip's frames and with its resolution?

Draws movies (the sample clip's scene from day to night, with grain; H.264, 4:2:0, 8 bit) into a
temporary folder, then runs `palette4d analyze` on each in a fresh process and, in turn, one that
only decodes it (the peer). Prints medians of user CPU, wall time and peak memory as a table, and
saves them as a plot.

    python benchmarks/bench_growth.py [--quick] [--runs 3] [--out growth.png] [-- analyze's options]

The whole takes a quarter of an hour on two cores, --quick two minutes.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

FRAMES = (25, 50, 100, 200, 400, 800, 1600)
SMALL = (640, 360)
SIZES = {
    "SD": (720, 576),
    "HD": (1280, 720),
    "Full HD": (1920, 1080),
    "UHD": (3840, 2160),
    "8K": (7680, 4320),
}
SHORT = 25
QUICK_FRAMES, QUICK_SIZES, QUICK_SHORT = (25, 100, 400), ("SD", "Full HD", "UHD"), 8
GRAIN = 2.0  # standard deviation in steps of 8-bit luma

DECODE = """
import sys, av
with av.open(sys.argv[1]) as container:
    stream = container.streams.video[0]
    stream.thread_type = "AUTO"
    for _ in container.decode(stream):
        pass
"""


@dataclass(frozen=True)
class Case:
    """One movie to measure."""

    series: str
    label: str
    frames: int
    size: tuple[int, int]

    @property
    def megapixels(self) -> float:
        """Of a frame."""
        return self.size[0] * self.size[1] / 1e6


@dataclass(frozen=True)
class Cost:
    """What a process took: seconds of user CPU and by the clock, and peak memory in MB."""

    cpu: float
    wall: float
    memory: float


def draw(path: Path, frames: int, width: int, height: int) -> None:
    """Encode one movie; always the same for the same arguments."""
    import av
    import numpy as np

    from palette4d.demo.scene import Scene

    scene, keys = Scene(480, 270), 25
    pictures = [scene.picture(i / (keys - 1)) for i in range(keys)]
    generator = np.random.default_rng(1)
    tile = GRAIN * generator.standard_normal((1 << 20) + width).astype(np.float32)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"preset": "ultrafast", "crf": "20"}
        for index in range(frames):
            at = index / max(frames - 1, 1) * (keys - 1)
            before = min(int(at), keys - 2)
            share = at - before
            mixed = (1 - share) * pictures[before] + share * pictures[before + 1]
            picture = av.VideoFrame.from_ndarray(np.rint(mixed * 255).astype(np.uint8), "rgb24")
            picture = picture.reformat(width, height, "yuv420p", interpolation="BICUBIC")
            plane = picture.planes[0]
            luma = np.frombuffer(plane, np.uint8).reshape(height, plane.line_size).copy()
            for row in luma:
                start = int(generator.integers(1 << 20))
                row[:width] = np.clip(row[:width] + tile[start : start + width] + 0.5, 0, 255)
            plane.update(luma)
            picture.pts = index
            container.mux(stream.encode(picture))
        container.mux(stream.encode())


def measure(command: list[str]) -> Cost:
    """Run a command to its end. Its memory must not be hidden by that of this process: it is kept
    small, and nothing is drawn in it."""
    started = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(command)} failed")
    return Cost(usage.ru_utime, time.perf_counter() - started, usage.ru_maxrss / 1024)


def median(costs: list[Cost]) -> Cost:
    """Return the median of each figure."""
    return Cost(
        statistics.median(c.cpu for c in costs),
        statistics.median(c.wall for c in costs),
        statistics.median(c.memory for c in costs),
    )


def run(case: Case, runs: int, options: list[str]) -> tuple[Cost, Cost]:
    """Return the costs of decoding and of analysing."""
    decodes, analyses = [], []
    with tempfile.TemporaryDirectory() as folder:
        movie, sidecar = Path(folder) / "clip.mp4", Path(folder) / "clip.p4d.json"
        shape = (str(case.frames), *map(str, case.size))
        measure([sys.executable, __file__, "--draw", str(movie), *shape])
        analyze = [sys.executable, "-m", "palette4d", "analyze", str(movie), "-o", str(sidecar)]
        for _ in range(runs):
            decodes.append(measure([sys.executable, "-c", DECODE, str(movie)]))
            sidecar.unlink(missing_ok=True)
            analyses.append(measure([*analyze, "--quiet", *options]))
    return median(decodes), median(analyses)


def plot(results: list[tuple[Case, Cost, Cost]], path: Path) -> None:
    """Draw CPU time and memory against frames and against resolution."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.ticker import FuncFormatter, NullFormatter

    plain = FuncFormatter(lambda value, _: f"{value:g}")
    figure, axes = pyplot.subplots(2, 2, figsize=(10, 7), layout="constrained")
    for column, series in enumerate(("frames", "resolution")):
        rows = [row for row in results if row[0].series == series]
        x = [case.frames if series == "frames" else case.megapixels for case, *_ in rows]
        cpu, memory = axes[0][column], axes[1][column]
        for which, name, colour in ((2, "analyze", "#2060a0"), (1, "decoding alone", "#c07020")):
            costs: list[Any] = [row[which] for row in rows]
            cpu.plot(x, [c.cpu for c in costs], "o-", color=colour, label=name)
            memory.plot(x, [c.memory for c in costs], "o-", color=colour, label=name)
        beyond = [analysis.cpu - decode.cpu for _, decode, analysis in rows]
        cpu.plot(x, beyond, "--", color="#2060a0", label="analyze less decoding")
        if series == "frames":
            linear = [beyond[-1] * n / x[-1] for n in x]
            cpu.plot(x, linear, ":", color="grey", label="in proportion to frames")
        cpu.set_yscale("log")
        cpu.set_ylabel("user CPU, s")
        memory.set_ylabel("peak memory, MB")
        memory.set_ylim(0, max(1050, *(row[2].memory * 1.05 for row in rows)))
        memory.axhline(1000, color="grey", linestyle=":", label="1 GB")
        for axis in (cpu, memory):
            axis.set_xscale("log")
            axis.set_xticks(x, [str(n) for n in x] if series == "frames" else None)
            axis.xaxis.set_major_formatter(plain)
            axis.xaxis.set_minor_formatter(NullFormatter())
            axis.grid(alpha=0.3)
            axis.legend(fontsize=8)
        case = rows[0][0]
        if series == "frames":
            cpu.set_title(f"{case.size[0]}x{case.size[1]}")
            memory.set_xlabel("frames")
        else:
            cpu.set_title(f"{case.frames} frames")
            memory.set_xticks(x, [f"{case.label}\n{case.megapixels:.3g}" for case, *_ in rows])
            cpu.set_xticks(x, [case.label for case, *_ in rows])
            memory.set_xlabel("megapixels")
    figure.savefig(path, dpi=110)


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer and smaller clips, one run")
    parser.add_argument("--runs", type=int, default=0, help="runs of each (3; 1 with --quick)")
    parser.add_argument("--out", type=Path, default=Path("growth.png"), help="the plot")
    parser.add_argument("--draw", nargs=4, help=argparse.SUPPRESS)
    parser.add_argument("options", nargs="*", help="options of analyze, after --")
    args = parser.parse_args()
    if args.draw:
        path, *shape = args.draw
        draw(Path(path), *map(int, shape))
        return
    lengths = QUICK_FRAMES if args.quick else FRAMES
    sizes = QUICK_SIZES if args.quick else tuple(SIZES)
    short = QUICK_SHORT if args.quick else SHORT
    cases = [Case("frames", "", n, SMALL) for n in lengths]
    cases += [Case("resolution", name, short, SIZES[name]) for name in sizes]
    print(f"{os.cpu_count()} cores; medians of {args.runs or (1 if args.quick else 3)}\n")
    print("| frames | size | decode CPU s | analyze CPU s | beyond, ms a frame | wall s | MB |")
    print("|---|---|---|---|---|---|---|")
    results = []
    for case in cases:
        decode, analysis = run(case, args.runs or (1 if args.quick else 3), args.options)
        results.append((case, decode, analysis))
        beyond = 1000 * (analysis.cpu - decode.cpu) / case.frames
        print(
            f"| {case.frames} | {case.label} {case.size[0]}x{case.size[1]} | {decode.cpu:.2f} "
            f"| {analysis.cpu:.2f} | {beyond:.0f} | {analysis.wall:.2f} | {analysis.memory:.0f} |",
            flush=True,
        )
    plot(results, args.out)
    print(f"\nwrote {args.out}")


if __name__ == "__main__":
    main()
