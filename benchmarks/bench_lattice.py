"""How fast and how close is the lattice on real frames, against exact mode and OpenColorIO?

    python benchmarks/bench_lattice.py SIDECAR CLIP [SIDECAR CLIP ...] [--frames 5,32,42,49]
        [--size 3840x2160]

Every frame is scaled to that size in float (OpenImageIO, Lanczos: it overshoots, as filters do) and
recoloured three ways, each by one thread and by two: exactly; by a lattice that is made for it, the
making included, as each frame of a clip that plays needs it; by a lattice that is there already, as
where palette and edit stay. The peer is OpenColorIO's CPU processor with a 3D LUT, tetrahedral, the
best of its optimisations, from the same float picture into another, as the lattice does, of three
and of four channels; its LUT is there already; two threads take half of the picture each. The error
is measured on every pixel, by the CLF finishing-tier measure.

Rates are medians of several runs in million pixels a second; all run in turn. `thread` columns are
of one thread's own processor time, which suffers less when others use the machine; two threads are
held against the clock and, in brackets, against the processor time of both.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import PyOpenColorIO as ocio
from bench_recolour import HD, UHD, UHD8K, hull, picks_in, rates
from numpy.typing import NDArray

from palette4d import _core

F32 = NDArray[np.float32]
# Nodes a side of OpenColorIO's LUTs: a usual one, the lattice's own, and the most that it takes.
SIZES = (33, 73, 129)
OPTIMISATIONS = ("NONE", "LOSSLESS", "VERY_GOOD", "DEFAULT", "DRAFT", "ALL")


def scaled(pixels: F32, width: int, height: int) -> F32:
    """Return an (h, w, 3 or more) picture as (height, width, 3) float32."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, oiio.FLOAT)
    source = oiio.ImageBuf(spec)
    source.set_pixels(spec.roi, np.ascontiguousarray(pixels[:, :, :3]))
    roi = oiio.ROI(0, width, 0, height, 0, 1, 0, 3)
    result = oiio.ImageBufAlgo.resize(source, filtername="lanczos3", roi=roi)
    return np.ascontiguousarray(result.get_pixels(oiio.FLOAT))


def with_alpha(image: F32) -> F32:
    """Return the picture with an opaque fourth channel."""
    return np.concatenate([image, np.ones((*image.shape[:2], 1), np.float32)], axis=2)


Apply = Callable[[], object]


def best_processor(recolourer: _core.Recolourer, size: int, image: F32) -> ocio.CPUProcessor:
    """Return OpenColorIO's tetrahedral LUT of so many nodes a side, the fastest of its kinds."""
    samples = np.linspace(0, 1, size, dtype=np.float32)
    grid = np.stack(np.meshgrid(samples, samples, samples, indexing="ij"), axis=-1)
    table = recolourer.apply(np.ascontiguousarray(grid.reshape(size, -1, 3)), precision="single")
    lut = ocio.Lut3DTransform(size)
    lut.setInterpolation(ocio.INTERP_TETRAHEDRAL)
    lut.setData(table.reshape(-1))
    processor = ocio.Config.CreateRaw().getProcessor(lut)
    out = np.empty_like(image)
    found = []
    for name in OPTIMISATIONS:
        candidate = processor.getOptimizedCPUProcessor(getattr(ocio, f"OPTIMIZATION_{name}"))
        apply = applied(candidate, image, out)
        taken = []
        for _ in range(3):
            started = time.thread_time()
            apply()
            taken.append(time.thread_time() - started)
        found.append((statistics.median(taken), len(found), candidate))
    return min(found)[2]


def applied(processor: ocio.CPUProcessor, image: F32, out: F32) -> Apply:
    """Return what applies a processor to a picture, of which `out` receives the result."""
    height, width, channels = image.shape
    source = ocio.PackedImageDesc(image, width, height, channels)
    target = ocio.PackedImageDesc(out, width, height, channels)
    return lambda: processor.apply(source, target)


def halves(processor: ocio.CPUProcessor, image: F32, out: F32) -> Apply:
    """Return what lets two threads of such a processor, which has none of its own, take half of the
    picture each."""
    middle = len(image) // 2
    parts = [applied(processor, image[at], out[at]) for at in (slice(middle), slice(middle, None))]

    def apply() -> None:
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            list(pool.map(lambda part: part(), parts))

    return apply


def measure(what: str, recolourer: _core.Recolourer, image: F32, runs: int) -> None:
    """Print one frame's figures."""
    four = with_alpha(image)
    expected = recolourer.apply(image, precision="single", threads=0)
    ready = _core.Lattice(recolourer)
    found = ready.apply(image, threads=0)
    ready.apply(four)
    wanted = expected.astype(np.float64)
    error = np.abs(found - wanted) / np.maximum(np.abs(wanted), 0.1)
    seen, size = ready.largest_error, ready.size
    del wanted
    out, out4 = np.empty_like(image), np.empty_like(four)
    luts = {n: best_processor(recolourer, n, four) for n in SIZES}
    one: dict[str, Apply] = {
        "exact": lambda: recolourer.apply(image, precision="single", out=out),
        "made": lambda: _core.Lattice(recolourer).apply(image, out=out),
        "made RGBA": lambda: _core.Lattice(recolourer).apply(four, out=out4),
        "ready": lambda: ready.apply(image, out=out),
        "ready RGBA": lambda: ready.apply(four, out=out4),
    }
    for n, lut in luts.items():
        one[f"OCIO {n}"] = applied(lut, image, out)
        one[f"OCIO {n} RGBA"] = applied(lut, four, out4)
    pixels = image.size // 3
    thread = rates(pixels, runs, one)
    two: dict[str, Apply] = {
        "exact": lambda: recolourer.apply(image, precision="single", threads=2, out=out),
        "made": lambda: _core.Lattice(recolourer).apply(image, threads=2, out=out),
        "made RGBA": lambda: _core.Lattice(recolourer).apply(four, threads=2, out=out4),
        "ready": lambda: ready.apply(image, threads=2, out=out),
        "ready RGBA": lambda: ready.apply(four, threads=2, out=out4),
    }
    for n, lut in luts.items():
        two[f"OCIO {n} RGBA"] = halves(lut, four, out4)
    wall, work = rates(pixels, runs, two, time.perf_counter), rates(pixels, runs, two)
    playing = 24 * pixels / 1e6
    print(f"{what}: {size}")
    print(
        f"  largest error {error.max():.5f} of every pixel, {seen:.5f} as the lattice says;"
        f" above 0.002: {int((error > _core.LATTICE_TOLERANCE).sum())}"
    )
    print("  thread:     " + ", ".join(f"{name} {rate:.1f}" for name, rate in thread.items()))
    print(
        f"  ratios:     made / exact {thread['made'] / thread['exact']:.2f},"
        f" ready / exact {thread['ready'] / thread['exact']:.2f};"
        f" to OCIO's {', '.join(map(str, SIZES))}, RGB: made"
        + ",".join(f" {thread['made'] / thread[f'OCIO {n}']:.2f}" for n in luts)
        + "; RGBA: made"
        + ",".join(f" {thread['made RGBA'] / thread[f'OCIO {n} RGBA']:.2f}" for n in luts)
        + ", ready"
        + ",".join(f" {thread['ready RGBA'] / thread[f'OCIO {n} RGBA']:.2f}" for n in luts)
    )
    print(
        "  ratios of two threads by the clock, RGBA: ready"
        + ",".join(f" {wall['ready RGBA'] / wall[f'OCIO {n} RGBA']:.2f}" for n in luts)
        + "; made"
        + ",".join(f" {wall['made RGBA'] / wall[f'OCIO {n} RGBA']:.2f}" for n in luts)
    )
    print(
        "  two threads: "
        + ", ".join(
            f"{name} {wall[name]:.1f} ({2 * work[name]:.1f}),"
            f" {100 * wall[name] / playing:.0f} % ({200 * work[name] / playing:.0f} %)"
            for name in two
        )
        + f" of the {playing:.0f} Mpix/s that 24 frames a second are",
        flush=True,
    )


def with_picks(
    what: str, cut: _core.Slice, edited: NDArray[np.float64], image: F32, runs: int
) -> None:
    """Print what three picks and two holds cost a lattice on one thread, in turn with none."""
    ways: dict[str, Apply] = {}
    for name, picks in (("none", None), ("five", picks_in(image, 3, holds=2))):
        recolourer = _core.Recolourer(cut.rgb, edited, cut.faces, picks=picks)
        ready, out = _core.Lattice(recolourer), np.empty_like(image)
        ready.apply(image, out=out)
        ways[f"ready {name}"] = lambda ready=ready, out=out: ready.apply(image, out=out)
        ways[f"made {name}"] = lambda r=recolourer, out=out: _core.Lattice(r).apply(image, out=out)
    found = rates(image.size // 3, runs, ways)
    times = [f"{n} {found[f'{n} none'] / found[f'{n} five']:.2f}" for n in ("ready", "made")]
    print(f"{what}: time with three picks and two holds, of that without: {', '.join(times)}")


def growth(recolourer: _core.Recolourer, image: F32, runs: int, plot: Path | None) -> None:
    """Print how the last frame's cost grows with palettes, pictures, threads; draw it."""

    def work(cut: _core.Recolourer, picture: F32, threads: int, out: F32) -> dict[str, float]:
        ways: dict[str, Apply] = {
            "exact": lambda: cut.apply(picture, precision="single", threads=threads, out=out),
            "lattice": lambda: _core.Lattice(cut).apply(picture, threads=threads, out=out),
        }
        return rates(picture.size // 3, runs, ways)

    by_vertices: dict[int, dict[str, float]] = {}
    half = np.ascontiguousarray(image[: len(image) // 2])
    for vertices in (4, 6, 8, 12, 16, 20, 24):
        by_vertices[vertices] = work(
            _core.Recolourer(*hull(vertices)), half, 1, np.empty_like(half)
        )
    pictures = {HD: image[::2, ::2], UHD: image, UHD8K: np.tile(image, (2, 2, 1))}
    by_size: dict[str, dict[str, float]] = {}
    for (width, height), view in pictures.items():
        picture = np.ascontiguousarray(view)
        by_size[f"{width}x{height}"] = work(recolourer, picture, 1, np.empty_like(picture))
    by_threads = {n: work(recolourer, image, n, np.empty_like(image)) for n in (1, 2, 4)}
    for what, table in (
        ("palette vertices, a third of them moved", by_vertices),
        ("picture", by_size),
        ("threads, of processor time", by_threads),
    ):
        print(f"{what}:")
        for key, found in table.items():
            print(f"  {key}: exact {found['exact']:.1f}, lattice {found['lattice']:.1f} Mpix/s")
    if plot is None:
        return
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.5), layout="constrained")
    for axes, table, label in zip(
        figure.subplots(1, 3),
        (by_vertices, by_size, by_threads),
        ("palette vertices", "picture", "threads"),
        strict=True,
    ):
        for way in ("exact", "lattice"):
            keys = [str(key) for key in table]
            axes.plot(keys, [found[way] for found in table.values()], "o-", label=way)
        axes.set(xlabel=label, ylabel="Mpix/s a thread", ylim=(0, None))
        axes.legend()
    figure.savefig(plot, dpi=120)
    print(f"wrote {plot}")


def main() -> None:
    """Run the comparisons and print their figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pairs", nargs="+", metavar="SIDECAR CLIP", help="edited sidecars, clips")
    parser.add_argument("--frames", action="append", default=[], help="of each pair, in turn")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument(
        "--size", default="{}x{}".format(*UHD), metavar="WxH", help="of the pictures"
    )
    parser.add_argument("--growth", action="store_true", help="also how cost grows")
    parser.add_argument("--plot", type=Path, help="draw that")
    args = parser.parse_args()
    if len(args.pairs) % 2:
        parser.error("expected pairs: SIDECAR CLIP")
    width, height = map(int, args.size.split("x"))
    if args.growth and (width, height) != UHD:
        parser.error("--growth goes by pictures of {}x{}".format(*UHD))
    from palette4d.media.clip import open_clip

    last = None
    for k, (path, clip) in enumerate(zip(args.pairs[::2], args.pairs[1::2], strict=True)):
        sidecar = _core.read_sidecar(path)
        frames = args.frames[k] if k < len(args.frames) else None
        for image in open_clip(clip, frames=frames).iter_images():
            cut = _core.slice_at(sidecar.polytope, image.frame)
            edited = _core.edited_colours(sidecar.polytope, sidecar.edits, cut)
            recolourer = _core.Recolourer(cut.rgb, edited, cut.faces)
            last = recolourer, scaled(image.pixels, width, height)
            measure(f"{Path(path).name} at {image.frame}", *last, args.runs)
            with_picks(f"{Path(path).name} at {image.frame}", cut, edited, last[1], args.runs)
    if args.growth and last:
        growth(*last, args.runs, args.plot)


if __name__ == "__main__":
    main()
