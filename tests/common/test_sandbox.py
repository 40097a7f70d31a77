"""A process that decodes a stranger's file reads and writes what its verb needs, and no more."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import hostile_reader
import PyOpenColorIO as ocio
import pytest
from confining import confines, forks
from edits import sequence
from farm_processes import wait_for

from palette4d.common import folders, sandbox, writer
from palette4d.common.errors import Palette4dError
from palette4d.media.clip_files import files_of_sidecar

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"

VERBS = {
    "analyze": "analyze clip/ -o out.p4d.json --quiet",
    "detect": "analyze clip/ --detect-shots -o shots --quiet",
    "edit": "analyze edit.edl --media clip -o shots --quiet --jobs 1",
    "render": "render own.p4d.json clip/ -o out.####.exr --quiet",
    "movie": "render own.p4d.json clip/ -o out.mov --quiet",
    "plot": "plot own.p4d.json -o out.png --frames 0",
    "bake": "bake own.p4d.json --frame 0 -o out.cube",
    "export": "export own.p4d.json --frames 0 -o luts --jobs 1",
    "config": "config own.p4d.json --frames 0 -o config --anyway --jobs 1",
    "pick": "edit own.p4d.json pick --clip clip/ --frame 0 --pixel 3,3 --to 0.1,0.2,0.9",
    "window": "edit own.p4d.json window p1 --clip clip/ --frame 0 --box 2,2,30,20",
}
EDL = """TITLE: edit
FCM: NON-DROP FRAME

001  frame  V     C        00:00:00:00 00:00:00:04 01:00:00:00 01:00:00:04
* FROM CLIP NAME: frame.####.png
"""

EDITED = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_edited.p4d.json"


@pytest.fixture
def memory(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A page of memory that programs of one user share by its number."""
    libc = ctypes.CDLL(None)
    number = libc.shmget(0, 4096, 0o600)
    monkeypatch.setenv("MEMORY", str(number))
    yield
    libc.shmctl(number, 0, None)


@pytest.fixture
def home(tmp_path: Path, memory: None) -> Path:
    """A home folder with what strangers want, and a clip and its sidecar right in it."""
    home = tmp_path / "home"
    (home / ".ssh").mkdir(parents=True)
    (home / ".ssh" / "id_rsa").write_text("a key")
    (home / ".bashrc").write_text("alias ls='ls --color'\n")
    (home / "clip").mkdir()
    sequence(home / "clip", "frame", 0, 6)
    (home / "edit.edl").write_text(EDL)
    hook = tmp_path / "hook"
    hook.mkdir()
    shutil.copyfile(hostile_reader.__file__, hook / "sitecustomize.py")
    return home


def command(home: Path, *words: str, hostile: bool = True) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"HOME": str(home), "HOSTILE_PARENT": str(os.getpid())}
    if hostile:
        environment["PYTHONPATH"] = str(home.parent / "hook")
    return subprocess.run(
        [sys.executable, "-P", "-m", "palette4d", *words],
        cwd=home,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def told(done: subprocess.CompletedProcess[str]) -> list[list[str]]:
    """What succeeded, at each clip that was opened."""
    lines = [line for line in done.stderr.splitlines() if line.startswith('{"hostile"')]
    return [json.loads(line)["hostile"] for line in lines]


@confines
def test_without_a_sandbox_a_reader_may_do_all_of_it(home: Path) -> None:
    """Else the other tests could not fail."""
    shutil.copyfile(GOLDEN / "v2_picks.p4d.json", home / "own.p4d.json")
    done = command(home, *VERBS["render"].split(), "--sandbox", "off")
    found = told(done)
    assert done.returncode == 0, done.stderr
    missed = set(hostile_reader.attempts(home, os.getpid())) - set(found[0])
    # What this machine refuses to everybody.
    assert missed <= {
        *("namespace", "io_uring", "change attributes", "watch all files", "change a file's flags")
    }


@confines
@pytest.mark.parametrize("verb", VERBS)
def test_a_reader_that_is_taken_over_can_do_nothing(home: Path, verb: str) -> None:
    """And the verb itself works as ever, right in the home folder."""
    before = sorted(path.name for path in home.iterdir())
    own = home / "own.p4d.json"
    shutil.copyfile(GOLDEN / "v2_picks.p4d.json", own)
    own.chmod(0o640)
    words = VERBS[verb].split()
    done = command(home, words[0], "--sandbox", "on", *words[1:])
    assert done.returncode == 0, done.stderr
    found = told(done)
    assert found
    allowed = {"start a process"} if verb == "detect" else set()
    assert all(set(each) <= allowed for each in found), found
    fonts = {".cache", ".config"}  # matplotlib's, made before the clip is opened
    made = {path.name for path in home.iterdir()} - {*before, own.name, *fonts}
    assert made or verb in ("pick", "window")
    assert not [name for name in made if name.startswith((".", "evil"))]
    assert stat.S_IMODE(own.stat().st_mode) == 0o640
    assert (home / ".bashrc").stat().st_size > 1


@confines
def test_links_of_a_clip_lead_to_clips_alone(home: Path) -> None:
    """An archive of a stranger may hold links to a key, or to the folder of all."""
    store = home / "store"
    store.mkdir()
    frame = (home / "clip" / "frame.0005.png").rename(store / "frame.png")
    (home / "clip" / "frame.0005.png").symlink_to(frame)
    for name, target in (("key.png", ".ssh/id_rsa"), ("all.png", "."), ("up.p4d.json", ".")):
        (home / "clip" / name).symlink_to(home / target)
    shutil.copyfile(GOLDEN / "v2_picks.p4d.json", home / "clip" / "own.p4d.json")
    files = ["clip/own.p4d.json", "clip/frame.####.png"]
    done = command(home, "render", *files, "-o", "o.####.exr")
    assert done.returncode == 0, done.stderr
    assert told(done) == [[]]
    assert len(list(home.glob("o.*.exr"))) == 6


@confines
@pytest.mark.parametrize("source", ["/dev/x.####.png", "notes/x.mov", "notes", "gone/x.png"])
def test_a_folder_that_a_sidecar_names_is_opened_for_the_clip_in_it_alone(
    home: Path, source: str
) -> None:
    (home / "grades" / "notes").mkdir(parents=True)
    (home / "grades" / "notes" / "diary.txt").touch()
    own = home / "grades" / "own.p4d.json"
    text = json.loads((GOLDEN / "v2_picks.p4d.json").read_text())
    text["clip"]["source"] = source
    own.write_text(json.dumps(text))
    assert set(files_of_sidecar(own)) == {own, own.parent}
    shutil.copy(home / "clip" / "frame.0001.png", own.parent / "notes" / "x.0001.png")
    opened = {own, own.parent, *([own.parent / "notes"] if "notes" in source else [])}
    assert set(files_of_sidecar(own)) == opened


@confines
def test_no_other_process_is_signalled_or_slowed() -> None:
    """The filter of calls alone keeps these from others, signals before Linux 6.12."""
    program = (
        "import os, resource, signal\n"
        "from palette4d.common import sandbox\n"
        "sandbox._libc().prctl(38, 1, 0, 0, 0)\n"
        "sandbox._filter_calls(False)\n"
        "signal.signal(signal.SIGUSR1, lambda *_: print('own'))\n"
        "signal.raise_signal(signal.SIGUSR1)\n"
        "resource.setrlimit(resource.RLIMIT_CORE, (0, 0))\n"
        "other = os.getppid()\n"
        "for ask in (\n"
        "    lambda: os.kill(other, 0),\n"
        "    lambda: resource.prlimit(other, 4),\n"
        "    lambda: os.setpriority(os.PRIO_PROCESS, other, 10),\n"
        "    lambda: os.setpriority(os.PRIO_USER, os.getuid(), 10),\n"
        "    lambda: os.sched_setscheduler(other, os.SCHED_IDLE, os.sched_param(0)),\n"
        "    lambda: os.sched_setaffinity(other, [0]),\n"
        "):\n"
        "    try:\n"
        "        print(ask())\n"
        "    except PermissionError:\n"
        "        print('refused')\n"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["own", *["refused"] * 6]


@confines
def test_no_open_file_has_signals_sent_or_others_changed(tmp_path: Path) -> None:
    """An open file can send a signal to its owner, hold up who opens it, or change its version."""
    own = tmp_path / "own"
    own.write_text("mine")
    program = (
        "import fcntl, os, socket, sys\n"
        "from palette4d.common import sandbox\n"
        "sandbox._libc().prctl(38, 1, 0, 0, 0)\n"
        "sandbox._filter_calls(False)\n"
        "fine, _ = socket.socketpair()\n"
        "fine.setblocking(False)\n"
        "os.set_inheritable(fine.fileno(), True)\n"
        "fcntl.fcntl(fine, fcntl.F_SETFL, fcntl.fcntl(fine, fcntl.F_GETFL))\n"
        "own = os.open(sys.argv[1], os.O_RDONLY)\n"
        "owner, version = 0x8901, 0x40087602\n"
        "for ask in (\n"
        "    lambda: fcntl.fcntl(fine, fcntl.F_SETOWN, os.getppid()),\n"
        "    lambda: fcntl.fcntl(fine, 10, 9),\n"
        "    lambda: fcntl.fcntl(fine, 15, bytes(8)),\n"
        "    lambda: fcntl.fcntl(own, fcntl.F_SETLEASE, fcntl.F_RDLCK),\n"
        "    lambda: fcntl.fcntl(os.open('/', os.O_RDONLY), fcntl.F_NOTIFY, 1),\n"
        "    lambda: fcntl.ioctl(fine, owner, bytes(4)),\n"
        "    lambda: fcntl.ioctl(own, version, bytes(8)),\n"
        "):\n"
        "    try:\n"
        "        print(ask())\n"
        "    except PermissionError:\n"
        "        print('refused')\n"
    )
    words = [sys.executable, "-P", "-c", program, str(own)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["refused"] * 7


@confines
@pytest.mark.parametrize("name", ["grade", ".hidden", "grade.of.a.shot"])
def test_the_file_that_was_named_is_written_whatever_its_name(home: Path, name: str) -> None:
    words = f"analyze clip/ -o {name} --quiet --sandbox on".split()
    done = [command(home, *words, hostile=False) for _ in range(2)]
    assert [one.returncode for one in done] == [0, 0], done[0].stderr
    assert json.loads((home / name).read_text())["schema"] == "palette4d.sidecar"
    assert command(home, "info", name, hostile=False).returncode == 0


@confines
def test_a_fork_has_no_file_of_its_parent_or_of_another_child(tmp_path: Path) -> None:
    """A pipe to another child would let it answer for that."""
    (tmp_path / "held").touch()
    program = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parents[1])!r})\n"
        "import child_calls, json, os\n"
        "from palette4d.common import sandbox\n"
        "from palette4d.common.child import Child\n"
        "sandbox.is_command, held = True, open('held')\n"
        "with Child(reads=[]) as one, Child(reads=[]) as other:\n"
        "    found = [child.call(child_calls.handles) for child in (one, other, one)]\n"
        "    parents = [child._process._popen.__class__.__module__ for child in (one, other)]\n"
        "print(json.dumps([found, parents]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", program],
        cwd=tmp_path,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    (one, other, again), kinds = json.loads(done.stdout)
    assert kinds == ["multiprocessing.popen_fork"] * 2
    assert sorted(one) == sorted(again)
    assert not set(one) & set(other)
    assert not [name for name in (*one, *other) if name.endswith("/held")]


def test_where_the_kernel_cannot_on_is_an_error_and_auto_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sandbox, "missing", lambda: "the kernel has no Landlock")
    assert not sandbox.wanted()
    monkeypatch.setattr(sandbox, "mode", "on")
    with pytest.raises(Palette4dError, match="no Landlock"):
        sandbox.wanted()


def script(tmp_path: Path, *lines: str, replaces: str = "the file itself") -> subprocess.Popen[str]:
    """A program that has a writer for `out.mov` in the folder `out`."""
    text = [
        *("import os, sys, time", "from pathlib import Path", f"os.chdir({str(tmp_path)!r})"),
        *("from palette4d.common import files, writer", "Path('out').mkdir(exist_ok=True)"),
        "from palette4d.common.errors import Palette4dError",
        f"promise = writer.Promise.of_file(Path('out/out.mov'), {replaces!r})",
        "with writer.writer_for(promise) as own:",
        *(f"    {line}" for line in lines),
    ]
    return subprocess.Popen(
        [sys.executable, "-P", "-c", "\n".join(text)], text=True, stdout=subprocess.PIPE
    )


@confines
@pytest.mark.parametrize("how", ["option", "variable"])
def test_a_config_elsewhere_is_read_for_a_bake(home: Path, tmp_path: Path, how: str) -> None:
    config = tmp_path / "configs" / "studio.ocio"
    config.parent.mkdir()
    built_in = ocio.Config.CreateFromBuiltinConfig("cg-config-v1.0.0_aces-v1.3_ocio-v2.1")
    config.write_text(built_in.serialize())
    show = tmp_path / "show"
    show.mkdir()
    shutil.copy(EDITED, show / "a.p4d.json")
    words = [show / "a.p4d.json", "--frame", "4", "-o", show / "a.cube", "--space", "ACEScg"]
    words += ["--ocio-config", config] if how == "option" else []
    environment = {**os.environ, "OCIO": str(config)} if how == "variable" else None
    command = [sys.executable, "-m", "palette4d", "bake", *map(str, words)]
    subprocess.run(command, check=True, env=environment)
    assert (show / "a.cube").exists()


@confines
def test_a_link_that_the_sandbox_does_not_follow_is_told(tmp_path: Path) -> None:
    """As stores of assets have them: files that are named by their content."""
    sequence(tmp_path / "store", "f", 1, 3)
    (tmp_path / "clip").mkdir()
    for path in (tmp_path / "store").iterdir():
        (tmp_path / "clip" / path.name).symlink_to(path.rename(path.with_suffix("")))
    (tmp_path / "out").mkdir()
    out = str(tmp_path / "out" / "a.p4d.json")
    analyze = ["analyze", str(tmp_path / "clip"), "-o", out, "--quiet"]
    command = [sys.executable, "-m", "palette4d", *analyze]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 1
    assert "the sandbox opens files of such names alone" in done.stderr
    assert subprocess.run([*command, "--sandbox", "off"]).returncode == 0


def test_a_user_without_a_home_folder_needs_none(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unknown() -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", unknown)
    assert not sandbox.holds_home(home / "clip")
    with pytest.raises(Palette4dError, match="set HOME"):
        folders.home()


@forks
def test_the_home_of_another_user_is_not_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the superuser decodes a clip of theirs."""
    import pwd

    monkeypatch.setattr(sandbox.Path, "home", lambda: tmp_path / "root")
    theirs = tmp_path / "bob"
    theirs.mkdir()
    (theirs / "a.png").touch()
    assert list(sandbox.parts(theirs, {"png"})) == [theirs]
    bob = pwd.struct_passwd(("bob", "x", 1001, 1001, "", str(theirs), ""))
    monkeypatch.setattr(pwd, "getpwall", lambda: [bob])
    assert list(sandbox.parts(theirs, {"png"})) == [Path(os.path.realpath(theirs / "a.png"))]
    assert list(sandbox.parts(tmp_path, {"png"})) == []


def test_a_promise_of_folders_has_no_hidden_ones(tmp_path: Path) -> None:
    (tmp_path / ".vscode").mkdir()
    (tmp_path / "below").mkdir()
    below = writer.Promise(tmp_path, ".p4d.json", below=True)
    assert below.holds(tmp_path / "below" / "a.p4d.json")
    assert below.holds(tmp_path / "a.p4d.json")
    shots = writer.Promise(tmp_path, (".p4d.json", ".shots.json"))
    assert shots.holds(tmp_path / "a.shots.json")
    for promise in (below, shots):
        for name in (".vscode/a.p4d.json", "tasks.json", ".a.p4d.json", "../a.p4d.json"):
            assert not promise.holds(tmp_path / name)
    assert not shots.holds(tmp_path / "below" / "a.p4d.json")


@forks
def test_the_writer_refuses_what_the_command_was_not_begun_for(tmp_path: Path) -> None:
    (tmp_path / "link.mov").symlink_to(tmp_path / "secret")
    (tmp_path / "secret").write_text("secret")
    tries = ["out/.hidden.mov", "out/a.sh", "a.mov", "out/below/a.mov", "out/../a.mov", "../a.mov"]
    with script(
        tmp_path,
        "(own.folder / 'x').write_text('evil')",
        "(own.folder / 'link').symlink_to('/etc/passwd')",
        f"asked = [['place', 'x', str(Path(p).absolute()), True] for p in {tries}]",
        "asked += [['place', 'link', str(Path('out/out.mov').absolute()), True]]",
        "asked += [['place', '../../secret', str(Path('out/out.mov').absolute()), True]]",
        "asked += [['make_folder', str(Path('out/other').absolute())], ['lock', '/tmp/a.sh']]",
        "asked += [['held'], ['remove', 'secret'], ['place', 'x']]",
        "for one in asked:",
        "    try:",
        "        own.ask(*one)",
        "    except Exception:",
        "        continue",
        "    print(one)",
        "with files.replacing(Path('out/out.mov')) as path:",
        "    path.write_text('a movie')",
    ) as done:
        assert done.communicate(timeout=60)[0] == ""
    assert done.returncode == 0
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["out.mov"]
    assert (tmp_path / "out" / "out.mov").read_text() == "a movie"
    assert (tmp_path / "secret").read_text() == "secret"


@forks
def test_a_writer_that_is_killed_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    with script(
        tmp_path,
        "import signal",
        "(own.folder / 'x').write_text('new')",
        "os.kill(int(Path('/proc/self/task', str(os.getpid()), 'children').read_text()), 9)",
        "try:",
        "    own.ask('place', 'x', str(Path('out/out.mov').absolute()), True)",
        "except Palette4dError as error:",
        "    print(error, flush=True)",
        "    os._exit(0)",
    ) as done:
        assert "the process that writes files was ended" in done.communicate(timeout=60)[0]


@forks
@pytest.mark.parametrize(
    ("replaces", "placed"),
    [
        ("none", ["new"]),
        ("the file itself", ["out", "new"]),
        ("all", ["out", "other", "new"]),
    ],
)
def test_the_writer_replaces_what_the_command_may(
    tmp_path: Path, replaces: str, placed: list[str]
) -> None:
    (tmp_path / "out").mkdir()
    for name in ("out", "other"):
        (tmp_path / "out" / f"{name}.mov").write_text("the user's")
    with script(
        tmp_path,
        "for name in ('out', 'other', 'new'):",
        "    (own.folder / 'x').write_text('evil')",
        "    try:",
        "        own.ask('place', 'x', str(Path(f'out/{name}.mov').absolute()), True)",
        "        print(name)",
        "    except Palette4dError:",
        "        pass",
        replaces=replaces,
    ) as done:
        assert done.communicate(timeout=60)[0].split() == placed


@forks
@pytest.mark.parametrize("there", [False, True])
def test_an_output_has_no_rights_of_its_makers_choice(tmp_path: Path, there: bool) -> None:
    """A setuid program of the user's, in a shared folder, is run by others."""
    (tmp_path / "out").mkdir()
    if there:
        (tmp_path / "out" / "out.mov").touch(0o640)
    with script(
        tmp_path,
        "os.umask(0o022)",
        "try:",
        "    with files.replacing(Path('out/out.mov'), force=True) as path:",
        "        os.umask(0)",
        "        os.close(os.open(path, os.O_CREAT | os.O_WRONLY, 0o6777))",
        "finally:",
        "    os.umask(0o022)",
    ) as done:
        assert done.wait(timeout=60) == 0
    assert stat.S_IMODE((tmp_path / "out" / "out.mov").stat().st_mode) == (
        0o640 if there else 0o644
    )


@forks
def test_an_output_that_is_being_placed_is_no_leftover(tmp_path: Path) -> None:
    """Other processes that write in the folder remove what killed ones left."""
    sweep = [
        "from pathlib import Path",
        "from palette4d.common import files",
        "print('begun', flush=True)",
        "while True:",
        "    files._swept.clear()",
        f"    files._remove_leftovers(Path({str(tmp_path / 'out')!r}))",
    ]
    (tmp_path / "out").mkdir()
    with subprocess.Popen(
        [sys.executable, "-P", "-c", "\n".join(sweep)], text=True, stdout=subprocess.PIPE
    ) as sweeper:
        try:
            assert sweeper.stdout
            assert sweeper.stdout.readline() == "begun\n"
            with script(
                tmp_path,
                "for i in range(100):",
                "    with files.replacing(Path('out/out.mov'), force=True) as path:",
                "        path.write_bytes(bytes([i]) * 1_000_000)",
            ) as done:
                assert done.wait(timeout=60) == 0
            assert sweeper.poll() is None
        finally:
            sweeper.kill()
    assert (tmp_path / "out" / "out.mov").read_bytes() == bytes([99]) * 1_000_000


@forks
def test_an_output_is_in_use_between_its_move_and_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At that moment another process writes beside it, and sweeps."""
    taken, path = tmp_path / "taken", tmp_path / "out.mov"
    taken.write_bytes(b"new")
    other = (
        "from pathlib import Path; from palette4d.common.files import replacing\n"
        f"with replacing(Path({str(tmp_path / 'other.mov')!r})) as own: own.touch()"
    )

    def move(source: Path, target: Path) -> None:
        source.replace(target)
        subprocess.run([sys.executable, "-P", "-c", other], check=True)

    monkeypatch.setattr(writer.shutil, "move", move)
    writer._place(taken, path, False, writer.Promise.of_file(path))
    assert path.read_bytes() == b"new"
    assert (tmp_path / "other.mov").exists()


@forks
def test_a_command_that_is_killed_leaves_nothing(tmp_path: Path) -> None:
    """Its writer ends with it, gives the lock back, and removes the temporary folder."""
    with script(
        tmp_path,
        "with own.locked(Path('out/a.mov')), files.replacing(Path('out/out.mov')) as path:",
        "    path.write_text('a part')",
        "    print('there', flush=True)",
        "    time.sleep(60)",
    ) as running:
        assert running.stdout
        assert running.stdout.readline() == "there\n"
        assert len(list((tmp_path / "out").iterdir())) == 2
        running.kill()
    wait_for(lambda: not list((tmp_path / "out").iterdir()), "an empty folder")
