"""Media are found by name in a folder, however deep."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from posix_files import links, make_deep

from palette4d.shows.find_media import Folder


@pytest.fixture
def deep(tmp_path: Path) -> Iterator[Path]:
    """A folder that is deeper than Python's stack."""
    make_deep(tmp_path, 1500)
    yield tmp_path
    subprocess.run(["rm", "-rf", tmp_path / "a"], check=True)


@links
def test_a_deep_tree_is_searched_as_far_as_paths_go(deep: Path) -> None:
    below = deep.joinpath(*"a" * 1400)
    (below / "shot.mov").touch()
    (deep / "z" / "y").mkdir(parents=True)
    (deep / "z" / "y" / "other.mov").touch()
    folder = Folder(deep)
    assert folder.find(["shot.mov"]) == below / "shot.mov"
    assert folder.find(["other.mov"]) == deep / "z" / "y" / "other.mov"


@links
def test_links_to_folders_are_not_followed(tmp_path: Path) -> None:
    media = tmp_path / "media"
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "shot.mov").touch()
    media.mkdir()
    (media / "link").symlink_to(tmp_path / "elsewhere")
    (media / "circle.mov").symlink_to("circle.mov")
    (media / "linked.mov").symlink_to(tmp_path / "elsewhere" / "shot.mov")
    folder = Folder(media)
    assert folder.find(["shot.mov"]) is None
    assert folder.find(["linked.mov"]) == media / "linked.mov"


def test_sequences_whose_names_end_in_digits(tmp_path: Path) -> None:
    for name in ("sh010", "sh020", "A001_C003"):
        for frame in (1001, 1002):
            (tmp_path / f"{name}.{frame}.exr").touch()
    folder = Folder(tmp_path)
    for name in ("sh010", "sh020", "A001_C003"):
        pattern = tmp_path / f"{name}.####.exr"
        for said in ("", ".exr", ".####.exr", ".%04d.exr", ".[1001-1002].exr", ".1001.exr"):
            assert folder.find([name + said]) == pattern, said
        assert folder.find([f"/srv/plates/{name}/{name}.1001.dpx"]) == pattern
    for missing in ("sh030.####.exr", "sh030.[1001-1002].exr", "sh030", "sh.1001.exr", "sh.exr"):
        assert folder.find([missing]) is None, missing


def test_a_still_of_another_number_is_another_picture(tmp_path: Path) -> None:
    (tmp_path / "card_01.png").touch()
    folder = Folder(tmp_path)
    assert folder.find(["card_01.png"]) == folder.find(["card"]) == tmp_path / "card_##.png"
    assert folder.find(["card_##.png"]) == tmp_path / "card_##.png"
    assert folder.find(["card_02.png"]) is None
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "card_02.png").touch()
    assert Folder(tmp_path).find(["card_02.png"]) == tmp_path / "below" / "card_##.png"
