"""The report: figures that the losses do not give, by hand-made palettes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from analysis_frames import in_core, mixture, noise, stats
from palette4d.analysis import pipeline
from palette4d.analysis.convex_hulls import deepest_concavity, hull_mesh
from palette4d.analysis.losses import NO_FACES, palette_loss
from palette4d.analysis.options import AnalysisOptions
from palette4d.analysis.polytope import Section, SkewPolytope
from palette4d.analysis.report import quality

from palette4d.media.array_clip import ArrayClip

FOUR = np.array([[0.1, 0.1, 0.1], [0.9, 0.2, 0.2], [0.2, 0.9, 0.2], [0.2, 0.2, 0.9]])
OPTIONS = AnalysisOptions()


def resting(corners, faces, last=4):
    """A palette that rests from frame 0 to `last`."""
    n = len(corners)
    vertices = np.array([[*c, t] for t in (0.0, last) for c in corners])
    tracks = tuple((i, n + i) for i in range(n))
    return SkewPolytope(vertices, (Section(0.0, float(last), tracks, faces),), ())


@pytest.fixture
def frames():
    return stats([mixture(FOUR, i) for i in range(5)])


def test_fits_are_the_frames_own_losses(frames):
    mesh = hull_mesh(0.5 + 0.9 * (FOUR - 0.5))
    found = quality.report(in_core(resting(mesh.rgb, mesh.faces), frames), frames, OPTIONS)
    assert [fit.frame for fit in found.fits] == [0, 1, 2, 3, 4]
    for fit, frame in zip(found.fits, frames, strict=True):
        assert pytest.approx(palette_loss(frame.colours, mesh.rgb, OPTIONS)) == fit.L
        assert fit.outside > 0
    assert max(fit.L for fit in found.fits) == found.worst.L
    assert found.median_loss == sorted(fit.L for fit in found.fits)[2]
    assert found.colours == 4
    assert (found.splits, found.merges) == (0, 0)


@pytest.mark.parametrize("crosses", [False, True])
def test_a_palette_that_crosses_itself_is_found(crosses):
    """A house whose top is pushed in, or whose corners have changed places."""
    floor = np.array([[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]])
    walls = np.vstack([np.c_[floor, np.full(4, z)] for z in (0.1, 0.9)])
    mesh = hull_mesh(np.vstack([walls, [0.5, 0.5, 1.0]]))
    rgb = mesh.rgb.copy()
    if crosses:
        rgb = rgb[np.random.default_rng(26).permutation(len(rgb))]
    else:
        rgb[np.argmax(rgb[:, 2]), 2] = 0.5
    frames = stats([np.random.default_rng(0).random((40, 50, 3)).astype(np.float32)] * 5)
    found = quality.report(in_core(resting(rgb, mesh.faces), frames), frames, OPTIONS)
    assert found.concavity[0] > 0.1
    assert (found.crossed[0] > 0) == crosses


def test_look_alikes_are_found_and_named(frames):
    five = np.vstack([FOUR, [0.92, 0.17, 0.2]])
    mesh = hull_mesh(five)
    found = quality.report(in_core(resting(mesh.rgb, mesh.faces), frames), frames, OPTIONS)
    pairs = itertools.combinations(mesh.rgb, 2)
    assert found.closest[0] == pytest.approx(min(np.linalg.norm(a - b) for a, b in pairs))


def test_tracks_of_a_split_are_not_look_alikes(frames):
    """Colour 3 splits at frame 2; its dense are one colour there, and far apart at the end."""
    mesh = hull_mesh(FOUR)
    five = hull_mesh(np.vstack([FOUR, [0.7, 0.7, 0.9]]))
    parent = [int(np.argmin(np.linalg.norm(mesh.rgb - c, axis=1))) for c in five.rgb]
    extra = int(np.argmax(np.linalg.norm(mesh.rgb[parent] - five.rgb, axis=1)))
    split = parent[extra] = int(np.argmin(np.linalg.norm(mesh.rgb - FOUR[3], axis=1)))
    vertices = [[*c, 0.0] for c in mesh.rgb]
    vertices += [[*mesh.rgb[split], 2.0]]
    vertices += [[*c, 4.0] for c in five.rgb]
    early = tuple((i, 4) if i == split else (i, 5 + parent.index(i)) for i in range(4))
    late = tuple((4 if p == split else p, 5 + i) for i, p in enumerate(parent))
    polytope = SkewPolytope(
        np.array(vertices),
        (Section(0.0, 2.0, early, mesh.faces), Section(3.0, 4.0, late, five.faces)),
        (Section(2.0, 3.0, late, five.faces),),
    )
    found = quality.report(in_core(polytope, frames), frames, OPTIONS)
    assert (found.splits, found.merges) == (1, 0)
    assert found.closest[0] > 0.5


def test_concavities_and_unused_handles_are_found(frames):
    cube = np.array(list(itertools.product([0.1, 0.9], repeat=3)))
    mesh = hull_mesh(np.vstack([cube, [0.5, 0.5, 0.95]]))
    apex = int(np.argmin(np.linalg.norm(mesh.rgb - [0.5, 0.5, 0.95], axis=1)))
    concave = mesh.rgb.copy()
    concave[apex, 2] = 0.5  # a pyramid is missing: 1/3 base times 0.4
    polytope = resting(concave, mesh.faces)
    found = quality.report(in_core(polytope, frames), frames, OPTIONS)
    assert found.concavity[0] == pytest.approx((0.8 * 0.8 * 0.4 / 3) / 0.8**3, rel=1e-6)
    assert deepest_concavity(polytope, frames) == pytest.approx(found.concavity[0], rel=1e-6)
    flat = resting(concave * [1, 1, 0.005], mesh.faces)  # as deep a concavity, but who would see it
    assert deepest_concavity(flat, frames) == 0
    thin = resting(concave * [1, 1, 0.03], mesh.faces)
    assert deepest_concavity(thin, frames) == pytest.approx(found.concavity[0], rel=1e-6)

    far = np.vstack([FOUR * 0.2, [0.9, 0.9, 0.9]])
    mesh = hull_mesh(far)
    dark = stats([mixture(FOUR * 0.2, i) for i in range(5)])
    found = quality.report(in_core(resting(mesh.rgb, mesh.faces), dark), dark, OPTIONS)
    handle = found.least_used[0]
    polytope = in_core(resting(mesh.rgb, mesh.faces), dark)
    at = polytope.vertex_ids.index(handle)
    np.testing.assert_allclose(polytope.vertices[at, :3], 0.9, atol=1e-9)
    assert found.least_used[1] < 0.02


def test_the_worst_frame_is_found():
    flash = [mixture(0.3 * FOUR, i) for i in range(9)]
    flash[4] = noise(4)
    frames = stats(flash)
    mesh = hull_mesh(0.3 * FOUR)
    found = quality.report(in_core(resting(mesh.rgb, mesh.faces, 8), frames), frames, OPTIONS)
    assert found.worst.frame == found.farthest.frame == 4


def test_pixels_are_outside_from_a_step_of_8_bits_on():
    """Beside faces, an edge and a corner, each as far as it is; beyond a line."""
    cube = hull_mesh(np.array(list(itertools.product([0.2, 0.6], repeat=3))))
    near, far = 0.9 / 255, 1.2 / 255
    towards = np.array([[1, 0, 0], [1, 1, 0], [1, 1, 1]])
    # Far ones on one side, near ones on the other: pixels that are close count as one.
    pixels = [
        0.4 + side * t * (0.2 + d / np.linalg.norm(t))
        for t in towards
        for side, d in ((-1, near), (1, far))
    ]
    inside = np.full((6, 3), 0.4)
    frames = stats([np.vstack([pixels, inside]).astype(np.float32)[None]] * 2)
    found = quality.report(in_core(resting(cube.rgb, cube.faces, 1), frames), frames, OPTIONS)
    fit = found.fits[0]
    assert fit.outside == pytest.approx(6 / 12)
    assert fit.outside_1_255 == pytest.approx(3 / 12)
    assert fit.farthest == pytest.approx(far, rel=1e-4)

    line = np.array([[0.2, 0.2, 0.2], [0.6, 0.6, 0.6]])
    found = quality.report(in_core(resting(line, NO_FACES, 1), frames), frames, OPTIONS)
    assert found.outside == pytest.approx(
        5 / 12
    )  # all but one beyond a corner, at an end of the line


def test_the_pipeline_reports_and_stores_the_figures():
    clip = ArrayClip([mixture(FOUR + 0.01 * i, i) for i in range(5)])
    analysis = pipeline.analyze(clip)
    last = analysis.document["quality"]["stages"][-1]
    for name, value in analysis.report.figures().items():
        assert last[name] == value
    assert last["L"] == pytest.approx(np.mean([fit.L for fit in analysis.report.fits]), abs=1e-6)
    assert last["farthest_frame"] in clip.frames
