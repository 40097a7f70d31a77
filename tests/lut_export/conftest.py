"""Sidecars to bake: the unit cube as palette, with colours edited."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

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


def cube_document(
    edit: Edit | None = None, low: float = 0.0, high: float = 1.0, **clip: Any
) -> dict[str, Any]:
    """A sidecar over frames 0..10 whose palette is a cube of RGB; `edit` maps every corner."""
    vertices = [
        {"id": f"v{8 * end + k + 1}", "frame": 10 * end, "rgb": [high if c else low for c in rgb]}
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


@pytest.fixture(scope="session")
def ocio_tool() -> Callable[..., str]:
    """Run one of OpenColorIO's own programs, which must succeed; what it prints."""
    # The folder for Windows is without them; there they are among the tests' tools.
    folders = [Path(root) / "PyOpenColorIO" / "bin" for root in sys.path]
    programs = next(folder for folder in folders if any(folder.glob("ociochecklut*")))

    def run(name: str, *words: object, **environment: str) -> str:
        done = subprocess.run(
            [programs / name, *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, **environment},
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


@pytest.fixture
def full_grid() -> None:
    """Ask for the dense grid as it is."""


@pytest.fixture(autouse=True)
def small_grid(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Measure errors on 13^3 colours instead of 67^3, but where a test asks for the full grid."""
    if "full_grid" not in request.fixturenames:
        monkeypatch.setattr("palette4d.lut_export.lut3d.DENSE", 13)


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


@pytest.fixture
def linear_sidecar(write_sidecar: Callable[..., Path]) -> Path:
    """Scene-linear light from -0.1 to 50; the brightest corner turns warm."""

    def edit(c: tuple[float, float, float]) -> tuple[float, float, float]:
        return (50.0, 42.0, 30.0) if c == (50.0, 50.0, 50.0) else c

    return write_sidecar(edit, low=-0.1, high=50.0, encoding="ACEScg")


@pytest.fixture
def bright_picture() -> NDArray[np.float32]:
    """(40, 60, 3) scene-linear light, evenly spread over the stops up to 50, some below 0."""
    draw = np.random.default_rng(7)
    light = np.exp2(draw.uniform(-8, np.log2(50), (40, 60, 3)))
    light[:2] = draw.uniform(-0.1, 0.0, (2, 60, 3))
    light[2, 0] = 50.0
    return light.astype(np.float32)
