"""The analysis counts the same colours that a recolouring sees, for every storage of a frame."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import OpenImageIO as oiio
import pytest
from clip_files import damage, write_image, write_movie

from palette4d import _core
from palette4d.media import clip_base, clip_movie
from palette4d.media.clip import FrameError, open_clip

MANY = 10**9


def filled(clip, frame: int) -> _core.ColourBinner:
    binner = _core.ColourBinner()
    ((number, fill),) = clip.fills([frame])
    assert number == frame
    assert fill(binner) == clip_base.hidden(clip.read(frame))
    return binner


def sorted_colours(rgb, counts):
    """Colours with their counts, in a fixed order."""
    rgb = np.asarray(rgb, float)
    order = np.lexsort(np.round(rgb * 1e6).T)
    return rgb[order], np.asarray(counts, float)[order]


def check(path, frame: int = 0, exact: bool = True, rows: slice = slice(None)) -> None:
    """Compare what is binned of a frame with the pixels that are read of it."""
    clip = open_clip(str(path))
    seen = clip.straight_colours(clip.read(frame))[rows].reshape(-1, 3)
    if clip.stated.headroom:  # the analysis takes 0 to 1 of Y'CbCr
        seen = np.clip(seen, 0, 1)
    finite = np.isfinite(seen).all(axis=1)
    binner = filled(clip, frame)
    assert (binner.pixels, binner.ignored) == (finite.sum(), (~finite).sum())
    expected, times = np.unique(seen[finite], axis=0, return_counts=True)
    taken = binner.take(MANY, MANY)
    if not len(expected):
        assert taken is None
        return
    tree = taken[0]
    assert tree.total == finite.sum()
    if exact:  # every colour has a cell of its own
        expected, times = sorted_colours(expected, times)
        found, counts = sorted_colours(tree.rgb, tree.counts)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7)
        np.testing.assert_array_equal(counts, times)
    else:  # cells keep means
        np.testing.assert_allclose(
            tree.counts @ tree.rgb, seen[finite].sum(axis=0, dtype=float), rtol=1e-6
        )


def random(kind: type, shape, seed: int = 0):
    generator = np.random.default_rng(seed)
    if kind in (np.float32, np.float16):
        return (generator.random(shape) * 1.5 - 0.25).astype(kind)
    top = np.iinfo(kind).max
    return generator.integers(0, top, shape, kind, endpoint=True)


@pytest.mark.parametrize(
    ("extension", "kind", "channels"),
    [
        ("png", np.uint8, 3),
        ("png", np.uint8, 1),
        ("png", np.uint8, 4),
        ("png", np.uint8, 2),
        ("jpg", np.uint8, 3),
        ("png", np.uint16, 3),
        ("png", np.uint16, 4),
        ("tif", np.uint8, 4),
        ("tif", np.uint16, 4),
        ("tif", np.uint32, 3),
        ("tif", np.float32, 3),
        ("exr", np.float16, 3),
        ("exr", np.float32, 4),
    ],
)
def test_images(tmp_path, extension, kind, channels):
    path = write_image(tmp_path / f"a.{extension}", random(kind, (37, 29, channels)))
    check(path, exact=kind == np.uint8 and extension != "tif")


def test_straight_alpha_in_a_tiff(tmp_path):
    pixels = random(np.uint8, (37, 29, 4))
    pixels[::3, :, 3] = 0
    check(write_image(tmp_path / "a.tif", pixels, oiio__UnassociatedAlpha=1))


@pytest.mark.parametrize("extension", ["png", "exr", "tif"])
def test_an_alpha_channel_that_is_not_in_use(tmp_path, extension):
    pixels = random(np.uint8, (12, 9, 4))
    pixels[..., 3] = 0
    pixels = pixels if extension == "png" else (pixels / 255).astype(np.float32)
    path = write_image(tmp_path / f"a.{extension}", pixels)
    check(path)
    assert filled(open_clip(str(path)), 0).pixels == 12 * 9


def test_what_is_not_finite(tmp_path):
    pixels = random(np.float32, (12, 9, 3))
    pixels[0, 0, 0], pixels[1, 1, 1], pixels[2, 2, 2] = np.nan, np.inf, -np.inf
    check(write_image(tmp_path / "a.exr", pixels), exact=False)
    pixels[...] = np.nan
    check(write_image(tmp_path / "b.exr", pixels))


def test_ten_bit_dpx(tmp_path):
    codes = random(np.uint16, (12, 9, 3)) >> 6
    stored = np.round(codes * (65535 / 1023)).astype(np.uint16)
    check(write_image(tmp_path / "a.dpx", stored, oiio__BitsPerSample=10), exact=False)


def test_channels_in_any_order(tmp_path):
    names = ("Z", "R", "A", "G", "N.x", "B")
    values = random(np.float32, (5, 7, 6))
    values[..., 2] = 1
    check(write_image(tmp_path / "a.exr", values, names=names), exact=False)


@pytest.mark.parametrize("extension", ["exr", "tif"])
def test_tiles(tmp_path, extension):
    path = tmp_path / f"a.{extension}"
    image = oiio.ImageBuf(random(np.float32, (75, 50, 3)))
    image.set_write_tiles(16, 32)
    assert image.write(str(path)), image.geterror()
    check(path, exact=False)


@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize(
    ("origin", "full"),
    [
        ((-1, 1), (0, 0, 5, 4)),
        ((2, 3), (0, 0, 40, 50)),
        ((-5, -6), (0, 0, 20, 25)),
        ((100, 100), (0, 0, 8, 9)),
        ((3, -2), (7, 11, 30, 5)),
    ],
)
def test_data_windows(tmp_path, origin, full, channels):
    values = np.abs(random(np.float32, (30, 25, channels)))
    check(
        write_image(tmp_path / "a.exr", values, full=full, origin=origin),
        exact=False,
    )


@pytest.mark.parametrize("step", [2, 5])
def test_rows_of_large_images(tmp_path, monkeypatch, step):
    monkeypatch.setattr(clip_base, "COUNTED_PIXELS", 60 * 40 // step)
    path = write_image(tmp_path / "a.png", random(np.uint8, (60, 40, 3)))
    assert open_clip(str(path)).row_step == step
    check(path, rows=slice(step // 2, None, step))
    full = (0, 0, 60, 40)
    path = write_image(
        tmp_path / "a.exr", random(np.float32, (23, 50, 3)), full=full, origin=(5, 4)
    )
    check(path, exact=False, rows=slice(step // 2, None, step))


def test_orientation(tmp_path):
    values = random(np.uint8, (6, 9, 3))
    check(write_image(tmp_path / "a.tif", values, Orientation=6))


def test_the_size_that_is_counted():
    sizes = {(720, 576): 1, (1920, 1080): 1, (3840, 2160): 2, (4096, 2160): 2, (7680, 4320): 8}
    for (width, height), step in sizes.items():
        clip = clip_movie.MovieClip(
            "a", "a", [0], Fraction(24), width, height, "", False, False, "", path=None, count=1
        )
        assert clip.row_step == step


FORMATS = [
    ("rawvideo", "bgr24", "rgb24", np.uint8, 3),
    ("ffv1", "gbrp16le", "gbrp16le", np.uint16, 3),
    ("ffv1", "bgr0", "bgr0", np.uint8, 4),
    ("ffv1", "gray", "gray", np.uint8, 0),
    ("ffv1", "yuv444p", "rgb24", np.uint8, 3),
    ("ffv1", "yuv420p", "rgb24", np.uint8, 3),
    ("ffv1", "yuv422p10le", "rgb24", np.uint8, 3),
    ("ffv1", "yuv420p12le", "rgb24", np.uint8, 3),
    ("ffv1", "yuva420p", "rgba", np.uint8, 4),
    ("ffv1", "gray10le", "gray", np.uint8, 0),
    ("ffv1", "bgra", "bgra", np.uint8, 4),
    ("libx264", "yuv420p", "rgb24", np.uint8, 3),
    ("mjpeg", "yuvj420p", "rgb24", np.uint8, 3),
    ("gif", "rgb8", "rgb24", np.uint8, 3),
]


def movie(path, codec, layout, source, kind, channels, size=(48, 64)):
    shape = (*size, channels) if channels else size
    frames = [random(kind, shape, seed) for seed in range(3)]
    suffix = {"gif": ".gif", "rawvideo": ".avi"}.get(codec, ".mkv")
    return write_movie(path.with_suffix(suffix), codec, layout, frames, source)


@pytest.mark.parametrize("how", FORMATS, ids=[f"{f[0]}-{f[1]}" for f in FORMATS])
def test_movies(tmp_path, how):
    path = movie(tmp_path / "a", *how)
    wide = any(bits in how[1] for bits in ("10", "12", "16"))
    check(path, 2, exact=not wide and how[1] not in ("gray", "yuva420p"))


@pytest.mark.parametrize("height", [48, 50])
@pytest.mark.parametrize("how", FORMATS, ids=[f"{f[0]}-{f[1]}" for f in FORMATS])
def test_rows_of_large_movies(tmp_path, monkeypatch, how, height):
    monkeypatch.setattr(clip_base, "COUNTED_PIXELS", height * 64 // 3)
    path = movie(tmp_path / "a", *how, size=(height, 64))
    clip = open_clip(str(path))
    assert clip.row_step == 3
    if "42" in how[1]:  # halved chroma: taken from the nearest row instead of filtered
        seen = clip.straight_colours(clip.read(1))[1::3].reshape(-1, 3)
        seen = seen[np.isfinite(seen).all(axis=1)]
        tree = filled(clip, 1).take(MANY, MANY)[0]
        assert tree.total == len(seen)
        luma = np.array([0.299, 0.587, 0.114])
        assert tree.counts @ tree.rgb @ luma / tree.total == pytest.approx(
            float(seen.mean(axis=0) @ luma), abs=0.01
        )
    else:
        rows = slice(1, None, 3)
        check(path, 1, exact=how[1] not in ("gray", "gray10le", "gbrp16le"), rows=rows)


def test_an_unused_alpha_channel_of_a_movie(tmp_path):
    pixels = random(np.uint8, (48, 64, 4))
    pixels[..., 3] = 0
    check(write_movie(tmp_path / "a.mkv", "ffv1", "bgra", [pixels] * 2, "bgra"), 1)


@pytest.mark.parametrize("extension", ["png", "exr", "tif", "dpx", "jpg"])
@pytest.mark.parametrize("keep", [0.0, 0.02, 0.5, 0.97])
def test_cut_files_fail_when_they_are_filled(tmp_path, extension, keep):
    pixels = random(np.float32 if extension == "exr" else np.uint8, (60, 80, 3))
    for frame in range(3):
        write_image(tmp_path / f"c.{frame}.{extension}", pixels)
    path = tmp_path / f"c.1.{extension}"
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * keep)])
    clip = open_clip(str(tmp_path))
    fills = dict(clip.fills(clip.frames))
    binner = _core.ColourBinner()
    with pytest.raises(FrameError, match=r"c\.1\..*frame 1 cannot be read"):
        fills[1](binner)
    binner.clear()
    fills[2](binner)
    assert binner.pixels == 4800


def test_unlike_frames_fail_when_they_are_filled(tmp_path):
    for frame, shape in enumerate([(6, 8, 3), (6, 9, 3), (6, 8, 4)]):
        write_image(tmp_path / f"c.{frame}.png", np.full(shape, 128, np.uint8))
    clip = open_clip(str(tmp_path))
    for frame, match in ((1, "frame 1 has 9x6 pixels"), (2, "frame 2 has straight alpha")):
        with pytest.raises(FrameError, match=match):
            filled(clip, frame)


def test_a_damaged_picture_fails_when_it_is_filled(tmp_path):
    frames = [random(np.uint8, (48, 64, 3), seed) for seed in range(6)]
    options = {"g": "1", "bf": "0"}
    path = write_movie(tmp_path / "a.mp4", "libx264", "yuv420p", frames, "rgb24", options=options)
    damage(path, 3)
    clip, good = open_clip(str(path)), []
    for number, fill in clip.fills(clip.frames):
        binner = _core.ColourBinner()
        if number == 3:
            with pytest.raises(FrameError, match="frame 3 cannot be decoded"):
                fill(binner)
        else:
            fill(binner)
            good.append(binner.pixels)
    assert good == [48 * 64] * 5
