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
