"""The verb `render`: the core over files, exact where nothing is edited, careful with files."""

from __future__ import annotations

import argparse
import os
from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from clip_files import grey_levels, write_image, write_movie

from palette4d import _core
from palette4d.cli import render
from palette4d.common.errors import Palette4dError, WriteError
from palette4d.media.clip import open_clip
from palette4d.media.frame_writer import FramePattern, OutputError, sample_type, write_frame

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"
EDITED, PLAIN = GOLDEN / "v1_edited.p4d.json", GOLDEN / "v1_split.p4d.json"


def run(*words: object) -> int:
    """Run the verb alone, without the other verbs' modules."""
    parser = argparse.ArgumentParser()
    render.add_parser(parser.add_subparsers())
    args = parser.parse_args(["render", *map(str, words), "--quiet"])
    return args.run(args)


def stored(path: Path) -> tuple[str, np.ndarray, oiio.ImageSpec]:
    """Sample type, samples as they are stored, and the header."""
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), config)
    assert source is not None, oiio.geterror()
    spec = source.spec()
    pixels = source.read_image(0, 0, 0, spec.nchannels, spec.format)
    source.close()
    return str(spec.format), np.asarray(pixels), spec


def colours(*shape: int, low: float = 0.0, high: float = 1.0, seed: int = 1) -> np.ndarray:
    """Random float32 pixels."""
    return np.random.default_rng(seed).uniform(low, high, shape).astype(np.float32)


def by_core(frame: float, pixels: np.ndarray, *, strength: float = 1.0, premultiplied=False):
    """The recolouring, put together here from the core's parts."""
    sidecar = _core.read_sidecar(str(EDITED))
    palette = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, sidecar.edits, palette)
    assert not np.array_equal(edited, palette.rgb)
    recolourer = _core.Recolourer(palette.rgb, edited, palette.faces)
    return recolourer.apply(
        pixels, strength=strength, premultiplied=premultiplied, threads=1, precision="single"
    )


@pytest.mark.parametrize("threads", [0, 1, 3])
@pytest.mark.parametrize("strength", [1.0, 0.25])
def test_frames_are_the_cores_own(tmp_path, threads, strength):
    frames = {n: colours(9, 13, 3, low=-0.5, high=1.5, seed=n) for n in range(3, 8)}
    for n, pixels in frames.items():
        write_image(tmp_path / "in" / f"c.{n:04d}.exr", pixels)
    output = tmp_path / "out" / "o.####.exr"
    assert (
        run(EDITED, tmp_path / "in", "-o", output, "--threads", threads, "--strength", strength)
        == 0
    )
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        f"o.{n:04d}.exr" for n in frames
    ]
    for n, pixels in frames.items():
        kind, written, _ = stored(tmp_path / "out" / f"o.{n:04d}.exr")
        assert kind == "float"
        np.testing.assert_array_equal(written, by_core(n, pixels, strength=strength))
        assert not np.array_equal(written, pixels)


def test_unedited_float_passes_bit_for_bit(tmp_path):
    pixels = colours(8, 8, 3, low=-2, high=9)
    pixels[0, 0] = [np.nan, np.inf, -np.inf]
    pixels[0, 1] = [-0.0, 1e-40, 3e38]
    write_image(tmp_path / "c.0005.exr", pixels)
    assert run(PLAIN, tmp_path / "c.0005.exr", "-o", tmp_path / "o.exr") == 0
    _, written, _ = stored(tmp_path / "o.exr")
    np.testing.assert_array_equal(written.view(np.uint32), pixels.view(np.uint32))


@pytest.mark.parametrize(
    ("kind", "extension"),
    [(np.uint8, "png"), (np.uint16, "png"), (np.uint8, "tif"), (np.uint16, "tif")],
)
@pytest.mark.parametrize("channels", [3, 4])
def test_unedited_integers_pass_at_their_own_depth(tmp_path, kind, extension, channels):
    top = np.iinfo(kind).max
    values = np.random.default_rng(2).integers(0, top, (300, 300, channels), kind, endpoint=True)
    path = write_image(tmp_path / f"c.0005.{extension}", values, oiio__UnassociatedAlpha=1)
    assert run(PLAIN, path, "-o", tmp_path / f"o.{extension}") == 0
    name, written, _ = stored(tmp_path / f"o.{extension}")
    assert name == np.dtype(kind).name
    np.testing.assert_array_equal(written, values)


def test_premultiplied_colours_are_recoloured_straight(tmp_path):
    alpha = np.float32(0.5)
    pixels = np.concatenate([colours(4, 4, 3) * alpha, np.full((4, 4, 1), alpha)], axis=2)
    pixels[0, 0] = 0
    write_image(tmp_path / "c.0005.exr", pixels)
    assert run(EDITED, tmp_path / "c.0005.exr", "-o", tmp_path / "o.exr") == 0
    _, written, _ = stored(tmp_path / "o.exr")
    np.testing.assert_array_equal(written, by_core(5, pixels, premultiplied=True))
    assert not np.array_equal(written, by_core(5, pixels, premultiplied=False))
    np.testing.assert_array_equal(written[0, 0], 0)
    np.testing.assert_array_equal(written[..., 3], pixels[..., 3])


def test_alpha_follows_each_formats_convention(tmp_path):
    straight = np.array([[[200, 100, 40, 51], [10, 20, 30, 0]]], np.uint8)
    png = write_image(tmp_path / "c.0005.png", straight, oiio__UnassociatedAlpha=1)
    assert run(PLAIN, png, "-o", tmp_path / "o.exr") == 0
    _, exr, spec = stored(tmp_path / "o.exr")
    assert spec.alpha_channel == 3
    np.testing.assert_allclose(exr[0, 0], np.array([40, 20, 8, 51]) / 255, atol=1e-6)
    np.testing.assert_array_equal(exr[0, 1], 0)
    assert run(PLAIN, tmp_path / "o.exr", "-o", tmp_path / "back.png", "--bits", 8) == 0
    _, back, _ = stored(tmp_path / "back.png")
    np.testing.assert_array_equal(back[0, 0], straight[0, 0])


def test_integer_outputs_are_rounded_and_clamped(tmp_path):
    pixels = np.array(
        [[[-0.5, 0.5, 1.5], [np.nan, np.inf, -np.inf], [1 / 3, 0.0, 1.0]]], np.float32
    )
    write_image(tmp_path / "c.0005.exr", pixels)
    expected = {
        "png": np.array([[[0, 32768, 65535], [0, 65535, 0], [21845, 0, 65535]]], np.uint16),
        "8": np.array([[[0, 128, 255], [0, 255, 0], [85, 0, 255]]], np.uint8),
    }
    assert run(PLAIN, tmp_path / "c.0005.exr", "-o", tmp_path / "o.png") == 0
    assert run(PLAIN, tmp_path / "c.0005.exr", "-o", tmp_path / "p.png", "--bits", 8) == 0
    assert run(PLAIN, tmp_path / "c.0005.exr", "-o", tmp_path / "o.tif") == 0
    kind, written, _ = stored(tmp_path / "o.png")
    assert kind == "uint16"
    np.testing.assert_array_equal(written, expected["png"])
    np.testing.assert_array_equal(stored(tmp_path / "p.png")[1], expected["8"])
    assert stored(tmp_path / "o.tif")[0] == "float"
    np.testing.assert_array_equal(stored(tmp_path / "o.tif")[1], pixels)


def test_half_keeps_finite_values_finite(tmp_path):
    pixels = np.array([[[0.1, 1e6, -1e6], [np.nan, np.inf, 2.0]]], np.float32)
    write_image(tmp_path / "c.0005.exr", pixels)
    assert run(PLAIN, tmp_path / "c.0005.exr", "-o", tmp_path / "o.exr", "--half") == 0
    kind, written, spec = stored(tmp_path / "o.exr")
    assert kind == "half"
    expected = np.array([[[0.1, 65504, -65504], [np.nan, np.inf, 2.0]]], np.float16)
    np.testing.assert_array_equal(written.astype(np.float16), expected)
    assert spec.get_string_attribute("compression") == "zip"


def test_frames_are_chosen_and_keep_their_numbers(tmp_path):
    grey_levels(tmp_path / "in", range(0, 21))
    output = tmp_path / "ö ut" / "f_%03d.png"
    assert run(PLAIN, tmp_path / "in", "-o", output, "--frames", "4-12x4") == 0
    names = sorted(p.name for p in output.parent.iterdir())
    assert names == ["f_004.png", "f_008.png", "f_012.png"]
    assert stored(output.parent / "f_008.png")[1][0, 0, 0] == 8


def test_any_list_of_frames_is_rendered(tmp_path, capsys):
    grey_levels(tmp_path / "in", range(0, 31, 3))
    output = tmp_path / "out" / "o.##.png"
    assert run(PLAIN, tmp_path / "in", "-o", output, "--frames", "12,0,30") == 0
    assert sorted(p.name for p in output.parent.iterdir()) == ["o.00.png", "o.12.png", "o.30.png"]
    assert stored(output.parent / "o.12.png")[1][0, 0, 0] == 12
    assert "rendered 3 frames" in capsys.readouterr().out


def test_any_list_of_a_movies_frames_is_rendered(tmp_path):
    frames = [np.random.default_rng(n).integers(0, 255, (6, 8, 3), np.uint8) for n in range(6)]
    movie = write_movie(tmp_path / "m.avi", "rawvideo", "bgr24", frames, "rgb24", rate=Fraction(25))
    assert run(PLAIN, movie, "-o", tmp_path / "o.#.png", "--frames", "0,1,4") == 0
    assert sorted(p.name for p in tmp_path.glob("*.png")) == ["o.0.png", "o.1.png", "o.4.png"]
    np.testing.assert_array_equal(stored(tmp_path / "o.4.png")[1], frames[4])


def test_frames_outside_the_sidecar_take_its_ends(tmp_path, capsys):
    pixels = colours(4, 4, 3)
    for n in (-3, 19, 41):
        write_image(tmp_path / "in" / f"c.{n:04d}.exr", pixels)
    for n in (-3, 41):
        assert run(EDITED, tmp_path / "in" / f"c.{n:04d}.exr", "-o", tmp_path / f"o{n}.exr") == 0
        error = capsys.readouterr().err
        assert "spans frames 0 to 20" in error
        assert f"; frame {n} takes the nearest end" in error
        np.testing.assert_array_equal(
            stored(tmp_path / f"o{n}.exr")[1], by_core(0 if n < 0 else 20, pixels)
        )


def test_metadata_goes_along(tmp_path):
    write_image(
        tmp_path / "c.0005.exr",
        colours(2, 2, 3),
        FramesPerSecond=Fraction(24000, 1001),
        oiio__ColorSpace="lin_rec709_scene",
        reelName="A001",
    )
    assert run(PLAIN, tmp_path / "c.0005.exr", "-o", tmp_path / "o.exr") == 0
    clip = open_clip(str(tmp_path / "o.exr"))
    assert (clip.rate, clip.encoding) == (Fraction(24000, 1001), "linear Rec.709")
    assert stored(tmp_path / "o.exr")[2].get_string_attribute("reelName") == "A001"
    for extension in ("png", "tif"):
        assert run(PLAIN, tmp_path / "c.0005.exr", "-o", tmp_path / f"o.{extension}") == 0


def test_movie_as_input(tmp_path):
    frames = [np.random.default_rng(n).integers(0, 255, (6, 8, 3), np.uint8) for n in range(4)]
    movie = write_movie(tmp_path / "m.avi", "rawvideo", "bgr24", frames, "rgb24", rate=Fraction(25))
    assert run(PLAIN, movie, "-o", tmp_path / "o.##.png") == 0
    for n, frame in enumerate(frames):
        np.testing.assert_array_equal(stored(tmp_path / f"o.{n:02d}.png")[1], frame)
    assert run(PLAIN, movie, "-o", tmp_path / "o.##.exr", "--frames", "1") == 0
    assert open_clip(str(tmp_path / "o.01.exr")).rate == 25


def test_existing_frames_are_kept_unless_forced(tmp_path):
    grey_levels(tmp_path / "in", range(3))
    output = tmp_path / "o.#.png"
    (tmp_path / "o.1.png").write_bytes(b"precious")
    with pytest.raises(Palette4dError, match=r"o\.1\.png: it exists already.*--force"):
        run(PLAIN, tmp_path / "in", "-o", output)
    assert (tmp_path / "o.1.png").read_bytes() == b"precious"
    assert not (tmp_path / "o.0.png").exists()
    assert run(PLAIN, tmp_path / "in", "-o", output, "--force") == 0
    assert stored(tmp_path / "o.1.png")[1][0, 0, 0] == 1


def test_its_own_input_is_never_replaced(tmp_path):
    folder = grey_levels(tmp_path / "in", range(3))
    before = {p: p.read_bytes() for p in folder.iterdir()}
    with pytest.raises(Palette4dError, match="frame of the clip itself"):
        run(PLAIN, folder, "-o", folder / "clip.####.png", "--force")
    (tmp_path / "link").symlink_to(folder)
    with pytest.raises(Palette4dError, match="frame of the clip itself"):
        run(PLAIN, folder, "-o", tmp_path / "link" / "clip.%04d.png", "--force")
    assert {p: p.read_bytes() for p in folder.iterdir()} == before


def test_wrong_requests_are_refused_before_anything_is_written(tmp_path):
    folder = grey_levels(tmp_path / "in", range(3))
    for words, message in (
        (["-o", tmp_path / "x" / "o.png"], "3 frames would go into one file"),
        (["-o", tmp_path / "x" / "o.####.gif"], 'extension ".gif"'),
        (["-o", tmp_path / "x" / "o.1-3#.png"], "found the range"),
        (["-o", tmp_path / "x" / "o.#.png", "--half"], "--half"),
        (["-o", tmp_path / "x" / "o.#.png", "--bits", 32], "--bits 32"),
    ):
        with pytest.raises(Palette4dError, match=message):
            run(PLAIN, folder, *words)
    with pytest.raises(Palette4dError, match=r"none\.json"):
        run(tmp_path / "none.json", folder, "-o", tmp_path / "x" / "o.#.png")
    assert not (tmp_path / "x").exists()


def test_bad_frames_stop_or_are_left_out(tmp_path, capsys):
    folder = grey_levels(tmp_path / "in", range(4))
    (folder / "clip.0002.png").write_bytes(b"no picture")
    with pytest.raises(Palette4dError, match="frame 2"):
        run(PLAIN, folder, "-o", tmp_path / "a" / "o.#.png")
    assert run(PLAIN, folder, "-o", tmp_path / "b" / "o.#.png", "--skip-bad-frames") == 0
    assert sorted(p.name for p in (tmp_path / "b").iterdir()) == ["o.0.png", "o.1.png", "o.3.png"]
    assert "skipped bad frame 2" in capsys.readouterr().err


@pytest.mark.parametrize("extension", ["exr", "png", "tif"])
def test_full_disk_is_said_and_nothing_half_written_stays(tmp_path, extension):
    resource = pytest.importorskip("resource", reason="file size limits are a Unix thing")
    signal = pytest.importorskip("signal")
    pixels = colours(200, 200, 3)
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, limit[1]))
        samples = sample_type(extension, "uint16")
        with pytest.raises(WriteError):
            write_frame(tmp_path / f"o.{extension}", pixels, samples)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, handler)
    assert list(tmp_path.iterdir()) == []


def test_folders_that_cannot_be_written_are_named(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    grey_levels(tmp_path / "in", range(2))
    with pytest.raises(OutputError, match="cannot be created"):
        run(PLAIN, tmp_path / "in", "-o", tmp_path / "file" / "o.#.png")
    for folder in ("none", "file"):
        with pytest.raises(Palette4dError, match=r"o\.png"):
            write_frame(tmp_path / folder / "o.png", colours(2, 2, 3), "uint8")
    if os.geteuid() != 0:  # root may write everywhere
        (tmp_path / "locked").mkdir(mode=0o500)
        with pytest.raises(WriteError):
            write_frame(tmp_path / "locked" / "o.png", colours(2, 2, 3), "uint8")


def test_output_names():
    assert FramePattern.parse("a/b.####.exr").path(7) == Path("a/b.0007.exr")
    assert FramePattern.parse("a/b.%04d.exr").path(-7) == Path("a/b.-007.exr")
    assert FramePattern.parse("b.#.TIFF").path(12345) == Path("b.12345.TIFF")
    assert FramePattern.parse("b.@@.png").path(5) == Path("b.05.png")
    assert FramePattern.parse("b.0001.png").path(5) == Path("b.0001.png")
    assert FramePattern.parse("b.tiff").extension == "tif"
