"""The verb studio where there is no toolkit or no screen; and the other verbs, which need none."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from without_module import run_without

from palette4d.cli.main import main

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"


def test_without_the_toolkit_it_says_what_to_install(tmp_path: Path) -> None:
    done = run_without("PySide6", tmp_path, "studio")
    assert done.returncode == 1
    assert f"`{sys.executable} -m pip install PySide6-Essentials`" in done.stderr


def test_no_other_verb_loads_the_toolkit() -> None:
    program = (
        "import sys, palette4d\n"
        "from palette4d.cli.main import main\n"
        "main(['info', sys.argv[1]])\n"
        "sys.exit(any(name.startswith('PySide6') for name in sys.modules))\n"
    )
    sidecar = str(GOLDEN / "v1_edited.p4d.json")
    done = subprocess.run(
        [sys.executable, "-c", program, sidecar], capture_output=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("size", ["big", "1600", "1x1"])
def test_a_size_that_is_none_is_wrong_usage(size: str) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["studio", "--size", size])
    assert ended.value.code == 2
