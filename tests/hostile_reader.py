"""What a reader that a file has taken over would try, and a hook that lets it try at each clip.

It is called `sitecustomize` in a folder of $PYTHONPATH. Then `open_clip` of each process of a
command prints, as a line of JSON on standard error, which of the attempts succeeded.
"""

import ctypes
import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

NEW_USER_NAMESPACE, IO_URING_SETUP = 0x10000000, 425
#: Of shmctl, and of ioctl for a file's flags.
INFORMATION, SET_FLAGS = 3, 0x40086602


def attempts(home: Path, parent: int) -> dict[str, Callable[[], object]]:
    """What must fail, by name; `home` has .ssh/id_rsa and .bashrc."""
    libc = ctypes.CDLL(None, use_errno=True)
    libc.shmat.restype = ctypes.c_ssize_t
    bashrc, buffer = home / ".bashrc", ctypes.create_string_buffer(200)

    def checked(result: int) -> None:
        if result == -1:
            raise OSError(ctypes.get_errno(), "refused")

    return {
        "read a key": (home / ".ssh" / "id_rsa").read_text,
        "read another process's environment": Path(f"/proc/{parent}/environ").read_bytes,
        "change a file": lambda: bashrc.open("a").close(),
        "make a file": (home / "evil.sh").touch,
        "make a file beside the clip": (home / "clip" / "evil.sh").touch,
        "make a folder": (home / f"folder{os.getpid()}").mkdir,
        "link": lambda: (home / f"link{os.getpid()}").symlink_to("/etc"),
        "hard link": lambda: os.link(bashrc, home / f"hard{os.getpid()}"),
        "rename": lambda: bashrc.rename(bashrc),
        "change rights": lambda: bashrc.chmod(0o666),
        "change times": lambda: os.utime(bashrc, (0, 0)),
        "change attributes": lambda: os.setxattr(bashrc, "user.evil", b"1"),
        "truncate": lambda: os.truncate(bashrc, 1),
        "listen": lambda: socket.socket().bind(("127.0.0.1", 0)),
        "local socket": lambda: socket.socket(socket.AF_UNIX).close(),
        # sendto() takes such a pair to the socket of any program
        "datagram": lambda: socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)[0].close(),
        "raw datagram": lambda: socket.socketpair(socket.AF_UNIX, socket.SOCK_RAW)[0].close(),
        "run a program": lambda: subprocess.run(["/bin/true"], check=True),
        "start a process": lambda: os.fork() or os._exit(0),
        "signal": lambda: os.kill(parent, 0),
        "find shared memory": lambda: checked(libc.shmctl(0, INFORMATION, buffer)),
        "attach shared memory": lambda: checked(libc.shmat(int(os.environ["MEMORY"]), None, 0)),
        "watch all files": lambda: checked(libc.fanotify_init(4, 0)),
        "change a file's flags": lambda: checked(
            libc.ioctl(os.open(bashrc, os.O_RDONLY), SET_FLAGS, b"\x80" + bytes(7))
        ),
        "namespace": lambda: checked(libc.unshare(NEW_USER_NAMESPACE)),
        "io_uring": lambda: checked(
            libc.syscall(ctypes.c_long(IO_URING_SETUP), 1, ctypes.create_string_buffer(120))
        ),
    }


def succeeded(home: Path, parent: int) -> list[str]:
    """Return the names of the attempts that succeeded."""
    found = []
    for name, attempt in attempts(home, parent).items():
        try:
            attempt()
        except OSError:
            continue
        found.append(name)
    return found


class _Hook(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Loads `palette4d.media.clip` with an `open_clip` that is taken over."""

    def __init__(self) -> None:
        self.real: Any = None

    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        if name != "palette4d.media.clip" or self.real is not None:
            return None
        self.real = True
        found = importlib.util.find_spec(name)
        assert found
        assert found.loader
        self.real, found.loader = found.loader, self
        return found

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        self.real.exec_module(module)
        opened = module.open_clip

        def open_clip(*arguments: Any, **options: Any) -> Any:
            home, parent = Path(os.environ["HOME"]), int(os.environ["HOSTILE_PARENT"])
            print(json.dumps({"hostile": succeeded(home, parent)}), file=sys.stderr, flush=True)
            return opened(*arguments, **options)

        module.open_clip = open_clip


if __name__ == "sitecustomize":
    sys.meta_path.insert(0, _Hook())
