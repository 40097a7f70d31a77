"""When views are told: calls of other threads at once, panels one a turn after the picture."""

import contextlib
import time
from collections.abc import Callable

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtWidgets import QWidget

#: Milliseconds between two looks whether the picture is shown, so that panels can be told; the
#: longest wait for it, and between two panels.
LOOK, LONGEST_REST = 5, 120


class Post(QObject):
    """Brings calls of other threads to the window's thread."""

    called = Signal(object)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.called.connect(lambda call: call(), Qt.ConnectionType.QueuedConnection)

    def post(self, call: Callable[[], object]) -> None:
        """Call a function on the window's thread; nothing happens when the window is gone."""
        with contextlib.suppress(RuntimeError):  # a thread may end after the window
            self.called.emit(call)


class Turns(QObject):
    """Tells panels what changed, one a turn, when the picture is shown.

    While something is dragged, a panel is told at most the newest state, and panels take at most a
    third of the time.

    Parameters
    ----------
    parent : QObject
    shown : callable
        Whether the picture of now is shown.
    """

    def __init__(self, parent: QObject, shown: Callable[[], bool]) -> None:
        super().__init__(parent)
        self._shown, self._asked = shown, 0.0
        self._waiting: dict[Callable[[], object], None] = {}
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._next)

    def later(self, call: Callable[[], object]) -> None:
        """Call a function soon; once, however often it is asked for until then."""
        self._waiting[call] = None
        if not self._timer.isActive():
            self._asked = time.monotonic()
            self._timer.start(LOOK)

    @property
    def settled(self) -> bool:
        """Whether all panels are told."""
        return not self._waiting

    def _next(self) -> None:
        start = time.monotonic()
        if not self._shown() and start < self._asked + LONGEST_REST / 1000:
            self._timer.start(LOOK)
            return
        call = next(iter(self._waiting), None)
        if call is None:
            return
        del self._waiting[call]
        call()
        panel = getattr(call, "__self__", None)
        if isinstance(panel, QWidget) and not panel.isWindow():  # a window would paint all panels
            panel.repaint()
        self._asked = time.monotonic()
        took = self._asked - start
        if self._waiting:
            self._timer.start(round(min(2000 * took, LONGEST_REST)))
