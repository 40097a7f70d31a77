"""Pictures of a drag are sums of what was drawn before, and are what recolouring would draw."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from palette4d import _core
from palette4d.grade.document import Document
from palette4d.media.clip import open_clip
from palette4d.studio.preview import Grade, Preview
from palette4d.studio.response import Responses

FRAME = 6


@pytest.fixture
def document(sidecar: Path) -> Document:
    """A grade with a moved handle, two picks and a hold."""
    made = Document.load(sidecar)
    made.set(handle(made, 0), rgb=(0.5, 0.4, 0.3))
    made.hold(FRAME, pixel=(20, 10), follow=False)
    for pixel, new in (((40, 30), (0.7, 0.3, 0.5)), ((120, 70), (0.1, 0.3, 0.8))):
        made.pick(FRAME, pixel=pixel, to=new, follow=False)
    return made


@pytest.fixture
def pixels(sidecar: Path) -> np.ndarray:
    clip = open_clip(str(sidecar.parent / "clip" / "frame.####.png"))
    found = np.ascontiguousarray(clip.read(FRAME)[..., :3], np.float32)
    found[3, 4] = np.nan
    return found


def handle(document: Document, number: int) -> str:
    ends = [end for both in document.grade.palette(FRAME).ends for end in both]
    return list(dict.fromkeys(ends))[number]


def drags(document: Document) -> dict[str, Callable[[Document, float], object]]:
    """Return what may be dragged, each with a value."""
    first, other = handle(document, 0), handle(document, 3)

    def both(d: Document, v: float) -> None:
        d.set(first, rgb=(v, 0.2, 1 - v))
        d.change_pick("p2", to=(v, v, 0.1))

    return {
        "a handle": lambda d, v: d.set(other, rgb=(v, 1 - v, 0.5)),
        "a pick": lambda d, v: d.change_pick("p2", to=(0.1, v, 1 - v)),
        "another pick": lambda d, v: d.change_pick("p3", to=(v, 0.9, 0.2)),
        "a handle and a pick": both,
        "the palette": lambda d, v: d.adjust(by=(0.1 * v, 0, 0.05)),
        "a reach": lambda d, v: d.change_pick("p3", reach=2 * v),
        "a range": lambda d, v: d.change_pick("p3", start=FRAME + 2 * round(v)),
    }


def test_a_drag_is_drawn_as_recolouring_would(document: Document, pixels: np.ndarray) -> None:
    responses = Responses()
    for name, drag in drags(document).items():
        for value in (0.0, 0.3, 0.9, 0.55):
            trial = Document(document.grade)
            drag(trial, value)
            grade = Grade.of(trial, FRAME)
            shown = responses.picture(pixels, grade)
            expected = Preview.exact(pixels, grade, False)
            np.testing.assert_allclose(shown, expected, atol=1e-4, err_msg=name)
            assert not np.array_equal(expected, pixels)


def test_a_step_of_a_drag_draws_nothing(
    document: Document, pixels: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = []
    draw = _core.draw
    monkeypatch.setattr(_core, "draw", lambda *a, **k: (drawn.append(a), draw(*a, **k))[1])
    responses = Responses()
    for value in np.linspace(0, 1, 20).tolist():
        trial = Document(document.grade)
        trial.change_pick("p2", to=(0.1, value, 0.4))
        responses.picture(pixels, Grade.of(trial, FRAME))
    assert len(drawn) == 2
