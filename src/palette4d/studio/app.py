"""Starting the window, with or without a screen."""

import os
import sys
from pathlib import Path

from palette4d.common.errors import Palette4dError, WriteError

#: Milliseconds after which a screenshot is taken even if something is still being computed.
LONGEST_WAIT = 60_000


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
    """
    if screenshot is not None:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    elif not has_screen():
        raise Palette4dError(
            "found no screen ($DISPLAY and $WAYLAND_DISPLAY are empty), expected one for the "
            "window. `palette4d studio PATH --screenshot OUT.png` draws it without a screen; for "
            "the window itself use a remote screen (ssh -X, VNC)"
        )
    from PySide6.QtCore import QSettings, Qt, QTimer
    from PySide6.QtWidgets import QApplication

    from palette4d.studio import theme
    from palette4d.studio.session import Session
    from palette4d.studio.window import Window

    app = QApplication.instance() or QApplication(["palette4d"])
    assert isinstance(app, QApplication)
    theme.dress(app)
    session = Session()
    settings = QSettings("palette4d", "studio")
    if screenshot is not None:  # a picture does not depend on who draws it
        settings = QSettings(os.devnull, QSettings.Format.IniFormat)
    window = Window(session, settings)
    window.resize(*size)
    window.arrange()
    if path is not None:
        window.open_path(path, clip)
    if frame is not None:
        session.go(frame)
    window.setAttribute(Qt.WidgetAttribute.WA_DontShowOnScreen, screenshot is not None)
    window.show()
    if screenshot is not None:
        QTimer.singleShot(2500, app.quit)
        app.exec()
        if not window.grab().save(str(screenshot)):
            raise WriteError(f"{screenshot}: cannot be written; expected a folder that exists")
        window.shut()
        return 0
    return int(app.exec())
