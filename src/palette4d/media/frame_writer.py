"""Writing frames: EXR, PNG, TIFF, DPX and JPEG through OpenImageIO, then renamed to their names.

Code values are written without conversion. Alpha follows each format's convention: premultiplied in
EXR and DPX, straight in PNG. TIFF keeps the frame's kind of alpha and states it. JPEG has none: the
picture is laid over black.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Generator, Iterable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palette4d import _core
from palette4d.common.errors import Arg, Palette4dError, WriteError
from palette4d.common.files import EXISTS, replacing
from palette4d.media import dpx_alpha, oiio_text
from palette4d.media.clip_base import strips
from palette4d.media.clip_sequence import Pattern
from palette4d.media.exr_around import has_every_block

FORMATS = ("exr", "png", "tif", "tiff", "dpx", "jpg", "jpeg")
_EXPECTED = ".exr, .png, .tif, .dpx or .jpg"
# What each format can hold of the metadata that `palette4d.media.clip_images` reads. Names with a
# colon are a format's own: only a copy in that format keeps them.
_TEXT = ("oiio:ColorSpace", "ICCProfile", "DateTime", "Copyright", "Artist", "ImageDescription")
_PLAIN = (*_TEXT, "Software", "PixelAspectRatio")
_METADATA: dict[str, tuple[str, ...]] = {
    "png": (*_PLAIN, "CICP"),
    "jpg": (*_PLAIN, "Make", "Model"),
}
_OWN = {"exr": (), "dpx": ("dpx:",), "tif": ("Exif:", "IPTC:", "GPS:")}
_COMMON = ("oiio:ColorSpace", "smpte:TimeCode", "smpte:KeyCode")
#: Characters of a text in a JPEG: all of its Exif data share 64 kB, and libjpeg ends the program
#: where they are more.
_JPEG_TEXT = 2000
_HALF_MAX = float(np.finfo(np.float16).max)


class OutputError(Palette4dError):
    """Frames cannot be written; the message says what was found and expected, and the remedy."""


@dataclass(frozen=True)
class FramePattern:
    """Names of output frames: `folder/prefix0012suffix`, or one plain name (width None)."""

    folder: Path
    prefix: str
    suffix: str
    width: int | None

    @classmethod
    def parse(cls, text: str, also: str = "") -> FramePattern:
        """Read `name.####.exr` (one # a digit), `name.%04d.exr`, `name.@@@@.exr` or `name.exr`.

        `also` is what errors offer besides frames.
        """
        path = Path(text)
        if path.suffix.lower().lstrip(".") not in FORMATS:
            raise OutputError(
                f'output {text}: found the extension "{path.suffix}", expected {_EXPECTED}; '
                f"name the frames as in OUT.####.exr{also}"
            )
        parsed = Pattern.parse(path.name)
        if parsed is None:
            return cls(path.parent, path.stem, path.suffix, None)
        if "-" in parsed.frames.lstrip("-"):
            raise OutputError(
                f"output {text}: found the range {parsed.frames} in its name, expected "
                f"a pattern such as OUT.####.exr; choose the frames with {Arg('frames')}"
            )
        return cls(path.parent, parsed.literal.prefix, parsed.suffix, parsed.width)

    @property
    def extension(self) -> str:
        """Lower case, without the dot, `tif` and `jpg` for both spellings."""
        return _format(self.suffix)

    def path(self, frame: int) -> Path:
        """File of a frame; the sign of a negative number counts as a digit, as in C's printf."""
        number = "" if self.width is None else f"{frame:0{self.width}d}"
        return self.folder / f"{self.prefix}{number}{self.suffix}"

    def paths(self, frames: Sequence[int]) -> list[Path]:
        """The files of several frames; OutputError if they would all have one name."""
        if self.width is None and len(frames) > 1:
            raise OutputError(
                f"output {self.path(0)}: {len(frames)} frames would go into one file; expected a "
                f"pattern such as {self.prefix}.####{self.suffix}, or one frame ({Arg('frames')})"
            )
        return [self.path(frame) for frame in frames]


def _format(suffix: str) -> str:
    return suffix.lower().lstrip(".").replace("tiff", "tif").replace("jpeg", "jpg")


def check_targets(
    targets: Sequence[Path], inputs: Iterable[Path] = (), force: bool = False
) -> None:
    """Check all outputs before the first is written."""
    existing = [target for target in targets if os.path.lexists(target)]
    own = {_identity(path) for path in inputs} if existing else set()
    for target in existing:
        if _identity(target) in own:
            raise OutputError(
                f"output {target}: it is a file of the clip itself; choose another folder or name"
            )
        if target.is_dir():
            raise OutputError(f"output {target}: it is a folder; choose another name")
    if existing and not force:
        more = f"{existing[0].parent} has {len(existing)} of the {len(targets)} files. "
        raise OutputError(f"{more if existing[1:] else ''}{existing[0]}: {EXISTS}")


def _identity(path: Path) -> tuple[int, int] | str:
    """Device and inode of a file, after links; its name if it does not exist."""
    try:
        status = path.stat()
    except OSError:
        return str(path.absolute())
    return status.st_dev, status.st_ino


def sample_type(extension: str, depth: str, *, half: bool = False, bits: int | None = None) -> str:
    """Sample type of an output file: "half", "float", "uint8", "uint10" or "uint16".

    Parameters
    ----------
    extension : "exr", "png", "tif", "dpx" or "jpg".
    depth : `Clip.depth` of the source.
    half : 16-bit float, EXR only.
    bits : 8 or 16 for PNG, 8, 16 or 32 for TIFF, 10 or 16 for DPX. By default 8 for an 8-bit
        source, else 16; 32 (float) for a TIFF of a float source; 10 for DPX.
    """
    if extension == "exr":
        if bits not in (None, 16, 32) or (bits == 32 and half):
            raise OutputError(
                f"found {bits} bits for EXR, expected 32-bit float, or 16 bits with "
                f"{Arg('half', True)}"
            )
        return "half" if half or bits == 16 else "float"
    if half:
        raise OutputError(
            f"found {Arg('half', True)} for {extension.upper()}, expected it for EXR alone"
        )
    if bits is None:
        if extension in ("dpx", "jpg"):
            return "uint10" if extension == "dpx" else "uint8"
        if extension == "tif" and depth in ("float", "half", "double"):
            return "float"
        return "uint8" if depth == "uint8" else "uint16"
    fitting = {"tif": (8, 16, 32), "dpx": (10, 16), "jpg": (8,)}.get(extension, (8, 16))
    if bits not in fitting:
        raise OutputError(
            f"found {bits} bits for {extension.upper()}, expected "
            + " or ".join(str(kind) for kind in fitting)
        )
    return "float" if bits == 32 else f"uint{bits}"


def quantised(pixels: NDArray[np.float32], samples: str) -> NDArray[Any]:
    """Float32 pixels as they are stored: clamped to 0..1 and rounded for integers (NaN is 0).

    10 bits are the upper bits of 16, and again the lower ones, as OpenImageIO reads them.
    """
    if samples == "float":
        return pixels.astype(np.float32, copy=False)
    if samples == "half":
        # Finite values stay finite; NaN and infinities are unchanged.
        finite = np.clip(pixels, -_HALF_MAX, _HALF_MAX)
        return np.where(np.isinf(pixels), pixels, finite).astype(np.float16)
    ten = samples == "uint10"
    kind = np.dtype("uint16" if ten else samples)
    largest = np.float32(1023 if ten else np.iinfo(kind).max)
    clamped = np.clip(np.nan_to_num(pixels, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    codes = np.asarray(np.rint(clamped * largest).astype(kind))
    return codes << 6 | codes >> 4 if ten else codes


def with_alpha_of(
    extension: str, pixels: NDArray[np.float32], premultiplied: bool
) -> tuple[NDArray[np.float32], bool]:
    """(pixels, premultiplied) in the format's kind of alpha; unchanged if it already fits.

    Premultiplied pixels without a straight colour (`_core.straight_colours`) keep their values.
    """
    if pixels.shape[2] == 4 and extension == "jpg":
        return pixels[..., :3] * (np.float32(1) if premultiplied else pixels[..., 3:]), True
    fits = extension == "tif" or premultiplied == (extension in ("exr", "dpx"))
    if pixels.shape[2] != 4 or fits:
        return pixels, premultiplied
    out = pixels.copy()
    if premultiplied:
        straight = _core.straight_colours(pixels, premultiplied=True)
        np.copyto(out[..., :3], straight, where=~np.isnan(straight))
        return out, False
    out[..., :3] *= pixels[..., 3:]
    return out, True


def _stored(
    extension: str, pixels: NDArray[np.float32], samples: str, premultiplied: bool
) -> tuple[NDArray[Any], bool]:
    """Return (samples as they are stored, premultiplied) of a frame, made strip by strip."""

    def strip(rows: slice) -> tuple[NDArray[Any], bool]:
        part, multiplied = with_alpha_of(extension, pixels[rows], premultiplied)
        return quantised(part, samples), multiplied

    first, multiplied = strip(slice(0, 1))
    if samples == "float" and np.may_share_memory(first, pixels):
        return np.ascontiguousarray(pixels), multiplied
    stored = np.empty((*pixels.shape[:2], first.shape[2]), first.dtype)
    for rows in strips(*pixels.shape[:2]):
        stored[rows] = strip(rows)[0]
    return stored, multiplied


def write_frame(
    path: Path,
    pixels: NDArray[np.float32],
    samples: str,
    *,
    premultiplied: bool = False,
    metadata: Iterable[tuple[str, Any, Any]] = (),
) -> None:
    """Write one frame under a temporary name in the same folder and rename it.

    Parameters
    ----------
    path : with an extension of `FORMATS`; a file that is there is replaced.
    pixels : (h, w, 3 or 4) float32; RGB or RGBA.
    samples : as `sample_type` gives it.
    premultiplied : whether the colours of RGBA pixels are multiplied by alpha.
    metadata : iterable of (name, OpenImageIO type, value); members that the format cannot hold are
        left out.

    Raises
    ------
    WriteError
        The folder is not writable or the disk is full; no partial file remains.
    """
    import OpenImageIO as oiio

    extension = _format(path.suffix)
    stored, premultiplied = _stored(extension, pixels, samples, premultiplied)
    height, width, channels = stored.shape
    kind = "uint16" if samples == "uint10" else samples
    spec = oiio.ImageSpec(width, height, channels, kind)
    for name, kind, value in metadata:
        long = extension == "jpg" and isinstance(value, str) and len(value) > _JPEG_TEXT
        if _holds(extension, name) and not long:
            spec.attribute(name, kind, value)
    spec.attribute("compression", "jpeg:95" if extension == "jpg" else "zip")
    if samples == "uint10":
        spec.attribute("oiio:BitsPerSample", 10)
    if extension == "jpg":
        spec.attribute("jpeg:subsampling", "4:4:4")
    if extension == "png":
        # A fast level: level 9 takes many times longer and saves a few per cent.
        spec.attribute("png:compressionLevel", 4)
    if channels == 4:
        spec.alpha_channel = 3
        spec.attribute("oiio:UnassociatedAlpha", 0 if premultiplied else 1)

    with replacing(path, force=True) as temporary:
        with _place(temporary, extension) as place:
            target = oiio.ImageOutput.create(oiio_text.file_name(temporary))
            if target is None:
                raise OutputError(f"{path}: {oiio_text.problem_of(oiio)}; expected {_EXPECTED}")
            if not target.open(place, spec):
                raise cannot_write(path, oiio_text.problem_of(target))
            written = target.write_image(stored)
            # PNG reports a full disk here, and still returns true.
            problem = oiio_text.problem_of(target)
            closed = target.close()
            # Likewise; of a whole TIFF it complains about Exif data.
            closing = oiio_text.problem_of(target)
        problem = problem or (closing if extension != "tif" else "")
        if problem or not written or not closed or not _is_whole(temporary, stored):
            raise cannot_write(path, problem)


@contextmanager
def _place(path: Path, extension: str) -> Generator[str]:
    """Yield the name that OpenImageIO writes to: of a JPEG a file in memory, where there are such.

    libjpeg ends the program when the disk is full.
    """
    if extension != "jpg" or sys.platform != "linux":
        yield str(path)
        return
    with os.fdopen(os.memfd_create("frame"), "rb") as memory:
        yield f"/proc/self/fd/{memory.fileno()}"
        path.write_bytes(memory.read())


def _holds(extension: str, name: str) -> bool:
    """Whether a format keeps an attribute of OpenImageIO."""
    if extension in _METADATA:
        return name in _METADATA[extension]
    if name == "CICP":
        return False
    return ":" not in name or name in _COMMON or name.startswith(_OWN[extension])


def _is_whole(path: Path, stored: NDArray[Any]) -> bool:
    """Whether a file holds the pixels: a write that fails is not always reported.

    Of a TIFF all rows are read, of others the last row; of an EXR also its table of places.
    """
    import OpenImageIO as oiio

    raw = oiio.ImageSpec()
    raw.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), raw)
    if source is None:
        oiio_text.problem_of(oiio)
        return False
    height, _, channels = stored.shape
    first = 0 if _format(path.suffix) == "tif" else height - 1
    kind, whole = source.spec().format, True
    bits = source.spec().get_int_attribute("oiio:BitsPerSample")
    for rows in strips(height - first, stored.shape[1]):
        top, end = first + rows.start, first + rows.stop
        read = source.read_scanlines(0, 0, top, end, 0, 0, channels, kind)
        if read is not None:
            read = dpx_alpha.with_last(read, path, bits, top)
        # JPEG is lossy: its decoder reports a file that ends early. NaNs are equal, too.
        whole = read is not None and (
            _format(path.suffix) == "jpg" or read.tobytes() == stored[top:end].tobytes()
        )
        if not whole:
            break
    problem = oiio_text.problem_of(source)
    source.close()
    if _format(path.suffix) == "exr" and not has_every_block(path):
        return False
    return whole and not problem


def cannot_write(path: Path, reason: str) -> WriteError:
    """Return the error for a frame that could not be written."""
    said = reason.strip().splitlines()[0] if reason.strip() else "the file was cut short"
    return WriteError(
        f"{path}: the frame cannot be written ({said}); expected a folder that may be written to "
        "on a disk with free space. Check both, or choose another place."
    )
