"""Starting the window, with or without a screen."""

import functools
import os
import sys
import time
import traceback
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palette4d.common.errors import Palette4dError, WriteError
from palette4d.studio import texts

if TYPE_CHECKING:
    from collections.abc import Callable

    from PySide6.QtWidgets import QApplication

    from palette4d.studio.session import Session
    from palette4d.studio.window import Window

#: Seconds after which a screenshot is taken even if something is still being computed.
LONGEST_WAIT = 60.0


def has_screen() -> bool:
    """Whether there is a screen to open a window on."""
    if os.environ.get("QT_QPA_PLATFORM") or not sys.platform.startswith("linux"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def run(
    path: str | None,
    *,
    clip: str | None = None,
    frame: float | None = None,
    screenshot: Path | None = None,
    size: tuple[int, int] = (1600, 1000),
    until_shown: bool = False,
    prepare: "Callable[[Window], object] | None" = None,
) -> int:
    """Open the window, and return the exit status when it is closed.

    Parameters
    ----------
    path : str or None
        A clip, a sidecar or a manifest.
    clip : str, optional
        The clip, where the sidecar's own path leads nowhere.
    frame : float, optional
        The frame to go to.
    screenshot : Path, optional
        Draw the window into this file and return; needs no screen.
    size : (int, int)
        The window's size in pixels.
    until_shown : bool
        Return when the first picture is drawn, without a screen: for benchmarks.
    prepare : callable, optional
        Called with the window before a screenshot, when everything is drawn: for the docs.
    """
    hidden = screenshot is not None or until_shown
    if hidden:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    elif not has_screen():
        raise Palette4dError(
            "found no screen ($DISPLAY and $WAYLAND_DISPLAY are empty), expected one for the "
            "window. `palette4d studio PATH --screenshot OUT.png` draws it without a screen; for "
            "the window itself use a remote screen (ssh -X, VNC)"
        )
    from PySide6.QtCore import QSettings, Qt
    from PySide6.QtWidgets import QApplication

    from palette4d.studio import theme
    from palette4d.studio.instance import bring_forward
    from palette4d.studio.session import Session
    from palette4d.studio.window import Window

    app = QApplication.instance() or QApplication(["palette4d"])
    assert isinstance(app, QApplication)
    if not hidden and path is not None and bring_forward(path, frame):
        return 0
    theme.dress(app)
    # The picture's thread waits for the window's at most this long.
    sys.setswitchinterval(0.001)
    session = Session()
    settings = QSettings("palette4d", "studio")
    if hidden:  # a picture does not depend on who draws it
        settings = QSettings(os.devnull, QSettings.Format.IniFormat)
    window = Window(session, settings)
    window.resize(*size)
    window.arrange()
    if path is not None:
        window.open_path(path, clip)
    if frame is not None:
        session.go(frame)
    window.setAttribute(Qt.WidgetAttribute.WA_DontShowOnScreen, hidden)
    window.show()
    sys.excepthook = functools.partial(_unexpected, session)
    if hidden:
        wait_until_shown(app, window)
        if prepare is not None:
            prepare(window)
            wait_until_shown(app, window)
        saved = screenshot is None or window.grab().save(str(screenshot))
        window.shut()
        if not saved:
            raise WriteError(f"{screenshot}: cannot be written; expected a folder that exists")
        return 0
    return int(app.exec())


def _unexpected(
    session: "Session", kind: type[BaseException], error: BaseException, trace: Any
) -> None:
    """Show an error of the program itself; the window stays, and nothing is lost."""
    traceback.print_exception(kind, error, trace)
    session.say(texts.UNEXPECTED.format(error=error), "error")


def wait_until_shown(app: "QApplication", window: "Window") -> None:
    """Wait until nothing in the window is being read or computed any more."""
    end, calm = time.monotonic() + LONGEST_WAIT, 0
    while calm < 3 and time.monotonic() < end:
        app.processEvents()
        time.sleep(0.01)
        calm = calm + 1 if window.settled else 0
