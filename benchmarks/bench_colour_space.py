"""How much does a log palette space gain on a scene-linear clip, and how long does conversion take?

A scene-linear clip (ACEScg, from below 0 to 50: a bright edge above a dim scene) is analysed with
the same options in ACEScct and in its own linear light. Then frames of it are recoloured in one
thread with and without the conversion, in turn; the peer is OpenColorIO's CPU processor, which
converts the same frames there and back.

    python benchmarks/bench_colour_space.py [--out DIR] [--runs 5]

With --out the plots of both palettes are kept there.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import PyOpenColorIO as ocio
from numpy.typing import NDArray

from palette4d import _core
from palette4d.cli.main import main as palette4d
from palette4d.colour.ocio_config import BUILT_IN

FRAMES, HEIGHT, WIDTH = 6, 72, 128
F32 = NDArray[np.float32]


def scene(frame: int, height: int = HEIGHT, width: int = WIDTH) -> F32:
    """(h, w, 3) scene-linear light; frames 1 to FRAMES."""
    y, x = np.mgrid[0:height, 0:width] / np.array([height, width])[:, None, None]
    fade = (frame - 1) / (FRAMES - 1)
    light = np.stack(
        [0.02 + 0.4 * x * (1 - fade) + 0.3 * fade * y, 0.05 + 0.18 * y, 0.01 + 0.5 * (1 - x) * y],
        axis=-1,
    )
    light *= np.exp2(np.random.default_rng(frame).normal(0, 0.5, (height, width, 1)))
    edge, foot = height // 9, height // 12
    light[:edge] *= 50 / light[:edge].max()
    light[-foot:] -= 0.08
    light[height * 5 // 12 : height * 5 // 9, width * 2 // 5 : width * 15 // 32] = 6, 2, 0.4
    return light.astype(np.float32)


def write(folder: Path) -> str:
    """Write the clip; returns its pattern."""
    for frame in range(1, FRAMES + 1):
        buffer = oiio.ImageBuf(scene(frame))
        if not buffer.write(str(folder / f"bright.{frame:04d}.exr")):
            raise SystemExit(buffer.geterror())
    return str(folder / "bright.####.exr")


def analysed(clip: str, sidecar: Path, *options: str) -> dict[str, Any]:
    """Analyse the clip; returns the sidecar."""
    if palette4d(["analyze", clip, "-o", str(sidecar), "--quiet", "--drop-edits", *options]):
        raise SystemExit(1)
    document: dict[str, Any] = json.loads(sidecar.read_text(encoding="utf-8"))
    return document


def median_seconds(works: dict[str, Callable[[], object]], runs: int) -> dict[str, float]:
    """Return the median of several runs of each, in turn."""
    took: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(runs):
        for name, work in works.items():
            started = time.perf_counter()
            work()
            took[name].append(time.perf_counter() - started)
    return {name: statistics.median(seconds) for name, seconds in took.items()}


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    parser.add_argument("--runs", type=int, default=5)
    args = parser.parse_args()
    pixels = np.concatenate([scene(f).reshape(-1, 3) for f in range(1, FRAMES + 1)])
    bright = (pixels.max(axis=1) > 1).mean()
    print(f"{FRAMES} frames of {WIDTH}x{HEIGHT}, {bright:.1%} of the pixels above 1")
    with tempfile.TemporaryDirectory() as scratch:
        folder = args.out or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        clip = write(Path(scratch))
        for space in ("ACEScct", "ACEScg"):
            sidecar = folder / f"{space}.p4d.json"
            document = analysed(clip, sidecar, "--input-space", "ACEScg", "--palette-space", space)
            last = document["quality"]["stages"][-1]
            rgb = np.array([vertex["rgb"] for vertex in document["polytope"]["vertices"]])
            print(
                f"{space:<8} L' {last['L_prime']:.3f}, outside {last['outside']:.1%}, farthest "
                f"{last['max_distance']:.2f}, {(rgb.max(axis=1) > 1).sum()} of {len(rgb)} handles "
                "above 1"
            )
            if args.out:
                picture = str(sidecar.with_suffix(".png"))
                palette4d(["plot", str(sidecar), "--clip", clip, "-o", picture, "--force"])
        costs(folder / "ACEScct.p4d.json", args.runs)


def costs(path: Path, runs: int) -> None:
    """Print what the conversion adds to a recolouring."""
    sidecar = _core.read_sidecar(path)
    assert sidecar.conversion is not None
    palette = _core.slice_at(sidecar.polytope, 3)
    recolourer = _core.Recolourer(palette.rgb, palette.rgb + 0.05, palette.faces)
    image = scene(3, 540, 960)
    steps = sidecar.conversion.steps
    own = steps.to_palette(image).astype(np.float32)
    config = ocio.Config.CreateFromBuiltinConfig(BUILT_IN)
    ways = [
        config.getProcessor(*names).getDefaultCPUProcessor()
        for names in (("ACEScg", "ACEScct"), ("ACEScct", "ACEScg"))
    ]

    def peer() -> None:
        copy = image.copy()
        for way in ways:
            way.applyRGB(copy)

    took = median_seconds(
        {
            "recolouring alone": lambda: recolourer.apply(own, precision="single"),
            "with the conversion": lambda: recolourer.apply(
                image, precision="single", conversion=steps
            ),
            "OpenColorIO, there and back": peer,
        },
        runs,
    )
    for name, seconds in took.items():
        print(f"{name:<28} {image[..., 0].size / seconds / 1e6:7.1f} Mpix/s")
    added = took["with the conversion"] - took["recolouring alone"]
    print(f"the conversion costs {added / took['OpenColorIO, there and back']:.1f} of the peer")


if __name__ == "__main__":
    main()
