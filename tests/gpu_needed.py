"""What the GPU's tests need of the system; CI must have all of it."""

import os
from typing import NoReturn

import pytest


def lacks(what: str) -> NoReturn:
    """Skip a test for what this machine lacks; fail it where PALETTE4D_REQUIRE_GPU is 1."""
    assert os.environ.get("PALETTE4D_REQUIRE_GPU") != "1", what
    pytest.skip(what)
