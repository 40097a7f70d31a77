"""The last alpha of lines of 10 bits, in every packing and order of bytes that is written."""

from pathlib import Path

import numpy as np
import pytest
from clip_files import write_image
from deliveries import render

from palette4d.media.clip import open_clip
from palette4d.media.dpx_alpha import with_last


@pytest.mark.parametrize("width", [4, 5, 6, 7])
@pytest.mark.parametrize("packing", ["A", "B"])
@pytest.mark.parametrize("endian", ["little", "big"])
def test_each_line_ends_with_its_own_alpha(
    tmp_path: Path, width: int, packing: str, endian: str
) -> None:
    levels = np.arange(1, 3 * width * 4 + 1, dtype=np.uint16).reshape(3, width, 4) * 7
    path = write_image(
        tmp_path / "a.0001.dpx",
        levels << 6 | levels >> 4,
        oiio__BitsPerSample=10,
        oiio__Endian=endian,
        dpx__Packing=f"Filled, method {packing}",
    )
    clip = open_clip(str(path))
    pixels = np.asarray(clip.read(1))
    assert (pixels * 1023).round().tolist() == levels.tolist()


def test_a_file_that_ends_early_is_left_as_it_was_read(tmp_path: Path) -> None:
    stored = np.full((2, 4, 4), 512 << 6, np.uint16)
    path = write_image(tmp_path / "a.dpx", stored, oiio__BitsPerSample=10)
    whole = path.read_bytes()
    for length in (3, 805, 815, len(whole) - 4):
        path.write_bytes(whole[:length])
        assert with_last(stored, path, 10) is stored


@pytest.mark.parametrize("width", [1, 4, 64, 65, 4096])
def test_a_picture_of_any_width_is_written(tmp_path: Path, width: int) -> None:
    pixels = np.linspace(0.1, 1, 2 * width * 4, dtype=np.float32).reshape(2, width, 4)
    pixels[..., 3] = 1
    write_image(tmp_path / "a.0001.exr", pixels)
    render(tmp_path / "a.0001.exr", tmp_path / "o.####.dpx")
    again = open_clip(str(tmp_path / "o.0001.dpx"))
    assert (again.read(1)[..., 3] == 1).all()
