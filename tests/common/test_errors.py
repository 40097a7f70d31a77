"""Errors are sentences that say what was found, without [Errno …]."""

from pathlib import Path

import pytest

from palette4d.cli import main
from palette4d.common.errors import Palette4dError, SidecarError, in_words


def problem_of(path: Path) -> OSError:
    with pytest.raises(OSError, match="Errno") as caught:
        path.read_bytes()
    return caught.value


def test_the_systems_errors_name_the_file_and_no_number(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path in (
        tmp_path / "missing",
        tmp_path,
        tmp_path / "file" / "below",
        tmp_path / ("x" * 300),
        Path("/proc/self/mem"),
    ):
        text = in_words(problem_of(path))
        assert "Errno" not in text
        if path.name != "mem":  # an error of reading, which does not know the name
            assert text.startswith(f"{path}: ")


def test_other_errors_are_said_as_they_are() -> None:
    assert in_words(Palette4dError("found x")) == "found x"
    assert in_words(OSError("no number")) == "no number"


@pytest.mark.parametrize(
    "words",
    [
        ("export", "{folder}/x.p4d.json", "--every", "1", "-o", "{folder}"),
        ("analyze", "{folder}", "-o", "{folder}/x/y.p4d.json"),
        ("config", "{folder}", "-o", "{folder}/x.ocio"),
        ("render", "{folder}", "{folder}", "-o", "{folder}/o.png"),
        ("plot", "{folder}/missing", "-o", "{folder}/o.png"),
    ],
)
def test_the_command_line_says_no_errno(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...]
) -> None:
    assert main.main([word.format(folder=tmp_path) for word in words]) in (1, 2)
    error = capsys.readouterr().err
    assert "Errno" not in error
    assert str(tmp_path) in error


def test_a_long_place_in_a_file_is_cut() -> None:
    error = SidecarError("clip.p4d.json", "/clip/" + "x" * 1_000_000, "nothing", "a number")
    assert str(error).endswith("xxx...: found nothing, expected a number")
    assert len(str(error)) < 500
