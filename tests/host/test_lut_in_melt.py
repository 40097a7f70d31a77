"""A .cube that was baked, applied by melt's own filter lut3d, beside the node in the same melt.

The filter is that of Debian's ffmpeg: it has nothing to do with OpenColorIO, nor with our core.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from host.scene import Image, Scene
from host.test_melt import box_sidecar
from numpy.typing import NDArray
from palette4d.lut_export.bake import BakeResult, bake

F64 = NDArray[np.float64]


@pytest.fixture(scope="module")
def graded(
    melt: Path,
    bundle: Path,
    real_frame: NDArray[np.float32],
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Scene, BakeResult, F64]:
    """A real frame in melt, a .cube of its edit, and what the node makes of it, within 0..1."""
    clip = [np.round(real_frame * 65535).astype(np.uint16)] * 3
    scene = Scene(melt, bundle.parent, tmp_path_factory.mktemp("melt lut") / "clip", clip)
    sidecar = scene.folder / "box.p4d.json"
    box_sidecar(sidecar, clip)
    out = scene.folder / "look.cube"
    result = bake(sidecar, 101.0, out, size=33, clip=real_frame)
    assert result.shaper.kind == "none"
    frames, said = scene.render(sidecar=sidecar)
    assert "persistent" not in said
    return scene, result, of_one(frames[1])


def of_one(frame: Image) -> F64:
    return frame[..., :3].astype(np.float64) / 65535


@pytest.mark.parametrize(
    ("interpolation", "reading"), [("trilinear", "linear"), ("tetrahedral", "tetrahedral")]
)
def test_melt_keeps_the_stated_error(
    graded: tuple[Scene, BakeResult, F64], interpolation: str, reading: str
) -> None:
    scene, result, by_the_node = graded
    frames, _ = scene.render(
        "avfilter.lut3d", **{"av.file": scene.folder / "look.cube", "av.interp": interpolation}
    )
    got = of_one(frames[1])
    assert np.abs(got - of_one(scene.clip[1])).mean() > 0.01  # it did something
    assert result.clip is not None
    stated = result.clip.by_reading[reading]
    relative = np.abs(got - by_the_node) / np.maximum(by_the_node, 0.1)
    # Both pictures have 16 bits, half a step of which is this much of 0.1.
    rounding = 1 / 65535 / 0.1
    assert relative.max() <= stated.relative_largest + rounding
    assert relative.mean() <= stated.relative_mean + rounding
    # No loose bound: the table's own error is what is left over.
    assert relative.mean() >= 0.5 * stated.relative_mean
