"""What exports of whole clips must draw."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.frame_edit import frame_edit
from parity.cases import Document, edited

from palette4d import _core

#: Of `render`, in the palette's code values.
PROMISE = 1e-4
#: Golden sidecars whose clips are in another colour space than their palettes.
CONVERTED = ["v1_every_step", "v1_scene_linear"]


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
