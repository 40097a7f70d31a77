"""Runs verbs with faults, each in a fork of this process, which has imported everything.

Processes that a verb starts are forks too. It reads trials as lines of JSON and answers each with a
line: the exit status (negative: the signal), the names of the calls that changed files, and what
was printed. The verb `autosave` is an edit in the window, and what the window then does by itself.
"""

import ctypes
import importlib
import json
import math
import multiprocessing
import os
import pkgutil
import signal
import sys
import tempfile
import traceback
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

import palette4d
from palette4d.cli.main import main
from palette4d.grade.document import Document
from palette4d.studio.session import Session, recovered

LEFT_OUT = ("palette4d.studio", "palette4d.__main__", "palette4d.common.windows")
for found in pkgutil.walk_packages(palette4d.__path__, "palette4d."):
    if not found.name.startswith(LEFT_OUT):
        importlib.import_module(found.name)
for name in ("OpenImageIO", "PyOpenColorIO", "opentimelineio", "matplotlib.figure"):
    importlib.import_module(name)

FORKS = multiprocessing.get_context("fork")
multiprocessing.get_context = lambda method=None: FORKS
resource_tracker.ensure_running = lambda: None

SHIM: Any = ctypes.CDLL(None)
SHIM.faults_names.restype = ctypes.c_char_p
KILL, KILL_HALFWAY, NOTHING = 0, -1, -2
#: A verb that takes longer hangs; SIGALRM ends it.
SECONDS = 300


def autosave(path: Path) -> int:
    session = Session()
    session.open_sidecar(path)
    session.edit(lambda document: document.set("v4", rgb=(1, 0, 0)))
    session.tick(math.inf)
    if not session.saved:
        assert session.document
        copy = recovered(path)
        assert copy
        assert Document.load(copy).grade.settings == session.document.grade.settings
        print(f"palette4d: error: {session.status.text}", file=sys.stderr)
    return 0 if session.saved else 1


def trial(
    folder: str, arguments: list[str], at: int, action: int, lasting: bool, locks: bool
) -> Any:
    """Run a verb in a fork, with the working folder `folder`."""
    with tempfile.TemporaryFile() as printed:
        names_of, told = os.pipe()
        child = os.fork()
        if not child:
            signal.alarm(SECONDS)
            for handle in (1, 2):
                os.dup2(printed.fileno(), handle)
            os.chdir(folder)
            SHIM.faults_begin(folder.encode(), ctypes.c_long(at), action, lasting, not locks)
            status = 70
            try:
                verb, *rest = arguments
                status = autosave(Path(*rest)) if verb == "autosave" else main(arguments)
            except SystemExit as error:
                status = int(error.code or 0)
            except BaseException:
                traceback.print_exc()
            sys.stdout.flush()
            sys.stderr.flush()
            names = SHIM.faults_names()
            SHIM.faults_begin(b"", ctypes.c_long(0), NOTHING, 0, 0)
            os.write(told, names)
            os._exit(status)
        os.close(told)
        names = os.read(names_of, 65536).decode().split()
        os.close(names_of)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        printed.seek(0)
        return {
            "status": status,
            "calls": names,
            "printed": printed.read().decode("utf-8", "replace"),
        }


if __name__ == "__main__":
    sys.path[:] = [entry for entry in sys.path if Path(entry) != Path(__file__).parent]
    for line in sys.stdin:
        print(json.dumps(trial(**json.loads(line))), flush=True)
