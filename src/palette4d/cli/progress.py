"""The progress bar of a command that works on frames."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any


@contextlib.contextmanager
def frames_bar(what: str, *, hidden: bool, total: int | None = None) -> Iterator[Any]:
    """Yield a tqdm bar on standard error; after an error, nothing is left of it.

    Parameters
    ----------
    what : str
        Stands before the bar.
    hidden : bool
        No bar at all; there is none either where standard error is no terminal.
    total : int, optional
        Frames in all, where they are known from the start.
    """
    from tqdm import tqdm

    with tqdm(total=total, desc=what, unit="frame", disable=hidden or None) as bar:
        try:
            yield bar
        except Exception:
            bar.leave = False  # the error is what remains
            raise
