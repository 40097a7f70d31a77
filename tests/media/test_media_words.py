"""What is said of media that cannot be read, and what is not said of media that can."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from clip_files import write_movie

from palette4d.cli.analyze import _rate
from palette4d.media.clip import ClipError, open_clip


def pictures(count: int) -> list[np.ndarray]:
    random = np.random.default_rng(1)
    return [random.integers(0, 255, (32, 48, 3), np.uint8) for _ in range(count)]


@pytest.mark.parametrize("extension", ["mp4", "mov"])
def test_a_movie_that_is_still_written(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"take.{extension}"
    write_movie(path, "mpeg4", "yuv420p", pictures(12), "rgb24", rate=Fraction(24))
    data = path.read_bytes()
    index = data.index(b"moov") - 4
    for end in (len(data) // 2, index):
        path.write_bytes(data[:end])
        with pytest.raises(ClipError, match="has no index yet: it is still being written"):
            open_clip(str(path))
    path.write_bytes(b"no movie at all, but text" * 9)
    with pytest.raises(ClipError, match="its content is none of"):
        open_clip(str(path))


@pytest.mark.parametrize("extension", ["mp4", "mkv"])
@pytest.mark.parametrize(("first", "last"), [(0, 31), (17, 60), (12, 47)])
def test_a_trimmed_stream_copy_has_one_rate(
    tmp_path: Path, extension: str, first: int, last: int
) -> None:
    """Packets from a key frame on, whose last pictures need some that were cut off."""
    whole, part = tmp_path / "whole.mp4", tmp_path / f"part.{extension}"
    write_movie(
        whole,
        "libx264",
        "yuv420p",
        pictures(72),
        "rgb24",
        rate=Fraction(24),
        options={"g": "12", "bf": "3"},
    )
    with av.open(str(whole)) as source, av.open(str(part), "w") as target:
        stream = source.streams.video[0]
        copy = target.add_stream_from_template(stream)
        for count, packet in enumerate(source.demux(stream)):
            if packet.dts is not None and first <= count <= last:
                packet.stream = copy
                target.mux(packet)
    assert open_clip(str(part)).notes == []


def test_a_varying_rate_is_still_said(tmp_path: Path) -> None:
    path = tmp_path / "vfr.mkv"
    with av.open(str(path), "w") as movie:
        stream = movie.add_stream("libx264", rate=24, options={"bf": "0"})
        stream.width, stream.height, stream.pix_fmt = 48, 32, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1000)
        time = 0
        for i, image in enumerate(pictures(60)):
            frame = av.VideoFrame.from_ndarray(image, "rgb24")
            frame.pts, frame.time_base = time, Fraction(1, 1000)
            time += 42 if i % 20 else 84
            movie.mux(stream.encode(frame))
        movie.mux(stream.encode(None))
    assert any("rate varies" in note for note in open_clip(str(path)).notes)


def test_subsampled_exr_is_no_bad_copy(tmp_path: Path) -> None:
    import OpenImageIO as oiio

    path = tmp_path / "yc.exr"
    spec = oiio.ImageSpec(16, 16, 3, "half")
    spec.channelnames = ("Y", "RY", "BY")
    image = oiio.ImageOutput.create(str(path))
    assert image.open(str(path), spec)
    assert image.write_image(np.zeros((16, 16, 3), np.float32))
    image.close()
    data = bytearray(path.read_bytes())
    for name in (b"RY\0", b"BY\0"):  # type, four bytes, then the sampling across and down
        struct.pack_into("<ii", data, data.index(name) + 11, 2, 2)
    path.write_bytes(data)
    with pytest.raises(ClipError, match="subsampled channels") as error:
        open_clip(str(path))
    assert "good copy" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "rate"),
    [
        ("24", Fraction(24)),
        ("23.976", Fraction(24000, 1001)),
        ("23.98", Fraction(24000, 1001)),
        ("29.97", Fraction(30000, 1001)),
        ("59.94", Fraction(60000, 1001)),
        ("24000/1001", Fraction(24000, 1001)),
        ("12.5", Fraction(25, 2)),
    ],
)
def test_rates_as_people_write_them(text: str, rate: Fraction) -> None:
    assert _rate(text) == rate


def test_no_home_folder_is_no_matter_of_the_user(tmp_path: Path) -> None:
    sidecar = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"
    done = subprocess.run(
        [sys.executable, "-m", "palette4d", "plot", sidecar, "-o", tmp_path / "x.png"],
        env={
            **os.environ,
            "HOME": str(tmp_path / "none" / "there"),
            "MPLCONFIGDIR": "",
            "XDG_CONFIG_HOME": "",
            "XDG_CACHE_HOME": "",
        },
        capture_output=True,
        text=True,
        check=True,
    )
    assert "atplotlib" not in done.stderr
