"""The numeric bindings: what they accept, what they refuse and how they say so, and the GIL."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from interpreter import assert_interpreter_runs_on
from numpy.typing import NDArray
from parity.cases import DOCUMENTS, cube, picture, same_bits

from palette4d import _core

Image = NDArray[np.float32]


def sidecar(name: str) -> _core.Sidecar:
    return _core.parse_sidecar(json.dumps(DOCUMENTS[name]), name)


@pytest.fixture
def recolourer() -> _core.Recolourer:
    rgb, faces = cube()
    edited = rgb.copy()
    edited[7] = (1.2, 0.7, 0.9)
    edited[1] = (0.8, 0.1, -0.1)
    return _core.Recolourer(rgb, edited, faces)


# Polytope and slice -------------------------------------------------------------------------------


def test_a_polytope_shows_what_it_is_made_of() -> None:
    document = DOCUMENTS["changes"]["polytope"]
    polytope = sidecar("changes").polytope
    assert polytope.vertices.dtype == np.float64
    assert polytope.vertices.tolist() == [[*v["rgb"], v["frame"]] for v in document["vertices"]]
    assert polytope.vertex_ids == [v["id"] for v in document["vertices"]]
    assert polytope.edges.dtype == np.int32
    assert polytope.edge_ids == [e["id"] for e in document["edges"]]
    names = polytope.vertex_ids
    assert [[names[i] for i in pair] for pair in polytope.edges.tolist()] == [
        [e["from"], e["to"]] for e in document["edges"]
    ]
    assert (polytope.first_frame, polytope.last_frame) == (0.0, 30.0)


def test_sections_are_blocks_and_transitions_in_turn() -> None:
    document = DOCUMENTS["changes"]["polytope"]
    polytope = sidecar("changes").polytope
    names = polytope.vertex_ids
    sections = polytope.sections
    assert [s["transition"] for s in sections] == [False, True, False, True, False]
    assert [(s["first"], s["last"]) for s in sections] == [
        (0, 8), (8, 10), (10, 20), (20, 23), (23, 30),
    ]  # fmt: skip
    for section, source in zip(sections[::2], document["blocks"], strict=True):
        assert [[names[i] for i in track] for track in section["tracks"]] == source["tracks"]
        assert section["faces"].tolist() == source["faces"]


def test_a_polytope_outlives_its_sidecar() -> None:
    polytope = sidecar("changes").polytope
    assert _core.slice_at(polytope, 9).rgb.shape == (5, 3)


def test_a_slice_has_arrays_of_the_right_kind() -> None:
    cut = _core.slice_at(sidecar("changes").polytope, 9)
    assert (cut.frame, cut.section) == (9.0, 1)
    for array, dtype, shape in (
        (cut.rgb, np.float64, (5, 3)),
        (cut.faces, np.int32, (6, 3)),
        (cut.edges, np.int32, (5,)),
        (cut.ends, np.int32, (5, 2)),
        (cut.weights, np.float64, (5,)),
    ):
        assert (array.dtype, array.shape) == (dtype, shape)
    assert _core.slice_at(sidecar("colour").polytope, 3).faces.shape == (0, 3)


def test_edges_of_a_slice_index_the_polytope() -> None:
    polytope = sidecar("changes").polytope
    cut = _core.slice_at(polytope, 14.5)
    assert cut.edges[1] == -1
    assert polytope.vertex_ids[cut.ends[1, 0]] == "bm"
    for edge, ends in zip(cut.edges, cut.ends, strict=True):
        if edge >= 0:
            assert polytope.edges[edge].tolist() == ends.tolist()


def test_a_frame_that_is_no_number_is_refused() -> None:
    with pytest.raises(ValueError, match="not a number"):
        _core.slice_at(sidecar("still").polytope, float("nan"))


def test_edits_of_another_sidecar_are_refused() -> None:
    changes, still = sidecar("changes"), sidecar("still-edited")
    with pytest.raises(ValueError, match="edits of 4 vertices, expected 17"):
        _core.edited_colours(changes.polytope, still.edits, _core.slice_at(changes.polytope, 0))
    with pytest.raises(ValueError, match="not one of this polytope"):
        _core.edited_colours(still.polytope, still.edits, _core.slice_at(changes.polytope, 9))


# Points and palettes ------------------------------------------------------------------------------


def test_points_of_any_layout_give_the_same_weights() -> None:
    rgb, faces = cube()
    points = np.random.default_rng(1).uniform(0.1, 0.9, (40, 3)).astype(np.float32)
    expected = _core.palette_weights(points.astype(float), rgb, faces)[0]
    for same in (
        points,
        np.asfortranarray(points),
        np.repeat(points, 2, axis=0)[::2],
        points[::-1][::-1],
        points.tolist(),
        points.astype(">f4"),
        points.astype(np.longdouble),
    ):
        assert _core.palette_weights(same, rgb, faces)[0].tolist() == expected.tolist()
    turned = _core.palette_weights(points, np.asfortranarray(rgb), np.array(faces, np.uint8))[0]
    assert turned.tolist() == expected.tolist()


def test_no_points_give_no_weights() -> None:
    rgb, faces = cube()
    weights, distance = _core.palette_weights(np.zeros((0, 3)), rgb, faces)
    assert weights.shape == (0, 8)
    assert distance.shape == (0,)


def test_points_that_are_not_finite_give_nan_and_spare_the_others() -> None:
    rgb, faces = cube()
    points = np.array([[np.nan, 0, 0], [0.5, 0.5, 0.5], [0, np.inf, 0]])
    weights, distance = _core.palette_weights(points, rgb, faces)
    assert np.isnan(weights).all(axis=1).tolist() == [True, False, True]
    assert np.isnan(distance).tolist() == [True, False, True]
    np.testing.assert_allclose(weights[1] @ rgb, 0.5, rtol=0, atol=1e-14)


RGB, FACES = cube()


@pytest.mark.parametrize(
    ("points", "rgb", "faces", "message"),
    [
        (np.zeros(3), RGB, FACES, r"points: found shape \(3,\), expected \(n, 3\)"),
        (np.zeros((4, 4)), RGB, FACES, r"points: found shape \(4, 4\), expected \(n, 3\)"),
        (np.zeros((1, 3), complex), RGB, FACES, "points: found dtype complex128, expected real"),
        ([["a", "b", "c"]], RGB, FACES, "points: found dtype <U1, expected real"),
        ([[1, 2], [3]], RGB, FACES, "points: not an array of numbers"),
        (np.zeros((1, 3)), RGB[:, :2], FACES, r"rgb: found shape \(8, 2\), expected \(n, 3\)"),
        (np.zeros((1, 3)), RGB * np.nan, FACES, "palette colour 0 is not finite"),
        (np.zeros((1, 3)), np.zeros((0, 3)), [], "without colours"),
        (np.zeros((1, 3)), RGB, [], "8 colours without faces"),
        (np.zeros((1, 3)), RGB[:2], [[0, 1, 0]], "fewer than three colours"),
        (np.zeros((1, 3)), RGB, [[0, 1, 8]], "face 0 has corner 8; expected 0 to 7"),
        (np.zeros((1, 3)), RGB, [[0, 1, -1]], "faces: found corner -1"),
        (np.zeros((1, 3)), RGB, [[0, 1, 2**40]], "faces: found corner 1099511627776"),
        (np.zeros((1, 3)), RGB, [[0, 1]], r"faces: found shape \(1, 2\), expected \(f, 3\)"),
        (np.zeros((1, 3)), RGB, [[0.0, 1.0, 2.0]], "faces: found dtype float64, expected integers"),
    ],
)  # fmt: skip
def test_bad_palettes_are_refused_in_words(points: Any, rgb: Any, faces: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        _core.palette_weights(points, rgb, faces)


# Images -------------------------------------------------------------------------------------------


def test_identity_is_known(recolourer: _core.Recolourer) -> None:
    assert not recolourer.identity
    assert _core.Recolourer(RGB, RGB, FACES).identity


@pytest.mark.parametrize("channels", [3, 4])
def test_views_with_any_row_stride_are_read_and_written(
    recolourer: _core.Recolourer, channels: int
) -> None:
    image = picture(channels)
    expected = recolourer.apply(image)
    assert expected.dtype == np.float32
    assert expected.flags.c_contiguous
    height, width = image.shape[:2]
    padded = np.full((height, width + 5, channels), 7, np.float32)
    padded[:, 2 : width + 2] = image
    before = padded.copy()
    assert same_bits(recolourer.apply(padded[:, 2 : width + 2]), expected).all()
    assert same_bits(recolourer.apply(image[::-1]), expected[::-1]).all()
    assert same_bits(recolourer.apply(image[::2]), expected[::2]).all()
    returned = recolourer.apply(image, out=padded[::-1, 2 : width + 2])
    assert same_bits(padded[::-1, 2 : width + 2], expected).all()
    assert returned.base is padded or np.shares_memory(returned, padded)
    assert (padded[:, :2] == before[:, :2]).all()
    assert (padded[:, width + 2 :] == before[:, width + 2 :]).all()
    place = image.copy()
    assert recolourer.apply(place, out=place) is place
    assert same_bits(place, expected).all()


def test_read_only_images_are_read(recolourer: _core.Recolourer) -> None:
    image = picture()
    image.flags.writeable = False
    assert recolourer.apply(image).shape == image.shape


@pytest.mark.parametrize("shape", [(0, 4, 3), (4, 0, 4), (0, 0, 3)])
def test_empty_images_stay_empty(recolourer: _core.Recolourer, shape: tuple[int, int, int]) -> None:
    assert recolourer.apply(np.zeros(shape, np.float32)).shape == shape


def unaligned(shape: tuple[int, ...]) -> Image:
    size = int(np.prod(shape)) * 4
    return np.zeros(size + 1, np.uint8)[1:].view(np.float32).reshape(shape)


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((2, 2, 3)), "image: found dtype float64, expected float32"),
        (np.zeros((2, 2, 3), ">f4"), "image: found dtype >f4, expected float32"),
        (np.zeros((2, 2), np.float32), r"image: found shape \(2, 2\), expected \(h, w, 3\) or"),
        (np.zeros((2, 2, 2), np.float32), r"image: found shape \(2, 2, 2\)"),
        (np.zeros((2, 4, 3), np.float32)[:, ::2], "bytes per pixel .* expected packed rows"),
        (np.zeros((2, 2, 6), np.float32)[:, :, ::2], "expected packed rows"),
        (np.zeros((2, 2, 4), np.float32)[:, :, :3], "16 bytes per pixel .* expected packed rows"),
        (np.broadcast_to(np.zeros((1, 2, 3), np.float32), (5, 2, 3)), "found rows 0 bytes apart"),
        (unaligned((2, 2, 3)), "unaligned memory"),
    ],
)
def test_bad_images_are_refused_in_words(
    recolourer: _core.Recolourer, image: Any, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        recolourer.apply(image)


def test_bad_outputs_are_refused_in_words(recolourer: _core.Recolourer) -> None:
    image = np.zeros((4, 4, 3), np.float32)
    with pytest.raises(ValueError, match=r"out: found shape \(4, 5, 3\), expected the image's"):
        recolourer.apply(image, out=np.zeros((4, 5, 3), np.float32))
    with pytest.raises(ValueError, match="out: found dtype float64"):
        recolourer.apply(image, out=np.zeros((4, 4, 3)))  # type: ignore[arg-type]
    frozen = image.copy()
    frozen.flags.writeable = False
    with pytest.raises(ValueError, match="out: found a read-only array"):
        recolourer.apply(image, out=frozen)
    with pytest.raises(ValueError, match="out: found memory that overlaps"):
        recolourer.apply(image, out=image[::-1])
    with pytest.raises(ValueError, match="out: not a NumPy array"):
        recolourer.apply(image, out=[1.0])  # type: ignore[arg-type]


def test_bad_options_are_refused_in_words(recolourer: _core.Recolourer) -> None:
    image = np.zeros((4, 4, 3), np.float32)
    with pytest.raises(ValueError, match="-1 threads"):
        recolourer.apply(image, threads=-1)
    with pytest.raises(ValueError, match="strength is not finite"):
        recolourer.apply(image, strength=float("nan"))
    with pytest.raises(ValueError, match=r"7 edited colours; expected as many .* 8"):
        _core.Recolourer(RGB, RGB[:7], FACES)
    with pytest.raises(ValueError, match="edited colour 0 is not finite"):
        _core.Recolourer(RGB, RGB + np.inf, FACES)


def test_the_interpreter_runs_on_while_an_image_is_recoloured(
    recolourer: _core.Recolourer,
) -> None:
    image = np.random.default_rng(4).uniform(0, 1, (400, 700, 3)).astype(np.float32)
    assert_interpreter_runs_on(lambda: recolourer.apply(image))
