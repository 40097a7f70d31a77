"""The verb `install-plugin`: puts the OpenFX bundle where hosts look for it.

The bundle lies inside the package (`palette4d/_ofx`). It is copied beside its destination first and
then renamed into place, so that a host never scans half a bundle. For Kdenlive and Shotcut the
verb also writes the files that let them show the node's parameters (`palette4d.hosts`).
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import sys
import tempfile
from importlib import resources
from pathlib import Path
from typing import Literal

from palette4d.common.errors import Palette4dError
from palette4d.hosts.editors import data_folder, install_kdenlive, install_shotcut

BUNDLE = "Palette4D.ofx.bundle"

_EPILOG = """\
examples:
  sudo palette4d install-plugin                   for every user, where all hosts look
  palette4d install-plugin --dest ~/OFX           for yourself; then export OFX_PLUGIN_PATH=~/OFX
  palette4d install-plugin --dest ~/OFX --link    follows this installation when it is upgraded
  palette4d install-plugin --dest ~/OFX --kdenlive --shotcut
                                                  the node, and files for these two programs
  palette4d install-plugin --kdenlive             that file alone, in ~/.local/share (or where
                                                  XDG_DATA_HOME says); not with sudo

Without its file Kdenlive has no way to choose a sidecar, and its choices do nothing. Without its
filter Shotcut has to be started with --experimental, and the sidecar's path has to be typed; with
it or without, Settings > Allow External Plugins must be on.
"""

_KDENLIVE_NOTE = """\
Restart Kdenlive; the effect is 'Palette4D', in the group Misc."""

_SHOTCUT_NOTE = """\
Restart Shotcut with Settings > Allow External Plugins on; the filter is 'Palette4D'."""


def default_destination(platform: str = sys.platform) -> Path:
    """The folder in which the OpenFX standard lets hosts look on a platform (`sys.platform`)."""
    if platform == "win32":
        return Path("C:/Program Files/Common Files/OFX/Plugins")
    if platform == "darwin":
        return Path("/Library/OFX/Plugins")
    return Path("/usr/OFX/Plugins")


def find_bundle() -> Path:
    """Return the bundle inside the installed package.

    Raises
    ------
    Palette4dError
        When this installation holds no bundle, or not as files.
    """
    for root in _bundle_roots():
        bundle = root / BUNDLE
        if any(bundle.glob("Contents/*/*.ofx")):
            return bundle
    raise Palette4dError(
        f"found no {BUNDLE} in the installed package palette4d, expected it in palette4d/_ofx; "
        "install palette4d again from a wheel built with PALETTE4D_BUILD_PLUGIN=ON (the default)"
    )


def _bundle_roots() -> list[Path]:
    """Folders `palette4d/_ofx`: one, or two in an editable installation."""
    resource = resources.files("palette4d") / "_ofx"
    if isinstance(resource, Path):
        return [resource]
    # An editable installation spreads the package over the source tree and site-packages; such a
    # resource is a MultiplexedPath, which yields the files' real paths only.
    found = []
    with contextlib.suppress(OSError, AttributeError):
        found = [entry for entry in resource.iterdir() if isinstance(entry, Path)]
    return [entry.parent for entry in found]


def install(bundle: Path, destination: Path, *, link: bool = False, force: bool = False) -> Path:
    """Copy or link the bundle into a plugin folder.

    Parameters
    ----------
    bundle : Path
        The bundle to install.
    destination : Path
        The folder of plugins; made when it is missing.
    link : bool
        Make a symbolic link instead of a copy.
    force : bool
        Replace something at the destination that is not an earlier Palette4D bundle.

    Returns
    -------
    Path
        The installed bundle.

    Raises
    ------
    Palette4dError
        When the destination is occupied, may not be written to or is no folder.
    """
    bundle = bundle.resolve()
    target = destination / BUNDLE
    try:
        destination.mkdir(parents=True, exist_ok=True)
        if target.exists() and target.resolve() == bundle and link:
            return target
        if os.path.lexists(target) and not force and not _is_ours(target):
            raise Palette4dError(
                f"{target}: found something that is not an OpenFX bundle of Palette4D, "
                "expected nothing or an earlier version; pass --force to replace it"
            )
        # Beside the target, so that the rename stays on one file system.
        with tempfile.TemporaryDirectory(prefix=".palette4d-", dir=destination) as temporary:
            fresh = Path(temporary) / BUNDLE
            if link:
                fresh.symlink_to(bundle, target_is_directory=True)
            else:
                shutil.copytree(bundle, fresh)
            _replace(fresh, target, Path(temporary) / "old")
    except PermissionError as error:
        raise Palette4dError(
            f"{destination}: may not be written to ({error.strerror}); run the command as an "
            "administrator (sudo), or give a folder of your own with --dest and name it in the "
            "environment variable OFX_PLUGIN_PATH"
        ) from error
    except OSError as error:
        raise Palette4dError(f"{target}: cannot be installed: {error}") from error
    return target


def _is_ours(target: Path) -> bool:
    """Tell a Palette4D bundle, or a link that leads nowhere any more, from anything else."""
    if target.is_symlink() and not target.exists():
        return True
    return target.is_dir() and any(target.glob("Contents/*/Palette4D.ofx"))


def _replace(fresh: Path, target: Path, aside: Path) -> None:
    """Rename `fresh` to `target`; what was there is put aside, and back when the rename fails."""
    occupied = os.path.lexists(target)
    if occupied:
        target.rename(aside)
    try:
        fresh.rename(target)
    except OSError:
        if occupied:
            aside.rename(target)
        raise


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb to the command line."""
    parser = subparsers.add_parser(
        "install-plugin",
        help="install the OpenFX node for your grading hosts",
        description="Install the OpenFX node (Palette4D) into a folder in which hosts look for "
        "plugins.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--dest",
        type=Path,
        metavar="DIR",
        help=f"folder of plugins (default here: {default_destination()})",
    )
    parser.add_argument("--link", action="store_true", help="make a symbolic link, not a copy")
    for program, what in (("kdenlive", "effect file"), ("shotcut", "filter")):
        parser.add_argument(
            f"--{program}",
            nargs="?",
            type=Path,
            const=True,
            metavar="DIR",
            help=f"write {program.capitalize()}'s {what}, into DIR or where the program looks for "
            "your own; without --dest, the node itself is not installed",
        )
    parser.add_argument(
        "--force",
        action="store_true",
        help="replace whatever has the bundle's name, or the files' names, there",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Install, and say what to do in the host."""
    if args.dest or not (args.kdenlive or args.shotcut):
        _install_node(args)
    elif args.link:
        raise Palette4dError("--link is for the node; add --dest DIR, or leave it out")
    if args.kdenlive:
        folder = _program_folder(args.kdenlive, "kdenlive")
        _tell(install_kdenlive(folder, force=args.force), _KDENLIVE_NOTE)
    if args.shotcut:
        folder = _program_folder(args.shotcut, "shotcut")
        _tell(install_shotcut(folder, force=args.force), _SHOTCUT_NOTE)
    return 0


def _install_node(args: argparse.Namespace) -> None:
    standard = default_destination()
    destination = args.dest.expanduser().absolute() if args.dest else standard
    target = install(find_bundle(), destination, link=args.link, force=args.force)
    print(f"installed {target}")
    if destination != standard:
        print(f"Tell your host where it is: export OFX_PLUGIN_PATH={destination}")
    print(
        "Restart the host (DaVinci Resolve, Nuke, Natron, Fusion, Kdenlive, …), add the node\n"
        "'Palette4D' (group Color) and choose a sidecar made by 'palette4d analyze'."
    )


def _program_folder(given: Path | Literal[True], program: str) -> Path:
    """The folder that was named, or the program's own where none was."""
    return data_folder(program) if given is True else given.expanduser().absolute()


def _tell(written: list[Path], note: str) -> None:
    for path in written:
        print(f"installed {path}")
    print(note)
