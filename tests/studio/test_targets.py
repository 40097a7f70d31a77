"""What the inspector shows of a handle, an edge or a pick, and the edits that it does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import palette4d
from palette4d import Document
from palette4d.colour.oklch import Adjustment
from palette4d.studio.solid_view import Moving
from palette4d.studio.targets import PickTo, Recolour, RecolourMany, Target, target_of

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"


@pytest.fixture
def document() -> Document:
    """v4, v17, s1 at 4.5 and s3 at 7 on e3, s2 at 9.25 on e13 are edited; e1 goes from v1 to v5."""
    return palette4d.load(GOLDEN / "v1_edited.p4d.json")


def target(document: Document, id_: str, frame: float) -> Target:
    found = target_of(document, id_, frame)
    assert found is not None
    return found


def test_a_handle_is_at_its_own_frame_and_an_edge_at_the_playhead(document: Document) -> None:
    vertex, stop, edge = (target(document, id_, 3.0) for id_ in ("v4", "s1", "e1"))
    assert (vertex.kind, vertex.frame, stop.kind, stop.frame) == ("vertex", 0, "stop", 4.5)
    assert vertex.before == pytest.approx((0.1, 0.1, 0.9))
    assert tuple(vertex.after) == pytest.approx(document.grade.colour("v4"))
    assert tuple(stop.after) == pytest.approx(document.grade.colour("s1"))
    assert (edge.kind, edge.frame) == ("edge", 3.0)
    assert tuple(edge.after) == pytest.approx(document.grade.colour("e1", frame=3.0))
    assert not vertex.picked
    # At its end an edge is its vertex, and elsewhere it is not there.
    at_end = target(document, "e1", 0.0)
    assert (at_end.kind, at_end.id) in {("vertex", "v1"), ("edge", "e1")}
    assert target_of(document, "e1", 15.0) is None
    assert target_of(document, "nothing", 3.0) is None


def test_of_colours_that_are_equal_there_the_selected_one_changes(document: Document) -> None:
    """As where a clip fades to black: all rows have one colour."""
    ids = [id_ for id_ in document.grade.palette(3.0).ids if id_ in document.grade.handles.edges]
    for id_ in ids:
        document.stop(id_, frame=3.0, rgb=(0.0, 0.0, 0.0))
    for id_ in ids:
        edited = Document(document.fields())
        Recolour(target(edited, id_, 3.0), (id_,), 3.0, (0.9, 0.1, 0.1))(edited)
        moved = Document(document.fields())
        assert Moving(id_, 3.0, [0.0, 0.0, 0.0], [0.9, 0.1, 0.1])(moved) in moved.grade.settings
        for found in (edited, moved):
            palette = found.grade.palette(3.0)
            red = [i for i, rgb in zip(palette.ids, palette.edited, strict=True) if rgb[0] > 0.8]
            assert red == [id_]


def test_a_row_at_its_end_is_its_vertex_once(document: Document) -> None:
    edge = document.grade.handles.edges["e1"]
    start, frame = edge["from"], document.grade.handles.vertices[edge["from"]]["frame"]
    before = np.array(document.grade.colour(start))
    new = (before + 0.1).tolist()
    Recolour(target(document, start, frame), (start, "e1"), frame, tuple(new))(document)
    assert document.grade.colour(start) == pytest.approx(new)


def test_several_handles_move_by_the_same_offset_in_one_step(document: Document) -> None:
    before = {id_: np.asarray(document.grade.colour(id_)) for id_ in ("v4", "s1")}
    edge = np.asarray(document.grade.colour("e1", frame=3.0))
    by = np.asarray((0.0, 0.2, -0.1))
    steps, new = len(document.history.done), before["v4"] + by
    Recolour(target(document, "v4", 3.0), ("v4", "s1", "e1", "gone"), 3.0, tuple(new))(document)
    assert len(document.history.done) == steps + 1
    assert document.grade.colour("v4") == pytest.approx(new)
    assert document.grade.colour("s1") == pytest.approx(before["s1"] + by)
    assert document.grade.colour("e1", frame=3.0) == pytest.approx(edge + by)
    document.undo()
    assert document.grade.colour("v4") == pytest.approx(before["v4"])


@pytest.mark.parametrize("track", [True, False])
def test_a_track_or_the_palette_moves_as_the_verb_moves_it(document: Document, track: bool) -> None:
    twin, id_ = Document(document.grade), "v4" if track else None
    inspected = target(document, "v4", 3.0)
    RecolourMany(inspected, track, tuple(inspected.after + 0.05), None)(document)
    twin.adjust(id_, track=track, by=(0.05, 0.05, 0.05))
    near = {key: pytest.approx(value.rgb) for key, value in twin.grade.settings.items()}
    assert {key: value.rgb for key, value in document.grade.settings.items()} == near
    change = Adjustment(hue=20.0, chroma=0.8, lightness=1.1)
    RecolourMany(inspected, track, (0.0, 0.0, 0.0), change)(document)
    twin.adjust(id_, track=track, hue=20.0, chroma=0.8, lightness=1.1)
    assert document.grade.colour("v4") == pytest.approx(twin.grade.colour("v4"), abs=1e-6)
    steps = len(document.history.done)
    RecolourMany(target(document, "v4", 3.0), track, document.grade.colour("v4"), None)(document)
    RecolourMany(inspected, track, (0.0, 0.0, 0.0), Adjustment())(document)
    assert len(document.history.done) == steps


def test_a_pick_gets_its_new_colour_and_a_draft_becomes_one() -> None:
    document = palette4d.load(GOLDEN / "v1_picks_and_holds.p4d.json")
    pick = next(each for each in document.grade.picks if each.kind == "pick")
    shown = target(document, pick.id, 0.0)
    assert (shown.kind, shown.frame, shown.picked) == ("pick", pick.frame, True)
    PickTo(shown, (0.25, 0.5, 0.75))(document)
    assert next(each for each in document.grade.picks if each.id == pick.id).to == (0.25, 0.5, 0.75)
    count = len(document.grade.picks)
    place = Target("place", "place", pick.frame, shown.before, shown.after)
    PickTo(place, (0.1, 0.2, 0.3))(document)  # nothing is learned yet
    assert len(document.grade.picks) == count
    PickTo(place, (0.1, 0.2, 0.3), draft=pick)(document)
    assert len(document.grade.picks) == count + 1
    assert len({each.id for each in document.grade.picks}) == count + 1
    assert document.grade.picks[-1].to == (0.1, 0.2, 0.3)
