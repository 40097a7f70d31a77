"""Several processes edit one sidecar at once; no acknowledged edit is lost."""

import itertools
import json
import os
import shutil
import stat
import subprocess
import sys
import tempfile
import time
import uuid
from pathlib import Path

import pytest
from posix_files import as_user, gifts

from palette4d.common import locking
from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document

GOLDEN = Path(__file__).parents[1] / "golden" / "sidecars"

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="flock is there only")

# The children wait for a common start. An error is an edit that is not acknowledged. Renames come
# late, as on a network.
WRITER = """
import errno, fcntl, json, os, sys, time
from palette4d.common import files
from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document

path, edge, count, locks, start = sys.argv[1:]
def refused(handle, operation):
    raise OSError(errno.ENOLCK, "no locks")
def useless(handle, operation):
    pass
fcntl.flock = {"refused": refused, "useless": useless, "flock": fcntl.flock}[locks]
rename = files._rename
def late(*names):
    time.sleep(0.003)
    rename(*names)
files._rename = late
while not os.path.exists(start):
    time.sleep(0.001)
acknowledged, refused = [], 0
for i in range(int(count)):
    try:
        document = Document.load(path)
        frame = 0.5 + i / 32
        document.stop(edge, frame=frame, rgb=(i / 1000, 0.25, 0.5))
        document.save()
    except Palette4dError:
        refused += 1
    else:
        acknowledged.append([edge, frame, i / 1000])
print(json.dumps([acknowledged, refused]))
"""
LOCKS = ("flock", "refused", "useless")
#: What a program of this computer that has ended leaves in its lock.
DEAD = locking._computer() + f" {2**22 + 1} {'0' * 16}"


def children(path: Path, count: int, locks: tuple[str, ...]) -> tuple[list[list[object]], int]:
    start = path.with_name("start")
    run = [
        subprocess.Popen(
            [sys.executable, "-c", WRITER, str(path), edge, str(count), how, str(start)],
            stdout=subprocess.PIPE,
            text=True,
        )
        for edge, how in zip(("e1", "e2", "e4", "e3"), 4 * locks, strict=False)
    ]
    time.sleep(0.5)
    start.touch()
    acknowledged, refused = [], 0
    for child in run:
        out, _ = child.communicate(timeout=300)
        assert child.returncode == 0
        found, not_found = json.loads(out)
        acknowledged += found
        refused += not_found
    return acknowledged, refused


@pytest.mark.parametrize(
    ("locks", "count"),
    [
        *((pair, 8) for pair in itertools.combinations_with_replacement(LOCKS, 2)),
        pytest.param(LOCKS, 150, marks=pytest.mark.slow),
    ],
)
def test_no_acknowledged_edit_is_lost(tmp_path: Path, locks: tuple[str, ...], count: int) -> None:
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    acknowledged, refused = children(path, count, locks)
    document = Document.load(path)
    found: dict[object, float] = {
        (s.edge, s.frame): s.rgb[0] for s in document.grade.settings.values()
    }
    for edge, frame, red in acknowledged:
        assert found.pop((edge, frame)) == red
    assert not found
    assert refused <= count // 5
    assert sorted(file.name for file in tmp_path.iterdir()) == ["clip.p4d.json", "start"]


@pytest.mark.parametrize("letter", ["x", "\N{CJK UNIFIED IDEOGRAPH-8272}"])
def test_a_file_with_the_longest_name_has_a_lock(tmp_path: Path, letter: str) -> None:
    whole = (255 - len(".p4d.json")) // len(letter.encode())
    path = tmp_path / f"{letter * whole}.p4d.json"
    path.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    document = Document.load(path)
    document.save_version("one")
    with locking.locked(path):
        (lock,) = tmp_path.glob(".*.lock")
        assert locking._LOCK.fullmatch(lock.name)
    document.save()
    assert Document.load(path).grade.versions == ("one",)


def test_a_lock_file_of_a_dead_process_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(locking, "LOCK_SECONDS", 0.3)
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    left = subprocess.run(
        [
            sys.executable,
            "-c",
            "import os, sys; from pathlib import Path; from palette4d.common import locking\n"
            f"with locking.locked(Path({str(path)!r})): os._exit(0)",
        ],
        check=True,
    )
    assert left.returncode == 0
    lock = tmp_path / ".clip.p4d.json.lock"
    computer = lock.read_text().split()[0]
    # Also one of a file that nobody writes again; those of other programs stay.
    lock.with_name(".other.p4d.json.lock").write_text(lock.read_text())
    foreign = lock.with_name(".foreign.lock")
    foreign.touch()
    os.utime(foreign, (0, 0))
    document = Document.load(path)
    document.set("v1", rgb=(0.5, 0.5, 0.5))
    document.save()
    foreign.unlink()
    assert [file.name for file in tmp_path.iterdir()] == ["clip.p4d.json"]
    # The lock of a computer that cannot be asked is respected, and one that names no process.
    document.set("v1", rgb=(0.6, 0.5, 0.5))
    before = path.read_bytes()
    for owner in ("elsewhere 1 abc", f"{computer} ² abc"):
        lock.write_text(owner, encoding="utf-8")
        with pytest.raises(Palette4dError, match=r"\.lock"):
            document.save()
        assert path.read_bytes() == before
    lock.unlink()
    document.save()


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone says when it was started")
def test_a_lock_of_another_machine_of_the_same_name_is_respected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Machines of a farm may all be called localhost; a process that is alive there is not here."""
    monkeypatch.setattr(locking, "LOCK_SECONDS", 0.3)
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    document = Document.load(path)
    document.set("v1", rgb=(0.5, 0.5, 0.5))
    lock = tmp_path / ".clip.p4d.json.lock"
    with locking.locked(path):
        computer, _, token = lock.read_text().split()
    start = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    twin = computer.replace(start, str(uuid.uuid4()))
    assert twin != computer
    lock.write_text(f"{twin} {2**22 + 1} {token}")
    with pytest.raises(Palette4dError, match="another program"):
        document.save()
    lock.write_text(f"{computer} {2**22 + 1} {token}")
    document.save()


def test_who_may_only_read_a_folder_cannot_hold_up_a_save(tmp_path: Path) -> None:
    fcntl = pytest.importorskip("fcntl")
    edited = tmp_path / "clip.p4d.json"
    edited.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    handle = os.open(edited.parent, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        document = Document.load(edited)
        document.set("v1", rgb=(0.5, 0.5, 0.5))
        document.save()
    finally:
        os.close(handle)
    assert Document.load(edited).grade.settings["v1"].rgb == (0.5, 0.5, 0.5)


def test_a_program_that_was_killed_while_it_removed_a_lock_stops_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(locking, "UNFINISHED_SECONDS", 0.05)
    lock = tmp_path / ".clip.p4d.json.lock"
    lock.touch()
    turn = lock.with_name(f"{lock.name}.removing")
    turn.touch()
    os.utime(turn, (0, 0))
    with locking.locked(tmp_path / "clip.p4d.json"):
        assert not turn.exists()


def test_a_lock_that_was_taken_away_stops_the_write(tmp_path: Path) -> None:
    target = tmp_path / "clip.p4d.json"
    with locking.locked(target) as held:
        held()
        (tmp_path / ".clip.p4d.json.lock").write_text("another 1 abc")
        with pytest.raises(Palette4dError):
            held()
    assert (tmp_path / ".clip.p4d.json.lock").read_text() == "another 1 abc"


@gifts
@pytest.mark.parametrize("left", ["dead", "unfinished"])
def test_a_left_over_lock_that_may_not_be_removed_is_an_error(
    monkeypatch: pytest.MonkeyPatch, left: str
) -> None:
    """Of a colleague's program, in a folder where each may remove his own files alone."""
    monkeypatch.setattr(locking, "LOCK_SECONDS", 0.3)
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o1777)
        path = Path(folder, "shot.p4d.json")
        lock = path.with_name(f".{path.name}.lock")
        lock.write_text(DEAD if left == "dead" else "")
        os.utime(lock, (0, 0))
        refused = pytest.raises(Palette4dError, match="remove that file")
        with as_user(777), refused, locking.locked(path):
            pass
        with locking.locked(path):  # its owner may
            pass


def test_a_removal_of_the_future_holds_nobody_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program was killed in it, and the clock was put back since."""
    monkeypatch.setattr(locking, "LOCK_SECONDS", 0.3)
    path = tmp_path / "shot.p4d.json"
    path.with_name(f".{path.name}.lock").write_text(DEAD)
    turn = path.with_name(f".{path.name}.lock.removing")
    turn.touch()
    os.utime(turn, (time.time() + 3600,) * 2)
    with locking.locked(path):
        pass
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("mask", [0, 0o077])
def test_all_read_who_holds_a_lock_and_its_owner_alone_changes_it(
    tmp_path: Path, mask: int
) -> None:
    """Else who may only read the folder takes it away, or a colleague cannot see that it died."""
    before = os.umask(mask)
    try:
        with locking.locked(tmp_path / "clip.p4d.json"):
            lock = tmp_path / ".clip.p4d.json.lock"
            assert stat.S_IMODE(lock.stat().st_mode) == 0o644
    finally:
        os.umask(before)


@pytest.mark.parametrize("content", ["", "computer 1", "computer 1 0123"])
def test_a_half_written_lock_file_stops_nobody(
    content: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program was killed while it wrote the lock file."""
    monkeypatch.setattr(locking, "UNFINISHED_SECONDS", 0.05)
    (tmp_path / ".clip.p4d.json.lock").write_text(content, encoding="utf-8")
    start = time.monotonic()
    with locking.locked(tmp_path / "clip.p4d.json"):
        assert time.monotonic() - start < locking.LOCK_SECONDS / 2
    assert list(tmp_path.iterdir()) == []


def test_a_pipe_in_the_place_of_the_lock_file_holds_nobody_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(locking, "LOCK_SECONDS", 0.2)
    os.mkfifo(tmp_path / ".clip.p4d.json.lock")
    with (
        pytest.raises(Palette4dError, match="has held"),
        locking.locked(tmp_path / "clip.p4d.json"),
    ):
        raise AssertionError("the body must not run")


def test_a_pick_whose_id_another_program_used_says_its_new_one(tmp_path: Path) -> None:
    path = tmp_path / "a.p4d.json"
    shutil.copy(GOLDEN / "v1_split.p4d.json", path)
    mine, theirs = Document.load(path), Document.load(path)
    mine.pick(3, colour=(0.4, 0.4, 0.4), by=(0.2, 0, 0), follow=False)
    theirs.pick(5, colour=(0.2, 0.3, 0.4), by=(0, 0.2, 0), follow=False)
    assert theirs.save() == {}
    assert mine.save() == {"p1": "p2"}
    assert mine.grade.pick("p2").frame == 3
    mine.change_pick("p2", reach=1.0)
    assert mine.save() == {}
