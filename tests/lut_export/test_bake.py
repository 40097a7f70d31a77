"""The bake: what is written, read back through OpenColorIO, against the exact core."""

from __future__ import annotations

import hashlib
import json
import os
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import PyOpenColorIO as ocio
import pytest
from numpy.typing import NDArray
from palette4d.lut_export import lut3d
from palette4d.lut_export.bake import bake
from palette4d.lut_export.bake_error import load, stated

import palette4d
from palette4d import Palette4dError, _core
from palette4d.cli.main import main
from palette4d.grade.document import Document

F32 = NDArray[np.float32]


def read_back(path: Path, colours: F32, interpolation: ocio.Interpolation) -> F32:
    """Apply a LUT file as a host with OpenColorIO does, independent of the code under test."""
    ocio.ClearAllCaches()
    transform = ocio.FileTransform(src=str(path), interpolation=interpolation)
    processor = ocio.Config.CreateRaw().getProcessor(transform).getDefaultCPUProcessor()
    result = np.array(colours, dtype=np.float32, order="C")
    processor.applyRGB(result)
    return result


def exact(sidecar: Path, frame: float, colours: F32, strength: float = 1.0) -> F32:
    """What the node would make of colours."""
    read = _core.read_sidecar(str(sidecar))
    palette = _core.slice_at(read.polytope, frame)
    edited = _core.edited_colours(read.polytope, read.edits, palette)
    picks = read.picks_at(palette.frame)
    recolourer = _core.Recolourer(palette.rgb, edited, palette.faces, picks=picks)
    return recolourer.apply(colours, strength=strength)


def random_colours(count: int = 20_000) -> F32:
    return np.random.default_rng(4).random((1, count, 3), dtype=np.float32)


@pytest.mark.parametrize("extension", [".cube", ".clf"])
def test_a_file_read_back_keeps_its_stated_error(
    extension: str, warm_sidecar: Path, tmp_path: Path
) -> None:
    image = random_colours().reshape(100, 200, 3)
    out = tmp_path / f"warm{extension}"
    result = bake(warm_sidecar, 4.0, out, size=17, clip=image)
    assert result.clip is not None
    want = exact(warm_sidecar, 4.0, image)
    assert np.abs(want - image).max() > 0.2  # the edit does something
    readings = (
        [ocio.INTERP_DEFAULT, ocio.INTERP_LINEAR, ocio.INTERP_TETRAHEDRAL, ocio.INTERP_BEST]
        if extension == ".cube"
        else [ocio.INTERP_DEFAULT]
    )
    # OpenColorIO's default, optimised processors round differently in the last bits.
    slack = 1e-6
    worst = 0.0
    for reading in readings:
        difference = np.abs(read_back(out, image, reading).astype(np.float64) - want)
        assert difference.max() <= result.clip.worst.largest + slack
        assert difference.mean() <= result.clip.worst.mean + slack
        worst = max(worst, float(difference.max()))
    # The statement is no loose bound either.
    assert worst == pytest.approx(result.clip.worst.largest, abs=slack)
    assert 0 < result.clip.worst.mean < result.clip.worst.largest < 0.05


@pytest.mark.usefixtures("full_grid")
def test_grid_error_is_what_it_says(warm_sidecar: Path, tmp_path: Path) -> None:
    out = tmp_path / "warm.clf"
    result = bake(warm_sidecar, 0.0, out, size=9)
    channel = ((np.arange(67) + 0.5) / 67).astype(np.float32)
    colours = np.stack(np.meshgrid(channel, channel, channel, indexing="ij"), axis=-1)
    colours = np.ascontiguousarray(colours.reshape(1, -1, 3))
    got = read_back(out, colours, ocio.INTERP_DEFAULT).astype(np.float64)
    want = exact(warm_sidecar, 0.0, colours)
    difference = np.abs(got - want)
    assert result.grid.colours == 67**3
    assert result.grid.worst.largest == pytest.approx(difference.max(), abs=1e-6)
    assert result.grid.worst.mean == pytest.approx(difference.mean(), abs=1e-6)
    relative = difference / np.maximum(np.abs(want), 0.1)
    assert result.grid.worst.relative_largest == pytest.approx(relative.max(), abs=1e-5)
    assert result.grid.worst.relative_mean == pytest.approx(relative.mean(), abs=1e-6)
    assert result.error == result.grid.worst.relative_largest
    assert result.clip is None
    assert result.clip_frame is None


@pytest.mark.parametrize(("extension", "tolerance"), [(".cube", 6e-7), (".clf", 1.5e-7)])
def test_no_edit_is_the_identity(
    extension: str, tolerance: float, write_sidecar: Callable[..., Path], tmp_path: Path
) -> None:
    out = tmp_path / f"same{extension}"
    result = bake(write_sidecar(), 3.5, out, size=33)
    assert result.identity
    colours = random_colours()
    for reading in (ocio.INTERP_DEFAULT, ocio.INTERP_TETRAHEDRAL):
        assert np.abs(read_back(out, colours, reading) - colours).max() <= tolerance
    assert result.grid.worst.largest <= tolerance


def test_strength_zero_is_the_identity_and_half_is_half(warm_sidecar: Path, tmp_path: Path) -> None:
    nothing = bake(warm_sidecar, 0.0, tmp_path / "0.clf", size=9, strength=0.0)
    assert nothing.identity
    assert nothing.grid.worst.largest < 1e-6
    bake(warm_sidecar, 0.0, tmp_path / "half.clf", size=9, strength=0.5)
    white = np.ones((1, 1, 3), dtype=np.float32)
    got = read_back(tmp_path / "half.clf", white, ocio.INTERP_DEFAULT)
    np.testing.assert_allclose(got[0, 0], [1.0, 0.9, 0.775], atol=1e-6)


def test_a_cube_file_lists_red_fastest(write_sidecar: Callable[..., Path], tmp_path: Path) -> None:
    out = tmp_path / "order.cube"
    bake(write_sidecar(lambda c: (c[0] * 0.5, c[1], c[2])), 0.0, out, size=3)
    lines = out.read_text(encoding="utf-8").splitlines()
    assert "LUT_3D_SIZE 3" in lines
    numbers = [line for line in lines if line[:1].isdigit()]
    assert len(numbers) == 27
    assert [float(v) for v in numbers[1].split()] == [0.25, 0.0, 0.0]
    assert [float(v) for v in numbers[3].split()] == [0.0, 0.5, 0.0]
    assert [float(v) for v in numbers[9].split()] == [0.0, 0.0, 0.5]


def test_nodes_hold_the_exact_colours(warm_sidecar: Path, tmp_path: Path) -> None:
    out = tmp_path / "nodes.clf"
    bake(warm_sidecar, 7.25, out, size=9)
    nodes = lut3d.grid(np.linspace(0, 1, 9, dtype=np.float32))
    got = read_back(out, nodes, ocio.INTERP_DEFAULT)
    np.testing.assert_allclose(got, exact(warm_sidecar, 7.25, nodes), atol=2e-7, rtol=0)


def test_clf_metadata(write_sidecar: Callable[..., Path], tmp_path: Path) -> None:
    sidecar = write_sidecar(lambda c: (c[0], c[1] * 0.9, c[2]), name="A & <B>\n\u00e9\x01")
    out = tmp_path / "meta.clf"
    image = random_colours(100)
    result = bake(sidecar, 4.5, out, size=5, clip=image)
    root = ElementTree.parse(out).getroot()
    space = root.tag.partition("}")[0] + "}"
    sha256 = hashlib.sha256(sidecar.read_bytes()).hexdigest()

    assert root.get("id") == result.id
    assert result.id.startswith("urn:uuid:")
    assert root.get("name") == "palette4d A & <B> \u00e9 frame 4.5"
    assert root.findtext(f"{space}InputDescriptor") == "sRGB"
    assert root.findtext(f"{space}OutputDescriptor") == "sRGB"
    descriptions = [e.text or "" for e in root.findall(f"{space}Description")]
    assert any(sha256 in line for line in descriptions)
    assert any("error on the clip's colours at frame 4: " in line for line in descriptions)
    assert result.clip is not None
    for found in (result.clip, result.grid):
        assert any(stated(found.worst.relative_largest) in line for line in descriptions)
    lut = root.find(f"{space}LUT3D")
    assert lut is not None
    assert lut.get("interpolation") == "tetrahedral"

    # OpenColorIO gives the same metadata back.
    ocio.ClearAllCaches()
    group = (
        ocio.Config.CreateRaw()
        .getProcessor(ocio.FileTransform(src=str(out)))
        .createGroupTransform()
    )
    assert group.getFormatMetadata().getID() == result.id


def test_cube_comments(warm_sidecar: Path, tmp_path: Path) -> None:
    out = tmp_path / "c.cube"
    result = bake(warm_sidecar, 1.0, out, size=5)
    comments = [line for line in out.read_text("utf-8").splitlines() if line.startswith("#")]
    text = "\n".join(comments)
    assert "clip cube, frame 1, strength 1, 3D LUT 5" in text
    assert result.sidecar_sha256 in text
    assert f"largest {stated(result.grid.worst.relative_largest)}" in text
    assert f"deltaE 2000 mean {stated(result.grid.worst.delta_e_mean)}" in text
    assert "deltaE: sRGB" in text
    assert result.id in text


def test_the_same_bake_gives_the_same_bytes_and_id(warm_sidecar: Path, tmp_path: Path) -> None:
    for extension in (".cube", ".clf"):
        names = [tmp_path / f"{k}{extension}" for k in range(2)]
        first, second = (bake(warm_sidecar, 1.0, name, size=9) for name in names)
        assert names[0].read_bytes() == names[1].read_bytes()
        assert first.id == second.id
    ids = {
        bake(warm_sidecar, path=tmp_path / "x.clf", **options, force=True).id
        for options in (
            {"frame": 1.0, "size": 9},
            {"frame": 2.0, "size": 9},
            {"frame": 1.0, "size": 5},
        )
    }
    assert len(ids) == 3


def test_a_document_is_baked_like_its_file(warm_sidecar: Path, tmp_path: Path) -> None:
    document = Document.load(warm_sidecar)
    outs = [tmp_path / f"{k}.cube" for k in range(3)]
    bake(warm_sidecar, 4.0, outs[0], size=5)
    bake(document, 4.0, outs[1], size=5)
    assert outs[0].read_bytes() == outs[1].read_bytes()
    # An edit that is not saved yet is baked, and the file's hash is not claimed.
    document.set("v8", rgb=(0.5, 0.8, 1.0))
    unsaved = bake(document, 0.0, outs[2], size=5)
    assert unsaved.sidecar_sha256 != hashlib.sha256(warm_sidecar.read_bytes()).hexdigest()
    white = np.ones((1, 1, 3), dtype=np.float32)
    got = read_back(outs[2], white, ocio.INTERP_LINEAR)
    np.testing.assert_allclose(got[0, 0], [0.5, 0.8, 1.0], atol=1e-5)
    never_saved = Document(document.fields())
    assert bake(never_saved, 0.0, tmp_path / "no.cube", size=5).sidecar is None


def test_smallest_size(warm_sidecar: Path, tmp_path: Path) -> None:
    for name in ("2.cube", "2.clf"):
        result = bake(warm_sidecar, 0.0, tmp_path / name, size=2)
        assert result.size == 2
        assert result.grid.worst.largest > 0.01


@pytest.mark.slow
def test_largest_size(warm_sidecar: Path, tmp_path: Path) -> None:
    result = bake(warm_sidecar, 0.0, tmp_path / "129.clf", size=129)
    assert result.size == 129
    assert result.grid.worst.largest < 0.001


def test_colours_outside_the_domain_are_counted(warm_sidecar: Path, tmp_path: Path) -> None:
    image = np.full((2, 2, 3), 0.5, dtype=np.float32)
    image[0, 0] = [2.0, 0.5, 0.5]
    image[1, 1] = np.nan
    options = {"frame": 0.0, "size": 9, "shaper": "none"}
    result = bake(warm_sidecar, path=tmp_path / "o.clf", **options, clip=image)
    assert result.clip is not None
    assert result.clip.colours == 3
    assert result.clip.outside_domain == pytest.approx(1 / 3)
    assert result.clip.worst.largest >= 0.9  # the clamp is part of the error


@pytest.mark.parametrize(
    ("options", "name", "word"),
    [
        ({"frame": 0.0, "size": 0}, "a.cube", "2 to 129"),
        ({"frame": 0.0, "size": 1}, "a.cube", "2 to 129"),
        ({"frame": 0.0, "size": 130}, "a.clf", "2 to 129"),
        ({"frame": 0.0, "size": -3}, "a.clf", "2 to 129"),
        ({"frame": -0.5, "size": 9}, "a.clf", "from 0 to 10"),
        ({"frame": 10.01, "size": 9}, "a.clf", "from 0 to 10"),
        ({"frame": 0.0, "size": 9, "strength": 1.5}, "a.clf", "0 to 1"),
        ({"frame": 0.0, "size": 9}, "a.xyz", r"\.cube.*\.clf.*\.cub"),
        ({"frame": 0.0, "size": 9}, "a", "no extension"),
        ({"frame": 0.0, "size": 9}, "none/a.clf", "no folder"),
    ],
)
def test_refusals_write_nothing(
    options: dict[str, Any], name: str, word: str, warm_sidecar: Path, tmp_path: Path
) -> None:
    before = sorted(tmp_path.iterdir())
    with pytest.raises(Palette4dError, match=word):
        bake(warm_sidecar, path=tmp_path / name, **options)
    assert sorted(tmp_path.iterdir()) == before


def test_existing_output_needs_force(warm_sidecar: Path, tmp_path: Path) -> None:
    out = tmp_path / "there.cube"
    out.write_text("mine", encoding="utf-8")
    with pytest.raises(Palette4dError, match="force=True"):
        bake(warm_sidecar, 0.0, out, size=5)
    assert out.read_text(encoding="utf-8") == "mine"
    bake(warm_sidecar, 0.0, out, size=5, force=True)
    assert "LUT_3D_SIZE 5" in out.read_text(encoding="utf-8")


@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse such names")
def test_a_name_that_is_no_utf8_is_refused_where_opencolorio_writes_it(
    warm_sidecar: Path, tmp_path: Path
) -> None:
    folder = tmp_path / os.fsdecode(b"d\xe9")
    folder.mkdir()
    with pytest.raises(Palette4dError, match="not UTF-8; rename"):
        bake(warm_sidecar, 0.0, folder / "a.cube", size=5)
    with pytest.raises(Palette4dError, match="not UTF-8; rename"):
        palette4d.config([warm_sidecar], folder / "config", every=8, anyway=True)
    assert not list(folder.iterdir())
    Document.load(warm_sidecar).save(folder / "s.p4d.json")


@pytest.mark.parametrize("name", ["a.cube", "a.clf"])
def test_folder_names_are_taken_as_they_are(name: str, warm_sidecar: Path, tmp_path: Path) -> None:
    """OpenColorIO would read $HOME and %x% as variables."""
    folder = tmp_path / "d$HOME%x% \u00fc #"
    folder.mkdir()
    result = bake(warm_sidecar, 0.0, folder / name, size=9)
    assert 0 < result.grid.worst.mean < 0.01
    assert [path.name for path in folder.iterdir()] == [name]


def test_a_file_that_is_no_lut(tmp_path: Path) -> None:
    path = tmp_path / "no.cube"
    with pytest.raises(Palette4dError, match="cannot read it"):
        load(path, ["linear"])
    path.write_text("nothing", encoding="utf-8")
    with pytest.raises(Palette4dError, match="cannot read it"):
        load(path, ["linear"])


class TestCommand:
    def write_frames(self, folder: Path, frames: range) -> F32:
        import OpenImageIO as oiio

        folder.mkdir()
        image = random_colours(64 * 36).reshape(36, 64, 3)
        for frame in frames:
            output = oiio.ImageOutput.create("frame.exr")
            output.open(str(folder / f"f.{frame:04d}.exr"), oiio.ImageSpec(64, 36, 3, "float"))
            assert output.write_image(image)
            output.close()
        return image

    def test_json_with_the_sidecars_own_clip(
        self,
        write_sidecar: Callable[..., Path],
        tmp_path: Path,
        capsys: pytest.CaptureFixture[str],
    ) -> None:
        image = self.write_frames(tmp_path / "frames", range(11))
        sidecar = write_sidecar(
            lambda c: (1.0, 0.8, 0.5) if c == (1.0, 1.0, 1.0) else c, source="frames/f.####.exr"
        )
        out = tmp_path / "a.clf"
        arguments = ["bake", str(sidecar), "--frame", "4.4", "-o", str(out), "--size", "9"]
        assert main([*arguments, "--json"]) == 0
        printed = capsys.readouterr()
        report = json.loads(printed.out)
        assert report["clip_frame"] == 4
        assert report["clip"]["colours"] == 64 * 36
        difference = np.abs(
            read_back(out, image, ocio.INTERP_DEFAULT).astype(np.float64)
            - exact(sidecar, 4.4, image)
        )
        assert report["clip"]["worst"]["largest"] == pytest.approx(difference.max(), abs=1e-6)
        assert report["clip"]["worst"]["mean"] == pytest.approx(difference.mean(), abs=1e-6)
        seen = report["clip"]["worst"]["delta_e_largest"] > 1
        assert ("can be seen" in printed.err) == seen
        assert report["error"] == report["clip"]["worst"]["relative_largest"]

    def test_without_the_clip_it_says_so(
        self, warm_sidecar: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "a.cube"
        assert main(["bake", str(warm_sidecar), "--frame", "0", "-o", str(out)]) == 0
        printed = capsys.readouterr()
        assert "--clip" in printed.err
        assert "dense grid, linear" in printed.out
        assert "clip's colours" not in printed.out
        assert "tetrahedral" in printed.out
        assert out.is_file()

    def test_a_given_clip_must_be_there(
        self, warm_sidecar: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        out = tmp_path / "a.cube"
        arguments = ["bake", str(warm_sidecar), "--frame", "0", "-o", str(out)]
        assert main([*arguments, "--clip", str(tmp_path / "no.####.png")]) == 1
        assert "palette4d: error:" in capsys.readouterr().err
        assert not out.exists()


def test_errors_leave_windows_out_but_for_that_of_the_picture(tmp_path: Path) -> None:
    golden = Path(__file__).parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"
    document = Document.load(golden)
    seen = document.grade.palette(4).rgb.mean(axis=0)
    document.pick(4, colour=seen, by=(0.2, 0, 0), follow=False, window=(0, 0, 32, 36), feather=0)
    picture = np.tile(np.float32(seen), (36, 64, 1))
    done = bake(document, 4, tmp_path / "a.cube", clip=picture)
    assert done.clip is not None
    assert done.clip.worst.delta_e_largest < 1
    assert "window of p1" in done.windows
    # The file changes the right half too.
    assert done.clean_up is not None
    assert done.clean_up.most > 5
    assert 0.4 * done.clean_up.most < done.clean_up.mean < 0.6 * done.clean_up.most
    document.set_window("p1", 4, None)
    done = bake(document, 4, tmp_path / "b.cube", clip=picture)
    assert done.windows == ""
    assert done.clean_up is not None
    assert done.clean_up.most < 1
