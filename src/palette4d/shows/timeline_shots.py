"""The shots of an edit. Input: the clips of a timeline. Output: `Shot`s.

Each clip gets the frames of its media that the edit shows, numbered as in `media.clip`: the numbers
in the names of an image sequence, and numbers from 0 in a movie.
"""

from __future__ import annotations

import dataclasses
import functools
from fractions import Fraction
from pathlib import Path

from palette4d.common.child import Child, ChildError
from palette4d.common.errors import Palette4dError, in_words
from palette4d.common.text import file_safe
from palette4d.media.clip import Clip, open_clip
from palette4d.media.clip_base import describe
from palette4d.media.timecode import start_timecode
from palette4d.shows import find_media
from palette4d.shows.shots import Shot
from palette4d.shows.timeline_clips import EditClip, EditList
from palette4d.shows.timeline_files import library

#: Limits for opening one clip: a long movie's time stamps are read through a slow network.
SECONDS, MEGABYTES = 300.0, 8192


@dataclasses.dataclass(frozen=True)
class Media:
    """A clip's first and last frame, all of them in words, and whether it is a movie, or a still.

    An opened clip may hold a million numbers, and an edit thousands of clips.
    """

    first: int
    last: int
    frames: str
    is_movie: bool
    is_still: bool


def shots_of(
    edit: EditList, folder: find_media.Folder | None = None, handles: int = 0
) -> list[Shot]:
    """Return the shots of an edit; `Shot.problem` says if its media is missing or unusable.

    Media is looked for in `folder`, then beside the timeline. `handles` is the number of head and
    of tail frames; there are fewer where the media ends.
    """
    with Child(SECONDS, MEGABYTES) as child:
        finder = _Finder(edit.path, folder, handles, child)
        return [finder.shot(clip) for clip in edit.clips]


class _Finder:
    """Finds the media of clips, and their frames in it."""

    def __init__(
        self, path: Path, folder: find_media.Folder | None, handles: int, child: Child
    ) -> None:
        self.path, self.folder, self.handles, self.child = path, folder, handles, child
        self.media: dict[str, Media | str] = {}
        self.timecodes: dict[str, str | None] = {}

    def shot(self, clip: EditClip) -> Shot:
        """Return the shot for a clip."""
        problem = clip.problem
        if not problem:
            try:
                return self.found_shot(clip)
            except (Palette4dError, OSError, ValueError) as error:  # names that cannot be
                problem = in_words(error)
        name = file_safe(clip.name or "shot")
        return Shot(name, "", 0, 0, (0, 0), place=clip.place, problem=problem)

    def found_shot(self, clip: EditClip) -> Shot:
        """Return the shot for a clip whose media is there."""
        spec = self.found(clip)
        media = self.opened(spec)
        first, last = self.frames(clip, spec, media)
        if not media.first <= first <= last <= media.last:
            raise Palette4dError(
                f"{spec}: the edit shows frames {first} to {last}, the media has {media.frames}; "
                "bring the whole media, or the right take"
            )
        return Shot(
            name=file_safe(clip.name or Path(spec).stem),
            clip=spec,
            first=max(media.first, first - self.handles),
            last=min(media.last, last + self.handles),
            used=(first, last),
            place=clip.place,
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
        found = self.media[spec]
        if isinstance(found, str):
            raise Palette4dError(found)
        return found

    def found(self, clip: EditClip) -> str:
        """Find a clip's media: by name in the folder, else at the timeline's path."""
        names: list[str] = []
        named = ""
        if clip.url:
            named = str(find_media.local_path(clip.url) / clip.pattern)
            names.append(named)
        names += [name for name in (clip.name, clip.reel) if name]
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

    def frames(self, clip: EditClip, spec: str, media: Media) -> tuple[int, int]:
        """Return the first and last frame of the media that the edit shows, as the files count."""
        if media.is_still:
            return media.first, media.first
        offset = self.offset(clip, spec, media)
        return clip.first + offset, clip.last + offset

    def offset(self, clip: EditClip, spec: str, media: Media) -> int:
        """Return the offset from a frame of the media's time to the file's frame number."""
        if clip.pattern:
            return clip.start_frame - (clip.begins or 0)
        if not media.is_movie and media.first <= clip.first <= clip.last <= media.last:
            return 0  # a sequence's numbers are the media's time
        begins = self.stated(spec, clip.rate) if clip.begins is None else clip.begins
        return 0 if begins is None else media.first - begins

    def stated(self, spec: str, rate: Fraction) -> int | None:
        """Return the start timecode in a clip's files as a frame count."""
        if spec not in self.timecodes:
            self.timecodes[spec] = self.child.call(_timecode, spec)
        text = self.timecodes[spec]
        if text is None:
            return None
        try:
            return int(library().opentime.from_timecode(text, float(rate)).to_frames())
        except ValueError:  # a rate that timecodes do not have
            return None


def _media(spec: str) -> Media:
    clip = _opened(spec)
    first, last = clip.frames[0], clip.frames[-1]
    still = len(clip.frames) == 1 and not clip.is_movie
    return Media(first, last, describe(clip.frames), clip.is_movie, still)


def _timecode(spec: str) -> str | None:
    return start_timecode(_opened(spec))


@functools.lru_cache(maxsize=1)
def _opened(spec: str) -> Clip:
    return open_clip(spec, skip_bad_frames=True)
