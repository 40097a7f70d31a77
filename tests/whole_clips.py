"""What exports of whole clips must draw."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.frame_edit import frame_edit
from parity.cases import Document, edited, hold, learned_odds, pick, picked, split_merge_document

from palette4d import _core

#: Of `render`, in the palette's code values.
PROMISE = 1e-4
#: Golden sidecars whose clips are in another colour space than their palettes.
CONVERTED = ["v1_every_step", "v1_scene_linear"]


def moved_picks(
    last: int, *, held: bool, odds: Callable[[int], NDArray[np.uint8]] = learned_odds
) -> Document:
    """Two picks, and a hold, which wander through the colours of a clip of many frames."""
    base = copy.deepcopy(split_merge_document())
    polytope, frames = base["polytope"], base["clip"]["frames"]
    for owner in (frames, *polytope["vertices"], *polytope["blocks"]):
        for name in owner.keys() & {"first", "last", "frame"}:
            owner[name] *= last / 30

    def path(seed: int, *rgb: float) -> list[tuple[int, tuple[float, ...], float]]:
        slow, fast = np.random.default_rng(seed).uniform(0, 6, (2, 3))
        times = range(0, last + 1, 15)
        way = [0.08 * np.sin(t / 90 + slow) + 0.03 * np.sin(t / 30 + fast) for t in times]
        return [(t, tuple(rgb + by), 1) for t, by in zip(times, way, strict=True)]

    picks = [
        pick("red", (0.6, 0.3, 0.2), (0.4, 0.3, 0.6), matte="a", until=last - 60, fade=30,
             path=path(1, 0.6, 0.3, 0.2), **{"from": 40}),
        pick("green", (0.3, 0.6, 0.25), (0.6, 0.6, 0.1), matte="b", softness=0.9,
             path=path(2, 0.3, 0.6, 0.25)),
        hold("kept", (0.2, 0.5, 0.3), matte="c", path=path(3, 0.2, 0.5, 0.3)),
    ][: 3 if held else 2]  # fmt: skip
    return picked(base, picks, {one["matte"]: odds(i) for i, one in enumerate(picks, 1)})


def exact(document: Document, frame: float, colours: NDArray[Any]) -> NDArray[np.float64]:
    """What `render` draws, in double."""
    sidecar = _core.parse_sidecar(json.dumps(document), "case")
    steps = sidecar.conversion.steps if sidecar.conversion else None
    return frame_edit(sidecar, frame, conversion=steps).exact(colours)


def converted(name: str, repo_root: Path) -> tuple[Document, _core.ColourConversion]:
    """A golden sidecar with an edit, and its conversion."""
    path = repo_root / "tests" / "golden" / "sidecars" / f"{name}.p4d.json"
    document: Document = json.loads(path.read_text(encoding="utf-8"))
    vertex = document["polytope"]["vertices"][0]
    r, g, b = (0.7 * value + 0.1 for value in vertex["rgb"])
    document = edited(document, {vertex["id"]: (r, g, b + 0.2)}, [])
    conversion = _core.parse_sidecar(json.dumps(document), "case").conversion
    assert conversion is not None
    return document, conversion.steps
