"""The verb `render`: exact pixels, unchanged where nothing is edited, and files that are kept."""

from __future__ import annotations

import os
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import OpenImageIO as oiio
import pytest
from clip_files import grey_levels, write_image, write_movie
from posix_files import links

from palette4d import _core
from palette4d.cli import render
from palette4d.common.arguments import Parser
from palette4d.common.errors import Palette4dError, WriteError
from palette4d.grade import rendering
from palette4d.grade.document import Document
from palette4d.media.clip import open_clip
from palette4d.media.frame_writer import FramePattern, sample_type, write_frame

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"
EDITED, PLAIN = GOLDEN / "v1_edited.p4d.json", GOLDEN / "v1_split.p4d.json"
PICKS = GOLDEN / "v2_picks.p4d.json"


def run(*words: object) -> int:
    """Run the verb alone, without the other verbs' modules."""
    parser = Parser()
    render.add_parser(parser.add_subparsers())
    args = parser.parse_args(["render", *map(str, words)])
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
    assert "3 frames" in capsys.readouterr().out


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
        assert "spans frames 0 to 20" in capsys.readouterr().err
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


def test_latin_1_text_goes_along(tmp_path):
    path = write_image(tmp_path / "c.0005.exr", colours(2, 2, 3), Artist="Andr++")
    path.write_bytes(path.read_bytes().replace(b"Andr++", b"Andr\xe9s"))
    for extension in ("exr", "png", "tif"):
        assert run(PLAIN, path, "-o", tmp_path / f"o.{extension}") == 0
        assert stored(tmp_path / f"o.{extension}")[2].get_string_attribute("Artist") == "Andrés"


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
    with pytest.raises(Palette4dError, match=r"o\.1\.png: found a file there.*force=True"):
        run(PLAIN, tmp_path / "in", "-o", output)
    assert (tmp_path / "o.1.png").read_bytes() == b"precious"
    assert not (tmp_path / "o.0.png").exists()
    assert run(PLAIN, tmp_path / "in", "-o", output, "--force") == 0
    assert stored(tmp_path / "o.1.png")[1][0, 0, 0] == 1


def test_its_own_input_is_never_replaced(tmp_path):
    folder = grey_levels(tmp_path / "in", range(3))
    before = {p: p.read_bytes() for p in folder.iterdir()}
    with pytest.raises(Palette4dError, match="of the clip itself"):
        run(PLAIN, folder, "-o", folder / "clip.####.png", "--force")
    assert {p: p.read_bytes() for p in folder.iterdir()} == before


@links
def test_its_own_input_is_not_replaced_through_a_link(tmp_path):
    folder = grey_levels(tmp_path / "in", range(3))
    before = {p: p.read_bytes() for p in folder.iterdir()}
    (tmp_path / "link").symlink_to(folder)
    with pytest.raises(Palette4dError, match="of the clip itself"):
        run(PLAIN, folder, "-o", tmp_path / "link" / "clip.%04d.png", "--force")
    assert {p: p.read_bytes() for p in folder.iterdir()} == before


def test_wrong_requests_are_refused_before_anything_is_written(tmp_path):
    folder = grey_levels(tmp_path / "in", range(3))
    for words, message in (
        (["-o", tmp_path / "x" / "o.png"], "3 frames would go into one file"),
        (["-o", tmp_path / "x" / "o.####.gif"], 'extension ".gif"'),
        (["-o", tmp_path / "x" / "o.avi"], "OUT.mp4"),
        (["-o", tmp_path / "x" / "o.1-3#.png"], "found the range"),
        (["-o", tmp_path / "x" / "o.#.png", "--half"], "half=True"),
        (["-o", tmp_path / "x" / "o.#.png", "--bits", 32], "32 bits"),
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
        run(PLAIN, folder, "-o", tmp_path / "a" / "o.#.png", "--missing", "error")
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
    with pytest.raises(Palette4dError, match="file"):
        run(PLAIN, tmp_path / "in", "-o", tmp_path / "file" / "o.#.png")
    for folder in ("none", "file"):
        with pytest.raises(Palette4dError, match=r"o\.png"):
            write_frame(tmp_path / folder / "o.png", colours(2, 2, 3), "uint8")
    if os.name == "posix" and os.geteuid() != 0:  # root may write everywhere
        (tmp_path / "locked").mkdir(mode=0o500)
        with pytest.raises(WriteError):
            write_frame(tmp_path / "locked" / "o.png", colours(2, 2, 3), "uint8")


def test_frames_beside_an_opened_clip_are_refused(tmp_path):
    grey_levels(tmp_path / "in", range(4))
    clip = open_clip(str(tmp_path / "in"), frames="1-2")
    with pytest.raises(Palette4dError, match="beside an opened clip"):
        rendering.render(PLAIN, clip, tmp_path / "o.#.png", frames="2")
    assert rendering.render(PLAIN, clip, tmp_path / "o.#.png").frames == [1, 2]


def test_output_names():
    assert FramePattern.parse("a/b.####.exr").path(7) == Path("a/b.0007.exr")
    assert FramePattern.parse("a/b.%04d.exr").path(-7) == Path("a/b.-007.exr")
    assert FramePattern.parse("b.#.TIFF").path(12345) == Path("b.12345.TIFF")
    assert FramePattern.parse("b.@@.png").path(5) == Path("b.05.png")
    assert FramePattern.parse("b.0001.png").path(5) == Path("b.0001.png")
    assert FramePattern.parse("b.tiff").extension == "tif"


def movie_of(folder: Path, count: int = 6, size: tuple[int, int] = (48, 64)) -> Path:
    """A lossless movie of flat tiles, 25 frames a second."""
    tiles = np.random.default_rng(3).integers(20, 235, (count, size[0] // 16, size[1] // 16, 3))
    frames = [np.kron(frame, np.ones((16, 16, 1))).astype(np.uint8) for frame in tiles]
    folder.mkdir(exist_ok=True)
    return write_movie(folder / "m.avi", "rawvideo", "bgr24", frames, "rgb24", rate=Fraction(25))


def centres(pixels: np.ndarray) -> np.ndarray:
    """The middle of each tile, where chroma of neighbours does not reach."""
    return pixels[8::16, 8::16]


@pytest.mark.parametrize(("name", "codec"), [("o.mp4", "h264"), ("o.mov", "prores")])
def test_a_movie_holds_the_recoloured_frames(tmp_path, name, codec):
    source = movie_of(tmp_path / "in")
    assert run(EDITED, source, "-o", tmp_path / "out" / name) == 0
    assert [path.name for path in (tmp_path / "out").iterdir()] == [name]
    clip = open_clip(str(tmp_path / "out" / name))
    assert (clip.rate, clip.frames, clip.width, clip.height) == (25, list(range(6)), 64, 48)
    for frame, pixels in open_clip(str(source)):
        expected = np.clip(by_core(frame, pixels), 0, 1)
        assert np.abs(expected - pixels).max() > 0.05
        np.testing.assert_allclose(centres(clip.read(frame)), centres(expected), atol=0.025)
    with av.open(str(tmp_path / "out" / name)) as movie:
        assert movie.streams.video[0].codec_context.name == codec


def test_a_movies_colours_have_no_bias(tmp_path):
    source = movie_of(tmp_path / "in", size=(128, 256))
    assert run(PLAIN, source, "-o", tmp_path / "o.mov") == 0
    error = centres(open_clip(str(tmp_path / "o.mov")).read(0) - open_clip(str(source)).read(0))
    assert abs(error.mean()) < 0.0005
    assert np.abs(error).max() < 0.01


def test_a_movie_says_its_colours(tmp_path):
    pixels = np.full((16, 16, 3), 0.5, np.float32)
    write_image(tmp_path / "c.0003.png", np.rint(pixels * 65535).astype(np.uint16))
    for name in ("o.mp4", "o.mov"):
        assert run(PLAIN, tmp_path / "c.0003.png", "-o", tmp_path / name) == 0
        clip = open_clip(str(tmp_path / name))
        assert (clip.encoding, clip.rate) == ("sRGB", 24)  # the rate is the sidecar's
        with av.open(str(tmp_path / name)) as movie:
            picture = next(movie.decode(video=0))
            assert (picture.color_primaries, picture.colorspace, picture.color_range) == (1, 1, 1)


def test_an_odd_size_of_a_movie_grows_by_a_copy_of_the_last(tmp_path):
    pixels = colours(15, 17, 3)
    write_image(tmp_path / "c.0003.png", np.rint(pixels * 65535).astype(np.uint16))
    for name, height in (("o.mp4", 16), ("o.mov", 15)):
        assert run(PLAIN, tmp_path / "c.0003.png", "-o", tmp_path / name) == 0
        clip = open_clip(str(tmp_path / name))
        assert (clip.width, clip.height) == (18, height)
        luma = clip.read(0) @ np.array([0.2126, 0.7152, 0.0722], np.float32)
        assert np.abs(luma[:15, 16] - luma[:15, 17]).mean() < 0.03


def test_a_movie_of_some_frames(tmp_path):
    source = movie_of(tmp_path / "in")
    assert run(PLAIN, source, "-o", tmp_path / "o.mov", "--frames", "1,4-5") == 0
    clip, whole = open_clip(str(tmp_path / "o.mov")), open_clip(str(source))
    assert clip.frames == [0, 1, 2]
    np.testing.assert_allclose(centres(clip.read(1)), centres(whole.read(4)), atol=0.01)


def test_alpha_of_a_movie_is_laid_over_black(tmp_path):
    pixels = np.full((16, 16, 4), 65535, np.uint16)
    pixels[..., 3] = 32768
    png = write_image(tmp_path / "c.0003.png", pixels, oiio__UnassociatedAlpha=1)
    assert run(PLAIN, png, "-o", tmp_path / "o.mov") == 0
    np.testing.assert_allclose(open_clip(str(tmp_path / "o.mov")).read(0), 0.5, atol=0.01)


def test_the_source_beside_the_edit(tmp_path):
    pixels = colours(6, 10, 3)
    write_image(tmp_path / "c.0005.exr", pixels)
    edited = by_core(5, pixels)
    white = np.ones((len(pixels), 2, pixels.shape[2]), np.float32)
    for how, expected in (
        ("side", np.concatenate([pixels, edited], axis=1)),
        ("wipe", np.concatenate([pixels[:, :4], white, edited[:, 6:]], axis=1)),
    ):
        output = tmp_path / f"{how}.exr"
        assert run(EDITED, tmp_path / "c.0005.exr", "-o", output, "--compare", how) == 0
        np.testing.assert_array_equal(stored(output)[1], expected)
    source = movie_of(tmp_path / "in")
    assert run(EDITED, source, "-o", tmp_path / "o.mov", "--compare", "side") == 0
    clip, whole = open_clip(str(tmp_path / "o.mov")), open_clip(str(source))
    assert (clip.width, clip.height) == (128, 48)
    np.testing.assert_allclose(centres(clip.read(2))[:, :4], centres(whole.read(2)), atol=0.01)


def rendered(output: Path, source: Path, progress: Callable[[int, int], None], force: bool) -> None:
    document, clip = Document.load(PLAIN), open_clip(str(source))
    rendering.render(document, clip, output, force=force, progress=progress)


@pytest.mark.parametrize("name", ["o.mp4", "o.mov"])
def test_ctrl_c_leaves_what_was_there_before(tmp_path, name):
    def interrupted(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    source = movie_of(tmp_path / "in")
    output = tmp_path / "out" / name
    with pytest.raises(KeyboardInterrupt):
        rendered(output, source, interrupted, force=False)
    assert list(output.parent.iterdir()) == []
    output.write_bytes(b"precious")
    with pytest.raises(Palette4dError, match="force=True"):
        rendered(output, source, lambda done, total: None, force=False)
    with pytest.raises(KeyboardInterrupt):
        rendered(output, source, interrupted, force=True)
    assert [path.read_bytes() for path in output.parent.iterdir()] == [b"precious"]
    told: list[tuple[int, int]] = []
    rendered(output, source, lambda *counts: told.append(counts), force=True)
    assert told == [(n, 6) for n in range(1, 7)]
    assert open_clip(str(output)).frames == list(range(6))


def test_a_movie_is_never_rendered_over_itself(tmp_path):
    source = tmp_path / "m.mov"
    assert run(PLAIN, movie_of(tmp_path / "in"), "-o", source) == 0
    before = source.read_bytes()
    with pytest.raises(Palette4dError, match="of the clip itself"):
        run(PLAIN, source, "-o", source, "--force")
    assert source.read_bytes() == before


def warnings_of(capsys, *words: object) -> list[str]:
    assert run(*words) == 0
    return [line for line in capsys.readouterr().err.splitlines() if "warning" in line]


def test_a_clip_unlike_the_sidecars_is_told(tmp_path, capsys):
    """The sidecar's clip has 64x36 pixels and frames 0 to 20."""
    for n in range(24):
        for folder, size in (("like", (36, 64)), ("small", (4, 6))):
            write_image(tmp_path / folder / f"c.{n:04d}.png", np.zeros((*size, 3), np.uint8))
    output = tmp_path / "out" / "o.####.png"
    like = [PLAIN, tmp_path / "like" / "c.0-20#.png", "-o", output, "--force"]
    assert warnings_of(capsys, *like) == []
    assert warnings_of(capsys, *like, "--frames", "3-7") == []
    (size,) = warnings_of(capsys, PLAIN, tmp_path / "small" / "c.0-20#.png", *like[2:])
    assert "64x36" in size
    assert "6x4" in size
    (longer,) = warnings_of(capsys, PLAIN, tmp_path / "like", *like[2:])
    assert "frames 0 to 20" in longer
    assert "21-23" in longer
    (shorter,) = warnings_of(capsys, PLAIN, tmp_path / "like" / "c.2-9#.png", *like[2:])
    assert "frames 0 to 20" in shorter
    assert "2-9" in shorter


def test_show_writes_a_matte_as_a_grey_picture(tmp_path):
    pixels = colours(9, 13, 3)
    source = write_image(tmp_path / "c.0005.exr", pixels)
    document = Document.load(EDITED)
    handle = document.grade.core.polytope.vertex_ids[0]
    for show in (f"weight:{handle}", "outside"):
        words = ("--output", show, "--outside-at", 0.01, "--force")
        assert run(EDITED, source, "-o", tmp_path / "o.exr", *words) == 0
        _, written, _ = stored(tmp_path / "o.exr")
        expected = document.matte(pixels, 5, show, outside_at=0.01)
        np.testing.assert_array_equal(written, np.stack([expected] * 3, axis=2))
        assert 0 < expected.max() <= 1


def test_show_writes_a_matte_into_alpha(tmp_path):
    pixels = colours(9, 13, 3)
    source = write_image(tmp_path / "c.0005.tif", pixels)
    words = ("--output", "outside", "--outside-at", 0.02, "--matte-in", "alpha")
    assert run(EDITED, source, "-o", tmp_path / "o.tif", *words) == 0
    _, written, _ = stored(tmp_path / "o.tif")
    np.testing.assert_array_equal(written[..., :3], pixels)
    matte = Document.load(EDITED).matte(pixels, 5, "outside", outside_at=0.02)
    np.testing.assert_array_equal(written[..., 3], matte)
    assert run(EDITED, source, "-o", tmp_path / "w.tif", *words, "--compare", "side") == 0
    assert stored(tmp_path / "w.tif")[1].shape == (9, 26, 4)


def test_the_palette_and_the_lightness_are_the_documents(tmp_path):
    pixels = colours(32, 13, 3)
    source = write_image(tmp_path / "c.0005.exr", pixels)
    words = (
        "--output",
        "palette",
        "--keep-lightness",
        1,
        "--lightness-of",
        "rec2020",
        "--mix",
        0.5,
    )
    assert run(EDITED, source, "-o", tmp_path / "o.exr", *words, "--strength", 0.75) == 0
    expected = Document.load(EDITED).recolour(
        pixels, 5, show="palette", keep_lightness=1, lightness_of="rec2020", mix=0.5, strength=0.75
    )
    np.testing.assert_array_equal(stored(tmp_path / "o.exr")[1], expected)


def test_output_writes_the_matte_of_a_pick(tmp_path):
    pixels = colours(40, 60, 3)
    source = write_image(tmp_path / "c.0002.exr", pixels)
    words = ("--output", "pick:p1", "--clean-up", 0.5)
    assert run(PICKS, source, "-o", tmp_path / "o.exr", *words) == 0
    expected = Document.load(PICKS).matte(pixels, 2, "pick:p1", clean_up=0.5)
    np.testing.assert_array_equal(stored(tmp_path / "o.exr")[1], np.stack([expected] * 3, axis=2))
    assert expected.max() > 0
    with pytest.raises(Palette4dError, match="p9"):
        run(PICKS, source, "-o", tmp_path / "p.exr", "--output", "pick:p9")


def test_picks_are_cleaned_up_as_asked(tmp_path):
    pixels = colours(40, 60, 3)
    source = write_image(tmp_path / "c.0002.exr", pixels)
    document, written = Document.load(PICKS), []
    for amount in (None, 0, 0.5):
        words = () if amount is None else ("--clean-up", amount)
        assert run(PICKS, source, "-o", tmp_path / "o.exr", *words, "--force") == 0
        written.append(stored(tmp_path / "o.exr")[1])
        expected = document.recolour(pixels, 2, clean_up=1 if amount is None else amount)
        np.testing.assert_array_equal(written[-1], expected)
    assert not np.array_equal(written[0], written[1])


@pytest.mark.parametrize("show", ["weight", "weight:", "pick", "pick:", "matte", "outside:v1"])
def test_an_output_that_does_not_exist_is_wrong_usage(tmp_path, show, capsys):
    with pytest.raises(SystemExit) as stopped:
        run(EDITED, tmp_path, "-o", tmp_path / "o.exr", "--output", show)
    assert stopped.value.code == 2
    assert "weight:ID" in capsys.readouterr().err


def test_a_handle_that_does_not_exist_is_an_error(tmp_path):
    source = write_image(tmp_path / "c.0005.exr", colours(4, 4, 3))
    with pytest.raises(Palette4dError, match="v99"):
        run(EDITED, source, "-o", tmp_path / "o.exr", "--output", "weight:v99")
    assert not (tmp_path / "o.exr").exists()
