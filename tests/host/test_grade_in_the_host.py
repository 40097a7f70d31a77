"""A grade made with the node's own parameters is the one that `palette4d render` makes of the same
edits in the sidecar, to the bit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from host.strict_node import StrictNode
from host.test_melt_render import palette4d
from numpy.typing import NDArray

FRAME = 15.0
Float = NDArray[np.float32]


def write_exr(path: Path, image: Float) -> None:
    spec = oiio.ImageSpec(image.shape[1], image.shape[0], image.shape[2], "float")
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(np.ascontiguousarray(image))
    assert output.close()


def read_exr(path: Path) -> Float:
    source = oiio.ImageInput.open(str(path))
    assert source, oiio.geterror()
    image = np.asarray(source.read_image("float"))
    source.close()
    return image


@pytest.fixture
def picture() -> Float:
    """(29, 41, 3), also below 0 and above 1."""
    random = np.random.default_rng(21)
    return (random.random((29, 41, 3)) * 1.6 - 0.3).astype(np.float32)


def test_handles_of_the_host_are_edits_of_the_sidecar(
    strict_host: Path, bundle: Path, repo_root: Path, tmp_path: Path, picture: Float
) -> None:
    golden = repo_root / "tests" / "golden" / "sidecars" / "v1_split.p4d.json"
    plain, edited = tmp_path / "plain.p4d.json", tmp_path / "edited.p4d.json"
    document = json.loads(golden.read_text())
    assert document["edits"] == {"vertices": [], "stops": []}
    for path in (plain, edited):
        path.write_bytes(golden.read_bytes())
    vertices = [vertex["id"] for vertex in document["polytope"]["vertices"]]
    grade = {"v12": "0.31,0.07,1.25", "v13": "-0.1,0.62,0.4", "v16": "0.9,0.2,0.05"}
    settings = []
    for name, colour in grade.items():
        palette4d("edit", edited, "set", name, "--rgb", *colour.split(","))
        slot = f"handle{vertices.index(name) + 1:02}"
        settings += [f"{slot}={colour}", f"{slot}On=1"]

    write_exr(tmp_path / "frame.0015.exr", picture)
    palette4d("render", edited, tmp_path / "frame.####.exr", "-o", tmp_path / "graded.####.exr")
    by_the_command = read_exr(tmp_path / "graded.0015.exr")
    assert not np.array_equal(by_the_command, picture)

    through = StrictNode(strict_host, bundle, tmp_path)

    def node(sidecar: Path, *more: str) -> Float:
        settings = (word for setting in more for word in ("--set", setting))
        return through.render(sidecar, FRAME, picture, *settings)

    assert node(plain, *settings).tobytes() == by_the_command.tobytes()
    assert node(edited).tobytes() == by_the_command.tobytes()
    # Off, or told to go by the sidecar: nothing is edited there.
    assert node(plain, *settings, "editsFrom=0").tobytes() == picture.tobytes()
    assert node(edited, "editsFrom=1").tobytes() == picture.tobytes()
