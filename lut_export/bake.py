"""Bake an edit at one time into a file and state the error of that file.

`frame_edit` says what the edit does, `shaper` and `lattice` sample it (or `cdl` fits it), `writers`
and `formats` make a file of it, `reading` reads that back and `error` compares it with the edit.
"""

import hashlib
import json
import uuid
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export import cdl as cdls
from palette4d.lut_export import lattice as lattices
from palette4d.lut_export.bake_options import (
    BakeOptions,
    check_options,
    check_target,
    choose_shaper,
)
from palette4d.lut_export.error import Measure, figures_info, figures_text, measure, stated
from palette4d.lut_export.formats import LutFormat, format_of, with_shaper
from palette4d.lut_export.frame_edit import FrameEdit, frame_edit, frame_text
from palette4d.lut_export.reading import LoadedLut, load
from palette4d.lut_export.shaper import UNSHAPED, Shaper
from palette4d.lut_export.spaces import BakeSpace, space_of
from palette4d.lut_export.writers import Description

from palette4d import _core
from palette4d.colour.conversion_steps import Step
from palette4d.colour.difference import Viewing, viewing_of
from palette4d.common.errors import Palette4dError
from palette4d.common.files import replacing

__all__ = ["PREVIEW_TIER", "BakeOptions", "BakeResult", "bake"]

F32 = NDArray[np.float32]

#: The namespace of the tables' ids (RFC 9562, version 5), drawn once for this project.
NAMESPACE = uuid.UUID("09823ba4-0bc8-43a9-995d-cb9a6abeb5b3")

#: The relative error up to which a table serves for previews.
PREVIEW_TIER = 0.002


@dataclass(frozen=True)
class BakeResult:
    """What was written, and how far it is from the exact edit.

    Attributes
    ----------
    format : str
        A name of `formats.FORMATS`.
    size : int or None
        Samples a side; None for a CDL.
    shaper : Shaper
        With the domain outside of which the file clamps.
    encoding : str
        The colour space that the file takes and returns.
    conversion : str or None
        The way to the palette's own numbers and where it stands; None without one.
    palette : (low, high)
        The smallest and largest number of the palette's colours, at any time, in the numbers of the
        domain.
    cdl : Cdl or None
        What was fitted, for a CDL.
    identity : bool
        Nothing is edited at that time.
    viewing : str
        How colours were taken for deltaE.
    grid : Measure
        On the dense grid over the domain.
    clip : Measure or None
        On the colours of the clip's frame; None without one.
    clip_frame : int or None
        The frame of the clip that was measured (the nearest to a fractional time).
    error : float
        The largest relative error on the clip's colours, or on the dense grid without a clip: what
        ``max_error`` and the preview tier are compared with.
    """

    output: str
    format: str
    title: str
    id: str
    sidecar: str
    sidecar_sha256: str
    clip_name: str
    encoding: str
    conversion: str | None
    frame: float
    size: int | None
    strength: float
    shaper: Shaper
    palette: tuple[float, float]
    cdl: cdls.Cdl | None
    rounding: str
    identity: bool
    viewing: str
    grid: Measure
    clip: Measure | None
    clip_frame: int | None
    error: float
    preview_tier: bool

    def as_json(self) -> dict[str, Any]:
        """Return the result as plain JSON values."""
        return asdict(self)


@dataclass(frozen=True)
class _Job:
    """What stays the same while a lattice grows."""

    sidecar: _core.Sidecar
    sidecar_sha256: str
    options: BakeOptions
    format: LutFormat
    space: BakeSpace
    edit: FrameEdit
    shaper: Shaper
    viewing: Viewing
    image: F32 | None
    image_frame: int | None

    @property
    def steps(self) -> tuple[Step, ...]:
        """The conversion beside the table; empty where the table is one of the space itself."""
        return self.space.steps if self.format.discrete else ()

    @property
    def conversion(self) -> str | None:
        """What goes on beside the edit, None for nothing."""
        if not self.space.steps:
            return None
        where = "beside the table, as transforms" if self.steps else "within the table"
        return f"{self.space.name} to {self.sidecar.clip['encoding']} and back {where}"

    def dense(self) -> F32:
        """Return the dense grid's colours in the file's space."""
        grid = lattices.dense_grid(self.shaper)
        return self.space.of_palette(grid).astype(np.float32) if self.steps else grid

    def measures(self, readers: dict[str, LoadedLut]) -> tuple[Measure, Measure | None]:
        """Compare a file that was read on the dense grid and on the clip's colours."""
        domain = (self.shaper.low, self.shaper.high)
        threads = self.options.threads
        shaped = self.space.to_palette if self.steps else None
        grid = measure(self.dense(), readers, self.edit, self.viewing, domain, threads, shaped)
        assert grid is not None  # the grid's colours are finite
        if self.image is None:
            return grid, None
        return grid, measure(self.image, readers, self.edit, self.viewing, domain, threads, shaped)


@dataclass(frozen=True)
class _Content:
    """What a file holds: a table or a CDL."""

    lattice: lattices.Lattice | None
    cdl: cdls.Cdl | None

    def identifier(self, job: _Job) -> str:
        """Return the URN of the content: the same for the same table of the same sidecar."""
        numbers = repr(self.cdl).encode() if self.lattice is None else self.lattice.values.tobytes()
        made_from = f"{job.sidecar_sha256} {job.options.frame!r} {job.options.strength!r}"
        if job.space.steps:
            made_from += f" {job.space.name} {json.dumps(job.steps)}"
        content = hashlib.sha256(f"{made_from} {job.shaper!r} ".encode() + numbers)
        return uuid.uuid5(NAMESPACE, content.hexdigest()).urn

    def text(self, job: _Job, description: Description) -> str:
        """Return the file's text."""
        if self.lattice is None:
            assert self.cdl is not None
            shot = f"{job.sidecar.clip['name']}.{frame_text(job.options.frame)}"
            return cdls.write(self.cdl, job.format.name, shot, description)
        assert job.format.write is not None
        return job.format.write(self.lattice, description)


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
        The file; its extension chooses the format unless the options do.
    options : BakeOptions
        Time, size, strength, shaper and how large an error may be.
    image : (h, w, 3 or 4) float array, optional
        The clip's frame at that time, to choose a shaper by and to measure the error on.
    image_frame : int, optional
        The number of that frame.
    force : bool
        Replace an existing file.

    Returns
    -------
    BakeResult
        The figures hold for the file as OpenColorIO reads it back. The same arguments give the same
        bytes.

    Raises
    ------
    SidecarError
        The sidecar is unusable.
    Palette4dError
        The options or the output cannot be used, or the error stays above ``options.max_error``;
        nothing was written.
    """
    format_ = format_of(output, options.format)
    check_target(output, force)
    sidecar = _core.read_sidecar(str(sidecar_path))
    check_options(options, format_, sidecar)
    space = space_of(sidecar_path, sidecar, options.space, options.ocio_config)
    colours = None
    if image is not None:
        colours = space.of_clip(np.asarray(image[..., :3], dtype=np.float32))
    palette: NDArray[Any] = sidecar.polytope.vertices[:, :3]
    in_palette = bool(space.steps) and format_.discrete
    shaper = UNSHAPED
    if not in_palette:
        palette = space.of_palette(palette)
    if not format_.is_cdl:
        seen = colours
        if in_palette and colours is not None:
            seen = space.to_palette(colours)
        shaper = choose_shaper(options, format_, palette, seen)
    job = _Job(
        sidecar=sidecar,
        sidecar_sha256=hashlib.sha256(sidecar_path.read_bytes()).hexdigest(),
        options=options,
        format=format_,
        space=space,
        edit=frame_edit(sidecar, options.frame, options.strength, space.chain),
        shaper=shaper,
        viewing=viewing_of(space.name),
        image=colours,
        image_frame=image_frame,
    )
    with replacing(output, force=force) as temporary:
        content, readers, grid, clip = _grown(job, temporary)
        description = _describe(job, content, (grid, clip))
        if format_.described:
            # Once more, now with the error, which the numbers do not depend on.
            _write(temporary, content.text(job, description))
            _check_same(load(temporary, format_.readings), readers, job, output)

    return BakeResult(
        output=str(output),
        format=format_.name,
        title=format_.title,
        id=description.identifier,
        sidecar=str(sidecar_path),
        sidecar_sha256=job.sidecar_sha256,
        clip_name=sidecar.clip["name"],
        encoding=space.name,
        conversion=job.conversion,
        frame=float(options.frame),
        size=None if content.lattice is None else content.lattice.size,
        strength=float(options.strength),
        shaper=shaper,
        palette=(float(palette.min()), float(palette.max())),
        cdl=content.cdl,
        rounding=format_.rounding,
        identity=job.edit.identity,
        viewing=job.viewing.assumption,
        grid=grid,
        clip=clip,
        clip_frame=image_frame if clip is not None else None,
        error=_judged(grid, clip),
        preview_tier=_judged(grid, clip) <= PREVIEW_TIER,
    )


def _grown(job: _Job, path: Path) -> tuple[_Content, dict[str, LoadedLut], Measure, Measure | None]:
    """Write files, larger and larger ones if need be, until the error is small enough."""
    limit, size = job.options.max_error, job.options.size
    while True:
        if job.format.is_cdl:
            colours = job.dense() if job.image is None else job.image
            content = _Content(None, cdls.fit(job.edit, colours))
        else:
            # In a list of transforms the table is one of the palette's numbers.
            edit = replace(job.edit, conversion=None) if job.steps else job.edit
            lattice = lattices.build(edit, size, job.shaper, job.options.threads, job.steps)
            content = _Content(lattice, None)
        _write(path, content.text(job, _describe(job, content, None)))
        readers = load(path, job.format.readings)
        grid, clip = job.measures(readers)
        if limit is None or _judged(grid, clip) <= limit:
            return content, readers, grid, clip
        larger = None if job.format.is_cdl else job.format.larger(size)
        if larger is None:
            raise Palette4dError(_too_far(job, size, grid, clip))
        size = larger


def _judged(grid: Measure, clip: Measure | None) -> float:
    return (grid if clip is None else clip).worst.relative_largest


def _too_far(job: _Job, size: int, grid: Measure, clip: Measure | None) -> str:
    where = "the dense grid" if clip is None else f"the clip's colours at frame {job.image_frame}"
    what = job.format.title if job.format.is_cdl else f"{job.format.title} with {size} a side"
    text = (
        f"the error stays above the limit: found |a-b|/max(|b|,0.1) of up to "
        f"{stated(_judged(grid, clip))} on {where} with {what}, expected at most "
        f"{job.options.max_error:g}; nothing was written. "
    )
    if clip is not None and clip.outside_domain > 0:
        return text + (
            f"{clip.outside_domain:.3%} of the colours are clamped: choose a format with a shaper "
            f"({with_shaper()}) or a wider --domain"
        )
    return text + "Allow a larger error, or use the node or `palette4d render`, which are exact"


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def _check_same(
    written: dict[str, LoadedLut], measured: dict[str, LoadedLut], job: _Job, output: Path
) -> None:
    """Make sure that the file that stays is the table that was measured."""
    colours = job.dense()
    for name, table in written.items():
        if not np.array_equal(table.apply(colours), measured[name].apply(colours)):
            raise Palette4dError(
                f"{output}: read back, the file differs from what was measured; "
                "nothing was written, please report this"
            )


# --------------------------------------------------------------------------- what a file says


def _describe(
    job: _Job, content: _Content, errors: tuple[Measure, Measure | None] | None
) -> Description:
    clip, options = job.sidecar.clip, job.options
    encoding = job.space.name or "the clip's own encoding"
    frame = frame_text(options.frame)
    info: dict[str, Any] = {
        "Clip": clip["name"],
        "Frame": frame,
        "Strength": repr(options.strength),
        "Encoding": encoding,
        "SidecarSha256": job.sidecar_sha256,
        "Shaper": job.shaper.kind,
        "Domain": f"{job.shaper.low:g} {job.shaper.high:g}",
    }
    what = "CDL" if content.lattice is None else f"lattice {content.lattice.size}"
    if job.conversion is not None:
        info["Conversion"] = job.conversion
    lines = [
        f"clip {clip['name']}, frame {frame}, strength {options.strength:g}, {what}",
        f"sidecar sha256 {job.sidecar_sha256}",
    ]
    if content.lattice is not None:
        lines.append(f"shaper {job.shaper.text()}")
    if errors is not None:
        grid, on_clip = errors
        info["Error"] = {}
        if on_clip is not None:
            where = f"on the clip's colours at frame {job.image_frame}"
            lines.append(f"error {where}: {figures_text(on_clip.worst)}")
            info["Error"]["Clip"] = {"Frame": job.image_frame, **figures_info(on_clip.worst)}
        lines.append(f"error on a dense grid: {figures_text(grid.worst)}")
        info["Error"]["Grid"] = figures_info(grid.worst)
        info["Error"]["Colours"] = job.viewing.assumption
        kind = "values" if job.format.is_cdl else "interpolation"
        lines.append(f"errors hold for {' and '.join(job.format.readings)} {kind}")
        lines.append(f"deltaE: {job.viewing.assumption}")
    return Description(
        identifier=content.identifier(job),
        name=f"palette4d {clip['name']} frame {frame}",
        lines=tuple(lines),
        input_space=encoding,
        output_space=encoding,
        info={"AppRelease": f"palette4d {_core.__version__}", "Palette4D": info},
    )
