"""The bundle for every system: `make test-bundles` builds it and names it in PALETTE4D_BUNDLE.

Without that variable no test is collected here, and without PALETTE4D_WHEELS (`make test-wheels`)
none of the wheels, of the folder for Linux and of the app for macOS. What is missing on this
machine is an error that says what to install; no test skips.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from bundles.systems import System, needed, wine_path

GIVEN = os.environ.get("PALETTE4D_BUNDLE")
collect_ignore_glob = [] if GIVEN else ["test_*.py"]
if not os.environ.get("PALETTE4D_WHEELS"):
    collect_ignore_glob += ["test_wheels.py", "test_linux_folder.py", "test_macos_app.py"]


@pytest.fixture(scope="session")
def bundle() -> Path:
    return Path(GIVEN or "")


@pytest.fixture(scope="session")
def linux(repo_root: Path, tmp_path_factory: pytest.TempPathFactory) -> System:
    build = Path(os.environ.get("PALETTE4D_BUILD_DIR") or repo_root / "build" / "cmake" / "test")
    return System(build, "", [], {}, str, str(tmp_path_factory.mktemp("linux")))


@pytest.fixture(scope="session")
def aarch64(repo_root: Path, tmp_path_factory: pytest.TempPathFactory) -> System:
    emulator = needed("qemu-aarch64", "qemu-user and libc6-arm64-cross")
    libraries = Path("/usr/aarch64-linux-gnu")
    if not (libraries / "lib" / "libc.so.6").exists():
        pytest.fail(f"{libraries} has no C library; install Debian's package libc6-arm64-cross")
    build = repo_root / "build" / "cmake" / "linux-aarch64"
    folder = str(tmp_path_factory.mktemp("aarch64"))
    return System(build, "", [emulator, "-L", str(libraries)], {}, str, folder)


@pytest.fixture(scope="session")
def windows(repo_root: Path, tmp_path_factory: pytest.TempPathFactory) -> System:
    """Wine, with folders whose names no code page of the West holds."""
    wine = needed("wine", "wine and wine64")
    environment = {
        "WINEPREFIX": str(tmp_path_factory.mktemp("wine")),
        "WINEDEBUG": "-all",
        "WINEDLLOVERRIDES": "mscoree,mshtml=",
        # File names in UTF-8; otherwise Wine cannot make ours.
        "LC_ALL": "C.UTF-8",
    }
    build = repo_root / "build" / "cmake" / "windows"
    return System(
        build, ".exe", [wine], environment, wine_path, r"C:\users\Public\Grüße 色 🎨\palette4d"
    )
