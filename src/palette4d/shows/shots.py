"""Shots: ranges of media with a name and the frames to analyse. Each shot gets one palette.

Input: a clip with cuts; for edits see `timeline`. Output: `Shot`s, which `batch` analyses.
"""

from __future__ import annotations

import bisect
import dataclasses
import itertools
import re
from collections.abc import Callable, Iterator, Sequence

from palette4d.analysis import colour_statistics
from palette4d.analysis.options import AnalysisOptions
from palette4d.common.errors import Palette4dError
from palette4d.common.text import file_safe
from palette4d.media import cuts
from palette4d.media.clip_base import Clip, even_step, hidden
from palette4d.shows.edl_cdl import Cdl

#: Largest number of colours per frame in the search for cuts.
BINS = 4096
#: The most former shots of one name, of those that share frames, that a shot is compared with.
MOST_ALIKE = 1000
#: What `numbered` adds to a name.
_SUFFIX = re.compile(r"_f-?\d+(_\d+)?$")


@dataclasses.dataclass(frozen=True)
class Place:
    """The place of a shot in a timeline.

    Attributes
    ----------
    track : the name of the video track.
    record : its start in the timeline: a timecode or a frame number.
    path : the clip's place in the timeline: indices of children, from the timeline's stack down.
    """

    track: str
    record: str
    path: tuple[int, ...]


@dataclasses.dataclass(frozen=True)
class Shot:
    """A range of one clip's frames that gets a palette.

    Attributes
    ----------
    name : the name of the sidecar, the look and the files; unique, also without regard to case.
    clip : the name for `open_clip`; "" if the media is missing.
    first, last : the first and last frame of the analysis, with head and tail frames; the clip's
        own numbers.
    used : (int, int); the first and the last frame that the timeline shows.
    step : the distance between frames.
    place : the place in the timeline.
    problem : the reason why it cannot be analysed, or "".
    speed : multiple of the media's own speed; negative backwards, 0 for a freeze frame.
    cdl : the CDL that the timeline states for it.
    """

    name: str
    clip: str
    first: int
    last: int
    used: tuple[int, int]
    step: int = 1
    place: Place | None = None
    problem: str = ""
    speed: float = 1.0
    cdl: Cdl | None = None

    @property
    def frames(self) -> str:
        """The frame range for `open_clip`."""
        return f"{self.first}-{self.last}" + (f"x{self.step}" if self.step != 1 else "")

    @property
    def count(self) -> int:
        """The number of analysed frames."""
        return (self.last - self.first) // self.step + 1


def words_of_speed(speed: float) -> str:
    """Return how a timeline plays a shot.

    >>> words_of_speed(-1), words_of_speed(1.5), words_of_speed(-2), words_of_speed(0)
    ('backwards', '1.5 x', '2 x backwards', 'freeze frame')
    """
    if speed == 0:
        return "freeze frame"
    words = [f"{abs(speed):.4g} x"] if abs(speed) != 1 else []
    return " ".join(words + ["backwards"] * (speed < 0))


def numbered(
    shots: Sequence[Shot], former: Sequence[Shot] = (), clips: Sequence[str] = ()
) -> tuple[list[Shot], list[str]]:
    """Return the shots with unique names, and the names that changed.

    If several shots have one name, the first keeps it. The others get their first frame as a
    suffix: `A`, `A_f120`. `former` are the shots of an earlier run, and `clips` the clips of
    `shots` as these state them: a shot of the same frames, or else of most of them, keeps its name
    wherever it stands now; of several media, a shot of the same one goes first.
    """
    names = _kept_names(shots, former, clips or [shot.clip for shot in shots])
    taken = {name.casefold() for name in names.values()}
    numbers: dict[str, Iterator[int]] = {}
    for i, shot in enumerate(shots):
        if i in names:
            continue
        name = shot.name
        if name.casefold() in taken:
            name = begin = f"{shot.name}_f{shot.used[0]}"
            again = numbers.setdefault(begin.casefold(), itertools.count(2))
            while name.casefold() in taken:
                name = f"{begin}_{next(again)}"
        taken.add(name.casefold())
        names[i] = name
    out = [dataclasses.replace(shot, name=names[i]) for i, shot in enumerate(shots)]
    return out, [now.name for now, shot in zip(out, shots, strict=True) if now.name != shot.name]


def _first(shot: Shot) -> int:
    return shot.used[0]


def _kept_names(
    shots: Sequence[Shot], former: Sequence[Shot], clips: Sequence[str]
) -> dict[int, str]:
    """Return the former names of shots by their places in the list."""
    alike: dict[str, list[Shot]] = {}  # by their first frames
    same: dict[tuple[str, str, tuple[int, int]], list[Shot]] = {}
    for shot in reversed(former):
        for own in {shot.name.casefold(), _SUFFIX.sub("", shot.name.casefold())}:
            alike.setdefault(own, []).append(shot)
            same.setdefault((own, shot.clip, shot.used), []).append(shot)
    for others in alike.values():
        others.sort(key=_first)
    longest = max((shot.used[1] - shot.used[0] for shot in former), default=0)
    kept: dict[int, str] = {}
    taken: set[str] = set()

    def keep(i: int, name: str) -> None:
        if i not in kept and name not in taken:
            kept[i] = name
            taken.add(name)

    for i, shot in enumerate(shots):
        whole = same.get((shot.name.casefold(), clips[i], shot.used), [])
        while whole and i not in kept:
            keep(i, whole.pop().name)
    pairs = []
    for i, shot in enumerate(shots):
        others = [] if i in kept else alike.get(shot.name.casefold(), [])
        begin = bisect.bisect_left(others, shot.used[0] - longest, key=_first)
        end = bisect.bisect_right(others, shot.used[1], key=_first)
        for other in others[begin : min(end, begin + MOST_ALIKE)]:
            first, last = max(shot.used[0], other.used[0]), min(shot.used[1], other.used[1])
            if first <= last:
                pairs.append((other.clip != clips[i], first - last, i, other.name))
    for _, _, i, name in sorted(pairs):
        keep(i, name)
    return kept


def detect(clip: Clip, progress: Callable[[int, int], object] | None = None) -> list[Shot]:
    """Split a clip at its cuts.

    Returns
    -------
    list of Shot
        In order of time, without gaps; one shot for a clip without cuts. The names are NAME_s001
        and so on.
    """
    step = even_step(clip.frames)
    if not step:
        raise Palette4dError(
            f"{clip.source}: the frames are not evenly spaced; expected a range such as 1-10 or "
            "1-10x3"
        )
    starts = cuts_of(clip, progress)
    bounds = [clip.frames[0], *starts, clip.frames[-1] + step]
    digits = max(3, len(str(len(bounds) - 1)))
    shots = []
    for i, (first, end) in enumerate(itertools.pairwise(bounds), start=1):
        shots.append(
            Shot(
                name=f"{file_safe(clip.name)}_s{i:0{digits}d}",
                clip=clip.source,
                first=first,
                last=end - step,
                used=(first, end - step),
                step=step,
            )
        )
    return shots


def cuts_of(clip: Clip, progress: Callable[[int, int], object] | None = None) -> list[int]:
    """Return the frames that begin a new shot; memory holds one histogram per frame."""
    tell = progress or (lambda done, total: None)
    options = AnalysisOptions(colours=BINS, coarse_colours=BINS)

    def histograms() -> Iterator[tuple[int, cuts.F64, bool]]:
        for done, image in enumerate(clip.iter_images(), start=1):
            tell(done, len(clip.frames))
            statistics = colour_statistics.gather(
                image.frame, clip.straight_colours(image.pixels), options
            )
            if statistics is not None:
                yield image.frame, statistics.histogram, hidden(image.pixels)

    frames = histograms()
    shown: list[tuple[int, cuts.F64]] = []  # the first frame with a visible pixel

    def before() -> Iterator[tuple[int, cuts.F64]]:
        for number, histogram, is_hidden in frames:
            if not is_hidden:
                shown.append((number, histogram))
                return
            yield number, histogram

    starts = cuts.find_cuts(before())
    if not shown:  # alpha is not used
        return starts
    rest = ((number, histogram) for number, histogram, is_hidden in frames if not is_hidden)
    return cuts.find_cuts(itertools.chain(shown, rest))


def trimmed(shot: Shot, clip: Clip) -> Shot:
    """Return a shot of a timeline with its head and tail frames cut off at the media's cuts.

    `clip` is its media, over the shot's frames. A cut inside the frames that the timeline shows is
    refused.
    """
    starts = cuts_of(clip)
    first, last = shot.used
    if inside := [cut for cut in starts if first < cut <= last]:
        raise Palette4dError(cuts.refusal_inside(inside))
    return dataclasses.replace(
        shot,
        first=max([shot.first, *(cut for cut in starts if cut <= first)]),
        last=min([shot.last, *(cut - shot.step for cut in starts if cut > last)]),
    )
