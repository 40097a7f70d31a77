"""The whole pipeline: degenerate clips, determinism, and never worse than a static hull."""

from __future__ import annotations

import dataclasses
import gc
import sys
import weakref

import numpy as np
import pytest
from analysis_frames import constant, grey, mixture, noise, stats
from palette4d.analysis import colour_statistics, pipeline, structure_search
from palette4d.analysis.options import METHODS, AnalysisOptions

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade import sidecar
from palette4d.media.array_clip import ArrayClip
from palette4d.media.clip import open_clip


def two_colours(seed):
    dark = np.random.default_rng(seed).random((20, 30, 1)) < 0.5
    return np.where(dark, np.float32([0.9, 0.1, 0.1]), np.float32([0.1, 0.2, 0.8]))


def flat(seed):
    image = noise(seed)
    image[..., 2] = 0.5
    return image


FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])


def drifting(count):
    """Four colours, one of which goes from red to yellow and back."""
    images = []
    for i in range(count):
        rgb = FOUR.copy()
        rgb[1, 1] += 0.6 * (1 - abs(2 * i / (count - 1) - 1))
        images.append(mixture(rgb, i))
    return images


NOTHING = noise(0) * np.float32(np.nan)

# name: frames, colours of the first frame's palette (None: any)
CLIPS = {
    "one frame": ([noise(1)], None),
    "one colour": ([constant([0.3, 0.4, 0.5])] * 5, 1),
    "one colour that changes": ([constant([0.3 + 0.1 * i, 0.4, 0.5]) for i in range(5)], 1),
    "grey": ([grey(i) for i in range(5)], 2),
    "two colours": ([two_colours(i) for i in range(4)], 2),
    "a plane of colours": ([flat(i) for i in range(2)], None),
    "float above one and below zero": ([noise(i, 8, -1) for i in range(3)], None),
    "large values": ([noise(i, 1e4) for i in range(3)], None),
    "one pixel": ([noise(i)[:1, :1] for i in range(3)], 1),
    "five pixels": ([noise(i)[:1, :5] for i in range(3)], None),
    "fade from and to black": (
        [noise(i, i / 4) for i in range(5)] + [noise(i, (4 - i) / 4) for i in range(1, 5)],
        None,
    ),
    "grey to colour": ([grey(i) for i in range(3)] + [noise(i) for i in range(3)], 2),
    "a flash": ([noise(i, 0.5) for i in range(3)] + [constant([1, 1, 1])] + [noise(4, 0.5)], None),
    "nothing finite here and there": ([NOTHING, noise(1), NOTHING, noise(2), NOTHING], None),
    "a cut": ([noise(i, 0.3) for i in range(2)] + [noise(i, 0.3, 0.6) for i in range(2)], None),
}


@pytest.mark.parametrize("name", CLIPS)
def test_any_clip_gives_a_valid_sidecar(name, tmp_path):
    frames, colours = CLIPS[name]
    clip = ArrayClip(frames)
    analysis = pipeline.analyze(clip, AnalysisOptions(), allow_cuts=True)
    path = tmp_path / "clip.p4d.json"
    sidecar.save(analysis.document, path)
    read = _core.read_sidecar(str(path))
    assert read.polytope.first_frame == clip.frames[0]
    assert read.polytope.last_frame == clip.frames[-1]
    for t in np.linspace(clip.frames[0] - 1, clip.frames[-1] + 1, 29):
        assert np.isfinite(_core.slice_at(read.polytope, t).rgb).all()
    if colours is not None:
        assert len(_core.slice_at(read.polytope, clip.frames[0]).rgb) == colours
    if name in ("one colour", "one colour that changes"):
        assert len(analysis.polytope.vertices) == 2
        assert analysis.stages[-1].losses.L < 1e-5
    if "finite" in name:
        assert any("no usable pixel" in note for note in analysis.notes)


def test_a_clip_without_any_colour_says_so():
    with pytest.raises(Palette4dError, match="no frame of the clip has a pixel"):
        pipeline.analyze(ArrayClip([NOTHING, NOTHING]), AnalysisOptions())


def test_frame_numbers_and_steps_are_kept():
    clip = ArrayClip([mixture(np.eye(4)[:, :3], i) for i in range(5)], first=1001, step=2)
    document = pipeline.analyze(clip).document
    assert document["clip"]["frames"] == {"first": 1001, "last": 1009, "step": 2, "skipped": []}
    times = {v["frame"] for v in document["polytope"]["vertices"]}
    assert min(times) == 1001
    assert max(times) == 1009


def test_the_same_clip_gives_the_same_text():
    frames = drifting(6)
    texts = {
        sidecar.dumps(pipeline.analyze(ArrayClip(frames), AnalysisOptions(threads=n)).document)
        for n in (1, 3)
    }
    assert len(texts) == 1


def test_stages_are_reported_in_order():
    seen = []
    frames = [noise(i) for i in range(4)]
    analysis = pipeline.analyze(
        ArrayClip(frames), AnalysisOptions(), lambda stage, done, total: seen.append(stage)
    )
    order = list(dict.fromkeys(seen))
    in_order = ["colour_statistics", "frame_hulls", "glue", "vertex_refinement"]
    assert [stage for stage in order if stage in in_order] == in_order
    names = [stage.stage for stage in analysis.stages]
    assert names == [
        "static_hull",
        "frame_hulls",
        "block_merging",
        "vertex_removal",
        "vertex_refinement",
    ]
    cost = AnalysisOptions().handle_cost
    first, last = (
        s.losses.L_prime + cost * s.vertices for s in (analysis.stages[0], analysis.stages[-1])
    )
    assert last <= first


def test_an_array_is_a_clip():
    frames = np.stack([mixture(np.eye(4)[:, :3], i) for i in range(4)])
    found = pipeline.analyze(frames)
    assert found.document["clip"]["frames"] == {"first": 0, "last": 3, "step": 1, "skipped": []}
    assert found.document["clip"]["size"] == [30, 20]
    same = pipeline.analyze(ArrayClip(frames.astype(np.float64)))
    assert found.document == same.document


def test_how_frames_are_numbered_does_not_matter():
    frames = stats(drifting(6))
    later = [dataclasses.replace(one, frame=one.frame + 1001) for one in frames]
    a, b = (pipeline.find_polytope(f, AnalysisOptions(vertices=12)) for f in (frames, later))
    np.testing.assert_array_equal(a.polytope.vertices[:, :3], b.polytope.vertices[:, :3])
    np.testing.assert_allclose(a.polytope.vertices[:, 3] + 1001, b.polytope.vertices[:, 3])
    assert a.polytope.blocks[-1].last + 1001 == b.polytope.blocks[-1].last


MOVING = {
    "noise that grows": [noise(i, 0.2 + 0.1 * i) for i in range(6)],
    "a flash": [*drifting(5)[:3], constant([1, 1, 1]), *drifting(5)[3:]],
    "a fade": [mixture(FOUR * i / 6, i) for i in range(7)],
    "one colour": [constant([0.3, 0.4, 0.5])] * 3,
    "there and gone": [
        mixture(FOUR if i in (2, 3) else FOUR[:1].repeat(4, 0), i) for i in range(6)
    ],
}


# Static palettes that are held by fewer terms than the default, or by none.
PLAIN = [
    AnalysisOptions(method="static", convexity=c, separation=0, reach=0, hull_box=b)
    for c, b in ((0, 0.15), (3, 0.15), (0, 0.3))
]


@pytest.mark.parametrize("name", MOVING)
def test_the_default_is_never_worse_than_a_static_hull(name):
    frames = stats(MOVING[name])
    analysis = pipeline.find_polytope(frames, AnalysisOptions())
    static = pipeline.find_polytope(frames, AnalysisOptions(method="static"))
    first = analysis.stages[0]
    assert first.stage == "static_hull"
    assert first.losses == static.stages[-1].losses
    assert analysis.stages[-1].losses.L_prime <= first.losses.L_prime + 1e-12
    # Nor than one without our own terms.
    for options in PLAIN:
        plain = pipeline.find_polytope(frames, options).stages[-1]
        assert analysis.stages[-1].losses.L_prime <= plain.losses.L_prime + 1e-12


def test_a_search_without_success_ends_with_the_static_palette(monkeypatch):
    def four_colours(starts, static, rungs, *rest):
        return None, rungs[-1]

    monkeypatch.setattr(structure_search, "search", four_colours)
    stages = pipeline.find_polytope(stats(MOVING["noise that grows"]), AnalysisOptions()).stages
    assert stages[-1].losses == stages[0].losses


_OTHER_COLOURS = pytest.mark.skipif(
    sys.platform == "win32",
    reason="with Windows' C library a plain search keeps 13 colours here, and 10 on Linux",
)


@pytest.mark.parametrize(("first", "last"), [pytest.param(0, 1, marks=_OTHER_COLOURS), (10, 13)])
def test_where_little_moves_the_default_beats_static_colours(seasons, first, last):
    clip = open_clip(str(seasons), frames=f"{first}-{last}")
    found = colour_statistics.gather_clip(clip, AnalysisOptions()).frames
    frames = [found[number] for number in sorted(found)]
    default = pipeline.find_polytope(frames, AnalysisOptions()).stages[-1].losses
    for options in PLAIN:
        assert default.L_prime < pipeline.find_polytope(frames, options).stages[-1].losses.L_prime


@pytest.mark.parametrize("most", [8, 11])
def test_few_vertices_mean_few_colours(most):
    """A colour has one at either end of the clip at least."""
    analysis = pipeline.find_polytope(stats(drifting(9)), AnalysisOptions(vertices=most))
    assert len(analysis.polytope.vertices) <= most
    assert analysis.notes == ()


@pytest.mark.parametrize("method", METHODS)
def test_every_method_covers_the_clip_and_lets_go_of_its_frames(method):
    """Of a show, the frames of one shot after the other are in memory, never of all."""
    frames = stats(drifting(6), first=11)
    gone = [weakref.ref(frame) for frame in frames] + [weakref.ref(f.coarse) for f in frames]
    analysis = pipeline.find_polytope(frames, AnalysisOptions(method=method))
    times = analysis.polytope.vertices[:, 3]
    assert times.min() == 11
    assert times.max() == 16
    assert analysis.polytope.blocks[0].first == 11
    assert analysis.polytope.blocks[-1].last == 16
    assert analysis.stages[-1].vertices == len(times)
    del frames
    gc.collect()
    assert [ref() for ref in gone] == [None] * len(gone)


def test_the_default_beats_the_static_hull_where_colours_move():
    analysis = pipeline.find_polytope(stats(drifting(9)), AnalysisOptions())
    assert analysis.stages[-1].losses.L_prime < 0.8 * analysis.stages[0].losses.L_prime


def test_blocks_are_limited():
    frames = stats([mixture(FOUR, i) for i in range(3)] + [noise(i) for i in range(3)])
    for most in (1, 2):
        analysis = pipeline.find_polytope(frames, AnalysisOptions(blocks=most))
        assert len(analysis.polytope.blocks) <= most


def test_numbers_that_no_sidecar_holds_are_refused_at_once() -> None:
    clip = ArrayClip(np.full((2, 4, 4, 3), 0.5, np.float32), first=20_261_128_100_000)

    def never(*_: object) -> None:
        raise AssertionError

    with pytest.raises(Palette4dError, match="found the frame number 20261128100001"):
        pipeline.analyze(clip, progress=never)


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_values_that_are_no_colours_are_refused_before_the_search(share: float) -> None:
    """As of an ID layer: bits of hashes, read as floats."""
    rng = np.random.default_rng(0)
    frames = rng.random((4, 24, 32, 3), np.float32)
    bits = rng.random(frames.shape[:-1]) < share
    frames[bits] = 10 ** rng.uniform(4, 9, (int(bits.sum()), 3)).astype(np.float32)
    with pytest.raises(Palette4dError, match=r"found code values up to .*expected colours"):
        pipeline.analyze(ArrayClip(frames))
