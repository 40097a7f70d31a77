"""Many tasks on this machine, in separate processes."""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any, TypeVar

from palette4d.common.errors import Palette4dError, in_words

Key = TypeVar("Key")
Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Failed:
    """The reason why a task failed, in words for the user."""

    text: str


def run(
    work: Callable[[Task, int], Result],
    tasks: Mapping[Key, Task],
    take: Callable[[Key, Result | Failed], None],
    jobs: int = 0,
    *,
    patient: bool = True,
) -> None:
    """Run the tasks, several at a time; call `take` with each result as soon as it is done.

    Parameters
    ----------
    work : (task, threads to use) -> result; a module's function, so that it can be pickled.
    tasks : the tasks, by any key.
    take : called in this process with a key and the result, or `Failed` for a `Palette4dError`, an
        `OSError`, or a process that was killed.
    jobs : processes; 0: one per processor; 1: run all tasks in this process.
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
    if jobs == 1:
        for key, task in tasks.items():
            told(key, outcome(work, task, threads))
        return
    pool = _new_pool(jobs)
    left = deque(tasks)
    # The tasks that ran when a process crashed. Each is run again alone, so that only the task
    # that crashes its process fails.
    suspects: set[Key] = set()
    order = {key: i for i, key in enumerate(tasks)}
    running: dict[Future[Result], Key] = {}
    others = set(multiprocessing.active_children())
    try:
        while True:
            # Submit only as many tasks as can run: Ctrl-C waits for these. It reaches all
            # processes, but the workers inherit the block and finish their task.
            with without_interrupts():
                while left and len(running) < (1 if suspects else jobs):
                    key = left.popleft()
                    running[_submitted(pool, work, tasks[key], threads)] = key
            if not running:
                break
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            broken = any(_is_broken(future) for future in done)
            if broken:  # all other futures break, too
                done, _ = wait(running)
            for future in sorted(done, key=lambda f: order[running[f]], reverse=broken):
                key = running.pop(future)
                if _is_broken(future) and key not in suspects:
                    suspects.add(key)
                    left.appendleft(key)
                else:
                    suspects.discard(key)
                    told(key, outcome(future.result))
            if broken:
                pool.shutdown()
                pool = _new_pool(jobs)
    except KeyboardInterrupt:
        if not patient:
            for process in set(multiprocessing.active_children()) - others:
                process.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        # After Ctrl-C: the tasks that have finished meanwhile.
        for future, key in running.items():
            if not future.cancelled() and (patient or not future.exception()):
                told(key, outcome(future.result))


def _new_pool(jobs: int) -> ProcessPoolExecutor:
    # Spawned, not forked: the libraries run threads, which a fork would break.
    return ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("spawn"))


def _is_broken(future: Future[Any]) -> bool:
    return isinstance(future.exception(), BrokenProcessPool)


def _submitted(
    pool: ProcessPoolExecutor, work: Callable[[Task, int], Result], task: Task, threads: int
) -> Future[Result]:
    try:
        return pool.submit(work, task, threads)
    except BrokenProcessPool as error:
        broken: Future[Result] = Future()
        broken.set_exception(error)
        return broken


def outcome(call: Callable[..., Result], *arguments: object) -> Result | Failed:
    """Return a call's result, or `Failed` with the reason."""
    try:
        return call(*arguments)
    except (Palette4dError, OSError) as error:
        return Failed(in_words(error))
    except BrokenProcessPool:
        return Failed(
            "its process crashed or was ended from outside (too little memory?); run the same "
            "command again"
        )


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


@contextlib.contextmanager
def without_interrupts() -> Iterator[None]:
    """Block Ctrl-C for this thread and for processes that start meanwhile."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
