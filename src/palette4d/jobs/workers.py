"""The workers for many tasks: processes on this machine, or a farm."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from palette4d.jobs import dask_farm, pool
from palette4d.jobs.pool import Failed, Key, Result, Task

__all__ = ["Failed", "Workers"]


@dataclass(frozen=True)
class Workers:
    """Processes on this machine (`jobs`; 0: one per processor), or a Dask farm (`cluster`)."""

    jobs: int = 0
    cluster: str | None = None

    def run(
        self,
        work: Callable[[Task, int], Result],
        tasks: Mapping[Key, Task],
        take: Callable[[Key, Result | Failed], None],
        *,
        patient: bool = True,
        reads: Iterable[Path] | None = None,
    ) -> None:
        """Run the tasks and call `take` with each result (`pool.run`, `dask_farm.run`)."""
        if self.cluster is not None:
            dask_farm.run(self.cluster, work, tasks, take)
        else:
            pool.run(work, tasks, take, self.jobs, patient=patient, reads=reads)
