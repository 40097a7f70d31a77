"""The shots of a timeline. Input: the clips of a timeline. Output: `Shot`s.

Each clip gets the frames of its media that the timeline shows, numbered as in `media.clip`: the
numbers in the names of an image sequence, and numbers from 0 in a movie.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import re
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Literal

from palette4d import _core
from palette4d.common.child import Child, ChildError
from palette4d.common.errors import Arg, Palette4dError, in_words
from palette4d.common.files import names_a_server
from palette4d.common.text import file_safe
from palette4d.media import clip_sequence
from palette4d.media.clip import Clip, open_clip
from palette4d.media.clip_base import describe
from palette4d.media.clip_files import files_of
from palette4d.media.timecode import (
    day_of,
    drops_numbers,
    frames_of,
    label_of,
    nearest,
    nominal,
    start_timecode,
)
from palette4d.shows import find_media
from palette4d.shows.shots import Shot
from palette4d.shows.timeline_clips import ClipList, TimelineClip

#: Limits for opening one clip: a long movie's time stamps are read through a slow network.
SECONDS, MEGABYTES = 300.0, 8192


@dataclasses.dataclass(frozen=True)
class Media:
    """A clip's first and last frame, all of them in words, and whether it is a movie, or a still.

    `rate` is for movies: images rarely state theirs. An opened clip may hold a million
    numbers, and a timeline thousands of clips.
    """

    first: int
    last: int
    frames: str
    is_movie: bool
    is_still: bool
    rate: Fraction

    @property
    def count(self) -> int:
        """How many frames there are from the first to the last."""
        return self.last - self.first + 1


Conform = Literal["by-rates", "frame-for-frame"]


def shots_of(
    timeline: ClipList,
    folder: find_media.Folder | None = None,
    handles: int = 0,
    conform: Conform | None = None,
) -> tuple[list[Shot], list[str]]:
    """Return the shots of a timeline, and notes on how they were counted.

    `Shot.problem` says if the media is missing or unusable.

    Media is looked for in `folder`, then beside the timeline. `handles` is the number of head and
    of tail frames; there are fewer where the media ends. `conform` says how the timeline plays
    movies of another rate; see `_Finder.counted`.
    """
    finder = _Finder(timeline.path, folder, handles, conform)
    with Child(SECONDS, MEGABYTES, finder.files(timeline.clips)) as finder.child:
        shots = [finder.shot(clip) for clip in timeline.clips]
        return shots, list(dict.fromkeys(finder.notes))


class _Finder:
    """Finds the media of clips, and their frames in it."""

    child: Child

    def __init__(
        self,
        path: Path,
        folder: find_media.Folder | None,
        handles: int,
        conform: Conform | None,
    ) -> None:
        self.path, self.folder, self.handles = path, folder, handles
        self.conform = conform
        self.specs: dict[int, str] = {}
        self.media: dict[str, Media | str] = {}
        self.timecodes: dict[str, str | None] = {}
        self.notes: list[str] = []

    def files(self, clips: Iterable[TimelineClip]) -> Iterator[Path]:
        """Yield what must be read to open the media of clips."""
        for clip in clips:
            with contextlib.suppress(Palette4dError, OSError, ValueError):  # `shot` says so
                self.specs[id(clip)] = self.found(clip)
        for spec in dict.fromkeys(self.specs.values()):
            yield from files_of(spec)

    def shot(self, clip: TimelineClip) -> Shot:
        """Return the shot for a clip."""
        problem = clip.problem
        if not problem:
            try:
                return self.found_shot(clip)
            except (Palette4dError, OSError, ValueError) as error:  # names that cannot be
                problem = in_words(error)
        name = _name(clip.name or "shot")
        return Shot(name, "", 0, 0, (0, 0), place=clip.place, problem=problem)

    def found_shot(self, clip: TimelineClip) -> Shot:
        """Return the shot for a clip whose media is there."""
        spec = self.specs.get(id(clip)) or self.found(clip)
        media = self.opened(spec)
        first, last = self.frames(clip, spec, media)
        if not media.first <= first <= last <= media.last:
            raise Palette4dError(
                f"{spec}: the edit shows frames {first} to {last}, the media has {media.frames}; "
                "bring the whole media, or the right take"
            )
        return Shot(
            name=_name(clip.name or Path(spec).name),
            clip=spec,
            first=max(media.first, first - self.handles),
            last=min(media.last, last + self.handles),
            used=(first, last),
            place=clip.place,
            speed=clip.shown.speed,
            cdl=clip.cdl,
        )

    def opened(self, spec: str) -> Media:
        """Open media in the child process, once: hostile media must cost one shot only."""
        if spec not in self.media:
            try:
                self.media[spec] = self.child.call(_media, spec)
            except ChildError as error:
                self.media[spec] = f"{spec}: the media is unusable: {error}"
            except Palette4dError as error:
                self.media[spec] = str(error)
        media = self.media[spec]
        if isinstance(media, str):
            raise Palette4dError(media)
        return media

    def found(self, clip: TimelineClip) -> str:
        """Find a clip's media: by name in the folder, else at the timeline's path."""
        names: list[str] = []
        named = ""
        if clip.url:
            named = str(find_media.local_path(clip.url) / clip.pattern)
            names.append(named)
        names += [name for name in (clip.name, clip.reel) if name]
        if named and self.folder is not None and (there := self.folder.find([named])):
            return str(there)
        if find_media.is_elsewhere(clip.url or "") or names_a_server(named, self.path):
            raise Palette4dError(
                f"found the media {clip.url!r} of another computer, expected a file of this one; "
                f"relink it, or name the folder that holds it with {Arg('media')}"
            )
        if named and (spec := find_media.as_clip(self.path.parent / named)) is not None:
            return spec
        if self.folder is not None and (there := self.folder.find(names)):
            return str(there)
        what = f"{_in_quotes(named)} is not there" if named else "the edit names no file for it"
        if self.folder is None:
            help_ = f"name the folder that holds it with {Arg('media')}"
        else:
            looked = " or ".join(map(_in_quotes, names)) or "its name"
            what += f", and nothing under {self.folder.path} is called {looked}"
            help_ = f"bring it there, or name another folder with {Arg('media')}"
        raise Palette4dError(f"the media is missing: {what}; {help_}")

    def frames(self, clip: TimelineClip, spec: str, media: Media) -> tuple[int, int]:
        """Return the first and last frame of the media that are shown, as the files count."""
        if media.is_still:
            return media.first, media.first
        rate = self.counted(clip, spec, media)
        first, last = clip.shown.frames(rate)
        offset = self.offset(clip, spec, media, rate, (first, last))
        return first + offset, last + offset

    def counted(self, clip: TimelineClip, spec: str, media: Media) -> Fraction:
        """Return the rate at which a clip's frames count: the timeline's, or the movie's own.

        23.976 and 24 count alike. A timeline that has another rate for all of the movie's frames
        plays them frame for frame; else its times are seconds. Timecodes of an EDL count frames of
        the movie, or pairs of them (SMPTE ST 12-1) and so on, which are seconds, too.
        """
        if not media.is_movie or nominal(clip.rate) == nominal(media.rate):
            return clip.rate
        if not clip.by_frames:
            by_rates = clip.length != media.count
        else:
            by_rates = nominal(media.rate) % nominal(clip.rate) == 0
        if self.conform is not None:
            by_rates = self.conform == "by-rates"
        elif clip.by_frames:
            other = "frame-for-frame" if by_rates else "by-rates"
            self.notes.append(
                f"{spec} plays {float(media.rate):.6g} frames per second, the EDL's timecodes "
                f"count {float(clip.rate):.6g}: they are taken as "
                f"{'seconds' if by_rates else 'frames'} of the media. Check the shot; "
                f"{Arg('conform', other)} takes them as {'frames' if by_rates else 'seconds'}"
            )
        return media.rate if by_rates else clip.rate

    def offset(
        self, clip: TimelineClip, spec: str, media: Media, rate: Fraction, shown: tuple[int, int]
    ) -> int:
        """Return the offset from a frame of the media's time to the file's frame number."""
        begins = None if clip.begins is None else round(clip.begins * rate)
        if clip.pattern:
            return clip.start_frame - (begins or 0)
        if not media.is_movie and media.first <= shown[0] <= shown[1] <= media.last:
            return 0  # a sequence's numbers are the media's time
        if begins is not None:
            return media.first - begins
        text = self.stated(spec)
        if text is None:
            return 0
        begins = frames_of(text, rate)
        if begins is None:
            raise Palette4dError(
                f"{spec}: it begins at the timecode {text}, which {float(rate):.6g} frames per "
                f"second do not have; check the edit's rate, or {Arg('conform')}"
            )
        drops = drops_numbers(text, rate)
        first = shown[0]
        if clip.drops is not None and clip.drops != drops:
            first = self.renumbered(clip, spec, rate, first, drops)
        if not 0 <= first - begins < media.count:  # past midnight
            first = nearest(first, begins, day_of(rate, drops))
        return media.first - begins + first - shown[0]

    def renumbered(
        self, clip: TimelineClip, spec: str, rate: Fraction, frame: int, drops: bool
    ) -> int:
        """Count the timecode of an EDL's event as its media's timecodes count."""
        label = label_of(frame, rate, bool(clip.drops))
        found = frames_of(label.replace(";", ":"), rate, drops)
        how = "leave numbers out" if drops else "leave no numbers out"
        if found is None:
            raise Palette4dError(
                f"{spec}: found the source timecode {label}, which the media does not have: its "
                f"timecodes {how} (drop-frame); mend FCM in the EDL"
            )
        self.notes.append(
            f"{spec}: its timecodes {how}, those of the EDL differ; events are found by the "
            "timecode that they state"
        )
        return found

    def stated(self, spec: str) -> str | None:
        """Return the start timecode in a clip's files."""
        if spec not in self.timecodes:
            self.timecodes[spec] = self.child.call(_timecode, spec)
        return self.timecodes[spec]


def _in_quotes(name: str) -> str:
    r"""Return a name with its special characters told, and Windows' backslashes as they are."""
    return repr(name).replace(r"\\", "\\")


def _name(clip: str) -> str:
    """Return the name of a clip's shot, which the node finds by its media: without an extension.

    Some programs name the whole path.

    The text after the last dot of a clip's name need not be an extension.
    """
    known = clip_sequence.MOVIE_EXTENSIONS | clip_sequence.IMAGE_EXTENSIONS | find_media.CAMERA
    if clip_sequence.extension(clip) not in known:
        return file_safe(clip)
    return file_safe(_core.clip_name(re.split(r"[\\/]", clip)[-1]))


def _media(spec: str) -> Media:
    clip = _opened(spec)
    first, last = clip.frames[0], clip.frames[-1]
    still = len(clip.frames) == 1 and not clip.is_movie
    return Media(first, last, describe(clip.frames), clip.is_movie, still, clip.rate)


def _timecode(spec: str) -> str | None:
    return start_timecode(_opened(spec))


@functools.lru_cache(maxsize=1)
def _opened(spec: str) -> Clip:
    return open_clip(spec, skip_bad_frames=True)
