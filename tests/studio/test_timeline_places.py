"""The timeline's rows and handles in a window: their height, and the playhead at them."""

from __future__ import annotations

import numpy as np

from palette4d.studio.timeline_places import LOWEST
from palette4d.studio.window import Window


def test_ten_rows_fit_below_five_picks_in_a_small_window(opened: Window) -> None:
    opened.resize(1000, 600)
    opened.arrange()
    for k in range(5):
        colour = (0.1 + 0.15 * k, 0.5, 0.4)
        opened.session.edit(
            lambda document, colour=colour: document.pick(
                12, colour=colour, by=(0.1, 0, 0), follow=False
            )
        )
    places = opened.timeline.places
    assert max(lane for _, lane in places.lanes()) == 4
    assert places.room >= 10 * LOWEST
    assert places.hidden == 0


def test_rows_are_made_taller_and_lower(opened: Window) -> None:
    timeline = opened.timeline
    before = timeline.places.timeline
    assert before is not None
    for _ in range(3):
        next(a for a in timeline.actions() if a.objectName() == "rows_taller").trigger()
    after = timeline.places.timeline
    assert after is not None
    assert after[0].row_height > 2.5 * before[0].row_height
    most = max(disc.radius for disc in after[1])
    assert most <= max(disc.radius for disc in before[1]) + 0.5
    for _ in range(9):
        next(a for a in timeline.actions() if a.objectName() == "rows_lower").trigger()
    last = timeline.places.timeline
    assert last is not None
    assert last[0].row_height == before[0].row_height


def test_a_new_stop_has_the_playhead(opened: Window) -> None:
    content = opened.timeline.places.content
    assert content is not None
    edge = next(k for k, ends in enumerate(content.edges) if np.ptp(content.frames[list(ends)]) > 4)
    start, end = sorted(content.frames[list(content.edges[edge])].tolist())
    frame = round(start) + 2 if round(start) + 2 != opened.session.frame else round(start) + 3
    opened.timeline.add_stop(content.edge_ids[edge], float(frame))
    assert start < opened.session.frame == frame < end
    opened.session.go(12)
    opened._do("go_to_selected")
    assert opened.session.frame == frame


def test_bars_keep_the_lists_order_whatever_their_ranges_are(opened: Window) -> None:
    session = opened.session
    for k, start in enumerate((7, 3, None)):
        colour = (0.2 + 0.2 * k, 0.5, 0.4)
        session.edit(
            lambda document, colour=colour, start=start: document.pick(
                8, colour=colour, by=(0.1, 0, 0), follow=False, start=start
            )
        )
    placed = [(pick.id, lane) for pick, lane in opened.timeline.places.lanes()]
    assert placed == [("p1", 0), ("p2", 1), ("p3", 2)]
