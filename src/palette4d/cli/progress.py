"""The progress bar of a command that works on frames."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator


@contextlib.contextmanager
def frames_bar(
    what: str, *, hidden: bool, total: int | None = None
) -> Iterator[Callable[..., None]]:
    """Show a tqdm bar on standard error, if that is a terminal; after an error it disappears.

    Yields a function to call with (frames done, frames in all) and, optionally, a text instead of
    `what`.
    """
    from tqdm import tqdm

    with tqdm(total=total, desc=what, unit="frame", disable=hidden or None) as bar:

        def progress(done: int, total: int, words: str = what) -> None:
            if bar.total != total:
                # Frames that were done before cost no time: the bar starts after them.
                bar.total, bar.initial, bar.n = total, done, done
            bar.set_description(words, refresh=False)
            bar.update(done - bar.n)
            bar.refresh()

        try:
            yield progress
        except Exception:
            bar.leave = False  # only the error message remains
            raise
