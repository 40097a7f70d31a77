"""The pictures: of waiting requests the newest, a coarse one first, mattes, and what is outside."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Callable, Generator
from pathlib import Path
from queue import Queue

import numpy as np
import pytest

import palette4d
from palette4d.grade.document import Document
from palette4d.studio import preview
from palette4d.studio.display import Display, Look
from palette4d.studio.player import Region
from palette4d.studio.preview import Grade, Picture, Preview, Request, outside_of, shares_of

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "sidecars"
WIDTH, HEIGHT = 64, 48
WHOLE = Region(0, 0, WIDTH, HEIGHT, WIDTH, HEIGHT)


@pytest.fixture
def document() -> Document:
    return palette4d.load(GOLDEN / "v1_edited.p4d.json")


@pytest.fixture
def pixels() -> np.ndarray:
    return np.random.default_rng(2).uniform(0.1, 0.9, (HEIGHT, WIDTH, 3)).astype(np.float32)


@pytest.fixture
def request_(document: Document, pixels: np.ndarray) -> Request:
    grade, display = Grade.of(document, 4.0), Display("unknown")
    return Request(0, 4, pixels, False, grade, None, WHOLE, display, Look(), None, 0)


@pytest.fixture
def heard() -> Queue[Picture]:
    return Queue()


@pytest.fixture
def made(heard: Queue[Picture]) -> Generator[Preview]:
    found = Preview(heard.put)
    yield found
    found.close()


def test_both_sides_are_the_source_and_what_is_graded(
    made: Preview, heard: Queue[Picture], request_: Request
) -> None:
    both = dataclasses.replace(request_, sides=frozenset({"before", "after"}))
    made.ask(both)
    shown = heard.get(timeout=30)
    assert shown.exact
    assert shown.before is not None
    assert shown.after is not None
    assert np.abs(shown.before[..., :3] - 255 * request_.pixels).max() <= 0.51
    graded = Preview.exact(request_.pixels, both.grade, False) if both.grade else None
    assert np.array_equal(shown.after, both.display.painter(Look()).paint(graded))
    assert not np.array_equal(shown.before, shown.after)
    made.ask(both)  # kept
    assert heard.get(timeout=30).after is shown.after
    made.forget()
    assert made.kept(both.key) is None


def test_only_the_newest_of_waiting_requests_is_shown_and_exact_work_stops_for_it(
    made: Preview, heard: Queue[Picture], request_: Request, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, go = threading.Event(), threading.Event()
    monkeypatch.setattr(preview, "STRIP", 8 * WIDTH)
    make = made.make

    def slow(request: Request, *, exact: bool, check: Callable[[], None] = lambda: None) -> Picture:
        begun.set()
        assert go.wait(30)
        return make(request, exact=exact, check=check)

    monkeypatch.setattr(made, "make", slow)
    made.ask(dataclasses.replace(request_, revision=1))
    assert begun.wait(30)
    for revision in (2, 3):
        made.ask(dataclasses.replace(request_, revision=revision))
    go.set()
    revisions = []
    while (shown := heard.get(timeout=30)).request.revision != 3 or not shown.exact:
        revisions.append((shown.request.revision, shown.exact))
    assert (1, True) not in revisions
    assert 2 not in {revision for revision, _ in revisions}


def test_what_fails_is_an_error_of_the_picture_and_the_next_one_is_made(
    made: Preview, heard: Queue[Picture], request_: Request
) -> None:
    made.ask(dataclasses.replace(request_, look=Look(gamma=0.0)))
    assert heard.get(timeout=30).error
    made.ask(request_)
    assert not heard.get(timeout=30).error


def test_the_share_of_a_handle_and_its_matte(document: Document, request_: Request) -> None:
    assert request_.grade is not None
    palette = request_.grade.palette
    shares = dict(zip(palette.ids, shares_of(palette, "v4"), strict=True))
    assert shares["e4"] == pytest.approx(5 / 9)  # from v4 at frame 0 to v8 at frame 9
    assert shares["e1"] == 0
    assert shares_of(palette, "e4").max() == 1
    own = palette.rgb[list(palette.ids).index("e4")].astype(np.float32)
    matte = preview.matte_of(np.tile(own, (2, 3, 1)), request_.grade, "v4")
    assert matte is not None
    assert matte == pytest.approx(np.full((2, 3), 5 / 9), abs=1e-5)
    assert preview.matte_of(request_.pixels, request_.grade, "v18") is None


def test_colours_outside_are_counted(request_: Request) -> None:
    assert request_.grade is not None
    palette = request_.grade.palette
    inside = palette.rgb.mean(axis=0)
    colours = np.tile(inside.astype(np.float32), (4, 5, 1))
    colours[:2] = (3.0, 3.0, -1.0)
    marked, share = outside_of(colours, request_.grade)
    assert share == 0.5
    assert marked[:2].min() == 255
    assert marked[2:].max() == 0
