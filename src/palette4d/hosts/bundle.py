"""The OpenFX bundle: its place in the package, the folders of hosts, and its installation.

The bundle is first copied beside its destination and then renamed. So a host never scans an
incomplete bundle.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from pathlib import Path

from palette4d import _core
from palette4d.common.errors import Palette4dError

BUNDLE = "Palette4D.ofx.bundle"


def default_destination(platform: str = sys.platform) -> Path:
    """The plugin folder of the OpenFX standard on a platform (`sys.platform`)."""
    if platform == "win32":
        return Path("C:/Program Files/Common Files/OFX/Plugins")
    if platform == "darwin":
        return Path("/Library/OFX/Plugins")
    return Path("/usr/OFX/Plugins")


def find_bundle() -> Path:
    """Return the bundle inside the installed package."""
    # It lies beside the compiled module, which in an editable installation is not in the sources.
    bundle = Path(_core.__file__).parent / "_ofx" / BUNDLE
    if any(bundle.glob("Contents/*/*.ofx")):
        return bundle
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
    try:
        destination.mkdir(parents=True, exist_ok=True)
        if target.exists() and target.resolve() == bundle and link:
            return target
        if os.path.lexists(target) and not force and not _is_ours(target):
            raise Palette4dError(
                f"{target}: found something that is not an OpenFX bundle of Palette4D, "
                "expected nothing or an earlier version; replace it with force=True"
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
            f"{destination}: may not be written to; run the command as an administrator (sudo), or "
            "give a folder of your own with dest=… and name it in the environment variable "
            "OFX_PLUGIN_PATH"
        ) from error
    except OSError as error:
        raise Palette4dError(
            f"{target}: cannot be installed ({error.strerror}); choose another folder with dest=…"
        ) from error
    return target


def _is_ours(target: Path) -> bool:
    """Return whether a path is a Palette4D bundle or a broken link."""
    if target.is_symlink() and not target.exists():
        return True
    return target.is_dir() and any(target.glob("Contents/*/Palette4D.ofx"))


def _replace(fresh: Path, target: Path, aside: Path) -> None:
    """Rename `fresh` to `target`; if that fails, restore the old target."""
    occupied = os.path.lexists(target)
    if occupied:
        target.rename(aside)
    try:
        fresh.rename(target)
    except OSError:
        if occupied:
            aside.rename(target)
        raise
