"""The clips of a timeline as plain data. Input: a timeline file. Output: an `ClipList`.

Each clip of each enabled video track counts, also nested clips, with the range of its media that
the timeline shows (`media_range`). Gaps and generators do not. OpenTimelineIO's objects stay in the
child process: a small file can crash the library, or take all time or memory.
"""

from __future__ import annotations

import dataclasses
import math
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

from palette4d.common.errors import Palette4dError, in_words
from palette4d.common.text import counted
from palette4d.media.timecode import label_of, nominal
from palette4d.shows import media_range, timeline_files
from palette4d.shows.edl_cdl import Cdl
from palette4d.shows.edl_items import NAMESPACE
from palette4d.shows.media_range import Level, Shown, own_rate, rate_of, seconds
from palette4d.shows.shots import Place

Of = TypeVar("Of")
#: The most compounds inside of each other.
DEEPEST = 64
NOTHING = Shown(Fraction(0), Fraction(0), Fraction(0))
#: The most digits of a frame number in a file's name.
MOST_DIGITS = 20


@dataclasses.dataclass(frozen=True)
class TimelineClip:
    """A clip of a timeline.

    Attributes
    ----------
    name : its name, may be "".
    place : its place in the timeline.
    url : the file, or the folder of `pattern`, as the timeline names it; "" if it names none.
    pattern : the name of the image sequence that it refers to, with one # a digit, or "".
    reel : its reel's name, or "".
    shown : the times of the media that the timeline shows, and the speed.
    rate : the media's frames per second, as the timeline counts them.
    begins, length : the start of the media in seconds, and its frames; None if the timeline does
        not say them.
    by_frames : whether the timeline's times are frames of the media, whatever its files' rate, as
        in an EDL.
    drops : whether the timecodes of an EDL leave numbers out; None if nothing says so.
    cdl : its CDL.
    start_frame : the number of the image sequence's first file.
    problem : the reason why its times or names cannot be used, or "".
    """

    name: str
    place: Place
    url: str = ""
    pattern: str = ""
    reel: str = ""
    shown: Shown = NOTHING
    rate: Fraction = Fraction(24)
    begins: Fraction | None = None
    length: int | None = None
    by_frames: bool = False
    drops: bool | None = None
    cdl: Cdl | None = None
    start_frame: int = 0
    problem: str = ""


@dataclasses.dataclass(frozen=True)
class ClipList:
    """A timeline's file, rate and clips in the order of the tracks, and notes on other items."""

    path: Path
    rate: Fraction
    clips: tuple[TimelineClip, ...]
    notes: tuple[str, ...]


def read(path: Path, rate: Fraction | None = None) -> ClipList:
    """Read an .otio, .otioz, .otiod or .edl file with exactly one timeline.

    `rate` is the rate of an EDL's timecodes, by default 24; other files state theirs.
    """
    return timeline_files.in_child(path, clips_of, path, rate)


def clips_of(path: Path, rate: Fraction | None = None) -> ClipList:
    """Return the clips of a timeline file, read in this process."""
    with timeline_files.faults_of(path):
        return _Walk(path, timeline_files.load(path, rate)).result()


class _Walk:
    """Gathers the clips of a timeline."""

    def __init__(self, path: Path, timeline: Any) -> None:
        self.otio, self.timeline, self.path = timeline_files.library(), timeline, path
        self.clips: list[TimelineClip] = []
        self.others: dict[tuple[str, str], int] = {}
        start = timeline.global_start_time
        try:
            self.rate = rate_of(start.rate) if start else _first_rate(timeline)
        except Palette4dError as error:
            raise Palette4dError(f"{path}: {error}") from None

    def result(self) -> ClipList:
        """Return all clips; `Palette4dError` if there are none."""
        schema = self.otio.schema
        for index, track in enumerate(self.timeline.tracks):
            level = Level(track, Fraction(0))
            if not isinstance(track, schema.Track):
                self.walk((level,), (index,), f"layer {index + 1}")
            elif track.kind != schema.TrackKind.Video:
                continue
            elif not track.enabled:
                self.passed_over("track is off", "tracks are off")
            else:
                self.walk((level,), (index,), track.name or f"V{index + 1}")
        notes = tuple(counted(count, *words) for words, count in self.others.items())
        if not self.clips and not len(self.timeline.tracks) and timeline_files.is_edl(self.path):
            raise Palette4dError(
                f"{self.path}: the timeline shows no clip: found no events; "
                "expected an EDL (CMX 3600) with at least one"
            )
        if not self.clips:
            raise Palette4dError(
                f"{self.path}: the timeline shows no clip: found "
                + ", ".join([counted(len(self.timeline.tracks), "track"), *notes])
                + "; expected at least one clip with media on a video track"
            )
        return ClipList(self.path, self.rate, tuple(self.clips), notes)

    def passed_over(self, single: str, several: str) -> None:
        key = (single, several)
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
        place: Fraction | str = Fraction(0)
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
            shown = media_range.shown(levels, self.rate)
            if shown is None:
                self.passed_over("clip is cut away", "clips are cut away")
                return
            place = Place(track, self.record_of(shown.record), path)
            self.clips.append(self.described(clip, place, shown))
        except MemoryError:
            raise
        except Exception as error:  # anything may come of a hostile file
            problem: str = in_words(error)
            if not isinstance(error, Palette4dError):
                problem = f"its times or names cannot be used ({problem}); mend it in the edit"
            self.clips.append(TimelineClip(clip.name, place, problem=problem))

    def described(self, clip: Any, place: Place, shown: Shown) -> TimelineClip:
        """Return a clip that shows a range of its media's time."""
        schema, reference = self.otio.schema, clip.media_reference
        numbered = isinstance(reference, schema.ImageSequenceReference)
        known = getattr(reference, "available_range", None)
        # Items beside the clip may have other rates.
        rate = own_rate(clip.trimmed_range() if known is None else known)
        if numbered and reference.rate > 0:
            rate = rate_of(reference.rate)
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
        return TimelineClip(
            name=clip.name,
            place=place,
            url=url,
            pattern=pattern,
            reel=_stated(clip, "reel", str) or "",
            shown=shown,
            rate=rate,
            begins=None if known is None else seconds(known.start_time),
            length=None if known is None else round(seconds(known.duration) * rate),
            by_frames=timeline_files.is_edl(self.path),
            drops=_stated(clip, "drop_frame", bool),
            cdl=Cdl.of_metadata(clip.metadata.get("cdl")),
            start_frame=reference.start_frame if numbered else 0,
        )

    def record_of(self, time: Fraction | None) -> str:
        """Return a time of the timeline as a timecode, else as a frame number; "" for no time."""
        if time is None:
            return ""
        opentime, start = self.otio.opentime, self.timeline.global_start_time
        count = (time + (seconds(start) if start else 0)) * self.rate
        frame = math.floor(count + media_range.ROUNDING)
        known = opentime.RationalTime.is_smpte_timecode_rate(float(self.rate))
        if not known or frame < 0:
            return f"{float(count):g}"
        drops = _stated(self.timeline, "drop_frame", bool)
        if drops is None:
            drops = self.rate.denominator == 1001 and nominal(self.rate) % 30 == 0
        return label_of(frame, self.rate, drops)


def _end(place: Fraction | str, item: Any) -> Fraction | str:
    """Return the end of an item that begins at a place; a text if it is not known."""
    if isinstance(place, str):
        return place
    try:
        return place + seconds(item.duration())
    except Exception:  # an item without any range, or times that cannot be: each type has its own
        kind = type(item).__name__.lower()
        return (
            f"its place in the edit is not known, because a {kind} before it has no length; "
            "expected one, set its source_range"
        )


def _stated(item: Any, name: str, kind: type[Of]) -> Of | None:
    """Return a member of the EDL's metadata of a clip or a timeline; None without one."""
    try:
        value = item.metadata[NAMESPACE][name]
    except (KeyError, TypeError):
        return None
    return value if isinstance(value, kind) else None


def _first_rate(timeline: Any) -> Fraction:
    """Return the rate of a timeline without a start time: the rate of its first clip."""
    for clip in timeline.find_clips():
        try:
            return rate_of(clip.trimmed_range().duration.rate)
        except Exception:  # a clip without any range
            continue
    return Fraction(24)
