"""Every verb that writes, killed or refused at every call that changes a file.

A library before the C library (shim.c) counts the calls that create, write, sync, rename and link
files, and fails one of them. Each file is then the old one or the new one. After a kill the same
command finishes the work and removes what was left over. A refusal is reported, and leaves nothing.
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from clip_files import write_image

HERE = Path(__file__).parent
GOLDEN = HERE.parent / "golden" / "sidecars" / "v1_edited.p4d.json"
KILL, KILL_HALFWAY, NOTHING = 0, -1, -2
LASTING = (errno.ENOSPC, errno.EROFS)
DATE = re.compile(rb"(?<=capDate\0string\0\x13\0\0\0).{19}")
LEFT_OVER = re.compile(r"(.*/)?\..*\.[0-9a-f]{16}\.p4d-tmp(\.[^.]*)?")

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not shutil.which("cc"), reason="needs Linux and a C compiler"
)

State = dict[str, bytes]


@dataclass(frozen=True)
class Verb:
    """A command, with what it needs to have run before. `again`: it may run twice."""

    arguments: str
    before: tuple[str, ...] = ()
    again: bool = True


SET = "edit a.p4d.json set v4 --rgb 1 0 0"
VERBS = {
    "set": Verb("edit a.p4d.json set v4 --rgb 1 0 0", again=False),
    "undo": Verb("edit a.p4d.json undo", (SET, "edit a.p4d.json set v4 --rgb 0 1 0"), again=False),
    "version": Verb("edit a.p4d.json version save warm", (SET,), again=False),
    "analyze": Verb("analyze clip -o a.p4d.json --drop-edits --quiet", (SET,)),
    "frames": Verb("render a.p4d.json clip -o out.####.png --force --quiet --threads 1"),
    "exr": Verb("render a.p4d.json clip -o out.####.exr --force --quiet --threads 1"),
    "movie": Verb("render a.p4d.json clip -o out.mov --force --quiet --threads 1"),
    "bake": Verb(
        "bake a.p4d.json --frame 3 -o a.cube --size 5 --force",
        ("bake a.p4d.json --frame 9 -o a.cube --size 5",),
    ),
    "export": Verb("export a.p4d.json --frames 3,4 --size 5 -o luts --jobs 1 --quiet --force"),
    "config": Verb("config a.p4d.json --stops --anyway --size 5 -o ocio --jobs 1 --quiet --force"),
    "plot": Verb("plot a.p4d.json -o a.svg --force"),
    "show": Verb("analyze clip --detect-shots -o shots --jobs 1 --quiet"),
}


class Driver:
    """The process that runs verbs in forks, with the shim in front of the C library."""

    def __init__(self, shim: Path) -> None:
        environment = {**os.environ, "LD_PRELOAD": str(shim), "OMP_NUM_THREADS": "1"}
        environment["PYTHONWARNINGS"] = "ignore"
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "driver.py")],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(
        self, folder: Path, words: str, at: int = 0, action: int = NOTHING, *, locks: bool = True
    ) -> dict[str, Any]:
        assert self.process.stdin
        assert self.process.stdout
        trial = {
            "folder": str(folder),
            "arguments": words.split(),
            "at": at,
            "action": action,
            "lasting": action in LASTING,
            "locks": locks,
        }
        print(json.dumps(trial), file=self.process.stdin, flush=True)
        done: dict[str, Any] = json.loads(self.process.stdout.readline())
        return done


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driver]:
    shim = tmp_path_factory.mktemp("shim") / "shim.so"
    compiler = ["cc", "-shared", "-fPIC", "-O1", "-o", str(shim), str(HERE / "shim.c"), "-ldl"]
    subprocess.run(compiler, check=True)
    one = Driver(shim)
    with one.process:  # its end of input ends the driver
        yield one


@pytest.fixture(scope="module")
def material(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an edited sidecar and a clip of three frames."""
    folder = tmp_path_factory.mktemp("material")
    shutil.copy(GOLDEN, folder / "a.p4d.json")
    generator = np.random.default_rng(0)
    for frame in range(3):
        pixels = generator.integers(0, 255, (12, 16, 3), np.uint8)
        write_image(folder / "clip" / f"c.{frame:04d}.png", pixels)
    return folder


def state_of(folder: Path) -> State:
    """Every file's content (less the date of an EXR), a link's target, and "" for folders."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_symlink():
            found[name] = b"-> " + os.fsencode(path.readlink())
        else:
            found[name] = DATE.sub(b"", path.read_bytes()) if path.is_file() else b""
    return found


def check(driver: Driver, material: Path, folder: Path, verb: Verb, *, full: bool) -> int:
    """Run a verb with a fault at each call; return how many trials there were."""

    def fresh() -> None:
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(start, folder)

    def run(at: int = 0, action: int = NOTHING, *, locks: bool = True) -> dict[str, Any]:
        return driver.run(folder, verb.arguments, at, action, locks=locks)

    start = folder.with_name("start")
    shutil.copytree(material, folder)
    for words in verb.before:
        assert driver.run(folder, words)["status"] == 0
    shutil.move(folder, start)
    old = state_of(start)
    trials = 0
    # Only sidecars are locked against other writers.
    lockless = full and verb.arguments.startswith(("edit", "analyze"))
    for locks in (True, False) if lockless else (True,):
        fresh()
        whole = run(locks=locks)
        assert whole["status"] == 0, whole
        new = state_of(folder)
        assert new != old
        fresh()
        run(locks=locks)
        assert state_of(folder) == new, "two runs differ"
        refusals = (errno.ENOSPC, errno.EIO, errno.EACCES, errno.EROFS, errno.EINTR)
        actions = (KILL, KILL_HALFWAY, *(refusals if full else refusals[:1]))
        for at in range(1, whole["calls"] + 1):
            for action in actions:
                fresh()
                done = run(at, action, locks=locks)
                found = state_of(folder)
                where = f"call {at}, action {action}, locks {locks}: {done}"
                trials += 1
                left = {n for n in found if LEFT_OVER.fullmatch(n) or n.endswith(".lock")}
                for name in set(found) | set(old):
                    if name.endswith((".series.json", ".shots.json")) and found.get(name):
                        json.loads(found[name])  # whole, and lists what was done so far
                    elif name not in left:
                        some = [state[name] for state in (old, new) if name in state]
                        assert (
                            found.get(name, b"") in [*some, b""][: len(some) + (name not in old)]
                        ), (name, where)
                assert "Traceback" not in done["printed"], where
                if action in (KILL, KILL_HALFWAY):
                    assert done["status"] in (-9, 0), where
                    again = run(locks=locks)
                    assert again["status"] == 0, (where, again)
                    # Without locks nobody knows whether the file's owner lives.
                    after = {
                        name: content
                        for name, content in state_of(folder).items()
                        if locks or not LEFT_OVER.fullmatch(name)
                    }
                    assert after == new if verb.again else after.keys() == new.keys(), where
                elif done["status"] == 0:
                    assert found == new, where
                else:
                    assert done["status"] == 1, where
                    assert "palette4d: error: " in done["printed"], where
                    assert not left, where
                    if len(set(new) - set(old)) == 0:
                        assert found == old, where
    return trials


@pytest.mark.parametrize("name", ["set", "frames"])
def test_killed_or_refused_at_each_call(
    name: str, driver: Driver, material: Path, tmp_path: Path
) -> None:
    assert check(driver, material, tmp_path / "work", VERBS[name], full=False) >= 9


@pytest.mark.slow
@pytest.mark.parametrize("name", VERBS)
def test_every_verb_with_every_fault(
    name: str, driver: Driver, material: Path, tmp_path: Path
) -> None:
    assert check(driver, material, tmp_path / "work", VERBS[name], full=True) >= 14
