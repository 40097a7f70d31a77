"""Sidecars to bake: the unit cube as palette, with colours edited."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

CORNERS = [(r, g, b) for r in (0.0, 1.0) for g in (0.0, 1.0) for b in (0.0, 1.0)]
#: Two triangles a side, anticlockwise from outside; corner index 4 r + 2 g + b.
CUBE_FACES = [
    [0, 1, 3],
    [0, 3, 2],
    [4, 6, 7],
    [4, 7, 5],
    [0, 4, 5],
    [0, 5, 1],
    [2, 3, 7],
    [2, 7, 6],
    [0, 2, 6],
    [0, 6, 4],
    [1, 5, 7],
    [1, 7, 3],
]

Edit = Callable[[tuple[float, float, float]], tuple[float, float, float]]


def cube_document(edit: Edit | None = None, **clip: Any) -> dict[str, Any]:
    """A sidecar over frames 0..10 whose palette is the RGB cube; `edit` maps every corner."""
    vertices = [
        {"id": f"v{8 * end + k + 1}", "frame": 10 * end, "rgb": list(rgb)}
        for end in (0, 1)
        for k, rgb in enumerate(CORNERS)
    ]
    edits = [
        {"vertex": v["id"], "rgb": list(edit(tuple(v["rgb"])))}
        for v in vertices
        if edit is not None
    ]
    return {
        "schema": "palette4d.sidecar",
        "version": 1,
        "generator": "palette4d test",
        "clip": {
            "name": "cube",
            "source": "nowhere/####.png",
            "frames": {"first": 0, "last": 10, "step": 1, "skipped": []},
            "rate": [24, 1],
            "size": [64, 36],
            "encoding": "sRGB",
            **clip,
        },
        "polytope": {
            "vertices": vertices,
            "edges": [
                {"id": f"e{k + 1}", "from": f"v{k + 1}", "to": f"v{k + 9}"} for k in range(8)
            ],
            "blocks": [
                {
                    "first": 0,
                    "last": 10,
                    "tracks": [[f"v{k + 1}", f"v{k + 9}"] for k in range(8)],
                    "faces": CUBE_FACES,
                }
            ],
            "transitions": [],
        },
        "quality": {"stages": [], "options": {}, "versions": {}},
        "edits": {"vertices": edits, "stops": []},
        "extra": {},
    }


@pytest.fixture
def write_sidecar(tmp_path: Path) -> Callable[..., Path]:
    """Write `cube_document(edit, **clip)` to a file."""

    def write(edit: Edit | None = None, **clip: Any) -> Path:
        path = tmp_path / "cube.p4d.json"
        path.write_text(json.dumps(cube_document(edit, **clip)), encoding="utf-8")
        return path

    return write


@pytest.fixture
def warm_sidecar(write_sidecar: Callable[..., Path]) -> Path:
    """An edit that no affine map equals: white turns warm, the other corners stay."""
    return write_sidecar(lambda c: (1.0, 0.8, 0.55) if c == (1.0, 1.0, 1.0) else c)
