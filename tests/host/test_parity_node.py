"""The parity cases through the node: the core's bits, which tests/parity has the reference for.

Layouts, depths and alpha are in test_pictures.cpp and test_outputs.cpp. Each picture goes through
the node's bundle in the strict host, in a process of its own.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host.strict_node import StrictNode
from numpy.typing import NDArray
from parity.cases import (
    DOCUMENTS,
    EDITED,
    frames_of,
    picture,
    same_bits,
)
from parity.implementations import FAST

from palette4d.grade.document import Document

Picture = NDArray[np.float32]  # (h, w, 3 or 4)
GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"


class Node(StrictNode):
    """The road from a sidecar to a picture, through the packaged bundle."""

    def recolour(
        self,
        image: Picture,
        document: dict[str, Any],
        frame: float,
        strength: float = 1.0,
        premultiplied: bool = False,
    ) -> Picture:
        sidecar = self.folder / "p4d.json"
        sidecar.write_text(json.dumps(document), encoding="utf-8")
        alpha = ("--premultiplied", int(premultiplied))
        # The reference has colours alone: a pixel's neighbours change nothing.
        alone = ("--set", "cleanUp=0")
        # A host's first row is the picture's lowest.
        upwards = np.ascontiguousarray(image[::-1])
        drawn = self.render(sidecar, frame, upwards, "--strength", strength, *alpha, *alone)
        return drawn[::-1]


@pytest.fixture
def node(strict_host: Path, bundle: Path, tmp_path: Path) -> Node:
    return Node(strict_host, bundle, tmp_path)


def hosts_frame(document: dict[str, Any], frame: float) -> float:
    """A frame after its way through the host's time, which counts from the clip's first frame."""
    first = float(document["clip"]["frames"]["first"])
    return first + (frame - first)


@pytest.mark.parametrize("name", EDITED)
def test_at_beside_and_between_all_that_happens_the_node_is_the_core(node: Node, name: str) -> None:
    image, document = picture(4), DOCUMENTS[name]
    changed = False
    for i, time in enumerate(filter(math.isfinite, frames_of(name))):
        strength, premultiplied = ((1.0, False), (0.4, True))[i % 2]
        arguments = image, document, hosts_frame(document, time), strength, premultiplied
        found = node.recolour(*arguments)
        assert same_bits(found, FAST.recolour(*arguments)).all(), f"frame {time}"
        changed |= not same_bits(found, image).all()
    assert changed


def test_the_node_converts_as_render_does(node: Node) -> None:
    """Scene-linear light from below 0 to 50, a palette in ACEScct: every bit is the same."""
    text = (GOLDEN / "v1_scene_linear.p4d.json").read_text(encoding="utf-8")
    document = Document(json.loads(text))
    random = np.random.default_rng(7)
    image = np.exp2(random.uniform(-9, 5.6, (20, 30, 4))).astype(np.float32)
    image[:3, :, :3] -= 0.1
    image[..., 3] = random.uniform(0, 1, (20, 30)).astype(np.float32)
    for frame in (3.0, 6.25, 12.0):
        found = node.recolour(image, json.loads(text), frame, 0.8, True)
        expected = document.recolour(image, frame, strength=0.8, premultiplied=True)
        assert same_bits(found, expected).all()
        assert np.isfinite(found).all()
    assert not same_bits(node.recolour(image, json.loads(text), 6.0), image).all()


#: `Document.recolour`'s arguments, and the node's parameters for the same.
OUTPUTS: list[tuple[dict[str, Any], list[str]]] = [
    ({"keep_lightness": 1.0}, ["keepLightness=1"]),
    (
        {"keep_lightness": 0.4, "lightness_of": "rec601", "strength": 0.7},
        ["keepLightness=0.4", "lightnessOf=5", "strength=0.7"],
    ),
    (
        {"keep_lightness": 0.9, "lightness_of": "ap1", "mix": 0.6},
        ["keepLightness=0.9", "lightnessOf=4", "mix=0.6"],
    ),
    ({"mix": 0.3}, ["mix=0.3"]),
    ({"show": "weight:{vertex}"}, ["output=1", "handle01Id={vertex}"]),
    ({"show": "weight:{stop}", "mix": 0.5}, ["output=1", "handle01Id={stop}", "mix=0.5"]),
    (
        {"show": "weight:{vertex}", "matte_in": "alpha"},
        ["output=1", "handle01Id={vertex}", "matteIn=1"],
    ),
    ({"show": "outside"}, ["output=3"]),
    ({"show": "outside", "outside_at": 0.2}, ["output=3", "outsideReach=0.2"]),
    ({"show": "palette"}, ["output=2"]),
    (
        {"show": "palette", "strength": 0.5, "keep_lightness": 0.8, "lightness_of": "p3"},
        ["output=2", "strength=0.5", "keepLightness=0.8", "lightnessOf=3"],
    ),
    ({"show": "palette", "mix": 0.0}, ["output=2", "mix=0"]),
    ({"show": "palette", "strength": 0.0}, ["output=2", "strength=0"]),
]


#: The same for picks.
OF_PICKS: list[tuple[dict[str, Any], list[str]]] = [
    ({}, []),
    ({"clean_up": 0.0}, ["cleanUp=0"]),
    (
        {"clean_up": 0.4, "strength": 0.7, "keep_lightness": 0.5, "mix": 0.9},
        ["cleanUp=0.4", "strength=0.7", "keepLightness=0.5", "mix=0.9"],
    ),
    ({"show": "palette"}, ["output=2"]),
    ({"show": "pick:p1"}, ["output=4"]),
    (
        {"show": "pick:p3", "clean_up": 0.0, "mix": 0.5},
        ["output=4", "pick=3", "cleanUp=0", "mix=0.5"],
    ),
    ({"show": "pick:p1", "matte_in": "alpha"}, ["output=4", "matteIn=1"]),
]


@pytest.mark.parametrize(
    ("name", "given", "parameters"),
    [
        (name, given, parameters)
        for names, outputs in (
            (("v1_edited", "v1_scene_linear", "v1_picks"), OUTPUTS),
            (("v2_picks",), OF_PICKS),
        )
        for name in names
        for given, parameters in outputs
    ],
)
def test_every_output_of_the_node_is_the_documents(
    node: Node, name: str, given: dict[str, Any], parameters: list[str]
) -> None:
    path = GOLDEN / f"{name}.p4d.json"
    document = Document.load(path)
    stops = [stop["id"] for stop in document.grade.core.edits.stops]
    ids = {
        "vertex": document.grade.core.polytope.vertex_ids[1],
        "stop": stops[0] if stops else "v1",
    }
    image = picture(4)
    image[..., :3] *= image[..., 3:]
    given = {key: v.format(**ids) if key == "show" else v for key, v in given.items()}
    sets = [word for each in parameters for word in ("--set", each.format(**ids))]
    changed = False
    for frame in (3.0, 2.25 if name == "v2_picks" else 6.25):
        # The driver's rows count upwards.
        found = node.render(
            path,
            frame,
            np.ascontiguousarray(image[::-1]),
            *("--premultiplied", 1, *sets),
        )[::-1]
        expected = document.recolour(image, frame, premultiplied=True, **given)
        assert same_bits(found, expected).all(), f"frame {frame}"
        changed |= not same_bits(found, image).all()
    assert changed or 0 in given.values()
