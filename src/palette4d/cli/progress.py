"""The progress of commands: bars on a terminal, events for a program that waits."""

from __future__ import annotations

import contextlib
import io
import time
from collections.abc import Callable, Iterator
from typing import Any

from palette4d.cli import job
from palette4d.cli.terminal import unfiltered_stderr
from palette4d.common.text import printable

#: Least seconds between two events of a stage: some have thousands of short steps.
BETWEEN = 0.1


def progress_bar(what: str, *, total: int | None, unit: str, hidden: bool) -> Any:
    """Return a tqdm bar on standard error, if that is a terminal and it is not hidden.

    For a program that waits, it writes events in the place of the bar.
    """
    from tqdm import tqdm

    tqdm.monitor_interval = 0  # no thread that draws: a process with threads cannot be forked
    if job.stream is None:
        file = unfiltered_stderr()
        return tqdm(total=total, desc=what, unit=unit, disable=hidden or None, file=file)

    bar = tqdm(total=total, desc=what, file=io.StringIO())
    told = 0.0

    def tell(msg: str | None = None, pos: int | None = None) -> None:
        nonlocal told
        now = time.monotonic()
        if msg != "" and (bar.n == bar.total or now - told > BETWEEN):
            told = now
            stage = job.shown(bar.desc.rstrip(": ").replace("_", " "))
            job.event(stage=stage, done=bar.n, total=bar.total)

    bar.display = tell
    tell()
    return bar


@contextlib.contextmanager
def frames_bar(
    what: str, *, hidden: bool, total: int | None = None
) -> Iterator[Callable[..., None]]:
    """Show a tqdm bar on standard error, if that is a terminal; after an error it disappears.

    Yields a function to call with (frames done, frames in all) and, optionally, a text instead of
    `what`.
    """
    with progress_bar(what, total=total, unit="frame", hidden=hidden) as bar:

        def progress(done: int, total: int, words: str = what) -> None:
            if bar.total != total:
                # Frames that were done before cost no time: the bar starts after them.
                bar.total, bar.initial, bar.n = total, done, done
            bar.set_description(printable(words), refresh=False)
            bar.update(done - bar.n)
            bar.refresh()

        try:
            yield progress
        except Exception:
            bar.leave = False  # only the error message remains
            raise
