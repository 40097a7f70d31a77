"""A movie that is rendered from a movie: its tags, fields, matrix, range, timecode and sound."""

from __future__ import annotations

import shutil
import subprocess
from fractions import Fraction

import av
import numpy as np
import pytest
from clip_files import write_image
from deliveries import centres, display_matrix, movie, packets, render, said, samples, tiles, words

from palette4d.cli.render import CODECS as OFFERED
from palette4d.media.clip import ClipError, open_clip
from palette4d.media.codecs import CODECS
from palette4d.media.frame_writer import OutputError

OUTPUTS = [("o.mov", name) for name in CODECS] + [("o.mp4", "h264"), ("o.mp4", "hevc")]
TAGS = [
    (12, 1, 1),
    (9, 16, 9),
    (9, 18, 9),
    (12, 13, 1),
    (5, 6, 5),
    (1, 2, 1),
    (2, 16, 9),
    (2, 2, 2),
]


def test_the_command_offers_every_codec():
    assert tuple(CODECS) == OFFERED


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """A movie for each of `TAGS`, limited and full."""
    folder = tmp_path_factory.mktemp("sources")
    return {
        (tags, full): movie(folder / f"{i}{full}.mp4", list(tiles()), tags=tags, full_range=full)
        for i, tags in enumerate(TAGS)
        for full in (False, True)
    }


@pytest.mark.parametrize("tags", TAGS, ids=lambda tags: "-".join(map(str, tags)))
@pytest.mark.parametrize(("name", "codec"), OUTPUTS)
def test_tags_are_copied(tmp_path, sources, tags, name, codec):
    for full in (False, True) if tags in (TAGS[0], TAGS[-1]) else (False,):
        # Another name each time: Windows replaces no file that a clip has open.
        source, output = sources[tags, full], tmp_path / f"{full}-{name}"
        done = render(source, output, codec=codec)
        found = said(output)
        expected = words(*tags[:2], tags[2] if tags[2] != 2 else 5)
        partly = 2 in tags[:2] and codec.startswith("dnx")
        if codec.startswith("dnx"):  # its matrix is Rec.709; .mov states the others both or not
            expected = ("", "", "bt709") if partly else (*expected[:2], "bt709")
            assert any("states" in note for note in done.notes) == (partly and tags[:2] != (2, 2))
        assert (found.primaries, found.transfer, found.matrix) == expected
        assert found.range == ("pc" if full and CODECS[codec].full_range else "tv")
        before, after = open_clip(str(source)), open_clip(str(output))
        assert before.encoding == after.encoding or partly
        np.testing.assert_allclose(
            centres(after.read(1)),
            centres(before.read(1)),
            atol=0.035 if codec[0] == "h" else 0.025,
        )


@pytest.mark.parametrize(
    ("transfer", "codec"), [(1, "h264"), (13, "h264"), (16, "hevc"), (18, "hevc")]
)
def test_an_mp4_gets_ten_bits_for_pq_and_hlg(tmp_path, sources, transfer, codec):
    source = movie(tmp_path / "s.mp4", list(tiles()), tags=(9, transfer, 9))
    render(source, tmp_path / "o.mp4")
    assert open_clip(str(tmp_path / "o.mp4")).depth == ("uint10" if codec == "hevc" else "uint8")


def corner(matrix: tuple[int, int, int, int], shape: tuple[int, int]) -> np.ndarray:
    """The index of the pixel that is shown at each place, by the definition of the matrix."""
    a, b, c, d = matrix
    height, width = shape
    places = {}
    for y in range(height):
        for x in range(width):
            places[a * x + c * y, b * x + d * y] = y * width + x
    across, down = sorted({x for x, _ in places}), sorted({y for _, y in places})
    return np.array([[places[x, y] for x in across] for y in down])


MATRICES = [
    *((a, 0, 0, d) for a in (1, -1) for d in (1, -1)),
    *((0, b, c, 0) for b in (1, -1) for c in (1, -1)),
]


@pytest.mark.parametrize("matrix", MATRICES)
def test_every_display_matrix(tmp_path, matrix):
    frames = list(tiles(2, (48, 64)))
    a, b, c, d = (one << 16 for one in matrix)
    path = movie(
        tmp_path / "s.mov", frames, "qtrle", "rgb24", matrix=(a, b, 0, c, d, 0, 0, 0, 1 << 30)
    )
    assert display_matrix(path) or matrix == (1, 0, 0, 1)
    clip = open_clip(str(path))
    expected = frames[1].reshape(-1, 3)[corner(matrix, (48, 64))]
    assert (clip.height, clip.width) == expected.shape[:2]
    np.testing.assert_array_equal(np.rint(clip.read(1) * 255), expected)
    if shutil.which("ffmpeg"):
        size = f"{expected.shape[1]}x{expected.shape[0]}"
        asked = f"ffmpeg -v error -i {path} -f rawvideo -pix_fmt rgb24 -s {size} -".split()
        shown = subprocess.run(asked, capture_output=True, check=True).stdout
        np.testing.assert_array_equal(
            np.frombuffer(shown, np.uint8).reshape(2, *expected.shape)[1], expected
        )


def ramp(bits: int, layout: str) -> list[np.ndarray]:
    """Luma from the lowest to the highest code of limited range; grey."""
    unit, kind = 1 << (bits - 8), np.uint8 if bits == 8 else np.uint16
    luma = np.rint(np.linspace(unit, 255 * unit - 1, 256)).astype(kind)
    across, down = (2 if "42" in layout else 1), (2 if "420" in layout else 1)
    chroma = np.full((128 // down, 256 // across), 128 * unit, kind)
    return [np.tile(luma, (128, 1)), chroma, chroma]


def test_super_whites_and_sub_blacks_survive(tmp_path):
    planes = ramp(10, "yuv422p10le")
    source = movie(tmp_path / "s.mov", [planes] * 2, "prores_ks", "yuv422p10le", tags=(1, 1, 1))
    before = samples(source)[0]
    assert before.min() < 30
    assert before.max() > 1000
    for codec in ("prores422hq", "prores4444", "dnxhr-hqx", "hevc"):
        render(source, tmp_path / "o.mov", codec=codec, crf=2 if codec == "hevc" else None)
        after = samples(tmp_path / "o.mov")[0].astype(float)
        after /= after.max() / 1019 if codec == "prores4444" else 1  # which decodes to 12 bits
        np.testing.assert_allclose(after, before, atol=5)
    render(source, tmp_path / "o.##.exr")
    floats = open_clip(str(tmp_path / "o.01.exr")).read(1)
    np.testing.assert_allclose(floats[..., 1], (before - 64.0) / 876, atol=1e-4)
    render(tmp_path / "o.##.exr", tmp_path / "back.mov")
    np.testing.assert_allclose(samples(tmp_path / "back.mov")[0].astype(int), before, atol=5)


@pytest.mark.parametrize(
    ("layout", "codec", "fewer"),
    [("yuv420p10le", "h264", True), ("yuv420p", "h264", False), ("yuv420p10le", "hevc", False)],
)
def test_fewer_bits_are_noted(tmp_path, layout, codec, fewer):
    # x265 has written a header that FFmpeg refused, late in a process that had done much else.
    source = movie(tmp_path / "s.mp4", list(tiles()), "libx264", layout)
    done = render(source, tmp_path / "o.mp4", codec=codec)
    assert any("10 bits" in note for note in done.notes) == fewer


def test_highlights_of_scene_linear_frames_keep_their_hue(tmp_path):
    pixels = np.full((128, 256, 3), (8.0, 0.2, 0.1), np.float32)
    write_image(tmp_path / "s.1.exr", pixels, oiio__ColorSpace="lin_rec709_scene")
    render(tmp_path / "s.#.exr", tmp_path / "o.mov", codec="prores4444")
    found = open_clip(str(tmp_path / "o.mov")).read(0)[64, 128]
    np.testing.assert_allclose(found, (1, 0.2, 0.1), atol=0.02)


@pytest.mark.parametrize("full_range", [False, True])
def test_every_code_of_a_lossless_movie_survives(tmp_path, full_range):
    """Also Y'CbCr that is no colour of R'G'B' 0..1."""
    generator = np.random.default_rng(4)
    low, high = (0, 256) if full_range else (1, 255)
    # Chroma is flat for three samples, so that filtering between samples changes nothing.
    planes = [
        generator.integers(low, high, (128, 256), np.uint8),
        *(
            np.kron(generator.integers(20, 230, (8, 16)), np.ones((8, 8))).astype(np.uint8)
            for _ in range(2)
        ),
    ]
    source = movie(
        tmp_path / "s.mp4",
        [planes] * 2,
        tags=(1, 1, 1),
        full_range=full_range,
        options={"qp": "0"},
    )
    render(source, tmp_path / "o.mp4", crf=0)
    inner = (slice(2, -2), slice(2, -2))
    for before, after in zip(samples(source), samples(tmp_path / "o.mp4"), strict=True):
        where = inner if before.shape == (128, 256) else (slice(3, None, 8), slice(3, None, 8))
        np.testing.assert_allclose(after[where].astype(int), before[where], atol=1)


def order_of_frames(path):
    """Which field comes first by ffprobe; None without it."""
    if not shutil.which("ffprobe"):
        return None
    asked = "ffprobe -v error -of csv=p=0 -show_entries frame=interlaced_frame,top_field_first"
    found = subprocess.run([*asked.split(), path], capture_output=True, text=True, check=True)
    return {"1,1": "tff", "1,0": "bff"}.get(found.stdout.split()[1].strip(","), found.stdout)


@pytest.mark.parametrize("fields", ["tff", "bff"])
@pytest.mark.parametrize(("name", "codec"), [("o.mp4", "h264"), ("o.mov", "prores422hq")])
def test_fields_stay_fields(tmp_path, fields, name, codec):
    """Each field has a colour of its own, which no other field may touch."""
    luma = np.where(np.arange(128) % 2, 76, 96).astype(np.uint8)[:, None] * np.ones((1, 256), "u1")
    blue, red = (
        np.where(np.arange(64) % 2, odd, even).astype(np.uint8)[:, None] * np.ones((1, 128), "u1")
        for even, odd in ((99, 184), (195, 117))
    )
    source = movie(
        tmp_path / "s.mp4",
        [[luma, blue, red]] * 3,
        fields=fields,
        options={"qp": "0", "flags": "+ildct+ilme"},
    )
    before = open_clip(str(source))
    assert before.stated.fields == fields
    render(source, tmp_path / name, codec=codec)
    after = open_clip(str(tmp_path / name))
    assert after.stated.fields == fields
    assert order_of_frames(tmp_path / name) in (fields, None)
    assert said(tmp_path / name).order in {"tff": ("tt", "tb"), "bff": ("bb", "bt")}[fields]
    np.testing.assert_allclose(after.read(1)[4:-4, 8:-8], before.read(1)[4:-4, 8:-8], atol=0.03)
    assert np.abs(after.read(1)[50, 100] - after.read(1)[51, 100]).max() > 0.5


@pytest.mark.parametrize("codec", ["hevc", "dnxhr-hqx"])
def test_fields_are_refused_where_they_would_be_lost(tmp_path, codec):
    source = movie(
        tmp_path / "s.mp4", list(tiles()), fields="tff", options={"flags": "+ildct+ilme"}
    )
    with pytest.raises(OutputError, match="deinterlace"):
        render(source, tmp_path / "o.mov", codec=codec)
    assert not (tmp_path / "o.mov").exists()


RATES = [
    *(Fraction(n * 1000, 1001) for n in (24, 30, 60)),
    *(Fraction(n) for n in (24, 25, 30, 48, 50)),
]


@pytest.mark.parametrize("rate", RATES, ids=str)
def test_timecode_aspect_reel_and_sound_are_kept(tmp_path, rate):
    timecode = "01:02:03;04" if rate.denominator != 1 and rate > 24 else "01:02:03:04"
    source = movie(
        tmp_path / "s.mov",
        list(tiles(12)),
        rate=rate,
        aspect=Fraction(4, 3),
        sound="pcm_s16le",
        metadata={"timecode": timecode, "reel_name": "A001C003"},
    )
    for name in ("o.mov", "o.mp4"):
        done = render(source, tmp_path / name)
        found = said(tmp_path / name)
        assert (found.aspect, found.timecode, found.rate) == (Fraction(4, 3), timecode, rate)
        assert found.sound == 1
        if name == "o.mov":
            assert found.reel == "A001C003"
        assert any("becomes AAC" in note for note in done.notes) == (name == "o.mp4")
        if name == "o.mov":
            assert b"".join(data for _, data in packets(tmp_path / name, "audio")) == b"".join(
                data for _, data in packets(source, "audio")
            )
    render(source, tmp_path / "o.mov", sound=False)
    assert said(tmp_path / "o.mov").sound == 0


@pytest.mark.parametrize("name", ["o.mov", "o.mp4"])
def test_title_times_and_languages_are_kept(tmp_path, name):
    made = movie(tmp_path / "made.mov", list(tiles(12)), sound="pcm_s16le")
    source = tmp_path / "s.mov"
    texts = {"title": "Reel 3", "comment": "night", "make": "Maker"}
    texts["creation_time"] = "2024-05-06T07:08:09.000000Z"
    with av.open(str(made)) as old, av.open(str(source), "w") as new:
        new.metadata.update(texts)
        copies = {one.index: new.add_stream_from_template(one) for one in old.streams}
        for one, track in zip(copies.values(), ("Camera A", "Dialogue"), strict=True):
            one.metadata.update(handler_name=track, language="fra")
        for packet in old.demux():
            if packet.size:
                packet.stream = copies[packet.stream_index]
                new.mux(packet)
    done = render(source, tmp_path / name)
    if name == "o.mp4":
        del texts["make"]
    assert any("metadata: make" in note for note in done.notes) == (name == "o.mp4")
    with av.open(str(tmp_path / name)) as found:
        assert {key: found.metadata.get(key) for key in texts} == texts
        video, sound = found.streams.video[0].metadata, found.streams.audio[0].metadata
    assert video["handler_name"] == "Camera A"
    assert (sound["handler_name"], sound["language"]) == ("Dialogue", "fra")


def test_compressed_sound_keeps_its_times(tmp_path):
    source = movie(tmp_path / "s.mp4", list(tiles(24)), sound="aac")
    render(source, tmp_path / "o.mp4")
    assert packets(tmp_path / "o.mp4", "audio") == packets(source, "audio")


def test_a_range_of_frames_gets_its_own_sound_and_timecode(tmp_path):
    source = movie(
        tmp_path / "s.mov",
        list(tiles(48)),
        sound="pcm_s16le",
        metadata={"timecode": "00:00:59:20"},
    )
    render(source, tmp_path / "o.mov", frames="12-35")
    assert said(tmp_path / "o.mov").timecode == "00:01:00:08"
    whole = b"".join(data for _, data in packets(source, "audio"))
    part = b"".join(data for _, data in packets(tmp_path / "o.mov", "audio"))
    at = whole.index(part)
    assert at / 4 / 48000 == pytest.approx(0.5, abs=0.03)
    assert len(part) / 4 / 48000 == pytest.approx(1, abs=0.03)
    done = render(source, tmp_path / "o.mov", frames="0-46x2")
    assert said(tmp_path / "o.mov").sound == 0
    assert any("sound is not copied" in note for note in done.notes)


def heard(path):
    """The sound of a movie as 16 bits, left channel, without what begins before 0."""
    with av.open(str(path)) as container:
        sampler = av.AudioResampler(format="s16", layout="stereo", rate=48000)
        found = []
        for sound in container.decode(audio=0):
            first = round(sound.pts * sound.time_base * 48000)
            found += [
                one.to_ndarray()[0, max(0, -2 * first) :: 2] for one in sampler.resample(sound)
            ]
    return np.concatenate(found).astype(float)


def test_pcm_becomes_aac_in_mp4_and_stays_in_step(tmp_path):
    source = movie(tmp_path / "s.mov", list(tiles(24)), sound="pcm_s16le")
    render(source, tmp_path / "o.mp4")
    render(source, tmp_path / "p.mp4", frames="12-23")
    before, after, part = (heard(tmp_path / name) for name in ("s.mov", "o.mp4", "p.mp4"))
    assert len(after) == pytest.approx(48000, abs=2048)
    for wave, start in ((after, 0), (part, 24000)):
        piece = wave[6000:16000]
        like = [
            np.corrcoef(piece, before[start + 6000 + lag : start + 16000 + lag])[0, 1]
            for lag in range(-1000, 1000, 4)
        ]
        # A sine repeats after 126 samples; its loudness tells the place.
        assert max(like) > 0.97
        loud = [float(np.abs(one[6000:16000]).mean()) for one in (wave, before[start:])]
        assert loud[0] == pytest.approx(loud[1], rel=0.08)


def test_what_a_movie_cannot_hold_is_said(tmp_path):
    source = movie(tmp_path / "s.mkv", list(tiles()), sound="libopus")
    done = render(source, tmp_path / "o.mov")
    assert any("opus is not copied" in note for note in done.notes)
    assert said(tmp_path / "o.mov").sound == 0


def test_frames_of_a_movie_state_what_it_states(tmp_path):
    source = movie(
        tmp_path / "s.mov",
        list(tiles(3)),
        tags=(9, 16, 9),
        aspect=Fraction(4, 3),
        metadata={"timecode": "10:00:00:23", "reel_name": "A001"},
    )
    render(source, tmp_path / "o.##.exr")
    clip = open_clip(str(tmp_path / "o.##.exr"))
    stated = {name: value for name, _, value in clip.load(1).metadata}
    assert stated["smpte:TimeCode"][0] == 0x10000100
    assert (stated["reelName"], stated["colorInteropID"]) == ("A001", "pq_rec2020_display")
    assert stated["PixelAspectRatio"] == pytest.approx(4 / 3, abs=1e-3)
    assert stated["chromaticities"][:2] == pytest.approx((0.708, 0.292))
    render(tmp_path / "o.##.exr", tmp_path / "back.mov")
    found, first = said(tmp_path / "back.mov"), said(source)
    assert (found.primaries, found.transfer, found.matrix) == words(9, 16, 9)
    assert (found.timecode, found.reel, found.aspect) == (first.timecode, "A001", Fraction(4, 3))


@pytest.mark.parametrize("extension", ["exr", "dpx"])
def test_frames_have_no_timecode_in_part_above_30_a_second(tmp_path, extension):
    source = movie(
        tmp_path / "s.mov",
        list(tiles(4)),
        rate=Fraction(50),
        metadata={"timecode": "10:00:00:38"},
    )
    done = render(source, tmp_path / f"o.#.{extension}")
    clip = open_clip(str(tmp_path / f"o.#.{extension}"))
    for image in clip.iter_images():
        assert "smpte:TimeCode" not in {name for name, _, _ in image.metadata}
    assert len([note for note in done.notes if "timecode" in note]) == 1


def test_alpha_survives_in_prores_4444(tmp_path):
    generator = np.random.default_rng(5)
    rgba = np.kron(generator.integers(9000, 56000, (8, 16, 4)), np.ones((16, 16, 1)))
    rgba = rgba.astype(np.uint16)
    write_image(tmp_path / "c.0003.png", rgba, oiio__UnassociatedAlpha=1)
    done = render(tmp_path / "c.0003.png", tmp_path / "o.mov", codec="prores4444")
    clip = open_clip(str(tmp_path / "o.mov"))
    assert clip.has_alpha
    np.testing.assert_allclose(centres(clip.read(0)), centres(rgba) / 65535, atol=0.012)
    assert not any("alpha" in note for note in done.notes)
    flat = render(tmp_path / "c.0003.png", tmp_path / "flat.mov")
    assert any("over black" in note for note in flat.notes)


def test_crf_trades_size_for_quality(tmp_path):
    source = movie(tmp_path / "s.mp4", list(tiles(4)), options={"qp": "0"})
    for codec in ("h264", "hevc"):
        sizes = []
        for crf in (1, 14, 40):
            render(source, tmp_path / "o.mp4", codec=codec, crf=crf)
            sizes.append((tmp_path / "o.mp4").stat().st_size)
        assert sizes == sorted(sizes, reverse=True)
    with pytest.raises(OutputError, match="crf=20"):
        render(source, tmp_path / "o.mov", crf=20)


def test_wrong_codecs_are_refused_before_anything_is_written(tmp_path):
    source = movie(tmp_path / "s.mp4", list(tiles(2, (48, 64))))
    for name, codec, message in (
        ("o.mp4", "prores422hq", r"expected \.mov"),
        ("o.mov", "prores", "expected one of prores422hq"),
        ("o.mov", "dnxhr-hqx", "at least 256x120"),
    ):
        with pytest.raises(OutputError, match=message):
            render(source, tmp_path / "x" / name, codec=codec)
    with pytest.raises(OutputError, match="for movies"):
        render(source, tmp_path / "x" / "o.#.png", codec="h264")
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(("size", "used"), [((128, 256), 5), ((128, 1280), 1), ((592, 128), 1)])
def test_the_matrix_of_untagged_movies(tmp_path, size, used):
    """SD is Rec.601, HD is Rec.709; the render states what was used."""
    source = movie(tmp_path / "s.mp4", list(tiles(1, size)))
    render(source, tmp_path / "o.mov")
    assert said(tmp_path / "o.mov").matrix == words(2, 2, used)[2]


def test_a_matrix_that_cannot_be_read_is_refused(tmp_path):
    source = movie(tmp_path / "s.mp4", list(tiles()), tags=(9, 16, 14))
    with pytest.raises(ClipError, match="ICtCp"):
        open_clip(str(source))


def test_hdr10_is_kept_by_hevc(tmp_path):
    display = "G(13250,34500)B(7500,3000)R(34000,16000)WP(15635,16450)L(10000000,50)"
    params = f"log-level=error:master-display={display}:max-cll=1000,400"
    source = movie(
        tmp_path / "s.mp4",
        list(tiles(4)),
        "libx265",
        "yuv420p10le",
        tags=(9, 16, 9),
        options={"x265-params": params},
    )
    expected = f"master-display={display}:max-cll=1000,400"
    assert open_clip(str(source)).stated.hdr10 == expected
    render(source, tmp_path / "o.mp4")
    assert open_clip(str(tmp_path / "o.mp4")).stated.hdr10 == expected
    done = render(source, tmp_path / "o.mov")
    assert any("HDR10" in note for note in done.notes)


@pytest.mark.slow
@pytest.mark.parametrize("rate", RATES, ids=str)
@pytest.mark.parametrize(("name", "codec"), OUTPUTS)
def test_formats_by_tags_by_rates(tmp_path, rate, name, codec):
    """The whole matrix; the tests above take its rows and columns."""
    for tags in TAGS:
        source = movie(
            tmp_path / "s.mov",
            list(tiles(3)),
            tags=tags,
            rate=rate,
            aspect=Fraction(4, 3),
            sound="pcm_s16le",
            metadata={"timecode": "10:00:00:00"},
        )
        render(source, tmp_path / name, codec=codec)
        found = said(tmp_path / name)
        assert (found.rate, found.aspect, found.sound) == (rate, Fraction(4, 3), 1)
        assert found.timecode == "10:00:00:00"
        if not (codec.startswith("dnx") and 2 in tags[:2]):
            assert (found.primaries, found.transfer) == words(*tags)[:2]
