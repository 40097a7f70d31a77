"""Many tasks on this machine, in separate processes."""

import contextlib
import os
import signal
import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from palette4d.common import sandbox
from palette4d.common.child import Child, ChildError, done
from palette4d.common.errors import Palette4dError, in_words

Key = TypeVar("Key")
Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Failed:
    """The reason why a task failed, in words for the user."""

    text: str


@dataclass(frozen=True)
class _Fault:
    """An error of the program itself."""

    error: Exception


def run(
    work: Callable[[Task, int], Result],
    tasks: Mapping[Key, Task],
    take: Callable[[Key, Result | Failed], None],
    jobs: int = 0,
    *,
    patient: bool = True,
    reads: Iterable[Path] | None = None,
) -> None:
    """Run the tasks, several at a time; call `take` with each result as soon as it is done.

    Parameters
    ----------
    work : (task, threads to use) -> result; a module's function, so that it can be pickled.
    tasks : the tasks, by any key.
    take : called in this process with a key and the result, or `Failed` for a `Palette4dError`, an
        `OSError`, or a process that was killed.
    jobs : processes; 0: one per processor; 1: run all tasks in this process, unless it is a command
        whose clips are decoded by confined processes.
    reads : what the processes may read, if they can be confined (`Child`).
    patient : after Ctrl-C, finish and report the running tasks; otherwise they are dropped.

    Raises
    ------
    KeyboardInterrupt
        Ctrl-C.
    """

    def told(key: Key, found: Result | Failed) -> None:
        with later_interrupts():
            take(key, found)

    processors = os.cpu_count() or 1
    jobs = min(jobs or processors, max(1, len(tasks)))
    threads = max(1, processors // jobs)
    if jobs == 1 and (reads is None or not sandbox.of_command()):
        for key, task in tasks.items():
            told(key, outcome(work, task, threads))
        return
    # Not `concurrent.futures`: its pool waits for ever if a process ends while another starts
    # (Python 3.11 to 3.13), and its processes outlive a parent that was killed.
    order = {key: i for i, key in enumerate(tasks)}
    busy: dict[Child, Key] = {}

    def finish(child: Child, failed: Callable[[Key], object]) -> None:
        key = busy.pop(child)
        try:
            found = child.finish()
        except ChildError:
            failed(key)
            return
        if isinstance(found, _Fault):
            raise found.error
        told(key, found)

    def run_all(keys: Iterable[Key], idle: list[Child], failed: Callable[[Key], object]) -> None:
        left = deque(keys)
        try:
            while left or busy:
                while left and idle:
                    child, key = idle.pop(), left.popleft()
                    child.begin(_attempt, work, tasks[key], threads)
                    busy[child] = key
                for child in sorted(done(busy), key=lambda child: order[busy[child]]):
                    finish(child, failed)
                    idle.append(child)
        except KeyboardInterrupt:
            for child in list(busy) if patient else ():
                finish(child, lambda key: None)
            raise

    with contextlib.ExitStack() as stack:
        children = [stack.enter_context(Child(reads=reads)) for _ in range(jobs)]
        crashed: list[Key] = []
        run_all(tasks, children, crashed.append)
        # Once more, alone: beside others there may have been too little memory.
        run_all(crashed, children[:1], lambda key: told(key, Failed(_CRASHED)))


_CRASHED = (
    "its process crashed or was ended from outside (too little memory?); run the same command again"
)


def _attempt(
    work: Callable[[Task, int], Result], task: Task, threads: int
) -> Result | Failed | _Fault:
    try:
        return outcome(work, task, threads)
    except Exception as error:
        error.add_note(traceback.format_exc())
        return _Fault(error)


def outcome(call: Callable[..., Result], *arguments: object) -> Result | Failed:
    """Return a call's result, or `Failed` with the reason."""
    try:
        return call(*arguments)
    except (Palette4dError, OSError) as error:
        return Failed(in_words(error))


@contextlib.contextmanager
def later_interrupts() -> Iterator[None]:
    """Delay Ctrl-C to the body's end, so that a file is written and recorded completely."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: held.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if held and callable(before):
            before(held[0], None)
