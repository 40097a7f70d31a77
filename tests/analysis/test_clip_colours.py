"""The clip's colours for the guard: few, small, all of the picture, and the rare ones too."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.typing import NDArray
from palette4d.analysis import colour_statistics
from palette4d.analysis.clip_colours import MOST_COLOURS, MOST_ENTRIES, clip_colours
from palette4d.analysis.frame_statistics import FrameStatistics
from palette4d.analysis.options import AnalysisOptions

LAMP = (1.0, 0.9, 0.5)


@pytest.fixture(scope="module")
def frames() -> list[FrameStatistics]:
    """A noisy night with a lamp of four pixels in one frame of thirty."""
    rng = np.random.default_rng(2)
    found = []
    for frame in range(30):
        picture = rng.normal((0.1, 0.12, 0.25), 0.04, (60, 80, 3)).clip(0, 1).astype(np.float32)
        if frame == 17:
            picture[10:12, 10:12] = LAMP
        one = colour_statistics.gather(frame, picture, AnalysisOptions())
        assert one is not None
        found.append(one)
    return found


def rows(entry: dict[str, object]) -> NDArray[np.float64]:
    return np.array(entry["rgbw"], float)


def test_entries_are_few_and_hold_the_whole_picture(frames: list[FrameStatistics]) -> None:
    entries = clip_colours(frames)
    assert len(entries) == MOST_ENTRIES
    assert [entry["frame"] for entry in entries] == sorted(entry["frame"] for entry in entries)
    assert (entries[0]["frame"], entries[-1]["frame"]) == (0, 29)
    for entry in entries:
        assert len(rows(entry)) <= MOST_COLOURS
        np.testing.assert_allclose(rows(entry)[:, 3].sum(), 1, atol=0.01)
        mean = rows(entry)[:, 3] @ rows(entry)[:, :3]
        np.testing.assert_allclose(mean, (0.1, 0.12, 0.25), atol=0.02)
    assert len(json.dumps(entries)) < 30_000


def test_a_lamp_of_few_pixels_and_one_frame_is_kept(frames: list[FrameStatistics]) -> None:
    away = [
        np.linalg.norm(rows(entry)[:, :3] - LAMP, axis=1).min() for entry in clip_colours(frames)
    ]
    assert min(away) < 0.02


def test_short_and_plain_clips(frames: list[FrameStatistics]) -> None:
    assert len(clip_colours(frames[:1])) == 1
    plain = np.full((4, 4, 3), 0.5, np.float32)
    one = colour_statistics.gather(7, plain, AnalysisOptions())
    assert one is not None
    assert clip_colours([one]) == [{"frame": 7, "rgbw": [[0.5, 0.5, 0.5, 1.0]]}]
