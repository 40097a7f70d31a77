"""The progress bar of a command that works on frames."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def frames_bar(
    what: str, *, hidden: bool, total: int | None = None
) -> Iterator[Callable[..., None]]:
    """Show a tqdm bar on standard error; after an error, nothing is left of it.

    Parameters
    ----------
    what : str
        Stands before the bar.
    hidden : bool
        No bar at all; there is none either where standard error is no terminal.
    total : int, optional
        Frames in all, where they are known from the start.

    Yields
    ------
    callable
        To be called with (frames done, frames in all) and, optionally, words instead of `what`.
    """
    from tqdm import tqdm

    with tqdm(total=total, desc=what, unit="frame", disable=hidden or None) as bar:

        def progress(done: int, total: int, words: str = what) -> None:
            if bar.total != total:
                # Frames that are there already cost no time: the bar starts after them.
                bar.total, bar.initial, bar.n = total, done, done
            bar.set_description(words, refresh=False)
            bar.update(done - bar.n)
            bar.refresh()

        try:
            yield progress
        except Exception:
            bar.leave = False  # the error is what remains
            raise
