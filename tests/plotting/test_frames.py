"""Which frames `plot` shows."""

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from palette4d.grade.clip_colours import ClipColours
from palette4d.grade.document import Document
from palette4d.plotting.frames import default_frames
from palette4d.plotting.rows import PlottedPalette

SPLIT = Path(__file__).resolve().parents[1] / "golden" / "sidecars" / "v1_split.p4d.json"


def palette_through(last: float, edited: Sequence[float] = ()) -> Any:
    """A palette with edits at some frames, of which none changes more than the others."""
    return SimpleNamespace(
        first=0.0, last=last, edited_times=edited, change=lambda times: np.ones(len(times))
    )


def clip_through(colours: dict[int, NDArray[np.float64]], *, stored: bool = True) -> Any:
    """A clip's colours at frames; others have those of the nearest one."""

    def at(time: float) -> NDArray[np.float64]:
        rgb = colours[min(colours, key=lambda frame: abs(frame - time))]
        return np.column_stack([rgb, np.full(len(rgb), 1 / len(rgb))])

    return SimpleNamespace(frames=list(colours) if stored else [], colours_at=at)


def pictures(reds: Sequence[float], noise: float = 0.0) -> dict[int, NDArray[np.float64]]:
    """Pictures at every fifth frame: many greys, and a quarter of the pixels in a red."""
    random = np.random.default_rng(1)
    greys = np.repeat(np.linspace(0.1, 0.9, 48)[:, None], 3, axis=1)
    found = {}
    for k, red in enumerate(reds):
        rgb = np.vstack([greys, np.tile([red, 0.2, 0.2], (16, 1))])
        found[5 * k] = rgb + random.normal(0, noise, rgb.shape)
    return found


def test_every_colour_of_the_clip_is_shown() -> None:
    # Three lights at 10, 15 and 40; the last is on for one picture alone.
    clip = clip_through(pictures([0.2, 0.2, 0.6, 0.6, 0.2, 0.2, 0.2, 0.2, 0.9, 0.2, 0.2]))
    shown = default_frames(palette_through(50), clip)
    assert 40 in shown
    assert len({10, 15} & set(shown)) == 1  # one of two that look alike
    assert shown[0] == 0
    assert shown[-1] == 50
    assert len(shown) == 4


def test_frames_that_differ_by_noise_look_alike() -> None:
    clip = clip_through(pictures([0.3] * 11, noise=0.004))
    assert default_frames(palette_through(50), clip) == [0, 50]


def test_a_slow_change_is_shown_evenly() -> None:
    clip = clip_through(pictures(np.linspace(0, 1, 11).tolist()))
    shown = default_frames(palette_through(50), clip)
    assert len(shown) == 6
    assert np.diff(shown).min() >= 5
    assert np.diff(shown).max() <= 15


def test_a_quick_change_leaves_pictures_for_the_rest() -> None:
    reds = [*np.linspace(0, 0.8, 6), *np.linspace(0.81, 0.85, 15)]
    shown = default_frames(palette_through(100), clip_through(pictures(reds)))
    assert len(shown) == 6
    assert np.diff(shown).max() <= 40


def test_without_colours_of_the_clip_frames_are_even() -> None:
    shown = default_frames(palette_through(50), clip_through(pictures([0.3]), stored=False))
    assert len(shown) == 6
    assert np.diff(shown).min() >= 5
    assert np.diff(shown).max() <= 15


@pytest.mark.parametrize(("last", "expected"), [(0, [0]), (1, [0, 1]), (2, [0, 1, 2])])
def test_short_clips(last: int, expected: list[int]) -> None:
    clip = clip_through(pictures([0.3]), stored=False)
    assert default_frames(palette_through(last, [0.4]), clip) == expected


@pytest.mark.parametrize(
    ("edited", "added"),
    [([], []), ([22], [22]), ([22.3, 97], [22]), ([36, 41, 58, 63], [58]), ([3, 26, 97], [26])],
)
def test_edits_only_add_frames(edited: list[float], added: list[int]) -> None:
    shown = {0: 0.2, 10: 0.5, 40: 0.9, 45: 0.6, 75: 0.3, 100: 0.7}
    colours = {t: np.array([[red, 0.0, 0.0]]) for t, red in shown.items()}
    found = default_frames(palette_through(100, edited), clip_through(colours))
    assert found == sorted([*shown, *added])


def test_the_largest_change_is_shown() -> None:
    document = Document.load(SPLIT)
    stored = ClipColours(document.grade.core.polytope, document.fields())
    before = default_frames(PlottedPalette.of(document.grade.core), stored)
    at = next(t for t in range(5, 18) if not {t, t + 1} & set(before))
    colour = document.grade.palette(at).rgb[0]
    document.pick(at, colour=colour, by=(0.2, 0, 0), start=at, until=at, follow=False)
    after = default_frames(PlottedPalette.of(document.grade.core), stored)
    assert sorted({*before, at}) == after
