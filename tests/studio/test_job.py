"""Verbs that run beside the window."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import palette4d
from palette4d.studio import texts
from palette4d.studio.job import Job


def test_a_job_does_what_the_command_does_and_reports(tmp_path: Path, analysed: Path) -> None:
    out = tmp_path / "by_job.p4d.json"
    words = ["analyze", str(analysed / "clip"), "-o", str(out), "--frames", "1-3"]
    heard: list[float | None] = []
    job = Job(words, lambda job: heard.append(job.fraction))
    assert job.wait(120) == 0
    fractions = {fraction for fraction in heard if fraction is not None}
    assert fractions >= {0.0, 1.0}
    assert job.messages == ""
    assert f"wrote {out}" in job.output
    assert palette4d.load(out).grade.frames == (1, 3, 1)


def test_a_job_runs_no_module_of_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "argparse.py").write_text("open('ran', 'w')\n")
    monkeypatch.chdir(tmp_path)
    assert Job(["--version"], lambda job: None).wait(60) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["argparse.py"]


def test_a_stopped_job_leaves_nothing(tmp_path: Path, analysed: Path) -> None:
    out = tmp_path / "stopped.p4d.json"
    job = Job(["analyze", str(analysed / "clip"), "-o", str(out)], lambda job: None)
    job.cancel()
    assert job.wait(30) != 0
    assert not out.exists()


def test_an_error_names_the_fields_of_the_dialog(tmp_path: Path, analysed: Path) -> None:
    for number in (1, 2, 4):
        (tmp_path / f"gap.{number}.png").hardlink_to(analysed / "clip" / "frame.0001.png")
    job = Job(
        ["analyze", str(tmp_path / "gap.#.png"), "-o", str(tmp_path / "x.p4d.json")],
        lambda job: None,
    )
    assert job.wait(60) == 1
    assert job.messages.startswith("error: ")
    assert f"'{texts.FIELDS['skip_bad_frames']}'" in job.messages
    assert "--" not in job.messages


def test_what_is_no_event_is_a_message(tmp_path: Path) -> None:
    job = Job(["--version"], lambda job: None)
    job.wait(60)
    for line in (
        b"Fatal Python error\n",
        b"[1, 2]\n",
        b'{"stage": "x"}\n',
        b'{"stage": "x", "done": "a", "total": 3}\n',
        b'{"stage": "x", "done": 1e999, "total": 3}\n',
        b"[" * 100_000,
    ):
        job.messages = ""
        job._take(line)
        assert job.messages == line.decode()
    job._take(b'{"stage": "x", "done": 9, "total": 3}\n')
    assert job.fraction == 1


def test_a_verb_stops_when_its_input_ends(tmp_path: Path, analysed: Path) -> None:
    """As Studio stops it on Windows, where nobody sends Ctrl-C to another console."""
    out = tmp_path / "stopped.p4d.json"
    words = ["analyze", "--stop-at-eof", str(analysed / "clip"), "-o", str(out)]
    with subprocess.Popen(
        [sys.executable, "-m", "palette4d", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdin is not None
        process.stdin.close()
        assert process.wait(60) == 130
    assert not out.exists()
