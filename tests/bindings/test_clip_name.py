"""The name by which the node finds a sidecar, and by which shots are called."""

from __future__ import annotations

import pytest

from palette4d import _core
from palette4d.media.clip_sequence import IMAGE_EXTENSIONS, MOVIE_EXTENSIONS
from palette4d.shows.timeline_shots import _name


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("A001C001.mov", "A001C001"),
        ("A001C001_220115.MXF", "A001C001_220115"),
        ("sh010.1001.exr", "sh010"),
        ("sh010.####.exr", "sh010"),
        ("sh010_%04d.dpx", "sh010"),
        ("sh010.[1001-1100].tif", "sh010"),
        ("plate_v2.png", "plate_v2"),
        ("plate.v2.1001.exr", "plate.v2"),
        ("take2.mov", "take2"),
        ("0001.png", "0001"),
        ("übung.0001.png", "übung"),
    ],
)
def test_names(file: str, name: str) -> None:
    assert _core.clip_name(file) == name


def test_every_image_and_movie_is_known_on_both_sides() -> None:
    for extension in IMAGE_EXTENSIONS:
        assert _core.clip_name(f"sh010.1001.{extension}") == "sh010"
    for extension in MOVIE_EXTENSIONS:
        assert _core.clip_name(f"sh010.1001.{extension}") == "sh010.1001"


@pytest.mark.parametrize(
    ("clip", "shot"),
    [
        ("A001C001.mov", "A001C001"),
        ("A001C001.R3D", "A001C001"),
        ("sh010.1001.exr", "sh010"),
        ("sh010.v2", "sh010.v2"),
        ("sh 010", "sh_010"),
    ],
)
def test_shots_are_named_as_the_node_looks_for_them(clip: str, shot: str) -> None:
    assert _name(clip) == shot
