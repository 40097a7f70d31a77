"""Verbs that run beside the window."""

from __future__ import annotations

from pathlib import Path

import pytest

import palette4d
from palette4d.studio.verb_process import VerbProcess


def test_a_job_does_what_the_command_does_and_reports(tmp_path: Path, analysed: Path) -> None:
    out = tmp_path / "by_job.p4d.json"
    words = ["analyze", str(analysed / "clip"), "-o", str(out), "--frames", "1-3"]
    heard: list[float | None] = []
    job = VerbProcess(words, lambda job: heard.append(job.fraction))
    assert job.wait(120) == 0
    assert job.command == " ".join(["palette4d", *words])
    assert any(fraction is not None for fraction in heard)
    assert palette4d.load(out).frames == (1, 3, 1)


def test_a_job_runs_no_module_of_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "argparse.py").write_text("open('ran', 'w')\n")
    monkeypatch.chdir(tmp_path)
    assert VerbProcess(["--version"], lambda job: None).wait(60) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["argparse.py"]


def test_a_stopped_job_leaves_nothing(tmp_path: Path, analysed: Path) -> None:
    out = tmp_path / "stopped.p4d.json"
    job = VerbProcess(["analyze", str(analysed / "clip"), "-o", str(out)], lambda job: None)
    job.cancel()
    assert job.wait(30) != 0
    assert not out.exists()
