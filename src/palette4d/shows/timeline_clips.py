"""The clips of an edit as plain data. Input: a timeline file. Output: an `EditList`.

Each clip of each enabled video track counts, also nested clips, with the range of its media that
the edit shows (`media_range`). Gaps and generators do not. OpenTimelineIO's objects stay in the
child process: a small file can crash the library, or take all time or memory.
"""

from __future__ import annotations

import dataclasses
import math
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d.common.errors import Palette4dError, in_words
from palette4d.common.text import counted
from palette4d.shows import media_range, timeline_files
from palette4d.shows.media_range import Level
from palette4d.shows.shots import Place

#: The most compounds inside of each other.
DEEPEST = 64
#: The most digits of a frame number in a file's name.
MOST_DIGITS = 20


@dataclasses.dataclass(frozen=True)
class EditClip:
    """A clip of an edit.

    Attributes
    ----------
    name : its name, may be "".
    place : its place in the edit.
    url : the file, or the folder of `pattern`, as the edit names it; "" if it names none.
    pattern : the name of the image sequence that it refers to, with one # a digit, or "".
    reel : its reel's name, or "".
    first, last : the frames that the edit shows, counted in the media's time at `rate`.
    rate : the media's frames per second.
    begins : the first frame of the media, counted likewise; None if the edit does not say it.
    start_frame : the number of the image sequence's first file.
    problem : the reason why its times or names cannot be used, or "".
    """

    name: str
    place: Place
    url: str = ""
    pattern: str = ""
    reel: str = ""
    first: int = 0
    last: int = 0
    rate: Fraction = Fraction(24)
    begins: int | None = None
    start_frame: int = 0
    problem: str = ""


@dataclasses.dataclass(frozen=True)
class EditList:
    """A timeline's file, rate and clips in the order of the tracks, and notes on other items."""

    path: Path
    rate: Fraction
    clips: tuple[EditClip, ...]
    notes: tuple[str, ...]


def read(path: Path, rate: Fraction | None = None) -> EditList:
    """Read an .otio, .otioz, .otiod or .edl file with exactly one timeline.

    `rate` is that of an EDL's timecodes, by default 24; other files state their rate.
    """
    return timeline_files.in_child(path, clips_of, path, rate)


def clips_of(path: Path, rate: Fraction | None = None) -> EditList:
    """Return the clips of a timeline file, read in this process."""
    with timeline_files.faults_of(path):
        return _Walk(path, timeline_files.load(path, rate)).result()


class _Walk:
    """Gathers the clips of a timeline."""

    def __init__(self, path: Path, timeline: Any) -> None:
        self.otio, self.timeline, self.path = timeline_files.library(), timeline, path
        self.clips: list[EditClip] = []
        self.others: dict[tuple[str, str], int] = {}
        start = timeline.global_start_time
        try:
            self.rate = _rate(start.rate if start else _first_rate(timeline))
        except Palette4dError as error:
            raise Palette4dError(f"{path}: {error}") from None

    def result(self) -> EditList:
        """Return all clips; `Palette4dError` if there are none."""
        schema = self.otio.schema
        for index, track in enumerate(self.timeline.tracks):
            level = Level(track, None)
            if not isinstance(track, schema.Track):
                self.walk((level,), (index,), f"layer {index + 1}")
            elif track.kind != schema.TrackKind.Video:
                continue
            elif not track.enabled:
                self.passed_over("track is off", "tracks are off")
            else:
                self.walk((level,), (index,), track.name or f"V{index + 1}")
        notes = tuple(counted(count, *words) for words, count in self.others.items())
        if not self.clips:
            raise Palette4dError(
                f"{self.path}: the timeline shows no clip: found "
                + ", ".join([counted(len(self.timeline.tracks), "track"), *notes])
                + "; expected at least one clip with media on a video track"
            )
        return EditList(self.path, self.rate, tuple(self.clips), notes)

    def passed_over(self, one: str, several: str) -> None:
        key = (one, several)
        self.others[key] = self.others.get(key, 0) + 1

    def walk(self, levels: tuple[Level, ...], path: tuple[int, ...], track: str) -> None:
        """Gather the clips in a track or a stack; `levels` begins with it, its parents follow."""
        if len(levels) > DEEPEST:
            raise Palette4dError(
                f"{self.path}: found compounds nested deeper than {DEEPEST}, expected fewer; "
                "flatten them in the edit"
            )
        schema, parent = self.otio.schema, levels[0].item
        # Summed here: OpenTimelineIO would add all items before each clip anew.
        place: Any = None
        for index, item in enumerate(parent):
            here = (*path, index)
            if isinstance(item, schema.Transition):
                continue
            inner = (Level(item, place), *levels)
            if isinstance(item, schema.Gap):
                self.passed_over("gap", "gaps")
            elif not item.enabled:
                self.passed_over("clip is off", "clips are off")
            elif isinstance(item, schema.Clip):
                self.clip(inner, here, track)
            else:
                self.walk(inner, here, track)
            if isinstance(parent, schema.Track):
                place = _end(place, item)

    def clip(self, levels: tuple[Level, ...], path: tuple[int, ...], track: str) -> None:
        clip = levels[0].item
        reference = clip.media_reference
        if isinstance(reference, self.otio.schema.GeneratorReference):
            self.passed_over("generated picture", "generated pictures")
            return
        place = Place(track, "", path)
        try:
            shown = media_range.shown(levels)
            if shown is None:
                self.passed_over("clip is cut away", "clips are cut away")
                return
            place = Place(track, self.record_of(shown[0]), path)
            self.clips.append(self.described(clip, place, shown[1]))
        except MemoryError:
            raise
        except Exception as error:  # anything may come of a hostile file
            problem = in_words(error)
            if not isinstance(error, Palette4dError):
                problem = f"its times or names cannot be used ({problem}); mend it in the edit"
            self.clips.append(EditClip(clip.name, place, problem=problem))

    def described(self, clip: Any, place: Place, used: Any) -> EditClip:
        """Return a clip that shows a range of its media's time."""
        schema, reference = self.otio.schema, clip.media_reference
        numbered = isinstance(reference, schema.ImageSequenceReference)
        known = getattr(reference, "available_range", None)
        start = known.start_time if known is not None else used.start_time
        rate = _rate(reference.rate if numbered and reference.rate > 0 else start.rate)
        first, last = media_range.frames(used, rate)
        url = pattern = ""
        if isinstance(reference, schema.ExternalReference):
            url = reference.target_url or ""
        elif numbered:
            digits = max(1, reference.frame_zero_padding)
            if digits > MOST_DIGITS:
                raise Palette4dError(
                    f"its files' numbers have {digits} digits, expected at most {MOST_DIGITS}; "
                    "mend frame_zero_padding in the edit"
                )
            url = reference.target_url_base or "."
            pattern = f"{reference.name_prefix}{'#' * digits}{reference.name_suffix}"
        return EditClip(
            name=clip.name,
            place=place,
            url=url,
            pattern=pattern,
            reel=_reel(clip),
            first=first,
            last=last,
            rate=rate,
            begins=None if known is None else round(start.rescaled_to(float(rate)).value),
            start_frame=reference.start_frame if numbered else 0,
        )

    def record_of(self, time: Any) -> str:
        """Return a time of the timeline as a timecode, else as a frame number."""
        opentime = self.otio.opentime
        start = self.timeline.global_start_time
        rate = float(self.rate)
        at = time.rescaled_to(rate)
        if start is not None:
            at += start.rescaled_to(rate)
        try:
            return str(opentime.to_timecode(at, rate))
        except ValueError:  # a rate that timecodes do not have, or before 0
            return f"{at.value:g}"


def _end(place: Any, item: Any) -> Any:
    """Return the end of a track's item that begins at a place; a text if there is no such time."""
    if isinstance(place, str):
        return place
    try:
        duration = item.duration()
    except Exception:  # an item without any range, or times that cannot be: each type has its own
        kind = type(item).__name__.lower()
        return f"a {kind} before it has no length, expected one; set its source_range"
    return duration if place is None else place + duration


def _reel(clip: Any) -> str:
    try:
        reel = clip.metadata["cmx_3600"]["reel"]
    except (KeyError, TypeError):
        return ""
    return reel if isinstance(reel, str) else ""


def _rate(rate: float) -> Fraction:
    found = Fraction(rate).limit_denominator(1001) if math.isfinite(rate) else Fraction(0)
    if found <= 0:
        raise Palette4dError(
            f"found the rate {rate:g}, expected frames per second above 0; mend it in the edit"
        )
    return found


def _first_rate(timeline: Any) -> float:
    """Return the rate of a timeline without a start time: the rate of its first clip."""
    for clip in timeline.find_clips():
        try:
            rate = float(clip.trimmed_range().duration.rate)
            _rate(rate)
        except Exception:  # a clip without any range
            continue
        return rate
    return 24.0
