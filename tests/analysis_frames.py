"""Small frames for the analysis' tests, all from seeded generators."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from palette4d.analysis import colour_statistics
from palette4d.analysis.options import AnalysisOptions

from palette4d import _core
from palette4d.grade import sidecar

F32 = NDArray[np.float32]


def noise(seed: int, scale: float = 1.0, offset: float = 0.0, size: tuple[int, int] = (20, 30)):
    rng = np.random.default_rng(seed)
    return (rng.random((*size, 3)) * scale + offset).astype(np.float32)


def constant(colour) -> F32:
    return np.broadcast_to(np.array(colour, np.float32), (20, 30, 3)).copy()


def grey(seed: int) -> F32:
    return np.repeat(noise(seed)[..., :1], 3, axis=2)


def mixture(corners, seed: int, pixels: int = 600) -> F32:
    """Pixels that are convex mixtures of the corners, some of them the corners themselves."""
    rng = np.random.default_rng(seed)
    corners = np.asarray(corners, float)
    weights = rng.dirichlet(np.full(len(corners), 0.3), pixels)
    weights[: len(corners) * 20] = np.repeat(np.eye(len(corners)), 20, axis=0)
    return (weights @ corners).astype(np.float32).reshape(-1, 30, 3)


def stats(images: list[F32], options: AnalysisOptions | None = None, first: int = 0):
    options = options or AnalysisOptions()
    out = [colour_statistics.gather(first + i, image, options) for i, image in enumerate(images)]
    assert all(s is not None for s in out)
    return out


def in_core(polytope, frames):
    """The polytope as the core reads it from a sidecar."""
    clip = {
        "name": "hand",
        "source": "hand.####.png",
        "frames": {"first": frames[0].frame, "last": frames[-1].frame, "step": 1, "skipped": []},
        "rate": [24, 1],
        "size": [30, 20],
        "encoding": "unknown",
    }
    document = sidecar.new_document(
        clip, polytope.fields(), {"stages": [], "options": {}, "versions": {}}
    )
    return _core.parse_sidecar(sidecar.dumps(document)).polytope
