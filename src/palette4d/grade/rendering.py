"""Rendering: a clip's frames, recoloured by the edits of a sidecar, as frame files or a movie."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from palette4d import _core
from palette4d.common.files import make_folder
from palette4d.common.message import Arg
from palette4d.grade.document import Document
from palette4d.grade.movie_rendering import MoviePlan, rate_of
from palette4d.grade.output import Output
from palette4d.grade.unread_steps import unread_note, unread_picks
from palette4d.media import existing
from palette4d.media.array_clip import ArrayClip
from palette4d.media.clip import Clip, Image, open_clip
from palette4d.media.clip_base import F32, ClipError, FrameError, describe, named, strips
from palette4d.media.clip_images import ImageClip
from palette4d.media.codecs import is_movie
from palette4d.media.exr_copy import write_around
from palette4d.media.frame_tags import frame_notes, of_another_frame, of_colours, of_movie
from palette4d.media.frame_writer import (
    FramePattern,
    OutputError,
    check_targets,
    sample_type,
    write_frame,
)
from palette4d.media.reading import like_source
from palette4d.media.timecode import timecode_in

Compare = Literal["wipe", "side"]
#: Pixels, between 5K and 6K, above which no frame is read while another is written: a frame of 8K
#: needs 400 MB.
LARGE = 16_000_000
Missing = Literal["hold", "black", "error"]
#: x, y, width and height of the clip's picture within an image.
Place = tuple[int, int, int, int]


@dataclass(frozen=True)
class Rendered:
    """What `render` wrote.

    Attributes
    ----------
    files : list of Path
        The frames, or the movie.
    frames, skipped : list of int
        The frame numbers that were rendered, and those of bad frames.
    kept : list of int
        Those whose files were there and were kept (``skip_existing``).
    filled : list of int
        Those of bad frames that show the frame before, or black.
    notes : list of str
        Notes for the user; the first say where clip and sidecar differ.
    """

    files: list[Path]
    frames: list[int]
    skipped: list[int]
    notes: list[str]
    kept: list[int] = field(default_factory=list)
    filled: list[int] = field(default_factory=list)


def compared(source: F32, edited: F32, how: Compare) -> F32:
    """Return the source and the edit in one picture.

    "side" puts the source to the left of the edit. "wipe" has the source's left half and the edit's
    right half, with a thin white line between them.
    """
    if how == "side":
        return np.concatenate([source, edited], axis=1)
    middle, half_line = source.shape[1] // 2, max(1, source.shape[1] // 960)
    picture = np.concatenate([source[:, :middle], edited[:, middle:]], axis=1)
    picture[:, middle - half_line : middle + half_line] = 1.0
    return picture


def with_alpha(pixels: F32) -> F32:
    """Return RGBA pixels; alpha is 1 where there was none."""
    if pixels.shape[2] == 4:
        return pixels
    return np.concatenate([pixels, np.ones_like(pixels[..., :1])], axis=2)


def mismatches(document: Document, clip: Clip, whole: bool) -> list[str]:
    """Return notes on differences between a clip and the sidecar's clip, and their effect.

    `whole`: the clip was opened with all its frames, not with a range.
    """
    sidecar = document.grade.core
    notes = []
    size = f"{sidecar.clip['width']}x{sidecar.clip['height']}"
    if size != f"{clip.width}x{clip.height}":
        notes.append(
            f"the sidecar was made from {size} pixels, this clip has {clip.width}x{clip.height}; "
            "edits apply to colours, so the render goes on. Check that this is the clip you mean"
        )
    first, last = sidecar.polytope.first_frame, sidecar.polytope.last_frame
    spans = f"the sidecar spans frames {first:g} to {last:g}"
    outside = [frame for frame in clip.frames if not first <= frame <= last]
    if outside:
        notes.append(
            f"{spans}, the frames to render are {describe(clip.frames)}; {describe(outside)} "
            f"{'takes' if len(outside) == 1 else 'take'} the palette of the nearest end"
        )
    elif whole and len(clip.frames) > 1 and (first, last) != (clip.frames[0], clip.frames[-1]):
        notes.append(
            f"{spans}, this clip has {describe(clip.frames)}; each frame takes the palette of its "
            "own number. Check that this is the clip you mean"
        )
    if waiting := unread_picks(document.grade, document.history):
        notes.append(unread_note(waiting))
    return notes


@dataclass
class Painter:
    """Draws a clip's frames, and pictures for bad frames.

    `missing` says what a bad frame shows; "leave out": nothing. `filled` are the bad frames that
    show something, so far, and what.
    """

    document: Document
    clip: Clip
    drawn: Output
    compare: Compare | None = None
    space: Literal["input", "palette"] = "input"
    threads: int = 0
    missing: Missing | Literal["leave out"] = "error"
    filled: dict[int, str] = field(default_factory=dict)
    _last: tuple[Image, F32] | None = field(default=None, init=False)

    def paint(self, frame: int) -> tuple[Image, F32] | None:
        """Return a frame and its picture; None if it is bad and left out."""
        painted = self._painted(frame)
        if painted is not None or self.missing == "leave out":
            return painted
        image, pixels = self._nearest(frame)
        self.filled[frame] = _filled(self.missing, image.frame)
        if self.missing == "black":
            pixels = np.zeros_like(pixels)
        rate = rate_of(self.clip, self.document)
        metadata = of_another_frame(image.metadata, frame - image.frame, rate)
        return replace(image, frame=frame, metadata=metadata), pixels

    def _painted(self, frame: int) -> tuple[Image, F32] | None:
        """Return a good frame and its picture; None if it is bad."""
        if frame in self.clip.skipped:
            return None
        try:
            image = self.clip.load(frame)
        except FrameError:
            if self.missing == "error":
                raise
            self.clip.skip(frame)
            return None
        source = with_alpha(image.pixels) if self.drawn.in_alpha else image.pixels
        pixels = self._recoloured(source, frame, image.around.picture if image.around else None)
        if self.compare is not None:
            pixels = compared(source, pixels, self.compare)
        painted = image, pixels
        self._last = None if self.large else painted
        return painted

    def _recoloured(self, source: F32, frame: int, place: Place | None) -> F32:
        """Recolour a frame; a large one strip by strip in its own memory, where that is the same.

        A filter of picks needs the whole picture, and so does one with its palette below.
        """
        whole = self.drawn.kind == "palette" or self.compare is not None
        filtered = self.drawn.clean_up > 0 and bool(self.document.grade.picks)
        if not self.large or whole or filtered or isinstance(self.clip, ArrayClip):
            return self._drawn(source, frame, place)
        x, y, width, height = place or (0, 0, source.shape[1], source.shape[0])
        for rows in strips(*source.shape[:2]):
            beside = x, y - rows.start, width, height
            source[rows] = self._drawn(source[rows], frame, beside)
        return source

    def _drawn(self, source: F32, frame: int, place: Place | None) -> F32:
        return self.document.recolour(
            source,
            frame,
            **asdict(self.drawn),
            premultiplied=self.clip.premultiplied,
            space=self.space,
            threads=self.threads,
            picture=place,
        )

    @property
    def large(self) -> bool:
        """Whether memory holds one frame alone: not the next one, nor the one before."""
        return self.clip.width * self.clip.height > LARGE

    def _nearest(self, frame: int) -> tuple[Image, F32]:
        """Return the nearest good frame before another one; the first good one if there is none.

        It may lie outside the range that is rendered, so that each chunk shows the same.
        """
        for other in self.clip.nearest_to(frame):
            if self._last is not None and self._last[0].frame == other:
                return self._last
            if (painted := self._painted(other)) is not None:
                return painted
        raise self.clip.none_readable()


def render(
    document: str | os.PathLike[str] | Document,
    clip: str | os.PathLike[str] | Clip,
    output: str | os.PathLike[str],
    *,
    frames: str | None = None,
    compare: Compare | None = None,
    space: Literal["input", "palette"] = "input",
    half: bool = False,
    bits: int | None = None,
    codec: str | None = None,
    crf: int | None = None,
    sound: bool = True,
    threads: int = 0,
    missing: Missing = "hold",
    skip_bad_frames: bool = False,
    skip_existing: bool = False,
    force: bool = False,
    progress: Callable[[int, int], object] | None = None,
    tell: Callable[[str, str], object] | None = None,
    **picture: Any,
) -> Rendered:
    """Recolour every frame of a clip and write it; memory holds three frames, of 6K and more one.

    After Ctrl-C or an error, written frames are complete, and there is no movie.

    Parameters
    ----------
    clip : str, path or Clip
        A name for `open_clip`, or an opened clip; ``frames`` and ``skip_bad_frames`` are for names.
    output : str or path
        ``OUT.####.exr`` (``.png``, ``.tif``, ``.dpx``, ``.jpg``) for frames, which keep their
        numbers, or ``OUT.mp4``, ``OUT.mov`` for a movie at the clip's rate.
    frames : str, optional
        Only these frames: "1001-1100x2".
    compare : {"wipe", "side"}, optional
        Show the source, too: "side" to the left of the edit, "wipe" as the left half.
    space : {"input", "palette"}
        "palette": the clip's code values are already in the palette's colour space.
    half : bool
        EXR in 16-bit float.
    bits : int, optional
        Bits a sample: 8 or 16 for PNG, 8, 16 or 32 for TIFF, 10 or 16 for DPX.
    codec : str, optional
        Of a movie, one of `CODECS`. By default ProRes 422 HQ for ``.mov``. ``.mp4`` gets H.264, and
        HEVC in 10 bits for PQ and HLG.
    crf : int, optional
        Quality of H.264 and HEVC, 0 (lossless) to 51.
    sound : bool
        Copy the sound of a movie to the movie that is rendered.
    threads : int
        0: one per processor.
    missing : {"hold", "black", "error"}
        What a missing or unreadable frame shows: the frame before (of the first ones, the first
        good one), black, or an error.
    skip_bad_frames : bool
        Write no files for such frames. A movie has no frame numbers, so that it follows
        ``missing``.
    skip_existing : bool
        Keep files that are whole and name no other grade, and render only the others: a render that
        was interrupted goes on. A frame's ``Software`` and the title of a movie's video track name
        the grade.
    force : bool
        Replace files that exist. A clip's own files are never replaced.
    progress : callable, optional
        Called with (frames written, frames in all).
    tell : callable, optional
        Called as ``tell(kind, text)`` before the first frame is rendered: "warning" where clip and
        sidecar differ, else "note".
    **picture
        What to draw: ``strength``, ``show`` and so on, as for `Document.recolour`.
    """
    if not isinstance(document, Document):
        document = Document.load(document)
    drawn = Output(**picture)
    whole, output = frames is None, os.fspath(output)
    if not isinstance(clip, Clip):
        clip = like_source(os.fspath(clip), str(document.grade.core.clip["source"]))
    movie = is_movie(Path(output))
    clip, fill = opened_for_render(clip, frames, missing, skip_bad_frames, movie=movie)
    size = clip.width * (2 if compare == "side" else 1), clip.height
    todo, filled = clip.frames, dict[int, str]()
    opened: contextlib.AbstractContextManager[_Write]
    if movie:
        if half or bits is not None:
            raise OutputError(
                f"output {output}: {Arg('half', True)} and {Arg('bits')} are for frames, not for "
                "movies"
            )
        # A frame that could not be read may be whole now.
        shown = *pictures_of(clip), clip.skipped, fill
        by = made_by(document, clip, drawn, compare, space, codec, crf, sound, *shown)
        repeated = []
        if skip_existing and Path(output).exists():
            state = existing.movie(Path(output), clip.frames, by.__eq__)
            if state == "whole":
                return Rendered([Path(output)], [], [], [], kept=list(clip.frames))
            repeated = existing.again([state])
        plan = MoviePlan.of(
            clip,
            document,
            Path(output),
            size,
            alpha=clip.has_alpha or drawn.in_alpha,
            codec=codec,
            crf=crf,
            sound=sound,
            made_by=by,
        )
        check_targets([Path(output)], set(map(clip.file, clip.frames)), force or skip_existing)
        make_folder(Path(output).parent)
        notes, opened = [*repeated, *plan.notes], plan.opened()
    else:
        refuse_codec(output, codec, crf)
        pattern = FramePattern.parse(output, ", or a movie OUT.mp4 or OUT.mov")
        samples = sample_type(pattern.extension, clip.depth, half=half, bits=bits)
        one = pictures_of(clip) if pattern.width is None else ()
        by = made_by(document, clip, drawn, compare, space, samples, *one)
        todo, repeated = frames_to_render(
            clip, pattern, size, by, fill, skip_existing=skip_existing, force=force
        )
        make_folder(pattern.folder)
        clip, left_out = with_surroundings(clip, pattern, drawn, compare)
        notes = [*repeated, *frame_notes(clip, pattern.extension), *left_out]
        opened = contextlib.nullcontext(frame_files(clip, pattern, samples, by, filled))
    warnings = mismatches(document, clip, whole)
    notes = [*clip.notes, *notes]
    if tell is not None:
        for kind, texts in (("warning", warnings), ("note", notes)):
            for text in texts:
                tell(kind, text)
    painter = Painter(document, clip, drawn, compare, space, threads, fill, filled)
    written: list[Path] = []
    rendered: list[int] = []
    pending: Future[Path] | None = None

    def finish() -> None:
        if pending is not None:
            written.append(pending.result())
            if progress is not None:
                progress(len(written), len(todo))

    # One frame is written while the next is read and recoloured.
    with opened as write, ThreadPoolExecutor(1) as writer:
        for frame in todo:
            if (painted := painter.paint(frame)) is None:
                continue
            finish()
            rendered.append(frame)
            pending = writer.submit(write, *painted)
            del painted
            if painter.large:
                finish()
                pending = None
        finish()
        if todo and not rendered:
            raise clip.none_readable()
    return Rendered(
        written[:1] if movie else written,
        rendered,
        sorted(set(clip.skipped) & set(todo)),
        [*warnings, *notes],
        sorted(set(clip.frames) - set(todo)),
        list(filled),
    )


def with_surroundings(
    clip: Clip, pattern: FramePattern, drawn: Output, compare: Compare | None
) -> tuple[Clip, list[str]]:
    """Return the clip as frame files are made of it, and notes on what they do not keep.

    Overscan, further channels and parts of EXR stay in EXR, if the picture is the recoloured one.
    """
    if not isinstance(clip, ImageClip) or not (more := clip.surroundings()):
        return clip, []
    kept = pattern.extension == "exr" and drawn.kind == "recoloured" and compare is None
    if kept and clip.separable:
        return replace(clip, whole=True), []
    return clip, [f"not kept of the clip's files: {more}"]


def refuse_codec(output: str, codec: str | None, crf: int | None) -> None:
    """Refuse the options of a movie for frames."""
    if codec is not None or crf is not None:
        raise OutputError(
            f"output {output}: {Arg('codec')} and {Arg('crf')} are for movies, not for frames"
        )


def opened_for_render(
    clip: str | os.PathLike[str] | Clip,
    frames: str | None,
    missing: Missing,
    skip_bad_frames: bool,
    *,
    movie: bool,
) -> tuple[Clip, Missing | Literal["leave out"]]:
    """Open the clip of a render; return it with what a bad frame shows.

    Frames before its first or behind its last file are an error: they are no gap.
    """
    if isinstance(clip, Clip):
        if frames is not None:
            raise ClipError(
                f"found {Arg('frames')} {frames!r} beside an opened clip, expected it in open_clip"
            )
        skip_bad_frames = skip_bad_frames or clip.skip_bad_frames
    else:
        tolerant = skip_bad_frames or missing != "error"
        clip = open_clip(os.fspath(clip), frames=frames, skip_bad_frames=tolerant)
        if not skip_bad_frames and (outside := clip.outside):
            raise ClipError(
                f"{clip.source}: found no {named(outside)}, before its first or behind its last "
                "frame; choose a range inside, or leave such frames out with "
                f"{Arg('skip_bad_frames', True)}"
            )
    return clip, "leave out" if skip_bad_frames and not movie else missing


def frames_to_render(
    clip: Clip,
    pattern: FramePattern,
    size: tuple[int, int],
    by: str,
    fill: Missing | Literal["leave out"],
    *,
    skip_existing: bool,
    force: bool,
) -> tuple[list[int], list[str]]:
    """Return the frames to write, after a check of their files, and a note on those written again.

    `size` is that of the pictures, `by` what `made_by` returns, `fill` what bad frames show.
    """
    targets = dict(zip(clip.frames, pattern.paths(clip.frames), strict=True))
    there = {frame: path for frame, path in targets.items() if skip_existing and path.is_file()}

    def state_of(frame: int, path: Path) -> existing.State:
        return existing.frame(path, size, lambda text: _is_wanted(text, by, clip, frame, fill))

    states = {frame: state_of(frame, path) for frame, path in there.items()}
    todo = [frame for frame in targets if states.get(frame) != "whole"]
    inputs = set(map(clip.file, clip.frames))
    check_targets([*targets.values()], inputs, force or skip_existing)
    return todo, existing.again(list(states.values()))


def _is_wanted(
    text: str, by: str, clip: Clip, frame: int, fill: Missing | Literal["leave out"]
) -> bool:
    """Whether a frame's file with this `Software` is what a render would write."""
    bad = frame in clip.skipped
    if bad and fill == "leave out":
        return True
    if not bad and text.startswith(f"{by}, "):  # it was bad
        try:
            clip.load(frame)
        except FrameError:
            bad = True
    shown = (other for other in clip.nearest_to(frame) if other not in clip.skipped)
    return text == (f"{by}, {_filled(fill, next(shown, frame))}" if bad else by)


def _filled(fill: str, frame: int) -> str:
    """Return what a file says of a bad frame that shows another one."""
    return fill if fill == "black" else f"{fill} {frame}"


def pictures_of(clip: Clip) -> tuple[list[int], list[int]]:
    """Return what tells the pictures of a file whose name tells none: frames, and their sizes."""
    files = dict.fromkeys(map(clip.file, clip.frames))
    return list(clip.frames), [path.stat().st_size for path in files if path.is_file()]


def made_by(document: Document, clip: Clip, *how: object) -> str:
    """Return what a file says of its origin; `how` is how it was drawn and stored.

    A hash tells grades apart: their palettes, edits and colour spaces, and layers, views and
    matrices of clips, but not their names.
    """
    fields = document.fields()
    own = {n: v for n, v in fields["clip"].items() if n not in ("name", "source")}
    reading = clip.source.partition("?")[2]
    grade = own, fields["polytope"], fields["edits"], reading
    state = json.dumps([*grade, *how], default=_plain)
    digest = hashlib.sha256(state.encode()).hexdigest()
    return f"palette4d {_core.__version__}, grade {digest[:16]}"


def _plain(drawn: Output) -> dict[str, object]:
    return {n: v if isinstance(v, str) else float(v) for n, v in vars(drawn).items()}


_Write = Callable[[Image, F32], Path]


def frame_files(
    clip: Clip, pattern: FramePattern, samples: str, by: str, filled: Mapping[int, str]
) -> _Write:
    """Return a function that writes a frame to its file, with the source frame's metadata.

    `by` is what `made_by` returns; `filled` has the bad frames, and what they show.
    """

    def write(image: Image, pixels: F32) -> Path:
        metadata = image.metadata
        if clip.is_movie:
            metadata = (*metadata, *of_movie(clip, image.frame))
        else:
            kept = {name for name, _, _ in metadata}
            metadata += tuple(tag for tag in of_colours(clip) if tag[0] not in kept)
        path = pattern.path(image.frame)
        software = f"{by}, {filled[image.frame]}" if image.frame in filled else by
        if image.around is not None and isinstance(clip, ImageClip) and clip.whole:
            held = image.around.file != clip.file(image.frame)
            own = timecode_in(metadata) if held else None
            write_around(path, image.around, pixels, samples, own, software=software)
        else:
            premultiplied = clip.premultiplied
            metadata += (("Software", "string", software),)
            write_frame(path, pixels, samples, premultiplied=premultiplied, metadata=metadata)
        return path

    return write
