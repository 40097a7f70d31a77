"""`render --cluster`: a real Dask farm on loopback writes what one machine writes."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from edits import movie, sequence
from farm_processes import farm

from palette4d.cli import main
from palette4d.common.errors import Palette4dError
from palette4d.jobs import dask_farm
from palette4d.shows.frames import Files, FramesTask, render, render_frames

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="the folder for Windows has no Dask; Linux runs this"
)

EDITED = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def run(*words: object) -> int:
    return main.main(["render", *map(str, words)])


def test_a_farm_writes_the_same_bytes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sequence with a gap and a broken frame, a movie, and a render that goes on."""
    sequence(tmp_path / "in", "sh", 1, 7)
    (tmp_path / "in" / "sh.0003.png").unlink()
    (tmp_path / "in" / "sh.0006.png").write_bytes(b"no picture")
    take = movie(tmp_path / "take.mov", 11)
    monkeypatch.chdir(tmp_path)
    assert run(EDITED, "in/sh.####.png", "-o", "here/o.####.png", "--bits", 16, "--quiet") == 0
    assert run(EDITED, take, "-o", "here_mov/o.####.png", "--quiet") == 0
    with farm(tmp_path / "farm", workers=1) as made:
        there = ["--cluster", made.address]
        words = [EDITED, "in/sh.####.png", "-o", "there/o.####.png", "--bits", 16, "--json", *there]
        capsys.readouterr()
        assert run(*words) == 0
        found = json.loads(capsys.readouterr().out)
        assert (found["frames"], found["filled"]) == ([1, 2, 3, 4, 5, 6, 7], [3, 6])
        assert files(Path("there")) == files(Path("here"))
        assert run(EDITED, take, "-o", "there_mov/o.####.png", "--quiet", *there) == 0
        assert files(Path("there_mov")) == files(Path("here_mov"))
        Path("there/o.0004.png").unlink()
        assert run(*words, "--skip-existing") == 0
        assert json.loads(capsys.readouterr().out)["frames"] == [4]
        assert files(Path("there")) == files(Path("here"))
        Path("in/sh.0005.png").write_bytes(b"broken meanwhile")
        capsys.readouterr()
        assert run(*words, "--force", "--frames", "1-2,4-7", "--missing", "error") == 1
        said = capsys.readouterr()
        assert json.loads(said.out)["frames"] == [1, 2, 4, 7]
        assert "2 frames of 6 could not" in said.err
        assert "from frame 5: " in said.err


@pytest.mark.parametrize("answered", [(), (11,)])
def test_a_worker_that_answers_with_other_frames_is_told_of(
    answered: tuple[int, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are neither left out without a word, nor put in other frames' places."""

    def lied(address: str, work: Any, tasks: Any, take: Any) -> None:
        for row, task in tasks.items():
            content = work(task, 1).content.values()
            take(row, Files(dict(zip(answered, content, strict=False)), (), ()))

    monkeypatch.setattr(dask_farm, "run", lied)
    clip = str(sequence(tmp_path / "in", "sh", 1, 3))
    (tmp_path / "o.0011.png").write_text("precious")
    with pytest.raises(Palette4dError, match="3 frames of 3 could not"):
        render(EDITED, clip, tmp_path / "o.####.png", frames="1-3", cluster="farm:9")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in", "o.0011.png"]


def test_what_a_farm_cannot_do(tmp_path: Path) -> None:
    clip = str(sequence(tmp_path / "in", "sh", 1, 2))
    with pytest.raises(Palette4dError, match="a movie is encoded frame after frame"):
        render(EDITED, clip, tmp_path / "o.mov", cluster="127.0.0.1:9")


def test_a_task_leaves_out_bad_frames(tmp_path: Path) -> None:
    """What a worker returns, without a farm."""
    from palette4d.grade import sidecar
    from palette4d.grade.output import Output
    from palette4d.media.frame_writer import FramePattern

    clip = str(sequence(tmp_path / "in", "sh", 1, 3))
    (tmp_path / "in" / "sh.0002.png").unlink()
    data = sidecar.dumps(sidecar.load(EDITED)).encode()
    pattern = FramePattern.parse(str(tmp_path / "o.####.png"))
    task = FramesTask(
        data,
        clip,
        None,
        (1, 2),
        Output(),
        None,
        "input",
        "leave out",
        pattern,
        "uint8",
        "palette4d",
    )
    found = render_frames(task, 1)
    assert list(found.content) == [1]
    assert (found.skipped, found.filled) == ((2,), ())
