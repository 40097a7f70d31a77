"""The verb `install-plugin`: the OpenFX node, and its files for Kdenlive and Shotcut."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from palette4d.common.text import quoted
from palette4d.hosts.bundle import SEARCH_PATH, default_destination, system_destination
from palette4d.hosts.install import install_plugin

_EPILOG = """\
examples:
  palette4d install-plugin --dest ~/OFX           for yourself; then export OFX_PLUGIN_PATH=~/OFX
  sudo /opt/palette4d/bin/palette4d install-plugin
                                                  for every user, where all hosts look, from an
                                                  environment that root alone may change
                                                  (on Windows: as an administrator, without sudo)
  palette4d install-plugin --dest ~/OFX --link    follows this installation when it is upgraded
  palette4d install-plugin --dest ~/OFX --kdenlive --shotcut
                                                  the node, and files for these two programs
  palette4d install-plugin --kdenlive             that file alone, in ~/.local/share (or in
                                                  $XDG_DATA_HOME); not with sudo

Without its file Kdenlive has no way to choose a sidecar, and its choices do nothing. Without its
filter Shotcut has to be started with --experimental, and the sidecar's path has to be typed. In
both cases Shotcut needs Settings > Allow External Plugins.
"""


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
        type=lambda text: Path(text).expanduser(),
        metavar="DIR",
        help="folder of plugins, such as ~/OFX for yourself (default: the first of "
        f"OFX_PLUGIN_PATH, else the one for all users; here {default_destination()})".replace(
            "%", "%%"
        ),
    )
    parser.add_argument("--link", action="store_true", help="make a symbolic link, not a copy")
    for program, what in (("kdenlive", "effect file"), ("shotcut", "filter")):
        parser.add_argument(
            f"--{program}",
            nargs="?",
            type=Path,
            const=True,
            default=False,
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
    """Install, and print the next steps in the host."""
    if args.dest is None and not (args.kdenlive or args.shotcut):
        folder = default_destination()
        of_all = folder == system_destination()
        print(
            f"{'for all users of this machine' if of_all else f'for hosts with {SEARCH_PATH}'}, "
            f"into {folder}; --dest DIR installs elsewhere, such as for yourself"
        )
    for path in install_plugin(
        args.dest, link=args.link, kdenlive=args.kdenlive, shotcut=args.shotcut, force=args.force
    ):
        print(f"installed {path}")
    if args.dest or not (args.kdenlive or args.shotcut):
        if args.dest and args.dest != system_destination():  # there hosts look by themselves
            say = "setx OFX_PLUGIN_PATH " if sys.platform == "win32" else "export OFX_PLUGIN_PATH="
            print(f"Tell your host where it is: {say}{quoted(args.dest.absolute())}")
        print(
            "Restart the host (DaVinci Resolve, Nuke, Natron, Fusion, Kdenlive, …), add the node\n"
            "'Palette4D' (group Color) and choose a sidecar made by 'palette4d analyze'."
        )
    if args.kdenlive:
        print("Restart Kdenlive; the effect is 'Palette4D', in the group Misc.")
    if args.shotcut:
        print(
            "Restart Shotcut with Settings > Allow External Plugins on; the filter is 'Palette4D'."
        )
    return 0
