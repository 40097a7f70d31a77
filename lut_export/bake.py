"""Bake an edit at one time into a file, and state the error of that file.

`frame_edit` is the edit, `shaper` and `lut3d` sample it (or `cdl` fits it), `formats` and `writers`
make a file of it, and `bake_error` reads that back and compares it with the edit.
"""

import hashlib
import json
import os
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export import cdl as cdls
from palette4d.lut_export import lut3d
from palette4d.lut_export import shaper as shapers
from palette4d.lut_export.bake_error import (
    Measure,
    Reader,
    figures_info,
    figures_text,
    load,
    measure,
    stated,
)
from palette4d.lut_export.formats import LutFormat, format_of, with_shaper
from palette4d.lut_export.frame_edit import FrameEdit, frame_edit, frame_text
from palette4d.lut_export.shaper import UNSHAPED, Choice, Kind, Shaper
from palette4d.lut_export.spaces import INPUT, BakeSpace, space_of
from palette4d.lut_export.writers import Description

from palette4d import _core
from palette4d.colour.conversion_steps import Step
from palette4d.colour.difference import VISIBLE, Viewing, viewing_of
from palette4d.common.errors import Palette4dError
from palette4d.common.files import refuse_existing, replacing
from palette4d.grade import sidecar as sidecars
from palette4d.grade.document import Document
from palette4d.media.source_clip import frame_colours

F32 = NDArray[np.float32]

#: The namespace of the files' ids (RFC 9562, version 5), drawn once for this project.
NAMESPACE = uuid.UUID("09823ba4-0bc8-43a9-995d-cb9a6abeb5b3")


@dataclass(frozen=True)
class BakeSettings:
    """What to bake at each frame; `bake` explains the members."""

    size: int = 33
    strength: float = 1.0
    format: str | None = None
    shaper: Choice = "auto"
    domain: tuple[float, float] | None = None
    max_error: float | None = None
    space: str = INPUT
    ocio_config: str | None = None


@dataclass(frozen=True)
class BakeResult:
    """What was written, and how far it is from the exact edit.

    Attributes
    ----------
    output, format, title : str
        The file, the name of its format in `formats.FORMATS`, and that for people.
    id : str
        A URN: the same for the same content.
    sidecar : str or None
        The sidecar's file; None for a document that was never saved.
    sidecar_sha256 : str
        The hash of the sidecar's bytes.
    size : int or None
        Samples a side; None for a CDL.
    shaper : Shaper
        With the domain outside of which the file clamps.
    encoding : str
        The colour space that the file takes and returns.
    conversion : str or None
        The conversion to the palette's colour space, and where it is; None without one.
    palette : (low, high)
        The smallest and largest code value of the palette's colours at any time, in the domain's
        colour space.
    cdl : Cdl or None
        The fit, for a CDL.
    rounding : str
        The precision of the file's code values.
    identity : bool
        Nothing is edited at that time.
    viewing : str
        How colours were taken for deltaE.
    grid : Measure
        The error on the dense grid over the domain.
    clip : Measure or None
        The error on the colours of the clip's frame; None without one.
    clip_frame : int or None
        The frame of the clip that was measured (the nearest to a fractional time).
    error : float
        The largest relative error on the clip's colours, or on the dense grid without a clip:
        ``max_error`` limits it.
    """

    output: str
    format: str
    title: str
    id: str
    sidecar: str | None
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

    @property
    def visible(self) -> bool:
        """Whether the error can be seen on the clip's own colours: deltaE 2000 above 1."""
        return self.clip is not None and self.clip.worst.delta_e_largest > VISIBLE


@dataclass(frozen=True)
class _Job:
    """What stays the same while a LUT grows."""

    sidecar: _core.Sidecar
    sha256: str
    frame: float
    settings: BakeSettings
    threads: int
    format: LutFormat
    space: BakeSpace
    edit: FrameEdit
    shaper: Shaper
    viewing: Viewing
    image: F32 | None
    image_frame: int | None

    @property
    def steps(self) -> tuple[Step, ...]:
        """The conversion beside the 3D LUT; empty where the LUT contains it."""
        return self.space.steps if self.format.discrete else ()

    @property
    def conversion(self) -> str | None:
        """The conversion and where it is; None without one."""
        if not self.space.steps:
            return None
        where = "beside the 3D LUT, as transforms" if self.steps else "within the 3D LUT"
        return f"{self.space.name} to {self.sidecar.clip['encoding']} and back {where}"

    def dense(self) -> F32:
        """Return the dense grid's colours in the file's space."""
        grid = lut3d.dense_grid(self.shaper)
        return self.space.of_palette(grid).astype(np.float32) if self.steps else grid

    def measured(self, colours: F32, readers: Mapping[str, Reader]) -> Measure | None:
        """Compare a file that was read back with the edit on some colours."""
        domain = (self.shaper.low, self.shaper.high)
        shaped = self.space.to_palette if self.steps else None
        return measure(colours, readers, self.edit, self.viewing, domain, self.threads, shaped)

    def content(self, size: int) -> lut3d.Lut3D | cdls.Cdl:
        """Return what the file holds."""
        if self.format.is_cdl:
            return cdls.fit(self.edit, self.dense() if self.image is None else self.image)
        # In a list of transforms the LUT takes and returns the palette's code values.
        edit = replace(self.edit, conversion=None) if self.steps else self.edit
        return lut3d.sample(edit, size, self.shaper, self.threads, self.steps)

    def write(self, path: Path, content: lut3d.Lut3D | cdls.Cdl, about: Description) -> None:
        """Write the file."""
        if isinstance(content, cdls.Cdl):
            shot = f"{self.sidecar.clip['name']}.{frame_text(self.frame)}"
            text = cdls.write(content, self.format.name, shot, about)
        else:
            assert self.format.write is not None
            text = self.format.write(content, about)
        path.write_text(text, encoding="utf-8", newline="\n")


def bake(
    source: str | os.PathLike[str] | Document,
    frame: float,
    path: str | os.PathLike[str],
    *,
    size: int = 33,
    strength: float = 1.0,
    format: str | None = None,
    shaper: Choice = "auto",
    domain: tuple[float, float] | None = None,
    max_error: float | None = None,
    space: str = INPUT,
    ocio_config: str | None = None,
    clip: str | NDArray[Any] | None = None,
    force: bool = False,
    threads: int = 0,
) -> BakeResult:
    """Write the edit at one time as a 3D LUT or an ASC CDL, and measure the file's error.

    Parameters
    ----------
    source : path or Document
        A sidecar (.p4d.json), or a document.
    frame : float
        The time, a frame number of the clip; fractions are allowed.
    path : path
        The file to write; its extension chooses the format unless `format` does.
    size : int
        Samples a side, 2..129.
    strength : float
        0..1, as in the node.
    format : str, optional
        A name of `formats.FORMATS`.
    shaper : {"auto", "none", "linear", "log"}
        The 1D shaper before the 3D LUT; see `palette4d.lut_export.shaper`.
    domain : (low, high), optional
        The code values that the shaper covers; by default the frame's and the palette's.
    max_error : float, optional
        The 3D LUT grows until `BakeResult.error` is at most this.
    space : str
        What the file takes and returns: "input" (the clip's code values), "palette", or a colour
        space of the config.
    ocio_config : str, optional
        The config that knows `space`; by default the sidecar's, else ``$OCIO``, else OpenColorIO's
        built-in studio config.
    clip : str or (h, w, 3 or 4) float array, optional
        The clip, or its picture at `frame`: the error is measured on its colours, and they choose
        the shaper. By default the clip that the sidecar names, if it is there.
    force : bool
        Replace an existing file.
    threads : int
        0: one a processor; the file does not depend on it.

    Returns
    -------
    BakeResult
        The errors hold for the file as OpenColorIO reads it back. Equal arguments give equal bytes.

    Raises
    ------
    SidecarError
        The sidecar is unusable.
    Palette4dError
        An argument cannot be used, or the error stays above `max_error`; nothing was written.
    """
    settings = BakeSettings(size, strength, format, shaper, domain, max_error, space, ocio_config)
    output = Path(path)
    format_ = format_of(output, format)
    check_target(output, force)
    sidecar, data, file = _opened(source)
    check_settings(settings, format_, sidecar, frame)
    found_space = space_of(data, sidecar, space, ocio_config)
    image, image_frame = _picture(file, sidecar, frame, clip)
    if image is not None:
        image = found_space.of_clip(np.asarray(image[..., :3], dtype=np.float32))
    palette: NDArray[Any] = sidecar.polytope.vertices[:, :3]
    in_palette = bool(found_space.steps) and format_.discrete
    if not in_palette:
        palette = found_space.of_palette(palette)
    chosen = UNSHAPED
    if not format_.is_cdl:
        seen = found_space.to_palette(image) if in_palette and image is not None else image
        chosen = _choose_shaper(settings, format_, palette, seen)
    job = _Job(
        sidecar=sidecar,
        sha256=hashlib.sha256(data).hexdigest(),
        frame=float(frame),
        settings=settings,
        threads=threads,
        format=format_,
        space=found_space,
        edit=frame_edit(sidecar, frame, strength, found_space.chain),
        shaper=chosen,
        viewing=viewing_of(found_space.name),
        image=image,
        image_frame=image_frame,
    )
    with replacing(output, force=force) as temporary:
        content, readers, grid, on_clip = _grow(job, temporary)
        about = _describe(job, content, (grid, on_clip))
        if format_.described:
            # Once more, now with its errors in it; the colours stay the same.
            job.write(temporary, content, about)
            _check_same(load(temporary, format_.readings), readers, job, output)
    return BakeResult(
        output=str(output),
        format=format_.name,
        title=format_.title,
        id=about.identifier,
        sidecar=None if file is None else str(file),
        sidecar_sha256=job.sha256,
        clip_name=sidecar.clip["name"],
        encoding=found_space.name,
        conversion=job.conversion,
        frame=float(frame),
        size=content.size if isinstance(content, lut3d.Lut3D) else None,
        strength=float(strength),
        shaper=chosen,
        palette=(float(palette.min()), float(palette.max())),
        cdl=content if isinstance(content, cdls.Cdl) else None,
        rounding=format_.rounding,
        identity=job.edit.identity,
        viewing=job.viewing.assumption,
        grid=grid,
        clip=on_clip,
        clip_frame=image_frame if on_clip is not None else None,
        error=_judged(grid, on_clip),
    )


# ------------------------------------------------------------------------------ before any sampling


def _opened(
    source: str | os.PathLike[str] | Document,
) -> tuple[_core.Sidecar, bytes, Path | None]:
    """Return the core's view of a sidecar, its bytes, and its file."""
    if not isinstance(source, Document):
        data = sidecars.read_bytes(source)
        return _core.parse_sidecar(data, os.fspath(source)), data, Path(source)
    fields = source.fields()
    if source.path is not None and source.path.is_file():
        data = source.path.read_bytes()
        if json.loads(data) == fields:
            return source.core, data, source.path
    return source.core, sidecars.encoded(fields), source.path


def check_target(path: Path, force: bool) -> None:
    """Refuse a file that may not be written.

    Raises
    ------
    Palette4dError
        As `common.files.refuse_existing`; also when `path` is a device or a pipe, which a file
        would replace.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise Palette4dError(
            f"{path}: found a device or a pipe, expected a file name; use `-o - --format …` and "
            "redirect the output in the shell"
        )
    refuse_existing(path, force)


def check_settings(
    settings: BakeSettings, format_: LutFormat, sidecar: _core.Sidecar, frame: float
) -> None:
    """Refuse what cannot be baked, before any frame is read.

    Raises
    ------
    Palette4dError
        Time, size, strength, shaper or domain are out of range or do not go with the format.
    """
    frame_edit(sidecar, frame, settings.strength)
    if format_.is_cdl:
        return
    lut3d.check_size(settings.size)
    format_.check_size(settings.size)
    kind = settings.shaper
    if settings.domain is not None:
        if kind == "auto":
            kind = "log" if format_.shaper else "none"
        Shaper(kind, *settings.domain)
    if kind in ("linear", "log") and not format_.shaper:
        raise Palette4dError(
            f"{format_.title} cannot hold a shaper; choose one of {with_shaper()}, or --shaper none"
        )


def _picture(
    file: Path | None, sidecar: _core.Sidecar, frame: float, clip: str | NDArray[Any] | None
) -> tuple[NDArray[Any] | None, int | None]:
    """Return the clip's picture at a time and its frame number, if there is one."""
    if clip is None or isinstance(clip, str):
        return frame_colours(file or Path("document"), sidecar.clip, frame, clip)
    if clip.ndim != 3 or clip.shape[2] not in (3, 4):
        raise Palette4dError(f"clip: found an array of shape {clip.shape}, expected (h, w, 3 or 4)")
    return clip, round(frame)


def _choose_shaper(
    settings: BakeSettings, format_: LutFormat, palette: NDArray[Any], image: F32 | None
) -> Shaper:
    """Return the shaper that the settings and the colours ask for.

    The frame's colours decide whether one is needed; a shaper covers the palette, too, so that the
    LUTs of one clip resemble each other. Without a frame the palette decides. `palette` holds the
    (n, 3) colours of the whole palette, in the colour space of `image`.
    """
    if settings.domain is not None:
        kind: Kind = "log" if settings.shaper == "auto" else settings.shaper
        return Shaper(kind, *settings.domain)
    if settings.shaper == "auto" and not format_.shaper:
        return UNSHAPED
    low, high = float(palette.min()), float(palette.max())
    if image is not None:
        finite = image[np.isfinite(image)]
        if not finite.size or (finite.min() >= 0 and finite.max() <= 1):
            low, high = 0.0, 1.0
        else:
            low, high = min(low, float(finite.min())), max(high, float(finite.max()))
    most = shapers.LARGEST
    return shapers.choose(settings.shaper, max(low, -most), min(high, most))


# ------------------------------------------------------------------------------ writing, measuring


def _grow(
    job: _Job, path: Path
) -> tuple[lut3d.Lut3D | cdls.Cdl, dict[str, Reader], Measure, Measure | None]:
    """Write files, larger and larger ones if need be, until the error is small enough."""
    limit, size = job.settings.max_error, job.settings.size
    while True:
        content = job.content(size)
        job.write(path, content, _describe(job, content, None))
        readers = load(path, job.format.readings)
        grid = job.measured(job.dense(), readers)
        assert grid is not None  # the grid's colours are finite
        clip = None if job.image is None else job.measured(job.image, readers)
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
        f"{job.settings.max_error:g}; nothing was written. "
    )
    if clip is not None and clip.outside_domain > 0:
        return text + (
            f"{clip.outside_domain:.3%} of the colours are clamped: choose a format with a shaper "
            f"({with_shaper()}) or a wider --domain"
        )
    return text + "Allow a larger error, or use the node or `palette4d render`, which are exact"


def _check_same(
    written: Mapping[str, Reader], measured: Mapping[str, Reader], job: _Job, output: Path
) -> None:
    """Make sure that the final file holds what was measured."""
    colours = job.dense()
    for name, reader in written.items():
        if not np.array_equal(reader(colours), measured[name](colours)):
            raise Palette4dError(
                f"{output}: read back, the file differs from what was measured; "
                "nothing was written, please report this"
            )


def nearer(size: int | None) -> str:
    """Return what is nearer to an edit than a 3D LUT of a size; None: than a CDL."""
    if size is None:
        return "a 3D LUT (.clf, .cube) is nearer"
    exact = "the node and `palette4d render` are exact"
    return f"a larger --size is nearer; {exact}" if size < lut3d.LARGEST else exact


def _describe(
    job: _Job,
    content: lut3d.Lut3D | cdls.Cdl,
    errors: tuple[Measure, Measure | None] | None,
) -> Description:
    """Return what the file says about itself; the lines repeat the names and values of its Info."""
    name, frame = job.sidecar.clip["name"], frame_text(job.frame)
    encoding = job.space.name or "the clip's own encoding"
    info: dict[str, Any] = {
        "Clip": name,
        "Frame": frame,
        "Strength": repr(job.settings.strength),
        "Encoding": encoding,
        "SidecarSha256": job.sha256,
        "Shaper": job.shaper.kind,
        "Domain": f"{job.shaper.low:g} {job.shaper.high:g}",
    }
    if job.conversion is not None:
        info["Conversion"] = job.conversion
    if isinstance(content, lut3d.Lut3D):
        what, held = f"3D LUT {content.size}", content.values.tobytes()
    else:
        what, held = "CDL", repr(content).encode()
    lines = [
        f"clip {name}, frame {frame}, strength {job.settings.strength:g}, {what}",
        f"sidecar sha256 {job.sha256}",
        f"shaper {job.shaper.text()}",
    ]
    if errors is not None:
        info["Error"] = {}
        measures = (
            ("Grid", "dense grid", errors[0]),
            ("Clip", f"clip's colours at frame {job.image_frame}", errors[1]),
        )
        for key, where, found in measures:
            if found is not None:
                info["Error"][key] = figures_info(found.worst)
                lines.append(f"error on the {where}: {figures_text(found.worst)}")
        info["Error"]["Colours"] = job.viewing.assumption
        lines.append(f"errors hold for the readings {' and '.join(job.format.readings)}")
        lines.append(f"deltaE: {job.viewing.assumption}")
    made_from = f"{job.sha256} {job.frame!r} {job.settings.strength!r} {job.shaper!r}"
    if job.space.steps:
        made_from += f" {job.space.name} {json.dumps(job.steps)}"
    digest = hashlib.sha256(f"{made_from} ".encode() + held).hexdigest()
    return Description(
        identifier=uuid.uuid5(NAMESPACE, digest).urn,
        name=f"palette4d {name} frame {frame}",
        lines=tuple(lines),
        input_space=encoding,
        output_space=encoding,
        info={"AppRelease": f"palette4d {_core.__version__}", "Palette4D": info},
    )
