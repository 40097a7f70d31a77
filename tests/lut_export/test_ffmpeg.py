"""A .cube applied by ffmpeg's filter lut3d, which does not use OpenColorIO.

The filter comes with PyAV, which carries ffmpeg's libraries.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from palette4d.lut_export.bake import BakeResult, bake
from palette4d.lut_export.frame_edit import frame_edit

from palette4d import _core

F32 = NDArray[np.float32]


def by_ffmpeg(path: Path, colours: F32, interpolation: str) -> F32:
    """Send (h, w, 3) float32 colours through ffmpeg's lut3d, in float."""
    assert "lut3d" in av.filter.filters_available
    # The filter works on 16 numbers at a time and, in place, runs over the end of shorter rows.
    rows = np.pad(colours, ((0, 0), (0, -colours.shape[1] % 16), (0, 0)))
    height, width = rows.shape[:2]
    graph = av.filter.Graph()
    source = graph.add_buffer(
        width=width, height=height, format="gbrpf32le", time_base=Fraction(1, 24)
    )
    # Quotes keep the colon of a drive; pytest's folders have no ' of their own.
    filter_ = graph.add("lut3d", f"file='{path.as_posix()}':interp={interpolation}")
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
    dialect: str, reading: str, warm_sidecar: Path, tmp_path: Path, real_frame: F32
) -> None:
    out = tmp_path / "warm.cube"
    options = {"frame": 4.0, "size": 33, "format": dialect}
    result = bake(warm_sidecar, path=out, **options, clip=real_frame)
    check(result, out, warm_sidecar, real_frame, reading)


@pytest.mark.parametrize("reading", ["tetrahedral", "linear"])
def test_ffmpeg_reads_the_shaper_of_a_csp(
    reading: str, linear_sidecar: Path, bright_picture: F32, tmp_path: Path
) -> None:
    """Not that of a .cube, which is why `bake` warns."""
    out = tmp_path / "bright.csp"
    result = bake(linear_sidecar, 4.0, out, size=33, clip=bright_picture)
    assert result.shaper.kind == "log"
    check(result, out, linear_sidecar, bright_picture, reading)


def check(result: BakeResult, out: Path, sidecar: Path, image: F32, reading: str) -> None:
    """The stated error is that of what ffmpeg makes of an image."""
    got = by_ffmpeg(out, image, "trilinear" if reading == "linear" else reading)
    assert np.abs(got - image).max() > 0.1  # it did something
    edit = frame_edit(_core.read_sidecar(str(sidecar)), result.frame)
    want = edit.exact(image.reshape(-1, 3)).reshape(image.shape)
    relative = np.abs(got - want) / np.maximum(np.abs(want), 0.1)
    assert result.clip is not None
    stated = result.clip.by_reading[reading]
    # Along a shaper's line ffmpeg rounds otherwise than OpenColorIO.
    slack = 1e-5 if result.shaper.kind == "none" else 2e-4
    assert relative.max() <= stated.relative_largest + slack
    assert relative.mean() == pytest.approx(stated.relative_mean, abs=slack)


def test_ffmpeg_reads_the_axes_as_meant(warm_sidecar: Path, tmp_path: Path) -> None:
    colours = np.random.default_rng(8).random((40, 50, 3), dtype=np.float32)
    out = tmp_path / "warm.cube"
    bake(warm_sidecar, 4.0, out, size=65)
    edit = frame_edit(_core.read_sidecar(str(warm_sidecar)), 4.0)
    want = edit.exact(colours.reshape(-1, 3)).reshape(colours.shape)
    assert np.abs(by_ffmpeg(out, colours, "tetrahedral") - want).max() < 2e-3
