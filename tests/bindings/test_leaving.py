"""A program ends as it wants to, whatever its threads do in the core."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

LEAVES = """
import os, sys, threading, time, types
import numpy as np
from palette4d import _core

picture = np.zeros((1500, 1500, 3), np.float32)
corner, faces = np.zeros((1, 3)), np.zeros((0, 3), np.int32)
recolourer = _core.Recolourer(corner, corner, faces)

def work():
    while True:
        recolourer.apply(picture)
        _core.scope_counts(picture)

class Late:  # Python removes it after it has ended the interpreter
    file = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT)

    def __del__(self, sleep=time.sleep, write=os.write):
        sleep(0.5)
        write(self.file, b"left")

sys.modules["late"] = types.ModuleType("late")
sys.modules["late"].late = Late()
threading.Thread(target=work, daemon=True).start()
time.sleep(0.2)
"""


@pytest.mark.skipif(os.name == "nt", reason="glibc alone unwinds a thread that Python ends")
def test_a_program_may_end_while_a_daemon_thread_is_in_the_core(tmp_path: Path) -> None:
    left = tmp_path / "left"
    done = subprocess.run(
        [sys.executable, "-P", "-c", LEAVES, left], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert left.read_text() == "left"
