"""A program ends as it wants to, whatever its threads do in the core."""

import subprocess
import sys

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
    def __del__(self, sleep=time.sleep, write=os.write):
        sleep(0.5)
        write(1, b"left")

sys.modules["late"] = types.ModuleType("late")
sys.modules["late"].late = Late()
threading.Thread(target=work, daemon=True).start()
time.sleep(0.2)
"""


def test_a_program_may_end_while_a_daemon_thread_is_in_the_core() -> None:
    done = subprocess.run(
        [sys.executable, "-P", "-c", LEAVES], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "left", "")
