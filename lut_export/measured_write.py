"""One bake: write the file, read it back, measure it, and repeat with a larger LUT if needed."""

import hashlib
import json
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from palette4d.lut_export import cdl as cdls
from palette4d.lut_export import lut3d
from palette4d.lut_export.bake_error import (
    SEEN,
    Measure,
    Reader,
    figures_text,
    load,
    measure,
    stated,
)
from palette4d.lut_export.formats import LutFormat, with_shaper
from palette4d.lut_export.frame_edit import FrameEdit, frame_text
from palette4d.lut_export.shaper import Choice, Shaper
from palette4d.lut_export.spaces import INPUT, BakeSpace
from palette4d.lut_export.writers import Description

from palette4d import _core
from palette4d.colour.conversion_steps import Step
from palette4d.colour.difference import Viewing
from palette4d.common.errors import Arg, Palette4dError

F32 = NDArray[np.float32]
#: Samples a side of a LUT whose size is not given: of handles alone, and with picks. It grows up to
#: USUAL while the error can be seen on the clip's frame.
PALETTE_SIZE, PICKS_SIZE, USUAL = 33, 65, 65

Content = lut3d.Lut3D | cdls.Cdl

#: The namespace of the files' ids (RFC 9562, version 5), chosen once for this project.
NAMESPACE = uuid.UUID("09823ba4-0bc8-43a9-995d-cb9a6abeb5b3")


@dataclass(frozen=True)
class BakeSettings:
    """The settings of a bake at any frame; `bake` explains the members."""

    size: int | None = None
    strength: float = 1.0
    format: str | None = None
    shaper: Choice = "auto"
    domain: tuple[float, float] | None = None
    max_error: float | None = None
    space: str = INPUT
    ocio_config: str | None = None


@dataclass(frozen=True)
class Job:
    """The part of a bake that does not change while the LUT grows."""

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
    def size(self) -> int:
        """The samples a side to begin with: mattes of picks have finer edges than the palette."""
        if self.settings.size is not None:
            return self.settings.size
        return PICKS_SIZE if self.edit.has_picks else PALETTE_SIZE

    @property
    def steps(self) -> tuple[Step, ...]:
        """The conversion beside the 3D LUT; empty if the LUT contains it."""
        return self.space.steps if self.format.discrete else ()

    @property
    def conversion(self) -> str | None:
        """The conversion and its place in the file; None without one."""
        if not self.space.steps:
            return None
        where = "beside the 3D LUT, as transforms" if self.steps else "within the 3D LUT"
        return f"{self.space.name} to {self.sidecar.clip['encoding']} and back {where}"

    def dense(self) -> F32:
        """Return the dense grid's colours in the file's space."""
        grid = lut3d.dense_grid(self.shaper)
        return self.space.of_palette(grid).astype(np.float32) if self.steps else grid

    def measured(self, colours: F32, readers: Mapping[str, Reader]) -> Measure | None:
        """Compare the file, read back, with the edit on the given colours."""
        domain = (self.shaper.low, self.shaper.high)
        shaped = self.space.to_palette if self.steps else None
        return measure(colours, readers, self.edit, self.viewing, domain, self.threads, shaped)

    def content(self, size: int) -> Content:
        """Return the file's content: a 3D LUT or a CDL."""
        if self.format.is_cdl:
            return cdls.fit(self.edit, self.dense() if self.image is None else self.image)
        # In a list of transforms, the LUT's input and output are the palette's code values.
        edit = replace(self.edit, conversion=None) if self.steps else self.edit
        return lut3d.sample(edit, size, self.shaper, self.threads, self.steps)

    def write(self, path: Path, content: Content, about: Description) -> None:
        """Write the file."""
        if isinstance(content, cdls.Cdl):
            shot = f"{self.sidecar.clip['name']}.{frame_text(self.frame)}"
            text = cdls.write(content, self.format.name, shot, about)
        else:
            assert self.format.write is not None
            text = self.format.write(content, about)
        path.write_text(text, encoding="utf-8", newline="\n")


def grow(job: Job, path: Path) -> tuple[Content, dict[str, Reader], Measure, Measure | None]:
    """Write files with larger and larger LUTs until the error is small enough."""
    limit, size = job.settings.max_error, job.size
    while True:
        content = job.content(size)
        job.write(path, content, describe(job, content, None))
        readers = load(path, job.format.readings)
        grid = job.measured(job.dense(), readers)
        assert grid is not None  # the grid's colours are finite
        clip = None if job.image is None else job.measured(job.image, readers)
        larger = None if job.format.is_cdl else job.format.larger(size)
        seen = clip is not None and clip.visible > SEEN
        if limit is None and (job.settings.size or not seen or larger is None or size >= USUAL):
            return content, readers, grid, clip
        if limit is not None and judged(grid, clip) <= limit:
            return content, readers, grid, clip
        if larger is None:
            raise Palette4dError(_too_far(job, size, grid, clip))
        size = larger


def judged(grid: Measure, clip: Measure | None) -> float:
    """Return the error that `max_error` limits."""
    return (grid if clip is None else clip).worst.relative_largest


def _too_far(job: Job, size: int, grid: Measure, clip: Measure | None) -> str:
    where = "the dense grid" if clip is None else f"the clip's colours at frame {job.image_frame}"
    what = job.format.title if job.format.is_cdl else f"{job.format.title} with {size} a side"
    text = (
        f"the error stays above the limit: found |a-b|/max(|b|,0.1) of up to "
        f"{stated(judged(grid, clip))} on {where} with {what}, expected at most "
        f"{job.settings.max_error:g}; nothing was written. "
    )
    if clip is not None and clip.outside_domain > 0:
        return text + (
            f"{clip.outside_domain:.3%} of the colours are clamped: choose a format with a shaper "
            f"({with_shaper()}) or a wider {Arg('domain')}"
        )
    return text + "Allow a larger error, or use the node or `palette4d render`, which are exact"


def check_same(
    written: Mapping[str, Reader], measured: Mapping[str, Reader], job: Job, output: Path
) -> None:
    """Check that the final file has the colours that were measured."""
    colours = job.dense()
    for name, reader in written.items():
        if not np.array_equal(reader(colours), measured[name](colours)):
            raise Palette4dError(
                f"{output}: the file read back differs from the measured file; "
                "nothing was written, please report this"
            )


def describe(
    job: Job, content: Content, errors: tuple[Measure, Measure | None] | None
) -> Description:
    """Return the file's description of itself."""
    name, frame = job.sidecar.clip["name"], frame_text(job.frame)
    encoding = job.space.name or "the clip's own encoding"
    if isinstance(content, lut3d.Lut3D):
        what, held = f"3D LUT {content.size}", content.values.tobytes()
    else:
        what, held = "CDL", repr(content).encode()
    lines = [
        f"clip {name}, frame {frame}, strength {job.settings.strength:g}, {what}",
        f"sidecar sha256 {job.sha256}, palette4d {_core.__version__}",
        f"shaper {job.shaper.text()}",
    ]
    if errors is not None:
        places = ("dense grid", f"clip's colours at frame {job.image_frame}")
        for where, error in zip(places, errors, strict=True):
            if error is not None:
                lines.append(f"error on the {where}: {figures_text(error.worst)}")
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
        space=encoding,
    )
