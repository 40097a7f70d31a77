"""The methods: each road ends in a polytope, and the default is never worse than a static hull."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest
from analysis_frames import constant, grey, mixture, noise, stats
from palette4d.analysis import methods, statistics
from palette4d.analysis.baselines import static_hull
from palette4d.analysis.options import METHODS, AnalysisOptions

from palette4d.media.clip import open_clip

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])


def drifting(count):
    """Four colours, one of which goes from red to yellow and back."""
    images = []
    for i in range(count):
        rgb = FOUR.copy()
        rgb[1, 1] += 0.6 * (1 - abs(2 * i / (count - 1) - 1))
        images.append(mixture(rgb, i))
    return images


CLIPS = {
    "drifting": drifting(9),
    "noise": [noise(i) for i in range(4)],
    "noise that grows": [noise(i, 0.2 + 0.1 * i) for i in range(6)],
    "a flash": [*drifting(5)[:3], constant([1, 1, 1]), *drifting(5)[3:]],
    "a fade": [mixture(FOUR * i / 6, i) for i in range(7)],
    "grey": [grey(i) for i in range(3)],
    "one colour": [constant([0.3, 0.4, 0.5])] * 3,
    "one frame": [mixture(FOUR, 0)],
    "there and gone": [
        mixture(FOUR if i in (2, 3) else FOUR[:1].repeat(4, 0), i) for i in range(6)
    ],
}


@pytest.mark.parametrize("name", CLIPS)
def test_the_default_is_never_worse_than_a_static_hull(name):
    frames = stats(CLIPS[name])
    analysis = methods.analyze(frames, AnalysisOptions())
    static = methods.analyze(frames, AnalysisOptions(method="static"))
    first = analysis.stages[0]
    assert first.stage == "static_hull"
    assert first.losses == static.stages[-1].losses
    assert analysis.stages[-1].losses.L_prime <= first.losses.L_prime + 1e-12
    # Nor than one of eight colours without our own terms.
    for options in static_hull.plain(AnalysisOptions(method="static")):
        plain = methods.analyze(frames, options).stages[-1]
        assert analysis.stages[-1].losses.L_prime <= plain.losses.L_prime + 1e-12


@pytest.mark.parametrize(("first", "last"), [(0, 1), (10, 13), (30, 33)])
def test_where_little_moves_the_default_beats_eight_static_colours(seasons, first, last):
    clip = open_clip(str(seasons), frames=f"{first}-{last}")
    found = statistics.gather_clip(clip, AnalysisOptions()).frames
    frames = [found[number] for number in sorted(found)]
    default = methods.analyze(frames, AnalysisOptions()).stages[-1].losses
    for options in static_hull.plain(AnalysisOptions(method="static")):
        assert default.L_prime < methods.analyze(frames, options).stages[-1].losses.L_prime


@pytest.mark.parametrize("most", [8, 10, 12])
def test_few_vertices_mean_few_colours(most):
    """A colour has one at either end of the clip at least."""
    analysis = methods.analyze(stats(drifting(9)), AnalysisOptions(vertices=most))
    assert len(analysis.polytope.vertices) <= most
    assert analysis.remarks == ()


@pytest.mark.parametrize("method", METHODS)
def test_every_method_covers_the_clip(method):
    frames = stats(drifting(6), first=11)
    analysis = methods.analyze(frames, AnalysisOptions(method=method))
    times = analysis.polytope.vertices[:, 3]
    assert times.min() == 11
    assert times.max() == 16
    assert analysis.polytope.blocks[0].first == 11
    assert analysis.polytope.blocks[-1].last == 16
    assert analysis.stages[-1].vertices == len(times)


def test_the_default_beats_the_static_hull_where_colours_move():
    analysis = methods.analyze(stats(drifting(9)), AnalysisOptions())
    assert analysis.stages[-1].losses.L_prime < 0.8 * analysis.stages[0].losses.L_prime


def test_blocks_are_limited():
    frames = stats([mixture(FOUR, i) for i in range(3)] + [noise(i) for i in range(3)])
    for most in (1, 2):
        analysis = methods.analyze(frames, AnalysisOptions(blocks=most))
        assert len(analysis.polytope.blocks) <= most


def test_an_unknown_method_is_refused():
    from palette4d.common.errors import Palette4dError

    with pytest.raises(Palette4dError, match="magic"):
        AnalysisOptions(method="magic")


@pytest.mark.parametrize("method", METHODS)
def test_an_analysis_lets_go_of_its_frames(method):
    """Of a show, the frames of one shot after the other are in memory, never of all."""
    frames = stats(drifting(4))
    gone = [weakref.ref(frame) for frame in frames] + [weakref.ref(f.coarse) for f in frames]
    assert methods.analyze(frames, AnalysisOptions(method=method)).stages
    del frames
    gc.collect()
    assert [ref() for ref in gone] == [None] * len(gone)
