"""Work beside the views' thread, of which only the newest counts. It knows no toolkit."""

import threading
from collections.abc import Callable


class Newest:
    """Does what it is asked in a thread; of calls that wait only the newest is done.

    Parameters
    ----------
    name : str
        The thread's name.
    """

    def __init__(self, name: str) -> None:
        """Do nothing yet."""
        self._name = name
        self._lock = threading.Lock()
        self._waiting: Callable[[], object] | None = None
        self._busy = False

    def ask(self, call: Callable[[], object]) -> None:
        """Do this next; a call that still waits is dropped."""
        with self._lock:
            self._waiting = call
            if self._busy:
                return
            self._busy = True
        threading.Thread(target=self._run, name=self._name, daemon=True).start()

    def _run(self) -> None:
        while True:
            with self._lock:
                call, self._waiting = self._waiting, None
                if call is None:
                    self._busy = False
                    return
            call()
