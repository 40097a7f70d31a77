"""Print the requirements of some of pyproject.toml's extras, one a line, for ``pip install -r``.

The tools (cmake, ruff, ...) live in an environment of their own, without palette4d, so they cannot
be asked for as ``palette4d[lint]``; this keeps pyproject.toml the only list.
"""

import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def requirements(extras: list[str]) -> list[str]:
    """Every requirement of the named extras, in the file's order; KeyError names an unknown one."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return [line for extra in extras for line in project["optional-dependencies"][extra]]


if __name__ == "__main__":
    print("\n".join(requirements(sys.argv[1:])))
