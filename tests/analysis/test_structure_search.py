"""The structure search keeps the vertices and colours that are worth their cost."""

from __future__ import annotations

import dataclasses
import functools
import itertools

import numpy as np
import pytest
from analysis_frames import in_core, mixture, stats
from palette4d.analysis import moves, pipeline
from palette4d.analysis.convex_hulls import hull_mesh
from palette4d.analysis.dense_polytope import DensePolytope
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.handle_use import RARE, handle_use, rare_handles
from palette4d.analysis.objective import Objective, refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import FramePalette
from palette4d.analysis.structure_search import (
    RARE_COST,
    Priced,
    allowed,
    best_of,
    key_frames,
    walk,
)

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
SIX = np.vstack([FOUR, [[0.8, 0.8, 0.1], [0.7, 0.7, 0.8]]])
GAMUT = Gamut(np.zeros(3), np.ones(3))


def bend(count, size, at, colours=FOUR):
    """Palettes a frame, colour 1 bending by `size` at frame `at`; and their frames."""
    palettes = []
    for i in range(count):
        rgb = colours + 0.01 * i
        rgb[1, 2] += size * max(0, 1 - abs(i - at) / at)
        palettes.append(FramePalette(rgb, hull_mesh(colours).faces))
    return palettes, stats([mixture(p.rgb, i) for i, p in enumerate(palettes)])


def choose(steps, options):
    few = [one for one in steps if allowed(one, steps, options)]
    return min(few, key=lambda one: one.price(options.handle_cost))


def full(palettes):
    return DensePolytope(range(len(palettes)), [palettes], []).polytope()


def test_every_step_has_fewer_vertices_and_its_own_value():
    palettes, frames = bend(7, 0.4, 3)
    options = AnalysisOptions(handle_cost=0.1)  # fewer is always better: down to the end
    steps = walk(full(palettes), frames, GAMUT, options, [])
    counts = [s.handles for s in steps]
    assert counts == sorted(set(counts), reverse=True)
    assert counts[0] == 28
    assert counts[-1] == 8
    for step in steps:
        evaluate = Objective(step.polytope, frames, options, GAMUT, coarse=True)
        value, _ = evaluate(step.polytope.vertices, list(range(7)))
        assert step.value == pytest.approx(value)


def test_a_handle_that_pays_stays_and_one_that_does_not_goes():
    palettes, frames = bend(9, 0.5, 4)
    best = {}
    for cost in (0.002, 10.0):
        options = AnalysisOptions(handle_cost=cost)
        steps = walk(full(palettes), frames, GAMUT, options, [])
        best[cost] = choose(steps, options).polytope
    inner = [v for v in best[0.002].vertices if 0 < v[3] < 8]
    assert len(inner) == 1
    assert abs(inner[0][3] - 4) < 1
    assert inner[0][2] > 0.5
    assert len(best[10.0].vertices) == 8


def test_a_colour_that_does_not_pay_goes():
    palettes, frames = bend(7, 0.0, 3, SIX)
    for cost, colours in ((0.0, 6), (10.0, 4)):
        options = AnalysisOptions(handle_cost=cost)
        found = choose(walk(full(palettes), frames, GAMUT, options, []), options).polytope
        assert len(found.blocks[0].tracks) == colours


def test_a_rare_colour_goes_if_it_does_not_pay_for_being_rare():
    pictures = [mixture(FOUR, i) for i in range(4)]
    for picture in pictures:
        picture.reshape(-1, 3)[-3:] = 0.9
    frames = stats(pictures)
    found = []
    paper = AnalysisOptions(convexity=0, separation=0, reach=0)  # prices are L' and handles alone
    for colours in (np.vstack([FOUR, np.full(3, 0.9)]), FOUR):
        hull = hull_mesh(colours)
        polytope = DensePolytope((0, 3), [[FramePalette(hull.rgb, hull.faces)] * 2], []).polytope()
        found.append((Priced(*refine_jointly(polytope, frames, GAMUT, paper, 200, coarse=True)), 0))
    (rich, _), (poor, _) = found
    assert rare_handles(rich.polytope, frames) == 2
    assert rare_handles(poor.polytope, frames) == 0
    for gain, colours in ((1.0, 4), (3.0, 5)):  # of the rare colour, in rare handles' extra costs
        cost = (poor.value - rich.value - gain * RARE_COST) / 2
        options = dataclasses.replace(paper, handle_cost=cost)
        _, best = best_of(found, frames, frames, GAMUT, options)
        assert len(best.blocks[0].tracks) == colours


def straight_and_bent(at=4):
    """Frames with a bend at frame 4; a palette without it, and one with a stop at frame `at`."""
    palettes, frames = bend(9, 0.5, 4)
    straight = DensePolytope((0, 8), [[palettes[0], palettes[8]]], []).polytope()
    track = straight.blocks[0].tracks[1]
    stop = (*palettes[at].rgb[1].tolist(), float(at))
    return frames, straight, straight.with_stop((track[0], track[1]), stop)


@pytest.mark.parametrize(
    ("options", "stops"), [({}, 1), ({"handle_cost": 5.0}, 0), ({"vertices": 8}, 0)]
)
def test_palettes_that_seem_nearly_equal_are_compared_on_all_frames(options, stops):
    frames, straight, bent = straight_and_bent()
    seems = [(Priced(straight, 0.1), 0), (Priced(bent, 0.1), 0)]
    _, best = best_of(seems, frames, frames, GAMUT, AnalysisOptions(**options))
    assert len(best.vertices) == len(straight.vertices) + stops


def test_of_palettes_that_cost_the_same_the_one_with_the_fewest_handles_is_taken():
    frames = stats([mixture(SIX, i) for i in range(9)])  # which do not change
    mesh = hull_mesh(FOUR)
    plain = DensePolytope((0, 8), [[FramePalette(mesh.rgb, mesh.faces)] * 2], []).polytope()
    richer = moves.enriched(plain)
    for order in ((plain, richer), (richer, plain)):
        seems = [(Priced(polytope, 0.1), 0) for polytope in order]
        _, best = best_of(seems, frames, frames, GAMUT, AnalysisOptions(handle_cost=0.0))
        assert len(best.vertices) == len(plain.vertices)


def test_rare_handles_need_not_be_looked_at_in_all_frames():
    pictures = [mixture(FOUR, i) for i in range(4)]
    for picture in pictures:
        picture.reshape(-1, 3)[-3:] = 0.9
    frames = stats(pictures)
    hull = hull_mesh(np.vstack([FOUR, np.full(3, 0.9)]))
    polytope = full([FramePalette(hull.rgb, hull.faces)] * 4)
    use = handle_use(polytope.vertices, lambda at: polytope.slice_at(float(at)), frames)
    assert rare_handles(polytope, frames) == (use < RARE).sum() == 4
    # The stop is in one frame with vertices that are known to have enough.
    frames, _, bent = straight_and_bent()
    assert rare_handles(bent, frames) == 0


def test_of_many_palettes_of_a_kind_the_best_are_compared():
    frames, _, good = straight_and_bent()
    worse = [straight_and_bent(at)[2] for at in (1, 2, 6, 7)]
    seems = [(Priced(polytope, 0.1), at) for at, polytope in enumerate(worse)]
    at, _ = best_of([*seems, (Priced(good, 0.099), 9)], frames, frames, GAMUT, AnalysisOptions())
    assert at == 9


def check(polytope):
    """Every section is covered by its tracks, and every vertex is on one."""
    covered = []
    for section in (*polytope.blocks, *polytope.transitions):
        for track in section.tracks:
            times = polytope.vertices[list(track), 3]
            assert (np.diff(times) > 0).all()
            assert times[0] <= section.first
            assert times[-1] >= section.last
            covered += list(track)
    assert set(covered) == set(range(len(polytope.vertices)))


def test_removed_vertices_leave_their_neighbours_joined():
    palettes, _ = bend(5, 0.0, 2)
    links = tuple((i, i) for i in range(4))
    polytope = DensePolytope(range(5), [palettes[:2], palettes[2:]], [links]).polytope()
    while vertices := polytope.removable():
        polytope = polytope.without(vertices[0])
        check(polytope)
    assert len(polytope.vertices) == 8
    assert len(polytope.edges()) == 4
    assert len(set(itertools.chain(*polytope.transitions[0].tracks))) == 8


def splitting():
    """Six colours, of which the last splits into two for the second block."""
    seven = np.vstack([SIX, [[0.75, 0.65, 0.95]]])
    early, late = hull_mesh(SIX), hull_mesh(seven)
    assert len(late.rgb) == 7
    links = tuple((min(i, 5), i) for i in range(7))
    first, second = FramePalette(SIX, early.faces), FramePalette(seven, late.faces)
    return DensePolytope(range(8), [[first] * 4, [second] * 4], [links], [late.faces]).polytope()


def test_a_colour_goes_from_every_section_and_leaves_closed_meshes():
    polytope = splitting()
    frames = stats([mixture(SIX, i) for i in range(8)])
    chains = moves.chains(polytope)
    # Five colours of the whole clip, and both that the sixth splits into, but not their stem.
    assert sorted(len(chain) for chain in chains) == [4, 4, 8, 8, 8, 8, 8]
    for chain in chains:
        rest = moves.without_chain(polytope, chain)
        check(rest)
        assert len(rest.vertices) == len(polytope.vertices) - len(chain)
        in_core(rest, frames)  # which refuses meshes that are not closed
    while chains := moves.chains(polytope):
        polytope = moves.without_chain(polytope, chains[0])
    assert min(len(block.tracks) for block in polytope.blocks) == moves.LEAST_COLOURS


def test_new_stops_lie_on_their_edges():
    polytope = splitting()
    while vertices := polytope.removable():
        polytope = polytope.without(vertices[0])
    richer = moves.enriched(polytope)
    assert set(richer.vertices[len(polytope.vertices) :, 3]) == {1.5, 5.0}
    check(richer)
    for before, after in zip(polytope.blocks, richer.blocks, strict=True):
        for t in np.linspace(before.first, before.last, 5):
            colours = polytope.colours_at(before, t)
            np.testing.assert_allclose(richer.colours_at(after, t), colours, atol=1e-12)


def test_key_frames_hold_the_ends_and_the_worst():
    pictures = [mixture(FOUR, i) for i in range(100)]
    pictures[37] = mixture(np.eye(4)[:, :3], 37)
    frames = stats(pictures)
    palettes = [FramePalette(FOUR, hull_mesh(FOUR).faces)] * 2
    static = DensePolytope((0, 99), [palettes], []).polytope()
    chosen = [frame.frame for frame in key_frames(static, frames, AnalysisOptions(), 24)]
    assert {0, 36, 37, 38, 99} <= set(chosen)
    assert len(chosen) <= 34
    assert max(b - a for a, b in itertools.pairwise(chosen)) <= 5


def moving():
    images = []
    for i in range(8):
        rgb = SIX.copy()
        rgb[1, 1] += 0.6 * (1 - abs(2 * i / 7 - 1))
        rgb[4, 0] -= 0.5 * (i > 4)
        images.append(mixture(rgb, i))
    return stats(images)


@pytest.fixture(scope="module")
def found():
    """A function from options to the price and the number of handles of a moving clip."""
    clip = moving()

    @functools.cache
    def analyse(**options):
        last = pipeline.find_polytope(clip, AnalysisOptions(**options)).stages[-1]
        return last.losses.L_prime + 0.0025 * last.vertices, last.vertices

    return analyse


@pytest.mark.slow
def test_a_dearer_handle_never_means_more_handles(found):
    counts = [found(handle_cost=0.0005)[1], found()[1], found(handle_cost=0.05)[1]]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[-1]


@pytest.mark.parametrize(
    "less", [{"blocks": 1}, pytest.param({"vertices": 10}, marks=pytest.mark.slow)]
)
def test_more_of_what_is_allowed_is_never_worse(found, less):
    assert found()[0] <= 1.005 * found(**less)[0]
