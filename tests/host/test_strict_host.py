"""The parity cases through the node, in the strict host: the same bytes as the compiled core."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from host.strict_node import Picture, StrictNode
from numpy.typing import NDArray

from palette4d import _core
from palette4d.media.frame_writer import quantised

FORMATS = (
    ("RGBA", "float", ()),
    ("RGB", "float", ()),
    ("RGBA", "byte", ()),
    ("RGBA", "float", ("--premultiplied", "1")),
    (
        *("RGBA", "float"),
        ("--upside-down", "1", "--padding", "24", "--origin", "-7,5", "--tile", "9"),
    ),
)


def picture(channels: int, depth: str) -> NDArray[np.float32] | NDArray[np.uint8]:
    random = np.random.default_rng(11)
    if depth == "byte":
        return random.integers(0, 256, (27, 31, channels), np.uint8)
    image = (random.random((27, 31, channels)) * 1.8 - 0.4).astype(np.float32)
    image[3, 4, 0] = np.nan
    image[5, 6, 1] = np.inf
    image[7, 8, 2] = -np.inf
    return image


def through_the_core(
    path: Path,
    frame: float,
    image: NDArray[np.float32] | NDArray[np.uint8],
    strength: float,
    premultiplied: bool,
) -> bytes:
    sidecar = _core.read_sidecar(str(path))
    cut = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, sidecar.edits, cut)
    picks = sidecar.picks_at(cut.frame)
    recolourer = _core.Recolourer(cut.rgb, edited, cut.faces, picks=picks)
    conversion = None if sidecar.conversion is None else sidecar.conversion.steps

    def apply(values: Picture) -> Picture:
        # The driver's rows count upwards.
        drawn = _core.draw(
            values[::-1],
            "recoloured",
            recolourer,
            strength=strength,
            premultiplied=premultiplied,
            conversion=conversion,
        )
        return np.ascontiguousarray(drawn[::-1])

    if image.dtype == np.float32:
        return apply(image).tobytes()
    return quantised(apply(image.astype(np.float32) / np.float32(255)), "uint8").tobytes()


def golden() -> list[Path]:
    folder = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
    return sorted(folder.glob("v*_*.p4d.json"))


@pytest.mark.parametrize("path", golden(), ids=lambda path: path.name.split(".")[0])
def test_the_nodes_bytes_are_the_cores(
    strict_host: Path, bundle: Path, tmp_path: Path, path: Path
) -> None:
    node = StrictNode(strict_host, bundle, tmp_path)
    polytope = _core.read_sidecar(str(path)).polytope
    first, last = polytope.first_frame, polytope.last_frame
    parts = (0.0, 0.375, 0.5, 0.375, 1.0)
    for (components, depth, options), part in zip(FORMATS, parts, strict=True):
        image = picture(len(components), depth)
        frame = float(first + round((last - first) * part * 4) / 4)
        strength = 0.75 if part == 0.5 else 1.0
        found = node.render(path, frame, image, "--strength", strength, *options)
        expected = through_the_core(path, frame, image, strength, "--premultiplied" in options)
        assert found.tobytes() == expected, (depth, options)


def test_the_driver_says_what_is_wrong(strict_host: Path, bundle: Path, tmp_path: Path) -> None:
    (tmp_path / "in.raw").write_bytes(b"too short")
    done = subprocess.run(
        [
            *(strict_host, "render", bundle, "x.json", "--width", "8", "--height", "8"),
            *(tmp_path / "in.raw", tmp_path / "out.raw"),
        ],
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 1
    assert "expected width x height" in done.stderr
