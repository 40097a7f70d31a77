"""Installs the files of `kdenlive` and `shotcut` where those programs look for them."""

import os
import sys
from pathlib import Path

from palette4d._core import __version__
from palette4d.common import folders
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.files import make_folder, replacing
from palette4d.common.json_files import UnusableFile, read_regular
from palette4d.hosts import MARK, kdenlive, shotcut


def data_folder(program: str, platform: str = sys.platform) -> Path:
    """Return the user's folder from which "kdenlive" or "shotcut" loads effects or filters."""
    if program == "kdenlive":  # Qt's AppDataLocation
        return folders.data_folder(platform, roaming=True) / "kdenlive/effects"
    # Qt's AppLocalDataLocation
    return folders.data_folder(platform) / "Meltytech/Shotcut/extensions/filters"


def install_kdenlive(folder: Path, *, force: bool = False) -> list[Path]:
    """Write Kdenlive's effect file into a folder of effects; return the written files.

    `force` replaces a file of that name that palette4d has not written.
    """
    return _write(folder, {kdenlive.FILE: kdenlive.effect_file(__version__)}, force)


def install_shotcut(folder: Path, *, force: bool = False) -> list[Path]:
    """Write Shotcut's filter, a folder of its own, as `install_kdenlive` does."""
    return _write(folder / shotcut.FOLDER, shotcut.filter_files(__version__), force)


def _write(folder: Path, texts: dict[str, str], force: bool) -> list[Path]:
    """Write all files, or none if one of them would replace another program's file."""
    make_folder(folder)
    paths = [folder / name for name in texts]
    for path in paths:
        if os.path.lexists(path) and not force and not _is_ours(path):
            raise Palette4dError(
                f"{path}: found something that palette4d has not written, expected nothing or an "
                f"earlier version; replace it with {Arg('force', True)}"
            )
    for path, text in zip(paths, texts.values(), strict=True):
        with replacing(path, force=True) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return paths


def _is_ours(path: Path) -> bool:
    """Whether the first lines of a file say that palette4d wrote it."""
    try:
        return MARK.encode() in read_regular(path)[:500]
    except (OSError, UnusableFile):
        return False
