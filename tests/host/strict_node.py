"""The node in the strict host: its description, and pictures, each in a process of its own."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[Any]  # (h, w, 3 or 4) float32 or uint8


def described(driver: Path, bundle: Path) -> dict[str, dict[str, Any]]:
    """The parameters that the node describes, by their names (`describe_json.hpp`)."""
    done = subprocess.run(
        [driver, "describe", bundle], capture_output=True, encoding="utf-8", check=False
    )
    assert done.returncode == 0, done.stderr
    parameters: dict[str, dict[str, Any]] = json.loads(done.stdout)
    return parameters


@dataclass(frozen=True)
class StrictNode:
    """The strict host's driver, the packaged bundle, and a folder for pictures."""

    driver: Path
    bundle: Path
    folder: Path

    def render(self, sidecar: Path, frame: float, image: Picture, *options: object) -> Picture:
        """What the node makes of a picture, which the driver's other `options` tell more of."""
        source, output = self.folder / "in.raw", self.folder / "out.raw"
        output.unlink(missing_ok=True)
        image.tofile(source)
        height, width, channels = image.shape
        done = subprocess.run(
            [
                *(self.driver, "render", self.bundle, sidecar, "--frame", repr(float(frame))),
                *("--width", str(width), "--height", str(height)),
                *("--components", {3: "RGB", 4: "RGBA"}[channels]),
                *("--depth", {np.uint8: "byte", np.float32: "float"}[image.dtype.type]),
                *(*map(str, options), source, output),
            ],
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert "message:" not in done.stdout, done.stdout
        return np.fromfile(output, image.dtype).reshape(image.shape)
