"""Whether the interpreter runs on while the core works."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable


def assert_interpreter_runs_on(work: Callable[[], object]) -> None:
    """Were the GIL held, this thread could not wake while another is in the core."""
    worker = threading.Thread(target=work)
    started = time.perf_counter()
    worker.start()
    longest, last = 0.0, time.perf_counter()
    while worker.is_alive():
        time.sleep(0.001)
        now = time.perf_counter()
        longest, last = max(longest, now - last), now
    total = time.perf_counter() - started
    assert longest < 0.6 * total
