"""From a sidecar to a picture: every implementation, every document."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from parity.cases import (
    DOCUMENTS,
    EDITED,
    FAST_TOLERANCE,
    PICTURE_TOLERANCE,
    UNEDITED,
    picture,
    same_bits,
    times_of,
)
from parity.implementations import (
    CORE,
    FAST,
    IMPLEMENTATIONS,
    LATTICE,
    REFERENCE,
    Core,
    Implementation,
    Lattice,
)
from parity.reference import bumps_at

from palette4d import _core

IMPLEMENTED = pytest.mark.parametrize("code", IMPLEMENTATIONS, ids=lambda code: code.name)


@pytest.mark.parametrize(("channels", "premultiplied"), [(3, False), (4, False), (4, True)])
@pytest.mark.parametrize("name", EDITED)
def test_the_core_recolours_as_the_reference(name: str, channels: int, premultiplied: bool) -> None:
    image = picture(channels)
    for frame in times_of(name):
        for strength in (1.0, 0.4):
            arguments = image, DOCUMENTS[name], frame, strength, premultiplied
            expected, found = REFERENCE.recolour(*arguments), CORE.recolour(*arguments)
            np.testing.assert_allclose(found, expected, **PICTURE_TOLERANCE)
            fast = FAST.recolour(*arguments)
            np.testing.assert_allclose(fast, expected, **FAST_TOLERANCE)


@pytest.mark.parametrize("name", EDITED)
@pytest.mark.parametrize("instructions", _core.instruction_sets())
def test_every_instruction_set_gives_the_same_bits(instructions: str, name: str) -> None:
    for channels, premultiplied in ((3, False), (4, True)):
        image, frame = picture(channels), times_of(name)[2]
        arguments = image, DOCUMENTS[name], frame, 0.9, premultiplied
        found = Core("single", instructions).recolour(*arguments)
        assert same_bits(found, FAST.recolour(*arguments)).all()


@pytest.mark.parametrize(("channels", "premultiplied"), [(3, False), (4, False), (4, True)])
@pytest.mark.parametrize("name", EDITED)
def test_the_lattice_is_within_its_tolerance_of_the_reference(
    name: str, channels: int, premultiplied: bool
) -> None:
    image = picture(channels)
    odd = ~np.isfinite(image).all(axis=2)
    for frame in times_of(name):
        for strength in (1.0, 0.4):
            arguments = image, DOCUMENTS[name], frame, strength, premultiplied
            expected, found = REFERENCE.recolour(*arguments), LATTICE.recolour(*arguments)
            assert same_bits(found[odd], expected[odd]).all()
            wanted = expected[~odd].astype(float)
            error = np.abs(found[~odd] - wanted) / np.maximum(np.abs(wanted), 0.1)
            if channels == 4:  # alpha may be anything, and is untouched
                assert same_bits(found[:, :, 3], image[:, :, 3]).all()
                error = error[:, :3]
            assert error.max() <= _core.LATTICE_TOLERANCE
            # What it cannot interpolate has the bits of the exact one, here that beyond its margin.
            with np.errstate(all="ignore"):
                straight = image[:, :, :3] / (image[:, :, 3:] if premultiplied else 1)
                outside = (np.abs(straight - 0.5) > 3).any(axis=2)
            exact = FAST.recolour(*arguments)
            assert same_bits(found[outside], exact[outside]).all()


@pytest.mark.parametrize("name", EDITED)
@pytest.mark.parametrize("instructions", _core.instruction_sets())
def test_every_instruction_set_interpolates_to_the_same_bits(instructions: str, name: str) -> None:
    for channels, premultiplied in ((3, False), (4, True)):
        arguments = picture(channels), DOCUMENTS[name], times_of(name)[2], 0.9, premultiplied
        found = Lattice(instructions).recolour(*arguments)
        assert same_bits(found, LATTICE.recolour(*arguments)).all()


@IMPLEMENTED
@pytest.mark.parametrize("name", UNEDITED)
def test_without_an_edit_the_picture_is_untouched(code: Implementation, name: str) -> None:
    for channels in (3, 4):
        image = picture(channels)
        for frame in times_of(name):
            result = code.recolour(image, DOCUMENTS[name], frame, 1.0, channels == 4)
            assert same_bits(result, image).all()


@IMPLEMENTED
@pytest.mark.parametrize("name", EDITED)
def test_strength_0_is_the_input_and_strength_is_linear(code: Implementation, name: str) -> None:
    image = picture(3)
    frame = times_of(name)[3]
    assert same_bits(code.recolour(image, DOCUMENTS[name], frame, 0.0), image).all()
    finite = np.isfinite(image).all(axis=2)
    full = code.recolour(image, DOCUMENTS[name], frame, 1.0)[finite].astype(float)
    half = code.recolour(image, DOCUMENTS[name], frame, 0.5)[finite].astype(float)
    atol = 2e-4 if code is FAST else 2e-7  # two results of FAST, 1e-4 each
    np.testing.assert_allclose(half, (full + image[finite]) / 2, rtol=2e-7, atol=atol)
    assert (full != image[finite]).any()


@IMPLEMENTED
def test_awkward_pixels_pass_bit_for_bit(code: Implementation) -> None:
    image = picture(4)
    odd = ~np.isfinite(image[:, :, :3]).all(axis=2) | (image[:, :, 3] == 0)
    assert odd.sum() >= 5
    result = code.recolour(image, DOCUMENTS["changes-vertex"], 9.0, 1.0, True)
    assert same_bits(result[odd], image[odd]).all()
    assert same_bits(result[:, :, 3], image[:, :, 3]).all()
    assert not same_bits(result[~odd][:, :3], image[~odd][:, :3]).all()


@IMPLEMENTED
def test_colours_outside_keep_their_distance(code: Implementation) -> None:
    """Far beyond one corner of the body, everything moves as the corner does."""
    document = DOCUMENTS["still-edited"]
    image = np.array([[[0.0, 40.0, 0.0], [-3.0, 25.0, -5.0]]], np.float32)
    moved = code.recolour(image, document, 7).astype(float) - image
    np.testing.assert_allclose(moved, np.tile([0.3, -0.2, 0.1], (1, 2, 1)), atol=4e-6)


def test_rounds_are_rare_where_the_implementations_differ() -> None:
    """Both compute in float64 and round once, so that nearly all results share all bits."""
    image = picture(3)
    result = CORE.recolour(image, DOCUMENTS["changes-stops"], 12.5)
    expected = REFERENCE.recolour(image, DOCUMENTS["changes-stops"], 12.5)
    assert same_bits(result, expected).mean() > 0.98


@pytest.mark.parametrize("name", ["still-bumps", "colour-bumps"])
def test_colours_beyond_all_bumps_keep_their_bits(name: str) -> None:
    image = picture(3)
    for frame in times_of(name):
        (centre, radius, *_), *_ = bumps_at(DOCUMENTS[name], frame)
        away = np.linalg.norm(image - centre, axis=2)
        beyond = ~(away < radius * (1 - 1e-6))  # NaN too
        assert 0 < beyond.sum() < beyond.size
        for code in (CORE, FAST, LATTICE):
            found = code.recolour(image, DOCUMENTS[name], frame)
            assert same_bits(found, image)[beyond].all()
            assert not same_bits(found, image)[~beyond].all(axis=1).any()


def test_bumps_add_to_what_the_palette_does() -> None:
    """The same picture without and with bumps differs by them alone."""
    document, frame, image = DOCUMENTS["changes-picks"], 12.5, picture(3)
    finite = np.isfinite(image).all(axis=2)
    plain = copy.deepcopy(document)
    plain["edits"]["solution"]["bumps"] = []
    colours = image[finite].astype(float)
    wanted = np.zeros_like(colours)
    for centre, radius, by, *_ in bumps_at(document, frame):
        within = 1 - ((colours - centre) ** 2).sum(axis=1, keepdims=True) / radius**2
        wanted += np.maximum(within, 0) ** 3 * by
    for code in (CORE, FAST, LATTICE):
        found, without = (
            code.recolour(image, d, frame)[finite].astype(float) for d in (document, plain)
        )
        near = np.abs(colours).max(axis=1) < 10
        np.testing.assert_allclose((found - without)[near], wanted[near], rtol=0, atol=1e-6)
