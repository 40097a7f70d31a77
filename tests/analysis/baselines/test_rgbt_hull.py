"""The simplified convex hull in RGB and time: its slices are those of qhull's, for any clip."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from analysis_frames import constant, grey, mixture, noise, stats
from palette4d.analysis.baselines import rgbt_hull
from palette4d.analysis.colour_statistics import gather
from palette4d.analysis.frame_statistics import Gamut
from palette4d.analysis.objective import loss_of
from palette4d.analysis.options import AnalysisOptions
from scipy.spatial import ConvexHull

from palette4d import _core
from palette4d.common.errors import Palette4dError
from palette4d.grade import sidecar
from palette4d.media.clip import open_clip

OPTIONS = AnalysisOptions()
CORNERS = [[0.1, 0.1, 0.1], [0.9, 0.2, 0.1], [0.2, 0.8, 0.2], [0.2, 0.3, 0.9], [0.9, 0.9, 0.8]]


def flat(seed):
    image = noise(seed)
    image[..., 2] = 0.5
    return image


def lattice(seed, n=3):
    """Colours of which many share planes."""
    values = np.random.default_rng(seed).integers(0, n, (20, 30, 3))
    return (values / (n - 1)).astype(np.float32)


# name: frames, fewest and most colours of a slice (None: any)
CLIPS = {
    "two frames": ([noise(1), noise(2)], (4, None)),
    "just solid": ([flat(i) + noise(i, 0.006) for i in range(4)], (4, None)),
    "three pixels": ([noise(i)[:1, :3] for i in range(3)], (3, None)),
    "float above one and below zero": ([noise(i, 8, -1) for i in range(3)], (4, None)),
    "large values": ([noise(i, 1e4) for i in range(3)], (4, None)),
    "fade from and to black": (
        [noise(i, i / 4) for i in range(5)] + [noise(i, (4 - i) / 4) for i in range(1, 5)],
        (1, None),
    ),
    "grey to colour": ([grey(i) for i in range(3)] + [noise(i) for i in range(3)], (2, None)),
    "flat at one end, three colours at the other": (
        [flat(1), noise(1), noise(2), noise(3)[:1, :3]],
        (3, None),
    ),
    "a flash": (
        [noise(i, 0.5) for i in range(3)] + [constant([1, 1, 1]), noise(4, 0.5)],
        (4, None),
    ),
    "a cut": (
        [noise(i, 0.3) for i in range(2)] + [noise(i, 0.3, 0.6) for i in range(2)],
        (4, None),
    ),
    "still": ([mixture(CORNERS, 0)] * 6, (5, 5)),
    "a still cube": ([lattice(0, 2)] * 5, (8, 8)),
    "a lattice that grows": (
        [lattice(i, 4) * np.float32(0.2 + 0.1 * i) for i in range(6)],
        (4, None),
    ),
}


# Those that are simplified to more vertices, too.
MANY = ("two frames", "a still cube", "a lattice that grows", "fade from and to black")


def cloud(i):
    """Colours in a ball that moves, grows and changes its shape."""
    rng = np.random.default_rng(i)
    ball = rng.normal(size=(20, 30, 3))
    ball *= (rng.random((20, 30, 1)) ** 0.3) / np.linalg.norm(ball, axis=2, keepdims=True)
    radii = [0.2 + 0.02 * i, 0.3 - 0.02 * i, 0.15 + 0.01 * i * i / 4]
    return (0.5 + ball * radii).astype(np.float32)


def frames_of(images, step=1):
    return [dataclasses.replace(s, frame=1001 + step * i) for i, s in enumerate(stats(images))]


def analysed(images, vertices=20, step=1):
    frames = frames_of(images, step=step)
    return frames, rgbt_hull.rgbt_polytope(frames, Gamut.of(frames), vertices)


def document(polytope, step=1):
    clip = {
        "name": "clip",
        "source": "clip.####.png",
        "frames": {
            "first": int(polytope.blocks[0].first),
            "last": int(polytope.blocks[-1].last),
            "step": step,
            "skipped": [],
        },
        "rate": [24, 1],
        "size": [30, 20],
        "encoding": "sRGB",
    }
    return sidecar.new_document(clip, polytope.fields())


def points_of_slice(vertices, t):
    """What a slice of the convex hull is the hull of: where all lines between vertices pass t."""
    times = vertices[:, 3]
    u, w = np.nonzero((times[:, None] < t) & (times[None] > t))
    weight = ((t - times[u]) / (times[w] - times[u]))[:, None]
    passing = vertices[u] + weight * (vertices[w] - vertices[u])
    return np.vstack([vertices[times == t], passing])[:, :3]


def farthest_outside(inner, hull):
    return (inner @ hull.equations[:, :-1].T + hull.equations[:, -1]).max()


def signed_volume(rgb, faces):
    corners = rgb[faces] - rgb.mean(axis=0)
    return np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6


def check_slices(polytope, times):
    """Compare every slice with qhull's; return the numbers of their colours."""
    core = sidecar.validate(document(polytope)).polytope
    vertices = polytope.vertices
    scale = max(1.0, np.abs(vertices[:, :3]).max())
    counts = []
    for t in times:
        piece = _core.slice_at(core, t)
        counts.append(len(piece.rgb))
        expected = points_of_slice(vertices, t)
        assert len(piece.faces) == (2 * len(piece.rgb) - 4 if len(piece.rgb) > 2 else 0)
        volume = signed_volume(piece.rgb, piece.faces)
        spread = np.linalg.svd(expected - expected.mean(axis=0), compute_uv=False)
        if len(expected) < 4 or spread[2] < 1e-9 * scale:  # flat: compare along every direction
            assert abs(volume) < 1e-9 * scale**3
            directions = np.random.default_rng(0).normal(size=(3, 200))
            directions /= np.linalg.norm(directions, axis=0)
            for sign in (1, -1):
                found = (sign * piece.rgb @ directions).max(axis=0)
                np.testing.assert_allclose(
                    found, (sign * expected @ directions).max(axis=0), rtol=0, atol=1e-9 * scale
                )
            continue
        hull = ConvexHull(expected)
        assert farthest_outside(piece.rgb, hull) < 1e-9 * scale
        assert farthest_outside(expected, ConvexHull(piece.rgb)) < 1e-9 * scale
        # The triangles bound that hull, outwards: a fold or a hole would change the volume.
        assert abs(volume - hull.volume) < 1e-9 * scale**3
        a, b, c = (piece.rgb[piece.faces[:, i]] for i in range(3))
        normals = np.cross(b - a, c - a)
        heights = np.einsum("fj,fnj->fn", normals, piece.rgb[None] - a[:, None])
        assert heights.max() < 1e-9 * scale**3
    return counts


@pytest.mark.parametrize(("name", "vertices"), [*((n, 8) for n in CLIPS), *((n, 20) for n in MANY)])
def test_slices_are_those_of_the_convex_hull(name, vertices):
    images, (fewest, most) = CLIPS[name]
    frames, polytope = analysed(images, vertices)
    numbers = [float(f.frame) for f in frames]
    assert set(polytope.vertices[:, 3]) <= set(numbers)
    first, last = numbers[0], numbers[-1]
    between = [*np.linspace(first, last, 17), *(np.array(numbers[:-1]) + 1e-4)]
    counts = check_slices(polytope, sorted({*numbers, *between}))
    assert fewest <= min(counts)
    assert most is None or max(counts) <= most
    # Every frame lies in a block, where the losses are measured.
    rows, _ = loss_of(polytope, frames).evaluate(
        polytope.vertices, list(range(len(frames))), _core.LossWeights(50, 50), 1, False
    )
    assert np.isfinite(rows).all()


@pytest.mark.parametrize("vertices", [8, 40])
def test_everything_is_enclosed_before_clipping(vertices):
    frames = frames_of([cloud(i) for i in range(7)])
    gamut = Gamut.of(frames)
    corners = rgbt_hull.all_extremes(frames, gamut)
    around = rgbt_hull.simplified(corners, 1001, 1007, gamut, vertices)
    assert 8 <= len(around) <= max(vertices, 8)
    assert around[:, 3].min() > 1001 - 1e-7
    assert around[:, 3].max() < 1007 + 1e-7
    hull = ConvexHull((around - [0, 0, 0, 1001]) / [1, 1, 1, 6])
    for frame in frames:
        t = np.full(len(frame.colours.rgb), (frame.frame - 1001) / 6)
        assert farthest_outside(np.column_stack([frame.colours.rgb, t]), hull) < 1e-7


@pytest.mark.parametrize(
    "images",
    [
        [noise(1)],
        [constant([0.3, 0.4, 0.5])] * 5,
        [constant([0.1 + 0.1 * i, 0.4, 0.5]) for i in range(5)],
        [grey(i) + noise(i, 0.001) for i in range(4)],
        [flat(i) + noise(i, 0.003) for i in range(4)],
    ],
    ids=["one frame", "one colour", "one that moves evenly", "nearly grey", "nearly a plane"],
)
def test_colours_without_volume_are_refused(images):
    with pytest.raises(Palette4dError, match="fill no volume"):
        analysed(images)


def test_a_clip_that_does_not_change_is_one_block():
    _, polytope = analysed([mixture(CORNERS, 0)] * 6)
    assert len(polytope.blocks) == 1
    assert [len(track) for track in polytope.blocks[0].tracks] == [2] * 5
    np.testing.assert_allclose(
        np.unique(np.round(polytope.vertices[:, :3], 5), axis=0),
        np.unique(np.round(np.array(CORNERS), 5), axis=0),
        atol=1e-5,
    )


def test_times_are_analysed_frames():
    frames, polytope = analysed([noise(i, 0.5 + 0.05 * i) for i in range(7)], step=3)
    assert set(polytope.vertices[:, 3]) <= {float(f.frame) for f in frames}
    sidecar.validate(document(polytope, step=3))
    covered = [(b.first, b.last) for b in polytope.blocks]
    assert all(any(a <= f.frame <= b for a, b in covered) for f in frames)


def test_vertices_stay_in_the_gamut():
    frames, polytope = analysed([noise(i) for i in range(6)], 12)
    gamut = Gamut.of(frames)
    assert (polytope.vertices[:, :3] >= gamut.low).all()
    assert (polytope.vertices[:, :3] <= gamut.high).all()


@pytest.mark.parametrize("seed", [1023, 1239, 1447])
def test_nearly_coincident_facets_are_told_apart(seed):
    """Points of a lattice, off by rounding: qhull's facets of these do not fit together."""
    rng = np.random.default_rng(seed)
    last = int(rng.integers(1, 8))
    points = rng.integers(0, 4, (60, 4)) / 3
    points[:, 3] = rng.integers(0, last + 1, 60)
    points[:2, 3] = 0, last
    points[:, :3] += rng.normal(0, 10 ** rng.uniform(-17, -5), (60, 3))
    polytope = rgbt_hull.convex_polytope(points, np.arange(last + 1.0))
    core = sidecar.validate(document(polytope)).polytope
    for t in np.linspace(0, last, 9):
        piece = _core.slice_at(core, t)
        expected = points_of_slice(points, t)
        volume = ConvexHull(expected, qhull_options="QJ").volume
        assert signed_volume(piece.rgb, piece.faces) == pytest.approx(volume, abs=1e-5)
        if volume > 1e-3:
            assert farthest_outside(expected, ConvexHull(piece.rgb)) < 1e-6


def test_the_same_clip_gives_the_same_polytope():
    images = [noise(i, 0.5 + 0.05 * i) for i in range(6)]
    one, other = (sidecar.dumps(document(analysed(images)[1])) for _ in range(2))
    assert one == other


def test_progress_ends_at_its_total():
    calls: list[tuple[int, int]] = []
    frames = frames_of([mixture(CORNERS, i) for i in range(6)])
    rgbt_hull.rgbt_polytope(
        frames, Gamut.of(frames), 10, lambda done, total: calls.append((done, total))
    )
    done = [d for d, _ in calls]
    assert len(calls) > 2
    assert done == sorted(done)
    assert len({total for _, total in calls}) == 1
    assert calls[-1][0] == calls[-1][1] > 0


def test_too_few_vertices_are_refused():
    frames = frames_of([noise(1), noise(2)])
    with pytest.raises(Palette4dError, match="found 7, expected at least 8"):
        rgbt_hull.rgbt_polytope(frames, Gamut.of(frames), 7)


@pytest.mark.slow
def test_seasons(seasons):
    """Section 6.2 calls these palettes extremely complex; few vertices have many edges."""
    frames = [
        gather(number, image, OPTIONS) for number, image in open_clip(str(seasons)).iter_colours()
    ]
    gamut = Gamut.of(frames)
    polytope = rgbt_hull.rgbt_polytope(frames, gamut, 20)
    assert 15 <= len(polytope.vertices) <= 20
    check_slices(polytope, np.linspace(0, 49, 99))
    rows, _ = loss_of(polytope, frames).evaluate(
        polytope.vertices, list(range(50)), _core.LossWeights(50, 50), 2, False
    )
    r, c = rows[:, 0].mean(), rows[:, 1].mean()
    assert 50 * r < 0.05
    assert 0.1 < c < 0.2
    colours = [
        len(_core.slice_at(sidecar.validate(document(polytope)).polytope, t).rgb)
        for t in range(1, 49)
    ]
    assert np.mean(colours) > 20
