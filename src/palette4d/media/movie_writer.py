"""Writing movies: H.264 in .mp4 and ProRes 422 HQ in .mov, through PyAV (FFmpeg's libraries).

R'G'B' becomes Y'CbCr without any transfer curve. Movies of these formats have no alpha: the picture
is composited over black. Sound is not copied.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import av
import numpy as np
from av.error import FFmpegError
from numpy.typing import NDArray

from palette4d.common.files import replacing
from palette4d.media.clip_base import F32
from palette4d.media.clip_movie import LUMA_WEIGHTS
from palette4d.media.frame_writer import OutputError


class _Format(NamedTuple):
    encoder: str
    layout: str
    bits: int
    rows: int  # rows of the picture per chroma sample; the columns are always two
    options: dict[str, str]


_FORMATS = {
    "mp4": _Format("libx264", "yuv420p", 8, 2, {"crf": "14"}),
    "mov": _Format("prores_ks", "yuv422p10le", 10, 1, {"profile": "hq", "vendor": "apl0"}),
}

#: Primaries, transfer and matrix (ITU-T H.273) for a clip's encoding (`Clip.encoding`).
_TAGS = {
    "sRGB": (1, 13, 1),
    "gamma 2.2": (1, 4, 1),
    "linear": (1, 8, 1),
    "linear Rec.709": (1, 8, 1),
    "Rec.2020": (9, 14, 9),
    "Rec.2100 PQ": (9, 16, 9),
    "Rec.2100 HLG": (9, 18, 9),
}
_REC709 = (1, 1, 1)
_LIMITED = 1


def is_movie(path: Path) -> bool:
    """Return whether a name has the extension of a movie that can be written."""
    return path.suffix.lower().lstrip(".") in _FORMATS


@contextlib.contextmanager
def movie_writer(
    path: Path, size: tuple[int, int], rate: Fraction, encoding: str = "unknown"
) -> Generator[Callable[[F32, bool], None]]:
    """Yield a function that appends a frame; the file appears when the body succeeds.

    After an error or Ctrl-C in the body, the old file is unchanged.

    Parameters
    ----------
    path : `.mp4` or `.mov`; a file that is there is replaced.
    size : (int, int); width and height in pixels. Two columns (in .mp4 also two rows) share a
        chroma sample, so an odd size grows by one: the last column or row is repeated.
    rate : frames per second.
    encoding : `Clip.encoding`, for the movie's colour tags; Rec.709 if it is unknown.

    Yields
    ------
    callable
        ((h, w, 3 or 4) float32 R'G'B'(A), whether colours are premultiplied). Values are clamped
        to 0..1; NaN is 0.
    """
    form = _FORMATS[path.suffix.lower().lstrip(".")]
    primaries, transfer, matrix = _TAGS.get(encoding, _REC709)
    with replacing(path, force=True) as temporary:
        try:
            with av.open(f"file:{temporary}", "w", options={"movflags": "+faststart"}) as movie:
                stream: Any = movie.add_stream(form.encoder, rate=rate, options=form.options)
                stream.width, stream.height = size[0] + size[0] % 2, size[1] + size[1] % form.rows
                stream.pix_fmt = form.layout
                stream.color_primaries, stream.color_trc = primaries, transfer
                stream.colorspace, stream.color_range = matrix, _LIMITED
                stream.thread_type = "AUTO"

                def append(pixels: F32, premultiplied: bool) -> None:
                    if pixels.shape[2] == 4:
                        alpha = np.float32(1) if premultiplied else pixels[..., 3:]
                        pixels = pixels[..., :3] * alpha
                    picture = _picture(pixels, form, matrix)
                    # ProRes reads its tags from the picture, H.264 from the stream.
                    picture.color_primaries, picture.color_trc = primaries, transfer
                    movie.mux(stream.encode(picture))

                yield append
                movie.mux(stream.encode(None))
        except FFmpegError as error:
            raise OutputError(
                f"{path}: the movie cannot be written ({error.strerror}); expected room on the "
                "disk and a size that the encoder takes. Check both, or render frames: "
                "OUT.####.png"
            ) from error


def _picture(pixels: F32, form: _Format, matrix: int) -> av.VideoFrame:
    """R'G'B' (h, w, 3) as limited-range Y'CbCr (ITU-T H.273, section 8.3), rounded once.

    libswscale has errors of up to one 8-bit step, and is on average half a step too bright.
    """
    height, width = pixels.shape[:2]
    pixels = np.pad(pixels, ((0, height % form.rows), (0, width % 2), (0, 0)), "edge")
    pixels = np.clip(np.nan_to_num(pixels, nan=0.0, posinf=1.0, neginf=0.0), 0, 1)
    red, blue = LUMA_WEIGHTS[matrix]
    luma = pixels @ np.array([red, 1 - red - blue, blue], np.float32)
    picture = av.VideoFrame(pixels.shape[1], pixels.shape[0], form.layout)
    picture.colorspace, picture.color_range = matrix, _LIMITED
    unit = 1 << (form.bits - 8)
    _fill(picture.planes[0], (16 + 219 * luma) * unit)
    for plane, channel, weight in ((1, 2, blue), (2, 0, red)):
        chroma = (pixels[..., channel] - luma) * np.float32(224 / (2 * (1 - weight)))
        # Chroma lies on the even columns and, if rows are halved, between two rows.
        before = np.concatenate([chroma[:, :1], chroma[:, 1:-1:2]], axis=1)
        chroma = (before + 2 * chroma[:, ::2] + chroma[:, 1::2]) / 4
        chroma = chroma.reshape(-1, form.rows, chroma.shape[1]).mean(axis=1)
        _fill(picture.planes[plane], (128 + chroma) * unit)
    return picture


def _fill(plane: Any, samples: NDArray[np.floating[Any]]) -> None:
    kind = np.dtype("<u2" if plane.line_size >= 2 * plane.width else "u1")
    lines = np.zeros((plane.height, plane.line_size // kind.itemsize), kind)
    lines[:, : plane.width] = np.rint(samples)
    plane.update(lines.tobytes())
