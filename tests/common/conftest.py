"""What the tests of files share."""

from pathlib import Path

import pytest


@pytest.fixture
def old(tmp_path: Path) -> Path:
    """A file that is to be replaced; no code page of the West holds its name."""
    path = tmp_path / "Grüße 色.cube"
    path.write_bytes(b"old")
    return path
