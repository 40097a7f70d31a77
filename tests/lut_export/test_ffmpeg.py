"""A .cube applied by a program that has nothing to do with OpenColorIO: ffmpeg's filter lut3d.

The filter comes with PyAV, which carries ffmpeg's libraries.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from palette4d import _core
from palette4d.analysis.clip import open_clip
from palette4d.lut_export.bake import BakeOptions, bake
from palette4d.lut_export.frame_edit import frame_edit

F32 = NDArray[np.float32]


def by_ffmpeg(path: Path, colours: F32, interpolation: str) -> F32:
    """Send (h, w, 3) float32 colours through ffmpeg's lut3d, in float."""
    if "lut3d" not in av.filter.filters_available:
        pytest.skip("this build of PyAV has no filter lut3d")
    # The filter works on 16 numbers at a time and, in place, runs over the end of shorter rows.
    rows = np.pad(colours, ((0, 0), (0, -colours.shape[1] % 16), (0, 0)))
    height, width = rows.shape[:2]
    graph = av.filter.Graph()
    source = graph.add_buffer(
        width=width, height=height, format="gbrpf32le", time_base=Fraction(1, 24)
    )
    # Inside a filter's arguments, ' : \ would need quotes; pytest's folders have none of them.
    filter_ = graph.add("lut3d", f"file={path}:interp={interpolation}")
    sink = graph.add("buffersink")
    source.link_to(filter_)
    filter_.link_to(sink)
    graph.configure()
    source.push(av.VideoFrame.from_ndarray(rows, format="gbrpf32le"))
    result = sink.pull()
    assert isinstance(result, av.VideoFrame)
    assert result.format.name == "gbrpf32le"
    return np.asarray(result.to_ndarray()[:, : colours.shape[1]], dtype=np.float32)


@pytest.mark.parametrize("dialect", ["resolve_cube", "iridas_cube"])
@pytest.mark.parametrize("reading", ["tetrahedral", "linear"])
def test_ffmpeg_keeps_the_stated_error(
    dialect: str, reading: str, warm_sidecar: Path, tmp_path: Path, seasons: Path
) -> None:
    image = np.ascontiguousarray(open_clip(str(seasons)).read(40)[..., :3])
    out = tmp_path / "warm.cube"
    options = BakeOptions(4.0, 33, format=dialect)
    result = bake(warm_sidecar, out, options, image=image, image_frame=40)
    got = by_ffmpeg(out, image, "trilinear" if reading == "linear" else reading)
    assert np.abs(got - image).max() > 0.1  # it did something
    edit = frame_edit(_core.read_sidecar(str(warm_sidecar)), 4.0)
    want = edit.exact(image.reshape(-1, 3)).reshape(image.shape)
    relative = np.abs(got - want) / np.maximum(np.abs(want), 0.1)
    assert result.clip is not None
    stated = result.clip.by_reading[reading]
    assert relative.max() <= stated.relative_largest + 1e-5
    assert relative.mean() == pytest.approx(stated.relative_mean, abs=1e-5)


def test_ffmpeg_reads_the_axes_as_meant(warm_sidecar: Path, tmp_path: Path) -> None:
    colours = np.random.default_rng(8).random((40, 50, 3), dtype=np.float32)
    out = tmp_path / "warm.cube"
    bake(warm_sidecar, out, BakeOptions(4.0, 65))
    edit = frame_edit(_core.read_sidecar(str(warm_sidecar)), 4.0)
    want = edit.exact(colours.reshape(-1, 3)).reshape(colours.shape)
    assert np.abs(by_ffmpeg(out, colours, "tetrahedral") - want).max() < 2e-3
