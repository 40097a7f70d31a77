"""Every verb that writes, killed or refused at every call that changes a file.

A library before the C library (shim.c) counts the calls that create, write, sync, rename and link
files, and fails one of them. Each file is then the old one or the new one. After a kill the same
command finishes the work and removes what was left over. A refusal is reported, and leaves nothing.
"""

from __future__ import annotations

import errno
import itertools
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

import edits
import numpy as np
import OpenImageIO as oiio
import pytest
from clip_files import write_image

HERE = Path(__file__).parent
GOLDEN = HERE.parent / "golden" / "sidecars" / "v1_edited.p4d.json"
KILL, KILL_HALFWAY, NOTHING = 0, -1, -2
REFUSALS = (errno.ENOSPC, errno.EIO, errno.EACCES, errno.EROFS, errno.EINTR)
LASTING = (errno.ENOSPC, errno.EROFS)
DATE = re.compile(rb"(?<=capDate\0string\0\x13\0\0\0).{19}")
TEMPORARY = r"(.*/)?\..*\.[0-9a-f]{16}\.p4d-tmp(\.[^.]*|/.*)?"
LOCK = r"(.*/)?\..*\.lock(\.removing)?"

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
# What is written is the same for every method, and this one is quick.
STATIC = "--method static --quiet"
SHOW = f"analyze edit.otio -o shots --jobs 1 {STATIC}"
RENDER = "render a.p4d.json clip -o {} --force --quiet --threads 1"
VERBS = {
    "set": Verb(SET, again=False),
    "undo": Verb("edit a.p4d.json undo", (SET, "edit a.p4d.json set v4 --rgb 0 1 0"), again=False),
    "pick": Verb("edit a.p4d.json pick --frame 3 --colour 0.5 0.5 0.5 --by 0.1,0,0", again=False),
    "version": Verb("edit a.p4d.json version save warm", (SET,), again=False),
    "copy": Verb("edit b.p4d.json copy a.p4d.json", (SET,), again=False),
    "copy to a show": Verb("edit shots/edit.shots.json copy a.p4d.json", (SHOW,), again=False),
    "autosave": Verb("autosave a.p4d.json", again=False),
    "analyze": Verb(f"analyze clip -o a.p4d.json --drop-edits {STATIC}", (SET,)),
    "analyze again": Verb(f"analyze clip -o a.p4d.json --keep-edits {STATIC}", (SET,), again=False),
    "show": Verb(f"analyze clip --detect-shots -o shots --jobs 1 {STATIC}"),
    "edit": Verb(SHOW),
    "frames": Verb(RENDER.format("out.####.png")),
    "exr": Verb(RENDER.format("out.####.exr")),
    "tif": Verb(RENDER.format("out.####.tif")),
    "movie": Verb(RENDER.format("out.mov")),
    "mp4": Verb(RENDER.format("out.mp4")),
    "sample": Verb("sample-clip -o sample.####.png --size 32x18 --frames 2 --quiet --force"),
    "bake": Verb(
        "bake a.p4d.json --frame 3 -o a.cube --size 5 --force",
        ("bake a.p4d.json --frame 9 -o a.cube --size 5",),
    ),
    "export": Verb("export a.p4d.json --frames 3,4 --size 5 -o luts --jobs 1 --quiet --force"),
    "export of a show": Verb(
        "export shots/edit.shots.json --every 9 --size 5 -o luts --otio luts.otio --jobs 1 "
        "--quiet --force",
        (SHOW,),
    ),
    "config": Verb("config a.p4d.json --stops --anyway --size 5 -o ocio --jobs 1 --quiet --force"),
    "svg": Verb("plot a.p4d.json -o a.svg --force"),
    "png": Verb("plot a.p4d.json -o a.png --width 400 --force"),
    "node": Verb("install-plugin --dest ofx"),
    "kdenlive": Verb("install-plugin --kdenlive kdenlive --shotcut shotcut --force"),
}


class Driver:
    """The process that runs verbs in forks, with the shim in front of the C library."""

    def __init__(self, shim: Path) -> None:
        environment = {**os.environ, "LD_PRELOAD": str(shim), "OMP_NUM_THREADS": "1"}
        environment["PYTHONWARNINGS"] = "ignore"
        environment["XDG_STATE_HOME"] = str(shim.with_name("state"))
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
    """A folder with two sidecars, the first with edits, a clip of three frames, and its edit."""
    folder = tmp_path_factory.mktemp("material")
    shutil.copy(GOLDEN, folder / "a.p4d.json")
    generator = np.random.default_rng(0)
    for frame in range(3):
        pixels = generator.integers(0, 255, (12, 16, 3), np.uint8)
        write_image(folder / "clip" / f"c.{frame:04d}.png", pixels)
    media = edits.numbered("clip", "c", 0, 3)
    edits.save(edits.timeline(edits.clip("sh010", media, 0, 3)), folder / "edit.otio")
    shutil.copy(GOLDEN.with_name("v1_split.p4d.json"), folder / "b.p4d.json")
    return folder


def state_of(folder: Path) -> State:
    """Every file's content (less the date of an EXR), and folders.

    A link counts as its target: where links are refused, copies take their place. A TIFF counts by
    its pixels: its library repeats a write, and leaves a gap.
    """
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_symlink() and not path.exists():
            found[name] = b"-> " + os.fsencode(path.readlink())
        elif path.suffix == ".tif" and not re.fullmatch(TEMPORARY, name):
            found[name] = oiio.ImageBuf(str(path)).get_pixels().tobytes()
        else:
            found[name] = DATE.sub(b"", path.read_bytes()) if path.is_file() else b"a folder"
    return found


def without(leftovers: str, state: State) -> State:
    return {name: state[name] for name in state if not re.fullmatch(leftovers, name)}


def faults_for(calls: list[str], *, full: bool) -> Iterator[tuple[int, int]]:
    """Pairs of a call's number, from 1, and what happens there.

    In full all of them, but of many alike in a row the first three and the last three; else each
    kind of call, where it stands last, is killed and refused once.
    """
    if full:
        for _, alike in itertools.groupby(enumerate(calls, 1), lambda call: call[1]):
            places = [at for at, _ in alike]
            ends = [*places[:3], *places[3:][-3:]]
            yield from itertools.product(ends, (KILL, KILL_HALFWAY, *REFUSALS))
    else:
        refusals = itertools.cycle(REFUSALS)
        for at in sorted({name: at for at, name in enumerate(calls, 1)}.values()):
            yield from ((at, KILL_HALFWAY), (at, next(refusals)))


def check(driver: Driver, material: Path, folder: Path, verb: Verb, *, full: bool) -> int:
    """Run a verb with one fault after the other; return how many there were."""

    def fresh() -> None:
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(start, folder)

    def run(at: int = 0, action: int = NOTHING, *, locks: bool = True) -> dict[str, Any]:
        return driver.run(folder, verb.arguments, at, action, locks=locks)

    start = folder.with_name("start")
    shutil.copytree(material, folder)
    for words in verb.before:
        done = driver.run(folder, words)
        assert done["status"] == 0, done
    shutil.move(folder, start)
    old = state_of(start)
    trials = 0
    # Only sidecars are locked against other writers.
    lockless = full and verb.arguments.startswith(("edit", "analyze", "autosave"))
    for locks in (True, False) if lockless else (True,):
        fresh()
        whole = run(locks=locks)
        assert whole["status"] == 0, whole
        new = state_of(folder)
        changed = [name for name in new if new[name] != old.get(name)]
        assert changed
        if full:
            fresh()
            run(locks=locks)
            assert state_of(folder) == new, "two runs differ"
        for at, action in faults_for(whole["calls"], full=full):
            fresh()
            done = run(at, action, locks=locks)
            found = state_of(folder)
            name = whole["calls"][at - 1]
            where = f"call {at} ({name}), action {action}, locks {locks}: {done}"
            trials += 1
            rest = without(f"{TEMPORARY}|{LOCK}", found)
            for file in set(rest) | set(old):
                if file.endswith((".series.json", ".shots.json")) and file in found:
                    json.loads(found[file])  # whole, and lists what was done so far
                else:
                    assert found.get(file) in (old.get(file), new.get(file)), (file, where)
            assert "Traceback" not in done["printed"], where
            if action in (KILL, KILL_HALFWAY):
                assert done["status"] == -9, where
            elif done["status"] == 0:
                assert rest == new, where
            else:
                assert done["status"] == 1, where
                assert "palette4d: error: " in done["printed"], where
                if len(changed) == 1:
                    assert rest == old, where
            removing = "unlink" in name or "rmdir" in name
            if action not in (KILL, KILL_HALFWAY, errno.EROFS) and not removing:
                assert found == rest, where
            elif done["status"] != 0 or found != rest:
                again = run(locks=locks)
                assert again["status"] == 0, (where, again)
                after = state_of(folder)
                if not locks:  # nobody knows whether the owner of the temporary file lives
                    after = without(TEMPORARY, after)
                assert after == new if verb.again else after.keys() == new.keys(), where
    return trials


@pytest.mark.parametrize("name", ["set", "copy", "autosave", "exr", "movie", "node"])
def test_each_kind_of_call_killed_and_refused(
    name: str, driver: Driver, material: Path, tmp_path: Path
) -> None:
    assert check(driver, material, tmp_path / "work", VERBS[name], full=False) >= 8


@pytest.mark.slow
@pytest.mark.parametrize("name", VERBS)
def test_every_call_with_every_fault(
    name: str, driver: Driver, material: Path, tmp_path: Path
) -> None:
    assert check(driver, material, tmp_path / "work", VERBS[name], full=True) >= 30
