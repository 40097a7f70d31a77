"""Mean value coordinates and palette weights: the core and the reference, every kind of palette.

What holds of any weights is in tests/core/recolour/test_mvc.cpp.
"""

from __future__ import annotations

import numpy as np
import pytest
from parity.cases import BODIES, DOCUMENTS, Body
from parity.implementations import CORE, REFERENCE

EACH_BODY = pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)


@EACH_BODY
def test_the_core_weighs_as_the_reference(body: Body) -> None:
    expected, far = REFERENCE.weights(body.points, body.rgb, body.faces)
    found, distance = CORE.weights(body.points, body.rgb, body.faces)
    np.testing.assert_allclose(distance, far, rtol=0, atol=1e-11)
    if body.name == "at-a-split":  # two corners coincide: only their sum means anything
        expected, found = (np.c_[w[:, :3], w[:, 3] + w[:, 4]] for w in (expected, found))
    np.testing.assert_allclose(found, expected, rtol=0, atol=body.tolerance)


@pytest.mark.parametrize("frame", [0, 3.3, 8, 8.01, 9.5, 10, 14.5, 20, 21.7, 23, 29, 99])
def test_polytope_weights_are_the_product_of_equation_7(frame: float) -> None:
    document = DOCUMENTS["changes"]
    points = np.random.default_rng(5).uniform(-0.2, 1.2, (25, 3))
    found = CORE.polytope_weights(points, document, frame)
    assert found.shape == (25, len(document["polytope"]["vertices"]))
    rgb, faces, where = CORE.slice(document, frame)
    inner, _ = CORE.weights(points, rgb, faces)
    names = [vertex["id"] for vertex in document["polytope"]["vertices"]]
    expected = np.zeros_like(found)
    for column, (first, last, weight) in enumerate(where):
        expected[:, names.index(first)] += (1 - weight) * inner[:, column]
        expected[:, names.index(last)] += weight * inner[:, column]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)
    # They reproduce the colour and, within the clip, the time.
    table = np.array([[*v["rgb"], v["frame"]] for v in document["polytope"]["vertices"]], float)
    np.testing.assert_allclose(found @ table[:, :3], inner @ rgb, rtol=0, atol=1e-12)
    np.testing.assert_allclose(found @ table[:, 3], min(frame, 30), rtol=0, atol=1e-11)
