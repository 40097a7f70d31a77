"""A row of the timeline has one name in the probe, in tips, in the inspector and in the history."""

from __future__ import annotations

from palette4d.studio.row_names import row_name, with_row_names
from palette4d.studio.window import Window


def test_all_edges_of_a_row_have_the_name_of_its_first_disc(opened: Window) -> None:
    document = opened.session.document
    assert document is not None
    grade = document.grade
    track = max(grade.tracks, key=lambda track: len(track.edges))
    names = {row_name(document, edge) for edge in track.edges}
    assert names == {f"{track.name} {grade.colour_names[track.name]}"}
    assert {row_name(document, track.name)} == names


def test_the_history_and_the_inspector_tell_rows_by_name(opened: Window) -> None:
    session = opened.session
    assert session.document is not None
    grade = session.document.grade
    edge = next(id_ for id_ in grade.palette(6).ids if id_ in grade.handles.edges)
    name = row_name(session.document, edge)
    session.edit(lambda document: document.stop(edge, frame=6, rgb=(0.1, 0.2, 0.9)))
    assert edge in session.document.history.done[-1].label
    shown = opened.history.list.item(1).text()
    assert name in shown
    assert edge not in shown.split()
    session.select(edge)
    assert opened.inspector.title.text() == name
    assert with_row_names(session.document, f"{edge} is #{edge}") == f"{name} is #{edge}"
