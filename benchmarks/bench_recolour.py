"""How fast is recolouring, exactly, and how does its cost grow?

Peers, measured in turn with it: `scalar_recolour.cpp`, a straightforward scalar implementation in
double precision (compiled here with ``c++ -O3``), the core's own double precision, and
OpenColorIO's CPU processor applying a 3D LUT by tetrahedral interpolation to the same float image
(which is what a bake costs, and not exact).

    python benchmarks/bench_recolour.py [--sidecar S --clip CLIP --frame T] [--plot OUT.png]

Prints medians of several runs in million pixels a second and as ratios. One thread is measured by
its processor time, several by the clock, which others on the machine slow down.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import PyOpenColorIO as ocio
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from palette4d import _core

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
Palette = tuple[F64, F64, I32]  # original, edited, faces

HD, UHD, UHD8K = (1920, 1080), (3840, 2160), (7680, 4320)


def hull(vertices: int, seed: int = 1) -> Palette:
    """Make a palette with so many colours, all on its hull, a third of them edited."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(vertices, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    rgb = 0.5 + 0.5 * directions
    faces = []
    shape = ConvexHull(rgb)
    for (a, b, c), equation in zip(shape.simplices.tolist(), shape.equations, strict=True):
        outwards = np.cross(rgb[b] - rgb[a], rgb[c] - rgb[a]) @ equation[:3] > 0
        faces.append([a, b, c] if outwards else [a, c, b])
    edited = rgb.copy()
    edited[::3] += rng.uniform(-0.3, 0.3, edited[::3].shape)
    return rgb, edited, np.array(faces, np.int32)


def inside(palette: Palette, width: int, height: int, seed: int = 2) -> F32:
    """Make a (height, width, 3) picture of colours evenly spread inside of a convex palette."""
    rng = np.random.default_rng(seed)
    shape = ConvexHull(palette[0])
    kept: list[F64] = []
    while sum(map(len, kept)) < width * height:
        colours = rng.uniform(0, 1, (width * height, 3))
        depth = shape.equations[:, :3] @ colours.T + shape.equations[:, 3:]
        kept.append(colours[(depth < 0).all(axis=0)])
    return np.concatenate(kept)[: width * height].reshape(height, width, 3).astype(np.float32)


def compiled_peer(folder: Path) -> Callable[[Palette, F32], F32]:
    """Compile scalar_recolour.cpp; returns its recolouring of an (h, w, 3) picture."""
    library = folder / "scalar.so"
    source = Path(__file__).with_name("scalar_recolour.cpp")
    compiler = os.environ.get("CXX", "c++")
    subprocess.run(
        [compiler, "-std=c++17", "-O3", "-shared", "-fPIC", source, "-o", library], check=True
    )
    function = ctypes.CDLL(str(library)).recolour_scalar
    function.argtypes = [
        *(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p, ctypes.c_int),
        *(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ssize_t),
    ]
    function.restype = None

    def recolour(palette: Palette, image: F32) -> F32:
        rgb, edited, faces = palette
        delta, out = np.ascontiguousarray(edited - rgb), np.empty_like(image)
        function(
            *(rgb.ctypes.data, delta.ctypes.data, len(rgb), faces.ctypes.data, len(faces)),
            *(image.ctypes.data, out.ctypes.data, image.size // 3),
        )
        return out

    return recolour


def ocio_processor(recolourer: _core.Recolourer, size: int) -> Callable[[F32], None]:
    """Return OpenColorIO's tetrahedral interpolation of the edit, in place."""
    samples = np.linspace(0, 1, size, dtype=np.float32)
    grid = np.stack(np.meshgrid(samples, samples, samples, indexing="ij"), axis=-1)
    table = recolourer.apply(np.ascontiguousarray(grid.reshape(size, -1, 3)), threads=0)
    lut = ocio.Lut3DTransform(size)
    lut.setInterpolation(ocio.INTERP_TETRAHEDRAL)
    lut.setData(table.reshape(-1))
    processor = ocio.Config.CreateRaw().getProcessor(lut).getDefaultCPUProcessor()

    def apply(image: F32) -> None:
        processor.applyRGB(image)

    return apply


def rates(
    pixels: int,
    runs: int,
    works: dict[str, Callable[[], object]],
    clock: Callable[[], float] = time.process_time,
) -> dict[str, float]:
    """Run all in turn, several times; returns median million pixels a second by name."""
    times: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(runs):
        for name, work in works.items():
            started = clock()
            work()
            times[name].append(clock() - started)
    return {name: pixels / statistics.median(taken) / 1e6 for name, taken in times.items()}


def exact(recolourer: _core.Recolourer, image: F32, threads: int) -> Callable[[], F32]:
    """Return a call of what the node does."""
    out = np.empty_like(image)
    return lambda: recolourer.apply(image, precision="single", threads=threads, out=out)


def against_peers(
    what: str, palette: Palette, image: F32, peer: Callable[[Palette, F32], F32], runs: int
) -> None:
    """Print one picture's rates on one thread."""
    recolourer = _core.Recolourer(*palette)
    part = np.ascontiguousarray(image[: max(1, image.shape[0] // 32)])
    lut, scratch = ocio_processor(recolourer, 65), image.copy()
    pixels = image.size // 3
    found = rates(
        pixels, runs, {"exact": exact(recolourer, image, 1), "ocio": lambda: lut(scratch)}
    )
    slow = rates(
        part.size // 3,
        runs,
        {
            "exact": exact(recolourer, part, 1),
            "scalar": lambda: peer(palette, part),
            "double": lambda: recolourer.apply(part),
        },
    )
    worst = np.abs(recolourer.apply(part, precision="single") - recolourer.apply(part)).max()
    print(
        f"{what:34} {found['exact']:7.1f} Mpix/s a thread; "
        f"{slow['exact'] / slow['scalar']:5.1f} x scalar double, "
        f"{slow['exact'] / slow['double']:5.1f} x the core in double, "
        f"{found['exact'] / found['ocio']:5.2f} x OCIO's 65 table; error {worst:.1e}"
    )
    for name in _core.instruction_sets():
        out = np.empty_like(part)

        def run(name: str = name, out: F32 = out) -> F32:
            return recolourer.apply(part, precision="single", instructions=name, out=out)

        print(f"{'':34} {rates(part.size // 3, runs, {name: run})[name]:7.1f} with {name}")


def soft(odds: NDArray[np.uint8]) -> F32:
    """Return the matte of log odds at softness 0.5."""
    membership = np.where(odds == 0, 0, 1 / (1 + np.exp(-(odds.astype(float) - 63) * 6 / 63)))
    t = np.clip((membership - 0.1) / 0.6, 0, 1)
    return (t * t * (3 - 2 * t)).astype(np.float32)


def picks_in(image: F32, count: int, seed: int = 3, holds: int = 0) -> _core.FramePicks:
    """Make picks of a picture's colours that take all of their hues, and holds."""
    rng = np.random.default_rng(seed)
    colours = rng.choice(image.reshape(-1, image.shape[2])[:, :3], count + holds).astype(float)
    mattes = [soft(_core.hue_matte(tuple(colour))) for colour in colours]
    left = np.prod([1 - matte for matte in mattes[count:]], axis=0) if holds else None
    picks = [
        (tuple(colour), tuple(rng.uniform(-0.2, 0.2, 3)), 1.0, matte)
        for colour, matte in zip(colours[:count], mattes, strict=False)
    ]
    return _core.FramePicks(picks, left=left)


def with_picks(what: str, palette: Palette, image: F32, runs: int) -> None:
    """Print what picks cost on one thread: medians of pairs, each in turn with the plain edit."""
    ways = {
        "one": _core.Recolourer(*palette, picks=picks_in(image, 1)),
        "another": _core.Recolourer(*palette, picks=picks_in(image, 1, seed=4)),
        "three": _core.Recolourer(*palette, picks=picks_in(image, 3)),
        "three, two holds": _core.Recolourer(*palette, picks=picks_in(image, 3, holds=2)),
        "one alone": _core.Recolourer(palette[0], palette[0], palette[2],
                                      picks=picks_in(image, 1)),
    }  # fmt: skip
    plain = exact(_core.Recolourer(*palette), image, 1)
    ratios: dict[str, list[float]] = {name: [] for name in ways}
    works = {name: exact(recolourer, image, 1) for name, recolourer in ways.items()}
    for _ in range(2 * runs):
        for name, work in works.items():
            times = []
            for each in (plain, work, plain):
                started = time.process_time()
                each()
                times.append(time.process_time() - started)
            ratios[name].append(2 * times[1] / (times[0] + times[2]))
    found = ", ".join(f"{name} {statistics.median(found):.3f}" for name, found in ratios.items())
    print(f"{what:34} time with picks, of that without: {found}")
    three = exact(ways["three"], image, 2)
    rate = rates(image.size // 3, runs, {"three": three}, time.perf_counter)["three"]
    print(f"{'':34} three picks on two threads: {1e6 * rate / (HD[0] * HD[1]):.1f} HD frames/s")


def mattes(runs: int) -> None:
    """Print what a frame's picks, and learning a matte, take."""
    path = [{"frame": 0, "rgb": [0.6, 0.3, 0.2]}, {"frame": 20, "rgb": [0.5, 0.4, 0.2]}]
    pick = {"id": "p", "kind": "pick", "frame": 0, "rgb": [0.6, 0.3, 0.2], "to": [0.2, 0.3, 0.6]}
    document = {
        "schema": "palette4d.sidecar",
        "version": 2,
        "generator": "benchmark",
        "clip": {
            "name": "none",
            "source": "none",
            "frames": {"first": 0, "last": 20, "step": 1, "skipped": []},
            "rate": [24, 1],
            "size": list(HD),
            "encoding": "sRGB",
        },
        "polytope": {
            "vertices": [
                {"id": "a", "frame": 0, "rgb": [0.5, 0.5, 0.5]},
                {"id": "b", "frame": 20, "rgb": [0.5, 0.5, 0.5]},
            ],
            "edges": [{"id": "ab", "from": "a", "to": "b"}],
            "blocks": [{"first": 0, "last": 20, "tracks": [["a", "b"]], "faces": []}],
            "transitions": [],
        },
        "quality": {"stages": [], "options": {}, "versions": {}},
        "edits": {"vertices": [], "stops": [], "picks": [{**pick, "path": path}]},
        "extra": {},
    }
    sidecar = _core.parse_sidecar(json.dumps(document))
    frame = np.full((HD[1], HD[0], 3), 0.4, np.float32)
    frame[300:800, 500:900] = (0.6, 0.3, 0.2)
    frame += np.random.default_rng(1).normal(0, 0.01, frame.shape).astype(np.float32)
    picked = (0.6, 0.3, 0.2)
    works: dict[str, Callable[[], object]] = {
        "a moved pick": lambda: sidecar.picks_at(10),
        "a still pick": lambda: sidecar.picks_at(0),
        "learning from one HD frame": lambda: _core.learn_matte(
            [(frame, picked, [([(700.0, 550.0)], 20.0)], [], True)], picked
        ),
    }
    found = rates(1, 2 * runs, works)
    print(", ".join(f"{name}: {1e-3 / rate:.2f} ms" for name, rate in found.items()))


def growth(runs: int, plot: Path | None) -> None:
    """Print how cost grows with palettes, pictures and threads; draw it when asked."""
    processors = os.cpu_count() or 1
    counts = sorted({1, 2, processors, *(2**k for k in range(8) if 2**k < processors)})
    by_vertices = {}
    for vertices in (4, 6, 8, 12, 16, 20, 24):
        palette = hull(vertices)
        image = inside(palette, 960, 540)
        work = exact(_core.Recolourer(*palette), image, 1)
        by_vertices[vertices] = rates(image.size // 3, runs, {"exact": work})["exact"]
    print("palette vertices:", ", ".join(f"{n}: {r:.1f}" for n, r in by_vertices.items()), "Mpix/s")
    palette = hull(8)
    recolourer, tile = _core.Recolourer(*palette), inside(palette, *HD)
    by_size, by_threads = {}, {}
    for width, height in (HD, UHD, UHD8K):
        image = np.tile(tile, (height // HD[1], width // HD[0], 1))
        work = exact(recolourer, image, 0)
        rate = rates(image.size // 3, max(3, runs // 2), {"exact": work}, time.perf_counter)[
            "exact"
        ]
        by_size[f"{width}x{height}"] = 1e6 * rate / (width * height)
    print("all threads:", ", ".join(f"{n}: {r:.1f}" for n, r in by_size.items()), "frames/s")
    for threads in counts:
        work = exact(recolourer, tile, threads)
        by_threads[threads] = rates(tile.size // 3, runs, {"exact": work}, time.perf_counter)[
            "exact"
        ]
    print("threads:", ", ".join(f"{n}: {r:.1f}" for n, r in by_threads.items()), "Mpix/s")
    if plot is None:
        return
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.5), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    left.plot(list(by_vertices), list(by_vertices.values()), "o-")
    left.set(xlabel="palette vertices", ylabel="Mpix/s, one thread", ylim=(0, None))
    middle.bar(list(by_size), list(by_size.values()))
    middle.set(ylabel="frames/s, all threads")
    right.plot(list(by_threads), list(by_threads.values()), "o-")
    right.set(xlabel="threads", ylabel="Mpix/s", ylim=(0, None))
    figure.savefig(plot, dpi=120)
    print(f"wrote {plot}")


def main() -> None:
    """Run the comparisons and print their figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sidecar", type=Path, help="an edited sidecar, for a real frame")
    parser.add_argument("--clip", help="its clip")
    parser.add_argument("--frame", type=int, default=0)
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--plot", type=Path)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        peer = compiled_peer(Path(folder))
        palette = hull(8)
        against_peers("8 vertices, inside, HD", palette, inside(palette, *HD), peer, args.runs)
        with_picks("8 vertices, inside, HD", palette, inside(palette, *HD), args.runs)
        if args.sidecar and args.clip:
            from palette4d.media.clip import open_clip

            sidecar = _core.read_sidecar(args.sidecar)
            cut = _core.slice_at(sidecar.polytope, args.frame)
            edited = _core.edited_colours(sidecar.polytope, sidecar.edits, cut)
            frames = str(args.frame)
            image = next(iter(open_clip(args.clip, frames=frames).iter_images())).pixels
            image = np.ascontiguousarray(image[:, :, :3])
            what = f"{args.sidecar.name} at {args.frame}, {image.shape[1]}x{image.shape[0]}"
            against_peers(what, (cut.rgb, edited, cut.faces), image, peer, args.runs)
            with_picks(what, (cut.rgb, edited, cut.faces), image, args.runs)
        mattes(args.runs)
        growth(args.runs, args.plot)


if __name__ == "__main__":
    main()
