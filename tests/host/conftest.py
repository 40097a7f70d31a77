"""Fixtures of the host tests: the packaged bundle, melt, and the strict host's driver."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from host.melt import MeltUnavailableError, bring_melt

from palette4d.hosts.bundle import find_bundle


@pytest.fixture(scope="session")
def bundle() -> Path:
    """The OpenFX bundle inside the installed package, or the one that PALETTE4D_BUNDLE names."""
    given = os.environ.get("PALETTE4D_BUNDLE")
    return Path(given) if given else find_bundle()


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


def built(repo_root: Path, name: str) -> Path:
    """What the C++ tests' build made for the tests of the host (in $PALETTE4D_BUILD_DIR)."""
    build = Path(os.environ.get("PALETTE4D_BUILD_DIR") or repo_root / "build" / "cmake" / "test")
    path = build / "tests" / "host" / name
    if not path.exists():
        pytest.skip(f"{name} is not built: no {path} (make test-cpp, or PALETTE4D_BUILD_DIR)")
    return path


@pytest.fixture(scope="session")
def strict_host(repo_root: Path) -> Path:
    """The strict host's driver."""
    return built(repo_root, "strict_host")


@pytest.fixture(scope="session")
def idle_bundle(repo_root: Path) -> Path:
    """The bundle of an effect that does nothing, org.palette4d.tests.Idle."""
    return built(repo_root, "Idle.ofx.bundle")
