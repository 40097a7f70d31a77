"""The error of a file: how far it is from the exact edit, over a set of colours.

a is the colour that OpenColorIO computes from the file; b is the core's colour in double precision.
So the error includes interpolation, rounding of the file's code values, and clamping outside the
LUT's domain. There are three measures, each with its mean and its largest value:

- absolute: |a - b| per channel;
- relative: |a - b| / max(|b|, 0.1) per channel, the measure of CLF's implementation guide;
- deltaE: CIEDE2000 between the two colours (`palette4d.colour.difference`).
"""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from decimal import ROUND_CEILING, Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export.frame_edit import FrameEdit

from palette4d.colour.difference import VISIBLE, Viewing, delta_e_2000
from palette4d.colour.ocio_config import failures
from palette4d.colour.ocio_processor import ExactProcessor
from palette4d.common.errors import Palette4dError

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

#: The denominator of the relative error is at least this.
FLOOR = 0.1

#: An error is worth a warning if more of the colours than this have a visible one.
SEEN = 0.01

#: Colours in one piece of a thread's work: they fit in a processor's cache.
PIECE = 1 << 14

#: deltaE is measured on at most about this many colours, evenly spread over the set.
DELTA_E_COLOURS = 1 << 20


#: A file read back: (n, 3) float32 colours -> (n, 3) float32.
Reader = Callable[[F32], F32]

#: The ways in which hosts read a file: a name, then a setter of OpenColorIO's FileTransform.
READINGS = {
    "linear": ("setInterpolation", "INTERP_LINEAR"),
    "tetrahedral": ("setInterpolation", "INTERP_TETRAHEDRAL"),
    "clamped": ("setCDLStyle", "CDL_ASC"),
    "not clamped": ("setCDLStyle", "CDL_NO_CLAMP"),
}


def load(path: Path, readings: Iterable[str]) -> dict[str, Reader]:
    """Read a file back through OpenColorIO, once for each of the given `READINGS`.

    If a LUT names its own interpolation, that is used.

    Raises
    ------
    Palette4dError
        OpenColorIO cannot read the file.
    """
    import PyOpenColorIO as ocio

    # OpenColorIO caches files by name: drop an earlier file of this name.
    ocio.ClearAllCaches()
    readers: dict[str, Reader] = {}
    for name in readings:
        setter, value = READINGS[name]
        transform = ocio.FileTransform(src=str(path.absolute()))
        getattr(transform, setter)(getattr(ocio, value))
        try:
            # An empty context: the environment would replace "$HOME" in a folder's name.
            readers[name] = ExactProcessor(
                ocio.Config.CreateRaw().getProcessor(
                    ocio.Context(), transform, ocio.TRANSFORM_DIR_FORWARD
                )
            )
        except failures() as error:
            raise Palette4dError(f"{path}: OpenColorIO cannot read it: {error}") from error
    return readers


@dataclass(frozen=True)
class Figures:
    """Means and maxima over a set of colours; of deltaE 2000 also what 99 % stay below."""

    mean: float
    largest: float
    relative_mean: float
    relative_largest: float
    delta_e_mean: float
    delta_e_99: float
    delta_e_largest: float


@dataclass(frozen=True)
class Measure:
    """The error over one set of colours.

    Attributes
    ----------
    colours : how many colours were compared.
    delta_e_colours : how many of them, evenly spread, with deltaE.
    visible : share of these with a deltaE 2000 above `VISIBLE`, in the worst reading.
    outside_domain : share of colours with a channel outside the file's domain, where it clamps.
    worst : the larger of `by_reading`, figure by figure: a bound for every host.
    by_reading : for each reading of the file.
    """

    colours: int
    delta_e_colours: int
    visible: float
    outside_domain: float
    worst: Figures
    by_reading: dict[str, Figures]


@dataclass(frozen=True)
class _Part:
    """Sums and maxima of a piece, (readings, 3), its visible errors and all deltaE."""

    colours: int
    delta_e_colours: int
    outside: int
    sums: F64
    maxima: F64
    visible: NDArray[np.int64]
    delta_e: NDArray[np.float32]


def measure(
    colours: F32,
    readers: Mapping[str, Reader],
    edit: FrameEdit,
    viewing: Viewing,
    domain: tuple[float, float] = (0.0, 1.0),
    threads: int = 0,
    shaped: Callable[[F32], F32] | None = None,
) -> Measure | None:
    """Compare files with the exact core.

    Parameters
    ----------
    colours : (h, w, 3 or more) float array; the colours to compare. NaNs and infinities are left
        out: no LUT can hold them.
    readers : for each reading, a function that applies the file.
    edit : the exact edit.
    viewing : for deltaE.
    domain : (low, high); of the file, for `Measure.outside_domain`.
    threads : 0: one per processor; the result does not depend on it.
    shaped : converts colours to the code values of the domain.

    Returns
    -------
    Measure or None
        None when no colour is finite.
    """
    stride = max(1, colours.shape[0] * colours.shape[1] // DELTA_E_COLOURS)

    def work(piece: F32) -> _Part:
        return _compare(piece, readers, edit, viewing, domain, stride, shaped)

    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        parts = list(pool.map(work, _pieces(colours)))
    count = sum(part.colours for part in parts)
    if not count:
        return None
    seen = sum(part.delta_e_colours for part in parts)
    # Add in the order of the pieces: the sums must not depend on the threads.
    total = np.sum([part.sums for part in parts], axis=0) / [3 * count, 3 * count, max(seen, 1)]
    largest = np.max([part.maxima for part in parts], axis=0)
    delta_e = np.concatenate([part.delta_e for part in parts], axis=1)
    most = np.zeros(len(readers))
    if seen:
        most = np.quantile(delta_e, 0.99, axis=1, method="higher").astype(np.float64)
    return Measure(
        colours=count,
        delta_e_colours=seen,
        visible=float(np.sum([part.visible for part in parts], axis=0).max() / max(seen, 1)),
        outside_domain=sum(part.outside for part in parts) / count,
        worst=_figures(total.max(axis=0), largest.max(axis=0), most.max()),
        by_reading={
            name: _figures(total[i], largest[i], most[i]) for i, name in enumerate(readers)
        },
    )


@dataclass(frozen=True)
class DeltaE:
    """DeltaE 2000 over a picture: the mean, what 99 % stay below, the largest."""

    mean: float
    most: float
    largest: float


def largest_delta_e(
    picture: F32, wanted: F32, readers: Mapping[str, Reader], viewing: Viewing
) -> DeltaE:
    """Compare files with a wanted picture, (h, w, 3) each; the largest of all readings."""
    pixels, aims = picture.reshape(-1, 3), wanted.reshape(-1, 3)
    finite = np.isfinite(pixels).all(axis=1) & np.isfinite(aims).all(axis=1)
    stride = max(1, len(pixels) // DELTA_E_COLOURS)
    pixels, aims = pixels[finite][::stride], aims[finite][::stride]
    if not len(pixels):
        return DeltaE(0.0, 0.0, 0.0)
    lab = viewing.lab(aims)
    errors = [delta_e_2000(lab, viewing.lab(reader(pixels))) for reader in readers.values()]
    return DeltaE(
        max(float(e.mean()) for e in errors),
        max(float(np.quantile(e, 0.99, method="higher")) for e in errors),
        max(float(e.max()) for e in errors),
    )


def _figures(mean: F64, largest: F64, most_e: float) -> Figures:
    (a, r, e), (largest_a, largest_r, largest_e) = mean.tolist(), largest.tolist()
    return Figures(a, largest_a, r, largest_r, e, float(most_e), largest_e)


def _pieces(colours: NDArray[Any]) -> Iterator[F32]:
    rows = max(1, PIECE // max(1, colours.shape[1]))
    for first in range(0, colours.shape[0], rows):
        piece = np.ascontiguousarray(colours[first : first + rows, :, :3], dtype=np.float32)
        yield piece.reshape(-1, 3)


def _compare(
    piece: F32,
    readers: Mapping[str, Reader],
    edit: FrameEdit,
    viewing: Viewing,
    domain: tuple[float, float],
    stride: int,
    shaped: Callable[[F32], F32] | None,
) -> _Part:
    finite = np.isfinite(piece).all(axis=-1)
    colours = piece if finite.all() else np.ascontiguousarray(piece[finite])
    sums, maxima = np.zeros((len(readers), 3)), np.zeros((len(readers), 3))
    visible = np.zeros(len(readers), np.int64)
    if not colours.size:
        return _Part(0, 0, 0, sums, maxima, visible, np.zeros((len(readers), 0), np.float32))
    values = colours if shaped is None else shaped(colours)
    outside = int(((values < domain[0]) | (values > domain[1])).any(axis=-1).sum())
    exact = edit.exact(colours)
    scale = np.maximum(np.abs(exact), FLOOR)
    lab = viewing.lab(exact[::stride])
    all_delta_e = np.zeros((len(readers), len(lab)), np.float32)
    for i, reader in enumerate(readers.values()):
        got = reader(colours).astype(np.float64)
        absolute = np.abs(got - exact)
        relative = absolute / scale
        delta_e = delta_e_2000(lab, viewing.lab(got[::stride]))
        visible[i] = (delta_e > VISIBLE).sum()
        all_delta_e[i] = delta_e
        for k, errors in enumerate((absolute, relative, delta_e)):
            sums[i, k], maxima[i, k] = errors.sum(), errors.max()
    return _Part(len(colours), len(lab), outside, sums, maxima, visible, all_delta_e)


def stated(value: float, digits: int = 3) -> str:
    """Return an error with three significant digits, rounded up so that the statement is true.

    >>> stated(0.0123401), stated(0.0), stated(0.5)
    ('0.0124', '0', '0.5')
    """
    if value <= 0:
        return "0"
    if not value < 1e20:
        return f"{value:.{digits}g}"
    exact = Decimal(value)
    step = Decimal(1).scaleb(exact.adjusted() - digits + 1)
    return f"{float(exact.quantize(step, rounding=ROUND_CEILING)):.{digits}g}"


def figures_text(figures: Figures) -> str:
    """Return errors in one line."""
    f = figures
    return (
        f"|a-b|/max(|b|,0.1) mean {stated(f.relative_mean)}, largest {stated(f.relative_largest)}; "
        f"deltaE 2000 mean {stated(f.delta_e_mean)}, 99 % {stated(f.delta_e_99)}, "
        f"largest {stated(f.delta_e_largest)}"
    )


def table(rows: Iterable[tuple[str, Figures]]) -> list[str]:
    """Return the lines of a printed table of errors, a row for each (name, figures)."""
    listed = list(rows)
    width = max(len(name) for name, _ in listed)
    lines = [
        f"{'error':<{width}}  |a-b|/max(|b|,0.1)   deltaE 2000",
        f"{'':<{width}}  mean      largest    mean      99 %      largest",
    ]
    for name, f in listed:
        mean, largest = stated(f.relative_mean), stated(f.relative_largest)
        delta_e = [stated(value) for value in (f.delta_e_mean, f.delta_e_99, f.delta_e_largest)]
        row = f"{name:<{width}}  {mean:<9} {largest:<10} {delta_e[0]:<9} {delta_e[1]:<9} "
        lines.append((row + delta_e[2]).rstrip())
    return lines
