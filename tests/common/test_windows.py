"""Files, locks and jobs on Windows, whose rules are others."""

import ctypes
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import palette4d
from palette4d.common.errors import Palette4dError, WriteError
from palette4d.common.files import refuse_existing, replacing
from palette4d.common.locking import locked
from palette4d.common.text import quoted
from palette4d.shows.find_media import local_path

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


def test_names_in_other_letters_are_one_file(tmp_path: Path) -> None:
    clip = tmp_path / "Clip.mov"
    clip.write_bytes(b"frames")
    with pytest.raises(Palette4dError, match="read for this output"):
        refuse_existing(tmp_path / "CLIP.MOV", force=True, inputs=[clip])
    with locked(clip), pytest.raises(FileExistsError):
        (tmp_path / ".CLIP.MOV.LOCK").open("x")


@pytest.mark.parametrize(
    ("named", "path"),
    [
        (r"S:\show\a.mov", r"S:\show\a.mov"),
        ("S:/show/a.mov", r"S:\show\a.mov"),
        (r"\\server\share\a.mov", r"\\server\share\a.mov"),
        ("file:///S:/my%20show/a.mov", r"S:\my show\a.mov"),
        ("file://localhost/S:/a.mov", r"S:\a.mov"),
        ("file://server/share/a.mov", r"\\server\share\a.mov"),
    ],
)
def test_media_on_drives_and_servers(named: str, path: str) -> None:
    assert str(local_path(named)) == path


@pytest.fixture
def sidecar(tmp_path: Path) -> Path:
    """A sidecar with a palette of one colour's neighbours."""
    path = tmp_path / "a.p4d.json"
    golden = Path(__file__).parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"
    path.write_bytes(golden.read_bytes())
    return path


def test_paths_are_longer_than_260_characters(sidecar: Path) -> None:
    """Windows asks for this in its registry; Wine always allows it."""
    folder = sidecar.parent
    while len(str(folder)) < 300:
        folder /= "a long name with blanks " * 2 + "色"
        folder.mkdir()
    with locked(folder / "b.p4d.json") as held:
        held()
        with replacing(folder / "b.p4d.json") as temporary:
            temporary.write_bytes(sidecar.read_bytes())
    document = palette4d.Document.load(folder / "b.p4d.json")
    assert repr(document) == repr(palette4d.Document.load(sidecar))


def test_line_ends_of_windows_are_read_and_not_written(sidecar: Path) -> None:
    sidecar.write_bytes(sidecar.read_bytes().replace(b"\n", b"\r\n"))
    document = palette4d.Document.load(sidecar)
    document.reset()
    document.save()
    assert b"\r" not in sidecar.read_bytes()


@pytest.mark.parametrize("utf8", ["0", "1"])
def test_no_code_page_is_asked(tmp_path: Path, utf8: str) -> None:
    """What goes to files and pipes is UTF-8, whatever Windows' code page is."""
    done = subprocess.run(
        [sys.executable, "-m", "palette4d", "info", "Grüße 色.p4d.json"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONUTF8": utf8},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 1
    assert "Grüße 色.p4d.json" in done.stderr.decode("utf-8")


def test_a_process_is_asked_and_not_ended() -> None:
    """Windows ends a process that gets any signal of os.kill."""
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        assert not windows.has_ended(process.pid)
        time.sleep(0.2)
        assert process.poll() is None
        process.communicate(b"\n")
        assert process.returncode == 0
