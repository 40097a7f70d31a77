"""Movies: numbers, rates, exact values from lossless files, colour matrices, damage, rotation."""

from __future__ import annotations

import weakref
from fractions import Fraction

import av
import numpy as np
import pytest
from av.video.reformatter import ColorRange, Colorspace
from clip_files import damage, write_image, write_movie

from palette4d.media import clip_movie
from palette4d.media.clip import ClipError, FrameError, open_clip

HEIGHT, WIDTH = 48, 64


def noise(count: int, kind: type = np.uint8, channels: int = 3, largest: int = 0):
    """Different random frames."""
    generator = np.random.default_rng(3)
    top = largest or np.iinfo(kind).max
    shape = (HEIGHT, WIDTH, channels) if channels else (HEIGHT, WIDTH)
    return [generator.integers(0, top, shape, kind, endpoint=True) for _ in range(count)]


def test_lossless_eight_bit_is_exact(tmp_path):
    frames = noise(6)
    path = write_movie(
        tmp_path / "rém i.avi", "rawvideo", "bgr24", frames, "rgb24", rate=Fraction(25)
    )
    clip = open_clip(str(path))
    assert clip.frames == list(range(6))
    assert (clip.rate, clip.width, clip.height, clip.depth) == (25, WIDTH, HEIGHT, "uint8")
    assert clip.is_movie
    assert (clip.name, clip.source) == ("rém i", str(path))
    for frame, pixels in clip:
        np.testing.assert_array_equal(pixels, frames[frame].astype(np.float32) / np.float32(255))


def test_lossless_sixteen_bit_is_exact(tmp_path):
    frames = noise(4, np.uint16)
    path = write_movie(tmp_path / "a.mkv", "ffv1", "gbrp16le", frames, "gbrp16le")
    clip = open_clip(str(path))
    assert clip.depth == "uint16"
    for frame, pixels in clip:
        np.testing.assert_array_equal(pixels, frames[frame].astype(np.float32) / np.float32(65535))


def test_a_movie_that_claims_very_many_frames_is_refused(tmp_path):
    path = write_movie(tmp_path / "a.mp4", "mpeg4", "yuv420p", noise(6), "rgb24")
    movie = bytearray(path.read_bytes())
    at = movie.index(b"stts") + 12  # the number of frames of the first length
    movie[at : at + 4] = (400_000_000).to_bytes(4, "big")
    path.write_bytes(movie)
    for frames in (None, "0-3"):
        with pytest.raises(ClipError, match="more than 1000000 frames in the movie"):
            open_clip(str(path), frames=frames, skip_bad_frames=True)


def test_alpha_is_straight(tmp_path):
    frames = noise(2, channels=4)
    path = write_movie(tmp_path / "a.mov", "qtrle", "argb", frames, "argb")
    clip = open_clip(str(path))
    assert (clip.has_alpha, clip.premultiplied) == (True, False)
    argb = frames[1]
    np.testing.assert_array_equal(np.rint(clip.read(1) * 255), argb[..., [1, 2, 3, 0]])


@pytest.mark.parametrize(
    "playlist",
    ["ffconcat version 1.0\nfile real.mkv\n", "#EXTM3U\n#EXTINF:1,\nreal.mkv\n#EXT-X-ENDLIST\n"],
    ids=["ffconcat", "hls"],
)
def test_a_playlist_does_not_lead_to_other_files(tmp_path, playlist):
    write_movie(tmp_path / "real.mkv", "ffv1", "gray", noise(2, channels=0), "gray")
    (tmp_path / "a.mp4").write_text(playlist)
    with pytest.raises(ClipError, match="its content is none of"):
        open_clip(str(tmp_path / "a.mp4"))


def test_pictures_that_are_too_large_are_refused(tmp_path, monkeypatch):
    path = write_movie(tmp_path / "a.mkv", "ffv1", "bgr0", noise(1), "rgb24")
    monkeypatch.setattr(clip_movie, "MOST_SAMPLES", HEIGHT * WIDTH * 3)
    open_clip(str(path))
    monkeypatch.setattr(clip_movie, "MOST_SAMPLES", HEIGHT * WIDTH * 3 - 1)
    with pytest.raises(ClipError, match="expected at most 13000x13000"):
        open_clip(str(path))


def test_grey(tmp_path):
    frames = noise(2, channels=0)
    clip = open_clip(str(write_movie(tmp_path / "a.mkv", "ffv1", "gray", frames, "gray")))
    np.testing.assert_array_equal(
        np.rint(clip.read(1) * 255), np.repeat(frames[1][..., None], 3, axis=2)
    )


MATRICES = {
    Colorspace.ITU709: (0.2126, 0.0722),
    Colorspace.ITU601: (0.299, 0.114),
    Colorspace.BT2020: (0.2627, 0.0593),
}


@pytest.mark.parametrize("matrix", list(MATRICES))
@pytest.mark.parametrize("color_range", [ColorRange.MPEG, ColorRange.JPEG])
@pytest.mark.parametrize("bits", [8, 10])
def test_luma_and_chroma_by_the_streams_own_matrix(tmp_path, matrix, color_range, bits):
    """Y'CbCr is made here from known R'G'B' by the standard's formula, and must come back."""
    generator = np.random.default_rng(5)
    rgb = generator.random((HEIGHT, WIDTH, 3))
    red_weight, blue_weight = MATRICES[matrix]
    luma = rgb @ [red_weight, 1 - red_weight - blue_weight, blue_weight]
    blue = (rgb[..., 2] - luma) / (2 * (1 - blue_weight))
    red = (rgb[..., 0] - luma) / (2 * (1 - red_weight))
    unit = 2 ** (bits - 8)
    if color_range == ColorRange.MPEG:
        planes = [219 * luma + 16, 224 * blue + 128, 224 * red + 128]
        codes = [np.rint(plane * unit) for plane in planes]
    else:
        top = 2**bits - 1
        codes = [
            np.rint(plane)
            for plane in (top * luma, top * blue + 128 * unit, top * red + 128 * unit)
        ]
    layout, kind = ("yuv444p", np.uint8) if bits == 8 else ("yuv444p10le", np.uint16)
    planar = np.stack([np.clip(code, 0, 2**bits - 1) for code in codes]).astype(kind)
    path = write_movie(
        tmp_path / "a.mkv",
        "ffv1",
        layout,
        [planar, planar],
        layout,
        size=(HEIGHT, WIDTH),
        colorspace=matrix,
        color_range=color_range,
    )
    clip = open_clip(str(path))
    assert clip.depth == f"uint{bits}"
    assert clip.encoding == ("Rec.709" if matrix == Colorspace.ITU709 else "unknown")
    step = 1 / (219 * unit)
    np.testing.assert_allclose(clip.read(1), rgb, atol=1.6 * step)


def flat(colours) -> list:
    """One flat frame a colour."""
    return [np.full((HEIGHT, WIDTH, 3), colour, np.uint8) for colour in colours]


def test_compressed_movie_with_reordered_frames(tmp_path):
    levels = [20 + 9 * n for n in range(24)]
    path = write_movie(
        tmp_path / "a.mp4",
        "libx264",
        "yuv420p",
        flat([(v, v, v) for v in levels]),
        "rgb24",
        rate=Fraction(24000, 1001),
        options={"crf": "8", "bf": "3", "g": "8"},
    )
    clip = open_clip(str(path))
    assert (clip.frames, clip.rate) == (list(range(24)), Fraction(24000, 1001))
    read = {frame: float(p.mean()) * 255 for frame, p in clip}
    assert list(read) == clip.frames
    np.testing.assert_allclose(list(read.values()), levels, atol=3)
    for frame in (20, 3, 4, 23, 0):  # back and forth
        assert float(clip.read(frame).mean()) * 255 == pytest.approx(levels[frame], abs=3)
    part = open_clip(str(path), frames="5-20x5")
    assert part.frames == [5, 10, 15, 20]
    assert [frame for frame, _ in part] == [5, 10, 15, 20]
    with pytest.raises(ClipError, match="the movie has 0-23"):
        open_clip(str(path), frames="20-24")
    assert clip.notes == []


def test_a_jump_decodes_from_the_key_frame_before(tmp_path, monkeypatch):
    path = write_movie(
        tmp_path / "a.mp4",
        "libx264",
        "yuv420p",
        flat([(5 * v, 5 * v, 5 * v) for v in range(48)]),
        "rgb24",
        options={"g": "8"},
    )
    decoded = []
    decode = clip_movie._decode

    def counted(*words):
        for number, picture in decode(*words):
            decoded.append(number)
            yield number, picture

    monkeypatch.setattr(clip_movie, "_decode", counted)
    clip = open_clip(str(path))
    for frame in (0, 44, 45):
        assert float(clip.read(frame).mean()) * 51 == pytest.approx(frame, abs=1)
    assert len(decoded) <= 1 + 8 + 1


@pytest.mark.parametrize("width", [33, 259, 515])
def test_a_picture_of_any_width_is_decoded_alike_each_time(tmp_path, width):
    """Threads of libswscale wrote over each other's first pixels where 8 divides no row."""
    random = np.random.default_rng(3).integers(0, 65535, (163, width, 3), np.uint16)
    path = write_movie(
        tmp_path / "a.mkv", "ffv1", "yuv422p10le", [random], "rgb48le", colorspace=Colorspace.ITU709
    )
    first = open_clip(str(path)).read(0)
    for _ in range(12):
        np.testing.assert_array_equal(open_clip(str(path)).read(0), first)


def test_a_movie_is_let_go_at_once(tmp_path):
    """Windows renames and replaces no file that is open."""
    path = write_movie(tmp_path / "a.avi", "rawvideo", "bgr24", noise(6), "rgb24")
    clip = open_clip(str(path))
    clip.read(2)
    gone = weakref.ref(clip)
    del clip
    assert gone() is None
    path.rename(tmp_path / "b.avi")


def test_variable_rate_is_noted(tmp_path):
    stamps = [*range(30), 36, 37, *range(58, 88)]
    path = write_movie(
        tmp_path / "a.mkv", "ffv1", "bgr0", noise(62, channels=4), "bgr0", stamps=stamps
    )
    clip = open_clip(str(path))
    assert clip.frames == list(range(62))
    assert any("rate varies" in note for note in clip.notes)
    assert len(list(clip)) == 62


@pytest.mark.parametrize(("degrees", "turns"), [(90, 1), (-90, -1), (180, 2)])
def test_rotation_is_applied(tmp_path, degrees, turns):
    frames = noise(2)
    path = write_movie(
        tmp_path / "a.mov",
        "qtrle",
        "rgb24",
        frames,
        "rgb24",
        prepare=lambda stream: stream.set_display_rotation(degrees),
    )
    clip = open_clip(str(path))
    expected = np.rot90(frames[1], turns)
    assert (clip.height, clip.width) == expected.shape[:2]
    np.testing.assert_array_equal(np.rint(clip.read(1) * 255), expected)


@pytest.mark.parametrize(
    ("name", "codec", "layout"),
    [("a.mp4", "libx264", "yuv420p"), ("a.mov", "prores_ks", "yuv422p10le")],
)
def test_damaged_frame_is_named_or_skipped(tmp_path, name, codec, layout):
    options = {"g": "1", "bf": "0"} if codec == "libx264" else {}
    path = write_movie(tmp_path / name, codec, layout, noise(6), "rgb24", options=options)
    whole_clip = open_clip(str(path))
    good = dict(whole_clip)
    damage(path, 3)
    with pytest.raises(FrameError, match="frame 3 cannot be decoded"):
        list(open_clip(str(path)))
    clip = open_clip(str(path), skip_bad_frames=True)
    read = dict(clip)
    assert list(read) == [0, 1, 2, 4, 5]
    assert clip.skipped == [3]
    for frame, pixels in read.items():  # no other frame has moved or changed
        np.testing.assert_array_equal(pixels, good[frame])


def test_movie_that_ends_early(tmp_path):
    path = write_movie(
        tmp_path / "a.mp4",
        "libx264",
        "yuv420p",
        flat([(40 * n, 99, 30) for n in range(6)]),
        "rgb24",
        options={"crf": "1", "bf": "0", "g": "1"},
    )
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ClipError, match=r"a\.mp4"):
        list(open_clip(str(path)))


@pytest.mark.parametrize(
    ("name", "codec", "layout"),
    [
        ("a.mkv", "ffv1", "bgr0"),
        ("a.webm", "libvpx-vp9", "yuv420p"),
        ("a.mxf", "mpeg2video", "yuv422p"),
        ("a.avi", "mjpeg", "yuvj420p"),
    ],
)
def test_a_file_that_is_cut_short_has_the_frames_that_it_promises(tmp_path, name, codec, layout):
    """Matroska and MXF state a time, no number of frames."""
    path = write_movie(tmp_path / name, codec, layout, noise(30), "rgb24", rate=Fraction(25))
    assert len(open_clip(str(path)).frames) == 30
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 6 // 10])
    with pytest.raises(FrameError, match=r"is missing: the file ends after \d+ of 30 frames"):
        open_clip(str(path))
    clip = open_clip(str(path), skip_bad_frames=True)
    good = [image.frame for image in clip.iter_images()]
    assert clip.frames == [*good, *clip.skipped] == list(range(30))
    assert 10 < len(good) < 25


def test_frames_with_exif(tmp_path):
    """Side data of a type that PyAV does not know, and beside it the display matrix."""
    frames = noise(3)
    path = write_movie(tmp_path / "a.mov", "tiff", "rgb24", frames, "rgb24")
    for frame, pixels in open_clip(str(path)):
        np.testing.assert_array_equal(pixels, frames[frame].astype(np.float32) / np.float32(255))
    jpeg = write_image(tmp_path / "a.jpg", frames[0], Orientation=6, Make="camera")
    with av.open(str(tmp_path / "b.mov"), "w") as movie:
        stream = movie.add_stream("mjpeg", rate=24)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuvj420p"
        packet = av.Packet(jpeg.read_bytes())
        packet.pts = packet.dts = 0
        packet.time_base, packet.stream, packet.is_keyframe = Fraction(1, 24), stream, True
        movie.mux(packet)
    shown = open_clip(str(tmp_path / "b.mov")).read(0)
    assert np.abs(shown - open_clip(str(jpeg)).read(0)).mean() < 0.05


def test_fragments_that_are_cut_short_are_noted(tmp_path):
    path = tmp_path / "a.mp4"
    with av.open(str(path), "w", options={"movflags": "frag_every_frame+empty_moov"}) as movie:
        stream = movie.add_stream("mpeg4", rate=25)
        stream.height, stream.width = HEIGHT, WIDTH
        for pixels in noise(30):
            movie.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, "rgb24")))
        movie.mux(stream.encode())
    assert not open_clip(str(path)).notes
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 6 // 10])
    (note,) = open_clip(str(path), skip_bad_frames=True).notes
    assert "does not say how many are missing behind the" in note


def test_what_is_no_movie(tmp_path):
    path = tmp_path / "a.mov"
    path.write_bytes(b"this is no movie" * 100)
    with pytest.raises(ClipError, match="cannot be opened"):
        open_clip(str(path))
    path.write_bytes(b"")
    with pytest.raises(ClipError, match="cannot be opened"):
        open_clip(str(path))
    with pytest.raises(ClipError, match="movie file"):
        open_clip(str(tmp_path))


def test_an_empty_file_is_said_to_be_empty(tmp_path):
    (tmp_path / "a.mov").touch()
    with pytest.raises(ClipError, match="the file is empty"):
        open_clip(str(tmp_path / "a.mov"))
