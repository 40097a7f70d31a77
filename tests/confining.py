"""Marks of tests that need what not every system has: a sandbox, or `fork`."""

import os

import pytest

from palette4d.common import sandbox

#: Nothing that can be installed gives a kernel without Landlock a sandbox.
confines = pytest.mark.skipif(
    bool(sandbox.missing()), reason=f"this kernel has no sandbox: {sandbox.missing()}"
)
forks = pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows has no fork, and no sandbox")
