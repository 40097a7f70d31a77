"""Starting the window, with or without a screen."""

import contextlib
import functools
import os
import re
import socket
import sys
import time
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palette4d.common.errors import Palette4dError, WriteError
from palette4d.common.files import refuse_existing, replacing
from palette4d.studio import libraries, texts

if TYPE_CHECKING:
    from collections.abc import Callable

    from PySide6.QtGui import QPixmap
    from PySide6.QtWidgets import QApplication

    from palette4d.studio.session import Session
    from palette4d.studio.window import Window

#: The size of a window that was never opened before.
USUAL_SIZE = (1600, 1000)
#: What the rims and the title of a window take, at most.
RIMS = (16, 48)
#: Seconds after which a screenshot is taken even if something is still being computed.
LONGEST_WAIT = 60.0


def has_screen() -> bool:
    """Whether there is a screen to open a window on."""
    if os.environ.get("QT_QPA_PLATFORM") or not sys.platform.startswith("linux"):
        return True
    if os.environ.get("WAYLAND_DISPLAY"):
        return True
    return answers(os.environ.get("DISPLAY", ""))


def answers(display: str) -> bool:
    """Whether an X server answers at a display such as ":0" or "host:10.0"; Qt aborts without."""
    if sys.platform == "win32":
        return False
    match = re.fullmatch(r"(?:unix)?([^:]*):(\d+)(?:\.\d+)?", display)
    if match is None:
        return False
    host, number = match[1], int(match[2])
    path = f"/tmp/.X11-unix/X{number}"
    places: list[Any] = [(host, 6000 + number)] if host else [path, f"\0{path}"]
    kind = socket.AF_INET if host else socket.AF_UNIX
    for place in places:
        with contextlib.suppress(OSError), socket.socket(kind) as found:
            found.settimeout(2)
            found.connect(place)
            return True
    return False


def run(
    path: str | None,
    *,
    clip: str | None = None,
    frame: float | None = None,
    screenshot: Path | None = None,
    force: bool = False,
    size: tuple[int, int] | None = None,
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
    force : bool
        Replace a file of that name.
    size : (int, int), optional
        The window's size in pixels; default: as it was left.
    until_shown : bool
        Return when the first picture is drawn, without a screen: for benchmarks.
    prepare : callable, optional
        Called with the window before a screenshot, when everything is drawn: for the docs.
    """
    hidden = screenshot is not None or until_shown
    if screenshot is not None:
        _check(screenshot, force, path)
    if hidden:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
        # The platform without a screen warns that it has no window manager.
        os.environ.setdefault("QT_LOGGING_RULES", "default.warning=false")
    elif not has_screen():
        raise Palette4dError(
            f"found no screen (DISPLAY={os.environ.get('DISPLAY', '')!r}, no WAYLAND_DISPLAY), "
            "expected one for the window. `palette4d studio PATH --screenshot OUT.png` draws it "
            "without a screen; for the window itself use a remote screen (ssh -X, VNC)"
        )
    if lacking := libraries.missing():
        raise Palette4dError(libraries.advice(lacking))
    from PySide6.QtCore import QSettings, QSize, Qt, QTemporaryDir
    from PySide6.QtWidgets import QApplication

    from palette4d.plotting import style
    from palette4d.studio import theme
    from palette4d.studio.application import Application
    from palette4d.studio.instance import bring_forward
    from palette4d.studio.session import Session
    from palette4d.studio.window import Window

    app = QApplication.instance() or Application(["palette4d"])
    assert isinstance(app, QApplication)
    if not hidden and path is not None and bring_forward(path, frame):
        return 0
    theme.dress(app)
    # The picture's thread waits for the window's at most this long.
    sys.setswitchinterval(0.001)
    session = Session()
    settings = QSettings("palette4d", "studio")
    nowhere = QTemporaryDir()
    if hidden:  # a picture does not depend on who draws it
        settings = QSettings(nowhere.filePath("studio.ini"), QSettings.Format.IniFormat)
    window = Window(session, settings)
    if isinstance(app, Application):
        app.open_path = window.open_path
    wanted = QSize(*(size or USUAL_SIZE))
    if not hidden:
        wanted = wanted.boundedTo(app.primaryScreen().availableSize() - QSize(*RIMS))
    window.resize(wanted)
    window.arrange()
    if size is None:
        window.restore()
    window.setAttribute(Qt.WidgetAttribute.WA_DontShowOnScreen, hidden)
    window.show()  # first: a dialog stands above it
    if not hidden:
        window.files.offer_crashed()
    if path is not None:
        window.open_path(path, clip)
    if frame is not None:
        session.go(frame)
        first, last, _ = session.frames
        if session.player is not None and not first <= frame <= last:
            beyond = texts.BEYOND.format(frame=style.number(frame), first=first, last=last)
            session.say(beyond, "warning")
    sys.excepthook = functools.partial(_unexpected, session)
    if hidden:
        if session.status.level == "error":
            window.shut()
            raise Palette4dError(session.status.text)
        if session.status.level == "warning":
            print(f"note: {session.status.text}", file=sys.stderr)
        wait_until_shown(app, window)
        if prepare is not None:
            prepare(window)
            wait_until_shown(app, window)
        picture, found = window.grab(), session.clip
        window.shut()
        settings.sync()  # while its folder is there
        if screenshot is not None:
            _save(
                picture, screenshot, force, () if found is None else map(found.file, found.frames)
            )
        return 0
    return int(app.exec())


def _check(picture: Path, force: bool, *inputs: str | None) -> None:
    """Refuse a name that no picture of the window may have."""
    if picture.suffix.lower() not in (".png", ".jpg"):
        raise Palette4dError(f"{picture}: found another extension, expected .png or .jpg")
    refuse_existing(picture, force, inputs=(Path(each) for each in inputs if each is not None))


def _save(picture: "QPixmap", path: Path, force: bool, inputs: Iterable[Path]) -> None:
    """Write a picture of the window."""
    refuse_existing(path, force, inputs=inputs)
    with replacing(path, force=force) as temporary:
        if not picture.save(str(temporary)):
            raise WriteError(f"{path}: cannot be written; choose another folder")


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
