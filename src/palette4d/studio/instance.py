"""One window for a sidecar: a second `palette4d studio` of it brings the first to the front.

Each window listens on a local socket named after its sidecar, in a folder where no other user can
make one; only this user may connect.
"""

import contextlib
import hashlib
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtNetwork import QLocalServer, QLocalSocket

from palette4d.common.folders import runtime_folder, state_folder
from palette4d.common.json_files import parse

#: Milliseconds that a window has for its answer.
PATIENCE = 1000

#: The longest question.
BYTES = 4096

#: The longest path of a socket: systems allow 103 to 107 bytes, and Qt binds a longer one first.
LONGEST = 90


def name_of(sidecar: str | os.PathLike[str]) -> str:
    """Return the socket's name for a sidecar: a path, or one in the folder of temporary files."""
    user = os.getuid() if hasattr(os, "getuid") else 0
    key = f"{user} {os.path.realpath(sidecar)}"
    name = f"palette4d-studio-{hashlib.sha256(os.fsencode(key)).hexdigest()[:20]}"
    for folder in _folders():
        path = str(folder / name)
        if _ours(folder) and not folder.stat().st_mode & 0o022 and len(path) <= LONGEST:
            return path
    return name


def _folders() -> list[Path]:
    """Return folders for sockets; on Windows they have none, on macOS the usual one is private."""
    if sys.platform in ("win32", "darwin"):
        return []
    own = runtime_folder()
    return [*([] if own is None else [own]), state_folder() / "palette4d"]


def bring_forward(sidecar: str | os.PathLike[str], frame: float | None) -> bool:
    """Ask the window of a sidecar to come to the front and go to a frame; False without one."""
    socket = QLocalSocket()
    socket.connectToServer(name_of(sidecar))
    if not socket.waitForConnected(PATIENCE) or not _ours(socket.fullServerName()):
        return False
    socket.write(json.dumps({"frame": frame}).encode() + b"\n")
    socket.flush()
    heard = socket.waitForReadyRead(PATIENCE)
    socket.disconnectFromServer()
    return heard


def is_open(sidecar: str | os.PathLike[str]) -> bool:
    """Whether a window has this sidecar open."""
    socket = QLocalSocket()
    socket.connectToServer(name_of(sidecar))
    return socket.waitForConnected(100) and _ours(socket.fullServerName())


def _ours(path: str | Path) -> bool:
    """Whether a socket, or its folder, is this user's."""
    if sys.platform == "win32":
        return True
    try:
        return Path(path).stat().st_uid == os.getuid()
    except OSError:
        return False


class Listener(QObject):
    """Listens for other starts with the sidecar of now.

    Parameters
    ----------
    asked : callable
        Called with the frame that was asked for, or None.
    """

    def __init__(self, parent: QObject, asked: Callable[[float | None], object]) -> None:
        """Listen to nothing yet."""
        super().__init__(parent)
        self._asked = asked
        self._server: QLocalServer | None = None
        self._path: Path | None = None

    def listen(self, sidecar: Path | None) -> None:
        """Listen for a sidecar, or for none; quick if it is the same."""
        if sidecar == self._path:
            return
        self._path = sidecar
        if self._server is not None:
            self._server.close()
            self._server.deleteLater()
            self._server = None
        if sidecar is None:
            return
        if is_open(sidecar):  # another window has it; that one goes on listening
            return
        if sys.platform == "linux" and not Path(name_of(sidecar)).is_absolute():
            with contextlib.suppress(OSError):
                _folders()[-1].mkdir(mode=0o700, parents=True, exist_ok=True)
        QLocalServer.removeServer(name_of(sidecar))  # of a window that was killed
        server = QLocalServer(self)
        server.setSocketOptions(QLocalServer.SocketOption.UserAccessOption)
        server.newConnection.connect(self._connected)
        server.listen(name_of(sidecar))
        self._server = server

    def _connected(self) -> None:
        assert self._server is not None
        socket = self._server.nextPendingConnection()
        socket.setReadBufferSize(BYTES)
        socket.disconnected.connect(socket.deleteLater)
        socket.readyRead.connect(lambda: self._read(socket))
        if socket.bytesAvailable():
            self._read(socket)

    def _read(self, socket: QLocalSocket) -> None:
        if not socket.canReadLine():
            return
        try:
            frame = parse(bytes(socket.readLine(BYTES).data()))["frame"]
            wanted = None if frame is None else frame + 0.0  # texts would be numbers to float()
        except (ValueError, KeyError, TypeError, OverflowError):
            return
        socket.write(b"ok\n")
        socket.flush()
        self._asked(wanted)
