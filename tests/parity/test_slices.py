"""Slices and edited colours: every implementation, every document, every kind of time."""

from __future__ import annotations

import numpy as np
import pytest
from parity.cases import DOCUMENTS, NUDGE, frames_of
from parity.implementations import CORE, IMPLEMENTATIONS, REFERENCE, Implementation
from parity.reference import displacements

IMPLEMENTED = pytest.mark.parametrize("code", IMPLEMENTATIONS, ids=lambda code: code.name)


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


@IMPLEMENTED
@pytest.mark.parametrize("name", DOCUMENTS)
def test_vertices_and_stops_hold_at_their_own_frames(code: Implementation, name: str) -> None:
    document = DOCUMENTS[name]
    new = {edit["vertex"]: edit["rgb"] for edit in document["edits"]["vertices"]}
    held = 0
    for vertex in document["polytope"]["vertices"]:
        rgb, _, where = code.slice(document, vertex["frame"])
        edited = code.edited(document, vertex["frame"])
        for row, (first, last, weight) in enumerate(where):
            if first == vertex["id"]:
                assert (last, weight) == (vertex["id"], 0)
                assert rgb[row].tolist() == vertex["rgb"]
                assert edited[row].tolist() == list(new.get(vertex["id"], vertex["rgb"]))
                held += 1
    assert held >= len(document["polytope"]["vertices"])
    ends = {edge["id"]: (edge["from"], edge["to"]) for edge in document["polytope"]["edges"]}
    for stop in document["edits"]["stops"]:
        where = code.slice(document, stop["frame"])[2]
        rows = [row for row, place in enumerate(where) if place[:2] == ends[stop["edge"]]]
        assert rows
        for row in rows:
            assert code.edited(document, stop["frame"])[row].tolist() == stop["rgb"]


@IMPLEMENTED
@pytest.mark.parametrize("name", DOCUMENTS)
def test_colours_are_continuous_in_time(code: Implementation, name: str) -> None:
    """Beside every mark each colour is close to one at the mark, and the other way around."""
    document = DOCUMENTS[name]
    for frame in frames_of(name):
        if not np.isfinite(frame):
            continue
        roads = [lambda t: code.slice(document, t)[0], lambda t: code.edited(document, t)]
        for colours in roads[:1] if name == "changes-hold" else roads:  # a hold ends in a jump
            here = colours(frame)
            for side in (-NUDGE, NUDGE):
                there = colours(frame + side)
                distance = np.abs(here[:, None] - there[None]).max(axis=2)
                assert distance.min(axis=0).max() < 10 * NUDGE
                assert distance.min(axis=1).max() < 10 * NUDGE


@IMPLEMENTED
@pytest.mark.parametrize("name", DOCUMENTS)
def test_faces_are_closed_and_oriented(code: Implementation, name: str) -> None:
    for frame in frames_of(name):
        rgb, faces, where = code.slice(DOCUMENTS[name], frame)
        assert len(rgb) == len(where), frame
        sides = [(f[k], f[(k + 1) % 3]) for f in faces for k in range(3)]
        assert len(set(sides)) == len(sides), frame
        assert {(b, a) for a, b in sides} == set(sides), frame
        assert len(faces) == max(2 * len(rgb) - 4, 0), frame


@IMPLEMENTED
def test_outside_the_clip_its_ends_hold(code: Implementation) -> None:
    for document in DOCUMENTS.values():
        blocks = document["polytope"]["blocks"]
        for outside, end in ((-1e9, blocks[0]["first"]), (1e9, blocks[-1]["last"])):
            assert (
                code.slice(document, outside)[0].tolist() == code.slice(document, end)[0].tolist()
            )


@IMPLEMENTED
def test_an_edit_leaves_other_times_alone(code: Implementation) -> None:
    """bm (14.5) and d1 (8) are edited: at the clip's ends, and at 23 but for b, nothing changes."""
    document = DOCUMENTS["changes-vertex"]
    for frame in (0, 30):
        assert code.edited(document, frame).tolist() == code.slice(document, frame)[0].tolist()
    changed = (code.edited(document, 23) != code.slice(document, 23)[0]).any(axis=1)
    assert changed.tolist() == [False, True, False, False]


def test_an_unedited_slice_is_bit_identical() -> None:
    for name in ("still", "colour", "grey", "flat", "changes", "changes-back"):
        for frame in frames_of(name):
            rgb = CORE.slice(DOCUMENTS[name], frame)[0]
            assert CORE.edited(DOCUMENTS[name], frame).tobytes() == rgb.tobytes()


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


def test_held_edits_stay_until_the_next_handle() -> None:
    document = DOCUMENTS["changes-hold"]
    handles = dict(displacements(document, document["polytope"]["edges"][0]))
    for frame, knot in ((4.0, 0), (8.999, 0), (16.0, 15), (21.4, 15), (22.0, 21.5), (29.9, 21.5)):
        moved = CORE.edited(document, frame)[0] - CORE.slice(document, frame)[0][0]
        np.testing.assert_allclose(moved, handles[knot], rtol=0, atol=1e-14)
