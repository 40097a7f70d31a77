"""The measures of an error, against plain NumPy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from palette4d.lut_export.bake_error import Figures, measure, stated, table
from palette4d.lut_export.frame_edit import FrameEdit, frame_edit

from palette4d import Palette4dError, _core
from palette4d.colour.difference import delta_e_2000, viewing_of

F32 = NDArray[np.float32]
SRGB = viewing_of("sRGB")


class Off:
    """A file that is wrong by a known amount."""

    def __init__(self, edit: FrameEdit, by: tuple[float, float, float]) -> None:
        self.edit, self.by = edit, by

    def __call__(self, colours: F32) -> F32:
        wrong = self.edit.exact(colours) + np.array(self.by) * colours
        return np.asarray(wrong, dtype=np.float32)


@pytest.fixture
def edit(warm_sidecar: Path) -> FrameEdit:
    return frame_edit(_core.read_sidecar(str(warm_sidecar)), 4.0)


def picture(height: int = 90, width: int = 400) -> F32:
    return np.random.default_rng(2).random((height, width, 3), dtype=np.float32)


def test_against_plain_numpy(edit: FrameEdit) -> None:
    colours = picture()
    readers = {"a": Off(edit, (0.01, 0.0, -0.02)), "b": Off(edit, (0.0, 0.03, 0.0))}
    got = measure(colours, readers, edit, SRGB)
    assert got is not None
    flat = colours.reshape(-1, 3)
    exact = edit.exact(flat)
    for name, reader in readers.items():
        difference = np.abs(reader(flat).astype(np.float64) - exact)
        relative = difference / np.maximum(np.abs(exact), 0.1)
        delta_e = delta_e_2000(SRGB.lab(exact), SRGB.lab(reader(flat)))
        want = (
            difference.mean(), difference.max(), relative.mean(), relative.max(),
            delta_e.mean(), np.quantile(delta_e, 0.99, method="higher"), delta_e.max(),
        )  # fmt: skip
        f = got.by_reading[name]
        have = (
            f.mean, f.largest, f.relative_mean, f.relative_largest, f.delta_e_mean,
            f.delta_e_99, f.delta_e_largest,
        )  # fmt: skip
        np.testing.assert_allclose(have, want, rtol=1e-7)
        assert delta_e.max() > 0.5
    assert got.colours == got.delta_e_colours == 90 * 400
    assert got.worst.largest == max(f.largest for f in got.by_reading.values())
    assert got.worst.delta_e_mean == max(f.delta_e_mean for f in got.by_reading.values())


def test_the_exact_edit_is_the_nodes(edit: FrameEdit) -> None:
    colours = picture(10) * 3 - 1
    exact = edit.exact(colours.reshape(-1, 3)).reshape(colours.shape)
    assert np.abs(exact - colours).max() > 0.2
    np.testing.assert_allclose(edit.apply(colours), exact, atol=2e-7, rtol=2e-7)


def test_threads_do_not_matter(edit: FrameEdit) -> None:
    readers = {"a": Off(edit, (0.01, 0.0, -0.02))}
    one, two = (measure(picture(), readers, edit, SRGB, threads=n) for n in (1, 5))
    assert one == two


def test_what_is_not_finite_is_left_out(edit: FrameEdit) -> None:
    readers = {"a": Off(edit, (0.01, 0.0, 0.0))}
    colours = picture(4, 4)
    want = measure(colours[1:], readers, edit, SRGB)
    colours[0] = [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf], [np.nan] * 3]
    got = measure(colours, readers, edit, SRGB)
    assert got is not None
    assert want is not None
    assert got.colours == 12
    assert got.worst.largest == want.worst.largest
    colours[:] = np.nan
    assert measure(colours, readers, edit, SRGB) is None


def test_colours_outside_the_domain(edit: FrameEdit) -> None:
    colours = np.full((1, 8, 3), 0.5, dtype=np.float32)
    colours[0, :2] = [[0.5, 0.5, 1.25], [-0.25, 0.5, 0.5]]
    readers = {"a": Off(edit, (0, 0, 0))}
    for domain, share in (((0, 1), 0.25), ((-0.25, 1), 0.125), ((-1, 2), 0.0)):
        got = measure(colours, readers, edit, SRGB, domain)
        assert got is not None
        assert got.outside_domain == share


def test_large_pictures_have_delta_e_on_part_of_their_colours(
    edit: FrameEdit, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("palette4d.lut_export.bake_error.DELTA_E_COLOURS", 1000)
    got = measure(picture(), {"a": Off(edit, (0.01, 0.0, 0.0))}, edit, SRGB)
    assert got is not None
    assert got.colours == 36_000
    assert 1000 <= got.delta_e_colours <= 1100
    assert got.worst.delta_e_mean > 0


@pytest.mark.parametrize("value", [0.0, 1e-12, 0.0123401, 0.5, 0.9999, 3.0, 123.4, 5e36, np.inf])
def test_stated_figures_are_never_too_small(value: float) -> None:
    assert value <= float(stated(value)) <= value * 1.01


def test_table_has_a_row_each() -> None:
    figures = Figures(0.1, 0.2, 0.00048828125, 0.25, 1.5, 4.0, 21.0)
    lines = table([("on the clip", figures), ("x", figures)])
    assert len(lines) == 4
    assert lines[2].split() == ["on", "the", "clip", "0.000489", "0.25", "1.5", "4", "21"]
    starts = [line.index("0.25") for line in lines[2:]]
    assert starts[0] == starts[1]


@pytest.mark.parametrize(("frame", "strength"), [(-0.1, 1.0), (10.5, 1.0), (2.0, 1.5)])
def test_no_edit_there(write_sidecar: Callable[..., Path], frame: float, strength: float) -> None:
    sidecar = _core.read_sidecar(str(write_sidecar()))
    with pytest.raises(Palette4dError, match="expected"):
        frame_edit(sidecar, frame, strength)
