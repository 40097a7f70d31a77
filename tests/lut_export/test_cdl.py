"""CDLs: exact where the edit is a CDL, near elsewhere, and their error is stated."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import PyOpenColorIO as ocio
import pytest
from numpy.typing import NDArray
from palette4d.lut_export.bake import bake
from palette4d.lut_export.cdl import Cdl, collection, fit
from palette4d.lut_export.frame_edit import frame_edit

from palette4d import Palette4dError, _core

F32, F64 = NDArray[np.float32], NDArray[np.float64]
EXTENSIONS = ["cc", "ccc", "cdl"]


def picture() -> F32:
    return np.random.default_rng(5).random((50, 60, 3), dtype=np.float32)


def by_opencolorio(path: Path, colours: F32, style: ocio.CDLStyle) -> F32:
    ocio.ClearAllCaches()
    transform = ocio.FileTransform(src=str(path))
    transform.setCDLStyle(style)
    result = colours.copy()
    ocio.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor().applyRGB(result)
    return result


def test_apply_is_opencolorios() -> None:
    cdl = Cdl((1.2, 0.9, 1.0), (0.01, -0.05, 0.02), (0.8, 1.1, 1.3), 0.7)
    colours = picture() * 1.5 - 0.2
    transform = ocio.CDLTransform()
    transform.setSlope(list(cdl.slope))
    transform.setOffset(list(cdl.offset))
    transform.setPower(list(cdl.power))
    transform.setSat(cdl.saturation)
    want = colours.copy()
    ocio.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor().applyRGB(want)
    got = cdl.apply(colours.reshape(-1, 3).astype(np.float64)).reshape(colours.shape)
    # OpenColorIO's fast power is good to some 1e-5.
    np.testing.assert_allclose(got, want, atol=5e-5)


def test_what_no_picture_shows_is_no_nearer_than_what_it_shows() -> None:
    """A turn of all hues leads below 0, where a CDL gets at the cost of other colours."""
    axis = np.cross(np.eye(3), np.ones(3) / np.sqrt(3))
    turn = np.eye(3) + np.sin(0.7) * axis + (1 - np.cos(0.7)) * axis @ axis
    colours = np.random.default_rng(1).uniform((0, 0.3, 0.4), (0.3, 0.8, 0.95), (30, 30, 3))
    points = colours.reshape(-1, 3)
    wanted = np.maximum(points @ turn.T, 0)

    def off(exact: Callable[[F64], F64]) -> float:
        edit: Any = SimpleNamespace(identity=False, exact=exact)
        got = fit(edit, colours.astype(np.float32)).apply(points)
        return float((np.abs(np.maximum(got, 0) - wanted) / np.maximum(wanted, 0.1)).mean())

    assert off(lambda p: p @ turn.T) <= off(lambda p: np.maximum(p @ turn.T, 0)) + 1e-6


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_an_edit_that_is_a_cdl_is_found(
    extension: str, write_sidecar: Callable[..., Path], tmp_path: Path
) -> None:
    sidecar = write_sidecar(lambda c: (0.8 * c[0] + 0.1, 0.9 * c[1], 1.1 * c[2] - 0.05))
    out = tmp_path / f"a.{extension}"
    result = bake(sidecar, 4.0, out)
    assert result.cdl is not None
    np.testing.assert_allclose(result.cdl.slope, (0.8, 0.9, 1.1), atol=2e-3)
    np.testing.assert_allclose(result.cdl.offset, (0.1, 0.0, -0.05), atol=2e-3)
    assert result.grid.by_reading["not clamped"].relative_largest < 2e-3
    assert result.size is None


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_the_residual_holds_on_a_real_frame(
    extension: str, warm_sidecar: Path, tmp_path: Path, real_frame: F32
) -> None:
    image = np.ascontiguousarray(real_frame[::3, ::3])
    out = tmp_path / f"a.{extension}"
    result = bake(warm_sidecar, 4.0, out, clip=image)
    edit = frame_edit(_core.read_sidecar(str(warm_sidecar)), 4.0)
    want = edit.exact(image.reshape(-1, 3)).reshape(image.shape)
    assert result.clip is not None
    styles = {"clamped": ocio.CDL_ASC, "not clamped": ocio.CDL_NO_CLAMP}
    assert set(result.clip.by_reading) == set(styles)
    for name, figures in result.clip.by_reading.items():
        difference = np.abs(by_opencolorio(out, image, styles[name]) - want)
        relative = difference / np.maximum(np.abs(want), 0.1)
        assert relative.max() == pytest.approx(figures.relative_largest, rel=0.01)
        assert relative.mean() == pytest.approx(figures.relative_mean, rel=0.01)
    # Nearer than doing nothing; a CDL cannot do it exactly.
    nothing = (np.abs(image - want) / np.maximum(np.abs(want), 0.1)).mean()
    assert 1e-4 < result.clip.worst.relative_mean < 0.7 * nothing


def test_no_other_cdl_is_nearer(warm_sidecar: Path) -> None:
    image = picture()
    edit = frame_edit(_core.read_sidecar(str(warm_sidecar)), 4.0)
    points = image.reshape(-1, 3).astype(np.float64)
    want = edit.exact(points)

    def squares(cdl: Cdl) -> float:
        relative = (cdl.apply(points) - want) / np.maximum(np.abs(want), 0.1)
        return float((relative**2).sum())

    found = fit(edit, image)
    least = squares(found)
    assert least < 0.5 * squares(Cdl())
    for name in ("slope", "offset", "power"):
        for channel in range(3):
            for step in (-0.003, 0.003):
                numbers = list(getattr(found, name))
                numbers[channel] += step
                assert squares(replace(found, **{name: tuple(numbers)})) > least
    for step in (-0.003, 0.003):
        assert squares(replace(found, saturation=found.saturation + step)) > least


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_no_edit_is_the_identity_exactly(
    extension: str, write_sidecar: Callable[..., Path], tmp_path: Path
) -> None:
    result = bake(write_sidecar(), 1.0, tmp_path / f"a.{extension}")
    assert result.cdl == Cdl()
    assert result.identity
    assert result.error == 0


def test_what_the_file_says(write_sidecar: Callable[..., Path], tmp_path: Path) -> None:
    sidecar = write_sidecar(lambda c: (c[0], 0.9 * c[1], c[2]), name="shot <1> & '2'")
    out = tmp_path / "a.cc"
    result = bake(sidecar, 2.5, out)
    root = ElementTree.parse(out).getroot()
    assert root.tag == "ColorCorrection"
    assert root.get("id") == "shot (1) + \u20192\u2019.2.5"
    texts = [element.text or "" for element in root.iter("Description")]
    assert any(result.sidecar_sha256 in text for text in texts)
    assert not any("&" in text for text in texts)
    assert any("error on the dense grid: " in text for text in texts)
    assert any(result.id in text for text in texts)
    assert root.findtext("InputDescription") == "sRGB"


def test_the_same_bytes_again(warm_sidecar: Path, tmp_path: Path) -> None:
    for name in ("a.ccc", "b.ccc"):
        bake(warm_sidecar, 4.0, tmp_path / name)
    assert (tmp_path / "a.ccc").read_bytes() == (tmp_path / "b.ccc").read_bytes()


def test_max_error_refuses_and_writes_nothing(warm_sidecar: Path, tmp_path: Path) -> None:
    with pytest.raises(Palette4dError, match=r"stays above the limit.*ColorCorrection"):
        bake(warm_sidecar, 4.0, tmp_path / "a.cc", max_error=1e-4)
    assert [path.name for path in tmp_path.iterdir()] == ["cube.p4d.json"]


def test_numbers_have_no_digits_of_rounding() -> None:
    cdl = Cdl((0.708397, 1.1, 0.9), (-0.00001, 0.0, 0.1), (1.23456, 1.0, 1.0), 0.3)
    root = ElementTree.fromstring(collection({"a > b": cdl, "c": cdl}))
    texts = [one.text for one in root.iter() if one.text and one.text.strip()]
    assert texts == ["0.708397 1.1 0.9", "-1e-05 0 0.1", "1.23456 1 1", "0.3"] * 2
