"""Bake an edit at one time into a file, and state the error of that file.

`frame_edit` is the edit. `shaper` and `lut3d` sample it, or `cdl` fits it. `formats` and `writers`
write the file. `bake_error` reads the file back and compares it with the edit. `measured_write`
repeats this with larger LUTs until the error is small enough.
"""

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export import cdl as cdls
from palette4d.lut_export import lut3d
from palette4d.lut_export import shaper as shapers
from palette4d.lut_export.bake_error import (
    SEEN,
    DeltaE,
    Measure,
    Reader,
    largest_delta_e,
    load,
)
from palette4d.lut_export.formats import LutFormat, format_of, with_shaper
from palette4d.lut_export.frame_edit import frame_edit, without_windows
from palette4d.lut_export.measured_write import (
    BakeSettings,
    Job,
    check_same,
    describe,
    grow,
    judged,
)
from palette4d.lut_export.shaper import UNSHAPED, Choice, Kind, Shaper
from palette4d.lut_export.spaces import INPUT, space_of

from palette4d import _core
from palette4d.colour.difference import viewing_of
from palette4d.common.errors import Arg, Palette4dError
from palette4d.common.files import refuse_existing, replacing
from palette4d.grade import sidecar as sidecars
from palette4d.grade.document import Document, content_of
from palette4d.media.oiio_text import file_name
from palette4d.media.source_clip import frame_colours

F32 = NDArray[np.float32]


@dataclass(frozen=True)
class BakeResult:
    """The file that was written, and its error.

    Attributes
    ----------
    output, format, title : str
        The file, the name of its format in `formats.FORMATS`, and the format's title for people.
    id : str
        A URN: the same for the same content.
    sidecar : str or None
        The sidecar's path; None for a document that was never saved.
    sidecar_sha256 : str
        The hash of the sidecar's bytes.
    size : int or None
        Samples a side; None for a CDL.
    shaper : Shaper
        Its domain is where the file does not clamp.
    encoding : str
        The colour space that the file takes and returns.
    conversion : str or None
        The conversion to the palette's colour space, and its place in the file; None without one.
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
        The colour encoding that deltaE assumes.
    grid : Measure
        The error on the dense grid over the domain.
    clip : Measure or None
        The error on the colours of the clip's frame; None without one.
    clip_frame : int or None
        The clip's frame for `clip`: the nearest to a fractional time.
    error : float
        The largest relative error on the clip's colours, or on the dense grid without a clip.
        ``max_error`` limits it.
    has_picks : bool
        The edit has picks.
    clean_up : DeltaE or None
        How far the file is from the picture with Clean up and windows, which only the node and
        `render` have; None without picks or without a clip.
    windows : str
        The note that the file lacks windows of picks; "" where there are none. The other errors are
        those of the edit without windows.
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
    has_picks: bool = False
    clean_up: DeltaE | None = None
    windows: str = ""

    @property
    def visible(self) -> bool:
        """Whether more than 1 % of the frame's pixels have a deltaE 2000 above 1."""
        return self.clip is not None and self.clip.visible > SEEN


@dataclass(frozen=True)
class SidecarBytes:
    """A sidecar that was read already: its file may change meanwhile."""

    path: Path
    data: bytes

    @classmethod
    def of(cls, source: "Path | SidecarBytes") -> "SidecarBytes":
        """Read a sidecar, unless it was read."""
        if isinstance(source, SidecarBytes):
            return source
        return cls(source, sidecars.read_bytes(source))

    def parsed(self) -> _core.Sidecar:
        """Return the core's view; `SidecarError` if it is unusable."""
        return _core.parse_sidecar(self.data, str(self.path))


def bake(
    source: str | os.PathLike[str] | Document | SidecarBytes,
    frame: float,
    path: str | os.PathLike[str],
    *,
    size: int | None = None,
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
    source : path, Document or SidecarBytes
        A sidecar (.p4d.json), or a document.
    frame : float
        The time, a frame number of the clip; fractions are allowed.
    path : path
        The file to write; its extension chooses the format unless `format` does.
    size : int, optional
        Samples a side, 2..129. By default 33, and 65 with picks or where 33 shows.
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
        The colour space of the file's input and output: "input" (the clip's code values),
        "palette", or a colour space of the config.
    ocio_config : str, optional
        The config that knows `space`; by default the sidecar's, else ``$OCIO``, else OpenColorIO's
        built-in studio config.
    clip : str or (h, w, 3 or 4) float array, optional
        The clip, or its picture at `frame`. Its colours choose the shaper and are measured for the
        error. By default the clip that the sidecar names, if it exists.
    force : bool
        Replace an existing file.
    threads : int
        0: one per processor; the file does not depend on it.

    Returns
    -------
    BakeResult
        The errors hold for the file as OpenColorIO reads it back. Equal arguments give equal bytes.

    Raises
    ------
    SidecarError
        The sidecar is unusable.
    Palette4dError
        An argument is invalid, or the error stays above `max_error`; nothing was written.
    """
    settings = BakeSettings(size, strength, format, shaper, domain, max_error, space, ocio_config)
    output = Path(path)
    format_ = format_of(output, format)
    sidecar, data, file = _opened(source)
    check_target(output, force, file)
    file_name(output)  # for OpenColorIO
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
        encoding = viewing_of(sidecar.clip["encoding"]).encoding
        plain = format_.name == "resolve_cube" and encoding in ("", "sdr-video")
        chosen = _choose_shaper(settings, format_, palette, seen, plain)
    job = Job(
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
        content, readers, grid, on_clip = grow(job, temporary)
        about = describe(job, content, (grid, on_clip))
        if format_.described:
            # Write it again, now with its errors; the colours stay the same.
            job.write(temporary, content, about)
            check_same(load(temporary, format_.readings), readers, job, output)
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
        error=judged(grid, on_clip),
        has_picks=job.edit.has_picks,
        clean_up=_beside_clean_up(job, readers) if on_clip is not None else None,
        windows=without_windows(sidecar, [frame]),
    )


def _beside_clean_up(job: Job, readers: Mapping[str, Reader]) -> DeltaE | None:
    """Compare the file with the cleaned-up picture and its windows; None without picks."""
    if job.image is None or not job.edit.has_picks:
        return None
    picture = np.ascontiguousarray(job.image)
    return largest_delta_e(
        picture, job.edit.apply(picture, job.threads, clean_up=1), readers, job.viewing
    )


def _opened(
    source: str | os.PathLike[str] | Document | SidecarBytes,
) -> tuple[_core.Sidecar, bytes, Path | None]:
    """Return the core's view of a sidecar, its bytes, and its file."""
    if not isinstance(source, Document | SidecarBytes):
        source = SidecarBytes.of(Path(source))
    if isinstance(source, SidecarBytes):
        return source.parsed(), source.data, source.path
    data = None if source.changed else content_of(source)
    if data is None:
        data = sidecars.dumps(source.fields()).encode("utf-8")
    return source.grade.core, data, source.path


def check_target(path: Path, force: bool, sidecar: Path | None) -> None:
    """Refuse a file that may not be written."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise Palette4dError(
            f"{path}: found a device or a pipe, expected a file name; for standard output run "
            "`palette4d bake -o - --format …`"
        )
    refuse_existing(path, force, inputs=[sidecar])


def check_settings(
    settings: BakeSettings, format_: LutFormat, sidecar: _core.Sidecar, frame: float
) -> None:
    """Refuse what cannot be baked, before any frame is read."""
    frame_edit(sidecar, frame, settings.strength)
    if format_.is_cdl:
        return
    if settings.size is not None:
        lut3d.check_size(settings.size)
        format_.check_size(settings.size)
    kind = settings.shaper
    if settings.domain is not None:
        if kind == "auto":
            kind = "log" if format_.shaper else "none"
        Shaper(kind, *settings.domain)
    if kind in ("linear", "log") and not format_.shaper:
        raise Palette4dError(
            f"{format_.title} cannot hold a shaper; choose one of {with_shaper()}, or "
            f"{Arg('shaper', 'none')}"
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
    settings: BakeSettings,
    format_: LutFormat,
    palette: NDArray[Any],
    image: F32 | None,
    plain: bool,
) -> Shaper:
    """Return the shaper for the settings and the colours.

    The frame's colours decide whether the LUT needs a shaper; without a frame, the palette decides.
    The shaper also covers the palette, so that all LUTs of a clip are similar. `palette` holds the
    (n, 3) colours of the whole palette, in the colour space of `image`. A `plain` LUT has no
    linear one unless it is asked for: few programs that take a .cube for a display read it.
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
    chosen = shapers.choose(settings.shaper, max(low, -most), min(high, most))
    alone = plain and settings.shaper == "auto" and chosen.kind == "linear"
    return UNSHAPED if alone else chosen


def nearer(size: int | None) -> str:
    """Return advice for less error than a 3D LUT of this size has; None: than a CDL has."""
    if size is None:
        return "a 3D LUT (.clf, .cube) is nearer"
    exact = "the node and `palette4d render` are exact"
    return f"a larger {Arg('size')} is nearer; {exact}" if size < lut3d.LARGEST else exact
