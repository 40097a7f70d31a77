"""Fixtures of the analysis' tests."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="session")
def tool(repo_root: Path) -> ModuleType:
    """`docs/sidecar_fields.py`, which writes a schema's table into its page."""
    spec = importlib.util.spec_from_file_location(
        "sidecar_fields", repo_root / "docs/sidecar_fields.py"
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
