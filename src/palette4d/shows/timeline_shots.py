"""The shots of an edit. Input: an OpenTimelineIO timeline or an EDL. Output: `Shot`s.

Each clip of each enabled video track is a shot, also nested clips, with the range of its media that
the edit shows (`media_range`). Gaps and generators are no shots. Times become frame numbers as in
`media.clip`: the numbers in the names of an image sequence, and numbers from 0 in a movie.
"""

from __future__ import annotations

import dataclasses
import math
from fractions import Fraction
from pathlib import Path
from typing import Any

from palette4d.common.child import Child, ChildError
from palette4d.common.errors import Palette4dError, in_words
from palette4d.common.text import counted, file_safe
from palette4d.media.clip import Clip, open_clip
from palette4d.media.clip_base import describe
from palette4d.media.timecode import start_timecode
from palette4d.shows import find_media, media_range
from palette4d.shows.shots import Place, Shot
from palette4d.shows.timeline_files import TimelineFile, library

#: Limits for opening one clip: a long movie's time stamps are read through a slow network.
SECONDS, MEGABYTES = 300.0, 8192


@dataclasses.dataclass(frozen=True)
class Edit:
    """A timeline's content: its shots in the order of the tracks, and notes on other items."""

    name: str
    rate: Fraction
    shots: tuple[Shot, ...]
    notes: tuple[str, ...]


def shots_of(
    document: TimelineFile, folder: find_media.Folder | None = None, handles: int = 0
) -> Edit:
    """Return the shots of a timeline; `Shot.problem` says if its media is missing or unusable.

    Media is looked for in `folder`, then beside the timeline. `handles` is the number of head and
    of tail frames; there are fewer where the media ends.
    """
    otio = library()
    timeline, path = document.timeline, document.path
    with Child(SECONDS, MEGABYTES) as child:
        reader = _Reader(otio, document, folder, handles, child)
        for index, track in enumerate(timeline.tracks):
            if not isinstance(track, otio.schema.Track):
                reader.walk(track, (index,), f"layer {index + 1}")
            elif track.kind != otio.schema.TrackKind.Video:
                continue
            elif not track.enabled:
                reader.passed_over("track is off", "tracks are off")
            else:
                reader.walk(track, (index,), track.name or f"V{index + 1}")
    if not reader.shots:
        raise Palette4dError(
            f"{path}: the timeline shows no clip: found {counted(len(timeline.tracks), 'track')}"
            + "".join(f", {note}" for note in reader.notes())
            + "; expected at least one clip with media on a video track"
        )
    return Edit(
        name=file_safe(path.stem),
        rate=reader.rate,
        shots=tuple(reader.shots),
        notes=tuple(reader.notes()),
    )


class _Reader:
    """Walks a timeline and gathers its shots."""

    def __init__(
        self,
        otio: Any,
        document: TimelineFile,
        folder: find_media.Folder | None,
        handles: int,
        child: Child,
    ) -> None:
        self.child = child
        self.otio, self.timeline, self.path = otio, document.timeline, document.path
        self.folder, self.handles = folder, handles
        self.clips: dict[str, Clip] = {}
        self.shots: list[Shot] = []
        self.others: dict[tuple[str, str], int] = {}
        start = self.timeline.global_start_time
        rate = start.rate if start else _rate(self.timeline)
        self.rate = Fraction(rate).limit_denominator(1001)

    def passed_over(self, one: str, several: str) -> None:
        key = (one, several)
        self.others[key] = self.others.get(key, 0) + 1

    def notes(self) -> list[str]:
        return [counted(count, *words) for words, count in self.others.items()]

    def walk(self, parent: Any, path: tuple[int, ...], track: str) -> None:
        """Gather the shots in a track or a stack."""
        schema = self.otio.schema
        for index, item in enumerate(parent):
            here = (*path, index)
            if isinstance(item, schema.Transition):
                continue
            if isinstance(item, schema.Gap):
                self.passed_over("gap", "gaps")
            elif not item.enabled:
                self.passed_over("clip is off", "clips are off")
            elif isinstance(item, schema.Clip):
                self.clip(item, here, track)
            else:
                self.walk(item, here, track)

    def clip(self, clip: Any, path: tuple[int, ...], track: str) -> None:
        reference = clip.media_reference
        if isinstance(reference, self.otio.schema.GeneratorReference):
            self.passed_over("generated picture", "generated pictures")
            return
        place = Place(track, "", path)
        try:
            shown = media_range.shown(clip)
            if shown is None:
                self.passed_over("clip is cut away", "clips are cut away")
                return
            place = Place(track, self.record_of(shown[0]), path)
            self.shots.append(self.shot(clip, place, shown[1]))
        except (
            *(Palette4dError, self.otio.exceptions.OTIOError),
            *(OSError, ValueError, ArithmeticError),  # names and times that cannot be
            NotImplementedError,  # what OpenTimelineIO raises for a gap without a length
        ) as error:
            problem = in_words(error)
            if isinstance(error, NotImplementedError):
                problem = "a gap before it has no length, expected one; set its source_range"
            name = file_safe(clip.name or "shot")
            self.shots.append(Shot(name, "", 0, 0, (0, 0), place=place, problem=problem))

    def shot(self, clip: Any, place: Place, used: Any) -> Shot:
        """Return the shot for a clip and the time range of its media that the edit shows."""
        spec = self.found(clip)
        media = self.opened(spec)
        first, last = self.frames(clip, used, media)
        low, high = media.frames[0], media.frames[-1]
        if not low <= first <= last <= high:
            raise Palette4dError(
                f"{spec}: the edit shows frames {first} to {last}, the media has "
                f"{describe(media.frames)}; bring the whole media, or the right take"
            )
        return Shot(
            name=file_safe(clip.name or Path(spec).stem),
            clip=spec,
            first=max(low, first - self.handles),
            last=min(high, last + self.handles),
            used=(first, last),
            place=place,
        )

    def opened(self, spec: str) -> Clip:
        """Open media in the child process: hostile media must cost one shot only."""
        if spec not in self.clips:
            try:
                self.clips[spec] = self.child.call(_open, spec)
            except ChildError as error:
                raise Palette4dError(f"{spec}: the media is unusable: {error}") from error
        return self.clips[spec]

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

    def found(self, clip: Any) -> str:
        """Find a clip's media: by name in the folder, else at the timeline's path."""
        schema, reference = self.otio.schema, clip.media_reference
        names: list[str] = []
        named = ""
        if isinstance(reference, schema.ExternalReference) and reference.target_url:
            named = str(find_media.local_path(reference.target_url))
        elif isinstance(reference, schema.ImageSequenceReference):
            base = find_media.local_path(reference.target_url_base or ".")
            digits = "#" * max(1, reference.frame_zero_padding)
            named = str(base / f"{reference.name_prefix}{digits}{reference.name_suffix}")
        if named:
            names.append(named)
        reel = dict(clip.metadata.get("cmx_3600", {})).get("reel", "")
        names += [name for name in (clip.name, str(reel)) if name]
        if named and self.folder is not None and (there := self.folder.find([named])):
            return str(there)
        if named and (spec := find_media.as_clip(self.path.parent / named)) is not None:
            return spec
        if self.folder is not None and (there := self.folder.find(names)):
            return str(there)
        what = f"{named!r} is not there" if named else "the edit names no file for it"
        if self.folder is None:
            help_ = "name the folder that holds it with media=…"
        else:
            looked = " or ".join(map(repr, names)) or "its name"
            what += f", and nothing under {self.folder.path} is called {looked}"
            help_ = "bring it there, or name another folder with media=…"
        raise Palette4dError(f"the media is missing: {what}; {help_}")

    def frames(self, clip: Any, used: Any, opened: Clip) -> tuple[int, int]:
        """Return the media's first and last frame number in a range of its time."""
        if len(opened.frames) == 1 and not opened.is_movie:
            return opened.frames[0], opened.frames[0]  # a still has only one frame
        reference = clip.media_reference
        rate = self.media_rate(reference, used)
        start = Fraction(used.start_time.value).limit_denominator(10**6)
        start *= rate / Fraction(used.start_time.rate).limit_denominator(1001)
        length = Fraction(used.duration.value).limit_denominator(10**6)
        length *= rate / Fraction(used.duration.rate).limit_denominator(1001)
        rounding = Fraction(media_range.ROUNDING).limit_denominator(1000)
        first = math.floor(start + rounding)
        last = max(first, math.ceil(start + length - rounding) - 1)
        offset = self.offset(reference, opened, first, last, rate)
        return first + offset, last + offset

    def media_rate(self, reference: Any, used: Any) -> Fraction:
        """Return the media's frames per second, which convert its times to frames."""
        if isinstance(reference, self.otio.schema.ImageSequenceReference) and reference.rate > 0:
            return Fraction(reference.rate).limit_denominator(1001)
        known = getattr(reference, "available_range", None)
        time = known.start_time if known is not None else used.start_time
        return Fraction(time.rate).limit_denominator(1001)

    def offset(self, reference: Any, opened: Clip, first: int, last: int, rate: Fraction) -> int:
        """Return the offset from a frame of the media's time to the file's frame number."""
        known = getattr(reference, "available_range", None)
        begins = None
        if known is not None:
            begins = round(known.start_time.rescaled_to(float(rate)).value)
        if isinstance(reference, self.otio.schema.ImageSequenceReference):
            return int(reference.start_frame) - (begins or 0)
        low, high = opened.frames[0], opened.frames[-1]
        if not opened.is_movie and low <= first <= last <= high:
            return 0  # a sequence's numbers are the media's time
        if begins is None:
            begins = self.stated(opened, rate)
        return 0 if begins is None else low - begins

    def stated(self, opened: Clip, rate: Fraction) -> int | None:
        """Return the start timecode in a clip's files as a frame count."""
        text = self.child.call(start_timecode, opened)
        if text is None:
            return None
        try:
            return int(self.otio.opentime.from_timecode(text, float(rate)).to_frames())
        except ValueError:  # a rate that timecodes do not have
            return None


def _open(spec: str) -> Clip:
    return open_clip(spec, skip_bad_frames=True)


def _rate(timeline: Any) -> float:
    """Return the rate of a timeline without a start time: the rate of its first clip."""
    for clip in timeline.find_clips():
        try:
            return float(clip.trimmed_range().duration.rate)
        except Exception:  # a clip without any range
            continue
    return 24.0
