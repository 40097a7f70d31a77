"""EXR files that hold more than the picture: a render colours the picture and keeps the rest."""

from __future__ import annotations

import shutil
import subprocess
import warnings
from pathlib import Path

import numpy as np
import OpenEXR
import OpenImageIO as oiio
import pytest
from clip_files import write_image
from deliveries import render, tiles

from palette4d.common.errors import WriteError
from palette4d.grade import rendering
from palette4d.grade.document import Document
from palette4d.media import clip_base, exr_around, exr_copy
from palette4d.media.clip import open_clip

EDITED = Document.load(
    Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"
)
MATRIX = np.arange(16, dtype=np.float32).reshape(4, 4)


def planes(height: int, width: int, *kinds: type, seed: int = 1) -> list[np.ndarray]:
    """Random channels; integers use all of their bits."""
    generator = np.random.default_rng(seed)
    return [
        generator.integers(0, 2**32, (height, width), np.uint32)
        if kind is np.uint32
        else generator.uniform(-0.2, 1.4, (height, width)).astype(kind)
        for kind in kinds
    ]


def everything(path: Path, compression: object = None) -> Path:
    """An EXR of two parts: overscan, a depth, an id, a second view, a camera, a mask."""
    half = np.float16
    window = (np.array([-8, -4], np.int32), np.array([55, 43], np.int32))
    shown = (np.array([0, 0], np.int32), np.array([47, 31], np.int32))
    names = ("R", "G", "B", "A", "Z", "id", "right.R", "right.G", "right.B")
    kinds = (half, half, half, half, np.float32, np.uint32, half, half, half)
    beauty = {
        name: OpenEXR.Channel(plane)
        for name, plane in zip(names, planes(48, 64, *kinds), strict=True)
    }
    beauty["A"].pixels[:] = 1
    header = {
        "name": "beauty",
        "type": OpenEXR.scanlineimage,
        "compression": compression or OpenEXR.PIZ_COMPRESSION,
        "dataWindow": window,
        "displayWindow": shown,
        "worldToCamera": MATRIX,
        "comment": "shot 12",
        "owner": "Jane",
    }
    mask = {"coverage": OpenEXR.Channel(planes(32, 48, np.float32, seed=9)[0])}
    part = {
        "name": "mask",
        "type": OpenEXR.scanlineimage,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "displayWindow": shown,
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        OpenEXR.File([OpenEXR.Part(header, beauty), OpenEXR.Part(part, mask)]).write(str(path))
    return path


def parts(path: Path) -> list:
    return OpenEXR.File(str(path), separate_channels=True).parts


def test_all_but_the_picture_is_kept(tmp_path):
    source = everything(tmp_path / "c.0005.exr")
    render(source, tmp_path / "o.exr")
    before, after = parts(source), parts(tmp_path / "o.exr")
    assert len(after) == 2
    for old, new in zip(before, after, strict=True):
        assert {*old.header, "software"} == set(new.header)
        assert set(old.channels) == set(new.channels)
        for name, channel in old.channels.items():
            np.testing.assert_array_equal(new.channels[name].pixels, channel.pixels)
            kind = np.float32 if name in "RGBA" else channel.pixels.dtype
            assert new.channels[name].pixels.dtype == kind
    np.testing.assert_array_equal(after[0].header["worldToCamera"], MATRIX)
    assert after[0].header["comment"] == "shot 12"
    np.testing.assert_array_equal(after[0].header["dataWindow"][0], [-8, -4])
    if shutil.which("oiiotool"):
        told = subprocess.run(
            ["oiiotool", "--info", "-v", "-a", str(tmp_path / "o.exr")],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for text in ("64 x   48", "worldToCamera", "coverage", "right.R", "pixel data origin"):
            assert text in told


@pytest.mark.parametrize("origin", [(-8, -4), (6, 5)], ids=["overscan", "cropped"])
@pytest.mark.parametrize("clean_up", [0.0, 1.0])
def test_a_window_lies_in_the_display_window(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, origin: tuple[int, int], clean_up: float
) -> None:
    """Of EXR to EXR, where the whole data window is drawn; strips know their place as well."""
    source = tmp_path / "c.0005.exr"
    image = np.full((48, 40, 4), 0.5, np.float32)
    names = ("R", "G", "B", "Z")
    write_image(source, image, names=names, origin=origin, full=(0, 0, 48, 40))
    fields = EDITED.fields()
    fields["clip"]["size"] = [48, 40]
    document = Document(fields)
    document.reset()
    document.pick(5, colour=(0.5, 0.5, 0.5), to=(0.9, 0.5, 0.5), whole_hue=True)
    document.set_window("p1", 5, (12, 10, 30, 24), feather=1, follow=False)
    rendering.render(document, source, tmp_path / "o.png", clean_up=clean_up)
    shown = oiio.ImageBuf(str(tmp_path / "o.png")).get_pixels()
    for large in (rendering.LARGE, 100):
        monkeypatch.setattr(rendering, "LARGE", large)
        monkeypatch.setattr(clip_base, "STRIP", 7 * 40)
        rendering.render(document, source, tmp_path / "o.exr", clean_up=clean_up, force=True)
        drawn = open_clip(tmp_path / "o.exr").read(0)
        if clean_up == 0:
            rows, columns = np.nonzero(drawn[..., 0] > 0.8)
            assert (columns.min(), rows.min(), columns.max(), rows.max()) == (12, 10, 29, 23)
        inside = drawn[..., 1] > 0
        # The filter sees the overscan, too.
        np.testing.assert_allclose(drawn[inside], shown[inside], atol=0.1 if clean_up else 0.01)


def test_later_frames_keep_what_the_first_has_not(tmp_path: Path) -> None:
    image = np.random.default_rng(2).random((12, 20, 4)).astype(np.float32)
    write_image(tmp_path / "c.0001.exr", image[..., :3])
    write_image(tmp_path / "c.0002.exr", image, names=("R", "G", "B", "Z"))
    write_image(tmp_path / "c.0003.exr", image[..., :3], origin=(-2, -1), full=(0, 0, 20, 12))
    whole, part = tmp_path / "whole.####.exr", tmp_path / "part.####.exr"
    rendering.render(EDITED, tmp_path / "c.####.exr", whole)
    rendering.render(EDITED, tmp_path / "c.####.exr", part, frames="2-3")
    for frame in (2, 3):
        (before,), (after,) = (
            parts(tmp_path / f"{name}.000{frame}.exr") for name in ("c", "whole")
        )
        assert set(after.channels) == set(before.channels)
        for window in ("dataWindow", "displayWindow"):
            np.testing.assert_array_equal(after.header[window], before.header[window])
        (again,) = parts(tmp_path / f"part.000{frame}.exr")
        for name, channel in after.channels.items():
            np.testing.assert_array_equal(again.channels[name].pixels, channel.pixels)


@pytest.mark.parametrize("orientation", [3, 6])
def test_a_turned_file_is_written_upright(tmp_path: Path, orientation: int) -> None:
    source = tmp_path / "c.0005.exr"
    image = np.random.default_rng(2).random((12, 20, 4)).astype(np.float32)
    write_image(source, image, names=("R", "G", "B", "Z"), Orientation=orientation)
    done = rendering.render(EDITED, source, tmp_path / "o.####.exr", strength=0)
    assert any("not kept" in note for note in done.notes)
    before, after = (open_clip(path).load(5).pixels for path in (source, tmp_path / "o.0005.exr"))
    np.testing.assert_allclose(before, after, atol=1e-3)


@pytest.mark.parametrize("half", [False, True])
def test_the_picture_is_recoloured_in_the_overscan_too(tmp_path, half):
    source = everything(tmp_path / "c.0005.exr")
    done = rendering.render(EDITED, source, tmp_path / "o.exr", half=half)
    assert not any("not kept" in note for note in done.notes)
    old, new = parts(source)[0].channels, parts(tmp_path / "o.exr")[0].channels
    pixels = np.stack([old[name].pixels for name in "RGBA"], axis=-1).astype(np.float32)
    expected = EDITED.recolour(pixels, 5, premultiplied=True)
    expected = expected.astype(np.float16 if half else np.float32)
    found = np.stack([new[name].pixels for name in "RGBA"], axis=-1)
    np.testing.assert_array_equal(found, expected)
    assert not np.array_equal(found, pixels.astype(found.dtype))
    np.testing.assert_array_equal(new["Z"].pixels, old["Z"].pixels)
    np.testing.assert_array_equal(new["id"].pixels, old["id"].pixels)


def test_lossy_compressions_are_not_applied_twice(tmp_path):
    source = everything(tmp_path / "c.0005.exr", OpenEXR.DWAA_COMPRESSION)
    render(source, tmp_path / "o.exr")
    for old, new in zip(parts(source), parts(tmp_path / "o.exr"), strict=True):
        for name, channel in old.channels.items():
            np.testing.assert_array_equal(new.channels[name].pixels, channel.pixels)


def test_what_is_dropped_is_said_once(tmp_path):
    for number in (5, 6):
        everything(tmp_path / f"c.{number:04d}.exr")
    for name, options in (
        ("o.####.png", {}),
        ("o.mov", {}),
        ("o.####.exr", {"compare": "side"}),
        ("o.####.exr", {"show": "outside"}),
    ):
        done = render(tmp_path / "c.####.exr", tmp_path / name, **options)
        said = [note for note in done.notes if "not kept" in note]
        assert len(said) == 1
        for text in ("overscan", "5 further channels", "1 further part"):
            assert text in said[0]


def test_the_analysis_sees_the_display_window(tmp_path):
    clip = open_clip(str(everything(tmp_path / "c.0005.exr")))
    assert (clip.width, clip.height) == (48, 32)
    assert clip.read(5).shape == (32, 48, 4)


def test_attributes_of_a_plain_exr_are_kept(tmp_path):
    pixels = np.zeros((8, 8, 3), np.float32)
    source = write_image(tmp_path / "c.0005.exr", pixels, Copyright="Jane", comment="x", iso=400)
    render(source, tmp_path / "o.exr")
    spec = oiio.ImageInput.open(str(tmp_path / "o.exr")).spec()
    found = [spec.getattribute(name) for name in ("Copyright", "comment", "iso")]
    assert found == ["Jane", "x", 400]


def test_metadata_of_dpx_and_tiff_are_kept(tmp_path):
    pixels = np.full((8, 8, 3), 2**15, np.uint16)
    attributes = {"DocumentName": "feature", "dpx:InputDevice": "scanner", "dpx:FrameId": "A12"}
    source = write_image(
        tmp_path / "c.0005.dpx", pixels, **{n.replace(":", "__"): v for n, v in attributes.items()}
    )
    render(source, tmp_path / "o.dpx", bits=16)
    spec = oiio.ImageInput.open(str(tmp_path / "o.dpx")).spec()
    first = oiio.ImageInput.open(str(source)).spec()
    for name in attributes:
        assert spec.getattribute(name) == first.getattribute(name) == attributes[name]
    source = write_image(
        tmp_path / "c.0005.tif", pixels, FNumber=2.8, DocumentName="plate", Artist="Jane"
    )
    render(source, tmp_path / "o.tif")
    spec = oiio.ImageInput.open(str(tmp_path / "o.tif")).spec()
    assert spec.getattribute("DocumentName") == "plate"
    assert spec.getattribute("FNumber") == pytest.approx(2.8)


@pytest.mark.parametrize("bits", [10, 16])
def test_dpx_holds_the_code_values(tmp_path, bits):
    frame = tiles(1, (32, 48))[0].astype(np.uint16) * 257
    source = write_image(tmp_path / "c.0005.png", frame)
    render(source, tmp_path / "o.0005.dpx", bits=bits)
    clip = open_clip(str(tmp_path / "o.0005.dpx"))
    assert clip.depth == f"uint{bits}"
    np.testing.assert_allclose(clip.read(5), frame / 65535, atol=0.51 / (2**bits - 1))
    if shutil.which("ffmpeg"):
        words = f"ffmpeg -v error -i {tmp_path / 'o.0005.dpx'} -f rawvideo -pix_fmt rgb48le -"
        shown = subprocess.run(words.split(), capture_output=True, check=True).stdout
        read = np.frombuffer(shown, "<u2").reshape(frame.shape)
        np.testing.assert_allclose(read / 65535, frame / 65535, atol=1.1 / (2**bits - 1))


def test_jpeg_proxies_are_near_and_whole(tmp_path):
    frame = tiles(1, (32, 48))[0]
    render(write_image(tmp_path / "c.0005.png", frame), tmp_path / "o.jpg")
    found = open_clip(str(tmp_path / "o.jpg")).read(0)
    np.testing.assert_allclose(found[8::16, 8::16], frame[8::16, 8::16] / 255, atol=0.03)


def test_a_full_disk_is_said_and_nothing_half_written_stays(tmp_path):
    resource = pytest.importorskip("resource", reason="file size limits are a Unix thing")
    signal = pytest.importorskip("signal")
    source = everything(tmp_path / "c.0005.exr")
    out = tmp_path / "out"
    out.mkdir()
    clip = open_clip(str(source))
    around = clip.load(5).around
    pixels = np.zeros((48, 64, 4), np.float32)
    size = source.stat().st_size
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        for short in (1000, size // 2):
            resource.setrlimit(resource.RLIMIT_FSIZE, (short, limit[1]))
            with pytest.raises(WriteError):
                exr_copy.write_around(out / "o.exr", around, pixels, "float", software="")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, handler)
    assert list(out.iterdir()) == []


def test_a_file_that_was_not_closed_is_seen(tmp_path):
    source = write_image(tmp_path / "c.exr", np.ones((32, 8, 3), np.float32), compression="zip")
    assert exr_around.has_every_block(source)
    data = bytearray(source.read_bytes())
    # Two places of 8 bytes; the first block follows them.
    table = next(i for i in range(len(data)) if int.from_bytes(data[i : i + 8], "little") == i + 16)
    data[table + 8 : table + 16] = bytes(8)
    source.write_bytes(data)
    assert not exr_around.has_every_block(source)
