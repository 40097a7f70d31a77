"""Slices and edited colours: the core and the reference, every document, every kind of time.

What holds of any slice is in tests/core/model/.
"""

from __future__ import annotations

import numpy as np
import pytest
from parity.cases import DOCUMENTS, NUDGE, frames_of
from parity.implementations import CORE, REFERENCE
from parity.reference import displacements


@pytest.mark.parametrize("name", DOCUMENTS)
def test_the_core_slices_as_the_reference(name: str) -> None:
    document = DOCUMENTS[name]
    for frame in frames_of(name):
        expected, found = REFERENCE.slice(document, frame), CORE.slice(document, frame)
        np.testing.assert_allclose(found[0], expected[0], rtol=0, atol=1e-14, err_msg=str(frame))
        assert found[1] == expected[1], frame
        assert [p[:2] for p in found[2]] == [p[:2] for p in expected[2]], frame
        np.testing.assert_allclose(
            [p[2] for p in found[2]], [p[2] for p in expected[2]], rtol=0, atol=1e-14
        )
        np.testing.assert_allclose(
            CORE.edited(document, frame), REFERENCE.edited(document, frame), rtol=0, atol=1e-14
        )


def test_smooth_ramps_are_the_monotone_cubics_of_scipy() -> None:
    from scipy.interpolate import PchipInterpolator

    document = DOCUMENTS["changes-smooth"]
    edge = next(edge for edge in document["polytope"]["edges"] if edge["id"] == "ea")
    times, values = zip(*displacements(document, edge), strict=True)
    assert times == (0, 9, 15, 21.5, 30)
    cubic = PchipInterpolator(times, values)
    for frame in np.linspace(0, 30, 61).tolist():
        moved = CORE.edited(document, frame)[0] - CORE.slice(document, frame)[0][0]
        np.testing.assert_allclose(moved, cubic(frame), rtol=0, atol=1e-14)


def test_smooth_ramps_have_no_kink_where_a_colour_passes_a_vertex() -> None:
    """bm (14.5) and the stop on eb1 (22) are edited, b0 and b1 are not."""
    document = DOCUMENTS["changes-smooth"]

    def moved(frame: float) -> np.ndarray:
        return CORE.edited(document, frame)[1] - CORE.slice(document, frame)[0][1]

    for frame in (14.5, 22.0):
        before, after = ((moved(frame + s) - moved(frame)) / s for s in (-NUDGE, NUDGE))
        np.testing.assert_allclose(before, after, rtol=0, atol=1e-6)
    # The way between two handles never leaves their span.
    for start, end in ((0.0, 14.5), (14.5, 22.0), (22.0, 30.0)):
        span = np.sort([moved(start), moved(end)], axis=0)
        for frame in np.linspace(start, end, 40).tolist():
            assert (moved(frame) >= span[0] - 1e-15).all()
            assert (moved(frame) <= span[1] + 1e-15).all()
    # Where colours merge (m, at 23) the slope is 0.
    at_m = [CORE.edited(document, t)[3] - CORE.slice(document, t)[0][3] for t in (23, 23 + NUDGE)]
    np.testing.assert_allclose(at_m[1], at_m[0], rtol=0, atol=1e-10)
