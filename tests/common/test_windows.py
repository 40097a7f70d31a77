"""Files, locks and jobs on Windows, whose rules are others."""

import ctypes
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from wine import WINE

from palette4d.common.errors import Palette4dError, WriteError
from palette4d.common.files import replacing
from palette4d.common.locking import locked
from palette4d.common.text import quoted

if sys.platform != "win32":
    pytest.skip("Windows alone", allow_module_level=True)

from palette4d.common import windows

HOLDER = """
import sys, time
from pathlib import Path
from palette4d.common.locking import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def replace(path: Path) -> None:
    with replacing(path, force=True) as temporary:
        temporary.write_bytes(b"new")


def test_an_open_file_is_replaced_when_its_reader_closes_it(old: Path) -> None:
    with old.open("rb") as reader:
        threading.Timer(0.5, reader.close).start()
        replace(old)
    assert old.read_bytes() == b"new"


def test_a_file_that_stays_open_is_named_and_kept(old: Path) -> None:
    with old.open("rb"), pytest.raises(WriteError, match=r"open in .*close it there"):
        replace(old)
    assert old.read_bytes() == b"old"
    assert [path.name for path in old.parent.iterdir()] == [old.name]


@pytest.mark.skipif(WINE, reason="Wine replaces read-only files")
def test_a_read_only_file_is_named_as_such(old: Path) -> None:
    old.chmod(0o444)
    with pytest.raises(WriteError, match="attrib -r"):
        replace(old)
    old.chmod(0o666)
    assert old.read_bytes() == b"old"


def test_who_holds_a_file_is_asked_without_harm(old: Path) -> None:
    with old.open("rb"):
        assert all(isinstance(name, str) for name in windows.holders(old))


def test_the_lock_of_a_killed_program_is_taken_over(old: Path) -> None:
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(old)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        assert not windows.has_ended(process.pid)
        process.kill()
        process.wait()
        started = time.monotonic()
        with locked(old) as held:
            held()
        assert time.monotonic() - started < 5
        assert windows.has_ended(process.pid)


def test_threads_take_turns(old: Path) -> None:
    count, errors = [0], []

    def add() -> None:
        try:
            for _ in range(5):
                with locked(old) as held:
                    before = count[0]
                    time.sleep(0.001)
                    held()
                    count[0] = before + 1
        except Palette4dError as error:
            errors.append(error)

    threads = [threading.Thread(target=add) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (count, errors) == ([20], [])


def test_a_job_limits_memory_and_ends_with_its_owner() -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        handle = int(process._handle)
        with windows.limited(handle, 300):
            inside, kernel = ctypes.c_int(), ctypes.WinDLL("kernel32")
            assert kernel.IsProcessInJob(ctypes.c_void_p(handle), None, ctypes.byref(inside))
            assert inside.value
            assert process.poll() is None
        process.wait(10)


def test_words_are_quoted_as_the_shell_takes_them(tmp_path: Path) -> None:
    plain, blank = tmp_path / "a.p4d.json", tmp_path / "my clip & more.p4d.json"
    assert quoted(blank) == f'"{blank}"'
    assert quoted(plain).strip('"') == str(plain)
    for word in (plain, blank):
        line = f'{quoted(sys.executable)} -c "import sys; print(sys.argv[1])" {quoted(word)}'
        done = subprocess.run(line, capture_output=True, text=True, check=True)
        assert done.stdout.strip() == os.fspath(word)
