"""A real Dask farm on loopback for the tests: a scheduler and workers in processes of their own."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

PATIENCE = 120.0


def wait_for(what: Callable[[], object], why: str) -> None:
    """Wait until something holds."""
    deadline = time.monotonic() + PATIENCE
    while not what():
        assert time.monotonic() < deadline, f"waited {PATIENCE:g} s for {why}"
        time.sleep(0.05)


def running(pid: int) -> bool:
    """Whether a process runs; one that ended may stay in the list until somebody asks for it."""
    if sys.platform == "win32":
        from palette4d.common.windows import has_ended

        return not has_ended(pid)
    try:
        os.kill(pid, 0)
        return ") Z " not in Path(f"/proc/{pid}/stat").read_text()
    except ProcessLookupError:
        return False
    except FileNotFoundError:  # a system without /proc, or just gone
        return not Path("/proc/self").exists()


class Farm:
    """A scheduler, on a port that the system chose, and its workers."""

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        self.folder, self.environment = folder, environment
        self.file = folder / "scheduler.json"
        self.scheduler = self._start("dask_scheduler", "--port", "0", "--dashboard-address", ":0")
        wait_for(self._there, "the scheduler")
        self.address: str = json.loads(self.file.read_text())["address"]
        self.workers: dict[str, subprocess.Popen[bytes]] = {}

    def _there(self) -> bool:
        assert self.scheduler.poll() is None, (self.folder / "dask_scheduler.log").read_text()
        with contextlib.suppress(OSError, ValueError):
            return bool(json.loads(self.file.read_text())["address"])
        return False

    def _start(self, program: str, *words: str, **more: str) -> subprocess.Popen[bytes]:
        log = self.folder / f"{program}.log"
        command = [sys.executable, "-m", f"distributed.cli.{program}", *words]
        with log.open("ab") as out:
            return subprocess.Popen(
                [*command, "--scheduler-file", str(self.file), "--host", "127.0.0.1"],
                stdout=out,
                stderr=out,
                stdin=subprocess.DEVNULL,
                cwd=self.folder,
                env={
                    **os.environ,
                    "DASK_TEMPORARY_DIRECTORY": str(self.folder),
                    **self.environment,
                    **more,
                },
            )

    def add_worker(self, name: str, threads: int = 1, **more: str) -> None:
        """Start a worker, without anybody who would start it again; with more of an environment."""
        words = ["--no-nanny", "--no-dashboard", "--nthreads", str(threads), "--name", name]
        self.workers[name] = self._start("dask_worker", *words, **more)

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """End a process as the system does when memory runs out."""
        process.kill()
        process.wait(timeout=PATIENCE)

    def close(self) -> None:
        """End all that still run."""
        running = [*self.workers.values(), self.scheduler]
        for process in running:
            if process.poll() is None:
                process.kill()
        for process in running:
            process.wait(timeout=PATIENCE)


@contextlib.contextmanager
def farm(folder: Path, workers: int, **environment: str) -> Iterator[Farm]:
    """Start a farm, with more of an environment; nothing of it outlives the block."""
    folder.mkdir()
    made = Farm(folder, environment)
    try:
        for i in range(workers):
            made.add_worker(f"w{i}")
        yield made
    finally:
        made.close()
