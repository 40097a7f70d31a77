"""The bundle's libraries in the strict host: natively, under Wine, and under qemu."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bundles.systems import System
from numpy.typing import NDArray
from parity.cases import DOCUMENTS, EDITED, picture, times_of

#: Under qemu a test takes twenty times as long: those of pictures and of instruction sets.
QUICK = ["picture", "matte", "outputs", "files", "threads", "unload"]


@pytest.mark.parametrize(
    ("name", "which"), [("linux", []), ("windows", ["-refused_in_turn"]), ("aarch64", QUICK)]
)
def test_the_strict_hosts_tests_pass(
    name: str, which: list[str], bundle: Path, request: pytest.FixtureRequest
) -> None:
    system: System = request.getfixturevalue(name)
    done = system.run("palette4d_host_tests", system.path(bundle), system.folder, *which)
    assert done.returncode == 0, done.stdout[-4000:]
    assert "ok    " in done.stdout


def rendered(
    system: System, bundle: Path, folder: Path, sidecar: Path, frame: float, *options: str
) -> NDArray[np.float32]:
    """The picture of `parity.cases` through a system's library."""
    image = picture(4)
    source, output = folder / "in.raw", folder / "out.raw"
    image.tofile(source)
    output.unlink(missing_ok=True)
    height, width, _ = image.shape
    done = system.run(
        *("strict_host", "render", system.path(bundle), system.path(sidecar)),
        *("--frame", repr(frame), "--width", str(width), "--height", str(height), *options),
        *(system.path(source), system.path(output)),
    )
    assert done.returncode == 0, done.stdout
    assert "message:" not in done.stdout, done.stdout
    return np.fromfile(output, np.float32).reshape(image.shape)


@pytest.mark.parametrize("name", ["windows", "aarch64"])
@pytest.mark.parametrize("case", EDITED[:: max(1, len(EDITED) // 5)])
def test_pictures_are_those_of_linux(
    name: str,
    case: str,
    bundle: Path,
    linux: System,
    tmp_path: Path,
    request: pytest.FixtureRequest,
) -> None:
    system: System = request.getfixturevalue(name)
    sidecar = tmp_path / "case 色.p4d.json"
    sidecar.write_text(json.dumps(DOCUMENTS[case]), encoding="utf-8")
    for frame in times_of(case)[:3]:
        expected = rendered(linux, bundle, tmp_path, sidecar, frame)
        found = rendered(system, bundle, tmp_path, sidecar, frame)
        np.testing.assert_array_equal(found, expected, err_msg=f"frame {frame}")
