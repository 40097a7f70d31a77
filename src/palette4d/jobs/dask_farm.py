"""Many tasks on a Dask farm: a scheduler, and workers on any machines.

If a worker dies, other workers repeat its tasks. Only this process writes files. Scheduler and
workers need the same palette4d. The workers must see the clips and sidecars under the same paths.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import logging
import os
import queue
import re
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from palette4d import _core
from palette4d.colour.ocio_config import from_anywhere
from palette4d.common.errors import Arg, Palette4dError
from palette4d.jobs.pool import (
    Failed,
    Key,
    Result,
    Task,
    later_interrupts,
    outcome,
)

#: Seconds to wait for the scheduler's answer, and for workers where there is none.
ANSWERS_WITHIN = 15
WORKERS_WITHIN = 120

#: Seconds until a note says that there is no worker, and seconds between checks: for the first
#: worker, and while all work.
TOLD_AFTER = 3
ASKED_EVERY = 0.2
WATCHED_EVERY = 5


def check_address(text: str) -> str:
    """Return the value of --cluster if it is a scheduler's address."""
    if re.fullmatch(r"((tcp|tls|wss?)://)?[^/:\s]+:[0-9]+", text):
        return text
    raise Palette4dError(
        f"found {text!r}, expected a Dask scheduler's address such as tls://farm.example:8786"
    )


def is_open(address: str) -> bool:
    """Whether others can run code through a scheduler: without TLS, also other users of this one.

    >>> is_open("tcp://farm:8786"), is_open("tls://farm:8786"), is_open("127.0.0.1:8786")
    (True, False, True)
    """
    return address.rpartition("://")[0] not in ("tls", "wss")


def run(
    address: str,
    work: Callable[[Task, int], Result],
    tasks: Mapping[Key, Task],
    take: Callable[[Key, Result | Failed], None],
) -> None:
    """Run each task on a farm; call `take` with each result as soon as it arrives.

    Parameters
    ----------
    address : str
        A scheduler's address (`check_address`).
    work, tasks, take
        As in `pool.run`; a worker runs one task at a time, with all its threads.
    """
    if not tasks:
        return
    if is_open(check_address(address)):
        _say(
            f"palette4d: warning: {address} has no authentication: whoever reaches it can run code "
            "as you on the farm. Use tls:// with your certificates (docs/shots.md)"
        )
    with _connected(address) as client:
        _check_scheduler(client, address)
        config = from_anywhere(os.environ.get("OCIO"))
        keys = {}
        futures = []
        for key, task in tasks.items():
            name = f"palette4d-{uuid.uuid4().hex}"
            keys[name] = key
            futures.append(client.submit(_piece, work, task, config, key=name, pure=False))
        _check_workers(client, address)
        try:
            for future, found in _finished(client, futures, address):
                with later_interrupts():
                    _take(take, keys.pop(future.key), found)
                future.release()  # results may be large
            deserted = Failed(
                f"the farm has had no worker for {WORKERS_WITHIN} seconds (too little memory?); "
                "start some with `dask worker`, and run the same command again"
            )
            for key in keys.values():
                with later_interrupts():
                    take(key, deserted)
        finally:
            with contextlib.suppress(Exception):  # the scheduler may have gone
                client.cancel(futures)


def _take(take: Callable[[Key, Any], None], key: Key, found: Any) -> None:
    """Call `take` with an answer; one of another type costs its task alone."""
    try:
        take(key, found)
    except (TypeError, ValueError, AttributeError, LookupError, RecursionError) as error:
        take(key, _unusable(error))


def _unusable(error: BaseException) -> Failed:
    return Failed(
        f"a worker's answer cannot be used ({type(error).__name__}: {error}); check that workers "
        "have the same packages as this computer, and run the same command again"
    )


# One task at a time in a process: the task uses all threads of the worker.
_at_work = threading.Lock()


def _piece(work: Callable[[Task, int], Result], task: Task, config: str | None) -> Result:
    """Run one task on a worker, with the $OCIO of the machine where the command runs."""
    from distributed import get_worker

    with _at_work:
        before = os.environ.pop("OCIO", None)
        try:
            if config is not None:
                os.environ["OCIO"] = config
            return work(task, max(1, get_worker().state.nthreads))
        except (Palette4dError, OSError):
            raise
        except Exception as error:
            problem = f"{type(error).__name__}: {error}"
        finally:
            os.environ.pop("OCIO", None)
            if before is not None:
                os.environ["OCIO"] = before
    # Not the error itself: one that cannot be sent, as of a deep recursion, never arrives.
    raise Palette4dError(f"the task ended on a worker with {problem}; please report this")


def _finished(client: Any, futures: list[Any], address: str) -> Iterator[tuple[Any, Any]]:
    """Yield each future and its outcome when it is done; end early if the farm keeps no worker."""
    done: queue.SimpleQueue[Any] = queue.SimpleQueue()
    for future in futures:
        future.add_done_callback(done.put)
    told, seen = False, time.monotonic()
    left = len(futures)
    while left:
        with contextlib.suppress(queue.Empty):
            future = done.get(timeout=WATCHED_EVERY)
            try:
                found = _outcome(client, future)
            except _LostError:
                future.add_done_callback(done.put)  # until another worker does it again
            else:
                told, seen = False, time.monotonic()
                left -= 1
                yield future, found
                continue
        waited = time.monotonic() - seen
        if _has_worker(client):
            told, seen = False, time.monotonic()
        elif waited >= WORKERS_WITHIN:
            return
        elif not told:
            told = True
            _say(
                "palette4d: note: the farm has no worker any more; start one with `dask worker "
                f"{address}` (waiting for {WORKERS_WITHIN - waited:.0f} more seconds)"
            )


def _has_worker(client: Any) -> bool:
    """Whether the scheduler says that it has a worker; False where it does not answer."""
    try:
        return bool(client.sync(client.scheduler.ncores, callback_timeout=ANSWERS_WITHIN))
    except OSError:
        return False


def _version() -> str:
    """Return the version of palette4d on the machine that runs this function."""
    return _core.__version__


class _LostError(Exception):
    """The last worker ended before its result was fetched."""


def _outcome(client: Any, future: Any) -> Any:
    """Fetch a result from its worker, which may take its time as long as the farm has workers."""
    import asyncio

    from distributed import KilledWorker

    def fetched() -> Any:
        wait = WATCHED_EVERY
        while True:
            try:
                return future.result(timeout=wait)
            except TimeoutError:
                if future.status == "error":  # the task's own
                    raise
                if not _has_worker(client):
                    raise _LostError from None
                wait *= 2  # a large result is fetched from its start again

    try:
        return outcome(fetched)
    except KilledWorker:
        return Failed(
            "every worker that tried it was ended from outside (too little memory?); run the same "
            "command again, on workers with more"
        )
    except (concurrent.futures.CancelledError, asyncio.CancelledError):
        return Failed("the farm's scheduler went away; run the same command again")
    except _LostError:
        raise
    except Exception as error:  # one that `_piece` did not raise, or an answer that is no pickle
        return _unusable(error)


@contextlib.contextmanager
def _connected(address: str) -> Iterator[Any]:
    """Yield a client of the scheduler at an address."""
    try:
        import distributed
    except ImportError as error:
        raise Palette4dError(
            f"{Arg('cluster')} needs Dask, which is not installed; run: pip install "
            "'palette4d[farm]'"
        ) from error
    encrypted = address.startswith(("tls://", "wss://"))
    if encrypted and distributed.Security().get_tls_config_for_role("client")["ca_file"] is None:
        raise Palette4dError(
            f"found no certificates for {address}, expected them in Dask's configuration "
            "(distributed.comm.tls); docs/shots.md shows it"
        )
    try:
        client = distributed.Client(address, timeout=ANSWERS_WITHIN, set_as_default=False)
    except Exception as error:  # what answers may be no scheduler: any of the library's
        raise Palette4dError(
            f"no Dask scheduler answers at {address} ({error}); start one with `dask scheduler`, "
            f"workers with `dask worker`, check the address, or use {Arg('jobs')}"
        ) from error
    with _without_log(), client:
        yield client


@contextlib.contextmanager
def _without_log() -> Iterator[None]:
    """Keep Dask's log off standard error: each failure is reported with its task."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _say(text: str) -> None:
    """Print a line on standard error, above a progress bar."""
    from tqdm import tqdm

    tqdm.write(text, file=sys.stderr)


def _check_workers(client: Any, address: str) -> None:
    """Wait for the first worker that answers, and refuse workers with another palette4d."""
    started = time.monotonic()
    told = False
    while (waited := time.monotonic() - started) < WORKERS_WITHIN:
        try:
            found = client.run(_version, on_error="return")
        except OSError as error:
            raise Palette4dError(
                f"the scheduler at {address} went away ({error}); start it, and run the same "
                "command again"
            ) from error
        # The worker died or lost its connection: Dask drops it, so it needs no error here.
        there = {who: it for who, it in found.items() if not isinstance(it, OSError)}
        for worker, version in sorted(there.items()):
            _check_version(f"the worker {worker}", version)
        if there:
            return
        if not told and waited >= TOLD_AFTER:
            told = True
            _say(
                f"palette4d: note: the scheduler at {address} has no worker yet; start one with "
                f"`dask worker {address}` (waiting for {WORKERS_WITHIN - waited:.0f} more seconds)"
            )
        time.sleep(ASKED_EVERY)
    raise Palette4dError(
        f"the scheduler at {address} has had no worker for {WORKERS_WITHIN} seconds; start some "
        f"with `dask worker {address}`"
    )


def _check_scheduler(client: Any, address: str) -> None:
    """Refuse a scheduler with another palette4d: it also imports the tasks."""
    try:
        found: object = client.run_on_scheduler(_version)
    except Exception as error:  # any error of the import on the scheduler
        found = error
    _check_version(f"the scheduler at {address}", found)


def _check_version(who: str, found: object) -> None:
    if isinstance(found, Exception):
        raise Palette4dError(
            f"{who} cannot import palette4d ({found}); install palette4d {_core.__version__} where "
            "it runs"
        )
    if found != _core.__version__:
        raise Palette4dError(
            f"{who} has palette4d {found}, expected {_core.__version__} as here, so that results "
            "are the same; install that where it runs"
        )
