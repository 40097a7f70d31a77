"""Of work that waits only the newest is done; what a newer click has overtaken is not shown."""

from __future__ import annotations

import functools
import threading
from pathlib import Path

from palette4d.studio.newest import Newest
from palette4d.studio.session import Session
from palette4d.studio.states import Place


def test_of_calls_that_wait_only_the_newest_is_done() -> None:
    newest, begun, go, end = Newest("test"), *(threading.Event() for _ in range(3))
    done: list[int] = []

    def first() -> None:
        begun.set()
        assert go.wait(10)
        done.append(0)

    newest.ask(first)
    assert begun.wait(10)
    for number in (1, 2):
        newest.ask(functools.partial(done.append, number))
    newest.ask(lambda: (done.append(3), end.set()))
    go.set()
    assert end.wait(10)
    assert done == [0, 3]
    end.clear()
    newest.ask(end.set)  # after a rest it begins again
    assert end.wait(10)


def test_a_pixel_that_was_clicked_earlier_is_not_shown_when_it_is_learned_late(
    sidecar: Path,
) -> None:
    session = Session()
    session.open_sidecar(sidecar)
    late: list[object] = []
    came = threading.Semaphore(0)
    session.post = lambda call: (late.append(call), came.release())
    colour = (0.5, 0.5, 0.5)
    places = [Place(session.frame, x, 40, 1, colour) for x in (20, 120)]
    session.begin_pick(places[0])
    assert came.acquire(timeout=60)
    first = late.pop()
    session.begin_pick(places[1])
    assert callable(first)
    first()
    assert session.draft is None
    assert session.learning
    assert came.acquire(timeout=60)
    second = late.pop()
    assert callable(second)
    second()
    assert session.draft is not None
    assert session.draft.pixel == (120, 40)
    first()
    assert session.draft.pixel == (120, 40)
    session.close()
