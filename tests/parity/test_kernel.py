"""The GPU kernel's text beside the reference and the exact core."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from parity import test_clean_up
from parity.cases import (
    BODIES,
    DOCUMENTS,
    EDITED,
    FAST_TOLERANCE,
    UNEDITED,
    Body,
    picture,
    random_hull,
    same_bits,
    times_of,
)
from parity.implementations import CORE, REFERENCE, Core, Document
from parity.kernel import KERNEL, draw, draw_by_metal
from parity.test_conversions import golden

from palette4d import _core

F64 = NDArray[np.float64]

#: Of the exact path, in the palette's code values; the promise is 1e-4.
GOAL = 4e-5


@pytest.mark.parametrize(("channels", "premultiplied"), [(3, False), (4, False), (4, True)])
@pytest.mark.parametrize("name", EDITED)
def test_the_kernel_recolours_as_the_reference(
    name: str, channels: int, premultiplied: bool
) -> None:
    image = picture(channels)
    for frame, strength in zip(times_of(name)[1:4], (1.0, 0.4, 1.0), strict=True):
        arguments = image, DOCUMENTS[name], frame, strength, premultiplied
        expected, found = REFERENCE.recolour(*arguments), KERNEL.recolour(*arguments)
        np.testing.assert_allclose(found, expected, **FAST_TOLERANCE)


@pytest.mark.parametrize("name", UNEDITED)
def test_without_an_edit_the_picture_is_untouched(name: str) -> None:
    for channels in (3, 4):
        image = picture(channels)
        for frame in times_of(name):
            result = KERNEL.recolour(image, DOCUMENTS[name], frame, 1.0, channels == 4)
            assert same_bits(result, image).all()


def test_pixels_that_no_edit_reaches_keep_their_bits() -> None:
    name = "still-pick"
    image = picture(4)
    exact = CORE.recolour(image, DOCUMENTS[name], 7.0)
    found = KERNEL.recolour(image, DOCUMENTS[name], 7.0)
    untouched = same_bits(exact, image)
    assert 10 < untouched.sum() < untouched.size
    assert same_bits(found, image)[untouched].all()


def near(rgb: F64, faces: list[list[int]], seed: int) -> NDArray[np.float32]:
    """Colours at 1e-8 to 1e-2 from faces, edges, vertices and planes, and anywhere."""
    rng = np.random.default_rng(seed)
    points = [rng.uniform(-0.2, 1.2, (4000, 3))]
    if faces:
        corners = rgb[np.array(faces)]
        away = np.repeat(10.0 ** np.arange(-8, -1), 6)
        for alpha in ((1, 1, 1), (1, 1, 0), (1, 0, 0)):
            shares = rng.dirichlet([1, 1, 1], (len(faces), len(away))) * np.array(alpha)
            shares /= shares.sum(axis=2, keepdims=True)
            at = np.einsum("fnk,fkc->fnc", shares, corners)
            points.append((at + away[:, None] * rng.normal(size=at.shape)).reshape(-1, 3))
        # In the planes, beside the faces.
        wide = rng.normal(size=(len(faces), len(away), 3)) * 2
        wide[..., 2] = 1 - wide[..., 0] - wide[..., 1]
        at = np.einsum("fnk,fkc->fnc", wide, corners)
        at = at + away[:, None] * rng.normal(size=at.shape)
        points.append(at[(np.abs(at - 0.5) < 0.7).all(axis=2)])
    return np.concatenate(points).astype(np.float32)


def largest_error(rgb: F64, faces: list[list[int]], seed: int) -> float:
    """Of the kernel from double precision, where all vertices move by up to 0.3."""
    rng = np.random.default_rng(seed)
    moved = rng.uniform(-0.3, 0.3, rgb.shape)
    # Where a colour splits, its parts begin with one change.
    same = np.argmax((rgb[:, None] == rgb[None]).all(axis=2), axis=1)
    edited = rgb + moved[same]
    recolourer = _core.Recolourer(rgb, edited, faces)
    image = near(rgb, faces, seed)[None]
    exact = recolourer.apply(image, precision="double")
    return float(np.abs(draw(image, recolourer).astype(float) - exact).max())


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
def test_every_kind_of_palette_is_within_the_goal(body: Body) -> None:
    assert largest_error(body.rgb, body.faces, 3) < GOAL


@pytest.mark.parametrize("points", [8, 12, 16])
@pytest.mark.parametrize("squeeze", [1.0, 0.02])
def test_random_hulls_are_within_the_goal(points: int, squeeze: float) -> None:
    for seed in range(3):
        rgb, faces = random_hull(seed, points)
        rgb = 0.5 + (rgb - 0.5) * np.array([1, squeeze, 1])
        assert largest_error(rgb, faces, seed) < GOAL


def reader(name: str, frame: float, output: str) -> _core.Recolourer:
    """What draws a matte of a document."""
    sidecar = Core.sidecar(DOCUMENTS[name])
    cut = _core.slice_at(sidecar.polytope, frame)
    if output == "outside":
        return _core.Recolourer(cut.rgb, _core.surface_reader(cut), cut.faces)
    if output == "pick":
        return _core.Recolourer(
            cut.rgb, cut.rgb, cut.faces, picks=sidecar.pick_matte_at("red", frame)
        )
    read = _core.weight_reader(sidecar.polytope, sidecar.edits, cut, "v2")
    return _core.Recolourer(cut.rgb, read, cut.faces)


@pytest.mark.parametrize("in_alpha", [False, True])
@pytest.mark.parametrize("premultiplied", [False, True])
@pytest.mark.parametrize("output", ["weight", "outside", "pick"])
def test_mattes_are_those_of_the_core(output: str, premultiplied: bool, in_alpha: bool) -> None:
    recolourer = reader("still-learned", 7.0, output)
    image = picture(4)
    options = {
        "output": output,
        "mix": 0.7,
        "matte_in_alpha": in_alpha,
        "outside_at": 0.1,
        "premultiplied": premultiplied,
    }
    expected = _core.draw(image, map=recolourer, clean_up=0.0, **options)
    found = draw(image, recolourer, **options)
    np.testing.assert_allclose(found, expected, rtol=2e-7, atol=GOAL * 10)
    assert np.ptp(expected[1:5, :, :]) > 0.1


@pytest.mark.parametrize("premultiplied", [False, True])
def test_lightness_is_kept_and_the_source_mixed_in_as_in_the_core(premultiplied: bool) -> None:
    recolourer = Core("single").recolourer(DOCUMENTS["still-learned"], 7.0)
    image = picture(4)
    options = {
        "strength": 0.8,
        "keep_lightness": 0.6,
        "lightness": [0.2126, 0.7152, 0.0722],
        "mix": 0.5,
        "premultiplied": premultiplied,
    }
    expected = _core.draw(image, "recoloured", recolourer, clean_up=0.0, **options)
    found = draw(image, recolourer, **options)
    np.testing.assert_allclose(found, expected, **FAST_TOLERANCE)
    assert (found[1:] != image[1:]).any()


def light(count: int = 6000) -> NDArray[np.float32]:
    """RGBA from deep shadows to highlights, below 0, and what is no colour."""
    random = np.random.default_rng(8)
    pixels = np.exp2(random.uniform(-12, 4, (count, 1))) * random.uniform(0.1, 1, (count, 4))
    pixels[::3, :3] = random.uniform(-0.3, 1.3, pixels[::3, :3].shape)
    pixels[:, 3] = random.uniform(0.2, 1, count)
    pixels[:12, 0] = np.repeat([np.nan, np.inf, -np.inf, 1e30], 3)
    pixels[12:18, 3] = np.repeat([0, np.nan], 3)
    return pixels[None].astype(np.float32)


def curves() -> list[Document]:
    """Steps with three sampled curves there, and one back."""
    x = np.linspace(-0.4, 1.5, 4096)
    made = [np.sinh(2 * x) / 4 + 0.1, np.expm1(x), x**3 + 0.3 * x]
    samples = [{"x": x.tolist(), "y": y.tolist()} for y in made]
    return [
        {"kind": "curve", "direction": "forward", "curves": samples},
        {"kind": "matrix", "matrix": [[0.8, 0.3, -0.1], [0, 1, 0], [-0.05, 0.2, 0.85]],
         "offset": [0.01, 0, -0.02]},
        {"kind": "curve", "direction": "inverse", "curves": [samples[1]]},
    ]  # fmt: skip


CONVERSIONS = {
    "scene_linear": golden("scene_linear")["clip"]["conversion"]["steps"],
    "every_step": golden("every_step")["clip"]["conversion"]["steps"],
    "curves": curves(),
}


@pytest.mark.parametrize("premultiplied", [False, True])
@pytest.mark.parametrize("output", ["recoloured", "weight", "outside", "pick"])
@pytest.mark.parametrize("name", CONVERSIONS)
def test_pictures_in_another_colour_space(name: str, output: str, premultiplied: bool) -> None:
    conversion = _core.ColourConversion(json.dumps(CONVERSIONS[name]))
    image = light()
    if name != "scene_linear":  # where their logs and curves are
        usual = np.abs(image) < 20
        image[usual] = np.tanh(image[usual])
    if premultiplied:
        image[..., :3] *= image[..., 3:]
    if output == "recoloured":
        recolourer = Core("single").recolourer(DOCUMENTS["still-learned"], 7.0)
    else:
        recolourer = reader("still-learned", 7.0, output)
    options = {"output": output, "premultiplied": premultiplied, "conversion": conversion}
    expected = _core.draw(image, map=recolourer, clean_up=0.0, **options)
    found = draw(image, recolourer, **options)
    odd = ~np.isfinite(image[..., :3]).all(axis=-1)
    if premultiplied:
        odd |= (image[..., 3] == 0) | np.isnan(image[..., 3])
    assert 8 < odd.sum() < 20
    assert same_bits(found, expected)[odd].all()
    far = (np.abs(image) > 1e6).any(axis=-1)
    expected, found, image = (a[~odd & ~far].astype(float) for a in (expected, found, image))
    if output != "recoloured":
        np.testing.assert_allclose(found, expected, atol=10 * GOAL)
        assert np.ptp(expected[:, :3]) > 0.1
        return
    untouched = (expected[:, :3] == image[:, :3]).all(axis=-1)
    assert 10 < untouched.sum() < len(image)
    assert (found[untouched, :3] == image[untouched, :3]).all()
    alpha = expected[:, 3:] if premultiplied else 1
    found_there, there = (conversion.to_palette(a[:, :3] / alpha) for a in (found, expected))
    # A matrix mixes channels: the largest one sets the scale.
    size = np.maximum(np.abs(there).max(axis=1, keepdims=True), 1)
    off = np.abs(found_there - there) / size
    assert off.max() < GOAL
    np.testing.assert_array_equal(found[:, 3], image[:, 3])


def test_the_kernel_says_which_conversions_it_lacks() -> None:
    steps = [{"kind": "curve", "direction": "forward",
              "curves": [{"x": [0, 1, 1 + 1e-12, 2], "y": [0, 1, 2, 3]}]}]  # fmt: skip
    conversion = _core.ColourConversion(json.dumps(steps))
    recolourer = Core("single").recolourer(DOCUMENTS["still-edited"], 7.0)
    with pytest.raises(ValueError, match="a conversion beyond single precision"):
        draw(light(), recolourer, conversion=conversion)


@pytest.mark.parametrize("size", [(64, 96), (37, 51), (3, 5), (1, 1), (9, 130)])
@pytest.mark.parametrize("amount", [1.0, 0.3])
@pytest.mark.parametrize("moves", [False, True])
def test_picks_are_cleaned_up_as_in_the_core(
    size: tuple[int, int], amount: float, moves: bool
) -> None:
    image = test_clean_up.picture(*size)
    image[1:3, 2:5] *= 20
    image[3:5, 2:5] -= 3
    image[30:31, 30:34, 1] = np.nan
    recolourer = test_clean_up.recolourer(moves=moves)
    expected = _core.draw(image, "recoloured", recolourer, clean_up=amount)
    found = draw(image, recolourer, clean_up=amount)
    np.testing.assert_allclose(found, expected, rtol=GOAL, atol=GOAL / 4)
    untouched = same_bits(expected, image)
    assert same_bits(found, image)[untouched].all()
    plain = draw(image, recolourer)
    assert np.nanmax(np.abs(plain - found)) > 0.02 * amount or min(size) < 9


@pytest.mark.parametrize("output", ["recoloured", "pick"])
@pytest.mark.parametrize("converts", [False, True])
@pytest.mark.parametrize("premultiplied", [False, True])
def test_pictures_with_alpha_are_cleaned_up(
    output: str, converts: bool, premultiplied: bool
) -> None:
    image = np.ones((60, 90, 4), np.float32)
    image[..., :3] = test_clean_up.picture(60, 90)
    image[..., 3] = np.random.default_rng(1).uniform(0.2, 1, image.shape[:2])
    image[20:24, 30:40, 3] = 0
    options: dict[str, Any] = {"output": output, "premultiplied": premultiplied, "clean_up": 1.0}
    conversion = _core.ColourConversion(json.dumps(CONVERSIONS["scene_linear"]))
    if converts:
        options["conversion"] = conversion
        image[..., :3] = conversion.to_clip(image[..., :3].reshape(-1, 3)).reshape(60, 90, 3)
    if premultiplied:
        image[..., :3] *= image[..., 3:]
    recolourer = test_clean_up.recolourer()
    if output == "pick":
        recolourer = reader("still-learned", 7.0, "pick")
    elif not converts:
        options |= {"keep_lightness": 0.3, "lightness": [0.2126, 0.7152, 0.0722]}
    expected = _core.draw(image, map=recolourer, **options)
    found = draw(image, recolourer, **options)
    if converts and output == "recoloured":
        some = image[..., 3] > 0
        alpha = image[some, 3:].astype(float) if premultiplied else 1
        there = [conversion.to_palette(a[some, :3] / alpha) for a in (found, expected)]
        np.testing.assert_allclose(there[0], there[1], atol=GOAL)
    else:
        np.testing.assert_allclose(found, expected, atol=GOAL)
    untouched = same_bits(expected, image)
    assert same_bits(found, image)[untouched].all()
    assert not np.array_equal(found, draw(image, recolourer, **options | {"clean_up": 0.0}))


@pytest.mark.parametrize("name", ["changes", "still-learned"])
@pytest.mark.parametrize("clean_up", [0.0, 0.7])
def test_the_kernel_for_metal_draws_the_same(name: str, clean_up: float) -> None:
    recolourer = Core("single").recolourer(DOCUMENTS[name], 7.0)
    image = picture(4)
    options = {"premultiplied": True, "clean_up": clean_up}
    expected = draw(image, recolourer, **options)
    expected[:, [0, -1]] = 0
    found = draw_by_metal(image, recolourer, **options)
    np.testing.assert_allclose(found, expected, **FAST_TOLERANCE)
    assert (found[:, 1:-1] != image[:, 1:-1]).any() == (name != "changes")


@pytest.fixture
def make_ptx(repo_root: Path) -> ModuleType:
    """tools/make_ptx.py."""
    spec = importlib.util.spec_from_file_location("make_ptx", repo_root / "tools" / "make_ptx.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_ptx_is_that_of_the_kernel(make_ptx: ModuleType) -> None:
    """Mended by: python tools/make_ptx.py."""
    text = make_ptx.PTX.read_text(encoding="utf-8")
    assert text.startswith(make_ptx.stamp())
    try:
        importlib.metadata.version("nvidia-cuda-nvrtc-cu11")
    except importlib.metadata.PackageNotFoundError:
        return  # the stamp alone
    assert text == make_ptx.compiled()
