"""Every format: written, read back by OpenColorIO, applied within its stated error; shapers."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import PyOpenColorIO as ocio
import pytest
from numpy.typing import NDArray
from palette4d.lut_export.bake import BakeResult, bake
from palette4d.lut_export.formats import FORMATS, LutFormat, format_named, format_of
from palette4d.lut_export.frame_edit import frame_edit

from palette4d import Palette4dError, _core

F32 = NDArray[np.float32]
TABLES = [known for known in FORMATS if not known.is_cdl]
SHAPED = [known for known in TABLES if known.shaper]
INTERPOLATION = {"linear": ocio.INTERP_LINEAR, "tetrahedral": ocio.INTERP_TETRAHEDRAL}


def named(known: LutFormat) -> str:
    return known.name


def read_back(path: Path, colours: F32, reading: str) -> F32:
    """Apply a file with OpenColorIO's defaults."""
    ocio.ClearAllCaches()
    transform = ocio.FileTransform(src=str(path), interpolation=INTERPOLATION[reading])
    processor = ocio.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor()
    result = np.array(colours, dtype=np.float32, order="C")
    processor.applyRGB(result)
    return result


def exact(sidecar: Path, frame: float, colours: F32) -> NDArray[np.float64]:
    edit = frame_edit(_core.read_sidecar(str(sidecar)), frame)
    return edit.exact(colours.reshape(-1, 3)).reshape(colours.shape)


def check(result: BakeResult, path: Path, sidecar: Path, image: F32) -> None:
    """The stated error holds for what a host reads, and is no loose bound."""
    assert result.clip is not None
    want = exact(sidecar, result.frame, image)
    worst = 0.0
    for reading, figures in result.clip.by_reading.items():
        difference = np.abs(read_back(path, image, reading) - want)
        relative = difference / np.maximum(np.abs(want), 0.1)
        # By default OpenColorIO approximates logarithms, and rounds differently in the last bits.
        slack = 1.01 if result.shaper.kind == "log" else 1.0
        assert relative.max() <= slack * figures.relative_largest + 3e-6
        assert relative.mean() <= slack * figures.relative_mean + 3e-6
        worst = max(worst, float(relative.max()))
    assert worst == pytest.approx(result.error, rel=0.01, abs=1e-5)


def test_opencolorio_writes_no_other_format() -> None:
    """A new format of OpenColorIO's should be offered, too."""
    bakes = {name for name, _ in ocio.Baker.getFormats()}
    groups = {extension for _, extension in ocio.GroupTransform.GetWriteFormats()}
    titles = {"Academy/ASC Common LUT Format": "clf", "Color Transform Format": "ctf"}
    ours = {known.name for known in FORMATS}
    assert {titles.get(name, name) for name in bakes} - ours == {"spi1d"}
    assert groups - ours == set()


@pytest.mark.parametrize("known", TABLES, ids=named)
def test_each_format_keeps_its_stated_error_on_a_real_frame(
    known: LutFormat,
    warm_sidecar: Path,
    tmp_path: Path,
    real_frame: F32,
    ocio_tool: Callable[..., str],
) -> None:
    image = np.ascontiguousarray(real_frame[::3, ::3])
    out = tmp_path / f"warm{known.extension}"
    options = {"frame": 4.0, "size": 33, "format": known.name}
    result = bake(warm_sidecar, path=out, **options, clip=image)
    assert (result.format, result.size) == (known.name, 33)
    assert result.shaper.kind == "none"
    check(result, out, warm_sidecar, image)
    assert result.error < 0.02
    brightest = image.reshape(-1, 3)[image.sum(axis=-1).argmax()]
    found = np.array(ocio_tool("ociochecklut", out, *brightest).split(), dtype=np.float64)
    want = exact(warm_sidecar, 4.0, brightest)
    assert np.all(np.abs(found - want) <= result.error * np.maximum(np.abs(want), 0.1) + 1e-5)
    assert np.abs(found - brightest).max() > 0.01


@pytest.mark.parametrize("known", SHAPED, ids=named)
def test_a_shaper_reaches_beyond_one(
    known: LutFormat, linear_sidecar: Path, bright_picture: F32, tmp_path: Path
) -> None:
    out = tmp_path / f"bright{known.extension}"
    options = {"frame": 4.0, "size": 33, "format": known.name}
    result = bake(linear_sidecar, path=out, **options, clip=bright_picture)
    assert (result.shaper.kind, result.shaper.low, result.shaper.high) == ("log", -0.1, 50.0)
    assert result.clip is not None
    assert result.clip.outside_domain == 0
    check(result, out, linear_sidecar, bright_picture)
    # Only CLF and CTF can hold the inverse of the shaper, too, and so leave shadows alone.
    mean = result.clip.worst.relative_mean
    assert mean < (0.003 if known.name in ("clf", "ctf") else 0.01)
    linear = bake(
        linear_sidecar,
        4.0,
        out,
        size=33,
        format=known.name,
        shaper="linear",
        clip=bright_picture,
        force=True,
    )
    assert linear.clip is not None
    assert mean < linear.clip.worst.relative_mean


@pytest.mark.parametrize("known", SHAPED, ids=named)
def test_a_linear_shaper_for_a_little_more(
    known: LutFormat, warm_sidecar: Path, tmp_path: Path
) -> None:
    image = np.random.default_rng(1).uniform(-0.05, 1.15, (30, 30, 3)).astype(np.float32)
    out = tmp_path / f"more{known.extension}"
    options = {"frame": 4.0, "size": 33, "format": known.name}
    if known.name == "resolve_cube":
        # Few programs that take a .cube of a display's colours read a shaper.
        assert bake(warm_sidecar, path=out, **options, clip=image).shaper.kind == "none"
        options |= {"shaper": "linear", "force": True}
    result = bake(warm_sidecar, path=out, **options, clip=image)
    assert result.shaper.kind == "linear"
    assert result.shaper.low <= image.min()
    assert result.shaper.high >= image.max()
    check(result, out, warm_sidecar, image)
    assert result.error < 0.06


def test_a_shaper_covers_the_palette_too(linear_sidecar: Path, tmp_path: Path) -> None:
    """LUTs of a clip are alike, whatever each frame shows."""
    image = np.full((2, 2, 3), 2.0, np.float32)
    result = bake(linear_sidecar, 4.0, tmp_path / "all.clf", size=9, clip=image)
    assert (result.shaper.low, result.shaper.high) == (-0.1, 50.0)


def test_without_a_shaper_beyond_one_is_clamped(
    linear_sidecar: Path, bright_picture: F32, tmp_path: Path
) -> None:
    """Formats that cannot hold one still write, and say how much they clamp."""
    out = tmp_path / "bright.spi3d"
    result = bake(linear_sidecar, 4.0, out, size=17, clip=bright_picture)
    assert result.shaper.kind == "none"
    assert result.clip is not None
    assert result.clip.outside_domain > 0.3
    assert result.error > 0.9


def test_clf_wraps_the_table_in_discrete_nodes(
    linear_sidecar: Path, bright_picture: F32, tmp_path: Path
) -> None:
    out = tmp_path / "bright.clf"
    bake(linear_sidecar, 4.0, out, size=5, clip=bright_picture)
    root = ElementTree.parse(out).getroot()
    nodes = [child.tag.rpartition("}")[2] for child in root]
    assert [n for n in nodes if n in ("Log", "LUT1D", "LUT3D", "Range")] == ["Log", "LUT3D", "Log"]


def test_an_unedited_log_table_is_the_identity(
    write_sidecar, bright_picture: F32, tmp_path: Path
) -> None:
    sidecar = write_sidecar(low=-0.1, high=50.0)
    result = bake(sidecar, 4.0, tmp_path / "a.clf", size=17, clip=bright_picture)
    assert result.identity
    assert result.error < 2e-5


def test_both_cube_dialects_hold_the_same_table(warm_sidecar: Path, tmp_path: Path) -> None:
    texts = {}
    for name in ("resolve_cube", "iridas_cube"):
        out = tmp_path / f"{name}.cube"
        assert bake(warm_sidecar, 0.0, out, size=9, format=name).format == name
        lines = out.read_text("utf-8").splitlines()
        texts[name] = [line for line in lines if line and not line.startswith("#")]
    assert texts["resolve_cube"] == texts["iridas_cube"]
    assert bake(warm_sidecar, 0.0, tmp_path / "x.cube", size=2).format == "resolve_cube"


def test_a_given_domain(warm_sidecar: Path, tmp_path: Path) -> None:
    options = {"frame": 0.0, "size": 9, "domain": (-0.5, 4.0)}
    result = bake(warm_sidecar, path=tmp_path / "a.clf", **options)
    assert (result.shaper.kind, result.shaper.low, result.shaper.high) == ("log", -0.5, 4.0)


@pytest.mark.parametrize(
    ("name", "options", "word"),
    [
        (
            "a.spi3d",
            {"shaper": "log"},
            "cannot hold a shaper.*resolve_cube",
        ),
        (
            "a.cube",
            {"shaper": "log", "format": "iridas_cube"},
            "cannot hold a shaper",
        ),
        ("a.itx", {"domain": (0, 2)}, 'shaper="log" or'),
        (
            "a.clf",
            {"shaper": "none", "domain": (0, 2)},
            'shaper="log" or',
        ),
        ("a.3dl", {"size": 16}, "expected 5, 9, 17, 33, 65, 129"),
        ("a.3dl", {"size": 3}, "expected 5, 9"),
        ("a.cube", {"format": "clf"}, r"expected \.clf"),
        ("a.cube", {"format": "resolv_cube"}, "expected resolve_cube"),
        ("a.spi1d", {"format": "spi1d"}, "mixes the channels"),
    ],
)
def test_refusals(
    name: str, options: dict[str, Any], word: str, warm_sidecar: Path, tmp_path: Path
) -> None:
    with pytest.raises(Palette4dError, match=word):
        bake(warm_sidecar, 0.0, tmp_path / name, **options)
    assert [path.name for path in tmp_path.iterdir()] == ["cube.p4d.json"]


def test_format_names() -> None:
    assert format_named("cube").name == "resolve_cube"
    assert format_named(".CSP").name == "cinespace"
    assert format_of(Path("A.CUBE")).name == "resolve_cube"
    assert format_of(Path("a.3dl"), "lustre").name == "lustre"
    with pytest.raises(Palette4dError, match="expected resolve_cube, iridas_cube, clf"):
        format_named("qqq")


class TestMaxError:
    def test_the_lattice_grows_until_it_holds(self, warm_sidecar: Path, tmp_path: Path) -> None:
        out = tmp_path / "a.clf"
        small = bake(warm_sidecar, 0.0, out, size=5)
        limit = small.error / 8
        result = bake(warm_sidecar, 0.0, out, size=5, max_error=limit, force=True)
        assert result.error <= limit
        assert result.size in (9, 17, 33, 65)
        before = bake(warm_sidecar, 0.0, out, size=(result.size - 1) // 2 + 1, force=True)
        assert before.error > limit  # no larger than needed

    def test_what_holds_already_does_not_grow(self, warm_sidecar: Path, tmp_path: Path) -> None:
        result = bake(warm_sidecar, 0.0, tmp_path / "a.clf", size=6, max_error=1.0)
        assert result.size == 6

    def test_it_fails_with_nothing_written(
        self,
        linear_sidecar: Path,
        bright_picture: F32,
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
    ) -> None:
        monkeypatch.setattr("palette4d.lut_export.formats.LARGEST", 17)
        out = tmp_path / "a.spi3d"
        with pytest.raises(Palette4dError, match="are clamped: choose a format with a shaper"):
            bake(linear_sidecar, 4.0, out, size=6, max_error=0.002, clip=bright_picture)
        assert [path.name for path in tmp_path.iterdir()] == ["cube.p4d.json"]


def test_a_name_of_any_length_can_be_read_back(
    write_sidecar: Callable[..., Path], tmp_path: Path
) -> None:
    sidecar = write_sidecar(lambda rgb: (rgb[0] / 2, rgb[1], rgb[2]), name="n" * 5000)
    out = tmp_path / "long.clf"
    bake(sidecar, 5, out, size=5)
    assert read_back(out, np.full((1, 3), 0.5, np.float32), "tetrahedral")[0, 0] < 0.4
