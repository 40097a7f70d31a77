"""Clip reading, the first stage: image sequences and movies as numbered float32 frames.

Input: a pattern, a folder, an image or a movie file. Output: a `Clip`, which yields one frame at a
time, (h, w, 3 or 4) float32, in rising order of frame numbers. Colours and alpha are not converted
(`Clip.encoding`, `Clip.premultiplied`).
"""

from __future__ import annotations

import os
from fractions import Fraction
from pathlib import Path

from palette4d.media import clip_sequence, oiio_text
from palette4d.media.clip_base import Clip, ClipError, FrameError, Image
from palette4d.media.reading import Reading, split

__all__ = ["Clip", "ClipError", "FrameError", "Image", "open_clip"]


def open_clip(
    spec: str | os.PathLike[str],
    *,
    frames: str | None = None,
    rate: Fraction | None = None,
    skip_bad_frames: bool = False,
) -> Clip:
    """Open a clip; pixels are read later, one frame at a time.

    Parameters
    ----------
    spec : str or path
        `name.####.exr` (one # a digit), `name.%04d.exr`, `name.@@@@.exr`, `name.1-10x2#.exr`, a
        folder with one image sequence, a single image, or a movie file. It may end in how the clip
        is read: `?layer=NAME`, `?view=NAME` of EXR, `?matrix=709` (601, 2020) of a movie that
        states none; several with `&`.
    frames : str, optional
        `A-B`, `A-BxN`, single numbers or comma lists (`common.arguments.parse_frames`); the
        whole clip by default.
    rate : Fraction, optional
        Frames per second; by default the file's rate, or 24 if it has none.
    skip_bad_frames : bool
        Skip frames that are missing, unreadable or of another size; list them in `Clip.skipped`.

    Raises
    ------
    ClipError
        When there is no such clip, the range does not fit, or the format is not supported.
    Palette4dError
        When the range cannot be understood.
    FrameError
        When a frame is missing or unreadable and `skip_bad_frames` is not set.
    """
    if rate is not None and rate <= 0:
        raise ClipError(f"rate {rate}: expected frames a second above 0, such as 24 or 24000/1001")
    spec = os.fspath(spec)
    if not spec.strip():
        raise ClipError(
            "the clip's name is empty; expected a pattern such as name.####.exr, a folder (. is "
            "the working folder), an image or a movie file"
        )
    name, reading = split(spec)
    if str(reading) and not Path(spec).exists():
        clip = _opened(name, reading, frames, rate, skip_bad_frames)
        clip.source += str(reading)
        return clip
    return _opened(spec, Reading(), frames, rate, skip_bad_frames)


def _opened(
    spec: str,
    reading: Reading,
    frames: str | None,
    rate: Fraction | None,
    skip_bad_frames: bool,
) -> Clip:
    from palette4d.media import clip_images

    def images(sequence: clip_sequence.ImageSequence, embedded: str | None, single: bool) -> Clip:
        if reading.matrix is not None:
            raise ClipError(f"{spec}: found a matrix for images, expected it for movies alone")
        return clip_images.open_images(
            sequence, frames, embedded, rate, skip_bad_frames, single, reading
        )

    path = Path(oiio_text.file_name(spec))
    if path.is_dir():
        clip = clip_sequence.in_folder(path)
        if isinstance(clip, clip_sequence.ImageSequence):
            return images(clip, None, False)
        path = clip
    extension = clip_sequence.extension(path)
    if path.is_file():
        if extension in clip_sequence.IMAGE_EXTENSIONS:
            sequence, _ = clip_sequence.of_file(path)
            return images(sequence, None, True)
        if extension in clip_sequence.MOVIE_EXTENSIONS:
            from palette4d.media import clip_movie

            if (reading.layer, reading.view) != (None, None):
                raise ClipError(f"{spec}: found a layer or view for a movie, expected it for EXR")
            return clip_movie.open_movie(path, frames, rate, skip_bad_frames, reading.matrix)
        raise ClipError(
            f'{path}: found a file with the extension "{extension}", expected an image '
            f"({', '.join(sorted(clip_sequence.IMAGE_EXTENSIONS))}) or a movie "
            f"({', '.join(sorted(clip_sequence.MOVIE_EXTENSIONS))})"
        )
    if clip_sequence.Pattern.parse(path.name) is not None:
        sequence, embedded = clip_sequence.of_pattern(spec)
        return images(sequence, embedded, False)
    raise ClipError(
        f"{spec}: no such file or folder; expected a pattern such as name.####.exr, a folder with "
        "one image sequence, an image or a movie file. Check the path."
    )
