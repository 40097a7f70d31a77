"""The clean-up of picks against a plain filter, written anew from its description."""

import json

import numpy as np
import pytest
from numpy.typing import NDArray
from parity.cases import DOCUMENTS
from parity.implementations import Core
from parity.kernel import draw

from palette4d import _core

F64 = NDArray[np.float64]

CELL, AROUND, NOISE, FAINT, MOST = 4, 2, 4e-4, 0.1, 2.0
TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def picks(change: tuple[float, float, float] = (-0.4, 0.3, 0.1)) -> _core.FramePicks:
    """Return one pick of all reds."""
    red = (0.8, 0.25, 0.2)
    odds = _core.hue_matte(red).astype(np.float64) - 63
    matte = 1 / (1 + np.exp(-odds * 6 / 63))
    return _core.FramePicks([(red, change, 1.0, np.where(odds > -63, matte, 0).astype(np.float32))])


def recolourer(found: _core.FramePicks | None = None, *, moves: bool = False) -> _core.Recolourer:
    """Return the picks on a palette that moves one colour, or none."""
    edited = [*TETRAHEDRON[:3], (0.1, 0.2, 0.9)] if moves else TETRAHEDRON
    return _core.Recolourer(TETRAHEDRON, edited, FACES, picks=found or picks())


def picture(height: int, width: int, seed: int = 3) -> NDArray[np.float32]:
    """Return smooth colours with edges and noise; a third of them are red."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width] / 23.0
    image = 0.5 + 0.3 * np.stack([np.sin(x + y), np.cos(2 * y - x), np.sin(3 * x)], -1)
    image[(np.floor(x) + np.floor(y)) % 3 == 0] = (0.75, 0.3, 0.2)
    return (image + rng.normal(0, 0.02, image.shape)).astype(np.float32)


def around(cells: F64) -> F64:
    """Return sums over the cells around each cell, those that there are."""
    padded = np.pad(cells, ((AROUND, AROUND), (AROUND, AROUND), (0, 0)))
    windows = np.lib.stride_tricks.sliding_window_view(
        padded, (2 * AROUND + 1, 2 * AROUND + 1), axis=(0, 1)
    )
    result: F64 = windows.sum((-2, -1))
    return result


def cells_of(pixels: F64, cell: int) -> F64:
    """Return sums over cells that are counted from the lower left."""
    height, width = pixels.shape[:2]
    padded = np.pad(pixels, ((-height % cell, 0), (0, -width % cell), (0, 0)))
    rows, columns = padded.shape[0] // cell, padded.shape[1] // cell
    result: F64 = padded.reshape(rows, cell, columns, cell, -1).sum((1, 3))
    return result


def between(cells: F64, height: int, width: int, cell: int) -> F64:
    """Return the cells' values at all pixels, linear between the cells' centres."""

    def axis(values: F64, size: int) -> F64:
        at = np.clip((np.arange(size) + 0.5) / cell - 0.5, 0, len(values) - 1)
        low = np.floor(at).astype(int)
        part = (at - low)[:, None, None]
        high = np.minimum(low + 1, len(values) - 1)
        result: F64 = (1 - part) * values[low] + part * values[high]
        return result

    down = axis(cells[::-1], height)[::-1]
    return axis(down.transpose(1, 0, 2), width).transpose(1, 0, 2)


def limited(colours: F64) -> F64:
    """Return the guide: colours beyond 0..1 are brought nearer to it."""
    with np.errstate(all="ignore"):
        low = np.where(colours < 0, colours / (1 - colours), colours)
        return np.where(colours > 1, 2 - 1 / colours, low)


def shares_of(image: NDArray[np.float32], found: _core.FramePicks) -> F64:
    """Return the shares of their changes that picks do, (h, w, 1): of a change without light."""
    whole = [(colour, (1.0, -1.0, 0.0), 1.0, matte) for colour, _, _, matte in found.picks]
    map_ = _core.Recolourer(TETRAHEDRON, TETRAHEDRON, FACES, picks=_core.FramePicks(whole))
    result: F64 = (map_.apply(image).astype(np.float64) - image)[..., :1]
    return result


def filtered(
    image: NDArray[np.float32],
    displacement: F64,
    good: NDArray[np.bool_],
    found: _core.FramePicks | None = None,
    cell: int = CELL,
) -> F64:
    """Return the displacement, filtered with the picture as its guide, (h, w, 3)."""
    height, width = good.shape
    image = np.where(good[..., None], image, 0).astype(np.float32)
    guide = limited(image.astype(np.float64))
    moved = np.concatenate([displacement, shares_of(image, found or picks())], -1)
    moved = np.where(good[..., None], moved, 0)
    products = (guide[..., :, None] * guide[..., None, :]).reshape(height, width, 9)
    mixed = (guide[..., :, None] * moved[..., None, :]).reshape(height, width, 12)
    cells = cells_of(np.concatenate([good[..., None], guide, moved, products, mixed], -1), cell)
    sums = around(cells)
    means = sums[..., 1:] / np.maximum(sums[..., :1], 1)
    shape = (*means.shape[:2], 3, 3)
    mean_guide, mean_moved = means[..., :3], means[..., 3:7]
    column = mean_guide[..., :, None]
    covariance = means[..., 7:16].reshape(shape) - column * mean_guide[..., None, :]
    mixed = means[..., 16:].reshape(*shape[:3], 4) - column * mean_moved[..., None, :]
    slopes = np.linalg.solve(covariance + NOISE * np.eye(3), mixed)
    constant = mean_moved - np.einsum("...c,...cd->...d", mean_guide, slopes)
    terms = np.concatenate([slopes.reshape(*shape[:2], 12), constant], -1)
    weight = (cells[..., :1] > 0).astype(np.float64)
    terms = around(terms * weight) / np.maximum(around(weight), 1)
    terms = between(terms, height, width, cell)
    slopes, constant = terms[..., :12].reshape(height, width, 3, 4), terms[..., 12:]
    found_moved = np.einsum("hwc,hwcd->hwd", guide, slopes) + constant
    share = np.maximum(found_moved[..., 3:], 0)
    result: F64 = found_moved[..., :3] * np.minimum(share, MOST) / np.maximum(share, FAINT)
    return result


@pytest.mark.parametrize("size", [(64, 96), (37, 51), (3, 5), (1, 1), (9, 130)])
@pytest.mark.parametrize("amount", [1.0, 0.3])
@pytest.mark.parametrize("moves", [False, True])
def test_the_core_filters_what_picks_do(size: tuple[int, int], amount: float, moves: bool) -> None:
    image = picture(*size)
    edit = recolourer(moves=moves)
    palette = recolourer(_core.FramePicks([]), moves=moves)
    displacement = edit.apply(image).astype(np.float64) - palette.apply(image)
    change = filtered(image, displacement, np.ones(size, bool)) - displacement
    expected = _core.draw(image, "recoloured", edit, clean_up=0) + amount * change
    drawn = _core.draw(image, "recoloured", edit, clean_up=amount)
    np.testing.assert_allclose(drawn, expected, atol=3e-6)


def test_highlights_and_negative_colours_guide_as_nearer_ones() -> None:
    image = picture(60, 80)
    image[20:23, 30:50] *= 40
    image[40:44, 30:50] -= 3
    guide = image.astype(np.float64)
    displacement = _core.draw(image, "recoloured", recolourer(), clean_up=0) - guide
    expected = guide + filtered(image, displacement, np.ones((60, 80), bool))
    drawn = _core.draw(image, "recoloured", recolourer())
    np.testing.assert_allclose(drawn, expected, atol=3e-6, rtol=3e-7)


def test_a_white_beside_a_strong_change_does_not_go_the_other_way() -> None:
    # Eyes in a pale face beside red lockers that become blue.
    image = np.full((40, 60, 3), (0.75, 0.25, 0.2), np.float32)
    image[12:30, 20:34] = 0.55, 0.5, 0.3
    image[18:20, 24:26] = 0.95, 0.95, 0.95
    for found in (picks(), picks((0.2, 0.1, -0.2))):
        drawn = _core.draw(image, "recoloured", recolourer(found))
        np.testing.assert_allclose(drawn[18:20, 24:26], image[18:20, 24:26], atol=0.002)
        assert np.abs(drawn[2, 2] - image[2, 2]).max() > 0.15


def test_colours_that_are_none_take_no_part() -> None:
    image = picture(40, 60)
    image[10:20, 5:30] = np.nan
    image[30, 30, 1] = np.inf
    good = np.isfinite(image).all(-1)
    guide = np.where(good[..., None], image, 0).astype(np.float64)
    displacement = recolourer().apply(guide.astype(np.float32)).astype(np.float64) - guide
    expected = guide + filtered(image, displacement, good)
    drawn = _core.draw(image, "recoloured", recolourer())
    np.testing.assert_array_equal(drawn[~good], image[~good])
    np.testing.assert_allclose(drawn[good], expected[good], atol=3e-6)


@pytest.mark.parametrize(("lines", "cell"), [(1080, 4), (360, 4), (288, 2), (90, 2)])
def test_cells_are_half_as_large_in_small_clips(lines: int, cell: int) -> None:
    """Beyond what the filter sees of a picked colour nothing changes, within it something does."""
    document = json.loads(json.dumps(DOCUMENTS["still-pick"]))
    document["clip"]["size"] = [16 * lines // 9, lines]
    sidecar = Core.sidecar(document)
    cut, picks = _core.slice_at(sidecar.polytope, 7.0), sidecar.picks_at(7.0)
    edit = _core.Recolourer(cut.rgb, cut.rgb, cut.faces, picks=picks)
    image = np.full((48, 160, 3), (0.1, 0.3, 0.8), np.float32)
    image[:, 80:] += np.random.default_rng(1).normal(0, 0.05, (48, 80, 1)).astype(np.float32)
    assert (_core.draw(image, "recoloured", edit, clean_up=0) == image).all()
    image[:, :80] = picks.picks[0][0]
    support = 6 * cell
    for drawn in (_core.draw(image, "recoloured", edit), draw(image, edit, clean_up=1.0)):
        moved = np.flatnonzero((drawn != image).any(axis=(0, 2)))
        assert support // 2 < moved.max() - 79 <= support
