"""The name by which the node finds a sidecar, and by which shots are called."""

from __future__ import annotations

import unicodedata

import pytest

from palette4d import _core
from palette4d.common.text import file_safe
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
        ("sh010-0010.exr", "sh010"),
        ("sh010.-0003.exr", "sh010"),
        ("sh010.1001-1100#.exr", "sh010"),
        ("sh010-####.exr", "sh010"),
        ("sh_010-####.exr", "sh_010"),
        ("sh_010-@@@@.exr", "sh_010"),
        ("sh_010-%04d.exr", "sh_010"),
        ("sh.010-####.exr", "sh.010"),
        ("show_010####.exr", "show_010"),
        ("ep01_020x####.exr", "ep01_020x"),
        ("show 2-####.dpx", "show 2"),
        ("sh010.-3-10x2,15#.exr", "sh010"),
        ("sh010.5,7#.exr", "sh010"),
        ("shot.$F4.exr", "shot"),
        ("shot.$F.exr", "shot"),
        ("-0003.png", "-0003"),
        ("world0001.exr", "world"),
        ("build.exr", "build"),
        ("me@home.exr", "me@home"),
        ("a[b].png", "a[b]"),
        ("hundred%d.png", "hundred"),
        ("v2.png", "v2"),
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
        ("/Volumes/x/A001.mov", "A001"),
        ("S:\\show\\A001.mov", "A001"),
        ("sh010/comp v2", "sh010_comp_v2"),
        ("Grün – 1.mov", "Grün_–_1"),
        ("Gru\u0308n.0001.exr", "Grün"),
        ("日本語.mov", "日本語"),
        ("\u0926\u093f\u0932.mov", "\u0926\u093f\u0932"),
    ],
)
def test_shots_are_named_as_the_node_looks_for_them(clip: str, shot: str) -> None:
    assert _name(clip) == shot


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("a\u202eb\u00a0c\u3000d\ufeff", "a_b_c_d_"),
        ('a:b*c?d"e<f>g|h/i\\\\j', "a_b_c_d_e_f_g_h_i_j"),
        ("../..", "_"),
        ("-.x.-", "x"),
        ("", "clip"),
        ("é" * 80, "é" * 60),
        ("a" + "日" * 80, "a" + "日" * 39),
        ("\ud800\udcff.mov", "_.mov"),
        ("a\n\x7f\x9fb", "a_b"),
    ],
)
def test_names_that_are_safe_in_files(name: str, safe: str) -> None:
    assert file_safe(name) == file_safe(safe) == safe


def test_every_letter_of_every_language_stays() -> None:
    """Of all characters those are unsafe that Unicode calls spaces, controls and private."""
    for code in (*range(0x80, 0xD800), *range(0xE000, 0x30000)):
        kind = unicodedata.category(chr(code))
        if kind[0] in "LMN":
            assert _core.file_safe(f"a{chr(code)}") == f"a{chr(code)}"
        elif kind[0] == "Z" or kind in ("Cc", "Co"):
            assert _core.file_safe(f"a{chr(code)}") == "a_", hex(code)


@pytest.mark.parametrize(
    "bad", [b"\x80", b"\xc0\xaf", b"\xe0\x80\xaf", b"\xed\xa0\x80", b"\xf5", b"\xe6"]
)
def test_bytes_that_are_no_utf_8_become_one_line(bad: bytes) -> None:
    assert _core.file_safe(b"a" + bad + b"b") == "a_b"
