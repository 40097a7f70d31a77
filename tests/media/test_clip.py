"""Clip reading: which files are found, their pixels, and the errors for unusable ones."""

from __future__ import annotations

import os
import struct
import sys
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from clip_files import TimeCode, grey_levels, write_image
from palette4d.analysis import pipeline
from palette4d.analysis.options import AnalysisOptions

from palette4d.common.arguments import parse_frames
from palette4d.common.errors import Palette4dError
from palette4d.media.clip import ClipError, FrameError, open_clip
from palette4d.media.clip_base import as_rate, describe
from palette4d.media.clip_sequence import frame_number
from palette4d.media.frame_writer import FramePattern, write_frame
from palette4d.media.timecode import start_timecode


def reds(clip) -> dict[int, int]:
    """Frame number -> the number painted into the frame."""
    return {frame: round(float(p[0, 0, 0]) * 65535) for frame, p in clip}


@pytest.mark.parametrize(
    ("text", "frames"),
    [
        ("1001-1100x2", list(range(1001, 1101, 2))),
        ("7", [7]),
        ("1,3,5", [1, 3, 5]),
        ("12,0,30,12", [0, 12, 30]),
        ("-5,-4,1-9x4,2", [-5, -4, 1, 2, 5, 9]),
        ("-3-1", [-3, -2, -1, 0, 1]),
        ("-5--3", [-5, -4, -3]),
        ("1-3,4-6", [1, 2, 3, 4, 5, 6]),
    ],
)
def test_frame_ranges(text, frames):
    assert parse_frames(text) == frames


@pytest.mark.parametrize(
    "text", ["", "a-b", "1-", "5-1", "-4--5", "1,", "1-10y3", "1.5-3.5", "1-10x0", "1--", "1x2"]
)
def test_bad_frame_ranges_are_named(text):
    with pytest.raises(Palette4dError, match="frame range"):
        parse_frames(text)


def test_huge_frame_range_is_refused():
    with pytest.raises(Palette4dError, match="more than 1000000 frames"):
        parse_frames("1-99999999999")


@pytest.mark.parametrize("frames", ["1-99999999999", "1-9999999x2,1-9999999x3"])
def test_a_pattern_with_a_huge_range_is_refused(tmp_path, frames):
    write_image(tmp_path / "a.1.png", np.zeros((1, 1, 3), np.uint8))
    with pytest.raises(Palette4dError, match="own range holds more than 1000000 frames"):
        open_clip(str(tmp_path / f"a.{frames}#.png"))
    dated = "a_20230101-120000."
    write_image(tmp_path / f"{dated}0001.png", np.zeros((1, 1, 3), np.uint8))
    assert open_clip(str(tmp_path / f"{dated}####.png")).frames == [1]


@pytest.mark.parametrize(
    ("stem", "expected"),
    [
        ("beach.0012", ("beach.", "0012")),
        ("beach.-0003", ("beach.", "-0003")),
        ("shot-0010", ("shot-", "0010")),
        ("00000", ("", "00000")),
        ("-5", ("", "-5")),
        ("IMG_001", ("IMG_", "001")),
        ("beach_v2", None),
        ("v003", None),
        ("beach", None),
    ],
)
def test_number_in_a_name(stem, expected):
    assert frame_number(stem) == expected


def test_description_and_rates():
    assert describe([1, 2, 3]) == "1-3"
    assert describe([1, 3, 5]) == "1-5x2"
    assert describe([1, 2, 4]) == "1, 2, 4"
    assert as_rate(23.976) == Fraction(24000, 1001)
    assert as_rate(29.97) == Fraction(30000, 1001)
    assert as_rate(25.0) == 25
    assert as_rate(12.5) == Fraction(25, 2)
    assert as_rate(float("nan")) is None
    assert as_rate(0.0) is None


@pytest.mark.parametrize(
    "pattern",
    ["clip.####.png", "clip.%04d.png", "clip.@@@@.png", "clip.#.png", "clip.1001-1005#.png", ""],
)
def test_every_pattern_finds_the_sequence(tmp_path, pattern):
    folder = grey_levels(tmp_path / "ünï code clip", range(1001, 1006))
    clip = open_clip(str(folder / pattern) if pattern else str(folder))
    assert clip.frames == [1001, 1002, 1003, 1004, 1005]
    assert clip.source == str(folder / "clip.####.png")
    assert (clip.name, clip.width, clip.height, clip.depth) == ("clip", 8, 6, "uint16")
    assert (clip.rate, clip.step, clip.encoding, clip.has_alpha) == (24, 1, "sRGB", False)
    assert reds(clip) == {frame: frame for frame in clip.frames}
    assert round(float(clip.read(1003)[0, 0, 0]) * 65535) == 1003


@pytest.mark.parametrize(
    "prefix",
    [
        "sh010-",
        "A001-C002-",
        "2026-11-28-",
        "take2_",
        "take#2_",
        "me@home_",
        "logo@2x_",
        "a1,",
        "x%d_",
        "$F",
        "a.1-5.",
    ],
)
def test_a_sequence_is_found_again_by_its_source(tmp_path, prefix):
    """Digits and marks in front of the number are not taken for a range."""
    for frame in (1, 2, 3):
        write_image(tmp_path / f"{prefix}{frame:04}.png", np.zeros((4, 4, 3), np.uint8))
    clip = open_clip(str(tmp_path))
    again = open_clip(clip.source)
    assert again.frames == clip.frames == [1, 2, 3]
    assert again.source == clip.source
    assert FramePattern.parse(clip.source).path(2) == tmp_path / f"{prefix}0002.png"


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("beach/f.0001.png", "beach"),
        ("beach/0001.png", "beach"),
        ("beach/frames/Frame_0001.png", "beach"),
        ("beach/v1/01.0001.png", "beach"),
        ("beach/cg/cg.0001.png", "cg"),
        ("beach/cg/f.0001.png", "cg"),
        ("beach/shot010.0001.png", "shot010"),
        ("beach/f.png", "f"),  # an image by itself
    ],
)
def test_a_clip_is_named_by_what_tells_something(tmp_path, path, name):
    file = tmp_path / path
    write_image(file, np.zeros((4, 4, 3), np.uint8))
    assert open_clip(str(file)).name == name
    assert open_clip(str(file.parent)).name == name


def test_ranges_in_the_pattern_and_outside(tmp_path):
    folder = grey_levels(tmp_path, range(1001, 1011))
    assert open_clip(str(folder / "clip.1001-1010x3#.png")).frames == [1001, 1004, 1007, 1010]
    clip = open_clip(str(folder), frames="1002-1008x2")
    assert clip.frames == [1002, 1004, 1006, 1008]
    assert clip.step == 2
    inner = open_clip(str(folder / "clip.1001-1009x2#.png"), frames="1003-1005x2")
    assert inner.frames == [1003, 1005]
    with pytest.raises(ClipError, match="leaves out"):
        open_clip(str(folder / "clip.1001-1009x2#.png"), frames="1003-1005")
    with pytest.raises(ClipError, match="the clip has 1001-1010"):
        open_clip(str(folder), frames="5-8")
    with pytest.raises(FrameError, match=r"1011, 1012|1011-1012"):
        open_clip(str(folder), frames="1009-1012")
    some = open_clip(str(folder), frames="1001,1002,1004")
    assert list(reds(some)) == some.frames == [1001, 1002, 1004]
    assert some.step == 0
    with pytest.raises(Palette4dError, match=r"1001, 1002, 1004 are not evenly spaced.*1-10x3"):
        pipeline.analyze(some, AnalysisOptions())
    with pytest.raises(ClipError, match="frame 5 was asked for"):
        open_clip(str(folder)).read(5)


def test_every_second_frame_on_disk_is_a_step(tmp_path):
    clip = open_clip(str(grey_levels(tmp_path, range(10, 20, 2))))
    assert clip.frames == [10, 12, 14, 16, 18]
    assert clip.step == 2


def test_negative_unpadded_and_growing_numbers(tmp_path):
    negative = grey_levels(tmp_path / "neg", range(-2, 3), "clip.{:04d}.png")
    assert reds(open_clip(str(negative))) == {-2: 2, -1: 1, 0: 0, 1: 1, 2: 2}
    assert open_clip(str(negative / "clip.####.png"), frames="-2--1").frames == [-2, -1]
    unpadded = grey_levels(tmp_path / "one", range(8, 12), "clip.{}.png")
    assert reds(open_clip(str(unpadded))) == {n: n for n in range(8, 12)}
    assert open_clip(str(unpadded / "clip.#.png")).frames == [8, 9, 10, 11]
    grown = grey_levels(tmp_path / "grown", range(9998, 10002))
    assert open_clip(str(grown / "clip.####.png")).frames == [9998, 9999, 10000, 10001]
    assert open_clip(str(grown)).frames == [9998, 9999, 10000, 10001]


def test_single_hash_means_what_lies_there(tmp_path):
    folder = grey_levels(tmp_path, range(1, 12))
    assert open_clip(str(folder / "clip.#.png")).frames == list(range(1, 12))


def test_single_image_is_a_clip_of_one_frame(tmp_path):
    grey_levels(tmp_path, range(12, 15))
    clip = open_clip(str(tmp_path / "clip.0013.png"))
    assert (clip.frames, clip.step) == ([13], 1)
    assert clip.source == str(tmp_path / "clip.0013.png")
    assert reds(clip) == {13: 13}
    plain = write_image(tmp_path / "x" / "still.png", np.zeros((2, 3, 3), np.uint8))
    assert open_clip(str(plain)).frames == [0]
    assert open_clip(str(plain.parent)).frames == [0]
    with pytest.raises(ClipError, match="the clip has 13"):
        open_clip(str(tmp_path / "clip.0013.png"), frames="1")


def test_a_name_with_marks_is_a_file_when_it_exists(tmp_path):
    path = write_image(tmp_path / "a#b%c@.0007.png", np.zeros((2, 3, 3), np.uint8))
    assert open_clip(str(path)).frames == [7]


def test_frames_outside_of_the_clip_are_named(tmp_path):
    folder = str(grey_levels(tmp_path, range(8)))
    with pytest.raises(FrameError, match=r"has frames 0-7; frame 8 is outside"):
        open_clip(folder, frames="5-8")
    assert open_clip(folder, frames="5-8", skip_bad_frames=True).skipped == [8]


def test_gap_is_named_or_skipped(tmp_path):
    folder = grey_levels(tmp_path, range(1, 9))
    (folder / "clip.0004.png").unlink()
    (folder / "clip.0007.png").unlink()
    with pytest.raises(FrameError, match=r"frames 4, 7 missing.*clip\.0004\.png"):
        open_clip(str(folder))
    clip = open_clip(str(folder), skip_bad_frames=True)
    assert clip.frames == list(range(1, 9))
    assert sorted(reds(clip)) == [1, 2, 3, 5, 6, 8]
    assert clip.skipped == [4, 7]


@pytest.mark.parametrize("extension", ["png", "exr", "tif", "dpx", "jpg"])
@pytest.mark.parametrize("keep", [0.0, 0.02, 0.5, 0.97])
def test_cut_file_is_named_or_skipped(tmp_path, extension, keep):
    noise = np.random.default_rng(1).random((60, 80, 3))
    for frame in (1, 2, 3):
        pixels = (noise * 255).astype(np.uint8) if extension != "exr" else noise.astype(np.float32)
        path = write_image(tmp_path / f"c.{frame:03d}.{extension}", pixels)
    path = tmp_path / f"c.002.{extension}"
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * keep)])
    with pytest.raises(FrameError, match=r"c\.002\..*frame 2 cannot be read"):
        list(open_clip(str(tmp_path)))
    clip = open_clip(str(tmp_path), skip_bad_frames=True)
    assert [frame for frame, _ in clip] == [1, 3]
    assert clip.skipped == [2]
    assert [frame for frame, _ in clip] == [1, 3]
    assert clip.skipped == [2]
    with pytest.raises(FrameError):
        clip.read(2)


def test_an_error_text_that_is_no_utf8_is_told(tmp_path):
    path = write_image(tmp_path / "c.1.exr", np.zeros((2, 2, 3), np.float32))
    path.write_bytes(path.read_bytes().replace(b"chlist", b"\xf0hlist"))
    with pytest.raises(FrameError, match="frame 1 cannot be read"):
        open_clip(str(path))


def test_metadata_that_is_no_utf8_is_taken_as_latin_1(tmp_path):
    path = write_image(tmp_path / "c.1.exr", np.zeros((2, 2, 3), np.float32), Copyright="Andr#")
    path.write_bytes(path.read_bytes().replace(b"Andr#", b"Andr\xe9"))
    image = open_clip(str(path)).load(1)
    assert {name: value for name, _, value in image.metadata}["Copyright"] == "André"


def test_a_path_is_a_name_too(tmp_path):
    write_image(tmp_path / "c.0001.png", np.zeros((2, 2, 3), np.uint8))
    assert open_clip(tmp_path).frames == open_clip(tmp_path / "c.####.png").frames == [1]


@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse such names")
def test_a_file_name_that_is_no_utf8_is_refused(tmp_path):
    image = write_image(tmp_path / "c.png", np.zeros((2, 2, 3), np.uint8))
    named = image.rename(tmp_path / os.fsdecode(b"caf\xe9.png"))
    for spec in (str(named), str(tmp_path)):
        with pytest.raises(Palette4dError, match="not UTF-8; rename"):
            open_clip(spec)


def test_first_frame_may_be_the_bad_one(tmp_path):
    grey_levels(tmp_path, range(3))
    (tmp_path / "clip.0000.png").write_bytes(b"no picture")
    with pytest.raises(FrameError, match="frame 0"):
        open_clip(str(tmp_path))
    clip = open_clip(str(tmp_path), skip_bad_frames=True)
    assert sorted(reds(clip)) == [1, 2]
    assert clip.skipped == [0]


def test_nothing_readable_says_so(tmp_path):
    for frame in range(3):
        (tmp_path / f"clip.{frame}.png").write_bytes(b"no picture")
    with pytest.raises(FrameError, match="none readable of frames 0-2"):
        open_clip(str(tmp_path), skip_bad_frames=True)


def test_other_size_and_channels_mid_clip(tmp_path):
    for frame, shape in enumerate([(6, 8, 3), (6, 8, 3), (6, 9, 3), (6, 8, 4), (6, 8, 1)]):
        write_image(tmp_path / f"c.{frame}.png", np.full(shape, 128, np.uint8))
    with pytest.raises(FrameError, match="frame 2 has 9x6 pixels, expected 8x6"):
        list(open_clip(str(tmp_path)))
    with pytest.raises(FrameError, match="frame 3 has straight alpha, expected no alpha"):
        open_clip(str(tmp_path)).read(3)
    clip = open_clip(str(tmp_path), skip_bad_frames=True)
    assert [frame for frame, _ in clip] == [0, 1, 4]  # grey is as good as RGB
    assert clip.skipped == [2, 3]


def test_folder_troubles(tmp_path):
    with pytest.raises(ClipError, match="found 0 files"):
        open_clip(str(tmp_path))
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(ClipError, match="found 1 file and no image"):
        open_clip(str(tmp_path))
    grey_levels(tmp_path, range(3), "a.{:02d}.png")
    (tmp_path / ".hidden.01.png").write_bytes(b"")
    assert open_clip(str(tmp_path)).frames == [0, 1, 2]
    grey_levels(tmp_path, range(5, 9), "b.{:04d}.png")
    with pytest.raises(
        ClipError, match=r"(?s)2 image seq.*a\.##\.png.*0-2.*b\.####\.png.*5-8"
    ) as e:
        open_clip(str(tmp_path))
    assert "Give the pattern" in str(e.value).replace("\n", " ")


def test_wrong_paths_say_what_is_there(tmp_path):
    grey_levels(tmp_path, range(3), "beach.{:03d}.png")
    with pytest.raises(ClipError, match=r"no file matches.*beach\.###\.png \(0-2\)"):
        open_clip(str(tmp_path / "beech.####.png"))
    with pytest.raises(ClipError, match="no such file or folder"):
        open_clip(str(tmp_path / "none.png"))
    with pytest.raises(ClipError, match="does not exist"):
        open_clip(str(tmp_path / "none" / "a.####.png"))
    with pytest.raises(ClipError, match='extension "txt"'):
        open_clip(str(tmp_path / "a.####.txt"))
    (tmp_path / "a.txt").write_text("hello")
    with pytest.raises(ClipError, match='extension "txt"'):
        open_clip(str(tmp_path / "a.txt"))


def test_dates_are_not_frames(tmp_path):
    grey_levels(tmp_path, range(2), "c.{}.png")
    (tmp_path / "c.1.png").rename(tmp_path / "c.20240101.png")
    (tmp_path / "c.0.png").rename(tmp_path / "c.20240102.png")
    write_image(tmp_path / "c.20260707.png", np.zeros((6, 8, 3), np.uint8))
    (tmp_path / "c.20240102.png").rename(tmp_path / "c.10240102.png")
    with pytest.raises(ClipError, match="dates or ids"):
        open_clip(str(tmp_path))


def one(path: Path):
    """Clip and pixels of a single image."""
    clip = open_clip(str(path))
    return clip, clip.read(clip.frames[0])


@pytest.mark.parametrize(
    ("extension", "kind", "largest"),
    [
        ("png", np.uint8, 255),
        ("png", np.uint16, 65535),
        ("tif", np.uint16, 65535),
        ("tif", np.uint32, 2**32 - 1),
    ],
)
def test_integers_are_scaled_by_their_largest_value(tmp_path, extension, kind, largest):
    values = np.linspace(0, largest, 6 * 5 * 3).astype(kind).reshape(6, 5, 3)
    clip, pixels = one(write_image(tmp_path / f"a.{extension}", values))
    assert clip.depth == np.dtype(kind).name
    assert pixels.dtype == np.float32
    assert pixels.max() == 1.0
    np.testing.assert_array_equal(pixels, (values / np.float64(largest)).astype(np.float32))


def test_ten_bit_dpx(tmp_path):
    codes = np.linspace(0, 1023, 4 * 8 * 3).astype(np.uint16).reshape(4, 8, 3)
    stored = np.round(codes * (65535 / 1023)).astype(np.uint16)
    attributes = {"oiio__BitsPerSample": 10, "dpx__FrameRate": 25.0}
    path = write_image(tmp_path / "a.0001.dpx", stored, **attributes)
    clip, pixels = one(path)
    assert clip.depth == "uint10"
    np.testing.assert_array_equal(pixels, codes.astype(np.float32) / np.float32(1023))


@pytest.mark.parametrize("samples", ["half", "float"])
def test_float_keeps_everything(tmp_path, samples):
    values = np.array([-2.5, -0.0, 0.25, 1.5, 1000.0, np.nan, np.inf, -np.inf, 0.125], np.float32)
    path = write_image(
        tmp_path / "a.exr", values.reshape(1, 3, 3), samples, FramesPerSecond=Fraction(24000, 1001)
    )
    clip, pixels = one(path)
    np.testing.assert_array_equal(pixels, values.reshape(1, 3, 3))
    assert (clip.rate, clip.depth, clip.encoding) == (Fraction(24000, 1001), samples, "unknown")
    assert open_clip(str(path), rate=Fraction(25)).rate == 25
    with pytest.raises(ClipError, match="above 0"):
        open_clip(str(path), rate=Fraction(0))


def test_encoding_is_the_files_own(tmp_path):
    pixels = np.zeros((2, 2, 3), np.float32)
    linear = write_image(tmp_path / "a.exr", pixels, oiio__ColorSpace="lin_rec709_scene")
    assert open_clip(str(linear)).encoding == "linear Rec.709"
    other = write_image(tmp_path / "b.exr", pixels, oiio__ColorSpace="ACEScg")
    assert "acescg" in open_clip(str(other)).encoding.lower().replace("lin_ap1_scene", "acescg")


@pytest.mark.parametrize("extension", ["png", "tif", "exr"])
def test_grey_becomes_three_equal_channels(tmp_path, extension):
    values = np.array([[[0], [51]], [[102], [255]]], np.uint8)
    stored = values if extension != "exr" else (values / 255).astype(np.float32)
    clip, pixels = one(write_image(tmp_path / f"a.{extension}", stored))
    assert not clip.has_alpha
    expected = np.repeat((values / 255).astype(np.float32), 3, axis=2)
    np.testing.assert_allclose(pixels, expected, atol=1e-7)


def test_grey_with_alpha(tmp_path):
    values = np.array([[[100, 50], [200, 255]]], np.uint8)
    clip, pixels = one(write_image(tmp_path / "a.png", values, oiio__UnassociatedAlpha=1))
    assert clip.has_alpha
    assert not clip.premultiplied
    np.testing.assert_array_equal(
        np.rint(pixels * 255), [[[100, 100, 100, 50], [200, 200, 200, 255]]]
    )


def test_straight_alpha_is_read_as_stored(tmp_path):
    values = np.array([[[200, 100, 50, 51], [255, 255, 255, 0]]], np.uint8)
    for extension in ("png", "tif"):
        path = write_image(tmp_path / f"a.{extension}", values, oiio__UnassociatedAlpha=1)
        clip, pixels = one(path)
        assert (clip.has_alpha, clip.premultiplied) == (True, False)
        np.testing.assert_array_equal(np.rint(pixels * 255), values)
        colours = clip.straight_colours(pixels)
        np.testing.assert_array_equal(np.rint(colours[0, 0] * 255), [200, 100, 50])
        assert np.isnan(colours[0, 1]).all()


def test_premultiplied_alpha_is_read_as_stored(tmp_path):
    values = np.array([[[0.5, 0.25, 0.125, 0.5], [0.5, 0.5, 0.5, 0]]], np.float32)
    for extension in ("exr", "tif"):
        clip, pixels = one(write_image(tmp_path / f"a.{extension}", values))
        assert (clip.has_alpha, clip.premultiplied) == (True, True)
        np.testing.assert_array_equal(pixels, values)
        colours = clip.straight_colours(pixels)
        np.testing.assert_array_equal(colours[0, 0], [1.0, 0.5, 0.25])
        assert np.isnan(colours[0, 1]).all()
    faint = values.copy()
    faint[0, 1, 3] = 1e-5  # 0.5 / 1e-5 would be a colour far outside the clip's
    assert np.isnan(clip.straight_colours(faint)[0, 1]).all()
    empty = values.copy()
    empty[..., 3] = 0
    np.testing.assert_array_equal(clip.straight_colours(empty), empty[..., :3])


def test_colours_are_found_among_many_channels(tmp_path):
    values = np.arange(6, dtype=np.float32).reshape(1, 1, 6) / 8
    names = ("Z", "R", "A", "G", "N.x", "B")
    clip, pixels = one(write_image(tmp_path / "a.exr", values, names=names))
    assert clip.has_alpha
    stored = dict(zip(names, values[0, 0], strict=True))
    np.testing.assert_array_equal(pixels[0, 0], [stored[name] for name in "RGBA"])
    names = ("d.B", "d.G", "d.R", "u", "v")
    clip, pixels = one(write_image(tmp_path / "b.exr", values[..., :5], names=names))
    assert not clip.has_alpha
    np.testing.assert_array_equal(pixels[0, 0], [2 / 8, 1 / 8, 0])
    names = ("one", "two", "three", "four")
    clip, pixels = one(write_image(tmp_path / "c.exr", values[..., :4], names=names))
    assert pixels.shape == (1, 1, 3)


def test_channels_that_are_no_colours_are_noted(tmp_path):
    values = np.ones((2, 2, 3), np.float32)
    normals, _ = one(write_image(tmp_path / "n.exr", values, names=("N.x", "N.y", "N.z")))
    (note,) = normals.notes
    assert "N.x, N.y, N.z are used as red, green and blue" in note
    for names in (("R", "G", "B"), ("diffuse.B", "diffuse.G", "diffuse.R")):
        colours, _ = one(write_image(tmp_path / f"{names[0]}.exr", values, names=names))
        assert colours.notes == []
    grey, _ = one(write_image(tmp_path / "grey.exr", values[..., :1], names=("Y",)))
    assert grey.notes == []


def test_data_window_lies_in_the_display_window(tmp_path):
    values = np.arange(1, 25, dtype=np.float32).reshape(2, 4, 3)
    path = write_image(tmp_path / "a.exr", values, full=(0, 0, 5, 4), origin=(-1, 1))
    clip, pixels = one(path)
    assert (clip.width, clip.height) == (5, 4)
    expected = np.zeros((4, 5, 3), np.float32)
    expected[1:3, :3] = values[:, 1:]
    np.testing.assert_array_equal(pixels, expected)


def test_a_small_file_that_states_a_huge_picture_is_refused(tmp_path):
    """An EXR of one pixel in a window of 120 GB."""
    small = np.zeros((1, 1, 3), np.float32)
    path = write_image(tmp_path / "huge.exr", small, full=(0, 0, 100_000, 100_000))
    assert path.stat().st_size < 1000
    with pytest.raises(FrameError, match="100000x100000 pixels in 3 channels are too many"):
        open_clip(str(path))


def test_orientation_is_applied(tmp_path):
    values = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    clip, pixels = one(write_image(tmp_path / "a.tif", values, Orientation=6))
    assert (clip.width, clip.height) == (2, 4)
    np.testing.assert_array_equal(np.rint(pixels * 255), np.rot90(values, -1))


def test_metadata_is_kept_for_the_copy(tmp_path):
    path = write_image(
        tmp_path / "a.0001.exr", np.zeros((2, 2, 3), np.float32), FramesPerSecond=Fraction(25)
    )
    image = open_clip(str(path)).load(1)
    assert ("FramesPerSecond", (25, 1)) in [(name, value) for name, _, value in image.metadata]


def test_the_seasons_clip(seasons):
    clip = open_clip(str(seasons))
    assert clip.frames == list(range(50))
    assert (clip.name, clip.width, clip.height, clip.depth) == ("seasons", 696, 380, "uint8")
    assert clip.source == str(seasons / "#####.png")
    pixels = clip.read(49)
    assert pixels.shape == (380, 696, 3)
    assert 0 <= pixels.min() < pixels.max() <= 1


@pytest.mark.parametrize("spec", ["", " "])
def test_an_empty_name_is_not_the_working_folder(tmp_path, monkeypatch, spec):
    monkeypatch.chdir(grey_levels(tmp_path, range(3)))
    assert open_clip(".").frames == [0, 1, 2]
    with pytest.raises(ClipError, match="name is empty"):
        open_clip(spec)


def test_one_numbered_image_among_others_is_no_sequence(tmp_path):
    grey_levels(tmp_path, range(7, 8))
    assert open_clip(str(tmp_path)).frames == [7]
    grey_levels(tmp_path, range(1), "beach.png")
    with pytest.raises(ClipError, match=r"(?s)2 images.*beach\.png.*clip\.0007\.png.*Give the"):
        open_clip(str(tmp_path))
    grey_levels(tmp_path, range(8, 9))
    assert open_clip(str(tmp_path)).frames == [7, 8]


def test_one_frame_is_no_frames(tmp_path):
    grey_levels(tmp_path, range(3, 4))
    (tmp_path / "clip.0003.png").write_bytes(b"")
    with pytest.raises(FrameError, match="none readable of frame 3;"):
        open_clip(str(tmp_path), skip_bad_frames=True)
    with pytest.raises(ClipError, match="found no frame 9, the clip has 3"):
        open_clip(str(tmp_path), frames="9")


@pytest.mark.parametrize("grey", [0x10, 0x42])
def test_a_dpx_of_ffmpeg(tmp_path, grey):
    """Its pixels begin where others have a rate and a timecode: 48.6 per second, 10:10:10:10."""
    codec = av.CodecContext.create("dpx", "w")
    codec.width, codec.height, codec.pix_fmt, codec.time_base = 16, 32, "rgb24", Fraction(1, 25)
    pixels = np.full((32, 16, 3), grey, np.uint8)
    (packet,) = codec.encode(av.VideoFrame.from_ndarray(pixels, "rgb24"))
    (tmp_path / "a.0001.dpx").write_bytes(bytes(packet))
    clip = open_clip(str(tmp_path / "a.####.dpx"))
    assert (clip.rate, start_timecode(clip), clip.stated.pixel_aspect) == (24, None, 1)
    image = clip.load(1)
    assert not [name for name, _, _ in image.metadata if "TimeCode" in name or "Rate" in name]
    write_frame(tmp_path / "b.exr", image.pixels, "float", metadata=image.metadata)
    copy = open_clip(str(tmp_path / "b.exr"))
    np.testing.assert_array_equal(copy.read(copy.frames[0]), pixels.astype(np.float32) / 255)


@pytest.mark.parametrize("bits", [0x14517214, 0x24000000, 0x00600000])
def test_a_timecode_that_cannot_be_is_none(tmp_path, bits):
    path = tmp_path / "a.0001.dpx"
    pixels = np.zeros((8, 16, 3), np.uint8)
    write_image(path, pixels, smpte__TimeCode=TimeCode(0x10203004), dpx__FrameRate=25.0)
    assert start_timecode(open_clip(str(path))) == "10:20:30:04"
    data = path.read_bytes()
    order = ">" if data[:4] == b"SDPX" else "<"
    path.write_bytes(
        data.replace(struct.pack(f"{order}I", 0x10203004), struct.pack(f"{order}I", bits))
    )
    assert start_timecode(open_clip(str(path))) is None


def test_long_texts_are_left_out_of_a_jpeg(tmp_path):
    """libjpeg ends the program where they are too long."""
    texts = [("Artist", "string", "A" * 70_000), ("Copyright", "string", "mine")]
    write_frame(tmp_path / "a.jpg", np.full((9, 9, 3), 0.5, np.float32), "uint8", metadata=texts)
    (image,) = open_clip(str(tmp_path / "a.jpg")).iter_images()
    found = {name: value for name, _, value in image.metadata}
    assert found["Copyright"] == "mine"
    assert "Artist" not in found
