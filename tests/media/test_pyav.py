"""PyAV is imported without a look into folders that every user of the computer may fill."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from palette4d import media

FOLDER = Path(media.__file__).parent
USERS = sorted(
    path.stem for path in FOLDER.glob("*.py") if "media.pyav import" in path.read_text("utf-8")
)
PROGRAM = """
import importlib, importlib.abc, os, sys
class Seen(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "av":
            print(os.environ.get("GNUTLS_SYSTEM_PRIORITY_FILE"))
sys.meta_path.insert(0, Seen())
importlib.import_module(sys.argv[1])
print(os.environ.get("GNUTLS_SYSTEM_PRIORITY_FILE"))
"""


def test_all_import_it_so() -> None:
    assert len(USERS) > 4
    for path in FOLDER.parent.rglob("*.py"):
        lines = path.read_text("utf-8").splitlines()
        direct = [line for line in lines if line.strip().startswith(("import av", "from av"))]
        assert not direct or path.name == "pyav.py", path


@pytest.mark.parametrize("module", USERS)
@pytest.mark.parametrize("given", [None, "settings"])
def test_its_tls_reads_no_settings_from_tmp(module: str, given: str | None) -> None:
    environment = {k: v for k, v in os.environ.items() if k != "GNUTLS_SYSTEM_PRIORITY_FILE"}
    environment |= {} if given is None else {"GNUTLS_SYSTEM_PRIORITY_FILE": given}
    command = [sys.executable, "-P", "-c", PROGRAM, f"palette4d.media.{module}"]
    done = subprocess.run(command, env=environment, check=True, text=True, stdout=subprocess.PIPE)
    assert done.stdout.split() == [given or os.devnull, str(given)]
