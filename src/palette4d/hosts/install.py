"""Installs the OpenFX node, and what Kdenlive and Shotcut need besides."""

from __future__ import annotations

import os
from pathlib import Path

from palette4d.common.errors import Arg, Palette4dError
from palette4d.hosts.bundle import default_destination, find_bundle, install_bundle
from palette4d.hosts.editors import data_folder, install_kdenlive, install_shotcut


def install_plugin(
    dest: str | os.PathLike[str] | None = None,
    *,
    link: bool = False,
    kdenlive: bool | str | os.PathLike[str] = False,
    shotcut: bool | str | os.PathLike[str] = False,
    force: bool = False,
) -> list[Path]:
    """Install the OpenFX node, and files for two editing programs.

    Parameters
    ----------
    dest : path, optional
        The folder of plugins; by default the first that hosts look in: of OFX_PLUGIN_PATH, else
        the system's. Without `dest`, and with `kdenlive` or `shotcut`, the node itself is not
        installed.
    link : bool
        Make a symbolic link to this installation instead of a copy.
    kdenlive, shotcut : bool or path
        Write this program's files, into the given folder or where the program looks.
    force : bool
        Replace whatever has these names there.

    Returns
    -------
    list of Path
        The node's bundle and the files.

    Raises
    ------
    Palette4dError
        A folder is not writable, or holds something else of the same name.
    """
    done = []
    if dest is not None or not (kdenlive or shotcut):
        folder = default_destination() if dest is None else _folder(dest)
        done.append(install_bundle(find_bundle(), folder, link=link, force=force))
    elif link:
        raise Palette4dError(
            f"{Arg('link', True)} is for the node; add {Arg('dest')}, or leave it out"
        )
    for program, given, install in (
        ("kdenlive", kdenlive, install_kdenlive),
        ("shotcut", shotcut, install_shotcut),
    ):
        if given:
            folder = data_folder(program) if given is True else _folder(given)
            done += install(folder, force=force)
    return done


def _folder(path: str | os.PathLike[str]) -> Path:
    return Path(path).expanduser().absolute()
