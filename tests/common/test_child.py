"""A child process with limits: whatever happens in it, the parent says so and goes on."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from child_calls import crash, fault, grow, hang, refuse, speak_to_the_tracker, take_over, well
from confining import confines
from farm_processes import running, wait_for
from wine import unlimited

from palette4d.common.child import Child, ChildError
from palette4d.common.errors import Palette4dError, SidecarError


@pytest.fixture(scope="module")
def child() -> Iterator[Child]:
    with Child(20, 2048) as one:
        yield one


def test_a_script_is_not_run_again(tmp_path: Path) -> None:
    """A child that starts by `spawn` would run a script that has no guard once more."""
    script = tmp_path / "script.py"
    script.write_text(
        "from palette4d.common.child import Child\n"
        "import os\n"
        "print('once')\n"
        "with Child() as child:\n"
        "    print(child.call(os.path.basename, 'a/b'))\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout) == (0, "once\nb\n"), done.stderr


def test_the_working_folder_is_no_place_of_modules(tmp_path: Path) -> None:
    script, folder = tmp_path / "script.py", tmp_path / "project"
    folder.mkdir()
    script.write_text(
        "from palette4d.common.child import Child\n"
        "import os\n"
        "with Child() as child:\n"
        "    print(child.call(os.path.basename, 'a/b'))\n"
    )
    for name in ("multiprocessing", "argparse"):
        (folder / f"{name}.py").write_text("open('ran', 'w')\n")
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stdout) == (0, "b\n"), done.stderr
    assert not (folder / "ran").exists()


def test_one_process_serves_many_calls(child: Child) -> None:
    first, second = child.call(well, 1, 2), child.call(well, 3, 4)
    assert (first[:2], second[:2]) == ((1, 2), (3, 4))
    assert first[2] == second[2]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (crash, "crashed .SIGABRT" if sys.platform != "win32" else "crashed .exit status"),
        pytest.param(grow, "more than 2048 MB", marks=unlimited),
    ],
)
def test_a_call_that_goes_wrong_costs_one_call(
    child: Child, call: Callable[[], object], words: str
) -> None:
    with pytest.raises(ChildError, match=words):
        child.call(call)
    assert child.call(well, 5, 6)[:2] == (5, 6)


def test_a_call_without_end_is_ended() -> None:
    with Child(0.5, 2048) as child, pytest.raises(ChildError, match=r"longer than 0\.5 seconds"):
        child.call(hang)


def test_a_call_without_end_ends_after_a_parent_that_was_killed(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        f"import sys; sys.path.insert(0, {str(Path(__file__).parents[1])!r})\n"
        "import child_calls\n"
        "from palette4d.common.child import Child\n"
        "if __name__ == '__main__':\n"
        "    child = Child(1, 2048)\n"
        "    child.begin(child_calls.well, 1, 2)\n"
        "    child.seconds = 60  # here alone, for a busy machine\n"
        "    print(child.finish()[2], flush=True)\n"
        "    child.begin(child_calls.hang)\n"
        "    print('begun', flush=True)\n"
        "    input()\n"
    )
    with subprocess.Popen(
        [sys.executable, str(program)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as parent:
        assert parent.stdout
        pid = int(parent.stdout.readline())
        assert parent.stdout.readline() == "begun\n"
        parent.kill()
    started = time.monotonic()
    wait_for(lambda: not running(pid), "the child to end")
    assert time.monotonic() - started < 30  # alone the call takes a minute


def test_errors_come_back(child: Child) -> None:
    with pytest.raises(SidecarError) as caught:
        child.call(refuse)
    assert caught.value.pointer == "/clip"
    with pytest.raises(Palette4dError, match="by zero"):
        child.call(fault)


def test_an_answer_runs_no_code_here(tmp_path: Path) -> None:
    """Else a decoder that was taken over would be out of its sandbox."""
    folder = tmp_path / "made"
    with Child(20) as child:
        child.call(take_over, str(folder))
        with pytest.raises(ChildError, match="take it over"):
            child.call(well, 1, 2)
        assert child.call(well, 5, 6)[:2] == (5, 6)
    assert not folder.exists()


@confines
def test_a_confined_child_speaks_to_its_parent_alone() -> None:
    tests = Path(__file__).parents[1]
    with Child(20) as free, Child(20, reads=[tests]) as confined:
        assert free.call(speak_to_the_tracker)
        assert not confined.call(speak_to_the_tracker)
