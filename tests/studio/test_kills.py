"""A window that is killed at any time after a release: nothing that was released is lost."""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from windows import edits_of

import palette4d
from palette4d.cli.main import main

PROGRAM = Path(__file__).with_name("killed_window.py")
#: Seconds within which a release is on disk.
PROMISED = 2.0


@pytest.fixture(scope="module")
def long_clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The palette of a clip that colours are followed through for some seconds."""
    folder = tmp_path_factory.mktemp("long")
    clip, out = str(folder / "clip" / "frame.####.png"), str(folder / "clip.p4d.json")
    assert main(["sample-clip", "-o", clip, "--size", "640x360", "--frames", "60", "--quiet"]) == 0
    assert main(["analyze", clip, "-o", out, "--quiet"]) == 0
    return Path(out)


def killed(sidecar: Path, seed: int) -> tuple[list[tuple[str, int, Any, float]], float]:
    """Use a window, and kill it; return what it said, each with its time, and the time of death."""
    chance = random.Random(seed)
    child = subprocess.Popen(
        [sys.executable, str(PROGRAM), str(sidecar), str(seed)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "PYTHONPATH": str(PROGRAM.parents[1])},
    )
    said: list[tuple[str, int, Any, float]] = []
    wanted, came = chance.randint(1, 4), threading.Event()

    def listen() -> None:
        assert child.stdout is not None
        for line in child.stdout:
            if not line.endswith("\n"):
                continue  # it died while it wrote
            word, number, *more = line.split(maxsplit=2)
            said.append(
                (word, int(number), json.loads(more[0]) if more else None, time.monotonic())
            )
            if word == "released" and int(number) == wanted:
                came.set()

    listener = threading.Thread(target=listen)
    listener.start()
    assert came.wait(120), "the window did not begin"
    time.sleep(chance.random() * PROMISED * 1.2)
    died = time.monotonic()
    child.kill()
    child.wait()
    listener.join()
    assert child.stdout is not None
    child.stdout.close()
    return said, died


def check(sidecar: Path, seed: int, *, promised: bool) -> None:
    """Kill a window, and look for what was acknowledged: said to be saved, or two seconds old."""
    said, died = killed(sidecar, seed)
    releases = {number: value for word, number, value, _ in said if word == "released"}
    sure = [number for word, number, _, _ in said if word == "saved"]
    if promised:
        sure += [n for word, n, _, at in said if word == "released" and died - at > PROMISED]
    # What the file has was released then or later.
    possible = [value for number, value in releases.items() if number >= max(sure, default=0)]
    if not sure:
        possible.append({})
    found = json.loads(json.dumps(edits_of(palette4d.load(sidecar).grade)))
    assert found in possible, f"seed {seed}, killed at {died}: {said[-8:]}"


def copied(sidecar: Path, folder: Path) -> Path:
    """Return a copy of a sidecar with its clip."""
    folder.mkdir()
    shutil.copytree(sidecar.parent / "clip", folder / "clip", copy_function=os.link)
    return Path(shutil.copy(sidecar, folder / "clip.p4d.json"))


@pytest.mark.parametrize("seed", range(3))
def test_a_killed_window_loses_nothing_that_it_acknowledged(
    analysed: Path, tmp_path: Path, seed: int
) -> None:
    check(copied(analysed / "clip.p4d.json", tmp_path / "own"), seed, promised=False)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(20))
def test_200_killed_windows_lose_nothing(long_clip: Path, tmp_path: Path, part: int) -> None:
    for seed in range(10 * part, 10 * part + 10):
        check(copied(long_clip, tmp_path / str(seed)), 1000 + seed, promised=True)
