"""The default method's search: its frames, dents, and what the result is held to."""

from __future__ import annotations

import dataclasses
import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from analysis_frames import mixture, noise, stats
from palette4d.analysis import block_merging, structure_search
from palette4d.analysis.block_merging import Block
from palette4d.analysis.frame_hulls import hull_mesh
from palette4d.analysis.handle_removal import Step
from palette4d.analysis.objective import refine_jointly
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Section, SkewPolytope
from palette4d.analysis.report import quality
from palette4d.analysis.structure_search import Candidate, Skew

from palette4d.demo.scene import Scene

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
CUBE = np.array(list(itertools.product((0.1, 0.9), repeat=3)))


def cube_with_apex(height):
    """A cube at rest for three frames, with a ninth colour over, in or under its top face."""
    mesh = hull_mesh(np.vstack([CUBE, [0.5, 0.5, 0.95]]))
    rgb = mesh.rgb.copy()
    rgb[np.argmin(np.linalg.norm(rgb - [0.5, 0.5, 0.95], axis=1)), 2] = height
    n = len(rgb)
    vertices = np.array([[*c, t] for t in (0.0, 2.0) for c in rgb])
    tracks = tuple((i, n + i) for i in range(n))
    return SkewPolytope(vertices, (Section(0.0, 2.0, tracks, mesh.faces),), ())


@pytest.fixture(scope="module")
def frames():
    """Colours in a cube, most of them in its middle, which draw a palette's colours (eq. 3)."""
    images = [noise(i, 0.8, 0.1, (30, 30)) for i in range(3)]
    for image in images:
        image[10:] = 0.5
    return stats(images)


def dent(polytope, frames):
    return quality.deepest_dent(polytope, frames)


LIMP = AnalysisOptions(convexity=0.01, separation=0.0, reach=0.0, refinement_box=0.5)


def refined_once(road, polytope, options):
    evaluations = structure_search.FINAL_EVALUATIONS
    return refine_jointly(
        polytope, road.frames, road.low, road.high, options, evaluations, coarse=False
    )[0]


def test_what_is_dented_is_refined_again_to_be_less_so(frames):
    road, start = Skew(frames, LIMP, None), cube_with_apex(0.9)
    assert dent(refined_once(road, start, LIMP), frames) > quality.DENT
    assert dent(road.refined(start, LIMP), frames) < 0.1 * quality.DENT


@pytest.mark.parametrize(
    ("convexity", "stiffer", "limit", "times"),
    [(0.01, 0.01, 0.05, 2), (0.0, 10.0, 0.05, 1), (0.01, 10.0, 0.2, 1)],
    ids=["where that is no use", "without convexity", "where nothing is dented"],
)
def test_else_it_stays(frames, monkeypatch, convexity, stiffer, limit, times):
    calls = []

    def counted(*args, **options):
        calls.append(args)
        return refine_jointly(*args, **options)

    monkeypatch.setattr(structure_search, "refine_jointly", counted)
    monkeypatch.setattr(structure_search, "STIFFER", stiffer)
    monkeypatch.setattr(quality, "DENT", limit)
    options = dataclasses.replace(LIMP, convexity=convexity)
    road, start = Skew(frames, options, None), cube_with_apex(0.9)
    once = refined_once(road, start, options)
    np.testing.assert_array_equal(road.refined(start, options).vertices, once.vertices)
    assert len(calls) == times


def moving(count: int) -> SkewPolytope:
    """Four colours with so many vertices; if odd, a dented palette of 18."""
    if count % 2:
        return cube_with_apex(0.5)
    mesh = hull_mesh(FOUR)
    times = np.linspace(0, 2, count // 4)
    vertices = np.array([[*c, t] for t in times for c in mesh.rgb])
    tracks = tuple(tuple(range(i, len(vertices), 4)) for i in range(4))
    return SkewPolytope(vertices, (Section(0.0, 2.0, tracks, mesh.faces),), ())


@pytest.mark.parametrize(
    ("most", "lowest", "expected"),
    [(0, 0.75, 16), (0, 0.55, 24), (20, 0.55, 8), (0, 0.1, 8)],
    ids=["as few as will do", "more", "no more than asked for", "none is as good"],
)
def test_what_beats_a_dented_hull_is_looked_for_among_more_vertices(
    frames, monkeypatch, most, lowest, expected
):
    """Palettes of 12, 16, 20 and 24 vertices, each of a lower L' than the last; one is dented."""
    values = {8: 1.0, 12: 0.8, 16: 0.7, 18: 0.2, 20: 0.6, 24: 0.5}
    road = Skew(frames, AnalysisOptions(vertices=most), None)
    monkeypatch.setattr(road, "refined", lambda polytope, options: polytope)
    monkeypatch.setattr(
        road, "losses", lambda polytope: SimpleNamespace(L_prime=values[len(polytope.vertices)])
    )

    def candidate(*counts):
        steps = tuple(Step(moving(count), values.get(count, 0.2)) for count in counts)
        return Candidate(steps[0].polytope, steps[-1], 1.0, steps, (str(counts),))

    candidates = [
        candidate(20, 12, 8),
        candidate(24, 17, 16),
        Candidate(moving(8), Step(moving(8), 1.0)),
    ]
    assert len(moving(17).vertices) == 18
    found, remarks = road.richer(moving(8), ("as given",), candidates, lowest)
    assert len(found.vertices) == expected
    of = {8: "as given", 16: "(24, 17, 16)", 24: "(24, 17, 16)"}
    assert remarks == (of[expected],)


def test_a_dented_static_hull_is_to_be_beaten_and_no_result(frames, monkeypatch):
    dented = cube_with_apex(0.5)
    asked = []
    monkeypatch.setattr(Skew, "plain_hulls", lambda self: [dented])

    def richer(self, polytope, remarks, candidates, lowest):
        asked.append((lowest, candidates))
        return polytope, remarks

    monkeypatch.setattr(Skew, "richer", richer)
    losses = Skew.losses

    def lower(self, polytope):
        found = losses(self, polytope)
        return dataclasses.replace(found, L_prime=0.01) if polytope is dented else found

    monkeypatch.setattr(Skew, "losses", lower)
    found = Skew(frames, AnalysisOptions(), None).run()
    assert [lowest for lowest, _ in asked] == [0.01, 0.01]
    (_, first), (_, other) = asked  # searched by all, then by half of the coarse colours
    assert first[0].steps
    assert other[0].steps
    assert first[0].removed.value != other[0].removed.value
    assert dent(found.polytope, frames) <= quality.DENT
    assert found.bound is not None
    assert 0.01 < found.stages[-1].losses.L_prime <= found.bound


@pytest.mark.parametrize(
    ("first", "stiffer", "lowest", "convexity", "expected"),
    [
        (("dented", 0.5), ("in shape", 0.7), 0.9, 3.0, 0.7),
        (("dented", 0.5), ("in shape", 0.76), 0.9, 3.0, 0.5),
        (("dented", 0.8), ("in shape", 0.85), 0.9, 3.0, 0.85),
        (("dented", 0.8), ("in shape", 0.91), 0.9, 3.0, 0.8),
        (("dented", 0.92), ("in shape", 0.95), 0.9, 3.0, 0.95),
        (("dented", 0.5), ("dented", 0.4), 0.9, 3.0, 0.5),
        (("in shape", 0.5), ("in shape", 0.4), 0.9, 3.0, 0.5),
        (("dented", 0.5), ("in shape", 0.4), 0.9, 0.0, 0.5),
    ],
    ids=[
        "in shape, for less than half of what is gained",
        "for more",
        "for less, where a dented hull is to be beaten",
        "for more there",
        "where that hull is not beaten anyway",
        "dented as well",
        "where nothing is dented",
        "where nobody asks for convexity",
    ],
)
def test_where_the_result_is_dented_a_stiffer_search_follows(
    frames, monkeypatch, first, stiffer, lowest, convexity, expected
):
    """Results of two searches, each known by its L'; static hulls have 1.0 and, dented, 0.9."""
    shapes = {"dented": lambda: cube_with_apex(0.5), "in shape": lambda: cube_with_apex(0.95)}
    made, values = [], {}

    def searched(self, simple):
        assert (simple.L_prime, simple.lowest) == (1.0, lowest)
        name, value = first if self.options.convexity == convexity else stiffer
        made.append(self.options.convexity)
        out = shapes[name]()
        values[id(out)] = (value, out)
        self.measure("block_merging", out)
        return out, (f"of {value}",)

    losses = Skew.losses

    def known(self, polytope):
        value, _ = values.get(id(polytope), (1.0, None))
        return dataclasses.replace(losses(self, polytope), L_prime=value)

    hull = cube_with_apex(0.5)
    values[id(hull)] = (lowest, hull)
    monkeypatch.setattr(Skew, "plain_hulls", lambda self: [hull])
    monkeypatch.setattr(Skew, "searched", searched)
    monkeypatch.setattr(Skew, "losses", known)
    found = Skew(frames, AnalysisOptions(convexity=convexity), None).run()
    again = first[0] == "dented" and convexity
    assert made == ([3.0, 30.0] if again else [convexity])
    assert [stage.stage for stage in found.stages] == [
        "static_hull",
        "block_merging",
        "vertex_refinement",
    ]
    # What is reported of the stages is of the search whose result is taken.
    assert [stage.losses.L_prime for stage in found.stages] == [1.0, expected, expected]
    assert found.bound == (lowest if expected <= lowest else 1.0)
    taken = again and expected == stiffer[1]
    assert [f"{first[1]:.3f}" in text for text in found.remarks] == [True] * bool(taken)


def test_a_clip_whose_palette_is_dented_gets_that_of_a_stiffer_search():
    """Eight frames of the sample clip: what is found with little convexity lacks 20 %."""
    scene = Scene(96, 54)
    frames = stats([scene.picture(i / 7) for i in range(8)])
    few, enough = AnalysisOptions(convexity=0.3), AnalysisOptions(convexity=3.0)
    road = Skew(frames, few, None)
    static = road.static()
    bound = road.losses(static).L_prime
    once, _ = road.searched(structure_search.Simple(static, bound, bound))
    assert dent(once, frames) > 3 * quality.DENT
    found = Skew(frames, few, None).run()
    expected = Skew(frames, enough, None).run()
    np.testing.assert_array_equal(found.polytope.vertices, expected.polytope.vertices)
    assert dent(found.polytope, frames) <= quality.DENT
    (remark,) = found.remarks
    assert "--convexity 3:" in remark
    assert expected.remarks == ()


@pytest.mark.parametrize(
    ("ways", "relaxed", "expected"),
    [
        ([2.0, 0.9, 0.5], [], 0.9),
        ([2.0], [1.5, 0.8, 0.7], 0.7),  # the second of them is dented
        ([2.0], [1.5, 1.4], 1.0),
    ],
    ids=["the first way that is as good", "the simple hull, relaxed", "the simple hull"],
)
def test_the_result_is_held_to_the_simple_hull(frames, monkeypatch, ways, relaxed, expected):
    """Each palette is known by its L'; that of the simple hull is 1."""
    road = Skew(frames, AnalysisOptions(), None)
    values = {}

    def palette(value):
        out = cube_with_apex(0.5 if value == 0.8 else 0.95)
        values[id(out)] = (value, out)
        return out

    simple = palette(1.0)
    later = itertools.chain(relaxed, itertools.repeat(1.2))
    monkeypatch.setattr(road, "refined", lambda polytope, options: palette(next(later)))
    monkeypatch.setattr(
        road, "losses", lambda polytope: SimpleNamespace(L_prime=values[id(polytope)][0])
    )
    calls = [lambda value=value: palette(value) for value in ways]
    found = road.never_worse(calls, simple, 1.0)
    assert values[id(found)][0] == expected
    assert 0.5 not in [value for value, _ in values.values()]  # nobody asked for it


def test_a_palette_of_one_block_has_no_remark_of_blocks(frames, monkeypatch):
    monkeypatch.setattr(structure_search.Glued, "remarks", lambda self: ("of blocks",))
    found = Skew(frames, AnalysisOptions(), None).run()
    assert len(found.polytope.blocks) == 1
    assert found.remarks == ()


@pytest.mark.parametrize(("blocks", "apart"), [(3, True), (2, False)])
def test_a_flash_is_tried_apart_from_all_other_frames(blocks, apart):
    """A flash is merged into its neighbours sooner than colours that are others from then on."""
    images = [mixture(FOUR if i < 9 else 1 - FOUR, i) for i in range(12)]
    images[5] = mixture(np.vstack([0.6 * FOUR + 0.4, [[0.9, 0.9, 0.5]]]), 5)
    skew = Skew(stats(images), AnalysisOptions(blocks=blocks), None)
    merged = block_merging.merge_sequence(
        skew.first_blocks(), skew.frames, skew.low, skew.high, skew.options
    )
    plain = [[b.first for b in configuration] for _, configuration in merged]
    assert [0, 5, 6] not in plain
    found = [[b.first for b in configuration] for configuration in skew.configurations()]
    assert ([0, 5, 6] in found) == apart
    assert [c for c in plain if len(c) <= blocks] == [c for c in found if c != [0, 5, 6]]
    assert [len(c) for c in found] == sorted((len(c) for c in found), reverse=True)


def test_search_frames_hold_the_ends_the_worst_and_the_blocks():
    palette = hull_mesh(FOUR)
    blocks = [Block(0, (palette,) * 70, (0.1,) * 70), Block(70, (palette,) * 30, (0.1,) * 30)]
    losses = np.full(100, 0.1)
    losses[37] = 0.5
    chosen = structure_search.search_frames(losses, blocks)
    assert {0, 99, 37, 69, 70} <= set(chosen)
    assert len(chosen) <= structure_search.SEARCH_FRAMES + structure_search.WORST_FRAMES + 4
    assert max(b - a for a, b in itertools.pairwise(chosen)) <= 5
    assert structure_search.search_frames(losses[:2], [Block(0, (palette,) * 2, (0.1,) * 2)]) == [
        0,
        1,
    ]


def nearest(polytope) -> float:
    """The least distance of two colours of a static palette at its first frame."""
    rgb = polytope.vertices[[track[0] for track in polytope.blocks[0].tracks], :3]
    gaps = np.linalg.norm(rgb[:, None] - rgb[None], axis=2)
    return float(gaps[~np.eye(len(rgb), dtype=bool)].min())


def test_look_alikes_of_a_static_palette_are_pushed_apart_as_far_as_allowed():
    generator = np.random.default_rng(1)
    corners = np.vstack([FOUR, [0.8, 0.8, 0.85], [0.9, 0.242, 0.242]])
    images = [mixture(corners, 10 + i, 3000) for i in range(3)]
    frames = stats([(i + 0.01 * generator.standard_normal(i.shape)).astype("f4") for i in images])
    skew = Skew(frames, AnalysisOptions(), None)
    hulls = [hull for hull in skew.plain_hulls() if not skew.dented(hull)]
    simple = min(hulls, key=lambda hull: skew.losses(hull).L_prime)
    bound = skew.losses(simple).L_prime
    assert nearest(simple) < 0.04
    found = skew.never_worse([], simple, bound)
    assert skew.losses(found).L_prime <= bound
    # With a little room they need not look alike.
    apart = skew.never_worse([], simple, 1.03 * bound)
    assert skew.losses(apart).L_prime <= 1.03 * bound
    assert nearest(apart) > 0.06
    assert skew.losses(skew.refined(simple, skew.shaped(0.5))).L_prime > 1.03 * bound
