"""Fixtures of the host tests: the packaged bundle, melt, and the strict host's driver."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from host.melt import MeltUnavailableError, bring_melt
from palette4d import plugin_install


@pytest.fixture(scope="session")
def bundle() -> Path:
    """The OpenFX bundle inside the installed package."""
    return plugin_install.find_bundle()


@pytest.fixture(scope="session")
def melt() -> Path:
    """The program melt; fetched once into the cache folder (about 70 MB to download)."""
    try:
        return bring_melt()
    except MeltUnavailableError as error:
        reason = f"melt, a real OpenFX host, is not to be had here: {error}"
    if os.environ.get("PALETTE4D_REQUIRE_HOST", "") not in ("", "0"):
        pytest.fail(reason)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def strict_host(repo_root: Path) -> Path:
    """The strict host's driver, built with the C++ tests (in $PALETTE4D_BUILD_DIR)."""
    build = Path(os.environ.get("PALETTE4D_BUILD_DIR") or repo_root / "build" / "cmake" / "test")
    driver = build / "tests" / "host" / "strict_host"
    if not driver.exists():
        pytest.skip(
            f"the strict host is not built: no {driver} (make test-cpp, or PALETTE4D_BUILD_DIR)"
        )
    return driver
