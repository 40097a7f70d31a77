"""Any bytes at all for the readers written in Python: a refusal, or something that can be used.

The inputs are mutations of tests/fuzz/readers/, the same in every run. PALETTE4D_FUZZ_SECONDS=N
makes others for N seconds, by PALETTE4D_FUZZ_SEED.
"""

from __future__ import annotations

import collections
import os
import tempfile
import time
from pathlib import Path

import pytest
import reader_targets

from palette4d.common.child import Child, ChildError

#: Inputs in a call of the child process; a call's seconds, and its MB.
BATCH, SECONDS, MEGABYTES = 50, 60, 1024
#: In memory: the readers' files are many, and synced.
MEMORY = Path("/dev/shm")


@pytest.mark.parametrize("inputs", [400, pytest.param(100_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", ["verbs", "manifest", "index", "correction", "otio", "edl"])
def test_any_bytes(kind: str, inputs: int) -> None:
    seconds = float(os.environ.get("PALETTE4D_FUZZ_SECONDS") or 0)
    seed = os.environ.get("PALETTE4D_FUZZ_SEED", "")
    ends = time.monotonic() + seconds
    outcomes: collections.Counter[str] = collections.Counter()
    number = crashes = 0
    batch = BATCH
    if kind == "verbs":  # a second for each that is accepted
        inputs, batch = inputs // 10, 10
    with (
        tempfile.TemporaryDirectory(dir=MEMORY if os.access(MEMORY, os.W_OK) else None) as name,
        Child(SECONDS, MEGABYTES) as child,
    ):
        folder = Path(name)
        while time.monotonic() < ends if seconds else number < inputs:
            try:
                outcomes.update(child.call(reader_targets.many, kind, seed, number, batch, folder))
                number += batch
            except ChildError as error:
                at = int((folder / "number").read_text())
                found = (folder / f"input.{kind}").read_bytes()
                # OpenTimelineIO crashes in a child process of the command, too.
                if kind not in ("otio", "edl") or "longer" in str(error):
                    pytest.fail(f"input {at}, {found!r}: {error}")
                crashes += 1
                number = at + 1
    assert outcomes["accepted"]
    print(f"{kind}: {number} inputs, {outcomes['accepted']} accepted, {crashes} crashes")
