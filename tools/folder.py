"""`make windows-zip`, `linux-tar`, `macos-zip`: a folder with all that palette4d needs.

    python tools/folder.py FOLDER BILL [ARCHIVE]

FOLDER holds python/, with palette4d and what it needs installed (tools/windows_python.sh,
tools/linux_python.sh, tools/macos_app.sh). It loses what palette4d never uses, and gets the
licences and BILL, the list of what is in it (CycloneDX). With ARCHIVE it is packed into that .zip:
the .app that it lies in, or else it is for Windows and gets launchers. Needs distlib.
"""

from __future__ import annotations

import argparse
import importlib.resources
import io
import shutil
import sys
import zipfile
from email.parser import HeaderParser
from pathlib import Path

from assemble_bundle import pack

LARGEST = 200_000_000
"""Bytes of the archive."""

LAUNCHERS = {
    "Palette4D Studio": ("w64", "pythonw", "studio"),
    "palette4d": ("t64", "python", "command"),
    "Install node": ("t64", "python", "install_node"),
    "Add shortcuts": ("t64", "python", "shortcuts"),
}
"""A program: distlib's launcher with a window or with a terminal, Python's, and the script."""

UNUSED = (
    "bin", "*/*.exe", "*/bin/*.exe", "*/include", "**/*.lib", "**/cmake", "**/tests/test_*.py",
    "**/tests/data", "matplotlib/mpl-data/sample_data",
)  # fmt: skip
QT_USED = (
    "*.py", "Qt6Core.dll", "Qt6Gui.dll", "Qt6Network.dll", "Qt6Widgets.dll", "pyside6.*.dll",
    "msvcp140*.dll", "vcruntime140*.dll", "opengl32sw.dll", "QtCore.*", "QtGui.*", "QtNetwork.*",
    "QtWidgets.*", "plugins/platforms/qoffscreen.dll", "plugins/platforms/qwindows.dll",
    "plugins/styles/*", "plugins/imageformats/qico.dll", "plugins/imageformats/qjpeg.dll",
    "libpyside6.*", "Qt/lib/libQt6[CGNWDX]*", "Qt/lib/libQt6OpenGL.*", "Qt/lib/libicu*",
    "Qt/plugins/platforms/*", "Qt/plugins/platformthemes/*",
    "Qt/plugins/platforminputcontexts/lib[ci]*",
    "Qt/plugins/wayland-*/*", "Qt/plugins/xcbglintegrations/*", "Qt/plugins/imageformats/libqico.*",
    "Qt/plugins/imageformats/libqjpeg.*", "Qt/plugins/styles/*",
    *(f"Qt/lib/Qt{part}.framework/**/*" for part in ("Core", "DBus", "Gui", "Network", "Widgets")),
)  # fmt: skip

LICENCES = """\
palette4d itself is under the BSD licence (palette4d/). This folder also has libraries of others,
listed below; their licences lie here, and palette4d.cdx.json lists them for programs.

PyAV's libraries are FFmpeg with x264 and x265, under the GNU General Public License. So the folder
as a whole may be passed on under version 3 of that licence (GPL-3). Qt is under the LGPL-3: you may
replace its libraries by your own. You get the sources of

  FFmpeg, x264, x265 and PyAV   https://github.com/PyAV-Org/pyav-ffmpeg, with the versions and the
                                commands of the build, and https://github.com/PyAV-Org/PyAV
  Qt and PySide                 https://download.qt.io/official_releases/QtForPython/pyside6
  all others                    PyPI, the Python Package Index, by the names and versions below

Whoever passes this folder on must let people have the same sources.

"""


def remove(path: Path) -> None:
    """Remove a file or a folder."""
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def trim(packages: Path) -> None:
    """Remove what palette4d does not use: it is half of the folder."""
    # Asks Windows' management for the version of Windows, which is slow, and ends Wine's.
    (packages.parents[1] / "_wmi.pyd").unlink(missing_ok=True)
    for pattern in UNUSED:
        for path in list(packages.glob(pattern)):
            remove(path)
    qt = packages / "PySide6"
    used = {path for pattern in QT_USED for path in qt.glob(pattern)}
    for path in list(qt.rglob("*")):
        if path.is_file() and path not in used:
            path.unlink()
    for path in sorted(qt.rglob("*"), reverse=True):
        if path.is_dir() and not any(path.iterdir()):
            path.rmdir()


def launcher(kind: str, python: str, script: str) -> bytes:
    """Return a program that runs a script with the Python beside it."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        text = Path(__file__).with_name("windows").joinpath(f"{script}.py").read_text("utf-8")
        archive.writestr(zipfile.ZipInfo("__main__.py"), text)
    program = importlib.resources.files("distlib").joinpath(f"{kind}.exe").read_bytes()
    return program + rf"#!<launcher_dir>\python\{python}.exe".encode() + b"\r\n" + packed.getvalue()


def licences(packages: Path, out: Path) -> None:
    """Collect the licence files of all packages, and list the packages."""
    lines = []
    for about in sorted(packages.glob("*.dist-info")):
        fields = HeaderParser().parsestr((about / "METADATA").read_text("utf-8"))
        name, version = fields["Name"], fields["Version"]
        given = fields["License-Expression"] or fields["License"] or ""
        # Some put the whole text there.
        named = given if 0 < len(given) < 60 and "\n" not in given else f"see {name.lower()}/"
        lines.append(f"  {name} {version}: {named}\n")
        folder = out / name.lower()
        for path in about.rglob("*"):
            if path.is_file() and path.name.upper().startswith(("LICEN", "COPYING", "NOTICE")):
                folder.mkdir(parents=True, exist_ok=True)
                shutil.copy(path, folder)
    # Windows' Python has it beside its programs, Linux's among its modules; an .app has no Python.
    for python in [*packages.parents[1].glob("LICENSE.txt"), *packages.parent.glob("LICENSE.txt")]:
        shutil.copy(python, out / "python.txt")
    # Qt's wheels name these and do not bring them.
    for name in ("GPL-3", "LGPL-3"):
        shutil.copy(Path("/usr/share/common-licenses", name), out / f"{name}.txt")
    (out / "README.txt").write_text(LICENCES + "".join(lines), encoding="utf-8", newline="\r\n")


def main() -> None:
    """Make the folder and the archive that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("folder", type=Path)
    parser.add_argument("bill", type=Path)
    parser.add_argument("archive", type=Path, nargs="?")
    arguments = parser.parse_args()
    folder: Path = arguments.folder
    (packages,) = folder.glob("python/[Ll]ib/**/site-packages")
    trim(packages)
    shutil.rmtree(folder / "LICENSES", ignore_errors=True)
    (folder / "LICENSES").mkdir()
    licences(packages, folder / "LICENSES")
    shutil.copy(arguments.bill, folder / "LICENSES" / "palette4d.cdx.json")
    archive: Path | None = arguments.archive
    if archive is None:
        return
    whole = next((parent for parent in folder.parents if parent.suffix == ".app"), folder)
    if whole == folder:
        for name, what in LAUNCHERS.items():
            (folder / f"{name}.exe").write_bytes(launcher(*what))
    pack(whole, archive)
    size = archive.stat().st_size
    print(f"{archive}: {size / 1e6:.0f} MB")
    if size > LARGEST:
        sys.exit(f"{archive}: found {size} bytes, expected at most {LARGEST}")


if __name__ == "__main__":
    main()
