"""Conversions from a clip's code values to its palette's: the core against plain NumPy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from parity import reference

from palette4d import _core

GOLDEN = Path(__file__).resolve().parents[1] / "golden" / "sidecars"
Document = dict[str, Any]


def golden(name: str) -> Document:
    document: Document = json.loads((GOLDEN / f"v1_{name}.p4d.json").read_text(encoding="utf-8"))
    return document


def colours() -> np.ndarray[Any, np.dtype[np.float32]]:
    random = np.random.default_rng(8)
    light = np.exp2(random.uniform(-12, 6, (150, 1))) * random.uniform(0.1, 1, (150, 3))
    around = random.uniform(-0.4, 1.6, (100, 3))
    plain = [[0, 0, 0], [-0.0, -3, 1e-30], [50, 0.18, -0.02], [1, 1, 1], [0.0078125] * 3]
    return np.concatenate([light, around, plain]).astype(np.float32)


@pytest.mark.parametrize("name", ["scene_linear", "every_step"])
def test_the_core_converts_as_the_reference(name: str) -> None:
    steps = golden(name)["clip"]["conversion"]["steps"]
    chain = _core.ColourConversion(json.dumps(steps))
    points = colours().astype(np.float64)
    if name == "every_step":  # its clip is in a camera's log
        points = np.clip(points, -0.3, 1.3)
    there = chain.to_palette(points)
    np.testing.assert_allclose(
        there, [reference.convert(steps, p) for p in points], rtol=1e-9, atol=1e-9
    )
    np.testing.assert_allclose(
        chain.to_clip(there), [reference.convert(steps, q, True) for q in there],
        rtol=1e-9, atol=1e-9,
    )  # fmt: skip
    np.testing.assert_allclose(chain.to_clip(there), points, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize(("channels", "premultiplied"), [(3, False), (4, False), (4, True)])
def test_the_core_recolours_between_conversions(
    precision: Any, channels: int, premultiplied: bool
) -> None:
    document = golden("scene_linear")
    sidecar = _core.parse_sidecar(json.dumps(document), "case")
    assert sidecar.conversion is not None
    steps, frame = document["clip"]["conversion"]["steps"], 6.0
    pixels = colours()
    alpha = np.random.default_rng(2).uniform(0.2, 1, (len(pixels), 1)).astype(np.float32)
    image = pixels if channels == 3 else np.concatenate([pixels, alpha], axis=1)
    image = np.ascontiguousarray(image[None])
    cut = _core.slice_at(sidecar.polytope, frame)
    edited = _core.edited_colours(sidecar.polytope, sidecar.edits, cut)
    recolourer = _core.Recolourer(cut.rgb, edited, cut.faces)
    way: dict[str, Any] = {"premultiplied": premultiplied, "conversion": sidecar.conversion.steps}
    found = recolourer.apply(image, precision=precision, **way)

    straight = pixels.astype(float) / (alpha.astype(float) if premultiplied else 1)
    palette = np.array([reference.convert(steps, p) for p in straight])
    weights, _ = reference.palette_weights(palette, cut.rgb, cut.faces)
    moved = palette + weights @ (edited - cut.rgb)
    expected = np.array([reference.convert(steps, q, True) for q in moved])
    expected *= alpha if premultiplied else 1
    # In the log a step of 1e-4 is 0.07 % of the light; double has only the rounding of float. The
    # matrix mixes channels, so that the largest of a colour sets the scale.
    scale = np.maximum(np.abs(expected).max(axis=1, keepdims=True), 0.01)
    off = np.abs(found[0, :, :3] - expected) / scale
    assert off.max() < {"single": 3e-3, "double": 2e-6}[precision]
    assert (found[0, :, :3] != pixels).any()
    if channels == 4:
        assert np.array_equal(found[..., 3], image[..., 3])
