"""The OpenFX bundle: its place in the package, the folders of hosts, and its installation.

The bundle is first copied beside its destination and then renamed. So a host never scans an
incomplete bundle.
"""

from __future__ import annotations

import contextlib
import errno
import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

from palette4d import _core
from palette4d.common.errors import Arg, Palette4dError, WriteError
from palette4d.common.files import replacing, temporary_folder
from palette4d.hosts.ownership import changeable, changeable_within, runs_as_root

BUNDLE = "Palette4D.ofx.bundle"
_PLUGINS = "OFX/Plugins"

#: In the bundle: the path of the Python with which the node's buttons start palette4d.
PROGRAM = Path("Contents/Resources/program")


SEARCH_PATH = "OFX_PLUGIN_PATH"
"""The variable that names further folders of plugins, separated as in PATH."""


def system_destination(system: str = sys.platform) -> Path:
    """The plugin folder of the OpenFX standard on a system (`sys.platform`)."""
    if system == "win32":
        # The first one for 64 bits, whatever this Python has.
        common = os.environ.get("COMMONPROGRAMW6432") or os.environ.get("COMMONPROGRAMFILES")
        return Path(common or "C:/Program Files/Common Files", _PLUGINS)
    if system == "darwin":
        return Path("/Library", _PLUGINS)
    return Path("/usr", _PLUGINS)


def default_destination(system: str = sys.platform) -> Path:
    """The folder that hosts look in first: of OFX_PLUGIN_PATH, else of the standard."""
    for folder in os.environ.get(SEARCH_PATH, "").split(";" if system == "win32" else ":"):
        if folder.strip():
            return Path(folder.strip()).expanduser().absolute()
    return system_destination(system)


def architecture(system: str = sys.platform, machine: str | None = None) -> str:
    """The folder below Contents in which hosts of a system look for the library."""
    if system == "win32":
        return "Win64"
    if system == "darwin":
        return "MacOS"
    machine = machine or platform.machine()
    return f"Linux-{'x86-64' if machine.lower() in ('x86_64', 'amd64') else machine}"


def find_bundle() -> Path:
    """Return the bundle inside the installed package."""
    # It lies beside the compiled module, which in an editable installation is not in the sources.
    bundle = Path(_core.__file__).parent / "_ofx" / BUNDLE
    found = sorted(library.parent.name for library in bundle.glob("Contents/*/*.ofx"))
    if architecture() in found:
        return bundle
    if found:
        raise Palette4dError(
            f"{bundle}: found libraries for {', '.join(found)}, expected one for this system, "
            f"{architecture()}; install palette4d again from its sources (pip install .)"
        )
    raise Palette4dError(
        f"found no {BUNDLE} in the installed package palette4d, expected it in {bundle.parent}; "
        "install palette4d again from a wheel built with PALETTE4D_BUILD_PLUGIN=ON (the default)"
    )


def install_bundle(
    bundle: Path, destination: Path, *, link: bool = False, force: bool = False
) -> Path:
    """Copy or link the bundle into a folder of plugins, which is made if it is missing.

    `force` replaces something that is not an earlier Palette4D bundle. Returns the installed
    bundle.
    """
    bundle = bundle.resolve()
    target = destination / BUNDLE
    if runs_as_root():
        _refuse_others_program(bundle)
    try:
        _make_open_folder(destination)
        if target.exists() and target.resolve() == bundle and link:
            return target
        if os.path.lexists(target) and not force and not _is_ours(target):
            raise Palette4dError(
                f"{target}: found something that is not an OpenFX bundle of Palette4D, "
                f"expected nothing or an earlier version; replace it with {Arg('force', True)}"
            )
        # Beside the target, so that the rename stays on one file system. Not by the name of a
        # bundle: hosts look for that in hidden folders too, and would load half a library.
        with temporary_folder(destination) as temporary:
            fresh = temporary / "new"
            if link:
                fresh.symlink_to(bundle, target_is_directory=True)
                # Another's installation may be closed: then the node says what its buttons need.
                with contextlib.suppress(WriteError):
                    _write_program(bundle)
            else:
                shutil.copytree(bundle, fresh, copy_function=_copy)
                _write_program(fresh)
                _open_for_all(fresh)
            _replace(fresh, target, temporary / "old")
    except PermissionError as error:
        who = (
            "close the programs that use the node, and run the command as an administrator"
            if sys.platform == "win32"
            else "run the command as an administrator (sudo)"
        )
        raise Palette4dError(
            f"{destination}: may not be written to; {who}, or give a folder of your own with "
            f"{Arg('dest')} and name it in the environment variable {SEARCH_PATH}"
        ) from error
    except OSError as error:
        if os.path.lexists(destination) and not destination.is_dir():
            raise Palette4dError(
                f"{destination}: found a file, expected a folder for the node; choose another with "
                f"{Arg('dest')}"
            ) from error
        raise Palette4dError(
            f"{target}: cannot be installed ({_reason(error)}); choose another folder with "
            f"{Arg('dest')}"
        ) from error
    return target


def _copy(source: str, target: str) -> None:
    """Copy a file's bytes to the disk: modes are set later, and Wine lacks Windows' own copying."""
    shutil.copyfile(source, target)
    with Path(target).open("rb+") as file:
        os.fsync(file.fileno())


def _reason(error: OSError) -> str:
    # One error of `copytree` holds those of all files: (from, to, text).
    if isinstance(error, shutil.Error) and error.args[0]:
        return str(error.args[0][0][2])
    return error.strerror or str(error)


#: Prints Python's folders of modules, also those that files *.pth name and that are not there yet.
_MODULE_FOLDERS = """
import os, sys
print(*sys.path, sep="\\n")
for folder in filter(os.path.isdir, sys.path):
    for name in [name for name in os.listdir(folder) if name.endswith(".pth")]:
        file = os.path.join(folder, name)
        if not os.path.isfile(file):
            continue  # as Python does
        with open(file, encoding="utf-8-sig", errors="surrogateescape") as lines:
            for line in map(str.strip, lines):
                if line and not line.startswith(("#", "import ", "import\\t")):
                    print(os.path.join(folder, line))
"""


def _refuse_others_program(bundle: Path) -> None:
    """Check that root alone may change what all users' nodes will run."""
    # This file: an editable installation runs its sources, which lie elsewhere. The folders of
    # modules: a virtual environment has those of its base, and others by files *.pth.
    ask = [sys.executable, "-E", "-P", "-c", _MODULE_FOLDERS]
    folders = subprocess.run(ask, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout
    above = (sys.executable, sys.prefix, sys.base_prefix, f"{sys.prefix}/pyvenv.cfg")
    within = (*folders.splitlines(), str(Path(__file__).parents[1]), str(bundle))
    for text in (*above, *within):
        path = Path(text)
        check = changeable_within if text in within and path.exists() else changeable
        problem = check(path)
        if problem is not None:
            raise Palette4dError(
                f"{path}: {problem}. Every user's node would run what that one puts there. Install "
                "palette4d where root alone may write (sudo python3 -m venv /opt/palette4d; sudo "
                "/opt/palette4d/bin/pip install …), and run its install-plugin"
            )


def _make_open_folder(folder: Path) -> None:
    """Make a folder and its parents; root's are readable for all whatever the umask is."""
    if not folder.exists():
        if folder.parent == folder:
            raise FileNotFoundError(errno.ENOENT, "there is no such drive", str(folder))
        _make_open_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        if runs_as_root():
            folder.chmod(0o755)


def _open_for_all(bundle: Path) -> None:
    """Let all users read a bundle that was copied from an environment which may be closed."""
    for path in (bundle, *bundle.rglob("*")):
        path.chmod(0o755 if path.is_dir() or path.suffix == ".ofx" else 0o644)


def _write_program(bundle: Path) -> None:
    """Tell the node's buttons which Python has palette4d."""
    file = bundle / PROGRAM
    file.parent.mkdir(exist_ok=True)
    with replacing(file, force=True) as temporary:
        temporary.write_text(f"{sys.executable}\n", encoding="utf-8")
    # The node does not believe a file that everybody may change.
    file.chmod(0o644)


def _is_ours(target: Path) -> bool:
    """Return whether a path is a Palette4D bundle or a broken link."""
    if target.is_symlink() and not target.exists():
        return True
    return target.is_dir() and any(target.glob("Contents/*/Palette4D.ofx"))


def _replace(fresh: Path, target: Path, aside: Path) -> None:
    """Rename `fresh` to `target`; if that fails, restore the old target."""
    occupied = os.path.lexists(target)
    if occupied:
        try:
            target.rename(aside)
        except OSError as error:
            # A folder in a lower layer of an overlay, as in an image of a container, only copies.
            if error.errno != errno.EXDEV:
                raise
            shutil.copytree(target, aside, symlinks=True)
            shutil.rmtree(target)
    try:
        fresh.rename(target)
    except OSError:
        if occupied:
            aside.rename(target)
        raise
