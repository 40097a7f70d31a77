"""Bake an edit at one time into a LUT file and state the error of that file.

The error is |a - b| per channel, where a is what OpenColorIO makes of a colour with the file read
back and b what the core makes of it exactly: mean and largest, over the clip's own colours at that
time and over the midpoints of the lattice's cells. It therefore contains everything: interpolation,
the rounding of the file's numbers, and the clamping of colours outside the table's domain.
"""

import hashlib
import uuid
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from decimal import ROUND_CEILING, Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d import _core
from palette4d.errors import Palette4dError
from palette4d.lut_export import lattice as lattices
from palette4d.lut_export.formats import Description, LoadedLut, LutFormat, format_of
from palette4d.replacing import refuse_existing, replacing

F32 = NDArray[np.float32]

#: Colours that are measured at a time: bounds the memory that a 4K frame or a size of 129 takes.
CHUNK = 1 << 20

#: The namespace of the tables' ids (RFC 9562, version 5), drawn once for this project.
NAMESPACE = uuid.UUID("09823ba4-0bc8-43a9-995d-cb9a6abeb5b3")


@dataclass(frozen=True)
class BakeOptions:
    """What to bake: the frame number (real), the lattice's size 2..129, the strength 0..1."""

    frame: float
    size: int = 33
    strength: float = 1.0


@dataclass(frozen=True)
class Difference:
    """|a - b| over a set of colours.

    Attributes
    ----------
    interpolation : str
        How the file was read.
    mean, largest : float
        Over all channels of all colours.
    """

    interpolation: str
    mean: float
    largest: float


@dataclass(frozen=True)
class Measure:
    """The error over one set of colours.

    Attributes
    ----------
    colours : int
        How many colours were compared.
    outside_domain : float
        Share of colours with a channel outside 0..1, which a table without shaper clamps.
    mean, largest : float
        Of the worst of `by_interpolation`: holds however a host reads the file.
    """

    colours: int
    outside_domain: float
    mean: float
    largest: float
    by_interpolation: tuple[Difference, ...]


@dataclass(frozen=True)
class BakeResult:
    """What was written, and how far it is from the exact edit.

    Attributes
    ----------
    midpoints : Measure
        On the midpoints of the lattice's cells.
    clip : Measure or None
        On the colours of the clip's frame; None without one.
    clip_frame : int or None
        The frame of the clip that was measured (the nearest to a fractional time).
    identity : bool
        Nothing is edited at that time.
    """

    output: str
    format: str
    id: str
    sidecar: str
    sidecar_sha256: str
    clip_name: str
    encoding: str
    frame: float
    size: int
    strength: float
    domain: tuple[float, float]
    rounding: str
    identity: bool
    midpoints: Measure
    clip: Measure | None
    clip_frame: int | None

    def as_json(self) -> dict[str, Any]:
        """Return the result as plain JSON values."""
        return asdict(self)


class _Sums:
    """Running mean and maximum of |a - b| for each interpolation."""

    def __init__(self, tables: dict[str, LoadedLut]) -> None:
        self.tables = tables
        self.total = dict.fromkeys(tables, 0.0)
        self.largest = dict.fromkeys(tables, 0.0)
        self.colours = 0
        self.outside = 0

    def add(self, colours: F32, exact: F32) -> None:
        """Compare (h, w, 3) colours with their exact replacements."""
        self.colours += colours[..., 0].size
        self.outside += int(np.count_nonzero(((colours < 0) | (colours > 1)).any(axis=-1)))
        for name, table in self.tables.items():
            difference = np.abs(table.apply(colours).astype(np.float64) - exact)
            self.total[name] += float(difference.sum())
            self.largest[name] = max(self.largest[name], float(difference.max()))

    def measure(self) -> Measure:
        """Return the figures."""
        differences = tuple(
            Difference(name, self.total[name] / (3 * self.colours), self.largest[name])
            for name in self.tables
        )
        return Measure(
            colours=self.colours,
            outside_domain=self.outside / self.colours,
            mean=max(d.mean for d in differences),
            largest=max(d.largest for d in differences),
            by_interpolation=differences,
        )


def measure(
    pieces: Iterable[F32],
    tables: dict[str, LoadedLut],
    recolourer: _core.Recolourer,
    strength: float,
) -> Measure | None:
    """Compare tables with the exact core on (h, w, 3) float32 pieces; None without any colour.

    Colours with a NaN or an infinity are left out: no table holds them.
    """
    sums = _Sums(tables)
    for piece in pieces:
        finite = np.isfinite(piece).all(axis=-1)
        colours = piece if finite.all() else np.ascontiguousarray(piece[finite][None])
        if colours.size:
            sums.add(colours, recolourer.apply(colours, strength=strength, threads=0))
    return sums.measure() if sums.colours else None


def _midpoint_pieces(size: int) -> Iterator[F32]:
    channel = lattices.midpoints(size)
    step = max(1, CHUNK // max(1, channel.size**2))
    for first in range(0, channel.size, step):
        yield lattices.grid(channel, slice(first, first + step))


def _image_pieces(image: NDArray[Any]) -> Iterator[F32]:
    rows = max(1, CHUNK // max(1, image.shape[1]))
    for first in range(0, image.shape[0], rows):
        yield np.ascontiguousarray(image[first : first + rows, :, :3], dtype=np.float32)


def frame_text(frame: float) -> str:
    """Return a frame number without needless decimals: 24, 24.5."""
    return f"{frame:.15g}"


def stated(value: float) -> str:
    """Return an error with three significant digits, rounded up: what is stated must hold.

    >>> stated(0.0123401), stated(0.0), stated(0.5)
    ('0.0124', '0', '0.5')
    """
    if value <= 0:
        return "0"
    exact = Decimal(value)
    step = Decimal(1).scaleb(exact.adjusted() - 2)
    return f"{float(exact.quantize(step, rounding=ROUND_CEILING)):.3g}"


def table_id(sidecar_sha256: str, options: BakeOptions) -> str:
    """Return the URN of a table: the same for the same sidecar, frame, size and strength."""
    content = f"{sidecar_sha256} {options.frame!r} {options.size} {options.strength!r}"
    return uuid.uuid5(NAMESPACE, content).urn


def check_options(options: BakeOptions, polytope: _core.Polytope, name: str) -> None:
    """Refuse what cannot be baked.

    Raises
    ------
    Palette4dError
        The size, the strength or the frame is out of range.
    """
    lattices.check_size(options.size)
    if not 0 <= options.strength <= 1:
        raise Palette4dError(f"strength {options.strength} is not possible; expected 0 to 1")
    first, last = polytope.first_frame, polytope.last_frame
    if not first <= options.frame <= last:
        raise Palette4dError(
            f"frame {frame_text(options.frame)} is outside the clip {name!r}; expected a time from "
            f"{frame_text(first)} to {frame_text(last)} (fractions are allowed)"
        )


def _error_lines(midpoints: Measure, clip: Measure | None, clip_frame: int | None) -> list[str]:
    lines = [
        f"error |a-b| on the midpoints of the lattice's cells: mean {stated(midpoints.mean)}, "
        f"largest {stated(midpoints.largest)}"
    ]
    if clip is not None:
        lines.insert(
            0,
            f"error |a-b| on the clip's colours at frame {clip_frame}: mean {stated(clip.mean)}, "
            f"largest {stated(clip.largest)}",
        )
    return lines


def _describe(
    sidecar: _core.Sidecar,
    sidecar_sha256: str,
    options: BakeOptions,
    format_: LutFormat,
    errors: tuple[Measure, Measure | None, int | None] | None,
) -> Description:
    clip = sidecar.clip
    encoding = clip["encoding"] or "the clip's own encoding"
    frame = frame_text(options.frame)
    info: dict[str, Any] = {
        "Clip": clip["name"],
        "Frame": frame,
        "Strength": repr(options.strength),
        "Encoding": encoding,
        "SidecarSha256": sidecar_sha256,
        "Domain": "0 1",
    }
    lines = [
        f"clip {clip['name']}, frame {frame}, strength {options.strength:g}, "
        f"lattice {options.size}",
        f"sidecar sha256 {sidecar_sha256}",
    ]
    if errors is not None:
        midpoints, on_clip, clip_frame = errors
        lines += _error_lines(midpoints, on_clip, clip_frame)
        lines.append(f"errors hold for {' and '.join(format_.interpolations)} interpolation")
        info["Error"] = {
            "MidpointsMean": stated(midpoints.mean),
            "MidpointsLargest": stated(midpoints.largest),
        }
        if on_clip is not None:
            info["Error"] |= {
                "ClipFrame": clip_frame,
                "ClipMean": stated(on_clip.mean),
                "ClipLargest": stated(on_clip.largest),
            }
    return Description(
        identifier=table_id(sidecar_sha256, options),
        name=f"palette4d {clip['name']} frame {frame}",
        lines=tuple(lines),
        input_space=encoding,
        output_space=encoding,
        info={"AppRelease": f"palette4d {_core.__version__}", "Palette4D": info},
    )


def _load(path: Path, format_: LutFormat) -> dict[str, LoadedLut]:
    return {name: LoadedLut(path, name) for name in format_.interpolations}


def bake(
    sidecar_path: Path,
    output: Path,
    options: BakeOptions,
    *,
    image: NDArray[Any] | None = None,
    image_frame: int | None = None,
    force: bool = False,
) -> BakeResult:
    """Write the edit at ``options.frame`` to `output` and measure the file.

    Parameters
    ----------
    sidecar_path : Path
        The sidecar.
    output : Path
        The file; its extension chooses the format.
    options : BakeOptions
        Time, size and strength.
    image : (h, w, 3 or 4) float array, optional
        The clip's frame at that time, to measure the error on.
    image_frame : int, optional
        The number of that frame.
    force : bool
        Replace an existing file.

    Returns
    -------
    BakeResult
        The figures hold for the file as OpenColorIO reads it back.

    Raises
    ------
    SidecarError
        The sidecar is unusable.
    Palette4dError
        The frame, size, strength, extension or output cannot be used; nothing was written.
    """
    format_ = format_of(output)
    refuse_existing(output, force)
    sidecar = _core.read_sidecar(str(sidecar_path))
    check_options(options, sidecar.polytope, sidecar.clip["name"])
    sidecar_sha256 = hashlib.sha256(sidecar_path.read_bytes()).hexdigest()
    recolourer = lattices.recolourer_at(sidecar, options.frame)
    table = lattices.build(recolourer, options.size, strength=options.strength)

    with replacing(output, force=force) as temporary:
        # Written twice: the second time with the error of the first, whose numbers are the same.
        description = _describe(sidecar, sidecar_sha256, options, format_, None)
        temporary.write_text(format_.write(table, description), encoding="utf-8", newline="\n")
        tables = _load(temporary, format_)
        midpoints = measure(_midpoint_pieces(options.size), tables, recolourer, options.strength)
        assert midpoints is not None  # a lattice has at least one cell
        on_clip = None
        if image is not None:
            on_clip = measure(_image_pieces(image), tables, recolourer, options.strength)

        errors = (midpoints, on_clip, image_frame)
        description = _describe(sidecar, sidecar_sha256, options, format_, errors)
        temporary.write_text(format_.write(table, description), encoding="utf-8", newline="\n")
        _check_same(_load(temporary, format_), tables, options.size, output)

    return BakeResult(
        output=str(output),
        format=format_.name,
        id=description.identifier,
        sidecar=str(sidecar_path),
        sidecar_sha256=sidecar_sha256,
        clip_name=sidecar.clip["name"],
        encoding=sidecar.clip["encoding"],
        frame=float(options.frame),
        size=options.size,
        strength=float(options.strength),
        domain=(table.low, table.high),
        rounding=format_.rounding,
        identity=recolourer.identity or options.strength == 0,
        midpoints=midpoints,
        clip=on_clip,
        clip_frame=image_frame if on_clip is not None else None,
    )


def _check_same(
    written: dict[str, LoadedLut], measured: dict[str, LoadedLut], size: int, output: Path
) -> None:
    """Make sure that the file that stays is the table that was measured."""
    for colours in _midpoint_pieces(size):
        for name, table in written.items():
            if not np.array_equal(table.apply(colours), measured[name].apply(colours)):
                raise Palette4dError(
                    f"{output}: read back, the file differs from what was measured; "
                    "nothing was written, please report this"
                )
