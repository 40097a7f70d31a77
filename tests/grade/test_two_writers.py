"""Several processes edit one sidecar at once; no acknowledged edit is lost."""

import errno
import fcntl
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from palette4d.common import locking
from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document

GOLDEN = Path(__file__).parents[1] / "golden" / "sidecars"

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="flock is there only")

# The children wait for a common start. An error is an edit that is not acknowledged.
WRITER = """
import errno, fcntl, json, os, sys, time
from palette4d.common.errors import Palette4dError
from palette4d.grade.document import Document

path, edge, count, error, start = sys.argv[1:]
if error:
    def flock(handle, operation):
        raise OSError(getattr(errno, error), error)
    fcntl.flock = flock
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


def children(path: Path, count: int, error: str) -> tuple[list[list[object]], int]:
    start = path.with_name("start")
    run = [
        subprocess.Popen(
            [sys.executable, "-c", WRITER, str(path), edge, str(count), error, str(start)],
            stdout=subprocess.PIPE,
            text=True,
        )
        for edge in ("e1", "e2", "e4", "e3")
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
    ("error", "count"),
    [
        ("", 25),
        ("ENOLCK", 25),
        pytest.param("EOPNOTSUPP", 150, marks=pytest.mark.slow),
    ],
)
def test_no_acknowledged_edit_is_lost(tmp_path: Path, error: str, count: int) -> None:
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    acknowledged, refused = children(path, count, error)
    document = Document.load(path)
    found: dict[object, float] = {(s.edge, s.frame): s.rgb[0] for s in document.settings.values()}
    for edge, frame, red in acknowledged:
        assert found.pop((edge, frame)) == red
    assert not found
    assert refused <= count // 5
    assert sorted(file.name for file in tmp_path.iterdir()) == ["clip.p4d.json", "start"]


def test_a_lock_file_of_a_dead_process_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(locking, "_flocked", lambda *_: False)
    monkeypatch.setattr(locking, "LOCK_SECONDS", 0.3)
    path = tmp_path / "clip.p4d.json"
    path.write_bytes((GOLDEN / "v1_split.p4d.json").read_bytes())
    left = subprocess.run(
        [
            sys.executable,
            "-c",
            "import os, sys; from pathlib import Path; from palette4d.common import locking\n"
            "locking._flocked = lambda *_: False\n"
            f"with locking.locked(Path({str(path)!r})): os._exit(0)",
        ],
        check=True,
    )
    assert left.returncode == 0
    lock = tmp_path / ".clip.p4d.json.lock"
    assert lock.exists()
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
    # The lock of a computer that cannot be asked is respected.
    lock.write_text("elsewhere 1 abc")
    document.set("v1", rgb=(0.6, 0.5, 0.5))
    before = path.read_bytes()
    with pytest.raises(Palette4dError, match=r"elsewhere.*\.lock"):
        document.save()
    assert path.read_bytes() == before
    lock.unlink()
    document.save()


def test_a_folder_that_cannot_be_opened_is_locked_by_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files can be written in a folder that may not be listed."""
    opens = os.open

    def closed(path: Any, *how: Any, **more: Any) -> int:
        if path == tmp_path:
            raise PermissionError(errno.EACCES, "closed")
        return opens(path, *how, **more)

    monkeypatch.setattr(os, "open", closed)
    with locking.locked(tmp_path / "clip.p4d.json"):
        assert (tmp_path / ".clip.p4d.json.lock").exists()
    assert not (tmp_path / ".clip.p4d.json.lock").exists()


def test_a_lock_that_was_taken_away_stops_the_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(locking, "_flocked", lambda *_: False)
    target = tmp_path / "clip.p4d.json"
    with locking.locked(target) as held:
        held()
        (tmp_path / ".clip.p4d.json.lock").write_text("another 1 abc")
        with pytest.raises(Palette4dError):
            held()
    assert (tmp_path / ".clip.p4d.json.lock").read_text() == "another 1 abc"


@pytest.mark.parametrize("content", ["", "computer 1", "computer 1 0123"])
def test_a_half_written_lock_file_stops_nobody(
    content: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program was killed while it wrote the lock file, where flock does not work."""

    def refuse(handle: int, operation: int) -> None:
        raise OSError(errno.ENOLCK, "no locks")

    monkeypatch.setattr(fcntl, "flock", refuse)
    monkeypatch.setattr(locking, "UNFINISHED_SECONDS", 0.05)
    (tmp_path / ".clip.p4d.json.lock").write_text(content, encoding="utf-8")
    start = time.monotonic()
    with locking.locked(tmp_path / "clip.p4d.json"):
        assert time.monotonic() - start < locking.LOCK_SECONDS / 2
    assert list(tmp_path.iterdir()) == []


def test_a_pipe_in_the_place_of_the_lock_file_holds_nobody_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(locking, "_flocked", lambda *_: False)
    monkeypatch.setattr(locking, "LOCK_SECONDS", 0.2)
    os.mkfifo(tmp_path / ".clip.p4d.json.lock")
    with (
        pytest.raises(Palette4dError, match="has held"),
        locking.locked(tmp_path / "clip.p4d.json"),
    ):
        raise AssertionError("the body must not run")
