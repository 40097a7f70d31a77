"""A run of melt without output is repeated; a run that ends in the middle is a failure."""

from __future__ import annotations

from pathlib import Path

import pytest
from host import scene

#: Counts its runs in the file `runs`; then what the test wants.
COUNT = "echo >> runs; n=$(wc -l < runs); "


def run(folder: Path, script: str) -> str:
    said, memory = scene.run_until_it_writes(
        ["sh", "-c", COUNT + script], folder, {}, lambda: list(folder.glob("out*"))
    )
    assert memory > 0
    return said


def runs(folder: Path) -> int:
    return (folder / "runs").read_text().count("\n")


@pytest.fixture
def hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scene, "FIRST_FRAME", 0.5)
    monkeypatch.setattr(scene, "WHOLE_CLIP", 1.0)


def test_a_silent_end_is_asked_again(tmp_path: Path) -> None:
    assert run(tmp_path, "[ $n -lt 3 ] || echo > out; echo run $n") == "run 3\n"


def test_a_wait_in_the_middle_is_a_failure(tmp_path: Path, hurried: None) -> None:
    with pytest.raises(AssertionError, match="did not end"):
        run(tmp_path, "echo > out; exec sleep 60")
    assert runs(tmp_path) == 1


def test_an_error_is_a_failure(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="ended with 3"):
        run(tmp_path, "exit 3")
    assert runs(tmp_path) == 1
