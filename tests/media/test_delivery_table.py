"""The docs' table of colour tags: each row is rendered from a movie with these tags."""

from __future__ import annotations

import re
from pathlib import Path

import OpenImageIO as oiio
import pytest
from deliveries import movie, render, said, tiles, words

PAGE = Path(__file__).resolve().parents[2] / "docs" / "delivery.md"


def rows() -> list[list[str]]:
    """The cells of the table."""
    block = re.search("<!-- begin: tests(.*?)<!-- end -->", PAGE.read_text("utf-8"), re.DOTALL)
    assert block
    lines = [line for line in block[1].splitlines() if line.startswith("|")][2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def numbers(text: str) -> tuple[int, ...]:
    return tuple(int(one) for one in re.match(r"[\d-]+", text)[0].split("-"))


def test_the_table_has_rows():
    assert len(rows()) > 10


@pytest.mark.parametrize("row", rows(), ids=lambda row: row[0])
def test_a_row_is_true(tmp_path, row):
    stated, in_movie, in_exr, in_png, in_others = row
    source = movie(tmp_path / "s.mp4", list(tiles(1, (32, 64))), tags=numbers(stated))
    for name in ("o.mov", "o.mp4"):
        render(source, tmp_path / name)
        found = said(tmp_path / name)
        assert (found.primaries, found.transfer, found.matrix) == words(*numbers(in_movie))
    cells = {"exr": in_exr, "png": in_png, "dpx": in_others, "tif": in_others, "jpg": in_others}
    for extension, cell in cells.items():
        done = render(source, tmp_path / f"o.{extension}")
        noted = any("cannot say that their colours" in note for note in done.notes)
        assert noted == (cell == "note"), extension
        image = oiio.ImageInput.open(str(tmp_path / f"o.{extension}"))
        name = image.spec().getattribute("colorInteropID")
        cicp = image.spec().getattribute("CICP")
        image.close()
        if extension == "exr":
            assert name == (cell if cell not in ("note", "–") else None)
        if extension == "png":
            assert cicp == ((*numbers(cell), 0, 1) if cell not in ("note", "–") else None)


@pytest.mark.parametrize("row", rows(), ids=lambda row: row[0])
def test_frames_bring_the_tags_back_into_a_movie(tmp_path, row):
    stated, _, in_exr, in_png, _ = row
    source = movie(tmp_path / "s.mp4", list(tiles(1, (32, 64))), tags=numbers(stated))
    for extension, cell in (("exr", in_exr), ("png", in_png)):
        if cell in ("note", "–"):
            continue
        render(source, tmp_path / f"o.{extension}")
        render(tmp_path / f"o.{extension}", tmp_path / "back.mov")
        found = said(tmp_path / "back.mov")
        assert (found.primaries, found.transfer) == words(*numbers(stated))[:2], extension
