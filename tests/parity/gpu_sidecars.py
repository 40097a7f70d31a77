"""Write the sidecars that gpu_check.sh draws: 8, 12 and 16 vertices, with 3 picks or none.

And one with picks whose clip is scene-linear light.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from parity.cases import Document, document, edited, pick, picked, random_hull


def sidecar(points: int) -> Document:
    """A palette that changes from frame 10 to 20, all of whose colours are edited."""
    rgb, faces = random_hull(points, points)
    rng = np.random.default_rng(points)
    later = rgb + rng.uniform(-0.02, 0.02, rgb.shape)
    vertices = {f"a{i}": (10.0, tuple(c)) for i, c in enumerate(rgb.tolist())}
    vertices |= {f"b{i}": (20.0, tuple(c)) for i, c in enumerate(later.tolist())}
    names = range(points)
    block = {"first": 10, "last": 20, "tracks": [[f"a{i}", f"b{i}"] for i in names], "faces": faces}
    edges = {f"e{i}": (f"a{i}", f"b{i}") for i in names}
    moved = {
        name: tuple((np.array(c) + rng.uniform(-0.2, 0.2, 3)).tolist())
        for name, (_, c) in vertices.items()
    }
    return edited(document(vertices, edges, [block], []), moved, [], ramp="smooth")


def in_light(document: Document) -> Document:
    """The same palette of a clip in another space: a matrix, a power, and a sampled curve."""
    x = np.linspace(-1, 2, 4096)
    matrix = [[1.66, -0.59, -0.07], [-0.12, 1.13, -0.01], [-0.02, -0.1, 1.12]]
    steps = [
        {"kind": "matrix", "matrix": matrix, "offset": [0, 0, 0]},
        {"kind": "gamma", "direction": "inverse", "gamma": [2.4] * 3, "offset": [0.055] * 3,
         "negative": "line"},
        {"kind": "curve", "direction": "forward",
         "curves": [{"x": x.tolist(), "y": (0.9 * x + 0.1 * np.sin(x)).tolist()}]},
    ]  # fmt: skip
    conversion = {"input_space": "light", "config": "check", "error": 0, "steps": steps}
    return {**document, "clip": {**document["clip"], "conversion": conversion}}


def main(folder: Path) -> None:
    """Write them into a folder."""
    picks = [
        pick("p1", (0.6, 0.3, 0.25), (0.4, 0.3, 0.6), softness=0.6),
        pick("p2", (0.3, 0.6, 0.3), (0.5, 0.55, 0.2)),
        pick("p3", (0.3, 0.35, 0.65), (0.2, 0.5, 0.6), reach=1),
    ]
    for points in (8, 12, 16):
        plain = sidecar(points)
        for name, written in (
            (f"{points:02}", plain),
            (f"{points:02}_picks", picked(plain, picks)),
        ):
            path = folder / f"{name}.p4d.json"
            path.write_text(json.dumps(written), encoding="utf-8")
    light = in_light(picked(sidecar(8), picks))
    (folder / "08_light.p4d.json").write_text(json.dumps(light), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
