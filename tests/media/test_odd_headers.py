"""Headers that hold what other programs, or strangers, put there: words, never tracebacks."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import OpenImageIO as oiio
import pytest
from clip_files import write_image, write_movie

from palette4d.common.errors import Palette4dError
from palette4d.grade.rendering import render
from palette4d.media import existing
from palette4d.media.clip import open_clip

EDITED = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"
PIXELS = np.full((16, 24, 3), 0.25, np.float32)
RENDER: Any = {"strength": 0.0}


def stating(path: Path, name: str, kind: str, value: Any) -> Path:
    """Write an EXR with an attribute of any type."""
    spec = oiio.ImageSpec(24, 16, 3, "float")
    pair = oiio.TypeDesc(oiio.FLOAT, oiio.VEC2)
    spec.attribute(name, pair if kind == "v2f" else oiio.TypeDesc(kind), value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    assert out.write_image(PIXELS)
    assert out.close()
    return path


@pytest.mark.parametrize(
    ("kind", "value", "rate"),
    [
        ("v2f", (23.976, 1.0), Fraction(24000, 1001)),
        ("v2f", (24.0, 1.001), Fraction(24000, 1001)),
        ("v2f", (24.0, 0.5), Fraction(48)),
        ("rational", (30000, 1001), Fraction(30000, 1001)),
        ("v2f", (float("inf"), 1.0), None),
        ("v2f", (24.0, 0.0), None),
        ("string", "24", None),
    ],
)
def test_rates_of_any_type(tmp_path: Path, kind: str, value: Any, rate: Fraction | None) -> None:
    path = stating(tmp_path / "c.0001.exr", "FramesPerSecond", kind, value)
    assert open_clip(str(path)).rate == (rate or Fraction(24))


@pytest.mark.parametrize("name", ["CICP", "chromaticities", "smpte:TimeCode", "PixelAspectRatio"])
@pytest.mark.parametrize(
    ("kind", "value"),
    [
        ("int", 7),
        ("float", 0.5),
        ("string", "1\n1111111"),
        ("v2f", (1.5, 2.0)),
        ("float[8]", (1e30,) * 8),
        ("int[4]", (-1, 400, 3, 9)),
    ],
)
def test_attributes_of_other_types_say_nothing(
    tmp_path: Path, name: str, kind: str, value: Any
) -> None:
    clip = str(stating(tmp_path / "c.0001.exr", name, kind, value))
    for output in ("o.mov", "o.exr", "o.png", "o.dpx", "o.tif", "o.jpg"):
        render(EDITED, clip, tmp_path / output, **RENDER)


def changed(path: Path, old: bytes, new: bytes) -> Path:
    """Replace bytes of a file by as many others."""
    data = path.read_bytes()
    assert old in data
    assert len(old) == len(new)
    path.write_bytes(data.replace(old, new))
    return path


@pytest.mark.parametrize(("old", "new"), [(b"Zoe", b"Zo\xeb"), (b"remark\0", b"rem\xe9rk\0")])
@pytest.mark.parametrize("further", [True, False])
def test_exr_texts_that_are_no_utf_8(tmp_path: Path, old: bytes, new: bytes, further: bool) -> None:
    names = ("R", "G", "B", "Z") if further else ()
    pixels = np.full((16, 24, 4 if further else 3), 0.25, np.float32)
    path = write_image(tmp_path / "c.0001.exr", pixels, names=names, remark="Zoe")
    clip = str(changed(path, old, new))
    for output in ("o.tif", "o.dpx", "o.png"):
        render(EDITED, clip, tmp_path / output, **RENDER)
    if not further:
        render(EDITED, clip, tmp_path / "o.exr", **RENDER)
        return
    # OpenEXR's own library copies what is around the picture.
    with pytest.raises(Palette4dError, match="expected an EXR that OpenEXR reads"):
        render(EDITED, clip, tmp_path / "o.exr", **RENDER)


@pytest.mark.parametrize("count", [b"\xfb\xff\xff\xff", b"\x11\0\0\0"])
def test_an_exr_that_promises_more_blocks_is_damaged(tmp_path: Path, count: bytes) -> None:
    path = write_image(tmp_path / "o.exr", PIXELS, chunkCouNt=16)
    changed(path, b"chunkCouNt\0int\0\4\0\0\0\x10\0\0\0", b"chunkCount\0int\0\4\0\0\0" + count)
    assert existing.frame(path, (24, 16), bool) == "damaged"


def frames(count: int) -> list[np.ndarray]:
    noise = np.random.default_rng(0).integers(0, 255, (count, 64, 96, 3), np.uint8)
    return list(noise)


def test_a_codec_that_nobody_knows(tmp_path: Path) -> None:
    path = tmp_path / "c.mov"
    write_movie(path, "prores_ks", "yuv422p10le", frames(2), "rgb24")
    with pytest.raises(Palette4dError, match="does not know the codec of its picture"):
        open_clip(str(changed(path, b"apch", b"brxq")))


def test_sound_that_nobody_knows_is_not_copied(tmp_path: Path) -> None:
    made, source = tmp_path / "made.mov", tmp_path / "c.mov"
    write_movie(made, "prores_ks", "yuv422p10le", frames(2), "rgb24")
    with av.open(str(made)) as old, av.open(str(source), "w") as new:
        picture = new.add_stream_from_template(old.streams.video[0])
        sound = new.add_stream("pcm_s16le", rate=48000, layout="mono")
        for packet in old.demux(video=0):
            if packet.size:
                packet.stream = picture
                new.mux(packet)
        silence = av.AudioFrame.from_ndarray(np.zeros((1, 4000), np.int16), layout="mono")
        silence.rate = 48000
        new.mux(sound.encode(silence))
    done = render(EDITED, str(changed(source, b"sowt", b"apac")), tmp_path / "o.mov", **RENDER)
    assert any("an unknown codec is not copied" in note for note in done.notes)


def test_a_range_behind_the_end_of_a_movie_that_was_cut_short(tmp_path: Path) -> None:
    path = tmp_path / "c.mkv"
    write_movie(path, "ffv1", "yuv420p", frames(6), "rgb24")
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    whole = render(EDITED, str(path), tmp_path / "a.####.png", **RENDER)
    first = next((frame for frame in whole.filled), None)
    assert first is not None
    done = render(EDITED, str(path), tmp_path / "b.####.png", frames=f"{first}", **RENDER)
    assert done.filled == [first]
