"""Stops for colours that only a few frames have."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from analysis_frames import in_core, mixture, stats
from bent_track import colours_at
from palette4d.analysis import pipeline
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.losses import loss_weights
from palette4d.analysis.objective import Objective, loss_of
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Section, SkewPolytope
from palette4d.analysis.stop_insertion import _Misfit, insert_stops

from palette4d import _core
from palette4d.media.clip import open_clip

FIVE = np.array(
    [[0.1, 0.1, 0.1], [0.6, 0.2, 0.2], [0.2, 0.6, 0.2], [0.2, 0.2, 0.6], [0.6, 0.6, 0.55]]
)
LIGHT = np.array([1.0, 1.0, 0.9])
GAMUT = Gamut(np.zeros(3), np.ones(3))
FRAMES = 21


def rest(colours=FIVE, count=FRAMES):
    """A polytope whose colours do not move, a little larger than those given."""
    mesh = hull_mesh(0.37 + 1.02 * (colours - 0.37))
    n = len(mesh.rgb)
    vertices = np.array([[*c, t] for t in (0.0, count - 1.0) for c in mesh.rgb])
    tracks = tuple((i, n + i) for i in range(n))
    return SkewPolytope(vertices, (Section(0.0, count - 1.0, tracks, mesh.faces),), ())


def clip(lit, pixels=30):
    """Mixtures of the five; a highlight on some of 900 pixels in the frames `lit`."""
    pictures = []
    for t in range(FRAMES):
        picture = mixture(FIVE, t, 900)
        if t in lit:
            picture.reshape(-1, 3)[:pixels] = LIGHT
        pictures.append(picture)
    return stats(pictures)


def in_parts(polytope, starts=(9, 15)):
    """The same edges in blocks of which all but the first begin at `starts`."""
    (whole,) = polytope.blocks
    firsts, lasts = [0, *starts], [*(start - 1 for start in starts), FRAMES - 1]
    blocks = [
        dataclasses.replace(whole, first=float(first), last=float(last))
        for first, last in zip(firsts, lasts, strict=True)
    ]
    between = [dataclasses.replace(whole, first=start - 1.0, last=float(start)) for start in starts]
    return dataclasses.replace(polytope, blocks=tuple(blocks), transitions=tuple(between))


def value(polytope, frames, options, brief=()):
    everything = list(range(len(frames)))
    objective = Objective(polytope, frames, options, GAMUT, coarse=True, brief=brief)
    return objective(polytope.vertices, everything)[0]


def farthest(polytope, frames):
    rows, _ = loss_of(polytope, frames).evaluate(
        polytope.vertices, list(range(len(frames))), loss_weights(AnalysisOptions()), 1, False
    )
    return rows[:, 4]


@pytest.mark.parametrize("lit", [(9, 10, 11), (3, 16)])
def test_a_highlight_gets_a_stop(lit):
    options, frames = AnalysisOptions(), clip(lit)
    before = rest()
    after = insert_stops(before, frames, GAMUT, options)[-1]
    added = len(after.polytope.vertices) - len(before.vertices)
    assert 1 <= added <= 3 * len(lit)
    assert 1 <= len(after.brief) <= len(lit)
    assert min(after.brief) >= len(before.vertices)
    assert value(after.polytope, frames, options, after.brief) < value(before, frames, options)
    for t in lit:
        nearest = np.linalg.norm(colours_at(after.polytope, t) - LIGHT, axis=1).min()
        assert nearest < 0.3 < np.linalg.norm(colours_at(before, t) - LIGHT, axis=1).min()
    # What is already there keeps its place.
    np.testing.assert_array_equal(after.polytope.vertices[: len(before.vertices)], before.vertices)
    # And far from the highlight, which is 0.6 away, not much has changed.
    dark = [t for t in range(FRAMES) if min(abs(t - at) for at in lit) > 4]
    for t in dark:
        moved = np.abs(colours_at(after.polytope, t) - colours_at(before, t)).max()
        assert moved < 0.3


@pytest.mark.parametrize("lit", [(9, 10, 11), (3, 16), (7, 8), (8,), (15,)])
def test_a_stop_is_on_all_tracks_that_run_along_its_edge(lit):
    """Edges go on across blocks: what is read back is what was made."""
    frames = clip(lit)
    for step in insert_stops(in_parts(rest()), frames, GAMUT, AnalysisOptions())[1:]:
        core = in_core(step.polytope, frames)
        assert len(core.edges) == len(step.polytope.edges())
        for block in step.polytope.blocks:
            for t in np.linspace(block.first, block.last, 13):
                expected = step.polytope.colours_at(block, t)
                np.testing.assert_allclose(_core.slice_at(core, t).rgb, expected, atol=1e-12)
    for t in lit:
        block = next(b for b in step.polytope.blocks if b.first <= t <= b.last)
        assert np.linalg.norm(step.polytope.colours_at(block, t) - LIGHT, axis=1).min() < 0.3


@pytest.mark.parametrize(("reach", "added"), [(0.0, False), (0.1, True)])
def test_a_small_highlight_counts_by_how_far_it_lies_outside(reach, added):
    """In the mean distance of all pixels two of 900 are nothing."""
    options, frames = AnalysisOptions(reach=reach), clip((10,), pixels=2)
    after = insert_stops(rest(), frames, GAMUT, options)[-1]
    assert (len(after.polytope.vertices) > len(rest().vertices)) == added


def test_a_lost_highlight_is_kept_although_it_comes_and_goes_at_once():
    """It is on four of 12 000 pixels; by L such frames are not among the worst."""
    lit, spare = (9, 10, 11), [0.47, 0.13, 0.47]
    pictures = []
    for t in range(FRAMES):
        picture = mixture(0.37 + 1.05 * (FIVE - 0.37), t, 12_000)
        if t in lit:
            picture.reshape(-1, 3)[:4] = [1.0, 0.0, 1.0]
        pictures.append(picture)
    frames, before = stats(pictures), rest(np.vstack([FIVE, spare]))
    options = AnalysisOptions(k=8)  # no more than a handle of its own has pixels
    after = insert_stops(before, frames, GAMUT, options)[-1]
    assert farthest(before, frames)[10] > 0.7
    assert farthest(after.polytope, frames)[10] < 0.3
    # The paper's eq. 11 would not have it.
    assert value(after.polytope, frames, options, after.brief) < value(before, frames, options)
    assert value(after.polytope, frames, options) > value(before, frames, options)
    # Without `reach` a highlight counts like everything else.
    plain = AnalysisOptions(k=8, reach=0.0)
    assert insert_stops(before, frames, GAMUT, plain)[-1].polytope is before


def highlights_over_seasons(seasons, numbers, lit, lights):
    """Pieces of SEASONS at half size; squares of (rgb, side) are lit in some frames."""
    clip = open_clip(str(seasons), frames=numbers)
    pictures = []
    for number, image in clip:
        picture = np.array(image[::2, ::2, :3])
        for place, (rgb, side) in enumerate(lights if number in lit else ()):
            picture[60 : 60 + side, 100 + 60 * place : 100 + 60 * place + side] = rgb
        pictures.append(picture)
    return stats([p[:, : p.shape[1] // 30 * 30] for p in pictures])


MAGENTA, BLUE = ((1.0, 0.0, 1.0), 8), ((0.0, 0.0, 1.0), 8)


@pytest.mark.parametrize(
    ("numbers", "lit", "lights"),
    [
        ("20-31", (22, 23, 24), (MAGENTA, BLUE)),
        ("0-11", (0, 1, 2), (MAGENTA,)),
    ],
    ids=["two at once", "in the first frames"],
)
def test_highlights_in_a_real_clip_are_kept(seasons, numbers, lit, lights):
    frames = highlights_over_seasons(seasons, numbers, lit, lights)
    analysis = pipeline.find_polytope(frames, AnalysisOptions())
    assert analysis.stages[-1].losses.max_distance < 0.3
    assert analysis.stages[-1].losses.L_prime < analysis.stages[0].losses.L_prime


@pytest.mark.parametrize(("left", "enough"), [(0.049, True), (0.051, False)])
def test_a_stop_brings_back_half_of_the_lost_pixels(left, enough):
    lost = _Misfit(far=np.array([1.0]), lost=np.array([0.1]))
    with_a_stop = _Misfit(far=np.array([0.5]), lost=np.array([left]))
    assert lost.removed(0, with_a_stop, 0, share=0.1) is enough


def test_frames_that_fit_alike_get_none():
    options, frames = AnalysisOptions(), clip(())
    before = rest()
    assert insert_stops(before, frames, GAMUT, options)[-1].polytope is before


def test_never_more_vertices_than_asked_for():
    options, frames = AnalysisOptions(vertices=len(rest().vertices)), clip((10,))
    before = rest()
    assert insert_stops(before, frames, GAMUT, options)[-1].polytope is before


@pytest.mark.parametrize("lit", [(0,), (FRAMES - 1,)])
def test_the_clips_ends_have_stops_already(lit):
    """There is no room for another; nothing may break."""
    options, frames = AnalysisOptions(), clip(lit)
    after = insert_stops(rest(), frames, GAMUT, options)[-1]
    now = value(after.polytope, frames, options, after.brief)
    assert now <= value(rest(), frames, options)
